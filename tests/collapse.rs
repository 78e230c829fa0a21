//! Textures that are made for levels: what they hold, which files they become, and Olano's own example.
#![cfg(feature = "search")]

mod fixtures;

use fixtures::Goldens;
use lodc::compile::{self, CompareRequest, Compared, Request, normal_form};
use lodc::emit::{self, EmitLevel, Form, Output, write_atomically};
use lodc::eval::generated::{GeneratedTextures, Store, TexelFormat};
use lodc::eval::lane::{LANES, Mask};
use lodc::eval::machine::{Bindings, Machine, Resource};
use lodc::eval::program::Program;
use lodc::eval::programs::Stand;
use lodc::eval::texture::{Dimension, Image, Sampler, Texture};
use lodc::front::Source;
use lodc::scene::Scene;
use lodc::search::{SampleSet, Samples};
use lodc_passes::texture_collapse::TextureCollapse;
use lodc_passes::{Candidate, Class, Pass, Shader, Stage, facts, recipe};
use naga::Binding;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What the main job wrote, against the original.
fn compared(original: Request, other: PathBuf) -> lodc::Result<Compared> {
    let asked = CompareRequest {
        original,
        other,
        ..CompareRequest::default()
    };
    compile::compare(&asked, &|| {})
}

#[test]
fn the_example_of_the_paper_becomes_one_constant_in_his_steps() {
    let folder = Path::new("testdata/derivations");
    let source = Source::read(&folder.join("silk.wgsl")).expect("it parses");
    let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
    let base = normal_form(&source).expect("it is small");
    let vertex = base.index(Stage::Vertex).expect("it has one");
    let vertex = Program::compile(base.module(), vertex, &[]).expect("it runs");
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let set = SampleSet::new(&stand, scene.farthest, Samples::Search).expect("it runs");
    let mut steps = vec![("the original".to_owned(), base.clone())];
    for (pass, choice) in [
        ("texture-collapse", "levels"),
        ("texture-removal", "seen-mean"),
        ("texture-collapse", "same"),
        ("texture-removal", "seen-mean"),
    ] {
        let (_, shader) = &steps[steps.len() - 1];
        let facts = set.facts(shader);
        let offered: Vec<Candidate> = (shader.passes().of_name(pass))
            .expect("it is known")
            .candidates(shader, &facts);
        // The sky goes before the cloth, which is all that is left in the end.
        let of_sky = |c: &&Candidate| !c.site.path().contains("silk") || steps.len() > 2;
        let mut wanted = offered.iter().filter(|c| c.choice.starts_with(choice));
        let candidate = match pass {
            "texture-removal" if steps.len() == 2 => wanted.find(|c| {
                let facts = facts.values.get(&c.site);
                facts.is_some() && c.site.path().contains("flowers") || {
                    let (_, value) = shader.find(&c.site).expect("it is there");
                    let users = shader.function(Stage::Fragment).expect("it has one");
                    matches!(&users.expressions[value], naga::Expression::ImageSample { coordinate, .. }
                        if matches!(users.expressions[*coordinate], naga::Expression::Math { .. }))
                }
            }),
            _ => wanted.find(of_sky),
        };
        let candidate = candidate.unwrap_or_else(|| panic!("{pass} {choice}: {offered:?}"));
        let made = recipe::apply(shader, candidate).expect("it was offered");
        made.validate().expect("it is valid");
        set.measure(&made).expect("it runs");
        steps.push((candidate.to_string(), made));
    }
    let mut golden = String::new();
    for (says, shader) in &steps {
        let level = EmitLevel {
            autolod: 1.0,
            shader: shader.clone(),
            distance: 1.0,
            error: 0.0,
            cost: 1.0,
            time: None,
            says: "a step".into(),
        };
        let files = Output {
            form: Form::Files,
            ..Output::default()
        };
        let files = emit::emit(&source, &base, &[level], files).expect("it can be written");
        let text = String::from_utf8(files[1].1.clone()).expect("WGSL is text");
        let kept = text.lines().filter(|line| line.starts_with("@group(1)"));
        let stage = text.find("@fragment").expect("it has a fragment stage");
        let _ = writeln!(golden, "# {says}");
        for line in kept {
            let _ = writeln!(golden, "{line}");
        }
        let _ = writeln!(golden, "\n{}", &text[stage..]);
    }
    let mut goldens = Goldens::of("collapse");
    goldens.compare("silk", &folder.join("silk.steps"), &golden);
    goldens.finish();
    assert_eq!(steps[4].1.sampled_textures(), 0);
}

