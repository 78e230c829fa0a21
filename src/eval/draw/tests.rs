//! Resolving by hand-made fragments, and whole frames from WGSL.

use super::*;
use crate::eval::image::Image;
use crate::eval::lane::Mask;
use crate::eval::machine::{Probe, Resource};
use crate::eval::raster::Attribute;
use crate::eval::texture::{Dimension, Sampler, Texture};
use crate::scene::mesh::Mesh;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Three fragments of two pixels: two on the first, in lanes 0 and 4.
fn coverage(depths: [f32; 3]) -> Coverage {
    let mut block = Block {
        inputs: Vec::new(),
        active: Mask([0xff, 0, 0, 0]),
        covered: Mask([0b1_0011, 0, 0, 0]),
        pixels: [u32::MAX; LANES],
        depths: [0.0; LANES],
        draw: 0,
        first: 0,
        quads: Vec::new(),
        recall: None,
    };
    for ((lane, pixel), depth) in [(0, 0), (1, 1), (4, 0)].into_iter().zip(depths) {
        block.pixels[lane] = pixel;
        block.depths[lane] = depth;
    }
    Coverage {
        width: 2,
        height: 1,
        grid: 1,
        blocks: vec![block],
        fragments: 3,
        drawn: 3,
        slots: Vec::new(),
        late: true,
        states: Arc::default(),
        vertex_profile: Profile::default(),
    }
}

fn shading(alive: [bool; 3]) -> Shading {
    Shading {
        colours: vec![[1.0; 4], [2.0; 4], [3.0; 4]],
        alive: alive.to_vec(),
        ..Shading::default()
    }
}

#[test]
fn the_nearest_alive_fragment_is_shown() {
    let shown = |depths, alive| {
        let picture = resolve(&coverage(depths), &shading(alive));
        assert_eq!(picture.covered[0], f32::from(picture.pixels[0][0] > 0.0));
        [picture.pixels[0][0], picture.pixels[1][0]]
    };
    assert_eq!(shown([0.2, 0.2, 0.5], [true; 3]), [1.0, 2.0]);
    assert_eq!(shown([0.5, 0.2, 0.2], [true; 3]), [3.0, 2.0]);
    assert_eq!(shown([0.2, 0.2, 0.2], [true; 3]), [1.0, 2.0]);
    assert_eq!(shown([0.2, 0.2, 0.5], [false, true, true]), [3.0, 2.0]);
    assert_eq!(shown([0.2, 0.2, 0.5], [false, true, false]), [0.0, 2.0]);
}

#[test]
fn a_returned_depth_counts() {
    let coverage = coverage([0.2, 0.2, 0.5]);
    let mut shading = shading([true; 3]);
    shading.depths = vec![0.9, 1.0, 0.8];
    let picture = resolve(&coverage, &shading);
    assert_eq!((picture.pixels[0][0], picture.covered[1]), (3.0, 0.0));
    shading.depths = vec![0.9, -2.0, f32::NAN];
    let picture = resolve(&coverage, &shading);
    assert_eq!((picture.pixels[0][0], picture.pixels[1][0]), (3.0, 2.0));
}

#[test]
fn what_is_hidden_is_not_seen() {
    let seen = seen(&coverage([0.5, 0.2, 0.2]), &shading([true; 3]), |c| c);
    assert_eq!(seen.weights, None);
    let seen = seen.coverage;
    assert_eq!(seen.fragments, 2);
    let block = &seen.blocks[0];
    assert_eq!(block.covered, Mask([0b1_0010, 0, 0, 0]));
    assert_eq!(block.active, Mask([0xff, 0, 0, 0]));
    assert_eq!(block.pixels[..5], [u32::MAX, 1, u32::MAX, u32::MAX, 0]);
}

#[test]
fn profiles_add_up() {
    let profile = |min, max| Profile {
        lanes: 2,
        probes: vec![vec![Probe {
            count: 2,
            weight: 2.0,
            sum: f64::from(min + max),
            min,
            max,
        }]],
        ..Profile::default()
    };
    let both = merge(profile(1.0, 2.0), profile(-1.0, 1.5));
    let probe = both.probes[0][0];
    assert_eq!((both.lanes, probe.count, probe.sum), (4, 4, 3.5));
    assert_eq!((probe.min, probe.max), (-1.0, 2.0));
    for (a, b) in [(f32::NAN, 1.0), (1.0, f32::NAN)] {
        let probe = merge(profile(a, a), profile(b, b)).probes[0][0];
        assert!(probe.min.is_nan() && probe.max.is_nan());
    }
}

