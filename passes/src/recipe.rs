//! Candidates and recipes: one simplification as data, and an ordered list of them.

use crate::Facts;
use crate::shader::{Shader, ValueId};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// What a simplification may change (Olano, section 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// Never changes the picture.
    Lossless,
    /// Changes nothing at the resolution that it was made for.
    ResolutionLossless,
    /// Changes the picture; the error is measured.
    Lossy,
}

/// One simplification that could be made: pass, site, choice, and the numbers that it bakes.
/// Pure data: it serialises, compares and holds no handle.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Candidate {
    /// The pass's command-line name.
    pub pass: String,
    /// The value that is changed, or whose users are.
    pub site: ValueId,
    /// What is done there, in the pass's own words: `mean`, `keep fs_main.specular.pow`. A value that it
    /// names is written as its id, hash and all.
    pub choice: String,
    /// The numbers that it bakes, as the bits of an f32 each; empty when it bakes none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub value: Vec<u32>,
}

impl Candidate {
    /// The numbers that it bakes.
    pub fn numbers(&self) -> impl Iterator<Item = f32> + '_ {
        self.value.iter().map(|bits| f32::from_bits(*bits))
    }

    /// The same candidate with another choice and other numbers.
    pub(crate) fn with(&self, choice: &str, numbers: &[f32]) -> Self {
        Self {
            choice: choice.into(),
            value: numbers.iter().map(|number| number.to_bits()).collect(),
            ..self.clone()
        }
    }

    /// The same candidate with its values named as in another version of their shader.
    fn known_to(&self, base: &Shader) -> Self {
        let word = |word: &str| match base.known_as(&word.into()) {
            Some(id) if word.contains('#') => id.to_string(),
            _ => word.to_owned(),
        };
        Self {
            site: base.known_as(&self.site).unwrap_or(&self.site).clone(),
            choice: self
                .choice
                .split(' ')
                .map(word)
                .collect::<Vec<_>>()
                .join(" "),
            ..self.clone()
        }
    }

    /// The same candidate with its values named as in another version of their shader's source, if they are still computed
    /// as they were. What that version does not have may come from an earlier step.
    fn still_known_to(&self, base: &Shader) -> Result<Self, Declined> {
        let still = |id: &ValueId| match base.known_as(id) {
            None => Ok(id.clone()),
            Some(now) if id.hash() == 0 || now.hash() == id.hash() => Ok(now.clone()),
            Some(_) => Err(Declined(format!(
                "`{}` is computed otherwise now",
                id.path()
            ))),
        };
        let word = |word: &str| match word.contains('#') {
            true => still(&word.into()).map(|id| id.to_string()),
            false => Ok(word.to_owned()),
        };
        let words: Result<Vec<String>, Declined> = self.choice.split(' ').map(word).collect();
        Ok(Self {
            site: still(&self.site)?,
            choice: words?.join(" "),
            ..self.clone()
        })
    }

    /// The numbers that it bakes, when they are `count` finite ones.
    ///
    /// # Errors
    /// When there are more or fewer, or one is infinite or not a number.
    pub fn baked(&self, count: usize) -> Result<Vec<f32>, Declined> {
        let numbers: Vec<f32> = self.numbers().collect();
        if numbers.len() != count {
            return Err(Declined(format!(
                "it bakes {} numbers, but the value has {count}",
                numbers.len()
            )));
        }
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(Declined("it bakes a number that is not finite".into()));
        }
        Ok(numbers)
    }
}

impl fmt::Display for Candidate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} ", self.pass, self.site.path())?;
        // Hashes are for finding, not for reading.
        for (i, word) in self.choice.split(' ').enumerate() {
            let sep = if i == 0 { "" } else { " " };
            write!(
                f,
                "{sep}{}",
                word.split_once('#').map_or(word, |(word, _)| word)
            )?;
        }
        let mut sep = " = ";
        for number in self.numbers() {
            write!(f, "{sep}{number}")?;
            sep = ", ";
        }
        Ok(())
    }
}

/// Why a candidate does not apply: one lower-case sentence without a full stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Declined(pub String);

impl fmt::Display for Declined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A change that a pass thought of, and why it is not offered, when it is not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Considered {
    /// The change. What it would bake is left out when it is declined.
    pub candidate: Candidate,
    /// Why it is not offered.
    pub declined: Option<Declined>,
}

