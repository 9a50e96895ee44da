//! The pipelines of the cull: which shader files make a module, and how one pipeline differs from
//! another.

#[cfg(feature = "testing")]
use crate::cull::lod::LodRule;
use crate::error::Result;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{File, Source, wgsl};
use crate::input::bounds::BoundsKind;
use crate::instances::piece::RECORD_BINDINGS;
use crate::output::bins::PlaneSet;

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
    /// Whether a descent on the nearest end goes row by row, as it does for boxes of groups.
    pub(crate) by_rows: bool,
    pub(crate) fit_volume: bool,
    /// Whether only some instances are asked for.
    pub(crate) among: bool,
    /// Whether the pyramid has nearest depths, too, so that an instance may surely show.
    pub(crate) nearest: bool,
    /// Whether it has them, asked for or not.
    pub(crate) both: bool,
    /// Whether the pyramid leaves out background.
    pub(crate) receivers: bool,
    /// What is decided about an instance.
    pub(crate) decision: Decision,
}

/// What a cull decides about an instance: each is a `classify` of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Decision {
    /// Whether it may be seen.
    Seen,
    /// Whether its shadow may be seen.
    Shadow,
    /// Whether it may lie in the view, whatever hides it.
    InView,
}

impl Decision {
    /// The shader files that decide, by certificates; a yardstick replaces them.
    pub(super) fn files(self) -> &'static [File] {
        match self {
            Self::Seen => {
                &[wgsl!("cull/supporting_planes"), wgsl!("cull/unoccluded"), wgsl!("cull/classify")]
            }
            // The bounds' files use the types of the supporting planes, which are never tested.
            Self::Shadow => &[
                wgsl!("cull/supporting_planes"),
                wgsl!("cull/unoccluded"),
                wgsl!("cull/shadow"),
                wgsl!("cull/shadow_classify"),
            ],
            Self::InView => {
                &[wgsl!("cull/supporting_planes"), wgsl!("cull/unoccluded"), wgsl!("cull/in_view")]
            }
        }
    }
}

impl CullKey {
    /// The key of the tests of instances, for what they report.
    ///
    /// What surely shows is kept, and so is what may show.
    /// Where nothing tells them apart, the nearest depths need not be read.
    /// A descent reads them all the same: it ends where an instance surely shows.
    pub(super) fn of_instances(self, report: &ReportKey) -> Self {
        let descends = self.descent || self.fit_volume || self.decision == Decision::Shadow;
        let is_told = report.verdicts || report.statistics;
        Self { nearest: self.nearest && (is_told || descends), ..self }
    }

    /// The key of a pass that reads no depth.
    pub(crate) fn without_depth(kind: BoundsKind, sample_coverage: bool) -> Self {
        Self {
            store: NO_DEPTH,
            kind,
            sample_coverage,
            // These have no effect, because no depth is read.
            reversed: false,
            chunks: 1,
            footprint_log2: 1,
            descent: false,
            by_rows: false,
            fit_volume: false,
            among: false,
            nearest: false,
            both: false,
            receivers: false,
            decision: Decision::Seen,
        }
    }
}

/// What a cull writes: the `override` constants of `shaders/output/report.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ReportKey {
    pub(crate) mask: bool,
    pub(crate) verdicts: bool,
    /// Whether some instances are absent.
    pub(crate) absent: bool,
    pub(crate) emit: EmitKey,
    pub(crate) statistics: bool,
    pub(crate) pass: FramePass,
}

impl ReportKey {
    /// Whether the mask may begin full where groups are culled first (`full_mask.rs`).
    ///
    /// Each instance is then reported by its bit alone, whether it is kept or culled.
    pub(super) fn flips(&self) -> bool {
        let emits = !matches!(self.emit, EmitKey::List { append: false, .. });
        self.mask && self.pass == FramePass::Alone && !emits
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
    /// The files that say which instances are tested and reported.
    fn member_files(self) -> &'static [File] {
        match self {
            Self::Alone => &[wgsl!("cull/run")],
            Self::Early(_) => {
                &[wgsl!("cull/history"), wgsl!("cull/candidates"), wgsl!("cull/early")]
            }
            Self::Late => &[wgsl!("cull/history"), wgsl!("cull/late")],
        }
    }

