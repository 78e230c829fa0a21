//! Random collapses of random meshes, and what none of them may change.

use std::collections::BTreeMap;

use super::*;
use crate::shapes::{Random, field, in_draws, soup, sphere, torus};

/// How many triangles each edge has, by its points.
fn edges(surface: &Surface) -> BTreeMap<(u32, u32), usize> {
    let mut edges = BTreeMap::new();
    for (t, _) in surface.triangles() {
        let [a, b, c] = surface.corners(t);
        for (a, b) in [(a, b), (b, c), (c, a)] {
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    edges
}

/// What collapses may not change: the Euler characteristic, the count of edges with more than two triangles, and that of border loops.
fn shape(surface: &Surface) -> (isize, usize, usize) {
    let edges = edges(surface);
    let points = (0..surface.points() as u32)
        .filter(|p| !surface.around(*p).is_empty())
        .count();
    let euler = points as isize - edges.len() as isize + surface.triangle_count() as isize;
    let crowded = edges.values().filter(|count| **count > 2).count();

    let border: Vec<(u32, u32)> = edges
        .iter()
        .filter(|(_, count)| **count == 1)
        .map(|(edge, _)| *edge)
        .collect();
    let mut loop_of: BTreeMap<u32, u32> = border
        .iter()
        .flat_map(|(a, b)| [(*a, *a), (*b, *b)])
        .collect();
    let mut loops = loop_of.len();
    for (a, b) in border {
        let find = |mut p: u32| {
            while loop_of[&p] != p {
                p = loop_of[&p];
            }
            p
        };
        let (a, b) = (find(a), find(b));
        if a != b {
            loop_of.insert(a, b);
            loops -= 1;
        }
    }
    (euler, crowded, loops)
}

/// Whether the surface is what one made anew of its triangles is.
fn assert_kept_up(surface: &Surface) {
    let mut stars = vec![Vec::new(); surface.points()];
    let mut wedges = vec![Vec::new(); surface.points()];
    for (t, corners) in surface.triangles() {
        for v in corners {
            stars[surface.point_of(v) as usize].push(t);
            wedges[surface.point_of(v) as usize].push(v);
        }
    }
    for point in 0..surface.points() as u32 {
        let mine = &mut wedges[point as usize];
        mine.sort_unstable();
        mine.dedup();
        assert_eq!(
            surface.around(point),
            stars[point as usize],
            "star of {point}"
        );
        assert_eq!(
            surface.vertices(point),
            mine.as_slice(),
            "vertices of {point}"
        );
        assert_eq!(
            surface.kind(point),
            surface.find_kind(point),
            "kind of {point}"
        );
    }
    assert_eq!(surface.triangle_count(), surface.triangles().count());
}

/// Whether every triangle is one, no two have the same points, and those that were moved are not flat.
fn assert_sound(surface: &Surface, original: &Mesh) {
    let mut seen = Vec::new();
    for (t, corners) in surface.triangles() {
        let [a, b, c] = surface.corners(t);
        assert!(
            a != b && b != c && c != a,
            "triangle {t} has two corners at a point"
        );
        let from_smallest = match a.min(b).min(c) {
            first if first == a => [a, b, c],
            first if first == b => [b, c, a],
            _ => [c, a, b],
        };
        let draw = original
            .draws()
            .iter()
            .position(|draw| draw.triangles.contains(&(t as usize)))
            .unwrap();
        seen.push((from_smallest, draw));
        let places = [a, b, c].map(|p| surface.position(p));
        if corners != original.indices.as_chunks::<3>().0[t as usize] {
            let double_area = (places[1] - places[0])
                .cross(places[2] - places[0])
                .length();
            let longest = (0..3)
                .map(|i| places[i].distance_squared(places[(i + 1) % 3]))
                .fold(0.0, f64::max);
            assert!(double_area > FLATTEST * longest, "triangle {t} is flat");
        }
    }
    seen.sort_unstable();
    assert!(
        seen.windows(2).all(|pair| pair[0] != pair[1]),
        "two triangles have the same points"
    );
}

/// Whether the mesh of the surface is one that can be drawn.
fn assert_drawable(surface: &Surface, original: &Mesh) {
    let mesh = surface.mesh(original);
    assert_eq!(mesh.indices.len(), 3 * surface.triangle_count());
    assert_eq!(mesh.uvs.len(), mesh.positions.len());
    assert_eq!(mesh.draws.len(), original.draws.len());
    let (mut vertices, mut triangles) = (0, 0);
    for draw in mesh.draws() {
        assert_eq!(
            (draw.vertices.start, draw.triangles.start),
            (vertices, triangles)
        );
        (vertices, triangles) = (draw.vertices.end, draw.triangles.end);
        for corners in &mesh.indices.as_chunks::<3>().0[draw.triangles] {
            assert!(
                corners
                    .iter()
                    .all(|v| draw.vertices.contains(&(*v as usize))),
                "a triangle reaches into another draw"
            );
        }
    }
    assert_eq!(
        (vertices, triangles),
        (mesh.positions.len(), mesh.indices.len() / 3)
    );
    let mut used = vec![false; mesh.positions.len()];
    mesh.indices.iter().for_each(|v| used[*v as usize] = true);
    assert!(used.iter().all(|used| *used));
    let places =
        |mesh: &Mesh, t: usize| [0, 1, 2].map(|i| mesh.positions[mesh.indices[3 * t + i] as usize]);
    for (number, (t, corners)) in surface.triangles().enumerate() {
        assert_eq!(
            places(&mesh, number),
            corners.map(|v| original.positions[v as usize]),
            "triangle {t}"
        );
    }
}

/// Collapses random edges until few are left, and looks at the surface now and then.
fn collapse_at_random(original: &Mesh, random: &mut Random) -> Surface {
    let mut surface = Surface::new(original);
    let before = shape(&surface);
    let mut tries = 0;
    let mut done = 0;
    while tries < 20 * surface.points() {
        tries += 1;
        let from = random.below(surface.points()) as u32;
        let neighbours = surface.neighbours(from);
        if neighbours.is_empty() {
            continue;
        }
        let to = neighbours[random.below(neighbours.len())];
        let Ok(collapse) = surface.collapse(from, to) else {
            continue;
        };
        surface.apply(&collapse);
        done += 1;
        if done % 50 == 0 {
            assert_eq!(shape(&surface), before, "after {done} collapses");
            assert_kept_up(&surface);
        }
    }
    assert_eq!(shape(&surface), before);
    assert_kept_up(&surface);
    assert_sound(&surface, original);
    assert_drawable(&surface, original);
    surface
}

#[test]
fn a_field_keeps_its_border_and_its_corners_may_go() {
    let mut random = Random(1);
    let original = field(12, 0.02, &mut random);
    let surface = collapse_at_random(&original, &mut random);
    assert_eq!(shape(&surface), (1, 0, 1));
    assert!(
        surface.triangle_count() < original.indices.len() / 6,
        "{} are left",
        surface.triangle_count()
    );
}

#[test]
fn a_sphere_with_a_seam_stays_closed() {
    let mut random = Random(2);
    let original = sphere(16, 12);
    let surface = Surface::new(&original);
    // Rows between the poles, on the meridian where the texture ends: two vertices each.
    let kinds = |kind| {
        (0..surface.points() as u32)
            .filter(|p| surface.kind(*p) == kind)
            .count()
    };
    assert_eq!(
        (kinds(Kind::Inside), kinds(Kind::Seam), kinds(Kind::Fixed)),
        (15 * 11, 11, 2)
    );

    // A neighbour of a pole could become any of its vertices.
    let below_pole = surface.point_of(17 + 5);
    assert_eq!(
        surface.collapse(below_pole, surface.point_of(0)),
        Err(Refusal::SeamEnd)
    );

    let surface = collapse_at_random(&original, &mut random);
    assert_eq!(shape(&surface), (2, 0, 0));
    assert!(edges(&surface).values().all(|count| *count == 2), "a crack");
    assert!(
        surface.triangle_count() < 16 * 12,
        "{} are left",
        surface.triangle_count()
    );
}

#[test]
fn a_torus_stays_one() {
    let mut random = Random(3);
    let original = torus(20, 12);
    let surface = collapse_at_random(&original, &mut random);
    assert_eq!(shape(&surface), (0, 0, 0));
    assert!(
        surface.triangle_count() < 20 * 12,
        "{} are left",
        surface.triangle_count()
    );
}

#[test]
fn draws_stay_apart_and_closed() {
    let mut random = Random(4);
    let original = in_draws(&torus(24, 12), 3, |[x, y, _]| {
        if y > 0.0 { 0 } else { 1 + usize::from(x > 0.0) }
    });
    let surface = collapse_at_random(&original, &mut random);
    assert_eq!(shape(&surface), (0, 0, 0));
    assert!(edges(&surface).values().all(|count| *count == 2), "a crack");
    assert!(
        surface.triangle_count() < 24 * 12,
        "{} are left",
        surface.triangle_count()
    );
}

#[test]
fn charts_stay_apart_within_a_draw() {
    // The charts of an atlas are parts like draws: their vertices differ. Now as one draw.
    let mut random = Random(5);
    let mut original = in_draws(&sphere(24, 16), 2, |[x, ..]| usize::from(x > 0.0));
    let first = original.draws[1].vertices.start as u32;
    original.draws.clear();
    for uv in &mut original.uvs[first as usize..] {
        uv[0] += 2.0;
    }
    let surface = collapse_at_random(&original, &mut random);
    for (t, corners) in surface.triangles() {
        let of_first = corners.iter().filter(|v| **v < first).count();
        assert!(
            of_first % 3 == 0,
            "triangle {t} has vertices of both charts"
        );
    }
}

#[test]
fn soups_break_nothing() {
    for seed in 10..60 {
        let mut random = Random(seed);
        let triangles = 4 + random.below(60);
        let original = soup(triangles, &mut random);
        collapse_at_random(&original, &mut random);
    }
}

#[test]
fn degenerate_triangles_and_copies_are_left_out() {
    let original = Mesh {
        positions: vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [-0.0, 0.0, -0.0],
        ],
        indices: vec![0, 1, 3, 0, 1, 2, 1, 2, 3, 2, 1, 0, 0, 0, 1],
        ..Mesh::default()
    };
    let surface = Surface::new(&original);
    assert_eq!(surface.points(), 3);
    assert_eq!(surface.point_of(3), 0);
    // The one that faces the other way is no copy.
    assert_eq!(
        surface.triangles().map(|(t, _)| t).collect::<Vec<_>>(),
        [1, 3]
    );
    assert_eq!(surface.triangle(0), None);
    assert_eq!(surface.vertices(0), [0]);
}

#[test]
fn the_last_of_a_component_stays() {
    let triangle = Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        indices: vec![0, 1, 2],
        ..Mesh::default()
    };
    assert_eq!(Surface::new(&triangle).collapse(0, 1), Err(Refusal::Last));
    let both_sides = Mesh {
        indices: vec![0, 1, 2, 2, 1, 0],
        ..triangle.clone()
    };
    let surface = Surface::new(&both_sides);
    assert_eq!(surface.kind(0), Kind::Inside);
    assert_eq!(surface.collapse(0, 1), Err(Refusal::Link));
    let tetrahedron = Mesh {
        indices: vec![0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3],
        ..triangle
    };
    let surface = Surface::new(&tetrahedron);
    assert_eq!(surface.kind(0), Kind::Inside);
    assert_eq!(surface.collapse(0, 1), Err(Refusal::Link));
}

