//! Blended scenes on the device: what is opaque, and then one layer after the other, from the nearest to the farthest.
//!
//! ```text
//! opaque draws --> colour, depth
//! blended draws, in front of that and behind the layer before --> layer: colour, depth, order     until one is empty
//! layer by layer, then what is opaque --add, finish--> premultiplied colour, coverage
//! ```
//!
//! Each layer holds, of the fragments that are left at a pixel, the nearest, of equally deep ones that of the last
//! triangle: the order in which the evaluator composes them, see `src/eval/draw/blend.rs`. So nothing is sorted, and
//! triangles may cut each other. It is done with integers, textures that are read, and arithmetic in a compute shader:
//! not every device blends floats of 32 bits.

use super::adapter::Gpu;
use super::compute;
use super::entry::{Behind, Targets};
use super::pass::{COLOUR, COVERED, DEPTH, Drawing, Images, Pass, Views, free};
use super::read::words_of;
use super::render::{Drawn, Stages};
use super::resources::{Uploads, buffer};
use crate::Result;
use crate::eval::draw::{Blend, state_of};
use crate::eval::raster::Frame;
use crate::scene::{Output, Scene};
use wgpu::{
    BindingType, BufferBindingType, BufferUsages, CompareFunction, StorageTextureAccess,
    TextureFormat, TextureUsages, TextureViewDimension,
};

/// The edge of a workgroup, in fine pixels.
const EDGE: u32 = 8;

/// How a blending is numbered in a fragment's order.
pub(super) fn number(blend: Blend) -> u32 {
    match blend {
        Blend::Opaque => 0,
        Blend::Alpha => 1,
        Blend::Premultiplied => 2,
        Blend::Additive => 3,
    }
}

/// The same as a device blends, where colour and coverage are drawn to one target; `None` where nothing is blended.
pub(super) fn by_device(blend: Blend) -> Option<wgpu::BlendState> {
    use wgpu::BlendFactor::{One, OneMinusSrcAlpha, SrcAlpha, Zero};
    let component = |src_factor, dst_factor| wgpu::BlendComponent {
        src_factor,
        dst_factor,
        operation: wgpu::BlendOperation::Add,
    };
    let over = component(One, OneMinusSrcAlpha);
    let (color, alpha) = match blend {
        Blend::Opaque => return None,
        Blend::Alpha => (component(SrcAlpha, OneMinusSrcAlpha), over),
        Blend::Premultiplied => (over, over),
        Blend::Additive => (component(SrcAlpha, One), component(Zero, One)),
    };
    Some(wgpu::BlendState { color, alpha })
}

/// A shader in a scene that blends, compiled.
#[derive(Debug)]
pub(super) struct Blended {
    /// Where there are opaque draws.
    opaque: Option<Pass>,
    layers: Pass,
    behind: Behind,
    composition: Composition,
}

impl Blended {
    /// Compiles a shader for a scene some of whose draws are blended.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub(super) fn new(gpu: &Gpu, stages: Stages<'_>, scene: &Scene) -> Result<Self> {
        let mut states = scene.states.iter();
        let drawing = Drawing {
            targets: Targets {
                writes_depth: true,
                ..Drawing::forward().targets
            },
            fronts: scene.states.iter().any(|state| state.front_only),
            ..Drawing::forward()
        };
        let opaque = states.any(|state| state.blend == Blend::Opaque);
        let opaque = opaque.then(|| Pass::new(gpu, stages, drawing.clone()));
        let behind = Behind {
            opaque: free(&stages, 1),
            depth: free(&stages, 2),
            order: free(&stages, 3),
            tells_triangles: gpu.tells_triangles(),
        };
        let layers = Drawing {
            targets: Targets {
                layer: Some(behind),
                ..drawing.targets
            },
            reads: [
                (behind.opaque, DEPTH),
                (behind.depth, DEPTH),
                (behind.order, COVERED),
            ]
            .into(),
            depth: Some(CompareFunction::LessEqual),
            ..drawing
        };
        Ok(Self {
            opaque: opaque.transpose()?,
            layers: Pass::new(gpu, stages, layers)?,
            behind,
            composition: Composition::new(gpu),
        })
    }

    /// Draws a frame.
    ///
    /// # Errors
    /// When the frame lacks what the shader reads, or the device was lost.
    pub(super) fn draw(
        &self,
        gpu: &Gpu,
        uploads: &mut Uploads,
        frame: &Frame,
        output: Output,
    ) -> Result<Drawn> {
        let images = || self.layers.images(gpu, frame);
        let (opaque, mut last, mut layer) = (images(), images(), images());
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        match &self.opaque {
            Some(pass) => {
                let draws = (frame, false);
                pass.draw((gpu, uploads), draws, &Views::new(), &opaque, &mut encoder)?;
            }
            None => drop(opaque.cleared(wgpu::Color::TRANSPARENT, 1.0, &mut encoder)),
        }
        // In front of everything.
        let later_than_all = wgpu::Color {
            r: u32::MAX.into(),
            ..wgpu::Color::TRANSPARENT
        };
        drop(last.cleared(later_than_all, 0.0, &mut encoder));
        gpu.queue().submit([encoder.finish()]);

        let size = [frame.width, frame.height].map(|edge| edge * frame.grid);
        let mut told = Told {
            size,
            clamped: !matches!(output, Output::Linear { .. }),
            first: true,
        };
        let found = self.composition.found(gpu);
        let (mut before, mut then) = (State::new(gpu, size), State::new(gpu, size));
        // There are no more layers than triangles.
        for _ in 0..triangles(frame) {
            let mut encoder = gpu.device().create_command_encoder(&Default::default());
            let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
            let reads = [
                (self.behind.opaque, opaque.depth.as_ref().map(view)),
                (self.behind.depth, last.depth.as_ref().map(view)),
                (self.behind.order, Some(view(&last.covered))),
            ];
            let reads: Views = reads
                .into_iter()
                .filter_map(|(at, view)| Some((at, view?)))
                .collect();
            let draws = (frame, true);
            self.layers
                .draw((gpu, uploads), draws, &reads, &layer, &mut encoder)?;
            encoder.clear_buffer(&found, 0, None);
            let pipeline = &self.composition.add;
            self.composition.run(
                gpu,
                pipeline,
                told,
                (&layer, &before, &then, &found),
                &mut encoder,
            );
            gpu.queue().submit([encoder.finish()]);
            if words_of(gpu, &found)?.iter().all(|count| *count == 0) {
                break;
            }
            told.first = false;
            std::mem::swap(&mut before, &mut then);
            std::mem::swap(&mut last, &mut layer);
        }
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let pipeline = &self.composition.finish;
        self.composition.run(
            gpu,
            pipeline,
            told,
            (&opaque, &before, &then, &found),
            &mut encoder,
        );
        gpu.queue().submit([encoder.finish()]);
        Ok(Drawn {
            colour: then.composed,
            covered: then.kept,
            blends: true,
        })
    }
}

