//! Runs a [`Program`] over blocks of lanes, with execution masks and helper lanes.
//!
//! A value is computed for all 256 lanes at once, whether they take part or not; only what outlives a
//! branch is written under the mask. Nothing traps, and lanes that do not take part are never seen, but for
//! derivatives next to diverging lanes, which no GPU defines either.

#![allow(
    clippy::vec_box,
    reason = "blocks change places with spare ones by their pointers, without a copy"
)]

mod kernels;
mod recall;
mod textures;
mod watch;

use super::lane::{LANES, Lane, Mask, Words};
use super::mix::Mix;
use super::program::Program;
use super::program::code::{Case, Instruction, Register, Step};
use super::texture::{Sampler, Texture};
use lodc_passes::Work;
use lodc_passes::facts::Moments;
use lodc_passes::semantics::{Kind, words};
use naga::{ScalarKind, Span};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use textures::Scratch;

pub use kernels::Kernels;
use kernels::{Registers, Vectors};
pub use recall::Recall;
pub use watch::{Outcome, Watcher};

/// Rounds of all loops together that a block may take; a shader that wants more is taken to
/// never end.
pub const MAX_ROUNDS: u32 = 1 << 18;

/// What is bound at a group and binding.
#[derive(Clone, Debug)]
pub enum Resource {
    /// A uniform or read-only storage buffer, in the layout of its type.
    Buffer(Arc<Vec<u8>>),
    /// A texture.
    Texture(Arc<Texture>),
    /// A sampler.
    Sampler(Arc<Sampler>),
    /// Another one of the above for each draw of a mesh; a draw beyond the last takes the last.
    PerDraw(Arc<[Resource]>),
}

impl Resource {
    /// What a draw sees; nothing when there is none.
    pub fn of_draw(&self, draw: usize) -> Option<&Self> {
        match self {
            Self::PerDraw(all) => all.get(draw).or(all.last()),
            one => Some(one),
        }
    }
}

/// The resources of a mesh's draws, by group and binding.
pub type Bindings = BTreeMap<(u32, u32), Resource>;

/// What a run of a program showed besides its results.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// Covered lanes that were run, helper lanes apart.
    pub lanes: u64,
    /// Work that those lanes executed, in total (divide by `lanes` for the mean). A discarded lane
    /// works no more.
    pub work: Work,
    /// What they executed by class, in total.
    pub mix: Mix,
    /// For each probe of the program and each of its components: what covered active lanes held.
    pub probes: Vec<Vec<Probe>>,
    /// For each probe of a value beside an operand, and each component of the value.
    pub pairs: Vec<Vec<Moments>>,
    /// Covered lanes that were still in a loop when it was stopped because it does not seem to end. Their
    /// outputs are NaN and 0.
    pub ran_away: u64,
    /// The loop that was stopped first.
    pub endless: Option<Span>,
}

impl Profile {
    /// Adds what a later run of the same program showed.
    pub fn absorb(&mut self, later: &Self) {
        self.lanes += later.lanes;
        self.work += later.work;
        self.mix += later.mix;
        self.ran_away += later.ran_away;
        self.endless = self.endless.or(later.endless);
        if self.probes.is_empty() && self.pairs.is_empty() {
            self.probes.clone_from(&later.probes);
            self.pairs.clone_from(&later.pairs);
            return;
        }
        for (ours, theirs) in self.pairs.iter_mut().zip(&later.pairs) {
            for (ours, theirs) in ours.iter_mut().zip(theirs) {
                ours.merge(theirs);
            }
        }
        for (ours, theirs) in self.probes.iter_mut().zip(&later.probes) {
            for (ours, theirs) in ours.iter_mut().zip(theirs) {
                ours.absorb(theirs);
            }
        }
    }
}

/// What covered active lanes held of one component of one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// How many lanes.
    pub count: u64,
    /// What they weigh together: as much as they are, unless the machine was told otherwise.
    pub weight: f64,
    /// Their weighted sum, accumulated in f64 in lane order.
    pub sum: f64,
    /// The smallest; NaN when one was NaN, infinite when there was none.
    pub min: f32,
    /// The largest; NaN when one was NaN, negative infinity when there was none.
    pub max: f32,
}

impl Default for Probe {
    fn default() -> Self {
        Self {
            count: 0,
            weight: 0.0,
            sum: 0.0,
            min: f32::INFINITY,
            max: f32::NEG_INFINITY,
        }
    }
}

