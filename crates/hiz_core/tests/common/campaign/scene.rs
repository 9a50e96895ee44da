//! A camera, a depth image, and the depth at which volumes begin.

use hiz_core::{Camera, Coverage, DepthConvention, ImageSize, Pose, Projection};
use hiz_ref::View;

use crate::common::Random;

use super::class::Class;

/// The content of a depth image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DepthStyle {
    /// One depth, at which the volumes begin.
    Equal,
    /// One depth, the near plane's.
    Near,
    /// Nothing: all pixels are far.
    Far,
    /// A wall in front of all volumes, with a column of holes.
    Column,
    /// The same wall with a row of holes.
    Row,
    /// The same wall with a column and a row of holes.
    Cross,
    /// The same wall with a hole of one pixel.
    Pixel,
    /// Random depths.
    Noise,
}

/// The settings that a scene is made from: random, until a class fixes some.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    pub(super) size: ImageSize,
    pub(super) convention: DepthConvention,
    pub(super) eye: [f64; 3],
    /// The greatest distance of the eye from the world's origin along each axis.
    away: f64,
    pub(super) near: f64,
    /// Infinite where there is no far plane, which only a perspective can lack.
    pub(super) far: f64,
    /// Half the image in world units, and then its middle.
    /// Measured at view depth 1 (perspective) or anywhere (orthographic).
    pub(super) half: [f64; 2],
    pub(super) middle: [f64; 2],
    pub(super) orthographic: bool,
    /// Whether the camera's axes are the world's, so that boxes can face it.
    pub(super) aligned: bool,
    pub(super) bare_matrix: bool,
    pub(super) style: DepthStyle,
}

impl Settings {
    fn new(random: &mut Random) -> Self {
        let half = [0; 2].map(|_| 10.0_f64.powf(random.range(-1.5, 0.7)));
        let near = 10.0_f64.powf(random.range(-3.0, 1.0));
        let centred = random.below(2) == 0;
        let mut settings = Self {
            size: ImageSize::new(1 + random.below(48), 1 + random.below(48)),
            convention: random.pick(&[DepthConvention::Standard, DepthConvention::Reversed]),
            eye: [0.0; 3],
            away: 0.0,
            near,
            far: if random.below(3) == 0 {
                f64::INFINITY
            } else {
                near * 10.0_f64.powf(random.range(0.5, 8.0))
            },
            half,
            middle: half.map(|h| if centred { 0.0 } else { random.range(-1.0, 1.0) * h }),
            orthographic: random.below(5) == 0,
            aligned: random.below(2) == 0,
            bare_matrix: random.below(6) == 0,
            style: random.pick(&[
                DepthStyle::Equal,
                DepthStyle::Equal,
                DepthStyle::Far,
                DepthStyle::Column,
                DepthStyle::Row,
                DepthStyle::Cross,
                DepthStyle::Pixel,
                DepthStyle::Noise,
            ]),
        };
        let away = random.pick(&[0.0, 0.0, 1.0, 1e3, 1e6]);
        settings.stand_away(away, random);
        settings
    }

    /// Puts the camera up to `distance` from the world's origin along each axis.
    /// Views from far away have larger near and far distances.
    pub(super) fn stand_away(&mut self, distance: f64, random: &mut Random) {
        self.away = distance;
        self.eye = [0; 3].map(|_| distance * random.range(-1.0, 1.0));
        if distance > 1e5 {
            (self.near, self.far) = (self.near * 1e3, self.far * 1e3);
        }
    }

