//! texture-collapse: texture samples and what is done to them become one sample of a texture that is made beforehand.
//!
//! Precondition. The site is a float or a vector of them of the fragment stage that is computed of samples of known
//! textures and of constants alone. All samples have the same sampler and choose their level of detail in the same way, at
//! coordinates that the candidate names, its root, or at ones that repeat a whole number of times when the root goes
//! from 0 to 1. Samples of arrays are in a constant layer, or in one that all have in common and the candidate names behind
//! all else: then the new texture is an array too, each layer made of those of the sources.
//!
//! Effect. One of the samples that nothing else needs reads the new texture at the root instead, and the site is what it
//! returns. The texture is bound at the first free binding of the group of the textures that went into it. How its texels
//! are computed is kept beside the variant (see [`crate::generated`]); uniforms that the scene fixes are numbers by then
//! (see [`crate::specialize`]).
//! - `same <root>`: all samples are at the root, of textures that are as large as each other, and the value is a linear
//!   function of them, so that filtering before and after gives the same.
//! - `levels <root>`: all are at the root, but the value is no linear function, or textures differ in size. Each MIP level is
//!   computed from that level of the sources: texel for texel it is the same, and what is filtered between texels differs.
//! - `resampled <root> <edge>`: some are at an affine function of the root, by which they repeat along both axes. The root is
//!   where one of them is, or else what all those coordinates are computed of, so that one of its periods is one of theirs
//!   all. They are resampled into the resolution of the finest of them, halved until the longest edge has no more than so
//!   many texels: as many as the period has pixels at the facts' distance, or all.
//!
//! - `bake <root> <edge>`: the value is computed of texture coordinates and constants alone, without a texture, such as
//!   noise. Each texel of the finest level is the mean of 4 x 4 points, and there are as many along each edge as the number
//!   behind the root says. Here a new sample comes, so that accesses may rise by one.
//!
//! Error. `same` has that of the texture's format. The others have what the picture shows: it is measured. But for `bake`, accesses never
//! increase, since at least one sample goes for the new one.
//!
//! Declines.
//! - A texture that the facts do not know, because it may hold anything, and one that has another image in each draw.
//! - Arrays in different layers, or with different numbers of layers.
//! - Coordinates without a common period, or with one that would take more than 4096 texels along an edge.
//! - What is in a branch that may be there for a hole in its domain, and what each round of a loop computes anew.
//! - Where other users still need all of the samples, so that there would be one more.
//! - `bake` of little work, of coordinates outside of 0..1, and in branches, where there is no implicit level of detail.
//! - Where the stage would sample more textures than WebGPU's default limit.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail", 2003, section 2.1
//! (texture collapse, figure 3) and 3.1 (names of generated textures); Brian Guenter, Todd Knoblock, Erik Ruf,
//! "Specializing Shaders", 1995 (values of coordinates, computed beforehand).

mod plan;
mod seen;

use crate::cost::{self, SAMPLE_WEIGHT};
use crate::facts::TextureFacts;
use crate::flow::{Flow, Value};
use crate::operands;
use crate::recipe::{Candidate, Class, Considered, Declined, Pass};
use crate::shader::{Shader, Stage, ValueId};
use crate::{Facts, Work};
use naga::{Expression, SampleLevel};
use plan::{MOST_EDGE, MOST_RESAMPLED, Plan, is_operation};
use seen::{Of, Sample, sample, seen_from};
use std::fmt;

/// The stage whose samples are collapsed.
const STAGE: Stage = Stage::Fragment;

/// How many textures a stage may sample: WebGPU's default `maxSampledTexturesPerShaderStage`.
pub const MOST_TEXTURES: usize = 16;

/// The pass.
pub struct TextureCollapse;

/// What makes texels of values: coordinates, and what chooses a layer of arrays.
type Root = (Value, Option<Value>);

