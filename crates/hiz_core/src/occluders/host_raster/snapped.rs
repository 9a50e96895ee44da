//! Triangles as they lie on the grid of an image, for methods that draw coverage in other ways.
//!
//! Their coverage is that of the rasteriser, exactly: the same corners and the same edges.

use crate::error::Result;
use crate::host::vectors::Plain;
use crate::input::camera::Camera;
use crate::input::mesh::FaceCull;
use crate::occluders::host_raster::edges::{Edges, LARGE, STEP, Steps};
use crate::occluders::host_raster::lanes::three;
use crate::occluders::host_raster::lens::{HALF, Image, Lens, UNITS};
use crate::occluders::host_raster::planted_fault::Planted;
use crate::occluders::host_raster::sides::Sides;
use crate::occluders::host_raster::triangle::{End, Triangle, clipped};
use crate::occluders::host_raster::vertices::Vertices;
use crate::occluders::placement::Placement;
use crate::occluders::shapes::Shapes;
use crate::occluders::surface::OccluderSurface;
use crate::occluders::view::View;

/// A triangle on the grid, or a part of one that was clipped.
pub(crate) struct Snapped {
    triangle: Triangle,
    edges: Edges,
    /// Columns and rows `first..=last` whose centres it may cover, within the image.
    pub(crate) columns: (i32, i32),
    pub(crate) rows: (i32, i32),
}

/// The copies of a surface as one camera sees them.
pub(crate) struct Grid<'a> {
    shapes: &'a Shapes,
    placements: &'a [Placement],
    image: Image,
    lenses: Vec<Lens>,
    faces: FaceCull,
    vertices: Box<Vertices>,
}

impl<'a> Grid<'a> {
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for a camera that float32 cannot hold.
    pub(crate) fn new(
        surface: &'a OccluderSurface,
        placements: &'a [Placement],
        camera: &Camera,
    ) -> Result<Self> {
        let (view, image) = (View::new(camera)?, Image::of_size(camera.size(), Planted::default()));
        let shapes = surface.shapes();
        let lens = |placement: &Placement| {
            let placed = view.placed(&shapes.meshes[placement.mesh as usize], placement);
            Lens::new(camera, &image, &placed, placement)
        };
        Ok(Self {
            shapes,
            placements,
            image,
            lenses: placements.iter().map(lens).collect(),
            faces: surface.cull_mode().as_seen_by(camera),
            vertices: Box::new(Vertices::new()),
        })
    }

    /// Hands out the triangles of a meshlet that may cover a centre, with their numbers.
    pub(crate) fn meshlet(&mut self, copy: u32, meshlet: u32, mut out: impl FnMut(u32, Snapped)) {
        let (shapes, image) = (self.shapes, &self.image);
        let lens = &self.lenses[copy as usize];
        let mirrored = self.placements[copy as usize].mirrored;
        let faces = if mirrored { self.faces.reversed() } else { self.faces };
        let meshlet = &shapes.meshlets[meshlet as usize];
        let vertices = &mut *self.vertices;
        let (groups, pixels) = (meshlet.groups(), image.pixels());
        vertices.project(&shapes.blocks, meshlet, groups.clone(), lens, image);
        vertices.select(&shapes.blocks, meshlet, groups, &Sides::of(faces), image, pixels);
        for i in 0..vertices.num_kept() {
            let corners = vertices.corners(&shapes.blocks, meshlet, i);
            let projected = three(|k| vertices.projected(corners[k]));
            let number = meshlet.triangles.start + vertices.kept(i) as u32;
            let mut add = |triangle: Triangle| {
                if let Some(snapped) = Snapped::new(triangle, image) {
                    out(number, snapped);
                }
            };
            if let [Some(a), Some(b), Some(c)] = projected {
                if let Some(triangle) = Triangle::new([a, b, c], faces, image) {
                    add(triangle);
                }
                continue;
            }
            let positions = shapes.triangles[number as usize].map(|v| shapes.positions[v as usize]);
            let ends = std::array::from_fn(|k| End {
                clip: lens.exact_clip(positions[k], image),
                projected: projected[k],
            });
            clipped(ends, faces, image, |triangle| add(*triangle));
        }
    }

    /// The number of a meshlet's first triangle.
    pub(crate) fn first_triangle(&self, meshlet: u32) -> u32 {
        self.shapes.meshlets[meshlet as usize].triangles.start
    }

    /// x, y and w of a triangle's corners in float64; x and y are in units about the middle.
    pub(crate) fn clip(&self, copy: u32, triangle: u32) -> [[f64; 3]; 3] {
        self.shapes.triangles[triangle as usize].map(|v| {
            let position = self.shapes.positions[v as usize];
            let [x, y, _, w] = self.lenses[copy as usize].exact_clip(position, &self.image);
            [x, y, w]
        })
    }

    /// The centre of a pixel in units about the middle.
    pub(crate) fn centre(&self, column: i32, row: i32) -> [f64; 2] {
        let at = |pixel: i32, half: i32| f64::from(pixel * UNITS + HALF - half);
        [at(column, self.image.half[0]), at(row, self.image.half[1])]
    }
}

impl Snapped {
    fn new(triangle: Triangle, image: &Image) -> Option<Self> {
        let range = |v: [i32; 3], side: i32| {
            let (low, high) = (v[0].min(v[1]).min(v[2]), v[0].max(v[1]).max(v[2]));
            (((low + HALF - 1) >> 8).max(0), ((high - HALF) >> 8).min(side - 1))
        };
        let (columns, rows) = (range(triangle.x, image.width), range(triangle.y, image.height));
        let is_there = columns.0 <= columns.1 && rows.0 <= rows.1;
        let edges = Edges::new(&triangle, Planted::default());
        is_there.then_some(Self { triangle, edges, columns, rows })
    }

    /// Whether no centre of a square of `side` pixels is covered, surely.
    pub(crate) fn misses(&self, column: i32, row: i32, side: i32) -> bool {
        let at = self.edges.at(&self.triangle, column, row);
        (0..3).any(|k| {
            let gain = i64::from(self.edges.right[k].max(0)) + i64::from(self.edges.down[k].max(0));
            at[k] + gain * i64::from(side - 1) < 0
        })
    }

    /// Which pixels of the tile that begins with this one are covered.
    ///
    /// Byte y is row y, and its lowest bit the first column.
    pub(crate) fn mask(&self, column: i32, row: i32) -> u64 {
        let at = self.edges.at(&self.triangle, column, row);
        let gain = |k: usize| {
            i64::from((STEP - 1) * (self.edges.right[k].max(0) + self.edges.down[k].max(0)))
        };
        if (0..3).any(|k| at[k] + gain(k) < 0) {
            return 0;
        }
        let steps = Steps::new(&self.triangle, &self.edges, Planted::default());
        self.edges.mask(
            Plain,
            &steps,
            three(|k| {
                #[expect(clippy::cast_possible_truncation, reason = "clamped")]
                let at = at[k].clamp(-LARGE, LARGE) as i32;
                at
            }),
        )
    }
}
