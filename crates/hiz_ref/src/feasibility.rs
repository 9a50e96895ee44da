//! Whether a cube or a ball meets a set of half-spaces, decided by trying every separating
//! certificate.
//!
//! Everything happens in the local coordinates of a volume.
//! There the volume is the cube `[-1, 1]^3` or the unit ball, and a linear function of position is
//! a [`Form`].
//! The conditions are `R_i >= 0`, or `R_i = 0`.
//!
//! By Farkas' lemma, if no point of the volume satisfies all conditions, some combination of them
//! is negative on the whole volume.
//! Its weights are `lambda_i >= 0`; the weight of a condition `R_i = 0` may have either sign.
//! Finitely many candidates for the weights suffice, and each is a polynomial in the inputs.
//! So signs of sums of products decide.
//!
//! # Cube
//!
//! Let g be the maximum of the combination over the cube:
//!
//! ```text
//! g(lambda) = sum lambda_i m_i + sum_k |sum lambda_i v_ik|
//! ```
//!
//! The hyperplanes `sum lambda_i v_ik = 0` cut the cone of weights into cells, and `g` is linear on
//! each cell.
//! So if `g` is negative anywhere, it is negative on an edge of a cell.
//! On an edge, one, two, three or four weights are not zero, and none, one, two or all three of
//! these sums vanish.
//!
//! Four weights mean that the combination is a negative constant: the half-spaces have no common
//! point at all.
//! For what the pixels of a camera see, a common point is easily found, and then no four weights
//! need be tried.
//!
//! # Ball
//!
//! The point of the intersection that is nearest to the centre is the projection of the centre onto
//! the active planes.
//! At most three independent planes are needed (Karush, Kuhn, Tucker; Caratheodory).
//! Let `m` be the values of the planes at the centre, and `G` the Gram matrix of their normals.
//! Then the weights are `-adj(G) m`, and the squared distance is `m . adj(G) m / det G`, which is
//! compared with 1.

use crate::scalar::{Ball, Scalar};
use std::cmp::Ordering;

/// The volume in its local coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// `[-1, 1]^3`
    Cube,
    /// `|s| <= 1`
    Ball,
}

/// A linear function of local coordinates: `middle + along . s`.
#[derive(Clone, Debug)]
pub(crate) struct Form<S> {
    pub(crate) middle: S,
    pub(crate) along: [S; 3],
}

impl<S: Scalar> Form<S> {
    pub(crate) fn scaled(&self, factor: f64) -> Form<S> {
        let factor = S::exact(factor);
        Form {
            middle: self.middle.times(&factor),
            along: [0, 1, 2].map(|k| self.along[k].times(&factor)),
        }
    }

    pub(crate) fn minus(&self, other: &Form<S>) -> Form<S> {
        Form {
            middle: self.middle.minus(&other.middle),
            along: [0, 1, 2].map(|k| self.along[k].minus(&other.along[k])),
        }
    }

    fn dot(&self, other: &Form<S>) -> S {
        let [a, b, c] = [0, 1, 2].map(|k| self.along[k].times(&other.along[k]));
        a.plus(&b).plus(&c)
    }

    /// Whether the form is strictly positive on the whole volume.
    pub(crate) fn is_positive_on(&self, shape: Shape) -> Option<bool> {
        match shape {
            Shape::Cube => {
                let [a, b, c] = [0, 1, 2].map(|k| self.along[k].magnitude());
                let least = self.middle.minus(&a.plus(&b).plus(&c));
                least.sign().map(Ordering::is_gt)
            }
            // middle > |along|, squared.
            Shape::Ball => {
                let difference = self.middle.times(&self.middle).minus(&self.dot(self));
                match difference.sign() {
                    Some(Ordering::Greater) => self.middle.sign().map(Ordering::is_gt),
                    Some(_) => Some(false),
                    None => (self.middle.sign() == Some(Ordering::Less)).then_some(false),
                }
            }
        }
    }
}

/// A condition on points: `form >= 0`, or `form = 0`.
#[derive(Debug)]
pub(crate) struct Constraint<S> {
    form: Form<S>,
    equality: bool,
}

impl<S> Constraint<S> {
    pub(crate) fn at_least_zero(form: Form<S>) -> Self {
        Constraint { form, equality: false }
    }

