//! The warm-up of an engine: a whole frame before the first one.

use std::sync::Arc;

use crate::cull::options::CullOptions;
use crate::error::{Error, Result};
use crate::headless::cull::CullExtras;
use crate::headless::depth_image::DepthImage;
use crate::headless::engine::Engine;
use crate::headless::two_passes::EarlyMask;
use crate::input::bounds::Floats;
use crate::input::camera::Camera;
use crate::input::depth::DepthInput;
use crate::input::depth_kind::DepthKind;
use crate::input::tolerance::DepthTolerance;
use crate::input::world_tolerance::WorldTolerance;
use crate::instances::Instances;
use crate::instances::update::record_idle_update;
use crate::occluders::drawing::{DepthLoad, DrawOptions};
use crate::occluders::uploaded::Occluders;
use crate::output::outputs::Outputs;
use crate::output::views::ViewsOutputs;
use crate::pyramid::reduce::record_idle_reduce;
use crate::pyramid::{Pyramid, PyramidOptions};

/// What the frames of an [`Engine::warm_up`] do beside one cull; nothing by default.
///
/// # Examples
/// Two passes against the farthest of 4 samples, and culls for two cameras:
///
/// ```
/// use hiz_core::headless::MoreWarmUp;
///
/// let more = MoreWarmUp { two_passes: true, samples: 4, views: 2 };
/// # let _ = more;
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MoreWarmUp {
    /// The passes of [`Engine::two_passes`], with any set and any capacity of the early one.
    pub two_passes: bool,
    /// How many samples per pixel depth has that is uploaded; 1 without multisampling.
    pub samples: u32,
    /// How many views [`Engine::cull_views`] has; up to 1: it is not called.
    pub views: u32,
}

impl Default for MoreWarmUp {
    fn default() -> Self {
        Self { two_passes: false, samples: 1, views: 1 }
    }
}

impl Engine {
    /// Makes everything that frames like this one need, and waits until the driver has compiled it.
    ///
    /// It runs a frame: a depth image, its pyramid, a cull, and the reads of all that `outputs`
    /// asks for.
    /// `more` says what else frames do.
    /// The depth image is that of `occluders`, or without them an uploaded one; call it twice if
    /// frames have both.
    /// Only the camera's image size, depth convention and handedness matter.
    /// The instances keep their bounds, and updates of them are compiled as well.
    ///
    /// # Errors
    /// Those of the calls of a frame, and [`Error::Invalid`] for samples of a drawn image.
    #[expect(clippy::too_many_arguments, reason = "the objects of a frame, and its options")]
    pub fn warm_up(
        &self,
        instances: &Arc<Instances>,
        camera: &Camera,
        occluders: Option<&Occluders>,
        levels: &PyramidOptions,
        options: &CullOptions,
        outputs: &Outputs,
        more: &MoreWarmUp,
    ) -> Result<()> {
        let depth = match occluders {
            Some(_) if more.samples > 1 => {
                return Err(Error::invalid(
                    "samples",
                    format!("expected 1 for depth that is drawn, got {}", more.samples),
                ));
            }
            Some(occluders) => self.render_depth(occluders, camera)?,
            None => self.far_depth(camera, levels, more.samples)?,
        };
        let pyramid = self.warm_up_frame(instances, &depth, levels, options, outputs, more)?;
        if let Some(occluders) = occluders
            && pyramid.built().is_some_and(|built| built.in_place.is_some())
        {
            // An image to which more was added is read in its texture.
            let add = DrawOptions { load: DepthLoad::Load, ..DrawOptions::default() };
            self.render_depth_into(&depth, occluders, &add)?;
            self.warm_up_frame(instances, &depth, levels, options, outputs, more)?;
        }
        self.scoped(|| {
            let (gpu, mut encoder) = (&self.context().gpu, self.encoder("hiz.update.warm_up"));
            record_idle_update(gpu, &mut encoder, instances)?;
            // The host may have made this pyramid's levels, and leave later ones to the device.
            record_idle_reduce(gpu, &mut encoder, &depth.source(), camera, &pyramid)?;
            self.queue().submit([encoder.finish()]);
            Ok(())
        })?;
        self.wait()
    }

    /// Runs what comes behind the depth image, and returns the pyramid.
    fn warm_up_frame(
        &self,
        instances: &Arc<Instances>,
        depth: &DepthImage,
        levels: &PyramidOptions,
        options: &CullOptions,
        outputs: &Outputs,
        more: &MoreWarmUp,
    ) -> Result<Arc<Pyramid>> {
        let camera = depth.camera();
        let pyramid = self.pyramid_with(depth, levels)?;
        let culling = self.cull(instances, camera, &pyramid, options, outputs)?;
        if outputs.mask {
            culling.mask()?;
        }
        if outputs.mask || outputs.indices {
            culling.indices()?;
        }
        if outputs.verdicts {
            culling.counts()?;
        }
        if more.two_passes {
            self.warm_up_two_passes(instances, camera, &pyramid, options)?;
        }
        if more.views > 1 {
            let views = vec![(camera, &pyramid); more.views as usize];
            let each = Outputs { mask: true, verdicts: outputs.verdicts, ..Outputs::NONE };
            let outputs = ViewsOutputs { each, any: outputs.clone() };
            let extras = CullExtras::default();
            self.cull_views(instances, &views, options, &outputs, &extras)?.masks()?;
        }
        Ok(pyramid)
    }

    /// An image in which nothing is before the far plane.
    fn far_depth(
        &self,
        camera: &Camera,
        levels: &PyramidOptions,
        samples: u32,
    ) -> Result<DepthImage> {
        let convention = camera.convention();
        let far = vec![convention.far(); camera.size().pixels() as usize];
        let kind = if convention.is_reversed() { DepthKind::ReversedNdc } else { DepthKind::Ndc };
        let one = DepthInput {
            numbers: Floats::F32(&far).into(),
            kind,
            scale: 1.0,
            invalid: &[],
            tolerance: DepthTolerance::NONE,
            world_tolerance: WorldTolerance::NONE,
        };
        match samples {
            0..=1 => self.upload_depth_for(&one, camera, levels.depths),
            _ => self.upload_samples_for(&vec![one; samples as usize], camera, levels.depths),
        }
    }

    /// Runs two passes with every kind of early set, with a capacity and without.
    fn warm_up_two_passes(
        &self,
        instances: &Arc<Instances>,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
    ) -> Result<()> {
        let all = vec![true; instances.len() as usize];
        // A capacity that cuts.
        for capacity in [None, Some(instances.len().saturating_sub(1))] {
            let passes = self.two_passes(instances, capacity)?;
            for set in [EarlyMask::Largest { pixels: 1 }, EarlyMask::Given(&all)] {
                passes.early(camera, set)?.mask()?;
            }
            passes.late(camera, pyramid, options)?.mask()?;
            // Only now is there a history.
            passes.early(camera, EarlyMask::LastVisible)?.mask()?;
        }
        Ok(())
    }
}
