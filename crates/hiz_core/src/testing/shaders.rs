//! Every shader module that this crate makes a pipeline of.

use crate::cull::among::among_order_module;
use crate::cull::count::count_module;
use crate::cull::explain::explain_module;
use crate::cull::full_mask::begin_mask_module;
use crate::cull::pipelines::{
    BinKey, Candidates, Decision, DepthStore, EmitKey, FramePass, accept_members_module,
    cull_boxes_module, cull_members_module, flat_module, settle_groups_module,
};
use crate::cull::pixels::pixels_module;
use crate::cull::refine::{refine_groups_module, refine_module};
use crate::gpu::clock_check::clock_check_module;
use crate::gpu::depth_source::SOURCES;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::shader::{FILES, Source, wgsl};
use crate::input::bounds::BoundsKind;
use crate::instances::from_buffer::{FROM_BUFFER_KINDS, from_buffer_module};
use crate::instances::tiers::form_tier_module;
use crate::instances::update::update_module;
#[cfg(feature = "methods")]
use crate::methods::{coarse_level_module, fragment_levels_module, texts_module};
use crate::occluders::device_raster::occluders_module;
use crate::output::bins::PlaneSet;
use crate::output::compact::{compact_module, copy_module};
use crate::output::cut::cut_module;
use crate::output::emit_passes;
use crate::output::views::join_module;
use crate::pyramid::mips_passes::mips_module;
use crate::pyramid::receiver_mask::receiver_mask_module;
use crate::pyramid::reduce::{EndFiles, blocks_module, coarse_module};
use crate::pyramid::resolve::resolve_module;
use crate::testing::lod::choose_lods_module;
#[cfg(feature = "yardstick")]
use crate::yardstick::{uncertified_module, yardstick_modules};

/// All kinds of bounds.
pub(super) const KINDS: [BoundsKind; 5] = [
    BoundsKind::Sphere,
    BoundsKind::Box,
    BoundsKind::OrientedBox,
    BoundsKind::Point,
    BoundsKind::WidePoint,
];

/// Every way to emit the kept instances, each with a shader of its own.
pub(super) const EMITS: [(&str, EmitKey); 5] = [
    ("list", EmitKey::NO_LIST),
    ("planes", EmitKey::Planes { by_index: false, set: PlaneSet::One, bins: ONE_LOD }),
    ("planes of LODs", EmitKey::Planes { by_index: false, set: PlaneSet::Four, bins: LODS }),
    ("bins", EmitKey::Append { list: true, capped: true, record_words: 5, bins: ONE_LOD }),
    ("bins of LODs", EmitKey::Append { list: true, capped: true, record_words: 5, bins: LODS }),
];

const ONE_LOD: BinKey = BinKey { sorted: true, lod_rule: None };
const LODS: BinKey = BinKey { sorted: true, lod_rule: Some(1) };

/// Every way to emit what one of the two passes of a frame reports.
pub(super) const EMITS_OF_TWO: [(&str, EmitKey); 3] = [("mask", EmitKey::Mask), EMITS[1], EMITS[2]];

/// Path below `shaders/`, without its extension, and text of every file.
pub fn files() -> Vec<(&'static str, &'static str)> {
    FILES.iter().map(|file| (file.path, file.text)).collect()
}

/// A name and the WGSL text of every module that a pipeline may be made of.
pub fn modules() -> Vec<(String, String)> {
    all().into_iter().map(|(name, source)| (name, source.text())).collect()
}

