//! `candidate` and `on_border` of `bounds_box_support.wgsl` and `bounds_sphere.wgsl`.
//! They are guesses that no proof relies on, so plain float32 will do in every style.

use hiz_core::BoundsKind;

use super::planes::Projected;
use super::{Value, dot};

type Vector = [f32; 3];

/// `Candidate`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) facing: f32,
    pub(super) slope: [f32; 2],
    own: f32,
}

/// `CANDIDATES`.
pub(super) fn count(kind: BoundsKind) -> u32 {
    if kind == BoundsKind::Sphere { 24 } else { 18 }
}

/// `candidate`, for a box or a sphere.
pub(super) fn candidate(kind: BoundsKind, i: u32, p: &Projected, facing: f32) -> Candidate {
    if kind == BoundsKind::Sphere { of_sphere(i, p, facing) } else { of_box(i, p, facing) }
}

/// `on_border`.
pub(super) fn on_border(kind: BoundsKind, guess: &Candidate, border: f32, extent: f32) -> bool {
    kind == BoundsKind::Sphere || (guess.own - border).abs() <= 1e-3 * extent
}

fn each(f: impl Fn(usize) -> f32) -> Vector {
    [f(0), f(1), f(2)]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `corner`: pixel position and depth.
fn corner(p: &Projected, signs: Vector) -> Vector {
    let at = |v: &Value| v.center + dot(v.half, signs);
    let w = at(&p.w);
    [at(&p.x) / w, at(&p.y) / w, at(&p.z) / w]
}

fn of_box(i: u32, p: &Projected, facing: f32) -> Candidate {
    let sign = |bit: u32| if i & bit == 0 { -1.0_f32 } else { 1.0 };
    let axis = |k: u32| each(|n| if n as u32 == k { 1.0 } else { 0.0 });
    let zxy = |e: Vector| [e[2], e[0], e[1]];
    let yzx = |e: Vector| [e[1], e[2], e[0]];
    if i < 12 {
        let e = axis(i >> 2);
        let beside = each(|k| sign(1) * zxy(e)[k] + sign(2) * yzx(e)[k]);
        let begin = corner(p, each(|k| beside[k] - e[k]));
        let end = corner(p, each(|k| beside[k] + e[k]));
        let along = [end[0] - begin[0], end[1] - begin[1]];
        let longest = along[0].abs().max(along[1].abs());
        let slope = [along[1] / longest, -along[0] / longest];
        return Candidate { facing: 0.0, slope, own: slope[0] * begin[0] + slope[1] * begin[1] };
    }
    let e = axis((i - 12) >> 1);
    let at = |a: f32, b: f32| corner(p, each(|k| sign(1) * e[k] + a * zxy(e)[k] + b * yzx(e)[k]));
    let (begin, diagonal, left, right) =
        (at(-1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0), at(1.0, -1.0));
    let normal = cross(each(|k| diagonal[k] - begin[k]), each(|k| left[k] - right[k]));
    let slope = [facing * normal[0] / normal[2], facing * normal[1] / normal[2]];
    Candidate {
        facing,
        slope,
        own: facing * begin[2] + (slope[0] * begin[0] + slope[1] * begin[1]),
    }
}

/// `gradient`.
fn gradient(r: &Value, w: &Value, point: Vector) -> Vector {
    let ratio = (r.center + dot(r.half, point)) / (w.center + dot(w.half, point));
    each(|k| r.half[k] - ratio * w.half[k])
}

fn normalized(v: Vector) -> Vector {
    let length = dot(v, v).sqrt();
    v.map(|x| x / length)
}

fn of_sphere(i: u32, p: &Projected, facing: f32) -> Candidate {
    if i < 16 {
        let (sine, cosine) = (i as f32 * (std::f32::consts::TAU / 16.0)).sin_cos();
        return Candidate { facing: 0.0, slope: [cosine, sine], own: 0.0 };
    }
    let center = [0.0; 3];
    let columns = gradient(&p.x, &p.w, center);
    let ray = normalized(cross(columns, gradient(&p.y, &p.w, center)));
    let away = facing * dot(gradient(&p.z, &p.w, center), ray);
    // WGSL's sign of 0 is 0.
    let sign = if away == 0.0 { 0.0 } else { away.signum() };
    let toward_eye = ray.map(|x| -sign * x);
    let right = normalized(columns);
    let up = cross(toward_eye, right);
    let (sine, cosine) = if i >= 20 { 1.2_f32 } else { 0.7 }.sin_cos();
    let (turned, turn) = (i as f32 * (std::f32::consts::TAU / 4.0)).sin_cos();
    let outward = each(|k| turn * right[k] + turned * up[k]);
    let point = each(|k| cosine * toward_eye[k] + sine * outward[k]);
    let down = each(|k| cosine * outward[k] - sine * toward_eye[k]);
    let image = [&p.x, &p.y, &p.z].map(|r| gradient(r, &p.w, point));
    let on_image = |v: Vector| image.map(|g| dot(v, g));
    let normal = cross(on_image(down), on_image(cross(point, down)));
    Candidate {
        facing,
        slope: [facing * normal[0] / normal[2], facing * normal[1] / normal[2]],
        own: 0.0,
    }
}
