//! Views: the exact projection, its image, and the linear inequalities of "inside a block of
//! pixels".

use crate::Error;
use crate::feasibility::{Constraint, Form};
use crate::scalar::Scalar;
use crate::volume::Frame;

/// The largest image side in pixels; hizvk accepts no larger one either.
const MAX_SIDE: u32 = 32768;

/// A projection to an image, taken exactly as written: `clip = rows * (p - origin, 1)` in real
/// arithmetic.
///
/// NDC is `clip.xyz / clip.w` with x to the right, y up and z from 0 to 1.
/// Pixel (column `j`, row `i`) is the closed square `[j, j+1] x [i, i+1]` of pixel coordinates
///
/// ```text
/// x_pixel = width/2 + width/2 * ndc.x          y_pixel = height/2 - height/2 * ndc.y
/// ```
///
/// so row 0 is on top, as in an image array.
/// A point is inside the frustum if `w > 0`, `0 <= z <= w` and its pixel coordinates lie in the
/// closed image rectangle.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Rows of the 4x4 matrix that takes `(p - origin, 1)` to clip coordinates x, y, z, w.
    pub rows: [[f64; 4]; 4],
    /// The world point that is subtracted from positions before `rows` apply, in world units.
    pub origin: [f64; 3],
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Whether NDC depth 1 is the nearest (reversed Z) instead of 0 (standard).
    pub reversed: bool,
}

impl View {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let (width, height) = (self.width, self.height);
        if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
            return Err(Error::Size { width, height });
        }
        let finite = self.rows.iter().flatten().chain(&self.origin).all(|x| x.is_finite());
        if finite { Ok(()) } else { Err(Error::NonFiniteView) }
    }

    /// Checks that a depth image with `got` numbers has this view's size.
    pub(crate) fn check_length(&self, got: usize) -> Result<(), Error> {
        let expected = self.width as usize * self.height as usize;
        if got == expected {
            Ok(())
        } else {
            Err(Error::DepthLength { expected, got, width: self.width, height: self.height })
        }
    }

    /// All pixels of the image.
    pub(crate) fn image(&self) -> Block {
        Block { x: [0, self.width], y: [0, self.height] }
    }
}

/// Which part of a pixel counts when a volume touches it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coverage {
    /// The whole closed square: nothing that overlaps the pixel may be hidden.
    #[default]
    Area,
    /// The centre alone, for images with one sample per pixel.
    /// A volume that covers no sample cannot be seen there.
    Sample,
}

/// A rectangle of pixels, half open: columns `x[0]..x[1]`, rows `y[0]..y[1]`.
/// Never empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) x: [u32; 2],
    pub(crate) y: [u32; 2],
}

impl Block {
    pub(crate) fn is_pixel(self) -> bool {
        self.x[1] - self.x[0] == 1 && self.y[1] - self.y[0] == 1
    }

    /// The two halves across the longer side.
    /// The block must not be a single pixel.
    pub(crate) fn halves(self) -> [Block; 2] {
        let Block { x, y } = self;
        if x[1] - x[0] >= y[1] - y[0] {
            let middle = x[0].midpoint(x[1]);
            [[x[0], middle], [middle, x[1]]].map(|x| Block { x, y })
        } else {
            let middle = y[0].midpoint(y[1]);
            [[y[0], middle], [middle, y[1]]].map(|y| Block { x, y })
        }
    }
}

/// The clip coordinates of a volume's points, as functions of its local coordinates (see
/// [`Frame`]).
#[derive(Debug)]
pub(crate) struct Clip<S> {
    /// Image width times clip x.
    /// Pixel edges then have whole-numbered coefficients, and so they do for `height_y`, image
    /// height times clip y.
    pub(crate) width_x: Form<S>,
    pub(crate) height_y: Form<S>,
    pub(crate) z: Form<S>,
    pub(crate) w: Form<S>,
}

impl<S: Scalar> Clip<S> {
    pub(crate) fn new(view: &View, frame: &Frame<S>) -> Clip<S> {
        let [x, y, z, w] = &view.rows;
        Clip {
            width_x: frame.form(x).scaled(f64::from(view.width)),
            height_y: frame.form(y).scaled(f64::from(view.height)),
            z: frame.form(z),
            w: frame.form(w),
        }
    }

