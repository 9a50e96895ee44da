//! Every module of this crate.

use crate::cull::count;
use crate::cull::explain::explain_module;
use crate::cull::pipelines::{DepthStore, cull_groups_module, cull_members_module, cull_module};
use crate::cull::refine::{refine_groups_module, refine_module};
use crate::gpu::depth_source::SOURCES;
use crate::gpu::shader::{FILES, Source};
use crate::input::bounds::BoundsKind;
use crate::instances::update;
use crate::occluders::raster;
use crate::output::compact;
use crate::pyramid::reduce::{blocks_module, coarse_module};
#[cfg(feature = "yardstick")]
use crate::yardstick;

/// All kinds of bounds.
const KINDS: [BoundsKind; 3] = [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox];

/// Path below `shaders/`, without its extension, and text of every file.
pub fn files() -> Vec<(&'static str, &'static str)> {
    FILES.iter().map(|file| (file.path, file.text)).collect()
}

/// A name and the WGSL text of every module that a pipeline may be made of.
pub fn modules() -> Vec<(String, String)> {
    all().into_iter().map(|(name, source)| (name, source.text())).collect()
}

fn all() -> Vec<(String, Source)> {
    let mut all = vec![
        ("refine_groups".to_owned(), refine_groups_module()),
        ("compact".to_owned(), compact::module()),
        ("count".to_owned(), count::module()),
        ("update".to_owned(), update::module()),
        ("occluders".to_owned(), raster::module()),
    ];
    for source in SOURCES {
        all.push((format!("reduce {source:?}"), blocks_module(source)));
        all.push((format!("reduce_coarse {source:?}"), coarse_module(source)));
        #[cfg(feature = "yardstick")]
        all.extend(yardstick::modules(source).map(|(name, m)| (format!("{name} {source:?}"), m)));
    }
    let stores = SOURCES.map(DepthStore::Apart).into_iter().chain([DepthStore::Atlas]);
    for store in stores {
        all.push((format!("cull_groups {store:?}"), cull_groups_module(store)));
        for kind in KINDS {
            let named = |name: &str| format!("{name} {store:?} {kind:?}");
            all.push((named("cull"), cull_module(store, kind)));
            all.push((named("cull_members"), cull_members_module(store, kind)));
            all.push((named("explain"), explain_module(store, kind)));
        }
        #[cfg(feature = "yardstick")]
        all.push((format!("uncertified cull {store:?}"), yardstick::cull_module(store)));
    }
    all.extend(KINDS.map(|kind| (format!("refine {kind:?}"), refine_module(kind))));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::depth_source::SourceKind;
    use crate::gpu::shader::wgsl;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    fn parse(source: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(source)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        Validator::new(ValidationFlags::all(), Capabilities::default())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        module
    }

    #[test]
    fn every_module_is_valid_wgsl() {
        for (_, text) in modules() {
            parse(&text);
        }
    }

    /// Offsets of a WGSL struct's members, and its size.
    fn layout(module: &naga::Module, name: &str) -> (Vec<(String, u32)>, u32) {
        let (_, ty) =
            module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).expect(name);
        let naga::TypeInner::Struct { members, span } = &ty.inner else {
            panic!("{name} is no struct")
        };
        (members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect(), *span)
    }

    macro_rules! same_layout {
        ($module:expr, $wgsl:literal, $rust:ty { $($theirs:literal = $ours:ident),* $(,)? }) => {{
            let (members, span) = layout(&$module, $wgsl);
            let expected = vec![$(($theirs.to_owned(), std::mem::offset_of!($rust, $ours) as u32)),*];
            assert_eq!(members, expected, "{}", $wgsl);
            assert_eq!(span as usize, size_of::<$rust>(), "{}", $wgsl);
        }};
    }

    #[test]
    fn rust_twins_have_the_offsets_of_wgsl() {
        use crate::cull::explain::ExplanationRecord;
        use crate::cull::view_uniform::ViewUniform;
        use crate::instances::piece::PieceUniform;
        use crate::instances::update::UpdateUniform;
        use crate::output::counters::{CounterRecord, StatisticsRecord};
        use crate::output::draw::DrawIndexedIndirect;
        use crate::pyramid::PyramidUniform;
        use crate::pyramid::levels::Level;
        use crate::pyramid::reduce::StepUniform;

        let module =
            parse(&cull_module(DepthStore::Apart(SourceKind::Depth), BoundsKind::Sphere).text());
        same_layout!(module, "Level", Level { "offset" = offset, "stride" = stride, "width" = width, "height" = height });
        same_layout!(module, "Pyramid", PyramidUniform {
            "levels" = levels, "origins" = origins, "chunk_shift" = chunk_shift, "first_stored" = first_stored, "last_stored" = last_stored,
            "padding" = padding
        });
        same_layout!(parse(&blocks_module(SourceKind::Depth).text()), "Step", StepUniform {
            "source" = source, "last" = last, "reduction" = reduction, "padding" = padding, "blocks" = blocks,
            "padding_1" = padding_1
        });
        same_layout!(module, "View", ViewUniform {
            "x" = x, "y" = y, "z" = z, "w" = w, "magnitudes" = magnitudes, "constant_magnitudes" = constant_magnitudes,
            "eye_hi" = eye_hi, "z_slope" = z_slope, "eye_lo" = eye_lo, "halves_size" = halves_size, "half_size" = half_size,
            "reach" = reach, "depth_factor" = depth_factor, "size" = size, "runtime_zero" = runtime_zero,
            "reduction" = reduction, "descent_budget" = descent_budget, "depth_offset" = depth_offset,
            "coordinate_limit" = coordinate_limit, "padding" = padding
        });
        same_layout!(module, "Piece", PieceUniform { "base" = base, "count" = count, "index" = index, "words" = words });
        same_layout!(module, "DrawIndexedIndirect", DrawIndexedIndirect {
            "index_count" = index_count, "instance_count" = instance_count, "first_index" = first_index,
            "base_vertex" = base_vertex, "first_instance" = first_instance
        });
        same_layout!(module, "Statistics", StatisticsRecord {
            "levels" = levels, "texels_low" = texels_low, "texels_high" = texels_high
        });
        let module = parse(&count::module().text());
        same_layout!(module, "Counters", CounterRecord {
            "outside" = outside, "occluded" = occluded, "visible" = visible, "invalid" = invalid
        });
        let update = parse(&update::module().text());
        same_layout!(update, "Update", UpdateUniform {
            "count" = count, "texels" = texels, "number" = number, "padding" = padding
        });
        let oriented = parse(
            &explain_module(DepthStore::Apart(SourceKind::Depth), BoundsKind::OrientedBox).text(),
        );
        same_layout!(oriented, "Explanation", ExplanationRecord {
            "verdict" = verdict, "stage" = stage, "level" = level, "farthest_bits" = farthest_bits, "pixels" = pixels,
            "depths" = depths, "last" = last, "texels_read" = texels_read, "of_footprint" = of_footprint,
            "farthest_before" = farthest_before, "any_before" = any_before
        });
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
            let module = parse(&cull_module(DepthStore::Apart(SourceKind::Depth), kind).text());
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
            assert_eq!(calls(&module, "load_volume", "bar3"), 2, "{kind:?}: d_hi and d_lo");
            assert_eq!(calls(&module, "surely_behind", "bar"), 1, "d - A");
            assert_eq!(
                calls(&module, "occluding_depth", "bar"),
                1,
                "the depth that slack has moved"
            );
            assert_eq!(calls(&module, "classify", "bar"), 2, "-A and 1 - A");
            if kind != BoundsKind::Sphere {
                assert_eq!(calls(&module, "extent_of", "bar"), 2, "low and high");
                assert_eq!(calls(&module, "surely_after", "bar"), 1, "the edge");
                assert_eq!(calls(&module, "surely_before", "bar"), 1, "the edge");
            }
            assert_eq!(calls(&module, "surely_clear", "bar"), 1, "d - A");
            assert_eq!(calls(&module, "proved_interval", "bar"), 2, "both ends");
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
            let module = parse(&cull_module(DepthStore::Apart(source), BoundsKind::Box).text());
            assert_eq!(calls(&module, "source_bits", "sanitized"), 1, "{source:?}");
        }
        assert_eq!(
            calls(
                &parse(&cull_module(DepthStore::Atlas, BoundsKind::Box).text()),
                "texel",
                "sanitized"
            ),
            1
        );
    }

    /// A guess is mostly right, so that no verdict shows whether it was proved.
    #[test]
    fn every_plane_and_side_is_certified() {
        for kind in KINDS {
            let module = parse(&cull_module(DepthStore::Apart(SourceKind::Depth), kind).text());
            assert_eq!(
                calls(&module, "supporting_planes", "surely_above"),
                1,
                "{kind:?}: a plane's offset"
            );
            assert_eq!(
                calls(&module, "proved_interval", "surely_above"),
                1,
                "{kind:?}: left and top"
            );
            assert_eq!(
                calls(&module, "proved_interval", "surely_below"),
                1,
                "{kind:?}: right and bottom"
            );
        }
    }

    /// The f32 that a shader says after `before`.
    fn number(shader: &str, before: &str) -> f64 {
        let rest = shader.split_once(before).unwrap_or_else(|| panic!("{before}")).1;
        let text: String =
            rest.chars().take_while(|c| c.is_alphanumeric() || ".-".contains(*c)).collect();
        match text.split_once("p") {
            Some(("0x1", exponent)) => 2.0_f64.powi(exponent.parse().expect("an exponent")),
            _ => text.parse().expect("a number"),
        }
    }

    /// What docs/accuracy.md derives of constants whose absence shows in no verdict but the
    /// mirror's: they cover what it counts.
    #[test]
    fn constants_cover_what_is_counted() {
        let eps = crate::host::rounding::EPS;
        let certificate = wgsl!("cull/certificate").text;
        assert!(
            number(certificate, "ERROR_FLOOR: f32 = ") >= 2.0_f64.powi(-70),
            "flushed subnormals"
        );
        // Both squares, the product and the sum lose at most 6 eps, and squares below 2^-126 what
        // they are.
        let sphere = wgsl!("instances/bounds_sphere").text;
        assert!(number(sphere, "dot(half, half) * ") >= 1.0 + 6.0 * eps, "a sphere's squares");
        assert!(number(sphere, "1.000001 + ") >= 2.0_f64.powi(-100), "what vanishes of them");
        // The margin is at least 2^-70; a ratio may not overflow.
        assert!(
            number(wgsl!("cull/classify").text, "LEAST_W: f32 = ") >= 2.0_f64.powi(-66),
            "the least w"
        );
        let planes = wgsl!("cull/supporting_planes").text;
        // Six roundings of a texel's comparison.
        assert!(number(planes, "let margin = ") >= 6.0, "a texel's margin");
        assert!(number(planes, "abs(bound)) + ") >= 2.0_f64.powi(-100), "what is flushed there");
        assert!(
            number(planes, "FLATTEST: f32 = ") >= 2.0_f64.powi(-100),
            "slopes that one product would flush"
        );
    }

    #[test]
    fn constants_agree_with_the_shaders() {
        let margin = format!("ERROR_ULPS: f32 = {:.1};", crate::input::view::ERROR_ULPS);
        assert!(wgsl!("cull/certificate").text.contains(&margin));
        let workgroup = crate::instances::piece::CULL_WORKGROUP;
        assert!(
            wgsl!("cull/cull_groups").text.contains(&format!("WORKGROUP: u32 = {workgroup}u;"))
        );
        assert!(wgsl!("instances/update").text.contains(&format!("@workgroup_size({workgroup})")));
        let group = format!("GROUP: u32 = {}u;", crate::instances::groups::GROUP);
        assert!(wgsl!("instances/groups").text.contains(&group));
        let run = format!("RUN: u32 = {}u;", crate::cull::groups::GROUPS_OF_RUN);
        assert!(wgsl!("instances/groups").text.contains(&run));
        let survivors = format!(
            "SURVIVORS_PER_ROW_LOG2: u32 = {}u;",
            crate::output::survivors::SURVIVORS_PER_ROW.ilog2()
        );
        assert!(wgsl!("instances/groups").text.contains(&survivors));
        let per_row = format!(
            "RECORDS_PER_ROW_LOG2: u32 = {}u;",
            crate::instances::records::RECORDS_PER_ROW.ilog2()
        );
        assert!(wgsl!("instances/record_layout").text.contains(&per_row));
    }
}
