//! Volumes whose verdict is nearly the opposite.
//! They are placed beside a hole or in front of a depth.
//! Then they are moved until the last bits decide the oracle's verdict.

use hiz_core::BoundsKind;
use hiz_ref::{View, Volume};

use crate::common::Random;

use super::class::Class;
use super::scene::{DepthStyle, Scene};

/// How far beside a border an edge may be placed, in pixels.
const HAIRS: [f64; 9] = [0.0, 1e-7, -1e-7, 3e-6, -3e-6, 1e-4, -1e-4, 1e-12, -1e-12];

/// A direction, and a predicate: has a volume moved far enough along it?
struct Way<'a> {
    direction: [f64; 3],
    cleared: Box<dyn Fn(&Volume) -> bool + 'a>,
}

impl Scene {
    /// A volume of `kind` as `class` wants it, and the direction in which it becomes hidden.
    /// The direction is as long as the scene's distance.
    pub(super) fn volume(
        &self,
        class: Class,
        kind: BoundsKind,
        random: &mut Random,
    ) -> (Volume, [f64; 3]) {
        let has_plates = matches!(kind, BoundsKind::Box | BoundsKind::OrientedBox);
        let placed = if class == Class::Grazing && has_plates {
            self.plate(kind, random)
        } else {
            self.placed(class, kind, random)
        };
        let way = self.way(class, random);
        let away = way.direction.map(|x| x * self.front.abs());
        // One in four stays where it was placed: a hair beside a border, or anywhere.
        let volume = if random.below(4) == 0 {
            placed
        } else {
            self.last_before(placed, away, &*way.cleared, random).unwrap_or(placed)
        };
        (if kind == BoundsKind::Point { narrowed(&volume) } else { volume }, away)
    }

    /// An interval in pixels along an axis.
    /// It is random, or ends a hair beside the border of the hole or of a texel.
    fn interval(&self, class: Class, axis: usize, random: &mut Random) -> [f64; 2] {
        let side = [self.view.width, self.view.height][axis];
        let hole = f64::from(self.hole[axis]);
        let hair = random.pick(&HAIRS);
        let extent = class.extent(side, random);
        let [from, to] = match random.below(if class == Class::PixelBorders { 3 } else { 4 }) {
            0 => [hole + self.edges[0] - extent, hole + self.edges[0] + hair],
            1 => [hole + self.edges[1] + hair, hole + self.edges[1] + extent],
            2 if class != Class::Tiny => {
                let k = random.below(5);
                let begin = f64::from(random.below(side + 1) >> k << k);
                [begin + hair, begin + f64::from(1_u32 << random.below(5)) - hair]
            }
            _ => {
                let begin = random.range(-0.2, 1.2) * f64::from(side);
                [begin, begin + extent]
            }
        };
        [from.min(to), from.max(to)]
    }