/// How a value is collapsed: the words of this pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Same,
    Levels,
    /// With so many texels along the longest edge at most.
    Resampled(u32),
    /// With so many texels along each edge.
    Bake(u32),
}

impl Kind {
    fn word(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Levels => "levels",
            Self::Resampled(_) => "resampled",
            Self::Bake(_) => "bake",
        }
    }
}

/// A choice, read: the kind, and the ids of values.
struct Choice {
    kind: Kind,
    root: ValueId,
    /// Of an array.
    layer: Option<ValueId>,
}

impl Choice {
    fn parse(choice: &str) -> Result<Self, Declined> {
        let number = |edge: &str| edge.parse().ok();
        let words: Vec<&str> = choice.split(' ').collect();
        let read = match words[..] {
            ["same", root, ref rest @ ..] => Some((Kind::Same, root, rest)),
            ["levels", root, ref rest @ ..] => Some((Kind::Levels, root, rest)),
            ["resampled", root, edge, ref rest @ ..] => {
                number(edge).map(|edge| (Kind::Resampled(edge), root, rest))
            }
            ["bake", root, edge] => number(edge).map(|edge| (Kind::Bake(edge), root, &[][..])),
            _ => None,
        };
        let (kind, root, rest) = read
            .filter(|(_, _, rest)| rest.len() < 2)
            .ok_or_else(|| Declined(format!("texture-collapse has no choice `{choice}`")))?;
        Ok(Self {
            kind,
            root: ValueId::from(root),
            layer: rest.first().map(|layer| ValueId::from(*layer)),
        })
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, root, layer } = self;
        write!(f, "{} {root}", kind.word())?;
        if let Kind::Resampled(edge) | Kind::Bake(edge) = kind {
            write!(f, " {edge}")?;
        }
        match layer {
            Some(layer) => write!(f, " {layer}"),
            None => Ok(()),
        }
    }
}

impl Pass for TextureCollapse {
    fn name(&self) -> &'static str {
        "texture-collapse"
    }

    fn summary(&self) -> &'static str {
        "texture samples and what is done to them become one sample of a new texture"
    }

    fn class(&self, candidate: &Candidate) -> Class {
        match Choice::parse(&candidate.choice).map(|choice| choice.kind) {
            Ok(Kind::Same) => Class::Lossless,
            Ok(Kind::Levels | Kind::Resampled(_)) => Class::ResolutionLossless,
            Ok(Kind::Bake(_)) | Err(_) => Class::Lossy,
        }
    }

    fn consider(&self, shader: &Shader, facts: &Facts) -> Vec<Considered> {
        match Flow::new(shader, STAGE) {
            Some(flow) => consider(&flow, facts),
            None => Vec::new(),
        }
    }

    fn applies(&self, shader: &Shader, candidate: &Candidate) -> Result<(), Declined> {
        let flow = stage(shader, candidate)?;
        Plan::of_candidate(&flow, candidate).map(drop)
    }

    fn apply(&self, shader: &Shader, candidate: &Candidate) -> Shader {
        let made = stage(shader, candidate)
            .and_then(|flow| Ok(Plan::of_candidate(&flow, candidate)?.make(&flow)));
        match made {
            Ok(made) => made,
            Err(declined) => panic!("{candidate} was applied, but {declined}"),
        }
    }
}

/// Whether all samples of a candidate are at its root, so that each texel of the new texture is one of the sources'.
pub fn is_texel_by_texel(candidate: &Candidate) -> bool {
    let kind = Choice::parse(&candidate.choice).map(|choice| choice.kind);
    candidate.pass == TextureCollapse.name() && matches!(kind, Ok(Kind::Same | Kind::Levels))
}

fn stage<'a>(shader: &'a Shader, candidate: &Candidate) -> Result<Flow<'a>, Declined> {
    candidate.baked(0)?;
    Flow::new(shader, STAGE).ok_or_else(|| Declined("there is no fragment stage".into()))
}