/// Numbers that look random.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) % end
    }
}

/// An expression over the samples of three textures, as text.
fn expression(random: &mut Random, depth: u64) -> String {
    if depth == 0 || random.below(5) == 0 {
        return match random.below(4) {
            0 => format!(
                "vec4f(0.{}, 0.25, {}.0, 0.5)",
                random.below(10),
                random.below(3)
            ),
            texture => format!("textureSample(t{}, s, uv)", texture - 1),
        };
    }
    let a = expression(random, depth - 1);
    match random.below(9) {
        0 => format!("clamp({a}, vec4f(0.0), vec4f(1.0))"),
        1 => format!("abs({a} - 0.5)"),
        2 => format!("({a}).bgra"),
        3 => format!("sqrt(max({a}, vec4f(0.0)))"),
        4 => format!("vec4f(({a}).rgb * ({a}).g, 1.0)"),
        operation => {
            let b = expression(random, depth - 1);
            match operation {
                5 => format!("({a} * {b})"),
                6 => format!("({a} + 0.5 * {b})"),
                7 => format!("mix({a}, {b}, 0.25)"),
                _ => format!("max({a}, {b})"),
            }
        }
    }
}

/// What a fragment stage returns at coordinates, each in a quad of its own.
fn at(shader: &Shader, bindings: &Bindings, points: &[[f32; 2]]) -> Vec<[f32; 4]> {
    in_layer(0, shader, bindings, points)
}

/// The same with a number at location 1.
fn in_layer(
    layer: u32,
    shader: &Shader,
    bindings: &Bindings,
    points: &[[f32; 2]],
) -> Vec<[f32; 4]> {
    let entry = shader.index(Stage::Fragment).expect("it has one");
    let program = Program::compile(shader.module(), entry, &[]).expect("it runs");
    let mut machine = Machine::new(&program, bindings);
    let mut outputs = vec![[0; LANES]; program.outputs().len()];
    let mut found = Vec::new();
    for points in points.chunks(LANES / 4) {
        let inputs = program.inputs().iter().map(|slot| {
            std::array::from_fn(|lane| match slot.binding {
                Binding::Location { location: 1, .. } => layer,
                Binding::Location { .. } => {
                    let point = points[(lane / 4).min(points.len() - 1)];
                    point[slot.component].to_bits()
                }
                Binding::BuiltIn(_) => 0,
            })
        });
        let inputs: Vec<_> = inputs.collect();
        machine.run(&inputs, Mask::ALL, Mask::ALL, &mut outputs);
        for i in 0..points.len() {
            let mut texel = [0.0; 4];
            for (slot, words) in program.outputs().iter().zip(&outputs) {
                texel[slot.component] = f32::from_bits(words[4 * i]);
            }
            found.push(texel);
        }
    }
    found
}

/// A shader that returns an expression over three textures, with something added to it.
fn shader_of(expression: &str, added: &str) -> Shader {
    let text = format!(
        "@group(0) @binding(0) var t0: texture_2d<f32>;
         @group(0) @binding(1) var t1: texture_2d<f32>;
         @group(0) @binding(2) var t2: texture_2d<f32>;
         @group(0) @binding(3) var s: sampler;
         @fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {{
             return {expression}{added};
         }}"
    );
    let source = Source::parse("random.wgsl", text.as_str()).unwrap_or_else(|e| panic!("{e}"));
    normal_form(&source).expect("it is small")
}

/// Three random textures that are so large, and a sampler.
fn random_textures(edges: [u32; 3], sampler: Sampler) -> Bindings {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut bindings = Bindings::new();
    for (binding, edge) in (0..3).zip(edges) {
        let texels = (0..edge * edge).map(|_| [0; 4].map(|_| random.below(256) as f32 / 255.0));
        let image = Image {
            width: edge,
            height: edge,
            texels: texels.collect(),
        };
        let texture = Texture::new(Dimension::D2, vec![image]).expect("it has texels");
        let texture = Resource::Texture(Arc::new(texture.with_mip_chain()));
        bindings.insert((0, binding), texture);
    }
    bindings.insert((0, 3), Resource::Sampler(Arc::new(sampler)));
    bindings
}

