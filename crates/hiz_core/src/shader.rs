//! WGSL: which files make which module.
//! Composition is ordered concatenation; there is no preprocessor.

use crate::bounds::BoundsKind;
use crate::camera::ImageSize;

macro_rules! wgsl {
    ($name:literal) => {
        include_str!(concat!("../shaders/", $name, ".wgsl"))
    };
}

/// What level 0 of a pyramid is read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum SourceKind {
    /// A depth texture.
    Depth,
    /// A float color texture.
    Float,
    /// A texture of float32 bits, four pixels a texel.
    Bits,
}

/// Where a cull reads depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum DepthStore {
    /// Level 0 in the depth image, the others in the buffers that the reduction fills.
    Apart(SourceKind),
    /// All of them in one texture.
    Atlas,
    /// Nowhere: it finds what is outside.
    Nowhere,
}

impl DepthStore {
    fn wgsl(self) -> String {
        match self {
            Self::Apart(source) => [&source.wgsl(), wgsl!("shared/texels_apart")].join("\n"),
            Self::Atlas => wgsl!("shared/texels_atlas").to_owned(),
            Self::Nowhere => wgsl!("shared/texels_nowhere").to_owned(),
        }
    }
}

impl SourceKind {
    fn wgsl(self) -> String {
        let sampled = wgsl!("shared/source_sampled");
        match self {
            Self::Depth => [wgsl!("shared/source_depth"), sampled].join("\n"),
            Self::Float => [wgsl!("shared/source_float"), sampled].join("\n"),
            Self::Bits => wgsl!("shared/source_bits").to_owned(),
        }
    }

    /// How it is bound.
    pub(crate) fn binding(self) -> wgpu::BindingType {
        let view_dimension = wgpu::TextureViewDimension::D2;
        let sampled = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension,
            multisampled: false,
        };
        match self {
            Self::Depth => sampled(wgpu::TextureSampleType::Depth),
            Self::Float => sampled(wgpu::TextureSampleType::Float { filterable: false }),
            Self::Bits => wgpu::BindingType::StorageTexture {
                access: wgpu::StorageTextureAccess::ReadOnly,
                format: wgpu::TextureFormat::Rgba32Uint,
                view_dimension,
            },
        }
    }

    /// The usage that its texture needs for that.
    pub(crate) fn usage(self) -> wgpu::TextureUsages {
        match self {
            Self::Depth | Self::Float => wgpu::TextureUsages::TEXTURE_BINDING,
            Self::Bits => wgpu::TextureUsages::STORAGE_BINDING,
        }
    }

    /// Pixels of a row that one texel holds.
    pub(crate) fn pixels_of_texel(self) -> u32 {
        if self == Self::Bits { 4 } else { 1 }
    }

    /// The size of the texture of an image.
    pub(crate) fn texture_size(self, image: ImageSize) -> ImageSize {
        ImageSize::new(image.width.div_ceil(self.pixels_of_texel()), image.height)
    }

    /// The kind that fits a texture's format.
    pub(crate) fn of(format: wgpu::TextureFormat) -> Option<Self> {
        match format {
            wgpu::TextureFormat::R32Float | wgpu::TextureFormat::R16Float => Some(Self::Float),
            wgpu::TextureFormat::Rgba32Uint => Some(Self::Bits),
            f if f.has_depth_aspect() => Some(Self::Depth),
            _ => None,
        }
    }
}

/// The depth reduction, three levels a pass.
pub(crate) fn reduce(source: SourceKind) -> String {
    reducing(source, wgsl!("reduce"))
}

/// The depth reduction to one coarse level.
pub(crate) fn reduce_coarse(source: SourceKind) -> String {
    reducing(source, wgsl!("reduce_coarse"))
}

fn reducing(source: SourceKind, entry: &str) -> String {
    [
        wgsl!("shared/depth_bits"),
        &source.wgsl(),
        wgsl!("shared/pyramid"),
        wgsl!("shared/pyramid_write"),
        entry,
    ]
    .join("\n")
}

/// A yardstick: one dispatch a level on a flat buffer.
pub(crate) fn yardstick_reduce_buffer(source: SourceKind) -> String {
    [wgsl!("shared/depth_bits"), &source.wgsl(), wgsl!("yardstick/reduce_buffer")].join("\n")
}

/// A yardstick: one dispatch a level on a texture's mip levels.
pub(crate) fn yardstick_reduce_texture(source: SourceKind) -> String {
    [wgsl!("shared/depth_bits"), &source.wgsl(), wgsl!("yardstick/reduce_texture")].join("\n")
}

/// The cull (`entry` = its own file), which shares everything up to the verdict with the
/// explanation.
fn classifying(store: DepthStore, kind: BoundsKind, entry: &str) -> String {
    module(store, kind, &certified(), &[wgsl!("shared/untold"), entry].join("\n"))
}

