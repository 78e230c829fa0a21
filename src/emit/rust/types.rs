//! Types of WGSL as types of Rust.
//!
//! Scalars are `f32`, `i32`, `u32` and `bool`, vectors `[f32; 3]`, matrices `[[f32; 3]; 4]`, column by column, arrays are
//! arrays, and structures are structures with the layout that WGSL gives them. In memory a vector of three in an array, and
//! each column of three of a matrix, takes the place of four: such are *padded* there, and have three elements as values.

use super::Written;
use super::text::{Text, rust_name};
use naga::proc::Layouter;
use naga::{ArraySize, Handle, Module, PredeclaredType, Scalar, ScalarKind, Type, TypeInner};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The longest array that the standard library has a default for.
const LONGEST_WITH_DEFAULT: u32 = 32;

/// The types of a module, and which of its structures have been asked for.
pub(super) struct Types<'a> {
    pub(super) module: &'a Module,
    layouts: Layouter,
    needed: BTreeSet<Handle<Type>>,
}

impl<'a> Types<'a> {
    pub(super) fn new(module: &'a Module) -> Written<Self> {
        let mut layouts = Layouter::default();
        layouts
            .update(module.to_ctx())
            .map_err(|error| error.to_string())?;
        Ok(Self {
            module,
            layouts,
            needed: BTreeSet::new(),
        })
    }

