//! Which values of a function get a line of their own when it is written as text.
//!
//! naga's writer gives a `let` to what is used twice, to every load and to every texture sample. A person
//! writes `material.roughness` and `textureSample(...).rgb` in place, and breaks an expression that gets long.
//! What is put in place is read later than where it stood, so nothing may change in between: memory that is
//! only read may move freely, a local variable until it is stored to, a sample within straight-line code.

use lodc_passes::operands;
use naga::valid::FunctionInfo;
use naga::{
    AddressSpace, BinaryOperator, Block, Expression, Function, Handle, ImageClass, Module,
    Statement, StorageAccess, TypeInner,
};
use std::cmp::Reverse;
use std::collections::BTreeSet;

/// From how many characters on an expression gets a line of its own.
const LONG: usize = 96;

/// The lines of a function.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    /// Values that get a `let` where the writer would not write one, or under a name of their own.
    pub(crate) named: BTreeSet<Handle<Expression>>,
    /// Values that the writer gives a `let`, and that go where they are used.
    pub(crate) inline: BTreeSet<Handle<Expression>>,
    /// Whether every operator has an operand that is no number.
    pub(crate) bare_numbers: bool,
}

/// A place where the text of a value ends up.
#[derive(Clone, Copy)]
struct Site {
    position: usize,
    /// Counts the boundaries of control flow that were passed: equal within straight-line code.
    epoch: usize,
}

/// Everything that planning asks of a function's text.
#[derive(Default)]
struct Walk {
    position: usize,
    epoch: usize,
    /// For each expression, where it is evaluated.
    evaluated: Vec<Option<Site>>,
    /// For each expression, where its text ends up.
    sites: Vec<Vec<Site>>,
    /// Which local variable is stored to, and where.
    stores: Vec<(Handle<naga::LocalVariable>, usize)>,
    /// First and last position of each loop.
    loops: Vec<(usize, usize)>,
}

/// Plans the lines of a function.
pub(crate) fn plan(module: &Module, function: &Function, info: &FunctionInfo) -> Lines {
    let expressions = &function.expressions;
    let mut lines = Lines {
        bare_numbers: expressions
            .iter()
            .all(|(_, e)| !has_numbers_alone(e, function)),
        ..Lines::default()
    };
    let walk = Walk::over(function, &|_| true);
    let may_be_named = |value: Handle<Expression>| {
        walk.evaluated[value.index()].is_some()
            && is_plain(info[value].ty.inner_with(&module.types))
    };
    let passed_on = passed_on(function);
    for &value in function.named_expressions.keys() {
        // A value that is only stored or returned needs no name beside the variable's.
        let is_passed_on = info[value].ref_count == 1 && passed_on.contains(&value);
        if may_be_named(value) && !is_passed_on {
            lines.named.insert(value);
        }
    }

    // Memory that is only read.
    for (value, expression) in expressions.iter() {
        if let Expression::Load { pointer } = *expression
            && !lines.named.contains(&value)
            && let Some(path) = path(function, pointer)
            && let Root::Global(global) = path.root
            && is_read_only(module.global_variables[global].space)
            && (path.fixed || info[value].ref_count == 1)
        {
            lines.inline.insert(value);
        }
    }

    // Samples that are used once.
    let writer_names = |value: Handle<Expression>, lines: &Lines| {
        let expression = &expressions[value];
        lines.named.contains(&value)
            || expression.bake_ref_count() <= info[value].ref_count
            || matches!(
                expression,
                Expression::ImageSample { .. }
                    | Expression::ImageLoad { .. }
                    | Expression::ImageQuery { .. }
            )
    };
    let walk = Walk::over(function, &|value| {
        writer_names(value, &lines) && !lines.inline.contains(&value)
    });
    let mut samples = Vec::new();
    for (value, expression) in expressions.iter() {
        let movable = match expression {
            Expression::ImageSample { .. }
            | Expression::Derivative { .. }
            | Expression::ImageQuery { .. } => true,
            Expression::ImageLoad { image, .. } => {
                is_sampled(info[*image].ty.inner_with(&module.types))
            }
            _ => false,
        };
        if movable
            && !lines.named.contains(&value)
            && let (Some(from), [site]) =
                (walk.evaluated[value.index()], &*walk.sites[value.index()])
            && from.epoch == site.epoch
        {
            samples.push(value);
        }
    }
    lines.inline.extend(samples);

    // Components of what has a name: `in.tangent.xyz` reads better than a name for it.
    for (value, expression) in expressions.iter() {
        if matches!(expression, Expression::Swizzle { .. })
            && !lines.named.contains(&value)
            && writer_names(value, &lines)
            && is_path(function, value, &|value| {
                lines.inline.contains(&value) != writer_names(value, &lines)
            })
        {
            lines.inline.insert(value);
        }
    }

    let is_returned = |value: Handle<Expression>| {
        let is_struct = matches!(
            info[value].ty.inner_with(&module.types),
            TypeInner::Struct { .. }
        );
        is_struct && info[value].ref_count == 1 && passed_on.contains(&value)
    };
    name_long_ones(
        &mut lines,
        function,
        &may_be_named,
        &is_returned,
        &writer_names,
    );

    // Local variables, once everything else has its place.
    let is_let = |value: Handle<Expression>, lines: &Lines| {
        writer_names(value, lines) && !lines.inline.contains(&value)
    };
    let walk = Walk::over(function, &|value| is_let(value, &lines));
    let mut locals = Vec::new();
    for (value, expression) in expressions.iter() {
        if let Expression::Load { pointer } = *expression
            && !lines.named.contains(&value)
            && let Some(path) = path(function, pointer)
            && let Root::Local(variable) = path.root
            && path.fixed
            && walk.stays_the_same(variable, value)
        {
            locals.push(value);
        }
    }
    lines.inline.extend(locals);
    lines
}