#[test]
fn a_fold_is_refused() {
    // A fan about a point, with one corner that is drawn in behind it.
    let star = [
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [-1.0, 0.2],
        [-0.1, 0.1],
        [-1.0, -1.0],
        [0.0, -1.0],
        [1.0, -1.0],
    ];
    let mut fan = Mesh::default();
    fan.positions.push([0.0; 3]);
    fan.positions.extend(star.map(|[x, y]| [x, y, 0.0]));
    for i in 0..8 {
        fan.indices.extend([0, 1 + i, 1 + (i + 1) % 8]);
    }
    let surface = Surface::new(&fan);
    assert_eq!(surface.kind(0), Kind::Inside);
    assert_eq!(surface.collapse(0, 1), Err(Refusal::Flip));
    assert!(surface.collapse(0, 5).is_ok());
    assert_eq!(surface.collapse(1, 3), Err(Refusal::NotNeighbours));
    assert_eq!(surface.collapse(1, 0), Err(Refusal::Kind));
}

#[test]
fn a_point_of_two_fans_stays() {
    let kind = |indices: &[u32]| {
        let positions = (0..8u8).map(f32::from).map(|i| [i, i * i, i * i * i]);
        Surface::new(&Mesh {
            positions: positions.collect(),
            indices: indices.to_vec(),
            ..Mesh::default()
        })
        .kind(0)
    };
    assert_eq!(kind(&[0, 1, 2, 0, 2, 3, 0, 3, 1]), Kind::Inside);
    assert_eq!(kind(&[0, 1, 2, 0, 2, 3]), Kind::Border);
    // Two closed fans, two open ones, one of each.
    let closed = [0, 1, 2, 0, 2, 3, 0, 3, 1];
    assert_eq!(
        kind(&[closed.as_slice(), &[0, 4, 5, 0, 5, 6, 0, 6, 4]].concat()),
        Kind::Fixed
    );
    assert_eq!(kind(&[0, 1, 2, 0, 3, 4]), Kind::Fixed);
    assert_eq!(kind(&[closed.as_slice(), &[0, 4, 5]].concat()), Kind::Fixed);
    // Three triangles at an edge: all three from it, all three to it, one against two.
    assert_eq!(kind(&[0, 1, 2, 0, 1, 3, 0, 1, 4]), Kind::Fixed);
    assert_eq!(kind(&[0, 2, 1, 0, 3, 1, 0, 4, 1]), Kind::Fixed);
    assert_eq!(kind(&[0, 1, 2, 0, 3, 1, 0, 4, 1]), Kind::Fixed);
    for others in [[2, 3], [3, 2]] {
        let [a, b] = others;
        assert_eq!(kind(&[0, 1, a, 0, 1, b, 0, 2, 1]), Kind::Fixed);
    }
    assert_eq!(kind(&[0, 1, 2, 0, 2, 3, 0, 3, 2]), Kind::Fixed);
}