/// The facts of three textures whose images are known, that are so large.
fn known_textures(edges: [u32; 3]) -> lodc_passes::Facts {
    let textures = ["t0", "t1", "t2"]
        .into_iter()
        .zip(edges)
        .map(|(name, edge)| {
            let known = facts::TextureFacts {
                size: [edge; 2],
                mean: vec![[0.5; 4]],
                ..facts::TextureFacts::default()
            };
            (name.to_owned(), known)
        });
    lodc_passes::Facts {
        textures: textures.collect(),
        repeating: ["s".to_owned()].into(),
        ..lodc_passes::Facts::default()
    }
}

/// How far a format may leave a component from what it was: half a step of eight bits, of the code where that is not the
/// number itself, or half a unit in the last place of a float of 16 bits; but for how precise the comparison itself is.
fn half_a_step(format: TexelFormat, component: usize, exact: f32, stored: f32) -> bool {
    let (exact, stored) = (f64::from(exact), f64::from(stored));
    let encoded = |x: f64| match x <= 0.003_130_8 {
        true => 12.92 * x,
        false => 1.055 * x.powf(1.0 / 2.4) - 0.055,
    };
    let (off, step) = match (format, component) {
        (TexelFormat::Rgba16Float, _) => {
            let exponent = exact.abs().max(2.0_f64.powi(-14)).log2().floor();
            (exact - stored, 2.0_f64.powf(exponent - 10.0))
        }
        (TexelFormat::Rgba8UnormSrgb, 0..3) => (encoded(exact) - encoded(stored), 1.0 / 255.0),
        _ => (exact - stored, 1.0 / 255.0),
    };
    off.abs() <= 0.5 * step + 1e-6
}

#[test]
fn collapsed_expressions_are_the_original_texel_for_texel() {
    let nearest = Sampler {
        linear_magnification: false,
        linear_minification: false,
        ..Sampler::default()
    };
    let mut formats = std::collections::BTreeSet::new();
    let mut collapsed = 0;
    for (seed, edges) in (0..160).zip([[16; 3], [16, 8, 4], [12, 7, 10]].into_iter().cycle()) {
        let bindings = random_textures(edges, nearest);
        let mut random = Random(seed * 77 + 1);
        // A sum, since of a swizzle what is swizzled is collapsed.
        let text = format!(
            "(0.875 * {} + 0.125 * textureSample(t0, s, uv))",
            expression(&mut random, 4)
        );
        let alone = shader_of(&text, "");
        let base = shader_of(&text, " + vec4f(uv, 0.0, 0.0)");
        for candidate in TextureCollapse.candidates(&base, &known_textures(edges)) {
            let variant = recipe::apply(&base, &candidate).expect("it was offered");
            variant
                .validate()
                .unwrap_or_else(|e| panic!("{candidate}: {e:?}\n{text}"));
            let accesses = |shader: &Shader| {
                let function = shader.function(Stage::Fragment).expect("it has one");
                let reads = function.expressions.iter();
                reads
                    .filter(|(_, e)| matches!(e, naga::Expression::ImageSample { .. }))
                    .count()
            };
            assert!(accesses(&variant) <= accesses(&base), "{candidate}\n{text}");
            let textures = GeneratedTextures::of(&variant).expect("it runs");
            let mut bound = bindings.clone();
            textures.bind(&mut bound, &Store::default());
            let baked = textures.baked(&bindings, &Store::default()).remove(0);
            formats.insert(baked.format);
            let [width, height, _] = baked.texture.size(0);
            let centres = (0..width * height).map(|i| {
                let [x, y] = [i % width, i / width].map(|x| x as f32 + 0.5);
                [x / width as f32, y / height as f32]
            });
            let centres: Vec<[f32; 2]> = centres.collect();
            // The texture is the original at the centre of each texel, rounded to the nearest that the format has; and the
            // variant does nothing but read it.
            let exact = at(&alone, &bindings, &centres);
            let now = at(&variant, &bound, &centres);
            for (i, exact) in exact.into_iter().enumerate() {
                let stored = baked.texture.levels()[0].texels[i];
                assert_eq!(stored, baked.format.rounded(exact), "{candidate}\n{text}");
                for c in 0..4 {
                    assert!(
                        half_a_step(baked.format, c, exact[c], stored[c]),
                        "{candidate}: {exact:?} {stored:?} {:?}\n{text}",
                        baked.format
                    );
                    let added = [centres[i][0], centres[i][1], 0.0, 0.0];
                    assert_eq!(now[i][c], stored[c] + added[c], "{candidate}\n{text}");
                }
            }
            if TextureCollapse.class(&candidate) == Class::Lossless {
                assert!(
                    baked.is_chain || baked.format == TexelFormat::Rgba16Float,
                    "{candidate}\n{text}"
                );
            }
            collapsed += 1;
        }
    }
    assert!(collapsed > 80, "{collapsed}");
    assert_eq!(formats.len(), 3, "{formats:?}");
}

