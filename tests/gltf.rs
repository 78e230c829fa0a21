//! Models as scene objects, and the scene files that `lodc init` writes for them: a small glTF made here with numbers
//! worked out by hand, files that are damaged, and real models where they are present (`LODC_DATA`, or
//! `../shared/data`).
#![cfg(feature = "cli")]

mod fixtures;

use lodc::compile::{InitRequest, init, normal_form};
use lodc::eval::draw::{Blend, DrawState, draw};
use lodc::eval::image::{encode_png, srgb_byte};
use lodc::eval::machine::Resource;
use lodc::eval::program::Program;
use lodc::eval::raster::{Attribute, Frame};
use lodc::front::Source;
use lodc::scene::Scene;
use lodc::scene::objects::bounding_sphere;
use lodc_passes::Stage;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder of its own, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lodc-gltf-{name}-{}", std::process::id()));
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

    /// Reads a model with no shader that wants anything of it.
    fn model(&self, name: &str) -> Result<Scene, String> {
        self.scene(PLAIN, &format!("object = \"{name}\"\n"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

const PLAIN: &str = "
    struct Camera { view_proj: mat4x4f }
    @group(0) @binding(0) var<uniform> camera: Camera;
    @vertex fn vs(@location(0) position: vec3f) -> @builtin(position) vec4f {
        return camera.view_proj * vec4f(position, 1.0);
    }
    @fragment fn fs() -> @location(0) vec4f { return vec4f(1.0); }";

/// Base colour with its factor, emission without one, and everything that a vertex has.
const SHADER: &str = "
    struct Camera { view_proj: mat4x4f }
    struct Material { base_color_factor: vec4f, metallic_factor: f32 }
    @group(0) @binding(0) var<uniform> camera: Camera;
    @group(1) @binding(0) var<uniform> material: Material;
    @group(1) @binding(1) var surface_sampler: sampler;
    @group(1) @binding(2) var base_color_texture: texture_2d<f32>;
    @group(1) @binding(3) var emissive_texture: texture_2d<f32>;
    struct V {
        @builtin(position) clip: vec4f,
        @location(0) uv: vec2f,
        @location(1) rest: vec4f,
    }
    @vertex fn vs(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) tangent: vec4f,
                  @location(3) uv: vec2f, @location(4) uv1: vec2f, @location(5) color: vec4f) -> V {
        return V(camera.view_proj * vec4f(position, 1.0), uv, tangent + vec4f(uv1, normal.xy) * color);
    }
    @fragment fn fs(v: V) -> @location(0) vec4f {
        let base = textureSample(base_color_texture, surface_sampler, v.uv) * material.base_color_factor;
        let glow = textureSample(emissive_texture, surface_sampler, v.uv);
        let colour = base.rgb + glow.rgb + vec3f(material.metallic_factor * 0.0);
        return vec4f(colour, base.a) + v.rest * 0.0;
    }";

fn bytes_of(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A square over -1..1 in x and y that faces +z, with two sets of texture coordinates, and an image of one texel,
/// 255, 128, 0.
///
/// Positions at 0, normals at 48, coordinates at 96 and 128, indices at 160, image at 172.
fn buffer() -> Vec<u8> {
    let corners = [[-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]];
    let mut bytes = Vec::new();
    for [x, y] in corners {
        bytes.extend(bytes_of(&[x, y, 0.0]));
    }
    bytes.extend(bytes_of(&[0.0, 0.0, 1.0].repeat(4)));
    for [x, y] in corners {
        bytes.extend(bytes_of(&[0.5 + 0.5 * x, 0.5 - 0.5 * y]));
    }
    for [x, y] in corners {
        bytes.extend(bytes_of(&[0.25 * x, 0.25 * y]));
    }
    for index in [0_u16, 1, 2, 0, 2, 3] {
        bytes.extend(index.to_le_bytes());
    }
    bytes.extend(encode_png(1, 1, &[[255, 128, 0, 255]]).unwrap());
    bytes
}

/// The square twice: moved and widened, and, below that node, mirrored in x and nearer by one.
fn json() -> String {
    let buffer = buffer();
    let length = buffer.len();
    format!(
        r#"{{ "asset": {{ "version": "2.0" }},
  "scene": 0, "scenes": [{{ "nodes": [0] }}],
  "nodes": [
    {{ "mesh": 0, "translation": [2, 0, 0], "scale": [2, 1, 1], "children": [1] }},
    {{ "mesh": 1, "translation": [0, 0, 1], "scale": [-1, 1, 1] }} ],
  "meshes": [
    {{ "name": "back", "primitives": [{{ "attributes": {ATTRIBUTES}, "indices": 4, "material": 0 }}] }},
    {{ "name": "front", "primitives": [{{ "attributes": {ATTRIBUTES}, "indices": 4, "material": 1 }}] }} ],
  "materials": [
    {{ "name": "Painted", "pbrMetallicRoughness": {{ "baseColorFactor": [0.5, 1, 1, 1], "metallicFactor": 0.25,
       "baseColorTexture": {{ "index": 0 }} }} }},
    {{ "name": "Glass", "pbrMetallicRoughness": {{ "baseColorFactor": [0, 0, 1, 0.25] }},
       "emissiveFactor": [1, 0.5, 0], "alphaMode": "BLEND" }} ],
  "textures": [{{ "source": 0, "sampler": 0 }}],
  "samplers": [{{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }}],
  "images": [{{ "bufferView": 5, "mimeType": "image/png" }}],
  "accessors": [
    {{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0] }},
    {{ "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3" }},
    {{ "bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2" }},
    {{ "bufferView": 3, "componentType": 5126, "count": 4, "type": "VEC2" }},
    {{ "bufferView": 4, "componentType": 5123, "count": 6, "type": "SCALAR" }} ],
  "bufferViews": [
    {{ "buffer": 0, "byteOffset": 0, "byteLength": 48 }},
    {{ "buffer": 0, "byteOffset": 48, "byteLength": 48 }},
    {{ "buffer": 0, "byteOffset": 96, "byteLength": 32 }},
    {{ "buffer": 0, "byteOffset": 128, "byteLength": 32 }},
    {{ "buffer": 0, "byteOffset": 160, "byteLength": 12 }},
    {{ "buffer": 0, "byteOffset": 172, "byteLength": {image} }} ],
  "buffers": [{{ "uri": "a.bin", "byteLength": {length} }}] }}"#,
        image = length - 172,
    )
}

