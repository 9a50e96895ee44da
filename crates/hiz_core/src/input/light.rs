//! Lights whose shadow casters are culled.

use std::f64::consts::FRAC_PI_6;

use crate::error::{Error, Result};
use crate::host::linear::{Vec3, normalized};

/// The widest light, in radians: 30 degrees.
/// Every light up to that leaves a box through some face, whatever its direction.
const WIDEST: f64 = FRAC_PI_6;

/// A larger coordinate or length would not fit the float32 numbers of a cull.
const LARGEST: f64 = 1_152_921_504_606_846_976.0; // 2^60

/// A light at infinity, such as the sun, and what can receive its shadows.
///
/// [`CullOptions::shadow`](crate::CullOptions::shadow) takes it.
/// A cull keeps the casters whose shadow may fall on something that the camera sees.
/// `docs/shadows.md` says what is promised, and what is not.
///
/// # Examples
/// A camera looks down at flat ground, and the sun stands above.
/// A box beside the view casts its shadow into it, and a box behind that one does not.
///
/// ```
/// # use hiz_core::headless::Engine;
/// # use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
/// # use hiz_core::{InstanceOptions, Outputs, Pose, Projection};
/// use hiz_core::{Depths, DirectionalLight, PyramidOptions};
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0, 10.0, 0.0], target: [0.0; 3], up: [0.0, 0.0, -1.0] };
/// # let (left, right, bottom, top, near, far) = (-4.0, 4.0, -4.0, 4.0, 0.0, 20.0);
/// # let convention = DepthConvention::Standard;
/// # let projection =
/// #     Projection::Orthographic { left, right, bottom, top, near, far, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
///
/// // The ground is 10 below the camera, which sees from 0 to 20: depth 0.5.
/// let depth = engine.upload_depth(&[0.5; 64 * 64], &camera)?;
/// let options = PyramidOptions { depths: Depths::Receivers, ..PyramidOptions::default() };
/// let receivers = engine.pyramid_with(&depth, &options)?;
///
/// let (min, max) = ([-6.5, 1.0, -0.5, -9.5, 1.0, -0.5], [-5.5, 2.0, 0.5, -8.5, 2.0, 0.5]);
/// let bounds = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };
/// let casters = engine.instances(&bounds, &InstanceOptions::default())?;
/// let sun = DirectionalLight::new([2.0, -1.0, 0.0], [-50.0, 0.0, -50.0], [50.0, 0.0, 50.0]);
/// let options = CullOptions { shadow: Some(sun), ..CullOptions::default() };
/// let culling = engine.cull(&casters, &camera, &receivers, &options, &Outputs::default())?;
/// assert_eq!(culling.mask()?, [true, false]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionalLight {
    /// The direction in which its light travels, of any length above 0.
    pub direction: Vec3,
    /// The least corner of a box around everything that can receive a shadow, in world units.
    /// A smaller box culls more.
    pub receivers_min: Vec3,
    /// The greatest corner of that box.
    pub receivers_max: Vec3,
    /// The angular radius of the light's disc in radians, 0..=30 degrees.
    /// The sun's is 0.27 degrees; 0 is a light with hard shadows.
    pub angular_radius: f64,
    /// How far from a point the lookup of its shadow reaches, in world units, at least 0.
    /// That is the radius of the filter's kernel, the diagonal of a texel of the shadow map, and the
    /// bias, added.
    pub filter_radius: f64,
}

impl DirectionalLight {
    /// A light with hard, exact shadows on whatever lies in the box.
    #[must_use]
    pub fn new(direction: Vec3, receivers_min: Vec3, receivers_max: Vec3) -> Self {
        Self { direction, receivers_min, receivers_max, angular_radius: 0.0, filter_radius: 0.0 }
    }

    /// Checks the numbers, and returns the unit vector of the direction.
    pub(crate) fn unit_direction(&self) -> Result<Vec3> {
        let unit = normalized(self.direction).ok_or_else(|| {
            Error::invalid(
                "shadow.direction",
                format!("expected a finite vector that is not 0, got {:?}", self.direction),
            )
        })?;
        let (min, max) = (self.receivers_min, self.receivers_max);
        let held = min.iter().chain(&max).all(|v| v.abs() < LARGEST);
        if !held || min.iter().zip(&max).any(|(min, max)| min > max) {
            return Err(Error::invalid(
                "shadow.receivers",
                format!(
                    "expected the least and greatest corner of a box, below 2^60, got {min:?} and \
                     {max:?}"
                ),
            ));
        }
        if !(0.0..=WIDEST).contains(&self.angular_radius) {
            return Err(Error::invalid(
                "shadow.angular_radius",
                format!(
                    "expected 0 to 30 degrees, got {} degrees",
                    self.angular_radius.to_degrees()
                ),
            ));
        }
        if !(0.0..LARGEST).contains(&self.filter_radius) {
            return Err(Error::invalid(
                "shadow.filter_radius",
                format!("expected a length in 0..2^60, got {}", self.filter_radius),
            ));
        }
        Ok(unit)
    }
}
