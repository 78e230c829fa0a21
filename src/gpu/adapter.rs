//! The adapters of this machine, one of them opened as a device, and what goes wrong on it as a diagnostic.

use crate::{Diagnostic, Result};
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::{Adapter, Backend, Backends, DeviceType, Features, Instance, InstanceDescriptor};

/// What an adapter is called: `llvmpipe (LLVM 15.0.6, 256 bits), Vulkan, software`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterLabel {
    /// The driver's own name for it.
    pub name: String,
    /// The interface that it is reached by: `Vulkan`, `OpenGL`, `Metal`, `Direct3D 12`.
    pub backend: &'static str,
    /// Whether it is a program that runs on the CPU, whose times say nothing about a GPU.
    pub software: bool,
    /// The driver and its version, as it says them.
    pub driver: String,
}

impl AdapterLabel {
    fn of(adapter: &Adapter) -> Self {
        let info = adapter.get_info();
        let backend = match info.backend {
            Backend::Vulkan => "Vulkan",
            Backend::Gl => "OpenGL",
            Backend::Metal => "Metal",
            Backend::Dx12 => "Direct3D 12",
            Backend::BrowserWebGpu => "WebGPU",
            Backend::Noop => "nothing",
        };
        // OpenGL does not say what kind of device it is: by their names these are Mesa's and Google's rasterisers.
        let name = info.name.to_lowercase();
        let rasterisers = ["llvmpipe", "softpipe", "swiftshader", "swrast"];
        let software =
            info.device_type == DeviceType::Cpu || rasterisers.iter().any(|r| name.contains(r));
        Self {
            name: info.name,
            backend,
            software,
            driver: format!("{} {}", info.driver, info.driver_info)
                .trim()
                .to_owned(),
        }
    }

    /// Whether every word of a name that a user gave is in it, whatever the case.
    fn matches(&self, name: &str) -> bool {
        let label = self.to_string().to_lowercase();
        let mut words = name.split_whitespace();
        words.all(|word| label.contains(&word.to_lowercase()))
    }
}

impl fmt::Display for AdapterLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.name, self.backend)?;
        if self.software {
            f.write_str(", software")?;
        }
        Ok(())
    }
}

/// A device that scenes are drawn with.
#[derive(Debug)]
pub struct Gpu {
    label: AdapterLabel,
    adapter: Adapter,
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// What went wrong outside of any [`Gpu::guarded`].
    stray: Arc<Mutex<Option<wgpu::Error>>>,
    /// Why the device was lost, once it was.
    lost: Arc<Mutex<Option<String>>>,
}

/// The adapters of this machine, best first: a GPU before software, and OpenGL last of each kind.
pub fn list() -> Vec<AdapterLabel> {
    let found = adapters().into_iter();
    found.map(|(label, _)| label).collect()
}

fn adapters() -> Vec<(AdapterLabel, Adapter)> {
    let backends = Backends::VULKAN | Backends::METAL | Backends::DX12 | Backends::GL;
    let instance = Instance::new(InstanceDescriptor {
        backends,
        ..InstanceDescriptor::new_without_display_handle()
    });
    let found = pollster::block_on(instance.enumerate_adapters(backends));
    let mut all: Vec<(AdapterLabel, Adapter)> = found
        .into_iter()
        .map(|adapter| (AdapterLabel::of(&adapter), adapter))
        .collect();
    all.sort_by_key(|(label, adapter)| {
        let info = adapter.get_info();
        let kind = match info.device_type {
            _ if label.software => 4,
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Other | DeviceType::Cpu => 3,
        };
        (kind, info.backend == Backend::Gl, label.to_string())
    });
    all
}

/// The ways out when there is no adapter.
const NO_ADAPTER: [&str; 2] = [
    "errors are measured without a GPU by default; only what asks for one needs it",
    "on Debian and Ubuntu `apt install mesa-vulkan-drivers` installs one in software",
];

