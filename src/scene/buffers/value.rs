//! Values of buffers as the scene file writes them: numbers, lists, meanings, domains.

use super::{Fill, bound, is_in, root};
use crate::Result;
use crate::front::Source;
use crate::front::names::listed;
use crate::scene::file::{Entries, Node, Toml, suggest};
use crate::scene::layout::{Layout, Leaf, Place, article};
use crate::scene::materials::Factor;
use crate::scene::semantic::Semantic;
use naga::{AddressSpace, ScalarKind};
use toml::Spanned;

/// A value that a key of the scene file gives to a part of a buffer.
pub(super) struct Given<'f> {
    pub(super) key: &'f Spanned<String>,
    pub(super) place: Place,
    /// For each leaf of the place, in order.
    pub(super) fills: Vec<(Leaf, Fill)>,
    /// Whether it gives only what no other entry gives and no name tells.
    pub(super) is_rest: bool,
}

/// What fills a whole part of a buffer that nothing else says anything of.
const ZERO: &str = "zero";

/// Reads one entry of `[uniforms]` or `[storage]`.
pub(super) fn read_entry<'f>(
    source: &Source,
    layout: &Layout,
    toml: Toml,
    table: &str,
    key: &'f Spanned<String>,
    value: &Spanned<Node>,
    before: &[Given],
) -> Result<Given<'f>> {
    let mut place = find(source, layout, toml, table, key)?;
    let path = place.path.clone();
    let is_rest = matches!(value.get_ref(), Node::Text(text) if text == ZERO);
    let twice = |g: &&Given| {
        let overlap = is_in(&g.place.path, &path) || is_in(&path, &g.place.path);
        g.place.path == path || (overlap && !g.is_rest && !is_rest)
    };
    if let Some(other) = before.iter().find(twice) {
        return Err(toml
            .error(format!("`{path}` is given twice"), key.span(), "again here")
            .with_label(other.key.span(), "first here"));
    }
    let read = Reader { layout, toml };
    let fills = match value.get_ref() {
        Node::Text(_) if is_rest => {
            if layout.has_runtime_array(place.ty) {
                place.runtime = place.runtime.max(1);
            }
            let leaves = layout.leaves(&place, place.runtime.max(1)).into_iter();
            leaves
                .map(|leaf| {
                    let zeros = vec![0.0; leaf.len()];
                    (leaf, Fill::Fixed(zeros))
                })
                .collect()
        }
        Node::Text(keyword) => {
            let meaning = Meaning::of_keyword(keyword).ok_or_else(|| {
                let known: Vec<&str> = Semantic::keywords()
                    .chain(Factor::keywords())
                    .chain([ZERO])
                    .collect();
                let error =
                    toml.error(format!("there is no meaning `{keyword}`"), value.span(), "");
                suggest(error, keyword, &known)
            })?;
            let leaves = layout.leaves(&place, 1);
            match leaves.as_slice() {
                [leaf] if leaf.path == path && meaning.fits(leaf) => {
                    vec![(leaf.clone(), meaning.fill())]
                }
                _ => {
                    return Err(toml
                        .error(
                            format!("`{path}` cannot be the {keyword}"),
                            value.span(),
                            format!("it is {}", article(&layout.type_name(place.ty))),
                        )
                        .with_note(format!("the {keyword} is {}", meaning.wants())));
                }
            }
        }
        Node::Table(entries) => read.domain(&mut place, value, entries)?,
        _ => read
            .whole(&mut place, value)?
            .into_iter()
            .map(|(leaf, numbers)| (leaf, Fill::Fixed(numbers)))
            .collect(),
    };
    Ok(Given {
        key,
        place,
        fills,
        is_rest,
    })
}

/// What a keyword says: a value that the scene computes, or a factor of the object's materials.
enum Meaning {
    Semantic(Semantic),
    Factor(&'static Factor),
}

impl Meaning {
    fn of_keyword(keyword: &str) -> Option<Self> {
        let semantic = Semantic::of_keyword(keyword).map(Self::Semantic);
        semantic.or_else(|| Factor::of_keyword(keyword).map(Self::Factor))
    }

    fn fits(&self, leaf: &Leaf) -> bool {
        match self {
            Self::Semantic(semantic) => semantic.fits(leaf),
            Self::Factor(factor) => factor.fits(leaf),
        }
    }