const ATTRIBUTES: &str = r#"{ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TEXCOORD_1": 3 }"#;

/// A GLB of some JSON, whose buffer has no URI then, and a chunk.
fn glb(json: &str, chunk: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let (json, chunk) = (padded(json.as_bytes(), b' '), padded(chunk, 0));
    let word = |n: usize| (n as u32).to_le_bytes();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(word(2));
    bytes.extend(word(28 + json.len() + chunk.len()));
    bytes.extend(word(json.len()));
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend(word(chunk.len()));
    bytes.extend(b"BIN\0");
    bytes.extend(chunk);
    bytes
}

fn per_draw(frame: &Frame, slot: (u32, u32)) -> &[Resource] {
    match &frame.bindings[&slot] {
        Resource::PerDraw(all) => all,
        one => std::slice::from_ref(one),
    }
}

const SCENE: &str =
    "object = \"a.gltf\"\nresolution = [64, 64]\n[views]\ndirections = [[0, 0, 1], [0, 0, -1]]\n";

#[test]
fn two_primitives_are_one_mesh_with_a_draw_for_each_material() {
    let folder = Folder::new("two");
    folder.write("a.gltf", json());
    folder.write("a.bin", buffer());
    let scene = folder.scene(SHADER, SCENE).unwrap();
    let mesh = &scene.mesh;
    // Two draws of four vertices and two triangles; the mirrored one is wound the other way.
    let ranges: Vec<_> = mesh
        .draws
        .iter()
        .map(|d| (d.vertices.clone(), d.triangles.clone()))
        .collect();
    assert_eq!(ranges, [(0..4, 0..2), (4..8, 2..4)]);
    // Its vertices are in the order in which its triangles name them, since its tangents were made.
    assert_eq!(mesh.indices, [0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 7, 5]);
    // x becomes 2 x + 2, and 2 (-x) + 2 in the child, which is also nearer.
    assert_eq!(mesh.positions[0], [0.0, 1.0, 0.0]);
    assert_eq!(mesh.positions[2], [4.0, -1.0, 0.0]);
    assert_eq!(mesh.positions[4], [4.0, 1.0, 1.0]);
    assert_eq!(mesh.positions[5], [0.0, -1.0, 1.0]);
    assert_eq!(mesh.normals, vec![[0.0, 0.0, 1.0]; 8]);
    // Tangents along u: mirrored in the child, with the bitangent at the top of the image in both.
    assert_eq!(mesh.tangents[..4], [[1.0, 0.0, 0.0, 1.0]; 4]);
    assert_eq!(mesh.tangents[4..], [[-1.0, 0.0, 0.0, -1.0]; 4]);
    assert_eq!(mesh.uvs[2], [1.0, 1.0]);
    assert_eq!(mesh.second_uvs[2], [0.25, -0.25]);
    assert_eq!(mesh.colours, vec![[1.0; 4]; 8]);
    // A box of 4 x 2 x 1.
    let sphere = bounding_sphere(mesh);
    assert_eq!(sphere.centre.to_array(), [2.0, 0.0, 0.5]);
    assert!((sphere.radius - 5.25f64.sqrt()).abs() < 1e-12);

    let frame = &scene.frames(scene.nearest)[0];
    assert_eq!(frame.attributes[&3], Attribute::Uv);
    assert_eq!(frame.attributes[&4], Attribute::SecondUv);
    // Factors by draw: base colour, metallic.
    let factors: Vec<Vec<f32>> = per_draw(frame, (1, 0))
        .iter()
        .map(|resource| match resource {
            Resource::Buffer(bytes) => bytes
                .chunks_exact(4)
                .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
                .collect(),
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(factors[0][..5], [0.5, 1.0, 1.0, 1.0, 0.25]);
    assert_eq!(factors[1][..5], [0.0, 0.0, 1.0, 0.25, 1.0]);
    // Textures by draw: what is missing is white, and for emission, whose factor the shader has no place for, the
    // factor itself: black, and orange.
    let texel = |slot, draw: usize| match &per_draw(frame, slot)[draw] {
        Resource::Texture(texture) => texture.levels()[0].texels[0],
        other => panic!("{other:?}"),
    };
    let image = [1.0, srgb_byte(128), 0.0, 1.0];
    assert_eq!(texel((1, 2), 0), image);
    assert_eq!(texel((1, 2), 1), [1.0; 4]);
    assert_eq!(texel((1, 3), 0), [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(texel((1, 3), 1), [1.0, 0.5, 0.0, 1.0]);
    match per_draw(frame, (1, 1)) {
        [Resource::Sampler(first), Resource::Sampler(second)] => {
            use lodc::eval::texture::Wrap;
            assert_eq!(first.wrap[..2], [Wrap::ClampToEdge, Wrap::MirrorRepeat]);
            assert!(!first.linear_magnification && first.linear_minification);
            assert_eq!(second.wrap[..2], [Wrap::Repeat, Wrap::Repeat]);
        }
        other => panic!("{other:?}"),
    }
    let told: Vec<String> = scene
        .inferences
        .iter()
        .filter(|i| i.table == "textures")
        .map(|i| format!("{}: {}", i.line_to_add, i.as_))
        .collect();
    assert_eq!(
        told,
        [
            "base_color_texture = { role = \"base-colour\" }: base-colour (white for `Glass`)",
            "emissive_texture = { role = \"emissive\" }: emissive (1, 0.5, 0 for `Glass`; black for `Painted`)",
        ]
    );
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let glass = DrawState {
        blend: Blend::Alpha,
        front_only: true,
    };
    assert_eq!(scene.states[..], [DrawState::default(), glass]);
    let files: Vec<&str> = scene.inputs.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(files[2..], ["a.gltf", "a.bin"]);
    // An embedded image is in the buffer's file: that is what the lock hashes.
    assert_eq!(scene.textures[0].files, ["a.bin"]);

    // From the front the second draw is over the first, a quarter of it; from behind the first hides the second, which
    // has no back besides.
    let source = Source::parse("a.wgsl", SHADER).unwrap();
    let base = normal_form(&source).unwrap();
    let program = |stage| Program::compile(base.module(), base.index(stage).unwrap(), &[]).unwrap();
    let (vertex, fragment) = (program(Stage::Vertex), program(Stage::Fragment));
    for (frame, expected) in scene.frames(10.0).iter().zip([
        [0.25 + 0.75 * 0.5, 0.125 + 0.75 * srgb_byte(128), 0.25, 1.0],
        [0.5, srgb_byte(128), 0.0, 1.0],
    ]) {
        let (picture, _) = draw(&vertex, &fragment, frame);
        let middle = picture.pixels[32 * 64 + 32];
        for (got, expected) in middle.iter().zip(expected) {
            assert!((got - expected).abs() < 1e-6, "{middle:?} {expected:?}");
        }
    }
}

#[test]
fn glb_and_data_uris_hold_the_same_model() {
    let folder = Folder::new("same");
    folder.write("a.gltf", json());
    folder.write("a.bin", buffer());
    let apart = folder.model("a.gltf").unwrap();
    folder.write(
        "b.glb",
        glb(&json().replace("\"uri\": \"a.bin\", ", ""), &buffer()),
    );
    let whole = folder.model("b.glb").unwrap();
    assert_eq!(apart.mesh, whole.mesh);
    let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let base64: String = buffer()
        .chunks(3)
        .flat_map(|three| {
            let bits = (0..3).fold(0u32, |b, i| b << 8 | u32::from(*three.get(i).unwrap_or(&0)));
            (0..4).map(move |i| match i <= three.len() {
                true => char::from(letters[(bits >> (18 - 6 * i) & 63) as usize]),
                false => '=',
            })
        })
        .collect();
    let uri = format!("data:application/octet-stream;base64,{base64}");
    folder.write("c.gltf", json().replace("a.bin", &uri));
    assert_eq!(apart.mesh, folder.model("c.gltf").unwrap().mesh);
    // An image inside a GLB is in that file.
    let scene = folder.scene(SHADER, "object = \"b.glb\"\n").unwrap();
    assert_eq!(scene.textures[0].files, ["b.glb"]);
}

#[test]
fn what_a_file_leaves_out_is_made() {
    let folder = Folder::new("bare");
    folder.write("a.bin", buffer());
    // Without normals triangles are flat, and share no vertices.
    let bare = json().replace("\"NORMAL\": 1, ", "");
    folder.write("a.gltf", bare);
    let scene = folder.scene(SHADER, "object = \"a.gltf\"\n").unwrap();
    assert_eq!(scene.mesh.positions.len(), 12);
    assert_eq!(scene.mesh.normals, vec![[0.0, 0.0, 1.0]; 12]);
    assert_eq!(scene.mesh.tangents[0], [1.0, 0.0, 0.0, 1.0]);
    // Without indices the vertices are the corners: the first three of four.
    folder.write("a.gltf", json().replace("\"indices\": 4, ", ""));
    assert_eq!(folder.model("a.gltf").unwrap().mesh.indices.len(), 6);
    // A strip and a fan of six corners have four triangles each.
    let strip = json().replacen("\"indices\": 4,", "\"indices\": 4, \"mode\": 5,", 1);
    folder.write("a.gltf", strip.replace("\"mode\": 5", "\"mode\": 6"));
    let mesh = folder.model("a.gltf").unwrap().mesh.clone();
    assert_eq!(mesh.indices[..12], [0, 1, 2, 0, 2, 0, 0, 0, 2, 0, 2, 3]);
    folder.write("a.gltf", strip);
    let mesh = folder.model("a.gltf").unwrap().mesh.clone();
    assert_eq!(mesh.indices[..12], [0, 1, 2, 1, 0, 2, 2, 0, 2, 0, 3, 2]);
    // Lines are left out, with a warning.
    let lines = json().replacen("\"indices\": 4,", "\"indices\": 4, \"mode\": 1,", 1);
    folder.write("a.gltf", lines);
    let scene = folder.model("a.gltf").unwrap();
    assert_eq!(scene.mesh.indices.len(), 6);
    assert!(scene.warnings[0].message.contains("points or lines"));
    // A normal without a direction gets that of its triangles, which are mirrored in the second node.
    let mut zero = buffer();
    zero[48..60].fill(0);
    folder.write("a.bin", zero);
    folder.write("a.gltf", json());
    let scene = folder.model("a.gltf").unwrap();
    assert!(scene.warnings[0].message.starts_with("2 normals"));
    assert_eq!(scene.mesh.normals, vec![[0.0, 0.0, 1.0]; 8]);
}

#[test]
fn transforms_of_textures_are_in_the_coordinates() {
    let folder = Folder::new("transform");
    folder.write("a.bin", buffer());
    let moved = "\"baseColorTexture\": { \"index\": 0, \"extensions\": { \"KHR_texture_transform\": \
                 { \"scale\": [3, -2], \"offset\": [0.5, 0] } } }";
    let json = json().replace("\"baseColorTexture\": { \"index\": 0 }", moved);
    folder.write("a.gltf", &json);
    let mesh = folder.model("a.gltf").unwrap().mesh.clone();
    assert_eq!(mesh.uvs[2], [3.5, -2.0]);
    assert_eq!(mesh.uvs[6], [1.0, 1.0]);
    // A texture of the same material that is not moved is warned of.
    let both = json.replacen(
        "} } } } }",
        "} } } }, \"normalTexture\": { \"index\": 0 } }",
        1,
    );
    folder.write("a.gltf", both);
    let scene = folder.model("a.gltf").unwrap();
    assert!(
        scene.warnings[0]
            .message
            .contains("different texture coordinates"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn damaged_models_are_refused_with_the_reason() {
    let folder = Folder::new("damaged");
    folder.write("a.bin", buffer());
    fs::create_dir(folder.0.join("folder.glb")).unwrap();
    let whole = json();
    let with = |from: &str, to: &str| {
        assert!(whole.contains(from), "{from}");
        whole.replacen(from, to, 1)
    };
    for (json, reason) in [
        (
            with("\"count\": 4", "\"count\": 4000000000"),
            "its positions has 4000000000 entries",
        ),
        (
            with("\"count\": 4", "\"count\": 5000000"),
            "its positions reaches beyond its buffer",
        ),
        (
            with("\"byteLength\": 48", "\"byteLength\": 18446744073709551615"),
            "its positions reaches beyond its buffer",
        ),
        (
            with("\"count\": 4", "\"count\": 2"),
            "an index is 2, and there are 2 vertices",
        ),
        (
            with(
                "\"bufferView\": 4, \"componentType\": 5123",
                "\"bufferView\": 4, \"componentType\": 5126",
            ),
            "its indices are no whole numbers",
        ),
        (
            with("\"NORMAL\": 1", "\"NORMAL\": 2"),
            "its normals has 2 numbers an entry instead of 3",
        ),
        (
            with("\"POSITION\": 0, ", ""),
            "`POSITION`|it has no positions|it is no valid glTF 2.0",
        ),
        (
            with(
                "\"translation\": [2, 0, 0]",
                "\"translation\": [1e38, 0, 0], \"rotation\": [1e38, 1e38, 1e38, 1e38]",
            ),
            "is no finite number",
        ),
        (
            with("\"children\": [1]", "\"children\": [1, 0]"),
            "has two parents",
        ),
        (
            with("\"children\": [1]", "\"children\": [7]"),
            "it is no valid glTF 2.0",
        ),
        (
            with("\"nodes\": [0] }", "\"nodes\": [] }"),
            "it has no triangles",
        ),
        (
            with("\"scale\": [2, 1, 1]", "\"scale\": [0, 0, 0]"),
            "are in one place",
        ),
        (
            with("\"uri\": \"a.bin\"", "\"uri\": \"b.bin\""),
            "there is no buffer `b.bin`",
        ),
        (
            with("\"uri\": \"a.bin\"", "\"uri\": \"data:;base64,!!\""),
            "no base64",
        ),
        (with("\"uri\": \"a.bin\", ", ""), "no chunk of bytes"),
        (
            with(
                "\"uri\": \"a.bin\", \"byteLength\": ",
                "\"uri\": \"a.bin\", \"byteLength\": 9",
            ),
            "bytes instead of 9",
        ),
        (
            with(
                "\"scene\": 0",
                "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"scene\": 0",
            ),
            "without mesh compression",
        ),
        (
            with("\"POSITION\": 0", "\"POSITION\": 9"),
            "the positions of mesh 0, primitive 0 are in no accessor",
        ),
        ("{".to_owned(), "its JSON is broken"),
        ("[]".to_owned(), "its JSON is no object"),
        (String::new(), "its JSON is broken"),
    ] {
        folder.write("a.gltf", &json);
        let error = folder.model("a.gltf").expect_err(reason);
        assert!(
            reason.split('|').any(|reason| error.contains(reason)),
            "{reason}: {error}"
        );
        assert!(error.contains("help:"), "{error}");
        assert!(error.contains("a.toml:1:10"), "{error}");
    }
    let mut nan = buffer();
    nan[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    folder.write("a.bin", nan);
    folder.write("a.gltf", &whole);
    let error = folder.model("a.gltf").unwrap_err();
    assert!(
        error.contains("the position of vertex 0 is no finite number"),
        "{error}"
    );
    let error = folder.model("folder.glb").unwrap_err();
    assert!(
        error.contains("the model `folder.glb` is a folder"),
        "{error}"
    );
    let error = folder.model("helmet.glb").unwrap_err();
    assert!(error.contains("there is no model `helmet.glb`"), "{error}");
    // A length that is not that of what follows: of the JSON, of the chunk.
    let glb = glb(&whole.replace("\"uri\": \"a.bin\", ", ""), &buffer());
    let json_end = 20 + u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    for (at, length) in [(12, 4), (12, u32::MAX), (json_end, 4), (json_end, u32::MAX)] {
        let mut wrong = glb.clone();
        wrong[at..at + 4].copy_from_slice(&length.to_le_bytes());
        folder.write("wrong.glb", &wrong);
        let error = folder.model("wrong.glb").unwrap_err();
        let reasons = [
            "is cut off or damaged",
            "its JSON is broken",
            "4 bytes instead of",
        ];
        assert!(
            reasons.iter().any(|reason| error.contains(reason)),
            "{error}"
        );
    }
    // A GLB that is cut off anywhere.
    for end in (0..glb.len()).step_by(97) {
        folder.write("cut.glb", &glb[..end]);
        assert!(folder.model("cut.glb").is_err(), "{end}");
    }
}

/// Bytes of a valid GLB changed by chance: no panic, and bounded memory. A failure names the round, and comes again.
#[test]
fn damaged_glb_files_are_refused_or_read() {
    let folder = Folder::new("chance");
    let whole = glb(&json().replace("\"uri\": \"a.bin\", ", ""), &buffer());
    for round in 0..1500u64 {
        let mut state = (round + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut below = |end: usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as usize % end.max(1)
        };
        let mut damaged = whole.clone();
        for _ in 0..=below(4) {
            let at = below(damaged.len());
            match below(3) {
                // Numbers are most of what may go wrong.
                0 => {
                    let digits = damaged.iter().enumerate();
                    let digits: Vec<usize> = digits
                        .filter(|(_, byte)| byte.is_ascii_digit())
                        .map(|(at, _)| at)
                        .collect();
                    damaged[digits[below(digits.len())]] = b"0123456789"[below(10)];
                }
                1 => damaged[at] = b" {}[]\",:-.e9"[below(12)],
                _ => damaged[at] = below(256) as u8,
            }
        }
        let path = folder.write("a.glb", &damaged);
        let read = std::panic::catch_unwind(|| lodc::compile::ModelFile::read(&path));
        match read.unwrap_or_else(|_| panic!("it panics in round {round}")) {
            Err(error) => assert!(!error.message.is_empty()),
            Ok(model) => {
                let mesh = &model.mesh;
                let count = mesh.positions.len();
                assert!(count <= damaged.len(), "round {round}: {count}");
                assert!(mesh.indices.iter().all(|i| (*i as usize) < count));
            }
        }
    }
}

#[test]
fn images_of_models_are_bounded_and_named() {
    let folder = Folder::new("images");
    folder.write("a.bin", buffer());
    let image = |uri: &str| {
        let json = json();
        let at = json.find("\"images\": [").unwrap();
        let end = at + json[at..].find(']').unwrap();
        let image = format!("\"images\": [{{ \"uri\": \"{uri}\" }}");
        folder.write("a.gltf", format!("{}{image}{}", &json[..at], &json[end..]));
        folder.scene(SHADER, SCENE).map(|_| ()).unwrap_err()
    };
    let error = image("skin.png");
    assert!(error.contains("there is no image `skin.png`"), "{error}");
    folder.write("skin.ktx2", b"\xabKTX 20\xbb\r\n\x1a\n");
    let error = image("skin.ktx2");
    assert!(error.contains("it is a KTX texture"), "{error}");
    assert!(error.contains("convert this one"), "{error}");
    // A size bomb: a header that says 60,000 x 60,000 pixels.
    let mut bomb = encode_png(1, 1, &[[0; 4]]).unwrap();
    bomb[16..20].copy_from_slice(&60_000u32.to_be_bytes());
    bomb[20..24].copy_from_slice(&60_000u32.to_be_bytes());
    let crc = crc32(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&crc.to_be_bytes());
    folder.write("bomb.png", &bomb);
    let error = image("bomb.png");
    assert!(error.contains("60000 x 60000"), "{error}");
}

#[test]
fn what_many_entries_share_takes_its_memory_once() {
    let folder = Folder::new("shared");
    // A mebibyte that 4,000 images are in: 4 GiB, if each had its own.
    let entry = "{ \"bufferView\": 0, \"mimeType\": \"image/png\" }";
    let images = vec![entry; 4_000].join(",");
    let triangle = bytes_of(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let mut chunk = encode_png(1, 1, &[[255; 4]]).unwrap();
    chunk.resize(1 << 20, 0);
    chunk.extend(triangle);
    let json = |images: &str, nodes: &str, accessor: &str| {
        format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "images": [{images}],
            "buffers": [{{ "byteLength": {length} }}],
            "bufferViews": [{{ "buffer": 0, "byteLength": 1048576 }}, {{ "buffer": 0, "byteOffset": 1048576, "byteLength": 36 }}],
            "accessors": [{{ {accessor}, "componentType": 5126, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }} }}] }}],
            "nodes": [{nodes}] }}"#,
            length = (1 << 20) + 36,
        )
    };
    let place = "\"bufferView\": 1, \"count\": 3";
    let whole = json(&images, "{ \"mesh\": 0 }", place);
    let path = folder.write("a.glb", glb(&whole, &chunk));
    let model = lodc::compile::ModelFile::read(&path).unwrap();
    let error = model.looks().unwrap_err().to_string();
    assert!(error.contains("more than 1024 MiB together"), "{error}");
    // A thousand nodes with millions of vertices each, of three numbers in the file, and no triangle.
    let nodes = vec!["{ \"mesh\": 0 }"; 1_000].join(",");
    let sparse = "\"count\": 3500000, \"sparse\": { \"count\": 1, \"values\": { \"bufferView\": 1 }, \
                  \"indices\": { \"bufferView\": 1, \"componentType\": 5125 } }";
    let points = json(entry, &nodes, sparse)
        .replace(
            "\"POSITION\": 0 }",
            "\"POSITION\": 0, \"NORMAL\": 0 }, \"indices\": 1",
        )
        .replace(
            "\"max\": [1, 1, 0] }]",
            "\"max\": [1, 1, 0] }, { \"bufferView\": 1, \"count\": 1, \"componentType\": 5125, \"type\": \"SCALAR\" }]",
        );
    folder.write("b.glb", glb(&points, &chunk));
    let error = folder.model("b.glb").unwrap_err();
    assert!(error.contains("more than 6000000 vertices"), "{error}");
}

/// The checksum of a PNG chunk.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |mut c: u32| {
        for _ in 0..8 {
            c = if c & 1 == 1 {
                0xedb8_8320 ^ c >> 1
            } else {
                c >> 1
            };
        }
        c
    };
    !bytes.iter().fold(!0, |crc, byte| {
        let c = (crc ^ u32::from(*byte)) & 0xff;
        step(c) ^ crc >> 8
    })
}