fn find(flow: &Flow, id: &ValueId) -> Result<Value, Declined> {
    match flow.shader.find(id) {
        Some((STAGE, value)) => Ok(value),
        Some(_) => Err(Declined(
            "only samples of the fragment stage are collapsed".into(),
        )),
        None => Err(Declined(format!("there is no value `{}`", id.path()))),
    }
}

/// All that this pass thinks of.
fn consider(flow: &Flow, facts: &Facts) -> Vec<Considered> {
    let values: Vec<Value> = flow.function.expressions.iter().map(|(v, _)| v).collect();
    let reads: Vec<(Value, Sample)> = values
        .iter()
        .filter_map(|value| Some((*value, sample(flow, *value)?)))
        .collect();
    let mut sampled: Vec<Value> = reads.iter().map(|(_, read)| read.coordinate).collect();
    sampled.sort_unstable();
    sampled.dedup();
    let mut layers: Vec<Value> = reads.iter().filter_map(|(_, read)| read.layer).collect();
    layers.sort_unstable();
    layers.dedup();
    let mut found: Vec<(Value, Considered)> = Vec::new();
    // For each value, the root and the layer that make texels of it.
    let mut root_of: Vec<Option<Root>> = vec![None; values.len()];
    // A larger period is for what has no smaller one, and an array for what needs more than a layer.
    let periods = periods(flow, &sampled);
    let flat = sampled.iter().chain(&periods).map(|root| (*root, None));
    let layered = layers.iter().flat_map(|layer| {
        let roots = sampled.iter().chain(&periods);
        roots.map(|root| (*root, Some(*layer)))
    });
    let first = sampled.len();
    for (at, (root, layer)) in flat.chain(layered).enumerate() {
        let of = seen_from(flow, root, layer);
        let is_texels = |value: Value| matches!(of[value.index()], Of::Texels { .. });
        let before = root_of.clone();
        for &value in values.iter().filter(|value| is_texels(**value)) {
            root_of[value.index()].get_or_insert((root, layer));
        }
        for site in largest(flow, &of, |of| matches!(of, Of::Texels { .. })) {
            if at >= first && before[site.index()].is_some() {
                continue;
            }
            let choices = match Plan::new(flow, site, (root, layer), &of) {
                Ok(plan) => choices(flow, &plan, facts),
                // A sample that nothing is done to is not worth a word.
                Err(_) if sample(flow, site).is_some() => Vec::new(),
                Err(why) => vec![(Kind::Same.word().to_owned(), Some(why))],
            };
            let choices = choices.into_iter();
            found.extend(choices.map(|(choice, why)| (site, candidate(flow, site, choice, why))));
        }
    }
    found.extend(apart(flow, &root_of));
    found.extend(procedural(flow, facts));
    found.sort_by(|(a, one), (b, other)| (a, &one.candidate).cmp(&(b, &other.candidate)));
    found.dedup();
    found
        .into_iter()
        .map(|(_, considered)| considered)
        .collect()
}

/// What a plan may be, each as its choice, or why not.
fn choices(flow: &Flow, plan: &Plan<'_>, facts: &Facts) -> Vec<(String, Option<Declined>)> {
    let kinds = known(flow, plan, facts).and_then(|()| match plan.kind {
        // Between the texels of the finer one, the coarser ones have bends.
        Kind::Same if !are_as_large(flow, plan, facts) => Ok(vec![Kind::Levels]),
        Kind::Resampled(_) => resolutions(flow, plan, facts),
        kind => Ok(vec![kind]),
    });
    match kinds {
        Ok(kinds) => {
            let kinds = kinds.into_iter();
            kinds
                .map(|kind| (plan.choice(flow, kind).to_string(), None))
                .collect()
        }
        Err(why) => vec![(plan.kind.word().to_owned(), Some(why))],
    }
}

