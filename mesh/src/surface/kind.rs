//! What may happen to a point: whether it is inside the surface, on a seam, on a border, or stays.

use super::Surface;

/// What may happen to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Inside the surface: its triangles close one fan and have the same vertex of it. It may go to a neighbour, unless there are two
    /// vertices there that it could become: then a seam ends here.
    Inside,
    /// On a seam: its triangles close one fan, one half of which has one vertex of it and the other half another.
    /// It may go along the two edges between them.
    Seam,
    /// On a border: its triangles make one open fan and have the same vertex of it. It may go along the border.
    Border,
    /// Anything else, where it cannot be said what should follow whom: where seams meet, or a seam meets a border, and where more than two
    /// triangles share an edge, or more than one fan a point. It stays.
    Fixed,
}

/// A triangle seen from one of its points: its vertex there, and the two other points in its orientation.
#[derive(Clone, Copy)]
struct Slice {
    next: u32,
    last: u32,
    vertex: u32,
}

impl Surface {
    /// The kind of a point, from its star alone.
    pub(super) fn find_kind(&self, point: u32) -> Kind {
        let mut slices: Vec<Slice> = self.stars[point as usize]
            .iter()
            .map(|&t| self.slice(t, point))
            .collect();
        if slices.is_empty() {
            return Kind::Fixed;
        }
        slices.sort_unstable_by_key(|slice| slice.next);
        if slices.windows(2).any(|pair| pair[0].next == pair[1].next) {
            return Kind::Fixed;
        }
        let follower = |slice: &Slice| {
            slices
                .binary_search_by_key(&slice.last, |other| other.next)
                .ok()
        };

        let mut has_one_before = vec![false; slices.len()];
        let mut ends = 0;
        for slice in &slices {
            match follower(slice) {
                Some(after) if has_one_before[after] => return Kind::Fixed,
                Some(after) => has_one_before[after] = true,
                None => ends += 1,
            }
        }

        // Once around, from the open end if there is one.
        let start = has_one_before
            .iter()
            .position(|before| !before)
            .unwrap_or(0);
        let (mut at, mut visited, mut seams) = (start, 0, 0);
        loop {
            visited += 1;
            let Some(after) = follower(&slices[at]) else {
                break;
            };
            seams += usize::from(slices[at].vertex != slices[after].vertex);
            at = after;
            if at == start {
                break;
            }
        }
        if visited != slices.len() {
            return Kind::Fixed;
        }
        match (ends, seams) {
            (0, 0) => Kind::Inside,
            (0, 2) => Kind::Seam,
            (1, 0) => Kind::Border,
            _ => Kind::Fixed,
        }
    }

    fn slice(&self, triangle: u32, point: u32) -> Slice {
        let vertices = self.triangles[triangle as usize];
        let points = self.corners(triangle);
        let i = points.iter().position(|p| *p == point).unwrap_or(0);
        let (next, last) = ((i + 1) % 3, (i + 2) % 3);
        Slice {
            next: points[next],
            last: points[last],
            vertex: vertices[i],
        }
    }
}
