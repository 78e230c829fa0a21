//! Uniform buffers as Mesa's software Vulkan takes them.
//!
//! Before version 23 it makes constants of uniforms that conditions depend on, and for some shaders it then reads a
//! buffer in front of the first one and crashes. What it cannot know the place of it leaves alone. So every uniform
//! becomes the first of two, chosen by a number that is 0: the third of the frame's [`Place`](super::entry::Place).

use super::entry;
use lodc_passes::operands;
use naga::proc::Layouter;
use naga::{
    ArraySize, Expression, Function, GlobalVariable, Handle, Module, ScalarKind, Span, Statement,
    Type, TypeInner,
};
use std::collections::BTreeMap;
use std::num::NonZeroU32;

/// Changes every uniform buffer of a module but that of the frame's place, which it adds. Each buffer must then be
/// as large as two.
pub(super) fn hide_uniforms(module: &mut Module, place: (u32, u32)) {
    let mut layouter = Layouter::default();
    if layouter.update(module.to_ctx()).is_err() {
        // The validator says what is wrong.
        return;
    }
    let hidden: Vec<Handle<GlobalVariable>> = module
        .global_variables
        .iter()
        .filter(|(_, global)| global.space == naga::AddressSpace::Uniform)
        .map(|(handle, _)| handle)
        .collect();
    for handle in &hidden {
        let base = module.global_variables[*handle].ty;
        let inner = TypeInner::Array {
            base,
            size: ArraySize::Constant(NonZeroU32::MIN.saturating_add(1)),
            stride: layouter[base].to_stride().next_multiple_of(16),
        };
        let ty = module
            .types
            .insert(Type { name: None, inner }, Span::UNDEFINED);
        module.global_variables[*handle].ty = ty;
    }
    let place = entry::place_variable(module, place);
    for function in entry::functions(module) {
        take_first(function, &hidden, place);
    }
}

/// Puts the first of the two in the place of each of these variables.
fn take_first(
    function: &mut Function,
    hidden: &[Handle<GlobalVariable>],
    place: Handle<GlobalVariable>,
) {
    let old = std::mem::take(&mut function.expressions);
    let new = &mut function.expressions;
    let mut add = |expression| new.append(expression, Span::UNDEFINED);
    let mut both = BTreeMap::new();
    for (_, expression) in old.iter() {
        if let Expression::GlobalVariable(global) = expression
            && hidden.contains(global)
        {
            both.entry(*global)
                .or_insert_with(|| add(Expression::GlobalVariable(*global)));
        }
    }
    let base = add(Expression::GlobalVariable(place));
    let first = add(Expression::AccessIndex { base, index: 0 });
    let pointer = add(Expression::AccessIndex {
        base: first,
        index: 2,
    });
    let float = add(Expression::Load { pointer });
    let index = add(Expression::As {
        expr: float,
        kind: ScalarKind::Uint,
        convert: None,
    });
    let mut last = index;
    let mut one = BTreeMap::new();
    for (global, base) in both {
        last = add(Expression::Access { base, index });
        one.insert(global, last);
    }
    let mut mapped: Vec<Handle<Expression>> = Vec::with_capacity(old.len());
    for (handle, expression) in old.iter() {
        let known = match expression {
            Expression::GlobalVariable(global) => one.get(global).copied(),
            _ => None,
        };
        mapped.push(known.unwrap_or_else(|| {
            let copy = operands::map(expression, |operand| mapped[operand.index()]);
            function.expressions.append(copy, old.get_span(handle))
        }));
    }
    super::opengl::renumbered(function, &|handle| {
        let new = mapped[handle.index()];
        (new, new)
    });
    let emit = Statement::Emit(naga::Range::new_from_bounds(first, last));
    let body = std::mem::take(&mut function.body);
    function.body.push(emit, Span::UNDEFINED);
    function.body.extend_block(body);
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    #[test]
    fn uniforms_of_every_shape_become_the_first_of_two() {
        let text = "
            struct Lamp { at: vec3f, reach: f32 }
            struct Lamps { count: u32, all: array<Lamp, 4> }
            @group(0) @binding(0) var<uniform> lamps: Lamps;
            @group(0) @binding(1) var<uniform> tint: vec3f;
            @group(0) @binding(2) var<uniform> gain: f32;
            fn lit(p: vec3f, i: u32) -> f32 {
                let lamp = lamps.all[i];
                return select(0.0, gain, distance(lamp.at, p) < lamp.reach);
            }
            @fragment fn fs(@location(0) p: vec3f) -> @location(0) vec4f {
                var sum = 0.0;
                for (var i = 0u; i < lamps.count; i++) { sum += lit(p, i); }
                if tint.x > 0.5 { sum *= 2.0; }
                return vec4f(tint * sum, 1.0);
            }";
        let mut module = naga::front::wgsl::parse_str(text).unwrap();
        hide_uniforms(&mut module, (0, 3));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
        validator.validate(&module).unwrap();
        let globals = module.global_variables.iter();
        let arrays = globals
            .filter(|(_, global)| matches!(module.types[global.ty].inner, TypeInner::Array { .. }));
        assert_eq!(arrays.count(), 4);
    }
}