/// How many triangles of a frame are blended.
fn triangles(frame: &Frame) -> usize {
    let draws = frame.mesh.draws();
    let draws = draws.iter().enumerate();
    let blended =
        draws.filter(|(number, _)| state_of(&frame.states, *number).blend != Blend::Opaque);
    blended.map(|(_, draw)| draw.triangles.len()).sum()
}

/// What is composed of the layers so far.
#[derive(Debug)]
struct State {
    /// Premultiplied colour and coverage.
    composed: wgpu::Texture,
    /// How much of what is behind is still seen; of a whole picture 1 where there is anything.
    kept: wgpu::Texture,
}

impl State {
    fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let usage = TextureUsages::STORAGE_BINDING
            | TextureUsages::TEXTURE_BINDING
            | TextureUsages::COPY_SRC;
        let image = |format| gpu.image(size, format, usage);
        Self {
            composed: image(COLOUR),
            kept: image(COVERED),
        }
    }
}

/// What a dispatch is told: `Told` of the shader.
#[derive(Clone, Copy, Debug)]
struct Told {
    size: [u32; 2],
    clamped: bool,
    first: bool,
}

/// The pipelines that compose layers.
#[derive(Debug)]
struct Composition {
    layout: wgpu::BindGroupLayout,
    add: wgpu::ComputePipeline,
    finish: wgpu::ComputePipeline,
}

impl Composition {
    fn new(gpu: &Gpu) -> Self {
        let device = gpu.device();
        let module = device.create_shader_module(wgpu::include_wgsl!("blend.wgsl"));
        let written = |format: TextureFormat| BindingType::StorageTexture {
            access: StorageTextureAccess::WriteOnly,
            format,
            view_dimension: TextureViewDimension::D2,
        };
        let types = [
            compute::buffer(BufferBindingType::Uniform),
            compute::WORDS,
            compute::WORDS,
            compute::WORDS,
            compute::WORDS,
            written(COLOUR),
            written(COVERED),
            compute::buffer(BufferBindingType::Storage { read_only: false }),
        ];
        let (layout, [add, finish]) =
            compute::pipelines(device, &module, &types, ["add", "finish"]);
        Self {
            add,
            finish,
            layout,
        }
    }

    /// Room for the number of a layer's fragments.
    fn found(&self, gpu: &Gpu) -> wgpu::Buffer {
        gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 4,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// Runs a pipeline over all pixels of what was drawn.
    fn run(
        &self,
        gpu: &Gpu,
        pipeline: &wgpu::ComputePipeline,
        told: Told,
        (drawn, before, then, found): (&Images, &State, &State, &wgpu::Buffer),
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let [width, height] = told.size;
        let words = [width, height, told.clamped.into(), told.first.into()];
        let bytes: Vec<u8> = words
            .iter()
            .flat_map(|word: &u32| word.to_le_bytes())
            .collect();
        let told = buffer(gpu, &bytes, BufferBindingType::Uniform);
        let textures = [
            &drawn.colours[0],
            &drawn.covered,
            &before.composed,
            &before.kept,
            &then.composed,
            &then.kept,
        ];
        let views = textures.map(|texture| texture.create_view(&Default::default()));
        let views = views.iter().map(wgpu::BindingResource::TextureView);
        let resources = std::iter::once(told.as_entire_binding())
            .chain(views)
            .chain([found.as_entire_binding()]);
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bound = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries,
        });
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bound, &[]);
        pass.dispatch_workgroups(width.div_ceil(EDGE), height.div_ceil(EDGE), 1);
    }
}
