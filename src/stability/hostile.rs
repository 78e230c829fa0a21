//! Hostile inputs: NaN and infinities in what vertices hold and in uniforms that may be anything.
//!
//! They are told of and decide nothing: WGSL lets implementations assume that there are none, so that what one makes of
//! them says little of another.

use super::inputs::Group;
use super::run::Subject;
use super::{Battery, Exhibit, Inputs};
use crate::eval::program::Refused;
use crate::eval::programs::Programs;
use crate::eval::rough::Arithmetic;
use lodc_passes::Shader;

/// What such a number is.
const WORST: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
/// Groups of declared inputs that are spoiled, and uniforms.
const SPOILED: usize = 2;
const UNIFORMS: usize = 4;

/// What becomes of hostile inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hostile {
    /// How many there were.
    pub inputs: u64,
    /// On how many of them what is returned is finite nevertheless.
    pub held: u64,
    /// On how many it is not, though the original's is.
    pub lost: u64,
}

impl Hostile {
    /// In a line.
    pub fn says(&self) -> String {
        let Self { inputs, held, lost } = *self;
        let text = format!("finite on {held} of {inputs} inputs with NaN or infinities");
        match lost {
            0 => text,
            _ => format!("{text}; on {lost} the original is and it is not"),
        }
    }
}

impl Battery<'_> {
    /// What a shader returns where inputs are NaN or infinite.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn hostile_inputs(&self, shader: &Shader) -> Result<Hostile, Refused> {
        let subject = Subject::new(Programs::of(shader)?);
        let mut hostile = Hostile::default();
        for group in self.spoiled() {
            let exhibit = Exhibit {
                frame: self.interface.frame(&group),
                inputs: Inputs::Made(group),
                hostile: Vec::new(),
                original: Vec::new(),
            };
            let original = self.run(&self.original, &exhibit, Arithmetic::OWN);
            let own = self.run(&subject, &exhibit, Arithmetic::OWN);
            hostile.inputs += own.lanes;
            hostile.held += own.lanes - own.count();
            hostile.lost += own.or(&original).count() - original.count();
        }
        Ok(hostile)
    }

    /// Declared inputs with one number of each quad spoiled, in one corner or in all, or with a uniform.
    fn spoiled(&self) -> Vec<Group> {
        let made = self
            .exhibits
            .iter()
            .filter_map(|exhibit| match &exhibit.inputs {
                Inputs::Made(group) => Some(group),
                Inputs::Seen(_) => None,
            });
        let made: Vec<&Group> = made.take(SPOILED).collect();
        let mut groups: Vec<Group> = made.iter().map(|group| (*group).clone()).collect();
        for group in &mut groups {
            for (number, quad) in group.quads.iter_mut().enumerate() {
                let corners = if number % 2 == 0 { 1 } else { 3 };
                for corner in &mut quad.corners[..corners] {
                    let count = corner.len();
                    corner[number % count] = WORST[number / count % WORST.len()];
                }
            }
        }
        let freedoms = self.interface.freedoms.iter();
        let any = freedoms.filter(|freedom| freedom.is_any && !freedom.is_matrix());
        for (number, freedom) in any.take(UNIFORMS).enumerate() {
            if let Some(group) = made.first() {
                let mut group = (*group).clone();
                group.values.retain(|(path, _)| path != freedom.path());
                let worst = f64::from(WORST[number % WORST.len()]);
                let values = vec![worst; freedom.len()];
                group.values.push((freedom.path().to_owned(), values));
                groups.push(group);
            }
        }
        groups
    }
}
