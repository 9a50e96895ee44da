//! Whether bounds contain their mesh.

use super::unit_scale;
use crate::dyadic::Dyadic;
use crate::scalar::{Ball, Scalar};
use crate::volume::Volume;
use std::cmp::Ordering;

/// Whether a point lies in a volume, decided exactly.
/// `false` for an invalid volume and for a point that is not finite.
#[must_use]
pub fn contains(volume: &Volume, point: [f64; 3]) -> bool {
    volume.is_valid()
        && point.iter().all(|x| x.is_finite())
        && all_hold::<Ball>(volume, &point.map(Ball::exact))
            .or_else(|| all_hold::<Dyadic>(volume, &point.map(Dyadic::exact)))
            .expect("exact numbers have a sign")
}

/// How far the vertices of a mesh lie outside of a volume, in world units.
///
/// The points are `world_from_mesh * p` for the `vertices` p; the matrix is 4x4, row-major and
/// affine, and `None` is the identity.
/// Whether a point lies in the volume is decided exactly, products included.
/// The volume is convex, so it contains the mesh if it contains the vertices.
///
/// - `None`: the volume contains all points.
/// - Infinity: the volume is invalid, or a number is not finite.
/// - Otherwise the largest distance in plain float64.
///   Up to rounding, it is no more than what really sticks out.
pub fn check_bounds(
    volume: &Volume,
    vertices: &[[f64; 3]],
    world_from_mesh: Option<&[f64; 16]>,
) -> Option<f64> {
    let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
    if !volume.is_valid()
        || !world_from_mesh.is_none_or(|m| finite(m))
        || !finite(vertices.as_flattened())
    {
        return Some(f64::INFINITY);
    }
    let mut worst: Option<f64> = None;
    for p in vertices {
        let inside = all_hold::<Ball>(volume, &placed(p, world_from_mesh))
            .or_else(|| all_hold::<Dyadic>(volume, &placed(p, world_from_mesh)))
            .expect("exact numbers have a sign");
        if !inside {
            let at: [Ball; 3] = placed(p, world_from_mesh);
            // The point may lie outside by less than float64 can represent.
            let distance = distance(volume, at.map(|x| x.mid)).max(f64::MIN_POSITIVE);
            worst = Some(worst.map_or(distance, |w| w.max(distance)));
        }
    }
    worst
}

fn placed<S: Scalar>(p: &[f64; 3], world_from_mesh: Option<&[f64; 16]>) -> [S; 3] {
    let p = p.map(S::exact);
    match world_from_mesh {
        None => p,
        Some(m) => std::array::from_fn(|row| {
            let start = S::exact(m[4 * row + 3]);
            (0..3).fold(start, |sum, k| sum.plus(&S::exact(m[4 * row + k]).times(&p[k])))
        }),
    }
}

/// Whether every inequality of the volume holds; `None` if one stays open.
fn all_hold<S: Scalar>(volume: &Volume, p: &[S; 3]) -> Option<bool> {
    let mut open = false;
    for rest in rests(volume, p) {
        match rest.sign() {
            Some(Ordering::Less) => return Some(false),
            Some(_) => {}
            None => open = true,
        }
    }
    (!open).then_some(true)
}

/// The slacks of the volume's inequalities: the point is inside if none of them is negative.
fn rests<S: Scalar>(volume: &Volume, p: &[S; 3]) -> Vec<S> {
    let number = |x: f64| S::exact(x);
    match volume {
        Volume::Sphere { center, radius } => {
            let square = |x: S| x.times(&x.clone());
            let distance = (0..3)
                .fold(number(0.0), |sum, i| sum.plus(&square(p[i].minus(&number(center[i])))));
            vec![square(number(*radius)).minus(&distance)]
        }
        Volume::Box { min, max } => (0..3)
            .flat_map(|i| [p[i].minus(&number(min[i])), number(max[i]).minus(&p[i])])
            .collect(),
        Volume::OrientedBox { center, half_sizes, axes } => {
            let d = [0, 1, 2].map(|i| p[i].minus(&number(center[i])));
            let half_axis =
                |k: usize| [0, 1, 2].map(|i| number(axes[i][k]).times(&number(half_sizes[k])));
            let half_axes = [half_axis(0), half_axis(1), half_axis(2)];
            normals(&half_axes)
                .iter()
                .map(|n| {
                    let support = half_axes
                        .iter()
                        .fold(number(0.0), |sum, e| sum.plus(&dot(n, e).magnitude()));
                    support.minus(&dot(n, &d).magnitude())
                })
                .collect()
        }
    }
}

/// Directions whose slabs together are the parallelepiped with these half axes.
///
/// If it is solid, the cross products of two half axes suffice.
/// If it is flat, directions within its plane or line bound it as well.
/// The slab of every direction contains the parallelepiped, so none of them is wrong.
fn normals<S: Scalar>(e: &[[S; 3]; 3]) -> Vec<[S; 3]> {
    let pairs = [(0, 1), (1, 2), (2, 0)];
    let faces = pairs.map(|(i, j): (usize, usize)| cross(&e[i], &e[j]));
    let solid = dot(&faces[0], &e[2]).sign().is_some_and(|s| s != Ordering::Equal);
    let mut all = faces.to_vec();
    if !solid {
        let unit = |i: usize| [0, 1, 2].map(|k| S::exact(if i == k { 1.0 } else { 0.0 }));
        for axis in e {
            all.extend(faces.iter().map(|n| cross(n, axis)));
            all.extend((0..3).map(|i| cross(axis, &unit(i))));
            all.push(axis.clone());
        }
        all.extend((0..3).map(unit));
    }
    all
}

fn cross<S: Scalar>(u: &[S; 3], v: &[S; 3]) -> [S; 3] {
    [(1, 2), (2, 0), (0, 1)]
        .map(|(i, j): (usize, usize)| u[i].times(&v[j]).minus(&u[j].times(&v[i])))
}

fn dot<S: Scalar>(u: &[S; 3], v: &[S; 3]) -> S {
    u[0].times(&v[0]).plus(&u[1].times(&v[1])).plus(&u[2].times(&v[2]))
}

/// How far a point lies outside, in plain float64.
/// For an oriented box, it is the distance to its farthest slab.
fn distance(volume: &Volume, p: [f64; 3]) -> f64 {
    let norm = |v: [f64; 3]| {
        let scale = unit_scale(v);
        v.iter().map(|x| (x * scale) * (x * scale)).sum::<f64>().sqrt() / scale
    };
    match volume {
        Volume::Sphere { center, radius } => norm([0, 1, 2].map(|i| p[i] - center[i])) - radius,
        Volume::Box { min, max } => {
            norm([0, 1, 2].map(|i| (min[i] - p[i]).max(p[i] - max[i]).max(0.0)))
        }
        Volume::OrientedBox { center, half_sizes, axes } => {
            let half_axes = [0, 1, 2].map(|k| [0, 1, 2].map(|i| axes[i][k] * half_sizes[k]));
            let d = [0, 1, 2].map(|i| p[i] - center[i]);
            let scale = unit_scale(half_axes.iter().flatten().copied().chain(d));
            let scaled = |v: [f64; 3]| v.map(|x| Ball::exact(x * scale));
            let (half_axes, d) = (half_axes.map(scaled), scaled(d));
            normals(&half_axes)
                .iter()
                .map(|n| {
                    let support: f64 = half_axes.iter().map(|e| dot(n, e).mid.abs()).sum();
                    (dot(n, &d).mid.abs() - support) / norm(n.map(|x| x.mid)) / scale
                })
                .filter(|x| x.is_finite())
                .fold(0.0, f64::max)
        }
    }
}
