//! A GLB of several levels: nodes under `MSFT_lod`, and every vertex once.
//!
//! Levels made by collapsing edges onto vertices that stay have no vertices but those of the level before. So all
//! levels of a draw share one run of vertices, the ones of the coarsest level first: each level is the beginning of
//! that run, as long as it needs, with indices of its own. The file holds each vertex once, and a loader that copies what an
//! accessor spans copies no vertex in vain. Where levels are of other makes, so that such beginnings would
//! hold many vertices that their level does not use, each level has a run of its own.

use super::{Level, Looks, Sight, extent};
use crate::{Draw, Mesh};
use std::collections::HashMap;
use std::fmt::Write;

/// How many vertices the beginnings of a shared run may have for each one that their levels use.
const MOST_SHARED: f64 = 1.25;

/// Words of a vertex with everything: position, normal, tangent, two pairs of texture coordinates, colour.
type Key = [u32; 18];

/// `ARRAY_BUFFER` and `ELEMENT_ARRAY_BUFFER`, what a view is for.
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// One GLB: a scene of one object, its first level with the others as `MSFT_lod` beneath it and their
/// `MSFT_screencoverage`, which ends with 0, so that the last level is drawn however small it is. With one level it is a
/// plain model. Materials are those of `looks`; images are embedded.
///
/// An attribute that says nothing is left out: colours that are all white, texture coordinates that are all 0 where
/// there are no textures, tangents of which some have no direction.
///
/// # Errors
/// When there is no level, when levels do not have the same draws, when a number is not finite, a normal no unit vector or an
/// index out of range, or when it would have 4 GiB.
pub fn glb(levels: &[Level], sight: &Sight, looks: &Looks) -> Result<Vec<u8>, String> {
    let Some(first) = levels.first() else {
        return Err("there is no level to write".to_owned());
    };
    let draws: Vec<Vec<Draw>> = levels.iter().map(|level| level.mesh.draws()).collect();
    let count = draws[0].len();
    for (i, (level, draws)) in levels.iter().zip(&draws).enumerate() {
        if draws.len() != count {
            return Err(format!(
                "level {i} has {} draws, and the first has {count}",
                draws.len()
            ));
        }
        check(level.mesh, draws).map_err(|why| format!("level {i}: {why}"))?;
    }
    let mut file = File::default();
    // Of each level, its primitives.
    let mut primitives = vec![Vec::new(); levels.len()];
    for draw in 0..count {
        let parts: Vec<Part> = levels
            .iter()
            .zip(&draws)
            .map(|(level, draws)| Part {
                mesh: level.mesh,
                triangles: &level.mesh.indices
                    [3 * draws[draw].triangles.start..3 * draws[draw].triangles.end],
            })
            .collect();
        let material = looks.of_draws.get(draw).copied().flatten();
        let made = file.draw(&parts, material, looks);
        for (all, primitive) in primitives.iter_mut().zip(made) {
            all.extend(primitive);
        }
    }
    let (_, radius, _) = extent(first.mesh);
    let coverages: Vec<f64> = levels[1..]
        .iter()
        .map(|level| sight.coverage(radius * sight.scale, level.distance))
        .chain([0.0])
        .collect();
    file.finish(&primitives, &coverages, looks)
}

/// Whether a mesh can be written.
fn check(mesh: &Mesh, draws: &[Draw]) -> Result<(), String> {
    let count = mesh.positions.len();
    let others = [
        ("normals", mesh.normals.len()),
        ("texture coordinates", mesh.uvs.len()),
        ("second texture coordinates", mesh.second_uvs.len()),
        ("tangents", mesh.tangents.len()),
        ("colours", mesh.colours.len()),
    ];
    for (what, other) in others {
        if other != 0 && other != count {
            return Err(format!("it has {other} {what}, and {count} positions"));
        }
    }
    if let Some(index) = mesh.indices.iter().find(|index| **index as usize >= count) {
        return Err(format!(
            "an index is {index}, and there are {count} vertices"
        ));
    }
    if draws.iter().any(|draw| {
        draw.triangles.start > draw.triangles.end || 3 * draw.triangles.end > mesh.indices.len()
    }) {
        return Err("a draw has triangles that are not there".to_owned());
    }
    for vertex in 0..count {
        let finite = mesh.positions[vertex].iter().all(|x| x.is_finite())
            && [&mesh.uvs, &mesh.second_uvs]
                .into_iter()
                .filter_map(|uvs| uvs.get(vertex))
                .flatten()
                .all(|x| x.is_finite())
            && mesh
                .colours
                .get(vertex)
                .is_none_or(|c| c.iter().all(|x| x.is_finite()));
        if !finite {
            return Err(format!("vertex {vertex} has a number that is not finite"));
        }
        if mesh
            .normals
            .get(vertex)
            .is_some_and(|normal| !is_unit(normal))
        {
            return Err(format!("the normal of vertex {vertex} is no unit vector"));
        }
    }
    Ok(())
}