    fn wants(&self) -> &'static str {
        match self {
            Self::Semantic(semantic) => semantic.wants(),
            Self::Factor(factor) => factor.wants(),
        }
    }

    fn fill(self) -> Fill {
        match self {
            Self::Semantic(semantic) => Fill::Semantic(semantic),
            Self::Factor(factor) => Fill::Factor(factor),
        }
    }
}

/// Whether a key of `[uniforms]` or `[storage]` names a part of a buffer of this shader.
pub(in crate::scene) fn has(source: &Source, table: &str, key: &Spanned<String>) -> bool {
    let unsaid = Toml { name: "", text: "" };
    find(source, &Layout::new(&source.module), unsaid, table, key).is_ok()
}

/// The part of a buffer that a key names.
fn find(
    source: &Source,
    layout: &Layout,
    toml: Toml,
    table: &str,
    key: &Spanned<String>,
) -> Result<Place> {
    let path = key.get_ref();
    let end = path.find(['.', '[']).unwrap_or(path.len());
    let (name, rest) = path.split_at(end);
    let variables = || bound(&source.module).map(|(v, _)| v);
    let Some(variable) = variables().find(|v| v.name.as_deref() == Some(name)) else {
        let known: Vec<String> = variables()
            .flat_map(|v| {
                let root = root(v);
                let leaves = layout.leaves(&root, 1).into_iter().map(|l| l.path);
                std::iter::once(root.path.clone()).chain(leaves)
            })
            .collect();
        let kind = if table == "storage" {
            "storage buffer"
        } else {
            "uniform"
        };
        return Err(toml.unknown(kind, key, known.iter().map(String::as_str)));
    };
    let right = match variable.space {
        AddressSpace::Uniform => "uniforms",
        _ => "storage",
    };
    if right != table {
        return Err(toml
            .error(
                format!(
                    "`{name}` is no {}",
                    if table == "uniforms" {
                        "uniform"
                    } else {
                        "storage buffer"
                    }
                ),
                key.span(),
                "",
            )
            .with_note(format!("write it under [{right}]")));
    }
    layout.follow(root(variable), rest).map_err(|end| {
        let known: Vec<String> = match layout.members(&end) {
            Some(members) => members.into_iter().map(|m| m.path).collect(),
            None => Vec::new(),
        };
        let names: Vec<&str> = known.iter().map(String::as_str).collect();
        let error = toml.error(format!("there is no uniform `{path}`"), key.span(), "");
        match layout.array(end.ty) {
            Some((_, _, Some(count))) => error.with_note(format!(
                "`{}` is an array: `{}[0]` to `{}[{}]`",
                end.path,
                end.path,
                end.path,
                count - 1
            )),
            Some((_, _, None)) => error.with_note(format!(
                "`{}` is an array: `{}[0]` and on",
                end.path, end.path
            )),
            None if names.is_empty() => error.with_note(format!(
                "`{}` is {}, which has no parts",
                end.path,
                article(&layout.type_name(end.ty))
            )),
            None => suggest(error, path, &names),
        }
    })
}

/// One value of a place: its leaves in order, each with its numbers.
type Whole = Vec<(Leaf, Vec<f64>)>;

/// Reads values in the shape that a place has.
struct Reader<'a> {
    layout: &'a Layout<'a>,
    toml: Toml<'a>,
}

