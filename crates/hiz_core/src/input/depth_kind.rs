//! What the numbers of a depth image mean.

/// What the numbers of a depth image mean.
///
/// # Examples
/// A wall at view depth 10, seen by the 2 x 2 pixels of a view of 90 degrees:
///
/// ```
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// use hiz_core::{DepthKind, Floats, ndc_from_kind};
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let camera = camera.with_size(ImageSize::new(2, 2))?;
///
/// // A ray through a pixel's centre goes half a metre aside and half a metre up or down per metre.
/// let ray = (1.0_f64 + 0.5 * 0.5 + 0.5 * 0.5).sqrt();
/// let (z, distance) = ([10.0; 4], [10.0 * ray; 4]);
/// let from_z = ndc_from_kind(Floats::F64(&z), DepthKind::Z, 1.0, &[], &camera)?;
/// let from_distance =
///     ndc_from_kind(Floats::F64(&distance), DepthKind::Distance, 1.0, &[], &camera)?;
///
/// // Both are near / view depth, 0.1 / 10, rounded towards far: with reversed Z, down.
/// for ndc in from_z.iter().chain(&from_distance) {
///     assert!((0.009_999..=0.01).contains(ndc));
/// }
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DepthKind {
    /// NDC depth: near 0, far 1.
    Ndc,
    /// NDC depth in reversed Z: near 1, far 0.
    ReversedNdc,
    /// View depth: world units along the viewing direction.
    Z,
    /// Distance from the eye: world units along the ray through the pixel's centre.
    Distance,
}