#[test]
fn a_scene_may_name_roles_and_factors_itself() {
    let folder = Folder::new("roles");
    folder.write("a.gltf", json());
    folder.write("a.bin", buffer());
    let said = format!(
        "{SCENE}[uniforms]\n\"material.metallic_factor\" = \"roughness-factor\"\n\
         [textures]\nemissive_texture = {{ role = \"base-color\", space = \"linear\" }}\n"
    );
    let scene = folder.scene(SHADER, &said).unwrap();
    let frame = &scene.frames(scene.nearest)[0];
    match &per_draw(frame, (1, 3))[0] {
        Resource::Texture(texture) => {
            assert_eq!(texture.levels()[0].texels[0][1], 128.0 / 255.0);
        }
        other => panic!("{other:?}"),
    }
    for (line, reason) in [
        (
            "[textures]\nemissive_texture = { role = \"glitter\" }",
            "there is no role `glitter`",
        ),
        (
            "[textures]\nemissive_texture = { role = \"normal\", wrap = \"clamp\" }",
            "unknown key `wrap`",
        ),
        (
            "[uniforms]\n\"material.metallic_factor\" = \"base-colour-factor\"",
            "cannot be the base-colour-factor",
        ),
    ] {
        let error = folder
            .scene(SHADER, &format!("{SCENE}{line}\n"))
            .unwrap_err();
        assert!(error.contains(reason), "{error}");
    }
    // A built-in object has no materials.
    for (line, reason) in [
        (
            "[textures]\nemissive_texture = { role = \"emissive\" }",
            "the object has none",
        ),
        (
            "[uniforms]\n\"material.metallic_factor\" = \"metallic-factor\"",
            "the object has none",
        ),
    ] {
        let error = folder.scene(SHADER, &format!("{line}\n")).unwrap_err();
        assert!(
            error.contains(reason) && error.contains("name a model"),
            "{error}"
        );
    }
}

