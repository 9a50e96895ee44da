//! The window: keys and the mouse move the camera and switch what is shown.
//!
//! A frame is drawn when something has changed, and a few more behind it.
//! By then the first of two passes draws what is visible, and the second finds nothing new.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hiz_core::ImageSize;
use hiz_core::wgpu::{self, CurrentSurfaceTexture};
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, KeyEvent, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key as Pressed, NamedKey};
use winit::window::{Window, WindowId};

use crate::Failure;
use crate::args::Arguments;
use crate::controls::{Controls, KEYS, Key};
use crate::gpu::{Gpu, IndirectChecks, instance};
use crate::overlay::ToWindow;
use crate::picture::save;
use crate::renderer::Renderer;
use crate::scene::Scene;

/// Frames that are drawn behind the last change.
const FRAMES_BEHIND: u32 = 3;
/// Radians that the camera turns per pixel of the mouse.
const TURN_PER_PIXEL: f64 = 0.004;

/// Opens a window and stays until it is closed.
///
/// # Errors
/// If there is no display, device or scene.
pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let scene = Scene::by_name(arguments.scene_name())?;
    let scene = if arguments.lods { scene } else { scene.without_lods() };
    for folder in arguments.screenshots.iter().chain([&arguments.out]) {
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    let events = EventLoop::new().map_err(|error| {
        format!(
            "no window: {error}; the viewer needs an X display (DISPLAY), and --headless needs none"
        )
    })?;
    events.set_control_flow(ControlFlow::Wait);
    let mut viewer = Viewer { arguments, scene: Some(scene), open: None, failed: None, written: 0 };
    events.run_app(&mut viewer)?;
    viewer.failed.map_or(Ok(()), Err)
}

/// What the window's events act on.
struct Viewer<'a> {
    arguments: &'a Arguments,
    /// Until it is uploaded.
    scene: Option<Scene>,
    open: Option<Open>,
    failed: Option<Failure>,
    /// Files so far.
    written: usize,
}

/// An open window and its renderer.
struct Open {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    format: wgpu::TextureFormat,
    to_window: ToWindow,
    renderer: Renderer,
    controls: Controls,
    frames_left: u32,
    /// Where the mouse was, while a button is held.
    dragged: Option<PhysicalPosition<f64>>,
    mouse: PhysicalPosition<f64>,
}

impl Open {
    fn new(events: &ActiveEventLoop, arguments: &Arguments, scene: Scene) -> Result<Self, Failure> {
        let ImageSize { width, height } = arguments.size;
        let attributes = Window::default_attributes()
            .with_title(format!("hizvk viewer: {}", scene.name))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(events.create_window(attributes)?);
        let instance = instance(IndirectChecks::On);
        let surface = instance.create_surface(Arc::clone(&window))?;
        let gpu = Gpu::open(&instance, Some(&surface))?;
        println!("adapter: {}", gpu.words());
        println!("{}", crate::culler::slack_in_words(&gpu.adapter));
        crate::sample_places::tell(&gpu, arguments.samples)?;
        let formats = surface.get_capabilities(&gpu.adapter_handle).formats;
        // Colours are stored as they are computed, so the window must not convert them.
        let format = formats.iter().copied().find(|f| !f.is_srgb()).unwrap_or(formats[0]);
        let to_window = ToWindow::new(&gpu, format);
        let mut renderer = Renderer::new(gpu, scene, arguments.size, arguments.samples)?;
        renderer.mode = arguments.mode;
        renderer.shown.numbers = true;
        let mut controls = Controls::new(renderer.scene.pose(0, 1), arguments.mode);
        for key in &arguments.keys {
            controls.press(*key, &mut renderer);
        }
        let mut open = Self {
            window,
            surface,
            format,
            to_window,
            renderer,
            controls,
            frames_left: FRAMES_BEHIND,
            dragged: None,
            mouse: PhysicalPosition::default(),
        };
        open.resize(arguments.size)?;
        Ok(open)
    }

