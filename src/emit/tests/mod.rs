//! Emission as a whole: small shaders for what is easily got wrong, and every shader under `testdata/`.

mod parameters;
#[cfg(feature = "search")]
mod per_pixel;
#[cfg(feature = "search")]
mod transition;
mod vertex;

use super::*;
use crate::fixtures;
use lodc_passes::shader::Stage;

/// The normal form of a source.
fn base(source: &Source) -> Shader {
    crate::compile::normal_form(source).unwrap_or_else(|e| panic!("{e}"))
}

/// A level that does what the source does.
fn level(source: &Source, autolod: f32) -> EmitLevel {
    EmitLevel {
        autolod,
        shader: base(source),
        distance: 2.0,
        error: 0.019,
        cost: 0.5,
        time: None,
        says: "detail left out".to_owned(),
    }
}

fn source(text: &str) -> Source {
    Source::parse("dir/test.wgsl", text).unwrap_or_else(|e| panic!("{e}"))
}

fn output(form: Form, target: Target) -> Output {
    Output {
        form,
        target,
        ..Output::default()
    }
}

/// The text with two levels, in a form.
#[track_caller]
fn emitted(text: &str, form: Form) -> String {
    let source = source(text);
    let levels = [level(&source, 0.85), level(&source, 2.1)];
    let files = emit(&source, &base(&source), &levels, output(form, Target::Wgsl))
        .unwrap_or_else(|e| panic!("{e}"));
    let (name, bytes) = files.into_iter().next_back().expect("there is a file");
    let expected = if form == Form::Files {
        "test.lod2.wgsl"
    } else {
        "test.lod.wgsl"
    };
    assert_eq!(name, Path::new(expected));
    String::from_utf8(bytes).expect("it is text")
}

#[track_caller]
fn has(text: &str, part: &str) {
    assert!(text.contains(part), "no `{part}` in\n{text}");
}

#[test]
fn a_level_at_zero_takes_the_place_of_the_original() {
    let source = source(SMALL);
    let levels = [level(&source, 0.0), level(&source, 2.1)];
    let emitted = |levels: &[EmitLevel], form| {
        let files = emit(&source, &base(&source), levels, output(form, Target::Wgsl));
        let files = files.unwrap_or_else(|e| panic!("{e}"));
        let texts = files.into_iter().map(|(name, bytes)| {
            let text = String::from_utf8(bytes).expect("it is text");
            (name.display().to_string(), text)
        });
        texts.collect::<Vec<_>>()
    };
    for form in [Form::Override, Form::Uniform] {
        let text = &emitted(&levels, form)[0].1;
        assert!(!text.contains("original_fs_main"), "{text}");
        has(
            text,
            "// 0      0.00     -      0.50  detail left out\n// 1      2.10 ",
        );
        has(
            text,
            ">= 2.1) { return lod_zero_fs_main(uv0); }\n    return lod_one_fs_main(uv0);",
        );
        has(text, "// Level 0. Detail left out.\nfn lod_zero_fs_main(");
        let alone = &emitted(&levels[..1], form)[0].1;
        has(alone, "{\n    return lod_zero_fs_main(uv0);\n}");
    }
    let files = emitted(&levels, Form::Files);
    assert_eq!(files[0].0, "test.lod0.wgsl");
    has(&files[0].1, "// Level 0 of test.wgsl");
    assert_eq!(files[1].0, "test.lod1.wgsl");
    assert_eq!(files.len(), 2);
}

/// A small material with a name of every awkward kind.
const SMALL: &str = "\
// A material. /* fn fs_main */
struct Material { rough1: f32, tint__x: vec3f, }
struct Varyings { @builtin(position) at: vec4f, @location(0) uv0: vec2f, }
@group(0) @binding(0) var<uniform> mat_1: Material;
@group(1) @binding(2) var colours: texture_2d<f32>;
@group(1) @binding(3) var colours_sampler: sampler;

@vertex
fn vs_main(@location(0) p: vec4f) -> Varyings { return Varyings(p, p.xy); }

@fragment // the one
fn fs_main(@location(0) uv0: vec2f) -> @location(0) vec4f {
    let base = textureSample(colours, colours_sampler, uv0 * 2.0).rgb; // twice
    return vec4f(base * mat_1.rough1 + mat_1.tint__x, 1.0);
}
";