/// Whether two scenes draw the same pictures.
fn assert_same(one: &Scene, other: &Scene) {
    assert_eq!(one.mesh, other.mesh);
    assert_eq!(
        (one.model, one.sphere, one.resolution, one.fov, one.seed),
        (
            other.model,
            other.sphere,
            other.resolution,
            other.fov,
            other.seed
        )
    );
    assert_eq!(
        (one.e_max, one.q, &one.distances, one.nearest, one.farthest),
        (
            other.e_max,
            other.q,
            &other.distances,
            other.nearest,
            other.farthest
        )
    );
    assert_eq!(
        (one.output, &one.views, one.offsets),
        (other.output, &other.views, other.offsets)
    );
    assert_eq!(one.states, other.states);
    assert_eq!(one.uniforms, other.uniforms);
    assert_eq!(one.textures.len(), other.textures.len());
    for (a, b) in one.textures.iter().zip(&other.textures) {
        assert_eq!((&a.name, a.dynamic), (&b.name, b.dynamic));
        assert_eq!((&a.images, &a.files), (&b.images, &b.files));
    }
    for (a, b) in one
        .frames(one.nearest)
        .iter()
        .zip(other.frames(one.nearest))
    {
        assert_eq!(a.attributes, b.attributes);
        assert_eq!(
            format!("{:?}", a.bindings.keys()),
            format!("{:?}", b.bindings.keys())
        );
        for (slot, resource) in &a.bindings {
            if let Resource::Buffer(_) | Resource::Sampler(_) = resource {
                assert_eq!(format!("{resource:?}"), format!("{:?}", b.bindings[slot]));
            }
        }
    }
}

