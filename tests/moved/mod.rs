//! Shaders with all that can be done once a draw moved to parameters, and emitted.

use lodc::compile::normal_form;
use lodc::emit::{self, EmitLevel, Files, Output};
use lodc::front::Source;
use lodc_passes::to_parameter::ToParameter;
use lodc_passes::{Facts, Pass, Shader};
use std::path::Path;

/// A shader with all that can be moved to parameters exactly, and the files of it as the one level of what it was.
pub(crate) fn with_parameters(path: &Path) -> (Shader, Files) {
    let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
    let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
    let mut shader = base.clone();
    while let Some(candidate) = ToParameter.candidates(&shader, &Facts::default()).first() {
        shader = ToParameter.apply(&shader, candidate);
    }
    let level = EmitLevel {
        autolod: 1.0,
        shader: shader.clone(),
        distance: 1.0,
        error: 0.0,
        cost: 1.0,
        says: "a variant".into(),
    };
    let files = emit::emit(&source, &base, &[level], Output::default());
    (shader, files.unwrap_or_else(|e| panic!("{e}")))
}