#[test]
fn arrays_are_the_original_texel_for_texel_in_each_layer() {
    const EDGE: u32 = 8;
    const LAYERS: u32 = 3;
    let source = "
        @group(0) @binding(0) var t0: texture_2d_array<f32>;
        @group(0) @binding(1) var t1: texture_2d_array<f32>;
        @group(0) @binding(2) var t2: texture_2d<f32>;
        @group(0) @binding(3) var s: sampler;
        @fragment fn fs(@location(0) uv: vec2f, @location(1) @interpolate(flat) layer: i32) -> @location(0) vec4f {
            let tiles = textureSample(t0, s, uv, layer) * textureSample(t1, s, uv, layer);
            return tiles * textureSample(t2, s, uv) + 0.25 * textureSample(t1, s, uv, 2);
        }";
    let source = Source::parse("arrays.wgsl", source).unwrap_or_else(|e| panic!("{e}"));
    let base = normal_form(&source).expect("it is small");
    let mut random = Random(99);
    let mut bindings = random_textures([EDGE; 3], Sampler::default());
    for binding in 0..2 {
        let images = (0..LAYERS).map(|_| Image {
            width: EDGE,
            height: EDGE,
            texels: (0..EDGE * EDGE)
                .map(|_| [0; 4].map(|_| random.below(256) as f32 / 255.0))
                .collect(),
        });
        let texture = Texture::new(Dimension::D2, images.collect()).expect("it has texels");
        let texture = Resource::Texture(Arc::new(texture.with_mip_chain()));
        bindings.insert((0, binding), texture);
    }
    let offered = TextureCollapse.candidates(&base, &known_textures([EDGE; 3]));
    let candidate = offered.iter().find(|c| c.choice.contains("fs.layer"));
    let candidate = candidate.unwrap_or_else(|| panic!("{offered:?}"));
    let variant = recipe::apply(&base, candidate).expect("it was offered");
    variant.validate().unwrap_or_else(|e| panic!("{e:?}"));
    let textures = GeneratedTextures::of(&variant).expect("it runs");
    let baked = textures.baked(&bindings, &Store::default()).remove(0);
    assert_eq!((baked.texture.layers(), baked.is_chain), (LAYERS, false));
    let (extension, bytes) = baked.file().expect("it can be written");
    let read = lodc::eval::generated::read("made.ktx2", &bytes).expect("it was written");
    assert_eq!((extension, &read), ("ktx2", &*baked.texture));
    let mut bound = bindings.clone();
    textures.bind(&mut bound, &Store::default());
    let centres =
        (0..EDGE * EDGE).map(|i| [i % EDGE, i / EDGE].map(|x| (x as f32 + 0.5) / EDGE as f32));
    let centres: Vec<[f32; 2]> = centres.collect();
    // One below and one behind the last are clamped in both.
    for layer in [0, 1, 2, 7, u32::MAX] {
        let exact = in_layer(layer, &base, &bindings, &centres).into_iter();
        let exact: Vec<[f32; 4]> = exact.map(|exact| baked.format.rounded(exact)).collect();
        assert_eq!(
            in_layer(layer, &variant, &bound, &centres),
            exact,
            "{layer}"
        );
    }
}

