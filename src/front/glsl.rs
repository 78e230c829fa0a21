//! GLSL to a module, through naga's reader: `#version 440` and later, textures and samplers
//! apart.

use super::lower::lower;
use super::parse::{at, uncapitalised};
use crate::{Diagnostic, Result};
use naga::front::glsl::{Error, ErrorKind, Frontend, Options};
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
    let message = uncapitalised(&error.kind.to_string());
    let located = at(
        Diagnostic::error(message).with_source(name, text),
        error.meta,
        "here",
    );
    match &error.kind {
        ErrorKind::NotImplemented(_) => located.with_note("naga's GLSL reader does not know this yet: write it another way, or translate the shader to WGSL, with `glslang` and `naga`"),
        _ => located,
    }
}
