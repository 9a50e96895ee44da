//! Constants, pipeline constants and sizes of workgroups.

use std::collections::{BTreeMap, BTreeSet};

use super::declared;
use crate::cull::among;
use crate::cull::count;
use crate::cull::descent;
use crate::cull::explain::{self, Stage};
use crate::cull::full_mask;
use crate::cull::groups::GROUPS_OF_RUN;
use crate::cull::history::HISTORY_BEGIN;
use crate::cull::lod::LodRule;
use crate::cull::pipelines::{Candidates, CullKey, Decision, DepthStore, FramePass, ReportKey};
use crate::cull::pipelines::{classify_constants, flat_module, report_constants};
use crate::cull::pixels;
use crate::cull::refine;
use crate::cull::view_uniform::COORDINATE_BITS;
use crate::gpu::clock_check;
use crate::gpu::depth_source::SourceKind;
use crate::host::rounding::EPS;
use crate::input::bounds::BoundsKind;
use crate::input::image::MAX_IMAGE_SIDE;
use crate::input::view::ERROR_ULPS;
use crate::instances::batch::GROUP;
use crate::instances::piece::CULL_WORKGROUP;
use crate::instances::records::{RECORDS_PER_ROW, TEXEL_BYTES};
use crate::instances::update;
use crate::instances::volume_record::{ABSENT_CENTER, BEYOND_LIMITS, LARGEST};
use crate::instances::{from_buffer, tiers};
use crate::methods;
use crate::output::bins::{BLOCK_WORDS, PlaneSet};
use crate::output::compact::SCATTER_WORKGROUP;
use crate::output::cut::CUT_WORKGROUP;
use crate::output::emit_passes;
use crate::output::mesh_table::{MAX_LODS, MESH_TEXELS};
use crate::output::survivors::SURVIVORS_PER_ROW;
use crate::output::verdict::{VERDICT_MASK, Verdict};
use crate::output::views;
use crate::output::visible::VERDICT_MULTIPLE;
use crate::pyramid::layout::{BLOCK_ALIGNMENT, BLOCK_LOG2, HEADERS, PIXELS};
use crate::pyramid::levels::MAX_LEVELS;
use crate::pyramid::mips_passes;
use crate::pyramid::receiver_mask::{MASK_BLOCK_LOG2, MASK_SIDE};
use crate::pyramid::reduce::{REDUCE_WORKGROUP, SHARED_LEVEL, TALL_SIDE};
use crate::pyramid::resolve;
use crate::testing::lod;
use crate::testing::shaders::tests::{covering, parse};
use crate::testing::shaders::{EMITS, EMITS_OF_TWO, KINDS, files};
use crate::yardstick::reduce as yardstick;

/// From this magnitude on, the next float32 makes up for two flushed subnormals.
const SMALL: f32 = 1.0 / (1_u128 << 100) as f32;

