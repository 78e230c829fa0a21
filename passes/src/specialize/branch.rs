//! Operations that a number of the draw switches off, and what is computed for them alone: that goes into a branch.

use super::place::Place;
use crate::edit::{Edit, Side};
use crate::facts::Facts;
use crate::flow::{Flow, Value};
use crate::operands::{self, User};
use crate::rate::Rates;
use crate::recipe::Declined;
use crate::semantics::Shape;
use crate::{Work, cost};
use naga::{
    AddressSpace, BinaryOperator as Op, Block, Expression, ImageClass, MathFunction as Math,
    RelationalFunction, SampleLevel, Statement, StorageAccess, UnaryOperator,
};

/// The least work that is worth a branch, in full-rate scalar operations.
const EXPENSIVE: f64 = 16.0;

/// When an operation is switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Off {
    /// Where the number is 0, or the condition of a choice says so.
    Zero,
    /// Where the number is 1.
    One,
}

impl Off {
    pub(super) const ALL: [Self; 2] = [Self::Zero, Self::One];

    /// The word of the pass.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Zero => "branch",
            Self::One => "branch-at-one",
        }
    }

    fn number(self) -> f32 {
        match self {
            Self::Zero => 0.0,
            Self::One => 1.0,
        }
    }
}

/// An operation that is to be done in a branch.
pub(super) struct Branch {
    site: Value,
    off: Off,
    /// The number, or the truth, that decides.
    switch: Value,
    /// What is computed on either side of the branch: where the switch is on, and where it is off.
    sides: [Vec<Value>; 2],
}

/// What switches an operation off.
pub(super) struct Switch {
    pub(super) value: Value,
    pub(super) off: Off,
}

/// A stage that is looked at for operations to switch off.
pub(super) struct Study<'a> {
    flow: &'a Flow<'a>,
    rates: Rates,
    works: Vec<Work>,
}

impl<'a> Study<'a> {
    /// `None` for a stage that is not well typed.
    pub(super) fn new(flow: &'a Flow<'a>) -> Option<Self> {
        let types = cost::types(flow.module, flow.function).ok()?;
        Some(Self {
            rates: Rates::of(flow.shader, flow.stage)?,
            works: cost::of_expressions(flow.module, &flow.function.expressions, &types),
            flow,
        })
    }

    /// What may switch an operation off: numbers of the draw that an operation with the value itself does not have.
    pub(super) fn switches(&self, site: Value) -> Vec<Switch> {
        if self.flow.floats(site).is_none() || self.is_of_draw(site) {
            return Vec::new();
        }
        let zero = |value| Switch {
            value,
            off: Off::Zero,
        };
        match self.flow.function.expressions[site] {
            Expression::Binary { .. } if self.is_factor(site) => Vec::new(),
            Expression::Binary { .. } => {
                let mut factors = Vec::new();
                self.factors(site, &mut factors);
                let factors = factors.into_iter().map(zero);
                factors.collect()
            }
            Expression::Math {
                fun: Math::Mix,
                arg2: Some(t),
                ..
            } if self.is_of_draw(t) => Off::ALL.map(|off| Switch { value: t, off }).into(),
            Expression::Select { condition, .. } if self.is_of_draw(condition) => {
                vec![zero(condition)]
            }
            _ => Vec::new(),
        }
    }

    /// Whether a value is the same for the whole draw, and no constant.
    fn is_of_draw(&self, value: Value) -> bool {
        let varies = self.rates.varies(value);
        varies.is_uniform() && varies.draw && !self.flow.is_constant(value)
    }

    /// Whether a value is a factor of another product alone.
    fn is_factor(&self, value: Value) -> bool {
        let mut users = self.flow.users(value);
        let (Some(user), None) = (users.next(), users.next()) else {
            return false;
        };
        !self.flow.is_stated(value)
            && self.flow.floats(user).is_some()
            && self.through(user).contains(&value)
    }