/// What a resampled texture's longest edge may have at most: a texel for a pixel, where it is known how large the period is
/// on the screen, and all that its sources have.
fn resolutions(flow: &Flow, plan: &Plan<'_>, facts: &Facts) -> Result<Vec<Kind>, Declined> {
    let whole = plan
        .textures(flow)
        .zip(&plan.repeats)
        .map(|(name, repeats)| {
            let size = facts
                .textures
                .get(name)
                .map_or([0; 2], |texture| texture.size);
            let edges = size.iter().zip(repeats);
            edges.fold(1.0_f32, |most, (edge, times)| {
                most.max(*edge as f32 * times)
            })
        });
    let whole = whole.fold(1.0, f32::max).ceil() as u32;
    let fits = pixels_along(flow, plan.root, facts).map_or(whole, |pixels| {
        let pixels = pixels.clamp(1.0, MOST_RESAMPLED as f32) as u32;
        pixels.next_power_of_two().max(LEAST_EDGE)
    });
    let mut edges: Vec<u32> = [fits.min(whole), whole]
        .into_iter()
        .filter(|edge| *edge <= MOST_RESAMPLED)
        .collect();
    edges.dedup();
    match edges.is_empty() {
        true => Err(Declined(format!(
            "one period of its coordinates has {whole} texels along an edge, and {MOST_RESAMPLED} is the most"
        ))),
        false => Ok(edges.into_iter().map(Kind::Resampled).collect()),
    }
}

/// How many pixels the screen has, at the facts' distance, where coordinates go from 0 to 1, when these are an affine
/// function of texture coordinates of the mesh.
fn pixels_along(flow: &Flow, root: Value, facts: &Facts) -> Option<f32> {
    let pixels = facts.pixels_per_coordinate?;
    inputs(flow).find_map(|input| {
        let Of::Affine(rows) = &seen_from(flow, input, None)[root.index()] else {
            return None;
        };
        let [[a, b, _], [c, d, _]] = rows[..] else {
            return None;
        };
        let area = (a * d - b * c).abs();
        (area > 0.0).then(|| pixels / area.sqrt())
    })
}

/// What may be texture coordinates of the mesh.
fn inputs<'f>(flow: &'f Flow<'_>) -> impl Iterator<Item = Value> + 'f {
    let values = flow.function.expressions.iter().map(|(value, _)| value);
    values.filter(|v| flow.input(*v).is_some() && flow.floats(*v) == Some(2))
}

/// Two floats that nobody samples at, which coordinates are computed of by arithmetic: where these have a common period, it
/// is one of those.
fn periods(flow: &Flow, sampled: &[Value]) -> Vec<Value> {
    let mut found = Vec::new();
    let mut seen = vec![false; flow.function.expressions.len()];
    let mut left: Vec<Value> = sampled.to_vec();
    while let Some(value) = left.pop() {
        if std::mem::replace(&mut seen[value.index()], true) {
            continue;
        }
        let expression = &flow.function.expressions[value];
        let is_computed = matches!(
            expression,
            Expression::Binary { .. }
                | Expression::Unary { .. }
                | Expression::Compose { .. }
                | Expression::Splat { .. }
                | Expression::Swizzle { .. }
        );
        let is_part = matches!(expression, Expression::AccessIndex { .. });
        if flow.floats(value) == Some(2) && !is_computed {
            found.push(value);
        } else if is_computed || (is_part && flow.floats(value) == Some(1)) {
            operands::each(expression, |operand| left.push(operand));
        }
    }
    found.retain(|value| !sampled.contains(value));
    found.sort_unstable();
    found
}

fn candidate(flow: &Flow, site: Value, choice: String, declined: Option<Declined>) -> Considered {
    Considered {
        candidate: Candidate {
            pass: TextureCollapse.name().into(),
            site: flow.id(site).clone(),
            choice,
            value: Vec::new(),
        },
        declined,
    }
}

