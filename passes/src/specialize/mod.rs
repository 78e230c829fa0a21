//! specialize: what the scene fixes is folded into the shader, and what that leaves without effect goes.
//!
//! Precondition. For `fixed`, the site is a load of a uniform, or of a read-only storage buffer, in either stage, and
//! the scene states what is there: the facts hold its words. Behind an index that varies all elements hold the same.
//! For `absent`, the site is an operation on floats of which an operand is known to be 0 or 1, in every component.
//!
//! Effect. `fixed <place>`: every load of that place becomes the constant that the candidate bakes, bit for bit; normal
//! form then folds what is made of constants, so that a test of a flag goes with the side that is not taken, and a loop
//! that has no round with its body. The site is the first of the loads; the place reads like
//! `lighting.lights[*].intensity`. Integers are not baked, as that is for floats, but stand behind the place: `fixed material.flags 5u`. `absent`: `x * 0` becomes 0, `x * 1`, `x / 1`, `x + 0`, `x - 0` and `mix(x, y, 0)` become `x`,
//! and so for the other order, `mix(x, y, 1)`, `fma` and `dot`. What fed the part that goes is dropped, unless something else needs it.
//! `branch <number>`: where a number of the draw is 0, `x * number` is 0, `mix(x, y, number)` is `x`, and what is computed for
//! nothing else is not computed: it goes into a branch on the number, with the operation. `branch-at-one <number>`: the
//! same of a `mix` that is `y` where the number is 1. `branch <condition>` of a `select`: each side is computed where it is chosen.
//!
//! Error. None: constants are folded by the table that the evaluator runs on. What `absent` leaves out may differ in the sign of a
//! zero, as may what `branch` does. 0 times an infinity or a NaN is a NaN; that a picture would show it is what the samples tell.
//!
//! Declines.
//! - A uniform that the scene samples, computes for each picture, takes from a model or a name, or calls dynamic:
//!   it is not thought of.
//! - A constant that an operation cannot take: a division by 0, an index beyond the end.
//! - `absent` where what would be multiplied by 0 was seen infinite or undefined, or was not seen. This needs facts, so it is
//!   decided when candidates are listed, not when they are replayed. `branch` of a product or a `mix` that was seen infinite or undefined.
//! - `branch` on a number that the samples do not show to be 0, or 1, at times, or that the scene fixes; for little work; and for what
//!   is needed elsewhere, or goes through variables. A derivative, and a sample with an implicit level, stays where it is unless compilers see
//!   that the branch is the same for all fragments.
//!
//! This work is based on: Neil D. Jones, Carsten K. Gomard, Peter Sestoft, "Partial Evaluation and Automatic Program
//! Generation", 1993, chapter 1; Brian Guenter, Todd B. Knoblock, Erik Ruf, "Specializing Shaders", 1995.

mod absent;
mod branch;
pub(crate) mod place;

use crate::edit::{Edit, New};
use crate::flow::{Flow, Value};
use crate::recipe::{Candidate, Class, Considered, Declined, Pass};
use crate::semantics::Shape;
use crate::shader::{Shader, Stage, ValueId};
use crate::{Facts, constants};
use absent::Absent;
use branch::{Branch, Off, Switch};
use naga::{Expression, Handle, ScalarKind};
use place::Place;

/// The stages that are specialised, each by itself.
const STAGES: [Stage; 2] = [Stage::Fragment, Stage::Vertex];

/// The pass.
pub struct Specialize;

/// What is done at a site: the only place where the words of this pass are read.
enum Choice<'a> {
    /// Loads of this place become a constant: of these integers, or of the floats that the candidate bakes.
    Fixed(&'a str, Vec<u32>),
    /// An operation does without what a 0 or a 1 makes pointless.
    Absent,
    /// An operation is done in a branch on a value.
    Branch(Off, ValueId),
}

