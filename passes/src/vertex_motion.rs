//! vertex-motion: a value of the fragment stage is computed in the vertex stage, and interpolated.
//!
//! Precondition. The site is a float of the fragment stage, or a vector of them, that is computed of inputs, uniforms,
//! textures and constants; the vertex stage is the user's own, hands those inputs over, and there is room for another.
//!
//! Effect. All that computes the value is copied to the end of the vertex stage, which hands the value over as another
//! output; the users of the site use that input. Loops and branches are copied with the variables that they work on. What
//! several moved values share is computed once, a loop that they need as well (see `lockstep`). A texture is read
//! with an explicit level there, which the candidate carries for each read whose level was implicit: at first the level
//! that the distance leads to; a search finds better ones.
//! - `flat`: it is the same for a whole triangle, and is handed over as it is.
//! - `affine`: it is an affine function of what is interpolated, so that it may be interpolated itself.
//! - `interpolate`: it is something else.
//! - `interpolate-and-normalise`: it is a direction, and made a unit one again.
//!
//! When no location is free, it goes behind a value that has been moved before and is handed over in the same way, into one vector.
//!
//! Error. `flat` has none. `affine` rounds at the vertices and when it is interpolated, instead of when it is computed:
//! a few units in the last place of the largest number that goes into it. The others have what the picture shows, on the
//! mesh at hand; a finer mesh makes it smaller.
//!
//! Declines.
//! - What fragments alone know is in it: derivatives, the position, front-facing and the like.
//! - Flat inputs and others in one value: between triangles with other flat inputs it would mean nothing.
//! - A read with an implicit level of a depth texture, which takes no such level, and of a texture without an image, whose
//!   level is not known.
//! - What decides when a loop ends, a built-in output or what is written to memory; unless it is `flat` or `affine`, what
//!   decides about a `discard`: cut-outs would follow the triangles.
//! - A value that each round of a loop computes anew, or that a branch computes with variables, where the branch is not
//!   the same for the whole draw; one with a hole in its domain, behind a branch that may be there for the hole.
//! - Where the work that moves is no more than that of the interpolation, and where its only user could move as well and
//!   does to the interpolated value what it does to this one.
//!
//! This work is based on: Songfang Liang et al., "Automatic Generation of Levels of Detail for Shaders and Meshes", 2022,
//! section 4.1; Rui Wang et al., "Automatic Shader Simplification using Surface Signal Approximation", 2014, section 4.

use crate::cost::{self, FLAT_WEIGHT, INTERPOLATION_WEIGHT};
use crate::edit::{Edit, New, floats, part};
use crate::flow::{Flow, Value};
use crate::interface::{self, Output, Roomy};
use crate::rate::{Rate, Rates, Surface};
use crate::recipe::{Candidate, Class, Considered, Declined, Pass};
use crate::shader::{Shader, Stage};
use crate::slice::{Around, Slice, Source};
use crate::{Facts, Work, lockstep, operands};
use naga::{
    BinaryOperator as Op, Binding, Expression, FunctionArgument, Handle, ImageClass, Interpolation,
    Literal, MathFunction as Math, SampleLevel, Statement, Type, TypeInner, UnaryOperator,
};
use std::collections::BTreeMap;

/// The pass.
pub struct VertexMotion;

/// How a value is handed over: the words of this pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Choice {
    Flat,
    Affine,
    Interpolate,
    InterpolateAndNormalise,
}

impl Choice {
    const ALL: [Self; 4] = [
        Self::Flat,
        Self::Affine,
        Self::Interpolate,
        Self::InterpolateAndNormalise,
    ];

    fn word(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Affine => "affine",
            Self::Interpolate => "interpolate",
            Self::InterpolateAndNormalise => "interpolate-and-normalise",
        }
    }

    fn interpolation(self, surface: Surface) -> Interpolation {
        match (self, surface) {
            (Self::Flat, _) => Interpolation::Flat,
            (Self::Affine, Surface::Linear) => Interpolation::Linear,
            _ => Interpolation::Perspective,
        }
    }

    fn parse(word: &str) -> Result<Self, Declined> {
        let mut all = Self::ALL.into_iter();
        all.find(|choice| choice.word() == word)
            .ok_or_else(|| Declined(format!("vertex-motion has no choice `{word}`")))
    }
}