/// The file with its open lines filled in as they stand.
fn filled_in(text: &str) -> String {
    let lines = text.lines().map(|line| match line.strip_suffix("fill in") {
        Some(_) => line.trim_start_matches("# "),
        None => match line.ends_with("what feeds it") {
            true => line.trim_start_matches("# "),
            false => line,
        },
    });
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_scene_that_init_writes_reads_back_as_it_was() {
    let folder = Folder::new("init");
    let mut complete = 0;
    for shader in fixtures::complete() {
        let source = match Source::read(&shader) {
            Ok(source) => source,
            // Several entry points: nobody says which.
            Err(_) => continue,
        };
        let path = folder
            .0
            .join(shader.with_extension("toml").file_name().unwrap());
        let request = InitRequest {
            shader: shader.clone(),
            output: Some(path.clone()),
            ..InitRequest::default()
        };
        let bare = Scene::resolve(&source, None);
        let made = match init(&request) {
            Ok((files, made)) => {
                assert_eq!(files[0].0, path);
                made
            }
            // What no scene could help with.
            Err(_) => {
                assert!(bare.is_err(), "{}", shader.display());
                continue;
            }
        };
        let read = |text: &str| Scene::resolve(&source, Some((&path, text)));
        let dynamic = |scene: &Scene| scene.textures.iter().filter(|t| t.dynamic).count();
        match bare {
            Ok(bare) => {
                let again = read(&made.text).unwrap_or_else(|e| panic!("{e}\n{}", made.text));
                assert_same(&bare, &again);
                assert_eq!(made.missing.len(), dynamic(&bare), "{}", made.text);
                // What init said, the file says: nothing is inferred again but what it left open.
                assert!(again.inferences.is_empty(), "{:?}", again.inferences);
                complete += 1;
            }
            Err(error) => {
                let again = read(&made.text).expect_err("something is missing");
                assert_eq!(error.message, again.message);
                let whole = read(&filled_in(&made.text));
                let whole = whole.unwrap_or_else(|e| panic!("{e}\n{}", made.text));
                assert!(made.missing.len() > dynamic(&whole));
            }
        }
    }
    assert!(complete > 10, "{complete} shaders say all by themselves");

    // The same with a model: its materials fill in what is left.
    folder.write("a.gltf", json());
    folder.write("a.bin", buffer());
    let shader = folder.write("s.wgsl", SHADER);
    let source = Source::read(&shader).unwrap();
    let request = InitRequest {
        shader,
        mesh: Some(folder.0.join("a.gltf")),
        ..InitRequest::default()
    };
    let (files, made) = init(&request).unwrap();
    assert_eq!(files[0].0, folder.0.join("s.toml"));
    assert!(made.missing.is_empty(), "{:?}", made.missing);
    let read = |text: &str| Scene::resolve(&source, Some((&files[0].0, text))).unwrap();
    let again = read(&made.text);
    assert_same(&read("object = \"a.gltf\"\n"), &again);
    assert!(again.inferences.is_empty());
    for line in [
        "# blend = \"alpha\" # of 1 of 2 materials, as the model says; write it to say otherwise for all",
        "object = \"a.gltf\"                            # 4 triangles, 2 materials, a draw for each",
        "\"material.base_color_factor\" = \"base-colour-factor\" # vec4<f32>: each material's: 0.5, 1, 1, 1; 0, 0, 1, 0.25",
        "base_color_texture = { role = \"base-colour\" } # of the model's materials: base-colour (white for `Glass`)",
        "uv1 = \"uv1\"                                  # the second of its texture coordinates",
    ] {
        let plain = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            plain(&made.text).contains(&plain(line)),
            "{line}\n{}",
            made.text
        );
    }
    // It never writes over a file unless it is told to.
    fs::write(&files[0].0, "mine").unwrap();
    let error = init(&request).unwrap_err();
    assert!(error.message.ends_with("is there already"), "{error}");
    let forced = InitRequest {
        force: true,
        ..request.clone()
    };
    assert!(init(&forced).is_ok());
    let onto = InitRequest {
        output: Some(folder.0.join("a.gltf")),
        ..forced
    };
    let error = init(&onto).unwrap_err();
    assert!(
        error.message.contains("would overwrite the input"),
        "{error}"
    );
    let lost = InitRequest {
        mesh: Some(folder.0.join("b.gltf")),
        force: true,
        ..request
    };
    let error = init(&lost).unwrap_err().to_string();
    assert!(error.contains("there is no model `b.gltf`"), "{error}");
    assert!(!error.contains("s.toml"), "{error}");
}

