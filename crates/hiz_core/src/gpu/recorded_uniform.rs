//! Uniforms whose contents come with each recording, and the bind groups that read them.

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::kept::KeptBindings;
use crate::gpu::numbers::{Copy, Numbers, UNIFORM_BYTES};
use crate::host::threads::Locked;

/// How many parts a uniform has.
pub(crate) const PARTS: usize = 2;
const PART_BYTES: usize = UNIFORM_BYTES as usize;

/// How often the same contents are asked for in a row until they get a uniform of their own.
/// That costs a bind group once, and saves each later recording the copy.
const RECURS: u32 = 16;

/// Parts with a uniform of their own that are kept at most.
const OWN_KEPT: usize = 4;

/// What tells apart the bind groups over one part: a code of the stage that asks, and the textures
/// and the buffer that are bound beside it.
pub(crate) type BindingKey =
    (u32, wgpu::TextureView, Option<wgpu::TextureView>, Option<wgpu::Buffer>);

/// A uniform of [`PARTS`] parts, each of which may be bound by itself.
///
/// Its buffer and bind groups stay, and each recording copies its contents into it
/// (`gpu/numbers.rs`).
/// Contents that recur get a uniform of their own, which is never written again.
#[derive(Debug)]
pub(crate) struct RecordedUniform {
    label: &'static str,
    uniform: wgpu::Buffer,
    bindings: KeptBindings<(usize, BindingKey)>,
    own: KeptBindings<(Vec<u8>, BindingKey)>,
    /// The contents that were asked for last, and how often before without others in between.
    last: Locked<(Vec<u8>, u32)>,
}

/// The bind groups of one recording, one per part.
#[derive(Debug)]
pub(crate) struct BoundParts {
    pub(crate) parts: Vec<wgpu::BindGroup>,
    /// What the recording has to copy with [`RecordedUniform::record`], if anything.
    pub(crate) numbers: Option<Numbers>,
}

impl RecordedUniform {
    /// Keeps the bind groups over both parts for the last `most` textures.
    pub(crate) fn new(gpu: &Gpu, label: &'static str, most: usize) -> Result<Self> {
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        Ok(Self {
            label,
            uniform: gpu.empty(label, (PARTS * PART_BYTES) as u64, usage)?,
            bindings: KeptBindings::new(PARTS * most),
            own: KeptBindings::new(OWN_KEPT),
            last: Locked::default(),
        })
    }

    /// The bind groups over the first parts of the uniform, which get `contents`.
    ///
    /// There are at most [`PARTS`] contents, of at most [`UNIFORM_BYTES`] each.
    /// `bind` makes the bind group around a part.
    pub(crate) fn bind(
        &self,
        gpu: &Gpu,
        key: &BindingKey,
        contents: &[&[u8]],
        bind: impl Fn(wgpu::BindingResource<'_>) -> Result<wgpu::BindGroup>,
    ) -> Result<BoundParts> {
        let own_key = |part: &&[u8]| (part.to_vec(), key.clone());
        let own = contents.iter().map(|part| self.own.find(&own_key(part))).collect();
        if let Some(parts) = own {
            return Ok(BoundParts { parts, numbers: None });
        }
        let mut staged = [0; PARTS * PART_BYTES];
        for (place, part) in staged.chunks_exact_mut(PART_BYTES).zip(contents) {
            place[..part.len()].copy_from_slice(part);
        }
        if self.asked_before(&staged) >= RECURS {
            let make = |part: &&[u8]| {
                self.own.get(own_key(part), || {
                    let uniform = gpu.filled(self.label, part, wgpu::BufferUsages::UNIFORM)?;
                    bind(uniform.as_entire_binding())
                })
            };
            let parts = contents.iter().map(make).collect::<Result<_>>()?;
            return Ok(BoundParts { parts, numbers: None });
        }
        let of_part = |(number, part): (usize, &&[u8])| {
            self.bindings.get((number, key.clone()), || {
                bind(wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer: &self.uniform,
                    offset: (number * PART_BYTES) as u64,
                    size: wgpu::BufferSize::new(part.len() as u64),
                }))
            })
        };
        let parts = contents.iter().enumerate().map(of_part).collect::<Result<_>>()?;
        Ok(BoundParts {
            parts,
            numbers: Some(gpu.numbers(&staged[..contents.len() * PART_BYTES])?),
        })
    }

    /// Records the copy of a recording's numbers, before the commands that read them.
    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder, numbers: Numbers) {
        let size = numbers.len();
        numbers.record(encoder, &[Copy { from: 0, target: &self.uniform, to: 0, size }]);
    }

    /// Notes that `contents` are asked for.
    /// Returns how often they were asked for before, without others in between.
    fn asked_before(&self, contents: &[u8]) -> u32 {
        let mut last = self.last.lock();
        if last.0 == contents {
            last.1 = last.1.saturating_add(1);
        } else {
            *last = (contents.to_vec(), 0);
        }
        last.1
    }

    /// Releases the uniforms of their own, whose contents will not come again.
    pub(crate) fn forget_contents(&self) {
        self.own.clear();
    }

    /// Releases all bind groups, and with them the textures that they hold.
    pub(crate) fn clear(&self) {
        self.own.clear();
        self.bindings.clear();
    }
}