impl Pass for VertexMotion {
    fn name(&self) -> &'static str {
        "vertex-motion"
    }

    fn summary(&self) -> &'static str {
        "a value is computed for each vertex, and interpolated"
    }

    fn class(&self, candidate: &Candidate) -> Class {
        match Choice::parse(&candidate.choice) {
            Ok(Choice::Flat | Choice::Affine) => Class::Lossless,
            _ => Class::Lossy,
        }
    }

    fn consider(&self, shader: &Shader, facts: &Facts) -> Vec<Considered> {
        let Some(flow) = Flow::new(shader, Stage::Fragment) else {
            return Vec::new();
        };
        Study::new(&flow).consider(facts)
    }

    fn with_numbers(&self, candidate: &Candidate, numbers: &[f32]) -> Option<Candidate> {
        // A level below 0 is the finest.
        let levels: Vec<f32> = numbers.iter().map(|level| level.max(0.0)).collect();
        (!levels.is_empty()).then(|| candidate.with(&candidate.choice, &levels))
    }

    fn applies(&self, shader: &Shader, candidate: &Candidate) -> Result<(), Declined> {
        let flow = site(shader, candidate)?.0;
        Study::new(&flow).plan(candidate).map(drop)
    }

    fn apply(&self, shader: &Shader, candidate: &Candidate) -> Shader {
        let planned = site(shader, candidate).and_then(|(flow, _)| {
            let study = Study::new(&flow);
            let plan = study.plan(candidate)?;
            Ok(study.make(&plan))
        });
        match planned {
            Ok(made) => made,
            Err(declined) => panic!("{candidate} was applied, but {declined}"),
        }
    }
}

/// The fragment stage, and the site in it.
fn site<'a>(shader: &'a Shader, candidate: &Candidate) -> Result<(Flow<'a>, Value), Declined> {
    let (stage, site) = shader
        .find(&candidate.site)
        .ok_or_else(|| Declined(format!("there is no value `{}`", candidate.site.path())))?;
    if stage != Stage::Fragment {
        return Err(Declined("it is computed for each vertex already".into()));
    }
    let flow = Flow::new(shader, stage);
    let flow = flow.ok_or_else(|| Declined("there is no fragment stage".into()))?;
    Ok((flow, site))
}

/// A shader that is looked at for values to move.
struct Study<'a> {
    flow: &'a Flow<'a>,
    rates: Rates,
    /// What the vertex stage hands over at each location.
    handed: BTreeMap<u32, (Handle<Type>, Option<Handle<Expression>>)>,
    /// For each value, whether a `discard` depends on it.
    discards: Vec<bool>,
}

/// A value that can be moved.
struct Movable<'a> {
    site: Value,
    slice: Slice<'a>,
    surface: Surface,
    exact: bool,
    /// The reads whose level is implicit.
    reads: Vec<Value>,
}

/// Where a value is handed over.
enum Room {
    /// At a location of its own.
    Free(u32),
    /// Behind another value, in one vector.
    Behind(Roomy),
}

/// What a candidate does.
struct Plan<'a> {
    movable: Movable<'a>,
    choice: Choice,
    room: Room,
    /// The level of each read whose level was implicit.
    levels: Vec<f32>,
}

impl<'a> Study<'a> {
    fn new(flow: &'a Flow<'a>) -> Self {
        let shader = flow.shader;
        let returned = interface::returned(shader).into_iter();
        let handed = returned.filter_map(|part| {
            let location = interface::location(part.binding.as_ref())?;
            Some((location, (part.ty, part.value)))
        });
        Self {
            handed: handed.collect(),
            rates: Rates::of(shader, Stage::Fragment).expect("a flow is of a stage that is there"),
            discards: discards(flow),
            flow,
        }
    }

