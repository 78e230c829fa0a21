//! Textures that passes make: what computes their texels, and where they are bound.
//!
//! ```text
//! bake: (coordinates, level of each read) -> texel      a fragment stage without anything else
//! var loctx_0_silk: texture_2d<f32>                     the variant samples it where it computed the texel
//! ```
//!
//! The texels are in no candidate: they follow from the variant and from the images that it reads, so that whoever has
//! those makes the same texture again.

use crate::fingerprint::Words;
use crate::shader::{Fingerprint, Shader, Stage};
use naga::{Expression, GlobalVariable, Handle};
use std::hash::{Hash, Hasher};
use std::sync::Arc;

/// The location at which a bake takes the coordinates of a texel; the level of each read follows, and the layer.
pub const COORDINATES: u32 = 0;

/// A texture that a pass has made.
#[derive(Clone, Debug)]
pub struct Generated {
    /// The group and binding of its variable.
    pub binding: (u32, u32),
    /// Whether it is a cube map, so that its coordinates are a direction.
    pub is_cube: bool,
    /// Whether it is an array, with as many layers as the arrays among its sources that are read in the same layer.
    pub is_array: bool,
    /// A shader whose fragment stage returns a texel at location 0 as a vector of four. Its inputs are the coordinates at
    /// location [`COORDINATES`], behind that a float for each of `reads`, the MIP level that it reads, and behind these the
    /// layer, an integer, of an array.
    pub bake: Arc<Shader>,
    /// The samples in the bake.
    pub reads: Vec<Read>,
    /// How many texels each edge has of what has no sources. With sources it has as many as the finest of them, halved until
    /// the longest edge has no more than this; `None` for no such end.
    pub edge: Option<u32>,
    /// How many numbers of a texel are used, 1 to 4; of fewer than four the last one is 1.
    pub components: usize,
}

/// A texture sample in a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Read {
    /// The group and binding of the texture.
    pub binding: (u32, u32),
    /// How often the texture repeats along each axis, over the part of it that is baked.
    pub repeats: [f32; 2],
    /// Whether it is an array that is read in the layer of the texel.
    pub is_layered: bool,
}

impl Generated {
    /// What tells it from other textures: all that its texels follow from, but for the images.
    pub fn definition(&self) -> Fingerprint {
        let mut words = Words::new();
        self.hash_into(&mut words);
        Fingerprint(words.bytes16())
    }

    fn hash_into(&self, words: &mut Words) {
        self.bake.fingerprint().0.hash(words);
        words.write_usize(self.components);
        self.edge.hash(words);
        for read in &self.reads {
            read.binding.hash(words);
            read.repeats.map(f32::to_bits).hash(words);
        }
    }
}

impl Shader {
    /// The generated textures that its stages read, with their variables, in the order in which they were made.
    pub fn generated(&self) -> Vec<(Handle<GlobalVariable>, &Generated)> {
        if self.generated.is_empty() {
            return Vec::new();
        }
        let mut read = vec![false; self.module.global_variables.len()];
        for point in &self.module.entry_points {
            for (_, expression) in point.function.expressions.iter() {
                if let Expression::GlobalVariable(variable) = expression {
                    read[variable.index()] = true;
                }
            }
        }
        let variables = self.module.global_variables.iter();
        let variables: Vec<_> = variables.filter(|(v, _)| read[v.index()]).collect();
        let all = self.generated.iter();
        all.filter_map(|generated| {
            let (variable, _) = variables.iter().find(|(_, declared)| {
                let at = declared.binding.map(|at| (at.group, at.binding));
                at == Some(generated.binding)
            })?;
            Some((*variable, generated))
        })
        .collect()
    }

    /// All textures that were made on the way to this variant, read or not, in the order in which they were made.
    pub fn made(&self) -> impl Iterator<Item = &Generated> {
        self.generated.iter()
    }

    /// How many textures of its own images and generated ones its fragment stage samples.
    pub fn sampled_textures(&self) -> usize {
        let Some(function) = self.function(Stage::Fragment) else {
            return 0;
        };
        let values = function.expressions.iter();
        let mut sampled: Vec<_> = values
            .filter_map(|(_, expression)| match *expression {
                Expression::GlobalVariable(variable) => {
                    let ty = self.module.global_variables[variable].ty;
                    let is_image = matches!(
                        self.module.types[ty].inner,
                        naga::TypeInner::Image { .. } | naga::TypeInner::BindingArray { .. }
                    );
                    is_image.then_some(variable)
                }
                _ => None,
            })
            .collect();
        sampled.sort_unstable();
        sampled.dedup();
        sampled.len()
    }

    /// The same shader with its generated textures under other names, at other bindings: for each that it reads a name and
    /// a binding, in the order of [`Shader::generated`].
    #[must_use]
    pub fn with_generated_at(&self, places: &[(String, (u32, u32))]) -> Self {
        let read: Vec<_> = self.generated().into_iter().map(|(v, _)| v).collect();
        let mut shader = self.clone();
        let mut generated = Vec::new();
        // What is not read any more has no name, so that nothing is taken for it.
        for (variable, declared) in shader.module.global_variables.iter_mut() {
            let at = declared.binding.map(|at| (at.group, at.binding));
            let mut made = self.generated.iter();
            if made.any(|one| Some(one.binding) == at) && !read.contains(&variable) {
                declared.name = None;
            }
        }
        for (variable, (name, binding)) in read.iter().zip(places) {
            let declared = &mut shader.module.global_variables[*variable];
            let before = declared.binding.map(|at| (at.group, at.binding));
            declared.name = Some(name.clone());
            let (group, binding) = *binding;
            declared.binding = Some(naga::ResourceBinding { group, binding });
            let own = self.generated.iter();
            let mut own = own.filter(|own| Some(own.binding) == before);
            generated.extend(own.next().cloned().map(|own| Generated {
                binding: (group, binding),
                ..own
            }));
        }
        shader.generated = generated;
        shader
    }
}

/// Gives the textures that were made their bindings in an order that does not depend on the one in which they were made,
/// so that two orders of the same edits make the same shader.
pub(crate) fn settled(mut shader: Shader) -> Shader {
    let mut ordered = std::mem::take(&mut shader.generated);
    let before: Vec<(u32, u32)> = ordered.iter().map(|made| made.binding).collect();
    let mut free = before.clone();
    free.sort_unstable();
    ordered.sort_by_key(|made| (made.binding.0, made.definition().0));
    let variables = shader.module.global_variables.iter();
    let variables: Vec<_> = variables
        .filter_map(|(variable, declared)| {
            let at = declared.binding.map(|at| (at.group, at.binding))?;
            before.contains(&at).then_some((variable, at))
        })
        .collect();
    for (made, now) in ordered.iter_mut().zip(free) {
        let (group, binding) = now;
        let mut own = variables.iter().filter(|(_, at)| *at == made.binding);
        if let Some((variable, _)) = own.next() {
            let binding = Some(naga::ResourceBinding { group, binding });
            shader.module.global_variables[*variable].binding = binding;
        }
        made.binding = now;
    }
    shader.generated = ordered;
    shader
}

/// The identity of a shader, or of a stage of it, with that of the textures that were made for it.
pub(crate) fn told_apart(shader: &Shader, known: Fingerprint) -> Fingerprint {
    let generated = shader.generated();
    if generated.is_empty() {
        return known;
    }
    let mut words = Words::new();
    known.0.hash(&mut words);
    for (_, one) in generated {
        one.binding.hash(&mut words);
        one.hash_into(&mut words);
    }
    Fingerprint(words.bytes16())
}
