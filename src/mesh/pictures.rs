//! Pictures of the original from all sides, by which meshes with fewer triangles are judged.

use super::Subject;
use super::view::View;
use crate::eval::raster::Frame;
use crate::scene::Split;
use crate::scene::mesh::{Draw, Mesh};
use lodc_mesh::Surface;
use rayon::prelude::*;
use std::sync::Arc;

/// Triangles between vertices of a mesh, that are drawn in place of its own: by the number of the triangle whose place they
/// take, their vertices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Triangles(pub(super) Vec<Option<[u32; 3]>>);

impl Triangles {
    /// The mesh's own.
    pub fn whole(mesh: &Mesh) -> Self {
        let corners = mesh.indices.chunks_exact(3);
        Self(corners.map(|c| Some([c[0], c[1], c[2]])).collect())
    }

    /// Those that a surface of the mesh has left.
    pub fn left(surface: &Surface, mesh: &Mesh) -> Self {
        let mut triangles = vec![None; mesh.indices.len() / 3];
        for (triangle, corners) in surface.triangles() {
            triangles[triangle as usize] = Some(corners);
        }
        Self(triangles)
    }

    /// So many as indices say, for each draw of the mesh; of each at most as many as the mesh has in it.
    pub fn of_draws(mesh: &Mesh, indices: impl Fn(&Draw) -> Vec<u32>) -> Self {
        let mut triangles = vec![None; mesh.indices.len() / 3];
        for draw in mesh.draws() {
            let places = &mut triangles[draw.triangles.clone()];
            let indices = indices(&draw);
            for (place, corners) in places.iter_mut().zip(indices.chunks_exact(3)) {
                *place = Some([corners[0], corners[1], corners[2]]);
            }
        }
        Self(triangles)
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.iter().flatten().count()
    }

    /// Them as a mesh of its own, with the vertices that they have.
    pub fn mesh(&self, original: &Mesh) -> Mesh {
        let indices = self.0.iter().flatten().flatten().copied().collect();
        let mut first = 0;
        let draws = original.draws.iter().map(|draw| {
            let count = self.0[draw.triangles.clone()].iter().flatten().count();
            let triangles = first..first + count;
            first += count;
            Draw {
                vertices: draw.vertices.clone(),
                triangles,
            }
        });
        let whole = Mesh {
            draws: draws.collect(),
            indices,
            ..original.clone()
        };
        Surface::new(&whole).mesh(&whole)
    }
}

/// Pictures of the original, at one distance.
pub struct Pictures<'a> {
    pub(super) subject: Subject<'a>,
    pub(super) views: Vec<View>,
    /// How many pixels the reference covers in all of them, at least 1.
    pub(super) coverage: f64,
    /// The mean squared error of the original itself.
    floor: f64,
}

impl<'a> Pictures<'a> {
    /// From at least so many sides, spread as the scene's views are; the scene's own where it lists them.
    pub fn all_around(subject: Subject<'a>, distance: f64, count: usize) -> Self {
        Self::of(subject, subject.scene.all_around(distance, count))
    }

    /// The same of what is not the original, but is judged by it: another shader, or a mesh with fewer triangles, in the same scene.
    pub(super) fn against(
        original: Subject<'a>,
        subject: Subject<'a>,
        distance: f64,
        count: usize,
    ) -> Self {
        let frames = original.scene.all_around(distance, count).into_par_iter();
        let views = frames.map(|of_original| {
            let frame = Frame {
                mesh: Arc::clone(&subject.scene.mesh),
                ..of_original.clone()
            };
            let view = View::new((&original, &of_original), &subject, frame);
            let error = view.error_of(&original, &of_original);
            (view, error)
        });
        let (views, errors): (Vec<View>, Vec<f64>) = views.unzip();
        Self::with(subject, views, errors.iter().sum())
    }

    /// So many that decide nothing, each from a side by chance.
    pub fn held_out(subject: Subject<'a>, distance: f64, split: Split, count: usize) -> Self {
        Self::of(subject, subject.scene.held_out(distance, split, count))
    }

    fn of(subject: Subject<'a>, frames: Vec<Frame>) -> Self {
        let views = frames.into_par_iter();
        let views = views.map(|frame| View::new((&subject, &frame), &subject, frame.clone()));
        let views: Vec<View> = views.collect();
        let errors = views.iter().map(|view| view.picture().error());
        let error = errors.sum();
        Self::with(subject, views, error)
    }

    /// With the sum of the original's own errors.
    fn with(subject: Subject<'a>, views: Vec<View>, error: f64) -> Self {
        let coverage = views.iter().map(View::coverage).sum::<f64>().max(1.0);
        Self {
            floor: error / coverage,
            coverage,
            views,
            subject,
        }
    }

    /// The mean squared error of the original's own pictures, which alias.
    pub fn floor(&self) -> f64 {
        self.floor
    }

    /// The mean squared error of the pictures that triangles make.
    pub fn square(&self, triangles: &Triangles) -> f64 {
        let pictures = self.views.par_iter().map(|view| {
            let picture = view.look(&self.subject, triangles, &view.squares(true));
            picture.error()
        });
        // In their order, so that sums are the same with any number of threads.
        let errors: Vec<f64> = pictures.collect();
        errors.iter().sum::<f64>() / self.coverage
    }

    /// What that is more than the original's, as a root: 0..1.
    pub fn excess(&self, triangles: &Triangles) -> f64 {
        (self.square(triangles) - self.floor).max(0.0).sqrt()
    }
}
