//! What the evaluator does in a second on one core: by class of operation, on a shader-like mix, and
//! on whole materials; and how long it takes to compile one.
//!
//! Elements are scalar operations of one lane, samples of one lane, or lanes of a material.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lodc::eval::lane::{LANES, Mask, Words};
use lodc::eval::machine::{Bindings, Machine, Resource};
use lodc::eval::program::Program;
use lodc::eval::texture::{Dimension, Sampler, Texture};
use naga::{AddressSpace, ImageDimension, Module, ShaderStage, TypeInner};
use std::hint::black_box;
use std::sync::Arc;

/// Operations in a chain.
const CHAIN: usize = 64;

fn parse(source: &str) -> Module {
    naga::front::wgsl::parse_str(source).expect("the shader is valid")
}

fn fragment(module: &Module) -> usize {
    let found = module
        .entry_points
        .iter()
        .position(|e| e.stage == ShaderStage::Fragment);
    found.expect("there is a fragment entry point")
}

/// A fragment shader that does an expression of `r`, `x` and `y` over and over.
fn chain(expression: &str) -> String {
    let lines = format!("r = {expression};\n").repeat(CHAIN);
    format!(
        "@group(0) @binding(0) var t: texture_2d<f32>;
         @group(0) @binding(1) var s: sampler;
         @fragment fn main(@location(0) x: f32, @location(1) y: f32) -> @location(0) f32 {{
            var r = x;
            {lines}
            return r;
         }}"
    )
}

/// Resources of the right kinds for a module: placeholder textures, and buffers of small numbers.
fn bindings(module: &Module) -> Bindings {
    let mut bindings = Bindings::new();
    for (handle, variable) in module.global_variables.iter() {
        let Some(at) = &variable.binding else {
            continue;
        };
        let inner = &module.types[variable.ty].inner;
        let resource = match (inner, variable.space) {
            (TypeInner::Sampler { .. }, _) => Resource::Sampler(Arc::new(Sampler::default())),
            (TypeInner::Image { dim, .. }, _) => {
                let dimension = match dim {
                    ImageDimension::Cube => Dimension::Cube,
                    ImageDimension::D3 => Dimension::D3,
                    _ => Dimension::D2,
                };
                let texture = Texture::placeholder(handle.index() as u64, dimension, 1);
                Resource::Texture(Arc::new(texture))
            }
            (_, AddressSpace::Uniform | AddressSpace::Storage { .. }) => {
                let words = inner.size(module.to_ctx()) / 4;
                let bytes = (0..words).flat_map(|i| {
                    // Counts of lights and the like are small integers, the rest small floats.
                    let value = 0.25 + (i % 7) as f32 * 0.125;
                    value.to_bits().to_le_bytes()
                });
                Resource::Buffer(Arc::new(bytes.collect()))
            }
            _ => continue,
        };
        bindings.insert((at.group, at.binding), resource);
    }
    bindings
}

/// Inputs that vary smoothly over a block of 32 by 8 pixels.
fn inputs(program: &Program) -> Vec<Words> {
    (0..program.inputs().len())
        .map(|slot| {
            std::array::from_fn(|lane| {
                let (quad, corner) = (lane / 4, lane % 4);
                let (x, y) = (quad % 16 * 2 + corner % 2, quad / 16 * 2 + corner / 2);
                let value = 0.3 + 0.004 * x as f32 + 0.003 * y as f32 + 0.05 * slot as f32;
                value.to_bits()
            })
        })
        .collect()
}

fn run(criterion: &mut Criterion, group: &str, name: &str, source: &str, elements: Option<u64>) {
    let module = parse(source);
    let program = Program::compile(&module, fragment(&module), &[]).expect("it compiles");
    let bindings = bindings(&module);
    let inputs = inputs(&program);
    let mut outputs = vec![[0; LANES]; program.outputs().len()];
    let mut machine = Machine::new(&program, &bindings);
    machine.run(&inputs, Mask::ALL, Mask::ALL, &mut outputs);
    let work = machine.profile().work;
    // Without a number it is what the profile counts.
    let elements = elements.unwrap_or((work.simple + work.special) as u64);
    let mut group = criterion.benchmark_group(group);
    group.throughput(Throughput::Elements(elements));
    group.bench_function(name, |b| {
        b.iter(|| machine.run(black_box(&inputs), Mask::ALL, Mask::ALL, &mut outputs));
    });
    group.finish();
}

