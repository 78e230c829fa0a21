//! Levels that have values computed once a draw.

use super::*;
use lodc_passes::to_parameter::ToParameter;
use lodc_passes::{Facts, Pass};

const LIGHT: &str = "\
struct Light { direction: vec3f, strength: f32 }
@group(0) @binding(0) var<uniform> light: Light;
@group(0) @binding(1) var<uniform> tint: vec3f;

@fragment fn fs_main(@location(0) normal: vec3f) -> @location(0) vec4f {
    let towards = normalize(-light.direction);
    let doubled = sqrt(tint) * light.strength;
    return vec4f(doubled * dot(normal, towards), 1.0);
}
";

/// Levels of a shader that move ever more to the parameter stage.
fn levels_of(source: &Source, base: &Shader, moved: &[usize]) -> Vec<EmitLevel> {
    let mut shader = base.clone();
    let mut levels = Vec::new();
    for (autolod, moved) in (1u8..).zip(moved) {
        for _ in 0..*moved {
            let candidates = ToParameter.candidates(&shader, &Facts::default());
            let Some(candidate) = candidates.first() else {
                break;
            };
            shader = ToParameter.apply(&shader, candidate);
        }
        levels.push(EmitLevel {
            shader: shader.clone(),
            ..level(source, f32::from(autolod))
        });
    }
    levels
}

#[test]
fn levels_share_a_block() {
    let source = source(LIGHT);
    let base = base(&source);
    let levels = levels_of(&source, &base, &[1, 1, 0]);
    let files = emit(&source, &base, &levels, output(Form::Uniform, Target::Wgsl));
    let files = files.unwrap_or_else(|e| panic!("{e}"));
    let text = String::from_utf8_lossy(&files[0].1).into_owned();
    let (_, generated) = text.split_once("// Level 1. ").expect("it is there");
    assert_eq!(
        generated,
        "Detail left out.
fn lod_one_fs_main(normal: vec3f) -> vec4f {
    let doubled = sqrt(tint) * light.strength;
    return vec4f(doubled * dot(normal, parameters.towards), 1.0);
}

// Level 2. Detail left out.
fn lod_two_fs_main(normal: vec3f) -> vec4f {
    return vec4f(parameters.doubled * dot(normal, parameters.towards), 1.0);
}

// Level 3. Detail left out.
fn lod_three_fs_main(normal: vec3f) -> vec4f {
    return vec4f(parameters.doubled * dot(normal, parameters.towards), 1.0);
}

// What is computed once a draw: by this entry point, or by the host.
struct LodParameters {
    towards: vec3f,
    doubled: vec3f,
}
@group(0) @binding(3) var<uniform> parameters: LodParameters;
@group(0) @binding(4) var<storage, read_write> parameters_stored: LodParameters;

@compute @workgroup_size(1)
fn lod_parameters() {
    lod_one_parameters();
    lod_two_parameters();
}

fn lod_one_parameters() {
    parameters_stored.towards = normalize(-light.direction);
}

fn lod_two_parameters() {
    parameters_stored.doubled = sqrt(tint) * light.strength;
}
"
    );
}

#[test]
fn other_languages_have_the_stage_too() {
    let source = source(LIGHT);
    let base = base(&source);
    let levels = levels_of(&source, &base, &[2]);
    for form in [Form::Uniform, Form::Files] {
        for (target, ending) in [
            (Target::Spirv, "spv"),
            (Target::Glsl, "comp.glsl"),
            (Target::Hlsl, "hlsl"),
            (Target::Msl, "metal"),
        ] {
            let files = emit(&source, &base, &levels, output(form, target));
            let files = files.unwrap_or_else(|e| panic!("{e}"));
            let mut files = files.iter().rev();
            let file = files.find(|(name, _)| name.to_string_lossy().ends_with(ending));
            let text = String::from_utf8_lossy(&file.expect(ending).1).into_owned();
            let entry = if target == Target::Glsl {
                "main"
            } else {
                "lod_parameters"
            };
            has(&text, entry);
        }
    }
}

#[cfg(feature = "search")]
mod numbers {
    //! Runs what fills the block, and the levels that read it.

    use super::super::meaning::outputs;
    use super::*;
    use crate::eval::lane::{LANES, Mask};
    use crate::eval::machine::{Bindings, Machine, Resource};
    use crate::eval::program::Program;
    use crate::scene::Scene;
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    use naga::{Binding, Module, StructMember, TypeInner};
    use rayon::prelude::*;
    use std::fmt::Write as _;
    use std::sync::Arc;

    /// The bytes of a block whose members an entry point returns by their places.
    fn bytes(
        module: &Module,
        entry: usize,
        members: &[StructMember],
        bindings: &Bindings,
    ) -> Vec<u8> {
        let program = Program::compile(module, entry, &[]).unwrap_or_else(|r| panic!("{}", r.what));
        let mut words = vec![[0; LANES]; program.outputs().len()];
        Machine::new(&program, bindings).run(&[], Mask::ALL, Mask::ALL, &mut words);
        let mut bytes = vec![0; 16 * (members.len() + 1)];
        for (slot, words) in program.outputs().iter().zip(&words) {
            if let Binding::Location { location, .. } = slot.binding {
                let at = members[location as usize].offset as usize + 4 * slot.component;
                bytes[at..at + 4].copy_from_slice(&words[0].to_le_bytes());
            }
        }
        bytes
    }

