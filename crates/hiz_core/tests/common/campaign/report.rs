//! What a campaign found, class by class.

use super::class::Class;
use super::grouped::Tested;

/// Counts of one class, or of all.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Tally {
    pub(crate) cases: usize,
    pub(crate) culled: usize,
    /// Culled although visible: must be 0.
    pub(crate) false_culls: usize,
    /// Kept although hidden: the price of being conservative.
    /// Only where the campaign counts them.
    pub(crate) false_keeps: usize,
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.cases += other.cases;
        self.culled += other.culled;
        self.false_culls += other.false_culls;
        self.false_keeps += other.false_keeps;
    }
}

/// A tally for each class.
#[derive(Debug, Clone)]
pub(crate) struct Report {
    pub(crate) classes: Vec<(Class, Tally)>,
    /// Whether false keeps were counted.
    pub(crate) keeps: bool,
    /// What groups tested; all 0 without groups.
    pub(crate) tested: Tested,
}

impl Report {
    pub(crate) fn new(classes: &[Class], keeps: bool) -> Self {
        Self {
            classes: classes.iter().map(|c| (*c, Tally::default())).collect(),
            keeps,
            tested: Tested::default(),
        }
    }

    pub(crate) fn add(&mut self, class: Class, tally: Tally) {
        for (c, t) in &mut self.classes {
            if *c == class {
                *t += tally;
            }
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for (class, tally) in &other.classes {
            self.add(*class, *tally);
        }
        self.tested.add(other.tested);
    }

    pub(crate) fn total(&self) -> Tally {
        let mut total = Tally::default();
        for (_, tally) in &self.classes {
            total += *tally;
        }
        total
    }
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut line = |name: &str, t: &Tally| {
            let keeps =
                if self.keeps { format!("{:>12}", t.false_keeps) } else { format!("{:>12}", "-") };
            writeln!(f, "{name:<18}{:>10}{:>10}{:>12}{keeps}", t.cases, t.culled, t.false_culls)
        };
        for (class, tally) in &self.classes {
            line(&format!("{class:?}"), tally)?;
        }
        line("all", &self.total())?;
        if self.tested.instances > 0 {
            let Tested { instances, one_by_one, contradictions } = self.tested;
            writeln!(
                f,
                "groups: {one_by_one} of {instances} instances tested one by one, \
                 {contradictions} contradictions"
            )?;
        }
        Ok(())
    }
}

/// The columns of a printed [`Report`].
pub(crate) const HEADER: &str = "class                  cases    culled false culls false keeps";
