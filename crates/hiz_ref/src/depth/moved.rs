//! Depth images that are moved away from the eye by a tolerance in the world.
//!
//! A view depth or distance v becomes `v + |v| relative + absolute`.
//! NDC depth stands for a view depth, which is moved in the same way.

use std::cmp::Ordering;

use super::{Geometry, Rays, Root, bracket};
use crate::Error;
use crate::dyadic::Dyadic;
use crate::scalar::Scalar;
use crate::view::View;

/// How far the depths of an image may lie before the surfaces that they measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Relative to the depth, from 0 on.
    pub relative: f64,
    /// In world units, from 0 on.
    pub absolute: f64,
}

impl Tolerance {
    /// The depths as given.
    pub const NONE: Self = Self { relative: 0.0, absolute: 0.0 };

    pub(super) fn check(self) -> Result<(), Error> {
        let fits = |v: f64| v.is_finite() && v >= 0.0;
        if fits(self.relative) && fits(self.absolute) {
            return Ok(());
        }
        Err(Error::DepthMeaning("tolerance: expected finite numbers from 0 on"))
    }

    /// A depth along a ray in world units, moved.
    pub(super) fn moved<S: Scalar>(self, value: S) -> S {
        if self == Self::NONE {
            return value;
        }
        let share = value.magnitude().times(&S::exact(self.relative));
        value.plus(&share).plus(&S::exact(self.absolute))
    }
}

impl Rays<'_> {
    /// The two float32 next to an NDC depth that is moved, or on which side of `0..=1` it is.
    ///
    /// `number` is in `0..=1`, and not far.
    pub(super) fn around_ndc(
        &self,
        pixel: [u32; 2],
        number: f64,
        tolerance: Tolerance,
    ) -> Result<[f32; 2], Ordering> {
        let given = || bracket(number, number, |f| order(number, f));
        let Some(signs) = self.exact.signs(self.view, pixel, number) else { return given() };
        let of = (pixel, number, tolerance, signs);
        let quick = self.float.moved_ndc(self.view, of).rounded();
        let exact = std::cell::OnceCell::new();
        bracket(quick.mid - quick.err(), quick.mid + quick.err(), |f| {
            exact.get_or_init(|| self.exact.moved_ndc(self.view, of)).compare(f)
        })
    }
}

fn order(number: f64, f: f32) -> Ordering {
    number.partial_cmp(&f64::from(f)).expect("a finite number")
}

/// What a depth's formula has to know of signs: that of its denominator, and that of
/// `number - depth at view depth 0`, both for parallel rays.
type Signs = (f64, f64);

impl Geometry<Dyadic> {
    /// `None` for a depth at or beyond infinity, which is not moved.
    fn signs(&self, view: &View, pixel: [u32; 2], number: f64) -> Option<Signs> {
        let Terms { denominator, from, scale } = self.terms(view, pixel, number);
        let sign = |x: &Dyadic| x.sign().expect("exact");
        if self.parallel {
            let one = |order| if order == Ordering::Less { -1.0 } else { 1.0 };
            return Some((one(sign(&denominator)), one(sign(&from))));
        }
        let per_depth = sign(&from.times(&scale));
        (per_depth == Ordering::Greater).then_some((1.0, 1.0))
    }
}

/// The parts of a pixel's formula.
struct Terms<S> {
    /// Of all NDC depths of the pixel.
    denominator: S,
    /// The number's distance from the depth at infinity, or for parallel rays from that at view
    /// depth 0, times the denominator.
    from: S,
    /// Perspective: area times constant.
    /// Parallel: how much the depth grows per view depth, times the denominator and divided by the
    /// length of the rays' direction.
    scale: S,
}

impl<S: Scalar> Geometry<S> {
    fn terms(&self, view: &View, pixel: [u32; 2], number: f64) -> Terms<S> {
        let (area, ray) = self.ray(view, pixel);
        let slope = super::dot(&self.z, &ray);
        let (denominator, start, scale) = if self.parallel {
            (
                self.determinant.times(&area).times(&self.w),
                self.constant.times(&area).plus(&slope.times(&self.w)),
                self.along.times(&area).times(&S::exact(self.away)),
            )
        } else {
            (self.determinant.times(&area), slope, self.constant.times(&area))
        };
        let from = S::exact(number).times(&denominator).minus(&start);
        Terms { denominator, from, scale }
    }

    /// The NDC depth of `number`, moved.
    ///
    /// Perspective: with the depth b at infinity, `number = b + q` and `q = scale / (n w)`.
    /// View depth times L is w, where L is the length of w's linear part.
    /// So the moved depth is `b + q / (1 + relative + absolute L (n q) / scale)`.
    /// The root L is taken out of the denominator, as in `1 / (e + f L) = (e - f L) / (e^2 - f^2
    /// L^2)`.
    fn moved_ndc(
        &self,
        view: &View,
        (pixel, number, tolerance, (of_denominator, of_from)): ([u32; 2], f64, Tolerance, Signs),
    ) -> Root<S> {
        let Terms { denominator: n, from, scale } = self.terms(view, pixel, number);
        let [relative, absolute] = [tolerance.relative, tolerance.absolute].map(S::exact);
        if self.parallel {
            // Farther is up in standard Z, and down in reversed Z.
            let farther = if view.reversed { -1.0 } else { 1.0 };
            let share = from.times(&S::exact(farther * of_denominator * of_from)).times(&relative);
            return Root {
                a: S::exact(number).times(&n).plus(&share),
                b: scale.times(&absolute),
                q: self.determinant.clone(),
                n,
            };
        }
        let base = S::exact(number).times(&n).minus(&from);
        let e = scale.plus(&scale.times(&relative));
        let f = from.times(&absolute);
        let square = e.times(&e).minus(&f.times(&f).times(&self.w_square));
        if square.is_zero() {
            // Both terms of `e + f L` are equal.
            let twice = e.plus(&e);
            return Root {
                a: base.times(&twice).plus(&from.times(&scale)),
                b: S::exact(0.0),
                q: S::exact(0.0),
                n: n.times(&twice),
            };
        }
        let moved = from.times(&scale);
        Root {
            a: base.times(&square).plus(&moved.times(&e)),
            b: moved.times(&f).negated(),
            q: self.w_square.clone(),
            n: n.times(&square),
        }
    }
}
