//! What `lodc diff` found, as data and as lines for a terminal.

use serde::Serialize;
use std::fmt::Write;

/// One shader against another, by what they compute.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ShaderDifference {
    /// lodc's own version.
    pub version: &'static str,
    /// The first shader, as it was named.
    pub before: String,
    /// The second.
    pub after: String,
    /// Whether both do the same: comments, names of local values and order count for nothing.
    pub same: bool,
    /// The values that differ, in the order of the second shader's lines; those that are gone by the first's.
    pub values: Vec<ValueDifference>,
    /// How many values more are computed as before, of values that differ.
    pub following: usize,
    /// The bindings that differ.
    pub bindings: Vec<BindingDifference>,
    /// What all of it comes to.
    pub totals: [Totals; 2],
}

/// What became of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Fate {
    /// The second shader alone has it.
    New,
    /// The first alone has it.
    Gone,
    /// It is computed otherwise.
    Changed,
    /// It is computed as before, and varies over something else.
    Rate,
}

/// A value that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ValueDifference {
    /// What became of it.
    pub fate: Fate,
    /// Its stage: `vertex` or `fragment`.
    pub stage: &'static str,
    /// What it is in the first shader; null when it is new.
    pub before: Option<ValueAt>,
    /// What it is in the second; null when it is gone.
    pub after: Option<ValueAt>,
}

/// A value of one of the shaders.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ValueAt {
    /// Its name, as `lodc inspect` has it.
    pub value: String,
    /// The cheapest rate at which it could be computed as it is.
    pub rate: String,
    /// Its own work in full-rate scalar operations, without that of its operands.
    pub operations: f64,
    /// Its own texture samples.
    pub samples: f64,
    /// Its file; null when it has no place in one.
    pub file: Option<String>,
    /// Its line there, from 1.
    pub line: Option<u32>,
    /// That line's text.
    pub text: Option<String>,
}

/// A binding that differs: its place as group and binding.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct BindingDifference {
    /// The variable.
    pub name: String,
    /// Its place in the first shader; null when it is new.
    pub before: Option<[u32; 2]>,
    /// Its place in the second; null when it is gone.
    pub after: Option<[u32; 2]>,
}

/// What a shader comes to when every statement runs once: all branches, and one round of each loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Totals {
    /// Work of a fragment in full-rate scalar operations, without its samples.
    pub operations: f64,
    /// Texture samples of a fragment.
    pub samples: f64,
    /// The work of a vertex.
    pub vertex_operations: f64,
    /// Components that are handed from the vertices to a fragment.
    pub varyings: u32,
    /// Bindings that the stages read.
    pub bindings: usize,
}

impl ShaderDifference {
    /// It as JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).map_or_else(|_| String::new(), |text| text + "\n")
    }

    /// It as lines for a terminal.
    pub fn lines(&self) -> String {
        if self.same {
            return format!("  {} and {} do the same\n", self.before, self.after);
        }
        let mut out = String::new();
        let mut lines_before = None;
        for value in &self.values {
            let lines = [('-', &value.before), ('+', &value.after)].map(|(sign, at)| {
                let at = at.as_ref()?;
                let place = format!("{}:{}", at.file.as_ref()?, at.line?);
                Some(format!("  {sign} {place}  {}\n", at.text.as_ref()?))
            });
            // What comes of one line stands above it once.
            if lines_before.as_ref().is_some_and(|before| *before != lines) {
                out.extend(lines_before.take().into_iter().flatten().flatten());
            }
            out += &value.line();
            lines_before = Some(lines);
        }
        out.extend(lines_before.into_iter().flatten().flatten());
        if self.following > 0 {
            let (count, s) = (self.following, if self.following == 1 { "" } else { "s" });
            let _ = writeln!(out, "  {count} more value{s} of what differs");
        }
        for binding in &self.bindings {
            let place = |at: Option<[u32; 2]>| {
                at.map(|[group, binding]| format!("group {group}, binding {binding}"))
            };
            let (fate, place) = match (place(binding.before), place(binding.after)) {
                (Some(before), Some(after)) if before != after => {
                    ("changed", format!("{before} -> {after}"))
                }
                (Some(place), Some(_)) => ("changed", format!("{place}, with another type")),
                (Some(before), None) => ("gone", before),
                (None, after) => ("new", after.unwrap_or_default()),
            };
            let _ = writeln!(out, "{fate:<8} {}  {place}", binding.name);
        }
        if self.values.is_empty() && self.bindings.is_empty() {
            out += "  values are the same: what differs is when they are computed, stored or returned\n";
        }
        out + &self.table()
    }

    /// The totals, as a table.
    fn table(&self) -> String {
        let [before, after] = self.totals;
        let figures: [(&str, f64, f64); 5] = [
            ("operations", before.operations, after.operations),
            ("samples", before.samples, after.samples),
            (
                "operations of a vertex",
                before.vertex_operations,
                after.vertex_operations,
            ),
            ("varyings", before.varyings.into(), after.varyings.into()),
            ("bindings", before.bindings as f64, after.bindings as f64),
        ];
        let mut rows = vec![["", "before", "after"].map(str::to_owned)];
        rows.extend(
            figures.map(|(what, before, after)| {
                [what.to_owned(), before.to_string(), after.to_string()]
            }),
        );
        super::terminal::columns(&rows, &[true, false, false])
    }
}

impl ValueDifference {
    fn line(&self) -> String {
        let fate = match self.fate {
            Fate::New => "new",
            Fate::Gone => "gone",
            Fate::Changed => "changed",
            Fate::Rate => "rate",
        };
        let both = [&self.before, &self.after].map(Option::as_ref);
        let each = |of: &dyn Fn(&ValueAt) -> String| {
            let mut all: Vec<String> = both.into_iter().flatten().map(of).collect();
            all.dedup();
            all.join(" -> ")
        };
        let name = each(&|at| at.value.clone());
        let rate = each(&|at| at.rate.clone());
        let count = |count: f64, what: &str| {
            let s = if count == 1.0 { "" } else { "s" };
            format!("{count} {what}{s}")
        };
        let work = each(&|at| match (at.operations, at.samples) {
            (operations, 0.0) => count(operations, "operation"),
            (0.0, samples) => count(samples, "sample"),
            (operations, samples) => {
                let operations = count(operations, "operation");
                format!("{operations}, {}", count(samples, "sample"))
            }
        });
        format!("{fate:<8} {name}  {rate}, {work}\n")
    }
}
