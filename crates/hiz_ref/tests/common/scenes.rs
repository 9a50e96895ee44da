//! Random views and volumes in float64 as real scenes have them.
//! Some are on a border on purpose.

use super::Random;
use hiz_ref::{View, Volume};

type Vector = [f64; 3];

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Random {
    /// Uniform in `from..to`.
    pub fn uniform(&mut self, from: f64, to: f64) -> f64 {
        let unit = (self.bits() >> 11) as f64 * 2.0f64.powi(-53);
        from + (to - from) * unit
    }

    /// Powers from `10^from` to `10^to`, uniform in the exponent.
    pub fn power(&mut self, from: f64, to: f64) -> f64 {
        10.0f64.powf(self.uniform(from, to))
    }

    /// Three rows that are orthonormal up to rounding: a rotation from a random unit quaternion.
    pub fn rotation(&mut self) -> [Vector; 3] {
        let q = loop {
            let q = [0; 4].map(|_| self.uniform(-1.0, 1.0));
            let square: f64 = q.iter().map(|x| x * x).sum();
            if (0.01..=1.0).contains(&square) {
                break q.map(|x| x / square.sqrt());
            }
        };
        let [w, x, y, z] = q;
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }
}

/// A camera, whose axes (right, up, forward) are the rows of a rotation.
pub struct Scene {
    pub view: View,
    pub axes: [Vector; 3],
}

/// A random camera somewhere in a large world.
/// It is perspective or orthographic, standard or reversed, finite or infinite, and off-centre.
pub fn scene(random: &mut Random, width: u32, height: u32) -> Scene {
    let axes = if random.whole(0, 3) == 0 {
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    } else {
        random.rotation()
    };
    let [right, up, forward] = axes;
    let reversed = random.whole(0, 1) == 1;
    let scale = random.uniform(0.5, 2.0);
    let (shift_x, shift_y) = (random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3));
    let near = random.power(-3.0, 0.0);
    let far = near * random.power(1.0, 7.0);
    let row = |v: Vector, shift: f64, constant: f64| {
        let [a, b, c] = [0, 1, 2].map(|i| scale * v[i] + shift * forward[i]);
        [a, b, c, constant]
    };
    // z = slope * depth + offset.
    // By hand from z(near), z(far) = 0, w for standard and w, 0 for reversed depth.
    let depth_row = |slope: f64, offset: f64| {
        let [a, b, c] = forward.map(|x| slope * x);
        [a, b, c, offset]
    };
    let rows = if random.whole(0, 3) == 0 {
        let far = far.min(100.0);
        let (slope, offset) = if reversed {
            (-1.0 / (far - near), far / (far - near))
        } else {
            (1.0 / (far - near), -near / (far - near))
        };
        let lens = |v: Vector, constant| {
            let [a, b, c] = v.map(|x| 0.2 * scale * x);
            [a, b, c, constant]
        };
        let z = depth_row(slope, offset);
        [lens(right, shift_x), lens(up, shift_y), z, [0.0, 0.0, 0.0, 1.0]]
    } else {
        let (slope, offset) = match (reversed, random.whole(0, 1)) {
            (false, 0) => (1.0, -near),
            (true, 0) => (0.0, near),
            (false, _) => (far / (far - near), -near * far / (far - near)),
            (true, _) => (-near / (far - near), near * far / (far - near)),
        };
        [
            row(right, shift_x, 0.0),
            row(up, shift_y, 0.0),
            depth_row(slope, offset),
            depth_row(1.0, 0.0),
        ]
    };
    let world = if random.whole(0, 1) == 0 { 0.0 } else { random.power(2.0, 7.0) };
    let view = View {
        rows,
        origin: [0; 3].map(|_| random.uniform(-world, world)),
        width,
        height,
        reversed,
    };
    Scene { view, axes }
}

/// A volume, mostly in front of the camera: any kind, from specks to walls.
pub fn volume(random: &mut Random, scene: &Scene) -> Volume {
    let depth = random.power(-1.0, 2.5);
    let spread = 1.3 * depth;
    let local = [random.uniform(-spread, spread), random.uniform(-spread, spread), depth];
    let center = [0, 1, 2].map(|i| {
        let column = scene.axes.map(|axis| axis[i]);
        scene.view.origin[i] + dot(column, local)
    });
    let size = depth * random.power(-3.0, 0.3);
    let half_sizes = [0; 3].map(|_| size * random.uniform(0.0, 1.0));
    match random.whole(0, 2) {
        0 => Volume::Sphere { center, radius: size },
        1 => Volume::Box {
            min: [0, 1, 2].map(|i| center[i] - half_sizes[i]),
            max: [0, 1, 2].map(|i| center[i] + half_sizes[i]),
        },
        _ => Volume::OrientedBox { center, half_sizes, axes: random.rotation() },
    }
}

/// An image with depths near the volume's nearest depth.
/// They are all nearer, or with holes, equal, or noise.
pub fn image(random: &mut Random, view: &View, nearest: Option<f64>) -> Vec<f32> {
    let count = view.width as usize * view.height as usize;
    let nearest = nearest.unwrap_or(0.5).clamp(0.0, 1.0) as f32;
    let toward_near = |x: f32| {
        if view.reversed { x.next_up() } else { x.next_down() }
    };
    match random.whole(0, 4) {
        0 => vec![nearest; count],
        1 => vec![toward_near(toward_near(nearest)); count],
        2 => (0..count).map(|_| random.uniform(0.0, 1.0) as f32).collect(),
        kind => {
            let mut pixels = vec![toward_near(nearest); count];
            for _ in 0..random.whole(1, if kind == 3 { 3 } else { 300 }) {
                let at = random.bits() as usize % count;
                pixels[at] = if view.reversed { 0.0 } else { 1.0 };
            }
            pixels
        }
    }
}
