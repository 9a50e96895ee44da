//! The maps of one view, with the depth-estimation buffer beside them.

use crate::error::Result;
use crate::host::memory;
use crate::input::camera::Camera;
use crate::input::image::{DepthConvention, ImageSize};
use crate::methods::occlusion_map::estimate::Estimate;
#[cfg(feature = "testing")]
use crate::methods::occlusion_map::fault::MapFault;
use crate::methods::occlusion_map::fault::Planted;
use crate::methods::occlusion_map::levels::Levels;
use crate::methods::occlusion_map::options::MapOptions;
use crate::methods::occlusion_map::select::chosen;
use crate::methods::seen::Eye;
use crate::occluders::drawing::{DrawOptions, Only};
use crate::occluders::host_raster::{HostRaster, Way};
use crate::occluders::surface::OccluderSurface;

/// Maps of what the occluders of one view cover, and about how far they are.
///
/// # Examples
/// ```
/// use hiz_core::methods::occlusion_map::{MapCull, MapOptions, OcclusionMap};
/// use hiz_core::{Bounds, Floats, MeshData, OccluderOptions, OccluderSurface, Verdict};
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(256, 256))?;
///
/// // A wall over the left half of the view, 10 m away.
/// let corners = [-20.0, -20.0, -10.0, 0.0, -20.0, -10.0, -20.0, 20.0, -10.0, 0.0, 20.0, -10.0];
/// let (vertices, triangles) = (Floats::F32(&corners), &[0, 1, 2, 2, 1, 3]);
/// let wall = MeshData { vertices, triangles, transforms: None };
/// let surface = OccluderSurface::from_meshes(&[wall], &OccluderOptions::default())?;
/// let map = OcclusionMap::new(&surface, &camera, &MapOptions::default())?;
/// assert_eq!((map.num_levels(), map.level(6).1[..4].to_vec()), (7, vec![4096, 4096, 0, 0]));
///
/// // A box behind the wall, and one that sticks out beside it.
/// let min = [-6.0, -1.0, -20.0, -1.0, -1.0, -20.0];
/// let max = [-4.0, 1.0, -15.0, 1.0, 1.0, -15.0];
/// let boxes = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };
/// let seen = map.cull(&boxes, &MapCull::default())?;
/// assert_eq!(seen.verdicts, [Verdict::Occluded, Verdict::Visible]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct OcclusionMap {
    camera: Camera,
    pub(super) eye: Eye,
    pub(super) levels: Levels,
    pub(super) estimate: Estimate,
    chosen: Vec<u32>,
    triangles: u64,
    pub(super) fault: Planted,
}

impl OcclusionMap {
    /// The maps of what `camera` sees of these occluders.
    ///
    /// The finest map has the camera's size, whose sides are powers of two; the text has 256x256.
    ///
    /// # Errors
    /// - [`Error::Invalid`](crate::Error::Invalid) for sides that are no powers of two, for options
    ///   that do not fit them, and for a camera that float32 cannot hold.
    /// - [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn new(surface: &OccluderSurface, camera: &Camera, options: &MapOptions) -> Result<Self> {
        Self::planted(surface, camera, options, Planted::default())
    }

    /// [`OcclusionMap::new`] with a planted fault, for tests.
    ///
    /// # Errors
    /// As [`OcclusionMap::new`].
    #[cfg(feature = "testing")]
    pub fn with_fault(
        surface: &OccluderSurface,
        camera: &Camera,
        options: &MapOptions,
        fault: Option<MapFault>,
    ) -> Result<Self> {
        Self::planted(surface, camera, options, Planted(fault))
    }

    fn planted(
        surface: &OccluderSurface,
        camera: &Camera,
        options: &MapOptions,
        fault: Planted,
    ) -> Result<Self> {
        let size = camera.size();
        options.check(size)?;
        let eye = Eye::new(camera);
        let boxes = surface.copy_boxes();
        let chosen = chosen(&eye, &boxes, options);
        let mut raster = HostRaster::new(size);
        let drawing = DrawOptions { only: Only::Listed(&chosen), ..DrawOptions::default() };
        surface.draw_into(&mut raster, camera, Way { threads: None, skip: true }, &drawing)?;
        let pixels = size.pixels() as usize;
        let mut depth: Vec<f32> = memory::list(pixels, "a map")?;
        depth.resize(pixels, 0.0);
        // Reversed depth is above 0 wherever something was drawn, however far.
        raster.write(&mut depth, DepthConvention::Reversed, None);
        let levels = Levels::new(size, options.least, depth.iter().map(|d| *d > 0.0), fault)?;
        let drawn = || chosen.iter().filter_map(|copy| boxes[*copy as usize]);
        let estimate = Estimate::new(&eye, options, drawn(), fault);
        let triangles = drawn().map(|one| one.triangles).sum();
        let camera = camera.clone();
        Ok(Self { camera, eye, levels, estimate, chosen, triangles, fault })
    }

    /// The view, with the finest map's size.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The number of maps, from the finest to the coarsest.
    pub fn num_levels(&self) -> u32 {
        self.levels.num_levels()
    }

    /// The size of map `level`, and how many of the 4^`level` pixels of each of its pixels are
    /// covered, row 0 on top.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn level(&self, level: u32) -> (ImageSize, &[u32]) {
        self.levels.level(level)
    }

    /// The least counts with which pixels of each map are opaque, for a hole of so many pixels of
    /// the finest map that is negligible.
    ///
    /// The opacity of level k is O(k) = 1 - `negligible_px` / 4^k, so that O(k + 1) is
    /// (3 + O(k)) / 4.
    /// The first level that has such a threshold is the one where the hole is at most a sixteenth
    /// of a pixel: 2x2 of 8x8, the text's 0.9375.
    /// Finer levels are opaque where they are full.
    pub fn least_counts(&self, negligible_px: u32) -> Vec<u32> {
        self.levels.least_counts(negligible_px, self.fault)
    }

    /// The depth-estimation buffer, row 0 on top.
    ///
    /// The view depth in world units of the farthest vertex of the boxes of the occluders in each
    /// region; infinite where there is none.
    pub fn estimate(&self) -> (ImageSize, &[f64]) {
        let side = self.estimate.regions;
        (ImageSize::new(side, side), &self.estimate.farthest)
    }

    /// The copies of meshes that were drawn, the most worthy first.
    pub fn chosen(&self) -> &[u32] {
        &self.chosen
    }

    /// The triangles of these copies.
    pub fn num_triangles(&self) -> u64 {
        self.triangles
    }
}