fn operations(criterion: &mut Criterion) {
    let chained = (CHAIN * LANES) as u64;
    for (name, expression, each) in [
        ("add_mul", "r * x + y", 2),
        ("uniform_operand", "r * 0.99 + 0.5", 2),
        ("min_max", "max(min(r, y), x)", 2),
        ("mix", "mix(r, y, x)", 1),
        ("floor_fract", "fract(r) + floor(y)", 3),
        ("divide", "y / r", 1),
        ("sqrt", "sqrt(r)", 1),
        ("exp2", "exp2(-r)", 2),
        ("log2", "log2(r + 1.5)", 2),
        ("pow", "pow(r, y)", 1),
        ("sin", "sin(r)", 1),
        ("atan2", "atan2(r, y)", 1),
        ("compare_select", "select(r, y, r < x)", 2),
        ("integers", "bitcast<f32>((bitcast<u32>(r) ^ 77u) * 3u)", 2),
    ] {
        let source = chain(expression);
        run(criterion, "operations", name, &source, Some(chained * each));
    }
    for (name, expression) in [
        (
            "texture_bilinear",
            "textureSampleLevel(t, s, vec2(r, y), 0.0).x",
        ),
        (
            "texture_trilinear",
            "textureSampleLevel(t, s, vec2(r, y), 1.5).x",
        ),
        (
            "texture_implicit",
            "textureSample(t, s, vec2(x, y) + r * 0.001).x",
        ),
    ] {
        run(
            criterion,
            "operations",
            name,
            &chain(expression),
            Some(chained),
        );
    }
}

/// Lambert and Blinn-Phong with four lights, fog and tone mapping: about four parts in five are
/// full-rate operations.
const MIX: &str = "
    struct Light { position: vec3f, power: f32, colour: vec3f, sharpness: f32 }
    struct Lights { eye: vec3f, fog: f32, list: array<Light, 4> }
    @group(0) @binding(0) var<uniform> lights: Lights;
    @fragment fn main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) albedo: vec3f)
        -> @location(0) vec4f {
        let n = normalize(normal);
        let to_eye = lights.eye - position;
        let v = normalize(to_eye);
        var sum = albedo * 0.05;
        for (var i = 0u; i < 4u; i++) {
            let l = lights.list[i];
            let d = l.position - position;
            let fall = l.power / (1.0 + dot(d, d));
            let to_light = normalize(d);
            let n_dot_l = dot(n, to_light);
            if n_dot_l <= 0.0 { continue; }
            let h = normalize(to_light + v);
            let gloss = pow(max(dot(n, h), 0.0), l.sharpness * 64.0);
            sum += (albedo * n_dot_l + vec3(gloss)) * l.colour * fall;
        }
        let fog = 1.0 - exp(-length(to_eye) * lights.fog);
        let hazy = mix(sum, vec3(0.5, 0.6, 0.7), fog);
        let mapped = hazy * (2.51 * hazy + 0.03) / (hazy * (2.43 * hazy + 0.59) + 0.14);
        return vec4(clamp(mapped, vec3(0.0), vec3(1.0)), 1.0);
    }";

const MATERIALS: [(&str, &str); 3] = [
    ("pbr", include_str!("../testdata/materials/pbr.wgsl")),
    ("rock", include_str!("../testdata/materials/rock.wgsl")),
    (
        "watermelon",
        include_str!("../testdata/materials/watermelon.wgsl"),
    ),
];

fn mix(criterion: &mut Criterion) {
    run(criterion, "mix", "blinn_phong", MIX, None);
    for (name, source) in MATERIALS {
        run(criterion, "materials", name, source, Some(LANES as u64));
    }
}

fn compile(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("compile");
    for (name, source) in MATERIALS {
        let module = parse(source);
        let entry = fragment(&module);
        group.bench_function(name, |b| {
            b.iter(|| Program::compile(black_box(&module), entry, &[]));
        });
    }
    group.finish();
}

criterion_group!(benches, operations, mix, compile);
criterion_main!(benches);
