//! What feeds the vertex stage: attributes of the mesh by the names of the inputs, or a supplied stage.

use super::file::{Entries, Node, Toml, suggest};
use super::{Inference, Settings};
use crate::eval::raster::Attribute;
use crate::front::names::{listed, words};
use crate::front::{Feed, Input, Source, VertexStage, inputs};
use crate::{Diagnostic, Result};
use naga::{Binding, Scalar, ScalarKind, ShaderStage, TypeInner};
use std::collections::BTreeMap;
use toml::Spanned;

/// What feeds each location of the vertex stage, and the stage if the file has none.
#[derive(Clone, Debug)]
pub(super) struct Fed {
    pub(super) attributes: BTreeMap<u32, Attribute>,
    pub(super) stage: Option<VertexStage>,
}

/// The inputs of a shader that something feeds, by their locations: of its vertex stage, or of its fragment stage where
/// it has no other.
fn fed_inputs(source: &Source) -> (Vec<(u32, Input)>, ShaderStage) {
    let (entry, stage) = match source.vertex_entry() {
        Some((entry, _)) => (entry, ShaderStage::Vertex),
        None => (source.fragment_entry().0, ShaderStage::Fragment),
    };
    let inputs = inputs(source, entry).into_iter();
    let located = inputs.filter_map(|input| match input.binding {
        Binding::Location { location, .. } => Some((location, input)),
        Binding::BuiltIn(_) => None,
    });
    (located.collect(), stage)
}

/// Whether a shader has an input of this name that something feeds.
pub(super) fn has(source: &Source, name: &str) -> bool {
    let (inputs, _) = fed_inputs(source);
    inputs.iter().any(|(_, input)| input.name == name)
}

/// Reads `[attributes]` and guesses the rest.
pub(super) fn resolve(
    source: &Source,
    toml: Toml,
    entries: &Entries,
    settings: &Settings,
    inferences: &mut Vec<Inference>,
) -> Result<Fed> {
    let (inputs, stage) = fed_inputs(source);
    let mut given = BTreeMap::new();
    for (key, value) in &entries.0 {
        let found = inputs.iter().find(|(_, i)| i.name == *key.get_ref());
        let Some((_, input)) = found else {
            let what = match stage {
                ShaderStage::Vertex => "vertex input",
                _ => "fragment input",
            };
            return Err(toml.unknown(what, key, inputs.iter().map(|(_, i)| i.name.as_str())));
        };
        let ty = &source.module.types[input.ty].inner;
        given.insert(input.name.clone(), read(toml, key, value, ty, stage)?);
    }
    if !settings.mesh.second_uvs.is_empty() {
        for input in later_sets(source, &inputs, &given, stage) {
            let told = Inference::new("attributes", &input.name, &Feed::SecondUv.to_toml());
            inferences.push(told.because("the second of its texture coordinates"));
            given.insert(input.name.clone(), Feed::SecondUv);
        }
    }
    if stage == ShaderStage::Fragment {
        let stage = VertexStage::supply(source, &given)?;
        for (name, feed, guessed) in &stage.feeds {
            if *guessed {
                let told = Inference::new("attributes", name, &feed.to_toml());
                inferences.push(told.because(BY_NAME));
            }
        }
        let locations = stage
            .module
            .entry_points
            .first()
            .into_iter()
            .flat_map(|_| 0..);
        let attributes = locations
            .map_while(|location| {
                let feed = VertexStage::attribute(location)?;
                Some((
                    location,
                    attribute(&feed, &TypeInner::Scalar(Scalar::F32), settings),
                ))
            })
            .collect();
        return Ok(Fed {
            attributes,
            stage: Some(stage),
        });
    }
    let mut attributes = BTreeMap::new();
    let mut unknown = Vec::new();
    for (location, input) in &inputs {
        let ty = &source.module.types[input.ty].inner;
        let feed = match given.remove(&input.name) {
            Some(feed) => feed,
            None => match Feed::infer(&input.name, ty, stage) {
                Some(feed) => {
                    let told = Inference::new("attributes", &input.name, &feed.to_toml());
                    inferences.push(told.because(BY_NAME));
                    feed
                }
                None => {
                    unknown.push(input);
                    continue;
                }
            },
        };
        attributes.insert(*location, attribute(&feed, ty, settings));
    }
    if !unknown.is_empty() {
        return Err(unknown_inputs(source, toml, &unknown));
    }
    Ok(Fed {
        attributes,
        stage: None,
    })
}

