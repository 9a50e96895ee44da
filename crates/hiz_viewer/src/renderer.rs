//! A renderer: it draws a frame in one of four ways, and counts what it drew.

use std::sync::Arc;
use std::time::Instant;

use hiz_core::wgpu;
use hiz_core::{
    Camera, DrawIndexedIndirect, HizContext, ImageSize, StageTimer, StageTimesInFlight,
};

use crate::Failure;
use crate::culler::{Culler, DrawList};
use crate::gpu::Gpu;
use crate::overlay::Overlay;
use crate::pipelines::Pipelines;
use crate::scene::Scene;
use crate::scene::motion::moved;
use crate::scene_on_device::{OnDevice, SKY};
use crate::targets::{Begin, Targets};

/// What is left out of a frame, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Nothing: all bodies are drawn, each at its finest.
    All,
    /// What is outside of the view.
    Frustum,
    /// What is outside of the view or behind occluders, which are drawn before.
    OnePass,
    /// What is outside of the view or behind what the frame before has shown.
    TwoPasses,
}

impl Mode {
    pub(crate) const ALL: [Self; 4] = [Self::All, Self::Frustum, Self::OnePass, Self::TwoPasses];

    /// The name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Frustum => "frustum",
            Self::OnePass => "one-pass",
            Self::TwoPasses => "two-passes",
        }
    }
}

/// What a frame shows beside the scene; keys switch it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shown {
    /// LODs in colours that get bluer.
    pub(crate) tint: bool,
    /// What was drawn in vain, darker.
    pub(crate) in_vain: bool,
    /// Bounds: white if drawn, red if culled.
    pub(crate) boxes: bool,
    /// A level of the pyramid in place of the picture.
    pub(crate) level: Option<u32>,
    /// A line of numbers.
    pub(crate) numbers: bool,
}

/// What a frame drew.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Counts {
    pub(crate) bodies: u32,
    /// Bodies that the first pass drew, and those of the second.
    pub(crate) drawn: [u32; 2],
    pub(crate) triangles: u64,
    /// From the begin of recording until the device was idle.
    pub(crate) milliseconds: f64,
}

/// Everything that draws one scene at one size.
#[derive(Debug)]
pub(crate) struct Renderer {
    pub(crate) gpu: Arc<Gpu>,
    pub(crate) scene: Scene,
    pub(crate) on_device: OnDevice,
    timer: StageTimer,
    /// What the stages of the last frame took, in words.
    stages: String,
    pub(crate) culler: Culler,
    pub(crate) targets: Targets,
    pub(crate) pipelines: Pipelines,
    pub(crate) bindings: wgpu::BindGroup,
    overlay: Overlay,
    pub(crate) mode: Mode,
    pub(crate) shown: Shown,
    pub(crate) counts: Counts,
}

impl Renderer {
    /// Uploads a scene.
    pub(crate) fn new(
        gpu: Arc<Gpu>,
        scene: Scene,
        size: ImageSize,
        samples: u32,
    ) -> Result<Self, Failure> {
        let hiz = HizContext::new(&gpu.device)?;
        Self::with_context(gpu, hiz, scene, size, samples)
    }

    /// [`Renderer::new`] with a context of `hiz_core`, such as one with planted faults.
    pub(crate) fn with_context(
        gpu: Arc<Gpu>,
        hiz: HizContext,
        scene: Scene,
        size: ImageSize,
        samples: u32,
    ) -> Result<Self, Failure> {
        let on_device = OnDevice::new(&gpu, &scene);
        let pipelines = Pipelines::new(&gpu, samples);
        let targets = Targets::new(&gpu, size, samples);
        let culler = Culler::new(&gpu, hiz, &scene, &on_device, &targets)?;
        Ok(Self {
            bindings: on_device.bind_group(&gpu, &pipelines.layout),
            timer: culler.timer(&gpu)?,
            stages: String::new(),
            culler,
            overlay: Overlay::new(&gpu, samples),
            mode: Mode::TwoPasses,
            shown: Shown { tint: true, in_vain: false, boxes: false, level: None, numbers: false },
            counts: Counts { bodies: on_device.num_bodies, ..Counts::default() },
            gpu,
            scene,
            on_device,
            targets,
            pipelines,
        })
    }

    /// Makes what depends on the size of the picture anew.
    pub(crate) fn resize(&mut self, size: ImageSize) -> Result<(), Failure> {
        self.targets = Targets::new(&self.gpu, size, self.targets.samples);
        self.culler.resize(&self.gpu, &self.targets)
    }

