//! Drawing meshlet by meshlet in an order that the caller chooses, on one thread.
//!
//! [`HostRaster`](super::HostRaster) draws a list in one go.
//! A hierarchy decides after each meshlet what comes next, and asks for pixels in between.
//! Both draw the same triangles into the same kind of [`Pane`].

use crate::error::Result;
use crate::host::linear::{Vec3, inverse3};
use crate::host::memory;
use crate::host::vectors::Plain;
use crate::input::image::{DepthConvention, ImageSize};
use crate::input::mesh::FaceCull;
use crate::occluders::host_raster::edges::Edges;
use crate::occluders::host_raster::lens::{HALF, Image, Lens, extent, extent_within};
use crate::occluders::host_raster::pane::Pane;
use crate::occluders::host_raster::planted_fault::Planted;
use crate::occluders::host_raster::tile::SIDE;
use crate::occluders::host_raster::triangle::Triangle;
use crate::occluders::host_raster::vertices::Vertices;
use crate::occluders::host_raster::written::write;
use crate::occluders::host_raster::{Candidate, Scene, triangles_of};
use crate::occluders::placement::{Placement, box_corner};
use crate::occluders::view::View;

pub(crate) use crate::occluders::host_raster::lens::Extent;

/// Pixels along a side of a tile, as a power of two.
pub(crate) const TILE_LOG2: u32 = SIDE.trailing_zeros();

/// A box in world coordinates, and how much larger than in the world a row's terms may be where its
/// vertices are computed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WorldBox {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
    /// 0 where mesh coordinates are world coordinates.
    pub(crate) stretch: f32,
}

impl WorldBox {
    /// The box around a box of mesh coordinates that stands at `placement`.
    pub(crate) fn of(placement: &Placement, min: Vec3, max: Vec3) -> Self {
        let Some(m) = &placement.matrix else { return Self { min, max, stretch: 0.0 } };
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in 0..8 {
            let local = box_corner(min, max, corner);
            let p = placement.world(local);
            for k in 0..3 {
                let size = (0..3).map(|j| (m[4 * k + j] * local[j]).abs()).sum::<f64>();
                // More than the roundings of the three products and sums.
                let spare = (size + m[4 * k + 3].abs()) * 8.0 * f64::EPSILON;
                low[k] = low[k].min(p[k] - spare);
                high[k] = high[k].max(p[k] + spare);
            }
        }
        let linear: [Vec3; 3] = std::array::from_fn(|i| [m[4 * i], m[4 * i + 1], m[4 * i + 2]]);
        Self { min: low, max: high, stretch: stretch(&linear) }
    }

    /// The box around nothing.
    pub(crate) const NOTHING: Self =
        Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3], stretch: 0.0 };

    /// Grows to hold another box, too.
    ///
    /// In place: LLVM 22 crashes on a fold of boxes that are returned.
    pub(crate) fn include(&mut self, other: &Self) {
        for k in 0..3 {
            self.min[k] = self.min[k].min(other.min[k]);
            self.max[k] = self.max[k].max(other.max[k]);
        }
        self.stretch = self.stretch.max(other.stretch);
    }
}

/// The greatest sum of a row of |L| |L^-1|; infinite for a matrix without a usable inverse.
///
/// A row r of the camera is r L in mesh coordinates, and a way d from the eye is L^-1 d.
/// So its terms there add up to at most |r| |L| |L^-1| |d|.
fn stretch(linear: &[Vec3; 3]) -> f32 {
    const LARGEST: f64 = 1e6;
    let Some(inverse) = inverse3(linear) else { return f32::INFINITY };
    let entry =
        |i: usize, j: usize| (0..3).map(|k| (linear[i][k] * inverse[k][j]).abs()).sum::<f64>();
    let most = (0..3).map(|i| (0..3).map(|j| entry(i, j)).sum()).fold(0.0, f64::max);
    // Rounded up; one part in a million is more than float32 rounds.
    if most < LARGEST { (most * (1.0 + 1e-6)) as f32 } else { f32::INFINITY }
}

/// An image that is drawn meshlet by meshlet.
pub(crate) struct OneByOne {
    image: Image,
    pane: Pane,
    vertices: Vertices,
    met: Met,
}

/// The tiles that triangles of the last meshlet met.
struct Met {
    /// Tiles in a row.
    across: u32,
    /// By tile: whether it is in the list.
    is_listed: Vec<bool>,
    /// Column and row of each tile.
    list: Vec<(u32, u32)>,
    /// The nearest of the triangles' corners.
    nearest: f32,
}

