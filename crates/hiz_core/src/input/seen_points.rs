//! What images and points say about each other on the host: colours of points, depth of points.
//!
//! Positions are projected in float64.
//! No verdict rests on it: which points are visible is decided by a cull before.

use crate::error::{Error, Result};
use crate::host::linear::Vec3;
use crate::host::threads::{on_threads, worth_it};
use crate::input::bounds::Floats;
use crate::input::camera::Camera;
use crate::input::discs::{Disc, draw_discs};
use crate::input::image::ImageSize;
use crate::input::lens::toward_far;

/// Points that one thread takes at a time.
const PART: usize = 1 << 14;

/// Weights beyond these are as good as these, and sums of them stay within float32.
const LEAST: f64 = 1e-18;
const MOST: f64 = 1e18;

/// Nanoseconds that a point takes, about.
const PER_POINT: u64 = 20;

/// Where positions lie in an image.
#[derive(Debug, Clone, Copy)]
struct Projector {
    rows: [[f64; 4]; 4],
    origin: Vec3,
    size: [f64; 2],
}

/// A projected position.
#[derive(Debug, Clone, Copy)]
struct Projected {
    /// Column and row in pixels; the first pixel's centre is (0.5, 0.5).
    at: [f64; 2],
    /// NDC depth.
    depth: f64,
    w: f64,
}

impl Projector {
    fn new(camera: &Camera) -> Self {
        let size = [camera.size().width, camera.size().height].map(f64::from);
        Self { rows: camera.rows(), origin: camera.origin(), size }
    }

    /// View depth is w times this, because the rows may have any factor.
    fn depth_per_w(&self) -> f64 {
        let [x, y, z, constant] = self.rows[3];
        let along = (x * x + y * y + z * z).sqrt();
        if along > 0.0 { along.recip() } else { constant.recip() }
    }

    /// `None` behind the eye, and for what is not finite.
    #[inline]
    fn project(&self, position: Vec3) -> Option<Projected> {
        let d: Vec3 = std::array::from_fn(|k| position[k] - self.origin[k]);
        let [x, y, z, w] =
            self.rows.map(|row| row[0] * d[0] + row[1] * d[1] + row[2] * d[2] + row[3]);
        let inverse = w.recip();
        let at =
            [(0.5 + 0.5 * x * inverse) * self.size[0], (0.5 - 0.5 * y * inverse) * self.size[1]];
        (w > 0.0).then_some(Projected { at, depth: z * inverse, w })
    }

    /// The same, if it lies within the image and between the planes.
    #[inline]
    fn project_inside(&self, position: Vec3) -> Option<Projected> {
        self.project(position).filter(|p| {
            let is_within = |k: usize| p.at[k] >= 0.0 && p.at[k] < self.size[k];
            is_within(0) && is_within(1) && (0.0..=1.0).contains(&p.depth)
        })
    }
}

/// The colours of an image: three numbers per pixel, rows from top to bottom.
#[derive(Debug, Clone, Copy)]
pub enum Colours<'a> {
    /// Bytes, as most pictures have.
    Bytes(&'a [u8]),
    /// float32 of any range.
    F32(&'a [f32]),
}

impl Colours<'_> {
    fn len(&self) -> usize {
        match self {
            Self::Bytes(v) => v.len(),
            Self::F32(v) => v.len(),
        }
    }

    #[inline]
    fn pixel(&self, i: usize) -> [f32; 3] {
        match self {
            Self::Bytes(v) => std::array::from_fn(|k| f32::from(v[3 * i + k])),
            Self::F32(v) => std::array::from_fn(|k| v[3 * i + k]),
        }
    }

    /// The colour between the four pixels around a place; at the image's edge its pixels repeat.
    #[inline]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the image before"
    )]
    fn between(&self, size: ImageSize, at: [f64; 2]) -> [f32; 3] {
        let sides = [size.width as usize, size.height as usize];
        let part = |k: usize| {
            let from_centre = (at[k] - 0.5).clamp(0.0, (sides[k] - 1) as f64);
            let first = from_centre as usize;
            (first, (first + 1).min(sides[k] - 1), (from_centre - first as f64) as f32)
        };
        let ((x0, x1, u), (y0, y1, v)) = (part(0), part(1));
        let [top, bottom] = [y0, y1].map(|y| {
            let (left, right) = (self.pixel(y * sides[0] + x0), self.pixel(y * sides[0] + x1));
            std::array::from_fn::<f32, 3, _>(|k| left[k] + (right[k] - left[k]) * u)
        });
        std::array::from_fn(|k| top[k] + (bottom[k] - top[k]) * v)
    }

    #[inline]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within the image, as the caller has checked"
    )]
    fn nearest(&self, size: ImageSize, at: [f64; 2]) -> [f32; 3] {
        self.pixel(at[1] as usize * size.width as usize + at[0] as usize)
    }
}

