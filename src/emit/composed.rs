//! The WGSL of a source that is no WGSL text of its own: of several files, or of another language.
//!
//! The module is written once, under its own names; from then on it is emitted as an author's text is.

use super::body::unwritable;
use super::print::{Wishes, print};
use super::{alone, read_back};
use crate::Result;
use crate::front::Source;
use crate::front::identifiers::Names;
use naga::diagnostic_filter::{
    FilterableTriggeringRule as Rule, Severity, StandardFilterableTriggeringRule as Standard,
};
use naga::{Handle, Module, Type, TypeInner};
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
    for (_, variable) in source.module.global_variables.iter() {
        let declared = composed.module.global_variables.iter();
        let again = declared.map(|(_, again)| again).find(|again| {
            again.binding == variable.binding
                && again.space == variable.space
                && again.name == variable.name
        });
        let (Some(_), Some(again)) = (variable.binding, again) else {
            continue;
        };
        if !same_layout((&source.module, variable.ty), (&composed.module, again.ty)) {
            let name = variable.name.as_deref().unwrap_or("a buffer");
            let reason = format!("WGSL cannot lay out `{name}` as it is");
            return Err(unwritable(source, &reason));
        }
    }
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

/// Whether the host finds everything at the same bytes of two types.
fn same_layout(a: (&Module, Handle<Type>), b: (&Module, Handle<Type>)) -> bool {
    match (&a.0.types[a.1].inner, &b.0.types[b.1].inner) {
        (
            TypeInner::Struct { members, span },
            TypeInner::Struct {
                members: others,
                span: other_span,
            },
        ) => {
            span == other_span
                && members.len() == others.len()
                && members.iter().zip(others).all(|(one, other)| {
                    one.offset == other.offset && same_layout((a.0, one.ty), (b.0, other.ty))
                })
        }
        (
            TypeInner::Array { base, size, stride },
            TypeInner::Array {
                base: other,
                size: other_size,
                stride: other_stride,
            },
        ) => {
            size == other_size && stride == other_stride && same_layout((a.0, *base), (b.0, *other))
        }
        (TypeInner::BindingArray { base, .. }, TypeInner::BindingArray { base: other, .. }) => {
            same_layout((a.0, *base), (b.0, *other))
        }
        (one, other) => one == other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A source as if it had been composed, so that its module is what there is of it.
    fn module_of(text: &str) -> Source {
        Source {
            verbatim: false,
            ..Source::parse("a.wgsl", text).unwrap_or_else(|e| panic!("{e}"))
        }
    }

    #[test]
    fn layouts_stay_where_the_author_widened_them() {
        let source = module_of(
            "struct Lamp { @size(32) power: f32, at: vec3f, @size(32) tint: vec3f }
            struct Scene { @align(16) count: u32, @align(64) lamps: array<Lamp, 4>, last: f32 }
            @group(0) @binding(0) var<uniform> scene: Scene;
            @fragment fn fs() -> @location(0) vec4f {
                return vec4f(scene.lamps[1].at * scene.lamps[2].tint, scene.last + scene.lamps[0].power);
            }",
        );
        let written = composed(&source).unwrap_or_else(|e| panic!("{e}"));
        for part in [
            "@size(32) power: f32",
            "@size(32) tint: vec3f",
            "@size(64) count: u32",
        ] {
            assert!(written.text.contains(part), "{}", written.text);
        }
    }

    #[test]
    fn a_text_of_wgsl_is_itself() {
        let source = Source::parse(
            "a.wgsl",
            "@fragment fn f() -> @location(0) vec4f { return vec4f(); }",
        );
        let source = source.unwrap_or_else(|e| panic!("{e}"));
        assert!(matches!(composed(&source), Ok(Cow::Borrowed(_))));
    }
}
