//! Writes meshes down: a GLB of all levels, and what engines need to choose among them.
//!
//! ```text
//! [Level] x Looks --glb--> the bytes of one file, levels under MSFT_lod
//! [Level] x Sight --table--> distances, screen coverages and heights, as TOML
//! ```
//!
//! Nothing here touches a file: bytes and text come out, and who calls puts them where they belong.

mod glb;
mod table;

pub use glb::glb;
pub use table::table;

use crate::Mesh;

/// A mesh and from where on it is drawn. Of several, the first is the original, and distances grow.
#[derive(Clone, Copy, Debug)]
pub struct Level<'m> {
    /// Its triangles. All levels have the same draws, of which some may have lost all their triangles.
    pub mesh: &'m Mesh,
    /// From which distance it is drawn, up to that of the next one: from the eye to the centre of the original's
    /// bounding sphere, in world units. The first level is also drawn nearer than it says.
    pub distance: f64,
}

/// How the object is looked at: what turns a distance into a size on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// The vertical field of view, degrees.
    pub fov: f64,
    /// The width of the screen by its height.
    pub aspect: f64,
    /// World units to a unit of the meshes, at most.
    pub scale: f64,
}

impl Default for Sight {
    fn default() -> Self {
        Self {
            fov: 45.0,
            aspect: 16.0 / 9.0,
            scale: 1.0,
        }
    }
}

impl Sight {
    /// The share of the screen that the disc of an object's bounding sphere covers, 0 to 1, as Babylon.js counts it:
    /// `radius` and `distance` in world units.
    pub fn coverage(&self, radius: f64, distance: f64) -> f64 {
        let height = self.height(2.0 * radius, distance);
        (std::f64::consts::PI / 4.0 * height * height / self.aspect).min(1.0)
    }

    /// The height of something by the height of the screen: `size` and `distance` in world units.
    pub fn height(&self, size: f64, distance: f64) -> f64 {
        size / (2.0 * distance * (self.fov.to_radians() / 2.0).tan())
    }
}

/// What the draws of a mesh look like, as a glTF file says it: entries of its tables as JSON texts, which are copied.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Looks {
    /// For each draw its material, an index into `materials`; what is missing has the default material.
    pub of_draws: Vec<Option<usize>>,
    /// Entries of `materials`.
    pub materials: Vec<String>,
    /// Entries of `textures`.
    pub textures: Vec<String>,
    /// Entries of `samplers`.
    pub samplers: Vec<String>,
    /// What `textures` name as their sources.
    pub images: Vec<Picture>,
    /// The extensions that these entries use.
    pub extensions: Vec<String>,
}

/// An image, as the bytes of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// What it is called.
    pub name: String,
    /// Its media type, such as `image/png`.
    pub kind: String,
    /// Its file.
    pub bytes: Vec<u8>,
}

/// The middle of the box around all vertices, the distance of the farthest one from there, and the longest side of the
/// box; zeros without vertices.
fn extent(mesh: &Mesh) -> ([f64; 3], f64, f64) {
    let points = || mesh.positions.iter().map(|p| p.map(f64::from));
    let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
    for p in points() {
        for axis in 0..3 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }
    if mesh.positions.is_empty() {
        return ([0.0; 3], 0.0, 0.0);
    }
    let centre = [0, 1, 2].map(|axis| (low[axis] + high[axis]) / 2.0);
    let side = (0..3).map(|axis| high[axis] - low[axis]);
    let squared = |p: [f64; 3]| -> f64 {
        let parts = (0..3).map(|axis| p[axis] - centre[axis]);
        parts.map(|x| x * x).sum()
    };
    let radius = points().map(squared).fold(0.0, f64::max).sqrt();
    (centre, radius, side.fold(0.0, f64::max))
}
