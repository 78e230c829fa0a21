//! Gives values and slots registers, and writes the code.
//!
//! A linear scan over the text: a value is live from its node to its last reader, or to the end of a loop that
//! reads it and does not compute it. The same register file serves values and slots. Registers are handed
//! out last in, first out, so that a block's working set stays small. Two copies are saved: a value read
//! from a slot that is not written while the value is live is the slot, and a value that is computed right
//! before it is written to a slot is computed in it.

use super::code::{self, Code, Instruction, Register, Step};
use super::ir::{Id, Ir, NONE, Node, SlotId};
use super::uniform::{Homes, Uniformity};
use lodc_passes::semantics::Kind;
use naga::DerivativeAxis;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Writes the code of a program.
pub(super) fn write(ir: &Ir, homes: &Homes, uniformity: &Uniformity) -> Code {
    let mut survey = Survey {
        ir,
        homes,
        masked: &uniformity.masked,
        values: vec![Span::NONE; ir.values.len()],
        slots: vec![Span::NONE; ir.slots.len()],
        gets: vec![Vec::new(); ir.slots.len()],
        sets: vec![Vec::new(); ir.slots.len()],
        computed: vec![0; ir.values.len()],
        in_place: Vec::new(),
        loops: Vec::new(),
        run: 1,
        now: 0,
        next_set: 0,
    };
    for &input in &ir.inputs {
        survey.values[input as usize].start = 0;
    }
    survey.enter();
    survey.block(&ir.body);
    survey.leave();
    for &(output, _) in &ir.outputs {
        survey.read(output);
    }
    let mut writer = Writer {
        ir,
        uniformity,
        registers: vec![None; ir.values.len()],
        slots: vec![None; ir.slots.len()],
        code: Code {
            labels: ir.labels,
            ..Code::default()
        },
        next_set: 0,
    };
    writer.allocate(survey);
    writer.constants();
    writer.code.prologue = ir
        .prologue
        .iter()
        .filter_map(|node| writer.instruction(node, false))
        .collect();
    writer.code.steps = writer.block(&ir.body);
    writer.code.inputs = ir
        .inputs
        .iter()
        .map(|&id| {
            let register = writer.registers[id as usize]?;
            Some((ir.values[id as usize].kind, register))
        })
        .collect();
    writer.code.outputs = ir
        .outputs
        .iter()
        .map(|&(id, kind)| (kind, writer.register(id)))
        .collect();
    writer.code
}

/// From where to where something is live; `end` is a reader's place.
#[derive(Clone, Copy, Debug)]
struct Span {
    start: u32,
    end: u32,
}

impl Span {
    const NONE: Self = Self {
        start: u32::MAX,
        end: 0,
    };

    fn is_none(self) -> bool {
        self.start == u32::MAX
    }

    fn include(&mut self, at: u32) {
        self.start = self.start.min(at);
        self.end = self.end.max(at);
    }
}

/// A loop that the survey is in.
struct Round {
    start: u32,
    /// Values from outside that it reads.
    values: Vec<Id>,
    slots: Vec<SlotId>,
}

/// A value that might be computed in the slot that it is written to.
struct InPlace {
    value: Id,
    slot: SlotId,
    at: u32,
}

/// Finds where everything is live. Its places are numbered as [`Homes`] numbers them.
struct Survey<'a> {
    ir: &'a Ir,
    homes: &'a Homes,
    masked: &'a [bool],
    values: Vec<Span>,
    slots: Vec<Span>,
    /// For each slot: who reads it where.
    gets: Vec<Vec<(u32, Id)>>,
    /// For each slot: where it is written.
    sets: Vec<Vec<u32>>,
    /// For each value the straight run of code that computes it by an operation; 0 for others.
    computed: Vec<u32>,
    in_place: Vec<InPlace>,
    loops: Vec<Round>,
    run: u32,
    now: u32,
    next_set: usize,
}

