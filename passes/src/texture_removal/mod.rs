//! texture-removal: a texture read becomes a constant, or a short sum of functions of its coordinates.
//!
//! Precondition. The site is a read (`textureSample` and its kin, `textureLoad`) that returns f32 in
//! the fragment stage, of a texture whose image is known, and nothing but the picture depends on it; or
//! the site is the texture variable itself, and all its reads are such reads of one kind.
//!
//! Effect. The read's users use a constant that the candidate carries. `seen-mean`: the mean of what
//! the read returned over the samples of the scene. `texture-mean`: the mean of the whole texture, at
//! the MIP level that the distance leads to. `only-colour`: the same, of a texture that has one colour.
//! `best`: the constant that leaves the least error on the screen; a search makes it of a mean that is worth it.
//! At a texture's variable every read becomes the same constant, so that the texture is not needed any
//! more, where each removal alone would still pay for the others; `seen-mean` is then the mean over all
//! reads. The variable's own id is the site, such as `fs_main.albedo_texture`.
//!
//! `normal-to-roughness <alpha's ids>`, for a map of normals whose role is known: the reads become their `seen-mean`, and
//! the roughness takes up the slopes that go with them. What uses alpha, the square of perceptual roughness, uses
//! `sqrt(min(alpha * alpha + v, 1.0))`. The candidate bakes `v` and behind it the constant. `roughness.rs` says how alpha
//! is found and why variances add. MIP levels lose the part of the variance that is within a pixel (Toksvig measures it
//! by how short a mean normal is); but here the whole map goes, and a pixel no longer knows where on the map it is, so
//! that the variance between pixels goes with it: `v` is that of all slopes that the reference shows. What is lost in
//! the MIP levels that the reference reads, the reference has lost too. That is a first guess: few maps have slopes
//! like those of a microfacet, most are flat with some steep edges, which a lobe had better not follow; and a
//! shader may scale its normals. So a search judges this choice by its best numbers.
//!
//! `polynomial D`, `harmonics D` and `lights N`, for a texture that is smooth: a sample becomes a sum of functions of its
//! coordinates, of a degree or band up to D, and never below 0. A polynomial takes the place of a texture of two dimensions,
//! such as a table of a reflectance over two arguments; harmonics take that of a cube map, such as surroundings that light a
//! rough surface; lights are the first band of these and up to four lobes, at the peaks of what that leaves of the map. The candidate bakes the factors, function by function, of the components that are used, and behind them a vector for each light,
//! whose length is how narrow it is. They are those
//! that are nearest to the texture at first, and then those that leave the least error on the screen, which needs no
//! window against ringing: what rings is an error.
//!
//! Error. For `texture-mean`, the least-squares error of the constant at that MIP level is the standard
//! deviation of the texels: [`deviation`] gives it. Its effect on the picture is measured. `only-colour`
//! is lossless, as weights of a filter that sum to 1 leave one colour what it is, but for rounding: it is of the exact tier, where
//! pictures are the same to the last bit.
//!
//! Declines.
//! - A texture that the facts do not know: it is dynamic, and may hold anything.
//! - Integer textures: their numbers name things, and things have no mean.
//! - A read that is only compared or made an integer, for a mean; one at a place that depends on what may take
//!   any value, for `seen-mean`.
//! - `texture-mean` for a gather or a depth comparison, whose result is no mix of texels, and for an
//!   array of textures.
//! - A read that decides when a loop ends (unless a counter of integers ends it anyway), a built-in
//!   output or what is written to memory.
//! - A read that no sample saw, for `seen-mean`.
//! - `polynomial` for coordinates that are seen outside 0..1, both sums for what is seen below 0. They are not thought of for
//!   textures of which they would leave most of the variance, or more than 0.9 of what a sum of less work leaves, and for
//!   reads other than plain samples. A sum that costs as much as the sample is declined.
//! - `normal-to-roughness` where alpha is not known for sure or seen above 1, where it and the normals are not two
//!   things that meet further on, where it decides more than the picture, and for normals that do not vary. It is not
//!   thought of for other textures.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail",
//! 2003, section 2.1; Ravi Ramamoorthi, Pat Hanrahan, "An Efficient Representation for Irradiance Environment Maps", 2001;
//! Michael Toksvig, "Mipmapping Normal Maps", 2005; Marc Olano, Dan Baker, "LEAN Mapping", 2010,
//! section 3.