/// How the colours of a point in several views are weighted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourWeight {
    /// All alike.
    Equal,
    /// By the inverse square of the view depth, as the point's surface fills the image.
    ///
    /// Parallel rays show everything alike, so there each point counts 1.
    Near,
}

/// Sums over the views so far, three of colours and one of each other per point.
#[derive(Debug)]
pub struct ColourSums<'a> {
    /// Weighted colours.
    pub colours: &'a mut [f32],
    /// Weights.
    pub weights: &'a mut [f32],
    /// How many views have seen the point.
    pub counts: &'a mut [u32],
}

/// Adds the colours of one image to the points that are visible in it, on all cores.
///
/// `positions` has three scalars per point, and `visible` a flag, as a cull's mask.
/// Points outside of the image count as not seen.
/// `bilinear`: between the four pixels around a point, rather than of the pixel that it lies in.
///
/// # Errors
/// [`Error::Invalid`] for arrays whose lengths disagree.
pub fn add_colours(
    positions: Floats<'_>,
    visible: &[bool],
    camera: &Camera,
    (image, bilinear, weight): (Colours<'_>, bool, ColourWeight),
    sums: ColourSums<'_>,
) -> Result<()> {
    let (count, size) = (visible.len(), camera.size());
    for (name, got, expected) in [
        ("positions", positions.len(), 3 * count),
        ("image", image.len(), 3 * size.pixels() as usize),
        ("colours", sums.colours.len(), 3 * count),
        ("weights", sums.weights.len(), count),
        ("counts", sums.counts.len(), count),
    ] {
        if got != expected {
            return Err(Error::invalid(name, format!("expected {expected} numbers, got {got}")));
        }
    }
    let projector = Projector::new(camera);
    let depth_per_w = projector.depth_per_w();
    let parts = (0..)
        .step_by(PART)
        .zip(visible.chunks(PART))
        .zip(sums.colours.chunks_mut(3 * PART))
        .zip(sums.weights.chunks_mut(PART).zip(sums.counts.chunks_mut(PART)));
    on_threads(worth_it(count as u64 * PER_POINT), parts, |part| {
        let (((first, visible), colours), (weights, counts)) = part;
        for (k, is_visible) in visible.iter().enumerate() {
            if !is_visible {
                continue;
            }
            let Some(p) = projector.project_inside(positions.array(first + k)) else { continue };
            let colour =
                if bilinear { image.between(size, p.at) } else { image.nearest(size, p.at) };
            #[expect(clippy::cast_possible_truncation, reason = "a weight")]
            let share = match weight {
                ColourWeight::Equal => 1.0,
                ColourWeight::Near => (p.w * depth_per_w).powi(2).recip().clamp(LEAST, MOST) as f32,
            };
            for (sum, channel) in colours[3 * k..3 * k + 3].iter_mut().zip(colour) {
                *sum += share * channel;
            }
            weights[k] += share;
            counts[k] += 1;
        }
    });
    Ok(())
}

/// A depth image of points, each a disc that faces the camera; the nearest one wins.
///
/// `radius` is that of the discs in world units, and `radius_px` the least one in pixels.
/// A disc covers the pixels whose centres lie in it, and the pixel that its own centre lies in.
/// It has the point's depth everywhere.
///
/// The result is NDC depth in the camera's convention, rounded to float32 towards far.
/// Points outside of the depth range make no disc, and empty pixels are far.
///
/// # Errors
/// [`Error::Invalid`] for radii that are negative or not finite, and for numbers that are no
/// positions of three scalars each.
pub fn depth_of_points(
    positions: Floats<'_>,
    camera: &Camera,
    radius: f64,
    radius_px: f64,
) -> Result<Vec<f32>> {
    for (name, value) in [("radius", radius), ("radius_px", radius_px)] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(Error::invalid(
                name,
                format!("expected a finite number from 0 on, got {value}"),
            ));
        }
    }
    if !positions.len().is_multiple_of(3) {
        return Err(Error::invalid(
            "positions",
            format!("expected three numbers per point, got {}", positions.len()),
        ));
    }
    let size = camera.size();
    let projector = Projector::new(camera);
    let per_radius = pixels_per_unit(&projector);
    let reversed = camera.convention().is_reversed();
    let disc = |i: usize| {
        let p = projector.project(positions.array(i))?;
        let reach = [0, 1].map(|k| radius_px.max(radius * per_radius[k] / p.w));
        let depth = toward_far(p.depth, reversed);
        (0.0..=1.0).contains(&p.depth).then_some(Disc { at: p.at, reach, depth })
    };
    let discs = (0..positions.len() / 3).filter_map(disc);
    Ok(draw_discs(discs, size, camera.convention()))
}

