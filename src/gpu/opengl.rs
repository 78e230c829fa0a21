//! What OpenGL's shading language has no words for, or others than WGSL has, said in a way that it can.
//!
//! - Loads of depth textures become loads of the floats that they hold: there a depth texture is a comparing sampler.
//!   Textures that are compared too, or handed to functions, stay as they are, and the driver says that it cannot.
//! - Divisions of whole numbers by 0, and remainders of negative ones, are anything there. So both are made of
//!   divisions whose divisor is 1 where WGSL has a result of its own.

use super::entry;
use lodc_passes::operands;
use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{
    BinaryOperator, Block, Expression, Function, GlobalVariable, Handle, ImageClass, Literal,
    Module, Scalar, ScalarKind, Span, Statement, Type, TypeInner, VectorSize,
};
use std::collections::{BTreeMap, BTreeSet};

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

/// Makes the quotients and remainders of whole numbers those of WGSL.
pub(super) fn divide_whole_numbers(module: &mut Module, info: &ModuleInfo) {
    let whole = |function: &Function, types: &FunctionInfo| {
        let all = function.expressions.iter();
        let divided = all.filter_map(|(handle, expression)| {
            let Expression::Binary { op, left, .. } = expression else {
                return None;
            };
            let divides = matches!(op, BinaryOperator::Divide | BinaryOperator::Modulo);
            let ty = types[*left].ty.inner_with(&module.types);
            let (size, scalar) = match *ty {
                TypeInner::Scalar(scalar) => (None, scalar),
                TypeInner::Vector { size, scalar } => (Some(size), scalar),
                _ => return None,
            };
            let whole = [Scalar::I32, Scalar::U32].contains(&scalar);
            (divides && whole).then_some((handle, (size, scalar == Scalar::I32)))
        });
        divided.collect::<BTreeMap<_, _>>()
    };
    let of_functions = module.functions.iter();
    let of_functions = of_functions.map(|(handle, function)| whole(function, &info[handle]));
    let of_entries = module.entry_points.iter().enumerate();
    let of_entries = of_entries.map(|(i, entry)| whole(&entry.function, info.get_entry_point(i)));
    let divided: Vec<_> = of_functions.chain(of_entries).collect();
    for (function, divided) in entry::functions(module).zip(divided) {
        if !divided.is_empty() {
            divide(function, &divided);
        }
    }
}

/// What is divided by what it is, or by 1 where WGSL has a result of its own. For each division the size of its
/// vectors, and whether it is signed.
fn divide(
    function: &mut Function,
    divided: &BTreeMap<Handle<Expression>, (Option<VectorSize>, bool)>,
) {
    let old = std::mem::take(&mut function.expressions);
    let mut literal = |literal| {
        let literal = Expression::Literal(literal);
        function.expressions.append(literal, Span::UNDEFINED)
    };
    let unsigned = [0, 1].map(|number| literal(Literal::U32(number)));
    let signed = [0, 1, -1, i32::MIN].map(|number| literal(Literal::I32(number)));
    let mut new: Vec<(Handle<Expression>, Handle<Expression>)> = Vec::with_capacity(old.len());
    for (handle, expression) in old.iter() {
        let span = old.get_span(handle);
        let mapped = operands::map(expression, |operand| new[operand.index()].0);
        let (Some((size, is_signed)), Expression::Binary { op, left, right }) =
            (divided.get(&handle), &mapped)
        else {
            let same = function.expressions.append(mapped, span);
            new.push((same, same));
            continue;
        };
        let mut first = None;
        let mut add = |expression| {
            let value = function.expressions.append(expression, span);
            first.get_or_insert(value);
            value
        };
        let mut number = |value| match *size {
            Some(size) => add(Expression::Splat { size, value }),
            None => value,
        };
        let [zero, one] = match is_signed {
            true => [signed[0], signed[1]].map(&mut number),
            false => unsigned.map(&mut number),
        };
        let minus_one_and_least = is_signed.then(|| [signed[2], signed[3]].map(&mut number));
        let binary = |op, left, right| Expression::Binary { op, left, right };
        let select = |condition, accept, reject| Expression::Select {
            condition,
            accept,
            reject,
        };
        let (left, mut divisor) = (*left, *right);
        let is_zero = add(binary(BinaryOperator::Equal, divisor, zero));
        divisor = add(select(is_zero, one, divisor));
        if let Some([minus_one, least]) = minus_one_and_least {
            let negates = add(binary(BinaryOperator::Equal, divisor, minus_one));
            let unless = add(select(negates, one, divisor));
            let is_least = add(binary(BinaryOperator::Equal, left, least));
            divisor = add(select(is_least, unless, divisor));
        }
        let mut value = add(binary(BinaryOperator::Divide, left, divisor));
        if *op == BinaryOperator::Modulo {
            let product = add(binary(BinaryOperator::Multiply, value, divisor));
            value = add(binary(BinaryOperator::Subtract, left, product));
        }
        new.push((value, first.unwrap_or(value)));
    }
    let to = |handle: Handle<Expression>| new[handle.index()];
    renumbered(function, &to);
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
    fn whole_numbers_are_divided_as_wgsl_has_it() {
        let text = "
            fn wrapped(i: vec3i) -> vec3i { return ((i % 7) + 7) % 7 / i; }
            @fragment fn fs(@location(0) p: vec3f) -> @location(0) vec4f {
                var sum = 0u;
                for (var i = 0u; i < 9u; i++) { if i % 2u == 1u { sum += 7u / i; } }
                return vec4f(vec3f(wrapped(vec3i(p))) / p, f32(sum));
            }";
        let mut module = naga::front::wgsl::parse_str(text).unwrap();
        let validated = |module: &Module| {
            use naga::valid::{Capabilities, ValidationFlags, Validator};
            Validator::new(ValidationFlags::all(), Capabilities::all())
                .validate(module)
                .unwrap()
        };
        let info = validated(&module);
        divide_whole_numbers(&mut module, &info);
        validated(&module);
        let all = functions(&module).flat_map(|f| f.expressions.iter());
        let left = all.filter(|(_, expression)| {
            let remainder = BinaryOperator::Modulo;
            matches!(expression, Expression::Binary { op, .. } if *op == remainder)
        });
        assert_eq!(left.count(), 0);
    }

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