    pub(crate) fn zero(form: Form<S>) -> Self {
        Constraint { form, equality: true }
    }
}

/// Whether some point of the volume satisfies every constraint.
/// With an exact scalar the answer is never `None`.
///
/// `consistent` says that some point, inside the volume or not, is known to satisfy them.
/// That saves work.
pub(crate) fn feasible<S: Scalar>(
    constraints: &[Constraint<S>],
    shape: Shape,
    consistent: bool,
) -> Option<bool> {
    let separated = match shape {
        Shape::Cube => cube_separated(constraints, consistent),
        Shape::Ball => {
            let separated = ball_separated(constraints);
            // The ball's certificates presuppose that the half-spaces have a common point.
            // If none is known, the cube around the ball decides too.
            if consistent || separated == Some(true) {
                separated
            } else {
                or(separated, cube_separated(constraints, consistent))
            }
        }
    };
    separated.map(|separated| !separated)
}

/// [`feasible`] in float64, with shortcuts for simple cases.
/// One plane may separate, or a guessed point may satisfy everything.
pub(crate) fn feasible_in_float(constraints: &[Constraint<Ball>], shape: Shape) -> Option<bool> {
    for constraint in constraints.iter().filter(|c| !c.equality) {
        let negated =
            Form { middle: constraint.form.middle.negated(), along: constraint.form.along };
        if negated.is_positive_on(shape) == Some(true) {
            return Some(false);
        }
    }
    if guess_point(constraints, shape) {
        return Some(true);
    }
    feasible(constraints, shape, is_consistent(constraints))
}

/// Whether some point, inside the volume or not, surely satisfies all constraints.
///
/// Tries one point if the constraints come in opposite pairs (left and right, top and bottom, near
/// and far).
/// It is the point that is equally far inside both constraints of each pair.
pub(crate) fn is_consistent(constraints: &[Constraint<Ball>]) -> bool {
    let [left, right, top, bottom, near, far] = constraints else {
        return false;
    };
    let rows = [[left, right], [top, bottom], [near, far]].map(|[a, b]| {
        let difference = a.form.minus(&b.form);
        let [x, y, z] = difference.along.map(|x| x.mid);
        [x, y, z, -difference.middle.mid]
    });
    // Cramer's rule with columns i, j, k of the three rows.
    let det = |i: usize, j: usize, k: usize| {
        let [a, b, c] = &rows;
        a[i] * (b[j] * c[k] - b[k] * c[j]) - a[j] * (b[i] * c[k] - b[k] * c[i])
            + a[k] * (b[i] * c[j] - b[j] * c[i])
    };
    let scale = det(0, 1, 2);
    let point = [det(3, 1, 2) / scale, det(0, 3, 2) / scale, det(0, 1, 3) / scale];
    satisfies(constraints, point)
}

/// Whether every constraint surely holds at a point.
fn satisfies(constraints: &[Constraint<Ball>], point: [f64; 3]) -> bool {
    let s = point.map(Ball::exact);
    point.iter().all(|x| x.is_finite())
        && constraints.iter().all(|Constraint { form, equality }| {
            let [a, b, c] = [0, 1, 2].map(|k| form.along[k].times(&s[k]));
            let value = form.middle.plus(&a.plus(&b).plus(&c));
            !equality && value.sign().is_some_and(Ordering::is_ge)
        })
}

fn and(a: Option<bool>, b: Option<bool>) -> Option<bool> {
    match (a, b) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (Some(true), Some(true)) => Some(true),
        _ => None,
    }
}

fn or(a: Option<bool>, b: Option<bool>) -> Option<bool> {
    and(a.map(|x| !x), b.map(|x| !x)).map(|x| !x)
}

