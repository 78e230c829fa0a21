//! The half-edge collapse: a point is moved onto a neighbour, and the triangles between them go.

use glam::DVec3;

use super::{GONE, Kind, Surface};

/// The smallest cosine between the normals of a triangle before and after a collapse: about 78 degrees. Beyond it the surface
/// would fold over.
pub const LARGEST_TURN: f64 = 0.2;

/// The smallest height of a moved triangle over its longest edge, relative to that edge. A flatter one has no normal to
/// speak of.
pub const FLATTEST: f64 = 1e-5;

/// What moving a point onto a neighbour does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Collapse {
    /// The point that goes.
    pub from: u32,
    /// The point that it goes to.
    pub to: u32,
    /// Each vertex of `from`, sorted, with the vertex of `to` that replaces it.
    pub vertices: Vec<(u32, u32)>,
    /// The triangles that go, sorted.
    pub removed: Vec<u32>,
    /// The triangles that stay and change, sorted, with their new vertices.
    pub moved: Vec<(u32, [u32; 3])>,
}

/// Why a point cannot be moved onto another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// There is no edge between them.
    NotNeighbours,
    /// A point of its kind may not leave, or not along this edge.
    Kind,
    /// There are two wedges that a wedge could become: a seam ends at the point.
    SeamEnd,
    /// They have neighbours in common that are not opposite to their edge, so that two sheets would be sewn together; or a triangle
    /// would come to lie on another.
    Link,
    /// A triangle that hangs on nothing would go, or a fin of one triangle: nothing would be left in its place.
    Last,
    /// A moved triangle would be flatter than [`FLATTEST`].
    Sliver,
    /// A moved triangle would turn by more than [`LARGEST_TURN`].
    Flip,
}

impl Surface {
    /// What moving the point `from` onto its neighbour `to` would do; or why it must not be done. Nothing is changed.
    ///
    /// # Errors
    /// See [`Refusal`].
    pub fn collapse(&self, from: u32, to: u32) -> Result<Collapse, Refusal> {
        let star = &self.stars[from as usize];
        let removed: Vec<u32> = star
            .iter()
            .copied()
            .filter(|&t| self.corners(t).contains(&to))
            .collect();
        if removed.is_empty() || from == to {
            return Err(Refusal::NotNeighbours);
        }
        let vertices = self.replacements(from, to, &removed)?;
        self.check_link(from, to, &removed)?;

        let mut moved = Vec::with_capacity(star.len() - removed.len());
        for &t in star.iter().filter(|t| !removed.contains(t)) {
            let before = self.triangles[t as usize];
            let after = before.map(|v| {
                vertices
                    .iter()
                    .find(|(old, _)| *old == v)
                    .map_or(v, |(_, new)| *new)
            });
            let place = |corners: [u32; 3]| corners.map(|v| self.position(self.point_of(v)));
            check_shape(place(before), place(after))?;
            moved.push((t, after));
        }
        Ok(Collapse {
            from,
            to,
            vertices,
            removed,
            moved,
        })
    }

    /// Each vertex of `from` with the one of `to` that replaces it: on either side of the edge, one that is in a triangle
    /// with its wedge.
    fn replacements(&self, from: u32, to: u32, shared: &[u32]) -> Result<Vec<(u32, u32)>, Refusal> {
        let wedge_of = |v: u32| self.wedge_of[v as usize];
        let mut pairs: Vec<(u32, u32)> = shared
            .iter()
            .map(|&t| {
                let at = |point| {
                    let corners = self.triangles[t as usize];
                    corners
                        .into_iter()
                        .find(|v| self.point_of(*v) == point)
                        .unwrap_or(corners[0])
                };
                (wedge_of(at(from)), at(to))
            })
            .collect();
        let allowed = match self.kind(from) {
            Kind::Inside => shared.len() == 2,
            Kind::Seam => shared.len() == 2 && pairs[0].0 != pairs[1].0,
            Kind::Border => shared.len() == 1,
            Kind::Fixed => false,
        };
        if !allowed {
            return Err(Refusal::Kind);
        }
        pairs.sort_unstable();
        if pairs
            .windows(2)
            .any(|two| two[0].0 == two[1].0 && wedge_of(two[0].1) != wedge_of(two[1].1))
        {
            return Err(Refusal::SeamEnd);
        }
        let new = |v: u32| {
            pairs
                .iter()
                .find(|(wedge, _)| *wedge == wedge_of(v))
                .map(|(_, new)| (v, *new))
        };
        self.vertices(from)
            .iter()
            .map(|&v| new(v).ok_or(Refusal::Kind))
            .collect()
    }

