//! `lod.wgsl`: whether a LOD is allowed, in any arithmetic.

use hiz_core::BoundsKind;

use super::volume::Volume;
use super::{Arithmetic, Certificates, Margins, Value, View};

/// `LEAST_NORMAL`.
const LEAST_NORMAL: f32 = f32::MIN_POSITIVE;
/// `LARGEST_DEVIATION`: 2^60.
const LARGEST_DEVIATION: f32 = f32::from_bits((127 + 60) << 23);
const EPS: f32 = 1.0 / 8_388_608.0;
/// `NEED_FACTOR`, the whole of it.
pub(crate) const NEED_FACTOR: f32 = 1.0 + 4.0 * EPS;
/// `RADIUS_FACTOR`, `RADIUS_FLOOR` and `ROOT_FACTOR` of `bounds_box_support.wgsl`.
const RADIUS_FACTOR: f32 = 1.0 + 32.0 * EPS;
const RADIUS_FLOOR: f32 = f32::from_bits((127 - 100) << 23);
const ROOT_FACTOR: f32 = 1.0 + 8.0 * EPS;

/// What a need is made of, besides the factor in the view.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Need {
    /// The LOD's error and the instance's scale.
    Error(f32, f32),
    /// The radius of the bounds, for the LOD after the full mesh.
    Size,
}

/// The view's uniform, as the choice of LODs reads it.
#[derive(Debug)]
pub(crate) struct LodMirror {
    view: View,
    needs: [f32; 2],
}

impl LodMirror {
    /// `needs` is the word at which `lod_needs` begins.
    pub(crate) fn new(words: &[u32], needs: usize) -> Self {
        let needs = [0, 1].map(|k| f32::from_bits(words[needs + k]));
        Self { view: View::new(words), needs }
    }

    /// Whether the LOD with this need is allowed.
    /// `need_factor` stands for [`NEED_FACTOR`].
    pub(crate) fn allows(
        &self,
        (kind, record): (BoundsKind, &[u32]),
        need: Need,
        (margins, need_factor): (impl Into<Margins>, f32),
        arithmetic: &mut Arithmetic,
    ) -> bool {
        let margins = margins.into();
        let Some(volume) = Volume::load(kind, record, &self.view, &margins, arithmetic) else {
            return false;
        };
        let mut c = Certificates { kind, margins, arithmetic };
        let w = c.value_of(&self.view.w, &volume);
        c.arithmetic.part();
        let factors = match need {
            Need::Error(error, scale) => {
                [error.max(LEAST_NORMAL), scale.max(LEAST_NORMAL), self.needs[0]]
            }
            Need::Size => [volume.radius(c.arithmetic), self.needs[1], 1.0],
        };
        let all_but_last = c.product(factors);
        c.surely_farther(&w, all_but_last, need_factor)
    }
}

impl Certificates<'_> {
    /// The product, in the order written or in any other.
    fn product(&mut self, mut factors: [f32; 3]) -> f32 {
        if self.arithmetic.style.reassociated {
            factors.swap(0, self.arithmetic.below(3) as usize);
        }
        let first = self.arithmetic.mul(factors[0], factors[1]).min(LARGEST_DEVIATION);
        self.arithmetic.mul(first, factors[2])
    }

    /// `surely_farther` of the need that is the product of the last two arguments.
    fn surely_farther(&mut self, w: &Value, need: f32, need_factor: f32) -> bool {
        self.arithmetic.part();
        let center = if self.arithmetic.takes_any_order() {
            let terms = [(w.center, 1.0), (-need, need_factor), (-w.error, 1.0)];
            self.arithmetic.sum_in_any_order(terms)
        } else {
            let difference = self.arithmetic.mul_add(-need, need_factor, w.center);
            self.arithmetic.sub(difference, w.error)
        };
        self.exceeds_support(center, w.half)
    }
}

impl Volume {
    /// `radius_of`.
    fn radius(&self, f: &mut Arithmetic) -> f32 {
        let [e, g, h] = self.half_axes;
        if self.kind == BoundsKind::Sphere {
            return e[0];
        }
        let mut longest = 0.0_f32;
        for (second, third) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let diagonal = [0, 1, 2].map(|k| f.sum([e[k], second * g[k], third * h[k]]));
            longest = longest.max(f.sum_of_products(diagonal, diagonal, None));
        }
        let square = f.mul_add(longest, RADIUS_FACTOR, RADIUS_FLOOR);
        // A wild root fails the check at times, and passes it by chance.
        let guess = if f.style.wild { 0.5 + f.below(1024) as f32 / 1024.0 } else { 1.0 };
        let root = f.mul(square.sqrt() * guess, ROOT_FACTOR);
        let added = self.half_axes.map(|axis| f.sum(axis.map(f32::abs)));
        let added = f.sum(added);
        if f.mul(root, root) >= square { root } else { f.mul(added, RADIUS_FACTOR) }
    }
}