impl Probe {
    fn add(&mut self, value: f32, weight: f64) {
        // What weighs nothing may be infinite.
        let sum = if weight > 0.0 {
            weight * f64::from(value)
        } else {
            0.0
        };
        self.absorb(&Self {
            count: 1,
            weight,
            sum,
            min: value,
            max: value,
        });
    }

    /// Adds what others held. NaN wins, unlike in `f32::min`.
    pub fn absorb(&mut self, other: &Self) {
        self.count += other.count;
        self.weight += other.weight;
        self.sum += other.sum;
        if other.min < self.min || other.min.is_nan() {
            self.min = other.min;
        }
        if other.max > self.max || other.max.is_nan() {
            self.max = other.max;
        }
    }
}

/// A program made ready to run over the resources of one draw: buffers read, uniform values computed.
/// `R` is what a float is while it runs.
#[derive(Debug)]
pub struct Machine<'a, R = f32> {
    program: &'a Program,
    buffers: Vec<&'a [u8]>,
    textures: Vec<&'a Texture>,
    samplers: Vec<&'a Sampler>,
    /// What earlier programs have read in the block that comes.
    recall: Option<&'a Recall>,
    registers: Registers<R>,
    scratch: Scratch,
    vectors: Option<Vectors>,
    /// The lanes that run.
    mask: Mask,
    /// The same as words, and of which mask they are.
    mask_words: Box<Words>,
    mask_of_words: Mask,
    /// For each label the lanes that wait at its end.
    waiting: Vec<Mask>,
    /// Lanes of quads that are not over.
    going: Mask,
    covered: Mask,
    /// What each lane weighs in probes; each 1 when there is nothing.
    weights: Option<Box<[f32; LANES]>>,
    discarded: Mask,
    ran_away: Mask,
    rounds: u32,
    endless: Option<Span>,
    counts: Vec<u64>,
    lanes: u64,
    lost: u64,
    probes: Vec<Vec<Probe>>,
    pairs: Vec<Vec<Moments>>,
    /// Who is shown each operation.
    watcher: Option<&'a mut dyn Watcher<R>>,
}

impl<'a> Machine<'a> {
    /// Makes a machine for a program and its resources. One machine serves one thread.
    ///
    /// # Panics
    /// When a resource that the program uses is not bound, or is of another kind: the scene sees to that.
    pub fn new(program: &'a Program, bindings: &'a Bindings) -> Self {
        Self::of_lanes(program, bindings, 0)
    }

    /// The same for one of several draws.
    ///
    /// # Panics
    /// As [`Machine::new`].
    pub fn of_draw(program: &'a Program, bindings: &'a Bindings, draw: usize) -> Self {
        Self::of_lanes(program, bindings, draw)
    }
}

impl<'a, R: Lane> Machine<'a, R> {
    /// The same for any type of lane.
    ///
    /// # Panics
    /// As [`Machine::new`].
    pub fn of_lanes(program: &'a Program, bindings: &'a Bindings, draw: usize) -> Self {
        Self::watched(program, bindings, draw, None)
    }

