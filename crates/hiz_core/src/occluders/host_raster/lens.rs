//! A camera in the numbers that the rasteriser computes with.
//!
//! Positions in the image are in **units** of 1/256 pixel, the grid that Vulkan's drivers use too.
//! Depth is **nearness**: 0 on the far plane, 1 on the near plane, greater where nearer.
//! It is reversed NDC depth, and 1 minus NDC depth for standard Z.

use crate::host::linear::{Mat4, Vec3, dot, solve3, sub};
use crate::host::rounding::flushed;
use crate::host::vectors::Eight;
use crate::input::camera::Camera;
use crate::input::image::{ImageSize, MAX_IMAGE_SIDE};
use crate::input::mesh::FaceCull;
use crate::occluders::host_raster::lanes::{greatest, lanes, least, least_of, three};
use crate::occluders::host_raster::planted_fault::{Planted, is_planted};
use crate::occluders::meshlets::LANES;
use crate::occluders::placement::Placement;
use crate::occluders::view::PlacedView;

/// Units per pixel.
pub(super) const UNITS: i32 = 256;
/// From a pixel's corner to its centre, in units.
pub(super) const HALF: i32 = UNITS / 2;
/// How far outside of the image a vertex may lie without its triangles being clipped, in pixels.
const GUARD_PIXELS: f32 = 8000.0;
/// How far from the image's middle a vertex may lie, in units: [`rounded`] holds 2^22.
///
/// The outermost centres of the largest image, 32,768 pixels, are half a pixel below 2^22.
pub(super) const FARTHEST_UNIT: f32 = 4_194_304.0 - 64.0;
const _: () = assert!((MAX_IMAGE_SIDE as i32 * UNITS - UNITS) / 2 < FARTHEST_UNIT as i32);

/// Vertices with a smaller w are clipped, so that its inverse is finite.
pub(super) const LEAST_W: f32 = 1e-30;

/// Added to a float32 below 2^22 in size, this leaves its nearest integer in the lowest bits.
const MAGIC: f32 = 12_582_912.0; // 1.5 * 2^23

/// The integer nearest to `v`, ties to even, for a size of at most 2^22.
///
/// Unlike a cast it becomes one addition and one subtraction of vectors.
/// Any number is safe; NaN and large ones give some integer.
#[inline(always)]
pub(super) fn rounded(v: f32) -> i32 {
    (v + MAGIC).to_bits().wrapping_sub(MAGIC.to_bits()) as i32
}

/// The image, in units about its middle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Image {
    /// Pixels.
    pub(super) width: i32,
    pub(super) height: i32,
    /// Half of the width and of the height, in units.
    pub(super) half: [i32; 2],
    /// Beyond this distance from the middle triangles are clipped, in units.
    pub(super) guard: [f32; 2],
    pub(super) fault: Planted,
}

/// A camera in the space of one copy of a mesh, in float32.
#[derive(Debug)]
pub(super) struct Lens {
    /// Rows about the eye: x and y in units about the image's middle, times w; nearness times w;
    /// and w.
    pub(super) rows: [[f32; 4]; 4],
    /// The eye is exactly `eye_hi + eye_lo`.
    pub(super) eye_hi: [f32; 3],
    pub(super) eye_lo: [f32; 3],
    eye: Vec3,
    /// The rows in float64.
    exact: Mat4,
    /// Whether triangles are turned round: the copy is mirrored.
    pub(super) mirrored: bool,
    /// Where faces that leave a closed part are left out; `None`: nowhere.
    pub(super) leaving: Option<Leaving>,
}

/// Where a ray of the view that leaves a closed part has entered it before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leaving {
    /// The sign of the area in the image of a face by which a ray leaves, if it is
    /// counter-clockwise as seen from outside.
    pub(super) sign: f32,
    /// A box around what the image shows of the near plane, in mesh coordinates.
    min: Vec3,
    max: Vec3,
}

impl Image {
    pub(super) fn of_size(size: ImageSize, fault: Planted) -> Self {
        let half = [size.width, size.height].map(|side| side as i32 * HALF);
        let guard = half.map(|h| least(h as f32 + GUARD_PIXELS * UNITS as f32, FARTHEST_UNIT));
        Self { width: size.width as i32, height: size.height as i32, half, guard, fault }
    }

    /// Its first and its last column, and its first and its last row.
    #[cfg(feature = "methods")]
    pub(super) fn pixels(&self) -> [(i32, i32); 2] {
        [(0, self.width - 1), (0, self.height - 1)]
    }