    fn resize(&mut self, size: ImageSize) -> Result<(), Failure> {
        let configuration = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format: self.format,
            color_space: wgpu::SurfaceColorSpace::Auto,
            width: size.width,
            height: size.height,
            present_mode: wgpu::PresentMode::Fifo,
            desired_maximum_frame_latency: 2,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
        };
        self.surface.configure(&self.renderer.gpu.device, &configuration);
        if self.renderer.targets.size != size {
            self.renderer.resize(size)?;
        }
        self.changed();
        Ok(())
    }

    fn changed(&mut self) {
        self.frames_left = FRAMES_BEHIND;
        self.window.request_redraw();
    }

    fn draw(&mut self) -> Result<(), Failure> {
        let size = self.renderer.targets.size;
        let camera = self.renderer.scene.camera(&self.controls.pose, size)?;
        self.renderer.draw(&camera)
    }

    /// Draws a frame and shows it.
    fn redraw(&mut self) -> Result<(), Failure> {
        self.draw()?;
        let texture = match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(texture)
            | CurrentSurfaceTexture::Suboptimal(texture) => texture,
            CurrentSurfaceTexture::Outdated | CurrentSurfaceTexture::Lost => {
                return self.resize(self.renderer.targets.size);
            }
            // Nobody sees it, or the next one comes in time.
            CurrentSurfaceTexture::Occluded | CurrentSurfaceTexture::Timeout => return Ok(()),
            CurrentSurfaceTexture::Validation => return Err("the surface is not valid".into()),
        };
        let gpu = &self.renderer.gpu;
        let mut encoder = gpu.encoder("viewer.window");
        let picture = &self.renderer.targets.picture_texture;
        self.to_window.record(gpu, &mut encoder, picture, &texture.texture);
        gpu.submit(encoder);
        gpu.queue.present(texture);
        self.frames_left = self.frames_left.saturating_sub(1);
        if self.frames_left > 0 {
            self.window.request_redraw();
        }
        Ok(())
    }

    /// Turns the camera by what a held mouse moved.
    fn drag(&mut self, to: PhysicalPosition<f64>) {
        self.mouse = to;
        if let Some(from) = self.dragged {
            let [left, up] = [from.x - to.x, from.y - to.y].map(|v| v * TURN_PER_PIXEL);
            // The scene follows the mouse.
            self.controls.turn(-left, -up);
            self.dragged = Some(to);
            self.changed();
        }
    }
}

impl Viewer<'_> {
    /// Does what a key does, draws, and writes the files that were asked for.
    fn press(&mut self, key: Key) -> Result<(), Failure> {
        let Some(open) = &mut self.open else { return Ok(()) };
        open.controls.press(key, &mut open.renderer);
        open.changed();
        let folder: Option<&Path> = match key {
            Key::Screenshot => Some(&self.arguments.out),
            _ => self.arguments.screenshots.as_deref(),
        };
        let Some(folder) = folder else { return Ok(()) };
        // The second frame is drawn with the history of this camera.
        for _ in 0..2 {
            open.draw()?;
        }
        let path = shot_path(folder, self.written, key);
        self.written += 1;
        let rgba = open.renderer.gpu.read_texture(&open.renderer.targets.picture_texture)?;
        save(&path, open.renderer.targets.size, &rgba)?;
        println!("{}: {}", path.display(), open.renderer.lines().join("; "));
        Ok(())
    }

    fn handle(&mut self, events: &ActiveEventLoop, event: WindowEvent) -> Result<(), Failure> {
        if let WindowEvent::KeyboardInput { event, is_synthetic, .. } = &event {
            // When the window gets the keyboard, keys that are held come once more.
            if *is_synthetic {
                return Ok(());
            }
            if event.logical_key == Pressed::Named(NamedKey::Escape) {
                events.exit();
            }
            return key_of(event).map_or(Ok(()), |key| self.press(key));
        }
        let Some(open) = &mut self.open else { return Ok(()) };
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(size) if size.width > 0 && size.height > 0 => {
                open.resize(ImageSize::new(size.width, size.height))?;
            }
            WindowEvent::RedrawRequested => open.redraw()?,
            WindowEvent::CursorMoved { position, .. } => open.drag(position),
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => {
                open.dragged = (state == ElementState::Pressed).then_some(open.mouse);
            }
            _ => {}
        }
        Ok(())
    }

    fn fail(&mut self, events: &ActiveEventLoop, result: Result<(), Failure>) {
        if let Err(error) = result {
            self.failed = Some(error);
            events.exit();
        }
    }
}

impl ApplicationHandler for Viewer<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(scene) = self.scene.take() else { return };
        let opened = Open::new(events, self.arguments, scene).map(|open| {
            self.open = Some(open);
            println!("open; H lists the numbers, Escape closes");
        });
        self.fail(events, opened);
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let result = self.handle(events, event);
        self.fail(events, result);
    }
}

fn shot_path(folder: &Path, number: usize, key: Key) -> PathBuf {
    let name = KEYS.iter().find(|(known, ..)| *known == key).map_or("key", |(_, name, _)| *name);
    folder.join(format!("{number:02}_{name}.png"))
}

/// What a pressed key does; `None` for other keys, and when one is let go.
/// A key that is held moves on; switches switch once.
fn key_of(event: &KeyEvent) -> Option<Key> {
    if event.state == ElementState::Released {
        return None;
    }
    let key = pressed(event)?;
    let moves = matches!(key, Key::Forward | Key::Back | Key::Left | Key::Right);
    (moves || !event.repeat).then_some(key)
}

fn pressed(event: &KeyEvent) -> Option<Key> {
    match &event.logical_key {
        Pressed::Named(NamedKey::ArrowUp) => Some(Key::Forward),
        Pressed::Named(NamedKey::ArrowDown) => Some(Key::Back),
        Pressed::Named(NamedKey::ArrowLeft) => Some(Key::Left),
        Pressed::Named(NamedKey::ArrowRight) => Some(Key::Right),
        Pressed::Named(NamedKey::F4) => Some(Key::Level),
        Pressed::Character(c) => match c.as_str() {
            "+" | "=" => Some(Key::Coarser),
            "-" => Some(Key::Finer),
            letter => Key::by_name(letter).ok(),
        },
        _ => None,
    }
}