    fn camera(&self, random: &mut Random) -> Option<Camera> {
        let direction: [f64; 3] = if self.aligned {
            [0.0, 0.0, -1.0]
        } else {
            std::array::from_fn(|_| random.range(-1.0, 1.0))
        };
        let up = if self.aligned {
            [0.0, 1.0, 0.0]
        } else {
            std::array::from_fn(|_| random.range(-1.0, 1.0))
        };
        // A target far enough not to be lost in the rounding of a distant eye.
        let target = std::array::from_fn(|k| self.eye[k] + (1.0 + self.away) * direction[k]);
        let (left, right) = (self.middle[0] - self.half[0], self.middle[0] + self.half[0]);
        let (bottom, top) = (self.middle[1] - self.half[1], self.middle[1] + self.half[1]);
        let (near, convention) = (self.near, self.convention);
        let projection = if self.orthographic {
            let far = if self.far.is_finite() { self.far } else { near * 1e3 };
            Projection::Orthographic { left, right, bottom, top, near, far, convention }
        } else {
            let far = self.far.is_finite().then_some(self.far);
            Projection::Frustum { left, right, bottom, top, near, far, convention }
        };
        let camera =
            Camera::look_at(&Pose { eye: self.eye, target, up }, &projection, self.size).ok()?;
        if self.bare_matrix {
            return Camera::from_clip_from_world(camera.clip_from_world(), self.size, convention)
                .ok();
        }
        Some(camera)
    }
}

/// A camera, its axes, its depth image, and the view depth at which volumes begin.
#[derive(Debug)]
pub(super) struct Scene {
    pub(super) settings: Settings,
    pub(super) camera: Camera,
    /// The camera as the oracle takes it.
    pub(super) view: View,
    /// Right, up, forward.
    pub(super) axes: [[f64; 3]; 3],
    /// View depth of the volumes' nearest points.
    pub(super) front: f64,
    /// The depth that the front has in the image, or is compared with.
    pub(super) front_depth: f32,
    /// Column and row of the holes.
    pub(super) hole: [u32; 2],
    pub(super) depth: Vec<f32>,
    /// Where in its pixel a hole can be seen from: 0 and 1 (area coverage), or the pixel's centre.
    pub(super) edges: [f64; 2],
}