    /// The same with somebody who is shown each operation, and may change what it gives.
    ///
    /// # Panics
    /// As [`Machine::new`].
    pub fn watched(
        program: &'a Program,
        bindings: &'a Bindings,
        draw: usize,
        watcher: Option<&'a mut dyn Watcher<R>>,
    ) -> Self {
        let find = |&(group, binding): &(u32, u32)| match bindings
            .get(&(group, binding))
            .and_then(|resource| resource.of_draw(draw))
        {
            Some(resource) => resource,
            None => panic!("nothing is bound at group {group}, binding {binding}"),
        };
        let wrong = |at: &(u32, u32), kind: &str| -> ! {
            panic!(
                "what is bound at group {}, binding {} is no {kind}",
                at.0, at.1
            )
        };
        let code = &program.code;
        let mut machine = Self {
            program,
            buffers: program
                .buffers
                .iter()
                .map(|at| match find(at) {
                    Resource::Buffer(buffer) => &buffer[..],
                    _ => wrong(at, "buffer"),
                })
                .collect(),
            textures: program
                .textures
                .iter()
                .map(|at| match find(at) {
                    Resource::Texture(texture) => &**texture,
                    _ => wrong(at, "texture"),
                })
                .collect(),
            samplers: program
                .samplers
                .iter()
                .map(|at| match find(at) {
                    Resource::Sampler(sampler) => &**sampler,
                    _ => wrong(at, "sampler"),
                })
                .collect(),
            recall: None,
            registers: Registers::new(code.registers),
            scratch: Scratch::default(),
            vectors: Vectors::detect(),
            mask: Mask::default(),
            mask_words: Box::new([0; LANES]),
            mask_of_words: Mask::default(),
            waiting: vec![Mask::default(); code.labels as usize],
            going: Mask::default(),
            covered: Mask::default(),
            weights: None,
            discarded: Mask::default(),
            ran_away: Mask::default(),
            rounds: 0,
            endless: None,
            counts: vec![0; program.work.len()],
            lanes: 0,
            lost: 0,
            probes: program
                .probes
                .iter()
                .map(|&components| vec![Probe::default(); components])
                .collect(),
            pairs: program
                .pairs
                .iter()
                .map(|&components| vec![Moments::default(); components])
                .collect(),
            watcher,
        };
        for &(kind, register, bits) in &code.constants {
            match kind {
                Kind::F => {
                    machine.registers.uniform_floats[register.index()] =
                        R::from_f32(f32::from_bits(bits));
                }
                Kind::W => machine.registers.uniform_words[register.index()] = bits,
            }
        }
        machine.instructions(&code.prologue);
        machine
    }

    /// Says what each lane of the next blocks weighs in probes, 0 or more.
    pub fn weigh(&mut self, weights: &[f32; LANES]) {
        **self.weights.get_or_insert_with(|| Box::new([1.0; LANES])) = *weights;
    }

    /// Says what is remembered of the textures in the next block, if anything.
    pub fn recall(&mut self, recall: Option<&'a Recall>) {
        self.recall = recall;
    }

    /// Runs one block. `inputs` has one entry per slot of [`Program::inputs`], `outputs` one per slot
    /// of [`Program::outputs`]. `active` lanes run; of those, `covered` ones count in the profile (the others
    /// are helper lanes). Returns the lanes that were not discarded.
    ///
    /// # Panics
    /// When there are fewer inputs or outputs than slots.
    pub fn run(
        &mut self,
        inputs: &[Words],
        active: Mask,
        covered: Mask,
        outputs: &mut [Words],
    ) -> Mask {
        let program = self.program;
        for (i, input) in program.code.inputs.iter().enumerate() {
            match *input {
                Some((Kind::F, register)) => {
                    let to = &mut self.registers.floats[register.index()];
                    for (to, &word) in to.iter_mut().zip(&inputs[i]) {
                        *to = R::from_f32(f32::from_bits(word));
                    }
                }
                Some((Kind::W, register)) => {
                    *self.registers.words[register.index()] = inputs[i];
                }
                None => {}
            }
        }
        self.mask = active;
        self.going = active;
        self.covered = covered.and(active);
        self.discarded = Mask::default();
        self.ran_away = Mask::default();
        self.rounds = 0;
        self.lanes += u64::from(self.covered.count());
        self.steps(&program.code.steps);
        self.lost += u64::from(self.ran_away.and(self.covered).count());

        for (&(kind, register), output) in program.code.outputs.iter().zip(outputs) {
            let registers = &self.registers;
            match (kind, register.is_uniform()) {
                (ScalarKind::Float, true) => {
                    *output =
                        [words::bits(registers.uniform_floats[register.index()].to_f32()); LANES];
                }
                (ScalarKind::Float, false) => {
                    let from = &registers.floats[register.index()];
                    for (to, from) in output.iter_mut().zip(from.iter()) {
                        *to = words::bits(from.to_f32());
                    }
                }
                (_, true) => *output = [registers.uniform_words[register.index()]; LANES],
                (_, false) => *output = *registers.words[register.index()],
            }
            if !self.ran_away.is_empty() {
                let lost = match kind {
                    ScalarKind::Float => words::bits(f32::NAN),
                    _ => 0,
                };
                for lane in self.ran_away.lanes() {
                    output[lane] = lost;
                }
            }
        }
        active.without(self.discarded)
    }

