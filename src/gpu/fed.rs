//! A fragment stage fed with chosen numbers, past any mesh: what the device makes of single inputs.
//!
//! Each input has a square of 2 x 2 pixels to itself, so that nothing varies within a quad.

use super::{Renderer, Stages};
use crate::eval::machine::Bindings;
use crate::eval::program::Program;
use crate::eval::raster::{Attribute, Frame};
use crate::scene::Scene;
use crate::scene::mesh::Mesh;
use crate::stability::{Asked, Fed};
use crate::{Diagnostic, Result};
use naga::{Binding, Interpolation, Module, Sampling, ScalarKind, TypeInner};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Arc;

/// Inputs in a row of a picture.
const CELLS: usize = 32;

/// What a vertex of [`Mesh`] holds beside its position: names in the vertex stage, and how many floats each has.
const HELD: [(&str, usize); 5] = [("a", 3), ("b", 2), ("c", 2), ("d", 4), ("e", 4)];
/// How many floats an input can have.
const FLOATS: usize = 15;

/// A vertex stage that hands over what a mesh holds, and where each number goes.
#[derive(Debug)]
pub struct Feeder {
    vertex: Module,
    /// Locations and how many floats each takes, in their order.
    places: Vec<(u32, usize)>,
}

impl Feeder {
    /// One for the fragment entry point at a place of a module; nothing where that asks for more than can be fed, or for other than
    /// floats that are interpolated in perspective.
    pub fn of((module, entry): (&Module, usize)) -> Option<Self> {
        let function = &module.entry_points.get(entry)?.function;
        let mut places = BTreeMap::new();
        let mut add = |binding: &Option<Binding>, ty| match binding {
            Some(Binding::Location {
                location,
                interpolation: None | Some(Interpolation::Perspective),
                sampling: None | Some(Sampling::Center),
                ..
            }) => {
                let floats = match &module.types[ty].inner {
                    TypeInner::Scalar(scalar) if scalar.kind == ScalarKind::Float => 1,
                    TypeInner::Vector { size, scalar } if scalar.kind == ScalarKind::Float => {
                        *size as usize
                    }
                    _ => return None,
                };
                places.insert(*location, floats);
                Some(())
            }
            Some(Binding::Location { .. }) => None,
            _ => Some(()),
        };
        for argument in &function.arguments {
            add(&argument.binding, argument.ty)?;
            if let TypeInner::Struct { members, .. } = &module.types[argument.ty].inner {
                for member in members {
                    add(&member.binding, member.ty)?;
                }
            }
        }
        let places: Vec<(u32, usize)> = places.into_iter().collect();
        if places.iter().map(|(_, floats)| floats).sum::<usize>() > FLOATS {
            return None;
        }
        let vertex = naga::front::wgsl::parse_str(&stage(&places)).ok()?;
        Some(Self { vertex, places })
    }

    /// Its vertex stage before a fragment stage.
    pub fn stages<'a>(&'a self, fragment: (&'a Module, usize)) -> Stages<'a> {
        Stages {
            vertex: (&self.vertex, 0),
            fragment,
            auto_lod: None,
        }
    }

    /// A frame whose squares are given these inputs, row by row.
    pub fn frame(&self, fed: &Fed) -> Frame {
        let rows = fed.inputs.len().div_ceil(CELLS).max(1);
        let mut mesh = Mesh::default();
        for (i, input) in fed.inputs.iter().enumerate() {
            let numbers = self.places.iter().flat_map(|(location, floats)| {
                let own = input.get(location).into_iter().flatten().copied();
                own.chain(std::iter::repeat(0.0)).take(*floats)
            });
            let mut all = [0.0; FLOATS];
            for (number, own) in all.iter_mut().zip(numbers) {
                *number = own;
            }
            let first = mesh.positions.len() as u32;
            for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let x = 2.0 * (i % CELLS + x) as f32 / CELLS as f32 - 1.0;
                let y = 1.0 - 2.0 * (i / CELLS + y) as f32 / rows as f32;
                mesh.positions.push([x, y, 0.5]);
                mesh.normals.push([all[0], all[1], all[2]]);
                mesh.uvs.push([all[3], all[4]]);
                mesh.second_uvs.push([all[5], all[6]]);
                mesh.tangents.push([all[7], all[8], all[9], all[10]]);
                mesh.colours.push([all[11], all[12], all[13], all[14]]);
            }
            mesh.indices
                .extend([0, 2, 1, 1, 2, 3].map(|corner| first + corner));
        }
        let attributes = [
            Attribute::Position,
            Attribute::Normal,
            Attribute::Uv,
            Attribute::SecondUv,
            Attribute::Tangent,
            Attribute::Colour,
        ];
        Frame {
            mesh: Arc::new(mesh),
            attributes: (0..).zip(attributes).collect(),
            width: 2 * CELLS as u32,
            height: 2 * rows as u32,
            offset: [0.0; 2],
            grid: 1,
            ..fed.frame.clone()
        }
    }

