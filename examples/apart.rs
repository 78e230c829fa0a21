//! Where the two renderers part: every value of a shader's normal form that a GPU computes otherwise than the evaluator.
//!
//! `cargo run --example apart -- testdata/materials/leather.wgsl testdata/materials/leather.toml vulkan` draws each value
//! in the place of the colour, with both, in the order in which they are computed: the first one that is printed is where
//! a difference begins. What a value is where it is not reached is 0.

use lodc::compile::normal_form;
use lodc::eval::draw::{resolve, shade};
use lodc::eval::image::Picture;
use lodc::eval::program::{Program, Refused};
use lodc::eval::raster::{Frame, rasterize};
use lodc::front::Source;
use lodc::gpu::{Gpu, Renderer, Stages};
use lodc::scene::Scene;
use lodc_passes::{Shader, Stage, operands};
use naga::{
    Block, Expression, Handle, Literal, LocalVariable, Module, Range, Scalar, ScalarKind, Span,
    Statement, Type, TypeInner, VectorSize,
};
use std::error::Error;
use std::path::Path;

/// The mean of relative differences from which a value is printed.
const APART: f64 = 1e-4;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [shader, scene, adapter] = arguments.as_slice() else {
        return Err("usage: apart SHADER SCENE ADAPTER".into());
    };
    let source = Source::read(Path::new(shader)).map_err(|e| e.to_string())?;
    let scene = Scene::read(&source, Some(Path::new(scene))).map_err(|e| e.to_string())?;
    if scene.lighting.is_some() || scene.blends() {
        return Err("a scene that is lit or blended shows no value as it is".into());
    }
    let base = normal_form(&source).map_err(|e| e.to_string())?;
    let gpu = Gpu::open(Some(adapter)).map_err(|e| e.to_string())?;
    let stages = Stages::of_shader(&base, &scene).ok_or("it has no vertex stage")?;
    let vertex = Program::compile(stages.vertex.0, stages.vertex.1, &[]).map_err(said)?;
    let frame = scene.frames(scene.nearest).swap_remove(0);

    let mut values = Vec::new();
    let function = base
        .function(Stage::Fragment)
        .ok_or("it has no fragment stage")?;
    operands::walk(&function.body, &mut |statement| {
        if let Statement::Emit(range) = statement {
            values.extend(range.clone());
        }
    });
    let mut renderer = Renderer::new(&gpu);
    println!(
        "mean      worst     value, by the GPU and by the evaluator where they are furthest apart"
    );
    for value in values {
        let Some(module) = shown(&base, value) else {
            continue;
        };
        let fragment = (&module, stages.fragment.1);
        let pipeline = renderer.pipeline(Stages { fragment, ..stages }, &scene);
        let pipeline = pipeline.map_err(|e| e.to_string())?;
        let drawn = renderer.draw(&pipeline, &scene, &frame);
        let drawn = drawn
            .and_then(|drawn| drawn.picture(&gpu))
            .map_err(|e| e.to_string())?;
        let evaluated = evaluated(&vertex, fragment, &frame).map_err(said)?;
        let found = Apart::of(&drawn, &evaluated);
        // Negated, so that a NaN is printed.
        let alike = found.mean <= APART;
        if !alike {
            println!(
                "{:<9.2e} {:<9.2e} {}: {:?} {:?}",
                found.mean,
                found.worst,
                base.id(Stage::Fragment, value).path(),
                found.example[0],
                found.example[1],
            );
        }
    }
    Ok(())
}

fn said(refused: Refused) -> String {
    refused.what.to_string()
}

fn evaluated(
    vertex: &Program,
    (module, entry): (&Module, usize),
    frame: &Frame,
) -> Result<Picture, Refused> {
    let fragment = Program::compile(module, entry, &[])?;
    let coverage = rasterize(vertex, &fragment, frame);
    Ok(resolve(
        &coverage,
        &shade(&fragment, &coverage, &frame.bindings),
    ))
}

/// How far two pictures are apart, relative to what they show.
struct Apart {
    mean: f64,
    worst: f32,
    example: [[f32; 4]; 2],
}

