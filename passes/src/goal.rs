//! Goals: what "cheaper" means. A goal weighs what a variant uses up against what the original does.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail", 2003, sections 5
//! and 6.1: texture accesses, texture memory, instructions, or a weighted mix of them.

use crate::cost::Work;
use crate::shader::{Shader, Stage};
use naga::{Expression, TypeInner};
use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

/// Something that a variant uses up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Resource {
    /// The estimated time of a covered fragment.
    Time,
    /// Texture accesses that a covered fragment executes.
    Accesses,
    /// Textures that are bound.
    Textures,
    /// Bytes of the textures that are bound, with their MIP levels.
    Memory,
    /// Operations that a covered fragment executes, those that were moved to other stages among them.
    Operations,
}

impl Resource {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Time,
        Self::Accesses,
        Self::Textures,
        Self::Memory,
        Self::Operations,
    ];

    /// Its name on the command line, in scenes and in locks.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Accesses => "accesses",
            Self::Textures => "textures",
            Self::Memory => "memory",
            Self::Operations => "operations",
        }
    }
}

/// What a variant uses up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Used {
    /// Executed work of a covered fragment.
    pub work: Work,
    /// How many textures are bound.
    pub textures: u32,
    /// Bytes of those, with their MIP levels.
    pub texture_bytes: u64,
    /// Bytes of the generated ones among them.
    pub generated_bytes: u64,
}

impl Used {
    /// How much of a resource that is, each in its own unit.
    pub fn of(&self, resource: Resource) -> f64 {
        match resource {
            Resource::Time => self.work.total(),
            Resource::Accesses => self.work.samples,
            Resource::Textures => f64::from(self.textures),
            Resource::Memory => self.texture_bytes as f64,
            Resource::Operations => self.work.operations() + self.work.moved,
        }
    }
}

/// The weights of the resources that are to become less.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// In the order of [`Resource::ALL`]: finite, none below 0, at least one above.
    weights: [f64; Resource::ALL.len()],
}

impl Default for Goal {
    /// Time alone.
    fn default() -> Self {
        Self::only(Resource::Time)
    }
}

impl Goal {
    /// One resource alone.
    pub fn only(resource: Resource) -> Self {
        Self {
            weights: Resource::ALL.map(|other| f64::from(u8::from(other == resource))),
        }
    }

    /// The resource, where it is one alone.
    pub fn single(&self) -> Option<Resource> {
        let mut weighed = self.weighed();
        match (weighed.next(), weighed.next()) {
            (Some((resource, _)), None) => Some(resource),
            _ => None,
        }
    }

    fn weighed(&self) -> impl Iterator<Item = (Resource, f64)> {
        let all = Resource::ALL.into_iter().zip(self.weights);
        all.filter(|(_, weight)| *weight > 0.0)
    }

    /// How much of the whole the time weighs, 0..=1.
    pub fn weight_of_time(&self) -> f64 {
        let [time, ..] = self.weights;
        time / self.weights.iter().sum::<f64>()
    }

    /// The cost of a variant: the weighted mean of what it uses up, each as a share of the original's, in units of the
    /// original's time. What the original uses nothing of does not count. For the time alone that is
    /// [`Work::total`], to the last bit.
    pub fn cost(&self, variant: &Used, original: &Used) -> f64 {
        let unit = original.work.total();
        let all: f64 = self.weights.iter().sum();
        let mut cost = 0.0;
        for (resource, weight) in self.weighed() {
            let whole = original.of(resource);
            if whole > 0.0 {
                cost += weight / all * (unit / whole) * variant.of(resource);
            }
        }
        cost
    }

    /// Whether an original uses nothing of what is to become less: then there is nothing to search.
    pub fn is_reached(&self, original: &Used) -> bool {
        self.weighed()
            .all(|(resource, _)| original.of(resource) <= 0.0)
    }
}

impl fmt::Display for Goal {
    /// `accesses`, or `time=1,memory=0.2`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(resource) = self.single() {
            return f.write_str(resource.name());
        }
        for (i, (resource, weight)) in self.weighed().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            write!(f, "{comma}{}={weight}", resource.name())?;
        }
        Ok(())
    }
}