mod roughness;
mod smooth;

use crate::basis::Basis;
use crate::edit::{Edit, New};
use crate::facts::TextureFacts;
use crate::flow::{Dynamic, Flow, Value};
use crate::recipe::{Candidate, Class, Considered, Declined, Pass};
use crate::shader::{Shader, Stage, ValueId};
use crate::{Facts, constants};
use naga::{Expression, GlobalVariable, Handle};
use smooth::Sum;

/// The stage whose reads are removed: textures that move vertices belong to the mesh.
const STAGE: Stage = Stage::Fragment;

/// The pass.
pub struct TextureRemoval;

/// What a read becomes: the only place where the words of this pass are read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Choice {
    SeenMean,
    TextureMean,
    Best,
    OnlyColour,
    NormalToRoughness,
    Smooth(Basis),
}

impl Choice {
    const ALL: [(Self, &'static str); 5] = [
        (Self::SeenMean, "seen-mean"),
        (Self::TextureMean, "texture-mean"),
        (Self::Best, "best"),
        (Self::OnlyColour, "only-colour"),
        (Self::NormalToRoughness, "normal-to-roughness"),
    ];

    /// A choice, and the ids of values that stand behind it.
    fn parse(choice: &str) -> Result<(Self, &str), Declined> {
        let (word, ids) = choice.split_once(' ').unwrap_or((choice, ""));
        if let Some(basis) = Basis::parse(word, ids) {
            return Ok((Self::Smooth(basis), ""));
        }
        Self::ALL
            .iter()
            .find(|(_, known)| *known == word)
            .map(|(parsed, _)| (*parsed, ids))
            .filter(|(parsed, ids)| *parsed == Self::NormalToRoughness || ids.is_empty())
            .ok_or_else(|| Declined(format!("texture-removal has no choice `{choice}`")))
    }

    fn word(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(choice, _)| *choice == self)
            .map_or("", |(_, word)| word)
    }
}

/// The least-squares error of a candidate that puts a texture's mean in its place: a standard deviation
/// for each channel, in linear light, at the facts' MIP level. `None` for other candidates, and for a
/// texture that the facts do not know.
pub fn deviation(shader: &Shader, facts: &Facts, candidate: &Candidate) -> Option<[f32; 4]> {
    if candidate.pass != TextureRemoval.name() {
        return None;
    }
    match Choice::parse(&candidate.choice).ok()?.0 {
        Choice::SeenMean | Choice::Best | Choice::NormalToRoughness | Choice::Smooth(_) => None,
        Choice::OnlyColour => Some([0.0; 4]),
        Choice::TextureMean => {
            let (stage, site) = shader.find(&candidate.site)?;
            let flow = Flow::new(shader, stage)?;
            let image = image(&flow, site).unwrap_or(site);
            let name = shader.module().global_variables[flow.global(image)?]
                .name
                .as_ref()?;
            facts.textures.get(name)?.deviation_at_level()
        }
    }
}

