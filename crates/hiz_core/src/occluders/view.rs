//! A camera as meshes are drawn with it: clip-space rows about the eye, in each mesh's own space.
//!
//! A rasteriser works in float32.
//! It subtracts the eye from a vertex before it rounds, so that a wall a million metres from the
//! origin does not tremble.
//! The matrix of a place is multiplied into the rows in float64, once for each copy and frame.

use crate::error::Result;
use crate::host::linear::{Mat4, Vec3, dot, sub};
use crate::host::rounding::{flushed, split3};
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::input::view::reference_point;
use crate::occluders::placement::{Placement, box_corner};
use crate::occluders::shapes::Mesh;

/// A camera, scaled so that w is near 1, with the point that rows are taken about.
#[derive(Debug)]
pub(super) struct View {
    rows: Mat4,
    origin: Vec3,
    point: Vec3,
}

/// The same camera in the space of one copy of a mesh: `clip = rows * (p - eye, 1)`.
#[derive(Debug)]
pub(super) struct PlacedView {
    /// In float64.
    pub(super) exact: Mat4,
    /// The eye, in mesh coordinates; for parallel rays the point of reference.
    pub(super) eye: Vec3,
    /// The rows in float32.
    pub(super) rows: [[f32; 4]; 4],
    /// The eye is exactly `eye_hi + eye_lo`.
    pub(super) eye_hi: [f32; 3],
    pub(super) eye_lo: [f32; 3],
}

impl View {
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for a camera that float32 cannot hold.
    pub(super) fn new(camera: &Camera) -> Result<Self> {
        let point = reference_point(camera)?;
        Ok(Self { rows: camera.rows_near_one(), origin: camera.origin(), point })
    }

    /// The camera in the space of one copy of `mesh`.
    pub(super) fn placed(&self, mesh: &Mesh, placement: &Placement) -> PlacedView {
        // A flattening matrix has no point of the mesh at the eye; any other is valid.
        let near = placement.mesh_point(self.point).unwrap_or(mesh.min);
        let (eye_hi, eye_lo) = split3(near);
        let eye: Vec3 = std::array::from_fn(|k| f64::from(eye_hi[k]) + f64::from(eye_lo[k]));
        let from_origin = sub(placement.world(eye), self.origin);
        let exact = self.rows.map(|row| {
            let linear = [row[0], row[1], row[2]];
            let along = |k: usize| match &placement.matrix {
                None => linear[k],
                Some(m) => dot(linear, [m[k], m[4 + k], m[8 + k]]),
            };
            [along(0), along(1), along(2), dot(linear, from_origin) + row[3]]
        });
        #[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
        let rows = exact.map(|row| row.map(|v| flushed(v as f32)));
        PlacedView { exact, eye, rows, eye_hi, eye_lo }
    }
}

impl PlacedView {
    /// Whether a box is outside one plane of the frustum.
    ///
    /// float64 without a proof is enough.
    /// A part kept wrongly costs time; a part dropped wrongly is a lost occluder, not a false cull.
    pub(super) fn is_outside(&self, min: Vec3, max: Vec3) -> bool {
        let clip: [[f64; 4]; 8] = std::array::from_fn(|corner| {
            let d = sub(box_corner(min, max, corner), self.eye);
            self.exact.map(|r| dot([r[0], r[1], r[2]], d) + r[3])
        });
        let all = |f: &dyn Fn(&[f64; 4]) -> f64| {
            clip.iter().all(|c| f(c) < -1e-9 * c.iter().fold(0.0_f64, |m, v| m.max(v.abs())))
        };
        all(&|c| c[0] + c[3])
            || all(&|c| c[3] - c[0])
            || all(&|c| c[1] + c[3])
            || all(&|c| c[3] - c[1])
            || all(&|c| c[2])
            || all(&|c| c[3] - c[2])
    }

    /// The pixels around a box, `[x0, y0, x1, y1]`; the whole image where it crosses the eye's
    /// plane.
    pub(super) fn rectangle(&self, min: Vec3, max: Vec3, size: ImageSize) -> [u32; 4] {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let sides = [size.width, size.height];
        for corner in 0..8 {
            let d = sub(box_corner(min, max, corner), self.eye);
            let [x, y, _, w] = self.exact.map(|r| dot([r[0], r[1], r[2]], d) + r[3]);
            if w.is_nan() || w <= 0.0 {
                return [0, 0, size.width - 1, size.height - 1];
            }
            for (k, ndc) in [x / w, -y / w].into_iter().enumerate() {
                let pixel = (ndc + 1.0) * f64::from(sides[k]) / 2.0;
                low[k] = low[k].min(pixel);
                high[k] = high[k].max(pixel);
            }
        }
        // A pixel to spare on each side covers what drivers round.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let pixel = |v: f64, k: usize| v.clamp(0.0, f64::from(sides[k] - 1)) as u32;
        [
            pixel(low[0] - 1.0, 0),
            pixel(low[1] - 1.0, 1),
            pixel(high[0] + 1.0, 0),
            pixel(high[1] + 1.0, 1),
        ]
    }
}