impl Survey<'_> {
    fn enter(&mut self) {
        self.now += 1;
        self.run += 1;
    }

    fn leave(&mut self) {
        self.now += 1;
        self.run += 1;
    }

    fn read(&mut self, id: Id) {
        let value = &self.ir.values[id as usize];
        if value.invariant {
            return;
        }
        let span = &mut self.values[id as usize];
        span.end = span.end.max(self.now);
        if let Some(round) = self.loops.last_mut()
            && span.start < round.start
        {
            round.values.push(id);
        }
    }

    fn touch(&mut self, slot: SlotId) {
        self.slots[slot as usize].include(self.now);
        if let Some(round) = self.loops.last_mut() {
            round.slots.push(slot);
        }
    }

    fn block(&mut self, nodes: &[Node]) {
        for node in nodes {
            self.now += 1;
            self.node(node);
        }
    }

    fn node(&mut self, node: &Node) {
        let mut operands = Vec::new();
        node.operands(|id| operands.push(id));
        for id in operands {
            self.read(id);
        }
        let (now, run) = (self.now, self.run);
        let operation = matches!(node, Node::Op { .. });
        let (values, computed) = (&mut self.values, &mut self.computed);
        node.results(|id| {
            values[id as usize].include(now);
            if operation {
                computed[id as usize] = run;
            }
        });
        match node {
            Node::Get {
                result,
                slot,
                index,
                ..
            } => {
                self.touch(*slot);
                if index.is_none() {
                    self.gets[*slot as usize].push((self.now, *result));
                }
            }
            Node::Set { slot, value, .. } => {
                self.touch(*slot);
                self.sets[*slot as usize].push(self.now);
                let masked = self.masked[self.next_set];
                self.next_set += 1;
                if self.ir.slots[*slot as usize].len == 1
                    && !masked
                    && self.computed[*value as usize] == self.run
                {
                    self.in_place.push(InPlace {
                        value: *value,
                        slot: *slot,
                        at: self.now,
                    });
                }
            }
            Node::If { accept, reject, .. } => {
                for block in [accept, reject] {
                    self.enter();
                    self.block(block);
                    self.leave();
                }
            }
            Node::Switch { cases, .. } => {
                self.enter();
                for case in cases {
                    self.enter();
                    self.block(&case.body);
                    self.leave();
                }
                self.leave();
            }
            Node::Loop {
                body,
                continuing,
                break_if,
                ..
            } => {
                self.loops.push(Round {
                    start: self.now,
                    values: Vec::new(),
                    slots: Vec::new(),
                });
                let start = self.now;
                self.enter();
                self.enter();
                self.block(body);
                self.leave();
                self.enter();
                self.block(continuing);
                self.leave();
                if let Some(condition) = break_if {
                    self.read(*condition);
                }
                self.leave();
                self.end_loop(start);
            }
            Node::Scope { body, .. } => {
                self.enter();
                self.block(body);
                self.leave();
            }
            _ => {}
        }
    }

    /// What a loop reads and does not compute lives to its end, and so does what it hands from one round to
    /// the next.
    fn end_loop(&mut self, start: u32) {
        let Some(round) = self.loops.pop() else {
            return;
        };
        for id in round.values {
            let span = &mut self.values[id as usize];
            span.end = span.end.max(self.now);
            if let Some(outer) = self.loops.last_mut()
                && span.start < outer.start
            {
                outer.values.push(id);
            }
        }
        for slot in round.slots {
            let (home_start, home_end) = self.homes.range(slot);
            let holds_home = start < home_start && home_end < self.now;
            if !holds_home {
                let span = &mut self.slots[slot as usize];
                span.include(start);
                span.include(self.now);
            }
            if let Some(outer) = self.loops.last_mut() {
                outer.slots.push(slot);
            }
        }
    }
}

/// Something that needs a register.
#[derive(Clone, Copy)]
enum Owner {
    Value(Id),
    Slot(SlotId),
}