impl Gpu {
    /// Opens the best adapter whose label has every word of `name` in it, or the best of all.
    ///
    /// # Errors
    /// When there is none, or its driver gives no device.
    pub fn open(name: Option<&str>) -> Result<Self> {
        let all = adapters();
        let known: Vec<String> = all.iter().map(|(label, _)| label.to_string()).collect();
        let found = all
            .into_iter()
            .find(|(label, _)| name.is_none_or(|name| label.matches(name)));
        let Some((label, adapter)) = found else {
            return Err(match (name, known.is_empty()) {
                (Some(name), false) => Diagnostic::error(format!("there is no adapter `{name}`"))
                    .with_note(format!(
                        "there is:\n{}\na part of a name is enough",
                        known.join("\n")
                    )),
                _ => NO_ADAPTER.iter().fold(
                    Diagnostic::error("there is no GPU, nor one in software"),
                    |error, note| error.with_note(*note),
                ),
            });
        };
        // Whatever it can: a shader is drawn as it is, or the driver says why not.
        let wanted = Features::FLOAT32_FILTERABLE
            | Features::TEXTURE_FORMAT_16BIT_NORM
            | Features::RG11B10UFLOAT_RENDERABLE
            | Features::DUAL_SOURCE_BLENDING
            | Features::CLIP_DISTANCES
            | Features::SHADER_F16
            | Features::PRIMITIVE_INDEX
            | Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES
            | Features::TIMESTAMP_QUERY
            | Features::PIPELINE_STATISTICS_QUERY;
        let descriptor = wgpu::DeviceDescriptor {
            required_features: adapter.features() & wanted,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let opened = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = opened.map_err(|error| {
            Diagnostic::error(format!("the adapter `{label}` gives no device"))
                .with_reason(error)
                .with_note("choose another one with `--adapter`")
        })?;
        let stray: Arc<Mutex<Option<wgpu::Error>>> = Arc::default();
        let keep = stray.clone();
        device.on_uncaptured_error(Arc::new(move |error| {
            let mut first = keep.lock().unwrap_or_else(PoisonError::into_inner);
            first.get_or_insert(error);
        }));
        let lost: Arc<Mutex<Option<String>>> = Arc::default();
        let keep = lost.clone();
        device.set_device_lost_callback(move |_, message| {
            let mut first = keep.lock().unwrap_or_else(PoisonError::into_inner);
            first.get_or_insert(message);
        });
        Ok(Self {
            label,
            adapter,
            device,
            queue,
            stray,
            lost,
        })
    }

    /// Whether it is reached by OpenGL.
    pub(super) fn is_opengl(&self) -> bool {
        self.adapter.get_info().backend == Backend::Gl
    }

    /// Whether the driver is Mesa's software Vulkan of a version that crashes on some shaders with uniform buffers, see
    /// `lavapipe`.
    pub(super) fn inlines_uniforms(&self) -> bool {
        let info = self.adapter.get_info();
        let version = info.driver_info.strip_prefix("Mesa ");
        let major = version.and_then(|v| v.split('.').next()?.parse::<u32>().ok());
        info.driver == "llvmpipe" && major.is_some_and(|major| major < 23)
    }

    /// Whether a fragment knows its triangle.
    pub(super) fn tells_triangles(&self) -> bool {
        self.device.features().contains(Features::PRIMITIVE_INDEX)
    }

    /// What the adapter is called.
    pub fn label(&self) -> &AdapterLabel {
        &self.label
    }

    /// The device.
    pub(super) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Its queue.
    pub(super) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// A texture of so many pixels, in width and height, without MIP levels.
    pub(super) fn image(
        &self,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width,
                height,
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

    /// Whether a format can be used so.
    pub(super) fn allows(&self, format: wgpu::TextureFormat, usages: wgpu::TextureUsages) -> bool {
        let features = self.adapter.get_texture_format_features(format);
        let needed = format.required_features();
        self.device.features().contains(needed) && features.allowed_usages.contains(usages)
    }

    /// Whether the device was lost, so that nothing more can be done on it: another one may be opened.
    pub fn is_lost(&self) -> bool {
        self.why_lost().is_some()
    }

    fn why_lost(&self) -> Option<String> {
        let lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
        lost.clone()
    }

    /// Does something on the device; what goes wrong there is an error. `what` says what was being done:
    /// "compiling the shader".
    pub(super) fn guarded<T>(&self, what: &str, work: impl FnOnce() -> Result<T>) -> Result<T> {
        use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
        let scopes = [Validation, OutOfMemory, Internal].map(|f| self.device.push_error_scope(f));
        let done = work();
        let [validation, memory, internal] = scopes;
        // They are popped in the reverse order of pushing.
        let errors = [
            pollster::block_on(internal.pop()),
            pollster::block_on(memory.pop()),
            pollster::block_on(validation.pop()),
            self.stray
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .take(),
        ];
        if let Some(message) = self.why_lost() {
            return Err(self
                .failed(what, "the device was lost")
                .with_reason(message.trim())
                .with_note("the driver gave up: a smaller resolution, or another adapter with `--adapter`, may do"));
        }
        match errors.into_iter().flatten().next() {
            Some(error) => Err(self.explain(what, &error)),
            None => done,
        }
    }

    fn failed(&self, what: &str, why: &str) -> Box<Diagnostic> {
        Diagnostic::error(format!("{what} failed on `{}`: {why}", self.label))
    }

    fn explain(&self, what: &str, error: &wgpu::Error) -> Box<Diagnostic> {
        match error {
            wgpu::Error::OutOfMemory { .. } => self
                .failed(what, "its memory is full")
                .with_note("a smaller `resolution` in the scene, or smaller textures, may do"),
            wgpu::Error::Validation { description, .. } => self
                .failed(what, "it is not allowed there")
                .with_reason(description.trim())
                .with_note("the evaluator has no such limit: it measures errors without a GPU"),
            wgpu::Error::Internal { description, .. } => self
                .failed(what, "the driver cannot do it")
                .with_reason(description.trim())
                .with_note("another adapter may, with `--adapter`; the evaluator needs none"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_name_is_enough() {
        let label = AdapterLabel {
            name: "llvmpipe (LLVM 15.0.6, 256 bits)".to_owned(),
            backend: "OpenGL",
            software: true,
            driver: String::new(),
        };
        assert_eq!(
            label.to_string(),
            "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL, software"
        );
        for (name, found) in [
            ("LLVMpipe", true),
            ("opengl", true),
            ("llvmpipe vulkan", false),
            ("software opengl", true),
            ("", true),
            ("radeon", false),
        ] {
            assert_eq!(label.matches(name), found, "{name}");
        }
    }

    #[test]
    fn a_device_that_is_lost_is_an_error_with_a_way_out() {
        for label in list() {
            let gpu = Gpu::open(Some(&label.to_string())).unwrap();
            assert!(!gpu.is_lost());
            gpu.device.destroy();
            // It is told of when the device is looked at the next time, whatever that finds.
            let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
            let error = gpu.guarded("drawing", || Ok(())).unwrap_err();
            assert!(
                gpu.is_lost() && error.message.contains("the device was lost"),
                "{error}"
            );
            assert!(!error.notes.is_empty(), "{error}");
        }
    }

    #[test]
    fn an_adapter_that_is_not_there_is_an_error_with_a_way_out() {
        let error = Gpu::open(Some("Voodoo 2")).unwrap_err();
        assert!(!error.notes.is_empty(), "{error}");
    }
}