#[test]
fn linear_expressions_are_the_original_between_texels_too() {
    let mut random = Random(7);
    let bindings = random_textures([16; 3], Sampler::default());
    let points: Vec<[f32; 2]> = (0..512)
        .map(|_| [0; 2].map(|_| random.below(4096) as f32 / 1024.0 - 2.0))
        .collect();
    let mut collapsed = 0;
    for seed in 0..300 {
        let text = expression(&mut Random(seed * 91 + 5), 2);
        // Every other one between two MIP levels.
        let text = match seed % 2 {
            0 => text,
            _ => text
                .replace("textureSample", "textureSampleLevel")
                .replace("s, uv)", "s, uv, 1.25)"),
        };
        let base = shader_of(&text, "");
        for candidate in TextureCollapse.candidates(&base, &known_textures([16; 3])) {
            if TextureCollapse.class(&candidate) != Class::Lossless {
                continue;
            }
            let variant = recipe::apply(&base, &candidate).expect("it was offered");
            let textures = GeneratedTextures::of(&variant).expect("it runs");
            let baked = textures.baked(&bindings, &Store::default()).remove(0);
            let mut bound = bindings.clone();
            textures.bind(&mut bound, &Store::default());
            // What a filter mixes is off by what its texels are off by at most. Where a code is of light, bright texels are off
            // by the most.
            let most = |x: f32, c: usize| match (baked.format, c) {
                (TexelFormat::Rgba16Float, _) => x / 2048.0,
                (TexelFormat::Rgba8UnormSrgb, 0..3) => 0.5 / 255.0 * 2.4 / 1.055,
                _ => 0.5 / 255.0,
            };
            let texels = baked.texture.levels()[0].texels.iter().flatten();
            let largest = texels.fold(0.0_f32, |most, x| most.max(x.abs()));
            let pairs = at(&base, &bindings, &points)
                .into_iter()
                .zip(at(&variant, &bound, &points));
            for (original, now) in pairs {
                for c in 0..4 {
                    let off = (original[c] - now[c]).abs();
                    assert!(
                        off <= most(largest, c) + 4e-6 * largest,
                        "{candidate}: {original:?} {now:?} {:?}\n{text}",
                        baked.format
                    );
                }
            }
            collapsed += 1;
        }
    }
    assert!(collapsed > 20, "{collapsed}");
}