pub(super) fn all() -> Vec<(String, Source)> {
    let mut all = vec![
        ("refine_groups".to_owned(), refine_groups_module()),
        ("compact".to_owned(), compact_module()),
        ("copy".to_owned(), copy_module()),
        ("cut".to_owned(), cut_module()),
        ("emit_draws".to_owned(), emit_passes::draws_module(PlaneSet::One)),
        ("count".to_owned(), count_module()),
        ("among_order".to_owned(), among_order_module()),
        ("begin_mask".to_owned(), begin_mask_module()),
        ("join_views".to_owned(), join_module()),
        ("clock_check".to_owned(), clock_check_module()),
        ("update".to_owned(), update_module()),
        ("form_tier".to_owned(), form_tier_module()),
        ("occluders".to_owned(), occluders_module()),
        ("resolve Depth".to_owned(), resolve_module(SourceKind::Depth)),
        ("resolve Float".to_owned(), resolve_module(SourceKind::Float)),
        ("snippets".to_owned(), snippets()),
    ];
    for set in [PlaneSet::One, PlaneSet::Four] {
        let modules: [(_, fn(_) -> _); 5] = [
            ("emit_cut", emit_passes::cut_module),
            ("emit_scan", emit_passes::scan_module),
            ("emit_bins", emit_passes::bins_module),
            ("emit_scatter", emit_passes::scatter_module),
            ("emit_instances", emit_passes::instances_module),
        ];
        all.extend(modules.map(|(name, module)| (format!("{name} {set:?}"), module(set))));
    }
    #[cfg(feature = "methods")]
    all.extend([
        ("published tests".to_owned(), texts_module()),
        ("one coarse level".to_owned(), coarse_level_module()),
        ("fragment levels".to_owned(), fragment_levels_module()),
    ]);
    let mask = |source| (format!("receiver_mask {source:?}"), receiver_mask_module(source));
    all.extend(SOURCES.into_iter().filter(|source| *source != SourceKind::Pair).map(mask));
    for source in SOURCES {
        // Mip textures read one image.
        if source != SourceKind::Pair {
            all.push((format!("mips {source:?}"), mips_module(source, false)));
            all.push((format!("mips {source:?} both"), mips_module(source, true)));
        }
        for ends in [EndFiles::One, EndFiles::Both] {
            all.push((format!("reduce {source:?} {ends:?}"), blocks_module(source, ends)));
            all.push((format!("reduce_coarse {source:?} {ends:?}"), coarse_module(source, ends)));
        }
        // Yardsticks read whole images alone.
        #[cfg(feature = "yardstick")]
        all.extend(
            (!source.is_part() && source != SourceKind::Pair)
                .then(|| yardstick_modules(source))
                .into_iter()
                .flatten()
                .map(|(name, m)| (format!("{name} {source:?}"), m)),
        );
    }
    let others = [DepthStore::Atlas, DepthStore::InPlace];
    let stores = SOURCES.map(DepthStore::Apart).into_iter().chain(others);
    // The sets of an early pass differ in a constant, and in what is decided.
    let early = [Candidates::History, Candidates::Size]
        .map(|candidates| (DepthStore::Atlas, FramePass::Early(candidates)));
    let passes = [FramePass::Alone, FramePass::Late];
    let passes = stores.clone().flat_map(|store| passes.map(|pass| (store, pass)));
    for (store, pass) in passes.chain(early) {
        let decision = pass.decision();
        for (name, is_top) in [("cull_groups", true), ("cull_children", false)] {
            let module = cull_boxes_module(store, decision, (pass, is_top));
            all.push((format!("{name} {store:?} {pass:?}"), module));
        }
        let emits: &[_] = if pass == FramePass::Alone { &EMITS } else { &EMITS_OF_TWO };
        for (kind, (way, emit)) in
            KINDS.into_iter().flat_map(|k| emits.iter().map(move |e| (k, *e)))
        {
            let named = |name: &str| format!("{name} {way} {store:?} {pass:?} {kind:?}");
            let of = (emit, pass);
            all.push((named("cull"), flat_module(store, kind, decision, of)));
            let members = cull_members_module(store, kind, decision, of);
            all.push((named("cull_members"), members));
            if matches!(pass, FramePass::Early(_)) {
                continue;
            }
            all.push((named("accept_members"), accept_members_module(store, kind, emit, pass)));
            if pass == FramePass::Alone && matches!(emit, EmitKey::List { .. }) {
                all.push((named("settle_groups"), settle_groups_module(store, kind, emit)));
            }
        }
    }
    // Culls of casters report as others do, so one way to emit stands for all.
    let emit = (EMITS[0].1, FramePass::Alone);
    for store in stores.clone() {
        for (name, is_top) in [("cull_groups", true), ("cull_children", false)] {
            let module = cull_boxes_module(store, Decision::Shadow, (FramePass::Alone, is_top));
            all.push((format!("{name} of casters {store:?}"), module));
        }
        for kind in KINDS {
            let named = |name: &str| format!("{name} of casters {store:?} {kind:?}");
            all.push((named("cull"), flat_module(store, kind, Decision::Shadow, emit)));
            let members = cull_members_module(store, kind, Decision::Shadow, emit);
            all.push((named("cull_members"), members));
        }
    }
    for store in stores {
        for kind in KINDS {
            all.push((format!("explain {store:?} {kind:?}"), explain_module(store, kind)));
            all.push((format!("pixels {store:?} {kind:?}"), pixels_module(store, kind)));
        }
        #[cfg(feature = "yardstick")]
        all.push((format!("uncertified cull {store:?}"), uncertified_module(store)));
    }
    for decision in [Decision::Seen, Decision::Shadow] {
        let refined =
            |kind| (format!("refine {decision:?} {kind:?}"), refine_module(kind, decision));
        all.extend(KINDS.map(refined));
    }
    all.extend(KINDS.map(|kind| (format!("choose_lods {kind:?}"), choose_lods_module(kind))));
    let from_buffer = |kind| (format!("from_buffer {kind:?}"), from_buffer_module(kind));
    all.extend(FROM_BUFFER_KINDS.map(from_buffer));
    all
}