    /// What has been run so far.
    pub fn profile(&self) -> Profile {
        let mut work = Work::default();
        let mut mix = self.program.prologue * self.lanes as f64;
        let executed = self.program.executed.iter();
        for ((&count, &each), executed) in self.counts.iter().zip(&self.program.work).zip(executed)
        {
            work += each * count as f64;
            mix += executed.mix(&self.textures, &self.samplers) * count as f64;
        }
        Profile {
            lanes: self.lanes,
            work,
            mix,
            probes: self.probes.clone(),
            pairs: self.pairs.clone(),
            ran_away: self.lost,
            endless: self.endless,
        }
    }

    // Control flow. Lanes that leave a branch wait at the end of what they leave.

    fn steps(&mut self, steps: &[Step]) {
        for step in steps {
            if self.mask.is_empty() {
                return;
            }
            self.step(step);
        }
    }

    fn step(&mut self, step: &Step) {
        match step {
            Step::Run(range) => self.run_code(range.clone()),
            Step::Kill => {
                self.discarded = self.discarded.or(self.mask);
                // A quad goes on as long as one of its pixels is wanted.
                let wanted = self.covered.without(self.discarded);
                self.going = self.going.and(wanted.quads());
                self.mask = self.mask.and(self.going);
            }
            Step::If {
                condition,
                accept,
                reject,
            } => {
                if condition.is_uniform() {
                    let taken = self.registers.uniform_words[condition.index()] != 0;
                    self.steps(if taken { accept } else { reject });
                    return;
                }
                let taken = self.lanes_where(*condition);
                let all = self.mask;
                self.mask = all.and(taken);
                self.steps(accept);
                let after_accept = self.mask;
                self.mask = all.without(taken).and(self.going);
                self.steps(reject);
                self.mask = self.mask.or(after_accept).and(self.going);
            }
            Step::Switch {
                selector,
                label,
                cases,
            } => {
                if selector.is_uniform() {
                    let value = self.registers.uniform_words[selector.index()];
                    let first = cases
                        .iter()
                        .position(|case| case.value == Some(value))
                        .or_else(|| cases.iter().position(|case| case.value.is_none()));
                    if let Some(first) = first {
                        for case in &cases[first..] {
                            self.steps(&case.body);
                            if !case.fall_through {
                                break;
                            }
                        }
                    }
                } else {
                    self.varying_switch(*selector, cases);
                }
                self.join(*label);
            }
            Step::Loop {
                label,
                next,
                body,
                continuing,
                break_if,
            } => {
                while !self.mask.is_empty() {
                    if self.rounds == MAX_ROUNDS {
                        self.ran_away = self.ran_away.or(self.mask);
                        let mut loops = self.program.loops.iter();
                        let this = loops.find(|(known, _)| known == label);
                        self.endless = self.endless.or(this.map(|(_, span)| *span));
                        self.leave(*label);
                        break;
                    }
                    self.rounds += 1;
                    self.steps(body);
                    self.join(*next);
                    self.steps(continuing);
                    let Some(condition) = break_if else {
                        continue;
                    };
                    if condition.is_uniform() {
                        if self.registers.uniform_words[condition.index()] != 0 {
                            self.leave(*label);
                        }
                    } else {
                        let out = self.lanes_where(*condition).and(self.mask);
                        let waiting = &mut self.waiting[*label as usize];
                        *waiting = waiting.or(out);
                        self.mask = self.mask.without(out);
                    }
                }
                self.join(*label);
            }
            Step::Scope { label, body } => {
                self.steps(body);
                self.join(*label);
            }
            Step::Exit(label) => self.leave(*label),
        }
    }

    fn varying_switch(&mut self, selector: Register, cases: &[Case]) {
        let all = self.mask;
        let words = &self.registers.words[selector.index()];
        let mut rest = all;
        let mut entries: Vec<Mask> = cases
            .iter()
            .map(|case| {
                let Some(value) = case.value else {
                    return Mask::default();
                };
                let mut here = Mask::default();
                for (lane, &word) in words.iter().enumerate() {
                    here.0[lane / 64] |= u64::from(word == value) << (lane % 64);
                }
                let here = here.and(rest);
                rest = rest.without(here);
                here
            })
            .collect();
        if let Some(default) = cases.iter().position(|case| case.value.is_none()) {
            entries[default] = rest;
            rest = Mask::default();
        }
        let mut done = rest;
        let mut falling = Mask::default();
        for (case, entry) in cases.iter().zip(entries) {
            self.mask = entry.or(falling).and(self.going);
            self.steps(&case.body);
            if case.fall_through {
                falling = self.mask;
            } else {
                done = done.or(self.mask);
                falling = Mask::default();
            }
        }
        self.mask = done.or(falling).and(self.going);
    }

