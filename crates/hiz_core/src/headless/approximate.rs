//! Approximate culls, submitted and read.

use std::sync::Arc;

use crate::cull::among::Among;
use crate::cull::approximate::{counted, record_more_than_negligible};
use crate::cull::inputs::CullInputs;
use crate::cull::options::CullOptions;
use crate::error::Result;
use crate::headless::cull::{CullExtras, Question, Reading};
use crate::headless::culling::{Culling, spread_bits};
use crate::headless::engine::Engine;
use crate::headless::ranges::{mask_ranges, pixel_ranges};
use crate::headless::readback;
use crate::host::memory;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::output::outputs::Outputs;
use crate::output::pixels::PixelCounts;
use crate::output::visible::Visible;
use crate::pyramid::Pyramid;

/// An approximate cull that was submitted.
///
/// What it leaves out may show, in at most [`pixels_lost`](Self::pixels_lost) pixels of a picture.
/// [`Approximate`](crate::Approximate) has an example.
#[derive(Debug)]
pub struct ApproximateCulling {
    engine: Engine,
    culling: Culling,
    counted: Arc<Visible>,
}

impl Engine {
    /// Culls what is hidden, and what can show in at most `negligible_px` pixels.
    ///
    /// # Errors
    /// Those of [`Engine::cull`].
    pub fn cull_approximate(
        &self,
        instances: &Arc<Instances>,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
        outputs: &Outputs,
        negligible_px: u32,
    ) -> Result<ApproximateCulling> {
        self.check_process()?;
        let gpu = &self.context().gpu;
        let (counted, among) = self.scoped(|| {
            self.bring_image_of(pyramid);
            let counted = Arc::new(counted(gpu, instances)?);
            let among = Arc::new(Among::new(gpu, instances)?);
            let inputs = CullInputs::new(instances, camera, pyramid, options);
            let mut encoder = self.encoder("hiz.approximate.encoder");
            let into = (&*counted, &*among);
            record_more_than_negligible(gpu, &mut encoder, &inputs, into, negligible_px)?;
            self.queue().submit([encoder.finish()]);
            Ok((counted, among))
        })?;
        let outputs = Outputs { pixels: false, ..outputs.clone() };
        let question = Question { instances, camera, pyramid, options, among: None };
        let extras = CullExtras { among: Some(&among), ..CullExtras::default() };
        let culling = self.cull_with(&question, &outputs, Reading::Staged, &extras)?;
        Ok(ApproximateCulling { engine: self.clone(), culling, counted })
    }
}

impl ApproximateCulling {
    /// What is kept.
    /// To it, what is negligible was not asked for: its verdict is outside.
    pub fn culling(&self) -> &Culling {
        &self.culling
    }

    /// The counts of all instances, by index.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost),
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn pixels(&self) -> Result<Vec<PixelCounts>> {
        let instances = self.culling.instances();
        let ranges = pixel_ranges(instances, &self.counted);
        let parts = self.engine.scoped(|| {
            readback::read_buffers(self.engine.device(), self.engine.queue(), &ranges)
        })?;
        let mut counts = memory::list(instances.len() as usize, "pixels")?;
        for part in parts {
            counts.extend(bytemuck::pod_collect_to_vec::<u8, PixelCounts>(&part));
        }
        Ok(counts)
    }

    /// Whether each instance can show in at most as many pixels as are negligible, by its index.
    /// So it was culled, whether it shows or not.
    ///
    /// # Errors
    /// Those of [`pixels`](Self::pixels).
    pub fn negligible(&self) -> Result<Vec<bool>> {
        let instances = self.culling.instances();
        let ranges = mask_ranges(instances, &self.counted);
        let planes = self.engine.scoped(|| {
            readback::read_buffers(self.engine.device(), self.engine.queue(), &ranges)
        })?;
        let mut negligible = memory::list(instances.len() as usize, "negligible")?;
        negligible.resize(instances.len() as usize, false);
        let mut rest = &mut negligible[..];
        for (piece, plane) in instances.pieces.iter().zip(&planes) {
            let (part, behind) = rest.split_at_mut(piece.count() as usize);
            spread_bits(plane, part);
            rest = behind;
        }
        for is_negligible in &mut negligible {
            *is_negligible = !*is_negligible;
        }
        Ok(negligible)
    }

    /// The most pixels by which a picture without what is negligible differs from one with it.
    ///
    /// It is the sum of the pixels in which each of these instances can show.
    ///
    /// # Errors
    /// Those of [`pixels`](Self::pixels).
    pub fn pixels_lost(&self) -> Result<u64> {
        let (counts, negligible) = (self.pixels()?, self.negligible()?);
        let lost = counts.iter().zip(&negligible).filter(|(_, is_negligible)| **is_negligible);
        Ok(lost.map(|(counts, _)| u64::from(counts.most_shown())).sum())
    }
}