impl Met {
    fn new(image: &Image) -> Self {
        let [across, rows] =
            [image.width, image.height].map(|side| (side as u32).div_ceil(SIDE as u32));
        let is_listed = vec![false; (across * rows) as usize];
        Self { across, is_listed, list: Vec::new(), nearest: 0.0 }
    }

    fn clear(&mut self) {
        for (column, row) in self.list.drain(..) {
            self.is_listed[(row * self.across + column) as usize] = false;
        }
        self.nearest = 0.0;
    }

    /// Lists the tiles of a triangle's rectangle.
    #[inline(always)]
    fn add(&mut self, t: &Triangle, image: &Image) {
        let Some((columns, rows)) = pixels_around(t, image) else { return };
        self.nearest = if t.nearest > self.nearest { t.nearest } else { self.nearest };
        let tile = |pixel: i32| pixel as u32 / SIDE as u32;
        for row in tile(rows.0)..=tile(rows.1) {
            for column in tile(columns.0)..=tile(columns.1) {
                let is_listed = &mut self.is_listed[(row * self.across + column) as usize];
                if !*is_listed {
                    *is_listed = true;
                    self.list.push((column, row));
                }
            }
        }
    }
}

/// How the copies of a scene are seen in one frame.
pub(crate) struct Looks<'a> {
    scene: Scene<'a>,
    view: View,
    faces: FaceCull,
    /// By copy, made when it is asked for.
    of_copies: Vec<Option<Lens>>,
    world: Lens,
}

impl<'a> Looks<'a> {
    /// `None` for a scene without copies.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for a camera that float32 cannot hold, and
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub(crate) fn new(scene: Scene<'a>) -> Result<Option<Self>> {
        let view = View::new(scene.camera)?;
        let Some((_, first)) = scene.copies.first() else { return Ok(None) };
        let mesh = &scene.shapes.meshes[first.mesh as usize];
        let image = Image::of_size(scene.camera.size(), Planted::default());
        let here = Placement::of_mesh(scene.shapes, first.mesh, None)?;
        let placed = view.placed(mesh, &here[0]);
        let world = Lens::new(scene.camera, &image, &placed, &here[0]);
        let mut of_copies = memory::list(scene.copies.len(), "copies")?;
        of_copies.resize_with(scene.copies.len(), || None);
        let faces = scene.cull_mode.as_seen_by(scene.camera);
        Ok(Some(Self { scene, view, faces, of_copies, world }))
    }

    fn lens(&mut self, copy: u32, image: &Image) -> &Lens {
        let Self { scene, view, of_copies, .. } = self;
        of_copies[copy as usize].get_or_insert_with(|| {
            let placement = scene.copies[copy as usize].1;
            let mesh = &scene.shapes.meshes[placement.mesh as usize];
            let placed = view.placed(mesh, placement);
            Lens::new(scene.camera, image, &placed, placement)
        })
    }
}

impl OneByOne {
    /// An image that is far everywhere.
    pub(crate) fn new(size: ImageSize) -> Self {
        let image = Image::of_size(size, Planted::default());
        let pane = Pane::of_image(image);
        Self { image, pane, vertices: Vertices::new(), met: Met::new(&image) }
    }

    pub(crate) fn clear(&mut self) {
        self.pane.clear();
    }

    /// What may show of a box in the world; `None` if it is surely outside of the view.
    pub(crate) fn extent_of_box(&self, looks: &Looks<'_>, b: &WorldBox) -> Option<Extent> {
        if b.stretch == 0.0 {
            return extent(Plain, &looks.world, &self.image, b.min, b.max);
        }
        extent_within(Plain, &looks.world, &self.image, b.min, b.max, |row, reach| {
            let sum = row[0].abs() + row[1].abs() + row[2].abs();
            b.stretch * sum * reach[0].max(reach[1]).max(reach[2])
        })
    }

    /// What may show of a meshlet of a copy; `None` if it is surely outside of the view.
    pub(crate) fn extent_of(
        &self,
        looks: &mut Looks<'_>,
        (copy, meshlet): (u32, u32),
    ) -> Option<Extent> {
        let shapes = looks.scene.shapes;
        let meshlet = &shapes.meshlets[meshlet as usize];
        extent(Plain, looks.lens(copy, &self.image), &self.image, meshlet.min, meshlet.max)
    }