    pub(super) fn inner(&self, ty: Handle<Type>) -> &'a TypeInner {
        &self.module.types[ty].inner
    }

    /// The type of a value.
    pub(super) fn value(&mut self, ty: Handle<Type>) -> Written<String> {
        let inner = self.inner(ty);
        if let Some(text) = plain(inner)? {
            return Ok(text);
        }
        match inner {
            TypeInner::Array { base, size, .. } => {
                let base = self.element(*base)?;
                Ok(format!("[{base}; {}]", length(*size)?))
            }
            TypeInner::Struct { members, .. } if self.is_pair(ty) => {
                let members: Written<Vec<String>> = (members.iter())
                    .map(|member| self.value(member.ty))
                    .collect();
                Ok(format!("({})", members?.join(", ")))
            }
            TypeInner::Struct { members, .. } => {
                // Those that it is made of are written too.
                for member in members {
                    if self.runtime_element(member.ty).is_none() {
                        self.value(member.ty)?;
                    }
                }
                self.needed.insert(ty);
                Ok(self.name(ty))
            }
            _ => Err("a value that is no number".into()),
        }
    }

    /// The type of a member of a structure, or of a buffer.
    pub(super) fn stored(&mut self, ty: Handle<Type>) -> Written<String> {
        match self.inner(ty) {
            TypeInner::Matrix { columns, .. } if self.is_padded_stored(ty) => {
                Ok(format!("[[f32; 4]; {}]", *columns as usize))
            }
            _ => self.value(ty),
        }
    }

    /// The type of an element of an array.
    pub(super) fn element(&mut self, ty: Handle<Type>) -> Written<String> {
        match self.inner(ty) {
            TypeInner::Vector { scalar, .. } if self.is_padded_element(ty) => {
                Ok(format!("[{}; 4]", scalar_name(*scalar)?))
            }
            _ => self.stored(ty),
        }
    }

    /// Whether a member of this type is padded.
    pub(super) fn is_padded_stored(&self, ty: Handle<Type>) -> bool {
        matches!(
            self.inner(ty),
            TypeInner::Matrix {
                rows: naga::VectorSize::Tri,
                ..
            }
        )
    }

    /// Whether an element of this type is padded.
    pub(super) fn is_padded_element(&self, ty: Handle<Type>) -> bool {
        matches!(
            self.inner(ty),
            TypeInner::Vector {
                size: naga::VectorSize::Tri,
                ..
            }
        ) || self.is_padded_stored(ty)
    }

    /// The element of an array whose length only the buffer tells.
    pub(super) fn runtime_element(&self, ty: Handle<Type>) -> Option<Handle<Type>> {
        match self.inner(ty) {
            TypeInner::Array {
                base,
                size: ArraySize::Dynamic,
                ..
            } => Some(*base),
            _ => None,
        }
    }

    /// Whether it is the result of `modf` or `frexp`, which is a pair here.
    pub(super) fn is_pair(&self, ty: Handle<Type>) -> bool {
        let special = self.module.special_types.predeclared_types.iter();
        special.into_iter().any(|(what, of)| {
            let pair = !matches!(what, PredeclaredType::AtomicCompareExchangeWeakResult(_));
            pair && *of == ty
        })
    }

    pub(super) fn name(&self, ty: Handle<Type>) -> String {
        rust_name(self.module.types[ty].name.as_deref().unwrap_or("Unnamed"))
    }

    /// The value that WGSL calls zero, as a value.
    pub(super) fn zero(&mut self, ty: Handle<Type>) -> Written<Text> {
        self.zero_as(ty, self.inner(ty))
    }

    fn zero_as(&mut self, ty: Handle<Type>, inner: &TypeInner) -> Written<Text> {
        let of = |scalar: &Scalar| match scalar.kind {
            ScalarKind::Float => Text::float(0.0),
            ScalarKind::Bool => Text::atom("false"),
            kind => Text::integer(0, kind == ScalarKind::Sint),
        };
        let repeated = |text: &Text, count: u32| Text {
            is_loose: text.is_loose,
            ..Text::atom(format!("[{}; {count}]", text.text))
        };
        Ok(match inner {
            TypeInner::Scalar(scalar) => of(scalar),
            TypeInner::Vector { size, scalar } => repeated(&of(scalar), *size as u32),
            TypeInner::Matrix { columns, rows, .. } => {
                let column = repeated(&Text::float(0.0), *rows as u32);
                repeated(&column, *columns as u32)
            }
            TypeInner::Array { base, size, .. } => {
                let element = self.zero_element(*base)?;
                repeated(&element, length(*size)?)
            }
            TypeInner::Struct { members, .. } if self.is_pair(ty) => {
                let members: Written<Vec<String>> = (members.iter())
                    .map(|member| Ok(self.zero(member.ty)?.text))
                    .collect();
                Text::atom(format!("({})", members?.join(", ")))
            }
            TypeInner::Struct { .. } => Text::atom(format!("{}::default()", self.value(ty)?)),
            _ => return Err("a value that is no number".into()),
        })
    }

    /// The same as a member of a structure.
    fn zero_stored(&mut self, ty: Handle<Type>) -> Written<Text> {
        match self.inner(ty) {
            TypeInner::Matrix { columns, .. } if self.is_padded_stored(ty) => {
                Ok(Text::atom(format!("[[0.0; 4]; {}]", *columns as u32)))
            }
            _ => self.zero(ty),
        }
    }

    /// The same as an element of an array.
    pub(super) fn zero_element(&mut self, ty: Handle<Type>) -> Written<Text> {
        match self.inner(ty) {
            TypeInner::Vector { scalar, .. } if self.is_padded_element(ty) => {
                let zero = self.zero_as(ty, &TypeInner::Scalar(*scalar))?;
                Ok(Text::atom(format!("[{}; 4]", zero.text)))
            }
            _ => self.zero_stored(ty),
        }
    }

    /// Whether a structure has padding, so that a value of it is not all of its members.
    pub(super) fn has_padding(&self, ty: Handle<Type>) -> bool {
        let TypeInner::Struct { members, span } = self.inner(ty) else {
            return false;
        };
        let mut end = 0;
        let mut padded = false;
        for member in members {
            padded |= words_between(end, member.offset) > 0;
            end = member.offset + self.size(member.ty);
        }
        padded || words_between(end, *span) > 0
    }

    /// In bytes, of a member; 0 of an array whose length only the buffer tells.
    fn size(&self, ty: Handle<Type>) -> u32 {
        match self.runtime_element(ty) {
            Some(_) => 0,
            None => self.layouts[ty].size,
        }
    }

    /// The declarations of the structures that were asked for, each behind those that it is made of.
    pub(super) fn declared(&mut self) -> Written<Vec<(Handle<Type>, String)>> {
        let needed: Vec<Handle<Type>> = self.needed.iter().copied().collect();
        let declare = |ty| Ok((ty, self.declaration(ty)?));
        needed.into_iter().map(declare).collect()
    }

    /// The names of those structures.
    pub(super) fn declared_names(&self) -> Vec<String> {
        self.needed.iter().map(|ty| self.name(*ty)).collect()
    }

    fn declaration(&mut self, ty: Handle<Type>) -> Written<String> {
        let TypeInner::Struct { members, span } = self.inner(ty) else {
            return Err("a structure that is none".into());
        };
        let name = self.name(ty);
        let mut fields: Vec<(String, String, String)> = Vec::new();
        let mut derives_default = true;
        let (mut end, mut paddings) = (0, 0);
        let mut pad = |fields: &mut Vec<(String, String, String)>, from: u32, to: u32| {
            let words = words_between(from, to);
            if words > 0 {
                let name = format!("_padding_{paddings}");
                paddings += 1;
                fields.push((name, format!("[u32; {words}]"), format!("[0; {words}]")));
            }
            words
        };
        let mut has_end = true;
        for member in members {
            derives_default &= pad(&mut fields, end, member.offset) <= LONGEST_WITH_DEFAULT;
            end = member.offset + self.size(member.ty);
            if self.runtime_element(member.ty).is_some() {
                has_end = false;
                continue;
            }
            derives_default &= self.has_default(member.ty);
            let called = rust_name(member.name.as_deref().unwrap_or("unnamed"));
            let ty = self.stored(member.ty)?;
            fields.push((called, ty, self.zero_stored(member.ty)?.text));
        }
        if has_end {
            derives_default &= pad(&mut fields, end, *span) <= LONGEST_WITH_DEFAULT;
        }
        let size = if has_end { *span } else { end };
        let default = if derives_default { ", Default" } else { "" };
        let mut out = format!(
            "/// `{name}` as a buffer has it: {size} bytes.\n\
             #[repr(C)]\n\
             #[derive(Clone, Copy, Debug{default}, PartialEq)]\n\
             #[allow(dead_code, missing_docs, non_camel_case_types, non_snake_case, unreachable_pub)]\n\
             pub struct {name} {{\n"
        );
        for (name, ty, _) in &fields {
            writeln!(out, "    pub {name}: {ty},").ok();
        }
        out.push_str("}\n");
        if !derives_default {
            write!(
                out,
                "\nimpl Default for {name} {{\n    fn default() -> Self {{\n        Self {{\n"
            )
            .ok();
            for (name, _, zero) in &fields {
                writeln!(out, "            {name}: {zero},").ok();
            }
            out.push_str("        }\n    }\n}\n");
        }
        Ok(out)
    }

    /// Whether the standard library has a default for a type of a member.
    fn has_default(&self, ty: Handle<Type>) -> bool {
        match self.inner(ty) {
            TypeInner::Array { base, size, .. } => {
                matches!(length(*size), Ok(size) if size <= LONGEST_WITH_DEFAULT)
                    && self.has_default(*base)
            }
            _ => true,
        }
    }

    /// The members of a structure of scalars and vectors, and its size in bytes.
    pub(super) fn numbers(&self, ty: Handle<Type>) -> Written<(Vec<Numbers>, u32)> {
        let TypeInner::Struct { members, span } = self.inner(ty) else {
            return Err("a structure that is none".into());
        };
        let all = members.iter().map(|member| {
            let (count, scalar) = match self.inner(member.ty) {
                TypeInner::Scalar(scalar) => (1, scalar),
                TypeInner::Vector { size, scalar } => (*size as usize, scalar),
                _ => return Err("a parameter that is no number".to_owned()),
            };
            Ok(Numbers {
                name: rust_name(member.name.as_deref().unwrap_or("unnamed")),
                offset: member.offset,
                count,
                kind: scalar.kind,
            })
        });
        Ok((all.collect::<Written<_>>()?, *span))
    }
}