const SHADERS: &str = "
struct View { scale: vec4f }
struct Varyings {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) @interpolate(flat) index: u32,
}
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;

@vertex fn vertex(@location(0) position: vec3f, @location(3) uv: vec2f, @builtin(vertex_index) index: u32) -> Varyings {
    return Varyings(vec4f(position.xy * view.scale.xy, 0.5 * position.z, position.z), uv, index);
}
@fragment fn textured(in: Varyings) -> @location(0) vec4f {
    return textureSample(picture, bilinear, in.uv);
}
@fragment fn lattice(in: Varyings) -> @location(0) vec4f {
    if fract(in.position.x * 0.25) < 0.5 { discard; }
    return vec4f(in.position.xyz, f32(in.index));
}
@fragment fn slopes(@location(0) uv: vec2f) -> @location(0) vec4f {
    return vec4f(dpdx(uv), dpdy(uv));
}
struct Deep { @location(0) colour: vec3f, @builtin(frag_depth) depth: f32 }
@fragment fn deep(in: Varyings) -> Deep {
    return Deep(vec3f(f32(in.index)), select(0.75, 0.25, in.index == 4u));
}
";

fn program(entry: &str) -> Program {
    program_of(SHADERS, entry)
}

/// An entry point of a text, compiled.
pub(super) fn program_of(shaders: &str, entry: &str) -> Program {
    let module = naga::front::wgsl::parse_str(shaders).unwrap();
    naga::valid::Validator::new(Default::default(), naga::valid::Capabilities::all())
        .validate(&module)
        .unwrap();
    let entry = module.entry_points.iter().position(|e| e.name == entry);
    Program::compile(&module, entry.unwrap(), &[]).unwrap()
}

