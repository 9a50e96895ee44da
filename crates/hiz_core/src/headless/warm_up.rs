//! The warm-up of an engine: a whole frame before the first one.

use std::sync::Arc;

use crate::cull::options::CullOptions;
use crate::error::Result;
use crate::headless::engine::Engine;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::instances::update::record_idle_update;
use crate::occluders::uploaded::Occluders;
use crate::output::outputs::Outputs;
use crate::pyramid::PyramidOptions;

impl Engine {
    /// Makes everything that frames like this one need, and waits until the driver has compiled it.
    ///
    /// It runs a frame: a depth image, its pyramid, a cull, and the reads of all that `outputs`
    /// asks for.
    /// The depth image is that of `occluders`, or without them an uploaded one; call it twice if
    /// frames have both.
    /// Only the camera's image size, depth convention and handedness matter.
    /// The instances keep their bounds, and updates of them are compiled as well.
    ///
    /// # Errors
    /// Those of the calls of a frame.
    pub fn warm_up(
        &self,
        instances: &Arc<Instances>,
        camera: &Camera,
        occluders: Option<&Occluders>,
        levels: &PyramidOptions,
        options: &CullOptions,
        outputs: &Outputs,
    ) -> Result<()> {
        let depth = if let Some(occluders) = occluders {
            self.render_depth(occluders, camera)?
        } else {
            let far = camera.convention().far();
            self.upload_depth(&vec![far; camera.size().pixels() as usize], camera)?
        };
        let pyramid = self.pyramid_with(&depth, levels)?;
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
        self.scoped(|| {
            let mut encoder = self.encoder("hiz.update.warm_up");
            record_idle_update(&self.context().gpu, &mut encoder, instances)?;
            self.queue().submit([encoder.finish()]);
            Ok(())
        })?;
        self.wait()
    }
}
