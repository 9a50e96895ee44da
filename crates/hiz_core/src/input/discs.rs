//! Discs that face the camera, drawn into a depth image on the host.
//!
//! Discs are drawn as they come.
//! Where they have covered the image many times over, the others are sorted and the nearest go
//! first, so that each pixel is drawn once.
//! So the radius of the discs does not matter much to the time.

use std::ops::Range;

use crate::input::image::{DepthConvention, ImageSize};

/// So many images' pixels are drawn before the discs that are left are sorted.
///
/// Small discs stay below it, and a sort costs more than it saves them.
const TIMES_COVERED: u64 = 8;

/// The square root that bounds a disc in a row loses at most this share of the reach.
///
/// Near a disc's upper and lower end it is that of the difference of two numbers near 1.
/// Both and what [`Disc::covers`] adds are off by less than 40 ulps, and `1e-14` has that root.
const ROOM: f64 = 1e-7;

/// Beyond this reach, in pixels, a row is not cut.
const GREATEST_REACH: f64 = 1e12;

/// A disc in the image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Disc {
    /// Its middle: column and row in pixels.
    pub(super) at: [f64; 2],
    /// Its half axes in pixels; they may be infinite.
    pub(super) reach: [f64; 2],
    /// Its depth in the image's convention.
    pub(super) depth: f32,
}

impl Disc {
    /// The pixels that it may cover along an axis: its own, and those with a centre within reach.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the image before"
    )]
    fn span(&self, axis: usize, side: u32) -> Range<usize> {
        let (at, reach) = (self.at[axis], self.reach[axis]);
        let clamp = |v: f64| v.clamp(0.0, f64::from(side)) as usize;
        let own = at.floor();
        let first = (at - reach - 0.5).ceil().min(own);
        let end = ((at + reach - 0.5).floor() + 1.0).max(own + 1.0);
        clamp(first)..clamp(end)
    }

    fn spans(&self, size: ImageSize) -> [Range<usize>; 2] {
        [self.span(0, size.width), self.span(1, size.height)]
    }

    /// How far a pixel's centre is from the middle along an axis, in reaches.
    /// The pixel in which the middle lies counts as 0.
    fn share(&self, axis: usize, pixel: usize) -> f64 {
        let distance = (pixel as f64 + 0.5 - self.at[axis]).abs();
        if distance <= 0.5 { 0.0 } else { distance / self.reach[axis] }
    }

    fn covers(&self, x: usize, y: usize) -> bool {
        let [u, v] = [self.share(0, x), self.share(1, y)];
        u * u + v * v <= 1.0
    }
}

/// The nearest depth of the discs that cover each pixel, and far where none does.
pub(super) fn draw_discs(
    mut discs: impl Iterator<Item = Disc>,
    size: ImageSize,
    convention: DepthConvention,
) -> Vec<f32> {
    let mut image =
        Image { pixels: vec![convention.far(); size.pixels() as usize], size, convention };
    let mut left = TIMES_COVERED * size.pixels();
    for disc in discs.by_ref() {
        let visited = image.draw(&disc);
        if visited > left {
            break;
        }
        left -= visited;
    }
    let mut rest: Vec<_> = discs.collect();
    rest.sort_unstable_by(|a, b| a.depth.total_cmp(&b.depth));
    if convention.is_reversed() {
        rest.reverse();
    }
    if !rest.is_empty() {
        image.draw_nearest_first(&rest);
    }
    image.pixels
}

/// A depth image that is drawn.
struct Image {
    pixels: Vec<f32>,
    size: ImageSize,
    convention: DepthConvention,
}

impl Image {
    /// Draws one disc; returns how many pixels it looked at.
    fn draw(&mut self, disc: &Disc) -> u64 {
        let [columns, rows] = disc.spans(self.size);
        for y in rows.clone() {
            for x in columns.clone().filter(|x| disc.covers(*x, y)) {
                self.put(x, y, disc.depth);
            }
        }
        (columns.len() * rows.len()) as u64
    }

