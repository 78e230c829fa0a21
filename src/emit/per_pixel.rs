//! A level for each pixel: autoLOD from the derivatives of the texture coordinates.
//!
//! ```text
//! fn fs_main(in) { pixel_lod <- derivatives of in.uv; gradients <- fronts of all levels; branch by pixel_lod }
//! ```
//!
//! Pixels side by side may be of different levels, so that what looks at a pixel's neighbours comes in front of the branch:
//! every function behind it takes its gradients as arguments.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail", 2003, section 5,
//! which draws an extra pass for the level of each pixel.

use super::EmitLevel;
use super::body::{Body, Hidden};
use super::level::gradient_function;
use super::parameters::Block;
use super::splice::{Behind, Chosen};
use super::varyings::Varyings;
use super::vertex::members;
use crate::front::Source;
use crate::front::identifiers::Names;
use crate::{Diagnostic, Result};
use lodc_passes::gradients::{Front, NotExplicit, explicit};
use lodc_passes::{Shader, Stage, operands};
use naga::{Expression, Function, Handle, SampleLevel, Scalar, TypeInner, VectorSize};
use std::collections::BTreeSet;

/// What the entry point of the fragment stage needs to choose for each pixel.
pub(crate) struct PerPixel {
    /// The expression of the pixel's autoLOD.
    pub(crate) value: String,
    /// What comes in front of the branch.
    pub(crate) before: String,
    /// The original with explicit gradients, where it derives something; else the author's function does.
    pub(crate) original: Option<EmitLevel>,
    /// The levels with explicit gradients.
    pub(crate) levels: Vec<EmitLevel>,
    /// What computes gradients for the original and each level, where they derive something.
    fronts: Vec<Option<Front>>,
    /// For each, which gradients its function takes, in order.
    inputs: Vec<Vec<usize>>,
    /// For the original and each level, the function of its front, the struct that it returns, and the variable.
    names: Vec<[String; 3]>,
}

impl PerPixel {
    /// What a source and its levels need. `scale` is how far texture coordinates go from pixel to pixel where autoLOD is 0.
    ///
    /// # Errors
    /// When the fragment stage has no texture coordinates, derives what is known only on the way, or has a level that
    /// wants a vertex stage of its own.
    pub(crate) fn new(
        body: &Body<'_>,
        (base, levels): (&Shader, &[EmitLevel]),
        (fragment, varyings): (&Chosen, &Varyings),
        scale: f32,
        names: &mut Names,
    ) -> Result<std::result::Result<Self, Hidden>> {
        for word in ["dpdx", "dpdy", "log2", "min", "dot"] {
            if let Some(hidden) = body.hides(word) {
                return Ok(Err(hidden));
            }
        }
        let source = body.source;
        if let Some(at) = varyings.of_levels.iter().position(|own| !own.is_empty()) {
            let number = super::number(levels, at + 1);
            return Err(Diagnostic::error(format!(
                "level {number} has a vertex stage of its own, which no pixel can choose"
            ))
            .with_note("make the levels for it: run lodc with `--per-pixel`, without `--locked`"));
        }
        let Some(coordinates) = coordinates(body, base, fragment) else {
            return Err(Diagnostic::error(
                "a level for each pixel is told from texture coordinates, and the fragment stage has none among its inputs",
            )
            .with_note("hand a vec2f of texture coordinates to the fragment stage, or leave `--per-pixel` out"));
        };
        let mut local = Names::default();
        local.reserve(body.declared.iter().copied());
        local.reserve(&fragment.functions);
        local.reserve(&fragment.arguments);
        let mut take = |wish: &str| local.take_local(wish, &BTreeSet::new());
        let [across, down, value] = ["across", "down", "pixel_lod"].map(&mut take);
        let square = f64::from(scale).powi(2) as f32;
        let mut before = format!(
            "let {across} = dpdx({coordinates});\nlet {down} = dpdy({coordinates});\n\
             // Halvings of scale of this pixel since the nearest view.\n\
             let {value} = 0.5 * log2(min(dot({across}, {across}), dot({down}, {down})) / {square:e});\n"
        );
        let mut fronts = Vec::new();
        let mut inputs = Vec::new();
        let mut of_all = Vec::new();
        let mut made = Vec::new();
        let shaders = std::iter::once(base).chain(levels.iter().map(|level| &level.shader));
        for (at, shader) in shaders.enumerate() {
            let name = &fragment.functions[at];
            let found = explicit(shader).map_err(|error| refused(source, shader, &error))?;
            let called = [
                names.take(&format!("{name}_gradients")),
                names.take(&format!("{}Gradients", in_capitals(name))),
                take(&format!("of_{name}")),
            ];
            let (shader, front, taken) = match found {
                Some(explicit) => (Some(explicit.shader), Some(explicit.front), explicit.inputs),
                None => (None, None, Vec::new()),
            };
            inputs.push(taken);
            let is_called = at > 0 || super::at_zero(levels).0.is_none();
            if front.is_some() && is_called {
                before += &format!("let {} = {};\n", called[2], fragment.call(&called[0], &[]));
            }
            fronts.push(front);
            of_all.push(called);
            made.push(shader);
        }
        let mut made = made.into_iter();
        let original = made.next().flatten().map(|shader| EmitLevel {
            says: "the original, with explicit gradients".to_owned(),
            ..EmitLevel::original(shader)
        });
        let levels = levels.iter().zip(made).map(|(level, shader)| EmitLevel {
            shader: shader.unwrap_or_else(|| level.shader.clone()),
            ..level.clone()
        });
        Ok(Ok(Self {
            value,
            before,
            original,
            levels: levels.collect(),
            fronts,
            inputs,
            names: of_all,
        }))
    }

