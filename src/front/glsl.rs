//! GLSL to a module, through naga's reader: `#version 440` and later, textures and samplers
//! apart.

use super::lower::lower;
use super::parse::uncapitalised;
use crate::{Diagnostic, Result};
use naga::front::glsl::{Error, ErrorKind, Frontend, Options, TokenValue};
use naga::{Module, ShaderStage};

/// Parses a shader of one stage. GLSL calls every stage `main`, and a module of both needs two names: the entry point
/// is called `fs_main`, or `vs_main`.
pub(super) fn parse(name: &str, text: &str, stage: ShaderStage) -> Result<Module> {
    let options = Options::from(stage);
    let parsed = Frontend::default().parse(&options, text);
    let mut module = parsed.map_err(|errors| refused(name, text, &errors.errors))?;
    lower(&mut module);
    for entry in &mut module.entry_points {
        let called = match stage {
            ShaderStage::Vertex => "vs_main",
            _ => "fs_main",
        };
        called.clone_into(&mut entry.name);
    }
    // The entry point is the reader's own and calls this: what is in it belongs to no other function.
    for (_, function) in module.functions.iter_mut() {
        if function.name.as_deref() == Some("main") {
            function.name = None;
        }
    }
    Ok(module)
}

/// The first error of naga's, in its place, with a way out where there is one.
fn refused(name: &str, text: &str, errors: &[Error]) -> Box<Diagnostic> {
    let Some(error) = errors.first() else {
        return Diagnostic::error(format!(
            "`{name}` is not read by naga, which does not say why"
        ));
    };
    let place = error
        .meta
        .to_range()
        .filter(|range| text.get(range.clone()).is_some());
    let word = place.clone().map_or("", |range| &text[range]);
    let line = place.clone().map_or("", |range| line_of(text, range.start));
    let (message, note) = explained(&error.kind, word, line);
    let located = Diagnostic::error(message).with_source(name, text);
    let located = match place {
        Some(range) => located.with_label(range, "here"),
        None => located,
    };
    match note {
        Some(note) => located.with_note(note),
        None => located,
    }
}

/// The line of a text that a byte is in.
fn line_of(text: &str, at: usize) -> &str {
    let start = text[..at].rfind('\n').map_or(0, |end| end + 1);
    text[start..].lines().next().unwrap_or("")
}

/// What an error says, and what to do about it. `word` is what stands at its place, and `line` the line around it.
fn explained(kind: &ErrorKind, word: &str, line: &str) -> (String, Option<String>) {
    let plain = || uncapitalised(&kind.to_string());
    let versions = "lodc reads `#version 440`, `450` and `460`: locations and bindings are given in `layout(...)`, textures and samplers are apart";
    match kind {
        ErrorKind::InvalidVersion(version) => (
            format!("GLSL {version} is not read"),
            Some(versions.to_owned()),
        ),
        ErrorKind::InvalidProfile(profile) => (
            format!("the profile `{profile}` of GLSL is not read"),
            Some(versions.to_owned()),
        ),
        _ if is_combined_sampler(word) => {
            let image = word.replacen("sampler", "texture", 1);
            let behind = line.split_once(word).map_or("", |(_, behind)| behind.trim_start());
            let name = behind.split(|c: char| c != '_' && !c.is_alphanumeric()).next();
            let name = name.filter(|name| line.contains("uniform") && !name.is_empty());
            let name = name.unwrap_or("map");
            (
                format!("a texture and its sampler in one, `{word}`, are not read: WGSL has them apart"),
                Some(format!(
                    "separate them: `uniform {image} {name}_texture;` and `uniform sampler {name}_sampler;`, each with a binding, read as `texture({word}({name}_texture, {name}_sampler), ...)`"
                )),
            )
        }
        ErrorKind::PreprocessorError(_) if line.trim_start().starts_with('#') => (
            format!("the directive `#{}` is not read", word.trim_start_matches('#')),
            Some("preprocess the shader first, with `glslc -E` or `glslangValidator -E`".to_owned()),
        ),
        ErrorKind::SemanticError(message) if message.contains("require layout(binding") => (
            "a uniform has no binding".to_owned(),
            Some("put it into a block with one: `layout(set = 0, binding = 0) uniform Material { ... };`".to_owned()),
        ),
        ErrorKind::UnsupportedMatrixWithTwoRowsInStd140 { columns } => (
            format!("a mat{columns}x2 in a std140 block, whose columns are 16 bytes apart, has no form in WGSL"),
            Some(format!("make it {columns} members of type `vec4`, and use their `xy`")),
        ),
        ErrorKind::InvalidToken(..) if ["varying", "attribute"].contains(&word) => (
            format!("`{word}` is GLSL of before version 130"),
            Some("write `layout(location = 0) in` in a fragment shader, and begin the file with `#version 450`".to_owned()),
        ),
        ErrorKind::UnknownVariable(variable) if variable == "gl_FragColor" => (
            plain(),
            Some("declare the colour: `layout(location = 0) out vec4 colour;`".to_owned()),
        ),
        ErrorKind::PreprocessorError(_) if plain().contains("64BitLiteral") => (
            "numbers of 64 bits are not read".to_owned(),
            Some("write `float` and `1.0` for `double` and `1.0lf`".to_owned()),
        ),
        ErrorKind::SemanticError(message) if message.starts_with("Missing entry point") => (
            "there is no `main`".to_owned(),
            Some("a stage is `void main() { ... }`".to_owned()),
        ),
        ErrorKind::SemanticError(message) if message.starts_with("Unexpected qualifier") => (
            format!("`{word}` is not read here"),
            Some("blocks are `std140` or `std430`: pad them with members where their layout is another".to_owned()),
        ),
        ErrorKind::InvalidToken(TokenValue::Layout, _) => (
            "a member of a block has no `layout` of its own".to_owned(),
            Some("let the members be in the order of their places, with others between them as padding".to_owned()),
        ),
        ErrorKind::NotImplemented(_) => (
            plain(),
            Some("naga's GLSL reader does not know this yet: write it another way, or translate the shader to WGSL, with `glslang` and `naga`".to_owned()),
        ),
        _ => (plain(), None),
    }
}

