//! Structs in buffers, records in textures, and bindings.

use std::collections::{BTreeMap, BTreeSet};
use std::mem::offset_of;

use super::declared;
use crate::cull::explain::ExplanationRecord;
use crate::cull::history::FrameUniform;
use crate::cull::pixels::CountingUniform;
use crate::cull::view_uniform::ViewUniform;
use crate::input::bounds::{Bounds, Floats};
use crate::instances::SEQUENCE_BYTES;
use crate::instances::from_buffer::FromBufferUniform;
use crate::instances::piece::PieceUniform;
use crate::instances::tiers::{FormUniform, TierUniform};
use crate::instances::update::UpdateUniform;
use crate::methods::TextUniform;
use crate::output::bins::{BinRecord, EmitUniform, TotalRecord};
use crate::output::counters::{CounterRecord, StatisticsRecord};
use crate::output::draw::DrawIndexedIndirect;
use crate::output::mesh_table::TemplateRecord;
use crate::output::pixels::PixelCounts;
use crate::output::survivors::SurvivorsRecord;
use crate::output::views::JoinUniform;
use crate::pyramid::PyramidUniform;
use crate::pyramid::layout::PYRAMID_CHUNKS;
use crate::pyramid::levels::Level;
use crate::pyramid::mips_bindings::{MipStepUniform, MipsUniform};
use crate::pyramid::receiver_mask::MaskUniform;
use crate::pyramid::resolve::{BandUniform, ResolvedUniform};
use crate::pyramid::steps::StepUniform;
use crate::testing::lod::LodCase;
use crate::testing::shaders::files;
use crate::testing::shaders::tests::covering;
use crate::yardstick::reduce as yardstick;

/// Structs that only a shader has: they lie in no buffer.
const SHADER_ONLY_STRUCTS: &[&str] = &[
    "Bin",
    "BoxInView",
    "BoxTexels",
    "Corners",
    "Depths",
    "Candidate",
    // Vertex inputs, which are found by location; see `occluders/device_meshes.rs`.
    "Copy",
    "Vertex",
    "Axes",
    "Ends",
    "Ends2",
    "Ends4",
    "Extent",
    "Face",
    "Flat",
    "MaskPlace",
    "Outline",
    "Outcome",
    "PixelPlanes",
    "Place",
    "Prepared",
    "Projected",
    "Slope",
    "SupportingPlane",
    "SupportingPlanes",
    "Swept",
    "Term",
    "Sure",
    "Value",
    "Volume",
    "Walk",
];

/// Offsets of a WGSL struct's members, and its size.
type Layout = (Vec<(String, u32)>, u32);

/// The layouts of every struct, by name.
fn structs() -> BTreeMap<String, BTreeSet<Layout>> {
    let mut structs: BTreeMap<String, BTreeSet<Layout>> = BTreeMap::new();
    for (_, module) in covering() {
        for (_, ty) in module.types.iter() {
            let naga::TypeInner::Struct { members, span } = &ty.inner else { continue };
            let members = members.iter().map(|m| (m.name.clone().expect("a member"), m.offset));
            let name = ty.name.clone().expect("a struct has a name");
            structs.entry(name).or_default().insert((members.collect(), *span));
        }
    }
    structs
}

/// A WGSL struct and its twin: each member's name there, and the offset of the field here.
macro_rules! twin {
    ($wgsl:literal, $rust:ty { $($theirs:literal = $ours:ident $(+ $more:literal)?),* $(,)? }) => {
        (
            $wgsl,
            (
                vec![$(($theirs.to_owned(), (offset_of!($rust, $ours) $(+ $more)?) as u32)),*],
                size_of::<$rust>() as u32,
            ),
        )
    };
}

