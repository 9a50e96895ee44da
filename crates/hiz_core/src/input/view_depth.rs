//! View depths of NDC depths, for explanations.

use crate::input::camera::Camera;
use crate::input::lens::{Rays, from_eye, parallel};

/// Converts NDC depth and w back to view depth in world units.
///
/// It serves explanations that people read; no decision rests on it.
pub(crate) enum ViewDepth {
    /// `ndc` is the slope, its error bound and the constant of `slope + constant / w`.
    /// It is `None` where NDC depth depends on the pixel as well.
    FromEye {
        w_length: f64,
        ndc: Option<[f64; 3]>,
    },
    Parallel {
        slope: f64,
        constant: f64,
    },
}

impl ViewDepth {
    /// `None` for a parallel camera if it does not say where its depth starts, or if its depth
    /// does not grow along its rays.
    pub(crate) fn new(camera: &Camera) -> Option<Self> {
        let rows = camera.rows_near_one();
        let rays = if camera.is_orthographic() { parallel(camera, &rows) } else { from_eye(&rows) };
        match rays.ok()? {
            Rays::Parallel { slope, constant, .. } => Some(Self::Parallel { slope, constant }),
            Rays::FromEye { k, constant, k_error, w_length, .. } => {
                let is_of_w_alone = (0..2).all(|i| k[i].abs() <= k_error[i]);
                Some(Self::FromEye {
                    w_length,
                    ndc: is_of_w_alone.then_some([k[2], k_error[2], constant]),
                })
            }
        }
    }

    /// The view depth of an NDC depth; infinite for the depth of an infinitely far point.
    pub(crate) fn of_ndc(&self, depth: f64) -> Option<f64> {
        match *self {
            Self::Parallel { slope, constant } => Some((depth - constant) / slope),
            Self::FromEye { w_length, ndc } => ndc.map(|[slope, error, constant]| {
                let difference = depth - slope;
                if difference.abs() <= error {
                    f64::INFINITY
                } else {
                    constant / difference / w_length
                }
            }),
        }
    }

    /// The view depth of w, scaled as in [`Camera::rows_near_one`].
    ///
    /// `None` for parallel rays, whose w is the same everywhere.
    pub(crate) fn of_w(&self, w: f64) -> Option<f64> {
        match *self {
            Self::Parallel { .. } => None,
            Self::FromEye { w_length, .. } => Some(w / w_length),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::image::{DepthConvention, ImageSize};
    use crate::input::lens::test_cameras::{POSE, perspective};
    use crate::input::projection::Projection;

    /// View depth from NDC depth and from w, at depths that are worked out by hand.
    #[test]
    fn view_depth_comes_back() {
        let near = |z: Option<f64>, expected: f64| {
            assert!((z.unwrap() - expected).abs() < 1e-12, "{z:?} {expected}");
        };
        for (convention, at_3) in
            [(DepthConvention::Standard, 0.75), (DepthConvention::Reversed, 0.25)]
        {
            let view = ViewDepth::new(&perspective(convention)).unwrap();
            near(view.of_ndc(at_3), 3.0);
            near(view.of_ndc(f64::from(convention.far())), 9.0);
            near(view.of_w(3.0), 3.0);
            let far = Projection::Perspective { fov_y: 1.0, near: 0.5, far: None, convention };
            let endless = Camera::look_at(&POSE, &far, ImageSize::new(2, 3)).unwrap();
            let view = ViewDepth::new(&endless).unwrap();
            // View depth 2 with near 1/2: a quarter of the way.
            near(view.of_ndc(if convention.is_reversed() { 0.25 } else { 0.75 }), 2.0);
            assert_eq!(view.of_ndc(f64::from(convention.far())), Some(f64::INFINITY));
            let (left, right, bottom, top) = (-1.0, 3.0, -1.0, 1.0);
            let parallel = Projection::Orthographic {
                left,
                right,
                bottom,
                top,
                near: -1.0,
                far: 7.0,
                convention,
            };
            let view =
                ViewDepth::new(&Camera::look_at(&POSE, &parallel, ImageSize::new(2, 2)).unwrap())
                    .unwrap();
            // Three quarters of the way from -1 to 7, in either direction.
            near(view.of_ndc(at_3), 5.0);
            assert_eq!(view.of_w(1.0), None);
        }
        // A bare orthographic matrix does not say where depth starts.
        // With an oblique near plane NDC depth depends on the pixel.
        let size = ImageSize::new(2, 2);
        let bare = |z, w| {
            let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, w];
            ViewDepth::new(
                &Camera::from_clip_from_world(rows, size, DepthConvention::Standard).unwrap(),
            )
        };
        assert!(bare([0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]).is_none());
        let oblique = bare([0.25, 0.0, 1.0, -1.0], [0.0, 0.0, 2.0, 0.0]).unwrap();
        assert_eq!(oblique.of_ndc(0.25), None);
        // w is scaled into 1..2: its length is 1.
        assert_eq!(oblique.of_w(5.0), Some(5.0));
    }
}
