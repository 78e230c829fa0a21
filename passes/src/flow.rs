//! What flows where in one entry point: types, users, and the values that no lossy pass may touch.
//!
//! A [`Flow`] is read off a function once and answers questions about it: who uses a value, whether
//! anything in it varies, what it keeps alive, whether it decides something other than a colour.
//! It changes nothing. Local variables are followed as a whole: whatever is stored in one may come out
//! of any of its loads, so every answer errs on the careful side.

use crate::operands::{self, User};
use crate::shader::{Shader, Stage, ValueId};
use naga::{
    Binding, Block, Expression, Function, GlobalVariable, Handle, Literal, LocalVariable,
    MathFunction as Math, Module, Scalar, ScalarKind, Statement, TypeInner,
};
use std::fmt;

/// A value of the function that is looked at.
pub(crate) type Value = Handle<Expression>;

/// What a value decides that a picture's error does not measure, or measures too late.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Decides {
    /// Whether a loop goes on: changed, it might never end.
    Loop,
    /// A built-in output: the position or the depth.
    BuiltIn,
    /// What is written to memory, or where.
    Memory,
}

impl fmt::Display for Decides {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Loop => "it decides when a loop ends",
            Self::BuiltIn => "it decides a built-in output",
            Self::Memory => "it decides what is written to memory",
        })
    }
}

/// An `if` or `switch` around a statement.
#[derive(Debug)]
struct Branch {
    outer: Option<usize>,
    condition: Value,
    /// How many loops are around it.
    depth: usize,
}

/// A store to a local variable, or to a part of one.
#[derive(Debug)]
struct LocalStore {
    local: Handle<LocalVariable>,
    pointer: Value,
    value: Value,
    branch: Option<usize>,
    /// The loops around it, outermost first.
    loops: Vec<usize>,
    /// Whether it is reached in every round of its innermost loop that goes on.
    every_round: bool,
}

/// A way out of a loop, or one around its ways out.
struct Exit {
    loop_: usize,
    conditions: Vec<Value>,
    /// Whether every round tests it.
    every_round: bool,
}

/// A stage's entry point, and what flows where in it.
pub(crate) struct Flow<'a> {
    pub(crate) shader: &'a Shader,
    pub(crate) stage: Stage,
    pub(crate) module: &'a Module,
    pub(crate) function: &'a Function,
    findings: &'a Findings,
}

/// What is found out about a function once, and kept with its shader.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    constant: Vec<bool>,
    decides: Vec<Option<Decides>>,
    stores: Vec<LocalStore>,
}

impl Findings {
    /// Reads a stage's entry point.
    pub(crate) fn of(shader: &Shader, stage: Stage) -> Self {
        let Some(function) = shader.function(stage) else {
            return Self::default();
        };
        let mut reader = Reader {
            shader,
            stage,
            function,
            branches: Vec::new(),
            stores: Vec::new(),
            loops: Vec::new(),
            continued: Vec::new(),
            exits: Vec::new(),
            roots: Vec::new(),
        };
        reader.block(&function.body, None, false);
        Self {
            constant: constant(function),
            decides: reader.decisions(),
            stores: reader.stores,
        }
    }
}

/// For each value, whether it is made of literals, constants and overrides alone.
fn constant(function: &Function) -> Vec<bool> {
    let mut constant = vec![false; function.expressions.len()];
    for (value, expression) in function.expressions.iter() {
        constant[value.index()] = match expression {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::Override(_)
            | Expression::ZeroValue(_) => true,
            Expression::Load { .. }
            | Expression::ImageSample { .. }
            | Expression::ImageLoad { .. }
            | Expression::ImageQuery { .. } => false,
            _ => {
                let mut any = false;
                let mut all = true;
                operands::each(expression, |operand| {
                    any = true;
                    all &= constant[operand.index()];
                });
                any && all
            }
        };
    }
    constant
}

impl<'a> Flow<'a> {
    /// A stage of a shader; `None` when it lacks the stage.
    pub(crate) fn new(shader: &'a Shader, stage: Stage) -> Option<Self> {
        Some(Self {
            shader,
            stage,
            module: shader.module(),
            function: shader.function(stage)?,
            findings: shader.findings(stage),
        })
    }

