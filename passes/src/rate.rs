//! Rates: what every value varies over, and the cheapest rate at which it could be computed.
//!
//! ```text
//! Constant    nothing                           folded, or baked
//! Texel       the coordinates of textures       computed beforehand, into a texture
//! Draw        uniforms                          once a draw
//! Vertex      the surface                       in the vertex stage, and interpolated
//! Coarse      the screen, slowly                in a picture of lower resolution
//! Fragment    anything                          where it is
//! ```
//!
//! A value may move to a cheaper rate exactly when that rate can compute it and hand it over unchanged: what only
//! uniforms feed to the draw, what is an affine function of perspective-interpolated inputs to the vertices, since
//! interpolation is affine too. A product of two interpolated values is not. Approximately it may move wherever it can
//! be computed at all; where it stops, the value that stops it is named.
//!
//! The analysis errs on the careful side: a local variable holds whatever is stored in it anywhere, and what is stored
//! under a condition, or in a loop that a condition leaves, varies over all that the condition varies over.
//!
//! This work is based on: Tim Foley, Pat Hanrahan, "Spark: Modular, Composable Shaders for Graphics Hardware", 2011,
//! section 3 (rates); Rui Wang et al., "Automatic Shader Simplification using Surface Signal Approximation", 2014
//! (moving code between stages).

use crate::flow::{Flow, Value};
use crate::interface;
use crate::operands;
use crate::shader::{Shader, Stage};
use naga::{
    AddressSpace, BinaryOperator, Binding, Block, BuiltIn, Expression, Interpolation, MathFunction,
    SampleLevel, Sampling, Statement, TypeInner, UnaryOperator,
};
use std::fmt;

/// How often a value is computed, cheapest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rate {
    /// Never: it is a number.
    Constant,
    /// Once a texel, beforehand.
    Texel,
    /// Once a draw.
    Draw,
    /// Once a vertex.
    Vertex,
    /// Once a pixel of a picture of lower resolution.
    Coarse,
    /// Once a fragment.
    Fragment,
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Constant => "Constant",
            Self::Texel => "Texel",
            Self::Draw => "Draw",
            Self::Vertex => "Vertex",
            Self::Coarse => "Coarse",
            Self::Fragment => "Fragment",
        })
    }
}

/// How a value goes over the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Surface {
    /// It is the same everywhere.
    #[default]
    Same,
    /// It is the same over a triangle.
    Flat,
    /// It is an affine function of inputs that are interpolated on the screen.
    Linear,
    /// It is an affine function of inputs that are interpolated with perspective.
    Affine,
    /// It is something else.
    Curved,
}

impl Surface {
    /// That of a sum. A sum of values that are interpolated in different ways is interpolated in none.
    fn plus(self, other: Self) -> Self {
        match (self, other) {
            (Self::Same, one) | (one, Self::Same) => one,
            (one, same) if one == same => one,
            _ => Self::Curved,
        }
    }
}

/// Why a value cannot go to a cheaper rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// It is no affine function of what is interpolated.
    NotAffine,
    /// It reads a texture, whose level of detail is chosen for each fragment.
    ImplicitLevel,
    /// It reads a texture.
    Texture,
    /// It is a difference between neighbouring fragments.
    Derivative,
    /// It is the place of the fragment on the screen.
    Position,
    /// It tells front from back.
    FrontFacing,
    /// It is about the samples of a fragment.
    Sample,
    /// It is about the triangle.
    Primitive,
    /// It reads memory that the shader may write.
    Memory,
    /// It is shared between fragments that run together.
    Subgroup,
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotAffine => "what is not affine",
            Self::ImplicitLevel => "the sample with an implicit level",
            Self::Texture => "the texture read",
            Self::Derivative => "the derivative",
            Self::Position => "the fragment's position",
            Self::FrontFacing => "front-facing",
            Self::Sample => "the sample index",
            Self::Primitive => "the primitive's index",
            Self::Memory => "the memory that may be written",
            Self::Subgroup => "the subgroup operation",
        })
    }
}

