//! Readback for a renderer: what a cull found comes to the host some frames later.
//!
//! The copies are recorded behind the cull, into a ring of staging buffers.
//! The caller submits and polls its device as it does anyway, and asks whether an answer is there.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::{Error, Result};
use crate::gpu::copies::{BufferRange, Copies, StagingPool};
use crate::gpu::device::{ContextId, Gpu};
use crate::host::memory;
use crate::output::draw::DrawIndexedIndirect;
use crate::output::emit::Emit;
use crate::output::outputs::Outputs;
use crate::output::visible::Visible;

/// A ring of slots for answers that are on their way to the host.
/// [`HizContext::create_readback`](crate::HizContext::create_readback) makes it.
///
/// Two slots are enough for a renderer that reads the answer of the frame before.
///
/// # Examples
/// The answer of each frame is read a frame later, and nobody waits:
///
/// ```
/// # use hiz_core::headless::Engine;
/// # use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
/// # use hiz_core::{InstanceOptions, Outputs, Pose, Projection, PyramidOptions, wgpu};
/// # let engine = Engine::new(None)?;
/// # let (device, queue, hiz) = (engine.device(), engine.queue(), engine.context());
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let pyramid = engine.pyramid(&engine.upload_depth(&[0.01; 64 * 64], &camera)?)?;
/// # let (centers, radii) = ([0.0, 0.0, -5.0, 0.0, 0.0, -20.0], [0.5, 0.5]);
/// # let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
/// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
/// # let options = CullOptions::default();
///
/// let visible = hiz.create_visible(&instances, &Outputs::default())?;
/// let ring = hiz.create_readback(2)?;
/// let mut on_its_way = None;
/// for _frame in 0..3 {
///     let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
///     hiz.record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)?;
///     let this_frame = hiz.record_readback(&mut encoder, &visible, &ring)?;
///     queue.submit([encoder.finish()]);
///     // ... work of the frame; the renderer polls once a frame, as a submit does.
///     # engine.wait()?;
///     device.poll(wgpu::PollType::Poll).expect("the device is there");
///     if let Some(answer) = on_its_way.replace(this_frame).filter(|last| last.is_ready()) {
///         let answer = answer.answer()?;
///         assert!(answer.is_kept(0) && !answer.is_kept(1));
///         assert_eq!(answer.indices, [0]);
///     }
/// }
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct ReadbackRing {
    context: ContextId,
    pool: StagingPool,
    slots: usize,
    in_flight: Arc<AtomicUsize>,
}

impl ReadbackRing {
    pub(crate) fn new(gpu: &Gpu, slots: usize) -> Result<Self> {
        if !(1..=64).contains(&slots) {
            return Err(Error::invalid("slots", format!("expected 1..=64, got {slots}")));
        }
        let pool = StagingPool::new(slots);
        Ok(Self { context: gpu.id(), pool, slots, in_flight: Arc::default() })
    }

    /// How many answers may be on their way at a time.
    pub fn slots(&self) -> usize {
        self.slots
    }

    /// How many slots are taken: by answers that were neither read nor dropped.
    pub fn in_flight(&self) -> usize {
        self.in_flight.load(Ordering::Relaxed)
    }
}

/// A taken slot of a ring, which its drop gives back.
#[derive(Debug)]
struct Slot(Arc<AtomicUsize>);

impl Slot {
    fn take(ring: &ReadbackRing) -> Result<Self> {
        let most = ring.slots;
        let taken = ring.in_flight.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |taken| {
            (taken < most).then_some(taken + 1)
        });
        match taken {
            Ok(_) => Ok(Self(Arc::clone(&ring.in_flight))),
            Err(taken) => Err(Error::invalid(
                "ring",
                format!(
                    "expected a free slot, got {taken} answers in flight in {most} slots; poll the \
                     device, and read or drop one of them first"
                ),
            )),
        }
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// An answer on its way to the host.
///
/// Dropping it frees its slot, whether or not it has arrived and whether or not it was submitted.
#[derive(Debug)]
pub struct AnswerInFlight {
    copies: Copies,
    outputs: Outputs,
    counts: Vec<u32>,
    /// In the order of the pieces; empty where they were not asked for.
    masks: Vec<wgpu::Buffer>,
    lists: Vec<wgpu::Buffer>,
    draws: Option<wgpu::Buffer>,
    _slot: Slot,
}

/// What a cull found, on the host.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Answer {
    /// A bit per instance, lowest first, in the caller's numbering; 1 if kept.
    /// Empty without [`Outputs::mask`].
    pub mask: Vec<u32>,
    /// The list of kept instances of all pieces.
    /// Empty without [`Outputs::indices`].
    pub indices: Vec<u32>,
    /// The draw arguments, one record per piece.
    /// Empty without [`Outputs::draws`] and [`Outputs::indices`].
    pub draws: Vec<DrawIndexedIndirect>,
}