    /// The id of a value.
    pub(crate) fn id(&self, value: Value) -> &'a ValueId {
        self.shader.id(self.stage, value)
    }

    /// The type of a value.
    pub(crate) fn inner(&self, value: Value) -> &'a TypeInner {
        self.shader.type_of(self.stage, value)
    }

    /// How many components a scalar or vector of f32 has; `None` for any other type.
    pub(crate) fn floats(&self, value: Value) -> Option<usize> {
        match *self.inner(value) {
            TypeInner::Scalar(Scalar::F32) => Some(1),
            TypeInner::Vector {
                size,
                scalar: Scalar::F32,
            } => Some(size as usize),
            _ => None,
        }
    }

    /// Whether a value is a float, or a vector or matrix of floats.
    pub(crate) fn is_float(&self, value: Value) -> bool {
        is_float(self.inner(value))
    }

    /// The expressions that use a value, each once, in arena order.
    pub(crate) fn users(&self, value: Value) -> impl Iterator<Item = Value> + use<'a> {
        let mut last = None;
        let users = self.shader.users(self.stage, value);
        users.iter().filter_map(move |user| match *user {
            User::Value(user) => (last.replace(user) != Some(user)).then_some(user),
            User::Statement(_) => None,
        })
    }

    /// Whether a statement uses a value: a condition, a store, a return.
    pub(crate) fn is_stated(&self, value: Value) -> bool {
        let users = self.shader.users(self.stage, value);
        matches!(users.last(), Some(User::Statement(_)))
    }

    /// Whether a value is made of literals, constants and overrides alone.
    pub(crate) fn is_constant(&self, value: Value) -> bool {
        self.findings.constant[value.index()]
    }

    /// Why a value must stay as it is, when it must.
    pub(crate) fn decides(&self, value: Value) -> Option<Decides> {
        self.findings.decides[value.index()]
    }

    /// The variable that a pointer, image or sampler comes from.
    pub(crate) fn global(&self, mut value: Value) -> Option<Handle<GlobalVariable>> {
        loop {
            match self.function.expressions[value] {
                Expression::GlobalVariable(global) => return Some(global),
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                    value = base
                }
                _ => return None,
            }
        }
    }

    /// The local variable that a pointer points into.
    pub(crate) fn local(&self, pointer: Value) -> Option<Handle<LocalVariable>> {
        local(self.function, pointer)
    }

    /// The binding of the entry point's input that a value is, when it is one.
    pub(crate) fn input(&self, value: Value) -> Option<&'a Binding> {
        match self.function.expressions[value] {
            Expression::FunctionArgument(i) => {
                self.function.arguments.get(i as usize)?.binding.as_ref()
            }
            Expression::AccessIndex { base, index } => {
                let Expression::FunctionArgument(i) = self.function.expressions[base] else {
                    return None;
                };
                let argument = self.function.arguments.get(i as usize)?;
                match self.module.types[argument.ty].inner {
                    TypeInner::Struct { ref members, .. } => {
                        members.get(index as usize)?.binding.as_ref()
                    }
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// For each value, on which sides it has holes before it: whether a number that is too low or too
    /// high leads to an operation whose domain ends there (a division, a logarithm, a root), through
    /// operations that hand it on.
    pub(crate) fn holes(&self) -> Vec<Holes> {
        let mut found = vec![Holes::default(); self.function.expressions.len()];
        // A second round takes what a loop stores back to the loads above it.
        for _ in 0..2 {
            let mut before_local = vec![Holes::default(); self.function.local_variables.len()];
            for (user, expression) in self.function.expressions.iter().rev() {
                let after = found[user.index()];
                if let Expression::Load { pointer } = *expression
                    && let Some(local) = self.local(pointer)
                {
                    before_local[local.index()] |= after;
                }
                holes(
                    expression,
                    |value| self.is_constant(value),
                    after,
                    |operand, holes| {
                        if self.is_float(operand) {
                            found[operand.index()] |= holes;
                        }
                    },
                );
            }
            for store in &self.findings.stores {
                found[store.value.index()] |= before_local[store.local.index()];
            }
        }
        found
    }

    /// Whether an operation itself has a hole in the domain of an operand.
    pub(crate) fn has_hole(&self, operation: Value, operand: Value) -> bool {
        let mut found = Holes::default();
        let expression = &self.function.expressions[operation];
        holes(
            expression,
            |_| false,
            Holes::default(),
            |value, holes| {
                if value == operand {
                    found |= holes;
                }
            },
        );
        found != Holes::default()
    }

    /// For each value, whether anything that differs between fragments is in it: an input, a
    /// derivative or a texture sample, or a local variable, which may hold one.
    pub(crate) fn varying(&self) -> Vec<bool> {
        let mut varying = vec![false; self.function.expressions.len()];
        for (value, expression) in self.function.expressions.iter() {
            varying[value.index()] = match expression {
                Expression::FunctionArgument(_) | Expression::LocalVariable(_) => true,
                _ => {
                    let mut any = false;
                    operands::each(expression, |operand| any |= varying[operand.index()]);
                    any
                }
            };
        }
        varying
    }
}

/// Whether a type is a float, or a vector or matrix of floats.
fn is_float(inner: &TypeInner) -> bool {
    matches!(
        inner.scalar(),
        Some(Scalar {
            kind: ScalarKind::Float,
            ..
        })
    ) && !matches!(inner, TypeInner::Atomic(_) | TypeInner::ValuePointer { .. })
}

/// The local variable that a pointer points into.
fn local(function: &Function, mut pointer: Value) -> Option<Handle<LocalVariable>> {
    loop {
        match function.expressions[pointer] {
            Expression::LocalVariable(local) => return Some(local),
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                pointer = base;
            }
            _ => return None,
        }
    }
}

/// The sides on which the domain of an operation further on ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Holes {
    /// A number that is too low falls in.
    pub(crate) low: bool,
    /// A number that is too high falls in.
    pub(crate) high: bool,
}

