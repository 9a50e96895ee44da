//! Cameras in float64, on the host: the numbers that the inputs denote, before any rounding.
//!
//! A camera is four clip-space rows about an origin: `clip = rows * (p - origin, 1)`.
//! Cameras with a pose take the eye as the origin.
//! A camera a million metres from the world's origin therefore loses no precision.
//!
//! Clip space is that of Vulkan, Direct3D and WebGPU: NDC x right, y **up**, z in `0..1`.
//! Vectors are columns, and pixel (0, 0) is the top-left one.

use crate::error::{Error, Result};
use crate::host::linear::{Mat3, Mat4, Vec3, cross, dot, inverse3, mul3, normalized};
use crate::input::image::{DepthConvention, ImageSize, check_size};
use crate::input::projection::{Pose, Projection};

/// Rows whose w has other coefficients are scaled by a power of two.
const SMALLEST_UNIT: f64 = 1.0 / LARGEST_UNIT;
const LARGEST_UNIT: f64 = 18_446_744_073_709_551_616.0; // 2^64

/// A view of the world: four clip-space rows about an origin, an image size and a depth convention.
///
/// The camera denotes exactly these float64 numbers, up to a factor of all rows.
/// Everything that a cull promises is promised about them.
///
/// # Examples
/// ```
/// use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
///
/// // By name: a million metres from the world's origin, along -z.
/// let eye = [1e6, 2.0, 0.0];
/// let pose = Pose { eye, target: [1e6, 2.0, -1.0], up: [0.0, 1.0, 0.0] };
/// let convention = DepthConvention::Reversed;
/// let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention };
/// let named = Camera::look_at(&pose, &projection, ImageSize::new(640, 360))?;
/// assert_eq!(named.origin(), eye);
///
/// // By a renderer's own matrix, row by row: clip = m * (x, y, z, 1).
/// let m = [
///     [1.0, 0.0, 0.0, 0.0],
///     [0.0, 1.0, 0.0, 0.0],
///     [0.0, 0.0, 0.0, 0.1], // reversed Z with the near plane at 0.1
///     [0.0, 0.0, -1.0, 0.0], // w is the view depth along -z
/// ];
/// let camera = Camera::from_clip_from_world(m, ImageSize::new(64, 64), convention)?;
/// assert_eq!(camera.clip_from_world(), m);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Camera {
    rows: Mat4,
    origin: Vec3,
    size: ImageSize,
    convention: DepthConvention,
    /// Whether `origin` is where the camera stands; false for a bare matrix.
    posed: bool,
}

/// Cameras are equal if they denote the same numbers, whichever constructor made them.
impl PartialEq for Camera {
    fn eq(&self, other: &Self) -> bool {
        (self.rows, self.origin, self.size, self.convention)
            == (other.rows, other.origin, other.size, other.convention)
    }
}

impl Camera {
    /// A camera from clip-space rows about an origin: `clip = rows * (p - origin, 1)`.
    ///
    /// `rows` are x, y, z and w in this order; `origin` is in world units and counts as the eye.
    ///
    /// # Errors
    /// [`Error::Invalid`] for NaN or infinite entries, an empty image and singular matrices;
    /// [`Error::Limit`] for an image side above [`MAX_IMAGE_SIDE`](crate::MAX_IMAGE_SIDE).
    pub fn from_rows(
        rows: Mat4,
        origin: Vec3,
        size: ImageSize,
        convention: DepthConvention,
    ) -> Result<Self> {
        check_size(size)?;
        if let Some(bad) = rows.iter().flatten().chain(&origin).find(|x| !x.is_finite()) {
            return Err(Error::invalid(
                "camera",
                format!("expected finite matrix entries, got {bad}"),
            ));
        }
        check_regular(&rows)?;
        let mut camera = Self { rows, origin, size, convention, posed: true };
        // A factor changes no projection, but squares of extreme numbers would leave float64.
        let unit = camera.unit_of_w();
        if !(SMALLEST_UNIT..=LARGEST_UNIT).contains(&unit) {
            let scaled = camera.rows_near_one();
            if scaled.iter().flatten().all(|v| v.is_finite()) {
                camera.rows = scaled;
            }
        }
        Ok(camera)
    }