    /// Draws a frame into the picture, waits for it, and counts what it drew.
    pub(crate) fn draw(&mut self, camera: &Camera) -> Result<(), Failure> {
        let begin = Instant::now();
        let times = self.shown.numbers.then(|| self.draw_timed(camera)).transpose()?;
        if times.is_none() {
            self.draw_scene(camera)?;
        }
        self.gpu.wait()?;
        self.counts.milliseconds = 1e3 * begin.elapsed().as_secs_f64();
        self.stages = times.map(|times| stages_in_words(&times)).transpose()?.unwrap_or_default();
        self.count()?;
        self.draw_overlay(camera)
    }

    /// Moves bodies to where they are in frame `frame`, and lets others come and go.
    ///
    /// # Errors
    /// If the device fails.
    pub(crate) fn step(&self, frame: usize) -> Result<(), Failure> {
        let (bodies, volumes) = moved(&self.scene, frame);
        self.on_device.put(&self.gpu, &bodies);
        self.culler.update(&self.gpu, &volumes)
    }

    /// Submits the scene alone: no boxes, level or numbers.
    pub(crate) fn draw_scene(&self, camera: &Camera) -> Result<(), Failure> {
        let mut encoder = self.gpu.encoder("viewer.frame");
        self.record_scene(&mut encoder, camera)?;
        self.gpu.submit(encoder);
        Ok(())
    }

    /// [`Renderer::draw_scene`] with timestamps around the library's stages.
    fn draw_timed(&self, camera: &Camera) -> Result<StageTimesInFlight, Failure> {
        let mut encoder = self.gpu.encoder("viewer.frame");
        self.timer.time(|| self.record_scene(&mut encoder, camera))?;
        let times = self.culler.record_times(&mut encoder, &self.timer)?;
        self.gpu.submit(encoder);
        Ok(times)
    }

    fn record_scene(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
    ) -> Result<(), Failure> {
        self.on_device.look(&self.gpu, camera, self.shown.tint);
        let last = !self.shown.in_vain;
        match self.mode {
            Mode::All => {
                let mut pass = self.begin(encoder, Begin::Empty, last);
                pass.set_pipeline(&self.pipelines.picture);
                self.on_device.draw_all(&mut pass);
            }
            Mode::Frustum => {
                self.culler.record_frustum(encoder, camera)?;
                self.record_picture(encoder, Begin::Empty, self.culler.kept(), last);
            }
            Mode::OnePass => {
                self.record_occluders(encoder);
                self.culler.record_one_pass(encoder, camera, &self.targets)?;
                self.record_picture(encoder, Begin::Empty, self.culler.kept(), last);
            }
            Mode::TwoPasses => {
                self.culler.record_early(encoder, camera)?;
                self.record_picture(encoder, Begin::Empty, self.culler.early(), false);
                self.culler.record_late(encoder, camera, &self.targets)?;
                self.record_picture(encoder, Begin::On, self.culler.late(), last);
            }
        }
        if self.shown.in_vain {
            let mut pass = self.begin(encoder, Begin::On, true);
            pass.set_pipeline(&self.pipelines.in_vain);
            self.draw_again(&mut pass);
        }
        Ok(())
    }

    fn draw_overlay(&mut self, camera: &Camera) -> Result<(), Failure> {
        let mut encoder = self.gpu.encoder("viewer.overlay");
        if let Some(level) = self.shown.level {
            if matches!(self.mode, Mode::All | Mode::Frustum) {
                self.culler.record_pyramid(&mut encoder, camera, &self.targets)?;
            }
            self.overlay.record_level(&self.gpu, &mut encoder, self, level);
        } else if self.shown.boxes {
            self.overlay.record_boxes(&self.gpu, &mut encoder, self, camera);
        }
        if self.shown.numbers {
            self.overlay.record_text(&self.gpu, &mut encoder, &self.targets, &self.lines());
        }
        self.gpu.submit_and_wait(encoder)
    }