/// As near to it as f32 gets, with room for a few roundings.
fn is_unit(vector: &[f32]) -> bool {
    let squared: f64 = vector.iter().map(|x| f64::from(*x) * f64::from(*x)).sum();
    (squared - 1.0).abs() < 1e-3
}

/// The triangles of one draw at one level.
#[derive(Clone, Copy)]
struct Part<'m> {
    mesh: &'m Mesh,
    triangles: &'m [u32],
}

/// Which attributes a draw has, at all levels alike.
#[derive(Clone, Copy)]
struct Has {
    normals: bool,
    tangents: bool,
    uvs: bool,
    second_uvs: bool,
    colours: bool,
}

impl Has {
    fn of(parts: &[Part], looks: &Looks) -> Self {
        let all = |test: &dyn Fn(&Mesh, usize) -> bool| {
            let mut parts = parts.iter();
            parts.all(|part| part.triangles.iter().all(|v| test(part.mesh, *v as usize)))
        };
        let second_uvs = all(&|mesh, v| mesh.second_uvs.len() > v);
        Self {
            normals: all(&|mesh, v| mesh.normals.len() > v),
            tangents: all(&|mesh, v| {
                let tangent = mesh.tangents.get(v);
                tangent.is_some_and(|t| is_unit(&t[..3]) && t[3].abs() == 1.0)
            }),
            // Sets of coordinates are counted from 0.
            uvs: all(&|mesh, v| mesh.uvs.len() > v)
                && (second_uvs
                    || !looks.textures.is_empty()
                    || !all(&|mesh, v| mesh.uvs[v] == [0.0; 2])),
            second_uvs,
            colours: all(&|mesh, v| mesh.colours.len() > v)
                && !all(&|mesh, v| mesh.colours[v] == [1.0; 4]),
        }
    }

    /// What makes a vertex another one; what the draw does not have is 0.
    fn key(self, mesh: &Mesh, vertex: usize) -> Key {
        let mut key = [0; 18];
        let mut put = |at: usize, numbers: &[f32]| {
            for (to, number) in key[at..].iter_mut().zip(numbers) {
                *to = number.to_bits();
            }
        };
        put(0, &mesh.positions[vertex]);
        if self.normals {
            put(3, &mesh.normals[vertex]);
        }
        if self.tangents {
            put(6, &mesh.tangents[vertex]);
        }
        if self.uvs {
            put(10, &mesh.uvs[vertex]);
        }
        if self.second_uvs {
            put(12, &mesh.second_uvs[vertex]);
        }
        if self.colours {
            // glTF has no colours beyond 1.
            put(14, &mesh.colours[vertex].map(|x| x.clamp(0.0, 1.0)));
        }
        key
    }
}

/// Vertices in the order of the file, and each level's part of them.
struct Run {
    vertices: Vec<Key>,
    /// Of each level: how many of the vertices it spans, from the first, and its corners.
    spans: Vec<(usize, Vec<u32>)>,
    /// How many different vertices the levels use, added up.
    used: usize,
}

