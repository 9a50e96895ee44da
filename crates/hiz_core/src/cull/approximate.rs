//! Approximate culling: what can show in a few pixels alone is culled, and is counted.
//!
//! It is two passes: the count of pixels sets a bit for what may show in more pixels than are
//! negligible, and an ordinary cull is restricted to these instances.

use crate::cull::among::{Among, AmongMask, record_among};
use crate::cull::inputs::CullInputs;
use crate::cull::pixels::PixelPass;
use crate::cull::record::{check_visible, record_cull};
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::instances::Instances;
use crate::output::outputs::Outputs;
use crate::output::visible::Visible;

/// The buffers of an approximate cull.
/// [`HizContext::create_approximate`](crate::HizContext::create_approximate) makes them, and
/// [`HizContext::record_cull_approximate`](crate::HizContext::record_cull_approximate) fills them.
///
/// They are no [`Visible`] of a certified cull: what is missing from them may show.
/// [`pixels`](Self::pixels) says in how many pixels.
///
/// # Examples
/// A ball that shows in few pixels, beside a larger one:
///
/// ```
/// # use hiz_core::headless::Engine;
/// # use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
/// # use hiz_core::{InstanceOptions, Outputs, Pose, Projection};
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let pyramid = engine.pyramid(&engine.upload_depth(&[0.0; 64 * 64], &camera)?)?;
/// # let (centers, radii) = ([0.0, 0.0, -5.0, 1.0, 0.0, -50.0], [0.5, 0.5]);
/// # let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
/// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
/// # let options = CullOptions::default();
/// let outputs = Outputs { mask: true, ..Outputs::NONE };
/// let seen = engine.cull_approximate(&instances, &camera, &pyramid, &options, &outputs, 10)?;
/// assert_eq!(seen.culling().mask()?, [true, false]);
/// // No picture differs by more pixels than this.
/// assert!((1..=10).contains(&seen.pixels_lost()?));
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct Approximate {
    /// The counts, and a mask of what is not negligible.
    pub(crate) counted: Visible,
    pub(crate) among: Among,
    visible: Visible,
}

impl Approximate {
    pub(crate) fn new(gpu: &Gpu, instances: &Instances, outputs: &Outputs) -> Result<Self> {
        let outputs = Outputs { pixels: false, ..outputs.clone() };
        Ok(Self {
            counted: counted(gpu, instances)?,
            among: Among::new(gpu, instances)?,
            visible: Visible::new(gpu, instances, &outputs)?,
        })
    }

    /// What is kept.
    pub fn visible(&self) -> &Visible {
        &self.visible
    }

    /// A piece's [`PixelCounts`](crate::PixelCounts), of all instances.
    ///
    /// What is negligible can show in `touched - hidden` pixels, and the sum of these bounds the
    /// pixels by which a picture can differ.
    ///
    /// # Panics
    /// If `piece` is not below the number of pieces.
    pub fn pixels(&self, piece: usize) -> &wgpu::Buffer {
        self.counted.pixels(piece).expect("it counts pixels")
    }

    /// A piece's mask of what may show in more pixels than are negligible, in the caller's
    /// numbering.
    ///
    /// # Panics
    /// If `piece` is not below the number of pieces.
    pub fn more_than_negligible(&self, piece: usize) -> &wgpu::Buffer {
        &self.counted.pieces[piece].mask
    }
}

/// The buffers that a count fills.
pub(crate) fn counted(gpu: &Gpu, instances: &Instances) -> Result<Visible> {
    Visible::new(gpu, instances, &Outputs { mask: true, pixels: true, ..Outputs::NONE })
}

/// Records the count, and what restricts a cull to the instances that are not negligible.
pub(crate) fn record_more_than_negligible(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    (counted, among): (&Visible, &Among),
    negligible_px: u32,
) -> Result<()> {
    check_visible(gpu, "approximate", inputs.instances, counted)?;
    let Some(pass) = PixelPass::new(gpu, inputs, counted, Some(negligible_px))? else {
        return Err(Error::mismatch("approximate", "expected buffers for counts of pixels"));
    };
    gpu.recorded(|| {
        for (piece, output) in inputs.instances.pieces.iter().zip(&counted.pieces) {
            encoder.clear_buffer(&output.mask, 0, Some(4 * u64::from(piece.words().max(1))));
        }
        pass.record(encoder, inputs.pyramid);
        Ok(())
    })?;
    record_among(gpu, encoder, inputs.instances, &AmongMask::Kept(counted), among)
}

/// Records an approximate cull.
pub(crate) fn record_cull_approximate(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    approximate: &Approximate,
    negligible_px: u32,
) -> Result<()> {
    let Approximate { counted, among, visible } = approximate;
    check_visible(gpu, "approximate", inputs.instances, visible)?;
    record_more_than_negligible(gpu, encoder, inputs, (counted, among), negligible_px)?;
    record_cull(gpu, encoder, &CullInputs { among: Some(among), ..*inputs }, visible)
}
