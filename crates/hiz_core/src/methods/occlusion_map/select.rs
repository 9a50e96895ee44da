//! The occluders of a view, from a database of occluders.
//!
//! Source: Zhang, Manocha, Hudson and Hoff (1997), section 5; Moller and Haines (1999): the best
//! are large, near and inside the frustum, up to a limit of polygons.
//! The database is what was uploaded, such as what `select_occluders` of the Python package keeps.

use crate::methods::occlusion_map::options::MapOptions;
use crate::methods::seen::{Eye, Seen};
use crate::occluders::copies::CopyBox;

/// The copies to draw, those that look largest first, as far as the limits go.
///
/// A copy that does not fit into what is left of the triangles is passed over.
pub(super) fn chosen(eye: &Eye, boxes: &[Option<CopyBox>], options: &MapOptions) -> Vec<u32> {
    let worth = |(number, copy): (u32, &Option<CopyBox>)| {
        let CopyBox { corners, triangles } = copy.as_ref()?;
        let is_there = !matches!(eye.look(corners), Seen::Outside);
        is_there.then(|| (eye.apparent_size(corners), number, *triangles))
    };
    let mut ranked: Vec<_> = (0..).zip(boxes).filter_map(worth).collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut left = options.max_triangles.unwrap_or(u64::MAX);
    let most =
        options.max_copies.map_or(usize::MAX, |most| usize::try_from(most).unwrap_or(usize::MAX));
    let fits = |(_, number, triangles): (f64, u32, u64)| {
        left = left.checked_sub(triangles)?;
        Some(number)
    };
    ranked.into_iter().filter_map(fits).take(most).collect()
}
