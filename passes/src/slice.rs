//! Slices: all that computes a value of one stage, and a copy of it in another.
//!
//! A slice holds the values that lead to one, through local variables: with a variable it holds all that is stored in it,
//! the conditions around those stores, and what ends the loops around them. Where there are variables, the statements up
//! to the value are copied as far as they are in the slice; else values alone are, and they are computed where the copy is
//! used. What is done to fragments besides, such as a `discard`, is not in it.

use crate::edit::{Edit, emit};
use crate::flow::{Flow, Value};
use crate::operands;
use crate::rate::ways_out;
use naga::{Block, Expression, Handle, LocalVariable, Span, Statement, SwitchCase, TypeInner};

/// All that computes a value.
pub(crate) struct Slice<'a> {
    flow: &'a Flow<'a>,
    value: Value,
    /// For each value of the function, whether it is in it.
    values: Vec<bool>,
    /// For each value, whether it stands for all that leads to it.
    ends: Vec<bool>,
    /// For each local variable, whether it is in it.
    locals: Vec<bool>,
    /// What is around the value, outermost first.
    around: Vec<Around>,
}

/// What is around a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Around {
    /// A branch on a condition.
    Branch(Value),
    /// A loop.
    Loop,
}

/// What a copy of a slice takes for what it cannot copy.
pub(crate) trait Source {
    /// The value that the copy has for a value of the slice that is no copy, such as an input of the stage.
    fn instead(&mut self, edit: &mut Edit<'_>, value: Value) -> Option<Handle<Expression>>;
    /// How the copy of a value is named; see [`Edit::add`].
    fn path(&self, value: Value) -> String;
    /// What becomes of an expression whose operands are those of the copy.
    fn adapted(&mut self, edit: &mut Edit<'_>, value: Value, expression: Expression) -> Expression;
}

impl<'a> Slice<'a> {
    /// The slice of a value.
    pub(crate) fn of(flow: &'a Flow<'a>, value: Value) -> Self {
        Self::up_to(flow, value, vec![false; flow.function.expressions.len()])
    }

    /// The slice of a value without what leads to some values in it, which a copy has other values for; there is a truth
    /// for each value of the function.
    pub(crate) fn up_to(flow: &'a Flow<'a>, value: Value, ends: Vec<bool>) -> Self {
        let function = flow.function;
        let mut slice = Self {
            flow,
            value,
            ends,
            values: vec![false; function.expressions.len()],
            locals: vec![false; function.local_variables.len()],
            around: Vec::new(),
        };
        slice.take(value);
        while slice.stores(&function.body, &mut Vec::new()) {}
        around(&function.body, value, &mut slice.around);
        if slice.has_variables() {
            for around in slice.around.clone() {
                if let Around::Branch(condition) = around {
                    slice.take(condition);
                }
            }
            while slice.stores(&function.body, &mut Vec::new()) {}
        }
        slice
    }

    /// Whether it goes through local variables.
    pub(crate) fn has_variables(&self) -> bool {
        self.locals.contains(&true)
    }

    /// What is around the value, outermost first. Of a slice with variables the conditions are in it.
    pub(crate) fn around(&self) -> &[Around] {
        &self.around
    }

    /// Its values, in the order of the function.
    pub(crate) fn values(&self) -> impl Iterator<Item = Value> + '_ {
        let all = self.flow.function.expressions.iter();
        all.map(|(value, _)| value)
            .filter(|value| self.values[value.index()])
    }

    /// Takes in a value and what it is computed of.
    fn take(&mut self, value: Value) {
        let function = self.flow.function;
        let mut open = vec![value];
        while let Some(value) = open.pop() {
            if std::mem::replace(&mut self.values[value.index()], true) {
                continue;
            }
            // An input stands for itself, not for the structure that it is a member of.
            if self.flow.input(value).is_some() || self.ends[value.index()] {
                continue;
            }
            let expression = &function.expressions[value];
            operands::each(expression, |operand| open.push(operand));
            if let Expression::LocalVariable(local) = *expression {
                self.locals[local.index()] = true;
                open.extend(function.local_variables[local].init);
            }
        }
    }

    /// Takes in what is stored in its variables. Returns whether anything is new.
    fn stores(&mut self, block: &Block, conditions: &mut Vec<Value>) -> bool {
        let mut any = false;
        for statement in block {
            let before = conditions.len();
            match *statement {
                Statement::Store { pointer, value } => {
                    if let Some(local) = self.flow.local(pointer)
                        && self.locals[local.index()]
                    {
                        let stored = [pointer, value];
                        for value in stored.iter().chain(conditions.iter()) {
                            if !self.values[value.index()] {
                                self.take(*value);
                                any = true;
                            }
                        }
                    }
                }
                Statement::If { condition, .. } => conditions.push(condition),
                Statement::Switch { selector, .. } => conditions.push(selector),
                Statement::Loop {
                    ref body,
                    ref continuing,
                    break_if,
                } => {
                    conditions.extend(break_if);
                    ways_out(body, conditions);
                    ways_out(continuing, conditions);
                }
                _ => {}
            }
            for inner in operands::blocks(statement) {
                any |= self.stores(inner, conditions);
            }
            conditions.truncate(before);
        }
        any
    }

    /// Whether a loop that is copied is left, or might be left, by what is not: a `discard`.
    pub(crate) fn discards_in_loop(&self) -> bool {
        let mut found = false;
        operands::walk(&self.flow.function.body, &mut |statement| {
            if let Statement::Loop { body, .. } = statement
                && self.keeps(statement)
            {
                operands::walk(body, &mut |inner| {
                    found |= matches!(inner, Statement::Kill);
                });
            }
        });
        found
    }

    /// Whether a statement that holds others stores to one of its variables.
    fn keeps(&self, statement: &Statement) -> bool {
        let mut found = false;
        for block in operands::blocks(statement) {
            operands::walk(block, &mut |inner| {
                if let Statement::Store { pointer, .. } = *inner {
                    let local = self.flow.local(pointer);
                    found |= local.is_some_and(|local| self.locals[local.index()]);
                }
            });
        }
        found
    }

    /// Copies it to the end of another function, and returns the value there.
    pub(crate) fn copy(&self, edit: &mut Edit<'_>, source: &mut impl Source) -> Handle<Expression> {
        let function = self.flow.function;
        let mut copy = Copy {
            slice: self,
            values: vec![None; function.expressions.len()],
            computed: vec![false; function.expressions.len()],
            locals: vec![None; function.local_variables.len()],
            kept: None,
        };
        for (local, variable) in function.local_variables.iter() {
            if self.locals[local.index()] {
                let init = variable
                    .init
                    .map(|init| copy.initialiser(edit, source, init));
                let variable = LocalVariable {
                    init,
                    ..variable.clone()
                };
                copy.locals[local.index()] = Some(edit.add_local(variable));
            }
        }
        for value in self.values() {
            let copied = source.instead(edit, value);
            copy.computed[value.index()] =
                copied.is_none() && !function.expressions[value].needs_pre_emit();
            let copied = copied.unwrap_or_else(|| {
                let expression = match function.expressions[value] {
                    Expression::LocalVariable(local) => {
                        Expression::LocalVariable(copy.locals[local.index()].unwrap_or(local))
                    }
                    ref other => operands::map(other, |operand| copy.value(operand)),
                };
                let expression = source.adapted(edit, value, expression);
                edit.add(source.path(value), expression)
            });
            if let Some(name) = function.named_expressions.get(&value)
                && copy.computed[value.index()]
            {
                edit.name(copied, name.clone());
            }
            copy.values[value.index()] = Some(copied);
        }
        if !self.has_variables() {
            return copy.value(self.value);
        }
        if self.around.is_empty() {
            let (statements, _) = copy.block(&function.body);
            edit.do_before_return(statements);
            return copy.value(self.value);
        }
        // It ends with the branch that it is computed in, so that it is kept in a variable.
        let ty = match *self.flow.inner(self.value) {
            TypeInner::Scalar(scalar) => TypeInner::Scalar(scalar),
            TypeInner::Vector { size, scalar } => TypeInner::Vector { size, scalar },
            ref other => panic!("{other:?} is not kept in a variable"),
        };
        let kept = LocalVariable {
            name: Some("moved".into()),
            ty: edit.ty(ty),
            init: None,
        };
        let kept = edit.add_local(kept);
        let path = source.path(self.value);
        let pointer = edit.add(format!("{path}.kept"), Expression::LocalVariable(kept));
        copy.kept = Some(pointer);
        let (mut statements, _) = copy.block(&function.body);
        let load = edit.add(format!("{path}.moved"), Expression::Load { pointer });
        statements.push(emit(load), Span::UNDEFINED);
        edit.do_before_return(statements);
        load
    }
}

/// Finds what is around a value. Returns whether it is computed in the block.
fn around(block: &Block, value: Value, found: &mut Vec<Around>) -> bool {
    for statement in block {
        if computes(statement, value) {
            return true;
        }
        let before = found.len();
        found.extend(match *statement {
            Statement::If { condition, .. } => Some(Around::Branch(condition)),
            Statement::Switch { selector, .. } => Some(Around::Branch(selector)),
            Statement::Loop { .. } => Some(Around::Loop),
            _ => None,
        });
        if operands::blocks(statement).any(|inner| around(inner, value, found)) {
            return true;
        }
        found.truncate(before);
    }
    false
}

fn computes(statement: &Statement, value: Value) -> bool {
    match statement {
        Statement::Emit(range) => range.clone().any(|computed| computed == value),
        _ => false,
    }
}

/// A copy that is being made.
struct Copy<'s, 'a> {
    slice: &'s Slice<'a>,
    values: Vec<Option<Handle<Expression>>>,
    /// Whether the copy of a value is computed by an `Emit`.
    computed: Vec<bool>,
    locals: Vec<Option<Handle<LocalVariable>>>,
    /// Where the value is stored when it has been computed.
    kept: Option<Handle<Expression>>,
}

impl Copy<'_, '_> {
    fn value(&self, value: Value) -> Handle<Expression> {
        match self.values[value.index()] {
            Some(copied) => copied,
            None => panic!(
                "{:?} is not in the slice",
                self.slice.flow.function.expressions[value]
            ),
        }
    }

