//! The vertex stage that lodc supplies to a file that has only a fragment entry point.
//!
//! It is a module of its own: it is drawn with, and never emitted. What feeds an input of the fragment
//! entry point is given by the scene, or guessed from the input's name and type.

use super::feed::shape;
use super::{Feed, Input, Source, inputs, validate};
use crate::{Diagnostic, Result};
use naga::valid::ModuleInfo;
use naga::{Binding, Interpolation, Module, Sampling, ScalarKind, ShaderStage};
use std::collections::BTreeMap;
use std::fmt::Write;

/// A supplied vertex stage.
#[derive(Clone, Debug)]
pub struct VertexStage {
    /// Its WGSL.
    pub text: String,
    /// The module; its one entry point is at 0.
    pub module: Module,
    /// What the validator found out about it.
    pub info: ModuleInfo,
    /// What feeds each input of the fragment entry point that has a location, by the input's name, in order;
    /// and whether that was guessed.
    pub feeds: Vec<(String, Feed, bool)>,
    /// Where its one uniform buffer is bound: apart from all that the file itself binds.
    pub group: u32,
    /// The binding in that group.
    pub binding: u32,
}

/// The attributes of the supplied stage: location, name, type.
const ATTRIBUTES: [(&str, &str); 6] = [
    ("position", "vec3<f32>"),
    ("normal", "vec3<f32>"),
    ("uv", "vec2<f32>"),
    ("tangent", "vec4<f32>"),
    ("colour", "vec4<f32>"),
    ("uv1", "vec2<f32>"),
];

impl VertexStage {
    /// Makes the stage for a file's fragment entry point. `given` says what feeds an input, by its name; the
    /// rest is guessed.
    ///
    /// # Errors
    /// When an input is not given and cannot be guessed, naming all of them and the lines to add.
    pub fn supply(source: &Source, given: &BTreeMap<String, Feed>) -> Result<Self> {
        let (entry, _) = source.fragment_entry();
        let mut feeds = Vec::new();
        let mut unknown = Vec::new();
        for input in inputs(source, entry) {
            if !matches!(input.binding, Binding::Location { .. }) {
                continue;
            }
            let ty = &source.module.types[input.ty].inner;
            let guess = || Feed::infer(&input.name, ty, ShaderStage::Fragment);
            match (given.get(&input.name), guess()) {
                (Some(feed), _) => feeds.push((input, feed.clone(), false)),
                (None, Some(feed)) => feeds.push((input, feed, true)),
                (None, None) => unknown.push(input),
            }
        }
        if !unknown.is_empty() {
            return Err(unknown_inputs(source, &unknown));
        }
        let (group, binding) = free_binding(&source.module);
        let text = write(source, &feeds, group, binding);
        let broken = |what: String| {
            Diagnostic::error("the vertex stage that lodc supplies is not valid")
                .with_reason(what)
                .with_note(format!(
                    "this is a bug in lodc; a vertex entry point in `{}` goes round it",
                    source.name
                ))
        };
        let module = naga::front::wgsl::parse_str(&text)
            .map_err(|error| broken(error.emit_to_string(&text)))?;
        let info = validate(&module).map_err(|error| broken(error.emit_to_string(&text)))?;
        let named = feeds
            .into_iter()
            .map(|(i, feed, guessed)| (i.name, feed, guessed));
        Ok(Self {
            text,
            feeds: named.collect(),
            module,
            info,
            group,
            binding,
        })
    }

    /// What an attribute of the stage carries, by its location.
    pub fn attribute(location: u32) -> Option<Feed> {
        let (name, _) = ATTRIBUTES.get(location as usize)?;
        Feed::of_keyword(name)
    }
}

fn unknown_inputs(source: &Source, unknown: &[Input]) -> Box<Diagnostic> {
    let names: Vec<&str> = unknown.iter().map(|i| i.name.as_str()).collect();
    let error = Diagnostic::error(format!(
        "`{}` has no vertex entry point, and what feeds {} cannot be told from the name and type",
        source.name,
        super::names::listed(names.iter().copied())
    ));
    let mut lines = String::from("say it in the scene:\n[attributes]");
    for input in unknown {
        let ty = &source.module.types[input.ty].inner;
        let value = Feed::suggestion(ty, ShaderStage::Fragment);
        // A name is a bare key in TOML unless it is outside ASCII.
        let bare = input
            .name
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || b == b'_');
        let quote = if bare { "" } else { "\"" };
        let _ = write!(lines, "\n{quote}{}{quote} = {value}", input.name);
    }
    let keywords: Vec<&str> = Feed::keywords(ShaderStage::Fragment).collect();
    let located = unknown.iter().fold(error, |error, input| {
        source.locate(error, input.span, "fed by the vertex stage")
    });
    located.with_note(lines).with_note(format!(
        "an input is fed by {}, or by fixed numbers",
        super::names::listed(keywords)
    ))
}

