//! Materials by their number, and locks of them that nobody searched: what a project of thousands has.

use crate::synthetic;
use lodc::emit::{FORMAT, Lock};
use lodc::front::Source;
use lodc_passes::recipe::{self, Recipe};
use lodc_passes::{Pass, op_removal::OpRemoval};
use std::fs;
use std::path::{Path, PathBuf};

/// A material of its own for each number: other terms, in another order, with other constants.
pub(crate) fn material(number: usize) -> String {
    const TERMS: [&str; 6] = [
        "max(dot(normal, light.direction), 0.0)",
        "pow(max(dot(normal, half_way), 0.0), SHARP)",
        "smoothstep(0.0, SOFT, abs(in.uv.x - 0.5))",
        "sin(in.uv.y * WAVES) * 0.5 + 0.5",
        "1.0 / (1.0 + dot(in.world, in.world) * FALL)",
        "sqrt(abs(normal.y)) * SOFT",
    ];
    let mut lines = String::new();
    let mut rest = number;
    for at in 0..4 {
        let term = TERMS[(rest + at) % TERMS.len()];
        rest /= TERMS.len();
        let term = term
            .replace("SHARP", &format!("{:.1}", 8.0 + (number % 50) as f32))
            .replace("SOFT", &format!("{:.3}", 0.1 + (number % 97) as f32 * 0.01))
            .replace("WAVES", &format!("{:.1}", 20.0 + (number % 31) as f32))
            .replace(
                "FALL",
                &format!("{:.4}", 0.01 + (number % 89) as f32 * 0.001),
            );
        lines += &format!("    let term_{} = {term};\n", ["a", "b", "c", "d"][at]);
    }
    format!(
        "// Material {number}.
struct Light {{ direction: vec3f, colour: vec3f, eye: vec3f }}
struct Varyings {{
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
}}
@group(0) @binding(0) var<uniform> light: Light;
@group(0) @binding(1) var albedo: texture_2d<f32>;
@group(0) @binding(2) var linear: sampler;

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {{
    let normal = normalize(in.normal);
    let half_way = normalize(normalize(light.eye - in.world) + light.direction);
{lines}    let base = textureSample(albedo, linear, in.uv).rgb;
    let lit = base * term_a + light.colour * term_b;
    return vec4f(lit * term_c + vec3f(term_d * 0.1), 1.0);
}}
"
    )
}

/// A lock of the shader in a file: levels that have one, four and nine of its operations less.
pub(crate) fn lock(shader: &Path) -> String {
    let source = Source::read(shader).unwrap_or_else(|e| panic!("{e}"));
    let base = lodc::compile::normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
    let facts = synthetic::facts(&base);
    let (mut now, mut steps) = (base.clone(), Vec::new());
    for candidate in OpRemoval.candidates(&base, &facts) {
        if let Ok(next) = recipe::apply(&now, &candidate) {
            (now, _) = (next, steps.push(candidate));
        }
    }
    let levels = [1, 4, 9].map(|count| count.min(steps.len()));
    let file = shader.file_name().expect("a file").to_string_lossy();
    let head = format!(
        "format = {FORMAT}\nsource = {{ file = '{file}', normal_form = \"{}\", fragment = \"{}\" }}\nseed = 1\nrho0 = 300.0\n",
        base.fingerprint(),
        source.fragment
    );
    let mut lock = Lock::parse("lock", &head).unwrap_or_else(|e| panic!("{e}"));
    let levels = levels.into_iter().zip(1_u8..);
    lock.levels = levels
        .map(|(count, at)| lodc::emit::LockedLevel {
            autolod: f32::from(at),
            distance: 2.0_f64.powi(at.into()),
            error: 0.0,
            floor: 0.0,
            bound: 0.0,
            cost: 1.0 / f64::from(at + 1),
            time: None,
            band_cost: None,
            says: format!("{count} operations changed"),
            recipe: Recipe(steps[..count].to_vec()),
        })
        .collect();
    lock.to_toml()
}

/// Writes the material of a number with its lock: `folder/m7.wgsl`, `folder/m7.lod.toml`.
pub(crate) fn write(folder: &Path, number: usize) -> PathBuf {
    fs::create_dir_all(folder).expect("a folder can be made");
    let shader = folder.join(format!("m{number}.wgsl"));
    fs::write(&shader, material(number)).expect("it can be written");
    fs::write(shader.with_extension("lod.toml"), lock(&shader)).expect("it can be written");
    shader
}