impl Run {
    fn of(parts: &[Part], has: Has) -> Self {
        // Only looked up, so that its order does not matter.
        let mut known: HashMap<Key, u32> = HashMap::new();
        let mut vertices = Vec::new();
        // The coarsest level that uses a vertex.
        let mut last: Vec<usize> = Vec::new();
        let mut used = 0;
        let mut corners = Vec::new();
        for (level, part) in parts.iter().enumerate() {
            let mut of_level = Vec::with_capacity(part.triangles.len());
            let mut seen = vec![u32::MAX; part.mesh.positions.len()];
            for vertex in part.triangles {
                let seen = &mut seen[*vertex as usize];
                if *seen == u32::MAX {
                    let key = has.key(part.mesh, *vertex as usize);
                    *seen = *known.entry(key).or_insert_with(|| {
                        vertices.push(key);
                        last.push(usize::MAX);
                        vertices.len() as u32 - 1
                    });
                    let last = &mut last[*seen as usize];
                    used += usize::from(*last != level);
                    *last = level;
                }
                of_level.push(*seen);
            }
            corners.push(of_level);
        }
        let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
        order.sort_by_key(|v| std::cmp::Reverse(last[*v as usize]));
        let mut place = vec![0; vertices.len()];
        for (to, from) in order.iter().enumerate() {
            place[*from as usize] = to as u32;
        }
        let spans = corners.into_iter().enumerate().map(|(level, corners)| {
            let span = last.iter().filter(|last| **last >= level).count();
            let corners = corners.into_iter().map(|v| place[v as usize]);
            (span, corners.collect())
        });
        Self {
            spans: spans.collect(),
            vertices: order.iter().map(|v| vertices[*v as usize]).collect(),
            used,
        }
    }

    /// Whether levels that share it are not much worse off than with vertices of their own.
    fn is_worth_sharing(&self) -> bool {
        let spans: usize = self.spans.iter().map(|(span, _)| span).sum();
        spans as f64 <= MOST_SHARED * self.used as f64
    }
}

/// What has been put into the file so far.
#[derive(Default)]
struct File {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl File {
    /// Writes a draw of all levels: a primitive of each, which is missing where it has no triangles.
    fn draw(
        &mut self,
        parts: &[Part],
        material: Option<usize>,
        looks: &Looks,
    ) -> Vec<Option<String>> {
        let has = Has::of(parts, looks);
        let run = Run::of(parts, has);
        let runs = match run.is_worth_sharing() {
            true => vec![run],
            false => parts.iter().map(|part| Run::of(&[*part], has)).collect(),
        };
        let material = material.filter(|m| *m < looks.materials.len());
        let mut primitives = Vec::new();
        for run in &runs {
            self.run(run, has, material, &mut primitives);
        }
        primitives
    }

    fn run(
        &mut self,
        run: &Run,
        has: Has,
        material: Option<usize>,
        primitives: &mut Vec<Option<String>>,
    ) {
        if run.vertices.is_empty() {
            primitives.extend(vec![None; run.spans.len()]);
            return;
        }
        let attributes = [
            ("POSITION", 0, 3, true),
            ("NORMAL", 3, 3, has.normals),
            ("TANGENT", 6, 4, has.tangents),
            ("TEXCOORD_0", 10, 2, has.uvs),
            ("TEXCOORD_1", 12, 2, has.second_uvs),
            ("COLOR_0", 14, 4, has.colours),
        ];
        let mut views = Vec::new();
        for (name, at, parts, _) in attributes.into_iter().filter(|(.., has)| *has) {
            let words = run.vertices.iter().flat_map(|key| &key[at..at + parts]);
            let bytes: Vec<u8> = words.flat_map(|word| word.to_le_bytes()).collect();
            let view = self.view(&bytes, Some(VERTICES), Some(4 * parts));
            views.push((name, parts, view));
        }
        for (span, corners) in &run.spans {
            if corners.is_empty() {
                primitives.push(None);
                continue;
            }
            let mut of_level = String::new();
            for (name, parts, view) in &views {
                let bounds = match *name {
                    "POSITION" => bounds(&run.vertices[..*span]),
                    _ => String::new(),
                };
                let kind = format!("VEC{parts}");
                let accessor = self.accessor(*view, 5126, *span, &kind, &bounds);
                let _ = write!(of_level, "{}\"{name}\":{accessor}", comma(&of_level));
            }
            // The largest number of a width means a new strip.
            let (kind, bytes): (u32, Vec<u8>) = match *span < 0x1_0000 {
                true => (
                    5123,
                    corners
                        .iter()
                        .flat_map(|c| (*c as u16).to_le_bytes())
                        .collect(),
                ),
                false => (5125, corners.iter().flat_map(|c| c.to_le_bytes()).collect()),
            };
            let view = self.view(&bytes, Some(INDICES), None);
            let indices = self.accessor(view, kind, corners.len(), "SCALAR", "");
            let material = material.map_or(String::new(), |m| format!(",\"material\":{m}"));
            primitives.push(Some(format!(
                "{{\"attributes\":{{{of_level}}},\"indices\":{indices}{material}}}"
            )));
        }
    }

