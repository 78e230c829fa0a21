//! The triangles at a point, one after another around it; and with that what may happen to the point: whether it is inside
//! the surface, on a seam, on a border, or stays.

use super::Surface;

/// What may happen to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Inside the surface: its triangles close one fan and have the same wedge of it. It may go to a neighbour, unless there are two
    /// wedges there that it could become: then a seam ends here.
    Inside,
    /// On a seam: its triangles close one fan, one half of which has one wedge of it and the other half another.
    /// It may go along the two edges between them.
    Seam,
    /// On a border: its triangles make one open fan and have the same wedge of it. It may go along the border.
    Border,
    /// Anything else, where it cannot be said what should follow whom: where seams meet, or a seam meets a border, and where more than two
    /// triangles share an edge, or more than one fan a point. It stays.
    Fixed,
}

/// A triangle seen from one of its points: its wedge there, and the two other points in its orientation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slice {
    pub(crate) triangle: u32,
    pub(crate) wedge: u32,
    pub(crate) next: u32,
    pub(crate) last: u32,
}

/// The triangles at a point, each of which shares an edge with the one before it.
#[derive(Clone, Debug)]
pub(crate) struct Fan {
    /// In the order of their orientation; the `last` of each is the `next` of the one after it.
    pub(crate) slices: Vec<Slice>,
    /// Whether the one after the last is the first.
    pub(crate) closed: bool,
}

impl Surface {
    /// The triangles around a point, when they make one fan. A point that is not fixed has one.
    pub(crate) fn fan(&self, point: u32) -> Option<Fan> {
        let star = &self.stars[point as usize];
        let mut slices: Vec<Slice> = star.iter().map(|&t| self.slice(t, point)).collect();
        slices.sort_unstable_by_key(|slice| slice.next);
        if slices.is_empty() || slices.windows(2).any(|pair| pair[0].next == pair[1].next) {
            return None;
        }
        let follower = |slice: &Slice| {
            slices
                .binary_search_by_key(&slice.last, |other| other.next)
                .ok()
        };
        let mut has_one_before = vec![false; slices.len()];
        for slice in &slices {
            if let Some(after) = follower(slice)
                && std::mem::replace(&mut has_one_before[after], true)
            {
                return None;
            }
        }

        // Once around, from the open end if there is one.
        let start = has_one_before
            .iter()
            .position(|before| !before)
            .unwrap_or(0);
        let mut ordered = Vec::with_capacity(slices.len());
        let mut at = Some(start);
        while let Some(this) = at {
            ordered.push(slices[this]);
            at = follower(&slices[this]).filter(|after| *after != start);
        }
        (ordered.len() == slices.len()).then_some(Fan {
            closed: has_one_before[start],
            slices: ordered,
        })
    }

    /// The kind of a point, from its star alone.
    pub(super) fn find_kind(&self, point: u32) -> Kind {
        let Some(Fan { slices, closed }) = self.fan(point) else {
            return Kind::Fixed;
        };
        let changes = slices
            .windows(2)
            .filter(|pair| pair[0].wedge != pair[1].wedge)
            .count();
        match (closed, changes) {
            (false, 0) => Kind::Border,
            (false, _) => Kind::Fixed,
            (true, 0) => Kind::Inside,
            // Where the fan closes is the other change; or there are both before.
            (true, 1) => Kind::Seam,
            (true, 2) if slices[0].wedge == slices[slices.len() - 1].wedge => Kind::Seam,
            (true, _) => Kind::Fixed,
        }
    }

    fn slice(&self, triangle: u32, point: u32) -> Slice {
        let vertices = self.triangles[triangle as usize];
        let points = self.corners(triangle);
        let i = points.iter().position(|p| *p == point).unwrap_or(0);
        Slice {
            triangle,
            wedge: self.wedge_of[vertices[i] as usize],
            next: points[(i + 1) % 3],
            last: points[(i + 2) % 3],
        }
    }
}
