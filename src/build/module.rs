//! The Rust module of a material: what a host has to know of its levels, for `include!`.
//!
//! It depends on nothing, but on `libm` where levels have parameters that it computes, and needs no standard library. What it
//! computes itself is in `host.rs`, which is written into it as it stands.

use super::bindings::{self, Bindings};
use crate::emit::rust::Buffers;
use crate::emit::{self, EmitLevel, Emitted, FORMAT, Form, GeneratedTexture, Lock, Target};
use crate::front::Source;
use crate::{Diagnostic, Result};
use lodc_passes::Shader;
use std::fmt::Write;
use std::path::Path;

/// Which level an object is drawn with, as it is written into every module.
const HOST: &str = include_str!("host.rs");

/// What a module is written from.
pub(super) struct Of<'a> {
    pub(super) source: &'a Source,
    /// Its normal form.
    pub(super) base: &'a Shader,
    /// The lock, where its levels are what was emitted.
    pub(super) lock: Option<&'a Lock>,
    pub(super) levels: &'a [EmitLevel],
    pub(super) emitted: &'a Emitted,
    pub(super) textures: &'a [GeneratedTexture],
    /// The folder of what was made for levels, from that of the module.
    pub(super) folder: &'a str,
    /// The file of the meshes, from there too.
    pub(super) meshes: Option<&'a str>,
    pub(super) form: Form,
    pub(super) target: Target,
    /// Whether structures are declared plain data to `bytemuck`.
    pub(super) bytemuck: bool,
}

/// The text of a module.
///
/// # Errors
/// When the parameter stage has something in it that there is no form for: a flaw.
pub(super) fn written(of: &Of<'_>) -> Result<String> {
    let Some(text) = of.emitted.texts.first() else {
        return Err(Diagnostic::error("internal error: nothing was emitted"));
    };
    // In the form of files each level has a stage of its own.
    let texts = of.emitted.texts.iter().enumerate();
    let buffers: Vec<Option<Buffers>> = texts
        .map(|(at, text)| {
            let stage = emit::targets::parameter_stage(of.source, text);
            let wanted = at == 0 || stage.is_some();
            let buffers = || emit::rust::buffers(of.source, &text.module, stage);
            wanted.then(buffers).transpose()
        })
        .collect::<Result<_>>()?;
    let in_buffer = emit::control::in_buffer(&text.module);
    let constant = emit::control::pipeline_constant(&text.module);
    let autolod = in_buffer
        .map(|(at, _)| at)
        .filter(|_| !of.levels.is_empty());
    let bindings = Bindings::of(of.source, &of.emitted.texts, &buffers, autolod);

    let name = Path::new(&of.source.name).file_name();
    let name = name.map_or(of.source.name.clone(), |n| n.to_string_lossy().into_owned());
    let mut out = format!(
        "// The levels of {} for a host, by lodc (lock format {FORMAT}). Made from the lock: change that, not this.\n\n\
         #[allow(dead_code, missing_docs, unreachable_pub, clippy::all, clippy::pedantic)]\nmod made {{\n",
        name.replace(['\n', '\r'], " ")
    );
    out.push_str(&shaders(of));
    let rho0 = of.lock.map_or(0.0, |lock| lock.rho0);
    let thresholds: Vec<f32> = (of.levels.iter())
        .map(|level| level.autolod)
        .filter(|start| *start > 0.0)
        .collect();
    write!(
        out,
        "\n/// Pixels per object unit at the nearest distance that levels were made for, where autoLOD is 0; 0 without levels.\n\
         pub const RHO0: f64 = {};\n\
         \n/// The autoLOD from which each level is used, from level 1 on.\n\
         pub const THRESHOLDS: &[f32] = &{thresholds:?};\n\
         \n/// The key of the pipeline constant that a level is chosen by, where it is one.\n\
         pub const AUTOLOD_CONSTANT: Option<&str> = {:?};\n\
         \n/// Group, binding and offset in bytes of the number in a buffer that a level is chosen by, where it is one.\n\
         pub const AUTOLOD_BUFFER: Option<(u32, u32, u32)> = {:?};\n",
        number(rho0),
        constant.map(|(_, key)| key),
        in_buffer.map(|((group, binding), offset)| (group, binding, offset)),
    )
    .ok();
    write!(
        out,
        "\n/// What the shader binds, by group and binding.\npub const BINDINGS: &[Binding] = &[\n{}];\n",
        bindings.written()
    )
    .ok();
    out.push_str(&levels(of, &bindings));
    out.push_str(&textures(of));
    out.push_str(&meshes(of));
    out.push_str(TYPES);
    out.push_str(bindings::TYPES);
    out.push_str(FUNCTIONS);
    for (level, buffers) in buffers.iter().enumerate() {
        if let Some(buffers) = buffers {
            out.push_str(&structures(level, buffers, of.bytemuck));
        }
    }
    write!(
        out,
        "\nmod host {{\n{HOST}}}\n}}\n\n#[allow(unused_imports, unreachable_pub)]\npub use made::*;\n"
    )
    .ok();
    Ok(out)
}

