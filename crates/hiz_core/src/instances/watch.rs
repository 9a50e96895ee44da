//! Watches: they connect a submitted cull with later updates of its instances.
//!
//! A cull writes no verdicts for the members of hidden groups.
//! They are refined when they are first read (`cull/refine.rs`), from the bounds that were culled.
//! An update would overwrite these bounds, so it first refines the verdicts of all submitted culls.
//!
//! The update also notes which instances it changed.
//! An explanation tests the bounds as they are now, so it must say if they are not those that were
//! culled.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, MutexGuard, Weak};

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::host::threads::Locked;

/// Work that a cull leaves undone, and that must run before its instances change.
pub(crate) trait Refine: std::fmt::Debug + Send + Sync {
    /// Records the work.
    /// It may run more than once; only the first run has an effect.
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
    /// The refinement of the verdicts, until its commands are submitted.
    /// They run after the cull and before any update.
    refinement: Option<Box<dyn Refine>>,
    /// The instances that were updated since: each first instance with the end of its range.
    /// The ranges neither overlap nor touch.
    updated: BTreeMap<u32, u32>,
}

impl Watch {
    /// A watch on a cull that leaves `refinement` undone, if any.
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
        // Merges all ranges that overlap or touch the new one.
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
    /// The length at which `add` next removes the watches that are no longer alive.
    full: usize,
}

impl Watches {
    /// Adds a cull that was just submitted.
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

    /// Records the outstanding refinements of all culls.
    /// Returns whether there was one.
    pub(crate) fn record_refinements(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<bool> {
        let mut any = false;
        for watch in self.living() {
            any |= record_refinement(gpu, encoder, &watch)?;
        }
        Ok(any)
    }

    /// Records the refinement of one cull if it is outstanding.
    /// Returns whether it was.
    pub(crate) fn record_refinement(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        watch: &Watch,
    ) -> Result<bool> {
        record_refinement(gpu, encoder, watch)
    }

    /// Notes that the recorded refinement of a cull was submitted.
    pub(crate) fn refined(&self, watch: &Watch) {
        watch.state().refinement = None;
    }

    /// Notes that the recorded refinements of all culls were submitted.
    pub(crate) fn all_refined(&self) {
        self.living().for_each(|watch| self.refined(&watch));
    }

    /// Notes that the instances `range` have new bounds from now on.
    pub(crate) fn note(&self, range: &Range<u32>) {
        self.living().for_each(|watch| watch.state().note(range));
    }
}

fn record_refinement(gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, watch: &Watch) -> Result<bool> {
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
