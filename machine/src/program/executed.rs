//! What each counted lane executes, by class: the account of a whole program, made once when it is compiled.
//!
//! A walk over the intermediate form. What a block holds belongs to the count at its end. A value that was computed
//! before, in the block or around it, is not computed again, as drivers see to; and what the draw's prologue computes
//! is what every lane executes as uniform values.

use super::code::Detail;
use super::ir::{Id, Ir, NONE, Node};
use super::uniform::Uniformity;
use crate::mix::{Class, Mix};
use crate::texture::{Dimension, Sampler, Texture};
use lodc_passes::semantics::Op;
use naga::DerivativeAxis;
use std::collections::HashMap;

/// What a lane that is counted executes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Executed {
    /// All but texture reads.
    mix: Mix,
    reads: Vec<Read>,
}

/// A read of a texture. What it takes depends on what is bound.
#[derive(Clone, Copy, Debug)]
struct Read {
    texture: u32,
    /// None for a load.
    sampler: Option<u32>,
    /// Whether the MIP level is that of coordinates' differences.
    implicit: bool,
    gradients: bool,
    /// Whether it is one level, the finest.
    finest: bool,
    gather: bool,
}

impl Executed {
    /// With textures and samplers as they are bound, by their places in the program.
    pub(crate) fn mix(&self, textures: &[&Texture], samplers: &[&Sampler]) -> Mix {
        let mut mix = self.mix;
        for read in &self.reads {
            let sampler = read.sampler.map(|sampler| samplers[sampler as usize]);
            read.count(textures[read.texture as usize], sampler, &mut mix);
        }
        mix
    }
}

impl Read {
    fn count(&self, texture: &Texture, sampler: Option<&Sampler>, mix: &mut Mix) {
        mix[Class::Sample] += 1.0;
        let Some(sampler) = sampler else {
            mix[Class::Texel] += 1.0;
            return;
        };
        let cube = texture.dimension() == Dimension::Cube;
        let levels = texture.level_count() > 1 && !self.finest && !self.gather;
        let filtered = sampler.linear_minification || sampler.linear_magnification;
        let of_image = match texture.dimension() {
            _ if self.gather => 4.0,
            _ if !filtered => 1.0,
            Dimension::D2 | Dimension::Cube => 4.0,
            Dimension::D3 => 8.0,
        };
        let images = if levels && sampler.linear_mip {
            2.0
        } else {
            1.0
        };
        mix[Class::Texel] += of_image * images;
        if levels && (self.implicit || self.gradients) {
            mix[Class::Level] += 1.0;
        }
        mix[Class::Gradient] += f64::from(u8::from(self.gradients));
        mix[Class::Cube] += f64::from(u8::from(cube));
    }
}

/// For each count of a program what its lanes execute, and what all lanes do in the prologue.
pub(super) fn executed(ir: &Ir, uniformity: &Uniformity) -> (Vec<Executed>, Mix) {
    let mut walk = Walk {
        uniformity,
        same: (0..ir.values.len() as Id).collect(),
        computed: HashMap::new(),
        order: Vec::new(),
        counts: vec![Executed::default(); ir.work.len()],
        prologue: true,
    };
    let mut prologue = Executed::default();
    for node in &ir.prologue {
        walk.node(node, &mut prologue);
    }
    walk.prologue = false;
    walk.block(&ir.body, Executed::default());
    (walk.counts, prologue.mix)
}

/// What a value is computed from: the kind of node, and what it reads.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Key {
    Op(Op, [Id; 3]),
    Derivative(DerivativeAxis, bool, Id),
    /// Numbers that tell reads of textures apart.
    Read(Vec<u32>),
}

struct Walk<'a> {
    uniformity: &'a Uniformity,
    /// For each value the first one that is the same.
    same: Vec<Id>,
    /// What was computed, in the blocks around this one and before it: the first results.
    computed: HashMap<Key, [Id; 4]>,
    /// Its keys, in the order in which they came.
    order: Vec<Key>,
    counts: Vec<Executed>,
    prologue: bool,
}

