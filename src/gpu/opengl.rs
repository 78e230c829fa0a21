//! Loads of depth textures, said in a way that OpenGL can: as loads of the floats that they hold.
//!
//! Its shading language has no load from what WGSL calls a depth texture, since there that is a comparing sampler.
//! Textures that are compared too, or handed to functions, stay as they are, and the driver says that it cannot.

use super::entry;
use lodc_passes::operands;
use naga::{
    Block, Expression, Function, GlobalVariable, Handle, ImageClass, Module, ScalarKind, Span,
    Statement, Type, TypeInner,
};
use std::collections::BTreeSet;

/// Changes the module's depth textures that are only loaded from into textures of floats.
pub(super) fn load_depths(module: &mut Module) {
    let mut loaded: BTreeSet<Handle<GlobalVariable>> = module
        .global_variables
        .iter()
        .filter(|(_, global)| is_depth(&module.types[global.ty].inner))
        .map(|(handle, _)| handle)
        .collect();
    for function in functions(module) {
        for (_, expression) in function.expressions.iter() {
            if matches!(
                expression,
                Expression::ImageLoad { .. } | Expression::ImageQuery { .. }
            ) {
                continue;
            }
            operands::each(expression, |operand| {
                if let Some(global) = global(function, operand) {
                    loaded.remove(&global);
                }
            });
        }
        operands::walk(&function.body, &mut |statement| {
            operands::each_of_statement(statement, |operand| {
                if let Some(global) = global(function, operand) {
                    loaded.remove(&global);
                }
            });
        });
    }
    if loaded.is_empty() {
        return;
    }
    for handle in &loaded {
        let ty = &module.types[module.global_variables[*handle].ty];
        let mut inner = ty.inner.clone();
        if let TypeInner::Image { class, .. } = &mut inner {
            *class = ImageClass::Sampled {
                kind: ScalarKind::Float,
                multi: false,
            };
        }
        let ty = module
            .types
            .insert(Type { name: None, inner }, Span::UNDEFINED);
        module.global_variables[*handle].ty = ty;
    }
    for function in entry::functions(module) {
        take_first(function, &loaded);
    }
}

fn is_depth(ty: &TypeInner) -> bool {
    matches!(
        ty,
        TypeInner::Image {
            class: ImageClass::Depth { multi: false },
            ..
        }
    )
}

fn functions(module: &Module) -> impl Iterator<Item = &Function> {
    let of_entries = module.entry_points.iter().map(|e| &e.function);
    module.functions.iter().map(|(_, f)| f).chain(of_entries)
}

fn global(function: &Function, value: Handle<Expression>) -> Option<Handle<GlobalVariable>> {
    match function.expressions[value] {
        Expression::GlobalVariable(global) => Some(global),
        _ => None,
    }
}

/// Puts the first component in the place of each load from these textures.
fn take_first(function: &mut Function, loaded: &BTreeSet<Handle<GlobalVariable>>) {
    let old = std::mem::take(&mut function.expressions);
    // For each old value the new one, and what is computed first for it.
    let mut new: Vec<(Handle<Expression>, Handle<Expression>)> = Vec::with_capacity(old.len());
    for (handle, expression) in old.iter() {
        let of_depth = match expression {
            Expression::ImageLoad { image, .. } => {
                matches!(&old[*image], Expression::GlobalVariable(g) if loaded.contains(g))
            }
            _ => false,
        };
        let mapped = operands::map(expression, |operand| new[operand.index()].0);
        let span = old.get_span(handle);
        let first = function.expressions.append(mapped, span);
        let value = match of_depth {
            true => {
                let component = Expression::AccessIndex {
                    base: first,
                    index: 0,
                };
                function.expressions.append(component, span)
            }
            false => first,
        };
        new.push((value, first));
    }
    let to = |handle: Handle<Expression>| new[handle.index()];
    renumbered(function, &to);
}

/// Puts new values in the place of old ones everywhere but in the expressions. `to` gives the new value, and the first
/// of those that are computed for it.
pub(super) fn renumbered(
    function: &mut Function,
    to: &impl Fn(Handle<Expression>) -> (Handle<Expression>, Handle<Expression>),
) {
    for (_, local) in function.local_variables.iter_mut() {
        local.init = local.init.map(|init| to(init).0);
    }
    let named = std::mem::take(&mut function.named_expressions);
    function.named_expressions = named.into_iter().map(|(h, name)| (to(h).0, name)).collect();
    renumber(&mut function.body, to);
}

fn renumber(
    block: &mut Block,
    to: &impl Fn(Handle<Expression>) -> (Handle<Expression>, Handle<Expression>),
) {
    for statement in block.iter_mut() {
        operands::each_mut_of_statement(statement, |v| *v = to(*v).0, |v| *v = to(*v).0);
        match statement {
            Statement::Emit(range) => {
                if let Some((first, last)) = range.first_and_last() {
                    *range = naga::Range::new_from_bounds(to(first).1, to(last).0);
                }
            }
            Statement::Block(block) => renumber(block, to),
            Statement::If { accept, reject, .. } => {
                renumber(accept, to);
                renumber(reject, to);
            }
            Statement::Loop {
                body, continuing, ..
            } => {
                renumber(body, to);
                renumber(continuing, to);
            }
            Statement::Switch { cases, .. } => {
                for case in cases {
                    renumber(&mut case.body, to);
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_that_are_only_loaded_become_floats() {
        let text = "
            @group(0) @binding(0) var seen: texture_depth_2d;
            @group(0) @binding(1) var compared: texture_depth_2d;
            @group(0) @binding(2) var compares: sampler_comparison;
            @fragment fn fs(@builtin(position) p: vec4f) -> @location(0) vec4f {
                let at = vec2i(p.xy) % vec2i(textureDimensions(seen));
                var sum = textureSampleCompare(compared, compares, p.xy, 0.5);
                for (var i = 0; i < 3; i++) {
                    let depth = textureLoad(seen, at + vec2i(i), 0) * 2.0;
                    if depth > 1.0 { sum += depth; }
                }
                return vec4f(sum + textureLoad(seen, at, 0));
            }";
        let mut module = naga::front::wgsl::parse_str(text).unwrap();
        load_depths(&mut module);
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::all(),
        );
        validator.validate(&module).unwrap();
        let depths = module.global_variables.iter();
        let depths = depths.filter(|(_, g)| is_depth(&module.types[g.ty].inner));
        let names: Vec<_> = depths.map(|(_, g)| g.name.as_deref()).collect();
        assert_eq!(names, [Some("compared")]);
    }
}
