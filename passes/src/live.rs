//! What a function still needs: drops stores, values, variables and control flow that nobody needs.
//!
//! One walk against the order of execution marks what is live; loops are walked until nothing changes.
//! A loop without an effect is dropped, as every loop of a shader ends.

use crate::operands;
use naga::{
    Arena, Block, Expression, Function, Handle, LocalVariable, Range, Span, Statement, SwitchCase,
};
use std::collections::HashSet;

/// A function without what it does not need, and for each of its expressions the old one.
pub(crate) struct Kept {
    pub(crate) function: Function,
    pub(crate) origins: Vec<Handle<Expression>>,
    /// For each local variable the old one.
    pub(crate) locals: Vec<Handle<LocalVariable>>,
    /// Whether something was dropped from a loop, so that more may be known about what it stores to.
    pub(crate) again: bool,
}

/// Drops everything that a function without calls and early returns does not need.
pub(crate) fn keep_needed(function: &Function) -> Kept {
    let count = function.expressions.len();
    let mut live = Live {
        function,
        roots: vec![None; count],
        needed: vec![false; count],
        kept: HashSet::new(),
        targets: Vec::new(),
        weak: false,
    };
    for (value, expression) in function.expressions.iter() {
        live.roots[value.index()] = match *expression {
            Expression::LocalVariable(local) => Some((local, true)),
            Expression::AccessIndex { base, .. } | Expression::Access { base, .. } => {
                live.roots[base.index()].map(|(local, _)| (local, false))
            }
            _ => None,
        };
    }
    let mut at_start = vec![false; function.local_variables.len()];
    live.block(&function.body, &mut at_start);
    let Live {
        mut needed,
        roots,
        kept,
        ..
    } = live;

    let mut used = vec![false; function.local_variables.len()];
    for (root, needed) in roots.iter().zip(&needed) {
        if let (Some((local, true)), true) = (root, needed) {
            used[local.index()] = true;
        }
    }
    let mut compact = Compact {
        old: function,
        kept: &kept,
        map: vec![None; count],
        new: Arena::new(),
        origins: Vec::with_capacity(count),
        loops: 0,
        again: false,
    };
    let mut locals = Arena::new();
    let mut local_origins = Vec::new();
    let mut local_map = vec![None; function.local_variables.len()];
    for (local, variable) in function.local_variables.iter() {
        if used[local.index()] {
            // What is stored before anything is loaded need not begin with anything.
            let init = variable.init.filter(|_| at_start[local.index()]);
            let copy = LocalVariable {
                name: variable.name.clone(),
                ty: variable.ty,
                init: init.map(|init| compact.initialiser(init)),
            };
            let span = function.local_variables.get_span(local);
            local_map[local.index()] = Some(locals.append(copy, span));
            local_origins.push(local);
        }
    }
    // What needs no `Emit` comes first, so that the rest is computed in long runs.
    for (value, expression) in function.expressions.iter() {
        if needed[value.index()] && expression.needs_pre_emit() {
            let mut copy = expression.clone();
            if let Expression::LocalVariable(local) = &mut copy
                && let Some(new) = local_map[local.index()]
            {
                *local = new;
            }
            compact.append(copy, value);
            needed[value.index()] = false;
        }
    }
    let body = compact.block(&function.body, &needed);
    let Compact {
        map,
        new,
        origins,
        again,
        ..
    } = compact;
    let mut named = naga::FastIndexMap::default();
    for (value, name) in &function.named_expressions {
        if let Some(new) = map[value.index()] {
            named.insert(new, name.clone());
        }
    }
    Kept {
        function: Function {
            name: function.name.clone(),
            arguments: function.arguments.clone(),
            result: function.result.clone(),
            local_variables: locals,
            expressions: new,
            named_expressions: named,
            body,
            diagnostic_filter_leaf: function.diagnostic_filter_leaf,
        },
        origins,
        locals: local_origins,
        again,
    }
}

/// For each local variable, whether what it holds may still be loaded.
type Alive = Vec<bool>;

fn join(into: &mut Alive, other: &Alive) {
    for (into, other) in into.iter_mut().zip(other) {
        *into |= other;
    }
}

/// What is live where a jump leads.
struct Target {
    is_loop: bool,
    at_break: Alive,
    at_continue: Alive,
}

struct Live<'a> {
    function: &'a Function,
    /// For each pointer to or into a local variable: which, and whether to the whole of it.
    roots: Vec<Option<(Handle<LocalVariable>, bool)>>,
    needed: Vec<bool>,
    /// The statements that stay, by address: the body is not touched meanwhile.
    kept: HashSet<*const Statement>,
    targets: Vec<Target>,
    /// Whether jumps count for nothing: set while it is found out whether a loop has any effect.
    weak: bool,
}

