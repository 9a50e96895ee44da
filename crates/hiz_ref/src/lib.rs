//! The oracle of hizvk: what an occlusion cull may and may not hide, by brute force and without a
//! GPU.
//!
//! A cull is right if everything that it hides is really hidden in the depth image that it was
//! given.
//! This crate says in exact arithmetic what "really" means.
//! It shares no code with the engine that it judges.
//!
//! # Definitions
//!
//! 1. A [`View`] is a projection and an image size.
//!    A [`Volume`] is a sphere or a box.
//!    Their numbers are the exact real numbers that the float64 values denote.
//! 2. A pixel is **touched** if some point of the volume with w > 0 and `0 <= z <= w` has pixel
//!    coordinates in the pixel's closed square.
//!    With [`Coverage::Sample`], the point must lie on the pixel's centre.
//! 3. A pixel **hides** the volume if its depth is strictly nearer than *all* of the volume,
//!    including the parts outside of the frustum.
//!    That means `z - depth w > 0` on all of it (reversed Z: `< 0`).
//!    With [`OwnDepth::PerPixel`], the depth must only be nearer than the part that the pixel can
//!    show.
//!    Depths are cleaned up first ([`sanitized_depth`]).
//! 4. If some touched pixel does not hide the volume, [`classify`] returns [`Verdict::Visible`],
//!    and culling it would be a false cull.
//!    Otherwise it returns [`Verdict::Hidden`]: the volume is outside of the frustum, or occluded.
//!
//! # Other questions
//!
//! - [`is_unoccluded`] says whether nothing in the image hides any part of a volume.
//! - [`depth_bounds`] converts an image that does not hold NDC depth.
//!   Its result is NDC depth between two float32 per pixel, and [`classify_between`] judges by such
//!   an image.
//!   [`moved_depth_bounds`] does the same for an image that may be off by a tolerance.
//! - [`pyramid()`] is the reference of the depth pyramid; it computes each texel from all of its
//!   pixels.
//! - [`check_proxy`] says whether an occluder proxy lies inside its mesh.
//! - [`check_bounds`] says whether bounds contain their mesh.
//! - [`pixel_truth`] counts the pixels that a volume touches, and of them those whose depth leaves
//!   open whether it shows.
//! - [`pixel_shift`] says how far two points are apart in the image, and [`coarsest_lod`] which
//!   level of detail a rule allows.
//!   Both are in float64 alone.
//! - [`swept_side`] says exactly on which side of a plane a volume lies that is swept along a light.
//!
//! # How it decides
//!
//! "Touched" is the question whether a convex volume meets a few half-spaces.
//! "Hides" is the question whether it lies on one side of a plane.
//! Both reduce to signs of polynomials in the inputs.
//! These are first evaluated in float64 with a running bound of the error.
//! If the bound leaves a sign open, exact dyadic fractions decide, so no verdict depends on
//! rounding.
//!
//! # Walk through the files
//!
//! `view` and `volume` turn the inputs into linear functions, and `feasibility` asks whether a
//! volume meets half-spaces.
//! `search` looks through the image for a pixel that proves a volume visible.
//! `unoccluded` asks the opposite question: whether all of a volume surely shows.
//! `scalar` and `dyadic` have the two arithmetics.
//! `depth` converts depth kinds, `pyramid` builds levels, `containment` checks proxies and
//! bounds, and `lod` judges levels of detail.
//!
//! # Example
//!
//! ```
//! use hiz_ref::{Verdict, View, Volume, classify};
//!
//! // Looks along +z from the origin, 90 degrees wide.
//! // Near plane at 1, infinite far plane, standard Z: depth is 1 - 1/z.
//! let view = View {
//!     rows: [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., -1.], [0., 0., 1., 0.]],
//!     origin: [0.; 3],
//!     width: 4,
//!     height: 4,
//!     reversed: false,
//! };
//! // The nearest point of the ball is at z = 8, which is depth 0.875.
//! let ball = Volume::Sphere { center: [0., 0., 10.], radius: 2. };
//! assert_eq!(classify(&view, &ball, &[0.8; 16])?, Verdict::Hidden);
//! assert_eq!(classify(&view, &ball, &[0.9; 16])?, Verdict::Visible);
//! # Ok::<(), hiz_ref::Error>(())
//! ```

mod containment;
mod depth;
mod dyadic;
mod feasibility;
mod lod;
mod pixels;
mod pyramid;
mod scalar;
mod search;
mod shadow;
mod unoccluded;
mod view;
mod volume;