/// The buffers of a text, which is the first or has a parameter stage of its own.
fn structures(level: usize, buffers: &Buffers, bytemuck: bool) -> String {
    let name = match level {
        0 => "buffers".to_owned(),
        level => format!("buffers_of_level_{level}"),
    };
    let mut out = format!(
        "\n/// The buffers of the shader, with the layout that it has them in.\n\
         #[allow(non_camel_case_types, non_snake_case)]\npub mod {name} {{\n{}",
        buffers.text
    );
    let structures = buffers.structures.iter().filter(|_| bytemuck);
    for structure in structures {
        write!(
            out,
            "\n// Safety: all of it is words of 4 bytes in the order of C, of which every value is valid, and what is between\n\
             // members is a member.\n\
             unsafe impl ::bytemuck::Zeroable for {structure} {{}}\n\
             unsafe impl ::bytemuck::Pod for {structure} {{}}\n"
        )
        .ok();
    }
    out.push_str("}\n");
    out
}

/// The shaders as constants.
fn shaders(of: &Of<'_>) -> String {
    let is_shader = |name: &&std::path::PathBuf| name.extension().is_none_or(|e| e != "rs");
    let names = of.emitted.files.iter().map(|(name, _)| name);
    let names: Vec<String> = names
        .filter(is_shader)
        .map(|name| format!("{:?}", name.to_string_lossy()))
        .collect();
    match (of.target, of.form) {
        (Target::Wgsl, Form::Override | Form::Uniform) => format!(
            "/// The shader with all its levels.\npub const SHADER: &str = include_str!({});\n",
            names.join("")
        ),
        (Target::Wgsl, Form::Files) => format!(
            "/// The shader of each level.\npub const SHADERS: &[&str] = &[{}];\n",
            list(names.iter().map(|name| format!("include_str!({name})")))
        ),
        _ => format!(
            "/// The files of the shader by their names, in the order of stages, and of levels.\n\
             pub const SHADERS: &[(&str, &[u8])] = &[{}];\n",
            list(
                names
                    .iter()
                    .map(|name| format!("({name}, include_bytes!({name}))"))
            )
        ),
    }
}

fn levels(of: &Of<'_>, bindings: &Bindings) -> String {
    let mut out =
        String::from("\n/// The levels, the nearest first.\npub const LEVELS: &[Level] = &[\n");
    let shaders = bindings::shaders(of.base, &of.emitted.levels);
    let original = (shaders.len() > of.levels.len()).then(|| EmitLevel::original(of.base.clone()));
    for (level, shader) in original.iter().chain(of.levels).zip(shaders) {
        let places = bindings.of_level(shader);
        writeln!(
            out,
            "    Level {{ autolod: {:?}, distance: {}, error: {}, cost: {}, says: {:?}, bindings: &{places:?}, textures: &{:?} }},",
            level.autolod,
            number(level.distance),
            number(level.error),
            number(level.cost),
            level.says,
            bindings.textures(&places),
        )
        .ok();
    }
    out.push_str("];\n");
    out
}

fn textures(of: &Of<'_>) -> String {
    let locked = of.lock.map_or(&[][..], |lock| &lock.generated);
    let mut out = String::from(
        "\n/// The textures that were made for levels: bindings of these names want these files.\n\
         pub const GENERATED: &[Generated] = &[\n",
    );
    for texture in of.textures {
        let Some(locked) = locked.iter().find(|locked| locked.name == texture.name) else {
            continue;
        };
        writeln!(
            out,
            "    Generated {{ name: {:?}, file: {:?}, format: {:?}, size: {:?}, layers: {:?}, levels: {} }},",
            locked.name,
            format!("{}/{}", of.folder, locked.file),
            locked.format,
            locked.size,
            locked.layers,
            locked.levels
        )
        .ok();
    }
    out.push_str("];\n");
    out
}