impl Live<'_> {
    fn need(&mut self, value: Handle<Expression>) {
        self.needed[value.index()] = true;
    }

    /// Walks a block from its end; `alive` is what is live behind it, and becomes what is live before
    /// it. Returns whether anything in it stays.
    fn block(&mut self, block: &Block, alive: &mut Alive) -> bool {
        let mut any = false;
        for statement in block.iter().rev() {
            if self.statement(statement, alive) {
                self.kept.insert(std::ptr::from_ref(statement));
                any = true;
            }
        }
        any
    }

    fn statement(&mut self, statement: &Statement, alive: &mut Alive) -> bool {
        match statement {
            Statement::Emit(range) => {
                // A range is walked from its end too.
                let first_and_last = range.first_and_last();
                let values: Vec<_> = first_and_last.map_or(Vec::new(), |_| range.clone().collect());
                for value in values.into_iter().rev() {
                    if !self.needed[value.index()] {
                        continue;
                    }
                    let expression = &self.function.expressions[value];
                    operands::each(expression, |operand| self.needed[operand.index()] = true);
                    if let Expression::Load { pointer } = *expression
                        && let Some((local, _)) = self.roots[pointer.index()]
                    {
                        alive[local.index()] = true;
                    }
                }
                false
            }
            Statement::Block(inner) => self.block(inner, alive),
            Statement::If {
                condition,
                accept,
                reject,
            } => {
                let mut rejected = alive.clone();
                let reject = self.block(reject, &mut rejected);
                let mut accepted = alive.clone();
                let accept = self.block(accept, &mut accepted);
                if accept || reject {
                    join(&mut accepted, &rejected);
                    *alive = accepted;
                    self.need(*condition);
                }
                accept || reject
            }
            Statement::Switch { selector, cases } => {
                let after = alive.clone();
                self.targets.push(Target {
                    is_loop: false,
                    at_break: after.clone(),
                    at_continue: Vec::new(),
                });
                let mut any = false;
                let mut before = after.clone();
                let mut next = after.clone();
                for case in cases.iter().rev() {
                    if !case.fall_through {
                        next.clone_from(&after);
                    }
                    any |= self.block(&case.body, &mut next);
                    join(&mut before, &next);
                }
                self.targets.pop();
                if any {
                    *alive = before;
                    self.need(*selector);
                }
                any
            }
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => {
                // Only what is done besides jumping counts as an effect.
                let needed = self.needed.clone();
                let kept = self.kept.clone();
                let weak = std::mem::replace(&mut self.weak, true);
                let mut before = alive.clone();
                let effect = self.rounds(body, continuing, None, &mut before);
                self.weak = weak;
                if !effect {
                    return false;
                }
                if weak {
                    *alive = before;
                    return true;
                }
                self.needed = needed;
                self.kept = kept;
                self.rounds(body, continuing, *break_if, alive);
                true
            }
            Statement::Break => {
                if let Some(target) = self.targets.last() {
                    alive.clone_from(&target.at_break);
                }
                !self.weak
            }
            Statement::Continue => {
                if let Some(target) = self.targets.iter().rev().find(|t| t.is_loop) {
                    alive.clone_from(&target.at_continue);
                }
                !self.weak
            }
            Statement::Return { value } => {
                alive.fill(false);
                if let Some(value) = value {
                    self.need(*value);
                }
                true
            }
            Statement::Store { pointer, value } => {
                if let Some((local, whole)) = self.roots[pointer.index()] {
                    if !alive[local.index()] {
                        return false;
                    }
                    if whole {
                        alive[local.index()] = false;
                    }
                }
                self.need(*pointer);
                self.need(*value);
                true
            }
            other => {
                operands::each_of_statement(other, |operand| {
                    self.needed[operand.index()] = true;
                    if let Some((local, _)) = self.roots[operand.index()] {
                        alive[local.index()] = true;
                    }
                });
                true
            }
        }
    }

    /// Walks a loop until what is live where it begins grows no more.
    fn rounds(
        &mut self,
        body: &Block,
        continuing: &Block,
        break_if: Option<Handle<Expression>>,
        alive: &mut Alive,
    ) -> bool {
        let after = std::mem::take(alive);
        let mut head = vec![false; after.len()];
        let mut effect = false;
        loop {
            let mut before = head.clone();
            if let Some(condition) = break_if {
                join(&mut before, &after);
                self.need(condition);
            }
            if self.weak {
                // Without its jumps the loop might as well end here.
                join(&mut before, &after);
            }
            effect |= self.block(continuing, &mut before);
            self.targets.push(Target {
                is_loop: true,
                at_break: after.clone(),
                at_continue: before.clone(),
            });
            effect |= self.block(body, &mut before);
            self.targets.pop();
            let grows = before.iter().zip(&head).any(|(now, had)| *now && !*had);
            join(&mut head, &before);
            if !grows {
                break;
            }
        }
        *alive = head;
        effect
    }
}