/// Why a feed was taken.
const BY_NAME: &str = "its name and type say so";

/// The inputs that are texture coordinates by their names, but for the first of them: by the number in the name,
/// then by place.
fn later_sets<'i>(
    source: &Source,
    inputs: &'i [(u32, Input)],
    given: &BTreeMap<String, Feed>,
    stage: ShaderStage,
) -> Vec<&'i Input> {
    let number = |name: &str| {
        let digits: String = name.chars().filter(char::is_ascii_digit).collect();
        let letter = words(name).last().map(|w| u32::from(w == "b"));
        digits.parse().ok().or(letter).unwrap_or(0)
    };
    let mut sets: Vec<(u32, u32, &Input)> = inputs
        .iter()
        .filter(|(_, input)| !given.contains_key(&input.name))
        .filter(|(_, input)| {
            let ty = &source.module.types[input.ty].inner;
            Feed::infer(&input.name, ty, stage) == Some(Feed::Uv)
        })
        .map(|(location, input)| (number(&input.name), *location, input))
        .collect();
    sets.sort_by_key(|(number, location, _)| (*number, *location));
    let first = usize::from(!given.values().any(|feed| *feed == Feed::Uv));
    sets.into_iter().skip(first).map(|(_, _, i)| i).collect()
}

/// The inputs that nothing feeds, with a line for each that could: their names, the line and the type.
pub(super) fn unfed(source: &Source) -> Vec<(String, String, String)> {
    let (inputs, stage) = fed_inputs(source);
    let inputs = inputs.into_iter().filter_map(|(_, input)| {
        let ty = &source.module.types[input.ty].inner;
        if Feed::infer(&input.name, ty, stage).is_some() {
            return None;
        }
        let value = Feed::suggestion(ty, stage);
        let line = Inference::new("attributes", &input.name, &value).line_to_add;
        Some((input.name.clone(), line, type_name(ty)))
    });
    inputs.collect()
}

fn read(
    toml: Toml,
    key: &Spanned<String>,
    value: &Spanned<Node>,
    ty: &TypeInner,
    stage: ShaderStage,
) -> Result<Feed> {
    let known = || Feed::keywords(stage).collect::<Vec<_>>();
    let feed = match value.get_ref() {
        Node::Text(keyword) => match Feed::of_keyword(keyword) {
            Some(feed) if feed.is_of(stage) => feed,
            _ => {
                let error = toml.error(
                    format!("there is no attribute `{keyword}`"),
                    value.span(),
                    "",
                );
                return Err(suggest(error, keyword, &known()));
            }
        },
        node => match numbers(node) {
            Some(numbers) => Feed::Constant(numbers),
            None => {
                return Err(toml
                    .error(
                        format!("what feeds `{}` is a name or numbers", key.get_ref()),
                        value.span(),
                        format!("this is {}", node.what()),
                    )
                    .with_note(format!("the names are {}", listed(known()))));
            }
        },
    };
    match feed.fits(ty) {
        Ok(()) => Ok(feed),
        Err(wants) => Err(toml
            .error(
                format!("`{}` cannot hold {}", key.get_ref(), feed.to_toml()),
                value.span(),
                match feed {
                    Feed::Constant(_) => format!("it wants {wants}"),
                    _ => format!("this wants a {wants}"),
                },
            )
            .with_note(format!("the shader declares it as {}", type_name(ty)))),
    }
}

fn numbers(node: &Node) -> Option<Vec<f64>> {
    match node {
        Node::Integer(n) => Some(vec![*n as f64]),
        Node::Float(x) => Some(vec![*x]),
        Node::Bool(b) => Some(vec![f64::from(*b)]),
        Node::List(list) => {
            let all = list.iter().map(|item| numbers(item.get_ref()));
            let all: Option<Vec<Vec<f64>>> = all.collect();
            let flat = all?;
            flat.iter().all(|one| one.len() == 1).then(|| flat.concat())
        }
        Node::Text(_) | Node::Table(_) => None,
    }
}

