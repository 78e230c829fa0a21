//! Coverage and inputs against results computed by hand. Vertices are given as if the vertex program had run.

use super::vertices::Vertices;
use super::{Block, Coverage, Shape, Target, Triangles, cover};
use crate::eval::draw::{Blend, DrawState};
use crate::eval::lane::LANES;
use crate::eval::machine::Profile;
use crate::eval::program::Slot;
use crate::scene::mesh::{Draw, Mesh};
use naga::{Binding, BuiltIn, Interpolation, ScalarKind};
use std::collections::BTreeMap;

fn location(location: u32, kind: ScalarKind, interpolation: Option<Interpolation>) -> Slot {
    Slot {
        binding: Binding::Location {
            location,
            interpolation,
            sampling: None,
            blend_src: None,
            per_primitive: false,
        },
        component: 0,
        kind,
        interpolation,
    }
}

fn float(at: u32, interpolation: Interpolation) -> Slot {
    location(at, ScalarKind::Float, Some(interpolation))
}

fn built_in(built_in: BuiltIn, component: usize, kind: ScalarKind) -> Slot {
    Slot {
        binding: Binding::BuiltIn(built_in),
        component,
        kind,
        interpolation: None,
    }
}

fn position() -> Vec<Slot> {
    (0..4)
        .map(|c| built_in(BuiltIn::Position { invariant: false }, c, ScalarKind::Float))
        .collect()
}

/// A scene of clip positions, each with one float at location 0.
struct Case {
    positions: Vec<[f32; 4]>,
    values: Vec<f32>,
    indices: Vec<u32>,
    size: (u32, u32),
    grid: u32,
    offset: [f32; 2],
    late: bool,
    /// Of each triangle, when each is a draw.
    states: Vec<DrawState>,
}

impl Case {
    fn new(positions: &[[f32; 4]], indices: &[u32]) -> Self {
        Self {
            positions: positions.to_vec(),
            values: vec![0.0; positions.len()],
            indices: indices.to_vec(),
            size: (8, 8),
            grid: 1,
            offset: [0.0; 2],
            late: false,
            states: Vec::new(),
        }
    }

    fn target(&self) -> Target {
        Target {
            width: self.size.0 * self.grid,
            height: self.size.1 * self.grid,
            grid: self.grid,
            offset: self.offset,
        }
    }

    fn mesh(&self) -> Mesh {
        Mesh {
            positions: vec![[0.0; 3]; self.positions.len()],
            indices: self.indices.clone(),
            draws: (0..self.states.len())
                .map(|i| Draw {
                    vertices: 3 * i..3 * i + 3,
                    triangles: i..i + 1,
                })
                .collect(),
            ..Mesh::default()
        }
    }

    fn shape(&self) -> Shape {
        let states = self.states.clone().into();
        let target = self.target();
        let triangles = Triangles::of(&self.positions, &self.mesh(), &target, &states);
        Shape::of(&triangles, &target)
    }

    fn cover(&self, inputs: &[Slot]) -> Coverage {
        let vertices = Vertices {
            positions: self.positions.clone(),
            outputs: vec![self.values.iter().map(|v| v.to_bits()).collect()],
            profile: Profile::default(),
        };
        let outputs = [float(0, Interpolation::Perspective)];
        cover(
            vertices,
            &outputs,
            inputs,
            &self.mesh(),
            &self.target(),
            (self.late, &self.states.clone().into()),
        )
    }
}

/// A clip position from pixel coordinates in a picture of 8 x 8.
fn at(x: f32, y: f32, z: f32, w: f32) -> [f32; 4] {
    [(x / 4.0 - 1.0) * w, (1.0 - y / 4.0) * w, z * w, w]
}

/// The covered lanes of all blocks, in order: block and lane.
fn fragments(coverage: &Coverage) -> impl Iterator<Item = (&Block, usize)> {
    coverage
        .blocks
        .iter()
        .flat_map(|block| block.covered.lanes().map(move |lane| (block, lane)))
}