    /// A value that can be moved, or why not.
    fn movable(&self, site: Value) -> Result<Movable<'a>, Declined> {
        let flow = self.flow;
        let no = |why: &str| Err(Declined(why.into()));
        if flow.shader.index(Stage::Vertex).is_none() {
            return no("the vertex stage is not the user's own");
        }
        if flow.floats(site).is_none() {
            return no("it is no float, or vector of floats");
        }
        if flow.is_constant(site) || self.rates.exactly(site) == Rate::Constant {
            return no("it is a constant");
        }
        if flow.input(site).is_some() {
            return no("it is handed over by the vertex stage as it is");
        }
        if let Some(stop) = self.rates.varies(site).screen {
            return Err(Declined(format!(
                "{} is known for fragments alone",
                stop.why
            )));
        }
        if let Some(why) = flow.decides(site) {
            return Err(Declined(why.to_string()));
        }
        let slice = Slice::of(flow, site);
        let (mut flat, mut smooth) = (false, false);
        let mut reads = Vec::new();
        for value in slice.values() {
            if let Some(binding) = flow.input(value) {
                self.handed(value, binding)?;
                match binding {
                    Binding::Location {
                        interpolation: Some(Interpolation::Flat),
                        ..
                    } => flat = true,
                    _ => smooth = true,
                }
                continue;
            }
            match flow.function.expressions[value] {
                Expression::FunctionArgument(_) => {
                    return no("an input is used as a whole structure");
                }
                Expression::Derivative { .. } => return no("it takes a derivative"),
                Expression::ImageSample {
                    image,
                    level: SampleLevel::Auto | SampleLevel::Bias(_),
                    clamp_to_edge,
                    ..
                } => {
                    if clamp_to_edge || !is_of_colours(flow.inner(image)) {
                        return no("it reads a texture that takes no explicit level");
                    }
                    reads.push(value);
                }
                _ => {}
            }
        }
        let varies = self.rates.varies(site);
        let exact = self.rates.exactly(site) <= Rate::Vertex;
        if flat && (smooth || !exact) {
            return no("flat inputs are in it, and what varies over a triangle");
        }
        if !exact && self.discards[site.index()] {
            return no("a `discard` depends on it");
        }
        self.reached(&slice)?;
        Ok(Movable {
            surface: varies.surface,
            site,
            slice,
            exact,
            reads,
        })
    }

    /// The vertex stage's value for an input.
    fn handed(&self, value: Value, binding: &Binding) -> Result<Handle<Expression>, Declined> {
        let location = interface::location(Some(binding));
        let handed = location.and_then(|location| self.handed.get(&location));
        let types = &self.flow.module.types;
        match handed {
            Some((ty, Some(handed))) if types[*ty].inner == *self.flow.inner(value) => Ok(*handed),
            Some((_, Some(_))) => Err(Declined(
                "the vertex stage hands an input over as another type".into(),
            )),
            _ => Err(Declined(
                "the vertex stage hands an input over in no way that is known".into(),
            )),
        }
    }

    /// Declines what is not computed for sure, where that matters.
    fn reached(&self, slice: &Slice<'_>) -> Result<(), Declined> {
        let no = |why: &str| Err(Declined(why.into()));
        if slice.discards_in_loop() {
            return no("a loop on the way to it discards");
        }
        let mut decided = false;
        for around in slice.around() {
            match around {
                Around::Branch(condition) => {
                    decided |= !self.rates.varies(*condition).is_uniform();
                }
                Around::Loop if slice.has_variables() => {
                    return no("each round of a loop computes it anew");
                }
                Around::Loop => {}
            }
        }
        if decided && slice.has_variables() {
            return no("a branch computes it, which is not the same for the whole draw");
        }
        if decided && slice.values().any(|value| self.has_hole(value)) {
            return no("the branch around it may be there for a hole in its domain");
        }
        Ok(())
    }

    fn has_hole(&self, value: Value) -> bool {
        let mut found = false;
        operands::each(&self.flow.function.expressions[value], |operand| {
            found |= !self.flow.is_constant(operand) && self.flow.has_hole(value, operand);
        });
        found
    }

    fn plan(&self, candidate: &Candidate) -> Result<Plan<'a>, Declined> {
        let choice = Choice::parse(&candidate.choice)?;
        let (_, site) =
            self.flow.shader.find(&candidate.site).ok_or_else(|| {
                Declined(format!("there is no value `{}`", candidate.site.path()))
            })?;
        let movable = self.movable(site)?;
        if !self.choices(&movable).contains(&choice) {
            return Err(Declined(format!(
                "`{}` cannot be moved as `{}`",
                candidate.site.path(),
                candidate.choice
            )));
        }
        let levels = candidate.baked(movable.reads.len())?;
        let room = self.room(&movable, choice).ok_or_else(full)?;
        Ok(Plan {
            movable,
            choice,
            room,
            levels,
        })
    }

    /// Where a value can be handed over, if there is a place.
    fn room(&self, movable: &Movable<'_>, choice: Choice) -> Option<Room> {
        let shader = self.flow.shader;
        if let Some(location) = interface::free_location(shader) {
            return Some(Room::Free(location));
        }
        let components = self.flow.floats(movable.site)?;
        let interpolation = choice.interpolation(movable.surface);
        interface::roomy(shader, interpolation, components).map(Room::Behind)
    }

    /// How a value can be handed over.
    fn choices(&self, movable: &Movable<'_>) -> Vec<Choice> {
        match movable.surface {
            Surface::Same | Surface::Flat if movable.exact => vec![Choice::Flat],
            _ if movable.exact => vec![Choice::Affine],
            _ if self.is_unit(movable.site) => {
                vec![Choice::Interpolate, Choice::InterpolateAndNormalise]
            }
            _ => vec![Choice::Interpolate],
        }
    }

    /// Whether a value is a unit direction.
    fn is_unit(&self, value: Value) -> bool {
        match self.flow.function.expressions[value] {
            Expression::Math {
                fun: Math::Normalize,
                ..
            } => true,
            Expression::Math {
                fun: Math::Reflect,
                arg,
                arg1: Some(normal),
                ..
            } => self.is_unit(arg) && self.is_unit(normal),
            Expression::Unary {
                op: UnaryOperator::Negate,
                expr,
            } => self.is_unit(expr),
            _ => false,
        }
    }

    fn consider(&self, facts: &Facts) -> Vec<Considered> {
        let flow = self.flow;
        let Ok(types) = cost::types(flow.module, flow.function) else {
            return Vec::new();
        };
        let works = cost::of_expressions(flow.module, &flow.function.expressions, &types);
        let has_vertex = flow.shader.index(Stage::Vertex).is_some();
        // For each value that is offered, how.
        let mut offered: Vec<Vec<Choice>> = vec![Vec::new(); flow.function.expressions.len()];
        let mut found = Vec::new();
        // Users come before what they use.
        let values: Vec<Value> = flow.function.expressions.iter().map(|(v, _)| v).collect();
        for &site in values.iter().rev() {
            if !self.is_operation(site) {
                continue;
            }
            let candidate = |choice: Choice, levels: &[f32]| Candidate {
                pass: VertexMotion.name().into(),
                site: flow.id(site).clone(),
                choice: choice.word().into(),
                value: levels.iter().map(|level| level.to_bits()).collect(),
            };
            let declined = |declined: Declined| Considered {
                candidate: candidate(Choice::Interpolate, &[]),
                declined: Some(declined),
            };
            let stop = self.rates.varies(site).screen;
            if stop.is_some_and(|stop| stop.value != site) {
                // It is said there.
                continue;
            }
            let movable = match self.movable(site) {
                Ok(movable) => movable,
                Err(why) => {
                    // In a loop, what is stored stands for all that leads to it.
                    let in_loop = Slice::of(flow, site).around().contains(&Around::Loop);
                    if !in_loop || flow.is_stated(site) {
                        found.push(declined(why));
                    }
                    if !has_vertex {
                        // The last one stands for all.
                        break;
                    }
                    continue;
                }
            };
            let work: Work = movable
                .slice
                .values()
                .fold(Work::default(), |sum, value| sum + works[value.index()]);
            for choice in self.choices(&movable) {
                let after = match choice {
                    // The last operation is done again.
                    Choice::InterpolateAndNormalise => NORMALISE,
                    _ => 0.0,
                };
                if work.total() <= self.handing_over(site, choice) + 2.0 * after {
                    continue;
                }
                if self.is_dominated(site, choice, &offered) {
                    continue;
                }
                offered[site.index()].push(choice);
                if self.room(&movable, choice).is_none() {
                    found.push(declined(full()));
                    continue;
                }
                match self.levels(&movable, facts) {
                    Ok(levels) => found.push(Considered {
                        candidate: candidate(choice, &levels),
                        declined: None,
                    }),
                    Err(why) => found.push(declined(why)),
                }
            }
        }
        found.reverse();
        found
    }

    /// Whether a value is computed, and more than a part of another.
    fn is_operation(&self, value: Value) -> bool {
        let flow = self.flow;
        let computed = match flow.function.expressions[value] {
            // A negation moves with what it negates.
            Expression::Binary { .. }
            | Expression::Select { .. }
            | Expression::Math { .. }
            | Expression::Derivative { .. }
            | Expression::ImageSample { .. }
            | Expression::ImageLoad { .. }
            | Expression::As { .. } => true,
            Expression::Compose { ref components, .. } => flow.joins(components),
            Expression::Load { pointer } => flow.local(pointer).is_some(),
            // All that is used of a vector.
            Expression::AccessIndex { base, .. } | Expression::Swizzle { vector: base, .. } => {
                self.is_operation(base) && !flow.is_stated(base) && flow.users(base).count() == 1
            }
            _ => false,
        };
        computed && flow.floats(value).is_some() && !flow.is_constant(value)
    }

    /// What handing a value over costs.
    fn handing_over(&self, value: Value, choice: Choice) -> f64 {
        let each = match choice {
            Choice::Flat => FLAT_WEIGHT,
            _ => INTERPOLATION_WEIGHT,
        };
        each * self.flow.floats(value).unwrap_or(0) as f64
    }

    /// Whether a value is better moved with its only user, which is offered, and does the same to what was
    /// interpolated.
    fn is_dominated(&self, value: Value, choice: Choice, offered: &[Vec<Choice>]) -> bool {
        let flow = self.flow;
        let mut users = flow.users(value);
        let (Some(user), None) = (users.next(), users.next()) else {
            return false;
        };
        if flow.is_stated(value)
            || !offered[user.index()].contains(&choice)
            || flow.floats(user) > flow.floats(value)
        {
            return false;
        }
        let same = |other: Value| self.rates.varies(other).is_uniform();
        match flow.function.expressions[user] {
            _ if choice == Choice::Flat => true,
            Expression::Binary { op, left, right } => match op {
                Op::Add | Op::Subtract | Op::Multiply => {
                    same(if left == value { right } else { left })
                }
                Op::Divide => same(right),
                _ => false,
            },
            Expression::AccessIndex { .. } | Expression::Swizzle { .. } => true,
            Expression::Math {
                fun: Math::Dot,
                arg,
                arg1: Some(other),
                ..
            } => same(if arg == value { other } else { arg }),
            _ => false,
        }
    }

    /// The level of each read whose level is implicit: the one that the distance leads to.
    fn levels(&self, movable: &Movable<'_>, facts: &Facts) -> Result<Vec<f32>, Declined> {
        let flow = self.flow;
        let reads = movable.reads.iter();
        reads
            .map(|read| {
                let Expression::ImageSample { image, .. } = flow.function.expressions[*read] else {
                    unreachable!("a read is a read");
                };
                let name = flow.global(image);
                let name = name.and_then(|g| flow.module.global_variables[g].name.as_ref());
                let texture = name.and_then(|name| facts.textures.get(name));
                texture
                    .map(|texture| texture.level.max(0.0))
                    .ok_or_else(|| {
                        Declined(
                            "the level of its texture, which has no image, is not known".into(),
                        )
                    })
            })
            .collect()
    }

    /// The shader with the value moved.
    fn make(&self, plan: &Plan<'_>) -> Shader {
        let flow = self.flow;
        let Plan {
            movable,
            choice,
            room,
            ..
        } = plan;
        let site = movable.site;
        let path = flow.id(site).path();
        let name = self
            .short(path)
            .replace(|c: char| !c.is_alphanumeric(), "_");
        // What is handed over before it in the same vector.
        let (location, name, before) = match room {
            Room::Free(location) => (*location, name, None),
            Room::Behind(other) => {
                let name = format!("{}_and_{name}", other.name);
                (other.location, name, Some(other))
            }
        };
        let binding = interface::at(location, choice.interpolation(movable.surface));
        let own = flow.floats(site).unwrap_or(1);
        let components = own + before.map_or(0, |before| before.components);
        let ty = |edit: &mut Edit<'_>| edit.ty(floats(components));

        let mut edit = Edit::new(flow.shader, Stage::Vertex);
        let mut value = movable
            .slice
            .copy(&mut edit, &mut OfFragment { study: self, plan });
        if let Some(before) = before {
            let ty = ty(&mut edit);
            let components = vec![before.value, value];
            value = edit.add(
                format!("{path}.packed"),
                Expression::Compose { ty, components },
            );
        }
        let output = Output {
            name: name.clone(),
            ty: ty(&mut edit),
            binding: binding.clone(),
        };
        edit.add_output(output, value);
        let with_output = lockstep::joined(edit.finish(), Stage::Vertex);

        let mut edit = Edit::new(&with_output, Stage::Fragment);
        let argument = FunctionArgument {
            name: Some(name),
            ty: ty(&mut edit),
            binding: Some(binding),
        };
        let mut input = edit.add_argument(format!("{path}.interpolated"), argument);
        if let Some(before) = before {
            let packed = input;
            let is_it = |expression: &Expression| matches!(expression, Expression::FunctionArgument(at) if *at == before.argument);
            let function = with_output.function(Stage::Fragment);
            let values = function.into_iter().flat_map(|f| f.expressions.iter());
            for (value, _) in values.filter(|(_, expression)| is_it(expression)) {
                let path = format!("{}.unpacked", with_output.id(Stage::Fragment, value).path());
                let part = edit.add(path, part(packed, 0, before.components));
                edit.replace(value, New::Value(part));
            }
            let part = part(packed, before.components, own);
            input = edit.add(format!("{path}.unpacked"), part);
        }
        if *choice == Choice::InterpolateAndNormalise {
            let normalise = Expression::Math {
                fun: Math::Normalize,
                arg: input,
                arg1: None,
                arg2: None,
                arg3: None,
            };
            input = edit.add(format!("{path}.normalised"), normalise);
        }
        edit.replace(site, New::Value(input));
        edit.finish()
    }

    /// A path without the entry point.
    fn short<'p>(&self, path: &'p str) -> &'p str {
        let entry = self.flow.shader.entry_point(Stage::Fragment);
        entry
            .and_then(|entry| path.strip_prefix(entry.name.as_str())?.strip_prefix('.'))
            .unwrap_or(path)
    }
}

