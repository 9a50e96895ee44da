//! How instances are culled.

use crate::host::rounding::EPS;

/// In which order the indices of the kept instances are listed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Order {
    /// Ascending: the same list from every run and driver.
    #[default]
    Stable,
    /// As invocations arrive: one pass fewer.
    Any,
}

/// Where a volume must not be seen to be culled.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Coverage {
    /// Anywhere in the closed pixel squares that its projection meets.
    #[default]
    Area,
    /// At pixel centres alone, for one sample a pixel and the same viewport and jitter.
    Sample,
}

/// How many texels of one level a test may read, as N x N.
/// More texels mean a finer level: less is kept, more is read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Footprint {
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
            Self::Two => 1,
            Self::Four => 2,
            Self::Eight => 3,
        }
    }
}

/// As what a volume is compared with the depth image.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Fit {
    /// The rectangle around its projection, at its nearest depth.
    #[default]
    Rectangle,
    /// Where the rectangle cannot decide: its own outline, and in each texel its own depth there.
    /// Less is kept, more is computed; with a descent it comes down to single pixels.
    Volume,
}

/// Whether whole groups of 64 instances are tested before their members.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Hierarchy {
    /// Where there are enough instances for it to pay.
    #[default]
    Auto,
    /// Whatever their number.
    Always,
    /// Each instance by itself.
    Never,
}

/// How instances are culled.
#[derive(Debug, Clone, PartialEq)]
pub struct CullOptions {
    /// The order of the packed list.
    pub order: Order,
    /// Area or sample coverage.
    pub coverage: Coverage,
    /// Extra distance in pixels, a multiple of 1/256 in 0..=16, that a projection must keep from
    /// what it does not touch.
    /// `None`: 0 in area coverage, 1/64 in sample coverage (what a rasteriser's snapping may move a
    /// sample).
    pub guard_px: Option<f64>,
    /// Relative slack of the stored depth, 0..=0.5: 2^-23 covers float32 depth that was rounded to
    /// nearest.
    /// What another format rounds comes beside it, from the pyramid
    /// ([`DepthTolerance`](crate::DepthTolerance)).
    pub depth_slack: f64,
    /// Absolute slack of the stored depth, 0..=0.5, in units of NDC depth and beside the relative
    /// one: the rasteriser of an orthographic camera errs by the same amount near and far.
    /// Anything above 0 counts 2^-23 more.
    pub depth_slack_abs: f64,
    /// kappa, 0..=1e6: how many eps of `sum |M| |p|` the transform of the depth image's renderer
    /// may have cost; 0 for depth that is exact for the camera's matrices, about 4 for a renderer
    /// that transforms world coordinates in float32.
    pub transform_slack: f64,
    /// How many texels a test reads.
    pub footprint: Footprint,
    /// How many texels of finer levels a test may read where the footprint cannot decide,
    /// 0..=65536; 0: none.
    /// With enough of them the answer is that of a rectangle test at full resolution.
    pub descent: u32,
    /// What stands for a volume.
    pub fit: Fit,
    /// Whether groups are tested first.
    /// What a group's test hides, its members' own tests would have hidden but for the level that
    /// they read: what is kept differs by next to nothing, and verdicts but for that not at all.
    pub hierarchy: Hierarchy,
    /// Count the depth tests of each level and the texels read.
    pub statistics: bool,
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
        }
    }
}