/// A square over the whole picture whose depth (and w) goes from `near` at the bottom to `far` at the top, with
/// texture coordinates 0..1 from the top left. Corners are on the screen's, whatever their w.
fn square(near: f32, far: f32) -> Mesh {
    let corner = |x: f32, y: f32, w: f32| [x * w, y * w, w];
    Mesh {
        positions: vec![
            corner(-1.0, 1.0, far),
            corner(-1.0, -1.0, near),
            corner(1.0, -1.0, near),
            corner(1.0, 1.0, far),
        ],
        uvs: vec![[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    }
}

fn frame(mesh: Mesh, size: u32, image: Image) -> Frame {
    let buffer = [1.0_f32, 1.0, 0.0, 0.0].map(f32::to_le_bytes);
    let texture = Texture::new(Dimension::D2, vec![image]).unwrap();
    let bindings = [
        Resource::Buffer(Arc::new(buffer.as_flattened().to_vec())),
        Resource::Texture(Arc::new(texture.with_mip_chain())),
        Resource::Sampler(Arc::new(Sampler::default())),
    ];
    Frame {
        mesh: Arc::new(mesh),
        attributes: BTreeMap::from([(0, Attribute::Position), (3, Attribute::Uv)]),
        bindings: (0..).map(|i| (0, i)).zip(bindings).collect(),
        width: size,
        height: size,
        offset: [0.0; 2],
        grid: 1,
        states: Arc::default(),
        shot: Default::default(),
        baked: Default::default(),
    }
}

fn image(size: u32, texel: impl Fn(u32, u32) -> [f32; 4]) -> Image {
    let texels = (0..size * size).map(|i| texel(i % size, i / size));
    Image {
        width: size,
        height: size,
        texels: texels.collect(),
    }
}

#[test]
fn a_textured_square_shows_its_image() {
    let image = image(8, |x, y| [x as f32, y as f32, (x * y) as f32, 1.0]);
    let frame = frame(square(1.0, 1.0), 8, image.clone());
    let (picture, profile) = draw(&program("vertex"), &program("textured"), &frame);
    assert_eq!(picture.covered, vec![1.0; 64]);
    for (got, texel) in picture.pixels.iter().zip(&image.texels) {
        for c in 0..4 {
            assert!((got[c] - texel[c]).abs() < 1e-4, "{got:?} {texel:?}");
        }
    }
    assert_eq!((profile.lanes, profile.work.samples), (64, 64.0));
}

#[test]
fn draws_share_the_depth_and_have_their_own_resources() {
    let mut mesh = square(1.0, 1.0);
    let second = square(1.0, 1.0);
    mesh.positions.extend(second.positions);
    mesh.uvs.extend(second.uvs);
    mesh.indices.extend([4, 5, 6, 4, 6, 7]);
    mesh.draws = [0..4, 4..8]
        .into_iter()
        .map(|vertices| crate::scene::mesh::Draw {
            triangles: vertices.start / 2..vertices.end / 2,
            vertices,
        })
        .collect();
    let mut frame = frame(mesh, 8, image(1, |_, _| [0.0; 4]));
    let picture_of = |colour: [f32; 4]| {
        let image = image(1, |_, _| colour);
        Resource::Texture(Arc::new(Texture::new(Dimension::D2, vec![image]).unwrap()))
    };
    let scale = |x: f32| {
        let bytes = [x, 1.0, 0.0, 0.0].map(f32::to_le_bytes);
        Resource::Buffer(Arc::new(bytes.as_flattened().to_vec()))
    };
    // The first is drawn half as wide, in red, and hides the second, which is as near.
    let (red, blue) = ([1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]);
    frame.bindings.insert(
        (0, 0),
        Resource::PerDraw(Arc::new([scale(0.5), scale(1.0)])),
    );
    frame.bindings.insert(
        (0, 1),
        Resource::PerDraw(Arc::new([picture_of(red), picture_of(blue)])),
    );
    let vertex = program("vertex");
    let (picture, profile) = draw(&vertex, &program("textured"), &frame);
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let inside = (2..6).contains(&(i % 8));
        assert_eq!(*pixel, if inside { red } else { blue }, "pixel {i}");
    }
    assert_eq!(profile.lanes, 64);
    // Vertices are counted from the start of each draw, and blocks are of one draw each, in a part too.
    let coverage = rasterize(&vertex, &program("lattice"), &frame);
    let shading = shade(&program("lattice"), &coverage, &frame.bindings);
    assert!(shading.colours.iter().all(|colour| colour[3] == 0.0));
    let draws = |coverage: &Coverage| -> Vec<(usize, usize)> {
        let blocks = coverage.blocks.iter();
        blocks.map(|b| (b.draw, b.covered_count())).collect()
    };
    assert_eq!(draws(&coverage), [(0, 32), (1, 64)]);
    let top = coverage.part(|(_, y)| y < 2);
    assert_eq!(draws(&top), [(0, 16), (1, 32)]);
}

#[test]
fn a_receding_square_changes_level_where_texels_get_smaller_than_pixels() {
    // A checkerboard of single texels is even grey from level 1 on.
    let image = image(64, |x, y| [((x + y) % 2) as f32, 0.0, 0.0, 1.0]);
    let frame = frame(square(1.0, 8.0), 64, image);
    let (picture, _) = draw(&program("vertex"), &program("textured"), &frame);
    // v at the screen's height t from the bottom, as the perspective test of the rasteriser has it.
    let v = |y: f32| {
        let t = 1.0 - y / 64.0;
        1.0 - (t / 8.0) / ((1.0 - t) + t / 8.0)
    };
    let (mut grey, mut sharp) = (0, 0);
    for y in 0..64_u32 {
        // Both rows of a quad, of which the upper may be a helper's: the same difference.
        let top = (y & !1) as f32 + 0.5;
        let texels = (v(top + 1.0) - v(top)) * 64.0;
        let row = &picture.pixels[y as usize * 64..][..64];
        if texels >= 2.001 {
            assert!(
                row.iter().all(|p| p[0] == 0.5),
                "row {y}, {texels} texels a pixel"
            );
            grey += 1;
        } else if texels < 1.0 && row.iter().any(|p| (p[0] - 0.5).abs() > 0.1) {
            sharp += 1;
        }
    }
    assert!(grey > 5 && sharp > 20, "{grey} {sharp}");
}

#[test]
fn derivatives_are_those_of_the_grid() {
    let mut frame = frame(square(1.0, 1.0), 16, image(1, |_, _| [0.0; 4]));
    for grid in [1, 4] {
        frame.grid = grid;
        let (picture, _) = draw(&program("vertex"), &program("slopes"), &frame);
        assert_eq!((picture.width, picture.height), (16, 16));
        let step = 1.0 / (16 * grid) as f32;
        for pixel in &picture.pixels {
            for (got, expected) in pixel.iter().zip([step, 0.0, 0.0, step]) {
                assert!((got - expected).abs() < 1e-6, "{pixel:?}");
            }
        }
    }
}

#[test]
fn discarded_fragments_show_what_is_behind() {
    let mut mesh = square(1.0, 1.0);
    let behind = square(1.0, 1.0);
    mesh.positions.extend(behind.positions);
    mesh.uvs.extend(behind.uvs);
    mesh.indices.extend([4, 5, 6, 4, 6, 7]);
    let frame = frame(mesh, 8, image(1, |_, _| [0.0; 4]));
    let vertex = program("vertex");
    let (picture, _) = draw(&vertex, &program("lattice"), &frame);
    for (i, (pixel, covered)) in picture.pixels.iter().zip(&picture.covered).enumerate() {
        let (x, y) = ((i % 8) as f32, (i / 8) as f32);
        if i % 4 < 2 {
            assert_eq!((*pixel, *covered), ([0.0; 4], 0.0));
        } else {
            // Of equal depth, the first square: its triangles start at vertex 0.
            assert_eq!((*pixel, *covered), ([x + 0.5, y + 0.5, 0.5, 0.0], 1.0));
        }
    }
    // A shader that moves its depth: the second square comes to the front.
    let (picture, _) = draw(&vertex, &program("deep"), &frame);
    assert!(picture.pixels.iter().all(|p| *p == [4.0, 4.0, 4.0, 1.0]));
}

#[test]
fn a_program_may_read_less_than_the_coverage_holds() {
    let frame = frame(square(1.0, 2.0), 32, image(1, |_, _| [0.0; 4]));
    let (vertex, slopes) = (program("vertex"), program("slopes"));
    let own = rasterize(&vertex, &slopes, &frame);
    let wider = rasterize(&vertex, &program("textured"), &frame);
    assert!(wider.slots.len() > own.slots.len());
    assert_eq!(
        shade(&slopes, &own, &frame.bindings).colours,
        shade(&slopes, &wider, &frame.bindings).colours
    );
}

#[test]
fn threads_do_not_change_the_bits() {
    let picture = image(16, |x, y| {
        [(x * 7 % 5) as f32, (y * 3 % 7) as f32, 0.3, 1.0]
    });
    let frame = frame(square(1.0, 30.0), 200, picture);
    let (vertex, fragment) = (program("vertex"), program("textured"));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build()
            .unwrap()
            .install(|| draw(&vertex, &fragment, &frame))
    };
    let bits = |p: &Picture| {
        p.pixels
            .as_flattened()
            .iter()
            .map(|v| v.to_bits())
            .collect::<Vec<_>>()
    };
    let (one, one_profile) = run(1);
    for threads in [2, 3, 1] {
        let (other, profile) = run(threads);
        assert_eq!(bits(&one), bits(&other));
        assert_eq!(one_profile, profile);
    }
}