struct Writer<'a> {
    ir: &'a Ir,
    uniformity: &'a Uniformity,
    registers: Vec<Option<Register>>,
    /// The first register of each slot.
    slots: Vec<Option<Register>>,
    code: Code,
    next_set: usize,
}

/// Which of the four files a kind and a uniformity mean.
fn file(kind: Kind, varies: bool) -> usize {
    match (varies, kind) {
        (true, Kind::F) => 0,
        (true, Kind::W) => 1,
        (false, Kind::F) => 2,
        (false, Kind::W) => 3,
    }
}

impl Writer<'_> {
    fn varies(&self, id: Id) -> bool {
        self.uniformity.values[id as usize]
    }

    /// A register that is never given back.
    fn permanent(&mut self, kind: Kind, varies: bool, count: u32) -> Register {
        let file = file(kind, varies);
        let first = self.code.registers[file];
        self.code.registers[file] += count;
        register(varies, first)
    }

    fn allocate(&mut self, mut survey: Survey) {
        // Which slot a value shares the register of, and for each slot when values do.
        let mut residents: Vec<Vec<Span>> = vec![Vec::new(); self.ir.slots.len()];
        let mut shared: Vec<Option<SlotId>> = vec![None; self.ir.values.len()];
        for (slot, resident) in residents.iter_mut().enumerate() {
            let info = self.ir.slots[slot];
            if info.len != 1 {
                continue;
            }
            let sets = &survey.sets[slot];
            for &(at, value) in &survey.gets[slot] {
                let end = survey.values[value as usize].end;
                // The kinds of uniformity agree: a value read from a slot varies as the slot does.
                if !written(sets, at, end) {
                    shared[value as usize] = Some(slot as SlotId);
                    survey.slots[slot].include(end);
                    resident.push(Span { start: at, end });
                }
            }
        }
        for InPlace { value, slot, at } in std::mem::take(&mut survey.in_place) {
            let (v, s) = (value as usize, slot as usize);
            let span = survey.values[v];
            let same = self.uniformity.values[v] == self.uniformity.slots[s];
            let start = span.start;
            let read_between = survey.gets[s]
                .iter()
                .any(|&(get, _)| get > start && get < at)
                || residents[s]
                    .iter()
                    .any(|resident| resident.start < start && resident.end > start);
            if shared[v].is_none()
                && same
                && !read_between
                && !written(&survey.sets[s], start.saturating_sub(1), at - 1)
                && !written(&survey.sets[s], at, span.end)
            {
                shared[v] = Some(slot);
                survey.slots[s].include(start);
                survey.slots[s].include(span.end);
                residents[s].push(span);
            }
        }

        let mut owners = Vec::new();
        for (id, span) in survey.values.iter().enumerate() {
            // An input that nobody reads ends where it starts.
            if !span.is_none() && span.end > 0 && shared[id].is_none() {
                owners.push((*span, Owner::Value(id as Id)));
            }
        }
        for (slot, span) in survey.slots.iter().enumerate() {
            let info = self.ir.slots[slot];
            if info.len == 1 {
                if !span.is_none() {
                    owners.push((*span, Owner::Slot(slot as SlotId)));
                }
            } else {
                let varies = self.uniformity.slots[slot];
                self.slots[slot] = Some(self.permanent(info.kind, varies, info.len));
            }
        }
        owners.sort_by_key(|(span, _)| span.start);
        let mut free: [Vec<u32>; 4] = Default::default();
        let mut live: [BinaryHeap<Reverse<(u32, u32)>>; 4] = Default::default();
        for (span, owner) in owners {
            let (kind, varies) = match owner {
                Owner::Value(id) => (self.ir.values[id as usize].kind, self.varies(id)),
                Owner::Slot(slot) => (
                    self.ir.slots[slot as usize].kind,
                    self.uniformity.slots[slot as usize],
                ),
            };
            let file = file(kind, varies);
            while let Some(&Reverse((end, register))) = live[file].peek()
                && end <= span.start
            {
                free[file].push(register);
                live[file].pop();
            }
            let index = free[file].pop().unwrap_or_else(|| {
                self.code.registers[file] += 1;
                self.code.registers[file] - 1
            });
            live[file].push(Reverse((span.end, index)));
            let register = register(varies, index);
            match owner {
                Owner::Value(id) => self.registers[id as usize] = Some(register),
                Owner::Slot(slot) => self.slots[slot as usize] = Some(register),
            }
        }
        for (id, slot) in shared.iter().enumerate() {
            if let Some(slot) = slot {
                self.registers[id] = self.slots[*slot as usize];
            }
        }
    }

    /// Registers for what is the same for a whole draw: they are written once and stay.
    fn constants(&mut self) {
        let mut used = vec![false; self.ir.values.len()];
        mark(&self.ir.body, &mut used);
        mark(&self.ir.prologue, &mut used);
        for &(output, _) in &self.ir.outputs {
            used[output as usize] = true;
        }
        for (id, value) in self.ir.values.iter().enumerate() {
            if !value.invariant || !used[id] {
                continue;
            }
            let register = self.permanent(value.kind, false, 1);
            self.registers[id] = Some(register);
            if let Some(bits) = value.constant {
                self.code.constants.push((value.kind, register, bits));
            }
        }
    }

    fn register(&self, id: Id) -> Register {
        if id == NONE {
            return Register::NONE;
        }
        self.registers[id as usize].unwrap_or(Register::NONE)
    }

    fn slot(&self, slot: SlotId) -> Register {
        self.slots[slot as usize].unwrap_or(Register::NONE)
    }

    fn block(&mut self, nodes: &[Node]) -> Vec<Step> {
        let mut steps = Vec::new();
        let mut start = self.code.instructions.len();
        for node in nodes {
            let mut masked = false;
            if let Node::Set { .. } = node {
                masked = self.uniformity.masked[self.next_set];
                self.next_set += 1;
            }
            if let Some(instruction) = self.instruction(node, masked) {
                self.code.instructions.push(instruction);
            }
            let end = self.code.instructions.len();
            let Some(step) = self.step(node) else {
                continue;
            };
            if end > start {
                steps.push(Step::Run(start..end));
            }
            steps.push(step);
            start = self.code.instructions.len();
        }
        let end = self.code.instructions.len();
        if end > start {
            steps.push(Step::Run(start..end));
        }
        steps
    }

    fn step(&mut self, node: &Node) -> Option<Step> {
        Some(match node {
            Node::Kill => Step::Kill,
            Node::Exit(label) => Step::Exit(*label),
            Node::If {
                condition,
                accept,
                reject,
            } => Step::If {
                condition: self.register(*condition),
                accept: self.block(accept),
                reject: self.block(reject),
            },
            Node::Switch {
                selector,
                label,
                cases,
            } => Step::Switch {
                selector: self.register(*selector),
                label: *label,
                cases: cases
                    .iter()
                    .map(|case| code::Case {
                        value: case.value,
                        body: self.block(&case.body),
                        fall_through: case.fall_through,
                    })
                    .collect(),
            },
            Node::Loop {
                label,
                next,
                body,
                continuing,
                break_if,
            } => Step::Loop {
                label: *label,
                next: *next,
                body: self.block(body),
                continuing: self.block(continuing),
                break_if: break_if.map(|condition| self.register(condition)),
            },
            Node::Scope { label, body } => Step::Scope {
                label: *label,
                body: self.block(body),
            },
            _ => return None,
        })
    }

    /// The instruction for a node that has one; `masked` is for writes.
    fn instruction(&self, node: &Node, masked: bool) -> Option<Instruction> {
        Some(match node {
            Node::Op {
                op,
                result,
                operands,
            } => Instruction::Op {
                op: *op,
                to: self.register(*result),
                operands: operands.map(|id| self.register(id)),
                origin: self.ir.values[*result as usize].origin,
            },
            Node::Get {
                result,
                slot,
                index,
                offset,
            } => {
                let info = self.ir.slots[*slot as usize];
                let (to, base) = (self.register(*result), self.slot(*slot));
                if info.len == 1 {
                    if to == base {
                        return None;
                    }
                    Instruction::Copy {
                        kind: info.kind,
                        to,
                        from: base,
                        masked: false,
                    }
                } else {
                    Instruction::Get {
                        kind: info.kind,
                        to,
                        base,
                        len: info.len,
                        index: index.map_or(Register::NONE, |id| self.register(id)),
                        offset: *offset,
                    }
                }
            }
            Node::Set {
                slot,
                index,
                offset,
                value,
            } => {
                let info = self.ir.slots[*slot as usize];
                let (base, from) = (self.slot(*slot), self.register(*value));
                if info.len == 1 {
                    if from == base {
                        return None;
                    }
                    Instruction::Copy {
                        kind: info.kind,
                        to: base,
                        from,
                        masked,
                    }
                } else {
                    Instruction::Set {
                        kind: info.kind,
                        base,
                        len: info.len,
                        index: index.map_or(Register::NONE, |id| self.register(id)),
                        offset: *offset,
                        from,
                        masked,
                    }
                }
            }
            Node::Fetch {
                result,
                buffer,
                index,
                offset,
            } => Instruction::Fetch {
                kind: self.ir.values[*result as usize].kind,
                to: self.register(*result),
                buffer: *buffer,
                index: index.map_or(Register::NONE, |id| self.register(id)),
                offset: *offset,
            },
            Node::Length {
                result,
                buffer,
                offset,
                stride,
            } => Instruction::Length {
                to: self.register(*result),
                buffer: *buffer,
                offset: *offset,
                stride: *stride,
            },
            Node::Derivative {
                result,
                value,
                axis,
                coarse,
            } => Instruction::Derivative {
                to: self.register(*result),
                from: self.register(*value),
                down: *axis == DerivativeAxis::Y,
                coarse: *coarse,
            },
            Node::Sample(sample) => {
                Instruction::Sample(Box::new(sample.map(|id| self.register(id))))
            }
            Node::TexelLoad(load) => {
                Instruction::TexelLoad(Box::new(load.map(|id| self.register(id))))
            }
            Node::Query {
                results,
                texture,
                question,
                level,
            } => Instruction::Query {
                results: results.map(|r| r.map(|id| self.register(id))),
                texture: *texture,
                question: *question,
                level: level.map(|id| self.register(id)),
            },
            Node::Probe { probe, values } => Instruction::Probe {
                probe: *probe,
                values: values.iter().map(|&id| self.register(id)).collect(),
            },
            Node::Count(count) => Instruction::Count(*count),
            _ => return None,
        })
    }
}

fn register(varies: bool, index: u32) -> Register {
    if varies {
        Register::varying(index)
    } else {
        Register::uniform(index)
    }
}

/// Whether one of these places lies after `after` and up to `until`.
fn written(sets: &[u32], after: u32, until: u32) -> bool {
    let first = sets.partition_point(|&at| at <= after);
    sets.get(first).is_some_and(|&at| at <= until)
}

fn mark(nodes: &[Node], used: &mut [bool]) {
    for node in nodes {
        node.operands(|id| used[id as usize] = true);
        node.results(|id| used[id as usize] = true);
        match node {
            Node::If { accept, reject, .. } => {
                mark(accept, used);
                mark(reject, used);
            }
            Node::Switch { cases, .. } => {
                for case in cases {
                    mark(&case.body, used);
                }
            }
            Node::Loop {
                body,
                continuing,
                break_if,
                ..
            } => {
                mark(body, used);
                mark(continuing, used);
                if let Some(condition) = break_if {
                    used[*condition as usize] = true;
                }
            }
            Node::Scope { body, .. } => mark(body, used),
            _ => {}
        }
    }
}
