//! The third answer: whether all of a volume shows, with nothing of the image before any part.
//!
//! # Definition
//!
//! A volume is *unoccluded* if
//!
//! - all of it lies strictly inside the six planes of the frustum, and
//! - each pixel that it touches holds a depth strictly farther than all of it.
//!
//! A pixel of exactly the far plane's depth is background, which the first condition is enough for.
//! A pixel without a valid depth may hold anything, so it counts as near
//! ([`sanitized_nearest_depth`]).

use crate::feasibility::Form;
use crate::pyramid::ONE;
use crate::scalar::Scalar;
use crate::search::Projected;
use crate::view::{Block, Clip, View};
use crate::{Coverage, DepthBounds, Error, Options, Volume};

/// The bits of -0.0f32.
const MINUS_ZERO: u32 = 0x8000_0000;

/// The nearest depth that a pixel of a depth image may stand for, decided on its bits.
///
/// - NaN, infinities and everything outside 0..=1 are "near": 0, or 1 if `reversed`.
///   That includes negative subnormals.
/// - -0 is +0.
/// - Everything else is itself.
#[must_use]
pub fn sanitized_nearest_depth(depth: f32, reversed: bool) -> f32 {
    let bits = depth.to_bits();
    if bits == MINUS_ZERO {
        0.0
    } else if bits <= ONE {
        depth
    } else if reversed {
        1.0
    } else {
        0.0
    }
}

/// Whether all of `volume` lies strictly inside the frustum, decided exactly.
///
/// That is w > 0, 0 < z < w, and pixel coordinates inside the image, none of them on a border.
/// `false` for an invalid volume.
///
/// # Errors
///
/// [`Error::NonFiniteView`] if the view is not finite, [`Error::Size`] if its size is wrong.
pub fn is_inside(view: &View, volume: &Volume) -> Result<bool, Error> {
    view.check()?;
    Ok(volume.is_valid()
        && Projected::new(view, volume, Options::default()).is_inside() == Some(true))
}

/// Whether all of `volume` is strictly nearer than `depth`, decided exactly.
///
/// `depth` is NDC depth and passes [`sanitized_nearest_depth`] first.
/// Only meaningful where all of the volume has w > 0.
/// `false` for an invalid volume.
///
/// # Errors
///
/// [`Error::NonFiniteView`] if the view is not finite, [`Error::Size`] if its size is wrong.
pub fn is_before(view: &View, volume: &Volume, depth: f32) -> Result<bool, Error> {
    view.check()?;
    let depth = sanitized_nearest_depth(depth, view.reversed);
    Ok(volume.is_valid()
        && Projected::new(view, volume, Options::default()).is_before(depth) == Some(true))
}

/// Whether all of `volume` shows in an NDC depth image, decided exactly.
///
/// `depth` has `view.width * view.height` values in row order, row 0 on top.
/// `false` for an invalid volume.
/// With [`Coverage::Sample`], a pixel is touched if its centre lies in the projection.
///
/// # Errors
///
/// [`Error::NonFiniteView`] if the view is not finite.
/// [`Error::Size`] or [`Error::DepthLength`] if the size of the view or of the image is wrong.
///
/// # Examples
///
/// ```
/// use hiz_ref::{Coverage, View, Volume, is_unoccluded};
///
/// // Looks along +z from the origin, 90 degrees wide.
/// // Near plane at 1, infinite far plane, standard Z: depth is 1 - 1/z.
/// let view = View {
///     rows: [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., -1.], [0., 0., 1., 0.]],
///     origin: [0.; 3],
///     width: 4,
///     height: 4,
///     reversed: false,
/// };
/// // The farthest point of the ball is at z = 4, which is depth 0.75.
/// let ball = Volume::Sphere { center: [0., 0., 3.], radius: 1. };
/// assert!(is_unoccluded(&view, &ball, &[0.8; 16], Coverage::Area)?);
/// assert!(!is_unoccluded(&view, &ball, &[0.75; 16], Coverage::Area)?);
/// # Ok::<(), hiz_ref::Error>(())
/// ```
pub fn is_unoccluded(
    view: &View,
    volume: &Volume,
    depth: &[f32],
    coverage: Coverage,
) -> Result<bool, Error> {
    view.check()?;
    view.check_length(depth.len())?;
    if !volume.is_valid() {
        return Ok(false);
    }
    let options = Options { coverage, ..Options::default() };
    let projected = Projected::new(view, volume, options);
    Ok(projected.is_inside() == Some(true) && !Search::new(&projected).finds_cover(depth))
}