fn meshes(of: &Of<'_>) -> String {
    let meshes = of.lock.map_or(&[][..], |lock| &lock.mesh);
    let meshes = meshes.iter().filter(|_| of.meshes.is_some());
    let lines = meshes.clone().map(|mesh| {
        format!(
            "    Mesh {{ level: {}, autolod: {:?}, distance: {}, triangles: {} }},\n",
            mesh.level,
            mesh.autolod,
            number(mesh.distance),
            mesh.triangles
        )
    });
    let thresholds: Vec<f32> = meshes.clone().map(|mesh| mesh.autolod).skip(1).collect();
    format!(
        "\n/// The file of the meshes that were made for levels, beside the shader, where there is one.\n\
         pub const MESH_FILE: Option<&str> = {:?};\n\
         \n/// The meshes in it that are used, the nearest first; none where all levels are drawn with the host's own.\n\
         pub const MESHES: &[Mesh] = &[\n{}];\n\
         \n/// The autoLOD from which each mesh is used, from the second on.\n\
         pub const MESH_THRESHOLDS: &[f32] = &{thresholds:?};\n",
        of.meshes,
        lines.collect::<String>()
    )
}

/// A number as Rust writes it.
fn number(x: f64) -> String {
    match x.is_finite() {
        true => format!("{x:?}"),
        false => format!("f64::from_bits({:#x})", x.to_bits()),
    }
}

fn list(all: impl Iterator<Item = String>) -> String {
    all.collect::<Vec<_>>().join(", ")
}

const TYPES: &str = r#"
/// A level of the shader.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// The autoLOD from which it is used.
    pub autolod: f32,
    /// The distance at which that is reached in the scene that levels were made for, in world units; 0 of the first.
    pub distance: f64,
    /// Its error there: root mean square, of display values in 0..1.
    pub error: f64,
    /// What it costs, as a share of the original's.
    pub cost: f64,
    /// What changed.
    pub says: &'static str,
    /// What it reads, as places in `BINDINGS`: nothing else has to be bound to something that is there.
    pub bindings: &'static [usize],
    /// The names of the textures among those.
    pub textures: &'static [&'static str],
}

/// A texture that was made for levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Generated {
    /// The name of its binding.
    pub name: &'static str,
    /// Its file, beside the shader.
    pub file: &'static str,
    /// How its texels are stored, as WebGPU calls it.
    pub format: &'static str,
    /// Width and height in texels.
    pub size: [u32; 2],
    /// How many layers it has, of an array.
    pub layers: Option<u32>,
    /// How many MIP levels it has.
    pub levels: u32,
}

/// A mesh that was made for levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Which level of the file it is, from 0.
    pub level: usize,
    /// The autoLOD from which it is used.
    pub autolod: f32,
    /// The distance at which that is reached, in world units.
    pub distance: f64,
    /// How many triangles it has.
    pub triangles: usize,
}
"#;

const FUNCTIONS: &str = r#"
pub use self::host::{Camera, HYSTERESIS, Object, rho, s_max};

/// How many halvings of scale on screen an object is away from the nearest distance that levels were made for: autoLOD.
pub fn auto_lod(camera: &Camera, object: &Object) -> f64 {
    host::auto_lod(RHO0, rho(camera, object))
}

/// The level to draw at an autoLOD, a place in `LEVELS`. `current` is the one that was drawn before: it stays until a threshold
/// has been passed by `HYSTERESIS`.
pub fn level(auto_lod: f64, current: Option<usize>) -> usize {
    host::level(THRESHOLDS, auto_lod, current)
}

/// The autoLOD to hand to the shader for a level: the middle of its interval. With a transition, hand over the autoLOD itself.
pub fn level_value(level: usize) -> f32 {
    host::middle(THRESHOLDS, level)
}

/// The mesh to draw at an autoLOD, a place in `MESHES`; `current` as of `level`.
pub fn mesh(auto_lod: f64, current: Option<usize>) -> usize {
    host::level(MESH_THRESHOLDS, auto_lod, current)
}
"#;