fn certified() -> String {
    [wgsl!("shared/supporting_planes"), wgsl!("shared/classify")].join("\n")
}

/// The same frame for the given decision about one instance.
fn module(store: DepthStore, kind: BoundsKind, classify: &str, entry: &str) -> String {
    let store = store.wgsl();
    let bounds = match kind {
        BoundsKind::Sphere => wgsl!("shared/bounds_sphere").to_owned(),
        BoundsKind::Box => {
            [wgsl!("shared/bounds_box_support"), wgsl!("shared/bounds_box")].join("\n")
        }
        BoundsKind::OrientedBox => {
            [wgsl!("shared/bounds_box_support"), wgsl!("shared/bounds_oriented_box")].join("\n")
        }
    };
    [
        wgsl!("shared/depth_bits"),
        wgsl!("shared/pyramid"),
        wgsl!("shared/view"),
        wgsl!("shared/record_layout"),
        wgsl!("shared/records"),
        bounds.as_str(),
        wgsl!("shared/certificate"),
        wgsl!("shared/verdict"),
        wgsl!("shared/outcome"),
        wgsl!("shared/levels"),
        store.as_str(),
        wgsl!("shared/texels"),
        classify,
        entry,
    ]
    .join("\n")
}

/// The cull of instances of one kind.
pub(crate) fn cull(store: DepthStore, kind: BoundsKind) -> String {
    classifying(store, kind, &flat_frame())
}

/// A yardstick: the same of boxes without certificates.
pub(crate) fn yardstick_cull(store: DepthStore) -> String {
    let bounds = BoundsKind::Box;
    module(store, bounds, &uncertified(), &[wgsl!("shared/untold"), &flat_frame()].join("\n"))
}

fn uncertified() -> String {
    // The kinds of bounds speak of supporting planes, which nobody asks for here.
    [wgsl!("shared/supporting_planes"), wgsl!("yardstick/classify_uncertified")].join("\n")
}

fn flat_frame() -> String {
    [
        wgsl!("shared/piece"),
        wgsl!("shared/groups"),
        wgsl!("shared/statistics"),
        wgsl!("shared/report"),
        wgsl!("cull"),
    ]
    .join("\n")
}

/// The cull of groups.
pub(crate) fn cull_groups(store: DepthStore) -> String {
    let entry = [
        wgsl!("shared/piece"),
        wgsl!("shared/groups"),
        wgsl!("shared/statistics"),
        wgsl!("cull_groups"),
    ];
    classifying(store, BoundsKind::Box, &entry.join("\n"))
}

/// The cull of the members of the groups that are left.
pub(crate) fn cull_members(store: DepthStore, kind: BoundsKind) -> String {
    let entry = [
        wgsl!("shared/piece"),
        wgsl!("shared/statistics"),
        wgsl!("shared/report"),
        wgsl!("shared/groups"),
        wgsl!("cull_members"),
    ];
    classifying(store, kind, &entry.join("\n"))
}

/// The verdicts of the members of groups that were hidden as a whole.
pub(crate) fn refine(kind: BoundsKind) -> String {
    let entry = [wgsl!("shared/piece"), wgsl!("shared/groups"), wgsl!("refine")];
    classifying(DepthStore::Nowhere, kind, &entry.join("\n"))
}

/// The groups that lie within the view.
pub(crate) fn refine_groups() -> String {
    let entry = [wgsl!("shared/piece"), wgsl!("refine_groups")];
    classifying(DepthStore::Nowhere, BoundsKind::Box, &entry.join("\n"))
}

/// The explanation of one instance's verdict.
pub(crate) fn explain(store: DepthStore, kind: BoundsKind) -> String {
    module(store, kind, &certified(), wgsl!("explain"))
}

/// The ordered compaction.
pub(crate) fn compact() -> String {
    [wgsl!("shared/piece"), wgsl!("compact")].join("\n")
}

/// The count of verdicts.
pub(crate) fn count() -> String {
    [wgsl!("shared/verdict"), wgsl!("shared/piece"), wgsl!("count")].join("\n")
}

/// The update of records and groups.
pub(crate) fn update() -> String {
    [wgsl!("shared/record_layout"), wgsl!("update")].join("\n")
}

/// The occluder pass.
pub(crate) fn occluders() -> String {
    wgsl!("occluders").to_owned()
}

/// All kinds of source, in the order of their numbers.
pub(crate) const SOURCES: [SourceKind; 3] =
    [SourceKind::Depth, SourceKind::Float, SourceKind::Bits];
const KINDS: [BoundsKind; 3] = [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox];

