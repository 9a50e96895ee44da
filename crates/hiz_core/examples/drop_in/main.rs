//! Culling dropped into a plain wgpu renderer: the same picture, from a few of 100,000 crates.
//!
//! ```text
//! cargo run --release --example drop_in -- town.png
//! ```
//!
//! `app.rs` is the renderer, `culling.rs` what culling adds.
//! This file compares pictures and times of frames without culling and with it.
//! `tests/examples.rs` runs it.

mod app;
pub(crate) mod culling;

use std::{error::Error, fs::File, sync::mpsc, time::Instant};

use culling::{CRATES, SIZE, Town};
use hiz_core::wgpu::{self, Buffer, BufferUsages, Device, Queue, util::DownloadBuffer};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let engine = hiz_core::headless::Engine::new(None)?; // an app has a device of its own
    let (device, queue) = (engine.device(), engine.queue());
    let town = Town::new(device, queue)?;
    let mut best = [f64::INFINITY; 2];
    // The first frame of each way makes pipelines, and is not the best.
    for round in 0..20 {
        let begin = Instant::now();
        queue.submit([town.frame(round % 2 == 1)?]);
        device.poll(wgpu::PollType::wait_indefinitely())?;
        best[round % 2] = best[round % 2].min(begin.elapsed().as_secs_f64() * 1e3);
    }
    let ([all, culled], drawn) = compare(&town, device, queue)?;
    println!("{:.1} ms per frame without culling, {:.1} ms with it", best[0], best[1]);
    println!("{drawn} of {CRATES} crates drawn, the same picture: {}", all == culled);
    if let Some(path) = std::env::args_os().nth(1) {
        let mut png = png::Encoder::new(File::create(path)?, SIZE.width, SIZE.height);
        png.set_color(png::ColorType::Rgba);
        png.write_header()?.write_image_data(&culled)?;
    }
    Ok(())
}

/// Pictures without and with culling, and the number of crates that were drawn with it.
pub(crate) type Compared = ([Vec<u8>; 2], u32);

/// Draws both.
pub(crate) fn compare(
    town: &Town,
    device: &Device,
    queue: &Queue,
) -> Result<Compared, Box<dyn Error>> {
    let all = read_picture(town, device, queue, town.frame(false)?)?;
    let culled = read_picture(town, device, queue, town.frame(true)?)?;
    let draws = read(device, queue, town.visible.draw_arguments().expect("among the outputs"))?;
    let draw: hiz_core::DrawIndexedIndirect = bytemuck::pod_read_unaligned(&draws);
    Ok(([all, culled], draw.instance_count))
}

/// Submits a frame; returns the four bytes of each of its pixels.
pub(crate) fn read_picture(
    town: &Town,
    device: &Device,
    queue: &Queue,
    frame: wgpu::CommandBuffer,
) -> Result<Vec<u8>, Box<dyn Error>> {
    let picture = &town.app.picture;
    let pixels = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(4 * SIZE.width * SIZE.height),
        usage: BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let bytes_per_row = Some(4 * SIZE.width);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &pixels, layout };
    let mut copy = device.create_command_encoder(&Default::default());
    copy.copy_texture_to_buffer(picture.as_image_copy(), to, picture.size());
    queue.submit([frame, copy.finish()]);
    read(device, queue, &pixels)
}

/// The bytes of a buffer, when all that was submitted is done.
fn read(device: &Device, queue: &Queue, buffer: &Buffer) -> Result<Vec<u8>, Box<dyn Error>> {
    let (told, answer) = mpsc::channel();
    DownloadBuffer::read_buffer(device, queue, &buffer.slice(..), move |bytes| {
        told.send(bytes.map(|bytes| bytes.to_vec())).expect("it is waited for");
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(answer.recv()??)
}