/// A pass: it lists candidates, and makes the change that one describes.
///
/// The candidate law: `candidates` is deterministic; `applies` can be asked of any shader;
/// `apply` after `applies` gives a valid module, and panics on anything else.
pub trait Pass: Sync {
    /// The command-line name, the same as that of the file and of the fixture folder.
    fn name(&self) -> &'static str;
    /// What it does, in one line.
    fn summary(&self) -> &'static str;
    /// What a candidate of this pass may change.
    fn class(&self, candidate: &Candidate) -> Class;
    /// Whether all that it does is of the exact tier: made before a search, so that no lossy change is credited with it, or
    /// not at all.
    fn is_exact(&self) -> bool {
        false
    }
    /// Whether a change is made before a search, as it costs no error and saves work: all changes of a pass of the exact tier, and
    /// those of others that are sure to.
    fn is_free(&self, _candidate: &Candidate) -> bool {
        self.is_exact()
    }
    /// Every change that this pass thinks of, in a fixed order; those that it declines with the reason.
    fn consider(&self, shader: &Shader, facts: &Facts) -> Vec<Considered>;
    /// Every change that this pass could make, in a fixed order.
    fn candidates(&self, shader: &Shader, facts: &Facts) -> Vec<Candidate> {
        let considered = self.consider(shader, facts).into_iter();
        considered
            .filter(|considered| considered.declined.is_none())
            .map(|considered| considered.candidate)
            .collect()
    }
    /// The same change with other numbers, of which there are as many, and with the choice that these have: a mean
    /// becomes the best constant. `None` when its numbers mean what they are, or it has none.
    fn with_numbers(&self, _candidate: &Candidate, _numbers: &[f32]) -> Option<Candidate> {
        None
    }
    /// Whether the numbers of a candidate are no more than a guess, so that it should be judged by better ones.
    fn guesses(&self, _candidate: &Candidate) -> bool {
        false
    }
    /// Whether a candidate can be applied to a shader.
    fn applies(&self, shader: &Shader, candidate: &Candidate) -> Result<(), Declined>;
    /// The shader with the change made.
    fn apply(&self, shader: &Shader, candidate: &Candidate) -> Shader;
}

/// An ordered list of candidates: a variant's derivation.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Recipe(pub Vec<Candidate>);

/// A candidate of a recipe that could not be applied.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReplayError {
    /// Its place in the recipe, from 0.
    pub step: usize,
    /// The candidate.
    pub candidate: Candidate,
    /// Why it did not apply.
    pub declined: Declined,
}

impl Recipe {
    /// Applies every candidate in order. A value that was renamed in the base since is found by its hash.
    ///
    /// # Errors
    /// At the first candidate that names no pass of the base or does not apply; nothing is skipped in silence.
    pub fn replay(&self, base: &Shader) -> Result<Shader, Box<ReplayError>> {
        self.replay_from(base, base)
    }

    /// As [`replay`](Self::replay), but on a shader that another recipe has made of the base.
    ///
    /// # Errors
    /// As `replay`.
    pub fn replay_from(&self, start: &Shader, base: &Shader) -> Result<Shader, Box<ReplayError>> {
        let mut shader = start.clone();
        for (step, candidate) in self.0.iter().enumerate() {
            shader = apply(&shader, &candidate.known_to(base)).map_err(|declined| {
                Box::new(ReplayError {
                    step,
                    candidate: candidate.clone(),
                    declined,
                })
            })?;
        }
        Ok(shader)
    }
}

/// What is left of a recipe on another version of its source.
#[derive(Clone, Debug)]
pub struct Surviving {
    /// The steps that still apply, one after the other, with their values as they are named now.
    pub recipe: Recipe,
    /// The shader that they make.
    pub shader: Shader,
    /// The others, with their places in the recipe as it was.
    pub lost: Vec<ReplayError>,
}

impl Recipe {
    /// Applies every candidate that still applies to another version of the source that the recipe was made for: its values
    /// are there, computed as they were, and its pass takes it. `start` is what another recipe has made of that version, `base`.
    pub fn surviving(&self, start: &Shader, base: &Shader) -> Surviving {
        let mut shader = start.clone();
        let (mut recipe, mut lost) = (Self::default(), Vec::new());
        for (step, candidate) in self.0.iter().enumerate() {
            let applied = candidate
                .still_known_to(base)
                .and_then(|known| Ok((apply(&shader, &known)?, known)));
            match applied {
                Ok((next, known)) => {
                    shader = next;
                    recipe.0.push(known);
                }
                Err(declined) => lost.push(ReplayError {
                    step,
                    candidate: candidate.clone(),
                    declined,
                }),
            }
        }
        Surviving {
            recipe,
            shader,
            lost,
        }
    }
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            step,
            candidate,
            declined,
        } = self;
        write!(f, "step {}, {candidate}: {declined}", step + 1)
    }
}

impl std::error::Error for ReplayError {}

/// Every candidate of a shader's passes, pass by pass; without those that ask a host for something.
pub fn candidates(shader: &Shader, facts: &Facts) -> Vec<Candidate> {
    shader
        .passes()
        .iter()
        .flat_map(|pass| pass.candidates(shader, facts))
        .collect()
}

/// Everything that a shader's passes think of, by the value that it changes; pass by pass for each.
pub fn considered(shader: &Shader, facts: &Facts) -> BTreeMap<ValueId, Vec<Considered>> {
    let mut by_site: BTreeMap<ValueId, Vec<Considered>> = BTreeMap::new();
    let passes = shader.passes().iter();
    for considered in passes.flat_map(|pass| pass.consider(shader, facts)) {
        let site = considered.candidate.site.clone();
        by_site.entry(site).or_default().push(considered);
    }
    by_site
}

/// Applies one candidate through the pass that it names.
///
/// # Errors
/// When the shader has no pass of that name, or the pass declines.
pub fn apply(shader: &Shader, candidate: &Candidate) -> Result<Shader, Declined> {
    let pass = shader.passes().of_name(&candidate.pass)?;
    pass.applies(shader, candidate)?;
    Ok(pass.apply(shader, candidate))
}