    /// A camera at `pose` that sees through `projection`; its rows are about the eye.
    ///
    /// # Errors
    /// [`Error::Invalid`], with the field's name, for an unusable pose, projection or size;
    /// [`Error::Limit`] for an image side above [`MAX_IMAGE_SIDE`](crate::MAX_IMAGE_SIDE).
    pub fn look_at(pose: &Pose, projection: &Projection, size: ImageSize) -> Result<Self> {
        let clip_from_camera = projection.clip_from_camera(size)?;
        let axes = pose.axes()?;
        Self::from_rows(
            linear_after(&clip_from_camera, &axes, [0.0; 3]),
            pose.eye,
            size,
            projection.convention(),
        )
    }

    /// A camera from one float64 matrix `clip_from_world`, row-major: `clip = m * (x, y, z, 1)`.
    ///
    /// A bare matrix does not say where the camera stands; see [`Camera::is_posed`].
    ///
    /// # Errors
    /// As [`Camera::from_rows`].
    pub fn from_clip_from_world(
        m: Mat4,
        size: ImageSize,
        convention: DepthConvention,
    ) -> Result<Self> {
        Ok(Self { posed: false, ..Self::from_rows(m, [0.0; 3], size, convention)? })
    }

    /// A camera from a projection and an affine world-to-camera matrix, both row-major.
    ///
    /// The camera's axes may be any, as long as both matrices agree on them.
    ///
    /// # Errors
    /// As [`Camera::from_rows`], and for a `camera_from_world` whose last row is not (0, 0, 0, 1)
    /// or that is singular.
    pub fn from_clip_from_camera(
        clip_from_camera: Mat4,
        camera_from_world: Mat4,
        size: ImageSize,
        convention: DepthConvention,
    ) -> Result<Self> {
        let (linear, translation) = affine_parts("camera_from_world", &camera_from_world)?;
        let inverse = inverse3(&linear).ok_or_else(|| {
            Error::invalid("camera_from_world", "expected an invertible matrix, got a singular one")
        })?;
        // The rows are about the eye as float64 rounds it; the translation keeps the remainder.
        let origin = mul3(&inverse, translation).map(|x| -x);
        let residual: Vec3 = std::array::from_fn(|i| dot(linear[i], origin) + translation[i]);
        Self::from_rows(
            linear_after(&clip_from_camera, &linear, residual),
            origin,
            size,
            convention,
        )
    }

    /// A camera from a projection and an affine camera-to-world matrix, which is the camera's pose.
    ///
    /// Both matrices are row-major, and must agree on the camera's axes.
    ///
    /// # Errors
    /// As [`Camera::from_clip_from_camera`].
    pub fn from_clip_from_camera_pose(
        clip_from_camera: Mat4,
        world_from_camera: Mat4,
        size: ImageSize,
        convention: DepthConvention,
    ) -> Result<Self> {
        let (linear, eye) = affine_parts("world_from_camera", &world_from_camera)?;
        let inverse = inverse3(&linear).ok_or_else(|| {
            Error::invalid("world_from_camera", "expected an invertible matrix, got a singular one")
        })?;
        Self::from_rows(linear_after(&clip_from_camera, &inverse, [0.0; 3]), eye, size, convention)
    }

    /// The same view in an image of another size.
    ///
    /// # Errors
    /// As [`Camera::from_rows`].
    pub fn with_size(&self, size: ImageSize) -> Result<Self> {
        Ok(Self {
            posed: self.posed,
            ..Self::from_rows(self.rows, self.origin, size, self.convention)?
        })
    }

    /// The image's size in pixels.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// Which end of the NDC depth range is far.
    pub fn convention(&self) -> DepthConvention {
        self.convention
    }

    /// The clip-space rows x, y, z, w about [`Camera::origin`].
    ///
    /// They are as given, up to a power of two where w's coefficients leave 2^-64 to 2^64.
    pub fn rows(&self) -> Mat4 {
        self.rows
    }

    /// The point that the rows are about, in world units; the eye of a camera with a pose.
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Whether [`Camera::origin`] is where the camera stands; a bare matrix does not say that.
    pub fn is_posed(&self) -> bool {
        self.posed
    }

    /// Whether the rays are parallel: w is the same everywhere.
    pub(crate) fn is_orthographic(&self) -> bool {
        self.rows[3][..3] == [0.0; 3]
    }

