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
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// A full-screen shader and what it reads of a material.
#[derive(Debug)]
pub struct Lighting {
    vertex: Program,
    fragment: Program,
    reads: Vec<((u32, u32), Plane)>,
    /// Clear images of each size that are not in use: one texture for each of `reads`. Most of an image is never
    /// written to, so that making it anew would cost more than lighting some of its pixels.
    spare: Mutex<BTreeMap<[u32; 2], Vec<GBuffer>>>,
}

/// A texture for each of a lighting's reads.
type GBuffer = Vec<Arc<Texture>>;

/// Pixels of the largest images that are kept for another use; a reference's are larger, and drawn once.
const KEPT: usize = 1 << 19;

impl Lighting {
    /// A vertex and a fragment program, whose picture is the colour at location 0, and the textures that hold what
    /// the material wrote: group, binding, and what.
    pub fn new(vertex: Program, fragment: Program, reads: Vec<((u32, u32), Plane)>) -> Self {
        Self {
            vertex,
            fragment,
            reads,
            spare: Mutex::default(),
        }
    }

    /// What it reads of the material: group, binding, and what.
    pub fn reads(&self) -> &[((u32, u32), Plane)] {
        &self.reads
    }

    /// Images in which nothing is drawn.
    fn clear(&self, [width, height]: [u32; 2]) -> GBuffer {
        let spare = self.spare.lock().ok().and_then(|mut spare| {
            let images = spare.get_mut(&[width, height])?;
            images.pop()
        });
        let texture = |(_, plane): &(_, Plane)| {
            let image = Image {
                width,
                height,
                texels: vec![plane.cleared(); width as usize * height as usize],
            };
            let texture = Texture::new(Dimension::D2, vec![image]);
            Arc::new(texture.expect("one image that is not empty is a texture"))
        };
        spare.unwrap_or_else(|| self.reads.iter().map(texture).collect())
    }

    /// Takes images back that are clear again.
    fn keep(&self, size: [u32; 2], images: GBuffer) {
        if size[0] as usize * size[1] as usize <= KEPT
            && let Ok(mut spare) = self.spare.lock()
        {
            spare.entry(size).or_default().push(images);
        }
    }
}

/// One image of a G-buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// What the material returns at a location, in a format.
    Target(u32, Format),
    /// The depth, 0..1.
    Depth,
}

impl Plane {
    /// What it holds where nothing is drawn.
    fn cleared(self) -> [f32; 4] {
        match self {
            Self::Target(_, format) => format.store([0.0; 4]),
            Self::Depth => [1.0, 0.0, 0.0, 1.0],
        }
    }
}

