//! Where in the buffers of a shader a load reads, by name, and what the scene states is there.

use super::pointer;
use crate::Facts;
use crate::flow::{Flow, Value};
use naga::{AddressSpace, ArraySize, Expression, StorageAccess, TypeInner};

/// How many elements behind indices that vary are compared with each other.
const MOST: usize = 4096;

/// A number, vector, matrix, or a column or component of one, in a buffer that the shader does not write.
pub(crate) struct Place {
    /// `lighting.lights[*].colour`: `[*]` stands for an index that varies. A column of a matrix and a component of a vector
    /// read `[1]` too.
    pub(super) path: String,
    /// The path of the whole number, vector or matrix, in the pieces that varying indices part it into.
    pieces: Vec<String>,
    /// For each of these indices, how many elements there are.
    counts: Vec<u32>,
    /// The words of the whole that it reads: the first one, and how many.
    part: (usize, usize),
}

impl Place {
    /// The place that a value loads, when it loads one.
    pub(crate) fn loaded(flow: &Flow, value: Value) -> Option<Self> {
        let mut indices = Vec::new();
        let mut at = pointer(flow, value)?;
        let variable = loop {
            match flow.function.expressions[at] {
                Expression::AccessIndex { base, index } => {
                    indices.push(Some(index));
                    at = base;
                }
                Expression::Access { base, .. } => {
                    indices.push(None);
                    at = base;
                }
                Expression::GlobalVariable(variable) => break variable,
                _ => return None,
            }
        };
        let variable = &flow.module.global_variables[variable];
        let read_only = match variable.space {
            AddressSpace::Uniform => true,
            AddressSpace::Storage { access } => !access.contains(StorageAccess::STORE),
            _ => false,
        };
        if !read_only {
            return None;
        }
        let types = &flow.module.types;
        let mut inner = &types[variable.ty].inner;
        let mut path = variable.name.clone()?;
        let mut pieces = vec![path.clone()];
        let mut counts = Vec::new();
        let mut part = (0, words(inner).unwrap_or(0));
        while let Some(index) = indices.pop() {
            let mut named = String::new();
            match (inner, index) {
                (TypeInner::Struct { members, .. }, Some(index)) => {
                    let member = members.get(index as usize)?;
                    named = format!(".{}", member.name.as_ref()?);
                    inner = &types[member.ty].inner;
                    part = (0, words(inner).unwrap_or(0));
                }
                (TypeInner::Array { base, size, .. }, index) => {
                    let size = match *size {
                        ArraySize::Constant(size) => Some(size.get()),
                        _ => None,
                    };
                    match index {
                        Some(index) => named = format!("[{index}]"),
                        None => {
                            counts.push(size?);
                            pieces.push(String::new());
                            path.push_str("[*]");
                        }
                    }
                    inner = &types[*base].inner;
                    part = (0, words(inner).unwrap_or(0));
                }
                // What is left are columns and components of what the scene states as a whole.
                (TypeInner::Matrix { rows, .. }, Some(column)) => {
                    let rows = *rows as usize;
                    path.push_str(&format!("[{column}]"));
                    part = (column as usize * rows, rows);
                    if let Some(component) = indices.pop() {
                        part = (part.0 + component? as usize, 1);
                        path.push_str(&format!("[{}]", component?));
                    }
                    break;
                }
                (TypeInner::Vector { .. }, Some(component)) => {
                    path.push_str(&format!("[{component}]"));
                    part = (component as usize, 1);
                    break;
                }
                _ => return None,
            }
            path.push_str(&named);
            if let Some(piece) = pieces.last_mut() {
                piece.push_str(&named);
            }
        }
        let whole = part.1 > 0 && indices.is_empty();
        whole.then_some(Self {
            path,
            pieces,
            counts,
            part,
        })
    }

    /// What the scene states is there, as the bits of each component: the same for every element that varying indices may
    /// choose.
    pub(crate) fn words(&self, facts: &Facts) -> Option<Vec<u32>> {
        let all = self.counts.iter().map(|count| *count as usize);
        let elements = all.product::<usize>();
        if elements > MOST {
            return None;
        }
        let mut found: Option<&[u32]> = None;
        for element in 0..elements {
            let mut left = element;
            let mut path = self.pieces[0].clone();
            for (count, piece) in self.counts.iter().zip(&self.pieces[1..]) {
                let count = *count as usize;
                path.push_str(&format!("[{}]{piece}", left % count));
                left /= count;
            }
            let words = facts.fixed.get(&path)?;
            let words = words.get(self.part.0..self.part.0 + self.part.1)?;
            if found.is_some_and(|found| found != words) {
                return None;
            }
            found = Some(words);
        }
        found.map(<[u32]>::to_vec)
    }
}

/// How many words a number, vector or matrix has.
fn words(inner: &TypeInner) -> Option<usize> {
    match *inner {
        TypeInner::Scalar(_) => Some(1),
        TypeInner::Vector { size, .. } => Some(size as usize),
        TypeInner::Matrix { columns, rows, .. } => Some(columns as usize * rows as usize),
        _ => None,
    }
}