/// Two draws of the three fragments of [`coverage`]: the first one's are those of the first block.
fn blended(depths: [f32; 3], blends: [Blend; 2]) -> Coverage {
    let mut coverage = coverage(depths);
    let mut second = coverage.blocks[0].clone();
    coverage.blocks[0].covered = Mask([0b11, 0, 0, 0]);
    second.covered = Mask([0b1_0000, 0, 0, 0]);
    (second.draw, second.first) = (1, 2);
    coverage.blocks.push(second);
    coverage.states = blends
        .map(|blend| DrawState {
            blend,
            front_only: false,
        })
        .into();
    coverage
}

#[test]
fn blended_fragments_are_composed_from_the_farthest_to_the_nearest() {
    use Blend::{Additive, Alpha, Opaque, Premultiplied};
    let mut shading = shading([true; 3]);
    // On the first pixel red and blue, on the second green.
    shading.colours = vec![
        [1.0, 0.0, 0.0, 0.5],
        [0.0, 1.0, 0.0, 0.25],
        [0.0, 0.0, 0.5, 0.25],
    ];
    let shown = |depths, blends| resolve(&blended(depths, blends), &shading);
    for (near, blends, first) in [
        // Blue over red over nothing, and red over blue.
        (2, [Alpha, Alpha], [0.375, 0.0, 0.125, 0.625]),
        (0, [Alpha, Alpha], [0.5, 0.0, 0.0625, 0.625]),
        (2, [Alpha, Premultiplied], [0.375, 0.0, 0.5, 0.625]),
        (2, [Alpha, Additive], [0.5, 0.0, 0.125, 0.5]),
        (2, [Opaque, Alpha], [0.75, 0.0, 0.125, 1.0]),
        (2, [Opaque, Additive], [1.0, 0.0, 0.125, 1.0]),
        // What is opaque hides what is behind, whichever is drawn first.
        (0, [Opaque, Alpha], [1.0, 0.0, 0.0, 1.0]),
        (0, [Alpha, Opaque], [0.5, 0.0, 0.25, 1.0]),
        (2, [Alpha, Opaque], [0.0, 0.0, 0.5, 1.0]),
        // Of equal depths the later one is over the other, but not over what is opaque.
        (1, [Alpha, Alpha], [0.375, 0.0, 0.125, 0.625]),
        (1, [Opaque, Alpha], [1.0, 0.0, 0.0, 1.0]),
    ] {
        let depths = match near {
            0 => [0.2, 0.5, 0.5],
            1 => [0.2, 0.5, 0.2],
            _ => [0.5, 0.5, 0.2],
        };
        let picture = shown(depths, blends);
        assert_eq!(picture.pixels[0], first, "{near} {blends:?}");
        assert_eq!(picture.covered, [1.0, 1.0]);
    }
    // Nothing shows where alpha is 0, or the fragment is gone.
    shading.colours[1][3] = 0.0;
    shading.alive = vec![false, true, false];
    let picture = resolve(&blended([0.5; 3], [Alpha; 2]), &shading);
    assert_eq!(picture, Picture::empty(2, 1));
    // What adds light hides nothing, and is seen.
    shading.colours[1] = [0.5, 0.0, 0.0, 1.0];
    let picture = resolve(&blended([0.5; 3], [Additive; 2]), &shading);
    assert_eq!(picture.pixels[1], [0.5, 0.0, 0.0, 0.0]);
    assert_eq!(picture.covered, [0.0, 1.0]);
}

