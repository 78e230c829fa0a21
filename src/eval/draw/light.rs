//! Deferred lighting: a full-screen shader that reads what a material wrote.
//!
//! ```text
//! Coverage x material --shade--> what it returns at each location
//!   --nearest--> G-buffer, in the formats of its targets     Coverage of the screen x lighting --shade--> colours
//! ```
//!
//! The G-buffer holds what a host's would: 0 where nothing was drawn, and a depth of 1. The lighting runs in whole
//! quads, so that its derivatives are those of a full-screen pass.

use super::{Format, Shading, each_visible, shade_into, shade_targets};
use crate::eval::image::Image;
use crate::eval::machine::{Bindings, Resource};
use crate::eval::program::Program;
use crate::eval::raster::{Coverage, Frame, rasterize};
use crate::eval::texture::{Dimension, Texture};
use std::sync::Arc;

/// A full-screen shader and what it reads of a material.
#[derive(Clone, Debug)]
pub struct Lighting {
    /// Its vertex stage.
    pub vertex: Arc<Program>,
    /// Its fragment stage; the picture is its colour at location 0.
    pub fragment: Arc<Program>,
    /// The textures that hold what the material wrote: group, binding, and what.
    pub reads: Vec<((u32, u32), Plane)>,
}

/// One image of a G-buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// What the material returns at a location, in a format.
    Target(u32, Format),
    /// The depth, 0..1.
    Depth,
}

/// The lighting of one frame, made ready: which fragments of the screen are lit.
#[derive(Clone, Debug)]
pub struct Lit {
    lighting: Arc<Lighting>,
    /// What the lighting reads besides the G-buffer.
    bindings: Bindings,
    screen: Coverage,
    /// For each fragment of the material, the fragment of the screen that lights it.
    places: Vec<Option<u32>>,
    /// The depth of each fragment of the material.
    depths: Vec<f32>,
    /// The locations that are read.
    locations: Vec<u32>,
}

impl Lit {
    /// Finds the fragments of a full-screen `frame` that light those of a material's coverage. The frame has the
    /// coverage's fine pixels as its pixels.
    ///
    /// # Panics
    /// When the sizes differ, or a resource of the lighting's vertex stage is not bound.
    pub fn new(lighting: &Arc<Lighting>, frame: Frame, material: &Coverage) -> Self {
        let screen = rasterize(&lighting.vertex, &lighting.fragment, &frame);
        assert_eq!(
            (screen.width, screen.height),
            (material.width, material.height),
            "the lighting has a pixel for each fine pixel"
        );
        let squares = |pixel: u32| {
            let (x, y) = (pixel % screen.width / 2, pixel / screen.width / 2);
            (y * screen.width.div_ceil(2) + x) as usize
        };
        let count = screen.width.div_ceil(2) as usize * screen.height.div_ceil(2) as usize;
        let mut wanted = vec![false; count];
        for pixel in material.pixels() {
            wanted[squares(pixel)] = true;
        }
        let screen = screen.part(|(x, y)| wanted[(y * screen.width.div_ceil(2) + x) as usize]);
        let mut lights = vec![None; screen.width as usize * screen.height as usize];
        for (fragment, pixel) in (0..).zip(screen.pixels()) {
            // Two triangles cover a pixel twice where a stage draws more than the screen; both show the same.
            lights[pixel as usize].get_or_insert(fragment);
        }
        let locations = lighting.reads.iter().filter_map(|(_, plane)| match plane {
            Plane::Target(location, _) => Some(*location),
            Plane::Depth => None,
        });
        let mut locations: Vec<u32> = locations.collect();
        locations.sort_unstable();
        locations.dedup();
        let blocks = material.blocks.iter();
        let depths = blocks.flat_map(|block| block.covered.lanes().map(|lane| block.depths[lane]));
        Self {
            bindings: frame.bindings,
            places: material.pixels().map(|p| lights[p as usize]).collect(),
            depths: depths.collect(),
            locations,
            lighting: lighting.clone(),
            screen,
        }
    }

