//! What a submitted cull has to know of later updates of its instances, and they of it.
//!
//! Verdicts of the members of hidden groups are refined when they are first read
//! (`cull::Refinement`), from the bounds that were culled.
//! So an update refines those of all submitted culls first; and notes which instances it changed,
//! so that an explanation, which tests the bounds as they are now, can say that they are not the
//! ones that were culled.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, MutexGuard, Weak};

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::host::threads::Locked;

/// What is left to be done of a cull before its instances change.
pub(crate) trait Refine: std::fmt::Debug + Send + Sync {
    /// Records it.
    /// It may run more than once, and the first time counts.
    fn record(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) -> Result<()>;
}

/// One submitted cull.
/// It lives as long as its answer may be read.
#[derive(Debug)]
pub(crate) struct Watch {
    state: Locked<State>,
}

#[derive(Debug)]
struct State {
    /// Until the commands that refine the verdicts were submitted, behind the cull and before any
    /// update.
    refinement: Option<Box<dyn Refine>>,
    /// The instances that were updated since: from the first to before the last, apart and not
    /// touching.
    updated: BTreeMap<u32, u32>,
}

impl Watch {
    /// Of a cull that leaves `refinement` to be done, if any.
    pub(crate) fn new(refinement: Option<Box<dyn Refine>>) -> Arc<Self> {
        Arc::new(Self { state: Locked::new(State { refinement, updated: BTreeMap::new() }) })
    }

    /// Whether any of `instances` was updated since the cull was submitted.
    pub(crate) fn is_updated(&self, instances: &Range<u32>) -> bool {
        let state = self.state();
        state
            .updated
            .range(..instances.end)
            .next_back()
            .is_some_and(|(_, end)| *end > instances.start)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }
}

impl State {
    fn note(&mut self, range: &Range<u32>) {
        if range.is_empty() {
            return;
        }
        let Range { mut start, mut end } = *range;
        // All that overlap or touch it become one with it.
        while let Some((first, last)) =
            self.updated.range(..=end).next_back().map(|(first, last)| (*first, *last))
        {
            if last < start {
                break;
            }
            self.updated.remove(&first);
            (start, end) = (start.min(first), end.max(last));
        }
        self.updated.insert(start, end);
    }
}

/// The submitted culls of some instances.
#[derive(Debug, Default)]
pub(crate) struct Watches {
    all: Vec<Weak<Watch>>,
    /// From how many on those that are gone are looked for.
    full: usize,
}

impl Watches {
    /// A cull, submitted just now.
    pub(crate) fn add(&mut self, watch: &Arc<Watch>) {
        if self.all.len() >= self.full {
            self.all.retain(|watch| watch.strong_count() > 0);
            self.full = 2 * self.all.len() + 8;
        }
        self.all.push(Arc::downgrade(watch));
    }

    fn living(&self) -> impl Iterator<Item = Arc<Watch>> {
        self.all.iter().filter_map(Weak::upgrade)
    }

    /// Records the refinements that are still to be done, of all culls; whether there was one.
    pub(crate) fn record_refinements(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<bool> {
        let mut any = false;
        for watch in self.living() {
            any |= record(gpu, encoder, &watch)?;
        }
        Ok(any)
    }

    /// Records the refinement of one cull, if it is still to be done; whether it is.
    pub(crate) fn record_refinement(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        watch: &Watch,
    ) -> Result<bool> {
        record(gpu, encoder, watch)
    }

    /// What was recorded for a cull was submitted.
    pub(crate) fn refined(&self, watch: &Watch) {
        watch.state().refinement = None;
    }

    /// What was recorded for all culls was submitted.
    pub(crate) fn all_refined(&self) {
        self.living().for_each(|watch| self.refined(&watch));
    }

    /// Instances `range` have new bounds from now on.
    pub(crate) fn note(&self, range: &Range<u32>) {
        self.living().for_each(|watch| watch.state().note(range));
    }
}

fn record(gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, watch: &Watch) -> Result<bool> {
    let state = watch.state();
    let Some(refinement) = &state.refinement else { return Ok(false) };
    refinement.record(gpu, encoder)?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn updated_ranges_are_joined_where_they_meet() {
        let watch = Watch::new(None);
        let noted = |ranges: &[(u32, u32)]| {
            let mut state = watch.state();
            ranges.iter().for_each(|(first, last)| state.note(&(*first..*last)));
            state.updated.iter().map(|(first, end)| (*first, *end)).collect::<Vec<_>>()
        };
        assert!(!watch.is_updated(&(0..u32::MAX)));
        assert_eq!(noted(&[(10, 20), (30, 40)]), [(10, 20), (30, 40)]);
        for (range, expected) in
            [(9..10, false), (9..11, true), (19..20, true), (20..30, false), (25..31, true)]
        {
            assert_eq!(watch.is_updated(&range), expected, "{range:?}");
        }
        assert_eq!(noted(&[(20, 22)]), [(10, 22), (30, 40)], "it touches the first");
        assert_eq!(noted(&[(12, 13)]), [(10, 22), (30, 40)], "it is there already");
        assert_eq!(noted(&[(50, 60), (21, 55)]), [(10, 60)], "it meets three");
        assert_eq!(noted(&[(0, 9)]), [(0, 9), (10, 60)]);
        assert_eq!(noted(&[(9, 10)]), [(0, 60)]);
    }
}