    /// The rows times the power of two that brings w into `[1, 2)`.
    ///
    /// That is w's constant for an orthographic camera, and w's largest coefficient otherwise.
    /// The scale changes no comparison.
    /// It has to come first, because products with tiny rows would lose bits below float64's range.
    pub(crate) fn rows_near_one(&self) -> Mat4 {
        let unit = self.unit_of_w();
        // log2 may be off by an ulp at a power of two.
        // w then lies marginally outside of [1, 2), which no bound depends on.
        // A subnormal unit makes the scale infinite, and rows with infinities are refused later.
        let scale = 2.0_f64.powf(unit.log2().floor()).recip();
        self.rows.map(|row| row.map(|v| v * scale))
    }

    /// w's constant for an orthographic camera, and w's largest coefficient otherwise.
    fn unit_of_w(&self) -> f64 {
        let w = self.rows[3];
        if self.is_orthographic() {
            w[3].abs()
        } else {
            w[..3].iter().fold(0.0_f64, |m, v| m.max(v.abs()))
        }
    }

    /// The row-major float64 matrix about the world's origin, rounded: `clip = m * (x, y, z, 1)`.
    pub fn clip_from_world(&self) -> Mat4 {
        self.rows.map(|r| [r[0], r[1], r[2], r[3] - dot([r[0], r[1], r[2]], self.origin)])
    }
}

/// Refuses matrices that squash the world to a plane, where no depth test has a meaning.
fn check_regular(rows: &Mat4) -> Result<()> {
    let linear = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
    let third = if linear(3) == [0.0; 3] { 2 } else { 3 };
    let unit = [linear(0), linear(1), linear(third)].map(normalized);
    let regular = match unit {
        [Some(x), Some(y), Some(t)] => dot(cross(x, y), t).abs() > 1e-12,
        _ => false,
    };
    if regular && (third == 3 || rows[3][3] != 0.0) {
        Ok(())
    } else {
        Err(Error::invalid("camera", "expected an invertible projection, got a singular matrix"))
    }
}

/// `p * [linear | translation]`, where the second factor is affine.
fn linear_after(p: &Mat4, linear: &Mat3, translation: Vec3) -> Mat4 {
    p.map(|r| {
        let head = [r[0], r[1], r[2]];
        let column = |c: usize| dot(head, [linear[0][c], linear[1][c], linear[2][c]]);
        [column(0), column(1), column(2), dot(head, translation) + r[3]]
    })
}

