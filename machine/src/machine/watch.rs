//! Shows each operation to somebody while it is done: what it is of, its operands, its result, which may be changed.
//!
//! Nothing of it is met when nobody watches.

use super::kernels::{self, Registers};
use super::{Instruction, Machine};
use crate::lane::{LANES, Lane, Mask, Words};
use crate::program::code::Register;
use lodc_passes::semantics::{Kind, Op, Real};

/// Sees the operations of a machine, in the order in which they are done.
pub trait Watcher<R>: std::fmt::Debug {
    /// An operation was done. `origin` is the place of its expression in the entry point's function, `u32::MAX` when it is of
    /// none; `lanes` are those that it counts for, nothing when it is the same for a whole draw, and then the first lane holds
    /// it. `operands` are in their order; one that is a word is there as the unsigned number that it is.
    fn done(
        &mut self,
        op: Op,
        origin: u32,
        lanes: Option<Mask>,
        operands: &[[R; LANES]],
        outcome: Outcome<'_, R>,
    );
}

/// What an operation gave.
#[derive(Debug)]
pub enum Outcome<'a, R> {
    /// Floats.
    Floats(&'a mut [R; LANES]),
    /// Words.
    Words(&'a Words),
}

impl<R: Lane> Machine<'_, R> {
    /// Does instructions, and shows each operation to the watcher.
    pub(super) fn watched_instructions(&mut self, instructions: &[Instruction]) {
        for instruction in instructions {
            let Instruction::Op {
                op,
                to,
                operands,
                origin,
            } = *instruction
            else {
                self.plain_instructions(std::slice::from_ref(instruction));
                continue;
            };
            let (kinds, result) = op.signature();
            // What an operation reads may be where it writes.
            let mut before = [[R::default(); LANES]; 3];
            for ((before, kind), operand) in before.iter_mut().zip(kinds).zip(operands) {
                *before = match kind {
                    Kind::F => float(&self.registers, operand),
                    Kind::W => word(&self.registers, operand),
                };
            }
            let before = &before[..kinds.len()];
            let lanes = (!to.is_uniform()).then(|| self.counted());
            match to.is_uniform() {
                true => kernels::once(&mut self.registers, op, to, operands),
                false => R::apply(self.vectors, &mut self.registers, op, to, operands),
            }
            let Some(watcher) = &mut self.watcher else {
                continue;
            };
            let registers = &mut self.registers;
            match (result, to.is_uniform()) {
                (Kind::F, false) => {
                    let floats = Outcome::Floats(&mut registers.floats[to.index()]);
                    watcher.done(op, origin, lanes, before, floats);
                }
                (Kind::F, true) => {
                    let one = &mut registers.uniform_floats[to.index()];
                    let mut block = [*one; LANES];
                    watcher.done(op, origin, lanes, before, Outcome::Floats(&mut block));
                    *one = block[0];
                }
                (Kind::W, false) => {
                    let words = Outcome::Words(&registers.words[to.index()]);
                    watcher.done(op, origin, lanes, before, words);
                }
                (Kind::W, true) => {
                    let block = [registers.uniform_words[to.index()]; LANES];
                    watcher.done(op, origin, lanes, before, Outcome::Words(&block));
                }
            }
        }
    }
}

/// What a register of floats holds, for each lane.
fn float<R: Copy>(registers: &Registers<R>, register: Register) -> [R; LANES] {
    match register.is_uniform() {
        true => [registers.uniform_floats[register.index()]; LANES],
        false => *registers.floats[register.index()],
    }
}

/// The same of a register of words.
fn word<R: Real>(registers: &Registers<R>, register: Register) -> [R; LANES] {
    match register.is_uniform() {
        true => [R::from_u32(registers.uniform_words[register.index()]); LANES],
        false => std::array::from_fn(|lane| R::from_u32(registers.words[register.index()][lane])),
    }
}