impl Scene {
    /// `None` where float64 cannot represent such a camera.
    pub(super) fn new(
        class: Class,
        coverage: Coverage,
        sizes: &[(u32, u32)],
        random: &mut Random,
    ) -> Option<Self> {
        let mut settings = Settings::new(random);
        class.insist(&mut settings, random);
        if !sizes.is_empty() {
            let (width, height) = random.pick(sizes);
            settings.size = ImageSize::new(width, height);
        }
        let camera = settings.camera(random)?;
        let rows = camera.rows();
        let reversed = settings.convention.is_reversed();
        let view = View {
            rows,
            origin: camera.origin(),
            width: settings.size.width,
            height: settings.size.height,
            reversed,
        };
        // The camera's axes, to the accuracy of float64.
        let unit = |v: [f64; 3]| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            v.map(|x| x / length)
        };
        let linear = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
        let forward = if settings.orthographic {
            unit(linear(2)).map(|x| if reversed { -x } else { x })
        } else {
            unit(linear(3))
        };
        let across = |r: usize| {
            let along: f64 = (0..3).map(|k| rows[r][k] * forward[k]).sum();
            unit(std::array::from_fn(|k| rows[r][k] - along * forward[k]))
        };
        let axes = [across(0), across(1), forward];
        let (near, size) = (settings.near, settings.size);
        let range = (settings.far / near).min(1e9);
        // Mostly within a thousand near planes; the whole range for the classes that need depth.
        let exponent = match class {
            Class::DeepRange => random.unit(),
            Class::BareMatrix => random.range(0.3, 1.0),
            _ => random.unit().min(3.0 / range.log10()),
        };
        let front = near
            * range.powf(exponent)
            * random.pick(&[1.0, 1.0, 1.0, 1.0 - 1e-6, 1.0 + 1e-6, 0.9]);
        let hole = [random.below(size.width), random.below(size.height)];
        let edges = match coverage {
            Coverage::Area => [0.0, 1.0],
            Coverage::Sample => [0.5, 0.5],
        };
        let mut scene = Self {
            settings,
            camera,
            view,
            axes,
            front,
            front_depth: 0.0,
            hole,
            depth: Vec::new(),
            edges,
        };
        scene.paint(random);
        Some(scene)
    }

    fn paint(&mut self, random: &mut Random) {
        let far = self.settings.convention.far();
        let mut equal = self.ndc(self.front) as f32;
        for _ in 0..random.below(3) {
            equal = if random.below(2) == 0 { equal.next_up() } else { equal.next_down() };
        }
        let clear =
            self.ndc(self.settings.near + 0.5 * (self.front - self.settings.near).max(0.0)) as f32;
        let style = self.settings.style;
        let (width, height, hole) =
            (self.settings.size.width, self.settings.size.height, self.hole);
        self.depth = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x == hole[0], y == hole[1])))
            .map(|(in_column, in_row)| {
                let is_hole = match style {
                    DepthStyle::Equal => return equal,
                    DepthStyle::Near => return 1.0 - far,
                    DepthStyle::Far => return far,
                    DepthStyle::Noise => return random.unit() as f32,
                    DepthStyle::Column => in_column,
                    DepthStyle::Row => in_row,
                    DepthStyle::Cross => in_column || in_row,
                    DepthStyle::Pixel => in_column && in_row,
                };
                if is_hole { far } else { clear }
            })
            .collect();
        self.front_depth = if style == DepthStyle::Near { 1.0 - far } else { equal };
        if matches!(style, DepthStyle::Equal | DepthStyle::Near) {
            // The view depth of the stored depth itself, to the accuracy of float64.
            let [z, w] = [2, 3].map(|r| self.along_forward(r));
            let d = f64::from(self.front_depth);
            let front = (d * w[1] - z[1]) / (z[0] - d * w[0]);
            if front.is_finite() && (self.settings.orthographic || front > 0.0) {
                self.front = front;
            }
        }
    }

    /// Slope and constant of a clip row along the optical axis.
    fn along_forward(&self, r: usize) -> [f64; 2] {
        let (row, origin) = (self.view.rows[r], self.view.origin);
        let slope = (0..3).map(|k| row[k] * self.axes[2][k]).sum::<f64>();
        [slope, (0..3).map(|k| row[k] * (self.settings.eye[k] - origin[k])).sum::<f64>() + row[3]]
    }

    /// NDC depth of view depth `z`.
    fn ndc(&self, z: f64) -> f64 {
        let [clip_z, clip_w] =
            [2, 3].map(|r| self.along_forward(r)).map(|[slope, constant]| slope * z + constant);
        clip_z / clip_w
    }

    /// World position of a position in view space (right, up, forward).
    pub(super) fn world(&self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| {
            self.settings.eye[k] + (0..3).map(|j| self.axes[j][k] * v[j]).sum::<f64>()
        })
    }

    /// View-space x and y of a pixel position at view depth `z`.
    pub(super) fn at(&self, pixel: [f64; 2], z: f64) -> [f64; 2] {
        let s = &self.settings;
        let scale = if s.orthographic { 1.0 } else { z };
        [
            (s.middle[0] + (2.0 * pixel[0] / f64::from(s.size.width) - 1.0) * s.half[0]) * scale,
            (s.middle[1] + (1.0 - 2.0 * pixel[1] / f64::from(s.size.height)) * s.half[1]) * scale,
        ]
    }

    /// The view of only the pixel columns (axis 0) or rows (axis 1) from `begin` to `end`.
    /// It has the accuracy of float64, which is enough for a search.
    pub(super) fn cropped(&self, axis: usize, begin: f64, end: f64) -> View {
        let size = f64::from([self.view.width, self.view.height][axis]);
        let (stretch, shift) = (size / (end - begin), (size - begin - end) / (end - begin));
        let shift = if axis == 0 { shift } else { -shift };
        let mut view = self.view.clone();
        view.rows[axis] =
            std::array::from_fn(|k| stretch * view.rows[axis][k] + shift * view.rows[3][k]);
        view
    }
}
