//! to-parameter: a value is computed once a draw, and read from a block of parameters.
//!
//! Precondition. The site is a number, a vector of them or a truth value of the fragment stage or, for `exact`, of
//! the vertex stage, that is computed of uniforms, read-only buffers and constants; for `average` it is a float or a vector of
//! them, of the fragment stage, that what varies within the draw is in, too.
//!
//! Effect. All that computes the value is copied to the parameter stage, which stores it in the block (see
//! [`crate::parameters`]); the users of the site read it there. Loops and branches are copied with the variables that they
//! work on. What several moved values share is computed once, a loop that they need as well (see `lockstep`).
//! - `exact`: nothing but uniforms and constants is in it. The largest such values are offered, as far as they do some work.
//! - `average <ids>`: the largest values in it that no uniform is in become constants, which the candidate carries, at
//!   first their means over the samples; a search finds better ones. Uniforms stay what they are, so that the level follows
//!   a changing light.
//!
//! Error. `exact` has none: the same operations are done to the same numbers. Where a host does them on the CPU, or a driver
//! fuses a multiplication with an addition in one place and not in the other, they round as they round there. `average` has what
//! the picture shows, over the uniforms that the scene samples.
//!
//! Declines.
//! - What cannot be had once a draw: inputs, derivatives and what else fragments alone know, unless `average` makes
//!   numbers of them; reads of textures; pipeline constants, which another pipeline would not have.
//! - A value that each round of a loop computes anew, or that a branch computes with variables, where the branch is not
//!   the same for the whole draw.
//! - `average` of what decides when a loop ends, a built-in output or what is written to memory; of a value
//!   behind a branch that may be there for a hole in its domain; where a value that would become a number has no mean
//!   (a decision, a number of something, an angle), was not seen, or depends on a texture that may be any; where these
//!   numbers are too many; where the scene fixes all uniforms in it, so that it is a constant.
//! - What does too little work to be read from a block, and where the only user does no more than use what is read from it.
//!
//! This work is based on: Yong He, Tim Foley, Natalya Tatarchuk, Kayvon Fatahalian, "A System for Rapid, Automatic
//! Shader Level-of-Detail", 2015, section 4; Songfang Liang et al., "Automatic Generation of Levels of Detail for
//! Shaders and Meshes", 2022, section 4.1.

use crate::edit::{Edit, New};
use crate::flow::{Dynamic, Flow, Value};
use crate::parameters;
use crate::rate::Rates;
use crate::recipe::{Candidate, Class, Considered, Declined, Pass};
use crate::shader::{Shader, Stage};
use crate::slice::{Around, Slice, Source};
use crate::specialize::place::Place;
use crate::{Facts, Work, constants, cost, lockstep, operands};
use naga::{BinaryOperator, Expression, Handle, Literal, Scalar, ScalarKind, Statement, TypeInner};
use std::collections::BTreeMap;

/// The least work that is worth a member of the block, in full-rate operations: that of a division.
const LEAST_WORK: f64 = 4.0;

/// How many numbers an average may bake. A search tries each of them.
const MOST_NUMBERS: usize = 16;

/// The stages whose values are moved.
const STAGES: [Stage; 2] = [Stage::Vertex, Stage::Fragment];

/// The pass.
pub struct ToParameter;

/// How a value is moved: the words of this pass.
enum Choice {
    Exact,
    /// With numbers for the values of these paths.
    Average(Vec<String>),
}

impl Choice {
    fn parse(choice: &str) -> Result<Self, Declined> {
        let mut words = choice.split(' ');
        match words.next() {
            Some("exact") if words.next().is_none() => Ok(Self::Exact),
            Some("average") => {
                let path = |word: &str| crate::ValueId::from(word).path().to_owned();
                Ok(Self::Average(words.map(path).collect()))
            }
            _ => Err(Declined(format!("to-parameter has no choice `{choice}`"))),
        }
    }
}