fn type_name(ty: &TypeInner) -> String {
    let name = |scalar: Scalar| match (scalar.kind, scalar.width) {
        (ScalarKind::Sint, _) => "i32",
        (ScalarKind::Uint, _) => "u32",
        (_, 2) => "f16",
        _ => "f32",
    };
    match *ty {
        TypeInner::Scalar(scalar) => name(scalar).to_owned(),
        TypeInner::Vector { size, scalar } => format!("vec{}<{}>", size as u8, name(scalar)),
        _ => "another type".to_owned(),
    }
}

/// The evaluator's attribute. Which columns the model matrix has is the scene's affair.
fn attribute(feed: &Feed, ty: &TypeInner, settings: &Settings) -> Attribute {
    let words = |numbers: &[f64], kind: ScalarKind| {
        let mut words = [0; 4];
        for (word, &number) in words.iter_mut().zip(numbers) {
            *word = match kind {
                ScalarKind::Sint => (number as i32).cast_unsigned(),
                ScalarKind::Uint => number as u32,
                _ => (number as f32).to_bits(),
            };
        }
        Attribute::Fixed(words)
    };
    match feed {
        Feed::Normal => Attribute::Normal,
        Feed::Uv => Attribute::Uv,
        Feed::SecondUv => Attribute::SecondUv,
        Feed::Tangent => Attribute::Tangent,
        Feed::Bitangent => Attribute::Bitangent,
        Feed::BitangentSign => Attribute::BitangentSign,
        Feed::Colour => Attribute::Colour,
        Feed::Constant(numbers) => {
            let kind = ty.scalar().map_or(ScalarKind::Float, |s| s.kind);
            words(numbers, kind)
        }
        Feed::ModelColumn(column) => {
            let column = settings.model.col(usize::from(*column).min(3));
            words(&column.to_array(), ScalarKind::Float)
        }
        // The last two are of the fragment stage, and refused before.
        Feed::Position | Feed::ObjectPosition | Feed::ViewDirection => Attribute::Position,
    }
}

fn unknown_inputs(source: &Source, toml: Toml, unknown: &[&Input]) -> Box<Diagnostic> {
    let names: Vec<&str> = unknown.iter().map(|i| i.name.as_str()).collect();
    let error = Diagnostic::error(format!(
        "what feeds the vertex input{} {} is not known",
        if names.len() > 1 { "s" } else { "" },
        listed(names.iter().copied())
    ));
    let located = unknown.iter().fold(error, |error, input| {
        let ty = type_name(&source.module.types[input.ty].inner);
        source.locate(error, input.span, format!("a {ty}"))
    });
    let lines: Vec<String> = unknown
        .iter()
        .map(|input| {
            let ty = &source.module.types[input.ty].inner;
            let value = Feed::suggestion(ty, ShaderStage::Vertex);
            Inference::new("attributes", &input.name, &value).line_to_add
        })
        .collect();
    located
        .with_note(format!(
            "say it in `{}`:\n[attributes]\n{}",
            toml.name,
            lines.join("\n")
        ))
        .with_note(format!(
            "an input is fed by {}, or by fixed numbers",
            listed(Feed::keywords(ShaderStage::Vertex))
        ))
}

#[cfg(test)]
mod tests {
    use super::super::file::SceneFile;
    use super::super::objects::Object;
    use super::*;

    const TEXT: &str = "
        @vertex fn vs(@location(0) position: vec3f, @location(2) uv: vec2f, @location(3) tangent: vec4f,
            @location(5) model_matrix_0: vec4f, @location(6) model_matrix_1: vec4f,
            @location(9) wibble: vec3f, @location(10) id: vec2u) -> @builtin(position) vec4f {
            return vec4f(position + wibble, 1.0) + model_matrix_0 + tangent;
        }
        @fragment fn fs() -> @location(0) vec4f { return vec4f(); }";