/// Constants of the shaders with a twin in this crate or in Rust's `core`.
fn twins() -> Vec<(&'static str, &'static str, f64)> {
    let int = f64::from;
    let float = |v: f32| f64::from(v);
    let bits = |v: f32| f64::from(v.to_bits());
    let verdict = |v: Verdict| int(v as u32);
    let stage = |s: Stage| int(s as u32);
    let rule = |r: &LodRule| int(r.code());
    let texels = |kind: BoundsKind| (kind.record_bytes() / TEXEL_BYTES) as f64;
    vec![
        ("methods/coarse_level", "TILE", int(methods::TILE)),
        ("methods/texts", "MAX_LEVELS", MAX_LEVELS as f64),
        ("methods/texts", "WORKGROUP", int(methods::TEXT_WORKGROUP)),
        ("cull/among", "AMONG_OF_GROUP", GROUP as f64 / int(u32::BITS)),
        ("cull/among_layout", "AMONG_BITS", int(u32::BITS)),
        ("cull/among_layout", "AMONG_PER_ROW_LOG2", int(among::WORDS_PER_ROW.ilog2())),
        ("cull/among_order", "WORKGROUP", int(among::WORKGROUP)),
        ("cull/begin_mask", "WORKGROUP", int(full_mask::WORKGROUP)),
        ("cull/begin_mask", "WORDS_OF_INVOCATION", int(full_mask::WORDS_OF_INVOCATION)),
        ("cull/candidates", "SET_BY_HISTORY", int(Candidates::History as u32)),
        ("cull/candidates", "SET_BY_SIZE", int(Candidates::Size as u32)),
        ("cull/candidates", "SET_GIVEN", int(Candidates::Given as u32)),
        ("cull/certificate", "EPS", EPS),
        ("cull/certificate", "ERROR_ULPS", ERROR_ULPS),
        ("cull/count", "LANES", int(count::LANES)),
        ("cull/count", "VECTORS", int(count::VECTORS)),
        ("cull/cull_box", "PARENTS", int(CULL_WORKGROUP) / GROUP as f64),
        ("cull/cull_box", "WORKGROUP", int(CULL_WORKGROUP)),
        ("cull/explain", "BEHIND", int(explain::BEHIND)),
        ("cull/explain", "CLEAR", int(explain::CLEAR)),
        ("cull/lod", "LOD_FINEST", rule(&LodRule::Finest)),
        ("cull/lod", "LOD_BY_ERROR", rule(&LodRule::Error { pixels: 1.0 })),
        ("cull/lod", "LOD_BY_DISTANCE", rule(&LodRule::Distance { thresholds: Vec::new() })),
        ("cull/lod", "LOD_BY_SIZE", rule(&LodRule::Size { pixels: Vec::new() })),
        ("cull/history", "HISTORY_BEGIN", int(HISTORY_BEGIN)),
        ("cull/history", "SHARES_OF_WORD", int(u32::BITS / GROUPS_OF_RUN)),
        ("cull/history", "WORDS_OF_GROUP", GROUP as f64 / int(u32::BITS)),
        ("cull/outcome", "AT_VALIDITY", stage(Stage::Validity)),
        ("cull/outcome", "AT_FRUSTUM", stage(Stage::Frustum)),
        ("cull/outcome", "AT_EYE_PLANE", stage(Stage::EyePlane)),
        ("cull/outcome", "AT_RECTANGLE", stage(Stage::Rectangle)),
        ("cull/outcome", "AT_DEPTH", stage(Stage::Depth)),
        ("cull/outcome", "AT_BLOCK", stage(Stage::Block)),
        ("cull/outcome", "AT_DESCENT", stage(Stage::Descent)),
        ("cull/outcome", "AT_LEVEL", stage(Stage::Level)),
        ("cull/outcome", "AT_FRONT", stage(Stage::Front)),
        ("cull/pixels", "WORKGROUP", int(pixels::WORKGROUP)),
        ("cull/pixels", "FEW", int(pixels::FEW)),
        ("cull/pixels", "LARGE_OF_TEAM", int(pixels::LARGE_OF_TEAM)),
        ("cull/pixels", "MOST_ORDERED", int(pixels::MOST_ORDERED)),
        ("cull/pixels", "PIXELS_OF_ITERATION", int(pixels::PIXELS_OF_ITERATION)),
        ("cull/pixels_large", "TEAM", int(pixels::TEAM)),
        ("cull/pixels_large", "LARGE_TEAM", int(pixels::LARGE_TEAM)),
        ("cull/refine", "WORKGROUP", int(refine::WORKGROUP)),
        ("cull/refine_groups", "WORKGROUP", int(refine::WORKGROUP)),
        ("cull/supporting_planes", "LARGEST_BITS", bits(LARGEST)),
        ("cull/view", "COORDINATE_BITS", int(COORDINATE_BITS)),
        ("cull/view", "COORDINATE_MASK", int((1 << COORDINATE_BITS) - 1)),
        ("gpu/clock_check", "WORKGROUP", int(clock_check::WORKGROUP)),
        ("gpu/depth_bits", "ONE_BITS", bits(1.0)),
        ("gpu/depth_bits", "LEAST_NORMAL_BITS", bits(f32::MIN_POSITIVE)),
        ("gpu/depth_bits", "NEGATIVE_ZERO_BITS", bits(-0.0)),
        ("gpu/depth_bits", "VECTOR_LOG2", int(PIXELS.ilog2())),
        ("gpu/depth_bits", "VECTOR", int(PIXELS)),
        ("gpu/depth_bits", "VECTOR_MASK", int(BLOCK_ALIGNMENT - 1)),
        ("gpu/depth_bits", "BLOCK_LOG2", int(BLOCK_LOG2)),
        ("gpu/depth_bits", "BLOCK", int(1_u32 << BLOCK_LOG2)),
        ("gpu/depth_bits", "BLOCK_QUADS", int(1_u32 << (BLOCK_LOG2 - 1))),
        ("instances/bounds_box", "RECORD_TEXELS", texels(BoundsKind::Box)),
        ("instances/bounds_oriented_box", "RECORD_TEXELS", texels(BoundsKind::OrientedBox)),
        ("instances/bounds_oriented_box", "LAST_TEXEL", texels(BoundsKind::OrientedBox) - 1.0),
        ("instances/bounds_sphere", "RECORD_TEXELS", texels(BoundsKind::Sphere)),
        ("instances/bounds_point", "RECORD_TEXELS", texels(BoundsKind::Point)),
        ("instances/bounds_wide_point", "RECORD_TEXELS", texels(BoundsKind::WidePoint)),
        ("instances/corners", "BOX_TEXELS", texels(BoundsKind::Box)),
        ("instances/corners", "SIGN_BIT", bits(-0.0)),
        ("instances/corners", "MAGNITUDE_BITS", int(u32::MAX >> 1)),
        ("instances/corners", "LARGEST_BITS", bits(LARGEST)),
        ("instances/corners", "LARGEST_CORNER_BITS", bits(2.0 * LARGEST)),
        ("instances/corners", "SMALL_BITS", bits(SMALL)),
        ("instances/corners", "BEYOND_SMALL_BITS", bits(2.0 * SMALL)),
        ("instances/corners", "INVALID_LOW", int(u32::MIN)),
        ("instances/corners", "INVALID_HIGH", int(u32::MAX)),
        ("instances/from_buffer", "WORKGROUP", int(from_buffer::WORKGROUP)),
        ("instances/from_buffer_box", "RECORD_TEXELS", texels(BoundsKind::Box)),
        ("instances/from_buffer_point", "RECORD_TEXELS", texels(BoundsKind::Point)),
        ("instances/from_buffer_sphere", "RECORD_TEXELS", texels(BoundsKind::Sphere)),
        ("instances/form_tier", "WORKGROUP", int(tiers::WORKGROUP)),
        ("instances/groups", "ACCEPTED", int(1 << 31)),
        ("instances/groups", "GROUP", GROUP as f64),
        ("instances/groups", "GROUP_LOG2", f64::from(GROUP.ilog2())),
        ("cull/supporting_planes", "PLANES_OF_ROUND", int(descent::PLANES_OF_ROUND)),
        ("cull/supporting_planes", "MOST_ROUNDS", int(descent::MOST_ROUNDS)),
        ("instances/groups", "RUN", int(GROUPS_OF_RUN)),
        ("instances/groups", "SHARE", GROUP as f64 / int(GROUPS_OF_RUN)),
        ("instances/groups", "SURVIVORS_PER_ROW_LOG2", int(SURVIVORS_PER_ROW.ilog2())),
        ("instances/piece", "VERDICT_MULTIPLE", int(VERDICT_MULTIPLE)),
        ("instances/piece", "WORD_BITS", int(u32::BITS)),
        ("instances/record_layout", "RECORDS_PER_ROW_LOG2", int(RECORDS_PER_ROW.ilog2())),
        ("instances/record_layout", "ABSENT_CENTER_BITS", bits(ABSENT_CENTER)),
        ("instances/record_layout", "BEYOND_LIMITS_BITS", bits(BEYOND_LIMITS)),
        ("instances/update", "WORKGROUP", int(update::WORKGROUP)),
        ("cull/decision", "ABSENT_BELOW", f64::from(ABSENT_CENTER) / 2.0),
        ("output/compact", "SCATTER_WORKGROUP", int(SCATTER_WORKGROUP)),
        ("output/join", "WORKGROUP", int(views::WORKGROUP)),
        ("output/emit_planes", "BLOCK_LOG2_WORDS", int(BLOCK_WORDS.ilog2())),
        ("output/emit_prefix", "WORKGROUP", int(emit_passes::WORKGROUP)),
        ("output/emit_prefix", "MESHES", int(emit_passes::MESHES)),
        ("output/emit_instances", "WORKGROUP", int(emit_passes::WORKGROUP)),
        ("output/emit_scan", "SHARE", int(BLOCK_WORDS / emit_passes::WORKGROUP)),
        ("output/emit_scatter", "WORKGROUP", int(emit_passes::WORKGROUP)),
        ("output/planes_one", "PLANES", int(PlaneSet::One.planes())),
        ("output/planes_four", "PLANES", int(PlaneSet::Four.planes())),
        ("output/mesh_table", "MESH_TEXELS", MESH_TEXELS as f64),
        ("output/cut", "WORKGROUP", int(CUT_WORKGROUP)),
        ("output/emit_cut", "WORKGROUP", int(CUT_WORKGROUP)),
        ("output/verdict", "OUTSIDE", verdict(Verdict::Outside)),
        ("output/verdict", "OCCLUDED", verdict(Verdict::Occluded)),
        ("output/verdict", "VISIBLE", verdict(Verdict::Visible)),
        ("output/verdict", "INVALID", verdict(Verdict::Invalid)),
        ("output/verdict", "UNOCCLUDED", verdict(Verdict::Unoccluded)),
        ("output/verdict", "VERDICT_COUNT", verdict(Verdict::Unoccluded) + 1.0),
        ("output/verdict", "VERDICT_MASK", int(VERDICT_MASK)),
        ("pyramid/levels", "MANTISSA_BITS", int(f32::MANTISSA_DIGITS - 1)),
        ("pyramid/levels", "EXPONENT_BIAS", f64::from(f32::MAX_EXP - 1)),
        ("pyramid/mips", "WORKGROUP", int(mips_passes::WORKGROUP)),
        ("pyramid/pyramid", "MAX_LEVELS", MAX_LEVELS as f64),
        ("pyramid/pyramid_write", "WORKGROUP", int(REDUCE_WORKGROUP)),
        ("pyramid/pyramid_write", "SIDE_LOG2", int(TALL_SIDE.ilog2())),
        ("pyramid/pyramid_write", "SIDE", int(TALL_SIDE)),
        ("pyramid/pyramid_write", "SIDE_MASK", int(TALL_SIDE - 1)),
        ("pyramid/receiver_mask", "SIDE", int(MASK_SIDE)),
        ("pyramid/receiver_mask", "MASK_BLOCK_LOG2", int(MASK_BLOCK_LOG2)),
        ("pyramid/receiver_mask", "EPS", EPS),
        ("pyramid/receiver_mask", "ERROR_ULPS", ERROR_ULPS),
        ("pyramid/resolve", "WORKGROUP", int(resolve::WORKGROUP)),
        ("pyramid/texels", "LEAST_NORMAL", float(f32::MIN_POSITIVE)),
        ("pyramid/texels_atlas", "HEADERS", int(HEADERS)),
        ("testing/choose_lods", "LANES", int(lod::LANES)),
        ("testing/choose_lods", "MAX_LODS", MAX_LODS as f64),
        ("yardstick/reduce_buffer", "WORKGROUP", int(yardstick::BUFFER_WORKGROUP)),
        ("yardstick/reduce_texture", "SIDE", int(yardstick::TEXTURE_WORKGROUP_SIDE)),
    ]
}

