//! Volumes swept along a light, in exact arithmetic.
//!
//! A swept volume is the hull of a volume and of the same volume moved.
//! So a linear function is positive on it if it is positive on both.

use crate::dyadic::Dyadic;
use crate::feasibility::Form;
use crate::scalar::Scalar;
use crate::view::View;
use crate::volume::{Frame, Volume};

/// A plane of a view: the points where `row - t w = 0`, for one of the rows below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SweptPlane {
    /// The pixel column, counted from the image's middle.
    Column(f64),
    /// The pixel row, counted downwards from the image's middle.
    Row(f64),
    /// NDC depth.
    Depth(f64),
}

/// Whether `row - t w > 0` on all of a volume swept by `length` times `direction`.
/// With `below`: whether it is less than 0 on all of it.
///
/// # Examples
/// A sphere of radius 1 at distance 10 moves by 5 towards the eye.
///
/// ```
/// use hiz_ref::{SweptPlane, View, Volume, swept_side};
///
/// let view = View {
///     rows: [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., -1.], [0., 0., 1., 0.]],
///     origin: [0.; 3],
///     width: 4,
///     height: 4,
///     reversed: false,
/// };
/// let ball = Volume::Sphere { center: [0., 0., 10.], radius: 1. };
/// let swept = |plane, below| swept_side(&view, &ball, (5., [0., 0., -1.]), plane, below);
/// // Its depth is 1 - 1/z, and z goes from 4 to 11.
/// assert!(swept(SweptPlane::Depth(0.74), false) && !swept(SweptPlane::Depth(0.75), false));
/// assert!(swept(SweptPlane::Depth(0.95), true) && !swept(SweptPlane::Depth(0.9), true));
/// ```
#[must_use]
pub fn swept_side(
    view: &View,
    volume: &Volume,
    (length, direction): (f64, [f64; 3]),
    plane: SweptPlane,
    below: bool,
) -> bool {
    let [x, y, z, w] = &view.rows;
    let (row, factor, t) = match plane {
        SweptPlane::Column(t) => (x, f64::from(view.width) / 2.0, t),
        SweptPlane::Row(t) => (y, f64::from(view.height) / -2.0, t),
        SweptPlane::Depth(t) => (z, 1.0, t),
    };
    let frame = Frame::<Dyadic>::new(volume, view.origin);
    let sign = if below { -1.0 } else { 1.0 };
    let form = frame.form(row).scaled(sign * factor).minus(&frame.form(w).scaled(sign * t));
    let along = |row: &[f64; 4]| {
        let [a, b, c] =
            [0, 1, 2].map(|k| Dyadic::exact(row[k]).times(&Dyadic::exact(direction[k])));
        a.plus(&b).plus(&c).times(&Dyadic::exact(length))
    };
    let step = along(row)
        .times(&Dyadic::exact(sign * factor))
        .minus(&along(w).times(&Dyadic::exact(sign * t)));
    let moved = Form { middle: form.middle.plus(&step), along: form.along.clone() };
    [form, moved]
        .iter()
        .all(|form| form.is_positive_on(volume.shape()).expect("exact arithmetic decides"))
}
