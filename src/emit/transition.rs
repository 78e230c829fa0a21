//! Bands behind thresholds: there the level before and the level are both drawn, and mixed, or one is chosen for each
//! pixel by a screen door.
//!
//! ```text
//! autoLOD   threshold ............ end of the band ............ next threshold
//! drawn     before --share--> level                 level alone
//! ```
//!
//! A band begins at its threshold, so that no level is seen nearer than where its error was measured.
//!
//! This work is based on: Marc Olano, Bob Kuehne, Maryann Simmons, "Automatic Shader Level of Detail", 2003, section 5,
//! which proposes to blend between levels; the mask is that of Bayer, "An optimum method for two-level rendition of
//! continuous-tone pictures", 1973.

use super::body::{Body, Hidden};
use super::splice::Chosen;
use super::{EmitLevel, Output, Transition};
use crate::Result;
use crate::front::Source;
use crate::front::identifiers::Names;
use lodc_passes::{Shader, Stage, operands};
use naga::{
    Binding, Block, BuiltIn, Expression, Function, Module, SampleLevel, Scalar, ScalarKind,
    ShaderStage, Span, Statement, TypeInner,
};
use std::collections::BTreeSet;

/// Where a level's band ends: what it says in hundredths is said with no more digits.
pub(crate) fn band_end(levels: &[EmitLevel], at: usize, output: Output) -> Option<f32> {
    let start = levels[at].autolod;
    if output.transition == Transition::Pop || start == 0.0 {
        return None;
    }
    let end = (f64::from(start) + f64::from(output.band)) * 1e4;
    let end = (end.round() / 1e4) as f32;
    let next = levels.get(at + 1).map(|next| next.autolod);
    Some(next.map_or(end, |next| end.min(next))).filter(|end| *end > start)
}

/// What the entry point of the fragment stage needs for its bands.
pub(crate) struct Bands {
    kind: Transition,
    /// Whether a branch by pixels may stand in front of everything.
    branches: bool,
    shown: Shown,
    /// The pixel's place, of type `vec4f`, for a screen door.
    position: String,
    /// A parameter that it is read from, where the author has none.
    pub(crate) parameter: Option<String>,
    /// The function of the screen door.
    door: String,
    /// The variable that says whether a pixel would have been discarded, where both levels are drawn whole.
    gone: Option<String>,
    /// For the original and each level, its function that notes it there.
    whole: Vec<String>,
    near: String,
    far: String,
    chosen: String,
    near_gone: String,
    far_gone: String,
}

/// What a fragment stage returns.
enum Shown {
    Nothing,
    /// A number or a vector, of this type.
    Value(String),
    /// A struct of this name, with these members.
    Struct(String, Vec<String>),
}

impl Bands {
    /// What a source and its levels need; nothing for a transition that has no bands.
    ///
    /// # Errors
    /// When the transition cannot be drawn, at what is in the way.
    pub(crate) fn new(
        body: &Body<'_>,
        fragment: &Chosen,
        output: Output,
        names: &mut Names,
    ) -> Result<std::result::Result<Option<Self>, Hidden>> {
        if output.transition == Transition::Pop {
            return Ok(Ok(None));
        }
        check(body.source, output.transition)?;
        for word in ["mix", "f32", "u32", "bool", "vec4f"] {
            if let Some(hidden) = body.hides(word) {
                return Ok(Err(hidden));
            }
        }
        let (module, source) = (body.module, body.source);
        let Some(entry) = fragment_entry(module, &source.fragment) else {
            return Ok(Ok(None));
        };
        let mut local = Names::default();
        local.reserve(body.declared.iter().copied());
        local.reserve(&fragment.functions);
        local.reserve(&fragment.arguments);
        let mut take = |wish: &str| local.take_local(wish, &BTreeSet::new());
        let (near, far) = (take("near"), take("far"));
        let (near_gone, far_gone) = (take("near_gone"), take("far_gone"));
        let chosen = take("chosen");
        let place = position_of(module, entry, &fragment.arguments);
        let dithers = output.transition == Transition::Dither;
        let (position, parameter) = match place {
            Some(place) => (place, None),
            None => {
                let name = take("pixel_position");
                let parameter = format!("@builtin(position) {name}: vec4f");
                (name, Some(parameter).filter(|_| dithers))
            }
        };
        // Each pixel's gradients are known in front of the branch there.
        let branches = output.per_pixel.is_some();
        let shown = shown(module, entry);
        if let Shown::Value(ty) = &shown
            && let Some(hidden) = body.hides(ty)
        {
            return Ok(Err(hidden));
        }
        let whole = dithers
            && !branches
            && discards(module, entry).is_some()
            && takes_derivatives(module, entry);
        let wishes = fragment.functions.iter().filter(|_| whole);
        Ok(Ok(Some(Self {
            kind: output.transition,
            branches,
            shown,
            position,
            parameter,
            door: match dithers {
                true => names.take("screen_door"),
                false => String::new(),
            },
            gone: whole.then(|| names.take("pixel_gone")),
            whole: wishes
                .map(|name| names.take(&format!("{name}_whole")))
                .collect(),
            near,
            far,
            chosen,
            near_gone,
            far_gone,
        })))
    }