impl Reader<'_> {
    /// `{ samples }`, `{ from, to, count }` or `{ dynamic }`.
    fn domain(
        &self,
        place: &mut Place,
        value: &Spanned<Node>,
        entries: &Entries,
    ) -> Result<Vec<(Leaf, Fill)>> {
        let toml = self.toml;
        const KEYS: [&str; 5] = ["samples", "from", "to", "count", "dynamic"];
        if let Some((key, _)) = entries
            .0
            .iter()
            .find(|(k, _)| !KEYS.contains(&k.get_ref().as_str()))
        {
            let error = toml.error(format!("unknown key `{}`", key.get_ref()), key.span(), "");
            return Err(suggest(error, key.get_ref(), &KEYS).with_note(
                "a value is a number, a list, `{ samples = [...] }`, `{ from, to, count }` or `{ dynamic = ... }`",
            ));
        }
        let has = |key: &str| entries.get(key).is_some();
        let ways = [
            has("samples"),
            has("from") || has("to") || has("count"),
            has("dynamic"),
        ];
        if ways.iter().filter(|&&w| w).count() != 1 {
            return Err(toml
                .error(
                    "this says in no way, or in several, which values are taken",
                    value.span(),
                    "",
                )
                .with_note("give `samples`, or `from` and `to`, or `dynamic`"));
        }
        if let Some(dynamic) = entries.get("dynamic") {
            let numbers = self.whole(place, dynamic)?;
            return Ok(numbers
                .into_iter()
                .map(|(l, n)| (l, Fill::Dynamic(n)))
                .collect());
        }
        let listed = has("samples");
        let samples: Vec<Whole> = match entries.get("samples") {
            Some(samples) => {
                let list = match samples.get_ref() {
                    Node::List(list) => list,
                    other => {
                        return Err(toml.error(
                            "`samples` wants a list of values",
                            samples.span(),
                            format!("this is {}", other.what()),
                        ));
                    }
                };
                if list.is_empty() {
                    return Err(toml
                        .error("`samples` is empty", samples.span(), "")
                        .with_note("give at least one value"));
                }
                list.iter()
                    .map(|item| self.whole(place, item))
                    .collect::<Result<_>>()?
            }
            None => self.range(place, value, entries)?,
        };
        let first = samples.first().cloned().unwrap_or_default();
        Ok(first
            .into_iter()
            .enumerate()
            .map(|(i, (leaf, _))| {
                let all = samples
                    .iter()
                    .filter_map(|s| s.get(i))
                    .map(|(_, n)| n.clone());
                let all = all.collect();
                let fill = match listed {
                    true => Fill::Sampled(all),
                    false => Fill::Range(all),
                };
                (leaf, fill)
            })
            .collect())
    }

    fn range(
        &self,
        place: &mut Place,
        value: &Spanned<Node>,
        entries: &Entries,
    ) -> Result<Vec<Whole>> {
        let toml = self.toml;
        let (Some(from), Some(to)) = (entries.get("from"), entries.get("to")) else {
            let lacks = if entries.get("from").is_some() {
                "to"
            } else {
                "from"
            };
            return Err(toml
                .error(format!("a domain needs `{lacks}`"), value.span(), "")
                .with_note("write `{ from = 0.0, to = 1.0, count = 3 }`"));
        };
        let count = match entries.get("count").map(|c| (c.span(), c.get_ref())) {
            None => 2,
            Some((_, Node::Integer(n))) if (2..=64).contains(n) => *n,
            Some((span, _)) => {
                return Err(toml.error("`count` wants a whole number of 2 to 64", span, ""));
            }
        };
        let (low, high) = (self.whole(place, from)?, self.whole(place, to)?);
        let at = |i: i64| {
            let t = i as f64 / (count - 1) as f64;
            low.iter()
                .zip(&high)
                .map(|((leaf, a), (_, b))| {
                    let numbers = a.iter().zip(b).map(|(a, b)| {
                        let x = a + (b - a) * t;
                        if leaf.kind == ScalarKind::Float {
                            x
                        } else {
                            x.round()
                        }
                    });
                    (leaf.clone(), numbers.collect())
                })
                .collect()
        };
        Ok((0..count).map(at).collect())
    }

    /// One value for all of a place: its leaves, each with its numbers.
    fn whole(&self, place: &mut Place, value: &Spanned<Node>) -> Result<Whole> {
        let mut found = Vec::new();
        self.read(place, value, &mut found)?;
        if let (Some((_, _, None)), Node::List(list)) =
            (self.layout.array(place.ty), value.get_ref())
        {
            place.runtime = place
                .runtime
                .max(u32::try_from(list.len()).unwrap_or(u32::MAX));
        }
        Ok(found)
    }

    fn read(&self, place: &Place, value: &Spanned<Node>, found: &mut Whole) -> Result<()> {
        let wrong = |wants: String| {
            self.toml
                .error(
                    format!(
                        "`{}` is {}",
                        place.path,
                        article(&self.layout.type_name(place.ty))
                    ),
                    value.span(),
                    format!("this is {}", describe(value.get_ref())),
                )
                .with_note(wants)
        };
        if let Some(members) = self.layout.members(place) {
            let names: Vec<&str> = members.iter().map(|m| m.path.as_str()).collect();
            return Err(wrong(format!(
                "give its members one by one: {}",
                listed(names)
            )));
        }
        if let Some((base, _, count)) = self.layout.array(place.ty) {
            let wants = || match count {
                Some(n) => format!(
                    "it wants a list of {n} values of {}",
                    self.layout.type_name(base)
                ),
                None => format!(
                    "it wants a list of values of {}",
                    self.layout.type_name(base)
                ),
            };
            let Node::List(list) = value.get_ref() else {
                return Err(wrong(wants()));
            };
            if list.is_empty() || count.is_some_and(|n| n as usize != list.len()) {
                return Err(wrong(wants()));
            }
            for (index, item) in list.iter().enumerate() {
                let index = u32::try_from(index).unwrap_or(u32::MAX);
                let element = self
                    .layout
                    .element(place, index)
                    .ok_or_else(|| wrong(wants()))?;
                self.read(&element, item, found)?;
            }
            return Ok(());
        }
        let mut leaves = self.layout.leaves(place, 0);
        let (Some(leaf), true) = (leaves.pop(), leaves.is_empty()) else {
            return Err(wrong("the scene cannot fill this type".to_owned()));
        };
        if leaf.width != 4 {
            return Err(wrong(
                "the evaluator runs values of 32 bits only".to_owned(),
            ));
        }
        let mut numbers = Vec::new();
        let fits = match (leaf.columns, leaf.rows) {
            (1, 1) => scalar(value, &leaf, &mut numbers),
            (1, rows) => vector(value, rows, &leaf, &mut numbers),
            (columns, rows) => match value.get_ref() {
                Node::List(list) if list.len() == columns => list
                    .iter()
                    .all(|column| vector(column, rows, &leaf, &mut numbers)),
                _ => false,
            },
        };
        if !fits {
            return Err(wrong(wanted(&leaf)));
        }
        found.push((leaf, numbers));
        Ok(())
    }
}

