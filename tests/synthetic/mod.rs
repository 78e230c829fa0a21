//! Facts that nobody measured, for tests of the passes: the same for a shader on every run.

use lodc_passes::facts::{Facts, TextureFacts, ValueFacts};
use lodc_passes::{Shader, Stage};
use naga::TypeInner;

/// Facts in which every f32 value of both stages was seen 64 times, between 0 and 1 with the mean 0.5,
/// and every texture has an image of three MIP levels.
pub(crate) fn facts(shader: &Shader) -> Facts {
    let mut facts = Facts::default();
    for stage in [Stage::Vertex, Stage::Fragment] {
        let Some(function) = shader.function(stage) else {
            continue;
        };
        for (value, _) in function.expressions.iter() {
            let count = match *shader.type_of(stage, value) {
                TypeInner::Scalar(naga::Scalar::F32) => 1,
                TypeInner::Vector {
                    size,
                    scalar: naga::Scalar::F32,
                } => size as usize,
                _ => continue,
            };
            facts.values.insert(
                shader.id(stage, value).clone(),
                ValueFacts {
                    count: 64,
                    mean: vec![0.5; count],
                    min: vec![0.0; count],
                    max: vec![1.0; count],
                },
            );
        }
    }
    for (_, variable) in shader.module().global_variables.iter() {
        if let TypeInner::Image { .. } = shader.module().types[variable.ty].inner
            && let Some(name) = &variable.name
        {
            facts.textures.insert(
                name.clone(),
                TextureFacts {
                    mean: vec![[0.5, 0.25, 0.75, 1.0]; 3],
                    deviation: vec![
                        [0.25, 0.25, 0.25, 0.0],
                        [0.125, 0.125, 0.125, 0.0],
                        [0.0; 4],
                    ],
                    level: 0.5,
                },
            );
        }
    }
    facts
}

/// The same facts with other numbers, some of them awkward: 0, 1, negative and large ones.
#[allow(dead_code, reason = "the goldens take the plain facts")]
pub(crate) fn awkward_facts(shader: &Shader, mut next: impl FnMut(usize) -> usize) -> Facts {
    let awkward = [0.0, -0.0, 1.0, 0.5, -0.75, 3.0, 1e-6, 40.0, 1e30];
    let mut facts = facts(shader);
    for value in facts.values.values_mut() {
        for i in 0..value.mean.len() {
            let mean = awkward[next(awkward.len())];
            let spread = [0.0, 0.01, 1.0][next(3)];
            value.mean[i] = mean;
            value.min[i] = mean - spread;
            value.max[i] = mean + spread;
        }
    }
    facts
}