    /// The arguments of the function of the original or of a level behind the entry point's own.
    pub(crate) fn arguments(&self, at: usize, members: &[Vec<String>]) -> Vec<String> {
        let [_, _, variable] = &self.names[at];
        let taken = self.inputs[at].iter();
        taken
            .filter_map(|gradient| members[at].get(*gradient))
            .map(|member| format!("{variable}.{member}"))
            .collect()
    }

    /// The fronts as text, each with its struct, and the members of that.
    pub(crate) fn written(
        &self,
        (base, levels): (&Shader, &[EmitLevel]),
        block: Option<&Block>,
        behind: &mut Behind<'_, '_>,
    ) -> Result<std::result::Result<Written, Hidden>> {
        let mut out = String::new();
        let mut all = Vec::new();
        let original = EmitLevel::original(base.clone());
        for (at, (front, [name, result, _])) in self.fronts.iter().zip(&self.names).enumerate() {
            let is_called = at > 0 || super::at_zero(levels).0.is_none();
            let Some(front) = front.as_ref().filter(|_| is_called) else {
                all.push(Vec::new());
                continue;
            };
            let (level, block) = match at.checked_sub(1) {
                None => ((0, &original), None),
                Some(level) => ((level, &levels[level]), block),
            };
            let called = (&**name, &**result);
            let printed =
                gradient_function(behind.body, level, front, called, block, &behind.names)?;
            let function = match behind.take(&printed, name) {
                Ok(function) => function,
                Err(hidden) => return Ok(Err(hidden)),
            };
            let item = behind.take_out(result);
            let text = item.map_or(String::new(), |item| item.text);
            let of_struct = members(&text).into_iter();
            all.push(of_struct.map(|member| member.name).collect());
            out += &format!("\n{text}\n{function}");
        }
        Ok(Ok((out, all)))
    }
}

/// Text, and the members of the struct of each function in it.
type Written = (String, Vec<Vec<String>>);

/// `original_fs_main` as `OriginalFsMain`.
fn in_capitals(name: &str) -> String {
    let parts = name.split('_').map(|part| {
        let mut letters = part.chars();
        let first = letters.next().map(|first| first.to_uppercase().to_string());
        first.unwrap_or_default() + letters.as_str()
    });
    parts.collect()
}

fn refused(source: &Source, shader: &Shader, error: &NotExplicit) -> Box<Diagnostic> {
    let values = shader
        .function(Stage::Fragment)
        .map(|function| &function.expressions);
    let span = values.map_or_else(Default::default, |values| values.get_span(error.value));
    source
        .error("a level for each pixel wants explicit gradients here", span, error.why)
        .with_note("sample with a level (`textureSampleLevel`) or with gradients there, or leave `--per-pixel` out")
}

/// The first texture coordinates that samples without a level are at, or else the first `vec2f` that is read of the inputs
/// of the fragment stage.
fn coordinates(body: &Body<'_>, base: &Shader, fragment: &Chosen) -> Option<String> {
    let function = base.function(Stage::Fragment)?;
    let is_flat = |value| {
        let flat = TypeInner::Vector {
            size: VectorSize::Bi,
            scalar: Scalar::F32,
        };
        *base.type_of(Stage::Fragment, value) == flat
    };
    let samples = function
        .expressions
        .iter()
        .filter_map(|(_, expression)| match expression {
            Expression::ImageSample {
                coordinate,
                level: SampleLevel::Auto | SampleLevel::Bias(_),
                ..
            } => Some(*coordinate),
            _ => None,
        });
    let mut inputs = samples.flat_map(|coordinate| inputs_of(function, coordinate));
    let sampled_at = inputs.find(|input| is_flat(*input));
    let mut all = function.expressions.iter().map(|(value, _)| value);
    let found = sampled_at
        .or_else(|| all.find(|value| is_flat(*value) && inputs_of(function, *value) == [*value]))?;
    let entry = body
        .module
        .entry_points
        .iter()
        .find(|e| e.name == fragment.entry)?;
    let argument = |at: u32| {
        Some((
            fragment.arguments.get(at as usize)?,
            entry.function.arguments.get(at as usize)?,
        ))
    };
    match function.expressions[found] {
        Expression::FunctionArgument(at) => argument(at).map(|(name, _)| name.clone()),
        Expression::AccessIndex { base, index } => {
            let Expression::FunctionArgument(at) = function.expressions[base] else {
                return None;
            };
            let (name, argument) = argument(at)?;
            let TypeInner::Struct { members, .. } = &body.module.types[argument.ty].inner else {
                return None;
            };
            let member = members.get(index as usize)?.name.as_ref()?;
            Some(format!("{name}.{member}"))
        }
        _ => None,
    }
}

/// The inputs that a value is made of: arguments, and members of them.
fn inputs_of(function: &Function, value: Handle<Expression>) -> Vec<Handle<Expression>> {
    let mut found = Vec::new();
    let mut open = vec![value];
    let mut known = BTreeSet::new();
    while let Some(value) = open.pop() {
        if !known.insert(value) {
            continue;
        }
        let is_input = match function.expressions[value] {
            Expression::FunctionArgument(_) => true,
            Expression::AccessIndex { base, .. } => {
                matches!(function.expressions[base], Expression::FunctionArgument(_))
            }
            _ => false,
        };
        if is_input {
            found.push(value);
        } else {
            operands::each(&function.expressions[value], |operand| open.push(operand));
        }
    }
    found
}
