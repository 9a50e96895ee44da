//! The oracle of hizvk: what an occlusion cull may and may not hide, by brute force and without a
//! GPU.
//!
//! A cull is right if everything that it hides is really hidden in the depth image that it was
//! given.
//! This crate says what "really" means, in exact arithmetic, and shares no code with the engine
//! that it judges.
//! From top to bottom:
//!
//! 1. A [`View`] is a projection and an image size, a [`Volume`] a sphere or box.
//!    Their numbers are taken as the exact real numbers that the float64 values denote.
//! 2. A pixel is **touched** if some point of the volume with w > 0 and `0 <= z <= w` has pixel
//!    coordinates in the pixel's closed square (or on its centre: [`Coverage`]).
//! 3. A pixel **hides** the volume if its depth is strictly nearer than *all* of the volume: `z -
//!    depth w > 0` on all of it (reversed Z: `< 0`), the parts outside of the frustum included; or,
//!    with [`OwnDepth::PerPixel`], than the part of it that the pixel can show.
//!    Depths are cleaned up first ([`sanitized_depth`]).
//! 4. [`classify`]: if some touched pixel does not hide the volume, it is [`Verdict::Visible`], and
//!    to cull it would be a false cull.
//!    Otherwise it is [`Verdict::Hidden`]: outside of the frustum, or occluded.
//! 5. [`depth_bounds`] says what the numbers of an image that holds no NDC depth are as NDC depth,
//!    between two float32; [`classify_between`] judges by such an image.
//! 6. [`pyramid()`] is the reference of the depth pyramid, each texel computed from all of its
//!    pixels.
//! 7. [`check_proxy`] and [`check_bounds`] say whether an occluder proxy lies inside its mesh and
//!    whether bounds contain theirs.
//!
//! Inside, "touched" is the question whether a convex volume meets a few half-spaces, and "hides"
//! whether it lies on one side of a plane; both come down to signs of polynomials in the inputs.
//! These are evaluated in float64 with a running bound of the error, and in exact dyadic fractions
//! where the bound leaves a sign open, so no verdict depends on rounding.
//!
//! ```
//! use hiz_ref::{Verdict, View, Volume, classify};
//!
//! // Looks along +z from the origin, 90 degrees wide, near plane at 1, infinite far plane, standard Z: depth is 1 - 1/z.
//! let view = View {
//!     rows: [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., -1.], [0., 0., 1., 0.]],
//!     origin: [0.; 3],
//!     width: 4,
//!     height: 4,
//!     reversed: false,
//! };
//! let ball = Volume::Sphere { center: [0., 0., 10.], radius: 2. }; // nearest point at z = 8, depth 0.875
//! assert_eq!(classify(&view, &ball, &[0.8; 16])?, Verdict::Hidden);
//! assert_eq!(classify(&view, &ball, &[0.9; 16])?, Verdict::Visible);
//! # Ok::<(), hiz_ref::Error>(())
//! ```

mod containment;
mod depth;
mod dyadic;
mod feasibility;
mod pyramid;
mod scalar;
mod search;
mod view;
mod volume;

pub use containment::{MeshError, Protrusion, TriangleMesh, check_bounds, check_proxy, contains};
pub use depth::{DepthBounds, DepthKind, DepthMeaning, depth_bounds};
pub use pyramid::{Level, pyramid, sanitized_depth};
pub use view::{Coverage, View};
pub use volume::Volume;

use search::{Found, Projected, find_open_pixel};

/// The answer for one volume and one depth image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Some touched pixel does not hide the volume: to cull it is a false cull.
    Visible,
    /// Every touched pixel hides the volume, or none is touched: it may be culled.
    Hidden,
    /// Float64 could not tell.
    /// Only with [`Arithmetic::Float`].
    Undecided,
    /// Not a volume ([`Volume::is_valid`]): it has to be kept.
    Invalid,
}