/// A place in the highest group that the module binds, behind everything there.
fn free_binding(module: &Module) -> (u32, u32) {
    let bound = || {
        module
            .global_variables
            .iter()
            .filter_map(|(_, v)| v.binding)
    };
    let group = bound().map(|b| b.group).max().unwrap_or(0);
    let in_group = bound().filter(|b| b.group == group).map(|b| b.binding);
    (group, in_group.max().map_or(0, |b| b.saturating_add(1)))
}

/// The stage's WGSL. Its member names are the scene's semantics.
fn write(source: &Source, feeds: &[(Input, Feed, bool)], group: u32, binding: u32) -> String {
    let mut text = String::from("struct Lodc {\n");
    for member in ["view_projection", "model", "normal_matrix"] {
        let _ = writeln!(text, "    {member}: mat4x4<f32>,");
    }
    text.push_str("    camera_position: vec4<f32>,\n}\n");
    let _ = writeln!(
        text,
        "@group({group}) @binding({binding}) var<uniform> lodc: Lodc;\n\nstruct Attributes {{"
    );
    for (location, (name, ty)) in ATTRIBUTES.iter().enumerate() {
        let _ = writeln!(text, "    @location({location}) {name}: {ty},");
    }
    text.push_str("}\n\nstruct Varyings {\n    @builtin(position) clip: vec4<f32>,\n");
    for (input, _, _) in feeds {
        if let Binding::Location {
            location,
            interpolation,
            sampling,
            ..
        } = input.binding
        {
            let ty = type_name(source, input);
            let how = interpolate(interpolation, sampling);
            let _ = writeln!(text, "    @location({location}) {how}at_{location}_: {ty},");
        }
    }
    text.push_str(
        "}\n\n@vertex\nfn lodc_vertex(in: Attributes) -> Varyings {\n    var out: Varyings;\n    \
         let world = lodc.model * vec4<f32>(in.position, 1.0);\n    \
         let normal = normalize((lodc.normal_matrix * vec4<f32>(in.normal, 0.0)).xyz);\n    \
         let tangent = normalize((lodc.model * vec4<f32>(in.tangent.xyz, 0.0)).xyz);\n    \
         let to_eye = normalize(lodc.camera_position.xyz - world.xyz);\n    \
         out.clip = lodc.view_projection * world;\n",
    );
    for (input, feed, _) in feeds {
        if let Binding::Location { location, .. } = input.binding {
            let value = value(source, input, feed);
            let _ = writeln!(text, "    out.at_{location}_ = {value};");
        }
    }
    text.push_str("    return out;\n}\n");
    text
}

fn interpolate(interpolation: Option<Interpolation>, sampling: Option<Sampling>) -> String {
    let kind = match interpolation {
        Some(Interpolation::Flat) => "flat",
        Some(Interpolation::Linear) => "linear",
        // Per-vertex inputs have no WGSL spelling without an extension; perspective is the default.
        Some(Interpolation::Perspective | Interpolation::PerVertex) | None => "perspective",
    };
    let at = match sampling {
        // A GPU takes the stages together only when both say it, or neither.
        Some(Sampling::Center) if kind != "flat" => ", center",
        Some(Sampling::Center) | None => "",
        Some(Sampling::Centroid) => ", centroid",
        Some(Sampling::Sample) => ", sample",
        Some(Sampling::First) => ", first",
        Some(Sampling::Either) => ", either",
    };
    format!("@interpolate({kind}{at}) ")
}

fn type_name(source: &Source, input: &Input) -> String {
    let Some((size, scalar)) = shape(&source.module.types[input.ty].inner) else {
        return "f32".to_owned();
    };
    let name = match scalar.kind {
        ScalarKind::Sint => "i32",
        ScalarKind::Uint => "u32",
        _ if scalar.width == 2 => "f16",
        _ => "f32",
    };
    match size {
        1 => name.to_owned(),
        size => format!("vec{size}<{name}>"),
    }
}

