//! Bounds that are taken from a buffer on the device, beside a copy of the same bytes there.

use std::sync::Arc;

use crate::error::Result;
use crate::headless::Engine;
use crate::input::bounds::Bounds;
use crate::instances::Instances;

/// Bounds in a buffer, and the instances that take them.
#[derive(Debug)]
pub struct BoundsInBuffer {
    given: wgpu::Buffer,
    copy: wgpu::Buffer,
    instances: Arc<Instances>,
}

impl BoundsInBuffer {
    /// Writes the float32 numbers of `bounds`, spheres, boxes or points, into a buffer.
    ///
    /// # Errors
    /// Those of [`Engine::instances_from`].
    pub fn new(engine: &Engine, bounds: &Bounds<'_>) -> Result<Self> {
        let count = bounds.len()?;
        let (first, then, width) = match bounds {
            Bounds::Spheres { centers, radii } => (centers, radii, 1),
            Bounds::Boxes { min, max } => (min, max, 3),
            Bounds::OrientedBoxes { centers, half_sizes, .. } => (centers, half_sizes, 3),
            Bounds::Points { positions } => (positions, positions, 0),
        };
        let mut numbers = Vec::with_capacity(count * (3 + width));
        for i in 0..count {
            numbers.extend((3 * i..3 * i + 3).map(|k| first.get(k) as f32));
            numbers.extend((width * i..width * (i + 1)).map(|k| then.get(k) as f32));
        }
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let (gpu, bytes) = (&engine.context().gpu, bytemuck::cast_slice(&numbers));
        let given = gpu.filled("hiz.yardstick.bounds", bytes, usage)?;
        let copy = gpu.empty("hiz.yardstick.copy", bytes.len() as u64, usage)?;
        let instances = engine.instances_from(&given, bounds.kind(), count as u32)?;
        Ok(Self { given, copy, instances })
    }

    /// Records that the bounds are taken.
    ///
    /// # Errors
    /// Those of [`HizContext::record_update_from`](crate::HizContext::record_update_from).
    pub fn record(&self, engine: &Engine, encoder: &mut wgpu::CommandEncoder) -> Result<()> {
        engine.context().record_update_from(encoder, &self.instances, &self.given)
    }

    /// Records a copy of the same bytes into another buffer.
    pub fn record_copy(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.copy_buffer_to_buffer(&self.given, 0, &self.copy, 0, self.given.size());
    }
}
