//! The table of distances: where each level begins and ends, in the words of several engines.

use super::{Level, Sight, extent};
use std::fmt::Write;

/// How much farther the end of a cross-fade is than its start. A level fades out behind the distance at which the next
/// one was found good enough, never before it.
const FADE: f64 = 1.1;

/// The table as TOML: what the distances mean, then a `[[level]]` for each.
///
/// `file` is what the levels are in, and `files`, unless it is empty, the file of each.
pub fn table(levels: &[Level], sight: &Sight, file: &str, files: &[String]) -> String {
    let mut text = String::from(
        "# Where each level of detail begins and ends. Distances are from the eye to the centre of the bounding sphere, in\n\
         # world units; heights and coverages are shares of the screen.\n",
    );
    let (centre, radius, side) = match levels.first() {
        Some(level) => extent(level.mesh),
        None => ([0.0; 3], 0.0, 0.0),
    };
    let Sight { fov, aspect, scale } = *sight;
    let _ = write!(
        text,
        "\nfile = {}\nfov = {fov:?}                       # vertical, degrees\naspect = {aspect:?}\n\
         scale = {scale:?}                     # world units to a unit of the model\n\
         centre = {centre:?}\nradius = {radius:?}\nlongest_side = {side:?}       # of its box\n",
        toml(file)
    );
    for (i, level) in levels.iter().enumerate() {
        // The first level is the nearest, wherever it is said to begin; the last has no end.
        let begin = if i == 0 { 0.0 } else { level.distance };
        let end = levels.get(i + 1).map(|next| next.distance);
        let fade = |from: Option<f64>| match from {
            Some(from) => format!("[{from:?}, {:?}]", short(from * FADE)),
            None => "[inf, inf]".to_owned(),
        };
        let start = match i {
            0 => "[0.0, 0.0]".to_owned(),
            _ => fade(Some(begin)),
        };
        let at_end = |size: &dyn Fn(f64) -> f64| end.map_or(0.0, |end| short(size(end)));
        let _ = write!(
            text,
            "\n[[level]]\n{}triangles = {}\nvertices = {}\ndistance = {begin:?}\n\
             screen_coverage = {:?}      # MSFT_screencoverage: down to this\n",
            match files.get(i) {
                Some(file) => format!("file = {}\n", toml(file)),
                None => String::new(),
            },
            level.mesh.indices.len() / 3,
            level.mesh.positions.len(),
            at_end(&|end| sight.coverage(radius * scale, end)),
        );
        let _ = write!(
            text,
            "bevy = {{ start_margin = {start}, end_margin = {}, use_aabb = true }}   # VisibilityRange\n\
             unity = {{ screenRelativeTransitionHeight = {:?} }}                     # LOD, at a lodBias of 1\n\
             godot = {{ visibility_range_begin = {begin:?}, visibility_range_end = {:?} }}   # GeometryInstance3D\n",
            fade(end),
            at_end(&|end| sight.height(side * scale, end)),
            // 0 is no end.
            end.unwrap_or(0.0),
        );
    }
    text
}

/// As many digits as anybody needs.
fn short(number: f64) -> f64 {
    format!("{number:.5e}").parse().unwrap_or(number)
}

/// A text as TOML has it.
fn toml(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;

    #[test]
    fn a_level_begins_where_the_one_before_ends() {
        // A box of 4 x 2 x 0: its sphere has the radius of the root of 5.
        let mesh = Mesh {
            positions: vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
            indices: vec![0, 1, 2],
            ..Mesh::default()
        };
        let levels = [2.0, 8.0, 20.0].map(|distance| Level {
            mesh: &mesh,
            distance,
        });
        let sight = Sight {
            fov: 90.0,
            aspect: 1.0,
            scale: 1.0,
        };
        let text = table(&levels, &sight, "a\"b.glb", &[]);
        assert!(text.contains(r#"file = "a\"b.glb""#), "{text}");
        assert!(text.contains("centre = [2.0, 1.0, 0.0]"), "{text}");
        let lines = |key: &str| -> Vec<String> {
            let lines = text.lines().filter_map(|line| line.strip_prefix(key));
            lines
                .map(|line| line.split(" #").next().unwrap_or("").trim().to_owned())
                .collect()
        };
        assert_eq!(lines("distance = "), ["0.0", "8.0", "20.0"]);
        let bevy = lines("bevy = ");
        assert!(bevy[0].starts_with("{ start_margin = [0.0, 0.0], end_margin = [8.0, 8.8]"));
        assert!(
            bevy[1].starts_with("{ start_margin = [8.0, 8.8]"),
            "{}",
            bevy[1]
        );
        assert!(bevy[1].contains("end_margin = [20.0, 22.0]"));
        assert!(bevy[2].contains("end_margin = [inf, inf]"));
        let godot = lines("godot = ");
        assert_eq!(
            godot[1],
            "{ visibility_range_begin = 8.0, visibility_range_end = 20.0 }"
        );
        assert!(godot[2].contains("visibility_range_end = 0.0"));
        // At 8 units the screen is 16 high, and the box 4 wide; the disc of the sphere has an area of 5 pi.
        let unity: Vec<f64> = lines("unity = { screenRelativeTransitionHeight = ")
            .iter()
            .map(|line| line.trim_end_matches('}').trim().parse().unwrap())
            .collect();
        assert!(
            (unity[0] - 0.25).abs() < 1e-12 && unity[2] == 0.0,
            "{unity:?}"
        );
        let coverage: f64 = lines("screen_coverage = ")[0].parse().unwrap();
        assert!((coverage - 5.0 * std::f64::consts::PI / 256.0).abs() < 1e-6);
    }
}