/// [`is_unoccluded`] for a depth image that is only known to lie between two images.
///
/// `None` if the volume is unoccluded in the farther image and not in the nearer one.
/// [`nearest_depth_bounds`](crate::nearest_depth_bounds) makes such images.
///
/// # Errors
///
/// Those of [`is_unoccluded`].
pub fn unoccluded_between(
    view: &View,
    volume: &Volume,
    depth: &DepthBounds,
    coverage: Coverage,
) -> Result<Option<bool>, Error> {
    if is_unoccluded(view, volume, &depth.nearer, coverage)? {
        return Ok(Some(true));
    }
    let may_be = is_unoccluded(view, volume, &depth.farther, coverage)?;
    Ok((!may_be).then_some(false))
}

impl Projected<'_> {
    /// Whether all of the volume lies strictly inside the six planes.
    pub(crate) fn is_inside(&self) -> Option<bool> {
        fn inside<S: Scalar>(clip: &Clip<S>, p: &Projected) -> Option<bool> {
            // An open sign leaves the answer open, even beside a plane that is crossed.
            let planes = planes(clip, p.view);
            let answers = planes.map(|form| form.is_positive_on(p.shape));
            answers.into_iter().try_fold(true, |all, one| Some(all && one?))
        }
        self.decide(|| inside(&self.float, self), || inside(self.exact(), self))
    }

    /// Whether all of the volume lies strictly nearer than `depth`, which is in 0..=1.
    pub(crate) fn is_before(&self, depth: f32) -> Option<bool> {
        fn before<S: Scalar>(clip: &Clip<S>, depth: f32, p: &Projected) -> Option<bool> {
            // With the other convention "beyond" is "before".
            clip.beyond(depth, !p.view.reversed).is_positive_on(p.shape)
        }
        self.decide(|| before(&self.float, depth, self), || before(self.exact(), depth, self))
    }
}

/// What is positive inside each of the six planes.
/// Together they imply w > 0, since the first two add up to a multiple of it.
fn planes<S: Scalar>(clip: &Clip<S>, view: &View) -> [Form<S>; 6] {
    let zero = clip.w.minus(&clip.w);
    let [width, height] = [view.width, view.height].map(|side| clip.w.scaled(f64::from(side)));
    let plus = |a: &Form<S>, b: &Form<S>| a.minus(&zero.minus(b));
    [
        plus(&width, &clip.width_x),
        width.minus(&clip.width_x),
        plus(&height, &clip.height_y),
        height.minus(&clip.height_y),
        plus(&clip.z, &zero),
        clip.w.minus(&clip.z),
    ]
}

/// The search for a touched pixel that does not lie behind all of a volume inside the frustum.
struct Search<'a> {
    projected: &'a Projected<'a>,
    /// In float32 steps from the nearest depth.
    /// The volume lies before all depths from `before_from` on, and before none up to `not_to`.
    before_from: i64,
    not_to: i64,
}

impl<'a> Search<'a> {
    fn new(projected: &'a Projected<'a>) -> Self {
        Self { projected, before_from: i64::from(ONE), not_to: -1 }
    }

    /// Whether all of the volume is nearer than a pixel's depth.
    /// As w > 0 on the volume, it is nearer than every depth behind one that it is nearer than.
    fn is_before(&mut self, pixel: f32) -> bool {
        let reversed = self.projected.view.reversed;
        let depth = sanitized_nearest_depth(pixel, reversed);
        let bits = i64::from(depth.to_bits());
        let steps = if reversed { i64::from(ONE) - bits } else { bits };
        if steps >= self.before_from {
            return true;
        }
        if steps <= self.not_to {
            return false;
        }
        let answer = self.projected.is_before(depth) == Some(true);
        if answer {
            self.before_from = steps;
        } else {
            self.not_to = steps;
        }
        answer
    }

    fn finds_cover(&mut self, depth: &[f32]) -> bool {
        let width = self.projected.view.width as usize;
        let is_area = self.projected.options.coverage == Coverage::Area;
        let mut blocks = vec![self.projected.bounding_block()];
        while let Some(block) = blocks.pop() {
            let [mut all, mut none] = [true; 2];
            for row in block.y[0]..block.y[1] {
                let row = &depth[row as usize * width..];
                for &pixel in &row[block.x[0] as usize..block.x[1] as usize] {
                    let before = self.is_before(pixel);
                    all &= before;
                    none &= !before;
                }
            }
            if all || self.projected.meets(block) == Some(false) {
                continue;
            }
            // The squares of its pixels cover a block, but its samples do not.
            if block.is_pixel() || (none && is_area) {
                return true;
            }
            blocks.extend(Block::halves(block));
        }
        false
    }
}
