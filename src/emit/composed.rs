//! The WGSL of a source that is no WGSL text of its own: of several files, or of another language.
//!
//! The module is written once, under its own names; from then on it is emitted as an author's text is.

use super::body::unwritable;
use super::names::Names;
use super::print::{Wishes, print};
use super::{alone, read_back};
use crate::Result;
use crate::front::Source;
use naga::Module;
use naga::diagnostic_filter::{
    FilterableTriggeringRule as Rule, Severity, StandardFilterableTriggeringRule as Standard,
};
use std::borrow::Cow;

/// The source as emission takes it: with a text that says all of it.
///
/// # Errors
/// When something in the module has no form in WGSL.
pub(crate) fn composed(source: &Source) -> Result<Cow<'_, Source>> {
    if source.verbatim {
        return Ok(Cow::Borrowed(source));
    }
    let printed = print(
        &source.module,
        &Wishes {
            keep: &|_| true,
            taken: &Names::default(),
            outside: &Names::default(),
            value: &|_, _| None,
            short_types: true,
        },
    )
    .map_err(|reason| unwritable(source, &reason))?;
    let mut directives = printed.directives;
    directives.extend(derivative_directive(&source.module));
    let items: Vec<_> = printed
        .items
        .iter()
        .map(|item| (item.keyword, item.text.as_str()))
        .collect();
    let text = alone::assembled("", &directives, &items);
    let mut composed = read_back(&text, source)?;
    composed.name.clone_from(&source.name);
    Ok(Cow::Owned(composed))
}

/// What the module lets pass for derivatives in control flow that is not uniform: the most lenient that it has
/// at any place, for all of it.
fn derivative_directive(module: &Module) -> Option<String> {
    let rule = Rule::Standard(Standard::DerivativeUniformity);
    let filters = module
        .diagnostic_filters
        .iter()
        .map(|(_, node)| &node.inner);
    let severities = filters.filter(|f| f.triggering_rule == rule);
    let most = severities
        .map(|f| f.new_severity)
        .min_by_key(|s| *s as u8)?;
    let word = match most {
        Severity::Off => "off",
        Severity::Info => "info",
        Severity::Warning => "warning",
        Severity::Error => "error",
    };
    Some(format!("diagnostic({word}, derivative_uniformity);"))
}
