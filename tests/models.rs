//! Models in and out: OBJ and PLY as objects of scenes, levels written as GLB and read again, and the judgement of
//! Khronos' validator (`tests/gltf`, which `.ci/run` installs) on what was written.
#![cfg(feature = "cli")]

#[path = "../examples/models/shapes.rs"]
mod shapes;

use lodc::compile::ModelFile;
use lodc::front::Source;
use lodc::scene::Scene;
use lodc::scene::mesh::write::{Level, Sight};
use lodc::scene::mesh::{Draw, Mesh};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder of its own, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lodc-models-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    fn scene(&self, shader: &str, toml: &str) -> Result<Scene, String> {
        let source = Source::parse("a.wgsl", shader).unwrap();
        let path = self.write("a.toml", toml);
        Scene::read(&source, Some(&path)).map_err(|error| error.to_string())
    }

    /// Writes levels of a model, and gives their files back, the table last.
    fn levels(&self, model: &ModelFile, levels: &[Level], name: &str, apart: bool) -> Vec<PathBuf> {
        let output = self.0.join(name);
        let files = model.files(levels, &Sight::default(), &output, apart);
        let files = files.unwrap_or_else(|error| panic!("{error}"));
        lodc::emit::write_atomically(&files).unwrap();
        files.into_iter().map(|(path, _)| path).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Base colour with its factor, and everything else that a vertex has.
const SHADER: &str = "
    struct Camera { view_proj: mat4x4f }
    struct Material { base_color_factor: vec4f, roughness_factor: f32 }
    @group(0) @binding(0) var<uniform> camera: Camera;
    @group(1) @binding(0) var<uniform> material: Material;
    @group(1) @binding(1) var surface_sampler: sampler;
    @group(1) @binding(2) var base_color_texture: texture_2d<f32>;
    struct V { @builtin(position) clip: vec4f, @location(0) uv: vec2f, @location(1) rest: vec4f }
    @vertex fn vs(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) tangent: vec4f,
                  @location(3) uv: vec2f, @location(4) color: vec4f) -> V {
        return V(camera.view_proj * vec4f(position, 1.0), uv, tangent + vec4f(normal, 0.0) * color);
    }
    @fragment fn fs(v: V) -> @location(0) vec4f {
        let base = textureSample(base_color_texture, surface_sampler, v.uv) * material.base_color_factor;
        return base + v.rest * 0.0 * material.roughness_factor;
    }";

/// Two triangles that share an edge at a right angle, each with a material.
const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n\
                   usemtl red\nf 1/1 2/2 3/3\nusemtl blue\nf 1/1 4/2 2/3\n";
const MTL: &str = "newmtl red\nKd 1 0 0\nPr 0.5\nmap_Kd one.png\nnewmtl blue\nKd 0 0 1\nd 0.5\n";

fn one_texel() -> Vec<u8> {
    lodc::eval::image::encode_png(1, 1, &[[255, 128, 0, 255]]).unwrap()
}

#[test]
fn an_obj_is_an_object_of_a_scene() {
    let folder = Folder::new("obj");
    folder.write("a.obj", OBJ);
    folder.write("a.mtl", MTL);
    folder.write("one.png", one_texel());
    let scene = folder.scene(SHADER, "object = \"a.obj\"\n").unwrap();
    assert_eq!(scene.mesh.draws().len(), 2);
    assert_eq!(scene.mesh.indices.len(), 6);
    // MikkTSpace made tangents along u.
    assert_eq!(scene.mesh.tangents[0][3], 1.0);
    let files: Vec<&str> = scene.inputs.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(files[2..], ["a.obj", "a.mtl", "one.png"]);
    let told: Vec<String> = scene.inferences.iter().map(|i| i.as_.clone()).collect();
    let told = told.join("\n");
    assert!(told.contains("base-colour (white for `blue`)"), "{told}");
    assert!(scene.states[1].front_only, "it is blended");
    // Without its library it is white.
    fs::remove_file(folder.0.join("a.mtl")).unwrap();
    let scene = folder.scene(SHADER, "object = \"a.obj\"\n").unwrap();
    let says = &scene.warnings[0].message;
    assert!(says.contains("`a.mtl`, which cannot be read"), "{says}");
}