/// Constants that only a shader has.
/// What is known of those that carry a proof is in `constants_cover_what_is_counted`.
const SHADER_ONLY: &[(&str, &[&str])] = &[
    ("cull/certificate", &["ERROR_FLOOR"]),
    ("cull/decision", &["LEAST_W", "RECTANGLE_MARGIN", "WIDENING_ULPS"]),
    ("cull/lod", &["NEEDS", "NEED_FACTOR", "LARGEST_DEVIATION"]),
    ("cull/begin_mask", &["ALL_BITS", "FULL_BELOW"]),
    // All bits of a run.
    ("cull/early", &["WHOLE_RUN"]),
    (
        "cull/pixels",
        &[
            "AROUND_SMALL",
            "FEW_TEAMS",
            "LISTED_FROM",
            "TEAMS_PER_ROW",
            "SMALL_ROWS",
            "CLASSES_LOG2",
            "CLASSES",
            "CLASS_SHIFT",
            "PLACE_MASK",
            "NO_KEY",
        ],
    ),
    (
        "cull/pixels_large",
        &[
            "AROUND_ROUND",
            "STEP",
            "CHILD_ROWS",
            "CHUNK",
            "LISTED",
            "LISTS",
            "ROW_SHIFT",
            "COLUMN_MASK",
        ],
    ),
    ("cull/pixels_look", &["UNKNOWN_BITS"]),
    ("cull/pixels_planes", &["OUTLINE_PLACES", "FACE_PLACES", "NO_PLANE"]),
    ("cull/pixels_planes_any", &["OUTLINE_PLANES", "FACE_PLANES", "TWO_SIDED"]),
    ("cull/pixels_planes_box", &["OUTLINE_PLANES", "FACE_PLANES", "TWO_SIDED"]),
    ("cull/refine", &["REFINED"]),
    ("cull/shadow", &["NO_FACE"]),
    ("cull/unoccluded", &["HALF_PIXEL"]),
    ("pyramid/store_both", &["ENDS"]),
    ("pyramid/store_one", &["ENDS"]),
    (
        "pyramid/receiver_mask",
        &[
            "MOST_BLOCKS",
            "ERROR_FLOOR",
            "ESTIMATE_MARGIN",
            "INTERVAL_ULPS",
            "HALF_PIXEL",
            "WIDEST",
            "FARTHEST_KEY",
        ],
    ),
    ("gpu/clock_check", &["LEFT", "RIGHT", "LEFT_AGAIN"]),
    ("cull/refine_groups", &["LAST_TEXEL", "WITHIN"]),
    (
        "cull/supporting_planes",
        &[
            "MAGNITUDE_MASK",
            "LARGEST_ERROR",
            "STEEPEST_BITS",
            "FLATTEST",
            "BEYOND",
            "GUESS_ERRORS",
            "TEXEL_ULPS",
            "TEXEL_FLOOR",
            "ROUNDS",
            "NOTHING_BEYOND",
        ],
    ),
    (
        "instances/bounds_box_support",
        &[
            "EDGES",
            "FACES",
            "CANDIDATES",
            "EDGES_OF_AXIS_LOG2",
            "BORDER_TOLERANCE",
            "RADIUS_FACTOR",
            "RADIUS_FLOOR",
            "ROOT_FACTOR",
        ],
    ),
    (
        "instances/bounds_sphere",
        &[
            "AXES",
            "SQUARES_FACTOR",
            "SQUARES_FLOOR",
            "LEAST_DIVISOR",
            "OUTLINE",
            "RING",
            "RING_ANGLES",
            "CANDIDATES",
            "OUTLINES",
            "TURN",
        ],
    ),
    ("instances/corners", &["HALF"]),
    ("methods/coarse_level", &["TILE_PIXELS", "HALF_TILE", "QUARTER_TILE", "ONE_BITS"]),
    ("methods/texts", &["HALF", "CORNERS", "PLANES", "SQUARE"]),
    ("instances/bounds_point_support", &["CANDIDATES", "OUTLINES"]),
    // One workgroup scans, however large it is.
    ("output/compact", &["LANES"]),
    ("output/emit_prefix", &["ROW", "ROWS"]),
    ("output/emit_record", &["COMMON_WORDS"]),
    ("output/emit_scatter", &["MANY", "LINE", "NO_INDEX_BIT"]),
    ("output/planes_four", &["COUNT_BITS", "COUNT_MASK"]),
    ("output/mesh_table", &["ERRORS_LOG2"]),
];