/// The values that statements store or return as they are.
fn passed_on(function: &Function) -> BTreeSet<Handle<Expression>> {
    let mut found = BTreeSet::new();
    operands::walk(&function.body, &mut |statement| match statement {
        Statement::Store { value, .. } | Statement::Return { value: Some(value) } => {
            found.insert(*value);
        }
        _ => {}
    });
    found
}

/// Whether a value is a part of something that is read by its name: an argument, what `has_name` says, or
/// memory that is read in place.
fn is_path(
    function: &Function,
    value: Handle<Expression>,
    has_name: &dyn Fn(Handle<Expression>) -> bool,
) -> bool {
    match function.expressions[value] {
        Expression::FunctionArgument(_) => true,
        Expression::Swizzle { vector: base, .. } | Expression::AccessIndex { base, .. } => {
            has_name(base) || is_path(function, base, has_name)
        }
        Expression::Load { .. } => true,
        _ => false,
    }
}

/// Gives a line to what would be too long in place, from the operands up. `is_returned` says of a struct that it is
/// returned or stored as it is made.
fn name_long_ones(
    lines: &mut Lines,
    function: &Function,
    may_be_named: &dyn Fn(Handle<Expression>) -> bool,
    is_returned: &dyn Fn(Handle<Expression>) -> bool,
    writer_names: &dyn Fn(Handle<Expression>, &Lines) -> bool,
) {
    /// What a name takes.
    const NAME: usize = 12;
    let mut lengths: Vec<usize> = Vec::with_capacity(function.expressions.len());
    for (value, expression) in function.expressions.iter() {
        let own = match expression {
            Expression::Literal(_) => 4,
            Expression::Access { .. } | Expression::AccessIndex { .. } => 4,
            Expression::Swizzle { .. } => 4,
            Expression::Load { .. } => 0,
            Expression::Binary { .. } | Expression::Unary { .. } => 3,
            Expression::ImageSample { .. } | Expression::ImageLoad { .. } => 16,
            Expression::Compose { .. } | Expression::Math { .. } => 8,
            _ => 10,
        };
        let mut length = own;
        operands::each(expression, |operand| {
            length += lengths.get(operand.index()).copied().unwrap_or(NAME);
        });
        let in_place = !writer_names(value, lines) || lines.inline.contains(&value);
        if in_place && length > LONG && is_returned(value) {
            // A name for all of it would make nothing shorter: its longest members get theirs.
            let mut members = Vec::new();
            operands::each(expression, |member| members.push(member));
            members.sort_by_key(|member| (Reverse(lengths[member.index()]), *member));
            for member in members {
                let own = lengths[member.index()];
                if length > LONG && own > NAME && may_be_named(member) {
                    lines.inline.remove(&member);
                    lines.named.insert(member);
                    lengths[member.index()] = NAME;
                    length -= own - NAME;
                }
            }
        } else if in_place && length > LONG && may_be_named(value) {
            lines.inline.remove(&value);
            lines.named.insert(value);
        }
        let in_place = !writer_names(value, lines) || lines.inline.contains(&value);
        lengths.push(if in_place { length } else { NAME });
    }
}

