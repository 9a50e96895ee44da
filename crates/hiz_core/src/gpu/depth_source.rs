//! The kinds of textures that can be level 0 of a pyramid, and how each is bound.

use crate::gpu::shader::File;
use crate::gpu::shader::wgsl;
use crate::input::image::ImageSize;

/// The kind of texture that level 0 of a pyramid is read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum SourceKind {
    /// A depth texture.
    Depth,
    /// A float colour texture with one channel.
    Float,
    /// A texture of float32 bits, with four pixels of a row per texel.
    Bits,
    /// A rectangle of a depth texture.
    DepthPart,
    /// A rectangle of a float colour texture with one channel.
    FloatPart,
    /// Two textures of float32 bits: the farthest of each pixel's samples, and the nearest.
    Pair,
}

const DEPTH: File = wgsl!("gpu/source_depth");
const FLOAT: File = wgsl!("gpu/source_float");
const SAMPLED: File = wgsl!("gpu/source_sampled");
const WHOLE: File = wgsl!("gpu/source_whole");
const PART: File = wgsl!("gpu/source_part");
const SINGLE: File = wgsl!("gpu/source_single");

impl SourceKind {
    /// The shader files that read this kind.
    pub(crate) fn files(self) -> &'static [File] {
        match self {
            Self::Depth => &[DEPTH, SAMPLED, WHOLE, SINGLE],
            Self::Float => &[FLOAT, SAMPLED, WHOLE, SINGLE],
            Self::DepthPart => &[DEPTH, SAMPLED, PART, SINGLE],
            Self::FloatPart => &[FLOAT, SAMPLED, PART, SINGLE],
            Self::Bits => &[wgsl!("gpu/source_bits"), SINGLE],
            Self::Pair => &[wgsl!("gpu/source_pair")],
        }
    }

    /// The shader files that read blocks of it for a reduction.
    pub(crate) fn quad_files(self) -> &'static [File] {
        match self {
            Self::Depth | Self::Float => &[wgsl!("gpu/quads_sampled"), wgsl!("gpu/quads_whole")],
            Self::DepthPart | Self::FloatPart => {
                &[wgsl!("gpu/quads_sampled"), wgsl!("gpu/quads_part")]
            }
            Self::Bits => &[wgsl!("gpu/quads_bits")],
            Self::Pair => &[wgsl!("gpu/quads_pair")],
        }
    }

    /// The type of its binding; `multisampled`: of a texture with several samples per pixel.
    pub(crate) fn binding(self, multisampled: bool) -> wgpu::BindingType {
        let view_dimension = wgpu::TextureViewDimension::D2;
        let sampled =
            |sample_type| wgpu::BindingType::Texture { sample_type, view_dimension, multisampled };
        match self {
            Self::Depth | Self::DepthPart => sampled(wgpu::TextureSampleType::Depth),
            Self::Float | Self::FloatPart => {
                sampled(wgpu::TextureSampleType::Float { filterable: false })
            }
            Self::Bits | Self::Pair => wgpu::BindingType::StorageTexture {
                access: wgpu::StorageTextureAccess::ReadOnly,
                format: wgpu::TextureFormat::Rgba32Uint,
                view_dimension,
            },
        }
    }

    /// The usage that its texture needs to be bound.
    pub(crate) fn usage(self) -> wgpu::TextureUsages {
        match self {
            Self::Depth | Self::Float | Self::DepthPart | Self::FloatPart => {
                wgpu::TextureUsages::TEXTURE_BINDING
            }
            Self::Bits | Self::Pair => wgpu::TextureUsages::STORAGE_BINDING,
        }
    }

    /// Whether a texel holds four pixels of a row.
    pub(crate) fn is_packed(self) -> bool {
        matches!(self, Self::Bits | Self::Pair)
    }

    /// Pixels of a row that one texel holds.
    pub(crate) fn pixels_of_texel(self) -> u32 {
        if self.is_packed() { 4 } else { 1 }
    }

    /// The size in texels of the texture for an image of this size in pixels.
    pub(crate) fn texture_size(self, image: ImageSize) -> ImageSize {
        ImageSize::new(image.width.div_ceil(self.pixels_of_texel()), image.height)
    }

    /// The kind that reads a rectangle of such a texture; none where a texel holds four pixels.
    pub(crate) fn part(self) -> Option<Self> {
        match self {
            Self::Depth | Self::DepthPart => Some(Self::DepthPart),
            Self::Float | Self::FloatPart => Some(Self::FloatPart),
            Self::Bits | Self::Pair => None,
        }
    }

    /// The kind that reads all of such a texture.
    pub(crate) fn whole(self) -> Self {
        match self {
            Self::DepthPart => Self::Depth,
            Self::FloatPart => Self::Float,
            whole => whole,
        }
    }

    /// Whether a rectangle of the texture is read, and not all of it.
    pub(crate) fn is_part(self) -> bool {
        matches!(self, Self::DepthPart | Self::FloatPart)
    }

    /// The kind for all of a texture of this format; `None` for formats that no pyramid can be
    /// built from.
    pub(crate) fn of(format: wgpu::TextureFormat) -> Option<Self> {
        match format {
            wgpu::TextureFormat::R32Float | wgpu::TextureFormat::R16Float => Some(Self::Float),
            wgpu::TextureFormat::Rgba32Uint => Some(Self::Bits),
            f if f.has_depth_aspect() => Some(Self::Depth),
            _ => None,
        }
    }
}

/// All kinds of source, in the order of their declaration.
#[cfg(feature = "testing")]
pub(crate) const SOURCES: [SourceKind; 6] = [
    SourceKind::Depth,
    SourceKind::Float,
    SourceKind::Bits,
    SourceKind::DepthPart,
    SourceKind::FloatPart,
    SourceKind::Pair,
];
