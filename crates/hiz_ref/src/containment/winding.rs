//! How often a closed mesh winds about a point, decided exactly.

use super::TriangleMesh;
use super::ratio::Ratio;
use crate::dyadic::Dyadic;
use crate::scalar::{Ball, Scalar};
use std::cmp::Ordering;

/// A point for predicates over any scalar: its coordinates times a positive `w`.
#[derive(Clone, Debug)]
struct Homogeneous<S> {
    at: [S; 3],
    w: S,
}

/// A point in space, in float64 with error bounds and exactly.
#[derive(Clone, Debug)]
pub(super) struct Place {
    ball: Homogeneous<Ball>,
    exact: Homogeneous<Dyadic>,
}

impl Place {
    pub(super) fn of(p: [f64; 3]) -> Place {
        Place::new(&p.map(Ratio::of))
    }

    pub(super) fn new(p: &[Ratio; 3]) -> Place {
        let [x, y, z] = p;
        let at = [
            x.over.times(&y.under).times(&z.under),
            y.over.times(&x.under).times(&z.under),
            z.over.times(&x.under).times(&y.under),
        ];
        let w = x.under.times(&y.under).times(&z.under);
        Place {
            ball: Homogeneous { at: [x.ball, y.ball, z.ball], w: Ball::exact(1.0) },
            exact: Homogeneous { at, w },
        }
    }

    /// The point rounded to float64, for display.
    pub(super) fn rounded(&self) -> [f64; 3] {
        self.ball.at.map(|x| x.mid)
    }

    fn decide(
        &self,
        ball: impl Fn(&Homogeneous<Ball>) -> Ball,
        exact: impl Fn(&Homogeneous<Dyadic>) -> Dyadic,
    ) -> Ordering {
        ball(&self.ball)
            .sign()
            .or_else(|| exact(&self.exact).sign())
            .expect("exact numbers have a sign")
    }

    /// The side of the plane through three points on which the point lies.
    pub(super) fn side(&self, t: &[[f64; 3]; 3]) -> Ordering {
        self.decide(|p| volume(t, p), |p| volume(t, p))
    }

    /// The side of the line from a to b on which the point lies, seen along `axis`.
    fn side_along(&self, axis: usize, a: [f64; 3], b: [f64; 3]) -> Ordering {
        self.decide(|p| area(axis, a, b, p), |p| area(axis, a, b, p))
    }

    /// Compares coordinate `axis` with a number.
    fn compare(&self, axis: usize, value: f64) -> Ordering {
        fn difference<S: Scalar>(p: &Homogeneous<S>, axis: usize, value: f64) -> S {
            p.at[axis].minus(&S::exact(value).times(&p.w))
        }
        self.decide(|p| difference(p, axis, value), |p| difference(p, axis, value))
    }

    /// How often a triangle winds about the point as seen along `axis`.
    ///
    /// If the point lies on an edge, it is moved by an infinitesimal amount.
    /// So intervals are half-open, and edges on which it lies count as passed.
    fn winds_along(&self, axis: usize, t: &[[f64; 3]; 3]) -> i32 {
        let up = (axis + 2) % 3;
        let above = t.map(|p| self.compare(up, p[up]) == Ordering::Less);
        let mut winding = 0;
        for k in 0..3 {
            let (a, b) = (k, (k + 1) % 3);
            if above[a] != above[b] {
                match (above[b], self.side_along(axis, t[a], t[b])) {
                    (true, Ordering::Greater) => winding += 1,
                    (false, Ordering::Less) => winding -= 1,
                    _ => {}
                }
            }
        }
        winding
    }

    /// Whether the point lies in the closed triangle, which must have an area.
    pub(super) fn lies_in(&self, t: &[[f64; 3]; 3]) -> bool {
        (0..3).all(|axis| {
            let [low, high] =
                [f64::min, f64::max].map(|pick| pick(pick(t[0][axis], t[1][axis]), t[2][axis]));
            self.compare(axis, low) != Ordering::Less
                && self.compare(axis, high) != Ordering::Greater
        }) && self.side(t) == Ordering::Equal
            && (0..3).all(|axis| {
                // It lies in the plane already; it lies in the triangle if it does so as seen along
                // every axis.
                let sides = [0, 1, 2].map(|k| self.side_along(axis, t[k], t[(k + 1) % 3]));
                !(sides.contains(&Ordering::Less) && sides.contains(&Ordering::Greater))
            })
    }
}

/// Whether three points surely lie strictly on one side of the plane through `t`, decided in
/// float64.
pub(super) fn surely_beside(t: &[[f64; 3]; 3], points: &[[f64; 3]; 3]) -> bool {
    let sides = points
        .map(|p| volume(t, &Homogeneous { at: p.map(Ball::exact), w: Ball::exact(1.0) }).sign());
    sides == [Some(Ordering::Less); 3] || sides == [Some(Ordering::Greater); 3]
}

/// Six times the signed volume of the tetrahedron of a triangle and the point.
fn volume<S: Scalar>(t: &[[f64; 3]; 3], p: &Homogeneous<S>) -> S {
    let number = |x: f64| S::exact(x);
    let edge = |k: usize| [0, 1, 2].map(|i| number(t[k][i]).minus(&number(t[0][i])));
    let (u, v) = (edge(1), edge(2));
    let d = [0, 1, 2].map(|i| p.at[i].minus(&number(t[0][i]).times(&p.w)));
    let minor = |i: usize, j: usize| u[i].times(&v[j]).minus(&u[j].times(&v[i]));
    minor(1, 2).times(&d[0]).plus(&minor(2, 0).times(&d[1])).plus(&minor(0, 1).times(&d[2]))
}

/// Twice the signed area of the triangle of a, b and the point, seen along `axis`.
fn area<S: Scalar>(axis: usize, a: [f64; 3], b: [f64; 3], p: &Homogeneous<S>) -> S {
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let number = |x: f64| S::exact(x);
    let edge = |k: usize| number(b[k]).minus(&number(a[k]));
    let to = |k: usize| p.at[k].minus(&number(a[k]).times(&p.w));
    edge(i).times(&to(j)).minus(&edge(j).times(&to(i)))
}

impl TriangleMesh<'_> {
    /// How often the closed mesh winds about a point that does not lie on it.
    ///
    /// Counts the signed crossings of the ray along +x.
    /// The ray is moved sideways by an infinitesimal amount, so it meets no edge.
    /// It cannot start on the mesh, because the point does not lie on it.
    pub(super) fn winding_about(&self, place: &Place) -> i32 {
        const X: usize = 0;
        (0..self.triangles.len())
            .map(|number| {
                let t = self.corners(number);
                let winds = place.winds_along(X, &t);
                // The normal's x has the sign of `winds`.
                // The crossing lies ahead if the point is on the side of the plane with lower x.
                let ahead = if winds > 0 { Ordering::Less } else { Ordering::Greater };
                if winds != 0 && place.side(&t) == ahead { winds } else { 0 }
            })
            .sum()
    }

    /// Whether a point lies on the mesh.
    pub(super) fn is_touched_by(&self, place: &Place) -> bool {
        (0..self.triangles.len()).any(|number| place.lies_in(&self.corners(number)))
    }
}