    /// The files that say which groups survive.
    fn group_files(self) -> &'static [File] {
        match self {
            Self::Alone | Self::Late => &[wgsl!("cull/groups_alone")],
            Self::Early(_) => {
                &[wgsl!("cull/history"), wgsl!("cull/candidates"), wgsl!("cull/groups_early")]
            }
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
            Self::Alone | Self::Late => SURVIVOR_BINDINGS,
            Self::Early(_) => EARLY_SURVIVOR_BINDINGS,
        }
    }

    /// What an early pass decides about a candidate: sizes need its rectangle.
    pub(crate) fn decision(self) -> Decision {
        match self {
            Self::Early(Candidates::History | Candidates::Given) => Decision::InView,
            Self::Early(Candidates::Size) | Self::Alone | Self::Late => Decision::Seen,
        }
    }

    /// The constant that an early pass has besides.
    fn constant(self) -> Option<(&'static str, f64)> {
        match self {
            Self::Early(candidates) => Some(("EARLY_SET", f64::from(candidates as u32))),
            Self::Alone | Self::Late => None,
        }
    }
}

/// How a cull emits the kept instances: a shader file with its constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum EmitKey {
    /// Nothing but the mask and the verdicts.
    Mask,
    /// One list, or none.
    List { append: bool, list: bool, capped: bool },
    /// Bit planes, of which bins are made later.
    Planes { by_index: bool, set: PlaneSet, bins: BinKey },
    /// The bins of one mesh, in any order.
    Append { list: bool, capped: bool, record_words: u32, bins: BinKey },
}

/// How the bin of an instance is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct BinKey {
    /// Whether the instances have mesh ids or scales.
    pub(crate) sorted: bool,
    /// The code of the rule that chooses LODs; `None` where LOD 0 is the only one that it can
    /// choose.
    pub(crate) lod_rule: Option<u32>,
}

impl BinKey {
    fn files(self) -> [File; 3] {
        let lod =
            if self.lod_rule.is_some() { wgsl!("cull/lod") } else { wgsl!("cull/lod_finest") };
        [wgsl!("output/mesh_table"), wgsl!("output/bin"), lod]
    }

    fn constants(self) -> impl Iterator<Item = (&'static str, f64)> {
        let rule = self.lod_rule.map(|code| ("LOD_RULE", f64::from(code)));
        [("SORTED", flag(self.sorted))].into_iter().chain(rule)
    }
}

impl EmitKey {
    /// Nothing but the mask and the verdicts.
    #[cfg(any(feature = "testing", feature = "yardstick"))]
    pub(crate) const NO_LIST: Self = Self::List { append: false, list: false, capped: false };

    /// The shader files that emit.
    pub(crate) fn files(self) -> Vec<File> {
        match self {
            Self::Mask => vec![wgsl!("output/report_mask")],
            Self::List { .. } => vec![wgsl!("output/report_list")],
            Self::Planes { bins, .. } => {
                [&bins.files()[..], &[wgsl!("output/report_planes")]].concat()
            }
            Self::Append { bins, .. } => {
                [&bins.files()[..], &[wgsl!("output/emit"), wgsl!("output/report_bins")]].concat()
            }
        }
    }

    fn constants(self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Mask => Vec::new(),
            Self::List { append, list, capped } => {
                vec![("APPEND", flag(append)), ("LIST", flag(list)), ("CAPPED", flag(capped))]
            }
            Self::Planes { by_index, set, bins } => bins
                .constants()
                .chain([("BY_INDEX", flag(by_index)), ("PLANES", f64::from(set.planes()))])
                .collect(),
            Self::Append { list, capped, record_words, bins } => bins
                .constants()
                .chain([
                    ("LIST", flag(list)),
                    ("CAPPED", flag(capped)),
                    ("RECORD_WORDS", f64::from(record_words)),
                ])
                .collect(),
        }
    }

    /// The bindings of the instances.
    fn record_bindings(self) -> &'static [(u32, Binding)] {
        match self {
            Self::Mask | Self::List { .. } => RECORD_BINDINGS,
            Self::Planes { .. } | Self::Append { .. } => BINNED_BINDINGS,
        }
    }
}