    /// A volume whose front faces the camera at the scene's depth.
    fn placed(&self, class: Class, kind: BoundsKind, random: &mut Random) -> Volume {
        let z = self.front;
        let ([x0, x1], [y0, y1]) =
            (self.interval(class, 0, random), self.interval(class, 1, random));
        let ([left, top], [right, bottom]) = (self.at([x0, y0], z), self.at([x1, y1], z));
        let middle = [0.5 * (left + right), 0.5 * (top + bottom)];
        let half = [0.5 * (right - left).abs(), 0.5 * (top - bottom).abs()];
        let pixel = (self.at([1.0, 0.0], z)[0] - self.at([0.0, 0.0], z)[0]).abs();
        let thickness = match class {
            Class::Tiny => 0.5 * (half[0] + half[1]),
            _ => random.pick(&[0.0, 0.0, 1e-3, 1.0, 30.0]) * pixel,
        };
        match kind {
            BoundsKind::Point | BoundsKind::WidePoint => {
                // An end of the interval, which is often a hair beside a border.
                let (x, y) = (random.pick(&[x0, x1]), random.pick(&[y0, y1]));
                let [x, y] = self.at([x, y], z);
                Volume::Sphere { center: self.world([x, y, z]), radius: 0.0 }
            }
            BoundsKind::Sphere => {
                let radius = match class {
                    Class::Tiny => half[0],
                    Class::Huge => half[0].max(half[1]),
                    _ => half[0].min(half[1]).max(1e-3 * pixel) * random.pick(&[1.0, 0.3, 1e-3]),
                };
                Volume::Sphere { center: self.world([middle[0], middle[1], z + radius]), radius }
            }
            BoundsKind::Box if self.settings.aligned => {
                // The camera looks along the world's -z with y up.
                // View (x, y, depth) is world (x, y, -depth).
                let a = self.world([left.min(right), top.min(bottom), z + thickness]);
                let b = self.world([left.max(right), top.max(bottom), z]);
                spanned(a, b)
            }
            BoundsKind::Box => {
                let center = self.world([middle[0], middle[1], z + thickness]);
                let h = [0; 3].map(|_| random.unit() * half[0].max(half[1]));
                spanned([0, 1, 2].map(|k| center[k] - h[k]), [0, 1, 2].map(|k| center[k] + h[k]))
            }
            BoundsKind::OrientedBox => {
                let [right, up, forward] = self.axes;
                // A roll about the view direction keeps the front in place.
                // So does a reflection along it.
                let (s, c) = if random.below(3) == 0 {
                    random.range(0.0, 6.3).sin_cos()
                } else {
                    (0.0, 1.0)
                };
                let mirror = random.pick(&[1.0, -1.0]);
                let axes = [0, 1, 2].map(|k| {
                    [c * right[k] + s * up[k], c * up[k] - s * right[k], mirror * forward[k]]
                });
                let center = self.world([middle[0], middle[1], z + thickness]);
                Volume::OrientedBox { center, half_sizes: [half[0], half[1], thickness], axes }
            }
        }
    }

    /// A flat box that contains a line of sight along a border of the hole.
    /// All of it projects onto one line of the image.
    fn plate(&self, kind: BoundsKind, random: &mut Random) -> Volume {
        let z = self.front;
        let axis = if self.settings.style == DepthStyle::Row { 1 } else { 0 };
        let mut pixel =
            [0, 1].map(|k| random.unit() * f64::from([self.view.width, self.view.height][k]));
        pixel[axis] = f64::from(self.hole[axis]) + random.pick(&self.edges) + random.pick(&HAIRS);
        let [x, y] = self.at(pixel, z);
        let along = if self.settings.orthographic { [0.0, 0.0, 1.0] } else { [x / z, y / z, 1.0] };
        let depth = 0.5 * z * random.unit();
        let height = random.pick(&[1e-3, 0.1, 1.0])
            * (self.at([0.0, 1.0], z)[1] - self.at([0.0, 0.0], z)[1]).abs();
        let (forward, center) =
            (self.world(along), self.world([0, 1, 2].map(|k| [x, y, z][k] + depth * along[k])));
        if kind == BoundsKind::Box {
            // A plate along the world's axes is edge-on only from an eye on or near its plane.
            let mut half = [depth; 3];
            half[random.below(3) as usize] = 0.0;
            return spanned(
                [0, 1, 2].map(|k| center[k] - half[k]),
                [0, 1, 2].map(|k| center[k] + half[k]),
            );
        }
        let up = self.axes[1 - axis];
        let axes = [0, 1, 2].map(|k| [forward[k] - self.settings.eye[k], up[k], 0.0]);
        Volume::OrientedBox { center, half_sizes: [depth, height, 0.0], axes }
    }

