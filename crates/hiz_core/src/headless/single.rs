//! A cull of bounds that are used once.
//!
//! A sort costs more than it saves a single cull, and records of all bounds would pass through the
//! memory four times.
//! So the bounds go to the device in parts, in the caller's order, and each part is culled at once.
//! While the device culls a part, the host packs the next one.
//! The memory that this takes does not grow with the number of bounds.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::cull::options::{CullOptions, Hierarchy};
use crate::error::Result;
use crate::headless::counts::Counts;
use crate::headless::cull::{CullExtras, Question, Reading};
use crate::headless::culling::Culling;
use crate::headless::depth_image::DepthImage;
use crate::headless::engine::Engine;
use crate::headless::kept_depth::KeptDepth;
use crate::host::memory;
use crate::input::bounds::{Bounds, BoundsKind};
use crate::input::camera::Camera;
use crate::input::depth::DepthInput;
use crate::instances::InstanceOptions;
use crate::instances::order::StoredOrder;
use crate::output::outputs::Outputs;
use crate::pyramid::atlas::AtlasUse;
use crate::pyramid::ends::Depths;
use crate::pyramid::{Pyramid, PyramidOptions};

/// Bounds of a part: as many as fit the caches of a core, and have a mask that needs no submit of
/// its own to be read.
const PART: usize = 1 << 16;

/// Parts that are on the device at a time: one is culled while the next one is copied.
const AT_A_TIME: usize = 3;

/// The largest image that is kept from call to call, with its pyramid: 3840x2160 pixels and more.
const MOST_KEPT_PIXELS: u64 = 1 << 24;

/// The answer of [`Engine::cull_once`].
#[derive(Debug, Clone)]
pub struct SingleCull {
    /// Whether each instance is kept, by its index.
    pub mask: Vec<bool>,
    /// The verdicts of the first instances, counted.
    pub first_counts: Counts,
}

impl Engine {
    /// Culls bounds that are used once by a depth image that is used once.
    ///
    /// A call keeps the texture of its image and the pyramid, for the next call of the same size.
    /// That is up to 64 MiB for the image and as much again for the pyramid and its atlas.
    /// An image of more than 2^24 pixels is not kept.
    ///
    /// # Errors
    /// Those of [`Engine::upload_depth_of_kind`], [`Engine::pyramid`] and [`Engine::cull_once`].
    pub fn cull_once_by_depth(
        &self,
        bounds: &Bounds<'_>,
        camera: &Camera,
        depth: &DepthInput<'_>,
        options: &CullOptions,
    ) -> Result<SingleCull> {
        self.check_process()?;
        // A thread that comes meanwhile finds none, and makes its own.
        let kept = self.kept_depth().lock().take();
        let pixels = camera.size().pixels();
        // A quarter of the texels: `AtlasUse::Auto` would look at the parts alone.
        let has_atlas = 4 * bounds.len()? as u64 >= pixels + pixels / 3;
        let kept =
            kept.filter(|kept| kept.pyramid.size() == camera.size() && kept.has_atlas == has_atlas);
        let (image, pyramid) = match kept {
            Some(KeptDepth { texture, view, pyramid, .. }) => {
                let image = DepthImage::again(self, texture, view, camera);
                (image, pyramid)
            }
            None => {
                let atlas = if has_atlas { AtlasUse::Always } else { AtlasUse::Never };
                let options = PyramidOptions { atlas, ..PyramidOptions::default() };
                let image = DepthImage::for_upload(self, camera)?;
                (image, self.context().create_pyramid(camera.size(), &options)?)
            }
        };
        let image = image.filled(depth, Depths::Farthest)?;
        self.reduce(&image, &pyramid)?;
        let pyramid = Arc::new(pyramid);
        let answer = self.cull_once(bounds, camera, &pyramid, options)?;
        if let (Some(pyramid), true) = (Arc::into_inner(pyramid), pixels <= MOST_KEPT_PIXELS) {
            let DepthImage { texture, view, .. } = image;
            let kept = KeptDepth { texture, view, pyramid, has_atlas };
            *self.kept_depth().lock() = Some(kept);
        }
        Ok(answer)
    }

    /// Culls bounds that are used once: upload and cull in one, without a sort.
    ///
    /// The mask is that of a cull of every instance by itself.
    /// [`Hierarchy::Auto`] tests no groups, which pay only after a sort.
    ///
    /// # Errors
    /// Those of [`Engine::instances`] and [`Engine::cull`].
    pub fn cull_once(
        &self,
        bounds: &Bounds<'_>,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
    ) -> Result<SingleCull> {
        let count = bounds.len()?;
        let hierarchy = match options.hierarchy {
            Hierarchy::Auto => Hierarchy::Never,
            chosen => chosen,
        };
        let options = CullOptions { hierarchy, statistics: false, ..options.clone() };
        // Spheres of radius 0 take three quarters of the time as points, whose records have half of
        // the bytes.
        // Their guard is that of spheres.
        let of_points =
            CullOptions { guard_px: Some(options.guard_of(BoundsKind::Sphere)), ..options.clone() };
        #[allow(clippy::needless_update, reason = "`testing` adds a field")]
        let upload = InstanceOptions { order: StoredOrder::Given, ..InstanceOptions::default() };
        let mut answer =
            SingleCull { mask: memory::list(count, "mask")?, first_counts: Counts::default() };
        let mut on_device = VecDeque::new();
        for start in (0..count.max(1)).step_by(PART) {
            if on_device.len() == AT_A_TIME {
                answer.take(&mut on_device)?;
            }
            let part = bounds.part(&(start..count.min(start + PART)));
            let (part, options) = match part.as_points() {
                Some(points) => (points, &of_points),
                None => (part, &options),
            };
            let outputs = Outputs { mask: true, verdicts: start == 0, ..Outputs::NONE };
            let has_groups = options.hierarchy == Hierarchy::Always;
            // One submission for both: each takes as long as thousands of tests.
            let (instances, copies) = self.instances_for_one(&part, &upload, has_groups)?;
            let question =
                Question { instances: &instances, camera, pyramid, options, among: None };
            let extras = CullExtras::default();
            let culling = self.cull_after(copies, &question, &outputs, Reading::Staged, &extras)?;
            on_device.push_back(culling);
        }
        while !on_device.is_empty() {
            answer.take(&mut on_device)?;
        }
        Ok(answer)
    }
}

impl SingleCull {
    /// Reads the answer of the part that was submitted first.
    fn take(&mut self, on_device: &mut VecDeque<Culling>) -> Result<()> {
        let Some(culling) = on_device.pop_front() else { return Ok(()) };
        if self.mask.is_empty() {
            self.first_counts = culling.counts()?;
        }
        self.mask.append(&mut culling.mask()?);
        Ok(())
    }
}
