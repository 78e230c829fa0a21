//! A text to a validated module, with naga's errors as diagnostics in the user's file.

use super::Source;
use super::names::whole_word;
use super::{glsl, settle};
use crate::{Diagnostic, Result};
use naga::valid::{Capabilities, ModuleInfo, ValidationError, ValidationFlags, Validator};
use naga::{Block, Module, ShaderStage, Span, Statement, WithSpan};
use std::error::Error;
use std::path::{Path, PathBuf};

/// What a shader may use: all that an engine could switch on. The evaluator refuses what it does not run
/// with a message of its own, at the expression.
pub const CAPABILITIES: Capabilities = Capabilities::all();

/// The stack that naga gets. Its parser recurses for nested source and its own limits assume the main
/// thread of an optimised build; this is far more than those limits can use, and only touched pages count.
const STACK: usize = 256 << 20;

/// The largest shader text, in bytes. Bevy's PBR is 0.12 MB composed; a text beyond this is a mistake, and
/// would only exhaust the stack.
const LARGEST: usize = 4 << 20;

/// How deep statements may be nested. Everything behind the reader walks blocks recursively, on threads
/// with the stack that the system gives.
const DEEPEST: usize = 256;

/// Validates a module as every module that lodc reads or writes is validated.
///
/// # Errors
/// As naga's validator.
pub fn validate(
    module: &Module,
) -> std::result::Result<ModuleInfo, Box<WithSpan<ValidationError>>> {
    Validator::new(ValidationFlags::all(), CAPABILITIES)
        .validate(module)
        .map_err(Box::new)
}

/// What a file is written in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Language {
    #[default]
    Wgsl,
    /// GLSL, which has a file a stage.
    Glsl(ShaderStage),
}

/// The language that a file's name says, when lodc reads it.
pub(super) fn language(path: &Path) -> Option<Language> {
    let extension = |path: &Path| Some(path.extension()?.to_str()?.to_ascii_lowercase());
    let of_stage = |extension: &str| match extension {
        "vert" | "vs" => Some(Language::Glsl(ShaderStage::Vertex)),
        "frag" | "fs" => Some(Language::Glsl(ShaderStage::Fragment)),
        _ => None,
    };
    match extension(path)?.as_str() {
        "wgsl" => Some(Language::Wgsl),
        // `rock.frag.glsl`; without a stage it is the one that shades.
        "glsl" => {
            let stage = path.file_stem().map(Path::new).and_then(extension);
            let named = stage.as_deref().and_then(of_stage);
            Some(named.unwrap_or(Language::Glsl(ShaderStage::Fragment)))
        }
        other => of_stage(other),
    }
}

/// The GLSL vertex shader beside a fragment shader, called alike.
pub(super) fn vertex_beside(path: &Path) -> Option<PathBuf> {
    if language(path) != Some(Language::Glsl(ShaderStage::Fragment)) {
        return None;
    }
    let name = path.file_name()?.to_str()?;
    let (stem, rest) = match name.strip_suffix(".glsl") {
        Some(before) => (before, ".glsl"),
        None => (name, ""),
    };
    let (stem, vertex) = match stem.rsplit_once('.')? {
        (stem, "fs") => (stem, "vs"),
        (stem, _) => (stem, "vert"),
    };
    let beside = path.with_file_name(format!("{stem}.{vertex}{rest}"));
    beside.is_file().then_some(beside)
}

/// Refuses a file that cannot have a vertex stage, by its name.
pub(super) fn expect_vertex(path: &Path, name: &str, readable: bool) -> Result<()> {
    match language(path) {
        Some(Language::Glsl(ShaderStage::Vertex)) => Ok(()),
        Some(Language::Glsl(_)) => Err(Diagnostic::error(format!(
            "`{name}` is a GLSL fragment shader, by its name: it has no vertex stage"
        ))
        .with_note("a GLSL vertex shader is called `.vert`")),
        _ => expect_known(path, name, readable),
    }
}

