//! Facts: what the samples of a scene show of the values of a shader, and what is known of its textures, at one
//! distance.

use super::samples::SampleSet;
use crate::eval::draw::{Blend, Shading, shade_into, shade_weighed};
use crate::eval::machine::{Probe, Profile};
use crate::eval::program::{Opacity, Program};
use crate::eval::programs::Programs;
use crate::eval::raster::vertex_profile;
use crate::eval::texture::{Dimension, Texture};
use crate::scene::{Scene, Variation};
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
        let stated = self.stand.scene.uniforms.iter().filter_map(|uniform| {
            let words = uniform.stated.clone()?;
            Some((uniform.path.clone(), words))
        });
        let probes = float_values(shader, Stage::Fragment);
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
            fixed: stated.collect(),
            repeating: self.stand.scene.repeating(),
            pixels_per_coordinate: coordinates_per_pixel(self.stand.scene, self.distance())
                .map(|coordinates| coordinates.recip() as f32),
            ..Facts::default()
        };
        let compiled = Program::compile_with_pairs(shader.module(), entry, &probes, &pairs);
        let Ok(programs) = compiled.and_then(|program| Programs::with(shader, program)) else {
            return facts;
        };
        facts
            .textures
            .extend(self.generated_facts(shader, &programs, &opacity));
        let program = &programs.fragment;
        let profiles: Vec<_> = self
            .frames
            .par_iter()
            .flat_map_iter(|frame| frame.drawings.iter().map(move |drawing| (frame, drawing)))
            .map(|(frame, drawing)| {
                let mut shading = Shading::default();
                let (frame, _) = programs.bound(&frame.frame);
                let bindings = &frame.bindings;
                let Some(seen) = &drawing.seen else {
                    let coverage = drawing.covered(&programs, &frame);
                    shade_into(program, &coverage, bindings, &mut shading);
                    return shading.profile;
                };
                let coverage = match programs.vertex {
                    Some(_) => &drawing.with_inputs(&seen.coverage, &programs, &frame),
                    None => &seen.coverage,
                };
                let Some(weights) = &seen.weights else {
                    shade_into(program, coverage, bindings, &mut shading);
                    return shading.profile;
                };
                let mut weighed = |weights| {
                    shade_weighed(program, coverage, bindings, weights, &mut shading);
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
        let of_values = probes.iter().enumerate().filter_map(|(i, value)| {
            let seen = seen_of(profiles.iter().map(|frame| &frame[i]), blended)?;
            Some((id(*value), seen))
        });
        facts.values.extend(of_values);
        facts
    }

    /// What the vertices of its frames show of every float value of a shader's vertex stage, and what the scene states.
    pub(super) fn vertex_facts(&self, shader: &Shader) -> Facts {
        let uniforms = self.stand.scene.uniforms.iter();
        let stated = uniforms.filter_map(|uniform| {
            let words = uniform.stated.clone()?;
            Some((uniform.path.clone(), words))
        });
        let mut facts = Facts {
            fixed: stated.collect(),
            ..Facts::default()
        };
        let Some(entry) = shader.index(Stage::Vertex) else {
            return facts;
        };
        let probes = float_values(shader, Stage::Vertex);
        let Ok(program) = Program::compile(shader.module(), entry, &probes) else {
            return facts;
        };
        let frames = self.frames.par_iter();
        let profiles: Vec<_> = frames
            .map(|frame| vertex_profile(&program, &frame.frame).probes)
            .collect();
        let of_values = probes.iter().enumerate().filter_map(|(i, value)| {
            let seen = seen_of(profiles.iter().map(|frame| &frame[i]), false)?;
            Some((shader.id(Stage::Vertex, *value).clone(), seen))
        });
        facts.values.extend(of_values);
        facts
    }
}

/// What several runs saw of one value; nothing where none computed it.
fn seen_of<'a>(
    profiles: impl Iterator<Item = &'a Vec<Probe>> + Clone,
    is_weighed: bool,
) -> Option<ValueFacts> {
    let mut fact = ValueFacts::default();
    let components = profiles.clone().map(Vec::len).max().unwrap_or(0);
    for component in 0..components {
        let (mut count, mut weight, mut sum) = (0, 0.0, 0.0);
        let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
        for probe in profiles.clone().filter_map(|frame| frame.get(component)) {
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
        if is_weighed {
            fact.weight.push(weight);
        }
        fact.min.push(min);
        fact.max.push(max);
    }
    (fact.count > 0).then_some(fact)
}

impl SampleSet<'_> {
    /// What is known of the textures that were made for a shader, by their names.
    fn generated_facts(
        &self,
        shader: &Shader,
        programs: &Programs,
        opacity: &Opacity,
    ) -> BTreeMap<String, TextureFacts> {
        let scene = self.stand.scene;
        let baked = programs.generated.baked(scene.constant(), &scene.baked);
        let generated = shader.generated().into_iter().zip(baked);
        generated
            .filter_map(|((variable, generated), baked)| {
                let name = shader.module().global_variables[variable].name.clone()?;
                let images = [baked.texture];
                let level = texels_per_pixel(scene, &images, self.distance()).unwrap_or(1.0);
                let weighed = opacity.textures.contains(&generated.binding);
                let [image] = images;
                Some((name, image.facts(level.log2().max(0.0) as f32, weighed)))
            })
            .collect()
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
            let level = texels_per_pixel(scene, &texture.images, distance)
                .unwrap_or(1.0)
                .log2();
            (
                texture.name.clone(),
                match texture.images.as_slice() {
                    [image] => TextureFacts {
                        slopes: texture.slopes.clone(),
                        fits: texture.fits.clone(),
                        ..image.facts(level.max(0.0) as f32, weighed)
                    },
                    // Draws with different images share no mean; what the samples see of them does.
                    _ => TextureFacts::default(),
                },
            )
        })
        .collect()
}