/// The bindings of the instances of a cull that emits bins: with slots and the mesh table.
pub(crate) const BINNED_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Uniform),
    (1, Binding::ReadQuads),
    (2, Binding::SampledQuads),
    (3, Binding::SampledQuads),
    (4, Binding::SampledQuads),
];

pub(crate) fn classify_constants(key: &CullKey) -> [(&'static str, f64); 11] {
    [
        ("REVERSED", flag(key.reversed)),
        ("CHUNKS", key.chunks as f64),
        ("SAMPLE_COVERAGE", flag(key.sample_coverage)),
        ("FOOTPRINT_LOG2", f64::from(key.footprint_log2)),
        ("DESCENT", flag(key.descent)),
        ("BY_ROWS", flag(key.by_rows)),
        // A point's rectangle is all there is of it.
        ("FIT_VOLUME", flag(key.fit_volume && !key.kind.is_point())),
        ("AMONG", flag(key.among)),
        ("NEAREST", flag(key.nearest)),
        ("BOTH", flag(key.both)),
        ("RECEIVERS", flag(key.receivers)),
    ]
}

/// The constants of `shaders/cull/lod.wgsl`.
#[cfg(feature = "testing")]
pub(crate) fn lod_constants(rule: &LodRule) -> [(&'static str, f64); 1] {
    [("LOD_RULE", f64::from(rule.code()))]
}

pub(crate) fn report_constants(key: &ReportKey) -> Vec<(&'static str, f64)> {
    let mut constants = vec![
        ("MASK", flag(key.mask)),
        ("VERDICTS", flag(key.verdicts)),
        ("FLIPS", flag(key.flips())),
        ("STATISTICS", flag(key.statistics)),
    ];
    constants.extend(key.emit.constants());
    constants.extend(key.pass.constant());
    constants
}

/// Where a cull reads depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum DepthStore {
    /// Level 0 from the depth image, and the others from the buffers that the reduction fills.
    Apart(SourceKind),
    /// All levels from one texture.
    Atlas,
    /// All levels from the buffer in which the host has made them with the image.
    InPlace,
}

/// Where a pass reads depth that reads none (`no_depth.rs`).
pub(crate) const NO_DEPTH: DepthStore = DepthStore::Atlas;

impl DepthStore {
    /// The shader files that read it.
    pub(crate) fn files(self) -> Vec<File> {
        match self {
            Self::Apart(source) => [source.files(), &[wgsl!("pyramid/texels_apart")]].concat(),
            Self::Atlas => vec![wgsl!("pyramid/texels_atlas")],
            Self::InPlace => vec![wgsl!("pyramid/texels_in_place")],
        }
    }

    /// A number that distinguishes the stores in the key of a view's bindings.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Apart(source) => source as u32,
            Self::Atlas => 6,
            Self::InPlace => 7,
        }
    }

    /// The layout of a cull's view: pyramid, camera and options.
    pub(crate) fn layout(self, gpu: &Gpu) -> Result<wgpu::BindGroupLayout> {
        use Binding::{Depth, Read, ReadQuads, Sampler, Uniform};
        match self {
            Self::Apart(source) => {
                let bindings = [
                    (0, Depth(source)),
                    (1, Sampler),
                    (2, Uniform),
                    (3, Read),
                    (4, Read),
                    (5, Read),
                    (6, Uniform),
                    (7, Depth(source)),
                ];
                let images = if source == SourceKind::Pair { 2 } else { 1 };
                gpu.layout("hiz.cull.view_layout", &bindings[..6 + images])
            }
            Self::Atlas => {
                gpu.layout("hiz.cull.atlas_layout", &[(2, Uniform), (3, ReadQuads), (6, Uniform)])
            }
            Self::InPlace => {
                gpu.layout("hiz.cull.in_place_layout", &[(2, Uniform), (3, Read), (6, Uniform)])
            }
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

/// The bindings of an early pass: mask, planes, history, statistics, frame, the caller's mask.
const EARLY_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Write),
    (1, Binding::Write),
    (2, Binding::Read),
    (3, Binding::Write),
    (4, Binding::Uniform),
    (5, Binding::Read),
];