/// The covered pixels as a picture of dots and crosses.
fn drawn(coverage: &Coverage) -> Vec<String> {
    let mut rows = vec![vec!['.'; coverage.width as usize]; coverage.height as usize];
    for (block, lane) in fragments(coverage) {
        let pixel = block.pixels[lane];
        let cell = &mut rows[(pixel / coverage.width) as usize][(pixel % coverage.width) as usize];
        *cell = if *cell == '.' { 'x' } else { '2' };
    }
    rows.into_iter().map(String::from_iter).collect()
}

#[test]
fn covers_the_centres_inside() {
    // Legs of 4 pixels from (1, 1): centres with x + y < 6 - on the long side, which is neither top nor left, not.
    let case = Case::new(
        &[
            at(1.0, 1.0, 0.5, 1.0),
            at(5.0, 1.0, 0.5, 1.0),
            at(1.0, 5.0, 0.5, 1.0),
        ],
        &[0, 1, 2],
    );
    let coverage = case.cover(&[]);
    assert_eq!(
        drawn(&coverage),
        [
            "........", ".xxx....", ".xx.....", ".x......", "........", "........", "........",
            "........"
        ]
    );
    assert_eq!(coverage.fragments, 6);
    // The other way round it covers the same.
    let mut back = case;
    back.indices = vec![0, 2, 1];
    assert_eq!(drawn(&back.cover(&[])), drawn(&coverage));
}

#[test]
fn top_and_left_edges_belong_to_a_triangle() {
    // Edges through the centres of pixels: left and top ones are in, right and bottom ones are out.
    let corners = [(1.5, 1.5), (5.5, 1.5), (5.5, 5.5), (1.5, 5.5)].map(|(x, y)| at(x, y, 0.5, 1.0));
    let case = Case::new(&corners, &[0, 1, 2, 0, 2, 3]);
    let mut expected = vec!["........"; 8];
    expected[1..5].fill(".xxxx...");
    assert_eq!(drawn(&case.cover(&[])), expected);
}

#[test]
fn shared_edges_cover_each_pixel_once() {
    // A fan about an odd centre that fills the picture; late, so that doubles would show.
    let corner = |i: u32| {
        let (x, y) = [
            (0.0, 0.0),
            (3.3, 0.0),
            (8.0, 0.0),
            (8.0, 4.5),
            (8.0, 8.0),
            (2.5, 8.0),
            (0.0, 8.0),
            (0.0, 3.1),
        ][i as usize % 8];
        at(x, y, 0.5, 1.0)
    };
    for centre in [(4.5, 4.5), (3.27, 5.81), (0.5, 7.5), (4.0, 4.0)] {
        let mut positions: Vec<_> = (0..8).map(corner).collect();
        positions.push(at(centre.0, centre.1, 0.5, 1.0));
        let indices: Vec<u32> = (0..8).flat_map(|i| [8, i, (i + 1) % 8]).collect();
        let mut case = Case::new(&positions, &indices);
        case.late = true;
        assert_eq!(drawn(&case.cover(&[])), vec!["xxxxxxxx"; 8], "{centre:?}");
    }
}

