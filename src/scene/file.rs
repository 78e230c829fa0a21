//! The scene file: TOML by serde, with the place of everything that can be wrong.

use crate::front::names::{listed, nearest};
use crate::{Diagnostic, Result};
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::ops::Range;
use toml::Spanned;

/// A scene file as it is written: nothing is filled in, and nothing is checked against a shader.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub(super) object: Option<Spanned<String>>,
    pub(super) model: Option<Spanned<[[f64; 4]; 4]>>,
    pub(super) resolution: Option<Spanned<[i64; 2]>>,
    pub(super) fov: Option<Spanned<f64>>,
    pub(super) seed: Option<Spanned<i64>>,
    pub(super) e_max: Option<Spanned<f64>>,
    #[serde(rename = "Q")]
    pub(super) q: Option<Spanned<f64>>,
    pub(super) levels: Option<Spanned<i64>>,
    pub(super) bound: Option<Spanned<String>>,
    pub(super) goal: Option<Spanned<String>>,
    pub(super) offsets: Option<Spanned<i64>>,
    pub(super) pixels_per_degree: Option<Spanned<f64>>,
    pub(super) blend: Option<Spanned<String>>,
    pub(super) output: Option<Spanned<String>>,
    pub(super) exposure: Option<Spanned<f64>>,
    pub(super) tone_mapping: Option<Spanned<String>>,
    #[serde(default)]
    pub(super) shader: Shader,
    #[serde(default)]
    pub(super) modules: Modules,
    #[serde(default)]
    pub(super) host: HostTable,
    #[serde(default)]
    pub(super) distance: Distance,
    #[serde(default)]
    pub(super) views: Views,
    #[serde(default)]
    pub(super) uniforms: Entries,
    #[serde(default)]
    pub(super) storage: Entries,
    #[serde(default)]
    pub(super) textures: Entries,
    #[serde(default)]
    pub(super) samplers: Entries,
    #[serde(default)]
    pub(super) attributes: Entries,
    pub(super) lighting: Option<Spanned<LightingTable>>,
    #[serde(default)]
    pub(super) targets: Entries,
}

/// `[lighting]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightingTable {
    pub(super) shader: Option<Spanned<String>>,
    pub(super) fragment: Option<String>,
    #[serde(default)]
    pub(super) uniforms: Entries,
    #[serde(default)]
    pub(super) storage: Entries,
    #[serde(default)]
    pub(super) textures: Entries,
    #[serde(default)]
    pub(super) samplers: Entries,
}

/// `[host]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HostTable {
    #[serde(default)]
    pub(super) parameters: bool,
    #[serde(default)]
    pub(super) textures: bool,
    /// In MiB.
    pub(super) max_texture_memory: Option<u32>,
}

/// `[shader]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shader {
    pub(super) vertex: Option<Spanned<String>>,
}

/// `[modules]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Modules {
    #[serde(default)]
    pub(super) folders: Vec<String>,
    #[serde(default)]
    pub(super) definitions: Entries,
}

/// `[distance]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Distance {
    pub(super) nearest: Option<Spanned<f64>>,
    pub(super) farthest: Option<Spanned<f64>>,
}

/// `[views]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Views {
    pub(super) directions: Option<Spanned<Vec<Spanned<[f64; 3]>>>>,
    pub(super) count: Option<Spanned<i64>>,
}

/// The entries of a table whose keys are the shader's names, in the order of the file.
#[derive(Clone, Debug, Default)]
pub(super) struct Entries(pub(super) Vec<(Spanned<String>, Spanned<Node>)>);

/// Any value.
#[derive(Clone, Debug)]
pub(super) enum Node {
    Integer(i64),
    Float(f64),
    Bool(bool),
    Text(String),
    List(Vec<Spanned<Node>>),
    Table(Entries),
}

impl Node {
    /// What it is, for a message.
    pub(super) fn what(&self) -> &'static str {
        match self {
            Self::Integer(_) | Self::Float(_) => "a number",
            Self::Bool(_) => "a boolean",
            Self::Text(_) => "a text",
            Self::List(_) => "a list",
            Self::Table(_) => "a table",
        }
    }
}