fn affine_parts(name: &str, m: &Mat4) -> Result<(Mat3, Vec3)> {
    if m[3] != [0.0, 0.0, 0.0, 1.0] {
        return Err(Error::invalid(
            name,
            format!("expected an affine matrix with last row (0, 0, 0, 1), got {:?}", m[3]),
        ));
    }
    if let Some(bad) = m.iter().flatten().find(|x| !x.is_finite()) {
        return Err(Error::invalid(name, format!("expected finite entries, got {bad}")));
    }
    Ok((std::array::from_fn(|i| [m[i][0], m[i][1], m[i][2]]), std::array::from_fn(|i| m[i][3])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::linear::sub;

    const SIZE: ImageSize = ImageSize { width: 4, height: 2 };

    fn forward_camera(convention: DepthConvention, far: Option<f64>) -> Camera {
        // At (10, 20, 30), looking along -z, so view depth is 30 - z.
        let pose = Pose { eye: [10.0, 20.0, 30.0], target: [10.0, 20.0, 0.0], up: [0.0, 5.0, 0.0] };
        let projection = Projection::Perspective {
            fov_y: std::f64::consts::FRAC_PI_2,
            near: 1.0,
            far,
            convention,
        };
        Camera::look_at(&pose, &projection, SIZE).unwrap()
    }

    fn clip(camera: &Camera, p: Vec3) -> [f64; 4] {
        let d = sub(p, camera.origin());
        camera.rows().map(|r| dot([r[0], r[1], r[2]], d) + r[3])
    }

    #[test]
    fn look_at_maps_hand_worked_points() {
        let camera = forward_camera(DepthConvention::Standard, Some(3.0));
        // One unit right and up at view depth 2: ndc x = 1 / (2 * aspect 2) = 0.25, y = 1/2.
        let [x, y, z, w] = clip(&camera, [11.0, 21.0, 28.0]);
        assert!(
            (w - 2.0).abs() < 1e-12 && (x / w - 0.25).abs() < 1e-12 && (y / w - 0.5).abs() < 1e-12
        );
        // depth (f - f n / z) / (f - n) = (3 - 3 / 2) / 2
        assert!((z / w - 0.75).abs() < 1e-12);
        for (convention, at_near) in
            [(DepthConvention::Standard, 0.0), (DepthConvention::Reversed, 1.0)]
        {
            for far in [Some(3.0), None] {
                let [.., z, w] = clip(&forward_camera(convention, far), [10.0, 20.0, 29.0]);
                assert!((z / w - at_near).abs() < 1e-12, "{convention:?} {far:?}");
            }
        }
    }

    #[test]
    fn poses_and_their_inverses_denote_the_same_camera() {
        let p = Projection::Perspective {
            fov_y: 1.0,
            near: 0.1,
            far: None,
            convention: DepthConvention::Reversed,
        };
        let p = p.clip_from_camera(SIZE).unwrap();
        // A rotation by 90 degrees about y and a translation; the inverse is written down by hand.
        let pose = [
            [0.0, 0.0, 1.0, 5.0],
            [0.0, 1.0, 0.0, 6.0],
            [-1.0, 0.0, 0.0, 7.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let inverse = [
            [0.0, 0.0, -1.0, 7.0],
            [0.0, 1.0, 0.0, -6.0],
            [1.0, 0.0, 0.0, -5.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let a =
            Camera::from_clip_from_camera_pose(p, pose, SIZE, DepthConvention::Reversed).unwrap();
        let b = Camera::from_clip_from_camera(p, inverse, SIZE, DepthConvention::Reversed).unwrap();
        assert_eq!(a.origin(), [5.0, 6.0, 7.0]);
        for point in [[1.0, 2.0, 3.0], [9.0, 6.0, 7.5]] {
            for (x, y) in clip(&a, point).iter().zip(clip(&b, point)) {
                assert!((x - y).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn who_looks_along_up_is_told_a_direction_that_works() {
        let camera = |target: Vec3, up: Vec3| {
            let good = Projection::Perspective {
                fov_y: 1.0,
                near: 0.1,
                far: None,
                convention: DepthConvention::Reversed,
            };
            Camera::look_at(&Pose { eye: [0.0; 3], target, up }, &good, SIZE)
        };
        for (target, up, said, other) in [
            ([0.0, -1.0, 0.0], [0.0, 1.0, 0.0], "(0, 0, -1)", [0.0, 0.0, -1.0]),
            ([0.0, 0.0, -3.0], [0.0, 0.0, 2.0], "(0, 1, 0)", [0.0, 1.0, 0.0]),
            ([5.0, 0.0, 0.0], [-1.0, 0.0, 0.0], "(0, 0, 1)", [0.0, 0.0, 1.0]),
        ] {
            let text = camera(target, up).unwrap_err().to_string();
            assert!(text.contains(&format!("such as {said} or the camera's heading")), "{text}");
            assert!(camera(target, other).is_ok(), "{said}");
        }
    }

    #[test]
    fn unusable_cameras_are_refused_by_name() {
        let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
        let good = Projection::Perspective {
            fov_y: 1.0,
            near: 0.1,
            far: None,
            convention: DepthConvention::Reversed,
        };
        let message = |pose: &Pose, projection: &Projection, size| {
            Camera::look_at(pose, projection, size).unwrap_err().to_string()
        };
        assert!(message(&Pose { target: [0.0; 3], ..pose }, &good, SIZE).starts_with("target:"));
        assert!(message(&Pose { up: [0.0, 0.0, 2.0], ..pose }, &good, SIZE).starts_with("up:"));
        assert!(message(&Pose { eye: [f64::NAN; 3], ..pose }, &good, SIZE).starts_with("eye:"));
        assert!(message(&pose, &good, ImageSize::new(0, 1)).starts_with("size:"));
        assert!(message(&pose, &good, ImageSize::new(32_769, 1)).contains("32768"));
        let bad = |fov_y, near, far| Projection::Perspective {
            fov_y,
            near,
            far,
            convention: DepthConvention::Standard,
        };
        assert!(message(&pose, &bad(0.0, 0.1, None), SIZE).starts_with("fov_y:"));
        assert!(message(&pose, &bad(1.0, 0.0, None), SIZE).starts_with("near:"));
        assert!(message(&pose, &bad(1.0, 1.0, Some(1.0)), SIZE).starts_with("far:"));
        let error = Camera::from_clip_from_world([[0.0; 4]; 4], SIZE, DepthConvention::Standard)
            .unwrap_err();
        assert!(error.to_string().contains("singular"));
    }
}
