//! What culls for several views leave: the masks of all views in one buffer, and their union.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::gpu::buffers::{STORAGE, entry};
use crate::gpu::device::Gpu;
use crate::gpu::kept::KeptBindings;
use crate::gpu::layouts::Binding;
use crate::gpu::numbers::UNIFORM_ALIGNMENT;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::StagePasses;
use crate::instances::Instances;
use crate::output::compact::Compaction;
use crate::output::emit::Emit;
use crate::output::outputs::Outputs;
use crate::output::visible::Visible;

/// Invocations of a workgroup; `shaders/output/join.wgsl`.
pub(crate) const WORKGROUP: u32 = 64;

/// The most views of one call.
pub const MAX_VIEWS: usize = 256;

const LAYOUT: &str = "hiz.views.layout";

const BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Uniform), (1, Binding::Read), (2, Binding::Write), (3, Binding::Write)];

/// Twin: `shaders/output/join.wgsl`, `Join`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct JoinUniform {
    pub(crate) view: u32,
    pub(crate) stride: u32,
    pub(crate) begin: u32,
    pub(crate) words: u32,
}

/// The shader that joins the masks of views.
pub(crate) fn join_module() -> Source {
    Source::of(&[&[wgsl!("output/join")]])
}

/// What is asked of a cull for several views.
///
/// The default makes the mask of each view, and one list with draw arguments of what any of them
/// keeps.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewsOutputs {
    /// What each view leaves by itself.
    /// Its mask is made in any case.
    pub each: Outputs,
    /// What is made of the instances that any view keeps.
    /// Its mask is made in any case, and it has no verdicts.
    /// It is emitted as [`Emit::List`].
    pub any: Outputs,
}

impl Default for ViewsOutputs {
    fn default() -> Self {
        Self {
            each: Outputs { mask: true, ..Outputs::NONE },
            any: Outputs { mask: true, indices: true, draws: true, ..Outputs::NONE },
        }
    }
}

impl ViewsOutputs {
    /// With what is made in any case.
    pub(crate) fn completed(&self) -> Self {
        Self {
            each: Outputs { mask: true, ..self.each.clone() },
            any: Outputs { mask: true, verdicts: false, pixels: false, ..self.any.clone() },
        }
    }
}

/// The buffers that culls for several views fill.
/// [`HizContext::create_visible_views`](crate::HizContext::create_visible_views) makes them.
///
/// [`masks`](Self::masks) has a row of bits per view, and [`any`](Self::any) what at least one view
/// keeps: a renderer in stereo draws one list, and its shader reads both bits of an instance.
/// [`view`](Self::view) has what each view leaves by itself, as for the faces of a cube map.
#[derive(Debug)]
pub struct VisibleViews {
    each: Vec<Arc<Visible>>,
    joined: Joined,
}

impl VisibleViews {
    pub(crate) fn new(
        gpu: &Gpu,
        instances: &Instances,
        views: usize,
        outputs: &ViewsOutputs,
    ) -> Result<Self> {
        let ViewsOutputs { each, any } = outputs.completed();
        let joined = Joined::new(gpu, instances, views, &any)?;
        let each = (0..views).map(|_| Visible::new(gpu, instances, &each).map(Arc::new));
        Ok(Self { each: each.collect::<Result<_>>()?, joined })
    }

    /// The number of views.
    pub fn num_views(&self) -> usize {
        self.each.len()
    }

    /// What view `view` leaves by itself.
    ///
    /// # Panics
    /// If `view` is not below [`VisibleViews::num_views`].
    pub fn view(&self, view: usize) -> &Visible {
        &self.each[view]
    }

    /// The instances that at least one view keeps: their mask, and list and draw arguments if they
    /// were asked for.
    pub fn any(&self) -> &Visible {
        &self.joined.any
    }

    /// The masks of all views, one row after the other.
    /// A row has a bit per instance in the caller's numbering, lowest first, whatever the pieces.
    pub fn masks(&self) -> &wgpu::Buffer {
        &self.joined.masks
    }

    /// Bytes from the row of one view to that of the next: a multiple of 256, so that a row may be
    /// bound by itself.
    pub fn mask_stride(&self) -> u64 {
        self.joined.stride
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        let each = self.each.iter().map(|visible| visible.device_bytes());
        each.sum::<u64>() + self.joined.device_bytes()
    }

    pub(crate) fn each(&self) -> Vec<&Visible> {
        self.each.iter().map(Arc::as_ref).collect()
    }

    pub(crate) fn joined(&self) -> &Joined {
        &self.joined
    }
}