    fn put(&mut self, x: usize, y: usize, depth: f32) {
        let pixel = &mut self.pixels[y * self.size.width as usize + x];
        let is_nearer = if self.convention.is_reversed() { depth > *pixel } else { depth < *pixel };
        if is_nearer {
            *pixel = depth;
        }
    }

    /// Draws discs that come from the nearest to the farthest.
    /// Of them only the first that covers a pixel matters to it.
    fn draw_nearest_first(&mut self, discs: &[Disc]) {
        let [width, height] = [self.size.width, self.size.height].map(|side| side as usize);
        let mut open_columns: Vec<_> = (0..height).map(|_| OpenPixels::new(width)).collect();
        let mut open_rows = OpenPixels::new(height);
        for disc in discs {
            let [columns, rows] = disc.spans(self.size);
            let mut y = open_rows.next(rows.start);
            while y < rows.end {
                let row = &mut open_columns[y];
                let inside = inside_of_row(disc, columns.clone(), y);
                let mut x = row.next(inside.start);
                while x < inside.end {
                    if disc.covers(x, y) {
                        self.put(x, y, disc.depth);
                        row.close(x);
                    }
                    x = row.next(x + 1);
                }
                if row.next(0) == width {
                    open_rows.close(y);
                }
                y = open_rows.next(y + 1);
            }
            if open_rows.next(0) == height {
                return;
            }
        }
    }
}

/// The columns of a disc that it may cover in a row; [`Disc::covers`] decides about each.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, and the result is cut to the columns"
)]
fn inside_of_row(disc: &Disc, columns: Range<usize>, y: usize) -> Range<usize> {
    let (at, reach, v) = (disc.at[0], disc.reach[0], disc.share(1, y));
    if reach > GREATEST_REACH {
        return columns;
    }
    let half = reach * (1.0 - v * v).max(0.0).sqrt() + (1.0 + ROOM * reach);
    let first = (at - half - 0.5).floor() as usize;
    let end = (at + half + 1.5).ceil() as usize;
    first.max(columns.start)..end.min(columns.end)
}

/// The pixels of a row, or the rows of an image, that no disc has closed.
///
/// Each entry leads to itself while it is open, and otherwise to one behind it.
/// Source: Tarjan, "Efficiency of a Good But Not Linear Set Union Algorithm", JACM 1975.
struct OpenPixels(Vec<u32>);

impl OpenPixels {
    #[expect(clippy::cast_possible_truncation, reason = "at most the side of an image")]
    fn new(count: usize) -> Self {
        Self((0..=count as u32).collect())
    }

    /// The first open one from `from` on, or their number.
    fn next(&mut self, from: usize) -> usize {
        let mut at = from.min(self.0.len() - 1);
        while self.0[at] as usize != at {
            // Halves the way for those that come later.
            self.0[at] = self.0[self.0[at] as usize];
            at = self.0[at] as usize;
        }
        at
    }