/// Every module, for those who plant faults in them.
pub(crate) fn all() -> Vec<String> {
    let culls = |store: DepthStore| {
        let of_kind =
            move |kind| [cull(store, kind), cull_members(store, kind), explain(store, kind)];
        KINDS.into_iter().flat_map(of_kind).chain([cull_groups(store), yardstick_cull(store)])
    };
    let of_source =
        |source| culls(DepthStore::Apart(source)).chain([reduce(source), reduce_coarse(source)]);
    SOURCES
        .into_iter()
        .flat_map(of_source)
        .chain(culls(DepthStore::Atlas))
        .chain(KINDS.map(refine))
        .chain([refine_groups()])
        .chain([compact(), count(), update(), occluders()])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
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
        for module in all() {
            parse(&module);
        }
        for source in SOURCES {
            parse(&yardstick_reduce_buffer(source));
            parse(&yardstick_reduce_texture(source));
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
        use crate::cull::{ExplanationRecord, ViewUniform};
        use crate::instances::PieceUniform;
        use crate::layout::Level;
        use crate::lists::DrawIndexedIndirect;
        use crate::pyramid::{PyramidUniform, StepUniform};
        use crate::update::UpdateUniform;
        use crate::visible::{CounterRecord, StatisticsRecord};

        let module = parse(&cull(DepthStore::Apart(SourceKind::Depth), BoundsKind::Sphere));
        same_layout!(module, "Level", Level { "offset" = offset, "stride" = stride, "width" = width, "height" = height });
        same_layout!(module, "Pyramid", PyramidUniform {
            "levels" = levels, "origins" = origins, "chunk_shift" = chunk_shift, "first_stored" = first_stored, "last_stored" = last_stored,
            "padding" = padding
        });
        same_layout!(parse(&reduce(SourceKind::Depth)), "Step", StepUniform {
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
        let module = parse(&count());
        same_layout!(module, "Counters", CounterRecord {
            "outside" = outside, "occluded" = occluded, "visible" = visible, "invalid" = invalid
        });
        let update = parse(&update());
        same_layout!(update, "Update", UpdateUniform {
            "count" = count, "texels" = texels, "number" = number, "padding" = padding
        });
        let oriented =
            parse(&explain(DepthStore::Apart(SourceKind::Depth), BoundsKind::OrientedBox));
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
            let module = parse(&cull(DepthStore::Apart(SourceKind::Depth), kind));
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
            let module = parse(&cull(DepthStore::Apart(source), BoundsKind::Box));
            assert_eq!(calls(&module, "source_bits", "sanitized"), 1, "{source:?}");
        }
        assert_eq!(
            calls(&parse(&cull(DepthStore::Atlas, BoundsKind::Box)), "texel", "sanitized"),
            1
        );
    }

    /// A guess is mostly right, so that no verdict shows whether it was proved.
    #[test]
    fn every_plane_and_side_is_certified() {
        for kind in KINDS {
            let module = parse(&cull(DepthStore::Apart(SourceKind::Depth), kind));
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
        let eps = crate::view::EPS;
        let certificate = wgsl!("shared/certificate");
        assert!(
            number(certificate, "ERROR_FLOOR: f32 = ") >= 2.0_f64.powi(-70),
            "flushed subnormals"
        );
        // Both squares, the product and the sum lose at most 6 eps, and squares below 2^-126 what
        // they are.
        let sphere = wgsl!("shared/bounds_sphere");
        assert!(number(sphere, "dot(half, half) * ") >= 1.0 + 6.0 * eps, "a sphere's squares");
        assert!(number(sphere, "1.000001 + ") >= 2.0_f64.powi(-100), "what vanishes of them");
        // The margin is at least 2^-70; a ratio may not overflow.
        assert!(
            number(wgsl!("shared/classify"), "LEAST_W: f32 = ") >= 2.0_f64.powi(-66),
            "the least w"
        );
        let planes = wgsl!("shared/supporting_planes");
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
        let margin = format!("ERROR_ULPS: f32 = {:.1};", crate::view::ERROR_ULPS);
        assert!(wgsl!("shared/certificate").contains(&margin));
        let workgroup = crate::layout::CULL_WORKGROUP;
        assert!(wgsl!("cull_groups").contains(&format!("WORKGROUP: u32 = {workgroup}u;")));
        assert!(wgsl!("update").contains(&format!("@workgroup_size({workgroup})")));
        let group = format!("GROUP: u32 = {}u;", crate::groups::GROUP);
        assert!(wgsl!("shared/groups").contains(&group));
        let run = format!("RUN: u32 = {}u;", crate::cull::GROUPS_OF_RUN);
        assert!(wgsl!("shared/groups").contains(&run));
        let survivors = format!(
            "SURVIVORS_PER_ROW_LOG2: u32 = {}u;",
            crate::visible::SURVIVORS_PER_ROW.ilog2()
        );
        assert!(wgsl!("shared/groups").contains(&survivors));
        let per_row =
            format!("RECORDS_PER_ROW_LOG2: u32 = {}u;", crate::records::RECORDS_PER_ROW.ilog2());
        assert!(wgsl!("shared/record_layout").contains(&per_row));
    }
}