#[test]
fn interpolates_perspective_correctly() {
    // A floor that recedes from w = 1 at the bottom to w = 10 at the top, its value from 0 to 1.
    let mut case = Case::new(
        &[
            at(0.0, 8.0, 0.1, 1.0),
            at(8.0, 8.0, 0.1, 1.0),
            at(8.0, 0.0, 0.9, 10.0),
            at(0.0, 0.0, 0.9, 10.0),
        ],
        &[0, 1, 2, 0, 2, 3],
    );
    case.values = vec![0.0, 0.0, 1.0, 1.0];
    let inputs = [
        vec![
            float(0, Interpolation::Perspective),
            float(0, Interpolation::Linear),
            float(0, Interpolation::Flat),
        ],
        position(),
    ]
    .concat();
    let coverage = case.cover(&inputs);
    assert_eq!(coverage.fragments, 64);
    for (block, lane) in fragments(&coverage) {
        let get = |slot: usize| f32::from_bits(block.inputs[slot][lane]);
        let (x, y) = (block.pixels[lane] % 8, block.pixels[lane] / 8);
        let t = 1.0 - (y as f32 + 0.5) / 8.0;
        let expected = (t / 10.0) / ((1.0 - t) + t / 10.0);
        assert!((get(0) - expected).abs() < 1e-6, "{} {expected}", get(0));
        assert!((get(1) - t).abs() < 1e-6);
        assert_eq!(get(2), 0.0);
        let depth = 0.1 + t * 0.8;
        let inverse_w = (1.0 - t) + t / 10.0;
        assert_eq!((get(3), get(4)), (x as f32 + 0.5, y as f32 + 0.5));
        assert!((get(5) - depth).abs() < 1e-6 && (get(6) - inverse_w).abs() < 1e-6);
        assert_eq!(block.depths[lane], get(5));
    }
}

#[test]
fn integers_are_flat_and_missing_inputs_are_zero() {
    let mut case = Case::new(
        &[
            at(0.0, 0.0, 0.5, 1.0),
            at(16.0, 0.0, 0.5, 1.0),
            at(0.0, 16.0, 0.5, 1.0),
        ],
        &[2, 1, 0],
    );
    case.values = [7_u32, 8, 9].map(f32::from_bits).to_vec();
    let inputs = [
        location(0, ScalarKind::Uint, Some(Interpolation::Flat)),
        location(5, ScalarKind::Float, Some(Interpolation::Perspective)),
        built_in(BuiltIn::SampleMask, 0, ScalarKind::Uint),
        built_in(BuiltIn::SampleIndex, 0, ScalarKind::Uint),
    ];
    for (block, lane) in fragments(&case.cover(&inputs)) {
        let words = [0, 1, 2, 3].map(|slot| block.inputs[slot][lane]);
        assert_eq!(words, [9, 0, 1, 0]);
    }
}

#[test]
fn helpers_extrapolate_so_that_quads_have_derivatives() {
    let mut case = Case::new(
        &[
            at(1.0, 1.0, 0.5, 1.0),
            at(5.0, 1.0, 0.5, 1.0),
            at(1.0, 5.0, 0.5, 1.0),
        ],
        &[0, 1, 2],
    );
    // 3 a pixel along x, 5 along y.
    case.values = vec![0.0, 12.0, 20.0];
    let coverage = case.cover(&[float(0, Interpolation::Perspective)]);
    let block = &coverage.blocks[0];
    let quads = (0..64).filter(|q| block.active.0[q / 16] >> (q % 16 * 4) & 15 == 15);
    let mut count = 0;
    for quad in quads {
        let value = |i: usize| f32::from_bits(block.inputs[0][quad * 4 + i]);
        assert_eq!(value(1) - value(0), 3.0);
        assert_eq!(value(3) - value(2), 3.0);
        assert_eq!(value(2) - value(0), 5.0);
        count += 1;
    }
    assert_eq!(count, 4);
    assert!(block.active != block.covered);
}

#[test]
fn clips_at_the_near_plane() {
    // A wall at a slant through the near plane: z = w - 1, w from 0.5 (cut) on the left to 2 on the right.
    // x in clip space runs over -w..w, so that screen positions stay; the cut is at w = 1.
    let clip = |x: f32, y: f32, w: f32| {
        let mut p = at(x, y, 0.0, w);
        p[2] = w - 1.0;
        p
    };
    let mut case = Case::new(
        &[
            clip(0.0, 0.0, 0.5),
            clip(8.0, 0.0, 2.0),
            clip(8.0, 8.0, 2.0),
            clip(0.0, 8.0, 0.5),
        ],
        &[0, 1, 2, 0, 2, 3],
    );
    // The value is w itself, which is linear in clip space.
    case.values = vec![0.5, 2.0, 2.0, 0.5];
    case.late = true;
    let coverage = case.cover(&[float(0, Interpolation::Perspective)]);
    // 1/w goes from 2 to 0.5 over 8 pixels: it is 1 at x = 16 / 3.
    assert_eq!(drawn(&coverage), vec![".....xxx"; 8]);
    for (block, lane) in fragments(&coverage) {
        let x = (block.pixels[lane] % 8) as f32 + 0.5;
        let w = 1.0 / (2.0 - 1.5 * x / 8.0);
        assert!((f32::from_bits(block.inputs[0][lane]) - w).abs() < 1e-6);
        assert!((block.depths[lane] - (w - 1.0) / w).abs() < 1e-6);
    }
}

