//! How occluders are drawn: by which rasteriser, into what, and which of them.

use crate::error::{Error, Result};
use crate::input::mesh::FaceCull;
use crate::occluders::placement::Placement;

/// How occluders are drawn, whenever they are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OccluderOptions {
    /// Which triangles do not occlude; all occlude by default.
    pub cull_mode: FaceCull,
}

/// Which rasteriser draws occluders into an [`OccluderDepth`](crate::OccluderDepth).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Rasteriser {
    /// The host's for a device that is a processor, such as lavapipe, and the device's for a GPU.
    #[default]
    Auto,
    /// The device's: a render pass.
    Device,
    /// The host's: on all cores, uploaded in the caller's encoder.
    Host,
}

/// What an image holds before occluders are drawn into it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum DepthLoad {
    /// The far plane everywhere.
    #[default]
    Clear,
    /// What was drawn into it before: more occluders are added.
    Load,
}

/// Which copies of meshes are drawn.
///
/// A copy is a mesh at one of its transforms.
/// Copies are numbered through all meshes in the order of the upload.
/// So a cull whose instances are the copies' bounds, in that order, says which of them to draw.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Only<'a> {
    /// All copies.
    #[default]
    All,
    /// These copies, by their numbers; a number may come more than once.
    Listed(&'a [u32]),
    /// The copies whose place holds true, one place for each copy.
    Masked(&'a [bool]),
}

/// Options for one drawing of occluders.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DrawOptions<'a> {
    /// What the image holds before.
    pub load: DepthLoad,
    /// Which copies are drawn.
    pub only: Only<'a>,
    /// At most so many triangles; `None`: all.
    ///
    /// Clusters of neighbouring triangles are chosen by their solid angle per triangle.
    /// The device's rasteriser takes the rectangle around a cluster for it.
    /// The rasteriser on the host remembers the last drawing of these occluders with a limit.
    /// It begins with those that were not hidden then, and those that were come last.
    /// Hidden triangles cost little without a limit, so measure before you set one.
    pub max_triangles: Option<u64>,
    /// At most so many copies, those that are largest in the image; `None`: all.
    pub max_copies: Option<u64>,
}

/// Columns `x0..=x1` and rows `y0..=y1`, as `[x0, y0, x1, y1]`; `None` for no pixel.
pub type Touched = Option<[u32; 4]>;

/// The smallest rectangle around both.
pub(super) fn both(a: Touched, b: Touched) -> Touched {
    match (a, b) {
        (Some(a), Some(b)) => {
            Some([a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])])
        }
        (one, other) => one.or(other),
    }
}

impl Only<'_> {
    /// The chosen copies, each once and in their order, with their numbers.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a number that no copy has, and for a mask of another length.
    pub(super) fn of<'p>(&self, placements: &'p [Placement]) -> Result<Vec<(u32, &'p Placement)>> {
        let copies = placements.len();
        let numbered = (0..).zip(placements);
        match self {
            Self::All => Ok(numbered.collect()),
            Self::Listed(list) => {
                if let Some(bad) = list.iter().find(|number| **number as usize >= copies) {
                    return Err(Error::invalid(
                        "only",
                        format!("expected numbers of the {copies} copies, got {bad}"),
                    ));
                }
                let mut chosen = vec![false; copies];
                for number in *list {
                    chosen[*number as usize] = true;
                }
                Ok(numbered.filter(|(number, _)| chosen[*number as usize]).collect())
            }
            Self::Masked(mask) => {
                if mask.len() != copies {
                    return Err(Error::invalid(
                        "only",
                        format!(
                            "expected one place for each of the {copies} copies, got {}",
                            mask.len()
                        ),
                    ));
                }
                Ok(numbered.filter(|(number, _)| mask[*number as usize]).collect())
            }
        }
    }
}

/// What the last drawing with a limit tells of a cluster, in the order of drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Last {
    Shown,
    /// It was not looked at.
    Unknown,
    Hidden,
}

/// A cluster of triangles that could be drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ranked {
    /// Its copy.
    pub(super) copy: u32,
    pub(super) triangles: u32,
    /// About how much of the view it takes, in any unit.
    pub(super) area: f32,
    pub(super) last: Last,
}