#[test]
fn the_authors_text_stays_as_it_is() {
    let text = emitted(SMALL, Form::Override);
    let authors = SMALL.replace(
        "@fragment // the one\nfn fs_main(@location(0) uv0: vec2f) -> @location(0) vec4f",
        "// the one\nfn original_fs_main(uv0: vec2f) -> vec4f",
    );
    let (header, rest) = text.split_once("\n\n").expect("a header and the rest");
    assert!(rest.starts_with(&authors), "{text}");
    assert!(header.lines().all(|line| line.starts_with("// ")), "{text}");
    assert_eq!(
        rest[authors.len()..],
        *"
// Halvings of scale on screen since the nearest view; 0, the default, is the original.
override autoLOD: f32 = 0.0;

@fragment // the one
fn fs_main(@location(0) uv0: vec2f) -> @location(0) vec4f {
    if !(autoLOD >= 0.85) { return original_fs_main(uv0); }
    if !(autoLOD >= 2.1) { return lod_one_fs_main(uv0); }
    return lod_two_fs_main(uv0);
}

// Level 1. Detail left out.
fn lod_one_fs_main(uv0: vec2f) -> vec4f {
    let base = textureSample(colours, colours_sampler, uv0 * 2.0).xyz;
    return vec4f(base * mat_1.rough1 + mat_1.tint__x, 1.0);
}

// Level 2. Detail left out.
fn lod_two_fs_main(uv0: vec2f) -> vec4f {
    let base = textureSample(colours, colours_sampler, uv0 * 2.0).xyz;
    return vec4f(base * mat_1.rough1 + mat_1.tint__x, 1.0);
}
"
    );
}

#[test]
fn the_header_lists_the_levels() {
    let text = emitted(SMALL, Form::Override);
    assert!(text.starts_with(
        "// Levels of detail of test.wgsl, by lodc (lock format 1). Made from test.lod.toml: change that, not this.\n\
         // level  autoLOD  error  cost  what changed\n\
         // 0      0.00     -      1.00  the original\n\
         // 1      0.85     0.019  0.50  detail left out\n\
         // 2      2.10     0.019  0.50  detail left out\n\n"
    ), "{text}");
}

#[test]
fn another_name_is_that_of_the_lock_too() {
    let source = source(SMALL);
    let files = emit_as(
        &source,
        &base(&source),
        &[level(&source, 1.0)],
        Output::default(),
        "other",
    )
    .unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(files[0].0, Path::new("other.lod.wgsl"));
    let text = String::from_utf8_lossy(&files[0].1);
    assert!(
        text.starts_with(
            "// Levels of detail of test.wgsl, by lodc (lock format 1). Made from other.lod.toml:"
        ),
        "{text}"
    );
}