/// The value that keeps another from a cheaper rate, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// The value, in the same stage.
    pub value: Value,
    /// What about it.
    pub why: Why,
}

/// What a value varies over.
#[derive(Clone, Copy, Debug, Default)]
pub struct Varies {
    /// Over draws: uniforms feed it.
    pub draw: bool,
    /// Over the surface.
    pub surface: Surface,
    /// Where it stopped to be affine, if it did.
    pub curved: Option<Stop>,
    /// The first texture read in it that varies within a draw.
    pub texels: Option<Stop>,
    /// What in it is known for fragments alone.
    pub screen: Option<Stop>,
}

impl Varies {
    const DRAW: Self = Self {
        draw: true,
        surface: Surface::Same,
        curved: None,
        texels: None,
        screen: None,
    };

    /// Known for fragments alone.
    fn on_screen(value: Value, why: Why) -> Self {
        Self {
            screen: Some(Stop { value, why }),
            ..Self::default()
        }
    }

    /// Whether it is the same for a whole draw.
    pub fn is_uniform(&self) -> bool {
        self.surface == Surface::Same && self.texels.is_none() && self.screen.is_none()
    }

    /// That of a sum, or of parts put together.
    fn plus(self, other: Self) -> Self {
        Self {
            draw: self.draw | other.draw,
            surface: self.surface.plus(other.surface),
            curved: self.curved.or(other.curved),
            texels: self.texels.or(other.texels),
            screen: self.screen.or(other.screen),
        }
    }

    /// That of any function: affine inputs come out curved, at `value`, and so does a sum of inputs that are
    /// interpolated in different ways.
    fn bent(self, value: Value) -> Self {
        match self.surface {
            Surface::Same | Surface::Flat => self,
            Surface::Linear | Surface::Affine | Surface::Curved => Self {
                surface: Surface::Curved,
                curved: self.curved.or(Some(Stop {
                    value,
                    why: Why::NotAffine,
                })),
                ..self
            },
        }
    }

    /// That of a product: affine as long as one factor is the same for the whole draw.
    fn times(self, other: Self, value: Value) -> Self {
        let product = self.plus(other);
        match self.is_uniform() || other.is_uniform() {
            true => product,
            false => product.bent(value),
        }
    }

    /// The same, where it is decided at `value` by what varies so.
    fn under(self, condition: Self, value: Value) -> Self {
        let decided = self.plus(condition);
        match condition.is_uniform() {
            true => decided,
            false => decided.bent(value),
        }
    }

    /// Whether it says the same as another, but for the values that are named.
    fn is_as(&self, other: &Self) -> bool {
        let flags = |v: &Self| (v.draw, v.surface, v.texels.is_some(), v.screen.is_some());
        flags(self) == flags(other)
    }
}

/// What every value of a stage varies over.
pub struct Rates {
    stage: Stage,
    of: Vec<Varies>,
}

impl Rates {
    /// Reads them off a stage of a shader; nothing when it lacks the stage. What a vertex stage hands over
    /// unchanged to all vertices is the same over the surface.
    pub fn of(shader: &Shader, stage: Stage) -> Option<Self> {
        let flow = Flow::new(shader, stage)?;
        let handed = match stage {
            Stage::Vertex | Stage::Parameter => None,
            Stage::Fragment => Self::of(shader, Stage::Vertex),
        };
        let analysis = Analysis {
            flow: &flow,
            shader,
            handed,
        };
        Some(Self {
            stage,
            of: analysis.run(),
        })
    }

    /// What a value varies over.
    pub fn varies(&self, value: Value) -> &Varies {
        &self.of[value.index()]
    }

    /// The rate of the stage, at which its values are computed as it stands.
    pub fn now(&self) -> Rate {
        match self.stage {
            Stage::Vertex => Rate::Vertex,
            Stage::Fragment => Rate::Fragment,
            Stage::Parameter => Rate::Draw,
        }
    }

