//! whole-power: `pow(x, n)` with a whole n becomes multiplications. A pass of a program's own, not of lodc's.
//!
//! Precondition. The site is `pow` of floats in the fragment stage, with one constant exponent from 2 to 64, and whole.
//!
//! Effect. `multiply`: squares are taken, and the right ones multiplied: `pow(x, 5.0)` becomes `x * (x^2)^2`.
//!
//! Error. That of rounding. Where x is negative, `pow` is not defined, and this is.
//!
//! Declines. Another exponent, or one that is computed.
//!
//! This work is based on: Donald Knuth, "The Art of Computer Programming", volume 2, section 4.6.3.

use lodc_passes::{Candidate, Class, Considered, Declined, Edit, Facts, New, Pass, Shader, Stage};
use naga::{BinaryOperator, Expression, Function, Handle, Literal, MathFunction};

/// Up to where multiplications are cheaper than a power on every GPU that we know of.
const LARGEST: f32 = 64.0;

/// The pass.
pub(crate) struct WholePower;

impl Pass for WholePower {
    fn name(&self) -> &'static str {
        "whole-power"
    }

    fn summary(&self) -> &'static str {
        "a power with a whole exponent becomes multiplications"
    }

    // The last bits differ: a search measures whether anybody sees that.
    fn class(&self, _: &Candidate) -> Class {
        Class::Lossy
    }

    fn consider(&self, shader: &Shader, _: &Facts) -> Vec<Considered> {
        let Some(function) = shader.function(Stage::Fragment) else {
            return Vec::new();
        };
        let powers = function.expressions.iter().filter(|(_, expression)| {
            let fun = MathFunction::Pow;
            matches!(expression, Expression::Math { fun: f, .. } if *f == fun)
        });
        let considered = powers.map(|(site, _)| Considered {
            candidate: Candidate {
                pass: self.name().into(),
                site: shader.id(Stage::Fragment, site).clone(),
                choice: "multiply".into(),
                value: Vec::new(),
            },
            declined: plan(function, site).err(),
        });
        considered.collect()
    }

    fn applies(&self, shader: &Shader, candidate: &Candidate) -> Result<(), Declined> {
        planned(shader, candidate).map(drop)
    }

    fn apply(&self, shader: &Shader, candidate: &Candidate) -> Shader {
        let planned = planned(shader, candidate);
        let (site, base, mut power) = planned.unwrap_or_else(|why| panic!("{candidate}: {why}"));
        let mut edit = Edit::new(shader, Stage::Fragment);
        // The pass names what it makes by its candidate, so that the names are the same on every run.
        let path = format!("{}.multiply", candidate.site.path());
        let mut times = |left, right| {
            let op = BinaryOperator::Multiply;
            edit.add(path.clone(), Expression::Binary { op, left, right })
        };
        let (mut square, mut product) = (base, None);
        loop {
            if power % 2 == 1 {
                product = Some(product.map_or(square, |product| times(product, square)));
            }
            power /= 2;
            if power == 0 {
                break;
            }
            square = times(square, square);
        }
        edit.replace(site, New::Value(product.unwrap_or(base)));
        edit.finish()
    }
}

/// The site, what is raised to a power, and the power.
type Plan = (Handle<Expression>, Handle<Expression>, u32);

/// What a candidate does, where it still can.
fn planned(shader: &Shader, candidate: &Candidate) -> Result<Plan, Declined> {
    let declined = |why: &str| Declined(why.into());
    let found = shader.find(&candidate.site);
    let found = found.filter(|(stage, _)| *stage == Stage::Fragment);
    let (stage, site) = found.ok_or_else(|| declined("there is no such value"))?;
    let function = shader.function(stage);
    let function = function.ok_or_else(|| declined("there is no fragment stage"))?;
    match candidate.choice.as_str() {
        "multiply" => plan(function, site),
        other => Err(Declined(format!("whole-power has no choice `{other}`"))),
    }
}

fn plan(function: &Function, site: Handle<Expression>) -> Result<Plan, Declined> {
    let Expression::Math {
        fun: MathFunction::Pow,
        arg: base,
        arg1: Some(exponent),
        ..
    } = function.expressions[site]
    else {
        return Err(Declined("it is no power".into()));
    };
    match constant(function, exponent) {
        Some(power) if power.fract() == 0.0 && (2.0..=LARGEST).contains(&power) => {
            Ok((site, base, power as u32))
        }
        Some(_) => Err(Declined(format!(
            "the exponent is no whole number from 2 to {LARGEST}"
        ))),
        None => Err(Declined("the exponent is computed".into())),
    }
}

/// The number that all components of a value are, when that is known. In normal form constants are literals.
fn constant(function: &Function, value: Handle<Expression>) -> Option<f32> {
    match &function.expressions[value] {
        Expression::Literal(Literal::F32(number)) => Some(*number),
        Expression::Splat { value, .. } => constant(function, *value),
        Expression::Compose { components, .. } => {
            let mut numbers = components.iter().map(|part| constant(function, *part));
            let first = numbers.next()??;
            numbers.all(|number| number == Some(first)).then_some(first)
        }
        _ => None,
    }
}