impl Holes {
    const LOW: Self = Self {
        low: true,
        high: false,
    };
    const BOTH: Self = Self {
        low: true,
        high: true,
    };

    fn flipped(self) -> Self {
        Self {
            low: self.high,
            high: self.low,
        }
    }

    /// For an operand whose sign, or whose partner's sign, decides the side.
    fn either(self) -> Self {
        let any = self.low || self.high;
        Self {
            low: any,
            high: any,
        }
    }
}

impl std::ops::BitOrAssign for Holes {
    fn bitor_assign(&mut self, other: Self) {
        self.low |= other.low;
        self.high |= other.high;
    }
}

/// Tells the holes before each operand of an operation: its own, and those after it (`after`) that a
/// bad number in the operand would reach.
///
/// Operations whose result lies in a safe range whatever goes in (`clamp`, `exp`, a `max` with a
/// constant on its side) end the search: a bad number ends there.
fn holes(
    expression: &Expression,
    is_constant: impl Fn(Value) -> bool,
    after: Holes,
    mut visit: impl FnMut(Value, Holes),
) {
    use naga::BinaryOperator as Op;
    match *expression {
        Expression::Binary { op, left, right } => match op {
            Op::Divide | Op::Modulo => {
                visit(left, after.either());
                // A divisor is kept off 0 from above as a rule.
                visit(right, Holes::LOW);
                visit(right, after.either());
            }
            Op::Add => [left, right]
                .into_iter()
                .for_each(|value| visit(value, after)),
            Op::Subtract => {
                visit(left, after);
                visit(right, after.flipped());
            }
            Op::Multiply => {
                [left, right]
                    .into_iter()
                    .for_each(|value| visit(value, after.either()));
            }
            _ => {}
        },
        Expression::Unary { expr, .. } => visit(expr, after.flipped()),
        Expression::Swizzle { vector: value, .. }
        | Expression::Splat { value, .. }
        | Expression::AccessIndex { base: value, .. }
        | Expression::Access { base: value, .. } => visit(value, after),
        Expression::Compose { ref components, .. } => {
            components
                .iter()
                .for_each(|&component| visit(component, after));
        }
        Expression::Select { accept, reject, .. } => {
            visit(accept, after);
            visit(reject, after);
        }
        Expression::Math {
            fun,
            arg,
            arg1,
            arg2,
            ..
        } => {
            let others = || arg1.into_iter().chain(arg2);
            match fun {
                Math::Log
                | Math::Log2
                | Math::Sqrt
                | Math::InverseSqrt
                | Math::Pow
                | Math::Normalize
                | Math::Acosh => {
                    let mut holes = after;
                    holes |= Holes::LOW;
                    visit(arg, holes);
                }
                Math::Acos | Math::Asin | Math::Atanh => visit(arg, Holes::BOTH),
                Math::Min | Math::Max => {
                    let limited = is_constant(arg) || others().any(&is_constant);
                    let rest = match fun {
                        Math::Max => Holes {
                            low: after.low && !limited,
                            ..after
                        },
                        _ => Holes {
                            high: after.high && !limited,
                            ..after
                        },
                    };
                    visit(arg, rest);
                    others().for_each(|value| visit(value, rest));
                }
                Math::Abs => visit(
                    arg,
                    Holes {
                        low: false,
                        ..after
                    }
                    .either(),
                ),
                Math::Floor | Math::Ceil | Math::Round | Math::Trunc => visit(arg, after),
                Math::Mix
                | Math::Fma
                | Math::Dot
                | Math::Cross
                | Math::Reflect
                | Math::Distance
                | Math::Length => {
                    visit(arg, after.either());
                    others().for_each(|value| visit(value, after.either()));
                }
                _ => {}
            }
        }
        _ => {}
    }
}

