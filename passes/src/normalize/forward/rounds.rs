//! Loops that go round less than twice: found by following the variables of their test through one round.

use super::{Forward, Known, jumps, root, stores};
use crate::semantics::Constant;
use crate::{fold, operands};
use naga::{Block, Expression, Handle, Statement};
use std::collections::BTreeMap;

/// How often a loop goes round, where that is known to be less than twice.
pub(super) enum Rounds {
    None,
    One {
        /// The statement of the body that has the test at its head.
        test: Option<usize>,
    },
}

/// What is known of a round of a loop before it is rebuilt.
struct Round {
    /// For each local variable, what it holds.
    locals: Vec<Option<Constant>>,
    /// What values are that were computed in it.
    values: BTreeMap<Handle<Expression>, Constant>,
}

/// Whether all that a block does is to break.
pub(super) fn is_break(block: &Block) -> bool {
    matches!(block[..], [Statement::Break])
}

impl Forward<'_> {
    /// How often a loop goes round, where that is less than twice. It is one that ends by a test at its head or by its
    /// `break if` alone.
    pub(super) fn rounds(
        &self,
        body: &Block,
        continuing: &Block,
        break_if: Option<Handle<Expression>>,
    ) -> Option<Rounds> {
        let first = body.iter().position(|s| !matches!(s, Statement::Emit(_)));
        let test = first.filter(|at| match &body[*at] {
            Statement::If { accept, reject, .. } => is_break(accept) != is_break(reject),
            _ => false,
        });
        let (head, rest) = match test {
            Some(test) => (&body[..test], &body[test + 1..]),
            None => (&body[..0], &body[..]),
        };
        if test.is_some() == break_if.is_some() || jumps(rest, false) {
            return None;
        }
        let locals = self.state.iter().map(|known| match known {
            Known::Value(value) => self.as_constant(*value).cloned(),
            Known::Memory | Known::Initial => None,
        });
        let mut round = Round {
            locals: locals.collect(),
            values: BTreeMap::new(),
        };
        let goes_on = |round: &mut Round| {
            let Statement::If {
                condition, accept, ..
            } = &body[test?]
            else {
                return None;
            };
            round.values.clear();
            self.foresee(head, round);
            let known = self.foreseen(*condition, round)?;
            Some((known.words[0] != 0) != is_break(accept))
        };
        if test.is_some() && !goes_on(&mut round)? {
            return Some(Rounds::None);
        }
        if let Some(Statement::If { accept, reject, .. }) = test.map(|test| &body[test]) {
            let side = if is_break(accept) { reject } else { accept };
            if jumps(side, false) {
                return None;
            }
            self.foresee(side, &mut round);
        }
        self.foresee(rest, &mut round);
        self.foresee(continuing, &mut round);
        let ends = match break_if {
            Some(condition) => self.foreseen(condition, &round)?.words[0] != 0,
            None => !goes_on(&mut round)?,
        };
        ends.then_some(Rounds::One { test })
    }

    /// Follows the local variables through statements.
    fn foresee(&self, statements: &[Statement], round: &mut Round) {
        for statement in statements {
            match statement {
                Statement::Emit(range) => {
                    for value in range.clone() {
                        if let Some(known) = self.foreseen_here(value, round) {
                            round.values.insert(value, known);
                        }
                    }
                }
                Statement::Block(inner) => self.foresee(inner, round),
                Statement::Store { pointer, value } => {
                    if let Some(local) = root(self.expressions, *pointer) {
                        let whole =
                            matches!(self.expressions[*pointer], Expression::LocalVariable(_));
                        round.locals[local.index()] =
                            self.foreseen(*value, round).filter(|_| whole);
                    }
                }
                other => {
                    // Nothing but stores changes a variable that is followed.
                    for block in operands::blocks(other) {
                        stores(self.expressions, block, &mut |local| {
                            round.locals[local] = None;
                        });
                    }
                }
            }
        }
    }

    /// What an old value is in a round, as far as statements have been followed, when it is a constant.
    fn foreseen(&self, old: Handle<Expression>, round: &Round) -> Option<Constant> {
        let old = self.replacement(old);
        let expression = &self.expressions[old];
        if let Some(known) = round.values.get(&old) {
            return Some(known.clone());
        }
        if let Some(value) = self.map[old.index()] {
            return self.as_constant(value).cloned();
        }
        match *expression {
            Expression::Literal(literal) => Constant::from_literal(literal),
            Expression::Constant(constant) => {
                fold::module_constant(self.module, self.module.constants[constant].init)
            }
            // What a variable holds is known where it is loaded, and what was added where it is first used.
            Expression::Load { .. } => None,
            _ if old.index() >= self.first_added => self.foreseen_here(old, round),
            _ => None,
        }
    }

    /// What an old value is that a round computes now, when it is a constant.
    fn foreseen_here(&self, old: Handle<Expression>, round: &Round) -> Option<Constant> {
        let expression = &self.expressions[old];
        match *expression {
            Expression::Load { pointer } => match self.expressions[self.replacement(pointer)] {
                Expression::LocalVariable(local) if self.tracked[local.index()] => {
                    round.locals[local.index()].clone()
                }
                _ => None,
            },
            Expression::Unary { .. }
            | Expression::Binary { .. }
            | Expression::Select { .. }
            | Expression::Math { .. }
            | Expression::As { .. } => {
                let mut known = Vec::new();
                let mut count = 0;
                operands::each(expression, |operand| {
                    count += 1;
                    known.extend(self.foreseen(operand, round));
                });
                let all = known.len() == count;
                all.then(|| fold::operation(expression, &known)).flatten()
            }
            _ => None,
        }
    }
}