    /// The pixel of each of so many inputs in such a frame.
    pub fn pixels(count: usize) -> impl Iterator<Item = usize> {
        (0..count).map(|i| 2 * (i / CELLS) * 2 * CELLS + 2 * (i % CELLS))
    }
}

/// The text of the vertex stage.
fn stage(places: &[(u32, usize)]) -> String {
    let held = HELD.iter().flat_map(|(name, count)| {
        let parts = ["x", "y", "z", "w"][..*count].iter();
        parts.map(move |part| format!("{name}.{part}"))
    });
    let mut held = held.collect::<Vec<_>>().into_iter();
    let (mut members, mut values) = (String::new(), String::new());
    for (location, floats) in places {
        let ty = match floats {
            1 => "f32".to_owned(),
            more => format!("vec{more}f"),
        };
        let own: Vec<String> = held.by_ref().take(*floats).collect();
        // Writing to a string cannot fail.
        let _ = write!(members, "@location({location}) v{location}: {ty}, ");
        let _ = write!(values, ", {ty}({})", own.join(", "));
    }
    let taken = HELD
        .iter()
        .zip(1..)
        .map(|((name, count), location)| format!("@location({location}) {name}: vec{count}f"));
    let taken: Vec<String> = taken.collect();
    let taken = taken.join(", ");
    format!(
        "struct Handed {{ @builtin(position) clip: vec4f, {members} }}
         @vertex fn feed(@location(0) at: vec3f, {taken}) -> Handed {{
             return Handed(vec4f(at, 1.0){values});
         }}"
    )
}

impl Renderer<'_> {
    /// For each fragment of the inputs whether a shader gives on it what is not finite; nothing where it cannot be fed, or something lights
    /// it that reads more than it draws. `more` is bound beside what the scene binds.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub fn bad(
        &mut self,
        stages: Stages<'_>,
        (scene, more): (&Scene, &Bindings),
        asked: &Asked,
    ) -> Result<Option<Vec<bool>>> {
        let (Some(feeder), None) = (Feeder::of(stages.fragment), &scene.lighting) else {
            return Ok(None);
        };
        let programs = [stages.vertex, stages.fragment]
            .map(|(module, entry)| Program::compile(module, entry, &[]));
        let [Ok(vertex), Ok(fragment)] = &programs else {
            return Err(Diagnostic::error("the evaluator refuses a variant"));
        };
        let fed_stages = feeder.stages(stages.fragment);
        let pipeline = self.pipeline(fed_stages, scene)?;
        let mut bad = Vec::new();
        for fed in asked.fed(scene, vertex, fragment) {
            let mut frame = feeder.frame(&fed);
            let more = more.iter().map(|(at, resource)| (*at, resource.clone()));
            frame.bindings.extend(more);
            let picture = self.draw(&pipeline, scene, &frame)?.picture(self.gpu())?;
            bad.extend(Feeder::pixels(fed.inputs.len()).map(|at| {
                let colour = picture.pixels[at];
                picture.covered[at] > 0.0 && !colour.iter().all(|x| x.is_finite())
            }));
        }
        Ok(Some(bad))
    }
}
