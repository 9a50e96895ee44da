// What all decisions about an instance share: the options that are compiled in, and thresholds.
// Each `classify` is in a file of its own: `classify.wgsl`, `shadow_classify.wgsl`, `in_view.wgsl`.

// True: only pixel centres count; otherwise whole pixel squares.
override SAMPLE_COVERAGE: bool;
// True: descend to finer levels where the footprint cannot decide.
override DESCENT: bool;
// True: with both ends, a descent goes down row by row to find out that all of a volume shows.
override BY_ROWS: bool;
// True: compare each texel with the volume's own outline and front there.
// Otherwise a texel is compared with the volume's rectangle at the volume's nearest depth.
override FIT_VOLUME: bool;

// An instance that is absent has its centre below this, on the first axis.
// No other centre is there, relative to any reference point: both are below 2^60 in magnitude.
// Half of `ABSENT_CENTER` in `crates/hiz_core/src/instances/volume_record.rs`.
const ABSENT_BELOW: f32 = -0x1p61;

// Below this w a ratio could overflow, as rows stay below 2^59.
// The margins alone reach 2^-70, so this keeps next to nothing visible.
const LEAST_W: f32 = 0x1p-66;

// The rectangle is widened by what its certificate will ask for, and by a quarter of it more.
const RECTANGLE_MARGIN: f32 = 1.25;
// And by this many EPS of half an image, more than adding half an image rounds away.
const WIDENING_ULPS: f32 = 4.0;