/// Texels of a texture, with its images, to a pixel at a distance, along an edge, when it is mapped by the mesh's own
/// texture coordinates: the mean over the mesh's area. `None` for a texture or a mesh that has no such coordinates.
pub(crate) fn texels_per_pixel(
    scene: &Scene,
    images: &[Arc<Texture>],
    distance: f64,
) -> Option<f64> {
    let flat = |image: &Arc<Texture>| image.dimension() == Dimension::D2;
    if !images.iter().all(flat) {
        return None;
    }
    mapped_per_pixel(scene, distance, &|draw| {
        let image = images.get(draw).or(images.last())?;
        let [width, height, _] = image.size(0);
        Some([width, height])
    })
}

/// How far the mesh's own texture coordinates go from one pixel to the next at a distance: the mean over the mesh's area.
/// `None` for a mesh that has none.
pub(crate) fn coordinates_per_pixel(scene: &Scene, distance: f64) -> Option<f64> {
    mapped_per_pixel(scene, distance, &|_| Some([1, 1]))
}

/// What is mapped by the mesh's texture coordinates to a pixel at a distance, along an edge, where the unit square of them
/// has that width and height for each draw.
fn mapped_per_pixel(
    scene: &Scene,
    distance: f64,
    of_draw: &dyn Fn(usize) -> Option<[u32; 2]>,
) -> Option<f64> {
    let mesh = &scene.mesh;
    if mesh.uvs.is_empty() {
        return None;
    }
    let (mut surface, mut all) = (0.0, 0.0);
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
        let [width, height] = of_draw(index)?;
        all += mapped * f64::from(width) * f64::from(height);
    }
    let scale = (all / surface).sqrt() / autolod::rho(&scene.view(distance));
    (scale.is_finite() && scale > 0.0).then_some(scale)
}

