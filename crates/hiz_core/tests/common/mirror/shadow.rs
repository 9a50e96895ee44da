//! `shadow.wgsl` once more, on the host: the sweep of a caster, and the certificates on it.

use hiz_core::{BoundsKind, Camera, CullOptions};

use super::{Arithmetic, Certificates, EPS, Margins, Row, Value, View, Volume, two_to};

/// Where the fields for casters begin among the words of `View`.
const FIELDS: usize = 56;

/// The light's numbers and the view's, as the shader reads them.
#[derive(Debug)]
pub(crate) struct ShadowMirror {
    view: View,
    half_sweeps: [f32; 4],
    steepness: [f32; 4],
    exits: [f32; 3],
    filter_radius: f32,
    exit_rates: [f32; 3],
    light_slope: f32,
    exit_size: f32,
    light_size: f32,
}

/// A caster's sweep, and its rows: x, y, z, w.
#[derive(Debug)]
pub(crate) struct SweptCaster {
    pub(crate) length: f32,
    values: [Value; 4],
    along: [f32; 4],
}

impl ShadowMirror {
    /// `None` for a camera that is refused.
    pub(crate) fn new(camera: &Camera, options: &CullOptions) -> Option<Self> {
        let words = hiz_core::testing::words::view(camera, options).ok()?;
        let one = |i: usize| f32::from_bits(words[FIELDS + i]);
        let three = |i: usize| [0, 1, 2].map(|k| one(i + k));
        let four = |i: usize| [0, 1, 2, 3].map(|k| one(i + k));
        Some(Self {
            view: View::new(&words),
            half_sweeps: four(0),
            steepness: four(4),
            exits: three(8),
            filter_radius: one(11),
            exit_rates: three(12),
            light_slope: one(15),
            exit_size: one(16),
            light_size: one(17),
        })
    }

    /// A in `z = A w + Z'`.
    pub(crate) fn z_slope(&self) -> f32 {
        self.view.z_slope
    }

    /// The caster of a record, swept; `None` if it is invalid, or if no receiver is in its shadow.
    ///
    /// `ulps`: the margin of the certificates.
    pub(crate) fn swept(
        &self,
        kind: BoundsKind,
        record: &[u32],
        ulps: f32,
        f: &mut Arithmetic,
    ) -> Option<SweptCaster> {
        let volume = Volume::load(kind, record, &self.view, &Margins::FULL, f)?;
        let length = self.sweep_of(&volume, f);
        if length < 0.0 {
            return None;
        }
        let growth = f.mul_add(length, self.light_slope, self.filter_radius);
        let size = f.mul_add(length, self.light_size, volume.size);
        let sized = Volume { size, ..volume };
        let view = &self.view;
        let mut certificates = Certificates { kind, margins: ulps.into(), arithmetic: f };
        let rows: [&Row; 4] = [&view.x, &view.y, &view.z, &view.w];
        let mut along = [0.0; 4];
        let values = [0, 1, 2, 3].map(|r| {
            let value = certificates.value_of(rows[r], &sized);
            let f = &mut *certificates.arithmetic;
            along[r] = f.mul(length, self.half_sweeps[r]);
            Value {
                center: f.add(value.center, along[r]),
                error: f.mul_add(growth, self.steepness[r], value.error),
                half: value.half,
            }
        });
        Some(SweptCaster { length, values, along })
    }

    fn sweep_of(&self, volume: &Volume, f: &mut Arithmetic) -> f32 {
        let sizes = f.add(volume.size, self.exit_size);
        let rounding = f.mul_add(24.0 * EPS, sizes, two_to(-70));
        let more = f.add(self.filter_radius, rounding);
        let mut shortest = two_to(100);
        for k in (0..3).filter(|k| self.exit_rates[*k] != 0.0) {
            let own = match volume.kind {
                BoundsKind::Sphere => volume.half_axes[0][0],
                _ => f.sum([0, 1, 2].map(|e| volume.half_axes[e][k].abs())),
            };
            let reach = f.add(own, more);
            let way = f.sub(self.exits[k], volume.center[k]);
            let reached = f.mul(reach, self.exit_rates[k].abs());
            shortest = shortest.min(f.mul_add(way, self.exit_rates[k], reached));
        }
        shortest
    }

    /// Whether the certificate says that `sign (r - t w) > 0` on all of the swept volume.
    /// `row`: 0 for x, 1 for y, 2 for z.
    pub(crate) fn surely(
        &self,
        kind: BoundsKind,
        caster: &SweptCaster,
        (sign, row, t): (f32, usize, f32),
        f: &mut Arithmetic,
    ) -> bool {
        let (r, w) = (caster.values[row], caster.values[3]);
        let across = f.mul_add(-t, caster.along[3], caster.along[row]).abs();
        let against = Value { error: f.add(r.error, across), ..r };
        let mut certificates = Certificates { kind, margins: Margins::FULL, arithmetic: f };
        certificates.surely(sign, &against, t, &w)
    }
}
