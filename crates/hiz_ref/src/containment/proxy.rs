//! Whether an occluder proxy lies inside its mesh.
//!
//! The solid of a closed mesh is its surface, together with all points that it winds about.
//! A proxy triangle lies in it if the mesh winds about all of the triangle's points that are not on
//! the mesh.
//!
//! The mesh meets the plane of the triangle in segments and in triangles of that plane.
//! Between the segments the winding is constant, so one point of each part decides.
//! The ends and crossings of all segments cut the plane into strips by their x coordinates,
//! computed exactly.
//! Each part has a point in the middle of some strip.

use super::ratio::Ratio;
use super::winding::{Place, surely_beside};
use super::{MeshError, TriangleMesh, unit_scale};
use std::cmp::Ordering;

/// The part of a proxy that is outside of its mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Protrusion {
    /// Proxy triangles that are outside somewhere, ascending.
    pub triangles: Vec<usize>,
    /// One point per such triangle that is outside, rounded to float64.
    pub witnesses: Vec<[f64; 3]>,
    /// Proxy vertices of triangles that are outside, ascending.
    pub vertices: Vec<usize>,
    /// The largest distance of a witness or an outside vertex to the mesh, in plain float64.
    /// The proxy protrudes at least that far.
    pub distance: f64,
}

/// Which part of `proxy` does not lie in the closed solid of `mesh`, decided exactly.
///
/// If the result is empty, the proxy is safe to draw in its mesh's stead.
/// Any ray from outside of the solid that meets a safe proxy meets the mesh before, or at the same
/// point.
/// The proxy need not be closed.
/// Proxy triangles without area hide nothing and are skipped.
///
/// # Errors
/// - [`MeshError::NonFinite`] and [`MeshError::Index`] for bad positions or indices of either mesh.
/// - [`MeshError::Open`] for a `mesh` that is not closed, because it has no inside.
pub fn check_proxy(
    proxy: &TriangleMesh<'_>,
    mesh: &TriangleMesh<'_>,
) -> Result<Protrusion, MeshError> {
    proxy.check()?;
    mesh.check()?;
    mesh.check_closed()?;
    let mut found = Protrusion::default();
    for number in 0..proxy.triangles.len() {
        let triangle = proxy.corners(number);
        if let Some(flat) = Flat::new(triangle)
            && let Some(witness) = outside_point(&flat, mesh)
        {
            found.distance = found.distance.max(distance_to(mesh, witness));
            found.triangles.push(number);
            found.witnesses.push(witness);
        }
    }
    let mut used: Vec<usize> = proxy.triangles.iter().flatten().map(|v| *v as usize).collect();
    used.sort_unstable();
    used.dedup();
    for vertex in used {
        let place = Place::of(proxy.vertices[vertex]);
        if mesh.winding_about(&place) == 0 && !mesh.is_touched_by(&place) {
            found.distance = found.distance.max(distance_to(mesh, proxy.vertices[vertex]));
            found.vertices.push(vertex);
        }
    }
    Ok(found)
}

/// A point of the triangle's plane, by two of its coordinates.
type Point = [Ratio; 2];

/// A triangle, with the two axes onto which its plane is projected.
struct Flat {
    corners: [[f64; 3]; 3],
    /// The axis that is left out; the other two follow it in cyclic order.
    dropped: usize,
    normal: [Ratio; 3],
}

impl Flat {
    /// `None` for a triangle without area.
    fn new(corners: [[f64; 3]; 3]) -> Option<Flat> {
        let edge =
            |k: usize| [0, 1, 2].map(|i| Ratio::of(corners[k][i]).minus(&Ratio::of(corners[0][i])));
        let (u, v) = (edge(1), edge(2));
        let normal = [(1, 2), (2, 0), (0, 1)]
            .map(|(i, j): (usize, usize)| u[i].times(&v[j]).minus(&u[j].times(&v[i])));
        // Any axis to which the plane is not parallel will do; the best one keeps the balls small.
        let dropped = (0..3)
            .filter(|i| normal[*i].sign() != Ordering::Equal)
            .max_by(|i, j| normal[*i].ball.mid.abs().total_cmp(&normal[*j].ball.mid.abs()))?;
        Some(Flat { corners, dropped, normal })
    }

    fn axes(&self) -> [usize; 2] {
        [(self.dropped + 1) % 3, (self.dropped + 2) % 3]
    }

    fn drawn(&self, p: [f64; 3]) -> Point {
        self.axes().map(|i| Ratio::of(p[i]))
    }

