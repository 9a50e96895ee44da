//! Outputs: what a cull is asked to leave behind.

use crate::output::draw::DrawTemplate;

/// What a cull leaves behind.
/// Anything that is not asked for is neither computed nor stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Outputs {
    /// One bit per instance: kept or not.
    pub mask: bool,
    /// The verdict of each instance.
    /// [`Counts`](crate::headless::Counts) come from it, and
    /// [`verdicts`](crate::headless::Culling::verdicts) says what each verdict means.
    pub verdicts: bool,
    /// The packed list of the indices of the kept instances.
    pub indices: bool,
    /// The draw arguments.
    /// Their instance count is the length of the list, whether or not there is a list.
    pub draws: bool,
    /// How many indices are written at most, in all pieces together.
    /// `None`: as many as there are instances.
    pub capacity: Option<u32>,
    /// The constant part of the draw arguments.
    pub draw: DrawTemplate,
}

impl Outputs {
    /// Nothing.
    pub const NONE: Self = Self {
        mask: false,
        verdicts: false,
        indices: false,
        draws: false,
        capacity: None,
        draw: DrawTemplate { index_count: 0, first_index: 0, base_vertex: 0, first_instance: 0 },
    };
    /// Everything, for all instances.
    pub const ALL: Self =
        Self { mask: true, verdicts: true, indices: true, draws: true, ..Self::NONE };
}

impl std::fmt::Display for Outputs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let all = [
            (self.mask, "mask"),
            (self.verdicts, "verdicts"),
            (self.indices, "indices"),
            (self.draws, "draws"),
        ];
        let names: Vec<_> =
            all.into_iter().filter_map(|(asked, name)| asked.then_some(name)).collect();
        if names.is_empty() { f.write_str("nothing") } else { f.write_str(&names.join(", ")) }
    }
}

impl Default for Outputs {
    fn default() -> Self {
        Self::ALL
    }
}