/// The constants of every file that are one number: by file and name.
fn numbers() -> BTreeMap<(String, String), f64> {
    let mut numbers = BTreeMap::new();
    for (source, module) in covering() {
        for (_, constant) in module.constants.iter() {
            let Some(name) = &constant.name else { continue };
            let value = match module.global_expressions[constant.init] {
                naga::Expression::Literal(naga::Literal::U32(v)) => f64::from(v),
                naga::Expression::Literal(naga::Literal::I32(v)) => f64::from(v),
                naga::Expression::Literal(naga::Literal::F32(v)) => f64::from(v),
                _ => continue,
            };
            let said = format!("const {name}:");
            for file in source.files().iter().filter(|file| file.text.contains(&said)) {
                numbers.insert((file.path.to_owned(), name.clone()), value);
            }
        }
    }
    numbers
}

#[test]
fn constants_have_the_numbers_of_their_twins() {
    let numbers = numbers();
    let wrong: Vec<_> = twins()
        .into_iter()
        .filter_map(|(file, name, ours)| {
            let theirs = numbers.get(&(file.to_owned(), name.to_owned())).copied();
            (theirs != Some(ours)).then_some((file, name, ours, theirs))
        })
        .collect();
    assert!(wrong.is_empty(), "file, name, ours, the shader's: {wrong:#?}");
    assert_eq!(PIXELS, BLOCK_ALIGNMENT, "`VECTOR` is both");
    assert_eq!(SourceKind::Bits.pixels_of_texel(), PIXELS, "and what an upload's texel holds");
}