    /// The cheapest rate at which a value can be computed without any change, but for rounding.
    pub fn exactly(&self, value: Value) -> Rate {
        let varies = self.varies(value);
        let rate = match varies.surface {
            _ if varies.screen.is_some() || varies.texels.is_some() => Rate::Fragment,
            Surface::Same if varies.draw => Rate::Draw,
            Surface::Same => Rate::Constant,
            Surface::Flat | Surface::Linear | Surface::Affine => Rate::Vertex,
            Surface::Curved => Rate::Fragment,
        };
        rate.min(self.now())
    }

    /// The cheapest rate at which it can be computed at all. What is read of textures alone can be computed texel by
    /// texel; filtering comes after that instead of before.
    pub fn approximately(&self, value: Value) -> Rate {
        let varies = self.varies(value);
        let rate = match varies.surface {
            _ if varies.screen.is_some() => Rate::Fragment,
            Surface::Same if varies.texels.is_some() && !varies.draw => Rate::Texel,
            Surface::Same if varies.texels.is_none() => self.exactly(value),
            _ => Rate::Vertex,
        };
        rate.min(self.now())
    }

    /// What keeps a value at the rate of its stage, or from going to a cheaper one exactly.
    pub fn stop(&self, value: Value) -> Option<Stop> {
        let varies = self.varies(value);
        varies.screen.or(varies.curved).or(varies.texels)
    }
}

/// What decides whether a statement is reached: the outermost condition, and what all of them vary over.
#[derive(Clone, Copy)]
struct Around {
    condition: Value,
    varies: Varies,
}

/// One analysis.
struct Analysis<'a> {
    flow: &'a Flow<'a>,
    shader: &'a Shader,
    /// The vertex stage's, for what it hands over.
    handed: Option<Rates>,
}

