//! Small files with numbers worked out by hand, and files that are damaged.

use super::*;
use crate::Mesh;

fn read_obj(text: &str) -> Result<Model, String> {
    obj(text.as_bytes(), &mut |_| None)
}

/// Positions of the corners of each triangle.
fn corners(mesh: &Mesh) -> Vec<[[f32; 3]; 3]> {
    let triangles = mesh.indices.chunks_exact(3);
    triangles
        .map(|t| [0, 1, 2].map(|i| mesh.positions[t[i] as usize]))
        .collect()
}

#[test]
fn an_obj_has_a_draw_for_each_material() {
    let text = "# a roof, \\\r\nmtllib a b.mtl\r\nv 0 0 0\r\nv 1 0 0\nv 1 1 0 1 0 0\nv 0 1 \\\n0\nv 0 1 1\n\
                vt 0 0\nvt 1 0.25\nvt 1 1\nvn 0 0 2\n\
                o thing\ng part\nusemtl Red#1 Paint\nf 1/1/1 2/2/1 3/3/1 4//1\n\
                usemtl other\nf -5 4 -1\nusemtl Red#1 Paint\nf 1/1/1 3/3/1 4//1\ncurv 1 2\n";
    let mtl = b"newmtl unused\nKd 0 0 0\nnewmtl Red#1 Paint\nKd 0.5 0.25 0.125\nd 0.5\nPr 0.25\nmap_Kd tex\\a b.png\n\
                map_Ke glow.png\nillum 2\nmap_Bump -bm 1 x.png\nKd bright\n";
    let mut asked = Vec::new();
    let model = obj(text.as_bytes(), &mut |name| {
        asked.push(name.to_owned());
        Some(mtl.to_vec())
    })
    .unwrap();
    assert_eq!(asked, ["a b.mtl"]);
    let mesh = &model.mesh;
    let ranges: Vec<_> = mesh
        .draws
        .iter()
        .map(|d| (d.vertices.clone(), d.triangles.clone()))
        .collect();
    // The quad is a fan of two, and shares its corners with the last face.
    assert_eq!(ranges, [(0..4, 0..3), (4..7, 3..4)]);
    assert_eq!(mesh.indices, [0, 1, 2, 0, 2, 3, 0, 2, 3, 4, 5, 6]);
    assert_eq!(corners(mesh)[3][0], [0.0, 0.0, 0.0]);
    assert_eq!(corners(mesh)[3][2], [0.0, 1.0, 1.0]);
    assert_eq!(mesh.normals[..4], [[0.0, 0.0, 1.0]; 4]);
    // The face of the second draw has none: they are its own, but for corners that the first has, too.
    assert_eq!(mesh.normals[6], [1.0, 0.0, 0.0]);
    assert!(mesh.normals[4][0] > 0.1 && mesh.normals[4][2] > 0.1);
    assert_eq!(
        mesh.uvs[..4],
        [[0.0, 1.0], [1.0, 0.75], [1.0, 0.0], [0.0; 2]]
    );
    assert_eq!(mesh.colours[2], [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(mesh.colours[1], [1.0; 4]);
    let red = &model.materials[0];
    assert_eq!(red.name, "Red#1 Paint");
    assert_eq!(red.base_colour, [0.5, 0.25, 0.125, 0.5]);
    assert_eq!((red.roughness, red.metallic), (0.25, 0.0));
    assert_eq!(red.base_image.as_deref(), Some("tex/a b.png"));
    assert_eq!(red.emission, [1.0; 3]);
    assert_eq!(model.materials[1], Material::named("other"));
    assert_eq!(
        model.warnings,
        [
            "has 1 lines in `a b.mtl` that cannot be read",
            "has lines that are not read: `curv`"
        ]
    );
}

#[test]
fn smoothing_groups_of_an_obj_count_where_it_has_no_normals() {
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let normals = |faces: &str| read_obj(&format!("{points}{faces}")).unwrap().mesh.normals;
    // Two faces at right angles: smooth along their edge, unless they are told apart.
    let smooth = normals("f 1 2 3\nf 1 4 2\n");
    assert_eq!(smooth.len(), 4);
    assert!((smooth[0][1] - 0.5f32.sqrt()).abs() < 1e-6, "{smooth:?}");
    for apart in ["s off\nf 1 2 3\nf 1 4 2\n", "s 1\nf 1 2 3\ns 2\nf 1 4 2\n"] {
        let flat = normals(apart);
        assert_eq!(flat[..3], [[0.0, 0.0, 1.0]; 3]);
        assert_eq!(flat[3..], [[0.0, 1.0, 0.0]; 3]);
    }
}

#[test]
fn broken_obj_files_are_refused_with_the_line() {
    for (text, reason) in [
        ("v 0 0\n", "line 1: a position has 2 numbers"),
        (
            "v 0 0 x\n",
            "line 1: a position has `x`, which is no number",
        ),
        (
            "v 0 0 nan\n",
            "line 1: a position has `nan`, which is no finite number",
        ),
        (
            "v 0 0 1e39\n",
            "line 1: a position has `1e39`, which is no finite number",
        ),
        (
            "v 0 0 0\nf 1 2 1\n",
            "line 2: a face has vertex 2, and there are 1 so far",
        ),
        (
            "v 0 0 0\n\\\n\nf 1 0 1\n",
            "line 4: a face has vertex 0, and there are 1 so far",
        ),
        (
            "v 0 0 0\nf 1 -2 1\n",
            "line 2: a face has vertex -2, and there are 1 so far",
        ),
        (
            "v 0 0 0\nf 1/1 1 1\n",
            "a face has texture coordinate 1, and there are 0",
        ),
        (
            "v 0 0 0\nf 1//9 1 1\n",
            "a face has normal 9, and there are 0",
        ),
        (
            "v 0 0 0\nf 99999999999999999999 1 1\n",
            "is no index of vertex",
        ),
        ("v 0 0 0\nf 1 1\n", "line 2: a face has 2 corners"),
        ("s one\n", "line 1: `one` is no smoothing group"),
        ("", "it has no faces"),
        ("v 0 0 0\np 1\n", "it has no faces"),
    ] {
        let error = read_obj(text).unwrap_err();
        assert!(error.contains(reason), "{text:?}: {error}");
    }
    let long = read_obj(&format!("v 0 0 {}\n", "x".repeat(100_000))).unwrap_err();
    assert!(long.len() < 200, "{long}");
}

const HEADER: &str = "ply\nformat FORMAT 1.0\ncomment TextureFile a b.png\nelement vertex 4\nproperty float x\n\
    property double y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
    element junk 1\nproperty list uchar short stuff\nelement face 1\nproperty uchar flags\n\
    property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n";

/// A square over 0..1, with texture coordinates of its corners: a quad.
fn square(format: &str) -> Vec<u8> {
    let mut bytes = HEADER.replace("FORMAT", format).into_bytes();
    let places = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    if format == "ascii" {
        for [x, y] in places {
            bytes.extend(format!("{x} {y} 0 255 0 255\r\n").into_bytes());
        }
        bytes.extend(b"2 7 8\n 3 4 0 1 2 3 8 0 0 1 0 1 1 0 1");
        return bytes;
    }
    let put = |bytes: &mut Vec<u8>, number: &[u8]| match format {
        "binary_big_endian" => bytes.extend(number.iter().rev()),
        _ => bytes.extend(number),
    };
    for [x, y] in places {
        put(&mut bytes, &(x as f32).to_le_bytes());
        put(&mut bytes, &f64::to_le_bytes(y));
        put(&mut bytes, &0f32.to_le_bytes());
        bytes.extend([255, 0, 255]);
    }
    bytes.push(2);
    put(&mut bytes, &7i16.to_le_bytes());
    put(&mut bytes, &8i16.to_le_bytes());
    bytes.extend([3, 4]);
    for i in 0..4i32 {
        put(&mut bytes, &i.to_le_bytes());
    }
    bytes.push(8);
    for uv in places.as_flattened() {
        put(&mut bytes, &(*uv as f32).to_le_bytes());
    }
    bytes
}

#[test]
fn a_ply_is_the_same_in_every_format() {
    let text = ply(&square("ascii")).unwrap();
    let mesh = &text.mesh;
    assert_eq!(mesh.indices, [0, 1, 2, 0, 2, 3]);
    assert_eq!(mesh.positions[2], [1.0, 1.0, 0.0]);
    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0]; 4]);
    assert_eq!(mesh.uvs, [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    assert_eq!(mesh.colours, [[1.0, 0.0, 1.0, 1.0]; 4]);
    assert_eq!(text.materials[0].base_image.as_deref(), Some("a b.png"));
    for format in ["binary_little_endian", "binary_big_endian"] {
        assert_eq!(ply(&square(format)).unwrap(), text, "{format}");
    }
}

#[test]
fn vertices_of_a_ply_may_have_normals_and_coordinates() {
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\nelement vertex 3\n\
                property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n\
                property float nz\nproperty float s\nproperty float t\nend_header\n\
                3 0 1 2\n0 0 0 0 3 0 0.5 0.25\n1 0 0 0 3 0 0 0\n0 1 0 0 0 0 0 0\n";
    let model = ply(text.as_bytes()).unwrap();
    assert_eq!(model.mesh.normals[..2], [[0.0, 1.0, 0.0]; 2]);
    assert_eq!(model.mesh.normals[2], [0.0, 0.0, 1.0]);
    assert_eq!(model.mesh.uvs[0], [0.5, 0.75]);
    assert!(
        model.warnings[0].contains("1 normals"),
        "{:?}",
        model.warnings
    );
}

#[test]
fn broken_ply_files_are_refused_with_the_place() {
    let whole = String::from_utf8(square("ascii")).unwrap();
    let with = |from: &str, to: &str| {
        assert!(whole.contains(from), "{from}");
        whole.replacen(from, to, 1).into_bytes()
    };
    let binary = square("binary_little_endian");
    let huge = |count: &str, format: &str| {
        let text = with("vertex 4", &format!("vertex {count}"));
        let text = String::from_utf8(text).unwrap();
        text.replace("ascii", format).into_bytes()
    };
    for (bytes, reason) in [
        (b"solid".to_vec(), "it does not begin with `ply`"),
        (b"solid\n".to_vec(), "it does not begin with `ply`"),
        (b"ply\n".to_vec(), "its header has no end"),
        (b"ply\nend_header\n".to_vec(), "its header says no format"),
        (with("ascii", "utf8"), "line 2: there is no format `utf8`"),
        (with("float x", "half x"), "line 5: there is no type `half`"),
        (
            with("element vertex", "vertex"),
            "line 4: there is no `vertex` in a header",
        ),
        (
            with("vertex 4", "vertex -1"),
            "line 4: `-1` is no number of elements",
        ),
        (
            huge("4000000000", "ascii"),
            "4000000000 of `vertex` do not fit",
        ),
        (
            huge("4000000000", "binary_big_endian"),
            "4000000000 of `vertex` do not fit",
        ),
        (
            huge("18446744073709551615", "binary_big_endian"),
            "do not fit",
        ),
        (with("float x", "float q"), "vertex 0: it has no x, y and z"),
        (
            with("1 0 0 255", "1 nan 0 255"),
            "vertex 1: its position is no finite number",
        ),
        (
            with("1 0 0 255", "1 1e60 0 255"),
            "vertex 1: its position is no finite number",
        ),
        (
            with("1 0 0 255", "1 zero 0 255"),
            "vertex 1: `zero` is no number",
        ),
        (
            with("3 4 0 1 2 3", "3 4 0 1 2 4"),
            "face 0: an index is 4, and there are 4 vertices",
        ),
        (
            with("3 4 0 1 2 3", "3 4 0 1 2 -1"),
            "face 0: an index is -1",
        ),
        (
            with("3 4 0 1 2 3", "3 4 0 1 2 .5"),
            "face 0: an index is 0.5",
        ),
        (
            with("3 4 0 1 2 3", "3 4000 0 1 2 3"),
            "face 0: a list has 4000 numbers",
        ),
        (
            with("3 4 0 1 2 3", "3 -4 0 1 2 3"),
            "face 0: a list has -4 numbers",
        ),
        (
            with("vertex_indices", "corners"),
            "face 0: it has no `vertex_indices`",
        ),
        (
            with("element face 1", "element face 0"),
            "it has 4 points, and no faces",
        ),
        (
            binary[..binary.len() - 1].to_vec(),
            "face 0: the file ends before it",
        ),
    ] {
        let error = ply(&bytes).unwrap_err();
        assert!(error.contains(reason), "{reason}: {error}");
    }
}

#[test]
fn an_element_of_nothing_may_be_as_long_as_it_likes() {
    let text = String::from_utf8(square("ascii")).unwrap();
    let text = text.replacen("element junk", "element void 4000000000\nelement junk", 1);
    assert!(ply(text.as_bytes()).is_ok());
}

/// Bytes of valid files changed by chance: no panic, and no more triangles than there are bytes. A failure names the
/// round, and comes again.
#[test]
fn damaged_files_are_refused_or_read() {
    let obj_text = "v 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ns 1\nusemtl a\nf 1/1/1 2/1/1 3//1 -1\n\
                    mtllib m\nf 1 3 4\n";
    let mtl = b"newmtl a\nKd 1 0.5 0\nmap_Kd a.png\nTr 0.5\nKe 1\n";
    let files = [
        obj_text.as_bytes().to_vec(),
        square("ascii"),
        square("binary_little_endian"),
        square("binary_big_endian"),
    ];
    for (number, file) in files.iter().enumerate() {
        for round in 0..4_000u64 {
            let mut state = (round + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mut below = |end: usize| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 33) as usize % end.max(1)
            };
            let mut damaged = file.clone();
            let mut library = mtl.to_vec();
            for _ in 0..=below(4) {
                let at = below(damaged.len());
                match below(5) {
                    0 => damaged.truncate(at.max(1)),
                    1 => damaged[at] = b" \n-/09e.x#\\"[below(11)],
                    2 => damaged[at] = below(256) as u8,
                    3 => {
                        let end = (at + below(12)).min(damaged.len());
                        let part = damaged[at..end].to_vec();
                        damaged.splice(at..at, part);
                    }
                    _ => {
                        let at = below(library.len());
                        library[at] = below(256) as u8;
                    }
                }
            }
            let read = std::panic::catch_unwind(|| match number {
                0 => obj(&damaged, &mut |_| Some(library.clone())),
                _ => ply(&damaged),
            });
            match read.unwrap_or_else(|_| panic!("file {number} panics in round {round}")) {
                Err(error) => assert!(!error.is_empty() && error.len() < 400, "{error}"),
                Ok(model) => {
                    let mesh = &model.mesh;
                    assert!(mesh.indices.len() / 3 <= damaged.len(), "round {round}");
                    let count = mesh.positions.len();
                    assert!(mesh.indices.iter().all(|i| (*i as usize) < count));
                    assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
                    assert_eq!(model.materials.len(), mesh.draws.len());
                }
            }
        }
    }
}
