//! The operands of every naga expression and statement: the only place that lists them.
//!
//! An operand is a value that an expression or a statement reads. The value that a statement
//! produces (the result of a call or of an atomic operation) is its [`result`], not an operand.

use naga::{
    AtomicFunction, Block, CooperativeData, Expression, Function, GatherMode, Handle, ImageQuery,
    RayPipelineFunction, RayQueryFunction, SampleLevel, Statement, SwitchCase,
};

/// Calls `$visit` with a reference to each operand of an expression, shared or mutable as `$expr` is.
macro_rules! expression_operands {
    ($expr:expr, $visit:expr) => {
        match $expr {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::Override(_)
            | Expression::ZeroValue(_)
            | Expression::FunctionArgument(_)
            | Expression::GlobalVariable(_)
            | Expression::LocalVariable(_)
            | Expression::CallResult(_)
            | Expression::AtomicResult { .. }
            | Expression::WorkGroupUniformLoadResult { .. }
            | Expression::RayQueryProceedResult
            | Expression::SubgroupBallotResult
            | Expression::SubgroupOperationResult { .. } => {}
            Expression::Compose { ty: _, components } => {
                for component in components {
                    $visit(component);
                }
            }
            Expression::Access { base, index } => {
                $visit(base);
                $visit(index);
            }
            Expression::AccessIndex { base, index: _ } => $visit(base),
            Expression::Splat { size: _, value } => $visit(value),
            Expression::Swizzle { vector, .. } => $visit(vector),
            Expression::Load { pointer } => $visit(pointer),
            Expression::ImageSample {
                image,
                sampler,
                gather: _,
                coordinate,
                array_index,
                offset,
                level,
                depth_ref,
                clamp_to_edge: _,
            } => {
                $visit(image);
                $visit(sampler);
                $visit(coordinate);
                if let Some(array_index) = array_index {
                    $visit(array_index);
                }
                if let Some(offset) = offset {
                    $visit(offset);
                }
                match level {
                    SampleLevel::Auto | SampleLevel::Zero => {}
                    SampleLevel::Exact(level) | SampleLevel::Bias(level) => $visit(level),
                    SampleLevel::Gradient { x, y } => {
                        $visit(x);
                        $visit(y);
                    }
                }
                if let Some(depth_ref) = depth_ref {
                    $visit(depth_ref);
                }
            }
            Expression::ImageLoad {
                image,
                coordinate,
                array_index,
                sample,
                level,
            } => {
                $visit(image);
                $visit(coordinate);
                if let Some(array_index) = array_index {
                    $visit(array_index);
                }
                if let Some(sample) = sample {
                    $visit(sample);
                }
                if let Some(level) = level {
                    $visit(level);
                }
            }
            Expression::ImageQuery { image, query } => {
                $visit(image);
                match query {
                    ImageQuery::Size { level: Some(level) } => $visit(level),
                    ImageQuery::Size { level: None }
                    | ImageQuery::NumLevels
                    | ImageQuery::NumLayers
                    | ImageQuery::NumSamples => {}
                }
            }
            Expression::Unary { op: _, expr } => $visit(expr),
            Expression::Binary { op: _, left, right } => {
                $visit(left);
                $visit(right);
            }
            Expression::Select {
                condition,
                accept,
                reject,
            } => {
                $visit(condition);
                $visit(accept);
                $visit(reject);
            }
            Expression::Derivative { expr, .. } => $visit(expr),
            Expression::Relational { fun: _, argument } => $visit(argument),
            Expression::Math {
                fun: _,
                arg,
                arg1,
                arg2,
                arg3,
            } => {
                $visit(arg);
                if let Some(arg1) = arg1 {
                    $visit(arg1);
                }
                if let Some(arg2) = arg2 {
                    $visit(arg2);
                }
                if let Some(arg3) = arg3 {
                    $visit(arg3);
                }
            }
            Expression::As { expr, .. } => $visit(expr),
            Expression::ArrayLength(array) => $visit(array),
            Expression::RayQueryVertexPositions { query, .. }
            | Expression::RayQueryGetIntersection { query, .. } => $visit(query),
            Expression::CooperativeLoad { data, .. } => {
                let CooperativeData {
                    pointer,
                    stride,
                    row_major: _,
                } = data;
                $visit(pointer);
                $visit(stride);
            }
            Expression::CooperativeMultiplyAdd { a, b, c } => {
                $visit(a);
                $visit(b);
                $visit(c);
            }
        }
    };
}

