//! What rays through the pixels of a picture see, in float64.
//! No depth image, matrix or other code of the library takes part.

use hiz_core::{ImageSize, Vec3};

use crate::scene::{EYE, FAR, FOV_Y_DEG, NEAR, axes};

/// The rays of a picture, and where each meets the nearest prism.
pub(crate) struct Rays {
    axes: [Vec3; 3],
    size: ImageSize,
    /// Half the image at view depth 1.
    half: [f64; 2],
    /// View depth of the nearest prism, by pixel.
    prism: Vec<f64>,
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// View depth at which a ray from the eye enters a box, if it does so behind the near plane.
fn enters([min, max]: &[Vec3; 2], ray: Vec3) -> Option<f64> {
    let (mut first, mut last) = (NEAR, FAR);
    for k in 0..3 {
        let (a, b) = ((min[k] - EYE[k]) / ray[k], (max[k] - EYE[k]) / ray[k]);
        first = first.max(a.min(b));
        last = last.min(a.max(b));
    }
    (first <= last).then_some(first)
}

impl Rays {
    pub(crate) fn new(azimuth_deg: f64, size: ImageSize, prisms: &[[Vec3; 2]]) -> Self {
        let tall = (0.5 * FOV_Y_DEG).to_radians().tan();
        let half = [tall * f64::from(size.width) / f64::from(size.height), tall];
        let mut rays = Self { axes: axes(azimuth_deg), size, half, prism: Vec::new() };
        for row in 0..size.height {
            for column in 0..size.width {
                let ray = rays.through(column, row);
                let depths = prisms.iter().filter_map(|prism| enters(prism, ray));
                rays.prism.push(depths.fold(FAR, f64::min));
            }
        }
        rays
    }

    /// The ray through a pixel's centre, per unit of view depth.
    fn through(&self, column: u32, row: u32) -> Vec3 {
        let along = |i: u32, count: u32| (2.0 * f64::from(i) + 1.0) / f64::from(count) - 1.0;
        let x = along(column, self.size.width) * self.half[0];
        let y = -along(row, self.size.height) * self.half[1];
        let [right, up, forward] = self.axes;
        [0, 1, 2].map(|k| forward[k] + x * right[k] + y * up[k])
    }

    /// Whether a ray meets the sphere before any prism.
    pub(crate) fn see(&self, sphere: [f32; 4]) -> bool {
        let [x, y, z, radius] = sphere.map(f64::from);
        let center = [x - EYE[0], y - EYE[1], z - EYE[2]];
        let at = self.axes.map(|axis| dot(center, axis));
        if at[2] + radius <= NEAR {
            return false;
        }
        let [columns, rows] = [0, 1].map(|k| self.range(k, at, radius));
        let inside = dot(center, center) - radius * radius;
        rows.clone().any(|row| {
            columns.clone().any(|column| {
                let ray = self.through(column, row);
                let (a, b) = (dot(ray, ray), dot(ray, center));
                let root = b * b - a * inside;
                if root <= 0.0 {
                    return false;
                }
                let (enter, leave) = ((b - root.sqrt()) / a, (b + root.sqrt()) / a);
                let pixel = (row * self.size.width + column) as usize;
                leave > NEAR && enter.max(NEAR) < self.prism[pixel]
            })
        })
    }

    /// The columns (axis 0) or rows (axis 1) that a sphere's box may touch.
    fn range(&self, axis: usize, at: [f64; 3], radius: f64) -> std::ops::Range<u32> {
        let count = [self.size.width, self.size.height][axis];
        let nearest = at[2] - radius;
        if nearest <= 0.01 {
            return 0..count;
        }
        let sign = [1.0, -1.0][axis];
        let ends = [-radius, radius].map(|r| sign * at[axis] + r);
        let over = |end: f64, to: fn(f64, f64) -> f64| to(end / nearest, end / (at[2] + radius));
        let pixel = |v: f64| (v / self.half[axis] + 1.0) * 0.5 * f64::from(count);
        let first = pixel(over(ends[0], f64::min)).floor().clamp(0.0, f64::from(count));
        let last = pixel(over(ends[1], f64::max)).ceil().clamp(0.0, f64::from(count));
        first as u32..last as u32
    }
}
