//! Runs one shader over one exhibit, and sees which fragments are bad: not finite, or beyond what the target holds.

use super::inputs::{Group, Interface};
use super::law::Broken;
use super::{Battery, Exhibit, Inputs, Reach};
use crate::eval::lane::{LANES, Mask, Words};
use crate::eval::machine::{Machine, Watcher};
use crate::eval::program::{Program, Slot};
use crate::eval::programs::{Programs, Stand};
use crate::eval::raster::{Block, Frame, on_spots};
use crate::eval::rough::{Arithmetic, Rough};
use naga::{Binding, ScalarKind};
use std::borrow::Cow;

/// What is run: the programs of a shader.
pub(crate) struct Subject {
    pub(crate) programs: Programs,
    /// Whether it has a vertex stage of its own.
    own_vertex: bool,
}

impl Subject {
    pub(crate) fn new(programs: Programs) -> Self {
        Self {
            own_vertex: programs.vertex.is_some(),
            programs,
        }
    }

    /// The vertex program that it is drawn with.
    pub(crate) fn vertex<'p>(&'p self, stand: &'p Stand<'_>) -> &'p Program {
        match &self.programs.vertex {
            Some((program, _)) => program,
            None => stand.vertex,
        }
    }

    /// The fragments of a group of made inputs, of which `own` is what uniforms and textures hold.
    pub(crate) fn given<'f>(
        &self,
        stand: &Stand<'_>,
        own: &'f Frame,
        group: &Group,
        watcher: Option<&mut dyn Watcher<f32>>,
    ) -> Given<'f> {
        let (frame, _) = self.programs.bound(own);
        let fragment = &self.programs.fragment;
        // The stage that lodc supplies has its buffer where a variant may have something else.
        let of_vertices = match self.own_vertex {
            true => &*frame,
            false => own,
        };
        let spots = Interface::spots(group);
        let blocks = on_spots(self.vertex(stand), fragment, of_vertices, &spots, watcher);
        Given {
            frame,
            blocks,
            slots: fragment.inputs().to_vec(),
        }
    }
}

/// Which fragments of an exhibit are bad, block by block.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bad {
    blocks: Vec<Mask>,
    /// How many there are.
    pub(crate) lanes: u64,
}

impl Bad {
    /// Which are bad in a block.
    pub(crate) fn block(&self, at: usize) -> Mask {
        self.blocks.get(at).copied().unwrap_or_default()
    }

    /// The first block and lane that is bad here and not there.
    pub(crate) fn first_beyond(&self, other: &Self) -> Option<(usize, usize)> {
        let blocks = self.blocks.iter().zip(&other.blocks).enumerate();
        blocks
            .filter_map(|(at, (own, other))| Some((at, own.without(*other).lanes().next()?)))
            .next()
    }

    /// What is bad in either run.
    pub(crate) fn or(mut self, other: &Self) -> Self {
        for (own, other) in self.blocks.iter_mut().zip(&other.blocks) {
            *own = own.or(*other);
        }
        self
    }

    /// How many are bad.
    pub(crate) fn count(&self) -> u64 {
        self.blocks.iter().map(|own| u64::from(own.count())).sum()
    }

    /// How many are bad in any of several runs.
    pub(crate) fn any(all: &[Self]) -> u64 {
        let blocks = all.first().map_or(0, |bad| bad.blocks.len());
        let of_block = (0..blocks).map(|at| {
            let masks = all.iter().map(|bad| bad.blocks[at]);
            let any = masks.reduce(Mask::or).unwrap_or_default();
            u64::from(any.count())
        });
        of_block.sum()
    }

    /// Some bad ones that are not bad in another run, as blocks and lanes.
    pub(crate) fn some(&self, count: usize, without: &Self) -> Vec<(usize, usize)> {
        let blocks = self.blocks.iter().enumerate();
        let all = blocks.flat_map(|(at, own)| {
            let other = without.blocks.get(at);
            let own = own.without(other.copied().unwrap_or_default());
            own.lanes().map(move |lane| (at, lane))
        });
        let all: Vec<_> = all.collect();
        let apart = all.len().div_ceil(count).max(1);
        all.into_iter().step_by(apart).collect()
    }
}

/// One input on which a shader fails and its original does not.
#[derive(Clone, Debug)]
pub struct Failure {
    pub(crate) exhibit: usize,
    /// The input that a hunt found, where it is none of the battery's.
    pub(crate) group: Option<Group>,
    pub(crate) block: usize,
    pub(crate) lane: usize,
    pub(crate) arithmetic: usize,
    /// The operation that breaks the law, where no number is bad.
    pub(crate) law: Option<Broken>,
    /// Where the input comes from.
    pub reach: Reach,
}

impl Failure {
    /// Which of its group's quads it is in.
    pub(crate) fn quad(&self) -> usize {
        self.block * (LANES / 4) + self.lane / 4
    }
}

/// The fragments of an exhibit as a subject is given them.
pub(crate) struct Given<'f> {
    pub(crate) frame: Cow<'f, Frame>,
    pub(crate) blocks: Vec<Block>,
    /// What the words of a block's inputs are.
    pub(crate) slots: Vec<Slot>,
}