/// Calls `$visit` with a reference to each operand of a statement, and `$result` with its result.
macro_rules! statement_operands {
    ($statement:expr, $visit:expr, $result:expr) => {
        match $statement {
            Statement::Emit(_)
            | Statement::Block(_)
            | Statement::Break
            | Statement::Continue
            | Statement::Kill
            | Statement::ControlBarrier(_)
            | Statement::MemoryBarrier(_) => {}
            Statement::If { condition, .. } => $visit(condition),
            Statement::Switch { selector, .. } => $visit(selector),
            Statement::Loop { break_if, .. } => {
                if let Some(break_if) = break_if {
                    $visit(break_if);
                }
            }
            Statement::Return { value } => {
                if let Some(value) = value {
                    $visit(value);
                }
            }
            Statement::Store { pointer, value } => {
                $visit(pointer);
                $visit(value);
            }
            Statement::ImageStore {
                image,
                coordinate,
                array_index,
                value,
            } => {
                $visit(image);
                $visit(coordinate);
                if let Some(array_index) = array_index {
                    $visit(array_index);
                }
                $visit(value);
            }
            Statement::Atomic {
                pointer,
                fun,
                value,
                result,
            } => {
                $visit(pointer);
                if let AtomicFunction::Exchange {
                    compare: Some(compare),
                } = fun
                {
                    $visit(compare);
                }
                $visit(value);
                if let Some(result) = result {
                    $result(result);
                }
            }
            Statement::ImageAtomic {
                image,
                coordinate,
                array_index,
                fun,
                value,
            } => {
                $visit(image);
                $visit(coordinate);
                if let Some(array_index) = array_index {
                    $visit(array_index);
                }
                if let AtomicFunction::Exchange {
                    compare: Some(compare),
                } = fun
                {
                    $visit(compare);
                }
                $visit(value);
            }
            Statement::WorkGroupUniformLoad { pointer, result } => {
                $visit(pointer);
                $result(result);
            }
            Statement::Call {
                function: _,
                arguments,
                result,
            } => {
                for argument in arguments {
                    $visit(argument);
                }
                if let Some(result) = result {
                    $result(result);
                }
            }
            Statement::RayQuery { query, fun } => {
                $visit(query);
                match fun {
                    RayQueryFunction::Initialize {
                        acceleration_structure,
                        descriptor,
                    } => {
                        $visit(acceleration_structure);
                        $visit(descriptor);
                    }
                    RayQueryFunction::Proceed { result } => $result(result),
                    RayQueryFunction::GenerateIntersection { hit_t } => $visit(hit_t),
                    RayQueryFunction::ConfirmIntersection | RayQueryFunction::Terminate => {}
                }
            }
            Statement::RayPipelineFunction(RayPipelineFunction::TraceRay {
                acceleration_structure,
                descriptor,
                payload,
            }) => {
                $visit(acceleration_structure);
                $visit(descriptor);
                $visit(payload);
            }
            Statement::SubgroupBallot { result, predicate } => {
                if let Some(predicate) = predicate {
                    $visit(predicate);
                }
                $result(result);
            }
            Statement::SubgroupGather {
                mode,
                argument,
                result,
            } => {
                match mode {
                    GatherMode::BroadcastFirst | GatherMode::QuadSwap(_) => {}
                    GatherMode::Broadcast(lane)
                    | GatherMode::Shuffle(lane)
                    | GatherMode::ShuffleDown(lane)
                    | GatherMode::ShuffleUp(lane)
                    | GatherMode::ShuffleXor(lane)
                    | GatherMode::QuadBroadcast(lane) => $visit(lane),
                }
                $visit(argument);
                $result(result);
            }
            Statement::SubgroupCollectiveOperation {
                argument, result, ..
            } => {
                $visit(argument);
                $result(result);
            }
            Statement::CooperativeStore { target, data } => {
                $visit(target);
                let CooperativeData {
                    pointer,
                    stride,
                    row_major: _,
                } = data;
                $visit(pointer);
                $visit(stride);
            }
        }
    };
}

/// Calls `visit` for each operand of an expression, in order.
pub fn each(expression: &Expression, mut visit: impl FnMut(Handle<Expression>)) {
    let mut visit = |operand: &Handle<Expression>| visit(*operand);
    expression_operands!(expression, visit);
}

/// Changes each operand of an expression in place, in order.
pub fn each_mut(expression: &mut Expression, mut visit: impl FnMut(&mut Handle<Expression>)) {
    expression_operands!(expression, visit);
}

/// The same expression over other operands.
pub fn map(
    expression: &Expression,
    mut to: impl FnMut(Handle<Expression>) -> Handle<Expression>,
) -> Expression {
    let mut mapped = expression.clone();
    each_mut(&mut mapped, |operand| *operand = to(*operand));
    mapped
}

/// Calls `visit` for each operand of a statement itself, not of the statements in its blocks.
pub fn each_of_statement(statement: &Statement, mut visit: impl FnMut(Handle<Expression>)) {
    let mut visit = |operand: &Handle<Expression>| visit(*operand);
    let result = |_: &Handle<Expression>| {};
    statement_operands!(statement, visit, result);
}

/// Changes each operand of a statement itself in place, and its result.
pub fn each_mut_of_statement(
    statement: &mut Statement,
    mut visit: impl FnMut(&mut Handle<Expression>),
    mut result: impl FnMut(&mut Handle<Expression>),
) {
    statement_operands!(statement, visit, result);
}

