//! The static cost model: what each operation is worth, by class.
//!
//! Texture samples are kept apart from arithmetic. How often an operation is executed is not known
//! here: the evaluator counts that, and multiplies. The classes of scalar operations stand in the table of
//! [`crate::semantics`]; an operation on vectors costs what it is made of there. Loads, accesses,
//! swizzles and composition are free, and so is what a compiler computes once and for all.

use crate::operands;
use crate::semantics::{self, Op, Operation, Scalars, Shape};
use naga::front::Typifier;
use naga::proc::{ResolveContext, ResolveError};
use naga::{Arena, DerivativeAxis, Expression, Function, Handle, Module, Statement};
use std::ops::{Add, AddAssign, Mul};

/// Executed work, per shaded fragment (or vertex) once it has been divided by how many there were.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Scalar operations at full rate: add, multiply, compare, select, convert.
    pub simple: f64,
    /// Scalar operations at quarter rate: division, square roots, exponentials, trigonometry.
    pub special: f64,
    /// Texture samples, loads and gathers.
    pub samples: f64,
    /// What has been moved to other stages and is executed there, and what handing it over costs, in full-rate scalar
    /// operations.
    pub moved: f64,
}

/// Full-rate scalar operations that a quarter-rate one is worth.
pub const SPECIAL_WEIGHT: f64 = 4.0;
/// Full-rate scalar operations that a texture sample is worth: the figure of He, Foley, Tatarchuk and
/// Fatahalian 2015, section 5.
pub const SAMPLE_WEIGHT: f64 = 100.0;

/// Full-rate scalar operations that the interpolation of one component of a fragment's input is worth: two
/// multiplications and two additions, with the values of a triangle's corners at hand as differences.
pub const INTERPOLATION_WEIGHT: f64 = 4.0;
/// The same of a component that is the same for a whole triangle.
pub const FLAT_WEIGHT: f64 = 1.0;

impl Work {
    /// Arithmetic alone, in full-rate scalar operations.
    pub fn operations(&self) -> f64 {
        self.simple + SPECIAL_WEIGHT * self.special
    }

    /// All of it in one number, in full-rate scalar operations.
    pub fn total(&self) -> f64 {
        self.operations() + SAMPLE_WEIGHT * self.samples + self.moved
    }
}

impl Add for Work {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            simple: self.simple + other.simple,
            special: self.special + other.special,
            samples: self.samples + other.samples,
            moved: self.moved + other.moved,
        }
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul<f64> for Work {
    type Output = Self;
    fn mul(self, times: f64) -> Self {
        Self {
            simple: self.simple * times,
            special: self.special * times,
            samples: self.samples * times,
            moved: self.moved * times,
        }
    }
}

/// The types of a function's expressions.
///
/// # Errors
/// When the function is not well typed; a validated one is.
pub fn types(module: &Module, function: &Function) -> Result<Typifier, ResolveError> {
    let context =
        ResolveContext::with_locals(module, &function.local_variables, &function.arguments);
    let mut types = Typifier::new();
    if let Some((last, _)) = function.expressions.iter().next_back() {
        types.grow(last, &function.expressions, &context)?;
    }
    Ok(types)
}

/// The work of one evaluation of an expression, without that of its operands. Nothing when all its
/// operands are constants.
pub fn of_expression(
    module: &Module,
    expressions: &Arena<Expression>,
    types: &Typifier,
    expression: Handle<Expression>,
) -> Work {
    let mut constant = true;
    let given = &expressions[expression];
    operands::each(given, |operand| {
        constant &= is_constant(expressions, operand);
    });
    if constant {
        return Work::default();
    }
    of_varying(module, types, given)
}

/// The work of each expression, as [`of_expression`] has it.
pub fn of_expressions(
    module: &Module,
    expressions: &Arena<Expression>,
    types: &Typifier,
) -> Vec<Work> {
    let mut constant: Vec<bool> = Vec::with_capacity(expressions.len());
    expressions
        .iter()
        .map(|(_, expression)| {
            let mut fixed = true;
            operands::each(expression, |operand| fixed &= constant[operand.index()]);
            constant.push(fixed && may_be_constant(expression));
            if fixed {
                Work::default()
            } else {
                of_varying(module, types, expression)
            }
        })
        .collect()
}

/// The work of a function whose every statement is executed once: all branches, one round of each
/// loop, and the functions that it calls.
///
/// # Errors
/// When the function is not well typed; a validated one is.
pub fn of_function(module: &Module, function: &Function) -> Result<Work, ResolveError> {
    let types = types(module, function)?;
    let costs = of_expressions(module, &function.expressions, &types);
    let mut total = Work::default();
    let mut called = Vec::new();
    operands::walk(&function.body, &mut |statement| match statement {
        Statement::Emit(range) => {
            for expression in range.clone() {
                total += costs[expression.index()];
            }
        }
        Statement::Call { function, .. } => called.push(*function),
        _ => {}
    });
    for function in called {
        total += of_function(module, &module.functions[function])?;
    }
    Ok(total)
}