impl Entries {
    /// The value of a key.
    pub(super) fn get(&self, key: &str) -> Option<&Spanned<Node>> {
        let mut all = self.0.iter();
        all.find(|(k, _)| k.get_ref() == key)
            .map(|(_, value)| value)
    }
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Node;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a value")
            }
            fn visit_bool<E>(self, v: bool) -> std::result::Result<Node, E> {
                Ok(Node::Bool(v))
            }
            fn visit_i64<E>(self, v: i64) -> std::result::Result<Node, E> {
                Ok(Node::Integer(v))
            }
            fn visit_f64<E>(self, v: f64) -> std::result::Result<Node, E> {
                Ok(Node::Float(v))
            }
            fn visit_str<E>(self, v: &str) -> std::result::Result<Node, E> {
                Ok(Node::Text(v.to_owned()))
            }
            fn visit_seq<A: SeqAccess<'de>>(
                self,
                mut seq: A,
            ) -> std::result::Result<Node, A::Error> {
                let mut list = Vec::new();
                while let Some(item) = seq.next_element()? {
                    list.push(item);
                }
                Ok(Node::List(list))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> std::result::Result<Node, A::Error> {
                entries(map).map(Node::Table)
            }
        }
        deserializer.deserialize_any(Any)
    }
}

impl<'de> Deserialize<'de> for Entries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Table;
        impl<'de> Visitor<'de> for Table {
            type Value = Entries;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table")
            }
            fn visit_map<A: MapAccess<'de>>(
                self,
                map: A,
            ) -> std::result::Result<Entries, A::Error> {
                entries(map)
            }
        }
        deserializer.deserialize_map(Table)
    }
}

fn entries<'de, A: MapAccess<'de>>(mut map: A) -> std::result::Result<Entries, A::Error> {
    let mut entries = Vec::new();
    while let Some(entry) = map.next_entry()? {
        entries.push(entry);
    }
    Ok(Entries(entries))
}

/// The scene file's name and text, for messages that point into it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Toml<'t> {
    /// As the user gave it.
    pub(super) name: &'t str,
    /// What spans point into.
    pub(super) text: &'t str,
}

impl Toml<'_> {
    /// An error at a place in the scene file.
    pub(super) fn error(
        &self,
        message: impl Into<String>,
        span: Range<usize>,
        remark: impl Into<String>,
    ) -> Box<Diagnostic> {
        Diagnostic::error(message)
            .with_source(self.name, self.text)
            .with_label(span, remark)
    }

    /// An error about a name that is none of `known`.
    pub(super) fn unknown<'n>(
        &self,
        what: &str,
        name: &Spanned<String>,
        known: impl IntoIterator<Item = &'n str>,
    ) -> Box<Diagnostic> {
        let known: Vec<&str> = known.into_iter().collect();
        let error = self.error(
            format!("there is no {what} `{}`", name.get_ref()),
            name.span(),
            "",
        );
        suggest(error, name.get_ref(), &known)
    }

    /// Reads the file.
    pub(super) fn parse(&self) -> Result<SceneFile> {
        toml::from_str(self.text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            let message = error.message().trim_end_matches('.');
            let located = |message: String| self.error(message, span.clone(), "");
            if let Some((unknown, rest)) = quoted(message, "unknown field ") {
                let known: Vec<&str> = rest.split('`').skip(1).step_by(2).collect();
                return suggest(located(format!("unknown key `{unknown}`")), unknown, &known);
            }
            let types = [
                ("expected f64", "expected a number"),
                ("expected i64", "expected a whole number"),
                ("expected a sequence", "expected a list"),
                ("invalid type: map", "invalid type: table"),
                ("sequence", "list"),
                ("integer `", "number `"),
                ("floating point `", "number `"),
                ("struct Shader", "a table"),
                ("struct Modules", "a table"),
                ("struct Distance", "a table"),
                ("struct Views", "a table"),
                ("struct LightingTable", "a table"),
            ];
            let message = message.lines().collect::<Vec<_>>().join(", ");
            located(
                types
                    .iter()
                    .fold(message, |m, (from, to)| m.replace(from, to)),
            )
        })
    }
}

/// The backquoted word behind a prefix, and the rest of the text.
fn quoted<'m>(message: &'m str, prefix: &str) -> Option<(&'m str, &'m str)> {
    message
        .strip_prefix(prefix)?
        .strip_prefix('`')?
        .split_once('`')
}

