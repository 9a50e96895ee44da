//! Levels of detail (LODs), in float64: how far points are apart in the image, and which LOD a rule
//! allows.
//!
//! A rule compares a *need* with the least w of the bounds, so that it can be computed twice.
//! What it promises is about pixels, which [`pixel_shift`] measures by projecting points.

use crate::view::View;
use crate::volume::Volume;

/// A rule that allows LODs, and what it needs to know of an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LodRule<'a> {
    /// No point of the LOD is more than `pixels` away from its counterpart.
    Error {
        /// How far each LOD's surface is from the full mesh, in world units at scale 1.
        errors: &'a [f64],
        /// The instance's scale.
        scale: f64,
        /// The largest error in pixels.
        pixels: f64,
    },
    /// LOD l + 1 where all of the bounds are farther than this view depth, in world units.
    Distance(&'a [f64]),
    /// LOD l + 1 where the bounds are narrower than this in every direction, in pixels.
    Size(&'a [f64]),
}

/// The distance in pixels between the images of two points.
///
/// `None` if neither lies in the closed image, or if one of them has w <= 0.
#[must_use]
pub fn pixel_shift(view: &View, p: [f64; 3], q: [f64; 3]) -> Option<f64> {
    let (p, q) = (pixel(view, p)?, pixel(view, q)?);
    let [half_width, half_height] = half_size(view);
    let shows = |t: [f64; 2]| t[0].abs() <= half_width && t[1].abs() <= half_height;
    (shows(p) || shows(q)).then(|| (p[0] - q[0]).hypot(p[1] - q[1]))
}

/// The coarsest LOD that a rule allows together with all finer ones.
///
/// LOD 0 needs nothing.
#[must_use]
pub fn coarsest_lod(view: &View, volume: &Volume, rule: LodRule<'_>) -> usize {
    let w = least_w(view, volume);
    let allowed = |needs: &[f64]| needs.iter().take_while(|need| w > **need).count();
    match rule {
        LodRule::Error { errors, scale, pixels } => {
            let factor = greatest_stretch(view) / pixels;
            let needs: Vec<f64> = errors.iter().skip(1).map(|e| e * scale * factor).collect();
            if w > 0.0 { allowed(&needs) } else { 0 }
        }
        LodRule::Distance(thresholds) => {
            let unit = length([0, 1, 2].map(|k| view.rows[3][k]));
            let needs: Vec<f64> = thresholds.iter().map(|d| d * unit).collect();
            if unit > 0.0 { allowed(&needs) } else { 0 }
        }
        LodRule::Size(pixels) => {
            let width = 2.0 * radius(volume) * greatest_stretch(view);
            let needs: Vec<f64> = pixels.iter().map(|size| width / size).collect();
            if w > 0.0 { allowed(&needs) } else { 0 }
        }
    }
}

/// Pixels times w that a unit of length can make at the image's corner where it makes most.
#[must_use]
pub fn greatest_stretch(view: &View) -> f64 {
    let [half_width, half_height] = half_size(view);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
    corners
        .into_iter()
        .map(|(x, y)| stretch_at(view, [x * half_width, y * half_height]).0)
        .fold(0.0, f64::max)
}

/// Pixels times w that a unit of length can make at pixel position `t`, counted from the image's
/// middle, and the unit vector that makes them.
#[must_use]
pub fn stretch_at(view: &View, t: [f64; 2]) -> (f64, [f64; 3]) {
    let [x, y, w] = pixel_rows(view);
    let row = |of: [f64; 4], t: f64| [0, 1, 2].map(|k| of[k] - t * w[k]);
    let (first, second) = (row(x, t[0]), row(y, t[1]));
    // The greatest singular value by a rotation that makes both rows orthogonal (one-sided Jacobi).
    let (a, b, c) = (dot(first, first), dot(first, second), dot(second, second));
    let angle = 0.5 * (2.0 * b).atan2(a - c);
    let along = [0, 1, 2].map(|k| angle.cos() * first[k] + angle.sin() * second[k]);
    let size = length(along);
    (size, along.map(|v| v / size))
}

/// The least w on a volume.
#[must_use]
pub fn least_w(view: &View, volume: &Volume) -> f64 {
    let w = view.rows[3];
    let lin = [w[0], w[1], w[2]];
    let at = |p: [f64; 3]| {
        let relative = [0, 1, 2].map(|k| p[k] - view.origin[k]);
        dot(lin, relative) + w[3]
    };
    match *volume {
        Volume::Sphere { center, radius } => at(center) - length(lin) * radius,
        Volume::Box { min, max } => {
            at([0, 1, 2].map(|k| if lin[k] > 0.0 { min[k] } else { max[k] }))
        }
        Volume::OrientedBox { center, half_sizes, axes } => {
            let reach = |k: usize| (dot(lin, axes.map(|row| row[k])) * half_sizes[k]).abs();
            at(center) - (reach(0) + reach(1) + reach(2))
        }
    }
}

/// The greatest distance of a point of a volume from its centre.
#[must_use]
pub fn radius(volume: &Volume) -> f64 {
    match *volume {
        Volume::Sphere { radius, .. } => radius,
        Volume::Box { min, max } => 0.5 * length([0, 1, 2].map(|k| max[k] - min[k])),
        Volume::OrientedBox { half_sizes, axes, .. } => {
            let corner = |signs: [f64; 3]| {
                length(
                    axes.map(|row| (0..3).map(|k| signs[k] * row[k] * half_sizes[k]).sum::<f64>()),
                )
            };
            let signs = [[1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]];
            signs.into_iter().map(corner).fold(0.0, f64::max)
        }
    }
}

/// Half of the image's size.
fn half_size(view: &View) -> [f64; 2] {
    [f64::from(view.width) / 2.0, f64::from(view.height) / 2.0]
}

/// The pixel position times w, from the image's middle and downwards, and w.
fn pixel_rows(view: &View) -> [[f64; 4]; 3] {
    let [half_width, half_height] = half_size(view);
    let [x, y, _, w] = view.rows;
    [x.map(|v| v * half_width), y.map(|v| -v * half_height), w]
}

/// The pixel position of a point, from the image's middle; `None` where w <= 0.
fn pixel(view: &View, p: [f64; 3]) -> Option<[f64; 2]> {
    let relative = [0, 1, 2].map(|k| p[k] - view.origin[k]);
    let [x, y, w] = pixel_rows(view).map(|r| dot([r[0], r[1], r[2]], relative) + r[3]);
    (w > 0.0).then(|| [x / w, y / w])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks along +z, 90 degrees wide, 8x4 pixels: a unit across at depth 1 is 4 pixels, and 2
    /// pixels down.
    fn view() -> View {
        View {
            rows: [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., -1.], [0., 0., 1., 0.]],
            origin: [10.0, 0.0, 0.0],
            width: 8,
            height: 4,
            reversed: false,
        }
    }

    #[test]
    fn pixels_by_hand() {
        // At depth 2: columns 0.5 * 4 = 2 and 1 * 4 = 4 from the middle.
        let shift = pixel_shift(&view(), [11.0, 0.0, 2.0], [12.0, 0.0, 2.0]);
        assert_eq!(shift, Some(2.0));
        // 3 pixels across and 4 down, with y up; the second point lies outside.
        let shift = pixel_shift(&view(), [10.0, 0.0, 1.0], [10.75, -2.0, 1.0]);
        assert_eq!(shift, Some(5.0));
        assert_eq!(pixel_shift(&view(), [15.0, 0.0, 1.0], [10.0, 9.0, 1.0]), None, "both outside");
        assert_eq!(pixel_shift(&view(), [10.0, 0.0, 1.0], [10.0, 0.0, -1.0]), None);
    }

    #[test]
    fn stretches_by_hand() {
        // In the middle: 4 across.
        let (size, along) = stretch_at(&view(), [0.0, 0.0]);
        assert!((size - 4.0).abs() < 1e-12 && (along[0].abs() - 1.0).abs() < 1e-12, "{along:?}");
        // On the right border: the row (4, 0, -4), which beats (0, -2, 0).
        let (size, along) = stretch_at(&view(), [4.0, 0.0]);
        assert!((size - 32.0_f64.sqrt()).abs() < 1e-12 && (along[0] + along[2]).abs() < 1e-12);
        assert!(greatest_stretch(&view()) > size);
    }

    #[test]
    fn rules_by_hand() {
        let ball = Volume::Sphere { center: [10.0, 0.0, 10.0], radius: 2.0 };
        let aabb = Volume::Box { min: [9.0, -1.0, 8.0], max: [11.0, 1.0, 12.0] };
        let turned = Volume::OrientedBox {
            center: [10.0, 0.0, 10.0],
            half_sizes: [1.0, 1.0, 1.0],
            axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]],
        };
        for volume in [ball, aabb, turned] {
            assert_eq!(least_w(&view(), &volume), 8.0, "{volume:?}");
            let rule = LodRule::Distance(&[7.0, 7.5, 8.0, 9.0]);
            assert_eq!(coarsest_lod(&view(), &volume, rule), 2, "{volume:?}");
        }
        assert_eq!(radius(&aabb), 6.0_f64.sqrt());
        // The longest diagonal is (1, 1, 2).
        assert_eq!(radius(&turned), 6.0_f64.sqrt());
        let g = greatest_stretch(&view());
        let errors = [0.0, 7.9 / g, 3.0 / g, 8.1 / g, 1.0 / g];
        let rule = |pixels| LodRule::Error { errors: &errors, scale: 2.0, pixels };
        assert_eq!(coarsest_lod(&view(), &ball, rule(2.0)), 2);
        assert_eq!(coarsest_lod(&view(), &ball, rule(1.0)), 0);
        let width = 4.0 * g / 8.0;
        let sizes = [1.01 * width, 0.99 * width];
        assert_eq!(coarsest_lod(&view(), &ball, LodRule::Size(&sizes)), 1);
        let behind = Volume::Sphere { center: [10.0, 0.0, 1.0], radius: 2.0 };
        assert_eq!(coarsest_lod(&view(), &behind, rule(1e9)), 0);
    }
}