/// A function that is being copied without what it does not need.
struct Compact<'a> {
    old: &'a Function,
    kept: &'a HashSet<*const Statement>,
    map: Vec<Option<Handle<Expression>>>,
    new: Arena<Expression>,
    origins: Vec<Handle<Expression>>,
    /// How many loops are around what is copied.
    loops: usize,
    again: bool,
}

impl Compact<'_> {
    fn append(&mut self, expression: Expression, old: Handle<Expression>) -> Handle<Expression> {
        let new = self
            .new
            .append(expression, self.old.expressions.get_span(old));
        self.origins.push(old);
        self.map[old.index()] = Some(new);
        new
    }

    fn initialiser(&mut self, old: Handle<Expression>) -> Handle<Expression> {
        let copy = operands::map(&self.old.expressions[old], |operand| {
            self.initialiser(operand)
        });
        let new = self.append(copy, old);
        // The body has copies of its own.
        self.map[old.index()] = None;
        new
    }

    fn mapped(&self, old: Handle<Expression>) -> Handle<Expression> {
        match self.map[old.index()] {
            Some(new) => new,
            None => panic!(
                "{:?} is used where it is not computed",
                self.old.expressions[old]
            ),
        }
    }

    fn block(&mut self, old: &Block, needed: &[bool]) -> Block {
        let mut block = Block::new();
        self.statements(old, needed, &mut block);
        block
    }

    fn statements(&mut self, old: &Block, needed: &[bool], block: &mut Block) {
        let mut run = None;
        for (statement, span) in old.span_iter() {
            if let Statement::Emit(range) = statement {
                for value in range.clone() {
                    if needed[value.index()] {
                        let copy = operands::map(&self.old.expressions[value], |operand| {
                            self.mapped(operand)
                        });
                        let new = self.append(copy, value);
                        run = Some((run.map_or(new, |(first, _)| first), new));
                    }
                }
                continue;
            }
            let address: *const Statement = statement;
            if !self.kept.contains(&address) {
                self.again |= self.loops > 0 || matches!(statement, Statement::Loop { .. });
                continue;
            }
            if let Some((first, last)) = run.take() {
                let range = Range::new_from_bounds(first, last);
                block.push(Statement::Emit(range), Span::UNDEFINED);
            }
            let copy = match statement {
                Statement::Block(inner) => {
                    self.statements(inner, needed, block);
                    continue;
                }
                Statement::If {
                    condition,
                    accept,
                    reject,
                } => Statement::If {
                    condition: self.mapped(*condition),
                    accept: self.block(accept, needed),
                    reject: self.block(reject, needed),
                },
                Statement::Switch { selector, cases } => Statement::Switch {
                    selector: self.mapped(*selector),
                    cases: cases
                        .iter()
                        .map(|case| SwitchCase {
                            value: case.value,
                            body: self.block(&case.body, needed),
                            fall_through: case.fall_through,
                        })
                        .collect(),
                },
                Statement::Loop {
                    body,
                    continuing,
                    break_if,
                } => {
                    self.loops += 1;
                    let body = self.block(body, needed);
                    let continuing = self.block(continuing, needed);
                    self.loops -= 1;
                    Statement::Loop {
                        body,
                        continuing,
                        break_if: break_if.map(|condition| self.mapped(condition)),
                    }
                }
                other => {
                    let mut copy = other.clone();
                    if let Some(result) = operands::result(other) {
                        self.append(self.old.expressions[result].clone(), result);
                    }
                    operands::each_mut_of_statement(
                        &mut copy,
                        |operand| *operand = self.mapped(*operand),
                        |_| {},
                    );
                    operands::each_mut_of_statement(
                        &mut copy,
                        |_| {},
                        |result| *result = self.mapped(*result),
                    );
                    copy
                }
            };
            block.push(copy, *span);
        }
        if let Some((first, last)) = run {
            let range = Range::new_from_bounds(first, last);
            block.push(Statement::Emit(range), Span::UNDEFINED);
        }
    }
}
