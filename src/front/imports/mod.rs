//! Composing: a source with `#import` and `#ifdef`, and the modules that it imports, become naga modules.
//!
//! ```text
//! text + folders --library--> what it imports --naga_oil--> naga module, names mangled, spans by module
//!                             --spans-------> spans in the files --demangle--> names as they were written
//! ```
//!
//! The work of the preprocessor and of linking modules is naga_oil's. What is done here is to find the
//! modules, to lead everything back to the files that people wrote, and to say what is wrong there.

mod demangle;
mod library;
mod refusal;
mod spans;

pub(super) use demangle::demangled;

use super::modules::{Modules, Value};
use super::{OtherFile, parse};
use crate::{Diagnostic, Result};
use library::Library;
use naga::Module;
use naga_oil::compose::{
    Composer, ComposerErrorInner, NagaModuleDescriptor, ShaderDefValue, ShaderType,
};
pub(in crate::front) use spans::Spans;
use std::collections::HashMap;
use std::path::Path;

/// The shader defs as naga_oil takes them.
type Definitions = HashMap<String, ShaderDefValue>;

/// A text that is composed.
#[derive(Clone, Copy)]
pub(super) struct Main<'a> {
    /// What messages call it.
    pub(super) name: &'a str,
    /// Where it was read from.
    pub(super) path: Option<&'a Path>,
    /// The text.
    pub(super) text: &'a str,
    /// The offset at which spans into it begin in the source that it becomes part of.
    pub(super) start: usize,
}

/// A composed module. Its names are mangled, and its spans naga_oil's.
pub(super) struct Composed {
    pub(super) module: Module,
    /// Where its spans lie in the texts of the source.
    pub(super) spans: Spans,
}

/// Composes several texts over one set of modules, whose files come back beside; spans into the first of them
/// begin at `start`.
///
/// # Errors
/// When a module is not found or is wrong, at its place in its own file.
pub(super) fn compose(
    mains: &[Main<'_>],
    modules: &Modules,
    mut start: usize,
) -> Result<(Vec<Composed>, Vec<OtherFile>)> {
    // naga recurses, and naga_oil panics on some bad input: both are kept apart.
    let name = mains.first().map_or("", |main| main.name);
    parse::on_deep_stack(name, || {
        let mut library = Library::read(mains, modules)?;
        let definitions = definitions(modules);
        let mut composer = Composer::default().with_capabilities(super::CAPABILITIES);
        for main in mains {
            library.add_imports_of(&mut composer, *main, &mut start)?;
        }
        let mut all = Vec::new();
        for main in mains {
            all.push(compose_one(&mut composer, &library, *main, &definitions)?);
        }
        Ok((all, library.files()))
    })
}

fn definitions(modules: &Modules) -> Definitions {
    let all = modules.definitions.iter();
    all.map(|d| {
        let value = match d.value {
            Value::Bool(value) => ShaderDefValue::Bool(value),
            Value::Int(value) => ShaderDefValue::Int(value),
            Value::Uint(value) => ShaderDefValue::UInt(value),
        };
        (d.name.clone(), value)
    })
    .collect()
}

fn compose_one(
    composer: &mut Composer,
    library: &Library,
    main: Main<'_>,
    definitions: &Definitions,
) -> Result<Composed> {
    let (_, _, own) = naga_oil::compose::get_preprocessor_data(main.text);
    let mut definitions = definitions.clone();
    definitions.extend(own);
    let make = |composer: &mut Composer| {
        let made = composer.make_naga_module(NagaModuleDescriptor {
            source: main.text,
            file_path: main.name,
            shader_type: ShaderType::Wgsl,
            shader_defs: definitions.clone(),
            additional_imports: &[],
        });
        made.map_err(Box::new)
    };
    let module = match make(composer) {
        // What is not valid is said by whoever validates the linked module, at its place.
        Err(error) if matches!(error.inner, ComposerErrorInner::ShaderValidationError(_)) => {
            composer.validate = false;
            let made = make(composer);
            composer.validate = true;
            made
        }
        made => made,
    };
    let module =
        module.map_err(|error| refusal::refusal(&error, composer, library, main, &definitions))?;
    if parse::nested(&module).is_some() {
        return Err(parse::nested_error().with_source(main.name, main.text));
    }
    let spans = Spans::new(composer, library, main, &definitions);
    Ok(Composed { module, spans })
}

/// An error in a file, at a place in it.
fn located(
    message: impl Into<String>,
    (name, text): (&str, &str),
    place: std::ops::Range<usize>,
    remark: impl Into<String>,
) -> Box<Diagnostic> {
    Diagnostic::error(message)
        .with_source(name, text)
        .with_label(place, remark)
}
