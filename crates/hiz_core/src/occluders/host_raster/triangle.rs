//! From three vertices to a triangle in the image: exact edges, and the plane of its depth.

use crate::host::linear::sub;
use crate::input::mesh::FaceCull;
use crate::occluders::host_raster::lanes::{greatest, least, three};
use crate::occluders::host_raster::lens::{Image, UNITS, rounded};
use crate::occluders::host_raster::planted_fault::is_planted;

/// Planes that rise more from pixel to pixel are no planes.
/// Sums over a tile stay finite below.
const STEEPEST: f32 = 1e30;

const PER_PIXEL: f64 = UNITS as f64;

/// A vertex in the image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    /// In units, about the image's middle.
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) nearness: f32,
}

/// A triangle in the image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangle {
    /// Corners on the grid, in units from the image's top left corner, such that the area is
    /// positive.
    pub(super) x: [i32; 3],
    pub(super) y: [i32; 3],
    /// Nearness at corner 0 as it lies on the grid.
    pub(super) nearness: f32,
    /// How nearness grows from pixel to pixel, to the right and downwards.
    pub(super) slope: [f32; 2],
    /// The nearness of the nearest corner, which no pixel exceeds.
    pub(super) nearest: f32,
}

impl Triangle {
    /// Takes coverage from the corners on the grid, and depth from those that were not rounded.
    ///
    /// A plane through rounded corners would be 50 to 90 times as wrong.
    /// `None` for a triangle without an area, and for a face that does not occlude.
    #[inline(always)]
    pub(super) fn new(corners: [Corner; 3], culled: FaceCull, image: &Image) -> Option<Self> {
        let x = three(|k| rounded(corners[k].x) + image.half[0]);
        let y = three(|k| rounded(corners[k].y) + image.half[1]);
        let area = i64::from(x[1] - x[0]) * i64::from(y[2] - y[0])
            - i64::from(y[1] - y[0]) * i64::from(x[2] - x[0]);
        if area == 0 {
            return None;
        }
        // In float64 the products are exact, so that thin triangles keep their slope.
        let [mut a, mut b, mut c] = three(|k| {
            let Corner { x, y, nearness } = corners[k];
            [f64::from(x), f64::from(y), f64::from(nearness)]
        });
        if is_planted!(image.fault, PlaneOfRoundedCorners) {
            for (k, corner) in [&mut a, &mut b, &mut c].into_iter().enumerate() {
                corner[0] = f64::from(x[k] - image.half[0]);
                corner[1] = f64::from(y[k] - image.half[1]);
            }
        }
        let [ax, ay, u] = sub(b, a);
        let [bx, by, v] = sub(c, a);
        let exact_area = ax * by - ay * bx;
        // Rounding the corners turns some thin triangles round, so it has no say in this.
        // Rows run downwards, so what is counter-clockwise with y up has a negative area here.
        let turned =
            if is_planted!(image.fault, FacingOfRoundedCorners) { area as f64 } else { exact_area };
        let is_culled = match culled {
            FaceCull::None => false,
            FaceCull::Back => turned > 0.0,
            FaceCull::Front => turned < 0.0,
        };
        if is_culled {
            return None;
        }
        let slope = [(u * by - v * ay) / exact_area, (v * ax - u * bx) / exact_area];
        let moved =
            [f64::from(x[0] - image.half[0]) - a[0], f64::from(y[0] - image.half[1]) - a[1]];
        let nearness = a[2] + slope[0] * moved[0] + slope[1] * moved[1];
        #[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
        let nearness = nearness as f32;
        #[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
        let slope = [(slope[0] * PER_PIXEL) as f32, (slope[1] * PER_PIXEL) as f32];
        // With corners on a line there is no plane; then the farthest corner counts.
        let is_plane = slope[0].abs() + slope[1].abs() < STEEPEST && nearness.is_finite();
        let depths = three(|k| corners[k].nearness);
        let farthest = least(least(depths[0], depths[1]), depths[2]);
        let nearest = greatest(greatest(depths[0], depths[1]), depths[2]);
        let most = if is_planted!(image.fault, NoCap) { f32::MAX } else { nearest };
        let (nearness, slope, nearest) =
            if is_plane { (nearness, slope, most) } else { (farthest, [0.0; 2], farthest) };
        let (x, y) = if area > 0 { (x, y) } else { ([x[0], x[2], x[1]], [y[0], y[2], y[1]]) };
        Some(Self { x, y, nearness, slope, nearest })
    }
}

