//! The outside judges: Tint, the compiler of Chromium, sees WGSL, and `spirv-val` sees SPIR-V.
//!
//! Both come from `.ci/run`. Where one is missing its tests say `SKIPPED` aloud, and fail when `CI` is set,
//! so that a machine that lost it cannot pass in silence.

mod fixtures;

use lodc::emit::{self, EmitLevel, Form, Output, Target, Transition};
use lodc::front::Source;
use lodc_passes::{Facts, Shader, all_passes, normalize};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The repository.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The name that messages call a shader by: its file's, without the extension.
fn stem(path: &Path) -> String {
    let name = path.file_stem().expect("a file");
    name.to_string_lossy().into_owned()
}

/// Names and texts of the `.wgsl` files of a folder under `testdata/`, in the order of their names.
fn wgsl_texts(folder: &str) -> Vec<(String, String)> {
    fixtures::shaders(Path::new("testdata").join(folder))
        .into_iter()
        .filter(|path| path.extension().is_some_and(|e| e == "wgsl"))
        .map(|path| {
            let text = fs::read_to_string(&path).expect("a text file");
            (stem(&path), text)
        })
        .collect()
}

/// A fresh folder for files that a judge reads.
fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a writable target folder");
    folder
}

/// Says that a judge is missing; in CI that is a failure.
fn skipped(judge: &str) {
    assert!(
        std::env::var_os("CI").is_none(),
        "{judge} is missing; .ci/run installs it"
    );
    println!("SKIPPED: {judge} is missing; .ci/run installs it");
}

/// Shows named WGSL texts to Tint. Its errors, one a line; `None` where Tint is not installed.
fn tint(test: &str, texts: &[(String, String)]) -> Option<Vec<String>> {
    let judge = root().join("tests/tint");
    let node = Command::new("node").arg("--version").output();
    if !judge.join("node_modules/webgpu").is_dir() || node.is_err() {
        skipped("Tint (npm package webgpu, and node)");
        return None;
    }
    let folder = scratch(test);
    let mut command = Command::new("node");
    command.arg(judge.join("check.mjs")).current_dir(&folder);
    for (name, text) in texts {
        let file = format!("{name}.wgsl");
        fs::write(folder.join(&file), text).expect("a writable target folder");
        command.arg(file);
    }
    let output = command.output().expect("node starts");
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut lines: Vec<String> = stdout.lines().map(str::to_owned).collect();
    assert_eq!(
        lines.pop(),
        Some(format!("checked {}", texts.len())),
        "Tint did not finish: {}{}",
        stdout,
        String::from_utf8_lossy(&output.stderr),
    );
    let errors = lines.iter().filter_map(|line| line.strip_prefix("error "));
    Some(errors.map(str::to_owned).collect())
}

/// Shows a named SPIR-V module to `spirv-val`. Its complaint, empty if there is none; `None` where it is not installed.
fn spirv_val(test: &str, name: &str, words: &[u32]) -> Option<String> {
    let file = scratch(&format!("{test}-{name}")).join("module.spv");
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    fs::write(&file, bytes).expect("a writable target folder");
    let Ok(output) = Command::new("spirv-val")
        .args(["--target-env", "vulkan1.1"])
        .arg(&file)
        .output()
    else {
        skipped("spirv-val (Debian package spirv-tools)");
        return None;
    };
    if output.status.success() {
        return Some(String::new());
    }
    let complaint = [output.stdout, output.stderr].concat();
    Some(format!(
        "{name}: {}",
        String::from_utf8_lossy(&complaint).trim()
    ))
}

/// Parses and validates WGSL with naga, which is what lodc itself uses.
fn validated(name: &str, text: &str) -> (naga::Module, naga::valid::ModuleInfo) {
    let module = naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(text, name)));
    let info = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::all(),
    )
    .validate(&module)
    .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(text, name)));
    (module, info)
}

/// The SPIR-V of a valid module, with its overrides at their defaults.
fn spirv(module: &naga::Module, info: &naga::valid::ModuleInfo) -> Vec<u32> {
    let (module, info) = naga::back::pipeline_constants::process_overrides(
        module,
        info,
        None,
        &naga::back::PipelineConstants::default(),
    )
    .expect("every override has a default");
    naga::back::spv::write_vec(&module, &info, &naga::back::spv::Options::default(), None)
        .expect("naga writes SPIR-V of what it validated")
}

/// A shader after `count` changes that need no facts, spread over what can be changed; without those that `moves` to the
/// vertex stage says no to.
fn simplified(base: &Shader, count: usize, moves: bool) -> Shader {
    let facts = Facts::default();
    let mut shader = base.clone();
    for step in 0..count {
        let passes = all_passes().filter(|pass| moves || pass.name() != "vertex-motion");
        let all = passes.flat_map(|pass| {
            let candidates = pass.candidates(&shader, &facts).into_iter();
            candidates.map(move |candidate| (pass, candidate))
        });
        let mut all: Vec<_> = all.collect();
        if all.is_empty() {
            break;
        }
        let (pass, candidate) = all.swap_remove(step * 7919 % all.len());
        shader = pass.apply(&shader, &candidate);
    }
    shader
}

/// The levels that a shader is emitted with here: its normal form, and two simpler ones.
fn levels(base: &Shader, moves: bool) -> Vec<EmitLevel> {
    [0, 3, 12]
        .iter()
        .enumerate()
        .map(|(at, &count)| EmitLevel {
            autolod: 0.5 + at as f32,
            shader: simplified(base, count, moves),
            distance: 2.0,
            error: 0.01,
            cost: 0.5,
            time: None,
            says: format!("{count} changes"),
        })
        .collect()
}