    /// Columns or rows `low..=high` whose centres lie between two positions from the middle.
    #[inline(always)]
    pub(super) fn pixels_between(half: i32, side: i32, from: f32, to: f32) -> (i32, i32) {
        let clamped = |v: f32| rounded(greatest(least(v, FARTHEST_UNIT), -FARTHEST_UNIT)) + half;
        ((clamped(from) >> 8).clamp(0, side - 1), (clamped(to) >> 8).clamp(0, side - 1))
    }
}

impl Leaving {
    /// Whether no ray of the view begins in this box.
    #[inline(always)]
    pub(super) fn is_outside(&self, min: &Vec3, max: &Vec3) -> bool {
        (0..3).any(|k| (max[k] < self.min[k]) | (self.max[k] < min[k]))
    }
}

impl Lens {
    pub(super) fn new(
        camera: &Camera,
        image: &Image,
        placed: &PlacedView,
        placement: &Placement,
    ) -> Self {
        let [x, y, z, w] = placed.exact;
        let nearness: [f64; 4] = if camera.convention().is_reversed() {
            z
        } else {
            std::array::from_fn(|k| w[k] - z[k])
        };
        let exact = [
            x.map(|v| v * f64::from(image.half[0])),
            y.map(|v| v * -f64::from(image.half[1])),
            nearness,
            w,
        ];
        #[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
        let rows = exact.map(|row| row.map(|v| flushed(v as f32)));
        let (eye_hi, eye_lo, eye) = (placed.eye_hi, placed.eye_lo, placed.eye);
        let mirrored = placement.mirrored;
        let mut lens = Self { rows, eye_hi, eye_lo, eye, exact, mirrored, leaving: None };
        lens.leaving = lens.leaving(camera, image, placement);
        lens
    }

    fn leaving(&self, camera: &Camera, image: &Image, placement: &Placement) -> Option<Leaving> {
        /// How far the box reaches beyond the near plane, as a share of its way from the eye.
        ///
        /// That is more than what float32 moves the vertices by that are clipped there or not.
        const SPARE: f64 = 1e-3;
        if placement.is_flat() {
            return None;
        }
        let [x, y, n, w] = &self.exact;
        let spare = 2.0 * f64::from(UNITS);
        let [half_x, half_y] = image.half.map(|half| f64::from(half) + spare);
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let mut size = 0.0_f64;
        for corner in 0..4 {
            let side = |k: u32, half: f64| if corner >> k & 1 == 0 { half } else { -half };
            let less = |row: &[f64; 4], half: f64| -> [f64; 4] {
                std::array::from_fn(|k| row[k] - half * w[k])
            };
            let planes = [less(x, side(0, half_x)), less(y, side(1, half_y)), less(n, 1.0)];
            let from_eye =
                solve3(&planes.map(|p| [p[0], p[1], p[2]]), planes.map(|plane| -plane[3]))?;
            for k in 0..3 {
                min[k] = min[k].min(from_eye[k]);
                max[k] = max[k].max(from_eye[k]);
                size = size.max(from_eye[k].abs());
            }
        }
        let is_mirrored = placement.mirrored && !is_planted!(image.fault, ClosedIgnoreMirrors);
        let of_backs = FaceCull::Back.as_seen_by(camera);
        let of_backs = if is_mirrored { of_backs.reversed() } else { of_backs };
        Some(Leaving {
            // Rows run downwards, so what is counter-clockwise with y up has a negative area here.
            sign: if of_backs == FaceCull::Back { 1.0 } else { -1.0 },
            min: std::array::from_fn(|k| self.eye[k] + (min[k] - SPARE * size)),
            max: std::array::from_fn(|k| self.eye[k] + (max[k] + SPARE * size)),
        })
    }

    /// The rows at a point in mesh coordinates, in float64.
    pub(super) fn exact_clip(&self, p: Vec3, image: &Image) -> [f64; 4] {
        let d = sub(p, self.eye);
        if is_planted!(image.fault, ClippedInFloat32) {
            #[expect(clippy::cast_possible_truncation, reason = "the fault that is planted")]
            return self.clip(d.map(|v| v as f32)).map(f64::from);
        }
        self.exact.map(|r| dot([r[0], r[1], r[2]], d) + r[3])
    }

    /// The rows at a point relative to the eye.
    #[inline(always)]
    pub(super) fn clip(&self, d: [f32; 3]) -> [f32; 4] {
        self.rows.map(|r| r[0] * d[0] + r[1] * d[1] + (r[2] * d[2] + r[3]))
    }