/// The expression that feeds an input, in the input's own type.
fn value(source: &Source, input: &Input, feed: &Feed) -> String {
    let size = shape(&source.module.types[input.ty].inner).map_or(1, |(size, _)| size);
    // Four components each, of which an input takes the first ones.
    let four = match feed {
        Feed::Constant(numbers) => {
            let numbers: Vec<String> = numbers.iter().map(|n| constant(*n)).collect();
            return format!("{}({})", type_name(source, input), numbers.join(", "));
        }
        Feed::BitangentSign => return "in.tangent.w".to_owned(),
        Feed::Position => "world",
        Feed::ObjectPosition => "vec4<f32>(in.position, 1.0)",
        Feed::Normal => "vec4<f32>(normal, 0.0)",
        Feed::Uv => "vec4<f32>(in.uv, 0.0, 0.0)",
        Feed::SecondUv => "vec4<f32>(in.uv1, 0.0, 0.0)",
        Feed::Tangent => "vec4<f32>(tangent, in.tangent.w)",
        Feed::Bitangent => "vec4<f32>(cross(normal, tangent) * in.tangent.w, 0.0)",
        Feed::Colour => "in.colour",
        Feed::ViewDirection => "vec4<f32>(to_eye, 0.0)",
        // Only vertex inputs are fed by these; the scene refuses them here.
        Feed::ModelColumn(_) => "vec4<f32>()",
    };
    match size {
        4 => four.to_owned(),
        3 => format!("({four}).xyz"),
        2 => format!("({four}).xy"),
        _ => format!("({four}).x"),
    }
}

/// A number as WGSL text that any numeric type takes.
fn constant(number: f64) -> String {
    match number.fract() == 0.0 && number.abs() < 1e15 {
        true => format!("{number:.0}"),
        false => format!("{number:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "@group(1) @binding(3) var t: texture_2d<f32>;\n";

    fn supply(arguments: &str) -> Result<VertexStage> {
        let text = format!(
            "{HEAD}@fragment fn fs({arguments}) -> @location(0) vec4f {{ return vec4f(1.0); }}"
        );
        VertexStage::supply(&Source::parse("a.wgsl", text)?, &BTreeMap::new())
    }

    #[test]
    fn inputs_are_fed_by_their_names() {
        let stage = supply(
            "@builtin(position) p: vec4f, @location(0) uv: vec2f, @location(2) world_normal: vec3f, \
             @location(3) worldPos: vec4f, @location(4) tangent: vec4f, @location(5) view_dir: vec3f, \
             @location(6) @interpolate(linear, centroid) color: vec3f, @location(7) bitangent: vec3f, \
             @location(8) tangent_sign: f32, @location(9) object_pos: vec3f",
        )
        .unwrap();
        let feeds: Vec<_> = stage
            .feeds
            .iter()
            .map(|(n, f, guessed)| (n.as_str(), f.clone(), *guessed))
            .collect();
        assert_eq!(
            feeds,
            [
                ("uv", Feed::Uv, true),
                ("world_normal", Feed::Normal, true),
                ("worldPos", Feed::Position, true),
                ("tangent", Feed::Tangent, true),
                ("view_dir", Feed::ViewDirection, true),
                ("color", Feed::Colour, true),
                ("bitangent", Feed::Bitangent, true),
                ("tangent_sign", Feed::BitangentSign, true),
                ("object_pos", Feed::ObjectPosition, true),
            ]
        );
        assert!(
            stage
                .text
                .contains("@location(6) @interpolate(linear, centroid)"),
            "{}",
            stage.text
        );
        // Its buffer is apart from the file's own bindings.
        assert_eq!((stage.group, stage.binding), (1, 4));
        assert_eq!(stage.module.entry_points.len(), 1);
    }

    #[test]
    fn a_fragment_without_inputs_needs_nothing() {
        let stage = supply("@builtin(position) p: vec4f").unwrap();
        assert!(stage.feeds.is_empty());
    }

    #[test]
    fn what_is_given_wins_and_integers_take_constants() {
        let text = "@fragment fn fs(@location(0) wet: f32, @location(1) @interpolate(flat) id: vec2u, \
                    @location(2) uv: vec2f) -> @location(0) vec4f { return vec4f(wet); }";
        let source = Source::parse("a.wgsl", text).unwrap();
        let given = BTreeMap::from([
            ("wet".to_owned(), Feed::Constant(vec![0.25])),
            ("id".to_owned(), Feed::Constant(vec![7.0, 3e9])),
            ("uv".to_owned(), Feed::Position),
        ]);
        let stage = VertexStage::supply(&source, &given).unwrap();
        assert!(stage.feeds.iter().all(|(_, _, guessed)| !guessed));
        assert!(
            stage.text.contains("vec2<u32>(7, 3000000000)"),
            "{}",
            stage.text
        );
    }

    #[test]
    fn unknown_inputs_are_named_with_the_lines_to_add() {
        let error =
            supply("@location(0) wetness: f32, @location(1) flow: vec3f, @location(2) uv: vec2f")
                .unwrap_err();
        let text = error.to_string();
        assert!(error.message.contains("`wetness` and `flow`"), "{text}");
        assert!(
            text.contains("[attributes]") && text.contains("wetness = 0.0"),
            "{text}"
        );
        assert!(text.contains("flow = \"position\""), "{text}");
        assert!(text.contains("a.wgsl:2:"), "{text}");
        assert_eq!(error.labels.len(), 2);
    }
}