    /// The link condition: the only neighbours that the two ends have in common are the corners opposite to their edge.
    /// With it the collapse changes nothing of how the surface is connected.
    fn check_link(&self, from: u32, to: u32, shared: &[u32]) -> Result<(), Refusal> {
        let mut opposite: Vec<u32> = shared
            .iter()
            .flat_map(|&t| self.corners(t))
            .filter(|corner| *corner != from && *corner != to)
            .collect();
        opposite.sort_unstable();
        opposite.dedup();
        if opposite.len() != shared.len() {
            return Err(Refusal::Link);
        }
        let mine = self.neighbours(from);
        let star = &self.stars[to as usize];
        let others = star
            .iter()
            .flat_map(|&t| self.corners(t))
            .filter(|corner| *corner != to && *corner != from);
        for corner in others {
            if mine.binary_search(&corner).is_ok() && !opposite.contains(&corner) {
                return Err(Refusal::Link);
            }
        }
        // A moved triangle has the points of one that is there already only when its two other corners are neighbours of both ends.
        // Then they are the opposite ones.
        if let [a, b] = opposite[..] {
            let has_both = |&t: &u32| {
                let corners = self.corners(t);
                corners.contains(&a) && corners.contains(&b)
            };
            if self.stars[from as usize].iter().any(has_both) && star.iter().any(has_both) {
                return Err(Refusal::Link);
            }
        }
        // A triangle with nothing behind it, or with more than one.
        if let ([_], [corner]) = (self.stars[from as usize].as_slice(), &opposite[..])
            && star
                .iter()
                .filter(|&&t| self.corners(t).contains(corner))
                .count()
                != 2
        {
            return Err(Refusal::Last);
        }
        Ok(())
    }

    /// Makes a collapse happen. The time is that of the stars of its two ends and of their neighbours.
    ///
    /// It must be what [`Surface::collapse`] answers now; it still is when no other was applied since that has moved or removed
    /// triangles at `from`, `to` or one of the neighbours of `from`.
    pub fn apply(&mut self, collapse: &Collapse) {
        let Collapse { from, to, .. } = *collapse;
        let mut touched: Vec<u32> = vec![to];
        for &t in &collapse.removed {
            let corners = self.corners(t);
            for corner in corners.into_iter().filter(|corner| *corner != from) {
                self.stars[corner as usize].retain(|&other| other != t);
            }
            touched.extend(corners);
            self.triangles[t as usize] = GONE;
        }
        self.live -= collapse.removed.len();
        for &(t, corners) in &collapse.moved {
            self.triangles[t as usize] = corners;
            touched.extend(self.corners(t));
        }
        let star = &mut self.stars[to as usize];
        star.extend(collapse.moved.iter().map(|(t, _)| *t));
        star.sort_unstable();
        self.stars[from as usize] = Vec::new();

        touched.push(from);
        touched.sort_unstable();
        touched.dedup();
        for &point in &touched {
            let mut vertices = std::mem::take(&mut self.vertices[point as usize]);
            vertices.clear();
            for &t in &self.stars[point as usize] {
                vertices.extend(
                    self.triangles[t as usize]
                        .into_iter()
                        .filter(|v| self.point_of(*v) == point),
                );
            }
            vertices.sort_unstable();
            vertices.dedup();
            self.vertices[point as usize] = vertices;
            self.kinds[point as usize] = self.find_kind(point);
        }
    }
}

/// Whether a moved triangle is a triangle still, and looks where it did. One that had no normal before may turn as it likes.
fn check_shape(before: [DVec3; 3], after: [DVec3; 3]) -> Result<(), Refusal> {
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    let longest = |[a, b, c]: [DVec3; 3]| {
        (b - a)
            .length_squared()
            .max((c - b).length_squared())
            .max((a - c).length_squared())
    };
    let (old, new) = (normal(before), normal(after));
    // Asked so that the answer to a NaN is no.
    let has_area = new.length() > FLATTEST * longest(after);
    if !has_area {
        return Err(Refusal::Sliver);
    }
    let had_area = old.length() > FLATTEST * longest(before);
    let looks_the_same_way = old.dot(new) > LARGEST_TURN * old.length() * new.length();
    if had_area && !looks_the_same_way {
        return Err(Refusal::Flip);
    }
    Ok(())
}