fn struct_twins() -> Vec<(&'static str, Layout)> {
    vec![
        twin!("BinRange", BinRecord {
            "begin" = begin, "count" = count, "shift" = shift, "filled" = filled,
        }),
        twin!("Counters", CounterRecord {
            "outside" = outside, "occluded" = occluded, "visible" = visible, "invalid" = invalid,
            "unoccluded" = unoccluded,
        }),
        twin!("Counting", CountingUniform {
            "budget" = budget, "negligible" = negligible, "ordered" = ordered,
            "iterations" = iterations,
        }),
        twin!("DrawIndexedIndirect", DrawIndexedIndirect {
            "index_count" = index_count, "instance_count" = instance_count,
            "first_index" = first_index, "base_vertex" = base_vertex,
            "first_instance" = first_instance,
        }),
        twin!("Join", JoinUniform {
            "view" = view, "stride" = stride, "begin" = begin, "words" = words,
        }),
        twin!("Emit", EmitUniform {
            "base" = base, "count" = count, "words" = words, "lods" = lods, "piece" = piece,
            "capacity" = capacity, "records" = records, "draws_begin" = draws_begin,
        }),
        twin!("Explanation", ExplanationRecord {
            "verdict" = verdict, "stage" = stage, "level" = level,
            "farthest_bits" = farthest_bits, "pixels" = pixels, "depths" = depths, "last" = last,
            "texels_read" = texels_read, "of_footprint" = of_footprint,
            "farthest_before" = farthest_before, "any_before" = any_before,
            "nearest_bits" = nearest_bits, "padding" = padding,
        }),
        twin!("Frame", FrameUniform {
            "early" = early, "least_pixels" = least_pixels, "padding" = padding,
        }),
        twin!("FromBuffer", FromBufferUniform {
            "count" = count, "first" = first, "stride" = stride, "runtime_zero" = runtime_zero,
        }),
        twin!("Level", Level {
            "offset" = offset, "stride" = stride, "width" = width, "height" = height,
        }),
        twin!("LodCase", LodCase {
            "mesh" = mesh, "count" = count, "scale" = scale, "padding" = padding,
        }),
        twin!("Mips", MipsUniform {
            "levels" = levels, "origin" = origin, "padding" = padding,
        }),
        twin!("MipStep", MipStepUniform {
            "source" = source, "last" = last, "first" = first, "rows" = rows,
        }),
        twin!("Piece", PieceUniform {
            "base" = base, "count" = count, "index" = index, "words" = words,
        }),
        twin!("PixelCounts", PixelCounts {
            "touched" = touched, "hidden" = hidden, "inside" = inside, "open" = open,
            "undecided" = undecided,
        }),
        twin!("Pyramid", PyramidUniform {
            "levels" = levels, "origins" = origins, "chunk_shift" = chunk_shift,
            "first_stored" = first_stored, "last_stored" = last_stored, "nearest" = nearest,
        }),
        twin!("ResolvedImage", ResolvedUniform { "origin" = origin, "size" = size }),
        twin!("Band", BandUniform {
            "first" = first, "rows" = rows, "stride" = stride, "nearest" = nearest,
        }),
        twin!("Statistics", StatisticsRecord {
            "levels" = levels, "texels_low" = texels_low, "texels_high" = texels_high,
        }),
        twin!("Step", StepUniform {
            "source" = source, "last" = last, "end" = end, "begin" = begin, "origin" = origin,
            "reduction" = reduction, "base" = base, "padding" = padding,
        }),
        twin!("Survivors", SurvivorsRecord {
            "workgroups" = workgroups, "workgroups_y" = workgroups + 4,
            "workgroups_z" = workgroups + 8, "count" = count, "tested" = tested,
            "accepted" = accepted, "is_full" = is_full, "padding" = padding,
            "accept_workgroups" = accept_workgroups,
            "accept_workgroups_y" = accept_workgroups + 4,
            "accept_workgroups_z" = accept_workgroups + 8, "accept_count" = accept_count,
        }),
        twin!("Parents", SurvivorsRecord {
            "workgroups" = workgroups, "workgroups_y" = workgroups + 4,
            "workgroups_z" = workgroups + 8, "count" = count, "tested" = tested,
            "accepted" = accepted, "is_full" = is_full, "padding" = padding,
            "accept_workgroups" = accept_workgroups,
            "accept_workgroups_y" = accept_workgroups + 4,
            "accept_workgroups_z" = accept_workgroups + 8, "accept_count" = accept_count,
        }),
        twin!("Tier", TierUniform { "count" = count, "below" = below, "padding" = padding }),
        twin!("FormTier", FormUniform {
            "count" = count, "below" = below, "runtime_zero" = runtime_zero, "padding" = padding,
        }),
        twin!("Template", TemplateRecord {
            "count" = count, "first" = first, "base_vertex" = base_vertex, "padding" = padding,
        }),
        twin!("TextView", TextUniform {
            "clip_from_world" = clip_from_world, "view_from_world" = view_from_world,
            "clip_from_view" = clip_from_view, "planes" = planes, "eye" = eye, "up" = up,
            "size" = size, "near" = near, "count" = count, "levels" = levels,
            "num_levels" = num_levels,
        }),
        twin!("Total", TotalRecord { "demand" = demand, "written" = written }),
        twin!("Update", UpdateUniform {
            "count" = count, "texels" = texels, "number" = number, "padding" = padding,
        }),
        twin!("ReceiverMask", MaskUniform {
            "x" = rows, "y" = rows + 16, "z" = rows + 32, "w" = rows + 48, "scale" = rows + 64,
            "x_size" = sizes, "y_size" = sizes + 16, "z_size" = sizes + 32, "w_size" = sizes + 48,
            "scale_size" = sizes + 64, "growth" = growth, "camera_half_size" = camera_half_size,
            "reach" = reach, "slack" = slack, "camera_size" = camera_size,
            "light_size" = light_size, "origin" = origin, "slack_abs" = slack_abs,
            "stride" = stride, "blocks" = blocks, "light_is_reversed" = light_is_reversed,
            "padding" = padding,
        }),
        twin!("View", ViewUniform {
            "x" = x, "y" = y, "z" = z, "w" = w, "magnitudes" = magnitudes,
            "constant_magnitudes" = constant_magnitudes, "eye_hi" = eye_hi, "z_slope" = z_slope,
            "eye_lo" = eye_lo, "halves_size" = halves_size, "half_size" = half_size,
            "reach" = reach, "depth_factor" = depth_factor, "size" = size,
            "runtime_zero" = runtime_zero, "reduction" = reduction,
            "descent_budget" = descent_budget, "depth_offset" = depth_offset,
            "coordinate_limit" = coordinate_limit, "lod_end" = lod_end,
            "lod_needs" = lod_needs,
            "source_origin" = source_origin, "near_factor" = near_factor,
            "near_offset" = near_offset, "padding" = padding,
            "half_sweeps" = shadow, "steepness" = shadow + 16, "exits" = shadow + 32,
            "filter_radius" = shadow + 44, "exit_rates" = shadow + 48,
            "light_slope" = shadow + 60, "exit_size" = shadow + 64, "light_size" = shadow + 68,
            "padding_1" = shadow + 72,
        }),
        twin!("YardstickLevel", yardstick::PlainLevel {
            "offset" = offset, "stride" = stride, "width" = width, "height" = height,
        }),
        // The host writes two levels, one after the other.
        (
            "YardstickStep",
            (
                vec![
                    ("read".to_owned(), 0),
                    ("written".to_owned(), size_of::<yardstick::PlainLevel>() as u32),
                ],
                2 * size_of::<yardstick::PlainLevel>() as u32,
            ),
        ),
        // The host writes zeros into a buffer that has room for it.
        ("Sequence", (vec![("next".to_owned(), 0), ("broken".to_owned(), 4)], 8)),
    ]
}