pub use containment::{MeshError, Protrusion, TriangleMesh, check_bounds, check_proxy, contains};
pub use depth::{
    DepthBounds, DepthKind, DepthMeaning, Tolerance, depth_bounds, moved_depth_bounds,
    nearest_depth_bounds,
};
pub use lod::{LodRule, coarsest_lod, greatest_stretch, least_w, pixel_shift, radius, stretch_at};
pub use pixels::{PixelTruth, pixel_truth};
pub use pyramid::{Level, pyramid, sanitized_depth};
pub use shadow::{SweptPlane, swept_side};
pub use unoccluded::{
    is_before, is_inside, is_unoccluded, sanitized_nearest_depth, unoccluded_between,
};
pub use view::{Coverage, View};
pub use volume::Volume;

use search::{Found, Projected, find_open_pixel};

/// The answer for one volume and one depth image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Some touched pixel does not hide the volume: culling it would be a false cull.
    Visible,
    /// Every touched pixel hides the volume, or no pixel is touched: it may be culled.
    Hidden,
    /// Float64 could not decide.
    /// Only with [`Arithmetic::Float`], and from [`classify_between`].
    Undecided,
    /// The volume is invalid ([`Volume::is_valid`]): it has to be kept.
    Invalid,
}

/// The arithmetic that decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arithmetic {
    /// Float64 with error bounds alone; some cases stay [`Verdict::Undecided`].
    Float,
    /// Float64 with error bounds, and exact arithmetic if these leave a sign open.
    #[default]
    Escalate,
    /// Exact arithmetic wherever a verdict depends on it.
    /// Float64 proofs only leave out what lies far away.
    /// Slow: tests compare the others with it.
    Exact,
}

/// To hide a volume in a pixel, which part of it the pixel's depth must be nearer than.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OwnDepth {
    /// All of it: one nearest depth stands for the whole volume.
    #[default]
    Nearest,
    /// The part inside the frustum that projects into the pixel's square, or onto its centre
    /// ([`Coverage`]).
    /// A depth hides more volumes this way.
    PerPixel,
}

/// The choices of [`classify_with`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The arithmetic that decides.
    pub arithmetic: Arithmetic,
    /// Which part of a pixel counts.
    pub coverage: Coverage,
    /// Which part of a volume counts in a pixel.
    pub own_depth: OwnDepth,
}

/// A verdict with what it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// The verdict.
    pub verdict: Verdict,
    /// Whether no point of the volume is inside the frustum.
    /// With [`Coverage::Sample`]: inside the frustum through the hull of the image's samples.
    /// `None` if float64 alone could not decide, or if the volume is invalid.
    pub outside: Option<bool>,
    /// For a visible volume: column and row of a touched pixel that does not hide it.
    /// `None` if float64 alone could not locate one.
    pub witness: Option<[u32; 2]>,
    /// The NDC depth of the volume's nearest point in plain float64.
    /// It is for display; no verdict rests on it.
    /// `None` unless all of the volume has w > 0.
    pub nearest_depth: Option<f64>,
}

