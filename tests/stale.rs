//! `lodc::Compiler` with a lock that is missing or stale and levels that are searched instead, and the files that were made for
//! levels, which it copies.
#![cfg(feature = "search")]

mod numbered;
mod synthetic;

use lodc::compile::{self, Request};
use lodc::emit::write_atomically;
use lodc::front::hash;
use lodc::{Built, Compiler, Stale};
use std::fs;
use std::path::{Path, PathBuf};

const RINGS: &str = "
    @fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
        var rings = 0.0;
        for (var i = 1; i < 9; i++) { rings += sin(uv.x * 40.0 * f32(i)) / f32(i * i); }
        return vec4f(0.4 + 0.1 * rings, 0.5, uv.y, 1.0);
    }";

const SCENE: &str =
    "resolution = [32, 32]\nlevels = 3\noffsets = 1\n[distance]\nnearest = 2.0\nfarthest = 40.0\n";

/// An empty folder of a test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("stale")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

fn read(file: &Path) -> Vec<u8> {
    fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

/// Builds into `out` beside the shader.
fn build(shader: &Path, stale: Stale) -> lodc::Result<Built> {
    let out = shader.with_file_name("out");
    Compiler::new(shader).output(out).stale(stale).build()
}

#[test]
fn levels_are_searched_once_and_again_when_the_shader_changes() {
    let folder = folder("search");
    let (shader, lock) = (folder.join("rings.wgsl"), folder.join("out/rings.lod.toml"));
    fs::write(&shader, RINGS).expect("it can be written");
    fs::write(folder.join("rings.toml"), SCENE).expect("it can be written");
    assert!(build(&shader, Stale::Error).is_err());
    let searched = || {
        let built = build(&shader, Stale::Search).unwrap_or_else(|error| panic!("{error}"));
        assert!(!built.is_original);
        let warned = built.warnings.iter().map(|warning| &warning.message);
        let warned: Vec<_> = warned.collect();
        assert!(
            matches!(&warned[..], [one] if one.ends_with("levels are searched in the meantime")),
            "{warned:?}"
        );
        // What it wrote itself is no reason to run again; what it would replay is.
        assert!(built.read.contains(&shader), "{:?}", built.read);
        assert!(built.read.contains(&folder.join("rings.lod.toml")));
        assert!(
            built
                .read
                .iter()
                .all(|file| !file.starts_with(folder.join("out")))
        );
        let module = String::from_utf8(read(&built.module)).expect("it is text");
        assert!(!module.contains("pub const THRESHOLDS: &[f32] = &[];"));
        read(&lock)
    };
    let first = searched();
    assert!(!folder.join("rings.lod.toml").exists());
    // A lock that fits is used, whatever else it says.
    let marked = String::from_utf8(first.clone()).expect("it is text") + "\n# Kept.\n";
    fs::write(&lock, &marked).expect("it can be written");
    assert_eq!(searched(), marked.as_bytes());
    fs::write(&shader, format!("// A comment.{RINGS}")).expect("it can be written");
    assert_eq!(searched(), marked.as_bytes());
    fs::write(&shader, RINGS.replace("40.0", "30.0")).expect("it can be written");
    let other = searched();
    assert!(other != first && other != marked.as_bytes());
    // Once it is committed, beside the shader, there is nothing to say.
    let other = String::from_utf8(other)
        .expect("it is text")
        .replace("../", "");
    fs::write(folder.join("rings.lod.toml"), other).expect("it can be written");
    let built = build(&shader, Stale::Search).unwrap_or_else(|error| panic!("{error}"));
    assert!(built.warnings.is_empty(), "{:?}", built.warnings);
}

#[test]
fn meshes_are_copied_when_they_are_what_they_were() {
    let folder = folder("meshes");
    let shader = numbered::write(&folder, 0);
    let lock = folder.join("m0.lod.toml");
    let text = String::from_utf8(read(&lock)).expect("it is text");
    let meshes = format!(
        "meshes = {{ file = 'm0.lod/m0.glb', hash = '{}' }}\n\nseed = 1",
        hash(b"meshes")
    );
    assert!(text.contains("seed = 1"), "{text}");
    fs::write(&lock, text.replacen("seed = 1", &meshes, 1)).expect("it can be written");
    let file = folder.join("m0.lod/m0.glb");
    let missing = build(&shader, Stale::Error).expect_err("it is not there");
    assert!(missing.message.contains("m0.glb"), "{missing}");
    fs::create_dir_all(folder.join("m0.lod")).expect("it can be made");
    fs::write(&file, "others").expect("it can be written");
    let other = build(&shader, Stale::Error).expect_err("it is another");
    assert!(other.message.contains("is not what it was"), "{other}");
    assert!(!folder.join("out").exists());
    fs::write(&file, "meshes").expect("it can be written");
    let built = build(&shader, Stale::Error).unwrap_or_else(|error| panic!("{error}"));
    let copy = folder.join("out/m0.lod/m0.glb");
    assert_eq!(built.assets, [copy.as_path()]);
    assert_eq!(read(&copy), b"meshes");
    assert!(built.read.contains(&file), "{:?}", built.read);
    let module = String::from_utf8(read(&built.module)).expect("it is text");
    assert!(
        module.contains("MESH_FILE: Option<&str> = Some(\"m0.lod/m0.glb\")"),
        "{module}"
    );
}

#[test]
fn textures_are_copied_when_they_are_what_they_were() {
    let folder = folder("textures");
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/textures");
    let image = |name: &str| format!("{:?}", textures.join(name));
    let shader = folder.join("tiles.wgsl");
    let text = "
        @group(0) @binding(0) var<uniform> camera: mat4x4f;
        @group(0) @binding(1) var smooth_sampler: sampler;
        @group(0) @binding(2) var tiles: texture_2d<f32>;
        @group(0) @binding(3) var shades: texture_2d<f32>;
        struct Surface { @builtin(position) clip: vec4f, @location(0) uv: vec2f }
        @vertex fn vs(@location(0) position: vec3f, @location(2) uv: vec2f) -> Surface {
            return Surface(camera * vec4f(position, 1.0), uv);
        }
        @fragment fn fs(in: Surface) -> @location(0) vec4f {
            let tinted = textureSample(tiles, smooth_sampler, in.uv) * textureSample(shades, smooth_sampler, in.uv);
            return vec4f(sqrt(tinted.rgb), 1.0);
        }";
    let scene = format!(
        "object = \"plane\"\nresolution = [48, 48]\nlevels = 3\nviews = {{ directions = [[0, 0.4, 1]] }}
         [distance]\nnearest = 2.5\nfarthest = 20
         [uniforms]\ncamera = \"model-view-projection\"
         [textures]\ntiles = {}\nshades = {}\n",
        image("hide_albedo.png"),
        image("grime.png")
    );
    fs::write(&shader, text).expect("it can be written");
    fs::write(folder.join("tiles.toml"), scene).expect("it can be written");
    let request = Request {
        shader: shader.clone(),
        textures: true,
        ..Request::default()
    };
    let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|error| panic!("{error}"));
    write_atomically(&compiled.files).expect("they can be written");
    let of_levels = folder.join("tiles.lod");
    let made = compiled.files.iter().map(|(file, _)| file);
    let made: Vec<_> = made.filter(|file| file.starts_with(&of_levels)).collect();
    assert!(!made.is_empty());
    let built = build(&shader, Stale::Error).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(built.assets.len(), made.len());
    let module = String::from_utf8(read(&built.module)).expect("it is text");
    for file in &made {
        let name = file.strip_prefix(&folder).expect("it is there");
        let copy = folder.join("out").join(name);
        assert!(built.assets.contains(&copy), "{:?}", built.assets);
        assert_eq!(read(&copy), read(file));
        assert!(built.read.contains(file), "{:?}", built.read);
        assert!(
            module.contains(&format!("file: {:?}", name.display().to_string())),
            "{module}"
        );
    }
    let mut other = read(made[0]);
    *other.last_mut().expect("it is not empty") ^= 1;
    fs::write(made[0], other).expect("it can be written");
    assert!(build(&shader, Stale::Error).is_err());
    fs::remove_file(made[0]).expect("it is there");
    assert!(build(&shader, Stale::Error).is_err());
}
