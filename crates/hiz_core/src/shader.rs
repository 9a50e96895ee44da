//! WGSL: which files make which module. Composition is ordered concatenation; there is no preprocessor.

use crate::bounds::BoundsKind;

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
    /// A texture of float32 bits.
    Bits,
}

impl SourceKind {
    fn wgsl(self) -> &'static str {
        match self {
            Self::Depth => wgsl!("shared/source_depth"),
            Self::Float => wgsl!("shared/source_float"),
            Self::Bits => wgsl!("shared/source_bits"),
        }
    }

    pub(crate) fn sample_type(self) -> wgpu::TextureSampleType {
        match self {
            Self::Depth => wgpu::TextureSampleType::Depth,
            Self::Float => wgpu::TextureSampleType::Float { filterable: false },
            Self::Bits => wgpu::TextureSampleType::Uint,
        }
    }

    /// The kind that fits a texture's format.
    pub(crate) fn of(format: wgpu::TextureFormat) -> Option<Self> {
        match format {
            wgpu::TextureFormat::R32Float => Some(Self::Float),
            wgpu::TextureFormat::R32Uint => Some(Self::Bits),
            f if f.has_depth_aspect() => Some(Self::Depth),
            _ => None,
        }
    }
}

/// The depth reduction.
pub(crate) fn reduce(source: SourceKind) -> String {
    [wgsl!("shared/depth_bits"), source.wgsl(), wgsl!("shared/pyramid"), wgsl!("reduce")].join("\n")
}

/// The cull (`entry` = its own file) or the explanation, which share everything up to the verdict.
fn classifying(source: SourceKind, kind: BoundsKind, entry: &str) -> String {
    let bounds = match kind {
        BoundsKind::Sphere => wgsl!("shared/bounds_sphere").to_owned(),
        BoundsKind::Box => [wgsl!("shared/bounds_box_support"), wgsl!("shared/bounds_box")].join("\n"),
        BoundsKind::OrientedBox => [wgsl!("shared/bounds_box_support"), wgsl!("shared/bounds_oriented_box")].join("\n"),
    };
    [
        wgsl!("shared/depth_bits"),
        source.wgsl(),
        wgsl!("shared/pyramid"),
        wgsl!("shared/view"),
        wgsl!("shared/validity"),
        bounds.as_str(),
        wgsl!("shared/certificate"),
        wgsl!("shared/supporting_planes"),
        wgsl!("shared/classify"),
        entry,
    ]
    .join("\n")
}

/// The cull of instances of one kind.
pub(crate) fn cull(source: SourceKind, kind: BoundsKind) -> String {
    classifying(source, kind, &[wgsl!("shared/piece"), wgsl!("cull")].join("\n"))
}

/// The explanation of one instance's verdict.
pub(crate) fn explain(source: SourceKind, kind: BoundsKind) -> String {
    classifying(source, kind, wgsl!("explain"))
}

/// The ordered compaction.
pub(crate) fn compact() -> String {
    [wgsl!("shared/piece"), wgsl!("compact")].join("\n")
}

/// From places to the caller's indices.
pub(crate) fn renumber() -> String {
    [wgsl!("shared/piece"), wgsl!("renumber")].join("\n")
}

/// The update of records and groups.
pub(crate) fn update() -> String {
    wgsl!("update").to_owned()
}

/// The occluder pass.
pub(crate) fn occluders() -> String {
    wgsl!("occluders").to_owned()
}

/// All kinds of source, in the order of their numbers.
pub(crate) const SOURCES: [SourceKind; 3] = [SourceKind::Depth, SourceKind::Float, SourceKind::Bits];
const KINDS: [BoundsKind; 3] = [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox];