#[test]
fn survives_what_is_behind_the_eye_huge_or_not_a_number() {
    let inside = [at(1.0, 1.0, 0.5, 1.0), at(7.0, 1.0, 0.5, 1.0)];
    for bad in [
        [f32::NAN, 0.0, 0.5, 1.0],
        [0.0, f32::INFINITY, 0.5, 1.0],
        [0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, -1.0],
        [3e38, -3e38, 0.5, 1.0],
        [1.0, 1.0, 0.5, 1e-30],
        [1.0, 1.0, 0.5, -1e-30],
        [1e30, 1e30, 1e30, 1e-30],
        [0.0, 0.0, 5.0, 1.0],
    ] {
        let mut case = Case::new(&[inside[0], inside[1], bad], &[0, 1, 2]);
        case.values = vec![1.0, 2.0, 3.0];
        let coverage = case.cover(&[float(0, Interpolation::Perspective)]);
        for (block, lane) in fragments(&coverage) {
            assert!(block.pixels[lane] < 64);
            assert!((0.0..1.0).contains(&block.depths[lane]));
            let value = f32::from_bits(block.inputs[0][lane]);
            assert!((0.99..3.01).contains(&value), "{bad:?}: {value}");
        }
    }
    // An index beyond the vertices and a triangle without area draw nothing.
    let none = Case::new(&inside, &[0, 1, 7, 0, 0, 1]);
    assert_eq!(none.cover(&[]).fragments, 0);
}

#[test]
fn covers_up_to_the_horizon() {
    // Points to the eye's sides: w falls to 0 and below, without a near plane to help (z = 0.5 w + 0.5 > 0).
    let corner = |x: f32, w: f32| [x, -1.0, 0.25, w];
    let mut case = Case::new(
        &[corner(-50.0, -0.5), corner(50.0, -0.5), corner(0.0, 20.0)],
        &[0, 1, 2],
    );
    case.values = vec![0.0, 0.0, 1.0];
    let coverage = case.cover(&[float(0, Interpolation::Perspective)]);
    // The plane y = -1 fills the lower half, up to w = 20.
    let rows = drawn(&coverage);
    assert_eq!(rows[..4], vec!["........"; 4]);
    assert_eq!(rows[5..], vec!["xxxxxxxx"; 3]);
    for block in &coverage.blocks {
        for lane in 0..LANES {
            assert!(f32::from_bits(block.inputs[0][lane]).is_finite());
        }
    }
}

#[test]
fn the_nearest_is_seen_and_ties_go_to_the_first() {
    let square = |z: f32, left: f32| {
        [
            at(left, 0.0, z, 1.0),
            at(8.0, 0.0, z, 1.0),
            at(8.0, 8.0, z, 1.0),
            at(left, 8.0, z, 1.0),
        ]
    };
    let squares = [square(0.5, 0.0), square(0.25, 4.0), square(0.5, 0.0)];
    let indices: Vec<u32> = (0..3)
        .flat_map(|s| [0, 1, 2, 0, 2, 3].map(|i| i + 4 * s))
        .collect();
    let mut case = Case::new(squares.as_flattened(), &indices);
    case.values = (0..12).map(|i| (i / 4) as f32).collect();
    let inputs = [
        float(0, Interpolation::Perspective),
        built_in(BuiltIn::PrimitiveIndex, 0, ScalarKind::Uint),
    ];
    let coverage = case.cover(&inputs);
    assert_eq!(coverage.fragments, 64);
    for (block, lane) in fragments(&coverage) {
        let right = block.pixels[lane] % 8 >= 4;
        assert_eq!(f32::from_bits(block.inputs[0][lane]), f32::from(right));
        assert_eq!(block.inputs[1][lane] / 2, u32::from(right));
        assert_eq!(block.depths[lane], if right { 0.25 } else { 0.5 });
    }
    case.late = true;
    assert_eq!(case.cover(&inputs).fragments, 64 + 32 + 64);
}

