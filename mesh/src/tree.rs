//! The triangles of a mesh in a tree of boxes, so that the one nearest to a place is found without looking at all of them.

use glam::{DVec3, Vec3};

use crate::Mesh;

/// How many triangles a leaf has at most.
const LEAF: usize = 4;

/// The triangles of a mesh in a tree of boxes.
#[derive(Clone, Debug)]
pub struct Tree {
    /// The root first; the two children of a node are one after another, behind it.
    nodes: Vec<Node>,
    /// The triangles in the order of the leaves.
    corners: Vec<[Vec3; 3]>,
    /// Their numbers in the mesh.
    triangles: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// The first triangle of a leaf; of an inner node, the first child.
    first: u32,
    /// How many triangles a leaf has; 0 in an inner node.
    count: u32,
}

/// The place of a mesh that is nearest to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The triangle that it is on.
    pub triangle: u32,
    /// Where it is.
    pub place: DVec3,
    /// How far away it is.
    pub distance: f64,
}

impl Tree {
    /// The tree of a mesh.
    ///
    /// # Panics
    /// When an index is beyond the positions: what reads meshes from files refuses such a one.
    pub fn new(mesh: &Mesh) -> Tree {
        let triangles = mesh.indices.as_chunks::<3>().0;
        let corners: Vec<[Vec3; 3]> = triangles
            .iter()
            .map(|corners| corners.map(|v| Vec3::from(mesh.positions[v as usize])))
            .collect();
        let mut order: Vec<u32> = (0..corners.len() as u32).collect();
        let mut nodes = Vec::with_capacity(corners.len());
        if !order.is_empty() {
            nodes.push(Node::around(&corners, &order, 0));
            split(&mut nodes, 0, &corners, &mut order, 0);
        }
        Tree {
            nodes,
            corners: order.iter().map(|&t| corners[t as usize]).collect(),
            triangles: order,
        }
    }

    /// The place nearest to another; of several, one on the first leaf that has it. `None` when there are no triangles.
    pub fn nearest(&self, to: DVec3) -> Option<Nearest> {
        let mut best = f64::INFINITY;
        let mut found = None;
        let mut waiting: Vec<(f64, u32)> = Vec::with_capacity(64);
        waiting.push((self.nodes.first()?.distance_squared(to), 0));
        while let Some((near, node)) = waiting.pop() {
            if near >= best {
                continue;
            }
            let Node { first, count, .. } = self.nodes[node as usize];
            if count > 0 {
                for i in first..first + count {
                    let place =
                        nearest_in_triangle(to, self.corners[i as usize].map(|c| c.as_dvec3()));
                    let square = place.distance_squared(to);
                    if square < best {
                        best = square;
                        found = Some((i, place));
                    }
                }
                continue;
            }
            let mut children = [first, first + 1]
                .map(|child| (self.nodes[child as usize].distance_squared(to), child));
            if children[0].0 < children[1].0 {
                children.swap(0, 1);
            }
            waiting.extend(children.into_iter().filter(|(near, _)| *near < best));
        }
        found.map(|(i, place)| Nearest {
            triangle: self.triangles[i as usize],
            place,
            distance: best.sqrt(),
        })
    }
}

impl Node {
    /// The leaf of some triangles.
    fn around(corners: &[[Vec3; 3]], triangles: &[u32], first: usize) -> Node {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for corner in triangles.iter().flat_map(|&t| corners[t as usize]) {
            low = low.min(corner);
            high = high.max(corner);
        }
        Node {
            low,
            high,
            first: first as u32,
            count: triangles.len() as u32,
        }
    }

    fn distance_squared(&self, to: DVec3) -> f64 {
        to.distance_squared(to.clamp(self.low.as_dvec3(), self.high.as_dvec3()))
    }
}