impl Pass for ToParameter {
    fn name(&self) -> &'static str {
        "to-parameter"
    }

    fn summary(&self) -> &'static str {
        "a value is computed once a draw, and read from a block of parameters"
    }

    fn class(&self, candidate: &Candidate) -> Class {
        match Choice::parse(&candidate.choice) {
            Ok(Choice::Exact) => Class::Lossless,
            _ => Class::Lossy,
        }
    }

    fn consider(&self, shader: &Shader, facts: &Facts) -> Vec<Considered> {
        let flows = STAGES.iter().filter_map(|stage| Flow::new(shader, *stage));
        flows
            .flat_map(|flow| Study::new(&flow).consider(facts))
            .collect()
    }

    fn with_numbers(&self, candidate: &Candidate, numbers: &[f32]) -> Option<Candidate> {
        let baked = !numbers.is_empty() && numbers.len() == candidate.value.len();
        baked.then(|| candidate.with(&candidate.choice, numbers))
    }

    fn applies(&self, shader: &Shader, candidate: &Candidate) -> Result<(), Declined> {
        let (flow, site) = site(shader, candidate)?;
        Study::new(&flow).plan(site, candidate).map(drop)
    }

    fn apply(&self, shader: &Shader, candidate: &Candidate) -> Shader {
        let planned = site(shader, candidate).and_then(|(flow, site)| {
            let study = Study::new(&flow);
            let (movable, numbers) = study.plan(site, candidate)?;
            Ok(study.make(&movable, &numbers))
        });
        match planned {
            Ok(made) => made,
            Err(declined) => panic!("{candidate} was applied, but {declined}"),
        }
    }
}

/// The stage of a site, and the site in it.
fn site<'a>(shader: &'a Shader, candidate: &Candidate) -> Result<(Flow<'a>, Value), Declined> {
    let (stage, site) = shader
        .find(&candidate.site)
        .ok_or_else(|| Declined(format!("there is no value `{}`", candidate.site.path())))?;
    if !STAGES.contains(&stage) {
        return Err(Declined("it is computed once a draw already".into()));
    }
    let flow = Flow::new(shader, stage);
    let flow = flow.ok_or_else(|| Declined("its stage is not there".into()))?;
    Ok((flow, site))
}

/// A stage that is looked at for values to move.
struct Study<'a> {
    flow: &'a Flow<'a>,
    rates: Rates,
}

/// A value that can be moved.
struct Movable<'a> {
    site: Value,
    slice: Slice<'a>,
    /// What becomes a number in it, and how many components each has.
    leaves: Vec<(Value, usize)>,
}

impl Movable<'_> {
    /// Its values but those that become numbers.
    fn moved(&self) -> impl Iterator<Item = Value> + '_ {
        let values = self.slice.values();
        values.filter(|value| self.leaves.iter().all(|(leaf, _)| leaf != value))
    }
}

impl<'a> Study<'a> {
    fn new(flow: &'a Flow<'a>) -> Self {
        let rates = Rates::of(flow.shader, flow.stage);
        Self {
            rates: rates.expect("a flow is of a stage that is there"),
            flow,
        }
    }

    /// Whether a value is the same for the whole draw, and no constant.
    fn is_uniform(&self, value: Value) -> bool {
        let varies = self.rates.varies(value);
        varies.is_uniform() && varies.draw
    }

    /// Whether a value varies within a draw, and uniforms are in it.
    fn is_mixed(&self, value: Value) -> bool {
        let varies = self.rates.varies(value);
        !varies.is_uniform() && varies.draw
    }

    /// Whether a value is a float or a vector of them that varies within a draw, and no uniform is in it.
    fn may_become_numbers(&self, value: Value) -> bool {
        let varies = self.rates.varies(value);
        !varies.is_uniform() && !varies.draw && self.flow.floats(value).is_some()
    }