    /// The place in space of a point of the plane.
    fn place(&self, p: &Point) -> Place {
        let ([i, j], a) = (self.axes(), self.corners[0]);
        let along = |k: usize, x: &Ratio| self.normal[k].times(&x.minus(&Ratio::of(a[k])));
        let drop = along(i, &p[0]).plus(&along(j, &p[1])).divided_by(&self.normal[self.dropped]);
        let mut at = [Ratio::of(0.0), Ratio::of(0.0), Ratio::of(0.0)];
        at[self.dropped] = Ratio::of(a[self.dropped]).minus(&drop);
        at[i] = p[0].clone();
        at[j] = p[1].clone();
        Place::new(&at)
    }

    /// The signed distance of a point from the plane, times the length of the normal.
    fn height(&self, p: [f64; 3]) -> Ratio {
        (0..3).fold(Ratio::of(0.0), |sum, i| {
            sum.plus(&self.normal[i].times(&Ratio::of(p[i]).minus(&Ratio::of(self.corners[0][i]))))
        })
    }

    /// The edges of the projected triangle.
    fn border(&self) -> [[Point; 2]; 3] {
        [0, 1, 2].map(|k| [self.drawn(self.corners[k]), self.drawn(self.corners[(k + 1) % 3])])
    }
}

/// A point of the triangle that the mesh neither touches nor winds about.
fn outside_point(flat: &Flat, mesh: &TriangleMesh<'_>) -> Option<[f64; 3]> {
    let mut segments = Vec::new();
    let mut coplanar = Vec::new();
    let range = |t: &[[f64; 3]; 3], i: usize, pick: fn(f64, f64) -> f64| {
        pick(pick(t[0][i], t[1][i]), t[2][i])
    };
    for number in 0..mesh.triangles.len() {
        let t = mesh.corners(number);
        let apart = (0..3).any(|i| {
            range(&t, i, f64::max) < range(&flat.corners, i, f64::min)
                || range(&t, i, f64::min) > range(&flat.corners, i, f64::max)
        });
        if !apart && !surely_beside(&flat.corners, &t) && !surely_beside(&t, &flat.corners) {
            cut(flat, &t, &mut segments, &mut coplanar);
        }
    }
    let border = flat.border();
    segments.retain(|s| !border.iter().any(|edge| is_beyond(s, edge, &border)));
    let outside = |p: &Point| {
        let place = flat.place(p);
        let covered = coplanar.iter().any(|t| place.lies_in(t));
        (!covered && mesh.winding_about(&place) == 0).then(|| place.rounded())
    };
    if segments.is_empty() {
        // There is one part, and any inner point will do.
        // This is the middle between a corner and the middle of the other two.
        let half = Ratio::of(0.5);
        let [a, b, c] = flat.corners.map(|p| flat.drawn(p));
        let middle = |p: &Point, q: &Point| [0, 1].map(|i| p[i].plus(&q[i]).times(&half));
        return outside(&middle(&a, &middle(&b, &c)));
    }
    segments.extend(border.iter().cloned());
    // The strips between the x of all ends and crossings, as far as the triangle reaches.
    let mut stops: Vec<Ratio> = segments.iter().flatten().map(|p| p[0].clone()).collect();
    for (number, s) in segments.iter().enumerate() {
        stops.extend(segments[..number].iter().filter_map(|other| crossing_x(s, other)));
    }
    stops.sort_by(Ratio::compare);
    stops.dedup_by(|a, b| a.compare(b) == Ordering::Equal);
    for pair in stops.windows(2) {
        let x = pair[0].between(&pair[1]);
        let heights = |lines: &[[Point; 2]]| {
            let mut heights: Vec<Ratio> = lines.iter().filter_map(|s| y_at(s, &x)).collect();
            heights.sort_by(Ratio::compare);
            heights.dedup_by(|a, b| a.compare(b) == Ordering::Equal);
            heights
        };
        // In a strip, the triangle lies between its two borders; a strip beside it has none.
        let [low, high] = &heights(&border)[..] else { continue };
        for pair in heights(&segments).windows(2) {
            if pair[0].compare(low) != Ordering::Less && pair[1].compare(high) != Ordering::Greater
            {
                let found = outside(&[x.clone(), pair[0].between(&pair[1])]);
                if found.is_some() {
                    return found;
                }
            }
        }
    }
    None
}

/// Where a triangle of the mesh meets the plane: in a segment, or as a whole.
fn cut(
    flat: &Flat,
    t: &[[f64; 3]; 3],
    segments: &mut Vec<[Point; 2]>,
    coplanar: &mut Vec<[[f64; 3]; 3]>,
) {
    let heights = t.map(|p| flat.height(p));
    let signs = [0, 1, 2].map(|k| heights[k].sign());
    if signs == [Ordering::Equal; 3] {
        coplanar.push(*t);
        segments.extend([0, 1, 2].map(|k| [flat.drawn(t[k]), flat.drawn(t[(k + 1) % 3])]));
        return;
    }
    let mut ends: Vec<Point> =
        (0..3).filter(|k| signs[*k] == Ordering::Equal).map(|k| flat.drawn(t[k])).collect();
    for k in 0..3 {
        let next = (k + 1) % 3;
        if signs[k] != Ordering::Equal && signs[next] == signs[k].reverse() {
            let part = heights[k].divided_by(&heights[k].minus(&heights[next]));
            let (a, b) = (flat.drawn(t[k]), flat.drawn(t[next]));
            ends.push([0, 1].map(|i| a[i].plus(&b[i].minus(&a[i]).times(&part))));
        }
    }
    // A single common point divides nothing, but it becomes a segment too.
    // Then strips end there, and no sample lies on it.
    if let [a, .., b] | [a @ b] = &ends[..] {
        segments.push([a.clone(), b.clone()]);
    }
}