    /// Appends bytes where four divide their place.
    fn view(&mut self, bytes: &[u8], target: Option<u32>, stride: Option<usize>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = format!(
            "{{\"buffer\":0,\"byteOffset\":{},\"byteLength\":{}",
            self.bytes.len(),
            bytes.len()
        );
        if let Some(stride) = stride {
            let _ = write!(view, ",\"byteStride\":{stride}");
        }
        if let Some(target) = target {
            let _ = write!(view, ",\"target\":{target}");
        }
        self.views.push(view + "}");
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    fn accessor(&mut self, view: usize, kind: u32, count: usize, shape: &str, more: &str) -> usize {
        self.accessors.push(format!(
            "{{\"bufferView\":{view},\"componentType\":{kind},\"count\":{count},\"type\":\"{shape}\"{more}}}"
        ));
        self.accessors.len() - 1
    }

    /// The container: the JSON, then the bytes.
    fn finish(
        mut self,
        primitives: &[Vec<String>],
        coverages: &[f64],
        looks: &Looks,
    ) -> Result<Vec<u8>, String> {
        let mut images = Vec::new();
        for image in &looks.images {
            let view = self.view(&image.bytes, None, None);
            images.push(format!(
                "{{\"name\":{},\"mimeType\":{},\"bufferView\":{view}}}",
                quoted(&image.name),
                quoted(&image.kind)
            ));
        }
        let mut nodes = Vec::new();
        let mut meshes = Vec::new();
        for (level, primitives) in primitives.iter().enumerate() {
            let name = quoted(&format!("lod{level}"));
            let mut node = format!("{{\"name\":{name}");
            if !primitives.is_empty() {
                let _ = write!(node, ",\"mesh\":{}", meshes.len());
                meshes.push(format!(
                    "{{\"name\":{name},\"primitives\":[{}]}}",
                    primitives.join(",")
                ));
            }
            if level == 0 && coverages.len() > 1 {
                let ids: Vec<String> = (1..coverages.len()).map(|id| id.to_string()).collect();
                let coverages: Vec<String> = coverages.iter().map(f64::to_string).collect();
                let _ = write!(
                    node,
                    ",\"extensions\":{{\"MSFT_lod\":{{\"ids\":[{}]}}}},\"extras\":{{\"MSFT_screencoverage\":[{}]}}",
                    ids.join(","),
                    coverages.join(",")
                );
            }
            nodes.push(node + "}");
        }
        let mut extensions: Vec<String> = looks.extensions.iter().map(|e| quoted(e)).collect();
        if coverages.len() > 1 {
            extensions.push(quoted("MSFT_lod"));
        }
        extensions.sort();
        extensions.dedup();
        let mut json = "{\"asset\":{\"version\":\"2.0\",\"generator\":\"lodc\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}]"
            .to_owned();
        let buffer = format!("{{\"byteLength\":{}}}", self.bytes.len());
        for (key, entries) in [
            ("extensionsUsed", &extensions),
            ("nodes", &nodes),
            ("meshes", &meshes),
            ("materials", &looks.materials),
            ("textures", &looks.textures),
            ("samplers", &looks.samplers),
            ("images", &images),
            ("accessors", &self.accessors),
            ("bufferViews", &self.views),
            ("buffers", &vec![buffer]),
        ] {
            // glTF has no empty tables.
            if !entries.is_empty() {
                let _ = write!(json, ",\"{key}\":[{}]", entries.join(","));
            }
        }
        json.push('}');
        let mut json = json.into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let word = |n: usize| {
            let word = u32::try_from(n).map_err(|_| "it would have more than 4 GiB".to_owned());
            word.map(u32::to_le_bytes)
        };
        let mut glb = b"glTF".to_vec();
        glb.extend([2, 0, 0, 0]);
        glb.extend(word(28 + json.len() + self.bytes.len())?);
        glb.extend(word(json.len())?);
        glb.extend(b"JSON");
        glb.extend(json);
        glb.extend(word(self.bytes.len())?);
        glb.extend(b"BIN\0");
        glb.extend(self.bytes);
        Ok(glb)
    }
}

/// The box around the positions of some vertices, as an accessor has it.
fn bounds(vertices: &[Key]) -> String {
    let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
    for key in vertices {
        for axis in 0..3 {
            let x = f32::from_bits(key[axis]);
            low[axis] = low[axis].min(x);
            high[axis] = high[axis].max(x);
        }
    }
    // As f64 all digits are there, so that every reader gets the same number.
    let list = |v: [f32; 3]| v.map(|x| f64::from(x).to_string()).join(",");
    format!(",\"min\":[{}],\"max\":[{}]", list(low), list(high))
}

fn comma(before: &str) -> &'static str {
    if before.is_empty() { "" } else { "," }
}

/// A text as JSON has it.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c < ' ' => {
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