/// Reads a function's statements.
struct Reader<'a> {
    shader: &'a Shader,
    stage: Stage,
    function: &'a Function,
    branches: Vec<Branch>,
    stores: Vec<LocalStore>,
    /// The loops around the statement that is read, outermost first.
    loops: Vec<usize>,
    /// For each loop met, whether a `continue` has been read in it.
    continued: Vec<bool>,
    exits: Vec<Exit>,
    /// Values that statements make count for more than the picture.
    roots: Vec<(Value, Decides)>,
}

impl Reader<'_> {
    fn branch(&mut self, outer: Option<usize>, condition: Value) -> Option<usize> {
        let depth = self.loops.len();
        self.branches.push(Branch {
            outer,
            condition,
            depth,
        });
        Some(self.branches.len() - 1)
    }

    /// The branches between a statement and a loop of the given depth around it, innermost first.
    fn inside(&self, mut branch: Option<usize>, depth: usize) -> Vec<usize> {
        let mut found = Vec::new();
        while let Some(i) = branch {
            if self.branches[i].depth < depth {
                break;
            }
            found.push(i);
            branch = self.branches[i].outer;
        }
        found
    }

    fn exit(&mut self, depth: usize, branch: Option<usize>) {
        let loop_ = self.loops[depth - 1];
        let branches = self.inside(branch, depth);
        let every_round =
            branches.len() == 1 && depth == self.loops.len() && !self.continued[loop_];
        let conditions = branches
            .iter()
            .map(|&i| self.branches[i].condition)
            .collect();
        self.exits.push(Exit {
            loop_,
            conditions,
            every_round,
        });
    }

    /// Reads a block. `switch` says that a `break` in it leaves a switch, not a loop.
    fn block(&mut self, block: &Block, branch: Option<usize>, switch: bool) {
        for statement in block {
            match *statement {
                Statement::Block(ref block) => self.block(block, branch, switch),
                Statement::If {
                    condition,
                    ref accept,
                    ref reject,
                } => {
                    let branch = self.branch(branch, condition);
                    self.block(accept, branch, switch);
                    self.block(reject, branch, switch);
                }
                Statement::Switch {
                    selector,
                    ref cases,
                } => {
                    let branch = self.branch(branch, selector);
                    for case in cases {
                        self.block(&case.body, branch, true);
                    }
                }
                Statement::Loop {
                    ref body,
                    ref continuing,
                    break_if,
                } => {
                    let loop_ = self.continued.len();
                    self.continued.push(false);
                    self.loops.push(loop_);
                    self.block(body, branch, false);
                    // A `continue` leads here: what stands here runs in every round.
                    let continued = std::mem::replace(&mut self.continued[loop_], false);
                    self.block(continuing, branch, false);
                    self.continued[loop_] = continued;
                    if let Some(condition) = break_if {
                        let conditions = vec![condition];
                        self.exits.push(Exit {
                            loop_,
                            conditions,
                            every_round: true,
                        });
                    }
                    self.loops.pop();
                }
                Statement::Break if !switch => {
                    if !self.loops.is_empty() {
                        self.exit(self.loops.len(), branch);
                    }
                }
                Statement::Continue => {
                    if let Some(&loop_) = self.loops.last() {
                        // It may pass by the test and the step of a counter.
                        self.exit(self.loops.len(), branch);
                        self.continued[loop_] = true;
                        if let Some(exit) = self.exits.last_mut() {
                            exit.every_round = false;
                        }
                    }
                }
                Statement::Return { value } => {
                    for depth in 1..=self.loops.len() {
                        self.exit(depth, branch);
                    }
                    if let Some(value) = value {
                        self.result(value);
                    }
                }
                Statement::Store { pointer, value } => match local(self.function, pointer) {
                    Some(local) => {
                        let depth = self.loops.len();
                        let every_round = self.loops.last().is_some_and(|&loop_| {
                            !self.continued[loop_] && self.inside(branch, depth).is_empty()
                        });
                        self.stores.push(LocalStore {
                            local,
                            pointer,
                            value,
                            branch,
                            loops: self.loops.clone(),
                            every_round,
                        });
                    }
                    None => self.memory(statement, branch),
                },
                Statement::Emit(_)
                | Statement::Break
                | Statement::Kill
                | Statement::ControlBarrier(_)
                | Statement::MemoryBarrier(_) => {}
                _ => self.memory(statement, branch),
            }
        }
    }

    /// A statement with an effect outside the picture: all that it uses, and all that decides whether
    /// it runs.
    fn memory(&mut self, statement: &Statement, branch: Option<usize>) {
        let roots = &mut self.roots;
        operands::each_of_statement(statement, |value| roots.push((value, Decides::Memory)));
        for i in self.inside(branch, 0) {
            self.roots
                .push((self.branches[i].condition, Decides::Memory));
        }
    }

    /// The built-in outputs in what is returned.
    fn result(&mut self, value: Value) {
        let Some(result) = &self.function.result else {
            return;
        };
        let is_built_in = |binding: &Option<Binding>| matches!(binding, Some(Binding::BuiltIn(_)));
        if is_built_in(&result.binding) {
            self.roots.push((value, Decides::BuiltIn));
        }
        let TypeInner::Struct { ref members, .. } = self.shader.module().types[result.ty].inner
        else {
            return;
        };
        for (i, member) in members.iter().enumerate() {
            if is_built_in(&member.binding) {
                let root = match self.function.expressions[value] {
                    Expression::Compose { ref components, .. } => components.get(i).copied(),
                    _ => Some(value),
                };
                self.roots.extend(root.map(|root| (root, Decides::BuiltIn)));
            }
        }
    }

    /// For each value, what it decides.
    fn decisions(&self) -> Vec<Option<Decides>> {
        let mut decides = vec![None; self.function.expressions.len()];
        let mut mark = |value, why| {
            self.slice(value, |value| {
                let fresh = decides[value.index()].is_none();
                decides[value.index()].get_or_insert(why);
                fresh
            });
        };
        for &(value, why) in &self.roots {
            mark(value, why);
        }
        for loop_ in 0..self.continued.len() {
            let own = || self.exits.iter().filter(|exit| exit.loop_ == loop_);
            // A counter suffices, and then it is all that has to stay.
            let counter = own().find(|exit| self.counts(exit));
            let stays =
                own().filter(|exit| counter.is_none_or(|counter| std::ptr::eq(counter, *exit)));
            for condition in stays.flat_map(|exit| &exit.conditions) {
                mark(*condition, Decides::Loop);
            }
        }
        decides
    }

    /// Visits a value and all that it is computed from, through local variables and the branches
    /// around their stores. `enter` says whether to go on from a value.
    fn slice(&self, value: Value, mut enter: impl FnMut(Value) -> bool) {
        let mut todo = vec![value];
        while let Some(value) = todo.pop() {
            if !enter(value) {
                continue;
            }
            let expression = &self.function.expressions[value];
            operands::each(expression, |operand| todo.push(operand));
            if let Expression::LocalVariable(local) = *expression {
                for store in self.stores.iter().filter(|store| store.local == local) {
                    todo.extend([store.value, store.pointer]);
                    let mut branch = store.branch;
                    while let Some(i) = branch {
                        todo.push(self.branches[i].condition);
                        branch = self.branches[i].outer;
                    }
                }
            }
        }
    }

    /// Whether an exit ends its loop whatever becomes of the floats: every round tests it, it is
    /// computed from integers alone, and one of them is stepped by a constant in every round.
    fn counts(&self, exit: &Exit) -> bool {
        if !exit.every_round {
            return false;
        }
        let mut seen = vec![false; self.function.expressions.len()];
        let mut floats = false;
        let mut locals = Vec::new();
        for &condition in &exit.conditions {
            self.slice(condition, |value| {
                floats |= is_float(self.shader.type_of(self.stage, value));
                if let Expression::LocalVariable(local) = self.function.expressions[value] {
                    locals.push(local);
                }
                !std::mem::replace(&mut seen[value.index()], true)
            });
        }
        !floats
            && locals.iter().any(|&local| {
                let mut inside = self
                    .stores
                    .iter()
                    .filter(|s| s.local == local && s.loops.contains(&exit.loop_));
                match (inside.next(), inside.next()) {
                    (Some(only), None) => {
                        only.every_round
                            && only.loops.last() == Some(&exit.loop_)
                            && self.steps(only)
                    }
                    _ => false,
                }
            })
    }

    /// Whether a store adds a constant to what its variable held.
    fn steps(&self, store: &LocalStore) -> bool {
        use naga::BinaryOperator::{Add, Subtract};
        let expressions = &self.function.expressions;
        let is_old = |value: Value| match expressions[value] {
            Expression::Load { pointer } => {
                local(self.function, pointer) == Some(store.local)
                    && matches!(expressions[pointer], Expression::LocalVariable(_))
            }
            _ => false,
        };
        let is_step = |value: Value| match expressions[value] {
            Expression::Literal(Literal::I32(step)) => step != 0,
            Expression::Literal(Literal::U32(step)) => step != 0,
            _ => false,
        };
        match expressions[store.value] {
            Expression::Binary {
                op: Add,
                left,
                right,
            } => (is_old(left) && is_step(right)) || (is_step(left) && is_old(right)),
            Expression::Binary {
                op: Subtract,
                left,
                right,
            } => is_old(left) && is_step(right),
            _ => false,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A shader as it was parsed, its values named as in the source.
    pub(crate) fn shader(source: &str) -> Shader {
        let module = naga::front::wgsl::parse_str(source).expect("the test's shader parses");
        let function = &module.entry_points[0].function;
        let ids = function.expressions.iter().map(|(value, _)| {
            match function.named_expressions.get(&value) {
                Some(name) => ValueId::new(name.as_str(), 0),
                None => ValueId::new(format!("{}", value.index()), 0),
            }
        });
        let ids = vec![ids.collect()];
        Shader::new(module, ids)
    }

    fn decides(source: &str, name: &str) -> Option<Decides> {
        let shader = shader(source);
        let (stage, value) = shader.find(&name.into()).expect("the test names a value");
        Flow::new(&shader, stage).and_then(|flow| flow.decides(value))
    }

    fn in_loop(before: &str, body: &str) -> String {
        format!(
            "@fragment fn main(@location(0) x: f32) -> @location(0) vec4f {{
                 let slope = x * 0.5; var height = 0.0; var i = 0; var done = false;
                 {before} {{ {body} }}
                 return vec4f(height + slope);
             }}"
        )
    }

    #[test]
    fn a_value_that_a_break_waits_for_stays() {
        let direct = in_loop("loop", "if height > slope { break; } height += 0.1;");
        assert_eq!(decides(&direct, "slope"), Some(Decides::Loop));
        let through_the_variable = in_loop("loop", "height += slope; if height > 1.0 { break; }");
        assert_eq!(decides(&through_the_variable, "slope"), Some(Decides::Loop));
        let through_a_flag = in_loop("loop", "if done { break; } if slope > 0.1 { done = true; }");
        assert_eq!(decides(&through_a_flag, "slope"), Some(Decides::Loop));
        let by_break_if = in_loop(
            "loop",
            "continuing { height += slope; break if height > 1.0; }",
        );
        assert_eq!(decides(&by_break_if, "slope"), Some(Decides::Loop));
        let by_return = in_loop(
            "loop",
            "if height > slope { return vec4f(1.0); } height += 0.1;",
        );
        assert_eq!(decides(&by_return, "slope"), Some(Decides::Loop));
    }

    #[test]
    fn a_counter_that_every_round_tests_and_steps_sets_the_others_free() {
        let free = |before: &str, body: &str| decides(&in_loop(before, body), "slope").is_none();
        let late_break = "if height > slope { break; } height += slope;";
        assert!(free("for (; i < 4; i++)", late_break));
        assert!(free("for (; i < 4; i += 2)", "height += slope;"));
        assert!(free(
            "loop",
            "if i > 4 { break; } if height > slope { break; } i = 1 + i;"
        ));
        // A `continue` before the test, or around the step, and the counter counts for nothing.
        assert!(!free(
            "loop",
            "if slope > 0.5 { continue; } if i > 4 { break; } i++;"
        ));
        assert!(!free("loop", "if i > 4 { break; } if slope > 0.5 { i++; }"));
        // A step back, or by a float, is none; nor is a test in a branch.
        assert!(!free("for (; i < 4; i++)", "if slope > 0.5 { i = 0; }"));
        assert!(!free("loop", "if i > 4 { break; } i += i32(slope);"));
        assert!(!free("loop", "if slope > 0.5 { if i > 4 { break; } } i++;"));
    }

    #[test]
    fn a_break_out_of_a_switch_is_no_way_out_of_the_loop() {
        let body = "if i > 4 { break; } switch i { case 1: { if slope > 0.5 { break; } height += 1.0; } default: {} } i++;";
        assert_eq!(decides(&in_loop("loop", body), "slope"), None);
    }

    #[test]
    fn only_the_built_in_part_of_an_output_stays() {
        let source = "struct Out { @location(0) c: vec4f, @builtin(frag_depth) d: f32 }
            @fragment fn main(@location(0) x: f32) -> Out {
                let tone = x * x; let depth = x + 0.5; return Out(vec4f(tone), depth);
            }";
        assert_eq!(decides(source, "tone"), None);
        assert_eq!(decides(source, "depth"), Some(Decides::BuiltIn));
    }

    #[test]
    fn what_is_written_to_memory_stays_with_the_branch_around_it() {
        let source = "@group(0) @binding(0) var<storage, read_write> log: f32;
            @fragment fn main(@location(0) x: f32) -> @location(0) vec4f {
                let heat = x * x; let when = x + 0.5; let tone = x * 2.0;
                if when > 1.0 { log = heat; }
                return vec4f(tone);
            }";
        assert_eq!(decides(source, "heat"), Some(Decides::Memory));
        assert_eq!(decides(source, "when"), Some(Decides::Memory));
        assert_eq!(decides(source, "tone"), None);
    }

    #[test]
    fn holes_are_reached_through_sums_and_variables_but_not_through_guards() {
        let source = "@fragment fn main(@location(0) x: f32) -> @location(0) vec4f {
                let far = x + 2.0; let guarded = x + 3.0; let stored = x + 4.0; let over = x + 5.0;
                let under = x + 6.0;
                var kept = 0.0;
                if x > 0.5 { kept = stored; }
                let root = sqrt(far + 1.0) + log(max(guarded, 0.1)) + over / (kept + 1.0)
                    + sqrt(1.0 - max(under, 0.0));
                return vec4f(root);
            }";
        let shader = shader(source);
        let flow = Flow::new(&shader, Stage::Fragment).expect("there is a fragment stage");
        let holes = flow.holes();
        for (name, expected) in [
            ("far", true),
            ("guarded", false),
            ("stored", true),
            ("over", false),
        ] {
            let (_, value) = shader.find(&name.into()).expect("the test names a value");
            assert_eq!(holes[value.index()].low, expected, "{name}");
        }
        let (_, under) = shader
            .find(&"under".into())
            .expect("the test names a value");
        assert!(
            holes[under.index()].high,
            "what is taken off may be too high"
        );
    }
}
