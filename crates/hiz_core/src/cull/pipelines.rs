//! The pipelines of the cull: which shader files make a module, and how one pipeline differs from
//! another.

use crate::error::Result;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{File, Source, wgsl};
use crate::input::bounds::BoundsKind;
use crate::instances::piece::RECORD_BINDINGS;

/// Everything in which one cull pipeline differs from another.
/// Each is compiled without the branches that it does not take.
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

impl CullKey {
    /// The key of a pass that reads no depth.
    pub(super) fn without_depth(kind: BoundsKind, sample_coverage: bool) -> Self {
        Self {
            store: DepthStore::Nowhere,
            kind,
            sample_coverage,
            // These have no effect, because no depth is read.
            reversed: false,
            chunks: 1,
            footprint_log2: 1,
            descent: false,
            fit_volume: false,
        }
    }
}

/// Which cull of a frame this is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum FramePass {
    /// One that is not one of two passes.
    Alone,
    /// The early pass, which reads no depth.
    Early(Candidates),
    /// The late pass.
    Late,
}

/// Where the candidates of an early pass come from; twin: `shaders/cull/candidates.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u32)]
pub(crate) enum Candidates {
    History = 0,
    Size = 1,
    Given = 2,
}

impl FramePass {
    /// The files that say what is done with kept instances.
    fn member_files(self) -> &'static [File] {
        match self {
            Self::Alone => &[wgsl!("output/report_alone")],
            Self::Early(_) => {
                &[wgsl!("cull/history"), wgsl!("cull/candidates"), wgsl!("cull/early")]
            }
            Self::Late => &[wgsl!("cull/history"), wgsl!("cull/late")],
        }
    }

    /// The files that say which groups survive.
    fn group_files(self) -> &'static [File] {
        match self {
            Self::Alone => &[wgsl!("cull/groups_alone")],
            Self::Early(_) => {
                &[wgsl!("cull/history"), wgsl!("cull/candidates"), wgsl!("cull/groups_early")]
            }
            Self::Late => &[wgsl!("cull/history"), wgsl!("cull/groups_late")],
        }
    }

    /// What a cull of instances writes, and what it reads of its frame.
    pub(super) fn member_bindings(self) -> &'static [(u32, Binding)] {
        match self {
            Self::Alone => VISIBLE_BINDINGS,
            Self::Early(_) => EARLY_BINDINGS,
            Self::Late => LATE_BINDINGS,
        }
    }

    /// What a cull of groups writes, and what it reads of its frame.
    pub(super) fn group_bindings(self) -> &'static [(u32, Binding)] {
        match self {
            Self::Alone => SURVIVOR_BINDINGS,
            Self::Early(_) => EARLY_SURVIVOR_BINDINGS,
            Self::Late => LATE_SURVIVOR_BINDINGS,
        }
    }

    /// The constants that an early pass has besides.
    fn constants(self) -> Option<(&'static str, f64)> {
        match self {
            Self::Early(candidates) => Some(("EARLY_SET", f64::from(candidates as u32))),
            Self::Alone | Self::Late => None,
        }
    }
}

/// What a cull writes: the `override` constants of `shaders/output/report.wgsl` and of
/// `shaders/output/report_alone.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ReportKey {
    pub(crate) pass: FramePass,
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

pub(crate) fn report_constants(key: &ReportKey) -> Vec<(&'static str, f64)> {
    let mut constants =
        vec![("VERDICTS", flag(key.verdicts)), ("STATISTICS", flag(key.statistics))];
    if key.pass == FramePass::Alone {
        constants.extend([
            ("MASK", flag(key.mask)),
            ("APPEND", flag(key.append)),
            ("LIST", flag(key.list)),
            ("CAPPED", flag(key.capped)),
        ]);
    }
    constants.extend(key.pass.constants());
    constants
}

/// Where a cull reads depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum DepthStore {
    /// Level 0 from the depth image, and the others from the buffers that the reduction fills.
    Apart(SourceKind),
    /// All levels from one texture.
    Atlas,
    /// No depth is read: such a pass only finds what is outside.
    Nowhere,
}

impl DepthStore {
    /// The shader files that read it.
    pub(crate) fn files(self) -> Vec<File> {
        match self {
            Self::Apart(source) => [source.files(), &[wgsl!("pyramid/texels_apart")]].concat(),
            Self::Atlas => vec![wgsl!("pyramid/texels_atlas")],
            Self::Nowhere => vec![wgsl!("pyramid/texels_nowhere")],
        }
    }

    /// A number that distinguishes the stores in the key of a view's bindings.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Apart(source) => source as u32,
            Self::Atlas => 3,
            Self::Nowhere => 4,
        }
    }

    /// The layout of a cull's view: pyramid, camera and options.
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
            Self::Nowhere => gpu.layout("hiz.cull.no_depth_layout", &[(2, Uniform), (6, Uniform)]),
        }
    }
}

/// The bindings of what a cull writes.
pub(crate) const VISIBLE_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Write),
    (1, Binding::Write),
    (2, Binding::Write),
    (3, Binding::Write),
    (4, Binding::Uniform),
];

/// The bindings of what a cull of groups writes.
pub(crate) const SURVIVOR_BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Write), (1, Binding::Write), (2, Binding::WriteTexels), (3, Binding::Write)];

/// The bindings of an early pass: mask, history, the caller's mask, statistics, frame.
const EARLY_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Write),
    (1, Binding::Read),
    (2, Binding::Read),
    (3, Binding::Write),
    (4, Binding::Uniform),
];

/// The bindings of a late pass: mask, history, the early pass's mask, statistics, frame.
const LATE_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Write),
    (1, Binding::Write),
    (2, Binding::Read),
    (3, Binding::Write),
    (4, Binding::Uniform),
];