/// The bindings of a late pass: mask, planes, history, statistics, frame.
const LATE_BINDINGS: &[(u32, Binding)] = VISIBLE_BINDINGS;

/// The bindings of an early pass's groups: as [`SURVIVOR_BINDINGS`], then history and frame.
const EARLY_SURVIVOR_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Write),
    (1, Binding::Write),
    (2, Binding::WriteTexels),
    (3, Binding::Write),
    (4, Binding::Read),
    (5, Binding::Uniform),
];

/// The bindings of the survivors, which tests of what they hold read.
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
        BoundsKind::Point => {
            &[wgsl!("instances/bounds_point_support"), wgsl!("instances/bounds_point")]
        }
        BoundsKind::WidePoint => {
            &[wgsl!("instances/bounds_point_support"), wgsl!("instances/bounds_wide_point")]
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
            wgsl!("cull/among_layout"),
            wgsl!("cull/among"),
            wgsl!("cull/certificate"),
            wgsl!("output/verdict"),
            wgsl!("cull/outcome"),
            wgsl!("cull/decision"),
            wgsl!("pyramid/levels"),
        ],
        &store.files(),
        &[wgsl!("pyramid/texels")],
        classify,
        entry,
    ])
}

/// The module of an entry point that does not write down which texels were read
/// (`shaders/cull/unexplained.wgsl`).
pub(crate) fn unexplained(
    store: DepthStore,
    kind: BoundsKind,
    decision: Decision,
    entry: &[File],
) -> Source {
    decision_module(store, kind, decision.files(), &[&[wgsl!("cull/unexplained")], entry].concat())
}

/// The files of the flat cull, which tests each instance by itself, without the decision.
pub(crate) fn flat_files(emit: EmitKey, pass: FramePass) -> Vec<File> {
    let shared = [
        wgsl!("cull/unexplained"),
        wgsl!("instances/piece"),
        wgsl!("instances/groups"),
        wgsl!("output/statistics"),
        wgsl!("output/report"),
    ];
    let last = [wgsl!("cull/not_flipped"), wgsl!("cull/cull")];
    [&shared[..], &emit.files(), pass.member_files(), &last].concat()
}

/// The shader of the flat cull, for instances of one kind.
pub(crate) fn flat_module(
    store: DepthStore,
    kind: BoundsKind,
    decision: Decision,
    (emit, pass): (EmitKey, FramePass),
) -> Source {
    decision_module(store, kind, decision.files(), &flat_files(emit, pass))
}

/// The shader of the cull of a tier's boxes: of all of them in the topmost tier, or of those that
/// the survivors of the tier above hold.
pub(crate) fn cull_boxes_module(
    store: DepthStore,
    decision: Decision,
    (pass, is_top): (FramePass, bool),
) -> Source {
    let shared = [wgsl!("instances/tier"), wgsl!("instances/groups"), wgsl!("output/statistics")];
    let which: &[File] = if is_top {
        &[wgsl!("cull/cull_groups")]
    } else {
        &[wgsl!("cull/parents"), wgsl!("cull/cull_children")]
    };
    let entry = [&shared, pass.group_files(), &[wgsl!("cull/cull_box")], which].concat();
    unexplained(store, BoundsKind::Box, decision, &entry)
}

/// The shader of the cull of the surviving groups' members.
pub(crate) fn cull_members_module(
    store: DepthStore,
    kind: BoundsKind,
    decision: Decision,
    (emit, pass): (EmitKey, FramePass),
) -> Source {
    members_module((store, kind, decision), emit, pass, &[wgsl!("cull/cull_members")])
}

/// The shader that keeps the members of accepted groups.
pub(crate) fn accept_members_module(
    store: DepthStore,
    kind: BoundsKind,
    emit: EmitKey,
    pass: FramePass,
) -> Source {
    let entry = [wgsl!("cull/accept_run"), wgsl!("cull/accept_members")];
    members_module((store, kind, Decision::Seen), emit, pass, &entry)
}

