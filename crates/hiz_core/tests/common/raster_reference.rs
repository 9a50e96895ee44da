//! What an image of triangles shows at least and at most, in float64 and by brute force.
//!
//! It uses no code of the crate except a camera's rows.
//! Depth is nearness here: 0 on the far plane, 1 on the near plane.

use hiz_core::{Camera, FaceCull};

pub(crate) type Vec3 = [f64; 3];

/// Corners lie on a grid of 1/256 pixel, so a border moves by less than this, in pixels.
const SNAPPED: f64 = 1.5 / 256.0;
/// Triangles are clipped this far outside of the image, or farther, in pixels.
const GUARD: f64 = 8000.0;
/// The roundings of one row of float32 clip coordinates, as a share of its terms' sizes.
const ROW: f64 = 16.0 / 16_777_216.0;
const ULP: f64 = 1.0 / 16_777_216.0;

/// Where the rays come from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Rays {
    From(Vec3),
    Along(Vec3),
}

/// Triangles in world coordinates, and how they are seen.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    pub(crate) camera: Camera,
    pub(crate) rays: Rays,
    pub(crate) culled: FaceCull,
}

/// The least and the greatest nearness that a pixel may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// A corner of what is left of a triangle behind the near plane.
#[derive(Debug, Clone, Copy)]
struct Corner {
    /// Pixels, from the image's top left corner.
    x: f64,
    y: f64,
    nearness: f64,
    /// What float32 may be wrong by: in pixels, and in nearness.
    error: f64,
    nearness_error: f64,
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// How a face is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Facing {
    Occludes,
    Culled,
    Unsure,
}

impl Seen {
    fn facing(&self, [a, b, c]: [Vec3; 3]) -> Facing {
        let normal = cross(sub(b, a), sub(c, a));
        let to_eye = match self.rays {
            Rays::From(eye) => sub(eye, a),
            Rays::Along(direction) => direction.map(|v| -v),
        };
        let front = dot(normal, to_eye);
        let sure = front.abs() > 1e-6 * dot(normal, normal).sqrt() * dot(to_eye, to_eye).sqrt();
        match self.culled {
            FaceCull::None => Facing::Occludes,
            _ if !sure => Facing::Unsure,
            FaceCull::Back if front > 0.0 => Facing::Occludes,
            FaceCull::Front if front < 0.0 => Facing::Occludes,
            _ => Facing::Culled,
        }
    }

    /// x and y in pixels times w, nearness times w, and w; and the sizes of their terms.
    fn clip(&self, p: Vec3) -> ([f64; 4], [f64; 4]) {
        let d = sub(p, self.camera.origin());
        let rows = self.camera.rows();
        let at = |r: usize| dot([rows[r][0], rows[r][1], rows[r][2]], d) + rows[r][3];
        let size =
            |r: usize| (0..3).map(|k| (rows[r][k] * d[k]).abs()).sum::<f64>() + rows[r][3].abs();
        let [width, height] = self.half();
        let (x, y, z, w) = (at(0), at(1), at(2), at(3));
        let is_reversed = self.camera.convention().is_reversed();
        let nearness = if is_reversed { z } else { w - z };
        let nearness_size = if is_reversed { size(2) } else { size(2) + size(3) };
        (
            [(x + w) * width, (w - y) * height, nearness, w],
            [size(0) * width, size(1) * height, nearness_size, size(3)],
        )
    }

    /// Half of the image in pixels.
    fn half(&self) -> [f64; 2] {
        let size = self.camera.size();
        [f64::from(size.width) / 2.0, f64::from(size.height) / 2.0]
    }

    /// What is left of a triangle behind the near plane.
    fn polygon(&self, triangle: [Vec3; 3]) -> Vec<Corner> {
        let ends = triangle.map(|p| self.clip(p));
        let inside = |clip: &[f64; 4]| clip[3] - clip[2];
        let mut polygon = Vec::new();
        for k in 0..3 {
            let ((a, sizes), (b, _)) = (ends[k], ends[(k + 1) % 3]);
            if inside(&a) >= 0.0 {
                polygon.push(self.corner(a, Some(sizes)));
            }
            if (inside(&a) >= 0.0) != (inside(&b) >= 0.0) {
                let t = inside(&a) / (inside(&a) - inside(&b));
                let cut = std::array::from_fn(|k| a[k] + t * (b[k] - a[k]));
                polygon.push(self.corner(cut, None));
            }
        }
        polygon
    }

    /// `sizes` are those of a vertex; cut points are computed in float64.
    fn corner(&self, [x, y, n, w]: [f64; 4], sizes: Option<[f64; 4]>) -> Corner {
        let half = self.half();
        let (x, y, nearness) = (x / w, y / w, n / w);
        let (from_middle_x, from_middle_y) = ((x - half[0]).abs(), (y - half[1]).abs());
        let far = from_middle_x.max(from_middle_y);
        let is_beyond =
            from_middle_x > 1.01 * (half[0] + GUARD) || from_middle_y > 1.01 * (half[1] + GUARD);
        let [ex, ey, en, ew] = match sizes {
            Some(sizes) if !is_beyond => sizes.map(|size| size / w * ROW),
            _ => [0.0; 4],
        };
        let grid = far.min(20_000.0) * 4.0 * ULP;
        Corner {
            x,
            y,
            nearness,
            error: ex + ey + far * ew + grid + far * 1e-14,
            nearness_error: en + nearness.abs() * (ew + 4.0 * ULP) + 1e-9 * ULP,
        }
    }