#[test]
fn what_is_written_of_random_expressions_has_the_errors_that_are_reported() {
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/textures");
    let image = |name: &str| textures.join(name).with_extension("png");
    let scene = format!(
        "object = \"plane\"\nresolution = [48, 48]\nlevels = 3\nviews = {{ directions = [[0, 0.4, 1]] }}
         [distance]\nnearest = 2.5\nfarthest = 20
         [uniforms]\ncamera = \"model-view-projection\"
         [textures]\nt0 = {:?}\nt1 = {:?}\nt2 = {{ file = {:?}, space = \"linear\" }}\n",
        image("hide_albedo"),
        image("grime"),
        image("diffuse_lut")
    );
    let mut made = 0;
    for seed in 0..12 {
        let folder = folder(&format!("random-{seed}"));
        let text = format!(
            "@group(0) @binding(0) var t0: texture_2d<f32>;
             @group(0) @binding(1) var t1: texture_2d<f32>;
             @group(0) @binding(2) var t2: texture_2d<f32>;
             @group(0) @binding(3) var s: sampler;
             @group(0) @binding(4) var<uniform> camera: mat4x4f;
             struct Surface {{ @builtin(position) clip: vec4f, @location(0) uv: vec2f }}
             @vertex fn vs(@location(0) position: vec3f, @location(2) uv: vec2f) -> Surface {{
                 return Surface(camera * vec4f(position, 1.0), uv);
             }}
             @fragment fn fs(in: Surface) -> @location(0) vec4f {{
                 let uv = in.uv;
                 return vec4f(({}).rgb + 0.5 * ({}).rgb, 1.0);
             }}",
            expression(&mut Random(seed * 131 + 3), 3),
            expression(&mut Random(seed * 57 + 11), 2)
        );
        fs::write(folder.join("random.wgsl"), &text).expect("it can be written");
        fs::write(folder.join("random.toml"), &scene).expect("it can be written");
        let request = Request {
            shader: folder.join("random.wgsl"),
            textures: true,
            ..Request::default()
        };
        let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
        write_atomically(&compiled.files).expect("they can be written");
        if compiled.report.levels.len() < 2 {
            continue;
        }
        made += compiled
            .files
            .iter()
            .filter(|(file, _)| file.starts_with(folder.join("random.lod")))
            .count();
        let compared = compared(request, folder.join("random.lod.wgsl"));
        let compared = compared.unwrap_or_else(|e| panic!("{e}\n{text}"));
        for level in &compiled.report.levels {
            let mut at = compared.comparison.distances.iter();
            let at = at.find(|at| at.distance == level.distance);
            let at = at.expect("every level starts at a distance of the scene");
            let off = (at.error.rmse - level.error.rmse).abs();
            assert!(off < 1e-6, "{} {}\n{text}", at.error.rmse, level.error.rmse);
            let (excess, bound) = (level.error.excess, level.error.bound);
            assert!(excess <= bound, "{excess} {bound}\n{text}");
        }
    }
    assert!(made >= 3, "{made}");
}

/// `lodc check` sees texels, and not how a file has them.
#[cfg(feature = "testing")]
fn checked_by_texels(request: &Request, textures: &[(PathBuf, Vec<u8>)]) {
    let differences = || {
        let check = compile::check(request).unwrap_or_else(|error| panic!("{error}"));
        check.differences
    };
    assert_eq!(differences(), []);
    let (path, bytes) = textures.first().expect("there is a texture");
    // What stands behind its end is no part of an image.
    let longer = [bytes.as_slice(), b"more"].concat();
    fs::write(path, longer).expect("it can be written");
    assert_eq!(differences(), []);
    fs::write(path, &bytes[..bytes.len() / 2]).expect("it can be written");
    assert_eq!(differences().len(), 1);
    let grey = lodc::eval::image::encode_png(4, 4, &[[128; 4]; 16]).expect("it is an image");
    fs::write(path, grey).expect("it can be written");
    let found = differences();
    assert!(found[0].what.contains("4 x 4 texels"), "{}", found[0].what);
    fs::remove_file(path).expect("it is there");
    let found = differences();
    assert!(found[0].what.ends_with("is missing\n"), "{}", found[0].what);
    assert_eq!(found[0].bytes.as_ref(), Some(bytes));
    fs::write(path, bytes).expect("it can be written");
    assert_eq!(differences(), []);
}

/// A folder of the test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("collapse")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

/// The same of a host that binds no textures that are made for levels.
fn refused_request(request: &Request) -> Request {
    Request {
        textures: false,
        ..request.clone()
    }
}

#[test]
fn textures_become_files_that_the_lock_makes_again() {
    let folder = folder("files");
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/textures");
    let shader = fs::read_to_string("testdata/derivations/silk.wgsl").expect("it is there");
    let scene = fs::read_to_string("testdata/derivations/silk.toml").expect("it is there");
    let scene = scene.replace("../materials/textures", &textures.to_string_lossy());
    fs::write(folder.join("silk.wgsl"), shader).expect("it can be written");
    fs::write(folder.join("silk.toml"), scene).expect("it can be written");
    let request = Request {
        shader: folder.join("silk.wgsl"),
        textures: true,
        ..Request::default()
    };
    let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
    let made = |files: &compile::Files| -> Vec<(PathBuf, Vec<u8>)> {
        let all = files.iter();
        let mut made: Vec<_> = all
            .filter(|(path, _)| path.starts_with(folder.join("silk.lod")))
            .cloned()
            .collect();
        made.sort();
        made
    };
    let before = made(&compiled.files);
    assert!(
        !before.is_empty(),
        "{:?}",
        compiled.files.iter().map(|(f, _)| f).collect::<Vec<_>>()
    );
    // A host that binds none, or has no memory for them, gets none, and is told what they would gain.
    let refused = [
        // A limit on none is no permission.
        Request {
            max_texture_memory: Some(32),
            ..refused_request(&request)
        },
        Request {
            max_texture_memory: Some(0),
            ..request.clone()
        },
    ];
    let refused = refused.map(|request| {
        let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(made(&compiled.files), []);
        compiled.report
    });
    let limited = |report: &lodc::report::Report| {
        let mut warnings = report.warnings.iter();
        warnings.any(|warning| warning.contains("none may be made"))
    };
    assert_eq!(refused.each_ref().map(limited), [true, false]);
    let gains = |report: &lodc::report::Report| -> Vec<Option<f64>> {
        let levels = report.levels.iter();
        levels.map(|level| level.cost.ratio_with_textures).collect()
    };
    assert!(
        gains(&refused[0]).iter().any(Option::is_some),
        "{:?}",
        gains(&refused[0])
    );
    let inspected = compile::inspect(&refused_request(&request)).unwrap_or_else(|e| panic!("{e}"));
    assert!(inspected.contains("texture-collapse*"), "{inspected}");
    write_atomically(&compiled.files).expect("they can be written");
    let (files, warnings) = compile::locked(&request).unwrap_or_else(|e| panic!("{e}"));
    assert!(warnings.is_empty());
    assert_eq!(made(&files), before);
    for (file, bytes) in &files {
        assert_eq!(
            &fs::read(file).expect("it was written"),
            bytes,
            "{}",
            file.display()
        );
    }
    let text = fs::read_to_string(folder.join("silk.lod.wgsl")).expect("it was written");
    for (file, _) in &before {
        let name = file.file_stem().expect("it has one").to_string_lossy();
        assert!(
            text.contains(&format!("var {name}: texture_2d<f32>;")),
            "{text}"
        );
    }
    // What is emitted draws what was measured, with the textures that were written.
    let compared = compared(request.clone(), folder.join("silk.lod.wgsl"));
    let compared = compared.unwrap_or_else(|e| panic!("{e}"));
    assert!(compared.warnings.is_empty(), "{:?}", compared.warnings);
    for level in &compiled.report.levels {
        let mut at = compared.comparison.distances.iter();
        let at = at.find(|at| at.distance == level.distance);
        let at = at.expect("every level starts at a distance of the scene");
        let off = (at.error.rmse - level.error.rmse).abs();
        assert!(off < 1e-6, "{} {}", at.error.rmse, level.error.rmse);
    }
    #[cfg(feature = "gpu")]
    drawn_by_a_gpu(&request, &compared.comparison);
    #[cfg(feature = "testing")]
    checked_by_texels(&request, &before);
    // Another image in the place of a source makes another texture.
    let lock = fs::read_to_string(folder.join("silk.lod.toml")).expect("it was written");
    let other = lock.replace("loctx_0", "loctx_7");
    fs::write(folder.join("silk.lod.toml"), other).expect("it can be written");
    let error = compile::locked(&request).expect_err("it is another");
    assert!(error.message.contains("is not what it was"), "{error}");
}

#[test]
fn arrays_become_files_of_all_their_layers() {
    let folder = folder("arrays");
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/textures");
    let layers = |names: [&str; 3]| {
        let paths = names.map(|name| format!("{:?}", textures.join(name).with_extension("png")));
        paths.join(", ")
    };
    let shader = "
        @group(0) @binding(0) var<uniform> camera: mat4x4f;
        @group(0) @binding(1) var smooth_sampler: sampler;
        @group(0) @binding(2) var tiles: texture_2d_array<f32>;
        @group(0) @binding(3) var shades: texture_2d_array<f32>;
        struct Surface { @builtin(position) clip: vec4f, @location(0) uv: vec2f }
        @vertex fn vs(@location(0) position: vec3f, @location(2) uv: vec2f) -> Surface {
            return Surface(camera * vec4f(position, 1.0), uv);
        }
        @fragment fn fs(in: Surface) -> @location(0) vec4f {
            let tile = u32(3.0 * in.uv.y);
            let tinted = textureSample(tiles, smooth_sampler, in.uv, tile) * textureSample(shades, smooth_sampler, in.uv, tile);
            return vec4f(sqrt(tinted.rgb), 1.0);
        }";
    let scene = format!(
        "object = \"plane\"\nresolution = [48, 48]\nlevels = 3\nviews = {{ directions = [[0, 0.4, 1]] }}
         [distance]\nnearest = 2.5\nfarthest = 20
         [uniforms]\ncamera = \"model-view-projection\"
         [textures]\ntiles = {{ layers = [{}] }}\nshades = {{ layers = [{}] }}\n",
        layers(["hide_albedo", "cliff_albedo", "grass_albedo"]),
        layers(["grime", "rock_albedo", "panel_albedo"])
    );
    fs::write(folder.join("tiles.wgsl"), shader).expect("it can be written");
    fs::write(folder.join("tiles.toml"), scene).expect("it can be written");
    let request = Request {
        shader: folder.join("tiles.wgsl"),
        textures: true,
        ..Request::default()
    };
    let compiled = compile::compile(&request, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
    write_atomically(&compiled.files).expect("they can be written");
    let made = &compiled.report.generated;
    assert!(
        matches!(&made[..], [made] if made.layers == Some(3) && made.file.ends_with(".ktx2")),
        "{made:?}"
    );
    let (files, _) = compile::locked(&request).unwrap_or_else(|e| panic!("{e}"));
    for (file, bytes) in &files {
        assert_eq!(
            &fs::read(file).expect("it was written"),
            bytes,
            "{}",
            file.display()
        );
    }
    let compared = compared(request.clone(), folder.join("tiles.lod.wgsl"));
    let compared = compared.unwrap_or_else(|e| panic!("{e}"));
    for level in &compiled.report.levels {
        let mut at = compared.comparison.distances.iter();
        let at = at.find(|at| at.distance == level.distance);
        let off = at.expect("a level starts there").error.rmse - level.error.rmse;
        assert!(off.abs() < 1e-6, "{off}");
    }
    #[cfg(feature = "gpu")]
    drawn_by_a_gpu(&request, &compared.comparison);
}

/// Holds a device's figures of the emitted shader, with its textures, against the evaluator's.
#[cfg(feature = "gpu")]
fn drawn_by_a_gpu(request: &Request, by_evaluator: &lodc::report::Comparison) {
    match lodc::gpu::Gpu::open(None) {
        Ok(_) => {}
        Err(error) if std::env::var_os("CI").is_some() => panic!("{error}"),
        Err(error) => {
            eprintln!("SKIPPED: generated textures on a GPU: {error}");
            return;
        }
    }
    let compared = compile::compare(
        &CompareRequest {
            original: request.clone(),
            other: request.shader.with_extension("lod.wgsl"),
            renderer: compile::DrawnBy::Gpu { adapter: None },
            ..CompareRequest::default()
        },
        &|| {},
    );
    let compared = compared.unwrap_or_else(|e| panic!("{e}"));
    let pairs = by_evaluator
        .distances
        .iter()
        .zip(&compared.comparison.distances);
    for (cpu, gpu) in pairs {
        let (at, cpu, gpu) = (cpu.distance, cpu.error.rmse, gpu.error.rmse);
        println!("at {at:.2}: error {cpu:.5} by evaluator, {gpu:.5} by GPU");
        assert!((cpu - gpu).abs() <= (0.05 * cpu).max(0.001), "{cpu} {gpu}");
    }
}

/// Noise over a plane, and what reads a texture beside it.
const NOISE: &str = "
    @group(0) @binding(0) var<uniform> camera: mat4x4f;
    @group(0) @binding(1) var smooth_sampler: sampler;
    @group(0) @binding(2) var paper: texture_2d<f32>;
    struct Surface { @builtin(position) clip: vec4f, @location(0) uv: vec2f }
    @vertex fn vs(@location(0) position: vec3f, @location(2) uv: vec2f) -> Surface {
        return Surface(camera * vec4f(position, 1.0), uv);
    }
    fn waves(p: vec2f) -> f32 {
        var sum = 0.0;
        for (var i = 1; i < 6; i++) {
            sum += sin(p.x * 11.0 * f32(i)) * cos(p.y * 13.0 * f32(i)) / f32(i);
        }
        return sum;
    }
    @fragment fn fs(in: Surface) -> @location(0) vec4f {
        let marble = 0.5 + 0.2 * waves(in.uv + 0.1 * waves(in.uv.yx));
        let grain = textureSample(paper, smooth_sampler, in.uv).g;
        return vec4f(marble, marble * marble, 0.25 + 0.25 * grain, 1.0);
    }";

#[test]
fn the_error_of_a_procedural_bake_falls_with_its_resolution() {
    let source = Source::parse("noise.wgsl", NOISE).unwrap_or_else(|e| panic!("{e}"));
    let paper = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials/textures/grime.png");
    let scene = "object = \"plane\"\nresolution = [128, 128]\nlevels = 3\n[distance]\nnearest = 2.5\nfarthest = 20\n[views]\ndirections = [[0, 0, 1]]\n[uniforms]\ncamera = \"model-view-projection\"\n";
    let scene = format!("{scene}[textures]\npaper = {paper:?}\n");
    let scene = Scene::resolve(&source, Some((Path::new("noise.toml"), &scene)));
    let scene = scene.unwrap_or_else(|e| panic!("{e}"));
    let base = normal_form(&source).expect("it is small");
    let vertex = base.index(Stage::Vertex).expect("it has one");
    let vertex = Program::compile(base.module(), vertex, &[]).expect("it runs");
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let set = SampleSet::new(&stand, scene.nearest, Samples::Full).expect("it runs");
    let offered = TextureCollapse.candidates(&base, &set.facts(&base));
    let bake = offered.iter().find(|c| c.choice.starts_with("bake"));
    let bake = bake.unwrap_or_else(|| panic!("{offered:?}"));
    let (kind, _) = bake.choice.rsplit_once(' ').expect("it has an edge");
    let floor = set.original().error.square();
    let mut before = f64::INFINITY;
    println!("edge  added squared error, by {bake}");
    for edge in [8, 16, 32, 64, 128, 256] {
        let candidate = Candidate {
            choice: format!("{kind} {edge}"),
            ..bake.clone()
        };
        let variant = recipe::apply(&base, &candidate).expect("it applies");
        let measured = set.measure(&variant).expect("it runs");
        let added = measured.error.square() - floor;
        println!("{edge:4}  {added:.2e}");
        assert!(
            added < 0.5 * before || added < 1e-5,
            "{edge}: {added} after {before}"
        );
        before = added;
        // One sample takes the place of the rounds of two loops.
        assert_eq!(measured.used.work.samples, 2.0);
        assert!(measured.used.work.operations() < 0.2 * set.original().used.work.operations());
    }
    assert!(before < 1e-5, "{before}");
}