/// What making a direction a unit one costs.
const NORMALISE: f64 = 12.0;

fn full() -> Declined {
    Declined(format!(
        "the stages hand over {} variables, and no more are allowed",
        interface::MOST_VARIABLES
    ))
}

/// Whether a texture has levels that are numbers between others.
fn is_of_colours(inner: &TypeInner) -> bool {
    matches!(
        inner,
        TypeInner::Image {
            class: ImageClass::Sampled { multi: false, .. },
            ..
        }
    )
}

/// For each value, whether a `discard` depends on it.
fn discards(flow: &Flow<'_>) -> Vec<bool> {
    let mut found = vec![false; flow.function.expressions.len()];
    let mut conditions = Vec::new();
    operands::walk(&flow.function.body, &mut |statement| {
        let condition = match *statement {
            Statement::If { condition, .. } => condition,
            Statement::Switch { selector, .. } => selector,
            _ => return,
        };
        let mut kills = false;
        for block in operands::blocks(statement) {
            operands::walk(block, &mut |inner| {
                kills |= matches!(inner, Statement::Kill)
            });
        }
        if kills {
            conditions.push(condition);
        }
    });
    for condition in conditions {
        for value in Slice::of(flow, condition).values() {
            found[value.index()] = true;
        }
    }
    found
}