    /// About the solid angle that triangles near `middle` take, from [`Meshlet::facing`].
    ///
    /// The unit is that of a pixel in the middle of the image, and both faces count.
    /// It is at most that of their box, which takes `most` pixels.
    ///
    /// A small area vector times the cross product of the gradients of x and y is its area in the
    /// image.
    /// A pixel at an angle from the view's axis has the solid angle of cos^3 of one in the middle.
    ///
    /// [`Meshlet::facing`]: crate::occluders::meshlets::Meshlet::facing
    pub(super) fn solid_angle(&self, facing: [f32; 3], middle: Vec3, most: f32) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "an estimate")]
        let d = sub(middle, self.eye).map(|v| v as f32);
        let at = self.clip(d);
        let w = at[3];
        if w.is_nan() || w <= 0.0 {
            return most;
        }
        let gradient = |row: usize| -> [f32; 3] {
            std::array::from_fn(|k| (self.rows[row][k] - at[row] / w * self.rows[3][k]) / w)
        };
        let (x, y) = (gradient(0), gradient(1));
        let units = (0..3).map(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            (x[i] * y[j] - x[j] * y[i]).abs() * facing[k]
        });
        let pixels = least(units.sum::<f32>() / (UNITS * UNITS) as f32, most);
        // Orthographic views have no angle: the quotient is infinite or NaN.
        let length = |v: &[f32]| v.iter().map(|v| v * v).sum::<f32>().sqrt();
        let cosine = least(w / (length(&d) * length(&self.rows[3][..3])), 1.0);
        pixels * cosine * cosine * cosine
    }
}

/// What the image shows of a box at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    /// No point of the box is nearer than this.
    pub(crate) nearest: f32,
    /// The first and the last column, and the first and the last row.
    pub(crate) columns: (i32, i32),
    pub(crate) rows: (i32, i32),
}

impl Extent {
    /// How many pixels lie in it.
    pub(super) fn pixels(&self) -> i64 {
        let side = |(first, last): (i32, i32)| i64::from(last - first + 1);
        side(self.columns) * side(self.rows)
    }
}

/// What may show of a box; `None` if it is surely outside the view.
///
/// A box counts as hidden if its nearest point is behind what has been drawn.
/// A wrong answer would lose an occluder, not hide an instance.
/// Its margins still cover the roundings, so that skipping hidden boxes changes no pixel.
#[inline(always)]
pub(super) fn extent(
    eight: impl Eight,
    lens: &Lens,
    image: &Image,
    min: Vec3,
    max: Vec3,
) -> Option<Extent> {
    extent_within(
        eight,
        lens,
        image,
        min,
        max,
        #[inline(always)]
        |row, reach| row[0].abs() * reach[0] + row[1].abs() * reach[1] + row[2].abs() * reach[2],
    )
}