/// Splits a leaf in halves along its longest side, and those in turn. `offset` is where `order` begins in that of the tree.
fn split(
    nodes: &mut Vec<Node>,
    node: usize,
    corners: &[[Vec3; 3]],
    order: &mut [u32],
    offset: usize,
) {
    if order.len() <= LEAF {
        return;
    }
    let middle = |t: u32| corners[t as usize].iter().sum::<Vec3>();
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &t in order.iter() {
        low = low.min(middle(t));
        high = high.max(middle(t));
    }
    let axis = (high - low).max_position();
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |&a, &b| {
        middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(&b))
    });
    let (left, right) = order.split_at_mut(half);

    let first = nodes.len();
    nodes.push(Node::around(corners, left, offset));
    nodes.push(Node::around(corners, right, offset + half));
    nodes[node].first = first as u32;
    nodes[node].count = 0;
    split(nodes, first, corners, left, offset);
    split(nodes, first + 1, corners, right, offset + half);
}

/// The point of a triangle that is nearest to a place.
pub fn nearest_in_triangle(to: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    // Exactly itself, where it is a corner.
    if to == a || to == b || to == c {
        return to;
    }
    // Inside, when it is on the inner side of each edge as seen along the normal.
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    let inside = |a: DVec3, b: DVec3| normal.dot((b - a).cross(to - a)) >= 0.0;
    if square > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return to - normal * (normal.dot(to - a) / square);
    }
    let on_edge = |a: DVec3, b: DVec3| {
        let way = b - a;
        let length = way.length_squared();
        let along = if length > 0.0 {
            ((to - a).dot(way) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        a + way * along
    };
    let mut best = on_edge(a, b);
    for other in [on_edge(b, c), on_edge(c, a)] {
        if other.distance_squared(to) < best.distance_squared(to) {
            best = other;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{Random, soup, sphere};

    /// The distance from a place to a triangle by trying many of its points.
    fn tried(to: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
        let steps = 60;
        let mut best = f64::INFINITY;
        for i in 0..=steps {
            for j in 0..=steps - i {
                let (u, v) = (
                    f64::from(i) / f64::from(steps),
                    f64::from(j) / f64::from(steps),
                );
                best = best.min(to.distance(a + (b - a) * u + (c - a) * v));
            }
        }
        best
    }

    #[test]
    fn nearest_in_a_triangle_is_nearer_than_any_point_tried() {
        let mut random = Random(7);
        for _ in 0..200 {
            let mut place = || DVec3::new(random.unit(), random.unit(), random.unit());
            let (to, corners) = (place() * 2.0, [place(), place(), place()]);
            let found = nearest_in_triangle(to, corners).distance(to);
            let tried = tried(to, corners);
            assert!(
                found <= tried + 1e-12 && found > tried - 0.02,
                "{found} and {tried}"
            );
        }
        let flat = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        assert_eq!(
            nearest_in_triangle(DVec3::new(1.5, 1.0, 0.0), flat),
            DVec3::X * 1.5
        );
        assert_eq!(nearest_in_triangle(DVec3::Y, [DVec3::X; 3]), DVec3::X);
        let corner = DVec3::new(0.1, 0.7, 0.3);
        assert_eq!(
            nearest_in_triangle(corner, [DVec3::X * 0.7, corner, DVec3::Y * 0.3]),
            corner
        );
    }

    #[test]
    fn the_tree_finds_what_looking_at_all_finds() {
        let mut random = Random(8);
        for mesh in [sphere(20, 12), soup(200, &mut random)] {
            let tree = Tree::new(&mesh);
            for _ in 0..200 {
                let to = DVec3::new(random.unit(), random.unit(), random.unit()) * 4.0 - 2.0;
                let all = mesh.indices.as_chunks::<3>().0.iter().map(|corners| {
                    let corners =
                        corners.map(|v| Vec3::from(mesh.positions[v as usize]).as_dvec3());
                    nearest_in_triangle(to, corners).distance_squared(to)
                });
                let nearest = tree.nearest(to).unwrap();
                assert_eq!(nearest.distance, all.fold(f64::INFINITY, f64::min).sqrt());
                assert_eq!(nearest.place.distance(to), nearest.distance);
            }
        }
        assert_eq!(Tree::new(&Mesh::default()).nearest(DVec3::ZERO), None);
    }
}