/// What callers append to shaders of their own.
fn snippets() -> Source {
    Source::of(&[&[wgsl!("snippets/mip_lookup"), wgsl!("snippets/mip_cull")]])
}

#[cfg(test)]
pub(in crate::testing) mod tests {
    use std::collections::HashSet;

    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    /// The flat cull that is not one of two passes.
    fn cull_module(store: DepthStore, kind: BoundsKind, emit: EmitKey) -> Source {
        flat_module(store, kind, Decision::Seen, (emit, FramePass::Alone))
    }

    pub(in crate::testing) fn parse(source: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(source)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        Validator::new(ValidationFlags::all(), Capabilities::default())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        module
    }

    /// The first modules of the list that have every file between them.
    ///
    /// What a file declares is the same in all of its modules.
    /// So declarations are looked at here, instead of in every module again.
    pub(in crate::testing) fn covering() -> Vec<(Source, naga::Module)> {
        let mut seen = HashSet::new();
        // All files of a module are taken in, so it is no `any`, which would stop at the first one.
        let mut has_new = |source: &Source| {
            source.files().iter().filter(|file| seen.insert(file.path)).count() > 0
        };
        let sources = all().into_iter().map(|(_, source)| source);
        sources.filter(&mut has_new).map(|s| (s.clone(), parse(&s.text()))).collect()
    }

    #[test]
    fn every_file_is_in_a_module() {
        let covered: HashSet<&str> =
            covering().iter().flat_map(|(source, _)| source.files()).map(|f| f.path).collect();
        let left_out: Vec<_> = files().into_iter().filter(|(p, _)| !covered.contains(p)).collect();
        assert!(left_out.is_empty(), "{left_out:?}");
    }

    #[test]
    fn every_module_is_valid_wgsl() {
        for (_, text) in modules() {
            parse(&text);
        }
    }