/// A scalar or vector that is a member of a structure.
pub(super) struct Numbers {
    pub(super) name: String,
    /// In bytes.
    pub(super) offset: u32,
    pub(super) count: usize,
    pub(super) kind: ScalarKind,
}

/// The type of a scalar, a vector or a matrix as a value; nothing for others.
pub(super) fn plain(inner: &TypeInner) -> Written<Option<String>> {
    Ok(Some(match inner {
        TypeInner::Scalar(scalar) => scalar_name(*scalar)?.to_owned(),
        TypeInner::Vector { size, scalar } => {
            format!("[{}; {}]", scalar_name(*scalar)?, *size as usize)
        }
        TypeInner::Matrix {
            columns,
            rows,
            scalar,
        } => format!(
            "[[{}; {}]; {}]",
            scalar_name(*scalar)?,
            *rows as usize,
            *columns as usize
        ),
        _ => return Ok(None),
    }))
}

fn scalar_name(scalar: Scalar) -> Written<&'static str> {
    match (scalar.kind, scalar.width) {
        (ScalarKind::Float, 4) => Ok("f32"),
        (ScalarKind::Sint, 4) => Ok("i32"),
        (ScalarKind::Uint, 4) => Ok("u32"),
        (ScalarKind::Bool, _) => Ok("bool"),
        _ => Err("numbers of 16 or 64 bits".into()),
    }
}

/// How many whole words are between two places in bytes.
fn words_between(from: u32, to: u32) -> u32 {
    to.saturating_sub(from) / 4
}

/// The length of an array.
pub(super) fn length(size: ArraySize) -> Written<u32> {
    match size {
        ArraySize::Constant(size) => Ok(size.get()),
        ArraySize::Pending(_) | ArraySize::Dynamic => {
            Err("an array whose length is not known".into())
        }
    }
}
