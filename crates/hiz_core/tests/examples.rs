//! Runs the example `simple`; `tests/renderer.rs` runs the other renderer.

mod common;
#[path = "../examples/simple.rs"]
#[allow(dead_code, reason = "the program's own device, and its report")]
mod simple;

use common::engine;
use hiz_core::DrawIndexedIndirect;
use hiz_core::wgpu::{self, util::DownloadBuffer};

/// 256 pixels of one byte: as many as `copy_texture_to_buffer` wants in a row.
const SIDE: u32 = 256;

/// The bytes of `buffer`.
fn read(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Vec<u8> {
    let (told, answer) = std::sync::mpsc::channel();
    DownloadBuffer::read_buffer(device, queue, &buffer.slice(..), move |bytes| {
        told.send(bytes.expect("a small buffer can be read").to_vec()).expect("it is waited for");
    });
    device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
    answer.recv().expect("the callback ran")
}

/// A metre at 16 m is 8 pixels of the 256, because the view is 90 degrees wide.
/// So a square of half a metre covers 4 x 4 pixels, and the wall ends at column 128.
/// Of the 20 x 20 boxes, the 10 columns left of the middle are behind the wall.
#[test]
fn simple_draws_what_the_wall_does_not_hide() {
    let engine = engine();
    let (device, queue) = (engine.device(), engine.queue());
    let (picture, visible) = simple::draw_frame(device, queue).unwrap();

    let draws = read(device, queue, visible.draw_arguments().unwrap());
    let draws: Vec<DrawIndexedIndirect> = bytemuck::pod_collect_to_vec(&draws);
    let draw = DrawIndexedIndirect { index_count: 6, instance_count: 200, ..Default::default() };
    assert_eq!(draws, [draw]);

    let pixels = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(SIDE * SIDE),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(SIDE), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        picture.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &pixels, layout },
        picture.size(),
    );
    queue.submit([encoder.finish()]);
    let pixels = read(device, queue, &pixels);
    for (i, pixel) in (0_u32..).zip(&pixels) {
        let (column, row) = (i % SIDE, i / SIDE);
        // From the middle, squares cover pixels 2 to 5 of every 8, and there are 10 each way.
        let in_square = |at: u32| (2..6).contains(&(at % 8)) && (48..208).contains(&at);
        let expected = column >= 128 && in_square(column) && in_square(row);
        assert_eq!(*pixel > 0, expected, "pixel {column}, {row}");
    }
}

/// The program itself, on a device that it opens.
#[test]
fn simple_runs() {
    simple::main().unwrap();
}
