//! The pose of a camera, and the projection from camera space to clip space.

use crate::error::{Error, Result};
use crate::host::linear::Mat4;
use crate::host::linear::{Mat3, Vec3, cross, dot, normalized, sub};
use crate::input::image::DepthConvention;
use crate::input::image::ImageSize;
use crate::input::image::check_size;

/// Where a camera stands and what it looks at, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The centre of projection; for an orthographic camera the point at view depth 0 on the axis.
    pub eye: Vec3,
    /// A point that appears on the optical axis; it must differ from `eye`.
    pub target: Vec3,
    /// A direction that appears upwards, of any length but 0 and not parallel to `target - eye`.
    ///
    /// To look straight down, pass what should be at the top of the image, such as the heading.
    pub up: Vec3,
}

impl Pose {
    /// The camera's axes in the world: orthonormal rows right, up and forward.
    ///
    /// # Errors
    /// [`Error::Invalid`] for numbers that are not finite, and for zero or parallel directions.
    pub(super) fn axes(&self) -> Result<Mat3> {
        for (name, v) in [("eye", self.eye), ("target", self.target), ("up", self.up)] {
            if !v.iter().all(|x| x.is_finite()) {
                return Err(Error::invalid(name, format!("expected finite numbers, got {v:?}")));
            }
        }
        let towards = sub(self.target, self.eye);
        if !towards.iter().all(|x| x.is_finite()) {
            return Err(Error::invalid(
                "target",
                "expected a point whose difference to eye float64 can hold",
            ));
        }
        let forward = normalized(towards).ok_or_else(|| {
            Error::invalid(
                "target",
                format!("expected a point apart from eye, got {:?} for both", self.eye),
            )
        })?;
        let up = normalized(self.up)
            .ok_or_else(|| Error::invalid("up", "expected a direction, got a zero vector"))?;
        let right = cross(forward, up);
        // For a smaller sine of their angle the image would rotate with the input's last bits.
        if dot(right, right) < 1e-20 {
            return Err(Error::invalid(
                "up",
                format!(
                    "expected a direction that is not parallel to target - eye, got {:?}; pass \
                     what shall be at the top of the image, such as {} or the camera's heading",
                    self.up,
                    across(self.up)
                ),
            ));
        }
        let right = normalized(right)
            .ok_or_else(|| Error::invalid("up", "expected a direction apart from target - eye"))?;
        Ok([right, cross(right, forward), forward])
    }
}

/// An axis across `up`, to suggest as the top of the image when a camera looks along `up`.
///
/// It follows the usual orientation of worlds with that up axis.
pub(crate) fn across(up: Vec3) -> &'static str {
    let [x, y, z] = up.map(f64::abs);
    if y >= x && y >= z {
        "(0, 0, -1)" // y is up, and cameras look along -z at rest
    } else if z >= x {
        "(0, 1, 0)" // z is up, and y is north
    } else {
        "(0, 0, 1)"
    }
}

/// How camera space becomes clip space.
///
/// In camera space x points right, y up and z **forward**, so view depth is positive in front.
/// Lengths are in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// A centred perspective with square pixels.
    ///
    /// The horizontal field of view follows from the aspect ratio of the image.
    Perspective {
        /// Vertical field of view in radians, in (0, pi).
        fov_y: f64,
        /// View depth of the near plane, > 0 and finite.
        near: f64,
        /// View depth of the far plane, > near; `None` or infinity: infinitely far.
        far: Option<f64>,
        /// Which end of the depth range is far.
        convention: DepthConvention,
    },
    /// An off-centre perspective.
    ///
    /// The borders of the image are given as tangents, that is as coordinates at view depth 1.
    Frustum {
        /// Tangent of the left border, negative to the left of the axis.
        left: f64,
        /// Tangent of the right border, > left.
        right: f64,
        /// Tangent of the bottom border.
        bottom: f64,
        /// Tangent of the top border, > bottom.
        top: f64,
        /// View depth of the near plane, > 0 and finite.
        near: f64,
        /// View depth of the far plane, > near; `None` or infinity: infinitely far.
        far: Option<f64>,
        /// Which end of the depth range is far.
        convention: DepthConvention,
    },
    /// A parallel projection with borders in world units.
    Orthographic {
        /// Left border.
        left: f64,
        /// Right border, > left.
        right: f64,
        /// Bottom border.
        bottom: f64,
        /// Top border, > bottom.
        top: f64,
        /// View depth of the near plane, finite; it may be negative.
        near: f64,
        /// View depth of the far plane, finite and > near.
        far: f64,
        /// Which end of the depth range is far.
        convention: DepthConvention,
    },
}

