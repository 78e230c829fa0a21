//! A window in which a material changes its level as it moves away: drawn with winit and wgpu, from its lock.
//!
//! ```sh
//! cargo run --release --features viewer --example viewer                   # a wall of `tests/sample`
//! cargo run --release --features viewer --example viewer -- material.wgsl [material.lod.toml] [--shots FOLDER]
//! ```
//!
//! Drag to turn, wheel or `+` and `-` for the distance, `0` to `9` for a level by hand, `a` for that of the distance, `t` to tint each level.
//! The title says what is drawn, and how long a frame takes. With `--shots` it presses the keys itself, and writes what the window shows.

#[path = "../drawing/mod.rs"]
#[allow(
    dead_code,
    reason = "every example takes what it needs of what they share"
)]
mod drawing;
mod view;

use drawing::{Material, Renderer, Result, instance, open};
use lodc::emit::write_atomically;
use lodc::eval::image::encode_png;
use lodc::scene::Output;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use view::View;
use wgpu::{CurrentSurfaceTexture, TextureFormat, TextureUsages};
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

/// Drawn when nothing is named.
const WALL: &str = "tests/sample/shaders/wall.wgsl";

/// How often the title is written.
const SECOND: Duration = Duration::from_secs(1);

fn main() {
    if let Err(error) = run(std::env::args().skip(1)) {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

/// Opens the window, and returns when it is closed.
///
/// # Errors
/// When the material cannot be replayed, or there is no display, or no device that shows pictures there.
pub(crate) fn run(mut arguments: impl Iterator<Item = String>) -> Result<()> {
    let (mut files, mut shots) = (Vec::new(), None);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--shots" => shots = Some(arguments.next().ok_or("--shots wants a folder")?.into()),
            _ => files.push(PathBuf::from(argument)),
        }
    }
    let mut files = files.into_iter();
    let shader = files.next().unwrap_or_else(|| WALL.into());
    let material = Material::replay(&shader, files.next().as_deref())?;
    let events = EventLoop::new()?;
    // Frames follow each other as fast as they can, so that their time says something.
    events.set_control_flow(ControlFlow::Poll);
    let mut app = App {
        name: shader.display().to_string(),
        view: View::new(&material),
        material,
        shots,
        opened: None,
        dragged: None,
        since: (Instant::now(), 0),
        ended: Ok(()),
    };
    events.run_app(&mut app)?;
    app.ended
}

struct App {
    name: String,
    material: Material,
    view: View,
    /// Where pictures go, instead of waiting for a person.
    shots: Option<PathBuf>,
    opened: Option<Opened>,
    /// Where the mouse was, while its button is down.
    dragged: Option<PhysicalPosition<f64>>,
    /// When the title was written, and how many frames have been drawn since.
    since: (Instant, u32),
    ended: Result<()>,
}

/// A window, and what draws to it.
struct Opened {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    renderer: Renderer,
}

impl Opened {
    fn new(events: &ActiveEventLoop, material: &Material, reads: bool) -> Result<Self> {
        let size = PhysicalSize::new(512, 512);
        let attributes = Window::default_attributes().with_inner_size(size);
        let window = Arc::new(events.create_window(attributes)?);
        let instance = instance();
        let surface = instance.create_surface(window.clone())?;
        let (adapter, (device, queue)) = open(&instance, Some(&surface))?;
        let able = surface.get_capabilities(&adapter);
        // Shaders return linear light for a target that encodes it, or have encoded it themselves.
        let encodes = material.scene.output != Output::Encoded;
        let fits = |format: &&TextureFormat| {
            let eight = [TextureFormat::Rgba8Unorm, TextureFormat::Bgra8Unorm];
            eight.contains(&format.remove_srgb_suffix()) && format.is_srgb() == encodes
        };
        let format = able.formats.iter().find(fits);
        let format = *format.ok_or("the window has no format of 8 bits a channel")?;
        let mut usage = TextureUsages::RENDER_ATTACHMENT;
        if reads {
            usage |= TextureUsages::COPY_SRC;
        }
        if !able.usages.contains(usage) {
            return Err("what this window shows cannot be read".into());
        }
        let size = window.inner_size();
        let configuration = wgpu::SurfaceConfiguration {
            usage,
            format,
            width: size.width.max(1),
            height: size.height.max(1),
            present_mode: wgpu::PresentMode::AutoNoVsync,
            desired_maximum_frame_latency: 2,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
            color_space: Default::default(),
        };
        surface.configure(&device, &configuration);
        let renderer = Renderer::new((device, queue), material, format)?;
        Ok(Self {
            window,
            surface,
            configuration,
            renderer,
        })
    }

    fn resize(&mut self, size: PhysicalSize<u32>) {
        self.configuration.width = size.width.max(1);
        self.configuration.height = size.height.max(1);
        self.configure();
    }

    fn configure(&self) {
        let device = &self.renderer.device;
        self.surface.configure(device, &self.configuration);
    }
}