/// The largest floats that are seen so: those that something else uses.
fn largest(flow: &Flow, of: &[Of], is: fn(&Of) -> bool) -> Vec<Value> {
    let values: Vec<Value> = flow.function.expressions.iter().map(|(v, _)| v).collect();
    let mut absorbed = vec![false; values.len()];
    let mut found = Vec::new();
    for &value in values.iter().rev() {
        if !is(&of[value.index()]) {
            continue;
        }
        let mut users = flow.users(value).peekable();
        let inner = !flow.is_stated(value)
            && users.peek().is_some()
            && users.all(|user| absorbed[user.index()]);
        let is_float = flow.floats(value).is_some();
        absorbed[value.index()] = inner || is_float;
        if is_float && !inner {
            found.push(part_of(flow, value, of, is));
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// The vector that a value is no more than a part of.
fn part_of(flow: &Flow, mut value: Value, of: &[Of], is: fn(&Of) -> bool) -> Value {
    loop {
        let whole = match flow.function.expressions[value] {
            Expression::AccessIndex { base, .. } => base,
            Expression::Swizzle { vector, .. } => vector,
            _ => return value,
        };
        if flow.floats(whole).is_none() || !is(&of[whole.index()]) {
            return value;
        }
        value = whole;
    }
}

/// Declines what is not known of the textures of a plan, or asks for too many.
fn known(flow: &Flow, plan: &Plan<'_>, facts: &Facts) -> Result<(), Declined> {
    for name in plan.textures(flow) {
        match facts.textures.get(name) {
            None => {
                return Err(Declined(format!(
                    "`{name}` is dynamic: it may hold anything"
                )));
            }
            Some(TextureFacts { mean, .. }) if mean.is_empty() => {
                return Err(Declined(format!("draws have different images of `{name}`")));
            }
            Some(_) => {}
        }
    }
    let given = plan
        .samples
        .iter()
        .any(|(_, read)| matches!(read.level, SampleLevel::Zero | SampleLevel::Exact(_)));
    if given && !are_as_large(flow, plan, facts) {
        let why = "a level of detail that is given means another size in each of its textures";
        return Err(Declined(why.into()));
    }
    let mut layers = plan
        .layered(flow)
        .filter_map(|name| facts.textures.get(name))
        .map(|texture| texture.layers);
    let first = layers.next();
    if layers.any(|layers| Some(layers) != first) {
        return Err(Declined(
            "its arrays differ in how many layers they have".into(),
        ));
    }
    if let Kind::Resampled(_) = plan.kind {
        let sampler = plan
            .samples
            .first()
            .and_then(|(_, read)| flow.global(read.sampler));
        let name = sampler.and_then(|sampler| flow.module.global_variables[sampler].name.as_ref());
        if !name.is_some_and(|name| facts.repeating.contains(name)) {
            return Err(Declined("its sampler does not repeat".into()));
        }
    }
    has_room(flow, plan)
}

/// Whether all textures of a plan are as large as each other, level by level.
fn are_as_large(flow: &Flow, plan: &Plan<'_>, facts: &Facts) -> bool {
    let known = plan.textures(flow);
    let mut sizes = known
        .filter_map(|name| facts.textures.get(name))
        .map(|texture| (texture.size, texture.mean.len()));
    let first = sizes.next();
    sizes.all(|size| Some(size) == first)
}

/// Declines what would make a stage sample too many textures.
fn has_room(flow: &Flow, plan: &Plan<'_>) -> Result<(), Declined> {
    let sampled = plan.make(flow).sampled_textures();
    if sampled > MOST_TEXTURES && sampled > flow.shader.sampled_textures() {
        return Err(Declined(format!(
            "the stage would sample {sampled} textures, and WebGPU's default limit is {MOST_TEXTURES}"
        )));
    }
    Ok(())
}

/// Values of samples that are at unrelated coordinates.
fn apart(flow: &Flow, root_of: &[Option<Root>]) -> Vec<(Value, Considered)> {
    let values = flow.function.expressions.iter().map(|(value, _)| value);
    values
        .filter(|value| root_of[value.index()].is_none() && flow.floats(*value).is_some())
        .filter(|value| is_operation(flow, *value))
        .filter_map(|value| {
            let (mut roots, mut others) = (Vec::new(), false);
            operands::each(&flow.function.expressions[value], |operand| {
                match root_of[operand.index()] {
                    Some(root) => roots.push(root),
                    None => others |= !flow.is_constant(operand),
                }
            });
            roots.sort_unstable();
            roots.dedup();
            let mut coordinates = roots.iter().map(|(root, _)| root);
            let first = coordinates.next();
            let why = match coordinates.all(|other| Some(other) == first) {
                true => "its textures are read in different layers",
                false => "its textures are read at coordinates without a common period",
            };
            (roots.len() > 1 && !others).then(|| {
                let declined = Some(Declined(why.into()));
                (
                    value,
                    candidate(flow, value, Kind::Resampled(0).word().into(), declined),
                )
            })
        })
        .collect()
}

/// The largest values of texture coordinates alone that are worth a sample, with the edge that gives a texel a pixel, and
/// with half of it.
fn procedural(flow: &Flow, facts: &Facts) -> Vec<(Value, Considered)> {
    let Ok(types) = cost::types(flow.module, flow.function) else {
        return Vec::new();
    };
    let works: Vec<Work> = cost::of_expressions(flow.module, &flow.function.expressions, &types);
    let mut found = Vec::new();
    for root in inputs(flow) {
        let of = seen_from(flow, root, None);
        for site in largest(flow, &of, |of| *of == Of::Function) {
            let edge = facts.pixels_per_coordinate.map_or(LEAST_EDGE, |pixels| {
                let pixels = pixels.clamp(1.0, MOST_EDGE as f32) as u32;
                pixels.next_power_of_two().clamp(LEAST_EDGE, MOST_EDGE)
            });
            let plan = Plan::procedural(flow, (site, root), &of, edge);
            let is_worth_it = match &plan {
                Ok(plan) => plan.work(&works) >= SAMPLE_WEIGHT,
                Err(_) => is_operation(flow, site),
            };
            if !is_worth_it {
                continue;
            }
            match plan.and_then(|plan| may_be_baked(flow, (&plan, root), facts).map(|()| plan)) {
                Ok(plan) => found.extend([edge, edge / 2].map(|edge| {
                    let choice = plan.choice(flow, Kind::Bake(edge)).to_string();
                    (site, candidate(flow, site, choice, None))
                })),
                Err(why) => {
                    let choice = Kind::Bake(edge).word().to_owned();
                    found.push((site, candidate(flow, site, choice, Some(why))));
                }
            }
        }
    }
    found
}

/// The shortest edge of a texture whose resolution is chosen, in texels. Half of it is tried too of a value without a texture.
const LEAST_EDGE: u32 = 16;

/// How far beyond 0..1 coordinates may go, as interpolation rounds them.
const BEYOND: f32 = 1e-3;

/// Declines a value whose coordinates leave the texture, or of which it is not known how large it is on the screen.
fn may_be_baked(
    flow: &Flow,
    (plan, root): (&Plan<'_>, Value),
    facts: &Facts,
) -> Result<(), Declined> {
    let no = |why: &str| Err(Declined(why.into()));
    if facts.pixels_per_coordinate.is_none() {
        return no("it is not known how large its coordinates are on the screen");
    }
    let inside = facts.values.get(flow.id(root)).is_some_and(|seen| {
        let least = seen.min.iter().all(|min| *min >= -BEYOND);
        least && seen.max.iter().all(|max| *max <= 1.0 + BEYOND)
    });
    if !inside {
        return no("its coordinates were seen outside of 0..1, or not at all");
    }
    has_room(flow, plan)
}