    fn initialiser(
        &self,
        edit: &mut Edit<'_>,
        source: &mut impl Source,
        value: Value,
    ) -> Handle<Expression> {
        let expression = &self.slice.flow.function.expressions[value];
        let expression = operands::map(expression, |part| self.initialiser(edit, source, part));
        edit.add(source.path(value), expression)
    }

    /// The statements of a block that are in the slice, up to the value; and whether that was reached.
    fn block(&self, block: &Block) -> (Block, bool) {
        let mut copied = Block::new();
        for (statement, span) in block.span_iter() {
            if let Statement::Emit(range) = statement {
                for value in range.clone() {
                    if !self.slice.values[value.index()] {
                        continue;
                    }
                    let of_copy = self.value(value);
                    if self.computed[value.index()] {
                        copied.push(emit(of_copy), Span::UNDEFINED);
                    }
                    if value == self.slice.value {
                        if let Some(pointer) = self.kept {
                            let value = of_copy;
                            copied.push(Statement::Store { pointer, value }, Span::UNDEFINED);
                        }
                        return (copied, true);
                    }
                }
                continue;
            }
            let mut reached = false;
            let mut inner = |block: &Block| {
                let (block, found) = self.block(block);
                reached |= found;
                block
            };
            let statement = match *statement {
                Statement::Block(ref block) => Statement::Block(inner(block)),
                Statement::Store { pointer, value } => {
                    let local = self.slice.flow.local(pointer);
                    if !local.is_some_and(|local| self.slice.locals[local.index()]) {
                        continue;
                    }
                    Statement::Store {
                        pointer: self.value(pointer),
                        value: self.value(value),
                    }
                }
                Statement::If { condition, .. }
                | Statement::Switch {
                    selector: condition,
                    ..
                } if !self.slice.values[condition.index()] => {
                    continue;
                }
                Statement::If {
                    condition,
                    ref accept,
                    ref reject,
                } => Statement::If {
                    condition: self.value(condition),
                    accept: inner(accept),
                    reject: inner(reject),
                },
                Statement::Switch {
                    selector,
                    ref cases,
                } => Statement::Switch {
                    selector: self.value(selector),
                    cases: cases
                        .iter()
                        .map(|case| SwitchCase {
                            body: inner(&case.body),
                            ..case.clone()
                        })
                        .collect(),
                },
                Statement::Loop {
                    ref body,
                    ref continuing,
                    break_if,
                } => {
                    if !self.slice.keeps(statement) {
                        continue;
                    }
                    Statement::Loop {
                        body: inner(body),
                        continuing: inner(continuing),
                        break_if: break_if.map(|condition| self.value(condition)),
                    }
                }
                Statement::Break => Statement::Break,
                Statement::Continue => Statement::Continue,
                _ => continue,
            };
            copied.push(statement, *span);
            if reached {
                return (copied, true);
            }
        }
        (copied, false)
    }
}
