//! What the machine does not take, as messages in the user's source.

use super::program::Refused;
use super::texture::Misfit;
use crate::Diagnostic;
use crate::front::Source;

/// What the evaluator does not run, as a message at its place in the source that was compiled.
pub fn refusal(refused: &Refused, source: &Source) -> Box<Diagnostic> {
    source
        .error(
            format!("lodc cannot evaluate {}", refused.what),
            refused.span,
            "here",
        )
        .with_reason("errors are measured by running the shader on the CPU, which does not do this")
        .with_note(refused.instead)
}

impl From<Misfit> for Box<Diagnostic> {
    fn from(misfit: Misfit) -> Self {
        Diagnostic::error(misfit.to_string())
    }
}
