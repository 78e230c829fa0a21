//! Facts that nobody measured, for tests of the passes: the same for a shader on every run.

use lodc_passes::facts::{Facts, Moments, TextureFacts, ValueFacts};
use lodc_passes::{Shader, Stage, op_removal};
use naga::TypeInner;

/// Facts in which every f32 value of both stages was seen 64 times, between 0 and 1 with the mean 0.5,
/// every texture has an image of three MIP levels, and every
/// value that may be fitted to an operand falls as that rises.
pub(crate) fn facts(shader: &Shader) -> Facts {
    let mut facts = Facts {
        pixels_per_coordinate: Some(100.0),
        ..Facts::default()
    };
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
                    weight: Vec::new(),
                    mean: vec![0.5; count],
                    min: vec![0.0; count],
                    max: vec![1.0; count],
                },
            );
        }
    }
    for (value, operand) in op_removal::pairs(shader) {
        let count = match *shader.type_of(Stage::Fragment, value) {
            TypeInner::Vector { size, .. } => size as usize,
            _ => 1,
        };
        // A value that falls from 0.75 as its operand rises, a little off the line.
        let seen = Moments {
            weight: 64.0,
            mean: [0.5, 0.5],
            squares: [1.25, 4.0],
            product: -2.0,
        };
        let id = |value| shader.id(Stage::Fragment, value).clone();
        facts
            .pairs
            .insert((id(value), id(operand)), vec![seen; count]);
    }
    for (_, variable) in shader.module().global_variables.iter() {
        if let TypeInner::Image { .. } = shader.module().types[variable.ty].inner
            && let Some(name) = &variable.name
        {
            facts.textures.insert(
                name.clone(),
                TextureFacts {
                    size: [16; 2],
                    layers: 4,
                    mean: vec![[0.5, 0.25, 0.75, 1.0]; 3],
                    deviation: vec![
                        [0.25, 0.25, 0.25, 0.0],
                        [0.125, 0.125, 0.125, 0.0],
                        [0.0; 4],
                    ],
                    slopes: Vec::new(),
                    fits: Vec::new(),
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
    for moments in facts.pairs.values_mut().flatten() {
        moments.mean = [0, 1].map(|_| awkward[next(awkward.len())]).map(f64::from);
        moments.product *= [1.0, -1.0, 0.0][next(3)];
    }
    facts
}