    fn bound(bindings: &Bindings, module: &Module, name: &str, bytes: Vec<u8>) -> Bindings {
        let mut bindings = bindings.clone();
        let mut variables = module.global_variables.iter();
        let found = variables.find(|(_, variable)| variable.name.as_deref() == Some(name));
        let at = found.and_then(|(_, variable)| variable.binding);
        let at = at.unwrap_or_else(|| panic!("no `{name}`"));
        let buffer = Resource::Buffer(Arc::new(bytes));
        bindings.insert((at.group, at.binding), buffer);
        bindings
    }

    /// The emitted text with a vertex stage behind it that returns what the parameter stage stores.
    fn returning(text: &str, members: &[&str]) -> String {
        let (head, rest) = text
            .split_once(" var<storage, read_write> parameters_stored")
            .expect("it is there");
        let (head, _) = head.rsplit_once('\n').expect("it has a line of its own");
        let text = format!("{head}\nvar<private> parameters_stored{rest}");
        let mut text = text.replace("@compute @workgroup_size(1)\n", "");
        let (_, block) = text
            .split_once("struct LodParameters {\n")
            .expect("it is there");
        let (block, _) = block.split_once('}').expect("it ends");
        let mut all = String::from("struct Returned { @builtin(position) at: vec4f,\n");
        for (at, line) in block.lines().enumerate() {
            let _ = writeln!(all, "@location({at}) @interpolate(flat) {}", line.trim());
        }
        let values: Vec<String> = members
            .iter()
            .map(|m| format!("parameters_stored.{m}"))
            .collect();
        let _ = write!(
            text,
            "{all}}}\n@vertex fn returning() -> Returned {{ lod_parameters(); return Returned(vec4f(), {}); }}",
            values.join(", ")
        );
        text
    }

    #[test]
    fn levels_read_what_the_stage_of_all_stores() {
        let paths = fixtures::complete();
        let drawn = paths.par_iter().filter(|path| {
            let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
            let base = base(&source);
            let levels = levels_of(&source, &base, &[1, 3]);
            if levels[0].shader.parameter_block().is_none() {
                return false;
            }
            let path = path.display();
            let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
            let bindings = &scene.frames(scene.nearest)[0].bindings;
            let files = emit(&source, &base, &levels, Output::default());
            let files = files.unwrap_or_else(|e| panic!("{path}: {e}"));
            let text = String::from_utf8_lossy(&files[0].1).into_owned();
            let emitted = read_back(&text, &source).unwrap_or_else(|e| panic!("{path}: {e}"));
            let mut types = emitted.module.types.iter();
            let (_, block) = types
                .find(|(_, ty)| ty.name.as_deref() == Some("LodParameters"))
                .expect("the block is there");
            let TypeInner::Struct { members, .. } = &block.inner else {
                panic!("{path}: the block is a struct");
            };
            let names: Vec<&str> = members.iter().filter_map(|m| m.name.as_deref()).collect();
            let returning = returning(&text, &names);
            // No stage of the source goes with it, so it is no source of lodc's.
            let module = naga::front::wgsl::parse_str(&returning)
                .unwrap_or_else(|e| panic!("{path}: {}\n{text}", e.emit_to_string(&returning)));
            let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
            let info = validator.validate(&module);
            let returning = Source {
                info: info.unwrap_or_else(|e| panic!("{path}: {e:?}\n{text}")),
                module,
                ..source.clone()
            };
            let settled = |source: &Source, autolod: f64| {
                let constants = [("autoLOD".to_owned(), autolod)].into_iter().collect();
                let (module, _) = naga::back::pipeline_constants::process_overrides(
                    &source.module,
                    &source.info,
                    None,
                    &constants,
                )
                .unwrap_or_else(|e| panic!("{path}: {e}"));
                module.into_owned()
            };
            let module = settled(&returning, 0.0);
            let entry = module
                .entry_points
                .iter()
                .position(|e| e.name == "returning");
            let all = bytes(&module, entry.expect("it is there"), members, bindings);
            for level in &levels {
                let shader = &level.shader;
                let (stage, entry) = shader.parameters_returned().expect("it has a block");
                let own = bytes(&stage, entry, shader.parameters(), bindings);
                let block = shader.parameter_block().expect("it has one");
                let read = shader.module().global_variables[block.read].name.clone();
                let own = bound(bindings, shader.module(), &read.expect("a name"), own);
                let wanted = outputs(shader.module(), &source.fragment, &own);
                let emitted = settled(&emitted, f64::from(level.autolod));
                let all = bound(bindings, &emitted, "parameters", all.clone());
                let found = outputs(&emitted, &source.fragment, &all);
                assert!(
                    wanted.is_some() && found == wanted,
                    "{path} at {}\n{text}",
                    level.autolod
                );
            }
            true
        });
        let drawn = drawn.count();
        assert!(drawn > 5, "{drawn}");
    }
}
