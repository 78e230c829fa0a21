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
    pub(in crate::eval) const NONE: Self = Self(u32::MAX);

    pub(in crate::eval) fn varying(index: u32) -> Self {
        Self(index)
    }

    pub(in crate::eval) fn uniform(index: u32) -> Self {
        Self(index | Self::UNIFORM)
    }

    /// Whether it is the same for all lanes.
    #[inline(always)]
    pub(in crate::eval) fn is_uniform(self) -> bool {
        self.0 & Self::UNIFORM != 0
    }

    /// Its place in its file.
    #[inline(always)]
    pub(in crate::eval) fn index(self) -> usize {
        (self.0 & !Self::UNIFORM) as usize
    }
}

/// How the MIP level of a sample is chosen; see [`crate::eval::texture::Detail`].
#[derive(Clone, Debug)]
pub(in crate::eval) enum Detail<V> {
    Implicit(Option<V>),
    Gradients(Vec<V>, Vec<V>),
    Exact(V),
    Zero,
}

/// A texture sample.
#[derive(Clone, Debug)]
pub(in crate::eval) struct Sample<V> {
    pub(in crate::eval) texture: u32,
    pub(in crate::eval) sampler: u32,
    pub(in crate::eval) coordinates: Vec<V>,
    pub(in crate::eval) layer: Option<V>,
    pub(in crate::eval) offset: [i32; 3],
    pub(in crate::eval) detail: Detail<V>,
    pub(in crate::eval) gather: Option<usize>,
    pub(in crate::eval) reference: Option<V>,
    pub(in crate::eval) clamp_to_edge: bool,
    /// What takes the four components; nothing where nobody asks.
    pub(in crate::eval) results: [Option<V>; 4],
}

/// A texel load.
#[derive(Clone, Debug)]
pub(in crate::eval) struct TexelLoad<V> {
    pub(in crate::eval) texture: u32,
    pub(in crate::eval) coordinates: Vec<V>,
    pub(in crate::eval) layer: Option<V>,
    pub(in crate::eval) level: Option<V>,
    pub(in crate::eval) results: [Option<V>; 4],
}

/// What is asked of a texture besides its texels.
#[derive(Clone, Copy, Debug)]
pub(in crate::eval) enum Question {
    /// Width, height and depth of a level.
    Size,
    /// How many levels there are.
    Levels,
    /// How many layers there are.
    Layers,
}

impl<V: Copy> Sample<V> {
    /// Calls `visit` with each operand.
    pub(in crate::eval) fn operands(&self, mut visit: impl FnMut(V)) {
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
    pub(in crate::eval) fn map<U>(&self, to: impl Fn(V) -> U) -> Sample<U> {
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
    pub(in crate::eval) fn operands(&self, mut visit: impl FnMut(V)) {
        self.coordinates.iter().copied().for_each(&mut visit);
        self.layer.iter().copied().for_each(&mut visit);
        self.level.iter().copied().for_each(&mut visit);
    }

    /// The same with other names for its values.
    pub(in crate::eval) fn map<U>(&self, to: impl Fn(V) -> U) -> TexelLoad<U> {
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
pub(in crate::eval) enum Instruction {
    /// A scalar operation.
    Op {
        op: Op,
        to: Register,
        operands: [Register; 3],
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
pub(in crate::eval) struct Case {
    pub(in crate::eval) value: Option<u32>,
    pub(in crate::eval) body: Vec<Step>,
    pub(in crate::eval) fall_through: bool,
}

/// A step of the program: straight code, or control flow. Lanes that exit wait at the end of what has
/// the label.
#[derive(Clone, Debug)]
pub(in crate::eval) enum Step {
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
pub(in crate::eval) struct Code {
    /// Registers of varying floats, varying words, uniform floats and uniform words.
    pub(in crate::eval) registers: [u32; 4],
    /// The constants that uniform registers start with.
    pub(in crate::eval) constants: Vec<(Kind, Register, u32)>,
    /// Instructions that run once for a draw, on uniform registers.
    pub(in crate::eval) prologue: Vec<Instruction>,
    pub(in crate::eval) instructions: Vec<Instruction>,
    pub(in crate::eval) steps: Vec<Step>,
    pub(in crate::eval) labels: u32,
    /// Where each input goes; nothing when it is not read.
    pub(in crate::eval) inputs: Vec<Option<(Kind, Register)>>,
    pub(in crate::eval) outputs: Vec<(ScalarKind, Register)>,
}