    /// A value that can be moved exactly, or why not.
    fn exact(&self, site: Value) -> Result<Movable<'a>, Declined> {
        if !self.is_uniform(site) {
            return Err(Declined("it is not the same for the whole draw".into()));
        }
        if held(self.flow.inner(site)).is_none() {
            return Err(Declined("a block holds no value of its type".into()));
        }
        let movable = Movable {
            slice: Slice::of(self.flow, site),
            leaves: Vec::new(),
            site,
        };
        self.copied(&movable)?;
        Ok(movable)
    }

    /// A value that can be moved with numbers for what varies in it, or why not.
    fn average(&self, site: Value) -> Result<Movable<'a>, Declined> {
        let flow = self.flow;
        let no = |why: &str| Err(Declined(why.into()));
        if flow.stage != Stage::Fragment {
            return no("only values of the fragment stage are averaged");
        }
        if !self.is_mixed(site) {
            return no("nothing that varies within the draw is in it, or no uniform is");
        }
        if flow.floats(site).is_none() {
            return no("it is no float, or vector of floats");
        }
        if let Some(why) = flow.decides(site) {
            return Err(Declined(why.to_string()));
        }
        let values = flow.function.expressions.iter();
        let ends = values.map(|(value, _)| self.may_become_numbers(value));
        let slice = Slice::up_to(flow, site, ends.collect());
        let leaves: Vec<(Value, usize)> = slice
            .values()
            .filter(|value| self.may_become_numbers(*value))
            .filter_map(|value| Some((value, flow.floats(value)?)))
            .collect();
        if leaves.iter().map(|(_, count)| count).sum::<usize>() > MOST_NUMBERS {
            return Err(Declined(format!(
                "more than {MOST_NUMBERS} numbers would take the place of what varies in it"
            )));
        }
        for (leaf, _) in &leaves {
            if let Some(meaning) = flow.meaning(*leaf) {
                let Declined(why) = meaning.into();
                let leaf = flow.id(*leaf).path();
                return Err(Declined(format!("of `{leaf}`, {why}")));
            }
        }
        let movable = Movable {
            site,
            slice,
            leaves,
        };
        self.copied(&movable)?;
        let mut decided = false;
        for around in movable.slice.around() {
            if let Around::Branch(condition) = around {
                decided |= !self.rates.varies(*condition).is_uniform();
            }
        }
        if decided && movable.moved().any(|value| self.has_hole(value)) {
            return no("the branch around it may be there for a hole in its domain");
        }
        Ok(movable)
    }

    /// Declines what cannot be copied to the parameter stage.
    fn copied(&self, movable: &Movable<'_>) -> Result<(), Declined> {
        let flow = self.flow;
        let no = |why: &str| Err(Declined(why.into()));
        for value in movable.moved() {
            match flow.function.expressions[value] {
                _ if flow.input(value).is_some() => {
                    return Err(Declined(format!(
                        "`{}` in it has no number in its place",
                        flow.id(value).path()
                    )));
                }
                Expression::FunctionArgument(_) => {
                    return no("an input is used as a whole structure");
                }
                Expression::Derivative { .. } => return no("it takes a derivative"),
                Expression::ImageSample { .. }
                | Expression::ImageLoad { .. }
                | Expression::ImageQuery { .. } => return no("it reads a texture"),
                Expression::Override(_) => {
                    return no("a constant of the pipeline is in it, which another one has not");
                }
                Expression::GlobalVariable(variable) => {
                    let space = flow.module.global_variables[variable].space;
                    let written = match space {
                        naga::AddressSpace::Uniform | naga::AddressSpace::Handle => false,
                        naga::AddressSpace::Storage { access } => {
                            access.contains(naga::StorageAccess::STORE)
                        }
                        _ => true,
                    };
                    if written {
                        return no("it reads memory that the shader may write");
                    }
                }
                Expression::CallResult(_)
                | Expression::AtomicResult { .. }
                | Expression::WorkGroupUniformLoadResult { .. }
                | Expression::RayQueryVertexPositions { .. }
                | Expression::RayQueryProceedResult
                | Expression::RayQueryGetIntersection { .. }
                | Expression::SubgroupBallotResult
                | Expression::SubgroupOperationResult { .. }
                | Expression::CooperativeLoad { .. }
                | Expression::CooperativeMultiplyAdd { .. } => {
                    return no("it is known for fragments alone");
                }
                _ => {}
            }
            let of_number = movable.leaves.is_empty() && !self.rates.varies(value).is_uniform();
            if of_number && !matches!(flow.inner(value), TypeInner::Pointer { .. }) {
                return no("a branch computes it, which is not the same for the whole draw");
            }
        }
        if movable.slice.discards_in_loop() {
            return no("a loop on the way to it discards");
        }
        if movable.slice.has_variables() {
            for around in movable.slice.around() {
                match around {
                    Around::Loop => return no("each round of a loop computes it anew"),
                    Around::Branch(condition) if !self.rates.varies(*condition).is_uniform() => {
                        return no(
                            "a branch computes it, which is not the same for the whole draw",
                        );
                    }
                    Around::Branch(_) => {}
                }
            }
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

    /// What a candidate moves, and the numbers for its leaves, one after the other.
    fn plan(
        &self,
        site: Value,
        candidate: &Candidate,
    ) -> Result<(Movable<'a>, Vec<f32>), Declined> {
        let movable = match Choice::parse(&candidate.choice)? {
            Choice::Exact => self.exact(site)?,
            Choice::Average(paths) => {
                let movable = self.average(site)?;
                let leaves = movable.leaves.iter();
                if !leaves
                    .map(|(leaf, _)| self.flow.id(*leaf).path())
                    .eq(&paths)
                {
                    return Err(Declined("what varies in it is not what it was".into()));
                }
                movable
            }
        };
        let count = movable.leaves.iter().map(|(_, count)| count).sum();
        let numbers = candidate.baked(count)?;
        self.follow(&movable, &numbers)?;
        Ok((movable, numbers))
    }

    /// Declines numbers that an operation in the slice cannot take.
    fn follow(&self, movable: &Movable<'_>, numbers: &[f32]) -> Result<(), Declined> {
        let mut rest = numbers;
        let mut known = Vec::new();
        for (leaf, count) in &movable.leaves {
            let (own, others) = rest.split_at(*count);
            known.push((*leaf, own));
            rest = others;
        }
        constants::follow(self.flow, &known)
    }

    /// All that this pass thinks of in the stage.
    fn consider(&self, facts: &Facts) -> Vec<Considered> {
        let flow = self.flow;
        let Ok(types) = cost::types(flow.module, flow.function) else {
            return Vec::new();
        };
        let works = cost::of_expressions(flow.module, &flow.function.expressions, &types);
        let mut found = self.exact_ones(&works);
        if flow.stage == Stage::Fragment {
            found.extend(self.averages(facts, &works));
        }
        found
    }

    /// Whether a value is declined for the same reason as a user of it, where that is said.
    fn is_said(&self, value: Value, why: &Declined, stays: &BTreeMap<Value, Declined>) -> bool {
        let mut users = self.flow.users(value);
        users.any(|user| stays.get(&user) == Some(why))
    }

    fn candidate(&self, site: Value, choice: String, numbers: &[f32]) -> Candidate {
        Candidate {
            pass: ToParameter.name().into(),
            site: self.flow.id(site).clone(),
            choice,
            value: numbers.iter().map(|number| number.to_bits()).collect(),
        }
    }

    /// The largest values that can be moved exactly.
    fn exact_ones(&self, works: &[Work]) -> Vec<Considered> {
        let flow = self.flow;
        let count = flow.function.expressions.len();
        // Whether it moves, and for each variable, whether all that is loaded of it does.
        let mut moves = vec![false; count];
        let mut loads = vec![true; flow.function.local_variables.len()];
        let mut stays: BTreeMap<Value, Declined> = BTreeMap::new();
        let values: Vec<Value> = flow.function.expressions.iter().map(|(v, _)| v).collect();
        for &value in values.iter().rev() {
            let mut loaded = None;
            if let Expression::Load { pointer } = flow.function.expressions[value] {
                loaded = flow.local(pointer);
            }
            if self.is_uniform(value) {
                match self.exact(value) {
                    Ok(_) => moves[value.index()] = true,
                    Err(why) => {
                        stays.insert(value, why);
                    }
                }
            }
            if let Some(local) = loaded {
                loads[local.index()] &= moves[value.index()];
            }
        }
        let mut stored_for_moved = vec![true; count];
        operands::walk(&flow.function.body, &mut |statement| match *statement {
            Statement::Store { pointer, value } => {
                let local = flow.local(pointer);
                stored_for_moved[value.index()] &= local.is_some_and(|l| loads[l.index()]);
            }
            ref other => operands::each_of_statement(other, |operand| {
                stored_for_moved[operand.index()] = false;
            }),
        });
        let mut found = Vec::new();
        for &value in &values {
            if !self.is_uniform(value) || !self.is_operation(value) {
                continue;
            }
            // What all users take along needs no member of its own.
            let mut users = flow.users(value);
            let any = flow.is_stated(value) || flow.users(value).next().is_some();
            if any
                && users.all(|user| moves[user.index()])
                && (!flow.is_stated(value) || stored_for_moved[value.index()])
            {
                continue;
            }
            let declined = stays.get(&value);
            // Where it stays, it is for what shades that somebody asks.
            if declined.is_some_and(|why| !flow.is_float(value) || self.is_said(value, why, &stays))
                || !is_worth(Slice::of(flow, value).values(), works)
            {
                continue;
            }
            found.push(Considered {
                candidate: self.candidate(value, "exact".into(), &[]),
                declined: declined.cloned(),
            });
        }
        found
    }

    /// The values that can be moved with numbers in them.
    fn averages(&self, facts: &Facts, works: &[Work]) -> Vec<Considered> {
        let flow = self.flow;
        let dynamic = Dynamic::of(flow, facts);
        let values: Vec<Value> = flow.function.expressions.iter().map(|(v, _)| v).collect();
        // What is offered, by what becomes numbers in it.
        let mut offered: BTreeMap<Value, Vec<(Value, usize)>> = BTreeMap::new();
        let mut stays: BTreeMap<Value, Declined> = BTreeMap::new();
        let mut found = Vec::new();
        for &site in values.iter().rev() {
            if !self.is_mixed(site) || !self.is_operation(site) || flow.floats(site).is_none() {
                continue;
            }
            let movable = match self.average(site) {
                Ok(movable) => movable,
                Err(why) => {
                    if !self.is_said(site, &why, &stays) {
                        found.push(Considered {
                            candidate: self.candidate(site, "average".into(), &[]),
                            declined: Some(why.clone()),
                        });
                    }
                    stays.insert(site, why);
                    continue;
                }
            };
            if !is_worth(movable.moved(), works)
                || movable.moved().all(|value| self.is_fixed(value, facts))
            {
                continue;
            }
            let mut users = flow.users(site);
            if let (Some(user), None) = (users.next(), users.next())
                && !flow.is_stated(site)
                && offered.get(&user) == Some(&movable.leaves)
            {
                // The user does the same to what it reads as to what it was given.
                continue;
            }
            let numbers = self.numbers(&movable, facts, &dynamic);
            let leaves = movable.leaves.iter();
            let ids: Vec<String> = leaves.map(|(leaf, _)| flow.id(*leaf).to_string()).collect();
            let choice = format!("average {}", ids.join(" "));
            found.push(match numbers {
                Ok(numbers) => {
                    offered.insert(site, movable.leaves);
                    Considered {
                        candidate: self.candidate(site, choice, &numbers),
                        declined: None,
                    }
                }
                Err(why) => Considered {
                    candidate: self.candidate(site, choice, &[]),
                    declined: Some(why),
                },
            });
        }
        found.reverse();
        found
    }

    /// Whether a value loads nothing that may change from draw to draw.
    fn is_fixed(&self, value: Value, facts: &Facts) -> bool {
        match self.flow.function.expressions[value] {
            Expression::Load { pointer } if self.flow.global(pointer).is_some() => {
                let place = Place::loaded(self.flow, value);
                place.is_some_and(|place| place.words(facts).is_some())
            }
            Expression::ArrayLength(_) => false,
            _ => true,
        }
    }

    /// The means of what becomes numbers.
    fn numbers(
        &self,
        movable: &Movable<'_>,
        facts: &Facts,
        dynamic: &Dynamic,
    ) -> Result<Vec<f32>, Declined> {
        let mut numbers = Vec::new();
        for (leaf, count) in &movable.leaves {
            let id = self.flow.id(*leaf);
            if dynamic.is(*leaf) {
                return Err(Declined(format!("`{}` may be anything", id.path())));
            }
            let mean = facts.mean([id], *count);
            numbers.extend(
                mean.map_err(|Declined(why)| Declined(format!("of `{}`, {why}", id.path())))?,
            );
        }
        self.follow(movable, &numbers)?;
        Ok(numbers)
    }

    /// Whether a value is computed, and more than a part of another.
    fn is_operation(&self, value: Value) -> bool {
        let flow = self.flow;
        let computed = match flow.function.expressions[value] {
            Expression::Unary { .. }
            | Expression::Binary { .. }
            | Expression::Select { .. }
            | Expression::Math { .. }
            | Expression::Relational { .. }
            | Expression::As { .. } => true,
            Expression::Compose { ref components, .. } => flow.joins(components),
            Expression::Load { pointer } => flow.local(pointer).is_some(),
            _ => false,
        };
        computed && !flow.is_constant(value)
    }

    /// The shader with the value moved.
    fn make(&self, movable: &Movable<'_>, numbers: &[f32]) -> Shader {
        let flow = self.flow;
        let site = movable.site;
        let path = flow.id(site).path();
        let with_stage = parameters::with_stage(flow.shader);
        let short = self.short(path);
        let name: String = short
            .chars()
            .map(|c| if c.is_alphanumeric() { c } else { '_' })
            .collect();
        let name = parameters::member_name(&with_stage, &name);
        let entry = with_stage.entry_point(Stage::Parameter);
        let entry = entry.map_or("", |entry| entry.name.as_str());

        let mut edit = Edit::new(&with_stage, Stage::Parameter);
        let mut source = OfStage {
            study: self,
            movable,
            numbers,
            entry,
        };
        let mut value = movable.slice.copy(&mut edit, &mut source);
        let is_bool = matches!(flow.inner(site), TypeInner::Scalar(Scalar::BOOL));
        if is_bool {
            let path = format!("{entry}.{short}.as_number");
            let [accept, reject] =
                [1, 0].map(|n| edit.add(path.clone(), Expression::Literal(Literal::U32(n))));
            value = edit.add(
                path,
                Expression::Select {
                    condition: value,
                    accept,
                    reject,
                },
            );
        }
        let ty = held(flow.inner(site)).expect("a planned value is held");
        let ty = edit.ty(ty);
        edit.add_parameter(name.clone(), ty, value);
        let filled = lockstep::joined(edit.finish(), Stage::Parameter);

        let block = filled.parameter_block().expect("it was just stored");
        let index = filled.parameters().len() as u32 - 1;
        let mut edit = Edit::new(&filled, flow.stage);
        let stage = flow.shader.entry_point(flow.stage);
        let stage = stage.map_or("", |entry| entry.name.as_str());
        let variable = &filled.module().global_variables[block.read];
        let variable = variable.name.as_deref().unwrap_or_default();
        let base = Expression::GlobalVariable(block.read);
        let base = edit.add(format!("{stage}.&{variable}"), base);
        let part = Expression::AccessIndex { base, index };
        let pointer = edit.add(format!("{stage}.&{variable}.{name}"), part);
        let read = format!("{stage}.{variable}.{name}");
        let mut parameter = edit.add(read.clone(), Expression::Load { pointer });
        if is_bool {
            let right = edit.add(&read, Expression::Literal(Literal::U32(0)));
            let op = BinaryOperator::NotEqual;
            let left = parameter;
            parameter = edit.add(
                format!("{read}.is_true"),
                Expression::Binary { op, left, right },
            );
        }
        edit.replace(site, New::Value(parameter));
        edit.finish()
    }

    /// A path without the entry point.
    fn short<'p>(&self, path: &'p str) -> &'p str {
        let entry = self.flow.shader.entry_point(self.flow.stage);
        entry
            .and_then(|entry| path.strip_prefix(entry.name.as_str())?.strip_prefix('.'))
            .unwrap_or(path)
    }
}