impl<'a> Choice<'a> {
    fn parse(choice: &'a str) -> Result<Self, Declined> {
        let unknown = || Declined(format!("specialize has no choice `{choice}`"));
        let mut parts = choice.split(' ');
        match (parts.next(), parts.next()) {
            (Some("fixed"), Some(place)) => {
                let integers = parts.map(integer).collect::<Option<_>>();
                Ok(Self::Fixed(place, integers.ok_or_else(unknown)?))
            }
            (Some("absent"), None) => Ok(Self::Absent),
            (Some(word), Some(value)) if parts.next().is_none() => {
                let mut all = Off::ALL.into_iter();
                let off = all.find(|off| off.word() == word).ok_or_else(unknown)?;
                Ok(Self::Branch(off, value.into()))
            }
            _ => Err(unknown()),
        }
    }

    /// The words of a choice that fixes a place, and what is baked beside them.
    fn fixed(place: &str, kind: ScalarKind, words: Vec<u32>) -> (String, Vec<u32>) {
        let sign = match kind {
            ScalarKind::Float => return (format!("fixed {place}"), words),
            ScalarKind::Sint => 'i',
            _ => 'u',
        };
        let mut choice = format!("fixed {place}");
        for word in words {
            let number = match kind {
                ScalarKind::Sint => i64::from(word.cast_signed()),
                _ => i64::from(word),
            };
            choice.push_str(&format!(" {number}{sign}"));
        }
        (choice, Vec::new())
    }
}

/// The bits of an integer as WGSL writes it: `5u`, `-2i`.
fn integer(text: &str) -> Option<u32> {
    match text.strip_suffix('u') {
        Some(digits) => digits.parse().ok(),
        None => {
            let number: i32 = text.strip_suffix('i')?.parse().ok()?;
            Some(number.cast_unsigned())
        }
    }
}

impl Pass for Specialize {
    fn name(&self) -> &'static str {
        "specialize"
    }

    fn summary(&self) -> &'static str {
        "what the scene fixes is folded, and what that leaves without effect goes"
    }

    fn class(&self, _: &Candidate) -> Class {
        Class::Lossless
    }

    fn is_exact(&self) -> bool {
        true
    }

    fn consider(&self, shader: &Shader, facts: &Facts) -> Vec<Considered> {
        let flows = STAGES.iter().filter_map(|stage| Flow::new(shader, *stage));
        flows.flat_map(|flow| of_stage(&flow, facts)).collect()
    }

    fn applies(&self, shader: &Shader, candidate: &Candidate) -> Result<(), Declined> {
        plan(shader, candidate).map(drop)
    }

    fn apply(&self, shader: &Shader, candidate: &Candidate) -> Shader {
        match plan(shader, candidate) {
            Ok((flow, plan)) => {
                let mut edit = Edit::new(shader, flow.stage);
                plan.make(&flow, &mut edit);
                edit.finish()
            }
            Err(declined) => panic!("{candidate} was applied, but {declined}"),
        }
    }
}

/// What the pass thinks of in a stage.
fn of_stage(flow: &Flow<'_>, facts: &Facts) -> Vec<Considered> {
    let mut found = Vec::new();
    let mut consider = |site: Value, (choice, value), verdict: Result<(), Declined>| {
        let declined = verdict.err();
        found.push(Considered {
            candidate: Candidate {
                pass: Specialize.name().into(),
                site: flow.id(site).clone(),
                choice,
                value,
            },
            declined,
        });
    };
    let mut places: Vec<String> = Vec::new();
    for (site, _) in flow.function.expressions.iter() {
        let Some(place) = Place::loaded(flow, site) else {
            continue;
        };
        if places.contains(&place.path) {
            continue;
        }
        if let Some(words) = place.words(facts) {
            let loads = loads(flow, &place.path);
            let verdict = becomes_constant(flow, &loads, &words);
            let kind = Shape::of(flow.inner(site)).map_or(ScalarKind::Float, Shape::kind);
            let (choice, value) = Choice::fixed(&place.path, kind, words);
            let value = if verdict.is_ok() { value } else { Vec::new() };
            consider(site, (choice, value), verdict);
        }
        places.push(place.path);
    }
    for (site, _) in flow.function.expressions.iter() {
        if let Some(absent) = Absent::of(flow, site) {
            let verdict = absent.is_harmless(flow, facts);
            consider(site, ("absent".into(), Vec::new()), verdict);
        }
    }
    // The vertices' work is not measured, so nothing says that a branch saves some.
    let study = (flow.stage == Stage::Fragment)
        .then(|| branch::Study::new(flow))
        .flatten();
    let sites = flow.function.expressions.iter();
    for (site, study) in sites.filter_map(|(site, _)| Some((site, study.as_ref()?))) {
        for switch in study.switches(site) {
            if !study.is_seen_off(&switch, facts) {
                continue;
            }
            let verdict = match study.branch(site, &switch) {
                Ok(None) => continue,
                Ok(Some(_)) => study.is_harmless(site, facts),
                Err(declined) => Err(declined),
            };
            let choice = format!("{} {}", switch.off.word(), flow.id(switch.value));
            consider(site, (choice, Vec::new()), verdict);
        }
    }
    found
}