/// Refuses files that are in no language that lodc reads, by their names.
pub(super) fn expect_known(path: &Path, name: &str, readable: bool) -> Result<()> {
    let vertex = Language::Glsl(ShaderStage::Vertex);
    if !readable || language(path).is_some_and(|known| known != vertex) {
        return Ok(());
    }
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let language = match extension.to_ascii_lowercase().as_str() {
        "vert" | "vs" | "comp" | "geom" | "tesc" | "tese" => {
            return Err(Diagnostic::error(format!(
                "`{name}` is no fragment shader: lodc works on the stage that shades"
            ))
            .with_note("name the fragment shader, `.frag`"));
        }
        "hlsl" | "fx" | "hlsli" | "cginc" | "shader" => "HLSL",
        "wesl" => "WESL",
        "slang" => "Slang",
        "metal" | "msl" => "Metal",
        "spv" => "SPIR-V",
        _ => "",
    };
    Err(match language {
        "" => Diagnostic::error(format!("`{name}` is not a shader that lodc reads, by its name"))
            .with_note("lodc reads WGSL (`.wgsl`) and GLSL fragment shaders (`.frag`): give the file that extension if it is one"),
        language => Diagnostic::error(format!(
            "`{name}` is {language}, which this build does not read"
        ))
        .with_note("translate it to WGSL first, with `naga`, `tint` or `glslang` and `naga`"),
    })
}

/// Parses and validates a text.
pub(super) fn parse(name: &str, text: &str, language: Language) -> Result<(Module, ModuleInfo)> {
    if text.trim().is_empty() {
        let example = match language {
            Language::Wgsl => "@fragment fn ...",
            Language::Glsl(_) => "void main() { ... }",
        };
        return Err(
            Diagnostic::error(format!("`{name}` is empty")).with_note(format!(
                "a material shader has at least a fragment entry point: `{example}`"
            )),
        );
    }
    if text.len() > LARGEST {
        return Err(Diagnostic::error(format!(
            "`{name}` has {} bytes, more than the {LARGEST} that lodc reads",
            text.len()
        ))
        .with_note(
            "leave out what its entry points do not use, or compile its materials one by one",
        ));
    }
    on_deep_stack(name, || parse_here(name, text, language))
}

/// Runs what calls naga's reader on a thread of its own, which gives naga its stack, and turns a panic of naga
/// into an error here.
pub(super) fn on_deep_stack<T: Send>(
    name: &str,
    run: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    std::thread::scope(|scope| {
        std::thread::Builder::new()
            .stack_size(STACK)
            .spawn_scoped(scope, run)
            .map_err(|error| Diagnostic::error(format!("cannot start a thread: {error}")))?
            .join()
            .unwrap_or_else(|_| {
                Err(Diagnostic::error(format!("naga broke down on `{name}`"))
                    .with_note("this is a bug in naga's reader: please report it with the file"))
            })
    })
}

fn parse_here(name: &str, text: &str, language: Language) -> Result<(Module, ModuleInfo)> {
    let module = match language {
        Language::Wgsl => wgsl(name, text)?,
        Language::Glsl(stage) => {
            let mut module = glsl::parse(name, text, stage)?;
            settle::settle(&mut module);
            module
        }
    };
    let info = checked(name, text, &module)?;
    Ok((module, info))
}

/// Where the most brackets are open in a text, comments and all.
fn deepest(text: &str) -> usize {
    let (mut depth, mut most, mut place) = (0, 0, 0);
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'(' | b'[' | b'<' => depth += 1,
            b')' | b']' | b'>' => depth -= 1,
            b';' | b'{' | b'}' => depth = 0,
            _ => {}
        }
        if depth > most {
            (most, place) = (depth, at);
        }
    }
    place
}

fn wgsl(name: &str, text: &str) -> Result<Module> {
    naga::front::wgsl::parse_str(text).map_err(|error| {
        if let Some(foreign) = foreign_directive(name, text) {
            return foreign;
        }
        if error.notes().any(|note| note.contains("recursion limit")) {
            let place = deepest(text);
            return Diagnostic::error("brackets are nested deeper than lodc reads")
                .with_source(name, text)
                .with_label(place..place + 1, "the deepest is here")
                .with_note(
                    "name a part of it first: `let part = ...;`, or `alias Part = ...;` for a type",
                );
        }
        let located = Diagnostic::error(uncapitalised(error.message())).with_source(name, text);
        let labelled = error
            .labels()
            .fold(located, |d, (span, remark)| at(d, span, remark));
        let noted = error.notes().fold(labelled, |d, note| d.with_reason(note));
        match error.message().contains("nesting limit") {
            true => noted.with_note("put the inner blocks into a function of their own"),
            false => noted,
        }
    })
}