#[test]
fn facing_follows_the_screen() {
    let corners = [
        at(0.0, 0.0, 0.5, 1.0),
        at(0.0, 8.0, 0.5, 1.0),
        at(8.0, 8.0, 0.5, 1.0),
    ];
    let inputs = [built_in(BuiltIn::FrontFacing, 0, ScalarKind::Bool)];
    // Top left, bottom left, bottom right is counter-clockwise to the eye.
    for (indices, front) in [([0, 1, 2], 1), ([0, 2, 1], 0)] {
        let coverage = Case::new(&corners, &indices).cover(&inputs);
        assert!(coverage.fragments > 0);
        assert!(fragments(&coverage).all(|(b, lane)| b.inputs[0][lane] == front));
    }
}

#[test]
fn the_grid_and_the_offset_sample_within_the_pixel() {
    let all = [
        at(0.0, 0.0, 0.5, 1.0),
        at(16.0, 0.0, 0.5, 1.0),
        at(0.0, 16.0, 0.5, 1.0),
    ];
    let mut case = Case::new(&all, &[0, 1, 2]);
    // The value is x in pixels.
    case.values = vec![0.0, 16.0, 0.0];
    case.offset = [0.25, -0.125];
    let inputs = [vec![float(0, Interpolation::Perspective)], position()].concat();
    for grid in [1, 4] {
        case.grid = grid;
        let coverage = case.cover(&inputs);
        assert_eq!((coverage.width, coverage.height), (8 * grid, 8 * grid));
        let mut seen = BTreeMap::new();
        for (block, lane) in fragments(&coverage) {
            let get = |slot: usize| f32::from_bits(block.inputs[slot][lane]);
            let (x, y) = (
                block.pixels[lane] % (8 * grid),
                block.pixels[lane] / (8 * grid),
            );
            let expected = (x as f32 + 0.5) / grid as f32 + 0.25;
            assert!((get(0) - expected).abs() < 1e-5, "{} {expected}", get(0));
            assert_eq!(get(1), expected);
            assert_eq!(get(2), (y as f32 + 0.5) / grid as f32 - 0.125);
            seen.insert((x, y), ());
        }
        // The topmost samples of the grid lie on the picture's top edge, which is inside.
        let rows = seen.keys().filter(|&&(x, _)| x == 0).count() as u32;
        assert_eq!(rows, 8 * grid);
    }
}

#[test]
fn blocks_are_full_and_in_order() {
    let mut case = Case::new(
        &[
            [-1.0, 1.0, 0.5, 1.0],
            [3.0, 1.0, 0.5, 1.0],
            [-1.0, -3.0, 0.5, 1.0],
        ],
        &[0, 1, 2],
    );
    // Odd sides leave helpers outside of the picture.
    case.size = (37, 19);
    let coverage = case.cover(&[]);
    assert_eq!(coverage.fragments, 37 * 19);
    assert_eq!(coverage.blocks.len(), (19_usize * 10).div_ceil(64));
    let mut first = 0;
    for block in &coverage.blocks {
        assert_eq!(block.first, first);
        first += block.covered_count();
    }
    assert_eq!(drawn(&coverage), vec!["x".repeat(37); 19]);
    // The first block is the first tile.
    let block = &coverage.blocks[0];
    assert!(block.pixels.iter().all(|&p| p % 37 < 16 && p / 37 < 16));
}