    /// The lanes that run wait at the end of what has the label.
    fn leave(&mut self, label: u32) {
        let waiting = &mut self.waiting[label as usize];
        *waiting = waiting.or(self.mask);
        self.mask = Mask::default();
    }

    /// The lanes that wait go on.
    fn join(&mut self, label: u32) {
        let waiting = std::mem::take(&mut self.waiting[label as usize]);
        self.mask = self.mask.or(waiting).and(self.going);
    }

    fn lanes_where(&self, condition: Register) -> Mask {
        Mask::from_words(&self.registers.words[condition.index()])
    }

    // Straight code.

    fn run_code(&mut self, range: Range<usize>) {
        let program = self.program;
        self.instructions(&program.code.instructions[range]);
    }

    fn instructions(&mut self, instructions: &[Instruction]) {
        if self.watcher.is_some() {
            return self.watched_instructions(instructions);
        }
        self.plain_instructions(instructions);
    }

    fn plain_instructions(&mut self, instructions: &[Instruction]) {
        for instruction in instructions {
            match *instruction {
                Instruction::Op {
                    op, to, operands, ..
                } => {
                    if to.is_uniform() {
                        kernels::once(&mut self.registers, op, to, operands);
                    } else {
                        R::apply(self.vectors, &mut self.registers, op, to, operands);
                    }
                }
                Instruction::Copy {
                    kind,
                    to,
                    from,
                    masked,
                } => {
                    if masked && self.mask_of_words != self.mask {
                        self.mask_of_words = self.mask;
                        self.mask.to_words(&mut self.mask_words);
                    }
                    let r = &mut self.registers;
                    let mask = masked.then_some(&*self.mask_words);
                    match kind {
                        Kind::F => copy(
                            &mut r.floats,
                            &mut r.uniform_floats,
                            &mut r.spare_float,
                            (to, from),
                            mask,
                        ),
                        Kind::W => copy(
                            &mut r.words,
                            &mut r.uniform_words,
                            &mut r.spare_word,
                            (to, from),
                            mask,
                        ),
                    }
                }
                _ => self.other(instruction),
            }
        }
    }

    /// Everything that is not done lane by lane alike.
    fn other(&mut self, instruction: &Instruction) {
        match instruction {
            Instruction::Op { .. } | Instruction::Copy { .. } => {}
            &Instruction::Get {
                kind,
                to,
                base,
                len,
                index,
                offset,
            } => {
                let r = &mut self.registers;
                let at = Place {
                    base,
                    len,
                    index,
                    offset,
                };
                match kind {
                    Kind::F => {
                        let (words, uniform) = (&r.words, &r.uniform_words);
                        let index = at.index(words, uniform);
                        get(
                            &mut r.floats,
                            &mut r.uniform_floats,
                            &mut r.spare_float,
                            to,
                            &at,
                            index,
                        );
                    }
                    Kind::W => {
                        let index = at.index(&r.words, &r.uniform_words).owned();
                        get(
                            &mut r.words,
                            &mut r.uniform_words,
                            &mut r.spare_word,
                            to,
                            &at,
                            index.borrowed(),
                        );
                    }
                }
            }
            &Instruction::Set {
                kind,
                base,
                len,
                index,
                offset,
                from,
                masked,
            } => {
                let r = &mut self.registers;
                let at = Place {
                    base,
                    len,
                    index,
                    offset,
                };
                let mask = if masked { self.mask } else { Mask::ALL };
                match kind {
                    Kind::F => {
                        let index = at.index(&r.words, &r.uniform_words);
                        set(&mut r.floats, &mut r.uniform_floats, from, &at, index, mask);
                    }
                    Kind::W => {
                        let index = at.index(&r.words, &r.uniform_words).owned();
                        set(
                            &mut r.words,
                            &mut r.uniform_words,
                            from,
                            &at,
                            index.borrowed(),
                            mask,
                        );
                    }
                }
            }
            &Instruction::Fetch {
                kind,
                to,
                buffer,
                index,
                offset,
            } => self.fetch(kind, to, buffer, index, offset),
            &Instruction::Length {
                to,
                buffer,
                offset,
                stride,
            } => {
                let bytes = self.buffers[buffer as usize].len() as u32;
                self.registers.uniform_words[to.index()] =
                    bytes.saturating_sub(offset) / stride.max(1);
            }
            &Instruction::Derivative {
                to,
                from,
                down,
                coarse,
            } => self.derivative(to, from, down, coarse),
            Instruction::Sample(sample) => self.sample(sample),
            Instruction::TexelLoad(load) => self.texel_load(load),
            Instruction::Query {
                results,
                texture,
                question,
                level,
            } => self.query(results, *texture, *question, *level),
            Instruction::Probe { probe, values } => {
                let lanes = self.counted();
                let registers = &self.registers;
                let read = |register: &Register, lane: usize| {
                    let value = if register.is_uniform() {
                        registers.uniform_floats[register.index()]
                    } else {
                        registers.floats[register.index()][lane]
                    };
                    value.to_f32()
                };
                let weights = self.weights.as_deref();
                let weight = |lane: usize| weights.map_or(1.0, |weights| f64::from(weights[lane]));
                let probe = *probe as usize;
                match probe.checked_sub(self.probes.len()) {
                    None => {
                        for (probe, register) in self.probes[probe].iter_mut().zip(values) {
                            for lane in lanes.lanes() {
                                probe.add(read(register, lane), weight(lane));
                            }
                        }
                    }
                    Some(pair) => {
                        let both = values.as_chunks::<2>().0.iter();
                        for (moments, both) in self.pairs[pair].iter_mut().zip(both) {
                            for lane in lanes.lanes() {
                                let pair = both.each_ref().map(|r| f64::from(read(r, lane)));
                                moments.add(pair, weight(lane));
                            }
                        }
                    }
                }
            }
            Instruction::Count(count) => {
                self.counts[*count as usize] += u64::from(self.counted().count());
            }
        }
    }

