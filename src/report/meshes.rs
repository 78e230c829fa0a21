//! Levels of a mesh and distances of meshes, as tables and as data.

use super::terminal::columns;
use crate::compile::{MeshError, MeshLevel, SeenMesh};
use crate::mesh::{Maker, Other};
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

/// The table of a mesh and its levels by pictures, and what other makers do in their place.
pub fn seen_mesh(made: &SeenMesh) -> String {
    let head = [
        "level",
        "triangles",
        "",
        "vertices",
        "mean of diagonal",
        "distance",
        "floor",
        "excess",
        "bound",
        "made by",
        "made in",
    ];
    let mut rows = vec![head.map(str::to_owned)];
    let [triangles, vertices] = made.original;
    let mut first: [String; 11] = std::array::from_fn(|_| "-".to_owned());
    first[..4].clone_from_slice(&[
        "0".to_owned(),
        triangles.to_string(),
        "100.0 %".to_owned(),
        vertices.to_string(),
    ]);
    rows.push(first);
    let share = |count: usize| 100.0 * count as f64 / triangles.max(1) as f64;
    let mut others = String::new();
    for (number, level) in (1..).zip(&made.levels) {
        let (maker, proposals) = &level.makers;
        let [own, asked] = level.times.map(|time| time.as_secs_f64());
        rows.push([
            number.to_string(),
            level.triangles.to_string(),
            format!("{:.1} %", share(level.triangles)),
            level.vertices.to_string(),
            percent(level.distance.mean(), level.distance.diagonal),
            format!("{:.2}", level.at),
            format!("{:.4}", level.floor),
            format!("{:.4}", level.excess),
            level
                .bound
                .map_or("-".to_owned(), |bound| format!("{bound:.4}")),
            maker.name().to_owned(),
            match maker {
                Maker::Pictures => format!("{own:.1} s"),
                Maker::Meshopt | Maker::MeshoptAttributes => format!("{asked:.1} s"),
            },
        ]);
        for (other, does) in proposals {
            let does = match does {
                Other::Triangles(count) => {
                    format!(
                        "{count} triangles, {:.1} %, for the same bound",
                        share(*count)
                    )
                }
                Other::Excess(excess) => format!("excess {excess:.4} with as many triangles"),
            };
            let name = other.name();
            others += &format!("  {:<16}level {number}, {name}: {does}\n", "beside");
        }
    }
    let mut left = [false; 11];
    left[9] = true;
    columns(&rows, &left)
        + "  floor: the original's own error; excess: what the mesh adds to it, on pictures that had no part in making it\n"
        + &others
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
