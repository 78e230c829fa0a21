//! What the user wants kept: values that are never folded, simplified or left out, values that may change only a
//! little, and values that go first.

use lodc_passes::vertex_motion::VertexMotion;
use lodc_passes::{Candidate, Pass, Shader, Stage, specialize};
use naga::Expression;
use std::collections::{BTreeMap, BTreeSet};

/// What a search may not do, and what it should do first. Values are known by their paths in the original.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kept {
    /// Values that stay as they are.
    pub(crate) values: BTreeSet<String>,
    /// Textures and buffers, or parts of buffers, that stay: something still reads each.
    pub(crate) read: BTreeSet<String>,
    /// By how much a change of a value may raise the error: the root of what it adds to the square.
    pub(crate) most: BTreeMap<String, f64>,
    /// Values whose changes are tried before others.
    pub(crate) first: BTreeSet<String>,
    /// The passes that may cost error; all when there are none.
    pub(crate) only: BTreeSet<String>,
    /// Whether levels have the original's vertex stage.
    pub(crate) same_vertex_stage: bool,
    /// Whether levels may be unstable where the original is not.
    pub(crate) unstable: bool,
    /// Whether neighbouring levels are drawn together somewhere, so that they share no value between the stages.
    pub(crate) apart: bool,
}

impl Kept {
    /// Whether a change is one that is not to be made.
    pub(crate) fn refuses(&self, candidate: &Candidate) -> bool {
        self.values.contains(candidate.site.path())
            || specialize::folded(candidate).is_some_and(|(place, _)| {
                let mut read = self.read.iter();
                read.any(|read| is_within(&place, read) || is_within(read, &place))
            })
    }

    /// Whether a pass may be tried where it costs error.
    pub(crate) fn admits(&self, pass: &str) -> bool {
        let moves = pass == VertexMotion.name() && self.same_vertex_stage;
        !moves && (self.only.is_empty() || self.only.contains(pass))
    }

    /// Whether everything that is to be kept is still in a shader.
    pub(crate) fn holds(&self, shader: &Shader) -> bool {
        let Some(function) = shader.function(Stage::Fragment) else {
            return true;
        };
        let values = || function.expressions.iter().map(|(value, _)| value);
        if !self.values.is_empty() {
            let there: BTreeSet<&str> = values()
                .map(|value| shader.id(Stage::Fragment, value).path())
                .collect();
            if !self.values.iter().all(|path| there.contains(&**path)) {
                return false;
            }
        }
        self.read.iter().all(|name| {
            values().any(|value| {
                let read = match function.expressions[value] {
                    Expression::GlobalVariable(variable) => {
                        shader.module().global_variables[variable].name.clone()
                    }
                    Expression::Load { .. } => specialize::place(shader, value),
                    _ => None,
                };
                read.is_some_and(|read| is_within(&read, name))
            })
        })
    }

    /// By how much a change may raise the error, as the root of what it adds to the square.
    pub(crate) fn most(&self, candidate: &Candidate) -> f64 {
        let most = self.most.get(candidate.site.path());
        most.copied().unwrap_or(f64::INFINITY)
    }

    /// Whether a change is tried before others.
    pub(crate) fn is_first(&self, candidate: &Candidate) -> bool {
        self.first.contains(candidate.site.path())
    }
}

/// Whether a place is another one, or lies in it. `[*]` stands for every index.
pub(crate) fn is_within(place: &str, outer: &str) -> bool {
    let steps = |path: &str| -> Vec<String> {
        let apart = path.replace('[', ".[");
        apart.split('.').map(str::to_owned).collect()
    };
    let (place, outer) = (steps(place), steps(outer));
    place.len() >= outer.len()
        && place
            .iter()
            .zip(&outer)
            .all(|(a, b)| a == b || [a, b].into_iter().any(|step| step == "[*]"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_lies_within_what_is_around_it() {
        assert!(is_within("lights[2].colour", "lights"));
        assert!(is_within("lights[2].colour", "lights[2]"));
        assert!(is_within("lights[*].colour", "lights[2].colour"));
        assert!(is_within("lights[2]", "lights[*]"));
        assert!(!is_within("lights[2].colour", "lights[1]"));
        assert!(!is_within("lights_count", "lights"));
        assert!(!is_within("lights", "lights[2]"));
    }
}
