//! Facts: what the samples of a scene show of the values of a shader, and what is known of its textures, at one
//! distance.

use super::samples::SampleSet;
use crate::eval::draw::{Blend, Shading, shade_into, shade_weighed};
use crate::eval::machine::Profile;
use crate::eval::program::{Opacity, Program};
use crate::eval::texture::{Dimension, Texture};
use crate::scene::{Scene, SceneTexture, Variation};
use glam::{Vec2, Vec3};
use lodc_passes::facts::{Moments, TextureFacts, ValueFacts};
use lodc_passes::{Facts, Shader, Stage, autolod, op_removal};
use naga::{Expression, Handle, Scalar, TypeInner};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

impl SampleSet<'_> {
    /// What the samples show of every float value of a shader, and of the scene's textures.
    pub fn facts(&self, shader: &Shader) -> Facts {
        let uniforms = self.stand.scene.uniforms.iter();
        let dynamic = uniforms.filter(|uniform| uniform.variation == Variation::Dynamic);
        let probes = float_values(shader);
        let pairs = op_removal::pairs(shader);
        // A shader always has a fragment stage.
        let entry = shader.index(Stage::Fragment).unwrap_or(0);
        let states = &self.stand.scene.states;
        let blended = states.iter().any(|state| state.blend != Blend::Opaque);
        let opacity = Program::opacity(shader.module(), entry, &probes, &pairs, blended);
        let opacity = opacity.unwrap_or_default();
        let mut facts = Facts {
            textures: texture_facts(self.stand.scene, self.distance(), &opacity),
            dynamic: dynamic.map(|uniform| uniform.path.clone()).collect(),
            ..Facts::default()
        };
        let compiled = Program::compile_with_pairs(shader.module(), entry, &probes, &pairs);
        let Ok(program) = compiled else {
            return facts;
        };
        let profiles: Vec<_> = self
            .frames
            .par_iter()
            .flat_map_iter(|frame| frame.drawings.iter().map(move |drawing| (frame, drawing)))
            .map(|(frame, drawing)| {
                let mut shading = Shading::default();
                let Some(seen) = &drawing.seen else {
                    shade_into(&program, &drawing.coverage, &frame.bindings, &mut shading);
                    return shading.profile;
                };
                let Some(weights) = &seen.weights else {
                    shade_into(&program, &seen.coverage, &frame.bindings, &mut shading);
                    return shading.profile;
                };
                let mut weighed = |weights| {
                    let bindings = &frame.bindings;
                    shade_weighed(&program, &seen.coverage, bindings, weights, &mut shading);
                    shading.profile.clone()
                };
                let by_share = weighed(&weights.share);
                with_opacity(by_share, weighed(&weights.arrives), &opacity)
            })
            .map(|profile| (profile.probes, profile.pairs))
            .collect();
        let id = |value| shader.id(Stage::Fragment, value).clone();
        for (i, (value, operand)) in pairs.into_iter().enumerate() {
            let mut seen: Vec<Moments> = Vec::new();
            for (_, frame) in &profiles {
                seen.resize(frame[i].len(), Moments::default());
                for (seen, more) in seen.iter_mut().zip(&frame[i]) {
                    seen.merge(more);
                }
            }
            facts.pairs.insert((id(value), id(operand)), seen);
        }
        let profiles: Vec<_> = profiles.into_iter().map(|(probes, _)| probes).collect();
        for (i, value) in probes.iter().enumerate() {
            let mut fact = ValueFacts::default();
            let components = profiles
                .iter()
                .map(|frame| frame[i].len())
                .max()
                .unwrap_or(0);
            for component in 0..components {
                let (mut count, mut weight, mut sum) = (0, 0.0, 0.0);
                let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
                for probe in profiles.iter().filter_map(|frame| frame[i].get(component)) {
                    count += probe.count;
                    weight += probe.weight;
                    sum += probe.sum;
                    // A NaN stays: it must be seen.
                    min = if min.is_nan() || probe.min > min {
                        min
                    } else {
                        probe.min
                    };
                    max = if max.is_nan() || probe.max < max {
                        max
                    } else {
                        probe.max
                    };
                }
                fact.count = count;
                fact.mean.push((sum / weight) as f32);
                if blended {
                    fact.weight.push(weight);
                }
                fact.min.push(min);
                fact.max.push(max);
            }
            if fact.count > 0 {
                facts.values.insert(id(*value), fact);
            }
        }
        facts
    }
}