    /// The operands of which each makes a product 0 when it is 0.
    fn through(&self, product: Value) -> Vec<Value> {
        match self.flow.function.expressions[product] {
            Expression::Binary {
                op: Op::Multiply,
                left,
                right,
            } => vec![left, right],
            Expression::Binary {
                op: Op::Divide,
                left,
                ..
            } => vec![left],
            Expression::Unary {
                op: UnaryOperator::Negate,
                expr,
            } => vec![expr],
            _ => Vec::new(),
        }
    }

    /// The factors of a product that are the same for the whole draw, through products that are nothing else.
    fn factors(&self, product: Value, found: &mut Vec<Value>) {
        for factor in self.through(product) {
            let is_plain = self.flow.floats(factor).is_some();
            if is_plain && self.is_of_draw(factor) {
                // What is made of one component says no more than that.
                let factor = match self.flow.function.expressions[factor] {
                    Expression::Splat { value, .. } => value,
                    _ => factor,
                };
                if !found.contains(&factor) {
                    found.push(factor);
                }
            } else if is_plain && self.is_factor(factor) {
                self.factors(factor, found);
            }
        }
    }

    /// Whether the samples show that an operation is switched off at times, by a number that the scene does not fix;
    /// of a truth nothing is known.
    pub(super) fn is_seen_off(&self, switch: &Switch, facts: &Facts) -> bool {
        let flow = self.flow;
        if flow.floats(switch.value).is_none() {
            return true;
        }
        let Some(seen) = facts.values.get(flow.id(switch.value)) else {
            return false;
        };
        let number = switch.off.number();
        let mut limits = seen.min.iter().zip(&seen.max);
        limits.all(|(min, max)| *min == number || *max == number)
            && !self.is_fixed(switch.value, facts)
    }

    /// Whether a value is made of nothing but what the scene states.
    fn is_fixed(&self, value: Value, facts: &Facts) -> bool {
        let flow = self.flow;
        let mut open = vec![value];
        let mut fixed = true;
        while let Some(value) = open.pop() {
            match Place::loaded(flow, value) {
                Some(place) => fixed &= place.words(facts).is_some(),
                None => match &flow.function.expressions[value] {
                    Expression::Load { .. } | Expression::FunctionArgument(_) => return false,
                    other => operands::each(other, |operand| open.push(operand)),
                },
            }
        }
        fixed
    }

    /// Declines where what is multiplied by 0 may be infinite or undefined; of a choice nothing is.
    pub(super) fn is_harmless(&self, site: Value, facts: &Facts) -> Result<(), Declined> {
        let flow = self.flow;
        if matches!(flow.function.expressions[site], Expression::Select { .. }) {
            return Ok(());
        }
        let path = flow.id(site).path();
        let seen = facts.values.get(flow.id(site));
        let seen = seen.filter(|seen| seen.count > 0).ok_or_else(|| {
            Declined(format!(
                "`{path}` is what it is without its switch unless something in it is infinite or undefined, and no sample of the scene computes it"
            ))
        })?;
        let mut limits = seen.min.iter().chain(&seen.max);
        match limits.all(|limit| limit.is_finite()) {
            true => Ok(()),
            false => Err(Declined(format!(
                "`{path}` was seen infinite or undefined, which it would not be without its switch"
            ))),
        }
    }