    /// How often `caller` calls `callee`.
    fn calls(module: &naga::Module, caller: &str, callee: &str) -> usize {
        let named = |name: &str| {
            module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(name)).expect("it")
        };
        let (handle, _) = named(callee);
        named(caller)
            .1
            .expressions
            .iter()
            .filter(|(_, e)| matches!(e, naga::Expression::CallResult(h) if *h == handle))
            .count()
    }

    /// No driver at hand folds what cancels, so no verdict shows whether `bar` stands in the way.
    /// (What folding would do is shown by `tests/mirror.rs`.)
    #[test]
    fn bars_stand_where_a_compiler_could_fold_what_cancels() {
        for kind in KINDS {
            let module = parse(
                &cull_module(DepthStore::Apart(SourceKind::Depth), kind, EmitKey::NO_LIST).text(),
            );
            for bar in ["bar", "bar2", "bar3"] {
                let (_, function) = module
                    .functions
                    .iter()
                    .find(|(_, f)| f.name.as_deref() == Some(bar))
                    .expect(bar);
                let is_xor = |e: &naga::Expression| {
                    matches!(
                        e,
                        naga::Expression::Binary { op: naga::BinaryOperator::ExclusiveOr, .. }
                    )
                };
                assert!(function.expressions.iter().any(|(_, e)| is_xor(e)), "{bar}");
            }
            // Of a narrow point nothing is added to `d_hi` but a number of the view.
            let bars = if kind == BoundsKind::Point { 1 } else { 2 };
            assert_eq!(calls(&module, "load_volume", "bar3"), bars, "{kind:?}: d_hi and d_lo");
            assert_eq!(calls(&module, "surely_behind", "bar"), 1, "d - A");
            assert_eq!(
                calls(&module, "occluding_depth", "bar"),
                1,
                "the depth that slack has moved"
            );
            assert_eq!(calls(&module, "surely_outside", "bar"), 2, "-A and 1 - A");
            assert_eq!(calls(&module, "surely_in_front", "bar"), 1, "d - A");
            assert_eq!(
                calls(&module, "revealing_depth", "bar"),
                1,
                "the depth that slack has moved towards the eye"
            );
            assert_eq!(calls(&module, "surely_inside", "bar"), 2, "-A and 1 - A");
            if matches!(kind, BoundsKind::Box | BoundsKind::OrientedBox) {
                assert_eq!(calls(&module, "extent_of", "bar"), 2, "low and high");
                assert_eq!(calls(&module, "surely_after", "bar"), 1, "the edge");
                assert_eq!(calls(&module, "surely_before", "bar"), 1, "the edge");
            }
            assert_eq!(calls(&module, "surely_clear", "bar"), 1, "d - A");
            assert_eq!(calls(&module, "proved_ends", "bar"), 2, "both ends");
            assert_eq!(calls(&module, "supporting_planes", "bar2"), 1, "slopes");
            assert_eq!(calls(&module, "supporting_planes", "bar"), 1, "offsets");
        }
    }

    /// Drivers clamp what is drawn to 0..=1, and nothing else may be copied into a depth texture:
    /// no verdict of theirs shows whether its single pixels are sanitized.
    /// (`tests/no_depth.rs` has what other textures hold.)
    #[test]
    fn single_pixels_of_every_source_are_sanitized() {
        for source in SOURCES {
            let module = parse(
                &cull_module(DepthStore::Apart(source), BoundsKind::Box, EmitKey::NO_LIST).text(),
            );
            assert_eq!(calls(&module, "texel", "sanitized"), 1, "{source:?}");
            assert_eq!(calls(&module, "nearest_texel", "sanitized_near"), 1, "{source:?}");
        }
        let atlas = cull_module(DepthStore::Atlas, BoundsKind::Box, EmitKey::NO_LIST);
        let atlas = parse(&atlas.text());
        assert_eq!(calls(&atlas, "texel", "sanitized"), 1);
        assert_eq!(calls(&atlas, "nearest_texel", "sanitized_near"), 1);
    }

    /// A guess is mostly right, so that no verdict shows whether it was proved.
    #[test]
    fn every_plane_and_side_is_certified() {
        for kind in KINDS {
            let module = parse(
                &cull_module(DepthStore::Apart(SourceKind::Depth), kind, EmitKey::NO_LIST).text(),
            );
            assert_eq!(
                calls(&module, "supporting_planes", "surely_above"),
                1,
                "{kind:?}: a plane's offset"
            );
            assert_eq!(calls(&module, "proved_ends", "surely_above"), 1, "{kind:?}: left and top");
            assert_eq!(
                calls(&module, "proved_ends", "surely_below"),
                1,
                "{kind:?}: right and bottom"
            );
        }
    }

    /// Literals of a shader's code, outside of declarations that name them and of attributes.
    fn literals(text: &str) -> Vec<&str> {
        let mut found = Vec::new();
        for line in text.lines() {
            let code = line.split("//").next().unwrap_or_default();
            if code.starts_with("const ") || code.starts_with('@') {
                continue;
            }
            let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
            found.extend(
                code.split(|c| !is_word(c)).filter(|w| w.starts_with(|c: char| c.is_ascii_digit())),
            );
        }
        found
    }

    /// Numbers that need no name: plain arithmetic, and the rows and lanes 0 to 3 of four.
    const PLAIN: &[&str] =
        &["0", "1", "2", "3", "0u", "1u", "2u", "3u", "0.0", "1.0", "-1.0", "2.0"];

    #[test]
    fn numbers_of_shaders_have_names() {
        // The locations of vertex inputs.
        let known = ["4", "5", "6", "7"].map(|number| ("occluders/occluders", number));
        for (path, text) in files() {
            for literal in literals(text) {
                let is_plain = PLAIN.contains(&literal) || known.contains(&(path, literal));
                assert!(is_plain, "{path}: what is {literal}?");
            }
        }
    }

    #[test]
    fn lines_of_shaders_have_at_most_100_columns() {
        for (path, text) in files() {
            for (i, line) in text.lines().enumerate() {
                assert!(line.chars().count() <= 100, "{path}, line {}", i + 1);
            }
        }
    }
}