/// A shader with changes of this pass made to it but for branches, all at once: those that apply to it as it is, at any load of their
/// places. What they leave draws as one after another would; its values may be named otherwise.
pub fn together(shader: &Shader, candidates: &[Candidate]) -> Shader {
    let mut shader = shader.clone();
    for stage in STAGES {
        let of_stage = candidates
            .iter()
            .filter(|c| self::stage(&shader, c) == Some(stage));
        let Some(flow) = Flow::new(&shader, stage).filter(|_| of_stage.clone().next().is_some())
        else {
            continue;
        };
        let mut edit = Edit::new(&shader, stage);
        for candidate in of_stage {
            let plan = match Choice::parse(&candidate.choice) {
                Ok(Choice::Fixed(path, integers)) => {
                    fold(&flow, loads(&flow, path), &integers, &candidate.value).map(Plan::Replace)
                }
                // One leaves the other's values elsewhere.
                Ok(Choice::Branch(..)) => continue,
                _ => plan(&shader, candidate).map(|(_, plan)| plan),
            };
            if let Ok(plan) = plan {
                plan.make(&flow, &mut edit);
            }
        }
        shader = edit.finish();
    }
    shader
}

/// The stage that a change is one of, by the path of its site, which need not be there any more.
pub fn stage(shader: &Shader, candidate: &Candidate) -> Option<Stage> {
    let name = candidate.site.path().split('.').next();
    let mut stages = STAGES.into_iter();
    stages.find(|stage| shader.entry_point(*stage).map(|entry| entry.name.as_str()) == name)
}

/// The place that a change folds and what is there, for people: `material.flags` and `5`, `sun.colour` and `[1, 0.5, 0.5]`;
/// `None` for other changes.
pub fn folded(candidate: &Candidate) -> Option<(String, String)> {
    if candidate.pass != Specialize.name() {
        return None;
    }
    let Ok(Choice::Fixed(path, _)) = Choice::parse(&candidate.choice) else {
        return None;
    };
    let integers = candidate.choice.split(' ').skip(2);
    let mut numbers: Vec<String> = integers
        .map(|number| number.trim_end_matches(['u', 'i']).to_owned())
        .collect();
    numbers.extend(candidate.numbers().map(|number| number.to_string()));
    let value = match &numbers[..] {
        [one] => one.clone(),
        several => format!("[{}]", several.join(", ")),
    };
    Some((path.to_owned(), value))
}

/// The number or condition on which a change puts an operation into a branch; `None` for other changes.
pub fn branched(candidate: &Candidate) -> Option<ValueId> {
    if candidate.pass != Specialize.name() {
        return None;
    }
    match Choice::parse(&candidate.choice) {
        Ok(Choice::Branch(_, value)) => Some(value),
        _ => None,
    }
}

/// The place of a uniform or read-only storage buffer that a value of the fragment stage loads, such as
/// `lighting.lights[*].intensity`, where `[*]` stands for an index that varies.
pub fn place(shader: &Shader, value: Handle<Expression>) -> Option<String> {
    Some(Place::loaded(&Flow::new(shader, Stage::Fragment)?, value)?.path)
}

/// What a candidate does.
enum Plan {
    /// It replaces values.
    Replace(Vec<(Value, New)>),
    /// It puts an operation into a branch.
    Branch(Branch),
}

impl Plan {
    fn make(self, flow: &Flow<'_>, edit: &mut Edit<'_>) {
        match self {
            Self::Replace(changes) => {
                for (value, new) in changes {
                    edit.replace(value, new);
                }
            }
            Self::Branch(branch) => branch.make(flow, edit),
        }
    }
}

