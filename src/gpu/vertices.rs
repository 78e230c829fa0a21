//! A mesh as vertex and index buffers: one buffer with all that a vertex stage reads, vertex after vertex.

use crate::eval::raster::{Frame, attribute};
use crate::{Diagnostic, Result};
use naga::{Binding, Module, ScalarKind, Type, TypeInner};
use wgpu::{VertexAttribute, VertexFormat};

/// An input of a vertex stage that a mesh feeds.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Input {
    location: u32,
    kind: ScalarKind,
    components: usize,
}

/// What a vertex stage reads of each vertex, in the order of locations.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    inputs: Vec<Input>,
}

impl Layout {
    /// What the entry point of a vertex stage reads.
    ///
    /// # Errors
    /// When an input is no scalar or vector of 32 bits.
    pub(super) fn new(module: &Module, entry: usize) -> Result<Self> {
        let mut inputs = Vec::new();
        let mut add = |binding: &Option<Binding>, ty: &Type| {
            let Some(Binding::Location { location, .. }) = binding else {
                return Ok(());
            };
            let (scalar, components) = match ty.inner {
                TypeInner::Scalar(scalar) => (scalar, 1),
                TypeInner::Vector { size, scalar } => (scalar, size as usize),
                _ => return Err(unreadable(*location)),
            };
            if scalar.width != 4 {
                return Err(unreadable(*location));
            }
            inputs.push(Input {
                location: *location,
                kind: scalar.kind,
                components,
            });
            Ok(())
        };
        for argument in &module.entry_points[entry].function.arguments {
            let ty = &module.types[argument.ty];
            match &ty.inner {
                TypeInner::Struct { members, .. } => {
                    for member in members {
                        add(&member.binding, &module.types[member.ty])?;
                    }
                }
                _ => add(&argument.binding, ty)?,
            }
        }
        inputs.sort_by_key(|input| input.location);
        Ok(Self { inputs })
    }

    /// Bytes of a vertex; 0 when nothing is read.
    pub(super) fn stride(&self) -> u64 {
        self.inputs
            .iter()
            .map(|input| 4 * input.components as u64)
            .sum()
    }

    /// As a pipeline wants it.
    pub(super) fn attributes(&self) -> Vec<VertexAttribute> {
        let mut offset = 0;
        let mut all = Vec::new();
        for input in &self.inputs {
            all.push(VertexAttribute {
                format: format(input),
                offset,
                shader_location: input.location,
            });
            offset += 4 * input.components as u64;
        }
        all
    }

    /// The bytes of all vertices of a frame.
    pub(super) fn bytes(&self, frame: &Frame) -> Vec<u8> {
        let mut bytes = Vec::new();
        for vertex in 0..frame.mesh.positions.len() {
            for input in &self.inputs {
                for component in 0..input.components {
                    let fed = (input.location, component);
                    let word = attribute(frame, fed, input.kind, vertex);
                    bytes.extend_from_slice(&word.to_le_bytes());
                }
            }
        }
        bytes
    }
}

fn unreadable(location: u32) -> Box<Diagnostic> {
    Diagnostic::error(format!(
        "the vertex input at location {location} is not of 32 bits, and is not drawn on a GPU"
    ))
    .with_note("the evaluator draws it")
}

fn format(input: &Input) -> VertexFormat {
    use VertexFormat as F;
    let formats = match input.kind {
        ScalarKind::Sint => [F::Sint32, F::Sint32x2, F::Sint32x3, F::Sint32x4],
        ScalarKind::Uint => [F::Uint32, F::Uint32x2, F::Uint32x3, F::Uint32x4],
        _ => [F::Float32, F::Float32x2, F::Float32x3, F::Float32x4],
    };
    formats[input.components - 1]
}

/// The corners of all triangles, counted from the first vertex of their draw. A flat input of a fragment is that of
/// its triangle's first corner, or, where `last_is_flat`, of the last one: there each first corner comes last.
pub(super) fn indices(frame: &Frame, last_is_flat: bool) -> Vec<u8> {
    let mesh = &frame.mesh;
    let mut bytes = Vec::new();
    for draw in mesh.draws() {
        let corners = 3 * draw.triangles.start..3 * draw.triangles.end;
        let corners = mesh.indices.get(corners).unwrap_or_default();
        for [a, b, c] in corners.as_chunks::<3>().0 {
            let corners = if last_is_flat { [b, c, a] } else { [a, b, c] };
            for corner in corners {
                let own = corner.saturating_sub(draw.vertices.start as u32);
                bytes.extend_from_slice(&own.to_le_bytes());
            }
        }
    }
    bytes
}
