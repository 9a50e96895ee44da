//! Culling dropped into a plain wgpu renderer: the same picture, from a few of 100,000 crates.
//!
//! ```text
//! cargo run --release --example drop_in -- town.png
//! ```
//!
//! `app.rs` is the renderer, `culling.rs` what culling adds.
//! `own.rs` has the culling that many renderers write themselves.
//! This file compares pictures and times of frames without culling and with both.
//! `tests/examples.rs` runs it.

mod app;
pub(crate) mod culling;
mod own;

use std::{error::Error, fs::File, sync::mpsc, time::Instant};

use culling::{CRATES, SIZE, Town};
use hiz_core::wgpu::{self, Buffer, BufferUsages, Device, Queue, Texture, util::DownloadBuffer};

type Outcome<T> = Result<T, Box<dyn Error>>;

pub(crate) const WAYS: [&str; 3] = ["no culling", "hizvk", "by hand"];

/// What a way draws, and what it takes.
pub(crate) struct Row {
    /// The median of its frames, in milliseconds.
    pub(crate) ms: f64,
    pub(crate) drawn: u32,
    pub(crate) picture: Vec<u8>,
    pub(crate) depth: Vec<f32>,
}

pub(crate) fn main() -> Outcome<()> {
    let engine = hiz_core::headless::Engine::new(None)?; // an app has a device of its own
    let (device, queue) = (engine.device(), engine.queue());
    let town = Town::new(device, queue)?;
    let rows = compare(&town, device, queue, 9)?;
    println!("way         ms per frame  crates drawn  other pixels  too far");
    for (way, row) in WAYS.iter().zip(&rows) {
        let other = other_pixels(&rows[0], row);
        let holes = holes(&rows[0], row);
        println!("{way:11} {:12.1} {:13} {other:13} {holes:8}", row.ms, row.drawn);
    }
    if let Some(path) = std::env::args_os().nth(1) {
        let mut png = png::Encoder::new(File::create(path)?, SIZE.width, SIZE.height);
        png.set_color(png::ColorType::Rgba);
        png.write_header()?.write_image_data(&rows[1].picture)?;
    }
    Ok(())
}

/// Pixels of another colour.
pub(crate) fn other_pixels(all: &Row, row: &Row) -> usize {
    let pixels = all.picture.chunks_exact(4).zip(row.picture.chunks_exact(4));
    pixels.filter(|(a, b)| a != b).count()
}

/// Pixels that show what lies farther, because something was hidden wrongly.
pub(crate) fn holes(all: &Row, row: &Row) -> usize {
    all.depth.iter().zip(&row.depth).filter(|(a, b)| a > b).count()
}

/// Draws the three ways in turns, so that whatever disturbs the machine disturbs all alike.
pub(crate) fn compare(
    town: &Town,
    device: &Device,
    queue: &Queue,
    rounds: usize,
) -> Outcome<[Row; 3]> {
    let own = own::Own::new(device, town);
    let frame = |way: usize| match way {
        2 => Ok(own.frame(device, town)),
        _ => town.frame(way == 1),
    };
    let mut all_ms = [const { Vec::new() }; 3];
    // The first round makes pipelines, and does not count.
    for round in 0..=rounds {
        for (way, ms) in all_ms.iter_mut().enumerate() {
            let begin = Instant::now();
            queue.submit([frame(way)?]);
            device.poll(wgpu::PollType::wait_indefinitely())?;
            if round > 0 {
                ms.push(begin.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
    let mut rows = Vec::new();
    for (way, mut ms) in all_ms.into_iter().enumerate() {
        ms.sort_by(f64::total_cmp);
        queue.submit([frame(way)?]);
        let picture = read_texture(device, queue, &town.app.picture)?;
        let depth = read_texture(device, queue, &town.app.depth)?;
        let draw = if way == 2 { Some(&own.draw) } else { town.visible.draw_arguments() };
        let draw = read(device, queue, draw.expect("among the outputs"))?;
        let drawn = if way == 0 { CRATES } else { bytemuck::pod_read_unaligned(&draw[4..8]) };
        let depth = bytemuck::pod_collect_to_vec(&depth);
        rows.push(Row { ms: ms[rounds / 2], drawn, picture, depth });
    }
    Ok(rows.try_into().unwrap_or_else(|_| unreachable!("three ways")))
}

/// The four bytes of each pixel, when all that was submitted is done.
pub(crate) fn read_texture(device: &Device, queue: &Queue, texture: &Texture) -> Outcome<Vec<u8>> {
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
    copy.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
    queue.submit([copy.finish()]);
    read(device, queue, &pixels)
}

/// The bytes of a buffer, when all that was submitted is done.
fn read(device: &Device, queue: &Queue, buffer: &Buffer) -> Outcome<Vec<u8>> {
    let (told, answer) = mpsc::channel();
    DownloadBuffer::read_buffer(device, queue, &buffer.slice(..), move |bytes| {
        told.send(bytes.map(|bytes| bytes.to_vec())).expect("it is waited for");
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(answer.recv()??)
}