impl DrawOptions<'_> {
    /// Whether there is a limit.
    pub(super) fn is_limited(&self) -> bool {
        self.max_triangles.is_some() || self.max_copies.is_some()
    }

    /// Which clusters are drawn within the limits.
    ///
    /// Copies come first: those whose clusters take most of the view, in the order of [`Last`].
    /// Of their clusters those come first that take most of the view per triangle, until the next
    /// one would pass the limit.
    pub(super) fn within_limits(&self, clusters: &[Ranked]) -> Vec<bool> {
        let mut is_kept = vec![true; clusters.len()];
        // By `Last`, then large before small, then in the given order.
        let key = |last: Last, area: f32| (last, !area.to_bits());
        if let Some(most) = self.max_copies {
            let mut copies: Vec<(u32, Last, f32)> = Vec::new();
            for cluster in clusters {
                match copies.last_mut().filter(|copy| copy.0 == cluster.copy) {
                    Some(copy) => {
                        copy.1 = copy.1.min(cluster.last);
                        copy.2 += cluster.area;
                    }
                    None => copies.push((cluster.copy, cluster.last, cluster.area)),
                }
            }
            copies.sort_by_key(|(_, last, area)| key(*last, *area));
            copies.truncate(usize::try_from(most).unwrap_or(usize::MAX));
            let mut chosen: Vec<u32> = copies.iter().map(|copy| copy.0).collect();
            chosen.sort_unstable();
            for (is_kept, cluster) in is_kept.iter_mut().zip(clusters) {
                *is_kept = chosen.binary_search(&cluster.copy).is_ok();
            }
        }
        if let Some(most) = self.max_triangles {
            let mut order: Vec<usize> = (0..clusters.len()).filter(|i| is_kept[*i]).collect();
            let per_triangle = |c: &Ranked| c.area / c.triangles.max(1) as f32;
            order.sort_by_key(|i| key(clusters[*i].last, per_triangle(&clusters[*i])));
            let mut left = most;
            for i in order {
                let triangles = u64::from(clusters[i].triangles);
                is_kept[i] = triangles <= left;
                left = if is_kept[i] { left - triangles } else { 0 };
            }
        }
        is_kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLUSTERS: [Ranked; 6] = [
        Ranked { copy: 0, triangles: 10, area: 1.0, last: Last::Unknown },
        Ranked { copy: 0, triangles: 20, area: 5.0, last: Last::Unknown },
        Ranked { copy: 3, triangles: 30, area: 4.0, last: Last::Unknown },
        Ranked { copy: 4, triangles: 40, area: 2.0, last: Last::Shown },
        Ranked { copy: 4, triangles: 50, area: 9.0, last: Last::Unknown },
        Ranked { copy: 5, triangles: 60, area: 99.0, last: Last::Hidden },
    ];

    fn kept(max_triangles: Option<u64>, max_copies: Option<u64>) -> Vec<usize> {
        let options = DrawOptions { max_triangles, max_copies, ..DrawOptions::default() };
        let is_kept = options.within_limits(&CLUSTERS);
        (0..CLUSTERS.len()).filter(|i| is_kept[*i]).collect()
    }

    #[test]
    fn useful_and_large_clusters_come_first_and_hidden_ones_last() {
        assert_eq!(kept(None, None), [0, 1, 2, 3, 4, 5]);
        assert_eq!(kept(Some(0), None), [0; 0]);
        // 40 that have shown, then those that are largest per triangle.
        assert_eq!(kept(Some(39), None), [0; 0]);
        assert_eq!(kept(Some(59), None), [3]);
        assert_eq!(kept(Some(60), None), [1, 3]);
        assert_eq!(kept(Some(109), None), [1, 3]);
        assert_eq!(kept(Some(110), None), [1, 3, 4]);
        assert_eq!(kept(Some(140), None), [1, 2, 3, 4]);
        assert_eq!(kept(Some(209), None), [0, 1, 2, 3, 4]);
        assert_eq!(kept(Some(210), None), [0, 1, 2, 3, 4, 5]);
        // Copy 4 has shown, copy 0 takes 6 of the image, copy 3 takes 4, and copy 5 was hidden.
        assert_eq!(kept(None, Some(1)), [3, 4]);
        assert_eq!(kept(None, Some(2)), [0, 1, 3, 4]);
        assert_eq!(kept(None, Some(3)), [0, 1, 2, 3, 4]);
        assert_eq!(kept(Some(40), Some(2)), [3]);
    }
}