/// [`extent`], where `terms` bounds the sizes of a row's first three terms anywhere in a box of
/// this reach from the eye, however its vertices are computed.
#[inline(always)]
pub(super) fn extent_within(
    eight: impl Eight,
    lens: &Lens,
    image: &Image,
    min: Vec3,
    max: Vec3,
    terms: impl Fn(&[f32; 4], &[f32; 3]) -> f32,
) -> Option<Extent> {
    const ALL: u32 = (1 << LANES) - 1;
    #[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
    let ends = three(|k| [(min[k] - lens.eye[k]) as f32, (max[k] - lens.eye[k]) as f32]);
    let at = three(|k| lanes(|i| ends[k][i >> k & 1]));
    let row = |k: usize| {
        let r = &lens.rows[k];
        lanes(|i| r[0] * at[0][i] + r[1] * at[1][i] + (r[2] * at[2][i] + r[3]))
    };
    // What the roundings of a row amount to at most, anywhere in the box.
    let reach = three(|k| ends[k][0].abs().max(ends[k][1].abs()));
    let spare = |k: usize| {
        let r = &lens.rows[k];
        (terms(r, &reach) + r[3].abs()) * ROW_MARGIN
    };
    let [x, y, n, w] = [row(0), row(1), row(2), row(3)];
    let [ex, ey, en, ew] = [spare(0), spare(1), spare(2), spare(3)];
    let half = [0, 1].map(|k: usize| image.half[k] as f32 + 2.0 * UNITS as f32);
    // Which corners are outside of each plane, and which surely need no clipping.
    let most = lanes(|i| w[i] + ew);
    let far = |k: usize, sign: f32| lanes(|i| sign * (half[k] * most[i]));
    let plus = |v: &[f32; LANES], e: f32| lanes(|i| v[i] + e);
    let is_outside = eight.greater(&far(0, -1.0), &plus(&x, ex)) == ALL
        || eight.greater(&plus(&x, -ex), &far(0, 1.0)) == ALL
        || eight.greater(&far(1, -1.0), &plus(&y, ey)) == ALL
        || eight.greater(&plus(&y, -ey), &far(1, 1.0)) == ALL
        || eight.greater(&plus(&n, -en), &most) == ALL
        || eight.greater(&[0.0; LANES], &plus(&n, en)) == ALL;
    if is_outside {
        return None;
    }
    let smallest = plus(&w, -ew);
    // NaN counts as crossing.
    let behind = eight.at_least(&smallest, &plus(&n, en))
        & eight.greater(&smallest, &[LEAST_W; LANES])
        & eight.greater(&[f32::INFINITY; LANES], &lanes(|i| x[i].abs() + y[i].abs()));
    if behind != ALL {
        let all = |side: i32| (0, side - 1);
        return Some(Extent {
            nearest: f32::MAX,
            columns: all(image.width),
            rows: all(image.height),
        });
    }
    let inverse = [lanes(|i| 1.0 / most[i]), lanes(|i| 1.0 / smallest[i])];
    let low = |v: &[f32; LANES], e: f32| {
        least_of(&lanes(|i| least((v[i] - e) * inverse[0][i], (v[i] - e) * inverse[1][i])))
    };
    let high = |v: &[f32; LANES], e: f32| {
        let v = lanes(|i| -greatest((v[i] + e) * inverse[0][i], (v[i] + e) * inverse[1][i]));
        -least_of(&v)
    };
    let (left, right, top, bottom) = (low(&x, ex), high(&x, ex), low(&y, ey), high(&y, ey));
    let nearest = greatest(0.0, high(&n, en));
    let farthest = least(1.0, least_of(&lanes(|i| n[i] * inverse[0][i])));
    // A pixel to spare on each side covers the roundings that follow.
    let spare = UNITS as f32;
    let nearest = if is_planted!(image.fault, BoxesByTheirFarthest) { farthest } else { nearest };
    Some(Extent {
        nearest: greatest(nearest, 0.0) * NEAR_MARGIN,
        columns: Image::pixels_between(image.half[0], image.width, left - spare, right + spare),
        rows: Image::pixels_between(image.half[1], image.height, top - spare, bottom + spare),
    })
}

/// More than the roundings of a vertex' row, as a share of the sum of its terms' sizes.
///
/// A vertex rounds each difference from the eye three times, and a row six times.
const ROW_MARGIN: f32 = 1e-6;

/// A few roundings of float32 above 1.
const NEAR_MARGIN: f32 = 1.0 + 1e-5;

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks along z from the origin: 100 pixels per metre at a distance of 1 m.
    fn lens(w: [f32; 4]) -> Lens {
        let units = 100.0 * UNITS as f32;
        Lens {
            rows: [[units, 0.0, 0.0, 0.0], [0.0, -units, 0.0, 0.0], [0.0, 0.0, 0.0, 0.1], w],
            eye_hi: [0.0; 3],
            eye_lo: [0.0; 3],
            eye: [0.0; 3],
            exact: [[0.0; 4]; 4],
            mirrored: false,
            leaving: None,
        }
    }

    #[test]
    fn solid_angles_by_hand() {
        let ahead = lens([0.0, 0.0, 1.0, 0.0]);
        let close = |found: f32, expected: f32| {
            assert!((found - expected).abs() < 1e-4 * expected, "{found}, not {expected}");
        };
        let wide = [0.0, 0.0, 2.0]; // 2 square metres that face the eye
        close(ahead.solid_angle(wide, [0.0, 0.0, 10.0], 1e9), 200.0);
        close(ahead.solid_angle(wide, [0.0, 0.0, 10.0], 50.0), 50.0);
        assert_eq!(ahead.solid_angle([2.0, 3.0, 0.0], [0.0, 0.0, 10.0], 1e9), 0.0);
        // 45 degrees aside: A cos / r^2 times 100^2, from the front and from the side.
        let aside = 2.0 * 0.5_f32.sqrt() / 200.0 * 1e4;
        close(ahead.solid_angle(wide, [10.0, 0.0, 10.0], 1e9), aside);
        close(ahead.solid_angle([2.0, 0.0, 0.0], [10.0, 0.0, 10.0], 1e9), aside);
        // Nothing is known of what is behind the eye, or where the eye is.
        assert_eq!(ahead.solid_angle(wide, [0.0, 0.0, -1.0], 7.0), 7.0);
        assert_eq!(ahead.solid_angle(wide, [0.0; 3], 7.0), 7.0);
        // Parallel rays: its area everywhere.
        let parallel = lens([0.0, 0.0, 0.0, 1.0]);
        close(parallel.solid_angle(wide, [5.0, 5.0, 10.0], 1e9), 2e4);
    }
}