impl Analysis<'_> {
    fn run(&self) -> Vec<Varies> {
        let function = self.flow.function;
        let mut of = vec![Varies::default(); function.expressions.len()];
        let mut locals = vec![Varies::default(); function.local_variables.len()];
        // What a loop stores reaches the loads above it in another round; nothing is ever taken back.
        loop {
            for (value, _) in function.expressions.iter() {
                of[value.index()] = self.value(value, &of, &locals);
            }
            let before = locals.clone();
            self.stores(&function.body, None, &of, &mut locals);
            if locals
                .iter()
                .zip(&before)
                .all(|(now, then)| now.is_as(then))
            {
                return of;
            }
        }
    }

    /// What a value varies over, as its operands do.
    fn value(&self, value: Value, of: &[Varies], locals: &[Varies]) -> Varies {
        let at = |operand: Value| of[operand.index()];
        let expression = &self.flow.function.expressions[value];
        let all = || {
            let mut sum = Varies::default();
            operands::each(expression, |operand| sum = sum.plus(at(operand)));
            sum
        };
        match *expression {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::Override(_)
            | Expression::ZeroValue(_) => Varies::default(),
            Expression::FunctionArgument(_) => match self.flow.input(value) {
                Some(binding) => self.input(value, binding),
                // A structure: its members say it.
                None => Varies::default(),
            },
            Expression::AccessIndex { .. } if self.flow.input(value).is_some() => self
                .flow
                .input(value)
                .map_or_else(Varies::default, |binding| self.input(value, binding)),
            Expression::LocalVariable(local) => locals[local.index()],
            Expression::GlobalVariable(global) => {
                match self.flow.module.global_variables[global].space {
                    AddressSpace::Uniform | AddressSpace::Immediate => Varies::DRAW,
                    AddressSpace::Storage { access }
                        if !access.contains(naga::StorageAccess::STORE) =>
                    {
                        Varies::DRAW
                    }
                    // What is read of a texture is said there.
                    AddressSpace::Handle => Varies::default(),
                    _ => Varies::on_screen(value, Why::Memory),
                }
            }
            Expression::Compose { .. }
            | Expression::Splat { .. }
            | Expression::Swizzle { .. }
            | Expression::AccessIndex { .. }
            | Expression::Load { .. }
            | Expression::Unary {
                op: UnaryOperator::Negate,
                ..
            } => all(),
            Expression::Access { base, index } => at(base).under(at(index), value),
            Expression::Select {
                condition,
                accept,
                reject,
            } => at(accept).plus(at(reject)).under(at(condition), value),
            Expression::Binary { op, left, right } => match op {
                BinaryOperator::Add | BinaryOperator::Subtract if self.flow.is_float(value) => {
                    all()
                }
                BinaryOperator::Multiply if self.flow.is_float(value) => {
                    at(left).times(at(right), value)
                }
                BinaryOperator::Divide if self.flow.is_float(value) && at(right).is_uniform() => {
                    all()
                }
                _ => all().bent(value),
            },
            Expression::Math {
                fun,
                arg,
                arg1,
                arg2,
                ..
            } => {
                let [first, second, third] =
                    [Some(arg), arg1, arg2].map(|a| a.map_or_else(Varies::default, at));
                match fun {
                    _ if !self.flow.is_float(value) => all().bent(value),
                    MathFunction::Dot | MathFunction::Cross | MathFunction::Outer => {
                        first.times(second, value)
                    }
                    MathFunction::Fma => first.times(second, value).plus(third),
                    MathFunction::Mix if third.is_uniform() => all(),
                    MathFunction::Mix if first.is_uniform() && second.is_uniform() => all(),
                    MathFunction::Radians | MathFunction::Degrees | MathFunction::Transpose => {
                        first
                    }
                    _ => all().bent(value),
                }
            }
            Expression::As { expr, .. } => {
                match self.flow.is_float(value) && self.flow.is_float(expr) {
                    true => at(expr),
                    false => at(expr).bent(value),
                }
            }
            Expression::ImageSample { ref level, .. } => {
                let why = match level {
                    SampleLevel::Auto | SampleLevel::Bias(_) => Why::ImplicitLevel,
                    _ => Why::Texture,
                };
                self.read(value, why, all())
            }
            Expression::ImageLoad { image, .. } => {
                let is_storage = matches!(
                    self.flow.inner(image),
                    TypeInner::Image {
                        class: naga::ImageClass::Storage { access, .. },
                        ..
                    } if access.contains(naga::StorageAccess::STORE)
                );
                match is_storage {
                    true => Varies::on_screen(value, Why::Memory),
                    false => self.read(value, Why::Texture, all()),
                }
            }
            // Over what is the same everywhere a derivative is 0, and so is the same.
            Expression::Derivative { expr, .. } if at(expr).is_uniform() => at(expr),
            Expression::Derivative { .. } => all()
                .plus(Varies::on_screen(value, Why::Derivative))
                .bent(value),
            Expression::ImageQuery { .. } => all().bent(value).plus(Varies::DRAW),
            Expression::ArrayLength(_)
            | Expression::Unary { .. }
            | Expression::Relational { .. } => all().bent(value),
            Expression::CallResult(_)
            | Expression::AtomicResult { .. }
            | Expression::WorkGroupUniformLoadResult { .. }
            | Expression::RayQueryVertexPositions { .. }
            | Expression::RayQueryProceedResult
            | Expression::RayQueryGetIntersection { .. } => Varies::on_screen(value, Why::Memory),
            Expression::SubgroupBallotResult
            | Expression::SubgroupOperationResult { .. }
            | Expression::CooperativeLoad { .. }
            | Expression::CooperativeMultiplyAdd { .. } => Varies::on_screen(value, Why::Subgroup),
        }
    }

    /// What a texture read gives, whose operands vary so. Coordinates that are affine, or read of textures themselves,
    /// are what texels are counted in. A texture is one of the draw's, as uniforms are, where one texel of it is read.
    fn read(&self, value: Value, why: Why, operands: Varies) -> Varies {
        if operands.is_uniform() {
            return operands.plus(Varies::DRAW);
        }
        let texels = operands.texels.or(Some(Stop { value, why }));
        match operands.surface {
            Surface::Same | Surface::Affine => Varies {
                surface: Surface::Same,
                texels,
                ..operands
            },
            _ => Varies {
                texels,
                ..operands.bent(value)
            },
        }
    }

    /// An input of the stage.
    fn input(&self, value: Value, binding: &Binding) -> Varies {
        let over = |surface| Varies {
            surface,
            ..Varies::default()
        };
        match *binding {
            Binding::BuiltIn(built_in) => match built_in {
                BuiltIn::VertexIndex | BuiltIn::InstanceIndex => over(Surface::Curved),
                BuiltIn::BaseInstance | BuiltIn::BaseVertex | BuiltIn::DrawIndex => Varies::DRAW,
                BuiltIn::Position { .. } | BuiltIn::PointCoord => {
                    Varies::on_screen(value, Why::Position)
                }
                BuiltIn::FrontFacing => Varies::on_screen(value, Why::FrontFacing),
                BuiltIn::SampleIndex | BuiltIn::SampleMask => Varies::on_screen(value, Why::Sample),
                BuiltIn::SubgroupSize | BuiltIn::SubgroupInvocationId => {
                    Varies::on_screen(value, Why::Subgroup)
                }
                _ => Varies::on_screen(value, Why::Primitive),
            },
            Binding::Location {
                location,
                interpolation,
                sampling,
                ..
            } => {
                if let Some(handed) = self.handed(location) {
                    return handed;
                }
                // Elsewhere than at the centre, it is another place on the surface than other inputs'.
                let centred = matches!(sampling, None | Some(Sampling::Center));
                match interpolation {
                    Some(Interpolation::Flat) => over(Surface::Flat),
                    Some(Interpolation::Linear) if centred => over(Surface::Linear),
                    None | Some(Interpolation::Perspective) if centred => over(Surface::Affine),
                    _ => over(Surface::Curved),
                }
            }
        }
    }

    /// What the vertex stage gives a location, when that is the same for the whole draw.
    fn handed(&self, location: u32) -> Option<Varies> {
        let rates = self.handed.as_ref()?;
        let mut returned = interface::returned(self.shader).into_iter();
        let is_it = |part: &interface::Returned| {
            interface::location(part.binding.as_ref()) == Some(location)
        };
        let varies = rates.varies(returned.find(is_it)?.value?);
        varies.is_uniform().then_some(*varies)
    }

    /// Adds to each local variable what is stored in it, and what decides whether it is.
    fn stores(&self, block: &Block, around: Option<Around>, of: &[Varies], locals: &mut [Varies]) {
        let within = |around: Option<Around>, condition: Value| {
            let varies = of[condition.index()];
            Some(match around {
                Some(around) => Around {
                    varies: around.varies.plus(varies),
                    ..around
                },
                None => Around { condition, varies },
            })
        };
        for statement in block {
            let inside = match *statement {
                Statement::If { condition, .. } => within(around, condition),
                Statement::Switch { selector, .. } => within(around, selector),
                Statement::Loop {
                    ref body,
                    ref continuing,
                    break_if,
                } => {
                    let mut exits: Vec<Value> = break_if.into_iter().collect();
                    ways_out(body, &mut exits);
                    ways_out(continuing, &mut exits);
                    exits.into_iter().fold(around, within)
                }
                Statement::Store { pointer, value } => {
                    if let Some(local) = self.flow.local(pointer) {
                        let stored = of[value.index()];
                        let stored = match around {
                            Some(around) => stored.under(around.varies, around.condition),
                            None => stored,
                        };
                        let local = &mut locals[local.index()];
                        *local = local.plus(stored).under(self.indices(pointer, of), value);
                    }
                    continue;
                }
                _ => around,
            };
            for inner in operands::blocks(statement) {
                self.stores(inner, inside, of, locals);
            }
        }
    }

    /// What the indices of a pointer vary over.
    fn indices(&self, pointer: Value, of: &[Varies]) -> Varies {
        match self.flow.function.expressions[pointer] {
            Expression::Access { base, index } => self.indices(base, of).plus(of[index.index()]),
            Expression::AccessIndex { base, .. } => self.indices(base, of),
            _ => Varies::default(),
        }
    }
}

