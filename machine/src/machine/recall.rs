//! What a block of fragments has read of textures, kept from one program to the next.
//!
//! Variants of one shader read the same textures at the same places, mostly. A read is found again by all that it is a
//! function of, bit by bit, so that a program gives the same bits with it as without.

use crate::lane::{LANES, Mask};
use crate::texture::{Detail, Floats, Request, Sampler, Texture};
use std::sync::{PoisonError, RwLock};

/// The most reads that are kept of a block; later ones then take the places of the oldest.
const MOST: usize = 32;

/// The texture samples of one block of fragments. To be used with resources that outlive it alone, since it tells
/// textures and samplers by where they are.
#[derive(Debug, Default)]
pub struct Recall(RwLock<Kept>);

#[derive(Debug, Default)]
struct Kept {
    reads: Vec<Read>,
    /// The next one to be replaced.
    oldest: usize,
}

/// A read and what came of it.
#[derive(Debug)]
struct Read {
    kind: Kind,
    operands: Vec<[u32; LANES]>,
    results: [Floats; 4],
}

/// What a read is a function of, but for its operands.
#[derive(Debug, PartialEq)]
struct Kind {
    texture: usize,
    sampler: usize,
    mask: Mask,
    offset: [i32; 3],
    gather: Option<usize>,
    clamp_to_edge: bool,
    /// Which operands there are: how many coordinates and gradients, then a bit for each of the others.
    operands: [usize; 3],
}

impl Kind {
    fn of(texture: &Texture, sampler: &Sampler, request: &Request, mask: Mask) -> Self {
        let (detail, gradients) = match request.detail {
            Detail::Implicit { bias: None } => (0, 0),
            Detail::Implicit { bias: Some(_) } => (1, 0),
            Detail::Gradients { ddx, .. } => (2, ddx.len()),
            Detail::Exact(_) => (3, 0),
            Detail::Zero => (4, 0),
        };
        let [layer, reference] =
            [request.layer.is_some(), request.reference.is_some()].map(usize::from);
        Self {
            texture: std::ptr::from_ref(texture).addr(),
            sampler: std::ptr::from_ref(sampler).addr(),
            mask,
            offset: request.offset,
            gather: request.gather,
            clamp_to_edge: request.clamp_to_edge,
            operands: [
                request.coordinates.len(),
                gradients,
                4 * detail + 2 * layer + reference,
            ],
        }
    }
}

/// The operands of a read, in an order that its kind decides.
fn each_operand<'a>(request: &'a Request) -> impl Iterator<Item = Operand<'a>> {
    let (one, [ddx, ddy]) = match request.detail {
        Detail::Implicit { bias } => (bias, [&[][..]; 2]),
        Detail::Gradients { ddx, ddy } => (None, [ddx, ddy]),
        Detail::Exact(level) => (Some(level), [&[][..]; 2]),
        Detail::Zero => (None, [&[][..]; 2]),
    };
    let lists = [request.coordinates, ddx, ddy];
    let floats = lists.into_iter().flatten().copied();
    let floats = floats.chain(one).chain(request.reference);
    let integers = request.layer.into_iter().map(Operand::Integers);
    floats.map(Operand::Floats).chain(integers)
}

#[derive(Clone, Copy)]
enum Operand<'a> {
    Floats(&'a Floats),
    Integers(&'a [i32; LANES]),
}

impl Operand<'_> {
    fn is(self, words: &[u32; LANES]) -> bool {
        // Without a way out in between, this is a few vector instructions.
        let differ = match self {
            Self::Floats(floats) => {
                let pairs = floats.iter().zip(words);
                pairs.fold(0, |differ, (a, b)| differ | (a.to_bits() ^ b))
            }
            Self::Integers(integers) => {
                let pairs = integers.iter().zip(words);
                pairs.fold(0, |differ, (a, b)| differ | (a.cast_unsigned() ^ b))
            }
        };
        differ == 0
    }

    fn words(self) -> [u32; LANES] {
        match self {
            Self::Floats(floats) => floats.map(f32::to_bits),
            Self::Integers(integers) => integers.map(i32::cast_unsigned),
        }
    }
}

impl Recall {
    /// Samples for the lanes of `mask`, as [`Texture::sample`] does, or remembers what came of it before.
    pub(super) fn sample(
        &self,
        texture: &Texture,
        sampler: &Sampler,
        request: &Request,
        mask: Mask,
        out: &mut [Floats; 4],
    ) {
        let kind = Kind::of(texture, sampler, request, mask);
        {
            // A thread that panicked has left nothing half done: reads are whole before they are kept.
            let kept = self.0.read().unwrap_or_else(PoisonError::into_inner);
            let found = kept.reads.iter().find(|read| {
                read.kind == kind
                    && each_operand(request)
                        .zip(&read.operands)
                        .all(|(a, b)| a.is(b))
            });
            if let Some(read) = found {
                *out = read.results;
                return;
            }
        }
        texture.sample(sampler, request, mask, out);
        let read = Read {
            kind,
            operands: each_operand(request).map(Operand::words).collect(),
            results: *out,
        };
        let mut kept = self.0.write().unwrap_or_else(PoisonError::into_inner);
        let Kept { reads, oldest } = &mut *kept;
        if reads.len() < MOST {
            reads.push(read);
        } else {
            reads[*oldest] = read;
            *oldest = (*oldest + 1) % MOST;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::Dimension;

    #[test]
    fn reads_are_told_apart_by_all_that_they_depend_on() {
        let [one, other] = [1, 2].map(|seed| Texture::placeholder(seed, Dimension::D2, 1));
        let [linear, nearest] = [true, false].map(|linear_magnification| Sampler {
            linear_magnification,
            ..Sampler::default()
        });
        let x: Floats = std::array::from_fn(|lane| lane as f32 * 0.37);
        let y: Floats = x.map(|x| x * 0.3 + 0.1);
        let shifted: Floats = x.map(|x| x + 0.05);
        let plain = [&x, &y];
        let moved = [&shifted, &y];
        let level = [1.5; LANES];
        let implicit = Request::implicit(&plain);
        let requests = [
            implicit,
            Request::implicit(&moved),
            Request {
                detail: Detail::Exact(&level),
                ..implicit
            },
            Request {
                detail: Detail::Implicit { bias: Some(&level) },
                ..implicit
            },
            Request {
                detail: Detail::Zero,
                ..implicit
            },
            Request {
                gather: Some(1),
                ..implicit
            },
            Request {
                offset: [1, 0, 0],
                ..implicit
            },
            Request {
                clamp_to_edge: true,
                ..implicit
            },
        ];
        let half = Mask([u64::MAX, 0, u64::MAX, 0]);
        let recall = Recall::default();
        let mut seen: Vec<[Floats; 4]> = Vec::new();
        for _ in 0..3 {
            for texture in [&one, &other] {
                for sampler in [&linear, &nearest] {
                    for request in &requests {
                        for mask in [Mask::ALL, half] {
                            let mut plain = [[0.0; LANES]; 4];
                            texture.sample(sampler, request, mask, &mut plain);
                            let mut recalled = [[0.0; LANES]; 4];
                            recall.sample(texture, sampler, request, mask, &mut recalled);
                            assert_eq!(plain, recalled);
                            if !seen.contains(&plain) {
                                seen.push(plain);
                            }
                        }
                    }
                }
            }
        }
        // They are more than are kept, and they do differ.
        assert!(seen.len() > MOST, "{}", seen.len());
        let kept = recall.0.read().unwrap_or_else(PoisonError::into_inner);
        assert_eq!(kept.reads.len(), MOST);
    }
}