impl Battery<'_> {
    /// The fragments of an exhibit for a subject, whose vertices are computed so.
    pub(crate) fn given<'f>(
        &self,
        subject: &Subject,
        exhibit: &'f Exhibit,
        watcher: Option<&mut dyn Watcher<f32>>,
    ) -> Given<'f> {
        match &exhibit.inputs {
            Inputs::Seen(coverage) => {
                let (frame, _) = subject.programs.bound(&exhibit.frame);
                let fragment = &subject.programs.fragment;
                let vertex = subject.vertex(self.stand);
                let more = match subject.own_vertex {
                    true => Cow::Owned(coverage.with_inputs_of(vertex, fragment, &frame)),
                    false => Cow::Borrowed(&**coverage),
                };
                Given {
                    frame,
                    slots: more.slots.clone(),
                    blocks: match more {
                        Cow::Owned(coverage) => coverage.blocks,
                        Cow::Borrowed(coverage) => coverage.blocks.clone(),
                    },
                }
            }
            Inputs::Made(group) => subject.given(self.stand, &exhibit.frame, group, watcher),
        }
    }

    /// Which fragments of an exhibit are given what is no number, or infinite, by the original's vertices.
    pub(crate) fn hostile(&self, exhibit: &Exhibit, arithmetic: Arithmetic) -> Bad {
        let mut rough = Rough(arithmetic);
        let given = match rough.is_plain() {
            true => self.given(&self.original, exhibit, None),
            false => self.given(&self.original, exhibit, Some(&mut rough)),
        };
        let floats = || {
            let slots = given.slots.iter().enumerate();
            slots.filter(|(_, slot)| slot.kind == ScalarKind::Float)
        };
        let mut bad = Bad::default();
        for block in &given.blocks {
            let mut own = Mask::default();
            for lane in block.covered.lanes() {
                let mut words = floats().map(|(at, _)| f32::from_bits(block.inputs[at][lane]));
                if words.any(|x| !x.is_finite()) {
                    own.0[lane / 64] |= 1 << (lane % 64);
                }
            }
            bad.lanes += u64::from(block.covered.count());
            bad.blocks.push(own);
        }
        bad
    }

    /// Which fragments of an exhibit are bad.
    pub(crate) fn run(&self, subject: &Subject, exhibit: &Exhibit, arithmetic: Arithmetic) -> Bad {
        let mut rough = Rough(arithmetic);
        let is_plain = rough.is_plain();
        let given = match is_plain {
            true => self.given(subject, exhibit, None),
            false => self.given(subject, exhibit, Some(&mut rough)),
        };
        let mut bad = Bad::default();
        for block in &given.blocks {
            let watcher = match is_plain {
                true => None,
                false => Some(&mut rough as &mut dyn Watcher<f32>),
            };
            let (outputs, alive) = shade(&subject.programs.fragment, &given, block, watcher);
            bad.lanes += u64::from(block.covered.count());
            bad.blocks.push(self.bad(subject, block, &outputs, alive));
        }
        bad
    }

    /// Which fragments of a block are bad, by what its program returned.
    pub(crate) fn bad(
        &self,
        subject: &Subject,
        block: &Block,
        outputs: &[Words],
        alive: Mask,
    ) -> Mask {
        let mut bad = Mask::default();
        for (slot, words) in subject.programs.fragment.outputs().iter().zip(outputs) {
            let is_colour = matches!(slot.binding, Binding::Location { .. });
            if slot.kind != ScalarKind::Float || !is_colour {
                continue;
            }
            for lane in block.covered.and(alive).lanes() {
                let x = f32::from_bits(words[lane]);
                if !x.is_finite() || x.abs() > self.most {
                    bad.0[lane / 64] |= 1 << (lane % 64);
                }
            }
        }
        bad
    }

    /// Where a subject is bad in an exhibit and the original is not, one for each arithmetic.
    pub(crate) fn failures_of(&self, subject: &Subject, at: usize) -> Vec<Failure> {
        let exhibit = &self.exhibits[at];
        let mut failures = Vec::new();
        for (number, arithmetic) in self.arithmetics.iter().enumerate() {
            let bad = self.run(subject, exhibit, *arithmetic);
            if let Some((block, lane)) = bad.first_beyond(&exhibit.original[number]) {
                failures.push(Failure {
                    exhibit: at,
                    group: None,
                    block,
                    lane,
                    arithmetic: number,
                    law: None,
                    reach: exhibit.reach(),
                });
            }
        }
        failures
    }
}

/// Runs a fragment program over a block.
pub(crate) fn shade(
    program: &Program,
    given: &Given<'_>,
    block: &Block,
    watcher: Option<&mut dyn Watcher<f32>>,
) -> (Vec<Words>, Mask) {
    let inputs = fed(program, given, block);
    let mut outputs = vec![[0; LANES]; program.outputs().len()];
    let watcher = watcher.map(|watcher| watcher as &mut dyn Watcher<f32>);
    let mut machine = Machine::watched(program, &given.frame.bindings, block.draw, watcher);
    let alive = machine.run(&inputs, block.active, block.covered, &mut outputs);
    (outputs, alive)
}

/// The inputs of a program, from those of a block.
pub(crate) fn fed(program: &Program, given: &Given<'_>, block: &Block) -> Vec<Words> {
    let slots = program.inputs().iter().map(|slot| {
        let at = given.slots.iter().position(|have| have.meets(slot));
        at.map_or([0; LANES], |at| block.inputs[at])
    });
    slots.collect()
}
