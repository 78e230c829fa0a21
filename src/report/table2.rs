//! What meshes alone, shaders alone and both come to, as a table for people and as data.

use crate::compile::{Row, Table2};
use lodc_joint::Score;
use serde::Serialize;
use std::fmt::Write;
use std::time::Duration;

/// A figure of a row.
type Figure = fn(&Row) -> f64;

/// The columns, each with the mean time that it has in a row.
const COLUMNS: [(&str, Figure); 5] = [
    ("mesh", |row| row.scores.meshes.time),
    ("shader", |row| row.scores.shaders.time),
    ("both", |row| row.scores.chosen.time),
    ("paper", |row| row.scores.paper.time),
    ("fastest", |row| row.scores.fastest.time),
];

/// What both together are compared with, and how many times as fast they are.
const RATIOS: [(&str, Figure); 3] = [
    ("none", |row| 1.0 / row.scores.chosen.time),
    ("mesh only", |row| {
        row.scores.meshes.time / row.scores.chosen.time
    }),
    ("shader only", |row| {
        row.scores.shaders.time / row.scores.chosen.time
    }),
];

/// The head of the table.
pub fn table2_head() -> String {
    let mut text = format!("  {:<16}{:>9}", "object", "triangles");
    for (name, _) in COLUMNS {
        let _ = write!(text, "{name:>9}");
    }
    text + &format!(
        "{:>9}{:>9}{:>10}{:>9}{:>8}{:>8}{:>8}\n",
        "levels", "±", "of bound", "shaders", "meshes", "pairs", "times"
    )
}

/// A row of it.
pub fn table2_row(row: &Row) -> String {
    let mut text = format!("  {:<16}{:>9}", row.name, row.triangles);
    for (_, of) in COLUMNS {
        let _ = write!(text, "{:>9.3}", of(row));
    }
    let spread = row
        .spread
        .map_or_else(|| "-".to_owned(), |s| format!("{s:.3}"));
    let seconds = |took: Duration| format!("{:.0} s", took.as_secs_f64());
    text += &format!(
        "{:>9}{spread:>9}{:>10.2}{:>9}{:>8}{:>8}{:>8}\n",
        row.levels,
        row.held_out,
        seconds(row.shaders_took),
        seconds(row.took.meshes),
        seconds(row.took.pairs + row.took.levels),
        seconds(row.took.timing),
    );
    if let Some(walk) = &row.scores.walk {
        let Score { time, j, .. } = walk;
        let [meshes, shaders, most] = row.pairs;
        let _ = writeln!(
            text,
            "  {:<16}by the walk alone: time {time:.3}, J {j:.3}; with all J {:.3}; up to {most} pairs of {meshes} x {shaders} at a distance, {:.0} s for meshes of shaders",
            "",
            row.scores.chosen.j,
            row.took.interleaving.as_secs_f64()
        );
    }
    text
}

/// What stands below: geometric means of how many times as fast both together are.
pub fn table2_means(table: &Table2) -> String {
    let mut text = String::new();
    for (name, of) in RATIOS {
        let _ = writeln!(
            text,
            "  {:<16}{:.2} times as fast as {name}, the geometric mean",
            if name == "none" { "both" } else { "" },
            mean(&table.rows, of)
        );
    }
    let times = match &table.adapter {
        Some(adapter) => format!("measured on {adapter}"),
        None => "estimated".to_owned(),
    };
    text + &format!(
        "  {:<16}{times}, means over the distances as shares of the original's\n",
        "times"
    )
}

fn mean(rows: &[Row], of: impl Fn(&Row) -> f64) -> f64 {
    let sum: f64 = rows.iter().map(|row| libm::log(of(row))).sum();
    libm::exp(sum / rows.len().max(1) as f64)
}

#[derive(Serialize)]
struct Data<'a> {
    adapter: Option<&'a str>,
    objects: Vec<ObjectData<'a>>,
    means: Vec<(&'a str, f64)>,
}

#[derive(Serialize)]
struct ObjectData<'a> {
    name: &'a str,
    triangles: usize,
    mesh_only: ScoreData,
    shader_only: ScoreData,
    both: ScoreData,
    paper: ScoreData,
    fastest: ScoreData,
    walk: Option<ScoreData>,
    levels: usize,
    held_out: f64,
    spread: Option<f64>,
    meshes: usize,
    shaders: usize,
    pairs: usize,
    seconds: [f64; 6],
}

#[derive(Serialize)]
struct ScoreData {
    j: f64,
    time: f64,
    transition: f64,
    switches: usize,
}

/// The table as JSON. `seconds` are those of shaders, meshes, interleaving, pairs, timing and levels.
pub fn table2_json(table: &Table2) -> String {
    let score = |score: &Score| ScoreData {
        j: score.j,
        time: score.time,
        transition: score.transition,
        switches: score.switches,
    };
    let objects = table.rows.iter().map(|row| {
        let (scores, took) = (&row.scores, &row.took);
        let [meshes, shaders, pairs] = row.pairs;
        let stages = [
            row.shaders_took,
            took.meshes,
            took.interleaving,
            took.pairs,
            took.timing,
            took.levels,
        ];
        ObjectData {
            name: &row.name,
            triangles: row.triangles,
            mesh_only: score(&scores.meshes),
            shader_only: score(&scores.shaders),
            both: score(&scores.chosen),
            paper: score(&scores.paper),
            fastest: score(&scores.fastest),
            walk: scores.walk.as_ref().map(score),
            levels: row.levels,
            held_out: row.held_out,
            spread: row.spread,
            meshes,
            shaders,
            pairs,
            seconds: stages.map(|took| took.as_secs_f64()),
        }
    });
    let means = RATIOS.iter();
    let data = Data {
        adapter: table.adapter.as_deref(),
        objects: objects.collect(),
        means: means
            .map(|(name, of)| (*name, mean(&table.rows, of)))
            .collect(),
    };
    // Strings and numbers serialise.
    serde_json::to_string_pretty(&data).unwrap_or_default() + "\n"
}