/// The lighting of one frame, made ready: which fragments of the screen are lit.
#[derive(Debug)]
pub struct Lit {
    lighting: Arc<Lighting>,
    /// What the lighting reads besides the G-buffer.
    bindings: Bindings,
    screen: Coverage,
    /// The pixels that the material may cover, sorted.
    pixels: Vec<u32>,
    /// For each fragment of the material, its pixel's place in `pixels`.
    places: Vec<u32>,
    /// For each of `pixels`, the fragment of the screen that lights it.
    lights: Vec<Option<u32>>,
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
        let mut pixels: Vec<u32> = material.pixels().collect();
        pixels.sort_unstable();
        pixels.dedup();
        let square = |pixel: u32| (pixel % screen.width / 2, pixel / screen.width / 2);
        let mut squares: Vec<(u32, u32)> = pixels.iter().map(|pixel| square(*pixel)).collect();
        squares.sort_unstable();
        let screen = screen.part(|square| squares.binary_search(&square).is_ok());
        let place = |pixel: u32| pixels.binary_search(&pixel).ok();
        let mut lights = vec![None; pixels.len()];
        for (fragment, pixel) in (0..).zip(screen.pixels()) {
            if let Some(place) = place(pixel) {
                // A stage that draws more than the screen may cover a pixel twice; both show the same.
                lights[place].get_or_insert(fragment);
            }
        }
        // Every pixel of the material is among them.
        let places = material.pixels().map(|p| place(p).unwrap_or(0) as u32);
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
            places: places.collect(),
            lights,
            depths: depths.collect(),
            locations,
            lighting: lighting.clone(),
            screen,
            pixels,
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
        let locations = &self.locations;
        shade_targets(material, coverage, bindings, locations, None, shading);
        let seen = self.seen(coverage, shading);
        let size = [coverage.width, coverage.height];
        let mut images = self.lighting.clear(size);
        for ((_, plane), image) in self.lighting.reads.iter().zip(&mut images) {
            self.draw(*plane, &seen, shading, image);
        }
        let mut lit_bindings = self.bindings.clone();
        for ((at, _), image) in self.lighting.reads.iter().zip(&images) {
            lit_bindings.insert(*at, Resource::Texture(image.clone()));
        }
        let mut lit = Shading::default();
        let fragment = &self.lighting.fragment;
        shade_into(fragment, &self.screen, &lit_bindings, &mut lit);
        drop(lit_bindings);
        for ((_, plane), image) in self.lighting.reads.iter().zip(&mut images) {
            self.write(image, |_| plane.cleared());
        }
        self.lighting.keep(size, images);
        for (fragment, place) in self.places.iter().enumerate() {
            let light = self.lights[*place as usize].map(|light| light as usize);
            match light.filter(|light| lit.alive[*light]) {
                Some(light) => shading.colours[fragment] = lit.colours[light],
                None => shading.alive[fragment] = false,
            }
        }
    }

    /// The fragment that is seen at each of the pixels.
    fn seen(&self, coverage: &Coverage, shading: &Shading) -> Vec<Option<usize>> {
        let mut seen = vec![None; self.pixels.len()];
        each_visible(
            coverage,
            shading,
            self.pixels.len(),
            |fragment, _| self.places[fragment],
            |place, fragment| seen[place as usize] = Some(fragment),
        );
        seen
    }

    /// Draws what is seen into an image.
    fn draw(
        &self,
        plane: Plane,
        seen: &[Option<usize>],
        shading: &Shading,
        image: &mut Arc<Texture>,
    ) {
        match plane {
            Plane::Depth => self.write(image, |place| match seen[place] {
                Some(fragment) => {
                    let own = shading.depths.get(fragment);
                    let depth = own.unwrap_or(&self.depths[fragment]);
                    // Clamped to the viewport's range; NaN is 0.
                    let shown = if depth.is_nan() {
                        0.0
                    } else {
                        depth.clamp(0.0, 1.0)
                    };
                    [shown, 0.0, 0.0, 1.0]
                }
                None => plane.cleared(),
            }),
            Plane::Target(location, format) => {
                let target = self.locations.iter().position(|have| *have == location);
                let values = target.and_then(|target| shading.targets.get(target));
                self.write(image, |place| match (seen[place], values) {
                    (Some(fragment), Some(values)) => format.store(values[fragment]),
                    _ => plane.cleared(),
                });
            }
        }
    }

    /// Writes each of the pixels of an image, by its place.
    fn write(&self, image: &mut Arc<Texture>, texel: impl Fn(usize) -> [f32; 4]) {
        let texels = Arc::make_mut(image).texels_mut();
        for (place, pixel) in self.pixels.iter().enumerate() {
            texels[*pixel as usize] = texel(place);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::draw::tests::program_of;
    use crate::eval::draw::{resolve, shade};
    use crate::eval::raster::Attribute;
    use crate::scene::mesh::Mesh;
    use crate::scene::objects::Object;

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

    fn program(entry: &str) -> Program {
        program_of(SHADERS, entry)
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
            states: Arc::default(),
            shot: Default::default(),
            baked: Default::default(),
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
        let reads = vec![
            ((0, 0), target(0, "rgba8unorm")),
            ((0, 1), target(2, "rg16float")),
            ((0, 2), Plane::Depth),
        ];
        let lighting = Arc::new(Lighting::new(program("screen"), program(fragment), reads));
        let material = program("material");
        let drawn = frame(half(), 8, grid);
        let coverage = rasterize(&program("vertex"), &material, &drawn);
        let screen = frame(Object::Screen.mesh(0), 8 * grid, 1);
        let lit = Lit::new(&lighting, screen, &coverage);
        let mut shading = Shading::default();
        lit.shade_into(&material, &coverage, &drawn.bindings, &mut shading);
        let first = shading.clone();
        // Into the same images again.
        lit.shade_into(&material, &coverage, &drawn.bindings, &mut shading);
        assert_eq!(first, shading);
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