    /// The branch that an operation goes into, or why it does not; `Ok(None)` where it would not save enough to think of.
    pub(super) fn branch(&self, site: Value, switch: &Switch) -> Result<Option<Branch>, Declined> {
        let flow = self.flow;
        let Some(block) = Around::of(&flow.function.body, site) else {
            return Ok(None);
        };
        // Within another branch on it, it is what it is there.
        let mut conditions = block.conditions.iter();
        if conditions.any(|condition| self.tree(*condition).contains(&switch.value)) {
            return Ok(None);
        }
        let [pinned, on, off] = match flow.function.expressions[site] {
            Expression::Math {
                arg,
                arg1: Some(arg1),
                ..
            } => match switch.off {
                Off::Zero => [vec![arg], vec![arg1], Vec::new()],
                Off::One => [vec![arg1], vec![arg], Vec::new()],
            },
            Expression::Select { accept, reject, .. } => [Vec::new(), vec![accept], vec![reject]],
            ref product => {
                let mut factors = Vec::new();
                operands::each(product, |factor| factors.push(factor));
                [Vec::new(), factors, Vec::new()]
            }
        };
        let pinned: Vec<Value> = pinned.into_iter().chain([switch.value]).collect();
        let mut sides = [on, off].map(|roots| self.side(&roots, &pinned, site, switch, &block));
        let work = |values: &[Value]| -> f64 {
            let works = values.iter().map(|value| self.works[value.index()].total());
            works.sum()
        };
        let expensive = sides.iter().any(|side| work(&side.alone) >= EXPENSIVE);
        if !expensive {
            let all = sides.iter().map(|side| work(&side.all));
            return match all.fold(0.0, f64::max) >= EXPENSIVE {
                true => Err(Declined(
                    "what it would leave out is used elsewhere too, or has to be computed where it is".into(),
                )),
                false => Ok(None),
            };
        }
        // What both sides use is on neither.
        let sides = [0, 1].map(|at| std::mem::take(&mut sides[at].alone));
        Ok(Some(Branch {
            site,
            off: switch.off,
            switch: switch.value,
            sides,
        }))
    }

    /// What is computed for one side of an operation.
    fn side(
        &self,
        roots: &[Value],
        pinned: &[Value],
        site: Value,
        switch: &Switch,
        block: &Around,
    ) -> OfSide {
        let flow = self.flow;
        let mut all: Vec<Value> = roots.iter().flat_map(|root| self.tree(*root)).collect();
        all.sort_unstable();
        all.dedup();
        let outside: Vec<Value> = pinned.iter().flat_map(|value| self.tree(*value)).collect();
        let all: Vec<Value> = all.into_iter().filter(|v| !outside.contains(v)).collect();
        let may_differ = block.in_loop || !self.is_plain(switch.value);
        let mut alone: Vec<Value> = Vec::new();
        // Users come behind what they use.
        for value in all.iter().rev().copied() {
            let is_used_there = |user: &User| match *user {
                User::Value(user) => {
                    alone.contains(&user) || (user == site && roots.contains(&value))
                }
                User::Statement(_) => false,
            };
            if block.values.contains(&value)
                && self.may_move(value, may_differ)
                && flow
                    .shader
                    .users(flow.stage, value)
                    .iter()
                    .all(is_used_there)
            {
                alone.push(value);
            }
        }
        alone.reverse();
        OfSide { all, alone }
    }

    /// All that a value is computed of, the value with it, up to loads of variables.
    fn tree(&self, value: Value) -> Vec<Value> {
        let mut found = vec![value];
        let mut at = 0;
        while let Some(value) = found.get(at).copied() {
            at += 1;
            operands::each(&self.flow.function.expressions[value], |operand| {
                if !found.contains(&operand) {
                    found.push(operand);
                }
            });
        }
        found
    }

    /// Whether compilers see that a value is the same for the whole draw.
    fn is_plain(&self, value: Value) -> bool {
        self.tree(value)
            .into_iter()
            .all(|value| match self.flow.function.expressions[value] {
                Expression::Load { pointer } => self.is_read_only(pointer),
                Expression::FunctionArgument(_)
                | Expression::ImageSample { .. }
                | Expression::ImageLoad { .. } => false,
                _ => true,
            })
    }

    /// Whether a pointer leads to what the shader does not write.
    fn is_read_only(&self, pointer: Value) -> bool {
        let Some(variable) = self.flow.global(pointer) else {
            return false;
        };
        match self.flow.module.global_variables[variable].space {
            AddressSpace::Uniform | AddressSpace::Immediate => true,
            AddressSpace::Storage { access } => !access.contains(StorageAccess::STORE),
            _ => false,
        }
    }

