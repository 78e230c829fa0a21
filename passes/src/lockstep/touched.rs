//! What statements read and write, which says whether two may change places.

use crate::normalize::forward::root;
use crate::operands;
use naga::{Arena, Block, Expression, Handle, LocalVariable, Statement};
use std::collections::BTreeSet;

/// Something that one statement leaves for others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    Value(Handle<Expression>),
    Local(Handle<LocalVariable>),
    /// All memory but local variables.
    Memory,
}

/// What a statement, with those in its blocks, reads and writes.
#[derive(Clone, Debug, Default)]
pub(super) struct Touched {
    reads: BTreeSet<Place>,
    writes: BTreeSet<Place>,
    /// Whether it does more than compute values and store them in local variables.
    pub(super) acts: bool,
}

impl Touched {
    /// What a statement touches. The first so many of the expressions are computed by an `Emit`, where they have to be, and
    /// the others where they are used.
    pub(super) fn by(
        expressions: &Arena<Expression>,
        emitted: usize,
        statement: &Statement,
    ) -> Self {
        let mut touched = Self::default();
        touched.take(expressions, emitted, statement);
        touched
    }

    fn take(&mut self, expressions: &Arena<Expression>, emitted: usize, statement: &Statement) {
        operands::each_of_statement(statement, |operand| {
            self.reads.insert(Place::Value(operand));
            if operand.index() >= emitted {
                self.read_by(expressions, operand);
            }
        });
        match statement {
            Statement::Emit(range) => {
                for value in range.clone() {
                    self.writes.insert(Place::Value(value));
                    self.read_by(expressions, value);
                }
            }
            Statement::Store { pointer, .. } => match root(expressions, *pointer) {
                Some(local) => {
                    self.writes.insert(Place::Local(local));
                }
                None => self.act(),
            },
            Statement::If { .. }
            | Statement::Switch { .. }
            | Statement::Loop { .. }
            | Statement::Break
            | Statement::Continue => {}
            _ => self.act(),
        }
        for block in operands::blocks(statement) {
            for inner in block {
                self.take(expressions, emitted, inner);
            }
        }
    }

    fn act(&mut self) {
        self.acts = true;
        self.reads.insert(Place::Memory);
        self.writes.insert(Place::Memory);
    }

    /// Takes in what computing a value reads.
    fn read_by(&mut self, expressions: &Arena<Expression>, value: Handle<Expression>) {
        match expressions[value] {
            Expression::Load { pointer } => {
                let place = root(expressions, pointer).map_or(Place::Memory, Place::Local);
                self.reads.insert(place);
            }
            Expression::ImageLoad { .. } => {
                self.reads.insert(Place::Memory);
            }
            _ => {}
        }
        operands::each(&expressions[value], |operand| {
            self.reads.insert(Place::Value(operand));
        });
    }

    /// Takes in what others touch.
    pub(super) fn add(&mut self, other: &Self) {
        self.reads.extend(&other.reads);
        self.writes.extend(&other.writes);
        self.acts |= other.acts;
    }

    /// Whether the order of the two matters.
    pub(super) fn meets(&self, other: &Self) -> bool {
        let meets = |one: &BTreeSet<Place>, other: &BTreeSet<Place>| !one.is_disjoint(other);
        meets(&self.writes, &other.reads)
            || meets(&self.writes, &other.writes)
            || meets(&self.reads, &other.writes)
    }

    /// The local variables among it.
    pub(super) fn locals(&self) -> impl Iterator<Item = Handle<LocalVariable>> + '_ {
        let places = self.reads.union(&self.writes);
        places.filter_map(|place| match place {
            Place::Local(local) => Some(*local),
            _ => None,
        })
    }
}

/// The local variables that statements store to.
pub(super) fn stored<'b>(
    expressions: &Arena<Expression>,
    blocks: impl IntoIterator<Item = &'b Block>,
) -> BTreeSet<Handle<LocalVariable>> {
    let mut found = BTreeSet::new();
    for block in blocks {
        operands::walk(block, &mut |statement| {
            if let Statement::Store { pointer, .. } = statement {
                found.extend(root(expressions, *pointer));
            }
        });
    }
    found
}
