//! What a program does with its materials on a device: binds what the module says, draws the level that the distance asks for, and
//! sees the colours that the shader says.
//!
//! Without an adapter it is skipped, aloud; where `CI` is set that is a failure.

use sample::{board, wall};
use wgpu::util::DeviceExt;

/// The edge of the pictures, which is that of those that levels were made for.
const EDGE: u32 = 64;

/// The vertical field of view, degrees.
const FOV: f32 = 45.0;

/// The format of pictures: what the shader returns, not rounded.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

const TEXEL: [f32; 3] = [0.8, 0.6, 0.4];
const DIRT: f32 = 0.25;

/// A wall in front of the eye: position, normal, texture coordinates.
const WALL: [[f32; 8]; 4] = [
    [-0.7, -0.7, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0],
    [0.7, -0.7, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
    [-0.7, 0.7, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    [0.7, 0.7, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0],
];

/// A binding of a material, as wgpu has it.
struct Slot {
    name: &'static str,
    group: u32,
    entry: wgpu::BindGroupLayoutEntry,
}

/// The bindings of a material that a draw reads. Each material's module has types of its own.
macro_rules! slots {
    ($material:ident) => {
        $material::BINDINGS
            .iter()
            .filter(|b| b.vertex || b.fragment)
            .map(|b| Slot {
                name: b.name,
                group: b.group,
                entry: wgpu::BindGroupLayoutEntry {
                    binding: b.binding,
                    visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                    ty: match b.kind {
                        $material::Kind::Uniform(_) => wgpu::BindingType::Buffer {
                            ty: wgpu::BufferBindingType::Uniform,
                            has_dynamic_offset: false,
                            min_binding_size: None,
                        },
                        $material::Kind::Texture {
                            dimension: $material::Dimension::D2,
                            texels: $material::Texels::Float,
                            is_multisampled: false,
                        } => wgpu::BindingType::Texture {
                            sample_type: wgpu::TextureSampleType::Float { filterable: true },
                            view_dimension: wgpu::TextureViewDimension::D2,
                            multisampled: false,
                        },
                        $material::Kind::Sampler { .. } => {
                            wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)
                        }
                        other => panic!("{}: {other:?}", b.name),
                    },
                    count: None,
                },
            })
            .collect::<Vec<Slot>>()
    };
}

struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
}