#[test]
fn a_ply_is_an_object_of_a_scene() {
    let folder = Folder::new("ply");
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                  property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let mut bytes = header.as_bytes().to_vec();
    for number in [0f32, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.push(3);
    for index in [0i32, 1, 2] {
        bytes.extend(index.to_le_bytes());
    }
    folder.write("a.ply", &bytes);
    let scene = folder.scene(SHADER, "object = \"a.ply\"\n").unwrap();
    assert_eq!(scene.mesh.normals, [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(scene.mesh.colours, [[1.0; 4]; 3]);
    let error = folder.scene(SHADER, "object = \"a.ply.gz\"\n").unwrap_err();
    assert!(
        error.contains("unpack it, with `gunzip`, and name `a.ply`"),
        "{error}"
    );
}

/// A level of a mesh: every second triangle of each draw.
fn coarser(mesh: &Mesh) -> Mesh {
    let mut indices = Vec::new();
    let mut draws = Vec::new();
    for draw in mesh.draws() {
        let start = indices.len() / 3;
        for triangle in draw.triangles.step_by(2) {
            indices.extend_from_slice(&mesh.indices[3 * triangle..3 * triangle + 3]);
        }
        draws.push(Draw {
            vertices: draw.vertices,
            triangles: start..indices.len() / 3,
        });
    }
    Mesh {
        indices,
        draws,
        ..mesh.clone()
    }
}

/// Whether two meshes have the same triangles, whatever the order of vertices. Normals are made unit vectors whenever
/// they are read, which rounds.
fn assert_same(one: &Mesh, other: &Mesh, name: &str) {
    assert_eq!(one.indices.len(), other.indices.len(), "{name}");
    for (a, b) in one.indices.iter().zip(&other.indices) {
        let (a, b) = (*a as usize, *b as usize);
        assert_eq!(one.positions[a], other.positions[b], "{name}");
        assert_eq!(one.uvs[a], other.uvs[b], "{name}");
        assert_eq!(one.second_uvs.get(a), other.second_uvs.get(b), "{name}");
        assert_eq!(one.colours[a], other.colours[b], "{name}");
        let pairs = one.normals[a].into_iter().zip(other.normals[b]);
        assert!(
            pairs.into_iter().all(|(x, y)| (x - y).abs() < 1e-6),
            "{name}"
        );
        let pairs = one.tangents[a].into_iter().zip(other.tangents[b]);
        assert!(
            pairs.into_iter().all(|(x, y)| (x - y).abs() < 1e-6),
            "{name}"
        );
    }
}

#[test]
fn what_is_written_reads_back_as_it_was() {
    let folder = Folder::new("again");
    folder.write("a.mtl", MTL);
    folder.write("one.png", one_texel());
    let model = ModelFile::read(&folder.write("a.obj", OBJ)).unwrap();
    let coarse = coarser(&model.mesh);
    let levels =
        [(&model.mesh, 2.0), (&coarse, 8.0)].map(|(mesh, distance)| Level { mesh, distance });
    let files = folder.levels(&model, &levels, "out.glb", false);
    let names = |files: &[PathBuf]| -> Vec<String> {
        let names = files.iter().filter_map(|file| file.file_name());
        names
            .map(|name| name.to_string_lossy().into_owned())
            .collect()
    };
    assert_eq!(names(&files), ["out.glb", "out.meshes.toml"]);
    let table: toml::Table = fs::read_to_string(&files[1]).unwrap().parse().unwrap();
    let said = table["level"].as_array().unwrap();
    assert_eq!(said[1]["distance"].as_float(), Some(8.0));
    assert_eq!(
        said[1]["bevy"]["start_margin"],
        said[0]["bevy"]["end_margin"]
    );
    // A reader that does not know levels gets the first.
    let again = ModelFile::read(&files[0]).unwrap();
    assert_same(&again.mesh, &model.mesh, "out");
    assert_eq!(
        again.looks().unwrap().materials,
        model.looks().unwrap().materials
    );
    let image = &again.looks().unwrap().images[0];
    assert_eq!(
        (image.kind.as_str(), &image.bytes),
        ("image/png", &one_texel())
    );
    let apart = folder.levels(&model, &levels, "each.glb", true);
    assert_eq!(
        names(&apart),
        ["each.lod0.glb", "each.lod1.glb", "each.meshes.toml"]
    );
    let second = ModelFile::read(&apart[1]).unwrap();
    assert_same(&second.mesh, &coarse, "each");
    judge(&[&files[0], &apart[0], &apart[1]]);
}

/// Where the real models are.
fn data() -> PathBuf {
    match std::env::var_os("LODC_DATA") {
        Some(path) => path.into(),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
    }
}

#[test]
fn real_models_keep_their_materials() {
    let folder = Folder::new("real");
    let mut written = Vec::new();
    for name in [
        "WaterBottle",
        "ToyCar",
        "SheenCloth",
        "FlightHelmet",
        "Suzanne",
    ] {
        let path = data().join(format!("{name}/{name}.gltf"));
        if !path.exists() {
            eprintln!("SKIPPED: there is no {}", path.display());
            continue;
        }
        let model = ModelFile::read(&path).unwrap();
        let coarse = coarser(&model.mesh);
        let levels =
            [(&model.mesh, 2.0), (&coarse, 8.0)].map(|(mesh, distance)| Level { mesh, distance });
        let file = folder
            .levels(&model, &levels, &format!("{name}.glb"), false)
            .swap_remove(0);
        let again = ModelFile::read(&file).unwrap();
        assert_same(&again.mesh, &model.mesh, name);
        let (before, after) = (model.looks().unwrap(), again.looks().unwrap());
        assert_eq!(before.materials, after.materials, "{name}");
        let bytes = |looks: &lodc::scene::mesh::write::Looks| -> Vec<usize> {
            looks.images.iter().map(|image| image.bytes.len()).collect()
        };
        assert_eq!(bytes(&before), bytes(&after), "{name}");
        written.push(file);
    }
    judge(&written.iter().collect::<Vec<_>>());
}

/// Shows files to the validator: its errors and warnings, one a line; nothing where it is not installed.
fn judged(files: &[&PathBuf]) -> Option<Vec<String>> {
    let judge = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gltf");
    let node = Command::new("node").arg("--version").output();
    if !judge.join("node_modules/gltf-validator").is_dir() || node.is_err() {
        let says = "Khronos' validator (npm package gltf-validator, and node) is missing; .ci/run installs it";
        assert!(std::env::var_os("CI").is_none(), "{says}");
        eprintln!("SKIPPED: {says}");
        return None;
    }
    let mut command = Command::new("node");
    command.arg(judge.join("check.mjs")).args(files);
    let output = command.output().expect("node starts");
    let says = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut lines: Vec<String> = says.lines().map(str::to_owned).collect();
    assert_eq!(
        lines.pop(),
        Some(format!("checked {}", files.len())),
        "the validator did not finish: {says}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    Some(lines)
}

/// Fails if the validator finds errors; what it warns of is printed.
fn judge(files: &[&PathBuf]) {
    for line in judged(files).into_iter().flatten() {
        assert!(!line.starts_with("error"), "{line}");
        eprintln!("{line}");
    }
}

#[test]
fn the_validator_finds_what_is_broken() {
    // An index beyond the vertices, which the writer would not write.
    let folder = Folder::new("judge");
    let model =
        ModelFile::read(&folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")).unwrap();
    let level = Level {
        mesh: &model.mesh,
        distance: 1.0,
    };
    let file = folder
        .levels(&model, &[level], "a.glb", false)
        .swap_remove(0);
    let mut bytes = fs::read(&file).unwrap();
    let at = bytes.len() - 4;
    assert_eq!(bytes[at..], [2, 0, 0, 0]);
    bytes[at] = 3;
    fs::write(&file, bytes).unwrap();
    if let Some(lines) = judged(&[&file]) {
        assert!(lines[0].contains("ACCESSOR_INDEX_OOB"), "{lines:?}");
    }
}

#[test]
fn generated_models_are_whole() {
    let folder = Folder::new("shapes");
    for (name, borders) in [("rock", 0), ("knot", 0), ("vase", 2)] {
        let mesh = shapes::shape(name, 5_000).unwrap();
        let count = mesh.indices.len() / 3;
        assert!(count.abs_diff(5_000) < 500, "{name}: {count}");
        assert_eq!(shapes::shape(name, 5_000).unwrap(), mesh, "{name}");
        // Each edge, by the places of its ends, has a triangle on both sides; a border is a ring of edges with one.
        let place = |v: u32| mesh.positions[v as usize].map(|x| (x + 0.0).to_bits());
        let mut edges = std::collections::BTreeMap::new();
        for triangle in mesh.indices.chunks_exact(3) {
            let corner = |i: usize| glam::Vec3::from(mesh.positions[triangle[i] as usize]);
            let face = (corner(1) - corner(0)).cross(corner(2) - corner(0));
            for i in 0..3 {
                let normal = mesh.normals[triangle[i] as usize];
                assert!(face.normalize().dot(normal.into()) > 0.3, "{name}");
                let ends = [place(triangle[i]), place(triangle[(i + 1) % 3])];
                let known = edges.entry([ends[0].min(ends[1]), ends[0].max(ends[1])]);
                *known.or_insert(0) += 1;
            }
        }
        let open = edges.values().filter(|sides| **sides == 1).count();
        assert!(edges.values().all(|sides| *sides <= 2), "{name}");
        assert_eq!(open, borders * 50, "{name}");
        let path = folder.0.join(format!("{name}.obj"));
        fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let model = ModelFile::read(&path).unwrap();
        let level = Level {
            mesh: &mesh,
            distance: 1.0,
        };
        let file = folder
            .levels(&model, &[level], &format!("{name}.glb"), false)
            .swap_remove(0);
        assert_same(&ModelFile::read(&file).unwrap().mesh, &mesh, name);
        judge(&[&file]);
    }
}

#[test]
fn levels_by_pictures_come_from_the_command_line() {
    let folder = Folder::new("pictures");
    let model = folder.write("knot.obj", obj(&shapes::shape("knot", 2000).unwrap()));
    let shader = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/clay.wgsl");
    let scene = fs::read_to_string(shader.with_extension("toml")).unwrap();
    let scene = folder.write("small.toml", format!("resolution = [64, 64]\n{scene}"));
    let output = folder.0.join("knot.lod.glb");
    let run = |rest: &[&str]| {
        let mut lodc = Command::new(env!("CARGO_BIN_EXE_lodc"));
        lodc.arg("mesh").arg(&model).arg("--shader").arg(&shader);
        lodc.arg("--scene")
            .arg(&scene)
            .args(["--views", "6"])
            .args(rest);
        let run = lodc.output().unwrap();
        let error = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{error}");
        String::from_utf8(run.stdout).unwrap()
    };
    let table = run(&["--image-error", "0.03,0.01", "-o", output.to_str().unwrap()]);
    // The columns: level, triangles, share, vertices, ...
    let triangles = |table: &str| -> Vec<usize> {
        let rows = table
            .lines()
            .map(|line| line.split_whitespace().collect::<Vec<_>>());
        let levels = rows.filter(|row| row.first().is_some_and(|f| f.parse::<u8>().is_ok()));
        levels.map(|row| row[1].parse().unwrap()).collect()
    };
    let found = triangles(&table);
    assert!(
        found.len() == 3 && found.is_sorted_by(|a, b| a > b),
        "{table}"
    );
    let read = ModelFile::read(&output).unwrap();
    assert_eq!(read.mesh.indices.len() / 3, found[0]);
    assert!(folder.0.join("knot.lod.meshes.toml").exists());
    // To a number of triangles, and for the distances of the scene.
    let found = triangles(&run(&["--triangles", "1200"]));
    assert!(found[1] <= 1200 && found[1] >= 1198, "{found:?}");
    let found = triangles(&run(&[]));
    assert!(
        found.len() > 3 && found.is_sorted_by(|a, b| a >= b),
        "{found:?}"
    );
}

/// A mesh as OBJ, with all that clay reads.
fn obj(mesh: &Mesh) -> String {
    let mut text = String::new();
    for [x, y, z] in &mesh.positions {
        text += &format!("v {x} {y} {z}\n");
    }
    for [x, y, z] in &mesh.normals {
        text += &format!("vn {x} {y} {z}\n");
    }
    for corners in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [corners[0] + 1, corners[1] + 1, corners[2] + 1];
        text += &format!("f {a}//{a} {b}//{b} {c}//{c}\n");
    }
    text
}