/// The arithmetic that decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arithmetic {
    /// Float64 with error bounds alone: some cases stay [`Verdict::Undecided`].
    Float,
    /// Float64 with error bounds, and exact arithmetic for what that leaves open.
    #[default]
    Escalate,
    /// Exact arithmetic wherever a verdict hangs on it; float64 proofs serve only to leave out what
    /// lies far away.
    /// Slow; the tests compare the others with it.
    Exact,
}

/// Which part of a volume a pixel's depth has to be nearer than to hide it there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OwnDepth {
    /// All of it: one nearest depth stands for the whole volume.
    #[default]
    Nearest,
    /// The part inside the frustum that projects into the pixel's square (or onto its centre:
    /// [`Coverage`]).
    /// Hides more.
    PerPixel,
}

/// Choices for [`classify_with`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The arithmetic that decides.
    pub arithmetic: Arithmetic,
    /// What of a pixel counts.
    pub coverage: Coverage,
    /// What of a volume counts in a pixel.
    pub own_depth: OwnDepth,
}

/// A verdict and what it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// The verdict.
    pub verdict: Verdict,
    /// Whether no point of the volume is inside the frustum (with [`Coverage::Sample`]: the frustum
    /// through the hull of the image's samples).
    /// `None` if float64 alone could not tell, or if the volume is invalid.
    pub outside: Option<bool>,
    /// For a visible volume: column and row of a touched pixel that does not hide it.
    /// (`None` if float64 alone lost its trail.)
    pub witness: Option<[u32; 2]>,
    /// The NDC depth of the volume's nearest point, in plain float64 and for the eyes alone: no
    /// verdict rests on it.
    /// `None` unless all of the volume has w > 0.
    pub nearest_depth: Option<f64>,
}

/// An input that has no meaning.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// An image side is 0 or too large.
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
    /// The depth image is of another size.
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
    /// The numbers of a depth image cannot mean what they are said to mean in this view.
    #[error("{0}")]
    DepthMeaning(&'static str),
}

/// Whether a cull may hide `volume`, given the NDC depth image `depth` (row order, row 0 on top,
/// `view.width * view.height` values).
///
/// Never [`Verdict::Undecided`].
///
/// # Errors
///
/// If the view is not finite or its size or that of the image is wrong.
pub fn classify(view: &View, volume: &Volume, depth: &[f32]) -> Result<Verdict, Error> {
    Ok(classify_with(view, volume, depth, Options::default())?.verdict)
}

/// [`classify`] with choices, and with what the verdict rests on.
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
    // Asked first: what misses the image as a whole needs no search of its pixels.
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

/// [`classify_with`], by an image that is known to lie between two.
///
/// A volume is [`Verdict::Visible`] if it is so in the nearer image, which hides most, and
/// [`Verdict::Hidden`] if it is so in the farther one.
/// Between them it is [`Verdict::Undecided`].
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

/// Whether no point of `volume` is inside the frustum: `w > 0`, `0 <= z <= w`, pixel coordinates in
/// the closed image.
/// Exact.
/// `false` for an invalid volume, which has to be kept.
///
/// # Errors
///
/// If the view is not finite or its size is wrong.
pub fn is_outside(view: &View, volume: &Volume) -> Result<bool, Error> {
    view.check()?;
    if !volume.is_valid() {
        return Ok(false);
    }
    let projected = Projected::new(view, volume, Options::default());
    Ok(projected.meets(view.image()) == Some(false))
}

/// Whether `depth` (after [`sanitized_depth`]) is strictly nearer than all of `volume`, wherever in
/// the image that may be.
/// Exact.
/// `false` for an invalid volume, and for the far plane, which hides nothing.
///
/// # Errors
///
/// If the view is not finite or its size is wrong.
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
/// Exact, and as slow as it sounds for large volumes.
/// Empty for an invalid volume.
///
/// # Errors
///
/// If the view is not finite or its size is wrong.
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

/// The nearest depth at which pixel (`column`, `row`) shows something of `volume`: every nearer one
/// hides there what [`OwnDepth::PerPixel`] asks for.
/// `None` if the pixel is not touched, or the volume invalid.
/// Exact.
///
/// # Errors
///
/// If the view is not finite or its size is wrong.
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