#[test]
fn fragments_weigh_what_the_picture_shows_of_them() {
    use Blend::{Additive, Alpha, Opaque, Premultiplied};
    let mut shading = shading([true; 3]);
    // On the first pixel two, on the second one.
    shading.colours = vec![
        [0.0, 0.0, 0.0, 0.5],
        [0.0, 0.0, 0.0, 0.25],
        [0.0, 0.5, 0.0, 0.25],
    ];
    let weights = |first: f32, blends| {
        let seen = seen(&blended([first, 0.5, 0.5], blends), &shading, |c| c);
        let weights = seen.weights.expect("it blends");
        assert_eq!(weights.arrives.len(), seen.coverage.fragments);
        (weights.arrives, weights.share)
    };
    let list = |all: &[f32]| all.to_vec();
    for (first, blends, arrives, share) in [
        (
            0.2,
            [Alpha, Alpha],
            &[1.0, 1.0, 0.5][..],
            &[0.5, 0.25, 0.125][..],
        ),
        (0.8, [Alpha, Alpha], &[0.75, 1.0, 1.0], &[0.375, 0.25, 0.25]),
        (0.8, [Opaque, Alpha], &[0.75, 1.0, 1.0], &[0.75, 1.0, 0.25]),
        // What adds light hides nothing, and what is premultiplied may add more than it hides.
        (0.8, [Alpha, Additive], &[1.0, 1.0, 1.0], &[0.5, 0.25, 0.25]),
        (
            0.8,
            [Alpha, Premultiplied],
            &[0.75, 1.0, 1.0],
            &[0.375, 0.25, 0.5],
        ),
        // What is hidden is not there.
        (0.2, [Opaque, Alpha], &[1.0, 1.0], &[1.0, 1.0]),
    ] {
        let found = weights(first, blends);
        assert_eq!(found, (list(arrives), list(share)), "{first} {blends:?}");
    }
}