    /// A strip of squares along x, with some of their triangles.
    fn strip(squares: usize) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..=squares {
            for y in [1.0, 0.0] {
                mesh.positions.push([i as f32, y, 0.0]);
                mesh.normals.push([0.0, 0.0, 1.0]);
                mesh.uvs.push([i as f32, 1.0 - y]);
                mesh.colours.push([1.0; 4]);
            }
        }
        for i in 0..squares as u32 {
            let a = 2 * i;
            mesh.indices.extend([a, a + 1, a + 2, a + 2, a + 1, a + 3]);
        }
        mesh
    }

    /// The same surface in one square: vertices of its own, which the strip has, too.
    fn coarse(squares: usize) -> Mesh {
        let whole = strip(squares);
        let at = [0, 1, 2 * squares, 2 * squares + 1];
        Mesh {
            positions: at.map(|i| whole.positions[i]).to_vec(),
            normals: at.map(|i| whole.normals[i]).to_vec(),
            uvs: at.map(|i| whole.uvs[i]).to_vec(),
            colours: at.map(|i| whole.colours[i]).to_vec(),
            indices: vec![0, 1, 2, 2, 1, 3],
            ..Mesh::default()
        }
    }

    fn level(mesh: &Mesh, distance: f64) -> Level<'_> {
        Level { mesh, distance }
    }

    fn json(glb: &[u8]) -> String {
        let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&glb[..4], word(4), word(8)), (&b"glTF"[..], 2, glb.len()));
        let end = 20 + word(12);
        assert_eq!(&glb[16..20], b"JSON");
        assert_eq!(&glb[end + 4..end + 8], b"BIN\0");
        assert_eq!(end + 8 + word(end), glb.len());
        assert_eq!(end % 4, 0);
        String::from_utf8(glb[20..end].to_vec()).unwrap()
    }

    /// `"count":` of every accessor.
    fn counts(json: &str) -> Vec<usize> {
        let counts = json.split("\"count\":").skip(1);
        counts
            .map(|rest| rest.split(',').next().unwrap().parse().unwrap())
            .collect()
    }

    #[test]
    fn levels_share_their_vertices_and_span_no_others() {
        let (fine, coarse) = (strip(50), coarse(50));
        let levels = [level(&fine, 1.0), level(&coarse, 8.0)];
        let both = glb(&levels, &Sight::default(), &Looks::default()).unwrap();
        let json = json(&both);
        // Position, normal, coordinates and indices, of one level after the other.
        assert_eq!(counts(&json), [102, 102, 102, 300, 4, 4, 4, 6]);
        let one = glb(&levels[..1], &Sight::default(), &Looks::default()).unwrap();
        let [both, one] = [&both, &one].map(|glb| glb.len());
        // The second level is two triangles and JSON.
        assert!(both - one < 1200, "{both} {one}");
        assert!(json.contains("\"MSFT_lod\":{\"ids\":[1]}"));
        assert!(!json.contains("COLOR_0") && !json.contains("TANGENT"));
        assert!(json.contains("\"min\":[0,0,0],\"max\":[50,1,0]"), "{json}");
    }

    #[test]
    fn simplified_levels_add_indices_and_no_vertices() {
        let fine = crate::shapes::sphere(80, 40);
        let mut simplifier = crate::simplify::Simplifier::new(&fine);
        let mut meshes = vec![fine.clone()];
        for share in [2, 4, 8] {
            simplifier.to_triangles(fine.indices.len() / 3 / share, &mut |_| {});
            meshes.push(simplifier.mesh());
        }
        let levels: Vec<Level> = meshes
            .iter()
            .zip(1..)
            .map(|(mesh, d)| level(mesh, f64::from(d)))
            .collect();
        let write = |levels: &[Level]| {
            glb(levels, &Sight::default(), &Looks::default())
                .unwrap()
                .len()
        };
        let (all, one) = (write(&levels), write(&levels[..1]));
        let indices: usize = meshes[1..].iter().map(|mesh| 2 * mesh.indices.len()).sum();
        assert!(all <= one + indices + 6_000, "{all} {one} {indices}");
    }

    #[test]
    fn levels_of_another_make_have_vertices_of_their_own() {
        let fine = strip(50);
        let mut other = coarse(50);
        for position in &mut other.positions {
            position[2] = 0.5;
        }
        let levels = [level(&fine, 1.0), level(&other, 8.0), level(&fine, 9.0)];
        let json = json(&glb(&levels, &Sight::default(), &Looks::default()).unwrap());
        assert_eq!(counts(&json)[4..8], [4, 4, 4, 6]);
    }

    #[test]
    fn indices_are_narrow_while_they_fit() {
        for (squares, kind) in [(32_766, "5123"), (32_767, "5125")] {
            let mesh = strip(squares);
            let json =
                json(&glb(&[level(&mesh, 1.0)], &Sight::default(), &Looks::default()).unwrap());
            assert!(
                json.contains(&format!("\"componentType\":{kind}")),
                "{squares}"
            );
            assert!(!json.contains("MSFT_lod") && !json.contains("extensionsUsed"));
        }
    }

    #[test]
    fn what_cannot_be_written_is_refused() {
        let fine = strip(2);
        let write = |mesh: &Mesh| glb(&[level(mesh, 1.0)], &Sight::default(), &Looks::default());
        let broken = |change: &dyn Fn(&mut Mesh)| {
            let mut mesh = fine.clone();
            change(&mut mesh);
            write(&mesh).unwrap_err()
        };
        assert!(glb(&[], &Sight::default(), &Looks::default()).is_err());
        for (error, reason) in [
            (broken(&|m| m.indices[0] = 6), "an index is 6"),
            (
                broken(&|m| m.positions[1][2] = f32::NAN),
                "vertex 1 has a number",
            ),
            (
                broken(&|m| m.normals[2] = [0.0; 3]),
                "the normal of vertex 2",
            ),
            (broken(&|m| m.uvs.truncate(3)), "3 texture coordinates"),
            (
                broken(&|m| {
                    m.draws = vec![Draw {
                        vertices: 0..6,
                        triangles: 0..5,
                    }];
                }),
                "triangles that are not there",
            ),
        ] {
            assert!(error.contains(reason), "{error}");
        }
        let mut split = fine.clone();
        split.draws = [(0..2), (2..4)]
            .map(|triangles| Draw {
                vertices: 0..6,
                triangles,
            })
            .to_vec();
        let levels = [level(&fine, 1.0), level(&split, 2.0)];
        let error = glb(&levels, &Sight::default(), &Looks::default()).unwrap_err();
        assert_eq!(error, "level 1 has 2 draws, and the first has 1");
    }

    #[test]
    fn names_are_texts_of_json() {
        assert_eq!(quoted("a\"b\\c\n"), r#""a\"b\\c\u000a""#);
    }
}
