//! `unoccluded.wgsl` and the third answer of `classify.wgsl`, without a descent.

use hiz_core::BoundsKind;

use super::{
    Arithmetic, Certificates, LEAST_NORMAL, LEAST_W, Margins, Mirror, Value, View, Volume,
    pixel_interval,
};

impl Mirror {
    /// Which volumes surely show in an image, for each kind.
    /// Their footprint is all pixels of the rectangle, or one pixel more on each side.
    pub(crate) fn unoccluded(
        &self,
        depth: &[f32],
        margins: impl Into<Margins>,
        arithmetic: &mut Arithmetic,
    ) -> Vec<Vec<bool>> {
        let margins = margins.into();
        let of_kind = |(kind, words): &(BoundsKind, Vec<u32>)| {
            let records = words.chunks_exact(kind.record_bytes() as usize / 4);
            records.map(|r| self.shows(*kind, r, depth, margins, arithmetic)).collect()
        };
        self.words.iter().map(of_kind).collect()
    }

    fn shows(
        &self,
        kind: BoundsKind,
        record: &[u32],
        depth: &[f32],
        margins: Margins,
        arithmetic: &mut Arithmetic,
    ) -> bool {
        let view = &self.view;
        let Some(volume) = Volume::load(kind, record, view, &margins, arithmetic) else {
            return false;
        };
        let mut c = Certificates { kind, margins, arithmetic };
        let [x, y, z, w] = [&view.x, &view.y, &view.z, &view.w].map(|row| c.value_of(row, &volume));
        let w_min = c.least_w(&w);
        if w_min.is_nan() || w_min <= LEAST_W || !self.surely_inside([&x, &y, &z, &w], &mut c) {
            return false;
        }
        // Guesses, which may be wild.
        let extents = [0, 1].map(|k| c.extent_of([&x, &y][k], &w, view.half_size[k]));
        let mut block = [[0; 2]; 2];
        for (k, side) in block.iter_mut().enumerate() {
            *side = pixel_interval(&extents[k], 1.25 / w_min, view, k);
            if c.arithmetic.style.wild && side[0] < side[1] && c.arithmetic.below(2) == 0 {
                side[c.arithmetic.below(2) as usize] = side[1];
            }
            if side[0] > side[1] {
                return false;
            }
        }
        let near = if self.reversed { 1.0 } else { 0.0 };
        let nearest = (block[1][0]..=block[1][1])
            .flat_map(|row| (block[0][0]..=block[0][1]).map(move |column| (row, column)))
            .map(|(row, column)| depth[(row * view.size[0] + column) as usize])
            .map(|d| if (0.0..=1.0).contains(&d) { d } else { near })
            .reduce(if self.reversed { f32::max } else { f32::min })
            .expect("a pixel");
        if !self.surely_in_front(nearest, &z, &w, &mut c) {
            return false;
        }
        let mut inside = |r: &Value, axis: usize| {
            let [first, last] = block[axis];
            let begin = first as f32 + view.reach - view.half_size[axis];
            let end = (last + 1) as f32 - view.reach - view.half_size[axis];
            (first == 0 || c.surely_after(r, &w, &extents[axis], begin, w_min))
                && (last + 1 >= view.size[axis]
                    || c.surely_before(r, &w, &extents[axis], end, w_min))
        };
        inside(&x, 0) && inside(&y, 1)
    }

    fn surely_in_front(&self, stored: f32, z: &Value, w: &Value, c: &mut Certificates<'_>) -> bool {
        let View { near_factor, near_offset, z_slope, .. } = self.view;
        c.arithmetic.part();
        let far = if self.reversed { 0.0 } else { 1.0 };
        let flushed = if stored < LEAST_NORMAL { 0.0 } else { stored };
        let d = if flushed == far {
            if self.reversed { LEAST_NORMAL } else { 1.0 }
        } else {
            let least = if self.reversed { flushed.max(LEAST_NORMAL) } else { flushed };
            c.arithmetic.mul_add(least, near_factor, near_offset)
        };
        c.surely_deeper(if self.reversed { 1.0 } else { -1.0 }, z, d, z_slope, w)
    }

    fn surely_inside(&self, [x, y, z, w]: [&Value; 4], c: &mut Certificates<'_>) -> bool {
        let view = &self.view;
        let guard = view.reach + if self.sample_coverage { 0.5 } else { 0.0 };
        let border = view.half_size.map(|h| h - guard);
        let far_plane = c.arithmetic.sub(1.0, view.z_slope);
        c.surely_below(x, border[0], w)
            && c.surely_above(x, -border[0], w)
            && c.surely_below(y, border[1], w)
            && c.surely_above(y, -border[1], w)
            && c.surely_above(z, -view.z_slope, w)
            && c.surely_below(z, far_plane, w)
    }
}