/// Whether a file is of a kind, by its extension.
fn is_a(path: &Path, kind: &str) -> bool {
    path.extension().is_some_and(|extension| extension == kind)
}

/// Shows every shader of a folder to the judges in every form, with levels.
fn emitted(folder: &str) {
    let mut wgsl = Vec::new();
    let mut of_pixels_count = 0;
    for path in fixtures::shaders(Path::new("testdata").join(folder)) {
        let name = stem(&path);
        let source = Source::read(&path).unwrap_or_else(|e| panic!("{e}"));
        let base = normalize(
            &source.module,
            source.vertex.as_deref(),
            &source.fragment,
            100_000,
        )
        .unwrap_or_else(|e| panic!("{}: {e}", source.name));
        let levels = [true, false].map(|moves| levels(&base, moves));
        let forms = [Form::Override, Form::Uniform, Form::Files].map(|form| Output {
            form,
            ..Output::default()
        });
        let bands = [Transition::Blend, Transition::Dither].map(|transition| Output {
            form: Form::Uniform,
            transition,
            ..Output::default()
        });
        let of_pixels = Output {
            per_pixel: Some(0.001),
            ..bands[1]
        };
        let all = forms.into_iter().chain(bands).chain([of_pixels]);
        for output in all {
            let Output {
                form,
                transition,
                per_pixel,
                ..
            } = output;
            let levels = &levels[usize::from(per_pixel.is_some())];
            let write = |target| emit::emit(&source, &base, levels, Output { target, ..output });
            let files = match write(Target::Wgsl) {
                // What it returns cannot be mixed, its autoLOD is one of a pipeline, or its pixels have no coordinates.
                Err(_) if transition != Transition::Pop => continue,
                written => written.unwrap_or_else(|e| panic!("{e}")),
            };
            // Beside the shader there may be Rust that fills its block.
            for (path, bytes) in files.into_iter().filter(|(path, _)| is_a(path, "wgsl")) {
                let stem = path.file_stem().expect("a name").to_string_lossy();
                let text = String::from_utf8(bytes).expect("WGSL is text");
                of_pixels_count += usize::from(per_pixel.is_some());
                let of_pixel = if per_pixel.is_some() {
                    "_per_pixel"
                } else {
                    ""
                };
                let kind = format!("{stem}_{}_{}{of_pixel}", form.name(), transition.name());
                wgsl.push((kind, text));
            }
            // Only WGSL carries overrides, also those of the author that choose a level.
            let Ok(files) = write(Target::Spirv) else {
                let overrides = form == Form::Override || !source.module.overrides.is_empty();
                assert!(overrides, "{name} has no {} in SPIR-V", form.name());
                continue;
            };
            for (path, bytes) in files.into_iter().filter(|(path, _)| is_a(path, "spv")) {
                let words: Vec<u32> = bytes
                    .chunks_exact(4)
                    .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
                    .collect();
                let test = format!("emitted_{folder}_{}", form.name());
                let module = path.display().to_string();
                if let Some(complaint) = spirv_val(&test, &module, &words) {
                    assert!(complaint.is_empty(), "{complaint}");
                }
            }
        }
    }
    assert!(of_pixels_count > 2, "{of_pixels_count} of {folder}");
    if let Some(errors) = tint(&format!("tint_emitted_{folder}"), &wgsl) {
        assert!(errors.is_empty(), "{errors:#?}");
    }
}

/// Uniform control flow is what Tint checks and naga does not: if this passes, Tint is not looking.
#[test]
fn tint_refuses_a_sample_under_a_varying_branch() {
    let bad = "@group(0) @binding(0) var t: texture_2d<f32>;
@group(0) @binding(1) var s: sampler;
@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {
    if uv.x > 0.5 { return textureSample(t, s, uv); }
    return vec4f(1.0);
}";
    validated("bad", bad);
    let texts = [
        ("bad".to_owned(), bad.to_owned()),
        ("broken".to_owned(), "fn f( {".to_owned()),
    ];
    let Some(errors) = tint("tint_refuses", &texts) else {
        return;
    };
    assert!(errors.len() >= 2, "{errors:#?}");
    assert!(
        errors[0].starts_with("bad.wgsl:4:") && errors[0].contains("uniform control flow"),
        "{errors:#?}"
    );
    assert!(errors[1].starts_with("broken.wgsl:1:"), "{errors:#?}");
}

#[test]
fn spirv_val_refuses_a_module_without_a_memory_model() {
    // A header, and nothing else.
    let words = [0x0723_0203, 0x0001_0300, 0, 1, 0];
    if let Some(complaint) = spirv_val("spirv_val_refuses", "empty", &words) {
        assert!(!complaint.is_empty());
    }
}

/// Shows every WGSL shader of a folder, as its author wrote it, to naga, Tint and `spirv-val`.
fn judged(folder: &str) {
    let texts = wgsl_texts(folder);
    for (name, text) in &texts {
        let (module, info) = validated(name, text);
        if let Some(complaint) = spirv_val(folder, name, &spirv(&module, &info)) {
            assert!(complaint.is_empty(), "{complaint}");
        }
    }
    if let Some(errors) = tint(&format!("tint_{folder}"), &texts) {
        assert!(errors.is_empty(), "{errors:#?}");
    }
}

#[test]
fn judges_accept_the_materials() {
    judged("materials");
}

#[test]
fn judges_accept_the_adversarial_shaders() {
    judged("shaders");
}

#[test]
fn judges_accept_what_is_emitted_for_the_materials() {
    emitted("materials");
}

#[test]
fn judges_accept_what_is_emitted_for_the_adversarial_shaders() {
    emitted("shaders");
}