    /// Shades a material and lights what is seen of it: each fragment's colour becomes that of its pixel once lit,
    /// and a pixel that the lighting does not write is not covered. The profile is the material's. The coverage is
    /// the one that this was made for.
    ///
    /// # Panics
    /// When a resource of a program is not bound.
    pub fn shade_into(
        &self,
        material: &Program,
        coverage: &Coverage,
        bindings: &Bindings,
        shading: &mut Shading,
    ) {
        shade_targets(material, coverage, bindings, &self.locations, shading);
        let mut lit_bindings = self.bindings.clone();
        for ((at, _), texture) in self
            .lighting
            .reads
            .iter()
            .zip(self.planes(coverage, shading))
        {
            lit_bindings.insert(*at, Resource::Texture(Arc::new(texture)));
        }
        let mut lit = Shading::default();
        shade_into(
            &self.lighting.fragment,
            &self.screen,
            &lit_bindings,
            &mut lit,
        );
        for (fragment, place) in self.places.iter().enumerate() {
            match place
                .map(|place| place as usize)
                .filter(|place| lit.alive[*place])
            {
                Some(place) => shading.colours[fragment] = lit.colours[place],
                None => shading.alive[fragment] = false,
            }
        }
    }

    /// The images that the lighting reads, of the fragments that are seen.
    fn planes(&self, coverage: &Coverage, shading: &Shading) -> Vec<Texture> {
        let pixels = coverage.width as usize * coverage.height as usize;
        let mut nearest = vec![None; pixels];
        each_visible(
            coverage,
            shading,
            pixels,
            |_, pixel| pixel,
            |pixel, fragment| nearest[pixel as usize] = Some(fragment),
        );
        let reads = self.lighting.reads.iter();
        let image = |plane: &Plane| -> Vec<[f32; 4]> {
            let seen = nearest.iter();
            match *plane {
                Plane::Depth => {
                    let depth = |&fragment: &usize| {
                        let own = shading.depths.get(fragment);
                        // Clamped to the viewport's range; NaN is 0.
                        own.unwrap_or(&self.depths[fragment]).max(0.0).min(1.0)
                    };
                    seen.map(|fragment| [fragment.as_ref().map_or(1.0, depth), 0.0, 0.0, 1.0])
                        .collect()
                }
                Plane::Target(location, format) => {
                    let target = self.locations.iter().position(|have| *have == location);
                    let values = target.and_then(|target| shading.targets.get(target));
                    let stored = |&fragment: &usize| {
                        values.map_or([0.0; 4], |values| format.store(values[fragment]))
                    };
                    let cleared = format.store([0.0; 4]);
                    seen.map(|fragment| fragment.as_ref().map_or(cleared, stored))
                        .collect()
                }
            }
        };
        let texture = |(_, plane): &(_, Plane)| {
            let image = Image {
                width: coverage.width,
                height: coverage.height,
                texels: image(plane),
            };
            Texture::new(Dimension::D2, vec![image])
                .expect("one image that is not empty is a texture")
        };
        reads.map(texture).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::draw::{resolve, shade};
    use crate::eval::raster::Attribute;
    use crate::scene::mesh::Mesh;
    use crate::scene::objects::Object;
    use std::collections::BTreeMap;

    const SHADERS: &str = "
struct Varyings { @builtin(position) position: vec4f, @location(0) uv: vec2f }
struct Outputs { @location(0) albedo: vec4f, @location(2) normal: vec2f }
@vertex fn vertex(@location(0) position: vec3f) -> Varyings {
    return Varyings(vec4f(position, 1.0), 0.5 + 0.5 * position.xy);
}
@fragment fn material(in: Varyings) -> Outputs {
    if in.position.x < 2.0 && in.position.y < 2.0 { discard; }
    return Outputs(vec4f(in.uv, 2.0, 1.0), floor(in.position.xy));
}
@vertex fn screen(@builtin(vertex_index) i: u32) -> Varyings {
    let uv = vec2f(f32((i << 1u) & 2u), f32(i & 2u));
    return Varyings(vec4f(2.0 * uv - 1.0, 0.0, 1.0) * vec4f(1.0, -1.0, 1.0, 1.0), uv);
}
@group(0) @binding(0) var albedo: texture_2d<f32>;
@group(0) @binding(1) var normal: texture_2d<f32>;
@group(0) @binding(2) var depth: texture_depth_2d;
@fragment fn read(in: Varyings) -> @location(0) vec4f {
    let at = vec2i(in.position.xy);
    return vec4f(textureLoad(albedo, at, 0).xz, textureLoad(normal, at, 0).y, textureLoad(depth, at, 0));
}
@fragment fn right_of(in: Varyings) -> @location(0) vec4f {
    let at = vec2i(in.position.xy) + vec2i(1, 0);
    return vec4f(textureLoad(normal, at, 0).xy, textureLoad(depth, at, 0), textureLoad(albedo, at, 0).w);
}
@fragment fn slope(in: Varyings) -> @location(0) vec4f {
    let here = textureLoad(normal, vec2i(in.position.xy), 0).x;
    if in.uv.y < 0.3 { discard; }
    return vec4f(dpdxFine(here), in.uv * vec2f(textureDimensions(normal)), 1.0);
}";

    fn program(entry: &str) -> Arc<Program> {
        let module = naga::front::wgsl::parse_str(SHADERS).unwrap();
        naga::valid::Validator::new(Default::default(), naga::valid::Capabilities::all())
            .validate(&module)
            .unwrap();
        let entry = module.entry_points.iter().position(|e| e.name == entry);
        Arc::new(Program::compile(&module, entry.unwrap(), &[]).unwrap())
    }

    fn frame(mesh: Mesh, size: u32, grid: u32) -> Frame {
        Frame {
            mesh: Arc::new(mesh),
            attributes: BTreeMap::from([(0, Attribute::Position)]),
            bindings: Bindings::new(),
            width: size,
            height: size,
            offset: [0.0; 2],
            grid,
        }
    }

    /// The lower left half of the picture, at a depth of 0.5.
    fn half() -> Mesh {
        Mesh {
            positions: vec![[-1.0, 1.0, 0.5], [-1.0, -1.0, 0.5], [1.0, -1.0, 0.5]],
            indices: vec![0, 1, 2],
            ..Mesh::default()
        }
    }

    /// The lit material in 8 x 8 pixels of so many fine ones, as its coverage and its shading.
    fn lit(fragment: &str, grid: u32) -> (Coverage, Shading) {
        let target = |location, name| Plane::Target(location, Format::of_name(name).unwrap());
        let lighting = Arc::new(Lighting {
            vertex: program("screen"),
            fragment: program(fragment),
            reads: vec![
                ((0, 0), target(0, "rgba8unorm")),
                ((0, 1), target(2, "rg16float")),
                ((0, 2), Plane::Depth),
            ],
        });
        let material = program("material");
        let drawn = frame(half(), 8, grid);
        let coverage = rasterize(&program("vertex"), &material, &drawn);
        let screen = frame(Object::Screen.mesh(0), 8 * grid, 1);
        let lit = Lit::new(&lighting, screen, &coverage);
        let mut shading = Shading::default();
        lit.shade_into(&material, &coverage, &drawn.bindings, &mut shading);
        assert_eq!(
            shading.profile.lanes,
            shade(&material, &coverage, &drawn.bindings).profile.lanes
        );
        (coverage, shading)
    }

    #[test]
    fn the_lighting_reads_what_the_material_wrote_in_the_targets_formats() {
        for grid in [1, 4] {
            let (coverage, shading) = lit("read", grid);
            let picture = resolve(&coverage, &shading);
            for (i, pixel) in picture.pixels.iter().enumerate() {
                let (x, y) = (i as u32 % (8 * grid), i as u32 / (8 * grid));
                // Below the diagonal, but for the corner that is discarded.
                let drawn = x < y && !(x < 2 * grid && y < 2 * grid);
                assert_eq!(picture.covered[i], f32::from(drawn), "{x} {y}");
                if !drawn {
                    continue;
                }
                let u = (x as f32 + 0.5) / (8 * grid) as f32;
                let steps = (u * 255.0).round_ties_even() / 255.0;
                // The position of the material is in pixels.
                let row = (y / grid) as f32;
                assert_eq!(*pixel, [steps, 1.0, row, 0.5], "{x} {y}");
            }
        }
    }

    #[test]
    fn beside_the_object_the_targets_are_clear() {
        let (coverage, shading) = lit("right_of", 1);
        let picture = resolve(&coverage, &shading);
        let at = |x: usize, y: usize| picture.pixels[8 * y + x];
        assert_eq!(at(2, 6), [3.0, 6.0, 0.5, 1.0]);
        // The diagonal is beside the object.
        assert_eq!(at(4, 5), [0.0, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn derivatives_cross_the_objects_edge_and_discards_uncover() {
        let (coverage, shading) = lit("slope", 1);
        let picture = resolve(&coverage, &shading);
        let at = |x: usize, y: usize| picture.pixels[8 * y + x];
        assert_eq!(at(2, 6), [1.0, 2.5, 6.5, 1.0]);
        // The pixel to the right of this one is not drawn: its target is clear.
        assert_eq!(at(4, 5)[0], -4.0);
        // v is below 0.3 in the upper rows: nothing is shown there.
        assert!(picture.covered[..2 * 8].iter().all(|c| *c == 0.0));
        assert_eq!(picture.covered[8 * 3], 1.0);
    }
}