/// The bindings of an early pass's groups: as [`SURVIVOR_BINDINGS`], then history and frame.
const EARLY_SURVIVOR_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Write),
    (1, Binding::Write),
    (2, Binding::WriteTexels),
    (3, Binding::Write),
    (4, Binding::Read),
    (5, Binding::Uniform),
];

/// The bindings of a late pass's groups: as [`SURVIVOR_BINDINGS`], then the history.
const LATE_SURVIVOR_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Write),
    (1, Binding::Write),
    (2, Binding::WriteTexels),
    (3, Binding::Write),
    (4, Binding::Write),
];

/// The bindings of the survivors, which a cull of members reads.
pub(crate) const MEMBER_BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Read), (1, Binding::ReadTexels)];

/// The bindings of what an explanation and a refinement write.
#[cfg(feature = "headless")]
pub(crate) const TWO_STORAGES: &[(u32, Binding)] = &[(0, Binding::Write), (1, Binding::Write)];

/// The module of a decision about one instance: `classify` decides, and `entry` has the entry
/// point.
pub(crate) fn decision_module(
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

/// The files of the decision by certificates; a yardstick replaces them.
pub(super) const CERTIFIED: &[File] = &[wgsl!("cull/supporting_planes"), wgsl!("cull/classify")];

/// The module of an entry point that does not write down which texels were read
/// (`shaders/cull/unexplained.wgsl`).
pub(super) fn unexplained(store: DepthStore, kind: BoundsKind, entry: &[File]) -> Source {
    decision_module(store, kind, CERTIFIED, &[&[wgsl!("cull/unexplained")], entry].concat())
}

/// The files of the flat cull, which tests each instance by itself, without the decision.
pub(crate) fn flat_files(pass: FramePass) -> Vec<File> {
    let shared = [
        wgsl!("cull/unexplained"),
        wgsl!("instances/piece"),
        wgsl!("instances/groups"),
        wgsl!("output/statistics"),
        wgsl!("output/report"),
    ];
    [&shared, pass.member_files(), &[wgsl!("cull/cull")]].concat()
}

/// The shader of the flat cull, for instances of one kind.
pub(crate) fn cull_module(store: DepthStore, kind: BoundsKind, pass: FramePass) -> Source {
    decision_module(store, kind, CERTIFIED, &flat_files(pass))
}

/// The shader of the cull of groups.
pub(crate) fn cull_groups_module(store: DepthStore, pass: FramePass) -> Source {
    let shared = [wgsl!("instances/piece"), wgsl!("instances/groups"), wgsl!("output/statistics")];
    let entry = [&shared, pass.group_files(), &[wgsl!("cull/cull_groups")]].concat();
    unexplained(store, BoundsKind::Box, &entry)
}

/// The shader of the cull of the surviving groups' members.
pub(crate) fn cull_members_module(store: DepthStore, kind: BoundsKind, pass: FramePass) -> Source {
    let shared = [
        wgsl!("instances/piece"),
        wgsl!("instances/groups"),
        wgsl!("output/statistics"),
        wgsl!("output/report"),
    ];
    let entry = [&shared, pass.member_files(), &[wgsl!("cull/cull_members")]].concat();
    unexplained(store, kind, &entry)
}

/// The layouts of a cull's view, of its records and of what it writes.
pub(super) fn layouts(
    gpu: &Gpu,
    store: DepthStore,
    label: &str,
    written: &[(u32, Binding)],
) -> Result<[wgpu::BindGroupLayout; 3]> {
    let records = gpu.layout("hiz.cull.instances_layout", RECORD_BINDINGS)?;
    Ok([store.layout(gpu)?, records, gpu.layout(label, written)?])
}

/// A flat cull that runs `source`, a module made by [`decision_module`].
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
        layouts: &layouts(
            gpu,
            key.store,
            "hiz.cull.visible_layout",
            report.pass.member_bindings(),
        )?,
        constants: &[&classify_constants(key)[..], &report_constants(report)].concat(),
    })
}

/// The flat cull, which tests each instance by itself.
pub(crate) fn cull_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
) -> Result<wgpu::ComputePipeline> {
    let source = cull_module(key.store, key.kind, report.pass);
    flat_pipeline(gpu, "hiz.cull.pipeline", source, key, report)
}

/// The cull of groups.
pub(crate) fn cull_groups_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
) -> Result<wgpu::ComputePipeline> {
    let mut constants = classify_constants(key).to_vec();
    constants.push(("STATISTICS", flag(report.statistics)));
    constants.extend(report.pass.constants());
    let written = report.pass.group_bindings();
    gpu.compute_pipeline(&Compute {
        label: "hiz.cull_groups.pipeline",
        source: cull_groups_module(key.store, report.pass),
        entry_point: "cull_groups",
        layouts: &layouts(gpu, key.store, "hiz.cull_groups.layout", written)?,
        constants: &constants,
    })
}

/// The cull of the surviving groups' members.
pub(crate) fn cull_members_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
) -> Result<wgpu::ComputePipeline> {
    let written = report.pass.member_bindings();
    let [view, records, visible] = layouts(gpu, key.store, "hiz.cull.visible_layout", written)?;
    let members = gpu.layout("hiz.cull_members.layout", MEMBER_BINDINGS)?;
    gpu.compute_pipeline(&Compute {
        label: "hiz.cull_members.pipeline",
        source: cull_members_module(key.store, key.kind, report.pass),
        entry_point: "cull_members",
        layouts: &[view, records, visible, members],
        constants: &[&classify_constants(key)[..], &report_constants(report)].concat(),
    })
}
