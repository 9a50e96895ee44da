//! Sets of numbers that are joined, as trees (Galler and Fischer 1964).

use crate::error::Result;
use crate::host::memory;

/// The numbers below a count, each in a set of its own at first.
#[derive(Debug)]
pub(crate) struct Forest(Vec<u32>);

impl Forest {
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory), where `what` are named.
    pub(crate) fn new(count: u32, what: &'static str) -> Result<Self> {
        memory::collected(0..count, what).map(Self)
    }

    /// The root of a number's set: its least number.
    #[inline]
    pub(crate) fn root(&mut self, mut number: u32) -> u32 {
        loop {
            let parent = self.0[number as usize];
            if parent == number {
                return number;
            }
            // Paths are halved on the way.
            let above = self.0[parent as usize];
            self.0[number as usize] = above;
            number = above;
        }
    }

    /// Joins the sets of two numbers.
    #[inline]
    pub(crate) fn join(&mut self, a: u32, b: u32) {
        if self.0[a as usize] == self.0[b as usize] {
            return;
        }
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_joined_has_one_root_and_nothing_else_has_it() {
        let mut forest = Forest::new(100, "numbers").unwrap();
        for number in (20..100).rev() {
            forest.join(number, number - 10);
        }
        for number in 0..100 {
            let expected = if number < 10 { number } else { 10 + number % 10 };
            assert_eq!(forest.root(number), expected);
        }
    }
}