    /// The lanes that run and that somebody wants.
    fn counted(&self) -> Mask {
        self.mask.and(self.covered).without(self.discarded)
    }

    fn fetch(&mut self, kind: Kind, to: Register, buffer: u32, index: Register, offset: u32) {
        let bytes = self.buffers[buffer as usize];
        let read = |index: u32| -> u32 {
            let at = index.wrapping_add(offset) as usize;
            match bytes.get(at..at.saturating_add(4)) {
                Some(&[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
                _ => 0,
            }
        };
        let r = &mut self.registers;
        if to.is_uniform() {
            let index = if index == Register::NONE {
                0
            } else {
                r.uniform_words[index.index()]
            };
            match kind {
                Kind::F => {
                    r.uniform_floats[to.index()] = R::from_f32(f32::from_bits(read(index)));
                }
                Kind::W => r.uniform_words[to.index()] = read(index),
            }
            return;
        }
        match kind {
            Kind::F => {
                let index = &r.words[index.index()];
                for (to, &index) in r.spare_float.iter_mut().zip(index.iter()) {
                    *to = R::from_f32(f32::from_bits(read(index)));
                }
                std::mem::swap(&mut r.spare_float, &mut r.floats[to.index()]);
            }
            Kind::W => {
                let index = &r.words[index.index()];
                for (to, &index) in r.spare_word.iter_mut().zip(index.iter()) {
                    *to = read(index);
                }
                std::mem::swap(&mut r.spare_word, &mut r.words[to.index()]);
            }
        }
    }

    fn derivative(&mut self, to: Register, from: Register, down: bool, coarse: bool) {
        let r = &mut self.registers;
        if to.is_uniform() {
            r.uniform_floats[to.index()] = R::from_f32(0.0);
            return;
        }
        let from = &r.floats[from.index()];
        for (out, quad) in r.spare_float.chunks_exact_mut(4).zip(from.chunks_exact(4)) {
            let (first, second) = match (down, coarse) {
                (false, true) => (quad[1].sub(quad[0]), quad[1].sub(quad[0])),
                (false, false) => (quad[1].sub(quad[0]), quad[3].sub(quad[2])),
                (true, true) => (quad[2].sub(quad[0]), quad[2].sub(quad[0])),
                (true, false) => (quad[2].sub(quad[0]), quad[3].sub(quad[1])),
            };
            let four = if down {
                [first, second, first, second]
            } else {
                [first, first, second, second]
            };
            out.copy_from_slice(&four);
        }
        std::mem::swap(&mut r.spare_float, &mut r.floats[to.index()]);
    }
}

/// Copies a register. With a mask, lanes whose word is 0 keep what they had.
#[inline(always)]
fn copy<T: Copy>(
    varying: &mut [Box<[T; LANES]>],
    uniform: &mut [T],
    spare: &mut Box<[T; LANES]>,
    (to, from): (Register, Register),
    mask: Option<&Words>,
) {
    if to.is_uniform() {
        uniform[to.index()] = uniform[from.index()];
        return;
    }
    match (from.is_uniform(), mask) {
        (true, None) => *varying[to.index()] = [uniform[from.index()]; LANES],
        (true, Some(mask)) => {
            let value = uniform[from.index()];
            let to = &mut varying[to.index()];
            for i in 0..LANES {
                to[i] = if mask[i] != 0 { value } else { to[i] };
            }
        }
        (false, None) => {
            **spare = *varying[from.index()];
            std::mem::swap(spare, &mut varying[to.index()]);
        }
        (false, Some(mask)) => {
            let (old, new) = (&varying[to.index()], &varying[from.index()]);
            for i in 0..LANES {
                spare[i] = if mask[i] != 0 { new[i] } else { old[i] };
            }
            std::mem::swap(spare, &mut varying[to.index()]);
        }
    }
}

/// An element of an array of registers.
struct Place {
    base: Register,
    len: u32,
    index: Register,
    offset: u32,
}

/// Which element it is.
enum At<'a> {
    One(u32),
    Each(&'a Words),
}

/// The same, apart from the registers.
enum OwnedAt {
    One(u32),
    Each(Box<Words>),
}

impl At<'_> {
    fn owned(&self) -> OwnedAt {
        match self {
            Self::One(at) => OwnedAt::One(*at),
            Self::Each(at) => OwnedAt::Each(Box::new(**at)),
        }
    }
}

impl OwnedAt {
    fn borrowed(&self) -> At<'_> {
        match self {
            Self::One(at) => At::One(*at),
            Self::Each(at) => At::Each(at),
        }
    }
}