/// Validates a module that was parsed from a text.
fn checked(name: &str, text: &str, module: &Module) -> Result<ModuleInfo> {
    // Here, where the stack is deep enough even to drop what is too deep for everyone else.
    if let Some(place) = nested(module) {
        let error = nested_error().with_source(name, text);
        return Err(at(error, place, "too deep from here"));
    }
    validate(module).map_err(|error| {
        let place = |d: Box<Diagnostic>, span, remark: &str| at(d, span, remark);
        let located = |d: Box<Diagnostic>| d.with_source(name, text);
        let error = invalid_at(&error, &located, &place);
        match error.1.filter(|_| error.0.labels.is_empty()) {
            Some(subject) => match whole_word(text, 0..text.len(), &subject) {
                Some(place) => error.0.with_label(place, "in this"),
                None => error.0,
            },
            None => error.0,
        }
    })
}

/// What naga's validator refuses in a source of several files.
pub(super) fn invalid(source: &Source, error: &WithSpan<ValidationError>) -> Box<Diagnostic> {
    let place = |d: Box<Diagnostic>, span, remark: &str| source.locate(d, span, remark);
    let (diagnostic, _) = invalid_at(error, &|d| d, &place);
    match diagnostic.source {
        Some(_) => diagnostic,
        None => diagnostic.with_source(&source.name, &source.text),
    }
}

/// Puts a diagnostic at a span, with a remark.
type Placing<'a> = dyn Fn(Box<Diagnostic>, Span, &str) -> Box<Diagnostic> + 'a;

/// What naga's validator refuses, and the name of what it is about.
fn invalid_at(
    error: &WithSpan<ValidationError>,
    located: &dyn Fn(Box<Diagnostic>) -> Box<Diagnostic>,
    place: &Placing<'_>,
) -> (Box<Diagnostic>, Option<String>) {
    // The outermost says which function, the innermost what is wrong.
    let mut reasons = Vec::new();
    let mut next: Option<&dyn Error> = error.as_inner().source();
    while let Some(reason) = next {
        reasons.push(reason.to_string());
        next = reason.source();
    }
    // What GLSL's reader made has no name.
    let message = uncapitalised(&error.as_inner().to_string()).replace(" '' is", " is");
    let labelled = error
        .spans()
        .fold(located(Diagnostic::error(message)), |d, (span, remark)| {
            place(d, *span, readable(remark))
        });
    let explained = reasons
        .iter()
        .fold(labelled, |d, reason| d.with_reason(uncapitalised(reason)));
    let advised = match reasons.iter().find_map(|reason| way_out(reason)) {
        Some(advice) => explained.with_note(advice),
        None => explained,
    };
    (advised, subject(error.as_inner()).map(str::to_owned))
}

/// What to do about a reason of naga's validator that does not say it itself.
fn way_out(reason: &str) -> Option<&'static str> {
    let of = [
        (
            "Multiple bindings at location",
            "give each input a location of its own: `@location(1)`, in GLSL `layout(location = 1) in`",
        ),
        (
            "Base type ",
            "give each texture and each sampler a variable and a binding of its own",
        ),
    ];
    of.iter()
        .find(|(known, _)| reason.starts_with(known))
        .map(|(_, advice)| *advice)
}

/// Where statements of a module are nested too deep for what is behind the reader.
pub(super) fn nested(module: &Module) -> Option<Span> {
    let functions = module.functions.iter().map(|(_, f)| f);
    let entries = module.entry_points.iter().map(|e| &e.function);
    let mut all = functions.chain(entries);
    all.find_map(|function| too_deep(&function.body, DEEPEST))
}

