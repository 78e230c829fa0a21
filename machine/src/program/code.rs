//! What a [`super::Program`] is made of: instructions on registers, under structured control flow.
//!
//! There are four files of registers, for floats and words, and for what differs from lane to lane and what
//! is the same for all. An instruction whose operands are all uniform has a uniform result, and is
//! done once.

use lodc_passes::semantics::{Kind, Op};
use naga::ScalarKind;
use std::ops::Range;

/// A register of the kind that the instruction implies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register(u32);

impl Register {
    const UNIFORM: u32 = 1 << 31;
    /// Stands for an operand that is not there.
    pub(crate) const NONE: Self = Self(u32::MAX);

    pub(crate) fn varying(index: u32) -> Self {
        Self(index)
    }

    pub(crate) fn uniform(index: u32) -> Self {
        Self(index | Self::UNIFORM)
    }

    /// Whether it is the same for all lanes.
    #[inline(always)]
    pub(crate) fn is_uniform(self) -> bool {
        self.0 & Self::UNIFORM != 0
    }

    /// Its place in its file.
    #[inline(always)]
    pub(crate) fn index(self) -> usize {
        (self.0 & !Self::UNIFORM) as usize
    }
}

/// How the MIP level of a sample is chosen; see [`crate::texture::Detail`].
#[derive(Clone, Debug)]
pub(crate) enum Detail<V> {
    Implicit(Option<V>),
    Gradients(Vec<V>, Vec<V>),
    Exact(V),
    Zero,
}

/// A texture sample.
#[derive(Clone, Debug)]
pub(crate) struct Sample<V> {
    pub(crate) texture: u32,
    pub(crate) sampler: u32,
    pub(crate) coordinates: Vec<V>,
    pub(crate) layer: Option<V>,
    pub(crate) offset: [i32; 3],
    pub(crate) detail: Detail<V>,
    pub(crate) gather: Option<usize>,
    pub(crate) reference: Option<V>,
    pub(crate) clamp_to_edge: bool,
    /// What takes the four components; nothing where nobody asks.
    pub(crate) results: [Option<V>; 4],
}

/// A texel load.
#[derive(Clone, Debug)]
pub(crate) struct TexelLoad<V> {
    pub(crate) texture: u32,
    pub(crate) coordinates: Vec<V>,
    pub(crate) layer: Option<V>,
    pub(crate) level: Option<V>,
    pub(crate) results: [Option<V>; 4],
}

/// What is asked of a texture besides its texels.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Question {
    /// Width, height and depth of a level.
    Size,
    /// How many levels there are.
    Levels,
    /// How many layers there are.
    Layers,
}

impl<V: Copy> Sample<V> {
    /// Calls `visit` with each operand.
    pub(crate) fn operands(&self, mut visit: impl FnMut(V)) {
        self.coordinates.iter().copied().for_each(&mut visit);
        self.layer.iter().copied().for_each(&mut visit);
        self.reference.iter().copied().for_each(&mut visit);
        match &self.detail {
            Detail::Implicit(bias) => bias.iter().copied().for_each(&mut visit),
            Detail::Gradients(x, y) => x.iter().chain(y).copied().for_each(&mut visit),
            Detail::Exact(level) => visit(*level),
            Detail::Zero => {}
        }
    }

    /// The same with other names for its values.
    pub(crate) fn map<U>(&self, to: impl Fn(V) -> U) -> Sample<U> {
        let list = |values: &[V]| values.iter().map(|&v| to(v)).collect();
        Sample {
            texture: self.texture,
            sampler: self.sampler,
            coordinates: list(&self.coordinates),
            layer: self.layer.map(&to),
            offset: self.offset,
            detail: match &self.detail {
                Detail::Implicit(bias) => Detail::Implicit(bias.map(&to)),
                Detail::Gradients(x, y) => Detail::Gradients(list(x), list(y)),
                Detail::Exact(level) => Detail::Exact(to(*level)),
                Detail::Zero => Detail::Zero,
            },
            gather: self.gather,
            reference: self.reference.map(&to),
            clamp_to_edge: self.clamp_to_edge,
            results: self.results.map(|r| r.map(&to)),
        }
    }
}