/// Where the real models are.
fn data() -> PathBuf {
    match std::env::var_os("LODC_DATA") {
        Some(path) => path.into(),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
    }
}

/// Runs the tool and returns what it printed.
fn lodc(arguments: &[&str]) -> String {
    let run = Command::new(env!("CARGO_BIN_EXE_lodc"))
        .args(arguments)
        .output()
        .unwrap();
    let says = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{arguments:?}: {says}");
    String::from_utf8_lossy(&run.stdout).into_owned()
}

#[test]
fn real_models_go_from_init_to_levels() {
    let shader = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/testdata/materials/gltf_pbr.wgsl"
    );
    for (name, triangles, draws) in [
        ("WaterBottle", 4_510, 1),
        ("FlightHelmet", 94_722, 6),
        ("ToyCar", 108_936, 3),
    ] {
        let model = data().join(format!("{name}/{name}.gltf"));
        if !model.is_file() {
            eprintln!("SKIPPED: {} is not there", model.display());
            continue;
        }
        let folder = Folder::new(name);
        let scene = folder.0.join("scene.toml");
        let output = folder.0.join(format!("{name}.lod.wgsl"));
        let [scene_text, output_text, model_text] =
            [&scene, &output, &model].map(|path| path.to_str().unwrap());
        let said = lodc(&["init", shader, "--mesh", model_text, "-o", scene_text]);
        assert!(!said.contains("to fill in"), "{said}");
        // The scene is used as it is, but for smaller pictures, which only make the test quicker.
        let text = fs::read_to_string(&scene).unwrap();
        let small = text.replace("resolution = [256, 256]", "resolution = [48, 48]");
        let small = small
            .replace("levels = 5", "levels = 3")
            .replace("count = 6", "count = 1");
        assert_eq!(small.matches("resolution = [48, 48]").count(), 1);
        fs::write(&scene, small).unwrap();
        let source = Source::read(Path::new(shader)).unwrap();
        let read = Scene::read(&source, Some(&scene)).unwrap();
        assert_eq!(read.mesh.indices.len() / 3, triangles, "{name}");
        assert_eq!(read.mesh.draws.len(), draws, "{name}");
        assert!(read.textures.iter().all(|texture| !texture.dynamic));
        let table = lodc(&[shader, "--scene", scene_text, "-o", output_text]);
        let levels = fs::read_to_string(output.with_extension("toml")).unwrap();
        assert!(levels.matches("[[level]]").count() >= 1, "{name}:\n{table}");
    }
}