#[test]
fn every_constant_of_a_shader_is_in_a_list() {
    let mut listed: BTreeSet<(&str, &str)> = BTreeSet::new();
    let twins = twins().into_iter().map(|(file, name, _)| (file, name));
    let only = SHADER_ONLY.iter().flat_map(|(file, names)| names.iter().map(|n| (*file, *n)));
    for entry in twins.chain(only) {
        assert!(listed.insert(entry), "{entry:?} is listed twice");
    }
    let found: BTreeSet<(&str, &str)> = files()
        .iter()
        .flat_map(|(path, text)| declared(text, "const ").map(|name| (*path, name)))
        .collect();
    let unlisted: Vec<_> = found.difference(&listed).collect();
    assert!(unlisted.is_empty(), "has it a twin? {unlisted:?}");
    let gone: Vec<_> = listed.difference(&found).collect();
    assert!(gone.is_empty(), "no shader has it: {gone:?}");
}

/// What two constants say about each other, or about a number of this crate.
#[test]
fn constants_fit_each_other() {
    let numbers = numbers();
    let number = |file: &str, name: &str| numbers[&(file.to_owned(), name.to_owned())];
    // A square of invocations.
    assert_eq!(TALL_SIDE * TALL_SIDE, REDUCE_WORKGROUP);
    // The least level of which a square of invocations can share a texel.
    assert_eq!(SHARED_LEVEL, BLOCK_LOG2 + TALL_SIDE.ilog2());
    // As powers of two they lose nothing.
    assert!(SURVIVORS_PER_ROW.is_power_of_two() && RECORDS_PER_ROW.is_power_of_two());
    // Flags stand beside what they flag.
    let flags = [number("cull/refine", "REFINED"), number("cull/refine_groups", "WITHIN")];
    let [told, within] = flags.map(|flag| flag as u32);
    assert!(told & VERDICT_MASK == 0 && within & VERDICT_MASK == 0 && told & within == 0);
    let (behind, clear) = (explain::BEHIND, explain::CLEAR);
    assert!(behind & explain::LEVEL_MASK == 0 && clear & explain::LEVEL_MASK == 0);
    assert!(behind & clear == 0 && MAX_LEVELS as u32 - 1 <= explain::LEVEL_MASK);
    assert!(number("cull/supporting_planes", "BEYOND") >= f64::from(MAX_IMAGE_SIDE));
    assert_eq!(MAX_IMAGE_SIDE, 1 << (MAX_LEVELS - 1));
    assert_eq!(Stage::ALL.map(|s| s as usize), std::array::from_fn(|i| i));
    assert!(BLOCK_WORDS.is_power_of_two());
    // Counts within a block are packed to 16 bits.
    const { assert!(32 * BLOCK_WORDS <= 1 << 16) };
    // A texel for the number of a mesh's LODs, and one for each four errors.
    assert_eq!(MESH_TEXELS - 1, MAX_LODS >> number("output/mesh_table", "ERRORS_LOG2") as u32);
    // The spacing just below 2^-100 exceeds two flushed numbers.
    assert!(f64::from(SMALL) * EPS / 2.0 > 2.0 * f64::from(f32::MIN_POSITIVE));
    // What is beyond limits is beyond what is still valid.
    const { assert!(BEYOND_LIMITS > LARGEST) };
}