impl Place {
    fn index<'a>(&self, words: &'a [Box<Words>], uniform: &[u32]) -> At<'a> {
        if self.index == Register::NONE {
            At::One(0)
        } else if self.index.is_uniform() {
            At::One(uniform[self.index.index()])
        } else {
            At::Each(&words[self.index.index()])
        }
    }

    /// The register of an element; the index is in range, but for lanes that do not run.
    fn register(&self, index: u32) -> usize {
        let at = index.wrapping_add(self.offset).min(self.len - 1);
        self.base.index() + at as usize
    }
}

fn get<T: Copy>(
    varying: &mut [Box<[T; LANES]>],
    uniform: &mut [T],
    spare: &mut Box<[T; LANES]>,
    to: Register,
    place: &Place,
    at: At,
) {
    match (at, place.base.is_uniform()) {
        (At::One(index), true) => {
            let value = uniform[place.register(index)];
            if to.is_uniform() {
                uniform[to.index()] = value;
            } else {
                *varying[to.index()] = [value; LANES];
            }
        }
        (At::One(index), false) => {
            **spare = *varying[place.register(index)];
            std::mem::swap(spare, &mut varying[to.index()]);
        }
        (At::Each(index), true) => {
            for (to, &index) in spare.iter_mut().zip(index) {
                *to = uniform[place.register(index)];
            }
            std::mem::swap(spare, &mut varying[to.index()]);
        }
        (At::Each(index), false) => {
            for lane in 0..LANES {
                spare[lane] = varying[place.register(index[lane])][lane];
            }
            std::mem::swap(spare, &mut varying[to.index()]);
        }
    }
}

fn set<T: Copy>(
    varying: &mut [Box<[T; LANES]>],
    uniform: &mut [T],
    from: Register,
    place: &Place,
    at: At,
    mask: Mask,
) {
    if place.base.is_uniform() {
        if let At::One(index) = at {
            uniform[place.register(index)] = uniform[from.index()];
        }
        return;
    }
    for lane in mask.lanes() {
        let value = if from.is_uniform() {
            uniform[from.index()]
        } else {
            varying[from.index()][lane]
        };
        let index = match at {
            At::One(index) => index,
            At::Each(index) => index[lane],
        };
        varying[place.register(index)][lane] = value;
    }
}

#[cfg(test)]
mod tests;