/// Whether a word is the type of a texture with its sampler.
fn is_combined_sampler(word: &str) -> bool {
    let kind = word.trim_start_matches(['i', 'u']);
    kind.strip_prefix("sampler").is_some_and(|shape| {
        ["1D", "2D", "3D", "Cube"]
            .iter()
            .any(|dimension| shape.starts_with(dimension))
    })
}

#[cfg(test)]
mod tests {
    use crate::front::Source;

    fn error(text: &str) -> (String, String) {
        let error = Source::parse("a.frag", text).expect_err(text);
        let place = error
            .labels
            .first()
            .map_or("", |(place, _)| &text[place.clone()]);
        (error.to_string(), place.to_owned())
    }

    #[test]
    fn what_is_not_read_comes_with_a_way_out() {
        let in_main = |body: &str| {
            format!(
                "#version 450\nlayout(location = 0) out vec4 colour;\n{body}\nvoid main() {{ colour = vec4(1.0); }}"
            )
        };
        for (text, place, parts) in [
            (
                "#version 330 core\nvoid main() {}".to_owned(),
                "330",
                ["GLSL 330 is not read", "#version 440"],
            ),
            (
                "varying vec2 uv;\nvoid main() {}".to_owned(),
                "varying",
                ["before version 130", "layout(location = 0) in"],
            ),
            (
                in_main("layout(binding = 1) uniform sampler2D albedo;"),
                "sampler2D",
                [
                    "in one, `sampler2D`",
                    "`uniform texture2D albedo_texture;` and `uniform sampler albedo_sampler;`",
                ],
            ),
            (
                in_main("vec4 read(samplerCube sky) { return texture(sky, vec3(1.0)); }"),
                "samplerCube",
                [
                    "in one, `samplerCube`",
                    "texture(samplerCube(map_texture, map_sampler), ...)",
                ],
            ),
            (
                in_main("uniform vec4 tint;"),
                "tint",
                ["a uniform has no binding", "uniform Material { ... }"],
            ),
            (
                in_main("#include \"common.glsl\""),
                "include",
                ["`#include` is not read", "glslc -E"],
            ),
            (
                in_main("layout(std140, binding = 0) uniform B { mat2 turn; };"),
                "mat2 turn",
                ["a mat2x2 in a std140 block", "`vec4`"],
            ),
            (
                in_main("float f() { return missing; }"),
                "missing",
                ["unknown variable: missing", ""],
            ),
        ] {
            let (said, at) = error(&text);
            for part in parts {
                assert!(said.contains(part), "{part}: {said}");
            }
            assert_eq!(at, place, "{said}");
        }
    }

    #[test]
    fn inputs_are_found_where_they_are_declared() {
        let text = "#version 450\nlayout(location = 0) in Vertex { vec3 normal; vec2 uv; } v;\nlayout(location = 2) in vec3 wet;
            layout(location = 0) out vec4 colour;\nvoid main() { colour = vec4(v.normal * wet, v.uv.x); }";
        let source = Source::parse("a.frag", text).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(source.fragment, "fs_main");
        let found: Vec<_> = crate::front::inputs(&source, 0)
            .into_iter()
            .map(|input| (input.span.to_range().map(|place| &text[place]), input.name))
            .collect();
        let named = ["normal", "uv", "wet"].map(|name| (Some(name), name.to_owned()));
        assert_eq!(found, named);
    }
}
