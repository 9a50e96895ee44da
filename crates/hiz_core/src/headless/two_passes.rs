//! The two passes of a frame on the engine's own device, with answers that are read.

use std::sync::Arc;

use crate::cull::history::{EarlySet, Temporal};
use crate::cull::lod::LodRule;
use crate::cull::options::CullOptions;
use crate::error::{Error, Result};
use crate::headless::culling::spread_bits;
use crate::headless::engine::Engine;
use crate::headless::ranges::{mask_bytes, mask_ranges};
use crate::headless::readback::Staged;
use crate::host::memory;
use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::output::outputs::Outputs;
use crate::output::visible::Visible;
use crate::pyramid::Pyramid;

/// The two passes of a view: [`Temporal`] with a device, and with answers that are read.
///
/// # Examples
/// A wall hides a ball, as the depth of the wall says:
///
/// ```
/// # use hiz_core::headless::Engine;
/// # use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
/// # use hiz_core::{InstanceOptions, Pose, Projection};
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let (min, max) = ([-9.0, -9.0, -11.0, 0.0, 0.0, -20.0], [9.0, 9.0, -10.0, 1.0, 1.0, -19.0]);
/// # let bounds = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };
/// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
/// use hiz_core::headless::EarlyMask;
///
/// let passes = engine.two_passes(&instances, None)?;
/// let early = passes.early(&camera, EarlyMask::Largest { pixels: 20 })?;
/// assert_eq!(early.mask()?, [true, false]);
///
/// // What the renderer has drawn of that: the wall, 10 m away.
/// let pyramid = engine.pyramid(&engine.upload_depth(&[0.01; 64 * 64], &camera)?)?;
/// let late = passes.late(&camera, &pyramid, &CullOptions::default())?;
/// assert_eq!(late.mask()?, [false, false]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct TwoPasses {
    engine: Engine,
    instances: Arc<Instances>,
    temporal: Temporal,
    /// Held while a pass is recorded and submitted, so that both happen in one order.
    submitting: Locked<()>,
}

/// What an early pass draws; [`EarlySet`] says more.
#[derive(Debug, Clone, Copy)]
pub enum EarlyMask<'a> {
    /// What the last late pass found visible.
    LastVisible,
    /// What is at least this many pixels wide or high.
    Largest {
        /// The least side, in pixels.
        pixels: u32,
    },
    /// Those of the instances for which this says so.
    Given(&'a [bool]),
}

impl Engine {
    /// Makes the two passes of a view.
    ///
    /// `early_capacity`: how many instances an early pass lists at most; `None`: all.
    ///
    /// # Errors
    /// Those of [`HizContext::create_temporal`](crate::HizContext::create_temporal), and
    /// [`Error::DeviceLost`].
    pub fn two_passes(
        &self,
        instances: &Arc<Instances>,
        early_capacity: Option<u32>,
    ) -> Result<TwoPasses> {
        // Masks are read; lists are only counted, where a capacity cuts them.
        let outputs = Outputs {
            mask: true,
            draws: early_capacity.is_some(),
            capacity: early_capacity,
            ..Outputs::NONE
        };
        let temporal = self.scoped(|| self.context().create_temporal(instances, &outputs))?;
        Ok(TwoPasses {
            engine: self.clone(),
            instances: Arc::clone(instances),
            temporal,
            submitting: Locked::default(),
        })
    }
}

impl TwoPasses {
    /// The instances.
    pub fn instances(&self) -> &Instances {
        &self.instances
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        self.temporal.device_bytes()
    }

    /// Forgets what was visible ([`Temporal::reset`]).
    pub fn reset(&self) {
        self.temporal.reset();
    }

    /// Records and submits an early pass.
    ///
    /// # Errors
    /// - Those of [`HizContext::record_early`](crate::HizContext::record_early).
    /// - [`Error::Invalid`] for a mask of another length.
    /// - [`Error::DeviceLost`].
    pub fn early(&self, camera: &Camera, set: EarlyMask<'_>) -> Result<PassAnswer> {
        let options = CullOptions::default();
        let given = match set {
            EarlyMask::Given(mask) => Some(self.mask_buffer(mask)?),
            EarlyMask::LastVisible | EarlyMask::Largest { .. } => None,
        };
        let set = match (set, &given) {
            (EarlyMask::Largest { pixels }, _) => EarlySet::Largest { pixels },
            (EarlyMask::Given(_), Some(given)) => EarlySet::Given(given),
            _ => EarlySet::LastVisible,
        };
        self.submit(self.temporal.early(), |encoder| {
            let context = self.engine.context();
            let temporal = &self.temporal;
            context.record_early(encoder, &self.instances, camera, temporal, set, &options)
        })
    }

