//! The two passes of a frame: what they share, and what one frame leaves for the next.
//!
//! `early` draws what was visible before, and `late` tests all instances against the depth of that.
//! Whatever the early pass draws, the image is right (`docs/accuracy.md` has the theorem).
//! So a history that is stale costs time, and nothing visible is lost.
//!
//! Three rules keep that true:
//!
//! - What counts as drawn is the early pass's mask after the capacity of its list was applied.
//! - It counts in its own frame alone: early passes are numbered, the device keeps the number of
//!   the last one that ran, and a late pass that finds another number takes nothing as drawn.
//! - A late pass clears the whole history before it notes what it keeps.

use std::sync::OnceLock;

use crate::cull::groups::GROUPS_OF_RUN;
use crate::cull::lod::LodRule;
use crate::cull::options::CullOptions;
use crate::cull::view_uniform::ViewUniform;
use crate::error::{Error, Result};
use crate::gpu::buffers::STORAGE;
use crate::gpu::device::{ContextId, Gpu};
use crate::gpu::kept::KeptBindings;
use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::instances::batch::GROUP;
use crate::instances::piece::Piece;
use crate::instances::tiers::TIERS;
use crate::instances::{Instances, InstancesId};
use crate::output::outputs::Outputs;
use crate::output::visible::Visible;

/// Words in front of the bits of a history; `shaders/cull/history.wgsl`.
pub(crate) const HISTORY_BEGIN: u32 = 4;

/// The least side in pixels of what is drawn first after a reset.
///
/// With 12 the first two frames of a street drew 362 and 96 of 3,400 instances, where the best
/// possible were 70; without any early set both drew 3,335 (`docs/accuracy.md`).
const FIRST_PIXELS: u32 = 12;

/// The callers' masks whose bind groups are kept, per piece.
const GIVEN_KEPT: usize = 3;

/// Twin: `shaders/cull/history.wgsl`, `Frame`.
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct FrameUniform {
    pub(crate) early: u32,
    pub(crate) least_pixels: i32,
    pub(crate) padding: [u32; 2],
}

/// What an early pass draws.
///
/// Any set gives the right image, and a set that hides much makes the late pass small.
/// What lies outside of the view is left out of each.
#[derive(Debug, Clone, Copy)]
pub enum EarlySet<'a> {
    /// What the last late pass found visible.
    ///
    /// After [`Temporal::reset`], and for instances that the last late pass did not test, there is
    /// no such set.
    /// It is [`EarlySet::Largest`] with 12 pixels then.
    LastVisible,
    /// What is at least this many pixels wide or high in the image, by its bounds.
    ///
    /// Take it in the first frame after a camera cut.
    Largest {
        /// The least side of the rectangle around the bounds, in pixels.
        pixels: u32,
    },
    /// What a mask of the caller names: one bit per instance in the caller's numbering.
    ///
    /// Each u32 word holds 32 instances, lowest bit first, as in [`Visible::mask`].
    /// The buffer has the usage `STORAGE` and all words of all instances.
    Given(&'a wgpu::Buffer),
}

/// The two passes of a view: the buffers that they fill, and its history.
///
/// Make one for each view, such as each eye or each cascade.
/// [`HizContext::record_early`](crate::HizContext::record_early) has an example.
#[derive(Debug)]
pub struct Temporal {
    pub(crate) context: ContextId,
    pub(super) early: Visible,
    pub(super) late: Visible,
    pub(super) pieces: Vec<History>,
    /// `FrameUniform` of the pass that runs.
    pub(super) frame: wgpu::Buffer,
    /// The view of an early pass, and what binds it.
    pub(super) view: wgpu::Buffer,
    pub(super) view_bindings: OnceLock<wgpu::BindGroup>,
    state: Locked<State>,
}

/// The history of a piece, and what the passes bind with it.
#[derive(Debug)]
pub(super) struct History {
    pub(super) words: wgpu::Buffer,
    /// What early passes bind, by the caller's mask; the stand-in of the others is one of them.
    pub(super) early: KeptBindings<wgpu::Buffer>,
    /// One per tier of boxes.
    pub(super) early_groups: [OnceLock<wgpu::BindGroup>; TIERS],
    /// What late passes bind, without and with the count of levels.
    pub(super) late: [OnceLock<wgpu::BindGroup>; 2],
    pub(super) cut: OnceLock<wgpu::BindGroup>,
}

/// What was recorded last.
#[derive(Debug, Default)]
struct State {
    /// The number of the last early pass; 0 before the first.
    number: u32,
    /// The instances that the last late pass tested; `None` after a reset.
    tested: Option<InstancesId>,
    /// The early pass that no late pass has followed.
    early: Option<Early>,
}

/// An early pass, as its late pass has to find everything.
#[derive(Debug)]
struct Early {
    number: u32,
    camera: Camera,
    lod: LodRule,
    instances: InstancesId,
    /// What [`Instances::changes`] said.
    changes: [u32; 2],
}