impl Walk {
    /// Follows a function's statements in the order in which they are written. `is_let` says which values
    /// have a line of their own; the text of the others is that of their users.
    fn over(function: &Function, is_let: &dyn Fn(Handle<Expression>) -> bool) -> Self {
        let count = function.expressions.len();
        let mut walk = Self {
            evaluated: vec![None; count],
            sites: vec![Vec::new(); count],
            ..Self::default()
        };
        walk.block(function, &function.body, is_let);
        walk
    }

    fn here(&self) -> Site {
        Site {
            position: self.position,
            epoch: self.epoch,
        }
    }

    fn block(
        &mut self,
        function: &Function,
        block: &Block,
        is_let: &dyn Fn(Handle<Expression>) -> bool,
    ) {
        for statement in block {
            self.position += 1;
            if let Statement::Emit(range) = statement {
                for value in range.clone() {
                    self.position += 1;
                    self.evaluated[value.index()] = Some(self.here());
                    if is_let(value) {
                        self.text(function, value, is_let);
                    }
                }
                continue;
            }
            let after_the_body = matches!(statement, Statement::Loop { .. });
            if !after_the_body {
                operands::each_of_statement(statement, |operand| {
                    self.operand(function, operand, is_let)
                });
            }
            match statement {
                Statement::Store { pointer, .. } => self.store(function, *pointer),
                Statement::Call { arguments, .. } => {
                    for argument in arguments {
                        self.store(function, *argument);
                    }
                }
                _ => {}
            }
            if matches!(statement, Statement::Store { .. }) {
                continue;
            }
            let start = self.position;
            self.epoch += 1;
            for inner in operands::blocks(statement) {
                self.block(function, inner, is_let);
                self.epoch += 1;
            }
            self.position += 1;
            if after_the_body {
                operands::each_of_statement(statement, |operand| {
                    self.operand(function, operand, is_let)
                });
                self.loops.push((start, self.position));
                self.epoch += 1;
            }
        }
    }

    fn store(&mut self, function: &Function, pointer: Handle<Expression>) {
        if let Some(Root::Local(variable)) = path(function, pointer).map(|path| path.root) {
            self.stores.push((variable, self.position));
        }
    }

    /// The text of a value's operands is here.
    fn text(
        &mut self,
        function: &Function,
        value: Handle<Expression>,
        is_let: &dyn Fn(Handle<Expression>) -> bool,
    ) {
        // The right operand of these may not be evaluated.
        if let Expression::Binary {
            op: BinaryOperator::LogicalAnd | BinaryOperator::LogicalOr,
            left,
            right,
        } = function.expressions[value]
        {
            self.operand(function, left, is_let);
            self.epoch += 1;
            self.operand(function, right, is_let);
            self.epoch += 1;
            return;
        }
        operands::each(&function.expressions[value], |operand| {
            self.operand(function, operand, is_let);
        });
    }