impl App {
    /// Draws a frame, and says which level that was. With a file the window's pixels go there.
    fn draw(&mut self, file: Option<PathBuf>) -> Result<Option<usize>> {
        let Some(opened) = &self.opened else {
            return Ok(None);
        };
        let [width, height] = [opened.configuration.width, opened.configuration.height];
        self.material.scene.resolution = [width, height];
        let level = self.view.level(&self.material, height);
        let frame = self
            .material
            .frame(self.view.direction(), self.view.distance);
        let shown = match opened.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(shown) | CurrentSurfaceTexture::Suboptimal(shown) => {
                shown
            }
            // The next frame will do.
            CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => return Ok(None),
            CurrentSurfaceTexture::Outdated | CurrentSurfaceTexture::Lost => {
                opened.configure();
                return Ok(None);
            }
            CurrentSurfaceTexture::Validation => return Err("the window cannot be drawn to".into()),
        };
        let renderer = &opened.renderer;
        renderer.draw(&frame, level, &shown.texture, self.view.tint(level));
        if let Some(file) = file {
            let mut pixels = renderer.pixels(&shown.texture)?;
            if opened.configuration.format.remove_srgb_suffix() == TextureFormat::Bgra8Unorm {
                pixels.iter_mut().for_each(|pixel| pixel.swap(0, 2));
            }
            write_atomically(&[(file, encode_png(width, height, &pixels)?)])?;
        }
        renderer.queue.present(shown);
        Ok(Some(level))
    }

    /// Says in the title what is drawn, and how long a frame took in the last second.
    fn title(&mut self, level: usize) {
        let (since, frames) = &mut self.since;
        *frames += 1;
        let taken = since.elapsed();
        if taken < SECOND {
            return;
        }
        let milliseconds = taken.as_secs_f64() * 1000.0 / f64::from(*frames);
        self.since = (Instant::now(), 0);
        if let Some(opened) = &self.opened {
            let height = opened.configuration.height;
            let auto_lod = self.material.auto_lod(self.view.distance, height);
            opened.window.set_title(&format!(
                "{}: distance {:.2}, autoLOD {auto_lod:.2}, level {level} of {}, {milliseconds:.2} ms a frame",
                self.name,
                self.view.distance,
                self.material.levels(),
            ));
        }
    }

    /// Every level by hand, tinted; then each at a distance that asks for it.
    fn shoot(&mut self, folder: &std::path::Path) -> Result<()> {
        let (_, height) = self.opened.as_ref().map_or((0, 0), |opened| {
            (opened.configuration.width, opened.configuration.height)
        });
        self.press("t");
        let levels = self.material.levels();
        for level in 0..levels {
            self.press(&level.to_string());
            self.shot(folder.join(format!("level-{level}.png")))?;
        }
        self.press("t");
        self.press("a");
        for level in 0..levels {
            self.view.distance = self.material.distance(level, height);
            self.shot(folder.join(format!("distance-{level}.png")))?;
        }
        Ok(())
    }

    fn shot(&mut self, file: PathBuf) -> Result<()> {
        // A window that has just been opened may have to be asked again.
        for _ in 0..100 {
            if let Some(level) = self.draw(Some(file.clone()))? {
                println!("{}: level {level}", file.display());
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        Err("the window shows nothing".into())
    }

    fn press(&mut self, key: &str) {
        self.view.press(key, self.material.levels());
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.opened.is_some() {
            return;
        }
        let opened = Opened::new(events, &self.material, self.shots.is_some());
        let done = opened.and_then(|opened| {
            opened.window.request_redraw();
            self.opened = Some(opened);
            match self.shots.clone() {
                Some(folder) => self.shoot(&folder).map(|()| true),
                None => Ok(false),
            }
        });
        match done {
            Ok(false) => {}
            Ok(true) => events.exit(),
            Err(error) => {
                self.ended = Err(error);
                events.exit();
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(size) => {
                if let Some(opened) = &mut self.opened {
                    opened.resize(size);
                }
            }
            WindowEvent::KeyboardInput {
                event:
                    KeyEvent {
                        logical_key,
                        state: ElementState::Pressed,
                        ..
                    },
                ..
            } => match logical_key.as_ref() {
                Key::Named(NamedKey::Escape) => events.exit(),
                Key::Character(key) => self.press(key),
                _ => {}
            },
            WindowEvent::MouseInput {
                state: ElementState::Released,
                button: MouseButton::Left,
                ..
            } => self.dragged = None,
            WindowEvent::MouseInput {
                state: ElementState::Pressed,
                button: MouseButton::Left,
                ..
            } => self.dragged = Some(PhysicalPosition::new(f64::NAN, f64::NAN)),
            WindowEvent::CursorMoved { position, .. } => {
                if let Some(before) = &mut self.dragged {
                    let (x, y) = (position.x - before.x, position.y - before.y);
                    *before = position;
                    self.view.turn(x, y);
                }
            }
            WindowEvent::MouseWheel { delta, .. } => self.view.approach(match delta {
                MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                MouseScrollDelta::PixelDelta(pixels) => pixels.y / 50.0,
            }),
            WindowEvent::RedrawRequested => {
                match self.draw(None) {
                    Ok(Some(level)) => self.title(level),
                    Ok(None) => {}
                    Err(error) => {
                        self.ended = Err(error);
                        events.exit();
                    }
                }
                if let Some(opened) = &self.opened {
                    opened.window.request_redraw();
                }
            }
            _ => {}
        }
    }
}