impl Gpu {
    /// The best adapter; `None` when there is none, which is said.
    fn open() -> Option<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = match pollster::block_on(instance.request_adapter(&Default::default())) {
            Ok(adapter) => adapter,
            Err(error) => {
                assert!(std::env::var_os("CI").is_none(), "{error}");
                println!("SKIPPED: {error}");
                return None;
            }
        };
        let opened = pollster::block_on(adapter.request_device(&Default::default()));
        let (device, queue) = opened.expect("the adapter gives a device");
        Some(Self { device, queue })
    }

    fn buffer(&self, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device
            .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: None,
                contents,
                usage,
            })
    }

    /// The colour in the middle of a picture of the wall. `fill` has the bytes of each buffer, and of each texture its one texel.
    fn drawn(
        &self,
        shader: &str,
        constants: &[(&str, f64)],
        slots: &[Slot],
        fill: &dyn Fn(&str) -> Vec<u8>,
    ) -> [f32; 4] {
        let device = &self.device;
        let (mut layouts, mut groups) = (Vec::new(), Vec::new());
        for group in 0..=1 {
            let slots = slots.iter().filter(|slot| slot.group == group);
            let entries: Vec<_> = slots.clone().map(|slot| slot.entry).collect();
            let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: None,
                entries: &entries,
            });
            let buffers = slots.clone().filter_map(|slot| match slot.entry.ty {
                wgpu::BindingType::Buffer { .. } => {
                    let uniform = wgpu::BufferUsages::UNIFORM;
                    Some((slot.entry.binding, self.buffer(&fill(slot.name), uniform)))
                }
                _ => None,
            });
            let buffers: Vec<_> = buffers.collect();
            let textures = slots.filter_map(|slot| match slot.entry.ty {
                wgpu::BindingType::Texture { .. } => {
                    Some((slot.entry.binding, self.texel(&fill(slot.name))))
                }
                _ => None,
            });
            let textures: Vec<_> = textures.collect();
            let sampler = device.create_sampler(&Default::default());
            let entry = |entry: &wgpu::BindGroupLayoutEntry| {
                let binding = entry.binding;
                let buffer = buffers.iter().find(|(at, _)| *at == binding);
                let texture = textures.iter().find(|(at, _)| *at == binding);
                let resource = match (buffer, texture) {
                    (Some((_, buffer)), _) => buffer.as_entire_binding(),
                    (_, Some((_, view))) => wgpu::BindingResource::TextureView(view),
                    _ => wgpu::BindingResource::Sampler(&sampler),
                };
                wgpu::BindGroupEntry { binding, resource }
            };
            let entries: Vec<_> = entries.iter().map(entry).collect();
            groups.push(device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &layout,
                entries: &entries,
            }));
            layouts.push(layout);
        }
        let layouts: Vec<_> = layouts.iter().map(Some).collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(shader.into()),
        });
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants,
            ..Default::default()
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vs_main"),
                compilation_options: compilation_options.clone(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: size_of_val(&WALL[0]) as u64,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2],
                })],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                ..Default::default()
            },
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fs_main"),
                compilation_options,
                targets: &[Some(FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let target = self.texture(
            EDGE,
            FORMAT,
            wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        );
        let vertices = self.buffer(bytemuck::cast_slice(&WALL), wgpu::BufferUsages::VERTEX);
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        for (at, group) in (0..).zip(&groups) {
            pass.set_bind_group(at, group, &[]);
        }
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.draw(0..4, 0..1);
        drop(pass);
        let row = EDGE * 16;
        let copy = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row * EDGE),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            target.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &copy,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            target.size(),
        );
        self.queue.submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, .., |mapped| {
            mapped.expect("it can be read");
        });
        let waited = device.poll(wgpu::PollType::wait_indefinitely());
        waited.expect("the device is there");
        let bytes = copy.get_mapped_range(..).expect("it is mapped");
        let pixels: &[[f32; 4]] = bytemuck::cast_slice(&bytes);
        pixels[(EDGE / 2 * EDGE + EDGE / 2) as usize]
    }

    fn texture(
        &self,
        edge: u32,
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: edge,
                height: edge,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    /// A texture of one texel.
    fn texel(&self, bytes: &[u8]) -> wgpu::TextureView {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = self.texture(1, wgpu::TextureFormat::Rgba8Unorm, usage);
        self.queue.write_texture(
            texture.as_image_copy(),
            bytes,
            wgpu::TexelCopyBufferLayout::default(),
            texture.size(),
        );
        texture.create_view(&Default::default())
    }
}

fn texel([r, g, b]: [f32; 3]) -> Vec<u8> {
    [r, g, b, 1.0]
        .map(|channel| (channel * 255.0).round() as u8)
        .to_vec()
}

/// World to clip for an eye on the z axis.
fn view_projection(distance: f32) -> [[f32; 4]; 4] {
    let focal = 1.0 / (FOV.to_radians() / 2.0).tan();
    let (near, far) = (0.1, 100.0);
    let depth = far / (near - far);
    [
        [focal, 0.0, 0.0, 0.0],
        [0.0, focal, 0.0, 0.0],
        [0.0, 0.0, depth, -1.0],
        [0.0, 0.0, near * depth - distance * depth, distance],
    ]
}