    /// The names of the functions that draw a pixel whole, and of the variable that says whether it would have been
    /// discarded; nothing where none is needed.
    pub(crate) fn whole(&self) -> Option<(&[String], &str)> {
        Some((&self.whole, self.gone.as_deref()?))
    }

    /// What the entry point does in the band of a level: the one at this place in the list, and its autoLOD from and
    /// until. `calls` are those of the level before and of the level.
    pub(crate) fn body(
        &self,
        (at, fragment): (usize, &Chosen),
        calls: [&str; 2],
        (value, from, until): (&str, f32, f32),
        levels: [&Shader; 2],
        authors: &Module,
    ) -> String {
        let width = ((f64::from(until) - f64::from(from)) * 1e4).round() / 1e4;
        let share = format!("({value} - {from:?}) / {width:?}");
        let [before, after] = calls;
        let Self { near, far, .. } = self;
        if self.kind == Transition::Blend {
            return match &self.shown {
                Shown::Nothing => format!("{after};\nreturn;"),
                Shown::Value(_) => format!("return mix({before}, {after}, {share});"),
                Shown::Struct(name, members) => {
                    let share_name = format!("{near}_to_{far}");
                    let mixed = members.iter().map(|member| {
                        format!("mix({near}.{member}, {far}.{member}, {share_name})")
                    });
                    format!(
                        "let {near} = {before};\nlet {far} = {after};\nlet {share_name} = {share};\nreturn {name}({});",
                        mixed.collect::<Vec<_>>().join(", ")
                    )
                }
            };
        }
        let test = format!("{}({}, {share})", self.door, self.position);
        // No return is chosen by pixels: what is behind it would not be uniform any more, and take no derivatives.
        let ty = match &self.shown {
            Shown::Nothing => {
                return format!(
                    "if {test} {{\n    {after};\n}} else {{\n    {before};\n}}\nreturn;"
                );
            }
            Shown::Value(ty) | Shown::Struct(ty, _) => ty,
        };
        let chosen = &self.chosen;
        if let (Some(gone), [_, ..]) = (&self.gone, &self.whole[..]) {
            // Both are drawn to the end, as derivatives want it; then one decides whether the pixel is there.
            let (near_gone, far_gone) = (&self.near_gone, &self.far_gone);
            let swapped = |call: &str, of: usize| {
                let arguments = &call[fragment.functions[of].len()..];
                format!("{}{arguments}", self.whole[of])
            };
            return format!(
                "let {near} = {};\nlet {near_gone} = {gone};\n{gone} = false;\nlet {far} = {};\nlet {far_gone} = {gone};\n\
                 var {chosen} = {near};\n{gone} = {near_gone};\nif {test} {{\n    {chosen} = {far};\n    {gone} = {far_gone};\n}}\n\
                 if {gone} {{ discard; }}\nreturn {chosen};",
                swapped(before, at),
                swapped(after, at + 1),
            );
        }
        // A branch that is not uniform may not take derivatives.
        let own = fragment_entry(authors, &fragment.entry);
        let derives = own.is_some_and(|entry| at == 0 && takes_derivatives(authors, entry))
            || levels.iter().any(|level| {
                let function = level.function(Stage::Fragment);
                function.is_some_and(|function| takes_derivatives(level.module(), function))
            });
        match derives && !self.branches {
            false => format!(
                "var {chosen}: {ty};\nif {test} {{\n    {chosen} = {after};\n}} else {{\n    {chosen} = {before};\n}}\nreturn {chosen};"
            ),
            true => format!(
                "let {near} = {before};\nlet {far} = {after};\nvar {chosen} = {near};\nif {test} {{ {chosen} = {far}; }}\nreturn {chosen};"
            ),
        }
    }

    /// The declarations that the bands need.
    pub(crate) fn declarations(&self) -> String {
        let mut out = String::new();
        if let Some(gone) = &self.gone {
            out += &format!(
                "\n// Whether the pixel would have been discarded.\nvar<private> {gone}: bool = false;\n"
            );
        }
        if self.kind == Transition::Dither {
            out += &format!(
                "\n// Whether a share of the pixels, 0 to 1, includes this one: an ordered mask of 8 x 8.\n\
                 fn {}(position: vec4f, share: f32) -> bool {{\n    \
                     let y = u32(position.y);\n    \
                     let x = u32(position.x) ^ y;\n    \
                     let order = ((x & 1u) << 5u) | ((y & 1u) << 4u) | ((x & 2u) << 2u) | ((y & 2u) << 1u) | ((x & 4u) >> 1u) | ((y & 4u) >> 2u);\n    \
                     return (f32(order) + 0.5) / 64.0 < share;\n\
                 }}\n",
                self.door
            );
        }
        out
    }
}

