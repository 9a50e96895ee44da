//! Depth kinds: the NDC depth that the numbers of a depth image mean, between two neighbouring
//! float32.
//!
//! Every depth here has the form `(a + b sqrt(q)) / n`, where a, b, q and n are polynomials in the
//! inputs.
//! The only root is the length of a ray.
//! Whether such a depth lies above a float32 f is the sign of a polynomial again.
//! It compares `a - f n` with `b sqrt(q)`, squared.
//! Float64 with an error bound finds the two float32 around the depth.
//! If the bound leaves more than two, exact arithmetic decides.

mod moved;

pub use moved::Tolerance;

use crate::Error;
use crate::dyadic::Dyadic;
use crate::pyramid::{LEAST_NORMAL, ONE};
use crate::scalar::{Ball, Scalar};
use crate::view::View;
use std::cell::OnceCell;
use std::cmp::Ordering;

/// What the numbers of a depth image mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthKind {
    /// NDC depth, near 0, far 1.
    Ndc,
    /// NDC depth, near 1, far 0.
    ReversedNdc,
    /// World units along the viewing direction, which is the normal of the planes of equal w.
    /// In a parallel projection: world units along the rays.
    Z,
    /// World units along the ray through the pixel's centre.
    Distance,
}

/// How the numbers of a depth image become depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthMeaning<'a> {
    /// What they mean.
    pub kind: DepthKind,
    /// World units per unit of the image, above 0; 1 for NDC depth.
    pub scale: f64,
    /// Numbers of the image, before `scale`, that mean "no data".
    pub invalid: &'a [f64],
    /// Whether the camera stands at `view.origin`.
    /// View depth of a parallel projection is measured from there; otherwise its start is unknown.
    pub origin_is_eye: bool,
}

/// An NDC depth image, enclosed by two float32 images.
/// In each pixel the two are equal or neighbours.
///
/// Whatever is visible by the nearer one can be seen, and whatever the farther one hides is hidden.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthBounds {
    /// One NDC depth per pixel, nowhere farther than the true depth.
    pub nearer: Vec<f32>,
    /// One NDC depth per pixel, nowhere nearer than the true depth.
    pub farther: Vec<f32>,
}

/// The NDC depth of each pixel of `image`.
///
/// `image` has `view.width * view.height` numbers in row order, row 0 on top.
/// Numbers without meaning count as "no data", which is the far plane:
///
/// - NaN, infinite and `invalid` numbers;
/// - NDC depth outside `0..=1`;
/// - zero and negative numbers of kinds `Z` and `Distance`.
///
/// View depth 0 of a parallel projection is at `view.origin`.
/// If its near plane lies behind `view.origin`, zero and negative numbers are depths too.
/// Behind means: by more than 2^-40 of the depth range, plus 2^-48 of the depth by which `origin`
/// moves a point.
///
/// # Errors
///
/// [`Error::NonFiniteView`], [`Error::Size`] or [`Error::DepthLength`] for a wrong view or image.
/// [`Error::DepthMeaning`] if the view is singular, or if kind or scale contradict it.
pub fn depth_bounds(
    view: &View,
    image: &[f64],
    meaning: DepthMeaning,
) -> Result<DepthBounds, Error> {
    moved_depth_bounds(view, image, meaning, Tolerance::NONE)
}

/// [`depth_bounds`] of an image whose depths are moved away from the eye by `tolerance`.
///
/// - A number of kind `Z` or `Distance` is moved as it stands.
/// - NDC depth is moved along the view, by the view depth that it stands for.
/// - "No data" and the far plane stay what they are.
/// - A number in front of the near plane is no data, however far it would be moved.
///
/// # Errors
///
/// Those of [`depth_bounds`], and [`Error::DepthMeaning`] for
///
/// - a tolerance that is negative or not finite;
/// - a tolerance of NDC depth, if the view is singular or does not say where view depth starts.
pub fn moved_depth_bounds(
    view: &View,
    image: &[f64],
    meaning: DepthMeaning,
    tolerance: Tolerance,
) -> Result<DepthBounds, Error> {
    let far = if view.reversed { 0.0 } else { 1.0 };
    let ends = around_pixels(view, image, meaning, tolerance)?.into_iter().map(|at| match at {
        Pixel::Between(ends) => ends,
        Pixel::Beyond | Pixel::NoData => [far; 2],
    });
    let (nearer, farther) = ends.map(|[nearer, farther]| (nearer, farther)).unzip();
    Ok(DepthBounds { nearer, farther })
}