/// What is said of that.
pub(super) fn nested_error() -> Box<Diagnostic> {
    Diagnostic::error(format!("statements are nested more than {DEEPEST} deep"))
        .with_note("split the function, or turn a chain of `else if` into a `switch`")
}

/// Where statements are nested deeper than `left` more blocks.
fn too_deep(block: &Block, left: usize) -> Option<Span> {
    block.span_iter().find_map(|(statement, span)| {
        let inner: Vec<&Block> = match statement {
            Statement::Block(block) => vec![block],
            Statement::If { accept, reject, .. } => vec![accept, reject],
            Statement::Switch { cases, .. } => cases.iter().map(|case| &case.body).collect(),
            Statement::Loop {
                body, continuing, ..
            } => vec![body, continuing],
            _ => return None,
        };
        match left {
            0 => Some(*span),
            left => inner.into_iter().find_map(|b| too_deep(b, left - 1)),
        }
    })
}

/// What is wrong when the text is not plain WGSL but one of its preprocessed or modular relatives.
/// Asked only after naga has refused the text, so that a comment or a macro-like name is no trap.
fn foreign_directive(name: &str, text: &str) -> Option<Box<Diagnostic>> {
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let start = offset + line.len() - line.trim_start().len();
        offset += line.len();
        let words = line.trim();
        let directive = words.split_whitespace().next().unwrap_or("");
        let place = start..start + words.len();
        if directive.starts_with('#') {
            let what = match directive {
                "#import" | "#define_import_path" => "imports are",
                _ => "preprocessor directives are",
            };
            return Some(
                Diagnostic::error(format!("{what} not read by this build"))
                    .with_source(name, text)
                    .with_label(place, "not WGSL")
                    .with_note(if cfg!(feature = "imports") {
                        "modules are composed of files: read the shader from one"
                    } else {
                        "build lodc with `--features imports`, which composes modules"
                    }),
            );
        }
        if directive == "import" && words.ends_with(';') {
            return Some(
                Diagnostic::error("imports are not read by this build")
                    .with_source(name, text)
                    .with_label(place, "this is WESL, not WGSL")
                    .with_note("link the package first, with `wesl`, and give lodc the plain WGSL"),
            );
        }
    }
    None
}

fn at(diagnostic: Box<Diagnostic>, span: Span, remark: impl Into<String>) -> Box<Diagnostic> {
    match span.to_range() {
        Some(range) => diagnostic.with_label(range, remark),
        None => diagnostic,
    }
}

/// The name of what a validation error is about; naga gives some of them no place.
fn subject(error: &ValidationError) -> Option<&str> {
    match error {
        ValidationError::Type { name, .. }
        | ValidationError::Constant { name, .. }
        | ValidationError::Override { name, .. }
        | ValidationError::GlobalVariable { name, .. }
        | ValidationError::Function { name, .. }
        | ValidationError::EntryPoint { name, .. } => Some(name),
        _ => None,
    }
}

/// naga's remark on a place without the Rust type and arena index of what is there:
/// `naga::ir::Expression [3]` says nothing to a shader's author.
fn readable(remark: &str) -> &str {
    match remark.starts_with("naga::") {
        true => "here",
        false => remark,
    }
}

/// A message of naga in the manner of ours: no capital, no full stop, types as WGSL writes them, and no arena
/// indices (`[12]`), which say nothing to a shader's author.
pub(super) fn uncapitalised(message: &str) -> String {
    let mut plain = String::new();
    let mut rest = message.trim_end_matches('.');
    while let Some(open) = rest.find(" [") {
        let inside = &rest[open + 2..];
        let digits = inside.len()
            - inside
                .trim_start_matches(|c: char| c.is_ascii_digit())
                .len();
        let index = digits > 0 && inside[digits..].starts_with(']');
        let end = open + if index { digits + 3 } else { 2 };
        plain.push_str(&rest[..if index { open } else { end }]);
        rest = &rest[end..];
        // What has no name but its index is `it`, unless its type follows.
        let word = plain.rsplit(' ').next().unwrap_or("");
        if index
            && !rest.starts_with(" (of type")
            && ["for", "of", "to", "by", "with"].contains(&word)
        {
            plain.push_str(" it");
        }
    }
    plain.push_str(rest);
    let plain = wgsl_types(plain);
    // `WGSL`, `I32`: not a sentence's first word.
    let mut chars = plain.chars();
    match (chars.next(), chars.as_str()) {
        (Some(first), rest) if rest.starts_with(|c: char| c.is_lowercase() || c == ' ') => {
            first.to_lowercase().chain(rest.chars()).collect()
        }
        _ => plain,
    }
}