/// What docs/accuracy.md derives of constants whose absence shows in no verdict but the mirror's:
/// they cover what it counts.
#[test]
fn constants_cover_what_is_counted() {
    let numbers = numbers();
    let number = |file: &str, name: &str| numbers[&(file.to_owned(), name.to_owned())];
    let two_to = |n: i32| 2.0_f64.powi(n);
    // Flushed subnormals.
    assert!(number("cull/certificate", "ERROR_FLOOR") >= two_to(-70));
    // Both squares, the product and the sum lose at most 6 eps.
    assert!(number("instances/bounds_sphere", "SQUARES_FACTOR") >= 1.0 + 6.0 * EPS);
    // The three products of a need.
    assert!(number("cull/lod", "NEED_FACTOR") >= 1.0 + 4.0 * EPS);
    // Bounds below the coordinate limit of every camera, and a product that does not overflow.
    let deviation = number("cull/lod", "LARGEST_DEVIATION");
    assert!((two_to(52)..=two_to(80)).contains(&deviation));
    // A box's radius: of a square or a sum less than 16 eps, and squares below 2^-126.
    assert!(number("instances/bounds_box_support", "RADIUS_FACTOR") >= 1.0 + 16.0 * EPS);
    assert!(number("instances/bounds_box_support", "RADIUS_FLOOR") >= two_to(-100));
    // Squares below 2^-126 lose what they are.
    assert!(number("instances/bounds_sphere", "SQUARES_FLOOR") >= two_to(-100));
    assert!(number("instances/bounds_sphere", "AXES") >= 3.0);
    // The margin is at least 2^-70; a ratio may not overflow.
    assert!(number("cull/decision", "LEAST_W") >= two_to(-66));
    let planes = |name: &str| number("cull/supporting_planes", name);
    // Six roundings of a texel's comparison, and what is flushed there.
    assert!(planes("TEXEL_ULPS") >= 6.0);
    assert!(planes("TEXEL_FLOOR") >= two_to(-100));
    // Slopes that one product would flush.
    assert!(planes("FLATTEST") >= two_to(-100));
    // Products of slopes and errors that do not overflow.
    assert!(planes("STEEPEST_BITS") <= f64::from(65_536.0_f32.to_bits()));
    assert!(planes("LARGEST_ERROR") <= two_to(38));
    assert_eq!(planes("MAGNITUDE_MASK"), f64::from(u32::MAX >> 1));
}

