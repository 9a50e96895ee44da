//! The pipelines of the cull: which files make a module, and what makes one pipeline differ from
//! another.

use crate::error::Result;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{File, Source, wgsl};
use crate::input::bounds::BoundsKind;
use crate::instances::piece::RECORD_BINDINGS;

/// What makes one cull pipeline differ from another; each is compiled without the branches that it
/// does not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct CullKey {
    pub(crate) store: DepthStore,
    pub(crate) kind: BoundsKind,
    pub(crate) reversed: bool,
    pub(crate) chunks: usize,
    pub(crate) sample_coverage: bool,
    pub(crate) footprint_log2: u32,
    pub(crate) descent: bool,
    pub(crate) fit_volume: bool,
}

/// What a cull leaves behind; `shaders/output/report.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ReportKey {
    pub(crate) mask: bool,
    pub(crate) verdicts: bool,
    pub(crate) append: bool,
    pub(crate) list: bool,
    pub(crate) capped: bool,
    pub(crate) statistics: bool,
}

pub(crate) fn classify_constants(key: &CullKey) -> [(&'static str, f64); 6] {
    [
        ("REVERSED", flag(key.reversed)),
        ("CHUNKS", key.chunks as f64),
        ("SAMPLE_COVERAGE", flag(key.sample_coverage)),
        ("FOOTPRINT_LOG2", f64::from(key.footprint_log2)),
        ("DESCENT", flag(key.descent)),
        ("FIT_VOLUME", flag(key.fit_volume)),
    ]
}

pub(crate) fn report_constants(key: &ReportKey) -> [(&'static str, f64); 6] {
    [
        ("MASK", flag(key.mask)),
        ("VERDICTS", flag(key.verdicts)),
        ("APPEND", flag(key.append)),
        ("LIST", flag(key.list)),
        ("CAPPED", flag(key.capped)),
        ("STATISTICS", flag(key.statistics)),
    ]
}

/// Where a cull reads depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum DepthStore {
    /// Level 0 in the depth image, the others in the buffers that the reduction fills.
    Apart(SourceKind),
    /// All of them in one texture.
    Atlas,
    /// Nowhere: it finds what is outside.
    #[cfg(feature = "headless")]
    Nowhere,
}

impl DepthStore {
    /// The files that read it.
    pub(crate) fn files(self) -> Vec<File> {
        match self {
            Self::Apart(source) => [source.files(), &[wgsl!("pyramid/texels_apart")]].concat(),
            Self::Atlas => vec![wgsl!("pyramid/texels_atlas")],
            #[cfg(feature = "headless")]
            Self::Nowhere => vec![wgsl!("pyramid/texels_nowhere")],
        }
    }

    /// Tells one store from another among the words of a view's bindings.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Apart(source) => source as u32,
            Self::Atlas => 3,
            #[cfg(feature = "headless")]
            Self::Nowhere => 4,
        }
    }

    /// The view of a cull: pyramid, camera and options.
    pub(crate) fn layout(self, gpu: &Gpu) -> Result<wgpu::BindGroupLayout> {
        use Binding::{Depth, Read, ReadQuads, Sampler, Uniform};
        match self {
            Self::Apart(source) => gpu.layout(
                "hiz.cull.view_layout",
                &[
                    (0, Depth(source)),
                    (1, Sampler),
                    (2, Uniform),
                    (3, Read),
                    (4, Read),
                    (5, Read),
                    (6, Uniform),
                ],
            ),
            Self::Atlas => {
                gpu.layout("hiz.cull.atlas_layout", &[(2, Uniform), (3, ReadQuads), (6, Uniform)])
            }
            #[cfg(feature = "headless")]
            Self::Nowhere => gpu.layout("hiz.cull.no_depth_layout", &[(2, Uniform), (6, Uniform)]),
        }
    }
}

/// What a cull writes.
pub(crate) const VISIBLE_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Write),
    (1, Binding::Write),
    (2, Binding::Write),
    (3, Binding::Write),
    (4, Binding::Uniform),
];

/// What a cull of groups writes.
pub(crate) const SURVIVOR_BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Write), (1, Binding::Write), (2, Binding::WriteTexels), (3, Binding::Write)];

/// What a cull of members reads of it.
pub(crate) const MEMBER_BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Read), (1, Binding::ReadTexels)];

/// What an explanation and a refinement write.
#[cfg(feature = "headless")]
pub(crate) const TWO_STORAGES: &[(u32, Binding)] = &[(0, Binding::Write), (1, Binding::Write)];