/// The NDC depth of each pixel of `image`, for [`unoccluded_between`].
///
/// It is that of [`depth_bounds`], except that "no data" is *near*: anything may be there.
/// View depth or distance beyond the far plane stays far, infinity included.
///
/// # Errors
///
/// Those of [`depth_bounds`].
///
/// [`unoccluded_between`]: crate::unoccluded_between
pub fn nearest_depth_bounds(
    view: &View,
    image: &[f64],
    meaning: DepthMeaning,
) -> Result<DepthBounds, Error> {
    let (near, far) = if view.reversed { (1.0, 0.0) } else { (0.0, 1.0) };
    let ends =
        around_pixels(view, image, meaning, Tolerance::NONE)?.into_iter().map(|at| match at {
            Pixel::Between(ends) => ends,
            Pixel::Beyond => [far; 2],
            Pixel::NoData => [near; 2],
        });
    let (nearer, farther) = ends.map(|[nearer, farther]| (nearer, farther)).unzip();
    Ok(DepthBounds { nearer, farther })
}

/// What a pixel holds.
enum Pixel {
    /// A depth between two float32, of which the nearer one comes first.
    Between([f32; 2]),
    /// View depth or distance beyond the far plane.
    Beyond,
    /// No depth.
    NoData,
}

/// What each pixel of an image holds.
fn around_pixels(
    view: &View,
    image: &[f64],
    meaning: DepthMeaning,
    tolerance: Tolerance,
) -> Result<Vec<Pixel>, Error> {
    view.check()?;
    tolerance.check()?;
    view.check_length(image.len())?;
    let DepthMeaning { kind, scale, invalid, origin_is_eye } = meaning;
    let mut ends = Vec::with_capacity(image.len());
    let metric = matches!(kind, DepthKind::Z | DepthKind::Distance);
    if !metric && (kind == DepthKind::ReversedNdc) != view.reversed {
        return Err(Error::DepthMeaning("kind: expected NDC depth in the view's own convention"));
    }
    if !(scale > 0.0 && scale.is_finite()) || (!metric && scale != 1.0) {
        return Err(Error::DepthMeaning(
            "scale: expected a positive finite number, 1 for NDC depth",
        ));
    }
    let is_moved = tolerance != Tolerance::NONE;
    if (metric || is_moved) && !origin_is_eye && view.rows[3][..3] == [0.0; 3] {
        return Err(Error::DepthMeaning(
            "kind: expected NDC depth without a tolerance for a parallel projection that does not \
             say where view depth starts",
        ));
    }
    let rays = if metric || is_moved { Some(Rays::new(view, kind)?) } else { None };
    let far = if view.reversed { 0.0 } else { 1.0 };
    let mut pixels = image.iter();
    for row in 0..view.height {
        for column in 0..view.width {
            let number = *pixels.next().expect("as many as pixels");
            let beyond = if view.reversed { Ordering::Less } else { Ordering::Greater };
            let around = match &rays {
                _ if invalid.contains(&number) => Err(Ordering::Equal),
                Some(_) if metric && number == f64::INFINITY => Err(beyond),
                _ if !number.is_finite() => Err(Ordering::Equal),
                Some(rays) if !metric && number != far && (0.0..=1.0).contains(&number) => {
                    match rays.around_ndc([column, row], number, tolerance) {
                        // Beyond the far plane.
                        Err(_) => Ok([far as f32; 2]),
                        moved => moved,
                    }
                }
                _ if !metric => bracket(number, number, |f| {
                    number.partial_cmp(&f64::from(f)).expect("a finite number")
                })
                .map_err(|_| Ordering::Equal),
                Some(rays) if number > 0.0 || rays.signed => {
                    match rays.around([column, row], (number, scale), Tolerance::NONE) {
                        Ok(_) if is_moved => rays.around([column, row], (number, scale), tolerance),
                        given => given,
                    }
                }
                _ => Err(Ordering::Equal),
            };
            ends.push(match around {
                Ok([low, high]) if view.reversed => Pixel::Between([high, low]),
                Ok(ends) => Pixel::Between(ends),
                Err(side) if side == beyond => Pixel::Beyond,
                Err(_) => Pixel::NoData,
            });
        }
    }
    Ok(ends)
}