/// The values of a stage that facts are wanted of: f32 scalars, vectors and matrices that are computed.
fn float_values(shader: &Shader, stage: Stage) -> Vec<Handle<Expression>> {
    let Some(function) = shader.function(stage) else {
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
                shader.type_of(stage, *value),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::programs::Stand;
    use crate::front::Source;
    use crate::search::Samples;
    use crate::search::best::best;
    use crate::search::interval::Interval;
    use lodc_passes::recipe;
    use std::path::Path;

    /// What `seen-mean` and another choice for the same texture of a material add to its squared error, each as it is
    /// listed and with its best numbers.
    fn added(material: &Path, scene: &str, part: f64, choice: &str) -> [[f64; 2]; 2] {
        let source = Source::read(material).expect("it parses");
        let path = material.with_extension("toml");
        let scene = Scene::resolve(&source, Some((&path, scene))).unwrap_or_else(|e| panic!("{e}"));
        let base = normal_form(&source).expect("it is small");
        let vertex = base.index(Stage::Vertex).expect("it has one");
        let vertex = Program::compile(base.module(), vertex, &[]).expect("it runs");
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let distance = scene.nearest * (scene.farthest / scene.nearest).powf(part);
        let interval = Interval::new(&stand, &[distance], Samples::Full).expect("it runs");
        let facts = interval.start().facts(&base);
        let floor = interval.start().original().error.square();
        let candidates = recipe::candidates(&base, &facts);
        let mut all = candidates.iter();
        let other = all.find(|candidate| candidate.choice.starts_with(choice));
        let other = other.expect("it is listed");
        let mean = candidates
            .iter()
            .find(|candidate| candidate.choice == "seen-mean" && candidate.site == other.site);
        [mean.expect("the mean is seen"), other].map(|candidate| {
            let shader = recipe::apply(&base, candidate).expect("it applies");
            let listed = interval.measure(&shader).expect("it runs");
            let better = best(&interval, &base, candidate, &listed);
            let better = better.map_or(listed, |better| better.measured);
            let added = [listed, better].map(|measured| measured.error.square() - floor);
            eprintln!(
                "{candidate}: {floor:.3e} and {:+.3e}, best {:+.3e}",
                added[0], added[1]
            );
            added
        })
    }

    /// A scene with pictures of 96 x 96 pixels.
    fn small(scene: &str) -> String {
        let lines = scene
            .lines()
            .map(|line| match line.starts_with("resolution") {
                true => "resolution = [96, 96]",
                false => line,
            });
        lines.collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn a_roughness_that_takes_up_the_slopes_leaves_less_error_than_a_mean_normal() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        for material in ["pbr", "gltf_pbr"] {
            let path = folder.join(material).with_extension("wgsl");
            let scene = std::fs::read_to_string(path.with_extension("toml")).expect("it is there");
            // A rough surface, so that there are slopes in all directions.
            let scene = scene.replace("panel_normal", "rock_normal");
            let [mean, widened] = added(&path, &small(&scene), 0.5, "normal-to-roughness");
            assert!(widened[1] < mean[1].min(mean[0]), "{mean:?} {widened:?}");
        }
    }

    #[test]
    fn a_sum_of_harmonics_leaves_less_error_than_the_mean_of_its_surroundings() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        let path = folder.join("car_paint.wgsl");
        let scene = std::fs::read_to_string(path.with_extension("toml")).expect("it is there");
        let [mean, sum] = added(&path, &small(&scene), 0.5, "harmonics");
        assert!(sum[1] < 0.75 * mean[1].min(mean[0]), "{mean:?} {sum:?}");
        let [_, lights] = added(&path, &small(&scene), 0.5, "lights");
        assert!(
            lights[1] < 0.75 * mean[1].min(mean[0]),
            "{mean:?} {lights:?}"
        );
    }

    #[test]
    fn a_roughness_takes_up_the_slopes_of_a_model() {
        let data = std::env::var_os("LODC_DATA").map(std::path::PathBuf::from);
        let data =
            data.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"));
        let bottle = data.join("WaterBottle/WaterBottle.gltf");
        if !bottle.exists() {
            eprintln!("SKIPPED: there is no {}", bottle.display());
            return;
        }
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        let scene =
            format!("object = {bottle:?}\nresolution = [96, 96]\nviews = {{ count = 2 }}\n");
        let [mean, widened] = added(
            &folder.join("gltf_pbr.wgsl"),
            &scene,
            0.5,
            "normal-to-roughness",
        );
        assert!(widened[1] < mean[1].min(mean[0]), "{mean:?} {widened:?}");
    }
}