    fn begin<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        begin: Begin,
        last: bool,
    ) -> wgpu::RenderPass<'e> {
        let mut pass = self.targets.begin(encoder, begin, SKY, last);
        self.set_up(&mut pass);
        pass
    }

    /// Binds what all pipelines of the scene read.
    pub(crate) fn set_up(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(0, &self.bindings, &[]);
        self.on_device.set_buffers(pass);
    }

    /// Draws the depth of the occluders alone.
    pub(crate) fn record_occluders(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = self.targets.begin_depth(encoder);
        self.set_up(&mut pass);
        pass.set_pipeline(&self.pipelines.depth);
        self.on_device.draw_occluders(&mut pass);
    }

    fn record_picture(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        begin: Begin,
        list: DrawList<'_>,
        last: bool,
    ) {
        let mut pass = self.begin(encoder, begin, last);
        pass.set_pipeline(&self.pipelines.picture);
        list.draw(&mut pass);
    }

    /// What the frame draws by lists, in the order of drawing.
    fn lists(&self) -> Vec<DrawList<'_>> {
        match self.mode {
            Mode::All => Vec::new(),
            Mode::Frustum | Mode::OnePass => vec![self.culler.kept()],
            Mode::TwoPasses => vec![self.culler.early(), self.culler.late()],
        }
    }

    /// Bits of the bodies that the frame drew; those of either buffer.
    pub(crate) fn drawn(&self) -> [&wgpu::Buffer; 2] {
        match self.mode {
            Mode::TwoPasses => self.culler.drawn_in_two(),
            Mode::All => self.culler.drawn_in_all(),
            Mode::Frustum | Mode::OnePass => self.culler.drawn_in_one(),
        }
    }

    /// The masks of what the frame drew by lists.
    #[cfg(test)]
    pub(crate) fn masks(&self) -> Vec<&wgpu::Buffer> {
        let drawn = self.drawn();
        drawn[..self.lists().len()].to_vec()
    }

    /// Draws all of the frame once more, with the pipeline that is set.
    pub(crate) fn draw_again(&self, pass: &mut wgpu::RenderPass<'_>) {
        if self.mode == Mode::All {
            self.on_device.draw_all(pass);
        }
        for list in self.lists() {
            list.draw(pass);
        }
    }

    /// Reads the draw arguments of the last frame.
    pub(crate) fn count(&mut self) -> Result<(), Failure> {
        let (mut drawn, mut triangles) = ([0; 2], 0);
        if self.mode == Mode::All {
            drawn[0] = self.on_device.num_bodies;
            triangles = self.scene.num_triangles();
        }
        for (list, drawn) in self.lists().iter().zip(&mut drawn) {
            let bytes = self.gpu.read_buffer(list.arguments())?;
            let draws: Vec<DrawIndexedIndirect> = bytemuck::pod_collect_to_vec(&bytes);
            for draw in &draws {
                *drawn += draw.instance_count;
                triangles += u64::from(draw.index_count / 3) * u64::from(draw.instance_count);
            }
        }
        self.counts.drawn = drawn;
        self.counts.triangles = triangles;
        Ok(())
    }

    /// The numbers of the last frame, in words.
    pub(crate) fn lines(&self) -> Vec<String> {
        let Counts { bodies, drawn: [early, late], triangles, milliseconds } = self.counts;
        let drawn = match self.mode {
            Mode::TwoPasses => format!("{early} early + {late} late"),
            _ => early.to_string(),
        };
        let ImageSize { width, height } = self.targets.size;
        let mut lines = vec![
            format!(
                "{} {}  {milliseconds:.1} ms  {width}x{height}x{}",
                self.scene.name,
                self.mode.name(),
                self.targets.samples
            ),
            format!("drawn {drawn} of {bodies}  triangles {triangles}"),
        ];
        if !self.stages.is_empty() {
            lines.push(self.stages.clone());
        }
        if let Some(level) = self.shown.level
            && let Some(ImageSize { width, height }) = self.culler.pyramid().level_size(level)
        {
            lines.push(format!("level {level}: {width}x{height}"));
        }
        lines
    }

    /// The number of levels that can be shown.
    pub(crate) fn num_levels(&self) -> u32 {
        self.culler.pyramid().num_levels()
    }
}

/// What the library's stages took on the device.
fn stages_in_words(times: &StageTimesInFlight) -> Result<String, Failure> {
    let stages = times.stages()?;
    let known: Option<Vec<_>> = stages
        .iter()
        .map(|stage| stage.gpu_ms.map(|ms| format!("{} {ms:.2}", stage.stage)))
        .collect();
    Ok(match known {
        Some(known) if !known.is_empty() => format!("stages in ms: {}", known.join(", ")),
        _ => "stages: wall time alone (no timestamps to trust)".to_owned(),
    })
}