/// How depth along the rays of a view becomes NDC depth, in float64 and exactly.
struct Rays<'a> {
    view: &'a View,
    kind: DepthKind,
    signed: bool,
    float: Geometry<Ball>,
    exact: Geometry<Dyadic>,
}

impl<'a> Rays<'a> {
    fn new(view: &'a View, kind: DepthKind) -> Result<Self, Error> {
        let exact = Geometry::<Dyadic>::new(view);
        if exact.determinant.is_zero() {
            return Err(Error::DepthMeaning(
                "view: expected an invertible projection, got a singular matrix",
            ));
        }
        if exact.parallel && exact.along.is_zero() {
            return Err(Error::DepthMeaning("view: expected depth to change along the rays"));
        }
        let [_, _, z, w] = view.rows;
        let moved = (0..3).map(|i| (z[i] * view.origin[i]).abs()).sum::<f64>() / w[3].abs();
        let behind_near = if view.reversed { 1.0 - z[3] / w[3] } else { z[3] / w[3] };
        let signed = exact.parallel && behind_near > 2.0_f64.powi(-40) + 2.0_f64.powi(-48) * moved;
        let float = Geometry { away: exact.away, ..Geometry::new(view) };
        Ok(Rays { view, kind, signed, float, exact })
    }

    /// The two float32 next to the depth of a number times its scale in a pixel.
    /// If the depth is outside `0..=1`, on which side.
    fn around(
        &self,
        pixel: [u32; 2],
        number: (f64, f64),
        tolerance: Tolerance,
    ) -> Result<[f32; 2], Ordering> {
        let quick = self.float.depth(self.view, self.kind, pixel, number, tolerance).rounded();
        let exact = OnceCell::new();
        bracket(quick.mid - quick.err(), quick.mid + quick.err(), |f| {
            exact
                .get_or_init(|| self.exact.depth(self.view, self.kind, pixel, number, tolerance))
                .compare(f)
        })
    }
}

/// The two float32 next to a number in `0..=1`; both are the number if it is a float32.
///
/// The number lies in `low..=high`, and `compare` gives its order relative to a float32.
/// If it is outside `0..=1`, on which side.
/// Below the least normal float32, the two are 0 and that float32.
fn bracket(low: f64, high: f64, compare: impl Fn(f32) -> Ordering) -> Result<[f32; 2], Ordering> {
    // Outwards once more, to cover the rounding of the ends; a NaN gives no bound.
    let low = if low.is_nan() { f64::NEG_INFINITY } else { low.next_down() };
    let high = if high.is_nan() { f64::INFINITY } else { high.next_up() };
    if low > 1.0 {
        return Err(Ordering::Greater);
    }
    if high < 0.0 {
        return Err(Ordering::Less);
    }
    for (end, open, outside) in
        [(0.0, low <= 0.0, Ordering::Less), (1.0, high >= 1.0, Ordering::Greater)]
    {
        if open {
            match compare(end) {
                Ordering::Equal => return Ok([end; 2]),
                order if order == outside => return Err(order),
                _ => {}
            }
        }
    }
    // Bisection over the bits, because float32 bits order like the numbers.
    let (mut below, mut above) = (floor(low.max(0.0)), ceiling(high.min(1.0)));
    while above - below > 1 {
        let middle = below.midpoint(above);
        match compare(f32::from_bits(middle)) {
            Ordering::Less => above = middle,
            Ordering::Greater => below = middle,
            Ordering::Equal => (below, above) = (middle, middle),
        }
    }
    let below = if below < LEAST_NORMAL { 0 } else { below };
    let above = if above > 0 { above.max(LEAST_NORMAL) } else { 0 };
    Ok([f32::from_bits(below), f32::from_bits(above)])
}