#[test]
fn blended_draws_are_tested_against_opaque_ones_and_hide_nothing() {
    // The lower left half of the picture at three depths, and its upper right half from behind.
    let lower = |z| {
        [
            at(0.0, 0.0, z, 1.0),
            at(0.0, 8.0, z, 1.0),
            at(8.0, 8.0, z, 1.0),
        ]
    };
    let back = [
        at(0.0, 0.0, 0.5, 1.0),
        at(8.0, 8.0, 0.5, 1.0),
        at(8.0, 0.0, 0.5, 1.0),
    ];
    let [a, b, c] = [0.5, 0.25, 0.75].map(lower);
    let positions = [a, b, c, [back[0], back[2], back[1]]].concat();
    let mut case = Case::new(&positions, &(0..12).collect::<Vec<_>>());
    let one = fragments(&case.cover(&[])).count();
    let state = |blend, front_only| DrawState { blend, front_only };
    let blended = state(Blend::Alpha, false);
    let mut of_draws = |states: [DrawState; 4]| {
        case.states = states.to_vec();
        let coverage = case.cover(&[]);
        let mut draws = [0; 4];
        for (block, _) in fragments(&coverage) {
            draws[block.draw] += 1;
        }
        draws
    };
    let opaque = DrawState::default();
    let [_, half, _, other] = of_draws([opaque; 4]);
    assert_eq!(half + other, one);
    assert_eq!(
        of_draws([opaque, blended, opaque, opaque]),
        [half, half, 0, other]
    );
    assert_eq!(
        of_draws([opaque, blended, blended, opaque]),
        [half, half, 0, other]
    );
    assert_eq!(
        of_draws([blended, blended, opaque, blended]),
        [half, half, half, other]
    );
    let fronts = of_draws([state(Blend::Alpha, true); 4]);
    assert!(
        fronts == [half, half, half, 0] || fronts == [0, 0, 0, other],
        "{fronts:?}"
    );
    case.late = true;
    assert_eq!(
        fragments(&case.cover(&[])).count(),
        3 * fronts[0] + fronts[3]
    );
}

#[test]
fn a_device_shades_what_is_not_hidden_yet() {
    // The whole picture of 8 x 8, behind, and before it two pixels of quads side by side.
    let far = [
        at(0.0, 0.0, 0.5, 1.0),
        at(0.0, 16.0, 0.5, 1.0),
        at(16.0, 0.0, 0.5, 1.0),
    ];
    let near = [
        at(1.0, 0.0, 0.2, 1.0),
        at(1.0, 1.0, 0.2, 1.0),
        at(5.0, 0.0, 0.2, 1.0),
    ];
    let corners: Vec<[f32; 4]> = far.into_iter().chain(near).collect();
    let back_to_front = Case::new(&corners, &[0, 1, 2, 3, 4, 5]);
    let whole = Shape {
        fragments: 64,
        quads: 16,
        stamps: 4,
        triangles: 2,
    };
    let front_to_back = Case::new(&corners, &[3, 4, 5, 0, 1, 2]);
    let [back, front] = [&back_to_front, &front_to_back].map(Case::shape);
    assert_eq!(front.fragments, whole.fragments);
    assert_eq!(front.quads, whole.quads + 2);
    assert_eq!(back.fragments, whole.fragments + 2);
    assert_eq!(
        (back.quads, back.stamps),
        (whole.quads + 2, whole.stamps + 1)
    );
    assert_eq!((front.stamps, front.triangles), (whole.stamps + 1, 2));
    // What is blended hides nothing.
    let glass = DrawState {
        blend: Blend::Alpha,
        ..DrawState::default()
    };
    let mut blended = front_to_back;
    blended.states = vec![glass; 2];
    assert_eq!(blended.shape().fragments, back.fragments);
}