/// The size of every entry point's workgroup; (0, 0, 0) of one that is not a dispatch.
fn workgroups() -> BTreeMap<&'static str, [u32; 3]> {
    let line = |n: u32| [n, 1, 1];
    BTreeMap::from([
        ("accept_members", line(GROUP as u32)),
        ("among_order", line(among::WORKGROUP)),
        ("atomic_16x16", [16, 16, 1]),
        ("atomic_16x4", [16, 4, 1]),
        ("atomic_16x8", [16, 8, 1]),
        ("atomic_4x4", [4, 4, 1]),
        ("atomic_8x4", [8, 4, 1]),
        ("atomic_8x8", [8, 8, 1]),
        ("begin", line(1)),
        ("begin_mask", line(full_mask::WORKGROUP)),
        ("choose_lods", line(lod::LANES)),
        ("cut", line(CUT_WORKGROUP)),
        ("emit_bins", line(emit_passes::WORKGROUP)),
        ("emit_block", line(emit_passes::WORKGROUP)),
        ("emit_cut", line(CUT_WORKGROUP)),
        ("emit_draws", line(emit_passes::WORKGROUP)),
        ("emit_instances", line(emit_passes::WORKGROUP)),
        ("emit_scatter", line(emit_passes::WORKGROUP)),
        ("emit_top", line(emit_passes::WORKGROUP)),
        ("copy_records", line(SCATTER_WORKGROUP)),
        ("count", line(count::LANES)),
        ("count_of_many_pixels", line(pixels::TEAM)),
        ("count_of_most_pixels", line(pixels::LARGE_TEAM)),
        ("count_of_pixels", line(pixels::WORKGROUP)),
        ("count_of_pixels_by_few", line(pixels::FEW)),
        ("cull", line(GROUP as u32)),
        ("cull_arm", line(methods::TEXT_WORKGROUP)),
        ("cull_children", line(CULL_WORKGROUP)),
        ("cull_darnell", line(methods::TEXT_WORKGROUP)),
        ("cull_groups", line(CULL_WORKGROUP)),
        ("cull_members", line(GROUP as u32)),
        ("cull_one_lookup", line(methods::TEXT_WORKGROUP)),
        ("cull_rakos", line(methods::TEXT_WORKGROUP)),
        ("explain", line(1)),
        ("farther_level", [0; 3]),
        ("form_tier", line(tiers::WORKGROUP)),
        ("join_views", line(views::WORKGROUP)),
        ("mip_blocks", line(mips_passes::WORKGROUP)),
        ("mip_level_0", line(mips_passes::WORKGROUP)),
        ("mip_tail", line(mips_passes::WORKGROUP)),
        ("occluder_vertex", [0; 3]),
        ("reduce", line(REDUCE_WORKGROUP)),
        ("reduce_buffer", line(yardstick::BUFFER_WORKGROUP)),
        ("reduce_coarse", line(REDUCE_WORKGROUP)),
        ("reduce_tail", line(REDUCE_WORKGROUP)),
        (
            "reduce_texture",
            [yardstick::TEXTURE_WORKGROUP_SIDE, yardstick::TEXTURE_WORKGROUP_SIDE, 1],
        ),
        ("finish_receivers", [MASK_SIDE, MASK_SIDE, 1]),
        ("scatter_receivers", [MASK_SIDE, MASK_SIDE, 1]),
        ("refine", line(refine::WORKGROUP)),
        ("refine_groups", line(refine::WORKGROUP)),
        ("settle_groups", line(GROUP as u32)),
        ("replace_groups", line(update::WORKGROUP)),
        ("replace_records", line(update::WORKGROUP)),
        ("resolve", line(resolve::WORKGROUP)),
        // One workgroup, the largest that WebGPU promises.
        ("scan", line(wgpu::Limits::default().max_compute_invocations_per_workgroup)),
        ("scatter", line(SCATTER_WORKGROUP)),
        ("spin", line(clock_check::WORKGROUP)),
        ("take_bounds", line(from_buffer::WORKGROUP)),
        ("tree", line(methods::TILE * methods::TILE)),
        ("whole_image", [0; 3]),
    ])
}