/// Whether a segment lies on or beyond an edge of the triangle `border`, so that it divides
/// nothing.
fn is_beyond(s: &[Point; 2], edge: &[Point; 2], border: &[[Point; 2]; 3]) -> bool {
    let side = |p: &Point, [a, b]: &[Point; 2]| {
        let (u, v) = ([0, 1].map(|i| b[i].minus(&a[i])), [0, 1].map(|i| p[i].minus(&a[i])));
        u[0].times(&v[1]).minus(&u[1].times(&v[0])).sign()
    };
    let inner = side(&border[2][0], &border[0]);
    s.iter().all(|end| side(end, edge) != inner)
}

/// The x at which two segments cross; `None` if they are parallel or do not meet.
fn crossing_x(s: &[Point; 2], other: &[Point; 2]) -> Option<Ratio> {
    let difference = |a: &Point, b: &Point| [0, 1].map(|i| b[i].minus(&a[i]));
    let cross = |u: &Point, v: &Point| u[0].times(&v[1]).minus(&u[1].times(&v[0]));
    let (u, v, d) =
        (difference(&s[0], &s[1]), difference(&other[0], &other[1]), difference(&s[0], &other[0]));
    let parallel = cross(&u, &v);
    if parallel.sign() == Ordering::Equal {
        return None;
    }
    let within = |part: &Ratio| {
        part.sign() != Ordering::Less && part.compare(&Ratio::of(1.0)) != Ordering::Greater
    };
    let (at_s, at_other) =
        (cross(&d, &v).divided_by(&parallel), cross(&d, &u).divided_by(&parallel));
    (within(&at_s) && within(&at_other)).then(|| s[0][0].plus(&u[0].times(&at_s)))
}

/// The y of a segment at x; `None` if the segment does not pass x.
fn y_at(s: &[Point; 2], x: &Ratio) -> Option<Ratio> {
    let [a, b] = s;
    let (before, after) = (a[0].compare(x), b[0].compare(x));
    if before == after || before == Ordering::Equal || after == Ordering::Equal {
        return None;
    }
    let part = x.minus(&a[0]).divided_by(&b[0].minus(&a[0]));
    Some(a[1].plus(&b[1].minus(&a[1]).times(&part)))
}

/// The distance of a point to the nearest triangle, in plain float64.
///
/// Source: Ericson, "Real-Time Collision Detection", 5.1.5.
fn distance_to(mesh: &TriangleMesh<'_>, p: [f64; 3]) -> f64 {
    let scale = unit_scale(mesh.vertices.iter().flatten().copied().chain(p));
    let scaled = |p: [f64; 3]| p.map(|x| x * scale);
    (0..mesh.triangles.len())
        .map(|t| distance_to_triangle(&mesh.corners(t).map(scaled), scaled(p)) / scale)
        .fold(f64::INFINITY, f64::min)
}

fn distance_to_triangle([a, b, c]: &[[f64; 3]; 3], p: [f64; 3]) -> f64 {
    let sub = |u: [f64; 3], v: [f64; 3]| [u[0] - v[0], u[1] - v[1], u[2] - v[2]];
    let dot = |u: [f64; 3], v: [f64; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let cross = |u: [f64; 3], v: [f64; 3]| {
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    };
    let to_segment = |a: [f64; 3], b: [f64; 3]| {
        let (along, to) = (sub(b, a), sub(p, a));
        let length = dot(along, along);
        let t = if length > 0.0 { (dot(along, to) / length).clamp(0.0, 1.0) } else { 0.0 };
        let off = sub(to, along.map(|x| x * t));
        dot(off, off).sqrt()
    };
    let normal = cross(sub(*b, *a), sub(*c, *a));
    let inside = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(u, v)| dot(cross(sub(**v, **u), sub(p, **u)), normal) >= 0.0);
    let length = dot(normal, normal).sqrt();
    let edges = to_segment(*a, *b).min(to_segment(*b, *c)).min(to_segment(*c, *a));
    if inside && length > 0.0 { (dot(sub(p, *a), normal) / length).abs().min(edges) } else { edges }
}