fn describe(node: &Node) -> String {
    match node {
        Node::List(list) => format!("a list of {}", list.len()),
        other => other.what().to_owned(),
    }
}

/// What a leaf is given in TOML.
fn wanted(leaf: &Leaf) -> String {
    let number = match leaf.kind {
        ScalarKind::Float => "a number".to_owned(),
        ScalarKind::Uint => "a whole number from 0 to 4294967295, or a boolean".to_owned(),
        _ => "a whole number from -2147483648 to 2147483647, or a boolean".to_owned(),
    };
    match (leaf.columns, leaf.rows) {
        (1, 1) => format!("it wants {number}"),
        (1, rows) => format!("it wants a list of {rows}, each {number}"),
        (columns, rows) => {
            format!("it wants a list of {columns} columns, each a list of {rows} numbers")
        }
    }
}

fn vector(value: &Spanned<Node>, rows: usize, leaf: &Leaf, numbers: &mut Vec<f64>) -> bool {
    match value.get_ref() {
        Node::List(list) => list.len() == rows && list.iter().all(|n| scalar(n, leaf, numbers)),
        _ => false,
    }
}

fn scalar(value: &Spanned<Node>, leaf: &Leaf, numbers: &mut Vec<f64>) -> bool {
    let range = match leaf.kind {
        ScalarKind::Uint => 0..=i64::from(u32::MAX),
        _ => i64::from(i32::MIN)..=i64::from(i32::MAX),
    };
    let number = match (leaf.kind, value.get_ref()) {
        (ScalarKind::Float, Node::Integer(n)) => Some(*n as f64),
        (ScalarKind::Float, Node::Float(x)) => Some(*x),
        (ScalarKind::Sint | ScalarKind::Uint, Node::Integer(n)) => {
            range.contains(n).then_some(*n as f64)
        }
        (ScalarKind::Sint | ScalarKind::Uint, Node::Bool(b)) => Some(f64::from(*b)),
        _ => None,
    };
    // A value that is no finite f32 would be written as something else.
    let fits = number.filter(|x| (*x as f32).is_finite());
    numbers.extend(fits);
    fits.is_some()
}