/// Whether an expression is constant as soon as its operands are.
fn may_be_constant(expression: &Expression) -> bool {
    match expression {
        Expression::Literal(_)
        | Expression::Constant(_)
        | Expression::Override(_)
        | Expression::ZeroValue(_)
        | Expression::Compose { .. }
        | Expression::Access { .. }
        | Expression::AccessIndex { .. }
        | Expression::Splat { .. }
        | Expression::Swizzle { .. } => true,
        _ => Operation::of(expression).is_some(),
    }
}

fn is_constant(expressions: &Arena<Expression>, expression: Handle<Expression>) -> bool {
    let given = &expressions[expression];
    let mut constant = may_be_constant(given);
    operands::each(given, |operand| {
        constant = constant && is_constant(expressions, operand);
    });
    constant
}

/// Counts scalar operations instead of doing them.
struct Count {
    simple: u32,
    special: u32,
}

impl Scalars for Count {
    type Value = ();
    fn word(&mut self, _: u32) {}
    fn float(&mut self, _: f32) {}
    fn apply(&mut self, op: Op, _: &[()]) {
        let (simple, special) = op.cost();
        self.simple += simple;
        self.special += special;
    }
}

fn of_varying(module: &Module, types: &Typifier, expression: &Expression) -> Work {
    let shape = |operand: Handle<Expression>| Shape::of(types.get(operand, &module.types));
    let mut work = Work::default();
    match expression {
        Expression::ImageSample { .. } | Expression::ImageLoad { .. } => work.samples = 1.0,
        Expression::ImageQuery { .. } | Expression::ArrayLength(_) => work.simple = 1.0,
        Expression::Derivative { axis, expr, .. } => {
            let each = match axis {
                DerivativeAxis::X | DerivativeAxis::Y => 1,
                DerivativeAxis::Width => 5,
            };
            work.simple = shape(*expr).map_or(0, |s| s.components() * each) as f64;
        }
        _ => {
            let Some((operation, operands)) = Operation::of(expression) else {
                return work;
            };
            let Some(shapes) = operands
                .iter()
                .map(|&o| shape(o))
                .collect::<Option<Vec<_>>>()
            else {
                return work;
            };
            let nothing = [(); 16];
            let given: Vec<(Shape, &[()])> = shapes
                .iter()
                .map(|&shape| (shape, &nothing[..shape.components()]))
                .collect();
            let mut count = Count {
                simple: 0,
                special: 0,
            };
            // What does not expand is not evaluated either.
            let _ = semantics::expand(&mut count, operation, &given);
            work.simple = f64::from(count.simple);
            work.special = f64::from(count.special);
        }
    }
    work
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The work of the entry point of a fragment shader with this body, `a` and `b` being inputs.
    fn work(body: &str) -> (f64, f64, f64) {
        let source = format!(
            "@group(0) @binding(0) var t: texture_2d<f32>;
             @group(0) @binding(1) var s: sampler;
             @group(0) @binding(2) var<uniform> m: mat4x4f;
             const k = 2.0;
             @fragment fn main(@location(0) a: vec3f, @location(1) b: vec3f) -> @location(0) vec4f {{
                {body}
             }}"
        );
        let module = naga::front::wgsl::parse_str(&source).expect("it parses");
        let work = of_function(&module, &module.entry_points[0].function).expect("it is typed");
        (work.simple, work.special, work.samples)
    }

    #[test]
    fn counts_components_and_classes() {
        assert_eq!(work("return vec4(a + b, 1.0);"), (3.0, 0.0, 0.0));
        assert_eq!(work("return vec4(a / b, 1.0);"), (0.0, 3.0, 0.0));
        assert_eq!(work("return vec4(dot(a, b));"), (5.0, 0.0, 0.0));
        assert_eq!(work("return vec4(normalize(a), 1.0);"), (8.0, 1.0, 0.0));
        assert_eq!(work("return vec4(pow(a.x, b.x));"), (1.0, 2.0, 0.0));
        assert_eq!(work("return m * vec4(a, 1.0);"), (28.0, 0.0, 0.0));
        assert_eq!(work("return vec4(a.zyx, b.x);"), (0.0, 0.0, 0.0));
        assert_eq!(work("return textureSample(t, s, a.xy);"), (0.0, 0.0, 1.0));
        assert_eq!(work("return vec4(dpdx(a), fwidth(b.x));"), (8.0, 0.0, 0.0));
    }

    #[test]
    fn constants_are_free() {
        assert_eq!(work("return vec4(k * sqrt(2.0) + 1.0);"), (0.0, 0.0, 0.0));
        assert_eq!(work("return vec4(a * (k * 3.0), 1.0);"), (3.0, 0.0, 0.0));
    }

    #[test]
    fn counts_branches_loops_and_calls_once() {
        assert_eq!(
            work("var x = a.x; if b.x > 0.0 { x += 1.0; } else { x *= 2.0; } return vec4(x);"),
            (3.0, 0.0, 0.0)
        );
    }
}