impl Answer {
    /// Whether an instance is kept, by the mask.
    ///
    /// # Panics
    /// Without [`Outputs::mask`], and for an instance that does not exist.
    pub fn is_kept(&self, index: u32) -> bool {
        self.mask[index as usize / 32] >> (index % 32) & 1 == 1
    }
}

impl AnswerInFlight {
    /// Whether the answer has arrived.
    ///
    /// A poll of the device finds out, as a submit does; this only looks at what it found.
    pub fn is_ready(&self) -> bool {
        self.copies.is_ready()
    }

    /// The answer, once [`is_ready`](Self::is_ready) says so.
    ///
    /// # Errors
    /// [`Error::Device`] if it has not arrived, or if the device is lost; [`Error::OutOfMemory`].
    pub fn answer(self) -> Result<Answer> {
        let words = |buffer: &wgpu::Buffer, size: u64| -> Result<Vec<u32>> {
            let range = BufferRange::first(buffer, size);
            match self.copies.with(&range, bytemuck::pod_collect_to_vec)? {
                Some(words) => Ok(words),
                None => Err(Error::Device("a range that was not copied".to_owned())),
            }
        };
        let instances: u64 = self.counts.iter().map(|n| u64::from(*n)).sum();
        let mut answer = Answer::default();
        if self.outputs.mask {
            answer.mask = memory::list(instances.div_ceil(32) as usize, "mask")?;
        }
        // Every piece but the last has a multiple of 32 instances, so the words join up.
        for (buffer, count) in self.masks.iter().zip(&self.counts) {
            answer.mask.extend(words(buffer, mask_bytes(*count))?);
        }
        if let Some(draws) = &self.draws {
            let words = words(draws, draws.size())?;
            answer.draws = bytemuck::pod_collect_to_vec(bytemuck::cast_slice::<u32, u8>(&words));
        }
        for (list, draw) in self.lists.iter().zip(&answer.draws) {
            answer.indices.extend(words(list, 4 * u64::from(draw.instance_count))?);
        }
        Ok(answer)
    }
}

/// Bytes of the mask of so many instances.
fn mask_bytes(count: u32) -> u64 {
    4 * u64::from(count.div_ceil(32))
}

/// Records the copies of everything that `visible` was asked for, except verdicts.
pub(crate) fn record_readback(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    visible: &Visible,
    ring: &ReadbackRing,
) -> Result<AnswerInFlight> {
    gpu.check_context("visible", visible.context)?;
    gpu.check_context("ring", ring.context)?;
    if visible.outputs().emit != Emit::List && visible.draw_arguments().is_some() {
        return Err(Error::invalid(
            "visible",
            format!(
                "expected outputs with Emit::List, or with a mask alone, got {}: bins and copied \
                 records are for the device's draws; copy Visible::list and draw_arguments into \
                 a buffer of your own, or let a second cull with a mask be read",
                visible.outputs()
            ),
        ));
    }
    let slot = Slot::take(ring)?;
    let pieces = 0..visible.num_pieces();
    let masks: Vec<_> = pieces.clone().filter_map(|p| visible.mask(p)).cloned().collect();
    let lists: Vec<_> = pieces.filter_map(|p| visible.list(p)).cloned().collect();
    let draws = visible.draw_arguments().cloned();
    let counts = visible.counts().to_vec();
    let mut ranges: Vec<_> = masks
        .iter()
        .zip(&counts)
        .map(|(mask, count)| BufferRange::first(mask, mask_bytes(*count)))
        .collect();
    ranges.extend(draws.iter().map(|draws| BufferRange::first(draws, draws.size())));
    ranges.extend(lists.iter().zip(&counts).map(|(list, count)| {
        BufferRange::first(list, 4 * u64::from((*count).min(visible.capacity())))
    }));
    let copies = gpu.recorded(|| Copies::record(gpu, encoder, &ring.pool, &ranges))?;
    let outputs = visible.outputs().clone();
    Ok(AnswerInFlight { copies, outputs, counts, masks, lists, draws, _slot: slot })
}
