//! Levels of a mesh and distances of meshes, as tables and as data.

use super::terminal::columns;
use crate::compile::{MeshError, MeshLevel};
use lodc_mesh::distance::{Distance, Way};
use serde_json::{Value, json};

/// The table of a mesh and its levels.
pub fn mesh_levels(levels: &[MeshLevel]) -> String {
    let mut rows = vec![
        [
            "level",
            "triangles",
            "",
            "vertices",
            "mean",
            "of diagonal",
            "largest",
            "bound",
            "of diagonal",
            "from distance",
            "made in",
        ]
        .map(str::to_owned),
    ];
    let original = levels.first().map_or(0, |level| level.triangles).max(1);
    for (number, level) in levels.iter().enumerate() {
        let Distance { diagonal, .. } = level.distance;
        rows.push([
            number.to_string(),
            level.triangles.to_string(),
            format!("{:.1} %", 100.0 * level.triangles as f64 / original as f64),
            level.vertices.to_string(),
            digits(level.distance.mean()),
            percent(level.distance.mean(), diagonal),
            digits(level.distance.largest()),
            digits(level.bound),
            percent(level.bound, diagonal),
            format!("{:.2}", level.from),
            match number {
                0 => "-".to_owned(),
                _ => format!("{:.1} s", level.time.as_secs_f64()),
            },
        ]);
    }
    columns(&rows, &[false; 11])
        + "  mean: from the vertices of both to the other, Pan's equation 1; largest: of those; bound: proved, for all points of both surfaces\n  \
           from distance: where the bound is a pixel high\n"
}

/// The table of how far two meshes are apart.
pub fn mesh_error(measured: &MeshError) -> String {
    let (vertices, surfaces) = (&measured.vertices, &measured.surfaces);
    let mut rows = vec![
        [
            "from",
            "points",
            "mean",
            "of diagonal",
            "largest",
            "of diagonal",
        ]
        .map(str::to_owned),
    ];
    let mut row = |from: &str, points: usize, mean: f64, largest: f64| {
        rows.push([
            from.to_owned(),
            points.to_string(),
            digits(mean),
            percent(mean, vertices.diagonal),
            digits(largest),
            percent(largest, vertices.diagonal),
        ]);
    };
    let mut ways = |what: &str, distance: &Distance| {
        let Distance { there, back, .. } = distance;
        row(
            &format!("the original's {what}"),
            there.points,
            there.mean,
            there.largest,
        );
        row(
            &format!("the other's {what}"),
            back.points,
            back.mean,
            back.largest,
        );
    };
    ways("vertices", vertices);
    ways("surface", surfaces);
    let (mean, points) = (
        vertices.mean(),
        vertices.there.points + vertices.back.points,
    );
    row("both vertices", points, mean, vertices.largest());
    let [original, other] = measured.triangles;
    format!(
        "  {:<16}{original} triangles, diagonal {}\n  {:<16}{other} triangles, {:.1} %\n\n",
        "original",
        digits(vertices.diagonal),
        "other",
        100.0 * other as f64 / original.max(1) as f64
    ) + &columns(&rows, &[true, false, false, false, false, false])
        + "  distances to the nearest place of the other mesh; the mean of both vertices is Pan's equation 1\n"
}

/// The same as JSON, with a line end at the end.
pub fn mesh_error_json(measured: &MeshError) -> String {
    let (vertices, surfaces) = (&measured.vertices, &measured.surfaces);
    let share = |length: f64| finite(length / vertices.diagonal);
    let way = |way: &Way| {
        json!({
            "points": way.points,
            "mean": finite(way.mean),
            "mean_of_diagonal": share(way.mean),
            "largest": finite(way.largest),
            "largest_of_diagonal": share(way.largest),
        })
    };
    let both = |distance: &Distance| json!({ "from_original": way(&distance.there), "from_other": way(&distance.back) });
    let all = json!({
        "triangles": measured.triangles,
        "diagonal": finite(vertices.diagonal),
        "mean": finite(vertices.mean()),
        "mean_of_diagonal": share(vertices.mean()),
        "vertices": both(vertices),
        "surfaces": both(surfaces),
    });
    // Serialising plain data to a string cannot fail.
    serde_json::to_string_pretty(&all).unwrap_or_default() + "\n"
}

/// JSON has no infinity.
fn finite(number: f64) -> Value {
    serde_json::Number::from_f64(number).map_or(Value::Null, Value::Number)
}

/// A length with four digits that say something.
fn digits(length: f64) -> String {
    match length {
        0.0 => "0".to_owned(),
        length if (1e-3..1e5).contains(&length) => {
            let before = length.log10().floor() as i32;
            format!("{length:.*}", (3 - before).max(0) as usize)
        }
        length => format!("{length:.3e}"),
    }
}

fn percent(length: f64, diagonal: f64) -> String {
    if diagonal > 0.0 {
        format!("{:.5} %", 100.0 * length / diagonal)
    } else {
        "-".to_owned()
    }
}