/// The bits of the greatest float32 that is not above a number of `0..=1`.
fn floor(x: f64) -> u32 {
    let nearest = x as f32;
    if f64::from(nearest) > x { nearest.to_bits() - 1 } else { nearest.to_bits() }
}

/// The bits of the least float32 that is not below a number of `0..=1`.
fn ceiling(x: f64) -> u32 {
    let nearest = x as f32;
    if f64::from(nearest) < x { (nearest.to_bits() + 1).min(ONE) } else { nearest.to_bits() }
}

/// The number `(a + b sqrt(q)) / n`, with `q >= 0`.
struct Root<S> {
    a: S,
    b: S,
    q: S,
    n: S,
}

impl Root<Ball> {
    fn rounded(&self) -> Ball {
        self.a.plus(&self.b.times(&self.q.square_root())).divided_by(self.n)
    }
}

impl Root<Dyadic> {
    /// How the number compares to `f`: the sign of `a - f n + b sqrt(q)`, times the sign of n.
    fn compare(&self, f: f32) -> Ordering {
        let sign = |x: &Dyadic| x.sign().expect("exact");
        let rest = self.a.minus(&self.n.times(&Dyadic::exact(f64::from(f))));
        let root = if self.q.is_zero() { Ordering::Equal } else { sign(&self.b) };
        let order = match (sign(&rest), root) {
            (x, Ordering::Equal) => x,
            (Ordering::Equal, y) => y,
            (x, y) if x == y => x,
            // The signs differ, so the larger magnitude decides.
            (x, y) => match sign(&rest.times(&rest).minus(&self.b.times(&self.b).times(&self.q))) {
                Ordering::Greater => x,
                Ordering::Less => y,
                Ordering::Equal => Ordering::Equal,
            },
        };
        if sign(&self.n) == Ordering::Less { order.reverse() } else { order }
    }
}

type Vector<S> = [S; 3];

fn dot<S: Scalar>(a: &Vector<S>, b: &Vector<S>) -> S {
    a[0].times(&b[0]).plus(&a[1].times(&b[1])).plus(&a[2].times(&b[2]))
}

fn cross<S: Scalar>(a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
    let part = |i: usize, j: usize| a[i].times(&b[j]).minus(&a[j].times(&b[i]));
    [part(1, 2), part(2, 0), part(0, 1)]
}

/// What all pixels of a view share.
///
/// Perspective: M has the linear rows x, y and w, and its inverse is given by the adjugate.
/// A point p with clip coordinates `w (x, y, 1)` is `M^-1 (w (x, y, 1) - constants)`.
///
/// Parallel: M has the rows x and y, and as its third row the rays' direction `x times y`.
struct Geometry<S> {
    parallel: bool,
    /// Columns of the adjugate: `M^-1 = adjugate / determinant`.
    adjugate: [Vector<S>; 3],
    determinant: S,
    /// The linear part of z.
    z: Vector<S>,
    /// The squared length of the linear part of w.
    w_square: S,
    /// Perspective: determinant times z at the eye.
    /// Parallel: determinant times z at the point with clip x = y = 0 on the plane through the
    /// origin across the rays.
    constant: S,
    /// Parallel: how z grows along the direction; `w` is the constant w.
    along: S,
    w: S,
    /// Parallel: 1 if the direction points away from the viewer, otherwise -1.
    away: f64,
}

