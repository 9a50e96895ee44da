//! The options of a cull, all chosen by the caller.

use crate::cull::lod::LodRule;
use crate::host::rounding::EPS;
use crate::input::light::DirectionalLight;
use crate::input::tolerance::DepthTolerance;

/// In which order the indices of the kept instances are listed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Order {
    /// Ascending: every run and every driver gives the same list.
    #[default]
    Stable,
    /// As invocations arrive, which saves a pass.
    Any,
}

/// Where a culled volume must not be seen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Coverage {
    /// Anywhere in the closed pixel squares that its projection meets.
    #[default]
    Area,
    /// At pixel centres alone.
    /// This is for images with one sample per pixel and the same viewport and jitter.
    Sample,
}

impl Coverage {
    /// How far a pixel's square reaches beyond what has to be missed, in pixels.
    pub(super) fn own_reach(self) -> f64 {
        match self {
            Self::Area => 0.0,
            Self::Sample => 0.5,
        }
    }
}

/// How many texels of one level a test may read, as N x N.
/// A larger footprint uses a finer level, so a cull keeps less and reads more.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Footprint {
    /// The one texel that encloses the rectangle.
    /// It is coarse where a border of large texels crosses the rectangle, so most is kept.
    /// With a descent this is the test of Greene, Kass and Miller (1993).
    One,
    /// 2 x 2.
    #[default]
    Two,
    /// 4 x 4.
    Four,
    /// 8 x 8.
    Eight,
}

impl Footprint {
    pub(super) fn log2(self) -> u32 {
        match self {
            Self::One => 0,
            Self::Two => 1,
            Self::Four => 2,
            Self::Eight => 3,
        }
    }
}

/// What stands for a volume in the comparison with the depth image.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Fit {
    /// The rectangle around its projection, at its nearest depth.
    #[default]
    Rectangle,
    /// First the rectangle; where that cannot decide, the volume's own outline and its own depth in
    /// each texel.
    /// A cull keeps less and computes more.
    /// With a descent, the comparison goes down to single pixels.
    Volume,
}

/// Whether whole groups of 64 instances are tested before their members, and in how many tiers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Hierarchy {
    /// If there are enough instances for it to pay.
    #[default]
    Auto,
    /// For any number of instances: one tier of boxes, those of the groups.
    Always,
    /// Each instance is tested by itself.
    Never,
    /// So many tiers of boxes, 0 to 3, for any number of instances.
    ///
    /// 1 is that of the groups.
    /// Above it lie boxes around 64 groups each, and then around 64 of these.
    /// A piece has another tier as soon as one of its boxes is full: from 4,033 and from 258,049
    /// instances on.
    /// Where there are fewer tiers, these are tested.
    Tiers(u32),
}