    /// `z - depth w`, signed so that it is positive if a point lies strictly farther than `depth`.
    pub(crate) fn beyond(&self, depth: f32, reversed: bool) -> Form<S> {
        let threshold = self.w.scaled(f64::from(depth));
        if reversed { threshold.minus(&self.z) } else { self.z.minus(&threshold) }
    }

    /// [`Clip::inside`] the block and not farther than `depth`: what a pixel of that depth does not
    /// hide.
    pub(crate) fn inside_and_before(
        &self,
        view: &View,
        block: Block,
        coverage: Coverage,
        depth: f32,
    ) -> Vec<Constraint<S>> {
        let mut all = self.inside(view, block, coverage);
        // The last two conditions are z >= 0 and w - z >= 0.
        // One of them follows from the new condition and the other one, so it is removed.
        // At the near plane's depth it does not follow: there both are needed to keep w from being
        // negative.
        let at_near_plane = depth == if view.reversed { 1.0 } else { 0.0 };
        if !at_near_plane {
            all.remove(all.len() - if view.reversed { 2 } else { 1 });
        }
        all.push(Constraint::at_least_zero(self.beyond(depth, !view.reversed)));
        all
    }

    /// [`Clip::inside`] the block and not nearer than `depth`.
    pub(crate) fn inside_and_behind(
        &self,
        view: &View,
        block: Block,
        coverage: Coverage,
        depth: f32,
    ) -> Vec<Constraint<S>> {
        let mut all = self.inside(view, block, coverage);
        all.push(Constraint::at_least_zero(self.beyond(depth, view.reversed)));
        all
    }

    /// The conditions under which a point is inside the frustum and inside the block.
    /// For samples, the block is the hull of the samples; otherwise its closed rectangle.
    ///
    /// `w > 0` needs no condition of its own.
    /// `0 <= z <= w` gives `w >= 0`, and `w = 0` leaves only points with `x = y = z = w = 0`.
    /// A matrix of full rank has no such point.
    /// For a singular matrix such a point counts as inside, so the answer errs towards visible.
    pub(crate) fn inside(
        &self,
        view: &View,
        block: Block,
        coverage: Coverage,
    ) -> Vec<Constraint<S>> {
        let inset = match coverage {
            Coverage::Area => 0.0,
            Coverage::Sample => 1.0,
        };
        // Edges in half pixels: then samples are whole numbers too, and all of them are exact.
        let edges =
            |[from, to]: [u32; 2]| (2.0 * f64::from(from) + inset, 2.0 * f64::from(to) - inset);
        let (width, height) = (f64::from(view.width), f64::from(view.height));
        let (left, right) = edges(block.x);
        let (top, bottom) = edges(block.y);

        let mut all = Vec::with_capacity(6);
        // From x_pixel >= left/2, times 2w: width x - (left - width) w >= 0.
        // From y_pixel >= top/2: (height - top) w - height y >= 0.
        let from_left = self.width_x.minus(&self.w.scaled(left - width));
        let from_top = self.w.scaled(height - top).minus(&self.height_y);
        if left == right {
            all.push(Constraint::zero(from_left));
        } else {
            all.push(Constraint::at_least_zero(from_left));
            all.push(Constraint::at_least_zero(self.w.scaled(right - width).minus(&self.width_x)));
        }
        if top == bottom {
            all.push(Constraint::zero(from_top));
        } else {
            all.push(Constraint::at_least_zero(from_top));
            all.push(Constraint::at_least_zero(
                self.height_y.minus(&self.w.scaled(height - bottom)),
            ));
        }
        all.push(Constraint::at_least_zero(self.z.clone()));
        all.push(Constraint::at_least_zero(self.w.minus(&self.z)));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_partition_a_block() {
        let block = Block { x: [3, 8], y: [2, 4] };
        let [a, b] = block.halves();
        assert_eq!((a.x, b.x), ([3, 5], [5, 8]));
        assert_eq!((a.y, b.y), (block.y, block.y));
        let column = Block { x: [0, 1], y: [0, 2] };
        let [a, b] = column.halves();
        assert_eq!((a.y, b.y), ([0, 1], [1, 2]));
        assert!(!column.is_pixel() && a.is_pixel() && b.is_pixel());
    }
}