    fn fed(shader: &str, toml: &str) -> (Result<Fed>, Vec<Inference>) {
        let source = Source::parse("a.wgsl", shader).unwrap();
        let toml = Toml {
            name: "a.toml",
            text: toml,
        };
        let file: SceneFile = toml.parse().unwrap();
        let folder = std::path::Path::new("");
        let settings = Settings::read(toml, &file, Object::Sphere, folder).unwrap();
        let mut inferences = Vec::new();
        let fed = resolve(&source, toml, &file.attributes, &settings, &mut inferences);
        (fed, inferences)
    }

    #[test]
    fn inputs_are_fed_as_given_or_guessed() {
        let (fed, inferences) = fed(
            TEXT,
            "model = [[2,0,0,0],[0,3,0,0],[0,0,1,0],[0,0,0,1]]\n[attributes]\nwibble = \"normal\"\nid = [7, 4000000000]\n",
        );
        let fed = fed.unwrap();
        assert!(fed.stage.is_none());
        let expected = [
            (0, Attribute::Position),
            (2, Attribute::Uv),
            (3, Attribute::Tangent),
            (5, Attribute::Fixed([2.0, 0.0, 0.0, 0.0].map(f32::to_bits))),
            (6, Attribute::Fixed([0.0, 3.0, 0.0, 0.0].map(f32::to_bits))),
            (9, Attribute::Normal),
            (10, Attribute::Fixed([7, 4_000_000_000, 0, 0])),
        ];
        assert_eq!(fed.attributes, BTreeMap::from(expected));
        let lines: Vec<_> = inferences.iter().map(|i| i.line_to_add.as_str()).collect();
        assert_eq!(
            lines,
            [
                "position = \"position\"",
                "uv = \"uv\"",
                "tangent = \"tangent\"",
                "model_matrix_0 = \"model-column-0\"",
                "model_matrix_1 = \"model-column-1\""
            ]
        );
    }

    #[test]
    fn unknown_inputs_name_the_lines_to_add() {
        let error = fed(TEXT, "").0.unwrap_err();
        assert_eq!(
            error.message,
            "what feeds the vertex inputs `wibble` and `id` is not known"
        );
        assert!(
            error.notes[0].contains("[attributes]\nwibble = \"position\"\nid = [0, 0]"),
            "{error}"
        );
        assert!(error.to_string().contains("a.wgsl:4:"), "{error}");
    }

    #[test]
    fn wrong_entries_are_located() {
        for (line, message, place) in [
            (
                "wobble = \"uv\"",
                "there is no vertex input `wobble`",
                "wobble",
            ),
            (
                "wibble = \"weight\"",
                "there is no attribute `weight`",
                "\"weight\"",
            ),
            (
                "wibble = \"view-direction\"",
                "there is no attribute `view-direction`",
                "\"view-direction\"",
            ),
            (
                "uv = \"normal\"",
                "`uv` cannot hold \"normal\"",
                "\"normal\"",
            ),
            ("uv = 1.0", "`uv` cannot hold 1.0", "1.0"),
            (
                "id = [0.5, 1.0]",
                "`id` cannot hold [0.5, 1.0]",
                "[0.5, 1.0]",
            ),
            ("uv = {}", "what feeds `uv` is a name or numbers", "{}"),
        ] {
            let text = format!("[attributes]\n{line}\n");
            let error = fed(TEXT, &text).0.unwrap_err();
            assert_eq!(error.message, message);
            assert_eq!(&text[error.labels[0].0.clone()], place);
            assert!(!error.notes.is_empty());
        }
    }

    #[test]
    fn a_file_without_a_vertex_stage_gets_one() {
        let shader = "@fragment fn fs(@location(0) uv: vec2f, @location(1) q: vec3f) -> @location(0) vec4f { return vec4f(uv, q.xy); }";
        let (with, inferences) = fed(shader, "[attributes]\nq = \"normal\"\n");
        let with = with.unwrap();
        assert_eq!(with.attributes.len(), 6);
        assert_eq!(with.attributes[&4], Attribute::Colour);
        assert!(with.stage.is_some());
        assert_eq!(inferences.len(), 1);
        let error = fed(shader, "[attributes]\nr = \"normal\"\n").0.unwrap_err();
        assert_eq!(error.message, "there is no fragment input `r`");
        assert!(fed(shader, "").0.unwrap_err().message.contains("`q`"));
    }
}