/// The options of a cull.
///
/// # Examples
/// A wall covers the columns below 38, and a box behind it reaches over columns 30 to 37.
/// The default test reads two texels a side, each 8 pixels wide, so it also reads column 39.
/// A descent goes on to finer levels, and culls the box.
///
/// ```
/// # use hiz_core::headless::Engine;
/// # use hiz_core::{Bounds, Camera, DepthConvention, Floats, ImageSize, InstanceOptions, Outputs};
/// # use hiz_core::{Pose, Projection};
/// use hiz_core::CullOptions;
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let image: Vec<f32> = (0..64 * 64).map(|i| if i % 64 < 38 { 0.0125 } else { 0.0 }).collect();
/// # let pyramid = engine.pyramid(&engine.upload_depth(&image, &camera)?)?;
/// # let (min, max) = (Floats::F32(&[-0.75, -0.75, -16.5]), Floats::F32(&[2.75, 2.75, -16.0]));
/// # let instances = engine.instances(&Bounds::Boxes { min, max }, &InstanceOptions::default())?;
/// # let outputs = Outputs::default();
///
/// let options = CullOptions::default();
/// let culling = engine.cull(&instances, &camera, &pyramid, &options, &outputs)?;
/// assert_eq!(culling.mask()?, [true]);
///
/// let options = CullOptions { descent: 64, ..CullOptions::default() };
/// let culling = engine.cull(&instances, &camera, &pyramid, &options, &outputs)?;
/// assert_eq!(culling.mask()?, [false]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CullOptions {
    /// The order of the list of kept instances.
    pub order: Order,
    /// Area or sample coverage.
    pub coverage: Coverage,
    /// Extra distance in pixels that a projection must keep from a pixel or sample that it does not
    /// touch.
    /// A multiple of 1/256 in 0..=16.
    /// `None`: 0 in area coverage, and 1/64 in sample coverage, where snapping in a rasteriser may
    /// move a sample that far.
    /// Of points, `None` is 1/2 in area coverage and 1 in sample coverage.
    /// Either way the pixels of the four centres around a point are read, because a depth image
    /// knows depth at the centres alone.
    pub guard_px: Option<f64>,
    /// Relative slack of the stored depth, 0..=0.5.
    /// 2^-23 covers float32 depth that was rounded to nearest.
    /// The pyramid adds what another format rounds ([`DepthTolerance`](crate::DepthTolerance)).
    pub depth_slack: f64,
    /// Absolute slack of the stored depth in units of NDC depth, 0..=0.5, in addition to the
    /// relative slack.
    /// Use it for orthographic cameras, where a rasteriser errs by the same amount near and far.
    /// Any value above 0 counts as 2^-23 more.
    pub depth_slack_abs: f64,
    /// How much the transform of the depth image's renderer may err, 0..=1e6.
    /// The unit is one float32 eps (2^-23) of `sum |M| |p|`: the renderer's matrix M times a world
    /// position p, with all products taken as positive.
    /// `docs/accuracy.md` calls it kappa.
    /// 0 is for depth that is exact for the camera's matrices.
    /// About 4 is for a renderer that transforms world coordinates in float32.
    pub transform_slack: f64,
    /// How many texels a test reads.
    pub footprint: Footprint,
    /// How many texels of finer levels a test may read if the footprint cannot decide, 0..=65536.
    /// 0: none.
    /// With enough of them, the answer is that of a rectangle test at full resolution.
    ///
    /// On processors (lavapipe, SwiftShader) a test reads at most 7,551 of them, with
    /// [`Fit::Volume`] 943, with a pyramid of both ends 3,775 and 839, and more are kept where these
    /// do not suffice.
    /// lavapipe ends longer loops and loses what they had left to do (docs/accuracy.md, "Loops that
    /// a driver ends").
    pub descent: u32,
    /// What stands for a volume in the comparison with the depth image.
    pub fit: Fit,
    /// Whether groups are tested before their members.
    /// A group's test hides only what its members' own tests would also hide, unless they read
    /// other texels.
    /// So the kept instances hardly differ; apart from these few, the verdicts are the same.
    pub hierarchy: Hierarchy,
    /// Whether to count the depth tests of each level and the texels read.
    pub statistics: bool,
    /// Which level of detail of its mesh a kept instance is drawn with.
    pub lod: LodRule,
    /// `Some`: the instances are shadow casters of this light, and kept is what may shadow something
    /// that the camera sees.
    /// The pyramid is then one of [`Depths::Receivers`](crate::Depths::Receivers).
    /// `None`: kept is what the camera may see.
    pub shadow: Option<DirectionalLight>,
}

impl CullOptions {
    /// The slack for what the renderer of the depth image rounded.
    pub(crate) fn depth_tolerance(&self) -> DepthTolerance {
        DepthTolerance { relative: self.depth_slack, absolute: self.depth_slack_abs }
    }
}

impl Default for CullOptions {
    fn default() -> Self {
        Self {
            order: Order::Stable,
            coverage: Coverage::Area,
            guard_px: None,
            depth_slack: EPS,
            depth_slack_abs: 0.0,
            transform_slack: 0.0,
            footprint: Footprint::Two,
            descent: 0,
            fit: Fit::Rectangle,
            hierarchy: Hierarchy::Auto,
            statistics: false,
            lod: LodRule::Finest,
            shadow: None,
        }
    }
}