/// The stage that a candidate changes, and what it does there, or why it does not apply.
fn plan<'a>(shader: &'a Shader, candidate: &Candidate) -> Result<(Flow<'a>, Plan), Declined> {
    let choice = Choice::parse(&candidate.choice)?;
    let (stage, site) = shader
        .find(&candidate.site)
        .ok_or_else(|| Declined(format!("there is no value `{}`", candidate.site.path())))?;
    let flow = (STAGES.contains(&stage))
        .then(|| Flow::new(shader, stage))
        .flatten()
        .ok_or_else(|| Declined("only what vertices and fragments do is specialised".into()))?;
    let plan = match choice {
        Choice::Fixed(path, integers) => {
            if Place::loaded(&flow, site).is_none_or(|place| place.path != path) {
                return Err(Declined(format!("it is no load of `{path}`")));
            }
            Plan::Replace(fold(
                &flow,
                loads(&flow, path),
                &integers,
                &candidate.value,
            )?)
        }
        Choice::Absent => {
            if !candidate.value.is_empty() {
                return Err(Declined("it bakes no numbers".into()));
            }
            let absent = Absent::of(&flow, site)
                .ok_or_else(|| Declined("no 0 or 1 makes a part of it pointless".into()))?;
            let change = (site, absent.becomes(&flow, site));
            Plan::Replace(vec![change])
        }
        Choice::Branch(off, value) => {
            if !candidate.value.is_empty() {
                return Err(Declined("it bakes no numbers".into()));
            }
            let no = || {
                let path = value.path();
                Declined(format!("there is no branch on `{path}` to put it into"))
            };
            let study = branch::Study::new(&flow).ok_or_else(no)?;
            let mut switches = study.switches(site).into_iter();
            let is_it =
                |switch: &Switch| switch.off == off && flow.id(switch.value).path() == value.path();
            let switch = switches.find(is_it).ok_or_else(no)?;
            let branch = study.branch(site, &switch)?;
            Plan::Branch(branch.ok_or_else(no)?)
        }
    };
    Ok((flow, plan))
}

/// What loads become: these integers, or what is baked beside them.
fn fold(
    flow: &Flow,
    loads: Vec<Value>,
    integers: &[u32],
    baked: &[u32],
) -> Result<Vec<(Value, New)>, Declined> {
    let is_float = loads.iter().all(|load| flow.is_float(*load));
    let words = match integers.is_empty() {
        true if is_float => baked,
        false if !is_float && baked.is_empty() => integers,
        _ => return Err(Declined("it bakes numbers of another kind".into())),
    };
    becomes_constant(flow, &loads, words)?;
    let constant = |load| (load, New::Words(words.to_vec()));
    Ok(loads.into_iter().map(constant).collect())
}

/// The loads of a place, in arena order.
fn loads(flow: &Flow, path: &str) -> Vec<Value> {
    let values = flow.function.expressions.iter().map(|(value, _)| value);
    values
        .filter(|value| Place::loaded(flow, *value).is_some_and(|place| place.path == path))
        .collect()
}

/// Checks that loads may become a constant of these words.
fn becomes_constant(flow: &Flow, loads: &[Value], words: &[u32]) -> Result<(), Declined> {
    for load in loads {
        let shape = Shape::of(flow.inner(*load))
            .ok_or_else(|| Declined("it is no number, vector or matrix of 32 bits".into()))?;
        if shape.components() != words.len() {
            return Err(Declined(format!(
                "it bakes {} numbers, but the value has {}",
                words.len(),
                shape.components()
            )));
        }
        if shape.kind() == ScalarKind::Float
            && !words.iter().all(|word| f32::from_bits(*word).is_finite())
        {
            return Err(Declined("it bakes a number that is not finite".into()));
        }
    }
    let become_constant = loads.iter().map(|load| (*load, words.to_vec()));
    constants::follow_words(flow, become_constant)
}

/// Whether a value is a load, which a place may be read by.
fn pointer(flow: &Flow, value: Value) -> Option<Value> {
    match flow.function.expressions[value] {
        Expression::Load { pointer } => Some(pointer),
        _ => None,
    }
}
