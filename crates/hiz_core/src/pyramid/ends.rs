//! Which ends of each block of pixels a pyramid stores: the farthest depth, the nearest, or both.

use crate::error::{Error, Result};

/// Which depths of each block of pixels a pyramid stores.
///
/// | | an invalid pixel (NaN, outside of 0..=1) | for |
/// |---|---|---|
/// | farthest | counts as far | what is hidden: behind all of a block |
/// | nearest | counts as near | what is surely visible: before all of a block |
///
/// Both ends are made in one pass that reads the depth image once.
///
/// # Examples
/// ```
/// use hiz_core::{DepthEnd, Depths, PyramidOptions, headless::Engine};
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(4, 2))?;
///
/// // Reversed Z: the farthest depth is the least, and the nearest the greatest.
/// let depth = engine.upload_depth(&[0.9, 0.8, 0.1, 0.2, 0.7, 0.6, f32::NAN, 0.4], &camera)?;
/// let options = PyramidOptions { depths: Depths::Both, ..PyramidOptions::default() };
/// let pyramid = engine.pyramid_with(&depth, &options)?;
/// assert_eq!(engine.read_level_of(&pyramid, 1, DepthEnd::Farthest)?, [0.6, 0.0]);
/// assert_eq!(engine.read_level_of(&pyramid, 1, DepthEnd::Nearest)?, [0.9, 1.0]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Depths {
    /// The farthest depth, which culls need.
    #[default]
    Farthest,
    /// The nearest depth alone; a cull takes no such pyramid.
    Nearest,
    /// Both.
    Both,
    /// Both, of the pixels that show a receiver of shadows.
    ///
    /// A pixel with exactly the bits of far, the clear value, shows the background.
    /// It is no receiver, and leaves both ends alone; -0 counts as 0.
    /// Invalid pixels make their block undecided: its farthest depth is far, its nearest near.
    /// A block without any receiver has farthest depth near and nearest depth far.
    ///
    /// Culls of shadow casters take such a pyramid, and no other cull does.
    Receivers,
}

/// One of the two ends of a block's depths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DepthEnd {
    /// The farthest depth.
    Farthest,
    /// The nearest depth.
    Nearest,
}

impl Depths {
    /// Whether the farthest depths are stored.
    pub fn has_farthest(self) -> bool {
        self != Self::Nearest
    }

    /// Whether the nearest depths are stored.
    pub fn has_nearest(self) -> bool {
        self != Self::Farthest
    }

    /// How many depths are stored for each block.
    pub(crate) fn count(self) -> u64 {
        u64::from(self.has_farthest()) + u64::from(self.has_nearest())
    }

    /// Whether background is left out.
    pub(crate) fn of_receivers(self) -> bool {
        self == Self::Receivers
    }

    /// Checks that one of the ends is stored.
    ///
    /// # Errors
    /// [`Error::Invalid`] for one that is not.
    pub(crate) fn check_end(self, end: DepthEnd) -> Result<()> {
        let is_there = match end {
            DepthEnd::Farthest => self.has_farthest(),
            DepthEnd::Nearest => self.has_nearest(),
        };
        if is_there {
            return Ok(());
        }
        let (other, asked) = match end {
            DepthEnd::Farthest => ("Nearest", "Farthest"),
            DepthEnd::Nearest => ("Farthest", "Nearest"),
        };
        Err(Error::invalid(
            "end",
            format!("expected {other}, the only depths of this pyramid, got {asked}"),
        ))
    }
}

/// Checks that an ordinary cull can use a pyramid of these depths.
///
/// # Errors
/// [`Error::Mismatch`] for [`Depths::Nearest`] and [`Depths::Receivers`].
pub(crate) fn check_culled(depths: Depths) -> Result<()> {
    let why = match depths {
        Depths::Farthest | Depths::Both => return Ok(()),
        Depths::Nearest => "has no farthest depths",
        Depths::Receivers => "leaves out background, where nothing hides",
    };
    Err(Error::mismatch(
        "pyramid",
        format!(
            "expected one of Depths::Farthest or Depths::Both, got one of Depths::{depths:?}, \
             which {why}"
        ),
    ))
}