/// Whether a transition can be drawn of a source.
///
/// # Errors
/// When levels are to be mixed and what the fragment stage returns cannot be, at its place.
pub(crate) fn check(source: &Source, transition: Transition) -> Result<()> {
    let module = &source.module;
    let Some(entry) = fragment_entry(module, &source.fragment) else {
        return Ok(());
    };
    if transition != Transition::Blend {
        return Ok(());
    }
    let way = "`--transition dither` chooses a level for each pixel instead, `--transition pop` for all at once";
    if let Some(span) = discards(module, entry) {
        let error = source.error(
            "levels cannot be mixed where pixels are discarded",
            span,
            "a pixel is there or is not",
        );
        return Err(error.with_note(way));
    }
    let is_mixed = |ty: naga::Handle<naga::Type>| {
        matches!(
            module.types[ty].inner,
            TypeInner::Scalar(Scalar::F32)
                | TypeInner::Vector {
                    scalar: Scalar::F32,
                    ..
                }
        )
    };
    let Some(result) = &entry.result else {
        return Ok(());
    };
    let unmixed = match &module.types[result.ty].inner {
        TypeInner::Struct { members, .. } => {
            let mut members = members.iter();
            let found = members.find(|member| !is_mixed(member.ty));
            found.map(|member| format!("`{}`", member.name.as_deref().unwrap_or("a member")))
        }
        _ if is_mixed(result.ty) => None,
        _ => Some("the result".to_owned()),
    };
    match unmixed {
        None => Ok(()),
        Some(what) => {
            let span = module.types.get_span(result.ty);
            let error = source.error(
                format!("levels cannot be mixed: {what} is no f32 and no vector of them"),
                span,
                "returned by the fragment stage",
            );
            Err(error.with_note(way))
        }
    }
}

fn fragment_entry<'m>(module: &'m Module, name: &str) -> Option<&'m Function> {
    let mut entries = module.entry_points.iter();
    let entry = entries.find(|e| e.stage == ShaderStage::Fragment && e.name == name)?;
    Some(&entry.function)
}

fn shown(module: &Module, entry: &Function) -> Shown {
    let Some(result) = &entry.result else {
        return Shown::Nothing;
    };
    match &module.types[result.ty] {
        naga::Type {
            name: Some(name),
            inner: TypeInner::Struct { members, .. },
        } => {
            let members = members.iter().filter_map(|member| member.name.clone());
            Shown::Struct(name.clone(), members.collect())
        }
        naga::Type { inner, .. } => Shown::Value(type_of_numbers(inner)),
    }
}

/// The type of a number or a vector, as WGSL writes it.
fn type_of_numbers(inner: &TypeInner) -> String {
    let word = |scalar: Scalar| match scalar.kind {
        ScalarKind::Sint => "i",
        ScalarKind::Uint => "u",
        _ if scalar.width == 2 => "h",
        _ => "f",
    };
    match *inner {
        TypeInner::Vector { size, scalar } => format!("vec{}{}", size as u8, word(scalar)),
        TypeInner::Scalar(scalar) => {
            format!("{}{}", word(scalar).replace('h', "f"), 8 * scalar.width)
        }
        // A stage returns nothing else.
        _ => "vec4f".to_owned(),
    }
}

/// How the entry point reads the pixel's place, where it is among its inputs.
fn position_of(module: &Module, entry: &Function, arguments: &[String]) -> Option<String> {
    let is_position = |binding: &Option<Binding>| {
        matches!(binding, Some(Binding::BuiltIn(BuiltIn::Position { .. })))
    };
    entry
        .arguments
        .iter()
        .zip(arguments)
        .find_map(|(argument, name)| {
            if is_position(&argument.binding) {
                return Some(name.clone());
            }
            let TypeInner::Struct { members, .. } = &module.types[argument.ty].inner else {
                return None;
            };
            let member = members.iter().find(|member| is_position(&member.binding))?;
            Some(format!("{name}.{}", member.name.as_ref()?))
        })
}

/// A function and those that it calls.
fn reached<'m>(module: &'m Module, function: &'m Function) -> Vec<&'m Function> {
    let mut all = vec![function];
    let mut known = BTreeSet::new();
    let mut at = 0;
    while let Some(function) = all.get(at).copied() {
        at += 1;
        operands::walk(&function.body, &mut |statement| {
            if let Statement::Call { function, .. } = statement
                && known.insert(*function)
            {
                all.push(&module.functions[*function]);
            }
        });
    }
    all
}

/// Where a function discards pixels, if it does.
fn discards(module: &Module, function: &Function) -> Option<Span> {
    fn within(block: &Block) -> Option<Span> {
        block
            .span_iter()
            .find_map(|(statement, span)| match statement {
                Statement::Kill => Some(*span),
                _ => operands::blocks(statement).find_map(within),
            })
    }
    let mut functions = reached(module, function).into_iter();
    functions.find_map(|function| within(&function.body))
}

/// Whether a function takes derivatives, for a texture's level of detail or by name.
fn takes_derivatives(module: &Module, function: &Function) -> bool {
    let functions = reached(module, function).into_iter();
    let mut values = functions.flat_map(|function| function.expressions.iter());
    values.any(|(_, expression)| match expression {
        Expression::Derivative { .. } => true,
        Expression::ImageSample { level, .. } => {
            matches!(level, SampleLevel::Auto | SampleLevel::Bias(_))
        }
        _ => false,
    })
}