    /// A way for volumes to become hidden, given the depth image.
    fn way(&self, class: Class, random: &mut Random) -> Way<'_> {
        let [right, up, forward] = self.axes;
        let outside = |view: View| move |v: &Volume| hiz_ref::is_outside(&view, v).unwrap_or(false);
        match self.settings.style {
            // Backwards, until it is behind the depth.
            DepthStyle::Equal | DepthStyle::Near | DepthStyle::Noise => {
                let hidden =
                    |v: &Volume| hiz_ref::hides(&self.view, v, self.front_depth).unwrap_or(false);
                Way { direction: forward, cleared: Box::new(hidden) }
            }
            // Away from the frustum's middle, until it is outside.
            DepthStyle::Far => {
                let (axis, sign) = match class {
                    Class::NearPlane => (forward, -1.0),
                    _ => (random.pick(&[right, up, forward]), random.pick(&[1.0, -1.0])),
                };
                Way {
                    direction: axis.map(|x| sign * x),
                    cleared: Box::new(outside(self.view.clone())),
                }
            }
            // Away from the hole, until it no longer touches it.
            DepthStyle::Column | DepthStyle::Row | DepthStyle::Cross | DepthStyle::Pixel => {
                let axis = match self.settings.style {
                    DepthStyle::Column => 0,
                    DepthStyle::Row => 1,
                    _ => random.below(2) as usize,
                };
                let size = f64::from([self.view.width, self.view.height][axis]);
                let hole = f64::from(self.hole[axis]);
                // Towards smaller pixel coordinates, clear of the hole and of everything beyond it.
                // Or the other way.
                let down = random.below(2) == 0;
                let (begin, end) =
                    if down { (hole + self.edges[0], size) } else { (0.0, hole + self.edges[1]) };
                // Pixel rows count downwards.
                let sign = if down == (axis == 0) { -1.0 } else { 1.0 };
                let direction = [right, up][axis].map(|x| sign * x);
                Way { direction, cleared: Box::new(outside(self.cropped(axis, begin, end))) }
            }
        }
    }

    /// Moves `volume` along `away` to the last place where it is not yet `cleared`.
    /// The place is found to within 1e-10 of the distance, or lies a few eps before it.
    /// `None` where there is no such place nearby.
    fn last_before(
        &self,
        volume: Volume,
        away: [f64; 3],
        cleared: &dyn Fn(&Volume) -> bool,
        random: &mut Random,
    ) -> Option<Volume> {
        let at = |s: f64| moved(&volume, away.map(|x| x * s));
        let towards = if cleared(&volume) { -1.0 } else { 1.0 };
        // A bracket around the change, which is mostly near.
        let (mut inner, mut outer) = (0.0, 1e-9 * towards);
        while cleared(&at(outer)) == (towards < 0.0) {
            (inner, outer) = (outer, outer * 16.0);
            if outer.abs() > 1e3 {
                return None;
            }
        }
        let (mut before, mut after) = if towards > 0.0 { (inner, outer) } else { (outer, inner) };
        for _ in 0..60 {
            if (after - before).abs() <= 1e-10 * before.abs().clamp(0.1, 1.0) {
                break;
            }
            let middle = 0.5 * (before + after);
            if cleared(&at(middle)) { after = middle } else { before = middle }
        }
        let hair = random.pick(&[0.0, 0.0, 0.0, 1e-9, 1e-8, 5e-8, 1e-7]);
        Some(at(before - hair))
    }
}

fn spanned(a: [f64; 3], b: [f64; 3]) -> Volume {
    Volume::Box { min: [0, 1, 2].map(|k| a[k].min(b[k])), max: [0, 1, 2].map(|k| a[k].max(b[k])) }
}

/// A point at the nearest position that float32 holds.
fn narrowed(point: &Volume) -> Volume {
    let Volume::Sphere { center, radius } = *point else { panic!("expected a point") };
    Volume::Sphere { center: center.map(|x| f64::from(x as f32)), radius }
}

/// `volume`, translated.
pub(crate) fn moved(volume: &Volume, by: [f64; 3]) -> Volume {
    let plus = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] + by[k]);
    match *volume {
        Volume::Sphere { center, radius } => Volume::Sphere { center: plus(center), radius },
        Volume::Box { min, max } => Volume::Box { min: plus(min), max: plus(max) },
        Volume::OrientedBox { center, half_sizes, axes } => {
            Volume::OrientedBox { center: plus(center), half_sizes, axes }
        }
    }
}