/// A message in which naga's types, as Rust prints them, are those of WGSL.
fn wgsl_types(mut message: String) -> String {
    if !message.contains("Scalar") && !message.contains("kind:") {
        return message;
    }
    for (kind, width, name) in [
        ("Float", 2, "f16"),
        ("Float", 4, "f32"),
        ("Float", 8, "f64"),
        ("Sint", 4, "i32"),
        ("Sint", 8, "i64"),
        ("Uint", 4, "u32"),
        ("Uint", 8, "u64"),
        ("Bool", 1, "bool"),
    ] {
        let scalar = format!("Scalar {{ kind: {kind}, width: {width} }}");
        message = message
            .replace(&format!("Scalar({scalar})"), name)
            .replace(&scalar, name);
        for (size, rows) in [("Bi", 2), ("Tri", 3), ("Quad", 4)] {
            let vector = format!("Vector {{ size: {size}, scalar: {name} }}");
            message = message.replace(&vector, &format!("vec{rows}<{name}>"));
            for (columns, count) in [("Bi", 2), ("Tri", 3), ("Quad", 4)] {
                let matrix =
                    format!("Matrix {{ columns: {columns}, rows: {size}, scalar: {name} }}");
                message = message.replace(&matrix, &format!("mat{count}x{rows}<{name}>"));
            }
        }
    }
    while let Some((before, rest)) = message.split_once("(of type ") {
        let Some((ty, after)) = rest.split_once(')') else {
            break;
        };
        message = format!("{before}{ty}{after}");
    }
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> Box<Diagnostic> {
        parse("a.wgsl", text, Language::Wgsl).expect_err(text)
    }

    #[test]
    fn parse_errors_point_into_the_text() {
        let text = "@fragment fn fs() -> @location(0) vec4f {\n    return vec4f(missing);\n}\n";
        let error = refused(text);
        assert!(error.message.contains("missing"), "{error}");
        assert_eq!(&text[error.labels[0].0.clone()], "missing");
        assert!(error.to_string().contains("a.wgsl:2:18"), "{error}");
    }

    #[test]
    fn notes_of_naga_are_kept() {
        let error = refused("fn f() -> f32 { return cross(vec2(0., 1.), vec2(0., 1.)); }");
        let text = error.to_string();
        assert!(text.contains("note: allowed type: vec3<f32>"), "{text}");
    }

    #[test]
    fn validation_errors_point_into_the_text_and_give_the_reason() {
        let text = "@fragment fn fs(@location(0) a: f32, @location(0) b: f32) -> @location(0) vec4f { return vec4f(a + b); }";
        let error = refused(text);
        let rendered = error.to_string();
        assert!(rendered.contains("a.wgsl:1:"), "{rendered}");
        assert!(rendered.contains("location"), "{rendered}");
        assert!(!rendered.contains("naga::"), "{rendered}");
        assert!(error.message.starts_with(char::is_lowercase), "{rendered}");
    }

    #[test]
    fn empty_files_are_called_empty() {
        for text in ["", " \n\t\n"] {
            assert_eq!(refused(text).message, "`a.wgsl` is empty");
        }
    }

    #[test]
    fn a_text_without_end_is_not_read() {
        let error = refused(&"// ".repeat(2 << 20));
        assert_eq!(
            error.message,
            "`a.wgsl` has 6291456 bytes, more than the 4194304 that lodc reads"
        );
    }

    #[test]
    fn relatives_of_wgsl_are_named() {
        for (text, message, place) in [
            (
                "#import bevy_pbr::mesh\n",
                "imports are",
                "#import bevy_pbr::mesh",
            ),
            (
                "fn a() {}\n  #ifdef X\nfn b() {}\n",
                "preprocessor",
                "#ifdef X",
            ),
            (
                "import super::a::b;\n",
                "imports are",
                "import super::a::b;",
            ),
        ] {
            let error = refused(text);
            assert!(error.message.starts_with(message), "{error}");
            assert_eq!(&text[error.labels[0].0.clone()], place);
        }
        // In a comment it is no directive.
        assert!(
            refused("// #import x\nfn f( {}")
                .message
                .contains("expected")
        );
        assert!(parse("a.wgsl", "/*\n#import x\n*/ fn f() {}", Language::Wgsl).is_ok());
    }

    #[test]
    fn other_languages_are_named() {
        for (file, part) in [
            ("a.vert", "no fragment shader"),
            ("a.hlsl", "HLSL"),
            ("a.txt", "not a shader that lodc reads"),
        ] {
            let error = expect_known(Path::new(file), file, true).unwrap_err();
            assert!(error.message.contains(part), "{error}");
        }
        assert!(expect_known(Path::new("a.WGSL"), "a", true).is_ok());
        assert!(expect_known(Path::new("a.FRAG"), "a", true).is_ok());
    }

    #[test]
    fn messages_of_naga_are_put_in_our_manner() {
        for (naga, ours) in [
            ("Function [12] 'f' is invalid", "function 'f' is invalid"),
            ("Expression [3] of [4] is bad.", "expression of it is bad"),
            ("Bindings for [1] conflict", "bindings for it conflict"),
            (
                "Operation Add can't work with [3] (of type Vector { size: Tri, scalar: Scalar { kind: Float, width: 4 } }) and [5] (of type Scalar(Scalar { kind: Sint, width: 4 }))",
                "operation Add can't work with vec3<f32> and i32",
            ),
            (
                "of type Matrix { columns: Quad, rows: Tri, scalar: Scalar { kind: Float, width: 4 } }",
                "of type mat4x3<f32>",
            ),
            ("(of type Scalar", "(of type Scalar"),
            ("WGSL is [x]", "WGSL is [x]"),
            ("a [", "a ["),
            ("", ""),
        ] {
            assert_eq!(uncapitalised(naga), ours);
        }
    }

    #[test]
    fn deep_nesting_is_an_error_or_fine_and_never_a_crash() {
        // The deepest that is read is read; one more is refused at its place.
        let nested = |n: usize| {
            format!(
                "fn f(a: bool) {{ {} {} }}",
                "if a {".repeat(n),
                "}".repeat(n)
            )
        };
        assert!(parse("a.wgsl", &nested(100), Language::Wgsl).is_ok());
        let chain = format!(
            "fn f(a: bool) {{ {} {{}} }}",
            "if a {} else ".repeat(DEEPEST + 2)
        );
        let error = refused(&chain);
        assert_eq!(error.message, "statements are nested more than 256 deep");
        assert!(!error.labels.is_empty());
        let n = 20_000;
        for text in [
            format!(
                "fn f() -> f32 {{ return {}1.0{}; }}",
                "(".repeat(n),
                ")".repeat(n)
            ),
            format!("fn f() -> f32 {{ return {}1.0; }}", "-".repeat(n)),
            format!("fn f() -> f32 {{ return 1.0{}; }}", " + 1.0".repeat(n)),
            format!("fn f() {{ {}{} }}", "{".repeat(n), "}".repeat(n)),
            format!("fn f(a: bool) {{ {} {{}} }}", "if a {} else ".repeat(n)),
            format!(
                "fn f(a: bool) {{ {} {} }}",
                "if a {".repeat(n),
                "}".repeat(n)
            ),
            format!(
                "fn f() -> f32 {{ return {}1.0{}; }}",
                "abs(".repeat(n),
                ")".repeat(n)
            ),
            format!(
                "var<private> a: {}f32{};",
                "array<".repeat(n),
                ", 1>".repeat(n)
            ),
        ] {
            let _ = parse("a.wgsl", &text, Language::Wgsl);
        }
    }
}