impl<V: Copy> TexelLoad<V> {
    /// Calls `visit` with each operand.
    pub(crate) fn operands(&self, mut visit: impl FnMut(V)) {
        self.coordinates.iter().copied().for_each(&mut visit);
        self.layer.iter().copied().for_each(&mut visit);
        self.level.iter().copied().for_each(&mut visit);
    }

    /// The same with other names for its values.
    pub(crate) fn map<U>(&self, to: impl Fn(V) -> U) -> TexelLoad<U> {
        TexelLoad {
            texture: self.texture,
            coordinates: self.coordinates.iter().map(|&v| to(v)).collect(),
            layer: self.layer.map(&to),
            level: self.level.map(&to),
            results: self.results.map(|r| r.map(&to)),
        }
    }
}

/// One instruction.
#[derive(Clone, Debug)]
pub(crate) enum Instruction {
    /// A scalar operation.
    Op {
        op: Op,
        to: Register,
        operands: [Register; 3],
        /// The place of the expression of the entry point that it is of; `u32::MAX` when it is of none.
        origin: u32,
    },
    /// A copy; where `masked`, only lanes that run get it.
    Copy {
        kind: Kind,
        to: Register,
        from: Register,
        masked: bool,
    },
    /// Reads one of `len` registers from `base` on, at `offset` plus an index.
    Get {
        kind: Kind,
        to: Register,
        base: Register,
        len: u32,
        index: Register,
        offset: u32,
    },
    /// Writes one.
    Set {
        kind: Kind,
        base: Register,
        len: u32,
        index: Register,
        offset: u32,
        from: Register,
        masked: bool,
    },
    /// Reads a word of a buffer, at `offset` plus an index in bytes.
    Fetch {
        kind: Kind,
        to: Register,
        buffer: u32,
        index: Register,
        offset: u32,
    },
    /// Counts the elements of a buffer.
    Length {
        to: Register,
        buffer: u32,
        offset: u32,
        stride: u32,
    },
    /// A difference within quads.
    Derivative {
        to: Register,
        from: Register,
        /// Along y rather than x.
        down: bool,
        coarse: bool,
    },
    Sample(Box<Sample<Register>>),
    TexelLoad(Box<TexelLoad<Register>>),
    Query {
        results: [Option<Register>; 3],
        texture: u32,
        question: Question,
        level: Option<Register>,
    },
    /// Adds values to a probe; to one of pairs, two at a time.
    Probe {
        probe: u32,
        values: Vec<Register>,
    },
    /// Counts lanes.
    Count(u32),
}

/// A case of a switch.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) value: Option<u32>,
    pub(crate) body: Vec<Step>,
    pub(crate) fall_through: bool,
}

/// A step of the program: straight code, or control flow. Lanes that exit wait at the end of what has
/// the label.
#[derive(Clone, Debug)]
pub(crate) enum Step {
    Run(Range<usize>),
    Kill,
    If {
        condition: Register,
        accept: Vec<Step>,
        reject: Vec<Step>,
    },
    Switch {
        selector: Register,
        label: u32,
        cases: Vec<Case>,
    },
    Loop {
        label: u32,
        next: u32,
        body: Vec<Step>,
        continuing: Vec<Step>,
        break_if: Option<Register>,
    },
    Scope {
        label: u32,
        body: Vec<Step>,
    },
    Exit(u32),
}

/// Everything that a machine runs.
#[derive(Debug, Default)]
pub(crate) struct Code {
    /// Registers of varying floats, varying words, uniform floats and uniform words.
    pub(crate) registers: [u32; 4],
    /// The constants that uniform registers start with.
    pub(crate) constants: Vec<(Kind, Register, u32)>,
    /// Instructions that run once for a draw, on uniform registers.
    pub(crate) prologue: Vec<Instruction>,
    pub(crate) instructions: Vec<Instruction>,
    pub(crate) steps: Vec<Step>,
    pub(crate) labels: u32,
    /// Where each input goes; nothing when it is not read.
    pub(crate) inputs: Vec<Option<(Kind, Register)>>,
    pub(crate) outputs: Vec<(ScalarKind, Register)>,
}
