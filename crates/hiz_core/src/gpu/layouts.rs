//! The bind group layouts, one place for all passes.

use crate::shader::{DepthStore, SOURCES, SourceKind};

/// The bind group layouts.
#[derive(Debug)]
pub(crate) struct Layouts {
    reduce: [wgpu::BindGroupLayout; 3],
    cull_apart: [wgpu::BindGroupLayout; 3],
    cull_atlas: wgpu::BindGroupLayout,
    cull_nowhere: wgpu::BindGroupLayout,
    /// A piece and its records.
    pub(crate) instances: wgpu::BindGroupLayout,
    /// What a cull writes.
    pub(crate) visible: wgpu::BindGroupLayout,
    pub(crate) compact: wgpu::BindGroupLayout,
    /// What a cull of groups writes.
    pub(crate) survivors: wgpu::BindGroupLayout,
    pub(crate) count: wgpu::BindGroupLayout,
    /// What a cull of members reads of it.
    pub(crate) members: wgpu::BindGroupLayout,
    pub(crate) update: wgpu::BindGroupLayout,
    pub(crate) one_uniform: wgpu::BindGroupLayout,
    pub(crate) two_storages: wgpu::BindGroupLayout,
    pub(crate) occluder_view: wgpu::BindGroupLayout,
}

#[derive(Debug, Clone, Copy)]
enum Binding {
    Texture(SourceKind),
    Sampler,
    Uniform,
    Read,
    Write,
    ReadQuads,
    WriteQuads,
    ReadTexels,
    WriteTexels,
}

impl Layouts {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        use Binding::{
            Read, ReadQuads, ReadTexels, Sampler, Texture, Uniform, Write, WriteQuads, WriteTexels,
        };
        let layout = |label: &str, entries: &[(u32, Binding)]| {
            let entries: Vec<_> =
                entries.iter().map(|(binding, kind)| layout_entry(*binding, *kind)).collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries: &entries,
            })
        };
        Self {
            reduce: SOURCES.map(|s| {
                layout(
                    "hiz.reduce.layout",
                    &[
                        (0, Texture(s)),
                        (1, Sampler),
                        (2, Uniform),
                        (3, Write),
                        (4, Write),
                        (5, Write),
                    ],
                )
            }),
            cull_apart: SOURCES.map(|s| {
                let apart = [(0, Texture(s)), (1, Sampler), (3, Read), (4, Read), (5, Read)];
                layout(
                    "hiz.cull.view_layout",
                    &[&apart[..], &[(2, Uniform), (6, Uniform)]].concat(),
                )
            }),
            cull_atlas: layout(
                "hiz.cull.atlas_layout",
                &[(2, Uniform), (3, ReadQuads), (6, Uniform)],
            ),
            cull_nowhere: layout("hiz.cull.no_depth_layout", &[(2, Uniform), (6, Uniform)]),
            instances: layout("hiz.cull.instances_layout", &[(0, Uniform), (1, ReadQuads)]),
            visible: layout(
                "hiz.cull.visible_layout",
                &[(0, Write), (1, Write), (2, Write), (3, Write), (4, Uniform)],
            ),
            compact: layout(
                "hiz.compact.layout",
                &[(0, Uniform), (1, Read), (2, Write), (3, Write), (4, Write), (5, Uniform)],
            ),
            survivors: layout(
                "hiz.cull_groups.layout",
                &[(0, Write), (1, Write), (2, WriteTexels), (3, Write)],
            ),
            members: layout("hiz.cull_members.layout", &[(0, Read), (1, ReadTexels)]),
            count: layout("hiz.count.layout", &[(0, Uniform), (1, Read), (2, Write)]),
            update: layout(
                "hiz.update.layout",
                &[(0, Uniform), (1, Read), (2, Read), (3, WriteQuads), (4, Write)],
            ),
            one_uniform: layout("hiz.uniform_layout", &[(0, Uniform)]),
            two_storages: layout("hiz.storage_layout", &[(0, Write), (1, Write)]),
            occluder_view: device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("hiz.occluders.layout"),
                entries: &[wgpu::BindGroupLayoutEntry {
                    visibility: wgpu::ShaderStages::VERTEX,
                    ..layout_entry(0, Uniform)
                }],
            }),
        }
    }

    pub(crate) fn reduce(&self, source: SourceKind) -> &wgpu::BindGroupLayout {
        &self.reduce[source as usize]
    }

    pub(crate) fn cull(&self, store: DepthStore) -> &wgpu::BindGroupLayout {
        match store {
            DepthStore::Apart(source) => &self.cull_apart[source as usize],
            DepthStore::Atlas => &self.cull_atlas,
            DepthStore::Nowhere => &self.cull_nowhere,
        }
    }
}

fn layout_entry(binding: u32, kind: Binding) -> wgpu::BindGroupLayoutEntry {
    let buffer =
        |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let storage_texture = |format, access| wgpu::BindingType::StorageTexture {
        access,
        format,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    let quads = |access| storage_texture(wgpu::TextureFormat::Rgba32Uint, access);
    let texels = |access| storage_texture(wgpu::TextureFormat::R32Uint, access);
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: match kind {
            Binding::Texture(source) => source.binding(),
            Binding::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering),
            Binding::Uniform => buffer(wgpu::BufferBindingType::Uniform),
            Binding::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            Binding::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            Binding::ReadQuads => quads(wgpu::StorageTextureAccess::ReadOnly),
            Binding::WriteQuads => quads(wgpu::StorageTextureAccess::WriteOnly),
            Binding::ReadTexels => texels(wgpu::StorageTextureAccess::ReadOnly),
            Binding::WriteTexels => texels(wgpu::StorageTextureAccess::WriteOnly),
        },
        count: None,
    }
}