impl Pass for TextureRemoval {
    fn name(&self) -> &'static str {
        "texture-removal"
    }

    fn summary(&self) -> &'static str {
        "a texture read becomes a constant, or a sum of functions of its coordinates"
    }

    fn class(&self, candidate: &Candidate) -> Class {
        match Choice::parse(&candidate.choice) {
            Ok((Choice::OnlyColour, _)) => Class::Lossless,
            _ => Class::Lossy,
        }
    }

    fn is_free(&self, candidate: &Candidate) -> bool {
        self.class(candidate) == Class::Lossless
    }

    fn consider(&self, shader: &Shader, facts: &Facts) -> Vec<Considered> {
        let Some(flow) = Flow::new(shader, STAGE) else {
            return Vec::new();
        };
        let survey = Survey {
            flow: &flow,
            facts,
            dynamic: Dynamic::of(&flow, facts),
        };
        let mut found = Vec::new();
        for (site, _) in flow.function.expressions.iter() {
            if let Some(image) = image(&flow, site) {
                survey.list(site, flow.global(image), &[site], &mut found);
            }
        }
        let mut listed = Vec::new();
        for (site, expression) in flow.function.expressions.iter() {
            if let Expression::GlobalVariable(texture) = *expression
                && !listed.contains(&texture)
            {
                listed.push(texture);
                let reads = reads(&flow, texture);
                if reads.len() > 1 {
                    survey.list(site, Some(texture), &reads, &mut found);
                }
            }
        }
        found
    }

    fn with_numbers(&self, candidate: &Candidate, numbers: &[f32]) -> Option<Candidate> {
        match Choice::parse(&candidate.choice).ok()?.0 {
            Choice::OnlyColour => None,
            Choice::NormalToRoughness => {
                // A variance is not negative, whatever suits the picture.
                let mut numbers = numbers.to_vec();
                let variance = numbers.first_mut()?;
                *variance = variance.max(0.0);
                Some(candidate.with(&candidate.choice, &numbers))
            }
            Choice::Smooth(_) => Some(candidate.with(&candidate.choice, numbers)),
            _ => Some(candidate.with(Choice::Best.word(), numbers)),
        }
    }

    fn guesses(&self, candidate: &Candidate) -> bool {
        let choice = Choice::parse(&candidate.choice);
        choice.is_ok_and(|(choice, _)| choice == Choice::NormalToRoughness)
    }

    fn applies(&self, shader: &Shader, candidate: &Candidate) -> Result<(), Declined> {
        plan(shader, candidate).map(drop)
    }

    fn apply(&self, shader: &Shader, candidate: &Candidate) -> Shader {
        match plan(shader, candidate) {
            Ok(plan) => {
                let mut edit = Edit::new(shader, STAGE);
                for read in plan.reads {
                    edit.replace(read, New::Numbers(plan.numbers.clone()));
                }
                if let Some(sum) = plan.sum {
                    let value = sum.write(shader, &mut edit);
                    edit.replace(plan.site, New::Value(value));
                }
                for alpha in plan.alphas {
                    roughness::widen(&mut edit, shader, alpha, plan.variance);
                }
                edit.finish()
            }
            Err(declined) => panic!("{candidate} was applied, but {declined}"),
        }
    }
}

/// What a candidate does.
struct Plan {
    /// What it is about.
    site: Value,
    /// What becomes a constant.
    reads: Vec<Value>,
    /// The constant that these become.
    numbers: Vec<f32>,
    /// What it widens.
    alphas: Vec<Value>,
    /// By how much.
    variance: f32,
    /// What the site becomes.
    sum: Option<Sum>,
}

fn plan(shader: &Shader, candidate: &Candidate) -> Result<Plan, Declined> {
    let (choice, ids) = Choice::parse(&candidate.choice)?;
    let (stage, site) = shader
        .find(&candidate.site)
        .ok_or_else(|| Declined(format!("there is no value `{}`", candidate.site.path())))?;
    let flow = (stage == STAGE)
        .then(|| Flow::new(shader, stage))
        .flatten()
        .ok_or_else(|| Declined("only reads of the fragment stage are removed".into()))?;
    let reads = match flow.function.expressions[site] {
        Expression::GlobalVariable(texture) => reads(&flow, texture),
        _ if image(&flow, site).is_some() => vec![site],
        _ => {
            return Err(Declined(
                "it is neither a texture read nor a texture".into(),
            ));
        }
    };
    let count = removable(&flow, &reads, choice)?;
    if let Choice::Smooth(basis) = choice {
        return Ok(Plan {
            site,
            reads: Vec::new(),
            numbers: Vec::new(),
            alphas: Vec::new(),
            variance: 0.0,
            sum: Some(Sum::new(&flow, site, basis, candidate)?),
        });
    }
    let (alphas, mut numbers) = match choice {
        Choice::NormalToRoughness => (roughness::named(&flow, ids)?, candidate.baked(1 + count)?),
        _ => (Vec::new(), candidate.baked(count)?),
    };
    let variance = match choice {
        Choice::NormalToRoughness => numbers.remove(0),
        _ => 0.0,
    };
    if variance < 0.0 {
        return Err(Declined("a variance is not negative".into()));
    }
    follow(&flow, &reads, &numbers)?;
    Ok(Plan {
        site,
        reads,
        numbers,
        alphas,
        variance,
        sum: None,
    })
}