/// Whether values do enough work together.
fn is_worth(values: impl Iterator<Item = Value>, works: &[Work]) -> bool {
    let sum = |sum: Work, value: Value| sum + works[value.index()];
    values.fold(Work::default(), sum).total() >= LEAST_WORK
}

/// The type that a block holds a value of a type as; `None` when it holds none.
fn held(inner: &TypeInner) -> Option<TypeInner> {
    let plain = |scalar: Scalar| {
        let kind = matches!(
            scalar.kind,
            ScalarKind::Float | ScalarKind::Sint | ScalarKind::Uint
        );
        kind && scalar.width == 4
    };
    match *inner {
        TypeInner::Scalar(Scalar::BOOL) => Some(TypeInner::Scalar(Scalar::U32)),
        TypeInner::Scalar(scalar) if plain(scalar) => Some(TypeInner::Scalar(scalar)),
        TypeInner::Vector { size, scalar } if plain(scalar) => {
            Some(TypeInner::Vector { size, scalar })
        }
        _ => None,
    }
}

/// What the parameter stage has for what cannot be copied there.
struct OfStage<'s, 'a> {
    study: &'s Study<'a>,
    movable: &'s Movable<'a>,
    numbers: &'s [f32],
    entry: &'s str,
}

impl OfStage<'_, '_> {
    /// The value that the parameter stage stores, for one that is read of the block.
    fn parameter(&self, value: Value) -> Option<Handle<Expression>> {
        let flow = self.study.flow;
        let Expression::Load { pointer } = flow.function.expressions[value] else {
            return None;
        };
        let Expression::AccessIndex { base, index } = flow.function.expressions[pointer] else {
            return None;
        };
        let block = flow.shader.parameter_block()?;
        let function = flow.shader.function(Stage::Parameter)?;
        let stored = parameters::stored(&function.body, &function.expressions)?;
        matches!(flow.function.expressions[base], Expression::GlobalVariable(v) if v == block.read)
            .then(|| stored.values.get(index as usize).copied())?
    }
}

impl Source for OfStage<'_, '_> {
    fn instead(&mut self, edit: &mut Edit<'_>, value: Value) -> Option<Handle<Expression>> {
        if let Some(parameter) = self.parameter(value) {
            return Some(parameter);
        }
        let leaves = &self.movable.leaves;
        let at = leaves.iter().position(|(leaf, _)| *leaf == value)?;
        let before: usize = leaves[..at].iter().map(|(_, count)| count).sum();
        let own = &self.numbers[before..before + leaves[at].1];
        Some(edit.add_numbers(&self.path(value), own))
    }

    fn path(&self, value: Value) -> String {
        let short = self.study.short(self.study.flow.id(value).path());
        format!("{}.{short}", self.entry)
    }

    fn adapted(&mut self, _: &mut Edit<'_>, _: Value, expression: Expression) -> Expression {
        expression
    }
}