/// Looks for a point by projecting onto the worst violated half-space again and again.
/// The search need not be trusted: its result counts only if every constraint surely holds there.
fn guess_point(constraints: &[Constraint<Ball>], shape: Shape) -> bool {
    const STEPS: usize = 24;
    /// Overshooting leads into the inside, where signs are certain.
    const OVERSHOOT: f64 = 1.5;
    /// Just inside the unit ball, so that the rounding of |s| does not matter.
    const REACH: f64 = 1.0 - 1e-9;

    if constraints.iter().any(|c| c.equality) {
        return false;
    }
    let mut s = [0.0f64; 3];
    for _ in 0..STEPS {
        let mut worst = f64::INFINITY;
        let mut step = [0.0; 3];
        let mut satisfied = true;
        for Constraint { form, .. } in constraints {
            let v = form.along.map(|x| x.mid);
            let value = form.middle.mid + v[0] * s[0] + v[1] * s[1] + v[2] * s[2];
            let square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
            satisfied &= value > 0.0;
            let distance = value / square.sqrt();
            if distance < worst {
                worst = distance;
                let push = OVERSHOOT * value.min(0.0) / square;
                step = v.map(|x| -push * x);
            }
        }
        if satisfied {
            break;
        }
        for k in 0..3 {
            s[k] += step[k];
        }
        match shape {
            Shape::Cube => s = s.map(|x| x.clamp(-1.0, 1.0)),
            Shape::Ball => {
                let length = (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]).sqrt();
                if length > REACH {
                    s = s.map(|x| x * (REACH / length));
                }
            }
        }
    }
    satisfies(constraints, s)
}

/// Whether some combination of the constraints is negative on the whole cube.
fn cube_separated<S: Scalar>(constraints: &[Constraint<S>], consistent: bool) -> Option<bool> {
    const AXIS_PAIRS: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];
    let n = constraints.len();
    let v = |i: usize, k: usize| &constraints[i].form.along[k];
    // a b - c d
    let cross = |a: &S, b: &S, c: &S, d: &S| a.times(b).minus(&c.times(d));
    let mut result = Some(false);
    let mut try_weights = |members: &[usize], weights: &[S], vanishing: &[usize]| {
        result = or(result, is_certificate(constraints, members, weights, vanishing));
        result == Some(true)
    };

    for i in 0..n {
        if try_weights(&[i], &[S::exact(1.0)], &[]) {
            return Some(true);
        }
    }
    for i in 0..n {
        for j in i + 1..n {
            for k in 0..3 {
                let weights = [v(j, k).clone(), v(i, k).negated()];
                if try_weights(&[i, j], &weights, &[k]) {
                    return Some(true);
                }
            }
        }
    }
    for i in 0..n {
        for j in i + 1..n {
            for l in j + 1..n {
                for [k, m] in AXIS_PAIRS {
                    let weights = [
                        cross(v(j, k), v(l, m), v(j, m), v(l, k)),
                        cross(v(l, k), v(i, m), v(l, m), v(i, k)),
                        cross(v(i, k), v(j, m), v(i, m), v(j, k)),
                    ];
                    if try_weights(&[i, j, l], &weights, &[k, m]) {
                        return Some(true);
                    }
                }
            }
        }
    }
    if consistent {
        return result;
    }
    // Cramer: the weights that make four vectors of three components vanish are their 3x3 minors
    // with alternating signs.
    let minor = |i: usize, j: usize, l: usize| {
        let [a, b, c] =
            [[1, 2], [2, 0], [0, 1]].map(|[p, q]| cross(v(j, p), v(l, q), v(j, q), v(l, p)));
        let [a, b, c] = [a.times(v(i, 0)), b.times(v(i, 1)), c.times(v(i, 2))];
        a.plus(&b).plus(&c)
    };
    for i in 0..n {
        for j in i + 1..n {
            for l in j + 1..n {
                for m in l + 1..n {
                    let weights = [
                        minor(j, l, m),
                        minor(i, l, m).negated(),
                        minor(i, j, m),
                        minor(i, j, l).negated(),
                    ];
                    if try_weights(&[i, j, l, m], &weights, &[0, 1, 2]) {
                        return Some(true);
                    }
                }
            }
        }
    }
    result
}