    fn operand(
        &mut self,
        function: &Function,
        value: Handle<Expression>,
        is_let: &dyn Fn(Handle<Expression>) -> bool,
    ) {
        let here = self.here();
        self.sites[value.index()].push(here);
        if !is_let(value) {
            self.text(function, value, is_let);
        }
    }

    /// Whether a variable keeps its value from where it is loaded to every place where that load is written.
    fn stays_the_same(
        &self,
        variable: Handle<naga::LocalVariable>,
        load: Handle<Expression>,
    ) -> bool {
        let Some(from) = self.evaluated[load.index()] else {
            return false;
        };
        let sites = &self.sites[load.index()];
        let Some(last) = sites.iter().map(|site| site.position).max() else {
            return false;
        };
        let stores = || {
            self.stores
                .iter()
                .filter(|(stored, _)| *stored == variable)
                .map(|(_, at)| *at)
        };
        let stored_between = stores().any(|at| from.position < at && at < last);
        // A loop that the load is before and the text inside comes round again after its stores.
        let stored_in_a_loop = self.loops.iter().any(|&(start, end)| {
            let inside = |at: usize| start < at && at <= end;
            !inside(from.position)
                && sites.iter().any(|site| inside(site.position))
                && stores().any(inside)
        });
        !stored_between && !stored_in_a_loop
    }
}

enum Root {
    Global(Handle<naga::GlobalVariable>),
    Local(Handle<naga::LocalVariable>),
}

struct Path {
    root: Root,
    /// Whether no index in it is computed.
    fixed: bool,
}

/// What a pointer points into.
fn path(function: &Function, pointer: Handle<Expression>) -> Option<Path> {
    let mut at = pointer;
    let mut fixed = true;
    loop {
        match function.expressions[at] {
            Expression::AccessIndex { base, .. } => at = base,
            Expression::Access { base, .. } => {
                fixed = false;
                at = base;
            }
            Expression::GlobalVariable(global) => {
                return Some(Path {
                    root: Root::Global(global),
                    fixed,
                });
            }
            Expression::LocalVariable(local) => {
                return Some(Path {
                    root: Root::Local(local),
                    fixed,
                });
            }
            _ => return None,
        }
    }
}

fn is_read_only(space: AddressSpace) -> bool {
    match space {
        AddressSpace::Uniform | AddressSpace::Immediate => true,
        AddressSpace::Storage { access } => access == StorageAccess::LOAD,
        _ => false,
    }
}

fn is_sampled(image: &TypeInner) -> bool {
    match image {
        TypeInner::Image { class, .. } => !matches!(class, ImageClass::Storage { .. }),
        _ => false,
    }
}

/// Whether a value can be given a name: pointers and opaque handles are better read in place.
fn is_plain(ty: &TypeInner) -> bool {
    matches!(
        ty,
        TypeInner::Scalar(_)
            | TypeInner::Vector { .. }
            | TypeInner::Matrix { .. }
            | TypeInner::Array { .. }
            | TypeInner::Struct { .. }
    )
}

/// Whether an operator has nothing but numbers to work on.
fn has_numbers_alone(expression: &Expression, function: &Function) -> bool {
    let is_operator = matches!(
        expression,
        Expression::Binary { .. }
            | Expression::Math { .. }
            | Expression::Select { .. }
            | Expression::As { .. }
            | Expression::Relational { .. }
            | Expression::Derivative { .. }
    );
    if !is_operator {
        return false;
    }
    let mut all = true;
    operands::each(expression, |operand| all &= is_number(operand, function));
    all
}

fn is_number(value: Handle<Expression>, function: &Function) -> bool {
    match &function.expressions[value] {
        // A constant of the author's may have no concrete type in the text.
        Expression::Literal(_) | Expression::Constant(_) => true,
        Expression::Splat { .. }
        | Expression::Compose { .. }
        | Expression::Unary { .. }
        | Expression::Swizzle { .. } => {
            let mut all = true;
            operands::each(&function.expressions[value], |operand| {
                all &= is_number(operand, function)
            });
            all
        }
        _ => false,
    }
}
