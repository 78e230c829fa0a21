//! Hands texture operations their operands as blocks of `f32`, and takes the results.

use super::Machine;
use super::kernels::Registers;
use crate::lane::{LANES, Lane, Mask};
use crate::program::code::{Detail, Question, Register, Sample, TexelLoad};
use crate::texture::{self, Floats, Integers, Request};

/// Blocks for operands that are uniform or not `f32`, and for results.
#[derive(Debug)]
pub(super) struct Scratch {
    /// Three coordinates, as many for either gradient, level of detail and depth reference.
    floats: Vec<Box<Floats>>,
    /// Three texel coordinates, layer and level.
    integers: Vec<Box<Integers>>,
    results: Box<[Floats; 4]>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            floats: vec![Box::new([0.0; LANES]); 11],
            integers: vec![Box::new([0; LANES]); 5],
            results: Box::new([[0.0; LANES]; 4]),
        }
    }
}

type Blocks<'a, T> = std::slice::IterMut<'a, Box<[T; LANES]>>;

fn floats<'a, R: Lane>(
    registers: &'a Registers<R>,
    register: Register,
    scratch: &mut Blocks<'a, f32>,
) -> &'a Floats {
    let Some(block) = scratch.next() else {
        return &[0.0; LANES];
    };
    if register.is_uniform() {
        **block = [registers.uniform_floats[register.index()].to_f32(); LANES];
        block
    } else {
        R::floats(&registers.floats[register.index()], block)
    }
}

fn integers<'a, R: Lane>(
    registers: &'a Registers<R>,
    register: Register,
    scratch: &mut Blocks<'a, i32>,
) -> &'a Integers {
    let Some(block) = scratch.next() else {
        return &[0; LANES];
    };
    if register.is_uniform() {
        **block = [registers.uniform_words[register.index()] as i32; LANES];
    } else {
        let words = &registers.words[register.index()];
        for (to, &word) in block.iter_mut().zip(words.iter()) {
            *to = word as i32;
        }
    }
    block
}

/// Up to three blocks, the first standing in for those that are not there.
fn three<'a, T>(mut blocks: impl Iterator<Item = &'a T>, none: &'a T) -> ([&'a T; 3], usize) {
    let mut list = [none; 3];
    let mut count = 0;
    for (to, block) in list.iter_mut().zip(blocks.by_ref()) {
        *to = block;
        count += 1;
    }
    (list, count)
}

impl<R: Lane> Machine<'_, R> {
    pub(super) fn sample(&mut self, sample: &Sample<Register>) {
        let texture = self.textures[sample.texture as usize];
        let sampler = self.samplers[sample.sampler as usize];
        let registers = &self.registers;
        let mut blocks = self.scratch.floats.iter_mut();
        let mut whole = self.scratch.integers.iter_mut();
        let mut list = |values: &[Register]| {
            three(
                values.iter().map(|&v| floats(registers, v, &mut blocks)),
                &[0.0; LANES],
            )
        };
        let (coordinates, count) = list(&sample.coordinates);
        let (x, y) = match &sample.detail {
            Detail::Gradients(x, y) => (list(x), list(y)),
            _ => (list(&[]), list(&[])),
        };
        let detail = match &sample.detail {
            Detail::Implicit(bias) => texture::Detail::Implicit {
                bias: bias.map(|bias| floats(registers, bias, &mut blocks)),
            },
            Detail::Gradients(..) => texture::Detail::Gradients {
                ddx: &x.0[..x.1],
                ddy: &y.0[..y.1],
            },
            Detail::Exact(level) => texture::Detail::Exact(floats(registers, *level, &mut blocks)),
            Detail::Zero => texture::Detail::Zero,
        };
        let request = Request {
            coordinates: &coordinates[..count],
            layer: sample
                .layer
                .map(|layer| integers(registers, layer, &mut whole)),
            offset: sample.offset,
            detail,
            gather: sample.gather,
            reference: sample
                .reference
                .map(|reference| floats(registers, reference, &mut blocks)),
            clamp_to_edge: sample.clamp_to_edge,
        };
        let out = &mut self.scratch.results;
        clear(out, self.mask);
        match self.recall {
            Some(recall) => recall.sample(texture, sampler, &request, self.mask, out),
            None => texture.sample(sampler, &request, self.mask, out),
        }
        self.take_results(&sample.results);
    }

    pub(super) fn texel_load(&mut self, load: &TexelLoad<Register>) {
        let texture = self.textures[load.texture as usize];
        let registers = &self.registers;
        let mut blocks = self.scratch.integers.iter_mut();
        let (coordinates, count) = three(
            load.coordinates
                .iter()
                .map(|&v| integers(registers, v, &mut blocks)),
            &[0; LANES],
        );
        let layer = load.layer.map(|v| integers(registers, v, &mut blocks));
        let level = load.level.map(|v| integers(registers, v, &mut blocks));
        let out = &mut self.scratch.results;
        clear(out, self.mask);
        texture.load(&coordinates[..count], layer, level, self.mask, out);
        self.take_results(&load.results);
    }

    fn take_results(&mut self, results: &[Option<Register>; 4]) {
        for (result, block) in results.iter().zip(self.scratch.results.iter()) {
            if let Some(register) = result {
                let to = &mut self.registers.floats[register.index()];
                for (to, &from) in to.iter_mut().zip(block) {
                    *to = R::from_f32(from);
                }
            }
        }
    }

    pub(super) fn query(
        &mut self,
        results: &[Option<Register>; 3],
        texture: u32,
        question: Question,
        level: Option<Register>,
    ) {
        let texture = self.textures[texture as usize];
        let answer = |level: u32| match question {
            Question::Size => texture.size((level as i32).max(0) as u32),
            Question::Levels => [texture.level_count(), 0, 0],
            Question::Layers => [texture.layers(), 0, 0],
        };
        let r = &mut self.registers;
        // A result may take the level's register.
        let levels = match level {
            Some(level) if !level.is_uniform() => Some(*r.words[level.index()]),
            _ => None,
        };
        for (i, result) in results.iter().enumerate() {
            let Some(to) = *result else {
                continue;
            };
            if let Some(levels) = &levels {
                let to = &mut r.words[to.index()];
                for (to, &level) in to.iter_mut().zip(levels) {
                    *to = answer(level)[i];
                }
            } else {
                let level = level.map_or(0, |level| r.uniform_words[level.index()]);
                r.uniform_words[to.index()] = answer(level)[i];
            }
        }
    }
}

/// Lanes that do not read have 0, not what an earlier read left.
fn clear(out: &mut [Floats; 4], mask: Mask) {
    if mask != Mask::ALL {
        *out = [[0.0; LANES]; 4];
    }
}
