//! What the opacity of a fragment is made of: the values that become its alpha, or decide whether it is discarded, by
//! arithmetic alone.
//!
//! What only leads there in another way (where a texture is read whose alpha is the fragment's, say) is left out: its
//! mean has nothing to do with how much of the fragment is seen.

use super::ir::{Id, Ir, Node};
use std::collections::BTreeSet;

/// The parts of a program that its fragments' opacity is made of.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Opacity {
    /// For each probe, whether each of its components is such a part.
    pub probes: Vec<Vec<bool>>,
    /// The same for each probe of a value beside an operand, by the value's components.
    pub pairs: Vec<Vec<bool>>,
    /// The textures whose alpha is such a part: group and binding.
    pub textures: BTreeSet<(u32, u32)>,
}

impl Opacity {
    /// Finds them, from the outputs that are alpha or a sample mask, and from what decides about a discard.
    pub(super) fn of(ir: &Ir, outputs: impl IntoIterator<Item = Id>) -> Self {
        let mut search = Search {
            values: vec![false; ir.values.len()],
            slots: vec![false; ir.slots.len()],
            found: 0,
        };
        for output in outputs {
            search.value(output);
        }
        // Slots are read before they are written in loops, so that one round does not always see all.
        loop {
            let before = search.found;
            search.block(&ir.body);
            search.block(&ir.prologue);
            if search.found == before {
                break;
            }
        }
        let mut opacity = Self {
            probes: vec![Vec::new(); ir.probes.len()],
            pairs: vec![Vec::new(); ir.pairs.len()],
            textures: BTreeSet::new(),
        };
        for nodes in [&ir.prologue, &ir.body] {
            collect(nodes, ir, &search.values, &mut opacity);
        }
        opacity
    }
}

/// Gathers what is known of probes and textures.
fn collect(nodes: &[Node], ir: &Ir, parts: &[bool], opacity: &mut Opacity) {
    let is_part = |id: &Id| parts.get(*id as usize).copied().unwrap_or(false);
    for node in nodes {
        match node {
            Node::Probe { probe, values } => {
                let probe = *probe as usize;
                match probe.checked_sub(ir.probes.len()) {
                    None => opacity.probes[probe] = values.iter().map(is_part).collect(),
                    // Value and operand take turns.
                    Some(pair) => {
                        let values = values.iter().step_by(2);
                        opacity.pairs[pair] = values.map(is_part).collect();
                    }
                }
            }
            Node::Sample(sample)
                if sample.gather.is_none() && sample.results[3].as_ref().is_some_and(is_part) =>
            {
                let texture = ir.textures[sample.texture as usize];
                opacity.textures.insert(texture);
            }
            Node::TexelLoad(load) if load.results[3].as_ref().is_some_and(is_part) => {
                opacity.textures.insert(ir.textures[load.texture as usize]);
            }
            _ => {}
        }
        inside(node, |nodes| collect(nodes, ir, parts, opacity));
    }
}

/// Calls `visit` with each block inside a node.
fn inside(node: &Node, mut visit: impl FnMut(&[Node])) {
    match node {
        Node::If { accept, reject, .. } => {
            visit(accept);
            visit(reject);
        }
        Node::Switch { cases, .. } => cases.iter().for_each(|case| visit(&case.body)),
        Node::Loop {
            body, continuing, ..
        } => {
            visit(body);
            visit(continuing);
        }
        Node::Scope { body, .. } => visit(body),
        _ => {}
    }
}

struct Search {
    values: Vec<bool>,
    slots: Vec<bool>,
    /// How many of both are parts.
    found: usize,
}

impl Search {
    fn value(&mut self, id: Id) {
        // An operand that is not there has no place.
        if let Some(part) = self.values.get_mut(id as usize) {
            self.found += usize::from(!std::mem::replace(part, true));
        }
    }