/// Pixels of a world unit across the view, along columns and rows, times w.
fn pixels_per_unit(projector: &Projector) -> [f64; 2] {
    let [x, y, _, w] = projector.rows;
    // Across the view w stays: what is left of a row without its part along w's direction.
    let across = |row: [f64; 4]| {
        let dot = |a: [f64; 4], b: [f64; 4]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
        let along = if dot(w, w) > 0.0 { dot(row, w) / dot(w, w) } else { 0.0 };
        let left = [0, 1, 2].map(|k| row[k] - along * w[k]);
        left.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    [0.5 * projector.size[0] * across(x), 0.5 * projector.size[1] * across(y)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::image::DepthConvention;

    /// View depth is z, and x and y span -1..1 at depth 1; the near plane is at 1.
    fn camera(width: u32, height: u32) -> Camera {
        let m = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 1.0, 0.0],
        ];
        let size = ImageSize::new(width, height);
        Camera::from_clip_from_world(m, size, DepthConvention::Reversed).unwrap()
    }

    /// Columns 0..4 and rows 0..2 with colour (10 x, 10 y, 1).
    fn picture() -> Vec<u8> {
        (0..8).flat_map(|i| [10 * (i % 4), 10 * (i / 4), 1]).collect()
    }

    fn added(position: [f64; 3], bilinear: bool, weight: ColourWeight) -> ([f32; 3], f32, u32) {
        let (mut colours, mut weights, mut counts) = ([0.0; 3], [0.0], [0]);
        let sums = ColourSums { colours: &mut colours, weights: &mut weights, counts: &mut counts };
        let picture = picture();
        let image = (Colours::Bytes(&picture), bilinear, weight);
        add_colours(Floats::F64(&position), &[true], &camera(4, 2), image, sums).unwrap();
        (colours, weights[0], counts[0])
    }

    #[test]
    fn colours_by_hand() {
        let equal = ColourWeight::Equal;
        // NDC (-0.25, 0.5) is column 1.5 and row 0.5: the centre of pixel (1, 0).
        let at = [-0.5, 1.0, 2.0];
        assert_eq!(added(at, false, equal), ([10.0, 0.0, 1.0], 1.0, 1));
        assert_eq!(added(at, true, equal), ([10.0, 0.0, 1.0], 1.0, 1));
        // The image's middle lies between four pixels; the nearest is that to the right below.
        assert_eq!(added([0.0, 0.0, 2.0], true, equal), ([15.0, 5.0, 1.0], 1.0, 1));
        assert_eq!(added([0.0, 0.0, 2.0], false, equal), ([20.0, 10.0, 1.0], 1.0, 1));
        // By 1 / w^2.
        assert_eq!(added([0.0, 0.0, 2.0], false, ColourWeight::Near), ([5.0, 2.5, 0.25], 0.25, 1));
        // At the edge pixels repeat; beside it, behind the eye and before the near plane: nothing.
        assert_eq!(added([-1.999, 0.0, 2.0], true, equal).0[0], 0.0);
        for outside in [[-2.1, 0.0, 2.0], [0.0, 0.0, -2.0], [0.0, 0.0, 0.5], [f64::NAN, 0.0, 2.0]] {
            assert_eq!(added(outside, true, equal), ([0.0; 3], 0.0, 0), "{outside:?}");
        }
    }

    #[test]
    fn discs_cover_the_pixels_whose_centres_they_hold() {
        let camera = camera(8, 8);
        let drawn = |positions: &[f64], radius: f64, radius_px: f64| {
            depth_of_points(Floats::F64(positions), &camera, radius, radius_px).unwrap()
        };
        let covered = |image: &[f32]| image.iter().filter(|d| **d > 0.0).count();
        // In the middle of pixel (4, 3): itself; with radius 1 its four neighbours.
        let at = [0.25, 0.25, 2.0];
        let image = drawn(&at, 0.0, 0.0);
        assert_eq!((image[3 * 8 + 4], covered(&image)), (0.5, 1));
        assert_eq!(covered(&drawn(&at, 0.0, 1.0)), 5);
        assert_eq!(covered(&drawn(&at, 0.0, 1.5)), 9);
        // A world unit is 4 / z pixels: half a unit at depth 2 is one.
        assert_eq!(covered(&drawn(&at, 0.5, 0.0)), 5);
        // The nearest wins, whatever comes first; nothing is drawn outside of the depth range.
        let two = [0.25, 0.25, 2.0, 0.5, 0.5, 4.0, 0.0, 0.0, 0.5, 0.0, 0.0, -3.0];
        assert_eq!(drawn(&two, 0.0, 0.0)[3 * 8 + 4], 0.5);
        assert_eq!(covered(&drawn(&two, 0.0, 0.0)), 1);
        // A disc beside the image reaches into it.
        assert_eq!(covered(&drawn(&[-2.1, 0.25, 2.0], 0.0, 1.0)), 1);
        let refused = depth_of_points(Floats::F64(&at), &camera, -1.0, 0.0).unwrap_err();
        assert_eq!(refused.to_string(), "radius: expected a finite number from 0 on, got -1");
    }
}