/// A vertex of a triangle that is clipped.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    /// Clip coordinates as in [`Lens::rows`](super::lens::Lens::rows), in float64.
    pub(super) clip: [f64; 4],
    /// Its place in the image, if it is a vertex inside of all planes.
    ///
    /// Its neighbours that need no clipping use the same place, so no gap opens between them.
    pub(super) projected: Option<Corner>,
}

impl End {
    /// How far inside of a plane it is; negative outside.
    fn inside(&self, plane: &[f64; 4]) -> f64 {
        let inside = (0..4).map(|k| plane[k] * self.clip[k]).sum::<f64>();
        // What float32 has found to be inside counts as such.
        if self.projected.is_some() { inside.max(0.0) } else { inside }
    }

    /// Where the edge to `other` crosses a plane, given how far inside of it both are.
    ///
    /// The ends are ordered, so that both triangles of an edge are cut at the same point.
    fn cut(&self, inside: f64, other: &Self, other_inside: f64) -> Self {
        let (a, da, b, db) = if inside < other_inside {
            (self, inside, other, other_inside)
        } else {
            (other, other_inside, self, inside)
        };
        let t = da / (da - db);
        let clip = std::array::from_fn(|k| a.clip[k] + t * (b.clip[k] - a.clip[k]));
        Self { clip, projected: None }
    }

    /// Its place in the image; `None` if float64 cannot tell.
    #[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
    fn corner(&self, largest: f64, guard: [f64; 2]) -> Option<Corner> {
        /// Beyond this ratio of a triangle's size to w, roundings would show in the image.
        const MOST: f64 = 8_589_934_592.0; // 2^33
        if let Some(corner) = self.projected {
            return Some(corner);
        }
        let [x, y, n, w] = self.clip;
        let place = [x / w, y / w, n / w];
        let is_certain = w > 0.0 && w * MOST >= largest;
        (is_certain && place.iter().all(|v| v.is_finite())).then(|| Corner {
            x: place[0].clamp(-guard[0], guard[0]) as f32,
            y: place[1].clamp(-guard[1], guard[1]) as f32,
            nearness: place[2].clamp(-1e30, 1.0) as f32,
        })
    }
}

/// Clips a triangle against the near plane and the guard band (Sutherland and Hodgman 1974), and
/// hands out what is left of it.
#[cold]
pub(super) fn clipped(
    ends: [End; 3],
    culled: FaceCull,
    image: &Image,
    mut out: impl FnMut(&Triangle),
) {
    /// A plane adds a corner, or a half of them where rounding has bent the polygon.
    const MOST: usize = 24;
    let guard @ [gx, gy] = image.guard.map(f64::from);
    // The planes as rows: inside of them the product with a point is not negative.
    let planes = [
        [0.0, 0.0, -1.0, 1.0],
        [-1.0, 0.0, 0.0, gx],
        [1.0, 0.0, 0.0, gx],
        [0.0, -1.0, 0.0, gy],
        [0.0, 1.0, 0.0, gy],
    ];
    let mut largest = 0.0;
    for end in &ends {
        let [x, y, n, w] = end.clip.map(f64::abs);
        let size = (x / gx).max(y / gy) + n + w;
        // Positions that are not finite leave nothing to draw.
        largest = if size.is_finite() { size.max(largest) } else { f64::INFINITY };
    }
    let (mut polygon, mut count) = ([ends[0]; MOST], 3);
    polygon[..3].copy_from_slice(&ends);
    for plane in planes {
        if polygon[..count].iter().all(|end| end.inside(&plane) >= 0.0) {
            continue;
        }
        let (mut next, mut left) = ([ends[0]; MOST], 0);
        for i in 0..count {
            let (a, b) = (polygon[i], polygon[(i + 1) % count]);
            let (da, db) = (a.inside(&plane), b.inside(&plane));
            if da >= 0.0 {
                next[left] = a;
                left += 1;
            }
            if (da >= 0.0) != (db >= 0.0) {
                next[left] = a.cut(da, &b, db);
                left += 1;
            }
        }
        (polygon, count) = (next, left);
        if count < 3 {
            return;
        }
    }
    let corners = polygon.map(|end| end.corner(largest, guard));
    for i in 1..count - 1 {
        let [Some(a), Some(b), Some(c)] = [corners[0], corners[i], corners[i + 1]] else {
            continue;
        };
        if let Some(triangle) = Triangle::new([a, b, c], culled, image) {
            out(&triangle);
        }
    }
}