    /// Records and submits a late pass.
    ///
    /// # Errors
    /// Those of [`HizContext::record_late`](crate::HizContext::record_late), and
    /// [`Error::DeviceLost`].
    pub fn late(
        &self,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
    ) -> Result<PassAnswer> {
        // Masks do not say which level of detail is drawn.
        let options = CullOptions { lod: LodRule::Finest, ..options.clone() };
        self.submit(self.temporal.late(), |encoder| {
            let (context, temporal) = (self.engine.context(), &self.temporal);
            context.record_late(encoder, &self.instances, camera, pyramid, temporal, &options)
        })
    }

    fn mask_buffer(&self, mask: &[bool]) -> Result<wgpu::Buffer> {
        let expected = self.instances.len() as usize;
        if mask.len() != expected {
            return Err(Error::invalid(
                "set",
                format!("expected a mask of {expected} instances, got {}", mask.len()),
            ));
        }
        let mut words = memory::list(expected.div_ceil(32).max(1), "set")?;
        words.extend(mask.chunks(32).map(|bits| {
            bits.iter().rev().fold(0_u32, |word, is_set| word << 1 | u32::from(*is_set))
        }));
        words.resize(expected.div_ceil(32).max(1), 0);
        let (gpu, bytes) = (&self.engine.context().gpu, bytemuck::cast_slice(&words));
        let storage = wgpu::BufferUsages::STORAGE;
        self.engine.scoped(|| gpu.filled("hiz.early.given", bytes, storage))
    }

    /// Submits what `record` records, and a copy of the mask that it leaves.
    fn submit(
        &self,
        visible: &Visible,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
    ) -> Result<PassAnswer> {
        let Self { engine, instances, .. } = self;
        let bytes: u64 = instances.pieces.iter().map(mask_bytes).sum();
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let _order = self.submitting.lock();
        engine.scoped(|| {
            let mut encoder = engine.encoder("hiz.two_passes.encoder");
            engine.timed(&mut encoder, record)?;
            let staged = if bytes == 0 {
                None
            } else {
                let staging = engine.context().gpu.empty("hiz.readback.staging", bytes, usage)?;
                Some(Staged::record(&mut encoder, staging, &mask_ranges(instances, visible)))
            };
            let submission = engine.queue().submit([encoder.finish()]);
            Ok(PassAnswer {
                engine: engine.clone(),
                instances: Arc::clone(instances),
                staged: Locked::new(staged),
                submission,
            })
        })
    }
}

/// What one pass draws.
/// It stays as it is while later passes run, and reading it waits for its own pass.
#[derive(Debug)]
pub struct PassAnswer {
    engine: Engine,
    instances: Arc<Instances>,
    /// Held during a read: a buffer is mapped by one reader at a time.
    staged: Locked<Option<Staged>>,
    submission: wgpu::SubmissionIndex,
}

impl PassAnswer {
    /// Whether each instance is drawn by this pass, by its index.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn mask(&self) -> Result<Vec<bool>> {
        self.engine.check_process()?;
        let mut mask = memory::list(self.instances.len() as usize, "mask")?;
        mask.resize(self.instances.len() as usize, false);
        let staged = self.staged.lock();
        let Some(staged) = &*staged else { return Ok(mask) };
        let (device, submission) = (self.engine.device(), self.submission.clone());
        self.engine.scoped(|| {
            staged.read(device, submission, |planes| {
                let mut rest = &mut mask[..];
                for (piece, plane) in self.instances.pieces.iter().zip(planes) {
                    let (part, behind) = rest.split_at_mut(piece.count() as usize);
                    spread_bits(plane, part);
                    rest = behind;
                }
            })
        })?;
        Ok(mask)
    }

    /// The instances.
    pub fn instances(&self) -> &Instances {
        &self.instances
    }
}