#[test]
fn structs_have_the_offsets_of_their_twins() {
    let structs = structs();
    for (name, layout) in struct_twins() {
        let found = structs.get(name).unwrap_or_else(|| panic!("no shader has {name}"));
        assert_eq!(*found, BTreeSet::from([layout]), "{name}");
    }
    const { assert!(SEQUENCE_BYTES >= 8, "the size of `Sequence`") };
}

#[test]
fn every_struct_of_a_shader_is_in_a_list() {
    let mut listed: BTreeSet<String> = BTreeSet::new();
    let only = SHADER_ONLY_STRUCTS.iter().copied();
    for name in struct_twins().into_iter().map(|(name, _)| name).chain(only) {
        assert!(listed.insert(name.to_owned()), "{name} is listed twice");
    }
    let found: BTreeSet<String> = structs().into_keys().collect();
    let declared: BTreeSet<String> =
        files().iter().flat_map(|(_, text)| declared(text, "struct ").map(str::to_owned)).collect();
    assert_eq!(declared, found, "a module has every struct");
    assert_eq!(found, listed);
}

/// A record's texels and lanes as `load_volume` and `caller_index` read them.
#[test]
fn records_lie_as_the_shaders_read_them() {
    let [one, two, three] = [1.0, 2.0, 3.0_f32].map(f32::to_bits);
    let center = [1.0, 2.0, 3.0];
    let centers = Floats::F64(&center);
    let record = |bounds: &Bounds<'_>| {
        let mut bytes = vec![0; bounds.kind().record_bytes() as usize];
        assert!(bounds.write_record(0, 77, &mut bytes));
        bytemuck::pod_collect_to_vec::<u8, u32>(&bytes)
    };
    let sphere = record(&Bounds::Spheres { centers, radii: Floats::F64(&[4.0]) });
    let radius = 4.0_f32.to_bits();
    assert_eq!(sphere, [one, two, three, radius, 0, 0, 0, 77]);
    let half = [5.0, 6.0, 7.0_f32];
    let [half_x, half_y, half_z] = half.map(f32::to_bits);
    let corner = |sign: f64| [0, 1, 2].map(|k| center[k] + sign * f64::from(half[k]));
    let (min, max) = (corner(-1.0), corner(1.0));
    let aligned = record(&Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) });
    assert_eq!(aligned, [one, two, three, 0, 0, 0, 0, 77, half_x, half_y, half_z, 0]);
    // Axis k of the box along axis k + 1 of the world: the half axes are columns.
    let oriented = record(&Bounds::OrientedBoxes {
        centers,
        half_sizes: Floats::F64(&[5.0, 6.0, 7.0]),
        rotations: Floats::F64(&[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
    });
    let positions = centers;
    assert_eq!(record(&Bounds::Points { positions }), [one, two, three, 77]);
    let third = 1.0 / 3.0;
    let (hi, lo) = (third as f32, (third - f64::from(third as f32)) as f32);
    let wide = record(&Bounds::Points { positions: Floats::F64(&[third, 2.0, 3.0]) });
    assert_eq!(wide, [hi.to_bits(), two, three, 77, lo.to_bits(), 0, 0, 0]);
    let texels = [[one, two, three, half_z], [0; 4], [0, half_x, 0, 0], [0, 0, half_y, 77]];
    assert_eq!(oriented, texels.concat());
}

#[test]
fn a_pyramid_has_as_many_bindings_as_chunks() {
    for (source, module) in covering() {
        let names = module.global_variables.iter().filter_map(|(_, v)| v.name.clone());
        let mut chunks: Vec<_> = names.filter(|name| name.starts_with("chunk_")).collect();
        chunks.sort();
        let all: Vec<_> = (0..PYRAMID_CHUNKS).map(|i| format!("chunk_{i}")).collect();
        assert!(chunks.is_empty() || chunks == all, "{source:?}: {chunks:?}");
    }
}
