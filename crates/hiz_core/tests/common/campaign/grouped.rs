//! A round that is culled in groups.
//! Each volume is repeated, so that some groups hold nothing else.
//! The boxes of those groups are as nearly undecided as the volume itself.

use hiz_core::headless::Engine;
use hiz_core::{Coverage, CullOptions, Hierarchy, InstanceOptions, Outputs, StoredOrder, Verdict};

use super::{Arrays, Round};
use crate::common::Random;

/// How many instances a cull in groups tested one by one, and what contradicts the flat cull.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Tested {
    /// All instances.
    pub(crate) instances: u64,
    /// Those that were tested by themselves.
    pub(crate) one_by_one: u64,
    /// Must be 0.
    /// The sum of four counts:
    ///
    /// - instances that are kept with groups alone;
    /// - the difference between the demand and the kept bits;
    /// - the difference between counted verdicts and those in the list;
    /// - verdicts that groups change, other than hiding a few more.
    pub(crate) contradictions: u64,
}

impl Tested {
    pub(crate) fn add(&mut self, other: Self) {
        self.instances += other.instances;
        self.one_by_one += other.one_by_one;
        self.contradictions += other.contradictions;
    }
}

impl Round {
    /// The masks that the device gives with groups, for each kind, in a random stored order.
    /// A volume counts as kept if all of its copies are kept.
    /// `None` for a camera that is refused.
    pub(crate) fn grouped_masks(&self, engine: &Engine) -> Option<(Vec<Vec<bool>>, Tested)> {
        let random = &mut Random(self.seed ^ (self.number as u64) << 32);
        // Whole groups of one volume, groups of a few volumes, and one group of everything.
        let copies = random.pick(&[64, 64, 21, 1]);
        let order = random.pick(&[StoredOrder::Morton, StoredOrder::Given]);
        let is_area = self.options.coverage == Coverage::Area;
        let image = self.upload(engine);
        let pyramid = engine.pyramid_with(&image, &self.pyramid_options(engine)).expect("pyramid");
        let mut masks = Vec::new();
        let mut tested = Tested::default();
        for (kind, volumes) in &self.volumes {
            let many: Vec<_> = volumes.iter().flat_map(|volume| vec![*volume; copies]).collect();
            let arrays = Arrays::new(&many);
            let options = InstanceOptions { order, ..InstanceOptions::default() };
            let instances = engine.instances(&arrays.bounds(*kind), &options).expect("instances");
            let cull = |hierarchy| {
                let options = CullOptions { hierarchy, ..self.options.clone() };
                engine.cull(&instances, &self.camera, &pyramid, &options, &Outputs::default())
            };
            let (flat_cull, grouped) = match (cull(Hierarchy::Never), cull(Hierarchy::Always)) {
                (Ok(flat), Ok(grouped)) => (flat, grouped),
                (Err(hiz_core::Error::Invalid { .. }), _) => return None,
                (Err(error), _) | (_, Err(error)) => panic!("{error}"),
            };
            let (flat, mask) = (flat_cull.mask().expect("mask"), grouped.mask().expect("mask"));
            let (counts, verdicts) =
                (grouped.counts().expect("counts"), grouped.verdicts().expect("verdicts"));
            let alone = flat_cull.verdicts().expect("verdicts");
            let pairs = alone.chunks_exact(copies).zip(verdicts.chunks_exact(copies)).zip(volumes);
            let changed = pairs.map(|((alone, verdicts), volume)| {
                // Outside by the certificate of the group's box, which is not the volume's own.
                let by_box = alone.iter().zip(verdicts).filter(|(alone, verdict)| {
                    matches!(alone, Verdict::Occluded | Verdict::Visible)
                        && **verdict == Verdict::Outside
                });
                let by_box = by_box.count() as u64;
                let is_right = by_box == 0
                    || !is_area
                    || hiz_ref::is_outside(&self.view, volume).expect("a finite view");
                let others = alone.iter().zip(verdicts).filter(|pair| {
                    let known = matches!(
                        pair,
                        (Verdict::Occluded | Verdict::Visible, Verdict::Outside)
                            | (Verdict::Visible, Verdict::Occluded)
                    );
                    !known && pair.0 != pair.1
                });
                others.count() as u64 + if is_right { 0 } else { by_box }
            });
            let counted = [
                counts.outside,
                counts.occluded,
                counts.visible,
                counts.invalid,
                counts.unoccluded,
            ];
            let wrong_counts = (0..5).map(|verdict| {
                counted[verdict]
                    .abs_diff(verdicts.iter().filter(|v| **v as usize == verdict).count() as u64)
            });
            let kept = mask.iter().filter(|kept| **kept).count() as u64;
            let kept_alone =
                flat.iter().zip(&mask).filter(|(flat, grouped)| **grouped && !**flat).count()
                    as u64;
            tested.add(Tested {
                instances: many.len() as u64,
                one_by_one: counts.tested_instances,
                contradictions: kept_alone
                    + counts.demand.abs_diff(kept)
                    + changed.sum::<u64>()
                    + wrong_counts.sum::<u64>(),
            });
            masks.push(
                mask.chunks_exact(copies).map(|copies| copies.iter().all(|kept| *kept)).collect(),
            );
        }
        Some((masks, tested))
    }
}
