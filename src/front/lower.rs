//! What other languages have and WGSL has not, said in what WGSL has: tests for infinity and NaN, and cases of a
//! `switch` that go on into the next one. And what naga's reader of GLSL leaves open.

use lodc_passes::operands;
use naga::front::Typifier;
use naga::proc::ResolveContext;
use naga::{
    Arena, BinaryOperator, Block, Expression, Function, Handle, Literal, Module, Range,
    RelationalFunction, Scalar, ScalarKind, Span, Statement, TypeInner, VectorSize,
};
use std::collections::BTreeMap;

/// Rewrites every function of a module, and completes its entry points.
pub(super) fn lower(module: &mut Module) {
    let lowered: Vec<Function> = module
        .functions
        .iter()
        .map(|(_, function)| without_tests(module, function))
        .collect();
    for ((_, function), mut lowered) in module.functions.iter_mut().zip(lowered) {
        separate_cases(&mut lowered.body, &mut lowered.expressions);
        *function = lowered;
    }
    for entry in &mut module.entry_points {
        emit_places(&mut entry.function);
    }
}

/// Emits the places that an entry point stores its inputs to: the members of blocks, which naga's reader leaves out.
fn emit_places(function: &mut Function) {
    let mut emitted = vec![false; function.expressions.len()];
    operands::walk(&function.body, &mut |statement| {
        if let Statement::Emit(range) = statement {
            range
                .clone()
                .for_each(|value| emitted[value.index()] = true);
        }
    });
    let mut body = Block::with_capacity(function.body.len());
    for (statement, span) in function.body.span_iter() {
        let mut missing = Vec::new();
        operands::each_of_statement(statement, |operand| {
            let mut next = Some(operand);
            while let Some(value) = next {
                let expression = &function.expressions[value];
                let place = match expression {
                    Expression::AccessIndex { base, .. } => Some(*base),
                    _ => None,
                };
                if place.is_some() && !std::mem::replace(&mut emitted[value.index()], true) {
                    missing.push(value);
                }
                next = place;
            }
        });
        missing.sort();
        for value in missing {
            body.push(Statement::Emit(Range::new_from_bounds(value, value)), *span);
        }
        body.push(statement.clone(), *span);
    }
    function.body = body;
}

/// A function that looks at the bits of a number where it asked whether it is infinite or NaN: of all bits but the
/// sign, those of infinity are the exponent's, and NaN has more.
fn without_tests(module: &Module, function: &Function) -> Function {
    let is_test = |e: &Expression| {
        matches!(
            e,
            Expression::Relational {
                fun: RelationalFunction::IsInf | RelationalFunction::IsNan,
                ..
            }
        )
    };
    if !function.expressions.iter().any(|(_, e)| is_test(e)) {
        return function.clone();
    }
    let context =
        ResolveContext::with_locals(module, &function.local_variables, &function.arguments);
    let mut types = Typifier::new();
    let mut expressions = Arena::new();
    // Literals are in no `Emit`, so they stand in front of all.
    let literal = |bits, expressions: &mut Arena<Expression>| {
        expressions.append(Expression::Literal(Literal::U32(bits)), Span::UNDEFINED)
    };
    let magnitude = literal(0x7fff_ffff, &mut expressions);
    let infinity = literal(0x7f80_0000, &mut expressions);
    // For each old value, the first of those that take its place, and the last, which is its own.
    let mut map: Vec<(Handle<Expression>, Handle<Expression>)> = Vec::new();
    for (old, expression) in function.expressions.iter() {
        let span = function.expressions.get_span(old);
        let expression = operands::map(expression, |operand| map[operand.index()].1);
        let argument = match expression {
            Expression::Relational { fun, argument } if is_test(&expression) => {
                operand_of(function, old)
                    .filter(|operand| {
                        types
                            .grow(*operand, &function.expressions, &context)
                            .is_ok()
                    })
                    .and_then(|operand| {
                        float(types[operand].inner_with(&module.types))
                            .map(|size| (fun, argument, size))
                    })
            }
            _ => None,
        };
        let Some((fun, argument, size)) = argument else {
            let new = expressions.append(expression, span);
            map.push((new, new));
            continue;
        };
        let bits = expressions.append(
            Expression::As {
                expr: argument,
                kind: ScalarKind::Uint,
                convert: None,
            },
            span,
        );
        let mut wide = |value| match size {
            Some(size) => expressions.append(Expression::Splat { size, value }, span),
            None => value,
        };
        let (magnitude, infinity) = (wide(magnitude), wide(infinity));
        let magnitude = expressions.append(
            Expression::Binary {
                op: BinaryOperator::And,
                left: bits,
                right: magnitude,
            },
            span,
        );
        let test = expressions.append(
            Expression::Binary {
                op: match fun {
                    RelationalFunction::IsInf => BinaryOperator::Equal,
                    _ => BinaryOperator::Greater,
                },
                left: magnitude,
                right: infinity,
            },
            span,
        );
        map.push((bits, test));
    }
    let mut lowered = Function {
        expressions,
        ..function.clone()
    };
    let value = |old: Handle<Expression>| map[old.index()].1;
    for (_, local) in lowered.local_variables.iter_mut() {
        local.init = local.init.map(value);
    }
    lowered.named_expressions = (function.named_expressions.iter())
        .map(|(old, name)| (value(*old), name.clone()))
        .collect();
    rewire(&mut lowered.body, &map);
    lowered
}