    /// Draws a meshlet of a copy, of which `extent` may show.
    pub(crate) fn draw(&mut self, looks: &mut Looks<'_>, item: (u32, u32), extent: &Extent) {
        let pixels = self.image.pixels();
        let Self { image, pane, vertices, met } = self;
        met.clear();
        each_triangle(looks, item, extent, image, pixels, vertices, |triangle| {
            met.add(triangle, image);
            pane.draw(std::slice::from_ref(triangle));
        });
        pane.renew();
    }

    /// Columns and rows of the tiles that the last meshlet may have changed, and the nearest depth
    /// of its triangles.
    pub(crate) fn changed(&self) -> (&[(u32, u32)], f32) {
        (&self.met.list, self.met.nearest)
    }

    /// The farthest depth of a tile, where it is known without looking at its pixels.
    pub(crate) fn known_farthest(&self, column: u32, row: u32) -> Option<f32> {
        self.pane.exact_farthest(column as usize, row as usize)
    }

    /// How many pixels' centres the triangles of a meshlet cover, each triangle by itself.
    pub(crate) fn centres(
        &mut self,
        looks: &mut Looks<'_>,
        item: (u32, u32),
        extent: &Extent,
    ) -> u64 {
        let pixels = self.image.pixels();
        let Self { image, vertices, .. } = self;
        let mut sum = 0;
        each_triangle(looks, item, extent, image, pixels, vertices, |triangle| {
            sum += covered(triangle, image);
        });
        sum
    }

    /// Nearness in row `y` of a tile; columns past the image's edge hold anything.
    pub(crate) fn row_of_tile(&self, column: u32, row: u32, y: u32) -> [f32; SIDE] {
        self.pane.row_of_tile(column as usize, row as usize, y as usize)
    }

    /// Writes the image as NDC depth, row 0 on top.
    pub(crate) fn write(&self, out: &mut [f32], convention: DepthConvention) {
        let pitch = self.image.width as usize * size_of::<f32>();
        let bytes = wgpu::WriteOnly::from_mut(bytemuck::cast_slice_mut(out));
        let panes = std::slice::from_ref(&self.pane);
        let rows = 0..self.image.height;
        write(&self.image, panes, bytes, pitch, rows, convention, |_, _, _| ());
    }
}

fn each_triangle(
    looks: &mut Looks<'_>,
    (copy, meshlet): (u32, u32),
    extent: &Extent,
    image: &Image,
    pixels: [(i32, i32); 2],
    vertices: &mut Vertices,
    out: impl FnMut(&Triangle),
) {
    let (shapes, faces) = (looks.scene.shapes, looks.faces);
    let groups = shapes.meshlets[meshlet as usize].groups();
    let candidate =
        Candidate { copy, meshlet, groups: (groups.start, groups.end), lens: 0, extent: *extent };
    let lens = looks.lens(copy, image);
    triangles_of(shapes, &candidate, lens, faces, image, pixels, vertices, out);
}

/// First and last column and row of the centres between a triangle's extremes.
#[inline(always)]
fn pixels_around(t: &Triangle, image: &Image) -> Option<((i32, i32), (i32, i32))> {
    let ends = |v: &[i32; 3]| (v[0].min(v[1]).min(v[2]), v[0].max(v[1]).max(v[2]));
    let ((left, right), (up, down)) = (ends(&t.x), ends(&t.y));
    let columns = (((left + HALF - 1) >> 8).max(0), ((right - HALF) >> 8).min(image.width - 1));
    let rows = (((up + HALF - 1) >> 8).max(0), ((down - HALF) >> 8).min(image.height - 1));
    (columns.0 <= columns.1 && rows.0 <= rows.1).then_some((columns, rows))
}

/// How many pixels' centres a triangle covers.
fn covered(t: &Triangle, image: &Image) -> u64 {
    let Some((columns, rows)) = pixels_around(t, image) else { return 0 };
    let edges = Edges::new(t, image.fault);
    let mut first = edges.at(t, columns.0, rows.0);
    let mut sum = 0;
    for _ in rows.0..=rows.1 {
        let mut at = first;
        for _ in columns.0..=columns.1 {
            sum += u64::from(at[0] >= 0 && at[1] >= 0 && at[2] >= 0);
            for k in 0..3 {
                at[k] += i64::from(edges.right[k]);
            }
        }
        for k in 0..3 {
            first[k] += i64::from(edges.down[k]);
        }
    }
    sum
}
