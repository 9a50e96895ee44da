// What the device knows about the order in which updates ran (`update.wgsl`).
struct Sequence {
    // The number of the next update.
    next: u32,
    // Not 0: an update was left out or overtaken, or bounds were taken from a buffer.
    broken: u32,
}