fn operand_of(function: &Function, test: Handle<Expression>) -> Option<Handle<Expression>> {
    match function.expressions[test] {
        Expression::Relational { argument, .. } => Some(argument),
        _ => None,
    }
}

/// The size of a vector of f32, or nothing in it for an f32; `None` for another type.
fn float(ty: &TypeInner) -> Option<Option<VectorSize>> {
    match *ty {
        TypeInner::Scalar(Scalar::F32) => Some(None),
        TypeInner::Vector {
            size,
            scalar: Scalar::F32,
        } => Some(Some(size)),
        _ => None,
    }
}

/// Puts new values in the place of old ones.
fn rewire(block: &mut Block, map: &[(Handle<Expression>, Handle<Expression>)]) {
    for statement in block.iter_mut() {
        match statement {
            Statement::Emit(range) => {
                if let Some((first, last)) = range.first_and_last() {
                    *range = Range::new_from_bounds(map[first.index()].0, map[last.index()].1);
                }
            }
            Statement::Block(inner) => rewire(inner, map),
            Statement::If { accept, reject, .. } => {
                rewire(accept, map);
                rewire(reject, map);
            }
            Statement::Loop {
                body, continuing, ..
            } => {
                rewire(body, map);
                rewire(continuing, map);
            }
            Statement::Switch { cases, .. } => {
                cases
                    .iter_mut()
                    .for_each(|case| rewire(&mut case.body, map));
            }
            _ => {}
        }
        let new = |value: &mut Handle<Expression>| *value = map[value.index()].1;
        operands::each_mut_of_statement(statement, new, new);
    }
}

/// Gives each case that goes on into the next one a copy of it. A case without a body stays: WGSL has several
/// selectors for one body.
fn separate_cases(block: &mut Block, expressions: &mut Arena<Expression>) {
    for statement in block.iter_mut() {
        match statement {
            Statement::Block(inner) => separate_cases(inner, expressions),
            Statement::If { accept, reject, .. } => {
                separate_cases(accept, expressions);
                separate_cases(reject, expressions);
            }
            Statement::Loop {
                body, continuing, ..
            } => {
                separate_cases(body, expressions);
                separate_cases(continuing, expressions);
            }
            Statement::Switch { cases, .. } => {
                let mut next = Block::new();
                for case in cases.iter_mut().rev() {
                    separate_cases(&mut case.body, expressions);
                    if case.fall_through && !case.body.is_empty() {
                        let copy = copied(&next, expressions, &mut BTreeMap::new());
                        case.body.extend_block(copy);
                        case.fall_through = false;
                    }
                    if !case.fall_through {
                        next = case.body.clone();
                    }
                }
            }
            _ => {}
        }
    }
}

/// A copy of a block that computes values of its own: each value is computed in one place alone.
fn copied(
    block: &Block,
    expressions: &mut Arena<Expression>,
    map: &mut BTreeMap<Handle<Expression>, Handle<Expression>>,
) -> Block {
    let mut copy = Block::with_capacity(block.len());
    for (statement, span) in block.span_iter() {
        let mut again =
            |old: Handle<Expression>,
             map: &mut BTreeMap<Handle<Expression>, Handle<Expression>>| {
                let expression = operands::map(&expressions[old], |operand| {
                    map.get(&operand).copied().unwrap_or(operand)
                });
                let span = expressions.get_span(old);
                let new = expressions.append(expression, span);
                map.insert(old, new);
                new
            };
        let mut statement = statement.clone();
        if let Statement::Emit(range) = &mut statement {
            let copies: Vec<Handle<Expression>> =
                range.clone().map(|old| again(old, map)).collect();
            if let (Some(first), Some(last)) = (copies.first(), copies.last()) {
                *range = Range::new_from_bounds(*first, *last);
            }
        } else if let Some(result) = operands::result(&statement) {
            again(result, map);
        }
        let new = |value: &mut Handle<Expression>| {
            *value = map.get(value).copied().unwrap_or(*value);
        };
        operands::each_mut_of_statement(&mut statement, new, new);
        match &mut statement {
            Statement::Block(inner) => *inner = copied(inner, expressions, map),
            Statement::If { accept, reject, .. } => {
                *accept = copied(accept, expressions, map);
                *reject = copied(reject, expressions, map);
            }
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => {
                *body = copied(body, expressions, map);
                *continuing = copied(continuing, expressions, map);
                // It may read what the loop computes.
                *break_if = break_if.map(|value| map.get(&value).copied().unwrap_or(value));
            }
            Statement::Switch { cases, .. } => {
                for case in cases {
                    case.body = copied(&case.body, expressions, map);
                }
            }
            _ => {}
        }
        copy.push(statement, *span);
    }
    copy
}