impl Projection {
    /// Which end of the depth range is far.
    pub fn convention(&self) -> DepthConvention {
        match *self {
            Self::Perspective { convention, .. }
            | Self::Frustum { convention, .. }
            | Self::Orthographic { convention, .. } => convention,
        }
    }

    /// The clip-space rows x, y, z, w for camera space (x right, y up, z forward).
    ///
    /// `size` is that of the image; its aspect ratio matters for [`Projection::Perspective`] alone.
    /// NDC depth is in `0..1`, in the convention of the projection.
    ///
    /// # Errors
    /// [`Error::Invalid`] for borders, angles or planes out of range, and for an empty image;
    /// [`Error::Limit`] for an image side above [`MAX_IMAGE_SIDE`](crate::MAX_IMAGE_SIDE).
    pub fn clip_from_camera(&self, size: ImageSize) -> Result<Mat4> {
        check_size(size)?;
        match *self {
            Self::Perspective { fov_y, near, far, convention } => {
                if !(fov_y > 0.0 && fov_y < std::f64::consts::PI) {
                    return Err(Error::invalid(
                        "fov_y",
                        format!(
                            "expected an angle in (0, 180) degrees, got {}",
                            fov_y.to_degrees()
                        ),
                    ));
                }
                let top = (fov_y / 2.0).tan();
                let right = top * f64::from(size.width) / f64::from(size.height);
                let [z, w] = perspective_depth(near, far, convention)?;
                Ok([[1.0 / right, 0.0, 0.0, 0.0], [0.0, 1.0 / top, 0.0, 0.0], z, w])
            }
            Self::Frustum { left, right, bottom, top, near, far, convention } => {
                check_borders(left, right, bottom, top)?;
                let [z, w] = perspective_depth(near, far, convention)?;
                let (dx, dy) = (right - left, top - bottom);
                Ok([
                    [2.0 / dx, 0.0, -(right + left) / dx, 0.0],
                    [0.0, 2.0 / dy, -(top + bottom) / dy, 0.0],
                    z,
                    w,
                ])
            }
            Self::Orthographic { left, right, bottom, top, near, far, convention } => {
                check_borders(left, right, bottom, top)?;
                if !(near.is_finite() && far.is_finite() && near < far) {
                    return Err(Error::invalid(
                        "far",
                        format!("expected a finite plane beyond near = {near}, got {far}"),
                    ));
                }
                let (dx, dy, dz) = (right - left, top - bottom, far - near);
                let z = match convention {
                    DepthConvention::Standard => [0.0, 0.0, 1.0 / dz, -near / dz],
                    DepthConvention::Reversed => [0.0, 0.0, -1.0 / dz, far / dz],
                };
                Ok([
                    [2.0 / dx, 0.0, 0.0, -(right + left) / dx],
                    [0.0, 2.0 / dy, 0.0, -(top + bottom) / dy],
                    z,
                    [0.0, 0.0, 0.0, 1.0],
                ])
            }
        }
    }
}

/// The z and w rows of a perspective, where w is view depth.
fn perspective_depth(
    near: f64,
    far: Option<f64>,
    convention: DepthConvention,
) -> Result<[[f64; 4]; 2]> {
    if !(near.is_finite() && near > 0.0) {
        return Err(Error::invalid(
            "near",
            format!("expected a finite view depth > 0, got {near}"),
        ));
    }
    let far = far.filter(|f| *f != f64::INFINITY);
    if let Some(far) = far
        && !(far.is_finite() && far > near)
    {
        return Err(Error::invalid(
            "far",
            format!("expected a view depth beyond near = {near}, or none, got {far}"),
        ));
    }
    let (slope, constant) = match (convention, far) {
        (DepthConvention::Standard, Some(f)) => (f / (f - near), -f * near / (f - near)),
        (DepthConvention::Standard, None) => (1.0, -near),
        (DepthConvention::Reversed, Some(f)) => (-near / (f - near), f * near / (f - near)),
        (DepthConvention::Reversed, None) => (0.0, near),
    };
    Ok([[0.0, 0.0, slope, constant], [0.0, 0.0, 1.0, 0.0]])
}

fn check_borders(left: f64, right: f64, bottom: f64, top: f64) -> Result<()> {
    if !(left.is_finite() && right.is_finite() && left < right) {
        return Err(Error::invalid(
            "right",
            format!("expected a finite border beyond left = {left}, got {right}"),
        ));
    }
    if !(bottom.is_finite() && top.is_finite() && bottom < top) {
        return Err(Error::invalid(
            "top",
            format!("expected a finite border beyond bottom = {bottom}, got {top}"),
        ));
    }
    Ok(())
}