/// What the vertex stage has for what cannot be copied there.
struct OfFragment<'s, 'a> {
    study: &'s Study<'a>,
    plan: &'s Plan<'a>,
}

impl Source for OfFragment<'_, '_> {
    fn instead(&mut self, edit: &mut Edit<'_>, value: Value) -> Option<Handle<Expression>> {
        let flow = self.study.flow;
        if let Some(binding) = flow.input(value) {
            return self.study.handed(value, binding).ok();
        }
        // A unit direction that was handed over is one in the vertex stage without being made one again.
        if let Expression::Math {
            fun: Math::Normalize,
            arg,
            ..
        } = flow.function.expressions[value]
            && let Some(binding) = flow.input(arg)
            && let Ok(handed) = self.study.handed(arg, binding)
            && let Expression::Math {
                fun: Math::Normalize,
                ..
            } = edit.expression(handed)
        {
            return Some(handed);
        }
        None
    }

    fn path(&self, value: Value) -> String {
        let flow = self.study.flow;
        let vertex = flow.shader.entry_point(Stage::Vertex);
        let entry = vertex.map_or("", |vertex| vertex.name.as_str());
        format!("{entry}.{}", self.study.short(flow.id(value).path()))
    }

    fn adapted(
        &mut self,
        edit: &mut Edit<'_>,
        value: Value,
        mut expression: Expression,
    ) -> Expression {
        let mut reads = self.plan.movable.reads.iter().zip(&self.plan.levels);
        if let Expression::ImageSample { level, .. } = &mut expression
            && let Some((_, number)) = reads.find(|(read, _)| **read == value)
        {
            let path = format!("{}.level", self.path(value));
            let number = Expression::Literal(Literal::F32(*number));
            *level = SampleLevel::Exact(edit.add(path, number));
        }
        expression
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_free_location_values_share_a_vector() {
        // Fourteen locations, and two that are free.
        let members: String = (0..13)
            .map(|at| format!("@location({at}) v{at}: vec4f, "))
            .collect();
        let rest = ", vec4f()".repeat(12);
        let text = format!(
            "struct Varyings {{ @builtin(position) clip: vec4f, {members} @location(13) n: vec3f }}
             @group(0) @binding(0) var<uniform> u: mat4x4f;
             @vertex fn vs(@location(0) p: vec3f) -> Varyings {{
                 return Varyings(u * vec4f(p, 1.0), vec4f(p, 1.0){rest}, p);
             }}
             @fragment fn fs(in: Varyings) -> @location(0) vec4f {{
                 let one = exp(dot(in.n, in.n)); let two = sin(in.n.x) * cos(in.n.y);
                 let three = sin(in.n.yzx) * exp(in.n); let four = cos(in.n.zx * 3.0) * sin(in.n.xy);
                 return vec4f(three * one, two) * (vec4f(four, four) + in.v0);
             }}"
        );
        let module = naga::front::wgsl::parse_str(&text).expect("it parses");
        let base = crate::normalize(&module, Some("vs"), "fs", 1000).expect("it has a normal form");
        let authors = base.function(Stage::Fragment).map(|f| f.arguments.len());
        let mut shader = base;
        let mut types = Vec::new();
        for name in ["one", "two", "three", "four"] {
            let candidates = VertexMotion.candidates(&shader, &Facts::default());
            let site = format!("fs.{name}");
            let mut of_value = candidates.iter().filter(|c| c.site.path() == site);
            let candidate = of_value.next();
            let Some(candidate) = candidate else {
                types.push("full".to_owned());
                continue;
            };
            shader = VertexMotion.apply(&shader, candidate);
            shader
                .validate()
                .unwrap_or_else(|error| panic!("{name}: {error:?}"));
            let function = shader.function(Stage::Fragment).expect("it has one");
            let added = function.arguments.iter().skip(authors.unwrap_or(0));
            let added = added.map(|argument| {
                let components = match shader.module().types[argument.ty].inner {
                    TypeInner::Vector { size, .. } => size as usize,
                    _ => 1,
                };
                format!(
                    "{} {components}",
                    argument.name.as_deref().unwrap_or_default()
                )
            });
            types.push(added.collect::<Vec<_>>().join(", "));
        }
        assert_eq!(
            types,
            [
                "one 1",
                "one 1, two 1",
                "one_and_three 4, two 1",
                "one_and_three 4, two_and_four 3"
            ]
        );
        assert_eq!(shader.handing_over(), Some(7.0 * INTERPOLATION_WEIGHT));
    }
}