#[test]
fn level_0_in_files_is_the_source() {
    let source = source(SMALL);
    let files = emit(
        &source,
        &base(&source),
        &[level(&source, 1.0)],
        output(Form::Files, Target::Wgsl),
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let names: Vec<_> = files
        .iter()
        .map(|(name, _)| name.to_string_lossy())
        .collect();
    assert_eq!(names, ["test.lod0.wgsl", "test.lod1.wgsl"]);
    assert_eq!(files[0].1, SMALL.as_bytes());
    let text = String::from_utf8_lossy(&files[1].1);
    has(&text, "struct Material { rough1: f32, tint__x: vec3f, }");
    has(
        &text,
        "@fragment\nfn fs_main(@location(0) uv0: vec2f) -> @location(0) vec4f {\n",
    );
    has(&text, "@vertex\nfn vs_main(");
    has(&text, "// Level 1 of test.wgsl");
    has(&text, "// From autoLOD 1.00 on. Detail left out.\n");
}

#[test]
fn the_uniform_takes_a_free_binding() {
    let text = emitted(SMALL, Form::Uniform);
    has(
        &text,
        "@group(1) @binding(4) var<uniform> level_of_detail: LevelOfDetail;",
    );
    has(&text, "if !(level_of_detail.autoLOD >= 0.85) {");
    assert!(!text.contains("override"));
    let text = "@fragment fn fs_main() -> @location(0) vec4f { return vec4f(); }";
    has(&emitted(text, Form::Uniform), "@group(0) @binding(0)");
}

#[test]
fn generated_names_avoid_the_authors() {
    let text = emitted(
        "fn original_fs_main() -> f32 { let lod_one_fs_main = 1.0; return lod_one_fs_main; }
         struct LevelOfDetail { level_of_detail: f32 }
         @fragment fn fs_main(@location(0) autoLOD: f32) -> @location(0) vec4f {
             let lod_two_fs_main = LevelOfDetail(autoLOD + original_fs_main());
             return vec4f(lod_two_fs_main.level_of_detail);
         }",
        Form::Override,
    );
    has(&text, "fn original_fs_main_b(autoLOD: f32) -> vec4f");
    has(
        &text,
        "@fragment fn fs_main(@location(0) autoLOD_b: f32) -> @location(0) vec4f {",
    );
    has(
        &text,
        "if !(autoLOD >= 0.85) { return original_fs_main_b(autoLOD_b); }",
    );
    has(&text, "fn lod_one_fs_main_b(autoLOD: f32)");
    has(&text, "fn lod_two_fs_main_b(autoLOD: f32)");
    let text = emitted(
        "struct LevelOfDetail { level_of_detail: f32 }
         @fragment fn fs_main() -> @location(0) vec4f { return vec4f(LevelOfDetail(1.0).level_of_detail); }",
        Form::Uniform,
    );
    has(&text, "var<uniform> level_of_detail_b: LevelOfDetail_b;");
}

#[test]
fn an_autolod_of_the_authors_is_used() {
    let body = "@fragment fn fs_main(@location(0) view: f32) -> @location(0) vec4f { return vec4f(view); }";
    let text = emitted(
        &format!("@id(7) override autoLOD: f32 = 0.5; {body}"),
        Form::Uniform,
    );
    has(&text, "if !(autoLOD >= 0.85) {");
    assert_eq!(text.matches("override").count(), 1);
    assert!(!text.contains("LevelOfDetail"));

    let text = emitted(
        &format!("@group(0) @binding(0) var<uniform> autoLOD: f32; {body}"),
        Form::Override,
    );
    has(&text, "if !(autoLOD >= 0.85) {");
    assert!(!text.contains("override"));

    let text = emitted(
        &format!(
            "struct Lod {{ pad: f32, autoLOD: f32 }} struct View {{ lod: Lod }}
             @group(0) @binding(0) var<uniform> view: View; {body}"
        ),
        Form::Override,
    );
    has(&text, "fs_main(@location(0) view_b: f32)");
    has(
        &text,
        "if !(view.lod.autoLOD >= 0.85) { return original_fs_main(view_b); }",
    );

    // By a uniform of the author's, other languages can carry it too.
    let source = source(&format!(
        "@group(0) @binding(0) var<uniform> autoLOD: f32; {body}"
    ));
    assert!(
        emit(
            &source,
            &base(&source),
            &[level(&source, 1.0)],
            output(Form::Override, Target::Spirv)
        )
        .is_ok()
    );
}

#[test]
fn an_autolod_that_no_host_sets_is_an_error_at_its_place() {
    let text = "const autoLOD = 1.0;\n@fragment fn fs_main() -> @location(0) vec4f { return vec4f(autoLOD); }";
    let source = source(text);
    let error = emit(
        &source,
        &base(&source),
        &[level(&source, 1.0)],
        Output::default(),
    )
    .expect_err("it cannot be used");
    assert_eq!(&text[error.labels[0].0.clone()], "autoLOD");
    assert!(!error.notes.is_empty());
}

#[test]
fn entry_points_of_every_shape_are_called() {
    let text = emitted(
        "struct In { @builtin(position) p: vec4f, @location(0) @interpolate(flat) id: u32, }
         struct Out { @location(0) colour: vec4f, @builtin(frag_depth) depth: f32, }
         @fragment fn fs_main(in: In, @builtin(front_facing) front: bool, @builtin(sample_index) s: u32) -> Out {
             return Out(vec4f(in.p.x, f32(in.id), f32(s), select(0.0, 1.0, front)), in.p.z);
         }",
        Form::Override,
    );
    has(
        &text,
        "fn original_fs_main(in: In, front: bool, s: u32) -> Out {",
    );
    has(&text, "return lod_two_fs_main(in, front, s);");
    // The front end wants a colour, but the splice itself does not.
    let mut source = source(
        "@fragment fn fs_main(@location(0) v: f32) -> @location(0) vec4f { return vec4f(v); }",
    );
    let (base, mut level) = (base(&source), level(&source, 0.85));
    level.says.clear();
    source.text = "@fragment fn fs_main(@builtin(position) p: vec4f) { if p.x < 1.0 { discard; } }"
        .to_owned();
    let text = splice::splice(
        &source,
        &base,
        &[level],
        output(Form::Override, Target::Wgsl),
        "test",
    )
    .unwrap_or_else(|e| panic!("{e}"))
    .text;
    has(
        &text,
        "if !(autoLOD >= 0.85) { original_fs_main(p); return; }",
    );
    has(&text, "    lod_one_fs_main(p);\n}");
}

#[test]
fn what_the_author_hides_gets_another_name() {
    let text = emitted(
        "const length = 3.0; @group(0) @binding(0) var<uniform> distance: vec4f;
         fn mix(a: f32) -> f32 { return a * length; }
         @fragment fn fs_main(@location(0) v: vec2f) -> @location(0) vec4f { return vec4f(mix(sqrt(v.x))) + distance; }",
        Form::Override,
    );
    // Nothing that the levels need is hidden, so the text stands.
    has(&text, "const length = 3.0;");
    let text = "// A colour.
        @group(0) @binding(0) var<uniform> select: vec4f; // and its use
        struct Pair { select: f32, mix: f32 }
        override gain = 2.0; override twice = gain * 2.0;
        fn saturate(a: f32) -> f32 { let p = Pair(a * twice, 1.0); return p.select; }
        @fragment fn fs_main(@location(0) v: vec2f) -> @location(0) vec4f {
            var x = 1.0;
            if v.x > 0.5 { x = v.y; }
            return vec4f(saturate(v.x)) + select * x;
        }";
    let spliced = emitted(text, Form::Override);
    has(
        &spliced,
        "var<uniform> select_b: vec4f; // and its use\n        struct Pair { select: f32, mix: f32 }",
    );
    has(
        &spliced,
        "fn saturate(a: f32) -> f32 { let p = Pair(a * twice, 1.0); return p.select; }",
    );
    has(&spliced, "return vec4f(saturate(v.x)) + select_b * x;");
    has(&spliced, "= select(1.0, v.y, v.x > 0.5);");
    let alone = emitted(text, Form::Files);
    has(&alone, "var<uniform> select_b: vec4f;");
    has(&alone, "override twice = gain * 2.0;");
    has(&alone, "= select(1.0, v.y, v.x > 0.5);");
}

#[test]
fn a_name_that_the_host_knows_cannot_change() {
    let text = "override select = 2.0;
        @fragment fn fs_main(@location(0) v: vec2f) -> @location(0) vec4f {
            var x = 1.0;
            if v.x > 0.5 { x = v.y; }
            return vec4f(select * x);
        }";
    let source = source(text);
    for form in [Form::Override, Form::Files] {
        let error = emit(
            &source,
            &base(&source),
            &[level(&source, 1.0)],
            output(form, Target::Wgsl),
        )
        .expect_err("the level needs `select`");
        assert_eq!(&text[error.labels[0].0.clone()], "select");
        assert!(!error.notes.is_empty());
    }
}

#[test]
fn diagnostics_and_extensions_stay_in_force() {
    let text = "enable f16;
        diagnostic(off, derivative_uniformity);
        @diagnostic(warning, derivative_uniformity)
        fn helper(v: f32) -> f32 { if v > 0.5 { return dpdx(v); } return 0.0; }
        @diagnostic(off, derivative_uniformity)
        @fragment
        fn fs_main(@location(0) v: f32) -> @location(0) vec4f { let h = f16(v); return vec4f(helper(v) + f32(h)); }";
    let spliced = emitted(text, Form::Override);
    has(&spliced, "\n\nenable f16;");
    has(
        &spliced,
        "// Level 1. Detail left out.\n@diagnostic(off, derivative_uniformity)\nfn lod_one_fs_main(",
    );
    let alone = emitted(text, Form::Files);
    has(
        &alone,
        "\n\nenable f16;\ndiagnostic(off, derivative_uniformity);\n",
    );
    has(
        &alone,
        "\n@diagnostic(off, derivative_uniformity)\n@fragment\nfn fs_main(",
    );
}

#[test]
fn line_ends_are_the_authors() {
    let text = SMALL.replace('\n', "\r\n");
    for form in [Form::Override, Form::Uniform, Form::Files] {
        let text = emitted(&text, form);
        assert_eq!(
            text.matches('\n').count(),
            text.matches("\r\n").count(),
            "{form:?} {text:?}"
        );
    }
    // A text that does not end its last line.
    has(
        &emitted(SMALL.trim_end(), Form::Override),
        "}\n\n// Halvings",
    );
}

#[test]
fn without_levels_the_original_is_written() {
    let source = source(SMALL);
    let files =
        emit(&source, &base(&source), &[], Output::default()).unwrap_or_else(|e| panic!("{e}"));
    let text = String::from_utf8_lossy(&files[0].1).into_owned();
    has(&text, SMALL);
    // A host that sets the constant finds it.
    has(&text, "override autoLOD: f32 = 0.0;");
}

#[test]
fn thresholds_rise() {
    let source = source(SMALL);
    for thresholds in [
        [0.0, 0.0],
        [1.0, 1.0],
        [2.0, 1.0],
        [1.0, f32::NAN],
        [1.0, f32::INFINITY],
    ] {
        let levels = thresholds.map(|autolod| level(&source, autolod));
        assert!(
            emit(&source, &base(&source), &levels, Output::default()).is_err(),
            "{thresholds:?}"
        );
    }
}

#[test]
fn every_language_is_written_where_it_can_carry_the_form() {
    let source = source(SMALL);
    let levels = [level(&source, 1.0)];
    for (target, extensions) in [
        (Target::Spirv, &["spv"][..]),
        (Target::Glsl, &["vert.glsl", "frag.glsl"]),
        (Target::Hlsl, &["hlsl"]),
        (Target::Msl, &["metal"]),
    ] {
        let error = emit(
            &source,
            &base(&source),
            &levels,
            output(Form::Override, target),
        )
        .expect_err("no language has it");
        assert!(error.message.contains(target.name()), "{error}");
        assert!(
            error
                .notes
                .iter()
                .any(|note| note.contains("--form uniform")),
            "{error}"
        );

        let files = emit(
            &source,
            &base(&source),
            &levels,
            output(Form::Uniform, target),
        )
        .unwrap_or_else(|e| panic!("{e}"));
        let names: Vec<_> = files
            .iter()
            .map(|(name, _)| name.to_string_lossy().into_owned())
            .collect();
        let expected: Vec<_> = extensions.iter().map(|e| format!("test.lod.{e}")).collect();
        assert_eq!(names, expected);

        let files = emit(
            &source,
            &base(&source),
            &levels,
            output(Form::Files, target),
        )
        .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(files.len(), 2 * extensions.len());
        assert!(files.iter().all(|(_, bytes)| !bytes.is_empty()));
    }
}

#[test]
fn a_constant_without_a_default_is_named_where_it_cannot_be_carried() {
    let source = source(
        "override gain: f32; @fragment fn fs_main() -> @location(0) vec4f { return vec4f(gain); }",
    );
    let error = emit(
        &source,
        &base(&source),
        &[level(&source, 1.0)],
        output(Form::Uniform, Target::Hlsl),
    )
    .expect_err("it has no value");
    assert!(error.message.contains("gain"), "{error}");
}

#[test]
fn every_shader_is_emitted_in_every_form() {
    let mut seen = 0;
    for path in fixtures::complete() {
        let source = Source::read(&path).unwrap_or_else(|e| panic!("{e}"));
        let first = level(&source, 0.85);
        let second = EmitLevel {
            autolod: 2.1,
            ..first.clone()
        };
        let levels = [first, second];
        for form in [Form::Override, Form::Uniform, Form::Files] {
            // What is emitted is read back before it is returned.
            let first = emit(&source, &base(&source), &levels, output(form, Target::Wgsl))
                .unwrap_or_else(|e| panic!("{e}"));
            let second = emit(&source, &base(&source), &levels, output(form, Target::Wgsl))
                .unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(first, second);
            for (name, bytes) in first {
                let text = String::from_utf8_lossy(&bytes).into_owned();
                let numbered = tokens::words(&text).into_iter().find(|word| {
                    let digits = word.strip_prefix("_e").unwrap_or_default();
                    !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
                });
                let numbered = numbered.filter(|word| !source.text.contains(word));
                assert_eq!(numbered, None, "{}:\n{text}", name.display());
            }
        }
        if !source
            .module
            .overrides
            .iter()
            .any(|(_, o)| o.name.as_deref() == Some("autoLOD"))
        {
            emit(
                &source,
                &base(&source),
                &levels,
                output(Form::Uniform, Target::Spirv),
            )
            .unwrap_or_else(|e| panic!("{e}"));
        }
        seen += 1;
    }
    assert!(seen > 30, "{seen}");
}

#[cfg(feature = "search")]
mod meaning {
    //! Runs what was emitted: every level gives what its variant gives, to the bit.

    use super::*;
    use crate::eval::lane::{LANES, Mask, Words};
    use crate::eval::machine::{Bindings, Machine};
    use crate::eval::program::Program;
    use crate::scene::Scene;
    use naga::{Module, ScalarKind, ShaderStage};
    use rayon::prelude::*;

    /// What a module's fragment stage returns for fixed inputs, and which lanes it keeps; `None` when the evaluator
    /// does not run it.
    pub(super) fn outputs(
        module: &Module,
        name: &str,
        bindings: &Bindings,
    ) -> Option<(Vec<Words>, Mask)> {
        let is_wanted = |e: &naga::EntryPoint| e.stage == ShaderStage::Fragment && e.name == name;
        let entry = module.entry_points.iter().position(is_wanted)?;
        let program = Program::compile(module, entry, &[]).ok()?;
        let inputs: Vec<Words> = program
            .inputs()
            .iter()
            .map(|slot| {
                // The same for an input whatever other inputs there are.
                let place = match slot.binding {
                    naga::Binding::Location { location, .. } => format!("{location}"),
                    naga::Binding::BuiltIn(built_in) => format!("{built_in:?}"),
                };
                let place = format!("{place} {}", slot.component);
                let mut state = place.bytes().fold(1u32, |state, byte| {
                    (state ^ u32::from(byte)).wrapping_mul(16_777_619)
                });
                let mut random = || {
                    state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                    state >> 8
                };
                std::array::from_fn(|_| match slot.kind {
                    ScalarKind::Float => (random() as f32 / (1 << 23) as f32 - 0.5).to_bits(),
                    ScalarKind::Bool => random() & 1,
                    _ => random() & 7,
                })
            })
            .collect();
        let mut outputs = vec![[0; LANES]; program.outputs().len()];
        let kept =
            Machine::new(&program, bindings).run(&inputs, Mask::ALL, Mask::ALL, &mut outputs);
        Some((outputs, kept))
    }

    /// The module of an emitted text, with autoLOD set.
    fn at(text: &str, source: &Source, autolod: f64) -> Module {
        let emitted = read_back(text, source).unwrap_or_else(|e| panic!("{e}"));
        let stage = (ShaderStage::Fragment, source.fragment.as_str());
        let constants = [("autoLOD".to_owned(), autolod)].into_iter().collect();
        let (module, _) = naga::back::pipeline_constants::process_overrides(
            &emitted.module,
            &emitted.info,
            Some(stage),
            &constants,
        )
        .unwrap_or_else(|e| panic!("{e}"));
        module.into_owned()
    }

    #[test]
    fn every_level_does_what_its_variant_does() {
        let paths = fixtures::complete();
        assert!(paths.len() > 30, "{}", paths.len());
        paths.par_iter().for_each(|path| {
            let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
            let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
            let bindings = &scene.frames(scene.nearest)[0].bindings;
            let name = &source.fragment;
            let levels = [level(&source, 1.0)];
            let variant = outputs(levels[0].shader.module(), name, bindings);
            assert!(variant.is_some(), "{}", path.display());

            let files = emit(
                &source,
                &base(&source),
                &levels,
                output(Form::Files, Target::Wgsl),
            );
            let files = files.unwrap_or_else(|e| panic!("{e}"));
            let text = String::from_utf8_lossy(&files[1].1);
            let alone = read_back(&text, &source).unwrap_or_else(|e| panic!("{e}"));
            let got = outputs(&alone.module, name, bindings);
            assert!(got == variant, "{} alone", path.display());

            let files = emit(&source, &base(&source), &levels, Output::default())
                .unwrap_or_else(|e| panic!("{e}"));
            let text = String::from_utf8_lossy(&files[0].1);
            if !text.contains("override autoLOD") {
                return;
            }
            let original = outputs(&source.module, name, bindings);
            for (autolod, wanted) in [(0.0, &original), (0.99, &original), (1.0, &variant)] {
                let got = outputs(&at(&text, &source, autolod), name, bindings);
                assert!(got == *wanted, "{} at {autolod}", path.display());
            }
        });
    }
}