/// What the middle of the picture shows of a plain wall.
fn seen(distance: f32) -> [f32; 3] {
    let focal = 1.0 / (FOV.to_radians() / 2.0).tan();
    // The picture's middle is a corner of its pixel.
    let off = distance / focal / EDGE as f32;
    [off, -off, 0.0]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: [f32; 3]) -> [f32; 3] {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

/// `fs_main` of `wall.wgsl` for a normal along z.
fn shaded(paint: &wall::buffers::Paint, at: [f32; 3], eye: [f32; 3], texel: [f32; 3]) -> [f32; 3] {
    let to_sun = unit(paint.sun);
    let to_eye = unit([0, 1, 2].map(|i| eye[i] - at[i]));
    let halfway = unit([0, 1, 2].map(|i| to_sun[i] + to_eye[i]));
    let diffuse = to_sun[2].max(0.0);
    let specular = halfway[2].max(0.0).powf(paint.gloss);
    let rim = paint.rim * (1.0 - to_eye[2].max(0.0)).powi(4);
    let (down, up) = ([0.10, 0.09, 0.08], [0.22, 0.27, 0.36]);
    [0, 1, 2].map(|i| {
        let base = texel[i] * paint.tint[i] * (1.0 + (DIRT - 1.0) * 0.3);
        let sky = (down[i] + up[i]) / 2.0;
        base * (diffuse + sky) + specular * diffuse + rim * sky
    })
}

#[test]
fn near_and_far_a_wall_is_drawn_at_the_level_of_its_distance() {
    let Some(gpu) = Gpu::open() else { return };
    let slots = slots!(wall);
    let paint = wall::buffers::Paint {
        tint: [0.9, 0.8, 0.7],
        gloss: 24.0,
        sun: [0.4, 0.8, 0.5],
        rim: 0.4,
    };
    let mut model = [[0.0; 4]; 4];
    (0..4).for_each(|k| model[k][k] = 1.0);
    let object = wall::Object {
        model,
        centre: [0.0; 3],
        radius: 1.0,
    };
    let mut level = None;
    for (distance, wanted) in [(2.0, 0), (22.0, 2)] {
        let eye = [0.0, 0.0, distance];
        let camera = wall::Camera {
            eye,
            fov: FOV,
            height: EDGE as f32,
            z_near: 0.1,
        };
        let chosen = wall::level(wall::auto_lod(&camera, &object), level);
        level = Some(chosen);
        assert_eq!(chosen, wanted);
        let constant = wall::AUTOLOD_CONSTANT.expect("a pipeline constant chooses");
        let picture = |level: usize, albedo: [f32; 3]| {
            let camera = wall::buffers::Camera {
                view_proj: view_projection(distance),
                eye,
                ..Default::default()
            };
            let constants = [(constant, f64::from(wall::level_value(level)))];
            gpu.drawn(wall::SHADER, &constants, &slots, &|name| match name {
                "camera" => bytemuck::bytes_of(&camera).to_vec(),
                "paint" => bytemuck::bytes_of(&paint).to_vec(),
                "albedo" => texel(albedo),
                "grime" => texel([DIRT; 3]),
                other => panic!("{other} is no buffer and no texture"),
            })
        };
        let drawn = picture(chosen, TEXEL);
        let original = shaded(&paint, seen(distance), eye, TEXEL);
        let apart = (0..3).map(|i| (drawn[i] - original[i]).abs());
        let apart = apart.fold(0.0, f32::max);
        // Every level but the original is something else, and reads the textures that the module says.
        let reads = wall::LEVELS[chosen].textures.contains(&"albedo");
        assert_eq!(
            chosen == 0,
            apart < 2e-3,
            "{distance}: {drawn:?} {original:?}"
        );
        assert_eq!(reads, picture(chosen, [0.1; 3]) != drawn, "{distance}");
        assert_ne!(picture(0, [0.1; 3]), picture(0, TEXEL), "{distance}");
    }
}

#[test]
fn a_level_reads_the_parameters_that_the_host_filled() {
    let Some(gpu) = Gpu::open() else { return };
    let slots = slots!(board);
    let eye = [0.0, 0.0, 10.0];
    let camera = board::buffers::Camera {
        view_proj: view_projection(eye[2]),
        eye,
        ..Default::default()
    };
    let paint = board::buffers::Paint {
        tint: [0.9, 0.8, 0.7],
        gloss: 24.0,
        sun: [0.4, 0.8, 0.5],
        rim: 0.4,
        ..Default::default()
    };
    let picture = |level: usize, block: &board::buffers::LodParameters| {
        let autolod = board::buffers::LevelOfDetail {
            autoLOD: board::level_value(level),
            ..Default::default()
        };
        gpu.drawn(board::SHADER, &[], &slots, &|name| match name {
            "camera" => bytemuck::bytes_of(&camera).to_vec(),
            "paint" => bytemuck::bytes_of(&paint).to_vec(),
            "level_of_detail" => bytemuck::bytes_of(&autolod).to_vec(),
            "parameters" => bytemuck::bytes_of(block).to_vec(),
            "albedo" => texel(TEXEL),
            "grime" => texel([DIRT; 3]),
            other => panic!("{other} is no buffer and no texture"),
        })
    };
    let filled = board::buffers::lod_parameters(&camera, &paint);
    let empty = board::buffers::LodParameters::default();
    assert_eq!(picture(0, &filled), picture(0, &empty));
    for level in [1, 2] {
        let drawn = picture(level, &filled);
        assert!(drawn.iter().all(|channel| channel.is_finite()), "{drawn:?}");
        assert_ne!(drawn, picture(level, &empty), "level {level}");
        assert_ne!(drawn, picture(0, &filled), "level {level}");
    }
}