#[test]
fn workgroups_have_the_sizes_that_dispatches_count_on() {
    let expected = workgroups();
    let mut found = BTreeSet::new();
    for (_, module) in covering() {
        for point in module.entry_points {
            let size = expected.get(point.name.as_str());
            assert_eq!(size, Some(&point.workgroup_size), "{}", point.name);
            found.insert(point.name);
        }
    }
    assert!(found.iter().map(String::as_str).eq(expected.into_keys()), "{found:?}");
}

#[test]
fn a_cull_sets_every_override() {
    let store = DepthStore::Apart(SourceKind::Depth);
    for kind in KINDS {
        let key = CullKey {
            store,
            kind,
            reversed: false,
            chunks: 1,
            sample_coverage: false,
            footprint_log2: 1,
            by_rows: false,
            descent: false,
            fit_volume: false,
            among: false,
            nearest: false,
            both: false,
            receivers: false,
            decision: Decision::Seen,
        };
        let alone = EMITS.map(|emit| (emit, FramePass::Alone));
        let early = [Candidates::History, Candidates::Size].map(FramePass::Early);
        let of_two = early
            .into_iter()
            .chain([FramePass::Late])
            .flat_map(|pass| EMITS_OF_TWO.map(|emit| (emit, pass)));
        for ((way, emit), pass) in alone.into_iter().chain(of_two) {
            let report = ReportKey {
                mask: false,
                verdicts: false,
                absent: false,
                emit,
                statistics: false,
                pass,
            };
            let set = classify_constants(&key).into_iter().chain(report_constants(&report));
            let set: BTreeSet<String> = set.map(|(name, _)| name.to_owned()).collect();
            let module = parse(&flat_module(store, kind, pass.decision(), (emit, pass)).text());
            let declared: BTreeSet<String> =
                module.overrides.iter().filter_map(|(_, o)| o.name.clone()).collect();
            assert_eq!(set, declared, "{kind:?} {way} {pass:?}");
        }
    }
}