    /// The range of each pixel, row 0 on top.
    pub(crate) fn ranges(&self, triangles: &[[Vec3; 3]]) -> Vec<Range> {
        let size = self.camera.size();
        let mut ranges =
            vec![Range { low: 0.0, high: 0.0 }; size.width as usize * size.height as usize];
        for triangle in triangles {
            self.add(*triangle, &mut ranges);
        }
        ranges
    }

    fn add(&self, triangle: [Vec3; 3], ranges: &mut [Range]) {
        let mut facing = self.facing(triangle);
        let polygon = self.polygon(triangle);
        if polygon.len() < 3 {
            return;
        }
        let most = |f: fn(&Corner) -> f64| polygon.iter().map(f).fold(f64::MIN, f64::max);
        let least = |f: fn(&Corner) -> f64| polygon.iter().map(f).fold(f64::MAX, f64::min);
        let error = most(|c| c.error);
        let margin = SNAPPED + error;
        let cap = (most(|c| c.nearness) + 2.0 * most(|c| c.nearness_error)).min(1.0);
        let plane = Plane::new(triangle.map(|p| self.clip(p).0));
        let thin = height(&polygon);
        // float32 may turn a face round that is thinner than its errors.
        if thin < 4.0 * error && self.culled != FaceCull::None {
            facing = Facing::Unsure;
        }
        if facing == Facing::Culled {
            return;
        }
        // Twice the part of its height that a point outside of the triangle may be beyond it.
        let beyond = 1.0 + 4.0 * margin / (thin - 4.0 * error).max(0.0);
        let size = self.camera.size();
        let within = |low: f64, high: f64, side: u32| {
            let last = f64::from(side) - 1.0;
            let first = (low - margin - 1.0).clamp(0.0, last + 1.0);
            first as u32..(high + margin + 1.0).clamp(-1.0, last) as i64 as u32 + 1
        };
        if most(|c| c.x) + margin < 0.0 || most(|c| c.y) + margin < 0.0 {
            return;
        }
        for row in within(least(|c| c.y), most(|c| c.y), size.height) {
            for column in within(least(|c| c.x), most(|c| c.x), size.width) {
                let (x, y) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
                let (distance, is_inside) = place(&polygon, x, y);
                if distance > margin && !is_inside {
                    continue;
                }
                let reach = |from: fn(&Corner) -> f64, to: f64, side: u32| {
                    let most = polygon.iter().map(|c| (from(c) - to).abs()).fold(0.0, f64::max);
                    most.min(f64::from(side) + 2.0 * GUARD)
                };
                let rise = plane.slope[0].abs() * reach(|c| c.x, x, size.width)
                    + plane.slope[1].abs() * reach(|c| c.y, y, size.height);
                let steep = plane.slope[0].abs() + plane.slope[1].abs();
                let tolerance = beyond * (most(|c| c.nearness_error) + steep * error)
                    + 16.0 * ULP * (rise + cap);
                let nearness = plane.at(x, y);
                let range = &mut ranges[(row * size.width + column) as usize];
                let (low, high) = if tolerance.is_finite() {
                    (nearness - tolerance, nearness + tolerance)
                } else {
                    (0.0, cap)
                };
                range.high = range.high.max(high.min(cap));
                if distance > margin && facing == Facing::Occludes {
                    range.low = range.low.max(low.min(cap * (1.0 - 4.0 * ULP)));
                }
            }
        }
    }
}

/// Nearness as a function of the place in the image.
struct Plane {
    slope: [f64; 2],
    at_origin: f64,
}

impl Plane {
    /// The solution of `slope . (x, y) + at_origin * w = nearness * w` at the corners.
    fn new(clip: [[f64; 4]; 3]) -> Self {
        let [a, b, c] = clip.map(|c| [c[0], c[1], c[3]]);
        let n = clip.map(|c| c[2]);
        let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
        let volume = dot(a, bc);
        let at = |k: usize| (bc[k] * n[0] + ca[k] * n[1] + ab[k] * n[2]) / volume;
        Self { slope: [at(0), at(1)], at_origin: at(2) }
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        self.slope[0] * x + self.slope[1] * y + self.at_origin
    }
}

/// The polygon's area by its longest side, in pixels: less than its height.
fn height(polygon: &[Corner]) -> f64 {
    let (mut area, mut longest) = (0.0, 0.0_f64);
    for (k, a) in polygon.iter().enumerate() {
        let b = &polygon[(k + 1) % polygon.len()];
        let from = &polygon[0];
        area += (a.x - from.x) * (b.y - from.y) - (a.y - from.y) * (b.x - from.x);
        longest = longest.max((a.x - b.x).hypot(a.y - b.y));
    }
    if longest > 0.0 { area.abs() / (2.0 * longest) } else { 0.0 }
}

/// How far a point is from the border, and whether it is inside.
fn place(polygon: &[Corner], x: f64, y: f64) -> (f64, bool) {
    let (mut distance, mut is_inside) = (f64::MAX, false);
    for (k, a) in polygon.iter().enumerate() {
        let b = &polygon[(k + 1) % polygon.len()];
        let (ex, ey) = (b.x - a.x, b.y - a.y);
        let (px, py) = (x - a.x, y - a.y);
        let length = ex * ex + ey * ey;
        let along = if length > 0.0 { ((px * ex + py * ey) / length).clamp(0.0, 1.0) } else { 0.0 };
        distance = distance.min((px - along * ex).hypot(py - along * ey));
        if (a.y > y) != (b.y > y) && x < a.x + (y - a.y) / ey * ex {
            is_inside = !is_inside;
        }
    }
    (distance, is_inside)
}