/// The value that a statement produces, as the result of a call does.
pub fn result(statement: &Statement) -> Option<Handle<Expression>> {
    let mut found = None;
    let visit = |_: &Handle<Expression>| {};
    let mut result = |produced: &Handle<Expression>| found = Some(*produced);
    statement_operands!(statement, visit, result);
    found
}

/// The blocks of a statement, in the order in which they are written; a loop's `continuing` comes
/// after its body.
pub fn blocks(statement: &Statement) -> impl Iterator<Item = &Block> {
    let (two, cases): ([Option<&Block>; 2], &[SwitchCase]) = match statement {
        Statement::Block(block) => ([Some(block), None], &[]),
        Statement::If { accept, reject, .. } => ([Some(accept), Some(reject)], &[]),
        Statement::Loop {
            body, continuing, ..
        } => ([Some(body), Some(continuing)], &[]),
        Statement::Switch { cases, .. } => ([None, None], cases),
        _ => ([None, None], &[]),
    };
    let cases = cases.iter().map(|case| &case.body);
    two.into_iter().flatten().chain(cases)
}

/// The same, to be changed.
pub fn blocks_mut(statement: &mut Statement) -> impl Iterator<Item = &mut Block> {
    let (two, cases): ([Option<&mut Block>; 2], &mut [SwitchCase]) = match statement {
        Statement::Block(block) => ([Some(block), None], &mut []),
        Statement::If { accept, reject, .. } => ([Some(accept), Some(reject)], &mut []),
        Statement::Loop {
            body, continuing, ..
        } => ([Some(body), Some(continuing)], &mut []),
        Statement::Switch { cases, .. } => ([None, None], cases),
        _ => ([None, None], &mut []),
    };
    let cases = cases.iter_mut().map(|case| &mut case.body);
    two.into_iter().flatten().chain(cases)
}

/// Calls `visit` for each statement of a block and of the blocks in it, a statement before its blocks.
pub fn walk<'a>(block: &'a Block, visit: &mut impl FnMut(&'a Statement)) {
    for statement in block {
        visit(statement);
        for inner in blocks(statement) {
            walk(inner, visit);
        }
    }
}

/// What reads a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum User {
    /// An expression.
    Value(Handle<Expression>),
    /// A statement, by its number in the order of [`walk`].
    Statement(usize),
}

/// For each expression of a function, by its index: what reads it, in arena order, statements last.
/// A user that reads a value twice is there twice.
pub fn users(function: &Function) -> Vec<Vec<User>> {
    let mut users = vec![Vec::new(); function.expressions.len()];
    for (user, expression) in function.expressions.iter() {
        each(expression, |operand| {
            users[operand.index()].push(User::Value(user));
        });
    }
    let mut number = 0;
    walk(&function.body, &mut |statement| {
        each_of_statement(statement, |operand| {
            users[operand.index()].push(User::Statement(number));
        });
        number += 1;
    });
    users
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fragment(body: &str) -> Function {
        let module = naga::front::wgsl::parse_str(body).expect("the test's shader parses");
        module.entry_points[0].function.clone()
    }

    #[test]
    fn every_operand_of_a_sample_is_seen_in_order_and_can_be_changed() {
        let function = fragment(
            "@group(0) @binding(0) var t: texture_depth_2d_array;
             @group(0) @binding(1) var s: sampler_comparison;
             @fragment fn main(@location(0) uv: vec2f) -> @location(0) vec4f {
                 return vec4f(textureSampleCompare(t, s, uv, i32(uv.x), uv.y, vec2i(1, 1)));
             }",
        );
        let (_, sample) = function
            .expressions
            .iter()
            .find(|(_, e)| matches!(e, Expression::ImageSample { .. }))
            .expect("there is a sample");
        let mut operands = Vec::new();
        each(sample, |operand| operands.push(operand));
        assert_eq!(
            operands.len(),
            6,
            "image, sampler, coordinate, layer, offset, reference"
        );
        let same = map(sample, |operand| operand);
        assert_eq!(&same, sample);
        let first = operands[0];
        let mut changed = Vec::new();
        each(&map(sample, |_| first), |operand| changed.push(operand));
        assert_eq!(changed, vec![first; 6]);
    }

    #[test]
    fn users_are_expressions_then_statements() {
        let function = fragment(
            "@fragment fn main(@location(0) a: f32) -> @location(0) vec4f {
                 if a > 0.5 { return vec4f(a * a); }
                 return vec4f(a);
             }",
        );
        let users = users(&function);
        let (argument, _) = function
            .expressions
            .iter()
            .find(|(_, e)| matches!(e, Expression::FunctionArgument(0)))
            .expect("there is an argument");
        assert_eq!(
            users[argument.index()].len(),
            4,
            "compared, squared, splatted"
        );
        let (condition, _) = function
            .expressions
            .iter()
            .find(|(_, e)| {
                matches!(
                    e,
                    Expression::Binary {
                        op: naga::BinaryOperator::Greater,
                        ..
                    }
                )
            })
            .expect("there is a comparison");
        assert!(matches!(users[condition.index()][..], [User::Statement(_)]));
    }
}