impl Temporal {
    pub(crate) fn new(gpu: &Gpu, instances: &Instances, outputs: &Outputs) -> Result<Self> {
        if !(outputs.mask || outputs.indices || outputs.draws) {
            return Err(Error::invalid(
                "outputs",
                format!(
                    "expected mask, indices or draws, which an early pass is drawn from, got \
                     {outputs}"
                ),
            ));
        }
        if outputs.pixels {
            return Err(Error::invalid(
                "outputs",
                "expected outputs without pixels for the two passes of a frame, got some with; \
                 count by a cull of its own against the pyramid of the late pass",
            ));
        }
        let early = Outputs { verdicts: false, ..outputs.clone() };
        let late = Outputs { capacity: None, ..outputs.clone() };
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let size = size_of::<ViewUniform>() as u64;
        Ok(Self {
            context: gpu.id(),
            early: Visible::of_two_passes(gpu, instances, &early)?,
            late: Visible::of_two_passes(gpu, instances, &late)?,
            pieces: instances
                .pieces
                .iter()
                .map(|piece| History::new(gpu, piece))
                .collect::<Result<_>>()?,
            frame: gpu.empty("hiz.temporal.frame", size_of::<FrameUniform>() as u64, usage)?,
            view: gpu.empty("hiz.temporal.early_view", size, usage)?,
            view_bindings: OnceLock::new(),
            state: Locked::default(),
        })
    }

    /// What the early pass draws.
    pub fn early(&self) -> &Visible {
        &self.early
    }

    /// What the late pass draws: all that is visible and not in [`Temporal::early`].
    pub fn late(&self) -> &Visible {
        &self.late
    }

    /// Forgets what was visible, as after a camera cut.
    ///
    /// The next early pass draws by size instead.
    /// Without it the image is right as well, but one frame draws what was visible before the cut.
    pub fn reset(&self) {
        self.state.lock().tested = None;
    }

    /// Bytes on the device: those of [`Temporal::early`] and [`Temporal::late`], and a bit per
    /// instance.
    pub fn device_bytes(&self) -> u64 {
        let histories = self.pieces.iter().map(|piece| piece.words.size()).sum::<u64>();
        self.early.device_bytes() + self.late.device_bytes() + histories
    }

    /// The history of a piece, for tests that overwrite it.
    /// From word 4 on, bit k of byte `8 g + s` is the place `64 g + s + 8 k`.
    #[cfg(feature = "testing")]
    pub fn history(&self, piece: usize) -> &wgpu::Buffer {
        &self.pieces[piece].words
    }

    /// The set that an early pass draws instead of `set`, if there is no history yet.
    pub(super) fn set_or_largest<'a>(
        &self,
        set: EarlySet<'a>,
        instances: &Instances,
    ) -> EarlySet<'a> {
        let is_known = self.state.lock().tested == Some(instances.id);
        match set {
            EarlySet::LastVisible if !is_known => EarlySet::Largest { pixels: FIRST_PIXELS },
            other => other,
        }
    }

    /// A number for an early pass.
    pub(super) fn next_number(&self) -> u32 {
        let mut state = self.state.lock();
        // 0 stands for no early pass.
        state.number = state.number.checked_add(1).unwrap_or(1);
        state.number
    }

    /// Notes that an early pass was recorded.
    pub(super) fn note_early(
        &self,
        number: u32,
        instances: &Instances,
        camera: &Camera,
        options: &CullOptions,
    ) {
        let changes = instances.changes();
        self.state.lock().early = Some(Early {
            number,
            camera: camera.clone(),
            lod: options.lod.clone(),
            instances: instances.id,
            changes,
        });
    }

    /// The number of the early pass that a late pass follows, or 0.
    ///
    /// # Errors
    /// [`Error::Mismatch`] if the late pass sees another scene or another view.
    pub(super) fn followed(
        &self,
        instances: &Instances,
        camera: &Camera,
        options: &CullOptions,
    ) -> Result<u32> {
        let state = self.state.lock();
        let Some(early) = &state.early else { return Ok(0) };
        if early.instances != instances.id {
            return Err(Error::mismatch(
                "instances",
                "expected those of this frame's `record_early`, got others; upload before it",
            ));
        }
        if early.changes != instances.changes() {
            return Err(Error::mismatch(
                "instances",
                "expected no update between `record_early` and `record_late`, which show one \
                 moment, got one; update before the first or after the second",
            ));
        }
        if early.camera != *camera {
            return Err(Error::mismatch(
                "camera",
                "expected that of this frame's `record_early`, jitter included, got another one",
            ));
        }
        if early.lod != options.lod {
            return Err(Error::mismatch(
                "lod",
                format!(
                    "expected that of this frame's `record_early`, {:?}, got {:?}",
                    early.lod, options.lod
                ),
            ));
        }
        Ok(early.number)
    }

    /// Notes that a late pass was recorded.
    pub(super) fn note_late(&self, instances: &Instances) {
        let mut state = self.state.lock();
        state.early = None;
        state.tested = Some(instances.id);
    }
}

impl History {
    fn new(gpu: &Gpu, piece: &Piece) -> Result<Self> {
        // A workgroup of a flat cull takes so many groups, whether there are as many or not.
        let groups = piece.groups().max(1).next_multiple_of(GROUPS_OF_RUN);
        let words = HISTORY_BEGIN + groups * (GROUP as u32 / u32::BITS);
        Ok(Self {
            words: gpu.empty("hiz.temporal.history", 4 * u64::from(words), STORAGE)?,
            early: KeptBindings::new(GIVEN_KEPT),
            early_groups: Default::default(),
            late: Default::default(),
            cut: OnceLock::new(),
        })
    }
}