impl Walk<'_> {
    /// A block of its own. `carried` is what its first count holds beside it.
    fn block(&mut self, nodes: &[Node], carried: Executed) {
        let before = self.order.len();
        let mut open = carried;
        let mut last: Option<usize> = None;
        for node in nodes {
            if let Node::Count(count) = node {
                let count = *count as usize;
                self.give(count, std::mem::take(&mut open));
                last = Some(count);
                continue;
            }
            self.node(node, &mut open);
            // A branch comes after the count of what is before it.
            if let Some(last) = last {
                self.give(last, std::mem::take(&mut open));
            }
        }
        for key in self.order.drain(before..) {
            self.computed.remove(&key);
        }
    }

    fn give(&mut self, count: usize, more: Executed) {
        let to = &mut self.counts[count];
        to.mix += more.mix;
        to.reads.extend(more.reads);
    }

    fn node(&mut self, node: &Node, open: &mut Executed) {
        match node {
            Node::Op {
                op,
                result,
                operands,
            } => {
                let mut operands = operands.map(|id| self.first(id));
                if matches!(op, Op::Add | Op::Mul | Op::AddWord | Op::MulWord) {
                    operands[..2].sort_unstable();
                }
                if self.is_new(Key::Op(*op, operands), [*result, NONE, NONE, NONE]) {
                    let uniform = self.prologue || !self.varies(*result);
                    open.mix.count(*op, uniform);
                }
            }
            Node::Derivative {
                result,
                value,
                axis,
                coarse,
            } => {
                let key = Key::Derivative(*axis, *coarse, self.first(*value));
                if self.varies(*result) && self.is_new(key, [*result, NONE, NONE, NONE]) {
                    open.mix[Class::Derivative] += 1.0;
                }
            }
            Node::Sample(sample) => {
                let mut key = vec![sample.texture, sample.sampler];
                key.extend(sample.offset.map(i32::cast_unsigned));
                key.push(match &sample.detail {
                    Detail::Implicit(None) => 0,
                    Detail::Implicit(Some(_)) => 1,
                    Detail::Gradients(..) => 2,
                    Detail::Exact(_) => 3,
                    Detail::Zero => 4,
                });
                key.push(sample.gather.map_or(NONE, |component| component as u32));
                key.push(u32::from(sample.clamp_to_edge));
                key.push(u32::from(sample.reference.is_some()));
                sample.operands(|id| key.push(self.first(id)));
                if self.is_new(Key::Read(key), sample.results.map(|r| r.unwrap_or(NONE))) {
                    open.reads.push(Read {
                        texture: sample.texture,
                        sampler: Some(sample.sampler),
                        implicit: matches!(sample.detail, Detail::Implicit(_)),
                        gradients: matches!(sample.detail, Detail::Gradients(..)),
                        finest: matches!(sample.detail, Detail::Zero),
                        gather: sample.gather.is_some(),
                    });
                }
            }
            Node::TexelLoad(load) => {
                let shape =
                    (u32::from(load.layer.is_some()) << 1) | u32::from(load.level.is_some());
                let mut key = vec![load.texture, NONE, shape];
                load.operands(|id| key.push(self.first(id)));
                if self.is_new(Key::Read(key), load.results.map(|r| r.unwrap_or(NONE))) {
                    open.reads.push(Read {
                        texture: load.texture,
                        sampler: None,
                        implicit: false,
                        gradients: false,
                        finest: true,
                        gather: false,
                    });
                }
            }
            Node::If {
                condition,
                accept,
                reject,
            } => {
                if self.varies(*condition) {
                    open.mix[Class::Branch] += 1.0;
                }
                self.block(accept, Executed::default());
                self.block(reject, Executed::default());
            }
            Node::Switch {
                selector, cases, ..
            } => {
                if self.varies(*selector) {
                    open.mix[Class::Branch] += 1.0;
                }
                for case in cases {
                    self.block(&case.body, Executed::default());
                }
            }
            Node::Loop {
                body, continuing, ..
            } => {
                let mut round = Executed::default();
                round.mix[Class::Branch] += 1.0;
                self.block(body, round);
                self.block(continuing, Executed::default());
            }
            Node::Scope { body, .. } => self.block(body, Executed::default()),
            Node::Get { .. }
            | Node::Set { .. }
            | Node::Fetch { .. }
            | Node::Length { .. }
            | Node::Query { .. }
            | Node::Probe { .. }
            | Node::Count(_)
            | Node::Kill
            | Node::Exit(_) => {}
        }
    }

    fn varies(&self, id: Id) -> bool {
        self.uniformity.values[id as usize]
    }

    fn first(&self, id: Id) -> Id {
        match id {
            NONE => NONE,
            id => self.same[id as usize],
        }
    }

    /// Whether something is computed for the first time; if not, its results are those of the first time.
    fn is_new(&mut self, key: Key, results: [Id; 4]) -> bool {
        let Some(first) = self.computed.get(&key) else {
            self.order.push(key.clone());
            self.computed.insert(key, results);
            return true;
        };
        for (result, first) in results.into_iter().zip(first) {
            if result != NONE && *first != NONE {
                self.same[result as usize] = *first;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use crate::lane::{LANES, Mask};
    use crate::machine::{Bindings, Machine, Resource};
    use crate::mix::{Class, Mix};
    use crate::program::Program;
    use crate::texture::{Dimension, Image, Sampler, Texture};
    use std::sync::Arc;

    /// What a lane executes on the mean, of those in which `a.x` is 0, 1, 0, 1, ...
    fn mix(body: &str, sampler: Sampler) -> Mix {
        let source = format!(
            "@group(0) @binding(0) var t: texture_2d<f32>;
             @group(0) @binding(1) var s: sampler;
             @group(0) @binding(2) var c: texture_cube<f32>;
             @group(0) @binding(3) var<uniform> u: vec4f;
             @fragment fn main(@location(0) a: vec3f, @location(1) b: vec3f) -> @location(0) vec4f {{
                {body}
             }}"
        );
        let module = naga::front::wgsl::parse_str(&source).expect("it parses");
        let program = Program::compile(&module, 0, &[]).expect("it runs");
        let image = |side| Image {
            width: side,
            height: side,
            texels: vec![[0.5; 4]; (side * side) as usize],
        };
        let plane = Texture::new(Dimension::D2, vec![image(8)]).expect("it fits");
        let cube = Texture::new(Dimension::Cube, vec![image(8); 6]).expect("it fits");
        let bindings: Bindings = [
            ((0, 0), Resource::Texture(Arc::new(plane.with_mip_chain()))),
            ((0, 1), Resource::Sampler(Arc::new(sampler))),
            ((0, 2), Resource::Texture(Arc::new(cube.with_mip_chain()))),
            ((0, 3), Resource::Buffer(Arc::new(vec![0; 16]))),
        ]
        .into();
        let mut machine = Machine::new(&program, &bindings);
        let mut inputs = vec![[0.25_f32.to_bits(); LANES]; program.inputs().len()];
        for (lane, word) in inputs[0].iter_mut().enumerate() {
            *word = ((lane % 2) as f32).to_bits();
        }
        let mut outputs = vec![[0; LANES]; program.outputs().len()];
        machine.run(&inputs, Mask::ALL, Mask::ALL, &mut outputs);
        let profile = machine.profile();
        profile.mix * (1.0 / profile.lanes as f64)
    }

    fn of(counts: &[(Class, f64)]) -> Mix {
        let mut mix = Mix::default();
        for (class, count) in counts {
            mix[*class] = *count;
        }
        mix
    }

    #[test]
    fn classes_are_told_apart() {
        use Class::*;
        for (body, counts) in [
            ("return vec4(a + b, 1.0);", &[(Float, 3.0)][..]),
            ("return vec4(a / b, a.x);", &[(Division, 3.0)]),
            (
                "return vec4(normalize(a), 1.0);",
                &[(Float, 8.0), (Root, 1.0)],
            ),
            (
                "return vec4(pow(a.x, b.x));",
                &[(Float, 1.0), (Exponential, 2.0)],
            ),
            ("return vec4(sin(a.x));", &[(Trigonometry, 1.0)]),
            ("return vec4(dpdx(a), 1.0);", &[(Derivative, 3.0)]),
            ("return vec4(select(a.x, b.x, a.y < b.y));", &[(Word, 2.0)]),
        ] {
            assert_eq!(mix(body, Sampler::default()), of(counts), "{body}");
        }
    }

    #[test]
    fn what_is_the_same_is_computed_once() {
        let body = "return vec4(normalize(a) * dot(b, normalize(a)), 1.0);";
        assert_eq!(
            mix(body, Sampler::default()),
            of(&[(Class::Float, 16.0), (Class::Root, 1.0)])
        );
        let sampled = mix(
            "return textureSample(t, s, a.xy) * textureSample(t, s, a.xy).x;",
            Sampler::default(),
        );
        assert_eq!(sampled[Class::Sample], 1.0);
        // Of what only one arm computes, the other has nothing.
        let body = "var x = 0.0; if a.x > 0.5 { x = b.x * b.y; } else { x = b.x * b.y + 1.0; } return vec4(x);";
        let arms = mix(body, Sampler::default());
        assert_eq!((arms[Class::Float], arms[Class::Branch]), (1.5, 1.0));
    }

    #[test]
    fn what_is_the_same_for_a_draw_is_uniform() {
        let body = "return vec4(a * normalize(u.xyz), 1.0);";
        assert_eq!(
            mix(body, Sampler::default()),
            of(&[(Class::Float, 3.0), (Class::Uniform, 12.0)])
        );
    }

    #[test]
    fn lanes_that_do_not_run_execute_nothing() {
        let body = "var x = b.x; for (var i = 0.0; i < 4.0 * a.x; i += 1.0) { x = x * b.y; } return vec4(x);";
        let mix = mix(body, Sampler::default());
        // Half of the lanes go four rounds and leave in the fifth, the others in the first; each asks whether to leave.
        assert_eq!(mix[Class::Branch], 2.0 * 3.0);
    }

    #[test]
    fn reads_are_what_the_sampler_makes_of_them() {
        let nearest = Sampler {
            linear_magnification: false,
            linear_minification: false,
            linear_mip: false,
            ..Sampler::default()
        };
        let bilinear = Sampler {
            linear_mip: false,
            ..Sampler::default()
        };
        let implicit = "return textureSample(t, s, a.xy);";
        for (body, sampler, sample, texels, levels, gradients, cubes) in [
            (implicit, Sampler::default(), 1.0, 8.0, 1.0, 0.0, 0.0),
            (implicit, bilinear, 1.0, 4.0, 1.0, 0.0, 0.0),
            (implicit, nearest, 1.0, 1.0, 1.0, 0.0, 0.0),
            (
                "return textureSampleLevel(t, s, a.xy, a.z);",
                Sampler::default(),
                1.0,
                8.0,
                0.0,
                0.0,
                0.0,
            ),
            (
                "return textureSampleGrad(t, s, a.xy, b.xy, b.yz);",
                Sampler::default(),
                1.0,
                8.0,
                1.0,
                1.0,
                0.0,
            ),
            (
                "return textureSample(c, s, a);",
                Sampler::default(),
                1.0,
                8.0,
                1.0,
                0.0,
                1.0,
            ),
            (
                "return textureLoad(t, vec2i(1, 2), 0) * b.x;",
                Sampler::default(),
                1.0,
                1.0,
                0.0,
                0.0,
                0.0,
            ),
        ] {
            let mix = mix(body, sampler);
            let seen = [
                Class::Sample,
                Class::Texel,
                Class::Level,
                Class::Gradient,
                Class::Cube,
            ]
            .map(|class| mix[class]);
            assert_eq!(seen, [sample, texels, levels, gradients, cubes], "{body}");
        }
    }
}
