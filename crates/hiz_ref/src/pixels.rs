//! What counts of pixels may say of a volume, decided pixel by pixel.

use crate::feasibility::{feasible, feasible_in_float};
use crate::pyramid::sanitized_depth;
use crate::search::Projected;
use crate::view::{Block, Coverage, View};
use crate::volume::Volume;
use crate::{Error, Options};

/// Numbers of pixels that a volume exactly touches, and what their depths leave open.
///
/// A count is right if it is at least as large as each of these:
///
/// | count | at least |
/// |---|---|
/// | `touched` | `touched` |
/// | `touched - hidden` | `shown` |
/// | `touched - open` | `not_open` |
/// | `inside` | `inside` |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelTruth {
    /// Pixels that it touches.
    pub touched: u32,
    /// Of these, pixels whose depth is not strictly nearer than all that the volume has there.
    pub shown: u32,
    /// Pixels whose depth is not strictly farther than all that the volume has there.
    /// Background, which is exactly far, is farther than everything.
    /// A number that is no depth is farther than nothing.
    pub not_open: u32,
    /// Pixels that are neither.
    pub inside: u32,
}

/// The truth about the pixels of a volume, decided exactly.
///
/// The time grows with the number of touched pixels.
/// All numbers are 0 for an invalid volume, of which nothing is true but that it is kept.
///
/// # Errors
///
/// Those of [`classify`](crate::classify).
///
/// # Examples
/// A ball in front of one half of a wall, and behind the other half:
///
/// ```
/// use hiz_ref::{Coverage, View, Volume, pixel_truth};
///
/// let view = View {
///     rows: [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., -1.], [0., 0., 1., 0.]],
///     origin: [0.; 3],
///     width: 2,
///     height: 1,
///     reversed: false,
/// };
/// let ball = Volume::Sphere { center: [0., 0., 10.], radius: 2. };
/// let truth = pixel_truth(&view, &ball, &[0.5, 0.99], Coverage::Area)?;
/// assert_eq!((truth.touched, truth.shown, truth.not_open, truth.inside), (2, 1, 1, 0));
/// # Ok::<(), hiz_ref::Error>(())
/// ```
pub fn pixel_truth(
    view: &View,
    volume: &Volume,
    depth: &[f32],
    coverage: Coverage,
) -> Result<PixelTruth, Error> {
    view.check()?;
    view.check_length(depth.len())?;
    let mut truth = PixelTruth::default();
    if !volume.is_valid() {
        return Ok(truth);
    }
    let projected = Projected::new(view, volume, Options { coverage, ..Options::default() });
    let far = if view.reversed { 0.0_f32 } else { 1.0 };
    for [x, y] in projected.touched().0 {
        let block = Block { x: [x, x + 1], y: [y, y + 1] };
        let given = depth[y as usize * view.width as usize + x as usize];
        let stored = sanitized_depth(given, view.reversed);
        let is_background = given.to_bits() == far.to_bits();
        let is_depth = (0.0..=1.0).contains(&given);
        let shows = projected.meets_before(block, stored) == Some(true);
        let not_open =
            !is_background && (!is_depth || projected.meets_behind(block, stored) == Some(true));
        truth.touched += 1;
        truth.shown += u32::from(shows);
        truth.not_open += u32::from(not_open);
        truth.inside += u32::from(shows && not_open);
    }
    Ok(truth)
}

impl Projected<'_> {
    /// Whether a point of the volume is inside the frustum and the block, and not nearer than
    /// `depth`, which is in 0..=1.
    fn meets_behind(&self, block: Block, depth: f32) -> Option<bool> {
        let behind = self.float_behind(block, depth);
        feasible_in_float(&behind, self.shape())
            .or_else(|| feasible(&self.exact_behind(block, depth), self.shape(), false))
    }
}