/// What is made of the masks of all views.
#[derive(Debug)]
pub(crate) struct Joined {
    pub(crate) masks: wgpu::Buffer,
    /// Bytes from the mask of one view to that of the next.
    pub(crate) stride: u64,
    pub(crate) any: Visible,
    pub(crate) views: usize,
    /// Per view, one per piece.
    uniforms: Vec<Vec<wgpu::Buffer>>,
    /// What a view binds for a piece, by the buffer of its mask.
    bindings: KeptBindings<(usize, usize, wgpu::Buffer)>,
}

impl Joined {
    pub(crate) fn new(
        gpu: &Gpu,
        instances: &Instances,
        views: usize,
        any: &Outputs,
    ) -> Result<Self> {
        if !(1..=MAX_VIEWS).contains(&views) {
            return Err(Error::invalid(
                "views",
                format!("expected 1..={MAX_VIEWS} views, got {views}"),
            ));
        }
        if any.emit != Emit::List {
            return Err(Error::invalid(
                "any",
                "expected Emit::List, got another way to emit: LODs and meshes are chosen for each \
                 view; ask them of `each`",
            ));
        }
        let words = u64::from(instances.len().div_ceil(32).max(1));
        let stride = (4 * words).next_multiple_of(UNIFORM_ALIGNMENT);
        let uniform = |view: usize, piece: &crate::instances::piece::Piece| {
            gpu.uniform(
                "hiz.views.join",
                &JoinUniform {
                    view: view as u32,
                    stride: (stride / 4) as u32,
                    // Pieces begin at multiples of a word.
                    begin: piece.range.start / 32,
                    words: piece.words(),
                },
            )
        };
        let uniforms = (0..views)
            .map(|view| instances.pieces.iter().map(|piece| uniform(view, piece)).collect())
            .collect::<Result<Vec<_>>>()?;
        Ok(Self {
            masks: gpu.empty("hiz.views.masks", views as u64 * stride, STORAGE)?,
            stride,
            any: Visible::new(gpu, instances, any)?,
            views,
            uniforms,
            bindings: KeptBindings::new(2 * views * instances.num_pieces()),
        })
    }

    /// Bytes on the device.
    pub(crate) fn device_bytes(&self) -> u64 {
        self.masks.size() + self.any.device_bytes()
    }

    /// Everything that joining the masks of `each` view needs.
    pub(crate) fn prepare(
        &self,
        gpu: &Gpu,
        instances: &Instances,
        each: &[&Visible],
    ) -> Result<Join<'_>> {
        let layout = gpu.layout(LAYOUT, BINDINGS)?;
        let pipeline = gpu.compute_pipeline(&Compute {
            label: "hiz.views.pipeline",
            source: join_module(),
            entry_point: "join_views",
            layouts: std::slice::from_ref(&layout),
            constants: &[],
        })?;
        let mut steps = Vec::new();
        for (view, visible) in each.iter().enumerate() {
            for (p, piece) in instances.pieces.iter().enumerate() {
                let mask = &visible.pieces[p].mask;
                let bindings = self.bindings.get((view, p, mask.clone()), || {
                    gpu.bind_group(
                        "hiz.views.bindings",
                        &layout,
                        &[
                            entry(0, self.uniforms[view][p].as_entire_binding()),
                            entry(1, mask.as_entire_binding()),
                            entry(2, self.masks.as_entire_binding()),
                            entry(3, self.any.pieces[p].mask.as_entire_binding()),
                        ],
                    )
                })?;
                steps.push((bindings, piece.words().div_ceil(WORKGROUP)));
            }
        }
        let compaction = match &self.any.lists {
            Some(lists) => Some(Compaction::new(gpu, instances, &self.any, lists)?),
            None => None,
        };
        Ok(Join { joined: self, pipeline, steps, compaction })
    }
}

/// The commands that join the masks of views.
pub(crate) struct Join<'a> {
    joined: &'a Joined,
    pipeline: wgpu::ComputePipeline,
    steps: Vec<(wgpu::BindGroup, u32)>,
    compaction: Option<Compaction>,
}

impl Join<'_> {
    /// Records them in one pass, behind the culls of all views.
    ///
    /// `idle`: every dispatch has zero workgroups.
    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder, idle: bool) {
        if let Some(lists) = &self.joined.any.lists {
            lists.record_clear(encoder);
        }
        let mut passes = StagePasses::begin(encoder, "hiz.views.pass");
        passes.record("join", |pass| {
            pass.set_pipeline(&self.pipeline);
            for (bindings, workgroups) in &self.steps {
                pass.set_bind_group(0, bindings, &[]);
                pass.dispatch_workgroups(if idle { 0 } else { *workgroups }, 1, 1);
            }
        });
        if let Some(compaction) = &self.compaction {
            passes.record("list", |pass| compaction.record(pass, idle));
        }
    }
}