    /// Goes from results to what they are made of. Says whether a lane may be discarded in the block.
    fn block(&mut self, nodes: &[Node]) -> bool {
        let mut discards = false;
        for node in nodes.iter().rev() {
            match node {
                Node::Kill => discards = true,
                Node::Op {
                    result, operands, ..
                } if self.values[*result as usize] => {
                    operands.iter().for_each(|operand| self.value(*operand));
                }
                Node::Get { result, slot, .. } if self.values[*result as usize] => {
                    let part = &mut self.slots[*slot as usize];
                    self.found += usize::from(!std::mem::replace(part, true));
                }
                Node::Set { slot, value, .. } if self.slots[*slot as usize] => self.value(*value),
                _ => {
                    let mut within = false;
                    inside(node, |nodes| within |= self.block(nodes));
                    match node {
                        Node::If { condition, .. } if within => self.value(*condition),
                        Node::Switch { selector, .. } if within => self.value(*selector),
                        _ => {}
                    }
                    discards |= within;
                }
            }
        }
        discards
    }
}

#[cfg(test)]
mod tests {
    use crate::program::Program;
    use naga::Expression;

    /// Which components of each named value are parts of the opacity, and the bindings of textures whose alpha is.
    fn opacity(body: &str, blended: bool) -> (Vec<(String, Vec<bool>)>, Vec<u32>) {
        let source = format!(
            "@group(0) @binding(0) var one: texture_2d<f32>;
             @group(0) @binding(1) var two: texture_2d<f32>;
             @group(0) @binding(2) var smooth_sampler: sampler;
             @fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {{ {body} }}"
        );
        let module = naga::front::wgsl::parse_str(&source).expect("it is valid");
        let function = &module.entry_points[0].function;
        let named = function.named_expressions.iter();
        let named: Vec<_> = named
            .filter(|(value, _)| {
                !matches!(
                    function.expressions[**value],
                    Expression::FunctionArgument(_)
                )
            })
            .map(|(value, name)| (*value, name.clone()))
            .collect();
        let probes: Vec<_> = named.iter().map(|(value, _)| *value).collect();
        let found = Program::opacity(&module, 0, &probes, &[], blended).expect("it is run");
        let names = named.into_iter().map(|(_, name)| name);
        (
            names.zip(found.probes).collect(),
            found
                .textures
                .into_iter()
                .map(|(_, binding)| binding)
                .collect(),
        )
    }

    const BLENDED: &str = "
        let paint = textureSample(one, smooth_sampler, uv);
        let dust = textureSample(two, smooth_sampler, paint.xy);
        var cover = paint.a * 0.5;
        if uv.x > 0.5 { cover = max(cover, dust.x); }
        let light = dot(paint.rgb, dust.rgb);
        return vec4f(paint.rgb * light, cover);";

    #[test]
    fn alpha_is_traced_through_arithmetic_and_variables() {
        let (named, textures) = opacity(BLENDED, true);
        let named: Vec<_> = named
            .iter()
            .map(|(name, parts)| (name.as_str(), &parts[..]))
            .collect();
        assert_eq!(
            named,
            [
                ("paint", &[false, false, false, true][..]),
                ("dust", &[true, false, false, false][..]),
                ("light", &[false][..]),
            ]
        );
        // Of the second texture it is not the alpha.
        assert_eq!(textures, [0]);
        let (named, textures) = opacity(BLENDED, false);
        assert!(named.iter().all(|(_, parts)| !parts.contains(&true)));
        assert!(textures.is_empty());
    }

    #[test]
    fn what_decides_about_a_discard_is_opacity() {
        let cut = "
            let paint = textureSample(one, smooth_sampler, uv);
            let limit = uv.y * 0.25;
            for (var i = 0; i < 2; i++) { if paint.a < limit { discard; } }
            return vec4f(paint.rgb, 1.0);";
        for blended in [false, true] {
            let (named, textures) = opacity(cut, blended);
            assert_eq!(named[0].1, [false, false, false, true]);
            assert_eq!(named[1].1, [true]);
            assert_eq!(textures, [0]);
        }
    }
}