impl<S: Scalar> Geometry<S> {
    fn new(view: &View) -> Self {
        let linear = |r: usize| [0, 1, 2].map(|k| S::exact(view.rows[r][k]));
        let constant = |r: usize| S::exact(view.rows[r][3]);
        let [x, y, z, w_linear] = [0, 1, 2, 3].map(linear);
        let parallel = view.rows[3][..3] == [0.0; 3];
        let third = if parallel { cross(&x, &y) } else { w_linear.clone() };
        let adjugate = [cross(&y, &third), cross(&third, &x), cross(&x, &y)];
        let determinant = dot(&third, &adjugate[2]);
        let mut start = constant(2).times(&determinant);
        for (column, r) in [(0, 0), (1, 1), (2, 3)] {
            if !(parallel && column == 2) {
                start = start.minus(&dot(&z, &adjugate[column]).times(&constant(r)));
            }
        }
        let along = dot(&z, &third);
        // Depth grows away from the viewer in standard Z, and falls in reversed Z.
        let grows = along.sign() == Some(Ordering::Greater);
        let away = if grows == (view.reversed == (view.rows[3][3] < 0.0)) { 1.0 } else { -1.0 };
        let w_square = dot(&w_linear, &w_linear);
        Geometry {
            parallel,
            adjugate,
            determinant,
            w_square,
            constant: start,
            along,
            w: constant(3),
            z,
            away,
        }
    }

    /// The number of pixels, and the ray of a pixel.
    ///
    /// Perspective: the ray along which w grows by 1, times determinant and area.
    /// Parallel: the pixel's position relative to that of x = y = 0, with the same factor.
    fn ray(&self, view: &View, [column, row]: [u32; 2]) -> (S, Vector<S>) {
        let (width, height) = (f64::from(view.width), f64::from(view.height));
        // The pixel's centre in NDC, times width and height, which makes whole numbers.
        let area = S::exact(width * height);
        let x = S::exact((2.0 * f64::from(column) + 1.0 - width) * height);
        let y = S::exact((height - 1.0 - 2.0 * f64::from(row)) * width);
        let at = |k: usize| {
            let [a, b, c] = [0, 1, 2].map(|j| &self.adjugate[j][k]);
            let sum = a.times(&x).plus(&b.times(&y));
            if self.parallel { sum } else { sum.plus(&c.times(&area)) }
        };
        let ray = [at(0), at(1), at(2)];
        (area, ray)
    }

    /// The NDC depth at which a number times its scale lies in a pixel, moved by a tolerance.
    fn depth(
        &self,
        view: &View,
        kind: DepthKind,
        pixel: [u32; 2],
        (number, scale): (f64, f64),
        tolerance: Tolerance,
    ) -> Root<S> {
        let (area, ray) = self.ray(view, pixel);
        let value = tolerance.moved(S::exact(number).times(&S::exact(scale)));
        if self.parallel {
            // z = (constant + w z.ray / area) / determinant + along value / |direction|.
            // |direction|^2 is the determinant.
            let place = self.constant.times(&area).plus(&dot(&self.z, &ray).times(&self.w));
            let grown = self.along.times(&value).times(&area).times(&S::exact(self.away));
            return Root {
                a: place,
                b: grown,
                q: self.determinant.clone(),
                n: self.determinant.times(&area).times(&self.w),
            };
        }
        // z / w = (z.ray / area + constant / w) / determinant.
        let slope = dot(&self.z, &ray);
        if kind == DepthKind::Z {
            // 1 / w = 1 / (value sqrt(w_square)) = sqrt(w_square) / (value w_square).
            let w_root = value.times(&self.w_square);
            Root {
                a: slope.times(&w_root),
                b: self.constant.times(&area),
                q: self.w_square.clone(),
                n: self.determinant.times(&area).times(&w_root),
            }
        } else {
            // 1 / w = |ray| / (area |determinant| value).
            let size = self.determinant.magnitude().times(&value);
            Root {
                a: slope.times(&size),
                b: self.constant.clone(),
                q: dot(&ray, &ray),
                n: self.determinant.times(&area).times(&size),
            }
        }
    }
}