/// Declines a constant that an operation on the reads cannot take.
fn follow(flow: &Flow, reads: &[Value], numbers: &[f32]) -> Result<(), Declined> {
    let become_constant: Vec<_> = reads.iter().map(|read| (*read, numbers)).collect();
    constants::follow(flow, &become_constant)
}

/// The texture that a value is read from, when it is a texture read.
fn image(flow: &Flow, value: Value) -> Option<Value> {
    match flow.function.expressions[value] {
        Expression::ImageSample { image, .. } | Expression::ImageLoad { image, .. } => Some(image),
        _ => None,
    }
}

/// The reads of a texture, in arena order.
fn reads(flow: &Flow, texture: Handle<GlobalVariable>) -> Vec<Value> {
    let values = flow.function.expressions.iter().map(|(value, _)| value);
    values
        .filter(|value| image(flow, *value).is_some_and(|i| flow.global(i) == Some(texture)))
        .collect()
}

/// What a read returns a mix of.
#[derive(PartialEq)]
enum Kind {
    Texels,
    Gathered(naga::SwizzleComponent),
    Compared,
}

fn kind(flow: &Flow, read: Value) -> Kind {
    match flow.function.expressions[read] {
        Expression::ImageSample {
            gather: Some(component),
            ..
        } => Kind::Gathered(component),
        Expression::ImageSample {
            depth_ref: Some(_), ..
        } => Kind::Compared,
        _ => Kind::Texels,
    }
}

/// How many numbers all reads return, when all can become one constant.
fn removable(flow: &Flow, reads: &[Value], choice: Choice) -> Result<usize, Declined> {
    let (Some(first), true) = (
        reads.first(),
        reads.iter().all(|read| flow.floats(*read).is_some()),
    ) else {
        return Err(Declined(if reads.is_empty() {
            "nothing reads it".into()
        } else {
            "it does not hold floats, so it has no mean".into()
        }));
    };
    let first_kind = kind(flow, *first);
    let of_texture = matches!(choice, Choice::TextureMean | Choice::OnlyColour);
    for read in reads {
        if let Some(why) = flow.decides(*read) {
            return Err(Declined(why.to_string()));
        }
        if choice != Choice::OnlyColour
            && let Some(meaning) = flow.meaning(*read)
        {
            return Err(meaning.into());
        }
        if flow.floats(*read) != flow.floats(*first) || kind(flow, *read) != first_kind {
            return Err(Declined("it is read in different ways".into()));
        }
        let whole = matches!(
            image(flow, *read).map(|image| &flow.function.expressions[image]),
            Some(Expression::GlobalVariable(_))
        );
        if of_texture && !whole {
            return Err(Declined("it is one of an array of textures".into()));
        }
    }
    if of_texture && first_kind != Kind::Texels {
        return Err(Declined("it returns no mix of texels".into()));
    }
    Ok(flow.floats(*first).unwrap_or(1))
}

/// One listing of the candidates.
struct Survey<'a> {
    flow: &'a Flow<'a>,
    facts: &'a Facts,
    dynamic: Dynamic,
}