impl Apart {
    fn of(drawn: &Picture, evaluated: &Picture) -> Self {
        let mut found = Self {
            mean: 0.0,
            worst: 0.0,
            example: [[0.0; 4]; 2],
        };
        let mut count = 0;
        for (at, (l, r)) in drawn.pixels.iter().zip(&evaluated.pixels).enumerate() {
            if drawn.covered[at] == 0.0 || evaluated.covered[at] == 0.0 {
                continue;
            }
            for (l_channel, r_channel) in l.iter().zip(r) {
                let same = l_channel == r_channel || l_channel.is_nan() && r_channel.is_nan();
                let size = l_channel.abs().max(r_channel.abs()).max(1e-3);
                let apart = if same {
                    0.0
                } else {
                    (l_channel - r_channel).abs() / size
                };
                found.mean += f64::from(apart);
                count += 1;
                let less = apart <= found.worst;
                if !less {
                    (found.worst, found.example) = (apart, [*l, *r]);
                }
            }
        }
        found.mean /= f64::from(count.max(1));
        found
    }
}

/// The shader with a value in the place of its colours, as floats; `None` when it is no scalar or vector of 32 bits.
fn shown(base: &Shader, value: Handle<Expression>) -> Option<Module> {
    let (size, scalar) = match *base.type_of(Stage::Fragment, value) {
        TypeInner::Scalar(scalar) => (None, scalar),
        TypeInner::Vector { size, scalar } => (Some(size), scalar),
        _ => return None,
    };
    if scalar.kind != ScalarKind::Bool && scalar.width != 4 {
        return None;
    }
    let mut module = base.module().clone();
    let four = TypeInner::Vector {
        size: VectorSize::Quad,
        scalar: Scalar::F32,
    };
    let four = Type {
        name: None,
        inner: four,
    };
    let four = module.types.insert(four, Span::UNDEFINED);
    let function = &mut module.entry_points[base.index(Stage::Fragment)?].function;
    let local = LocalVariable {
        name: Some("shown".to_owned()),
        ty: four,
        init: None,
    };
    let local = function.local_variables.append(local, Span::UNDEFINED);
    let mut add = |expression| function.expressions.append(expression, Span::UNDEFINED);
    let pointer = add(Expression::LocalVariable(local));
    let zero = add(Expression::Literal(Literal::F32(0.0)));
    let mut first = None;
    let mut components = Vec::new();
    for index in 0..4 {
        let component = match size {
            None if index == 0 => value,
            Some(size) if index < size as u32 => {
                add(Expression::AccessIndex { base: value, index })
            }
            _ => {
                components.push(zero);
                continue;
            }
        };
        let float = match scalar.kind {
            ScalarKind::Float => component,
            _ => add(Expression::As {
                expr: component,
                kind: ScalarKind::Float,
                convert: Some(4),
            }),
        };
        first = first.or([component, float].into_iter().find(|made| *made != value));
        components.push(float);
    }
    let colour = add(Expression::Compose {
        ty: four,
        components,
    });
    let range = Range::new_from_bounds(first.unwrap_or(colour), colour);
    let kept = [
        Statement::Emit(range),
        Statement::Store {
            pointer,
            value: colour,
        },
    ];
    // The entry point of a normal form returns once, at its end.
    let load = add(Expression::Load { pointer });
    let ty = function.result.as_ref()?.ty;
    let returned = match &module.types[ty].inner {
        TypeInner::Struct { members, .. } if members.len() == 1 => add(Expression::Compose {
            ty,
            components: vec![load],
        }),
        TypeInner::Vector { .. } => load,
        _ => return None,
    };
    let mut body = std::mem::take(&mut function.body);
    body.cull(body.len().saturating_sub(1)..);
    keep(&mut body, value, &kept);
    let range = Range::new_from_bounds(load, returned);
    body.push(Statement::Emit(range), Span::UNDEFINED);
    let returned = Statement::Return {
        value: Some(returned),
    };
    body.push(returned, Span::UNDEFINED);
    function.body = body;
    Some(module)
}

/// Puts statements behind the one that computes a value; whether it was there.
fn keep(block: &mut Block, value: Handle<Expression>, kept: &[Statement]) -> bool {
    for at in 0..block.len() {
        let found = match &mut block[at] {
            Statement::Emit(range) => {
                if range.clone().any(|made| made == value) {
                    block.splice(at + 1..at + 1, Block::from_vec(kept.to_vec()));
                    return true;
                }
                false
            }
            Statement::Block(inner) => keep(inner, value, kept),
            Statement::If { accept, reject, .. } => {
                keep(accept, value, kept) || keep(reject, value, kept)
            }
            Statement::Loop {
                body, continuing, ..
            } => keep(body, value, kept) || keep(continuing, value, kept),
            Statement::Switch { cases, .. } => cases
                .iter_mut()
                .any(|case| keep(&mut case.body, value, kept)),
            _ => false,
        };
        if found {
            return true;
        }
    }
    false
}