/// The shader that settles the members of whole groups, where a mask may begin full.
pub(crate) fn settle_groups_module(store: DepthStore, kind: BoundsKind, emit: EmitKey) -> Source {
    let entry = [wgsl!("cull/accept_run"), wgsl!("cull/settle_groups")];
    members_module((store, kind, Decision::Seen), emit, FramePass::Alone, &entry)
}

fn members_module(
    (store, kind, decision): (DepthStore, BoundsKind, Decision),
    emit: EmitKey,
    pass: FramePass,
    entry: &[File],
) -> Source {
    let shared = [
        wgsl!("instances/piece"),
        wgsl!("output/statistics"),
        wgsl!("output/report"),
        wgsl!("instances/groups"),
    ];
    let last = [wgsl!("cull/parents"), wgsl!("cull/flipped")];
    let files = [&shared[..], &emit.files(), pass.member_files(), &last, entry].concat();
    unexplained(store, kind, decision, &files)
}

/// The layouts of a cull's view, of its records and of what it writes.
pub(super) fn layouts(
    gpu: &Gpu,
    store: DepthStore,
    records: &[(u32, Binding)],
    (label, written): (&str, &[(u32, Binding)]),
) -> Result<[wgpu::BindGroupLayout; 3]> {
    let records = gpu.layout("hiz.cull.instances_layout", records)?;
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
            report.emit.record_bindings(),
            ("hiz.cull.visible_layout", report.pass.member_bindings()),
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
    gpu.known.get((*key, *report), || {
        let module = flat_module(key.store, key.kind, key.decision, (report.emit, report.pass));
        flat_pipeline(gpu, "hiz.cull.pipeline", module, key, report)
    })
}

/// The cull of the boxes of a tier; of all of them if it is the topmost one.
pub(crate) fn cull_boxes_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
    (tier, is_top): (u32, bool),
) -> Result<wgpu::ComputePipeline> {
    let mut constants = classify_constants(key).to_vec();
    constants.push(("TIER", f64::from(tier)));
    constants.push(("VERDICTS", flag(report.verdicts)));
    constants.push(("FLIPS", flag(report.flips())));
    constants.push(("STATISTICS", flag(report.statistics)));
    constants.extend(report.pass.constant());
    let written = ("hiz.cull_groups.layout", report.pass.group_bindings());
    let mut layouts = layouts(gpu, key.store, RECORD_BINDINGS, written)?.to_vec();
    if !is_top {
        layouts.push(gpu.layout("hiz.cull_members.layout", MEMBER_BINDINGS)?);
    }
    gpu.compute_pipeline(&Compute {
        label: "hiz.cull_groups.pipeline",
        source: cull_boxes_module(key.store, key.decision, (report.pass, is_top)),
        entry_point: if is_top { "cull_groups" } else { "cull_children" },
        layouts: &layouts,
        constants: &constants,
    })
}

/// The cull of the surviving groups' members.
pub(crate) fn cull_members_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
) -> Result<wgpu::ComputePipeline> {
    let module = cull_members_module(key.store, key.kind, key.decision, (report.emit, report.pass));
    members_pipeline(gpu, key, report, ("cull_members", module), &[])
}

/// What keeps the members of accepted groups.
pub(crate) fn accept_members_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
) -> Result<wgpu::ComputePipeline> {
    let module = accept_members_module(key.store, key.kind, report.emit, report.pass);
    let absent = [("ABSENT", flag(report.absent))];
    members_pipeline(gpu, key, report, ("accept_members", module), &absent)
}

fn members_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
    (entry_point, source): (&'static str, Source),
    more: &[(&'static str, f64)],
) -> Result<wgpu::ComputePipeline> {
    let written = ("hiz.cull.visible_layout", report.pass.member_bindings());
    let [view, records, visible] = layouts(gpu, key.store, report.emit.record_bindings(), written)?;
    let members = gpu.layout("hiz.cull_members.layout", MEMBER_BINDINGS)?;
    gpu.compute_pipeline(&Compute {
        label: "hiz.cull_members.pipeline",
        source,
        entry_point,
        layouts: &[view, records, visible, members],
        constants: &[&classify_constants(key)[..], &report_constants(report), more].concat(),
    })
}