impl Survey<'_> {
    fn list(
        &self,
        site: Value,
        texture: Option<Handle<GlobalVariable>>,
        reads: &[Value],
        found: &mut Vec<Considered>,
    ) {
        let name = texture.and_then(|t| self.flow.module.global_variables[t].name.as_deref());
        let known = name.and_then(|name| self.facts.textures.get(name));
        let of_texture = if known.is_some_and(|texture| texture.is_flat()) {
            Choice::OnlyColour
        } else {
            Choice::TextureMean
        };
        let mut consider = |choice: &str, verdict: Result<Vec<f32>, Declined>| {
            let (value, declined) = match verdict {
                Ok(numbers) => (numbers.iter().map(|n| n.to_bits()).collect(), None),
                Err(declined) => (Vec::new(), Some(declined)),
            };
            let candidate = Candidate {
                pass: TextureRemoval.name().into(),
                site: self.flow.id(site).clone(),
                choice: choice.into(),
                value,
            };
            found.push(Considered {
                candidate,
                declined,
            });
        };
        for choice in [Choice::SeenMean, of_texture] {
            consider(choice.word(), self.mean(choice, known, reads));
        }
        let mean = self.mean(Choice::SeenMean, known, reads);
        if let (Some(known), [read], Ok(_)) = (known, reads, mean) {
            for (basis, verdict) in smooth::listed(self.flow, self.facts, known, *read) {
                consider(&basis.to_string(), verdict);
            }
        }
        // The slopes of a map that is read in several places go once.
        let all =
            texture.is_some_and(|texture| reads.len() == self::reads(self.flow, texture).len());
        if let (Some(known), true) = (known.filter(|known| !known.slopes.is_empty()), all) {
            let word = Choice::NormalToRoughness.word();
            match self.widening(known, reads) {
                Ok((alphas, numbers)) => consider(&format!("{word}{alphas}"), Ok(numbers)),
                Err(declined) => consider(word, Err(declined)),
            }
        }
    }

    /// The mean that takes the place of reads.
    fn mean(
        &self,
        choice: Choice,
        known: Option<&TextureFacts>,
        reads: &[Value],
    ) -> Result<Vec<f32>, Declined> {
        let count = removable(self.flow, reads, choice)?;
        let known = known
            .ok_or_else(|| Declined("its texture has no image, so it may hold anything".into()))?;
        let mean = match choice {
            Choice::TextureMean | Choice::OnlyColour => known.mean_at_level()?[..count].to_vec(),
            _ => {
                if reads.iter().any(|read| self.dynamic.is(*read)) {
                    return Err(Declined(
                        "where it is read depends on something that may take any value".into(),
                    ));
                }
                let ids = reads.iter().map(|read| self.flow.id(*read));
                self.facts.mean(ids, count)?
            }
        };
        follow(self.flow, reads, &mean)?;
        Ok(mean)
    }

    /// The ids of alpha, each behind a blank; and the variance that it takes up, with the mean normal behind it.
    fn widening(
        &self,
        known: &TextureFacts,
        reads: &[Value],
    ) -> Result<(String, Vec<f32>), Declined> {
        let mean = self.mean(Choice::NormalToRoughness, Some(known), reads)?;
        let alphas = roughness::find(self.flow, reads)?;
        let ids: Vec<&ValueId> = alphas.iter().map(|alpha| self.flow.id(*alpha)).collect();
        let seen = ids.iter().filter_map(|id| self.facts.values.get(id));
        if seen
            .flat_map(|seen| &seen.max)
            .any(|max| max.is_nan() || *max > roughness::MOST)
        {
            return Err(Declined(format!(
                "`{}` is seen above {}, so that it is no roughness",
                ids[0].path(),
                roughness::MOST
            )));
        }
        let variance = known
            .slope_variance()
            .filter(|variance| *variance > 0.0)
            .ok_or_else(|| Declined("its normals do not vary".into()))?;
        let numbers = std::iter::once(variance).chain(mean).collect();
        Ok((ids.iter().map(|id| format!(" {id}")).collect(), numbers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::shader;

    #[test]
    fn the_error_of_a_mean_is_the_deviation_at_its_level() {
        let shader = shader(
            "@group(0) @binding(0) var grain: texture_2d<f32>;
             @group(0) @binding(1) var s: sampler;
             @fragment fn main(@location(0) uv: vec2f) -> @location(0) vec4f {
                 let fine = textureSample(grain, s, uv); return fine;
             }",
        );
        let mut facts = Facts::default();
        let texture = TextureFacts {
            mean: vec![[0.5; 4]; 2],
            deviation: vec![[0.25; 4], [0.125; 4]],
            level: 1.0,
            ..TextureFacts::default()
        };
        facts.textures.insert("grain".into(), texture);
        let offered = TextureRemoval.candidates(&shader, &facts);
        let [mean] = &offered[..] else {
            panic!("nothing was seen, so the texture's mean is all: {offered:?}");
        };
        assert_eq!(mean.choice, "texture-mean");
        assert_eq!(deviation(&shader, &facts, mean), Some([0.125; 4]));
        assert_eq!(TextureRemoval.class(mean), Class::Lossy);

        if let Some(texture) = facts.textures.get_mut("grain") {
            texture.deviation.fill([0.0; 4]);
        }
        let offered = TextureRemoval.candidates(&shader, &facts);
        assert_eq!(offered[0].choice, "only-colour");
        assert_eq!(TextureRemoval.class(&offered[0]), Class::Lossless);
        assert_eq!(deviation(&shader, &facts, &offered[0]), Some([0.0; 4]));
    }
}