/// The frame of a decision about one instance: `classify` decides, `entry` asks.
pub(crate) fn module(
    store: DepthStore,
    kind: BoundsKind,
    classify: &[File],
    entry: &[File],
) -> Source {
    let bounds: &[File] = match kind {
        BoundsKind::Sphere => &[wgsl!("instances/bounds_sphere")],
        BoundsKind::Box => &[wgsl!("instances/bounds_box_support"), wgsl!("instances/bounds_box")],
        BoundsKind::OrientedBox => {
            &[wgsl!("instances/bounds_box_support"), wgsl!("instances/bounds_oriented_box")]
        }
    };
    Source::of(&[
        &[
            wgsl!("gpu/depth_bits"),
            wgsl!("pyramid/pyramid"),
            wgsl!("cull/view"),
            wgsl!("instances/record_layout"),
            wgsl!("instances/records"),
        ],
        bounds,
        &[
            wgsl!("cull/certificate"),
            wgsl!("output/verdict"),
            wgsl!("cull/outcome"),
            wgsl!("pyramid/levels"),
        ],
        &store.files(),
        &[wgsl!("pyramid/texels")],
        classify,
        entry,
    ])
}

/// The certified decision.
pub(super) const CERTIFIED: &[File] = &[wgsl!("cull/supporting_planes"), wgsl!("cull/classify")];

/// The module of an entry that does not tell what was read.
pub(super) fn untold(store: DepthStore, kind: BoundsKind, entry: &[File]) -> Source {
    module(store, kind, CERTIFIED, &[&[wgsl!("cull/untold")], entry].concat())
}

/// The files of the flat cull but for the decision.
pub(crate) const FLAT: &[File] = &[
    wgsl!("cull/untold"),
    wgsl!("instances/piece"),
    wgsl!("instances/groups"),
    wgsl!("output/statistics"),
    wgsl!("output/report"),
    wgsl!("cull/cull"),
];

/// The cull of instances of one kind.
pub(crate) fn cull_module(store: DepthStore, kind: BoundsKind) -> Source {
    module(store, kind, CERTIFIED, FLAT)
}

/// The cull of groups.
pub(crate) fn cull_groups_module(store: DepthStore) -> Source {
    let entry = [
        wgsl!("instances/piece"),
        wgsl!("instances/groups"),
        wgsl!("output/statistics"),
        wgsl!("cull/cull_groups"),
    ];
    untold(store, BoundsKind::Box, &entry)
}

/// The cull of the members of the groups that are left.
pub(crate) fn cull_members_module(store: DepthStore, kind: BoundsKind) -> Source {
    let entry = [
        wgsl!("instances/piece"),
        wgsl!("output/statistics"),
        wgsl!("output/report"),
        wgsl!("instances/groups"),
        wgsl!("cull/cull_members"),
    ];
    untold(store, kind, &entry)
}

/// The layouts of a cull's view, of records and of what is written.
pub(super) fn layouts(
    gpu: &Gpu,
    store: DepthStore,
    label: &str,
    written: &[(u32, Binding)],
) -> Result<[wgpu::BindGroupLayout; 3]> {
    let records = gpu.layout("hiz.cull.instances_layout", RECORD_BINDINGS)?;
    Ok([store.layout(gpu)?, records, gpu.layout(label, written)?])
}

/// A flat cull by `source`, which [`module`] makes.
pub(crate) fn flat_pipeline(
    gpu: &Gpu,
    label: &'static str,
    source: Source,
    key: &CullKey,
    report: &ReportKey,
) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label,
        source,
        entry_point: "cull",
        layouts: &layouts(gpu, key.store, "hiz.cull.visible_layout", VISIBLE_BINDINGS)?,
        constants: &[classify_constants(key), report_constants(report)].concat(),
    })
}

/// The flat cull.
pub(crate) fn cull_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
) -> Result<wgpu::ComputePipeline> {
    flat_pipeline(gpu, "hiz.cull.pipeline", cull_module(key.store, key.kind), key, report)
}

/// The cull of groups; `statistics`: levels are counted.
pub(crate) fn cull_groups_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    statistics: bool,
) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.cull_groups.pipeline",
        source: cull_groups_module(key.store),
        entry_point: "cull_groups",
        layouts: &layouts(gpu, key.store, "hiz.cull_groups.layout", SURVIVOR_BINDINGS)?,
        constants: &[&classify_constants(key)[..], &[("STATISTICS", flag(statistics))]].concat(),
    })
}

/// The cull of the members of the groups that are left.
pub(crate) fn cull_members_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
) -> Result<wgpu::ComputePipeline> {
    let [view, records, visible] =
        layouts(gpu, key.store, "hiz.cull.visible_layout", VISIBLE_BINDINGS)?;
    let members = gpu.layout("hiz.cull_members.layout", MEMBER_BINDINGS)?;
    gpu.compute_pipeline(&Compute {
        label: "hiz.cull_members.pipeline",
        source: cull_members_module(key.store, key.kind),
        entry_point: "cull_members",
        layouts: &[view, records, visible, members],
        constants: &[classify_constants(key), report_constants(report)].concat(),
    })
}