/// Whether these weights, or their negatives, form a certificate.
///
/// The weights must have the signs that the constraints need, and the combination must be negative
/// on the whole cube.
/// They are known up to a common sign.
/// `vanishing` lists the axes along which the combination is zero by construction.
fn is_certificate<S: Scalar>(
    constraints: &[Constraint<S>],
    members: &[usize],
    weights: &[S],
    vanishing: &[usize],
) -> Option<bool> {
    let (mut positive, mut negative) = (Some(true), Some(true));
    for (&i, weight) in members.iter().zip(weights) {
        let sign = weight.sign();
        // With a weight of 0, this is a candidate with fewer members, which is tried separately.
        if sign == Some(Ordering::Equal) {
            return Some(false);
        }
        if !constraints[i].equality {
            positive = and(positive, sign.map(Ordering::is_gt));
            negative = and(negative, sign.map(Ordering::is_lt));
        }
        if positive == Some(false) && negative == Some(false) {
            return Some(false);
        }
    }
    let combine = |part: &dyn Fn(&Form<S>) -> S| {
        members
            .iter()
            .zip(weights)
            .map(|(&i, weight)| part(&constraints[i].form).times(weight))
            .reduce(|a, b| a.plus(&b))
            .expect("at least one member")
    };
    let middle = combine(&|form| form.middle.clone());
    let spread = (0..3)
        .filter(|k| !vanishing.contains(k))
        .map(|k| combine(&|form| form.along[k].clone()).magnitude())
        .fold(S::exact(0.0), |a, b| a.plus(&b));
    let below = |middle: S| middle.plus(&spread).sign().map(Ordering::is_lt);
    or(and(positive, below(middle.clone())), and(negative, below(middle.negated())))
}

/// Whether the projection of the centre onto some active set of at most three planes is outside the
/// unit ball.
fn ball_separated<S: Scalar>(constraints: &[Constraint<S>]) -> Option<bool> {
    let n = constraints.len();
    let form = |i: usize| &constraints[i].form;
    let value = |i: usize| &form(i).middle;
    let gram: Vec<Vec<S>> =
        (0..n).map(|i| (0..n).map(|j| form(i).dot(form(j))).collect()).collect();
    let g = |i: usize, j: usize| &gram[i][j];
    // a b - c d
    let cross = |a: &S, b: &S, c: &S, d: &S| a.times(b).minus(&c.times(d));

    // `solution` is adj(G) m, the weights times -1; `square` is det G.
    // Any weights of the right signs with m . adj(G) m > det G separate.
    // That holds even if G is singular: then the combination is a negative constant.
    let mut result = Some(false);
    let mut try_solution = |members: &[usize], solution: &[S], square: &S| {
        let mut signs = Some(true);
        for (&i, x) in members.iter().zip(solution) {
            if !constraints[i].equality {
                signs = and(signs, x.sign().map(Ordering::is_lt));
            }
        }
        if signs != Some(false) {
            let reach = members
                .iter()
                .zip(solution)
                .map(|(&i, x)| value(i).times(x))
                .reduce(|a, b| a.plus(&b))
                .expect("at least one member");
            let outside = reach.minus(square).sign().map(Ordering::is_gt);
            result = or(result, and(signs, outside));
        }
        result == Some(true)
    };

    for i in 0..n {
        if try_solution(&[i], &[value(i).clone()], g(i, i)) {
            return Some(true);
        }
    }
    for i in 0..n {
        for j in i + 1..n {
            let solution = [
                cross(g(j, j), value(i), g(i, j), value(j)),
                cross(g(i, i), value(j), g(i, j), value(i)),
            ];
            let square = cross(g(i, i), g(j, j), g(i, j), g(i, j));
            if try_solution(&[i, j], &solution, &square) {
                return Some(true);
            }
        }
    }
    for i in 0..n {
        for j in i + 1..n {
            for l in j + 1..n {
                // The adjugate of a symmetric matrix, by rows.
                let ii = cross(g(j, j), g(l, l), g(j, l), g(j, l));
                let ij = cross(g(i, l), g(j, l), g(i, j), g(l, l));
                let il = cross(g(i, j), g(j, l), g(i, l), g(j, j));
                let jj = cross(g(i, i), g(l, l), g(i, l), g(i, l));
                let jl = cross(g(i, j), g(i, l), g(i, i), g(j, l));
                let ll = cross(g(i, i), g(j, j), g(i, j), g(i, j));
                let row = |a: &S, b: &S, c: &S, x: &S, y: &S, z: &S| {
                    a.times(x).plus(&b.times(y)).plus(&c.times(z))
                };
                let apply = |a: &S, b: &S, c: &S| row(a, b, c, value(i), value(j), value(l));
                let solution = [apply(&ii, &ij, &il), apply(&ij, &jj, &jl), apply(&il, &jl, &ll)];
                let square = row(&ii, &ij, &il, g(i, i), g(i, j), g(i, l));
                if try_solution(&[i, j, l], &solution, &square) {
                    return Some(true);
                }
            }
        }
    }
    result
}