/// What was seen of values, each fragment weighed by its share of the picture, but of what their opacity is made of, which
/// is worth as much whatever it is: where that is so, it is as the second profile has it.
fn with_opacity(mut profile: Profile, opacity_profile: Profile, opacity: &Opacity) -> Profile {
    let probes = profile.probes.iter_mut().zip(opacity_profile.probes);
    for ((probes, others), parts) in probes.zip(&opacity.probes) {
        for ((probe, other), part) in probes.iter_mut().zip(others).zip(parts) {
            if *part {
                *probe = other;
            }
        }
    }
    let pairs = profile.pairs.iter_mut().zip(opacity_profile.pairs);
    for ((pairs, others), parts) in pairs.zip(&opacity.pairs) {
        for ((pair, other), part) in pairs.iter_mut().zip(others).zip(parts) {
            if *part {
                *pair = other;
            }
        }
    }
    profile
}

/// What is known of every texture that is not dynamic, at the MIP level that a distance leads to. Where a texture's alpha
/// is its fragments' opacity, its colours are weighed by it.
fn texture_facts(
    scene: &Scene,
    distance: f64,
    opacity: &Opacity,
) -> BTreeMap<String, TextureFacts> {
    let known = scene.textures.iter().filter(|texture| !texture.dynamic);
    known
        .map(|texture| {
            let weighed = opacity.textures.contains(&(texture.group, texture.binding));
            let level = texels_per_pixel(scene, texture, distance)
                .unwrap_or(1.0)
                .log2();
            (
                texture.name.clone(),
                match texture.images.as_slice() {
                    [image] => image.facts(level.max(0.0) as f32, weighed),
                    // Draws with different images share no mean; what the samples see of them does.
                    _ => TextureFacts::default(),
                },
            )
        })
        .collect()
}

/// Texels of a texture to a pixel at a distance, along an edge, when it is mapped by the mesh's own texture
/// coordinates: the mean over the mesh's area. `None` for a texture or a mesh that has no such coordinates.
pub(crate) fn texels_per_pixel(
    scene: &Scene,
    texture: &SceneTexture,
    distance: f64,
) -> Option<f64> {
    let mesh = &scene.mesh;
    let flat = |image: &Arc<Texture>| image.dimension() == Dimension::D2;
    if !texture.images.iter().all(flat) || mesh.uvs.is_empty() {
        return None;
    }
    let (mut surface, mut texels) = (0.0, 0.0);
    for (index, draw) in mesh.draws().into_iter().enumerate() {
        let mut mapped = 0.0;
        for corners in
            mesh.indices[3 * draw.triangles.start..3 * draw.triangles.end].chunks_exact(3)
        {
            let [a, b, c] = [0, 1, 2].map(|i| corners[i] as usize);
            let position = |i: usize| Vec3::from(mesh.positions[i]).as_dvec3();
            let uv = |i: usize| Vec2::from(mesh.uvs[i]).as_dvec2();
            surface += (position(b) - position(a))
                .cross(position(c) - position(a))
                .length();
            mapped += (uv(b) - uv(a)).perp_dot(uv(c) - uv(a)).abs();
        }
        let image = texture.images.get(index).or(texture.images.last())?;
        let [width, height, _] = image.size(0);
        texels += mapped * f64::from(width) * f64::from(height);
    }
    let scale = (texels / surface).sqrt() / autolod::rho(&scene.view(distance));
    (scale.is_finite() && scale > 0.0).then_some(scale)
}

/// The fragment values that facts are wanted of: f32 scalars, vectors and matrices that are computed.
fn float_values(shader: &Shader) -> Vec<Handle<Expression>> {
    let Some(function) = shader.function(Stage::Fragment) else {
        return Vec::new();
    };
    function
        .expressions
        .iter()
        .filter(|(_, expression)| {
            !expression.needs_pre_emit() || matches!(expression, Expression::FunctionArgument(_))
        })
        .map(|(value, _)| value)
        .filter(|value| {
            matches!(
                shader.type_of(Stage::Fragment, *value),
                TypeInner::Scalar(Scalar::F32)
                    | TypeInner::Vector {
                        scalar: Scalar::F32,
                        ..
                    }
                    | TypeInner::Matrix {
                        scalar: Scalar::F32,
                        ..
                    }
            )
        })
        .collect()
}