    fn close(&mut self, at: usize) {
        self.0[at] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Discs of all sizes, also without end, around and inside of an image.
    fn discs(count: u32, size: ImageSize, longest: f64) -> Vec<Disc> {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31)
        };
        let sides = [size.width, size.height].map(f64::from);
        let mut some = Vec::new();
        for k in 0..count {
            let mut at = sides.map(|side| (2.0 * random() - 0.5) * side);
            let reach = [longest * random(), longest * random()];
            if longest > 1e3 {
                // Their edges cross the image.
                let turn = std::f64::consts::TAU * random();
                at = [at[0] + reach[0] * turn.cos(), at[1] + reach[1] * turn.sin()];
                if k % 4 == 0 {
                    // Their lowest points lie in a row of pixel centres, where rounding decides.
                    at = [sides[0] / 2.0, f64::from(k % size.height) + 0.5 - reach[1]];
                }
            }
            let reach = if k % 97 == 5 { [f64::INFINITY, 1e300] } else { reach };
            // Some without an end to their sides have their uppermost point in such a row.
            let (at, reach) = if k % 97 == 6 {
                ([at[0], f64::from(k % size.height) + 3.5], [f64::INFINITY, 3.0])
            } else {
                (at, reach)
            };
            // Some depths are equal.
            let depth = if k % 3 == 0 { 0.25 } else { 0.1 + 0.8 * random() as f32 };
            some.push(Disc { at, reach, depth });
        }
        some
    }

    /// Pixel by pixel, by the definition.
    fn expected(discs: &[Disc], size: ImageSize, reversed: bool) -> Vec<f32> {
        let mut image = Vec::new();
        for y in 0..size.height {
            for x in 0..size.width {
                let centre = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                let depths = discs.iter().filter(|disc| {
                    let shares = [0, 1].map(|k| {
                        let away = (centre[k] - disc.at[k]).abs();
                        if away <= 0.5 { 0.0 } else { away / disc.reach[k] }
                    });
                    shares[0] * shares[0] + shares[1] * shares[1] <= 1.0
                });
                let depths = depths.map(|disc| disc.depth);
                image.push(if reversed {
                    depths.fold(0.0, f32::max)
                } else {
                    depths.fold(1.0, f32::min)
                });
            }
        }
        image
    }

    const CASES: [(u32, f64); 8] = [
        (9, 1.5),
        (200, 2.0),
        (300, 12.0),
        (400, 80.0),
        (300, 1e5),
        (300, 1e8),
        (300, 1e10),
        (300, 1e14),
    ];

    #[test]
    fn every_order_draws_the_nearest_of_all_that_cover_a_pixel() {
        for (width, height) in [(31, 17), (1, 40), (64, 1), (1, 1)] {
            let size = ImageSize::new(width, height);
            for (count, longest) in CASES {
                // Without the endless ones, so that some pixels stay open.
                let mut some = discs(count, size, longest);
                some.retain(|disc| longest == 80.0 || disc.reach[0].is_finite());
                for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
                    let reversed = convention.is_reversed();
                    let right = expected(&some, size, reversed);
                    let empty = || vec![convention.far(); right.len()];
                    let mut image = Image { pixels: empty(), size, convention };
                    for disc in &some {
                        image.draw(disc);
                    }
                    assert_eq!(image.pixels, right, "{width}x{height}, {count} as they come");
                    let mut sorted = some.clone();
                    sorted.sort_by(|a, b| a.depth.total_cmp(&b.depth));
                    if reversed {
                        sorted.reverse();
                    }
                    let mut image = Image { pixels: empty(), size, convention };
                    image.draw_nearest_first(&sorted);
                    assert_eq!(image.pixels, right, "{width}x{height}, {count} nearest first");
                    let both = draw_discs(some.iter().copied(), size, convention);
                    assert_eq!(both, right, "{width}x{height}, {count} discs");
                }
            }
        }
    }

    #[test]
    fn what_a_disc_covers_of_a_row_lies_inside_of_it() {
        let size = ImageSize::new(101, 23);
        for (count, longest) in CASES {
            for disc in discs(count, size, longest) {
                let [columns, rows] = disc.spans(size);
                for y in rows {
                    let inside = inside_of_row(&disc, columns.clone(), y);
                    let mut covered = columns.clone().filter(|x| disc.covers(*x, y));
                    assert!(covered.all(|x| inside.contains(&x)), "{disc:?}, row {y}");
                }
            }
        }
    }

    #[test]
    fn discs_larger_than_the_image_take_the_time_of_the_image() {
        let size = ImageSize::new(1920, 1080);
        // One of them draws the image; 20,000 images one after the other would take minutes.
        let disc = |k: u32| {
            let depth = 0.9 - 1e-6 * k as f32;
            Disc { at: [900.5, 500.5], reach: [1e6; 2], depth }
        };
        let start = std::time::Instant::now();
        let image = draw_discs((0..20_000).map(disc), size, DepthConvention::Standard);
        assert!(image.iter().all(|depth| *depth == disc(19_999).depth));
        assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    }
}
