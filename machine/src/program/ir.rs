//! The intermediate form: scalar values in single assignment, slots that are assigned again, and
//! structured control flow. Calls are inlined, pointers resolved, vectors taken apart.

use lodc_passes::Work;
use lodc_passes::semantics::{Kind, Op};
use naga::{DerivativeAxis, ScalarKind, Span};

/// A scalar value, by its place in [`Ir::values`].
pub(super) type Id = u32;
/// No value.
pub(super) const NONE: Id = u32::MAX;
/// A variable, by its place in [`Ir::slots`].
pub(super) type SlotId = u32;
/// Where an [`Node::Exit`] leads: past the end of the scope, loop or switch that has the label.
/// Outer ones have smaller labels.
pub(super) type Label = u32;

/// What is known of a value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value {
    pub(super) kind: Kind,
    /// Its bits, when it is a constant.
    pub(super) constant: Option<u32>,
    /// Whether it is the same for a whole draw: a constant, or computed from constants and buffers.
    pub(super) invariant: bool,
    /// The place of the expression of the entry point that it was made for; [`NONE`] when it is none of its own.
    pub(super) origin: u32,
}

/// A scalar variable of each lane, or an array of such that is indexed while the program runs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slot {
    pub(super) kind: Kind,
    pub(super) len: u32,
}

pub(super) use super::code::{Detail, Question, Sample, TexelLoad};

/// One case of a switch.
#[derive(Clone, Debug)]
pub(super) struct Case {
    /// The value that selects it; nothing for the default.
    pub(super) value: Option<u32>,
    pub(super) body: Vec<Node>,
    pub(super) fall_through: bool,
}

/// One step.
#[derive(Clone, Debug)]
pub(super) enum Node {
    Op {
        op: Op,
        result: Id,
        operands: [Id; 3],
    },
    /// Reads a slot, at `offset` plus an index that is in range.
    Get {
        result: Id,
        slot: SlotId,
        index: Option<Id>,
        offset: u32,
    },
    /// Writes a slot.
    Set {
        slot: SlotId,
        index: Option<Id>,
        offset: u32,
        value: Id,
    },
    /// Reads a word of a buffer, at `offset` plus an index in bytes.
    Fetch {
        result: Id,
        buffer: u32,
        index: Option<Id>,
        offset: u32,
    },
    /// How many elements of a size in bytes follow an offset in a buffer.
    Length {
        result: Id,
        buffer: u32,
        offset: u32,
        stride: u32,
    },
    Derivative {
        result: Id,
        value: Id,
        axis: DerivativeAxis,
        coarse: bool,
    },
    Sample(Box<Sample<Id>>),
    TexelLoad(Box<TexelLoad<Id>>),
    Query {
        results: [Option<Id>; 3],
        texture: u32,
        question: Question,
        level: Option<Id>,
    },
    /// Adds the values to a probe, component by component; for a probe of pairs, two at a time.
    Probe {
        probe: u32,
        values: Vec<Id>,
    },
    /// Counts the lanes that come by.
    Count(u32),
    /// The lanes that come by go on as helpers.
    Kill,
    If {
        condition: Id,
        accept: Vec<Node>,
        reject: Vec<Node>,
    },
    Switch {
        selector: Id,
        label: Label,
        cases: Vec<Case>,
    },
    Loop {
        /// Leaving the loop.
        label: Label,
        /// Leaving the body for `continuing`.
        next: Label,
        body: Vec<Node>,
        continuing: Vec<Node>,
        break_if: Option<Id>,
    },
    Scope {
        label: Label,
        body: Vec<Node>,
    },
    Exit(Label),
}

/// A whole program.
#[derive(Debug, Default)]
pub(super) struct Ir {
    pub(super) values: Vec<Value>,
    pub(super) slots: Vec<Slot>,
    /// How many labels there are.
    pub(super) labels: u32,
    /// Computed once for a draw, in order.
    pub(super) prologue: Vec<Node>,
    pub(super) body: Vec<Node>,
    pub(super) inputs: Vec<Id>,
    /// The results, with their kinds.
    pub(super) outputs: Vec<(Id, ScalarKind)>,
    /// What each counted lane of a [`Node::Count`] has worked.
    pub(super) work: Vec<Work>,
    pub(super) buffers: Vec<(u32, u32)>,
    pub(super) textures: Vec<(u32, u32)>,
    pub(super) samplers: Vec<(u32, u32)>,
    /// The components of each probe.
    pub(super) probes: Vec<usize>,
    /// The components of each probe of a value beside an operand; these are numbered on from the others.
    pub(super) pairs: Vec<usize>,
    pub(super) discards: bool,
    /// Where the loop of each label is.
    pub(super) loops: Vec<(Label, Span)>,
    /// What new values are made for, as [`Value::origin`].
    pub(super) origin: u32,
}

impl Ir {
    /// A new value.
    pub(super) fn value(&mut self, kind: Kind) -> Id {
        self.values.push(Value {
            kind,
            constant: None,
            invariant: false,
            origin: self.origin,
        });
        self.values.len() as Id - 1
    }
}

impl Node {
    /// Calls `visit` with each value that this node itself reads, not those of the nodes inside it.
    pub(super) fn operands(&self, mut each: impl FnMut(Id)) {
        let mut visit = |id: Id| {
            if id != NONE {
                each(id);
            }
        };
        match self {
            Self::Op { operands, .. } => operands.iter().copied().for_each(&mut visit),
            Self::Get { index, .. } | Self::Fetch { index, .. } => {
                index.iter().copied().for_each(&mut visit);
            }
            Self::Set { index, value, .. } => {
                index.iter().copied().for_each(&mut visit);
                visit(*value);
            }
            Self::Derivative { value, .. } => visit(*value),
            Self::Sample(sample) => sample.operands(visit),
            Self::TexelLoad(load) => load.operands(visit),
            Self::Query { level, .. } => level.iter().copied().for_each(&mut visit),
            Self::Probe { values, .. } => values.iter().copied().for_each(&mut visit),
            Self::If { condition, .. } => visit(*condition),
            Self::Switch { selector, .. } => visit(*selector),
            // Read after `continuing`, see the walks.
            Self::Loop { .. } => {}
            Self::Length { .. }
            | Self::Count(_)
            | Self::Kill
            | Self::Scope { .. }
            | Self::Exit(_) => {}
        }
    }

    /// Calls `visit` with each value that this node defines.
    pub(super) fn results(&self, mut each: impl FnMut(Id)) {
        let mut visit = |id: Id| {
            if id != NONE {
                each(id);
            }
        };
        match self {
            Self::Op { result, .. }
            | Self::Get { result, .. }
            | Self::Fetch { result, .. }
            | Self::Length { result, .. }
            | Self::Derivative { result, .. } => visit(*result),
            Self::Sample(sample) => sample.results.iter().flatten().copied().for_each(visit),
            Self::TexelLoad(load) => load.results.iter().flatten().copied().for_each(visit),
            Self::Query { results, .. } => results.iter().flatten().copied().for_each(visit),
            _ => {}
        }
    }
}