/// The conditions of a loop's body that decide whether it goes on as written.
pub(crate) fn ways_out(block: &Block, conditions: &mut Vec<Value>) {
    for statement in block {
        let condition = match *statement {
            Statement::If { condition, .. } => Some(condition),
            Statement::Switch { selector, .. } => Some(selector),
            _ => None,
        };
        if let Some(condition) = condition {
            let mut leaves = false;
            for inner in operands::blocks(statement) {
                operands::walk(inner, &mut |statement| {
                    leaves |= matches!(
                        statement,
                        Statement::Break
                            | Statement::Continue
                            | Statement::Return { .. }
                            | Statement::Kill
                    );
                });
            }
            if leaves {
                conditions.push(condition);
            }
        }
        for inner in operands::blocks(statement) {
            ways_out(inner, conditions);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::shader;

    /// Rates of the values of a fragment shader that are named in it.
    fn rates(items: &str, inputs: &str, body: &str) -> impl Fn(&str) -> (Rate, Rate, Option<Why>) {
        let shader = shader(&format!(
            "struct U {{ tint: vec3f, scale: f32, count: i32, lights: array<vec4f, 4> }}
             @group(0) @binding(0) var<uniform> u: U;
             @group(0) @binding(1) var t: texture_2d<f32>;
             @group(0) @binding(2) var s: sampler;
             {items}
             @fragment fn main(@location(0) uv: vec2f, @location(1) n: vec3f, {inputs}) -> @location(0) vec4f {{
                 {body}
                 return vec4f();
             }}"
        ));
        let rates = Rates::of(&shader, Stage::Fragment).expect("it has the stage");
        move |name| {
            let (_, value) = shader
                .find(&name.into())
                .unwrap_or_else(|| panic!("no value {name}"));
            let why = rates.stop(value).map(|stop| stop.why);
            (rates.exactly(value), rates.approximately(value), why)
        }
    }

    #[test]
    fn what_is_affine_goes_to_the_vertices_exactly_and_a_product_of_two_inputs_does_not() {
        let of = rates(
            "",
            "@location(2) @interpolate(flat) kind: i32, @location(3) @interpolate(linear) onscreen: vec2f,
             @location(4) @interpolate(flat) shade: vec3f, @location(5) @interpolate(perspective, centroid) near: vec2f",
            "let affine = (uv * u.scale + u.tint.xy) / u.scale; let product = uv.x * uv.y;
             let turned = dot(n, u.tint); let both = n + vec3f(onscreen, 1.0);
             let flatly = shade * u.tint * shade; let flat_and_not = shade + n; let unit = normalize(n);
             let mixed = mix(u.tint, u.lights[1].xyz, uv.x); let divided = u.scale / uv.x;
             let linearly = onscreen * 2.0; let centroid = near * 2.0; let at_kind = u.lights[kind];
             let of_bools = select(u.tint, n, uv.x > 0.5); let by_draw = select(n, -n, u.scale > 0.5);",
        );
        let exactly = (Rate::Vertex, Rate::Vertex, None);
        let curved = (Rate::Fragment, Rate::Vertex, Some(Why::NotAffine));
        for name in [
            "affine", "turned", "mixed", "flatly", "linearly", "at_kind", "by_draw",
        ] {
            assert_eq!(of(name), exactly, "{name}");
        }
        for name in ["product", "unit", "divided", "of_bools"] {
            assert_eq!(of(name), curved, "{name}");
        }
        for name in ["both", "flat_and_not", "centroid"] {
            assert_eq!(
                (of(name).0, of(name).1),
                (Rate::Fragment, Rate::Vertex),
                "{name}"
            );
        }
    }

    #[test]
    fn uniforms_go_to_the_draw_and_numbers_nowhere() {
        let of = rates(
            "",
            "@builtin(position) at: vec4f",
            "let number = 2.0 * 3.0; let sun = normalize(u.tint) * u.scale; let texel = textureLoad(t, vec2i(1), 0);
             let size = textureDimensions(t); let pixel = at.x * u.scale; let still = dpdx(u.scale);",
        );
        let draw = (Rate::Draw, Rate::Draw, None);
        for name in ["sun", "texel", "size", "still"] {
            assert_eq!(of(name), draw, "{name}");
        }
        assert_eq!(of("number"), (Rate::Constant, Rate::Constant, None));
        assert_eq!(
            of("pixel"),
            (Rate::Fragment, Rate::Fragment, Some(Why::Position))
        );
    }

    #[test]
    fn textures_go_to_texels_unless_something_else_feeds_them() {
        let of = rates(
            "",
            "",
            "let colour = textureSample(t, s, uv); let darker = colour * colour * 0.5;
             let again = textureSample(t, s, colour.xy); let tinted = colour.xyz * u.tint;
             let lit = colour.x * n.x; let moved = textureSample(t, s, uv + u.scale);
             let round = textureSampleLevel(t, s, normalize(n).xy, 0.0); let slope = dpdx(uv.x);
             let bumped = textureSampleGrad(t, s, uv, vec2f(slope), vec2f());",
        );
        let texel = (Rate::Fragment, Rate::Texel, Some(Why::ImplicitLevel));
        for name in ["colour", "darker", "again"] {
            assert_eq!(of(name), texel, "{name}");
        }
        for name in ["tinted", "lit", "moved"] {
            assert_eq!(
                (of(name).0, of(name).1),
                (Rate::Fragment, Rate::Vertex),
                "{name}"
            );
        }
        assert_eq!(of("round").1, Rate::Vertex);
        for name in ["slope", "bumped"] {
            assert_eq!(
                of(name),
                (Rate::Fragment, Rate::Fragment, Some(Why::Derivative)),
                "{name}"
            );
        }
    }

    #[test]
    fn variables_vary_over_what_is_stored_and_over_what_decides_it() {
        let of = rates(
            "",
            "",
            "var sum = vec3f(); for (var i = 0; i < u.count; i++) { sum += u.lights[i].xyz * n.x; }
             let summed = sum;
             var power = 1.0; for (var i = 0; i < 3; i++) { power *= uv.x; } let raised = power;
             var chosen = u.scale; if (uv.x > 0.5) { chosen = 2.0; } let side = chosen;
             var by_flag = uv.x; if (u.scale > 0.5) { by_flag = uv.y; } let flagged = by_flag;
             var rounds = 0.0; loop { if (f32(rounds) > n.x) { break; } rounds += 1.0; } let left = rounds;
             var list = array<f32, 4>(); list[u.count] = 1.0; let kept = list[1]; list[i32(uv.x)] = 1.0;",
        );
        assert_eq!(of("summed"), (Rate::Vertex, Rate::Vertex, None));
        assert_eq!(of("flagged"), (Rate::Vertex, Rate::Vertex, None));
        for name in ["raised", "side", "left", "kept"] {
            assert_eq!(
                of(name),
                (Rate::Fragment, Rate::Vertex, Some(Why::NotAffine)),
                "{name}"
            );
        }
    }

    #[test]
    fn what_the_vertex_stage_hands_over_unchanged_is_the_draws() {
        let module = "struct V { @builtin(position) at: vec4f, @location(0) tint: vec3f, @location(1) uv: vec2f }
             @group(0) @binding(0) var<uniform> u: vec4f;
             @vertex fn vs(@location(0) p: vec3f) -> V { return V(vec4f(p, 1.0), u.xyz * 2.0, p.xy); }
             @fragment fn fs(v: V) -> @location(0) vec4f { let tint = v.tint; let uv = v.uv; return vec4f(tint, uv.x); }";
        let module = naga::front::wgsl::parse_str(module).expect("it parses");
        let shader =
            crate::normalize(&module, Some("vs"), "fs", 1000).expect("it has a normal form");
        let rates = Rates::of(&shader, Stage::Fragment).expect("it has the stage");
        let at = |path: &str| {
            let found = shader.find(&path.into());
            found.unwrap_or_else(|| panic!("no {path}")).1
        };
        assert_eq!(rates.exactly(at("fs.v.tint")), Rate::Draw);
        assert_eq!(rates.exactly(at("fs.v.uv")), Rate::Vertex);
    }
}