    /// Whether a value may be computed later than it is, under a condition; `may_differ` when compilers may take that for
    /// one that neighbouring fragments decide differently.
    fn may_move(&self, value: Value, may_differ: bool) -> bool {
        let flow = self.flow;
        match flow.function.expressions[value] {
            Expression::Load { pointer } => self.is_read_only(pointer),
            Expression::Derivative { .. } => !may_differ,
            Expression::ImageSample { level, .. } => match level {
                SampleLevel::Auto | SampleLevel::Bias(_) => !may_differ,
                _ => true,
            },
            Expression::ImageLoad { image, .. } => match *flow.inner(image) {
                naga::TypeInner::Image {
                    class: ImageClass::Storage { access, .. },
                    ..
                } => !access.contains(StorageAccess::STORE),
                _ => true,
            },
            Expression::Compose { .. }
            | Expression::Access { .. }
            | Expression::AccessIndex { .. }
            | Expression::Splat { .. }
            | Expression::Swizzle { .. }
            | Expression::ImageQuery { .. }
            | Expression::Unary { .. }
            | Expression::Binary { .. }
            | Expression::Select { .. }
            | Expression::Relational { .. }
            | Expression::Math { .. }
            | Expression::As { .. }
            | Expression::ArrayLength(_) => true,
            _ => false,
        }
    }
}

/// What is computed for one side of an operation.
struct OfSide {
    /// All of it.
    all: Vec<Value>,
    /// What may be computed in a branch, since nothing else needs it, in order.
    alone: Vec<Value>,
}

/// What is around a value.
struct Around {
    /// What its own block computes.
    values: Vec<Value>,
    /// The conditions of the branches around it.
    conditions: Vec<Value>,
    in_loop: bool,
}

impl Around {
    fn of(block: &Block, value: Value) -> Option<Self> {
        let computed = block.iter().flat_map(|statement| match statement {
            Statement::Emit(range) => range.clone().collect(),
            _ => Vec::new(),
        });
        let values: Vec<Value> = computed.collect();
        if values.contains(&value) {
            return Some(Self {
                values,
                conditions: Vec::new(),
                in_loop: false,
            });
        }
        block.iter().find_map(|statement| {
            let mut blocks = operands::blocks(statement);
            let mut around = blocks.find_map(|block| Self::of(block, value))?;
            match *statement {
                Statement::If { condition, .. } => around.conditions.push(condition),
                Statement::Switch { selector, .. } => around.conditions.push(selector),
                Statement::Loop { .. } => around.in_loop = true,
                _ => {}
            }
            Some(around)
        })
    }
}

impl Branch {
    /// Makes it.
    pub(super) fn make(&self, flow: &Flow, edit: &mut Edit<'_>) {
        let path = flow.id(self.site).path();
        let condition = self.condition(flow, edit, path);
        let operation = flow.function.expressions[self.site].clone();
        let [on, off] = match operation {
            Expression::Select { accept, reject, .. } => [accept, reject],
            _ => {
                let off = match operation {
                    Expression::Math {
                        arg,
                        arg1: Some(arg1),
                        ..
                    } => match self.off {
                        Off::Zero => arg,
                        Off::One => arg1,
                    },
                    _ => {
                        let components = Shape::of(flow.inner(self.site)).map(Shape::components);
                        edit.constant(self.site, &vec![0; components.unwrap_or(1)])
                    }
                };
                [edit.add(format!("{path}.on"), operation), off]
            }
        };
        let [computed_on, computed_off] = self.sides.clone();
        let side = |computed, left| Side { computed, left };
        edit.branch(
            self.site,
            condition,
            [side(computed_on, on), side(computed_off, off)],
        );
    }

    /// What is true where the operation is not switched off.
    fn condition(&self, flow: &Flow, edit: &mut Edit<'_>, path: &str) -> Value {
        let inner = flow.inner(self.switch);
        let Some(components) = flow.floats(self.switch) else {
            return self.switch;
        };
        let path = format!("{path}.switch");
        let word = self.off.number().to_bits();
        let number = edit.constant(self.switch, &vec![word; components]);
        let differs = Expression::Binary {
            op: Op::NotEqual,
            left: self.switch,
            right: number,
        };
        let differs = edit.add(&*path, differs);
        match Shape::of(inner) {
            Some(Shape::Vector(..)) => edit.add(
                path,
                Expression::Relational {
                    fun: RelationalFunction::Any,
                    argument: differs,
                },
            ),
            _ => differs,
        }
    }
}