/// An input that has no meaning.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// An image side is 0 or larger than 32768 pixels.
    #[error("view size: expected sides of 1 to 32768 pixels, got {width}x{height}")]
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The matrix or the origin is not finite.
    #[error("view: expected finite rows and a finite origin, got NaN or infinity")]
    NonFiniteView,
    /// The depth image has another number of pixels than the view.
    #[error("depth: expected {expected} values ({width}x{height}), got {got}")]
    DepthLength {
        /// Number of pixels of the view.
        expected: usize,
        /// Number of depths.
        got: usize,
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The numbers of a depth image cannot mean in this view what they are said to mean.
    /// The text says why.
    #[error("{0}")]
    DepthMeaning(&'static str),
}

/// Whether a cull may hide `volume`, given an NDC depth image.
///
/// `depth` has `view.width * view.height` values in row order, row 0 on top.
/// The answer is never [`Verdict::Undecided`].
///
/// # Errors
///
/// [`Error::NonFiniteView`] if the view is not finite.
/// [`Error::Size`] or [`Error::DepthLength`] if the size of the view or of the image is wrong.
pub fn classify(view: &View, volume: &Volume, depth: &[f32]) -> Result<Verdict, Error> {
    Ok(classify_with(view, volume, depth, Options::default())?.verdict)
}

/// [`classify`] with choices; the result says what the verdict rests on.
///
/// # Errors
///
/// Those of [`classify`].
pub fn classify_with(
    view: &View,
    volume: &Volume,
    depth: &[f32],
    options: Options,
) -> Result<Outcome, Error> {
    view.check()?;
    view.check_length(depth.len())?;
    if !volume.is_valid() {
        return Ok(Outcome {
            verdict: Verdict::Invalid,
            outside: None,
            witness: None,
            nearest_depth: None,
        });
    }
    let projected = Projected::new(view, volume, options);
    // Asked first, because a volume that misses the image as a whole needs no search of its pixels.
    let met = projected.meets(view.image());
    let (verdict, outside, witness) = if met == Some(false) {
        (Verdict::Hidden, Some(true), None)
    } else {
        match find_open_pixel(&projected, depth) {
            Found::Open(witness) => (Verdict::Visible, Some(false), witness),
            Found::Nothing => (Verdict::Hidden, is_not(met), None),
            Found::Unknown => (Verdict::Undecided, is_not(met), None),
        }
    };
    Ok(Outcome { verdict, outside, witness, nearest_depth: projected.nearest_depth() })
}

/// [`classify_with`] for a depth image that is only known to lie between two images.
///
/// - [`Verdict::Visible`]: visible even in the nearer image, which hides most.
/// - [`Verdict::Hidden`]: hidden even in the farther image, which hides least.
/// - [`Verdict::Undecided`]: hidden in the nearer image, but visible in the farther one.
///
/// # Errors
///
/// Those of [`classify`].
pub fn classify_between(
    view: &View,
    volume: &Volume,
    depth: &DepthBounds,
    options: Options,
) -> Result<Verdict, Error> {
    let Outcome { verdict, outside, .. } = classify_with(view, volume, &depth.nearer, options)?;
    if verdict != Verdict::Hidden || outside == Some(true) || depth.nearer == depth.farther {
        return Ok(verdict);
    }
    Ok(match classify_with(view, volume, &depth.farther, options)?.verdict {
        Verdict::Visible => Verdict::Undecided,
        farther => farther,
    })
}

/// Whether no point of `volume` is inside the frustum, decided exactly.
///
/// Inside means `w > 0`, `0 <= z <= w` and pixel coordinates in the closed image.
/// `false` for an invalid volume, which has to be kept.
///
/// # Errors
///
/// [`Error::NonFiniteView`] if the view is not finite, [`Error::Size`] if its size is wrong.
pub fn is_outside(view: &View, volume: &Volume) -> Result<bool, Error> {
    view.check()?;
    if !volume.is_valid() {
        return Ok(false);
    }
    let projected = Projected::new(view, volume, Options::default());
    Ok(projected.meets(view.image()) == Some(false))
}

/// Whether `depth` is strictly nearer than all of `volume`, decided exactly.
///
/// `depth` is NDC depth and passes [`sanitized_depth`] first.
/// The place of the volume in the image has no effect.
/// `false` for an invalid volume, and for the far plane, which hides nothing.
///
/// # Errors
///
/// [`Error::NonFiniteView`] if the view is not finite, [`Error::Size`] if its size is wrong.
pub fn hides(view: &View, volume: &Volume, depth: f32) -> Result<bool, Error> {
    view.check()?;
    let depth = sanitized_depth(depth, view.reversed);
    let far = if view.reversed { 0.0 } else { 1.0 };
    if !volume.is_valid() || depth == far {
        return Ok(false);
    }
    let projected = Projected::new(view, volume, Options::default());
    Ok(projected.is_beyond(depth) == Some(true))
}

/// Column and row of every pixel that `volume` touches, in row order.
///
/// The result is exact, and the time grows with the number of touched pixels.
/// Empty for an invalid volume.
///
/// # Errors
///
/// [`Error::NonFiniteView`] if the view is not finite, [`Error::Size`] if its size is wrong.
pub fn touched_pixels(
    view: &View,
    volume: &Volume,
    coverage: Coverage,
) -> Result<Vec<[u32; 2]>, Error> {
    view.check()?;
    if !volume.is_valid() {
        return Ok(Vec::new());
    }
    let options = Options { coverage, ..Options::default() };
    let (pixels, decided) = Projected::new(view, volume, options).touched();
    debug_assert!(decided, "exact arithmetic decides everything");
    Ok(pixels)
}

/// The nearest NDC depth at which pixel (`column`, `row`) shows something of `volume`, decided
/// exactly.
///
/// Every nearer depth hides there the part that [`OwnDepth::PerPixel`] asks about.
/// `None` if the pixel is not touched, or if the volume is invalid.
///
/// # Errors
///
/// [`Error::NonFiniteView`] if the view is not finite, [`Error::Size`] if its size is wrong.
///
/// # Panics
///
/// If the pixel lies outside of the image.
pub fn own_depth(
    view: &View,
    volume: &Volume,
    coverage: Coverage,
    [column, row]: [u32; 2],
) -> Result<Option<f32>, Error> {
    view.check()?;
    assert!(
        column < view.width && row < view.height,
        "pixel ({column}, {row}) of {}x{}",
        view.width,
        view.height
    );
    if !volume.is_valid() {
        return Ok(None);
    }
    let options = Options { coverage, ..Options::default() };
    Ok(Projected::new(view, volume, options).own_depth([column, row]))
}

fn is_not(answer: Option<bool>) -> Option<bool> {
    answer.map(|x| !x)
}