impl FromStr for Goal {
    type Err = String;

    /// Reads what is displayed; a resource without a weight has 1.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut weights = [0.0; Resource::ALL.len()];
        for part in text.split(',') {
            let (name, weight) = match part.split_once('=') {
                Some((name, weight)) => (name.trim(), weight.trim()),
                None => (part.trim(), "1"),
            };
            let known = || Resource::ALL.map(Resource::name).join(", ");
            let Some(at) = Resource::ALL.iter().position(|r| r.name() == name) else {
                return Err(format!(
                    "there is no goal `{name}`: it is one of {}",
                    known()
                ));
            };
            let weight: f64 = weight
                .parse()
                .ok()
                .filter(|weight: &f64| weight.is_finite() && *weight >= 0.0)
                .ok_or_else(|| format!("the weight of `{name}` is a number from 0"))?;
            weights[at] += weight;
        }
        match weights.iter().any(|weight| *weight > 0.0) {
            true => Ok(Self { weights }),
            false => Err("a goal has at least one weight above 0".to_owned()),
        }
    }
}

/// Group and binding of every texture that a shader's fragment or vertex stage names.
pub fn active_textures(shader: &Shader) -> BTreeSet<(u32, u32)> {
    let stages = [Stage::Fragment, Stage::Vertex];
    let functions = stages.into_iter().filter_map(|s| shader.function(s));
    let values = functions.flat_map(|function| function.expressions.iter());
    let module = shader.module();
    values
        .filter_map(|(_, expression)| {
            let Expression::GlobalVariable(variable) = *expression else {
                return None;
            };
            let variable = &module.global_variables[variable];
            let ty = match module.types[variable.ty].inner {
                TypeInner::BindingArray { base, .. } => base,
                _ => variable.ty,
            };
            let is_texture = matches!(module.types[ty].inner, TypeInner::Image { .. });
            let binding = variable.binding.filter(|_| is_texture)?;
            Some((binding.group, binding.binding))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn used(simple: f64, samples: f64, textures: u32, texture_bytes: u64) -> Used {
        Used {
            work: Work {
                simple,
                samples,
                ..Work::default()
            },
            textures,
            texture_bytes,
            generated_bytes: 0,
        }
    }

    #[test]
    fn costs_are_shares_of_the_original() {
        let original = used(77.0, 5.0, 4, 4000);
        let variant = used(33.0, 1.0, 1, 1000);
        let share = |text: &str| {
            let goal: Goal = text.parse().expect("it is one");
            goal.cost(&variant, &original) / goal.cost(&original, &original)
        };
        assert_eq!(share("accesses"), 0.2);
        assert_eq!(share("textures"), 0.25);
        assert_eq!(share("memory"), 0.25);
        assert!((share("operations") - 33.0 / 77.0).abs() < 1e-12);
        assert!((share("accesses=1,textures=3") - 0.2375).abs() < 1e-12);
        let time = Goal::default();
        assert_eq!(
            time.cost(&variant, &original).to_bits(),
            variant.work.total().to_bits()
        );
    }

    #[test]
    fn what_the_original_lacks_does_not_count() {
        let original = used(10.0, 0.0, 0, 0);
        let mixed: Goal = "time,accesses".parse().expect("it is one");
        let half = mixed.cost(&used(5.0, 0.0, 0, 0), &original);
        assert_eq!(half / mixed.cost(&original, &original), 0.5);
        assert!(Goal::only(Resource::Accesses).is_reached(&original));
        assert!(!mixed.is_reached(&original));
    }

    #[test]
    fn goals_are_read_as_they_are_shown() {
        for text in ["time", "accesses", "time=1,memory=0.2"] {
            let goal: Goal = text.parse().expect("it is one");
            assert_eq!(goal.to_string(), text);
        }
        for (text, message) in [
            ("speed", "there is no goal `speed`"),
            ("time=-1", "the weight of `time`"),
            ("time=x", "the weight of `time`"),
            ("time=0", "at least one weight"),
            ("", "there is no goal ``"),
        ] {
            let error = text.parse::<Goal>().expect_err(text);
            assert!(error.contains(message), "{error}");
        }
    }
}