#[test]
fn a_moved_triangle_keeps_an_area() {
    // The first triangle has none to begin with, so that only the second one could fold. Moved, they are both on a line.
    let strip = Mesh {
        positions: vec![
            [1.0, 0.0, 0.0],
            [0.0; 3],
            [2.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [3.0, 0.0, 0.0],
        ],
        indices: vec![0, 1, 2, 0, 2, 3, 2, 4, 3],
        ..Mesh::default()
    };
    let surface = Surface::new(&strip);
    assert_eq!(surface.kind(3), Kind::Border);
    assert_eq!(surface.kind(0), Kind::Border);
    assert_eq!(
        surface.collapse(0, 3).map(|collapse| collapse.moved.len()),
        Ok(1)
    );
    assert_eq!(surface.collapse(3, 4), Err(Refusal::Sliver));
}

#[test]
fn a_mesh_without_shared_vertices_is_no_heap_of_triangles() {
    // Each triangle has vertices and tangents of its own, as some exporters write it.
    let mut random = Random(6);
    let shared = torus(16, 10);
    let mut original = Mesh::default();
    for &v in &shared.indices {
        original.indices.push(original.positions.len() as u32);
        original.positions.push(shared.positions[v as usize]);
        original.uvs.push(shared.uvs[v as usize]);
        original
            .tangents
            .push([random.unit() as f32, 0.0, 0.0, 1.0]);
    }
    let surface = Surface::new(&original);
    assert!((0..surface.points() as u32).all(|point| surface.kind(point) == Kind::Inside));
    assert_eq!(surface.mesh(&original), original);
    let surface = collapse_at_random(&original, &mut random);
    assert!(
        surface.triangle_count() < 16 * 10,
        "{} are left",
        surface.triangle_count()
    );

    // The other side of a mirrored texture is something else.
    original.tangents[0][3] = -1.0;
    let surface = Surface::new(&original);
    assert_eq!(surface.kind(surface.point_of(0)), Kind::Seam);
}
