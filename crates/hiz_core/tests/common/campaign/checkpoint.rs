//! The progress of a long campaign, kept in a file.
//! It can be stopped at any time, and the next run continues from there.

use std::path::PathBuf;

use super::class::Class;
use super::report::{Report, Tally};

/// The file that holds the progress of a campaign with these settings.
#[derive(Debug)]
pub(crate) struct Checkpoint {
    path: PathBuf,
    /// The settings in one line: progress made with other settings is ignored.
    settings: String,
}

impl Checkpoint {
    /// The checkpoint of the campaign `settings` (one line), in the build's folder for tests.
    pub(crate) fn new(name: &str, settings: String) -> Self {
        Self {
            path: PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.txt")),
            settings,
        }
    }

    /// How many chunks are done, and what they found.
    /// 0 and an empty report unless a run with these settings was stopped.
    pub(crate) fn load(&self, keeps: bool) -> (u64, Report) {
        let fresh = || (0, Report::new(&Class::ALL, keeps));
        let Ok(text) = std::fs::read_to_string(&self.path) else { return fresh() };
        let mut lines = text.lines();
        if lines.next() != Some(self.settings.as_str()) {
            return fresh();
        }
        let mut report = Report::new(&Class::ALL, keeps);
        let Some(Ok(done)) = lines.next().map(str::parse) else { return fresh() };
        for (class, line) in Class::ALL.iter().zip(lines) {
            let numbers: Result<Vec<usize>, _> = line.split(' ').map(str::parse).collect();
            let Ok([cases, culled, false_culls, false_keeps]) = numbers.as_deref() else {
                return fresh();
            };
            let (cases, culled, false_culls, false_keeps) =
                (*cases, *culled, *false_culls, *false_keeps);
            report.add(*class, Tally { cases, culled, false_culls, false_keeps });
        }
        (done, report)
    }

    /// Saves the progress.
    /// Writes a new file and renames it, so that a killed run leaves the previous one intact.
    pub(crate) fn save(&self, done: u64, report: &Report) {
        let mut text = format!("{}\n{done}\n", self.settings);
        for (_, t) in &report.classes {
            text += &format!("{} {} {} {}\n", t.cases, t.culled, t.false_culls, t.false_keeps);
        }
        let beside = self.path.with_extension("new");
        std::fs::write(&beside, text)
            .and_then(|()| std::fs::rename(&beside, &self.path))
            .expect("a place to note");
    }

    /// Removes the file: the campaign is over, and the next run starts anew.
    pub(crate) fn remove(&self) {
        std::fs::remove_file(&self.path).ok();
    }
}
