//! Bind group layouts, each made once per device.

use std::collections::HashMap;

use crate::error::Result;
use crate::gpu::depth_source::SourceKind;
use crate::host::threads::Locked;

/// The type of one binding in a layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Binding {
    /// A depth image.
    Depth(SourceKind),
    /// A multisampled depth image.
    Samples(SourceKind),
    /// The sampler for a depth image.
    Sampler,
    Uniform,
    /// A uniform buffer of a vertex shader; all other bindings are for compute shaders.
    VertexUniform,
    /// Storage buffers.
    Read,
    Write,
    /// Storage textures of format `Rgba32Uint`.
    ReadQuads,
    WriteQuads,
    /// A sampled texture of unsigned integers: of format `Rgba32Uint` or `R32Uint`.
    SampledQuads,
    /// Storage textures of format `R32Uint`.
    ReadTexels,
    WriteTexels,
    /// A storage texture of format `R32Float`.
    #[cfg(feature = "yardstick")]
    WriteFloats,
}

/// Layouts by their bindings: equal bindings share a layout.
#[derive(Debug, Default)]
pub(crate) struct Layouts(Locked<HashMap<Vec<(u32, Binding)>, wgpu::BindGroupLayout>>);

impl Layouts {
    /// The layout of these bindings, made by `make` on first use.
    pub(crate) fn get(
        &self,
        bindings: &[(u32, Binding)],
        make: impl FnOnce(&[wgpu::BindGroupLayoutEntry]) -> Result<wgpu::BindGroupLayout>,
    ) -> Result<wgpu::BindGroupLayout> {
        let mut made = self.0.lock();
        if let Some(layout) = made.get(bindings) {
            return Ok(layout.clone());
        }
        let entries: Vec<_> =
            bindings.iter().map(|(binding, kind)| layout_entry(*binding, *kind)).collect();
        let layout = make(&entries)?;
        made.insert(bindings.to_vec(), layout.clone());
        Ok(layout)
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
        visibility: if kind == Binding::VertexUniform {
            wgpu::ShaderStages::VERTEX
        } else {
            wgpu::ShaderStages::COMPUTE
        },
        ty: match kind {
            Binding::Depth(source) => source.binding(false),
            Binding::Samples(source) => source.binding(true),
            Binding::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering),
            Binding::Uniform | Binding::VertexUniform => buffer(wgpu::BufferBindingType::Uniform),
            Binding::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            Binding::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            Binding::ReadQuads => quads(wgpu::StorageTextureAccess::ReadOnly),
            Binding::WriteQuads => quads(wgpu::StorageTextureAccess::WriteOnly),
            Binding::SampledQuads => wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            Binding::ReadTexels => texels(wgpu::StorageTextureAccess::ReadOnly),
            Binding::WriteTexels => texels(wgpu::StorageTextureAccess::WriteOnly),
            #[cfg(feature = "yardstick")]
            Binding::WriteFloats => storage_texture(
                wgpu::TextureFormat::R32Float,
                wgpu::StorageTextureAccess::WriteOnly,
            ),
        },
        count: None,
    }
}