/// Every module, for those who plant faults in them.
pub(crate) fn all() -> Vec<String> {
    let classifying = SOURCES.iter().flat_map(|s| KINDS.iter().flat_map(|k| [cull(*s, *k), explain(*s, *k)]));
    SOURCES
        .iter()
        .map(|s| reduce(*s))
        .chain(classifying)
        .chain([compact(), renumber(), update(), occluders()])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    fn parse(source: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
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
    }

    /// Offsets of a WGSL struct's members, and its size.
    fn layout(module: &naga::Module, name: &str) -> (Vec<(String, u32)>, u32) {
        let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).expect(name);
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
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
        use crate::bounds::{BoxRecord, OrientedBoxRecord, SphereRecord};
        use crate::cull::{ExplanationRecord, ViewUniform};
        use crate::instances::PieceUniform;
        use crate::layout::Level;
        use crate::pyramid::PyramidUniform;
        use crate::update::UpdateUniform;
        use crate::view::Row;
        use crate::visible::{CounterRecord, DrawIndexedIndirect};

        let module = parse(&cull(SourceKind::Depth, BoundsKind::Sphere));
        same_layout!(module, "Row", Row { "m" = m, "a" = a });
        same_layout!(module, "Level", Level { "offset" = offset, "stride" = stride, "width" = width, "height" = height });
        same_layout!(module, "Pyramid", PyramidUniform {
            "levels" = levels, "num_levels" = num_levels, "chunk_shift" = chunk_shift, "padding" = padding
        });
        same_layout!(module, "View", ViewUniform {
            "x" = x, "y" = y, "z" = z, "w" = w, "eye_hi" = eye_hi, "z_slope" = z_slope, "eye_lo" = eye_lo,
            "coordinate_limit" = coordinate_limit, "half_size" = half_size, "reach" = reach, "depth_factor" = depth_factor,
            "size" = size, "runtime_zero" = runtime_zero, "reduction" = reduction, "descent_budget" = descent_budget, "depth_offset" = depth_offset, "padding_0" = padding_0,
            "padding_1" = padding_1
        });
        same_layout!(module, "Piece", PieceUniform { "base" = base, "count" = count, "index" = index, "words" = words });
        same_layout!(module, "DrawIndexedIndirect", DrawIndexedIndirect {
            "index_count" = index_count, "instance_count" = instance_count, "first_index" = first_index,
            "base_vertex" = base_vertex, "first_instance" = first_instance
        });
        same_layout!(module, "Counters", CounterRecord {
            "outside" = outside, "occluded" = occluded, "visible" = visible, "invalid" = invalid, "levels" = levels,
            "texels_low" = texels_low, "texels_high" = texels_high
        });
        let update = parse(&update());
        same_layout!(update, "Update", UpdateUniform {
            "count" = count, "vectors" = vectors, "number" = number, "padding" = padding
        });
        assert_eq!(layout(&module, "SphereRecord").1 as usize, size_of::<SphereRecord>());
        let boxes = parse(&cull(SourceKind::Depth, BoundsKind::Box));
        assert_eq!(layout(&boxes, "BoxRecord").1 as usize, size_of::<BoxRecord>());
        let oriented = parse(&explain(SourceKind::Depth, BoundsKind::OrientedBox));
        assert_eq!(layout(&oriented, "OrientedBoxRecord").1 as usize, size_of::<OrientedBoxRecord>());
        same_layout!(oriented, "Explanation", ExplanationRecord {
            "verdict" = verdict, "stage" = stage, "level" = level, "farthest_bits" = farthest_bits, "pixels" = pixels,
            "texels" = texels, "texel_bits" = texel_bits, "depths" = depths, "padding" = padding
        });
    }

    /// How often `caller` calls `callee`.
    fn calls(module: &naga::Module, caller: &str, callee: &str) -> usize {
        let named = |name: &str| module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(name)).expect("it");
        let (handle, _) = named(callee);
        named(caller)
            .1
            .expressions
            .iter()
            .filter(|(_, e)| matches!(e, naga::Expression::CallResult(h) if *h == handle))
            .count()
    }

    /// No driver at hand folds what cancels, so no verdict shows whether `bar` stands in the way. (What folding would do is shown by
    /// `tests/mirror.rs`.)
    #[test]
    fn bars_stand_where_a_compiler_could_fold_what_cancels() {
        for kind in KINDS {
            let module = parse(&cull(SourceKind::Depth, kind));
            for bar in ["bar", "bar2", "bar3"] {
                let (_, function) = module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(bar)).expect(bar);
                let is_xor = |e: &naga::Expression| {
                    matches!(e, naga::Expression::Binary { op: naga::BinaryOperator::ExclusiveOr, .. })
                };
                assert!(function.expressions.iter().any(|(_, e)| is_xor(e)), "{bar}");
            }
            assert_eq!(calls(&module, "load_volume", "bar3"), 2, "{kind:?}: d_hi and d_lo");
            assert_eq!(calls(&module, "surely_behind", "bar"), 1, "d - A");
            assert_eq!(calls(&module, "occluding_depth", "bar"), 1, "the depth that slack has moved");
            assert_eq!(calls(&module, "classify", "bar"), 2, "-A and 1 - A");
            assert_eq!(calls(&module, "surely_clear", "bar"), 1, "d - A");
            assert_eq!(calls(&module, "proved_interval", "bar"), 2, "both ends");
            assert_eq!(calls(&module, "supporting_planes", "bar2"), 1, "slopes");
            assert_eq!(calls(&module, "supporting_planes", "bar"), 1, "offsets");
        }
    }

    /// A guess is mostly right, so that no verdict shows whether it was proved.
    #[test]
    fn every_plane_and_side_is_certified() {
        for kind in KINDS {
            let module = parse(&cull(SourceKind::Depth, kind));
            assert_eq!(calls(&module, "supporting_planes", "surely_above"), 1, "{kind:?}: a plane's offset");
            assert_eq!(calls(&module, "proved_interval", "surely_above"), 1, "{kind:?}: left and top");
            assert_eq!(calls(&module, "proved_interval", "surely_below"), 1, "{kind:?}: right and bottom");
        }
    }

    #[test]
    fn constants_agree_with_the_shaders() {
        let margin = format!("ERROR_ULPS: f32 = {:.1};", crate::view::ERROR_ULPS);
        assert!(wgsl!("shared/certificate").contains(&margin));
        let workgroup = crate::layout::CULL_WORKGROUP;
        assert!(wgsl!("cull").contains(&format!("WORKGROUP: u32 = {workgroup}u;")));
        for shader in [wgsl!("cull"), wgsl!("renumber"), wgsl!("update")] {
            assert!(shader.contains(&format!("@workgroup_size({workgroup})")));
        }
    }
}
