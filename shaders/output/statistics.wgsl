// Counts of what tests have read, where they are asked for.

// True: the tests on each level and the texels are counted.
override STATISTICS: bool;

// Twin: `StatisticsRecord` in `crates/hiz_core/src/output/counters.rs`.
struct Statistics {
    // How many instances and groups were compared with the depths of each level.
    levels: array<atomic<u32>, MAX_LEVELS>,
    // Texels read, a 64-bit number in two halves.
    texels_low: atomic<u32>,
    texels_high: atomic<u32>,
}

@group(2) @binding(3) var<storage, read_write> statistics: Statistics;

// Counts a test that began at `level` and read `texels_read` texels.
fn count_texels(level: u32, texels_read: u32) {
    if texels_read > 0u {
        atomicAdd(&statistics.levels[level], 1u);
        let before = atomicAdd(&statistics.texels_low, texels_read);
        if before + texels_read < before { atomicAdd(&statistics.texels_high, 1u); }
    }
}
