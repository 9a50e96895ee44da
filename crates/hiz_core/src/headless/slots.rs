//! The slots of culls that are submitted ahead of their reads: so many may be unfinished at a time.

use std::sync::{Arc, OnceLock, Weak};
use std::time::Instant;

use crate::error::Result;

/// How many such culls may be unfinished at a time.
pub const CULLS_IN_FLIGHT: usize = 2;

/// The culls that may be unfinished, the oldest first.
///
/// `S` names a submission.
#[derive(Debug)]
pub(super) struct Slots<S = wgpu::SubmissionIndex>(Vec<Taken<S>>);

impl<S> Default for Slots<S> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

#[derive(Debug)]
pub(super) struct Taken<S = wgpu::SubmissionIndex> {
    /// Gone once the answer was dropped.
    pub(super) answer: Weak<()>,
    pub(super) done: Arc<OnceLock<Instant>>,
    pub(super) submission: S,
}

impl<S> Slots<S> {
    /// Calls `wait` for the oldest submissions until one more cull may be submitted.
    pub(super) fn make_room(&mut self, mut wait: impl FnMut(S) -> Result<()>) -> Result<()> {
        loop {
            self.0.retain(|taken| taken.answer.strong_count() > 0 && taken.done.get().is_none());
            if self.0.len() < CULLS_IN_FLIGHT {
                return Ok(());
            }
            wait(self.0.remove(0).submission)?;
        }
    }

    pub(super) fn take(&mut self, slot: Taken<S>) {
        self.0.push(slot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes a slot when there is room, and returns which submissions that waited for.
    fn submit(slots: &mut Slots<u32>, answer: &Arc<()>, submission: u32) -> Vec<u32> {
        let mut waited = Vec::new();
        let room = slots.make_room(|oldest| {
            waited.push(oldest);
            Ok(())
        });
        assert!(room.is_ok());
        let (answer, done) = (Arc::downgrade(answer), Arc::default());
        slots.take(Taken { answer, done, submission });
        waited
    }

    #[test]
    fn a_third_waits_for_the_oldest_that_is_unfinished_and_wanted() {
        let (mut slots, answers) = (Slots::default(), [(); 6].map(Arc::new));
        let [first, second, third, abandoned, more, last] = answers;
        assert_eq!(submit(&mut slots, &first, 1), []);
        assert_eq!(submit(&mut slots, &second, 2), []);
        assert_eq!(submit(&mut slots, &third, 3), [1]);
        // The second is done by itself.
        slots.0[0].done.get_or_init(Instant::now);
        assert_eq!(submit(&mut slots, &abandoned, 4), []);
        drop(abandoned);
        assert_eq!(submit(&mut slots, &more, 5), []);
        assert_eq!(submit(&mut slots, &last, 6), [3]);
        // Where waiting fails, the error comes out.
        let failed = slots.make_room(|_| Err(crate::Error::DeviceLost("gone".to_owned())));
        assert!(failed.is_err());
    }
}
