//! From three vertices to a triangle in the image: exact edges, and the plane of its depth.

use crate::host::linear::sub;
use crate::input::mesh::FaceCull;
use crate::occluders::host_raster::lens::{Image, UNITS, greatest, least, rounded};

/// Planes that rise more from pixel to pixel are no planes.
/// Sums over a tile stay finite below.
const STEEPEST: f32 = 1e30;

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
        let x = corners.map(|c| rounded(c.x) + image.half[0]);
        let y = corners.map(|c| rounded(c.y) + image.half[1]);
        let area = i64::from(x[1] - x[0]) * i64::from(y[2] - y[0])
            - i64::from(y[1] - y[0]) * i64::from(x[2] - x[0]);
        // Rows run downwards, so what is counter-clockwise with y up has a negative area here.
        let is_culled = match culled {
            FaceCull::None => false,
            FaceCull::Back => area > 0,
            FaceCull::Front => area < 0,
        };
        if area == 0 || is_culled {
            return None;
        }
        // In float64 the products are exact, so that thin triangles keep their slope.
        let [a, b, c] = corners.map(|c| [c.x, c.y, c.nearness].map(f64::from));
        let [ax, ay, u] = sub(b, a);
        let [bx, by, v] = sub(c, a);
        let exact_area = ax * by - ay * bx;
        let slope = [(u * by - v * ay) / exact_area, (v * ax - u * bx) / exact_area];
        let moved =
            [f64::from(x[0] - image.half[0]) - a[0], f64::from(y[0] - image.half[1]) - a[1]];
        let nearness = a[2] + slope[0] * moved[0] + slope[1] * moved[1];
        #[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
        let (nearness, slope) = (nearness as f32, slope.map(|v| (v * f64::from(UNITS)) as f32));
        // With corners on a line there is no plane; then the farthest corner counts.
        let is_plane = slope[0].abs() + slope[1].abs() < STEEPEST && nearness.is_finite();
        let depths = corners.map(|c| c.nearness);
        let farthest = least(least(depths[0], depths[1]), depths[2]);
        let nearest = greatest(greatest(depths[0], depths[1]), depths[2]);
        let (nearness, slope, nearest) =
            if is_plane { (nearness, slope, nearest) } else { (farthest, [0.0; 2], farthest) };
        let (x, y) = if area > 0 { (x, y) } else { ([x[0], x[2], x[1]], [y[0], y[2], y[1]]) };
        Some(Self { x, y, nearness, slope, nearest })
    }
}

/// Clips a triangle against the near plane and the guard band (Sutherland and Hodgman 1974), and
/// hands out what is left of it.
///
/// `clip` are clip coordinates as in [`Lens::rows`].
#[cold]
pub(super) fn clipped(
    clip: [[f32; 4]; 3],
    culled: FaceCull,
    image: &Image,
    mut out: impl FnMut(&Triangle),
) {
    /// At most three corners and one more for each plane.
    const MOST: usize = 8;
    let [gx, gy] = image.guard.map(f64::from);
    // The planes as rows: inside of them the product with a point is not negative.
    let planes = [
        [0.0, 0.0, -1.0, 1.0],
        [-1.0, 0.0, 0.0, gx],
        [1.0, 0.0, 0.0, gx],
        [0.0, -1.0, 0.0, gy],
        [0.0, 1.0, 0.0, gy],
    ];
    let (mut polygon, mut count) = ([[0.0; 4]; MOST], 3);
    for (corner, clip) in polygon.iter_mut().zip(clip) {
        *corner = clip.map(f64::from);
    }
    for plane in planes {
        let inside = |p: &[f64; 4]| (0..4).map(|k| plane[k] * p[k]).sum::<f64>();
        let (mut next, mut left) = ([[0.0; 4]; MOST], 0);
        for i in 0..count {
            let (a, b) = (polygon[i], polygon[(i + 1) % count]);
            let (da, db) = (inside(&a), inside(&b));
            if da >= 0.0 {
                next[left] = a;
                left += 1;
            }
            if (da >= 0.0) != (db >= 0.0) {
                next[left] = cut(a, da, b, db);
                left += 1;
            }
        }
        (polygon, count) = (next, left);
        if count < 3 {
            return;
        }
    }
    #[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
    let corner = |p: [f64; 4]| Corner {
        x: (p[0] / p[3]) as f32,
        y: (p[1] / p[3]) as f32,
        nearness: (p[2] / p[3]) as f32,
    };
    for i in 1..count - 1 {
        let corners = [polygon[0], polygon[i], polygon[i + 1]].map(corner);
        // The apex of the view, w = 0, is inside of every plane and has no place in the image.
        if corners.iter().any(|c| !c.x.is_finite() || !c.y.is_finite() || !c.nearness.is_finite()) {
            continue;
        }
        if let Some(triangle) = Triangle::new(corners, culled, image) {
            out(&triangle);
        }
    }
}

/// Where the edge between two points crosses a plane, given how far inside of it they are.
///
/// The ends are ordered, so that both triangles of an edge are cut at the same point.
fn cut(a: [f64; 4], da: f64, b: [f64; 4], db: f64) -> [f64; 4] {
    let (a, da, b, db) = if da < db { (a, da, b, db) } else { (b, db, a, da) };
    let t = da / (da - db);
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}