/// Adds the names that may have been meant, or else those that there are.
pub(super) fn suggest(error: Box<Diagnostic>, wanted: &str, known: &[&str]) -> Box<Diagnostic> {
    let near = nearest(wanted, known.iter().copied(), 3);
    match (near.as_slice(), known) {
        ([], []) => error.with_note("there are none"),
        ([], known) => {
            let few = listed(known.iter().copied().take(12));
            let more = if known.len() > 12 { ", and more" } else { "" };
            let verb = if known.len() > 1 { "are" } else { "is" };
            error.with_note(format!("there {verb} {few}{more}"))
        }
        (near, _) => error.with_note(format!(
            "did you mean {}?",
            listed(near.iter().copied()).replace(" and ", " or ")
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<SceneFile> {
        Toml {
            name: "a.toml",
            text,
        }
        .parse()
    }

    /// The message, what the first label covers, and the notes.
    fn refused(text: &str) -> (String, String, Vec<String>) {
        let error = parse(text).expect_err(text);
        assert_eq!(error.source.as_ref().unwrap().0, "a.toml");
        let place = text.get(error.labels[0].0.clone()).unwrap_or("").to_owned();
        (error.message.clone(), place, error.notes.clone())
    }

    #[test]
    fn values_keep_their_places() {
        let text = "[uniforms]\n\"a.b\" = [1, [2.5, true], { dynamic = \"x\" }]\n";
        let file = parse(text).unwrap();
        let (key, value) = &file.uniforms.0[0];
        assert_eq!(
            (&text[key.span()], key.get_ref().as_str()),
            ("\"a.b\"", "a.b")
        );
        let Node::List(list) = value.get_ref() else {
            panic!()
        };
        let places: Vec<_> = list.iter().map(|n| &text[n.span()]).collect();
        assert_eq!(places, ["1", "[2.5, true]", "{ dynamic = \"x\" }"]);
        assert!(matches!(list[0].get_ref(), Node::Integer(1)));
    }

    #[test]
    fn subtables_are_entries_too() {
        let file = parse("[textures.sky]\nfaces = [\"a\"]\n").unwrap();
        assert!(matches!(
            file.textures.get("sky").unwrap().get_ref(),
            Node::Table(_)
        ));
    }

    #[test]
    fn whole_numbers_are_numbers() {
        let file =
            parse("fov = 45\nresolution = [16, 16]\n[views]\ndirections = [[0, 0, 1]]").unwrap();
        assert_eq!(*file.fov.unwrap().get_ref(), 45.0);
    }

    #[test]
    fn unknown_keys_are_located_and_near_ones_named() {
        let (message, place, notes) = refused("fov = 45.0\nobjekt = \"sphere\"\n");
        assert_eq!(
            (message.as_str(), place.as_str()),
            ("unknown key `objekt`", "objekt")
        );
        assert_eq!(notes, ["did you mean `object`?"]);
        let (message, place, notes) = refused("[distance]\nzzz = 1\n");
        assert_eq!(
            (message.as_str(), place.as_str()),
            ("unknown key `zzz`", "zzz")
        );
        assert_eq!(notes, ["there are `nearest` and `farthest`"]);
    }

    #[test]
    fn wrong_types_are_located() {
        for (text, message, at) in [
            (
                "fov = \"wide\"",
                "invalid type: string \"wide\", expected a number",
                "\"wide\"",
            ),
            (
                "levels = 2.5",
                "invalid type: number `2.5`, expected a whole number",
                "2.5",
            ),
            (
                "object = 5",
                "invalid type: number `5`, expected a string",
                "5",
            ),
            (
                "resolution = [1]",
                "invalid length 1, expected an array of length 2",
                "[1]",
            ),
            (
                "distance = 5",
                "invalid type: number `5`, expected a table",
                "5",
            ),
            (
                "uniforms = 5",
                "invalid type: number `5`, expected a table",
                "5",
            ),
            (
                "[views]\ndirections = 5",
                "invalid type: number `5`, expected a list",
                "5",
            ),
        ] {
            let (said, place, _) = refused(text);
            assert_eq!((said.as_str(), place.as_str()), (message, at), "{text}");
        }
    }

    #[test]
    fn broken_toml_is_located() {
        let (message, _, _) = refused("[distance\nnearest = 2.0");
        assert!(message.contains("expected"), "{message}");
        let (message, place, _) = refused("fov = 1.0\nfov = 2.0\n");
        assert!(message.contains("duplicate"), "{message}");
        assert_eq!(place, "fov");
    }
}
