// The history of the two passes of a frame: which instances the last late pass found visible.
//
// A byte belongs to one invocation of a cull, and holds a bit for each of the RUN members that the
// invocation tests.
// A late pass begins with zeros, and sets the bits of what it keeps.
// So it writes nothing about the groups that it rejects, which are most of them.
// The words follow the stored order, which updates keep.
// Twin: `crates/hiz_core/src/cull/history.rs`.

// Words in front of the bits.
// The first is the number of the last early pass that has run.
// Twin: `HISTORY_BEGIN` in `crates/hiz_core/src/cull/history.rs`.
const HISTORY_BEGIN: u32 = 4u;

// What one recording of a pass knows of its frame.
// Twin: `FrameUniform` in `crates/hiz_core/src/cull/history.rs`.
struct Frame {
    // The number of the early pass: of this one, or of the one whose list was drawn before.
    // 0: there was none.
    early: u32,
    // The early pass by size draws what is at least this many pixels wide or high.
    least_pixels: i32,
    padding: vec2<u32>,
}

// How many of the SHARE invocations of a group have their bits in one word, and the group's words.
const SHARES_OF_WORD: u32 = 32u / RUN;
const WORDS_OF_GROUP: u32 = SHARE / SHARES_OF_WORD;

// The word of one of the invocations of a group.
fn history_word(group: u32, share: u32) -> u32 {
    return HISTORY_BEGIN + group * WORDS_OF_GROUP + share / SHARES_OF_WORD;
}

// Where its bits begin in that word.
fn history_shift(share: u32) -> u32 {
    return share % SHARES_OF_WORD * RUN;
}
