//! The Morton order, in which instances are stored.
//! Instances that lie together in space then lie together in memory.
//!
//! Source: Morton, "A computer oriented geodetic data base and a new technique in file sequencing",
//! IBM, 1966.
//!
//! The curve runs through cubes that are nested in one another.
//! Each instance has its key in the smallest cube that holds its centre.
//! The innermost cube comes from a sample of the centres, and each cube is 8 times as large as the
//! one inside it.
//! So an outlier does not coarsen the cells of the others.
//! An instance a million times as far away as all others lies in an outer cube of its own.

use std::ops::Range;

use crate::error::Result;
use crate::host::memory;
use crate::host::threads::{cores, on_threads};
use crate::input::bounds::Bounds;
use crate::instances::keys::Cube;

/// The most keys that are sampled to split the curve into parts.
const SAMPLES: usize = 4096;

/// From this many instances on, more threads help to sort.
/// One takes tens of microseconds to start, and sorting them takes milliseconds.
const PARALLEL_FROM: usize = 1 << 15;

/// The most parts that are sorted at the same time.
const MOST_PARTS: usize = 16;

/// Instances whose keys one thread computes at a time.
const KEYED_AT_A_TIME: usize = 1 << 13;

/// Words whose order one thread settles at a time.
const SETTLED_AT_A_TIME: usize = 1 << 11;

/// What is sorted is a word: the 40 highest bits of a key, above the index of the instance.
/// A piece has at most 2^24 instances.
const INDEX_BITS: u32 = 24;

/// The instances of `range` along the curve, as indices relative to its start.
///
/// Instances with equal keys keep the caller's order, and invalid bounds come last.
/// So the order is the same on every machine, for any number of threads.
///
/// Every thread sorts one interval of the curve, which a sample of the keys makes about as long as
/// the others.
/// Then words that are equal are settled by the rest of their keys.
pub(crate) fn order(bounds: &Bounds<'_>, range: Range<usize>) -> Result<Vec<u32>> {
    let cube = Cube::new(bounds, &range)?;
    let key = |index: usize| cube.key_of(bounds, range.start + index);
    let threads = if range.len() < PARALLEL_FROM { 1 } else { cores().min(MOST_PARTS) };
    let starts = starts(range.len(), key, threads)?;
    let mut words = memory::list(range.len(), "order")?;
    words.resize(range.len(), 0);
    let mut ends = memory::list(range.len().div_ceil(KEYED_AT_A_TIME), "order")?;
    ends.resize(range.len().div_ceil(KEYED_AT_A_TIME), [0; MOST_PARTS]);
    let chunks = words.chunks_mut(KEYED_AT_A_TIME).zip(&mut ends).enumerate();
    on_threads(threads, chunks, |(chunk, (words, ends)): (_, (&mut [u64], &mut Ends))| {
        let first = chunk * KEYED_AT_A_TIME;
        let mut scratch = [0; KEYED_AT_A_TIME];
        let keyed = &mut scratch[..words.len()];
        cube.keys(bounds, range.start + first, keyed);
        for (index, word) in (first..).zip(&mut *keyed) {
            *word = *word >> INDEX_BITS << INDEX_BITS | index as u64;
        }
        *ends = group(keyed, &starts, words);
    });
    let mut sorted: Vec<Result<Vec<u64>>> = (0..threads).map(|_| Ok(Vec::new())).collect();
    on_threads(threads, sorted.iter_mut().enumerate(), |(part, sorted)| {
        *sorted = words_of(&words, &ends, part).and_then(sort_part);
    });
    drop((words, ends));
    let mut sorted = sorted.into_iter().collect::<Result<Vec<_>>>()?;
    let mut order = memory::list(range.len(), "order")?;
    order.resize(range.len(), 0);
    // Equal words may all be in one part, so parts are cut anew.
    let chunks = chunks_of_runs(&mut sorted, &mut order)?;
    on_threads(threads, chunks, |(words, indices)| {
        settle_equal_words(words, key);
        for (index, word) in indices.iter_mut().zip(words) {
            *index = index_of(*word) as u32;
        }
    });
    Ok(order)
}

fn index_of(word: u64) -> usize {
    (word & ((1 << INDEX_BITS) - 1)) as usize
}

/// Where the words of each part end in a chunk.
type Ends = [u32; MOST_PARTS];

/// The least word of each part but the first, by a sample of the keys.
/// Words with one key are in one part.
fn starts(count: usize, key: impl Fn(usize) -> u64, parts: usize) -> Result<Vec<u64>> {
    if parts == 1 {
        return Ok(Vec::new());
    }
    let step = count.div_ceil(SAMPLES).max(1);
    let mut sample = memory::list(SAMPLES, "order")?;
    sample.extend((0..count).step_by(step).map(|index| key(index) >> INDEX_BITS << INDEX_BITS));
    sample.sort_unstable();
    Ok((1..parts).map(|k| sample[k * sample.len() / parts]).collect())
}

/// Writes the words of a chunk to `to`, part by part, and otherwise in their order.
fn group(words: &[u64], starts: &[u64], to: &mut [u64]) -> Ends {
    let mut ends = [0; MOST_PARTS];
    if starts.is_empty() {
        to.copy_from_slice(words);
        ends[0] = words.len() as u32;
        return ends;
    }
    let mut filled = 0;
    for (part, end) in ends.iter_mut().enumerate().take(starts.len() + 1) {
        let start = if part == 0 { 0 } else { starts[part - 1] };
        let is_last = part == starts.len();
        let next = if is_last { u64::MAX } else { starts[part] };
        for word in words {
            // Without a branch that no processor could predict.
            // What is not of this part is overwritten by the next word.
            let Some(slot) = to.get_mut(filled) else { break };
            *slot = *word;
            filled += usize::from((start <= *word) & ((*word < next) | is_last));
        }
        *end = filled as u32;
    }
    ends
}

/// The words of a part, of all chunks.
fn words_of(words: &[u64], ends: &[Ends], part: usize) -> Result<Vec<u64>> {
    let here = |ends: &Ends| if part == 0 { 0 } else { ends[part - 1] }..ends[part];
    let count = ends.iter().map(|ends| here(ends).len()).sum();
    let mut mine = memory::list(count, "order")?;
    for (words, ends) in words.chunks(KEYED_AT_A_TIME).zip(ends) {
        let here = here(ends);
        mine.extend_from_slice(&words[here.start as usize..here.end as usize]);
    }
    Ok(mine)
}

/// Sorts the words of a part; the indices of equal keys ascend already.
fn sort_part(mut mine: Vec<u64>) -> Result<Vec<u64>> {
    let mut spare = memory::collected(mine.iter().copied(), "order")?;
    radix_sort(&mut mine, &mut spare);
    Ok(mine)
}

/// Whether two words have the same bits of their keys.
fn are_equal(a: u64, b: u64) -> bool {
    a >> INDEX_BITS == b >> INDEX_BITS
}

/// Sorted words, and what becomes of them: the indices in order.
type Chunk<'a> = (&'a mut [u64], &'a mut [u32]);

/// All words in chunks that part no equal ones.
fn chunks_of_runs<'a>(sorted: &'a mut [Vec<u64>], order: &'a mut [u32]) -> Result<Vec<Chunk<'a>>> {
    let most = sorted.iter().map(|part| part.len().div_ceil(SETTLED_AT_A_TIME)).sum();
    let mut chunks = memory::list(most, "order")?;
    let mut indices = order;
    for part in sorted {
        let mut words = &mut part[..];
        while !words.is_empty() {
            let mut end = words.len().min(SETTLED_AT_A_TIME);
            while end < words.len() && are_equal(words[end - 1], words[end]) {
                end += 1;
            }
            let (own, behind) = words.split_at_mut(end);
            let (own_indices, indices_behind) = indices.split_at_mut(end);
            chunks.push((own, own_indices));
            (words, indices) = (behind, indices_behind);
        }
    }
    Ok(chunks)
}

/// Sorts equal words by the whole keys of their instances.
fn settle_equal_words(words: &mut [u64], key: impl Fn(usize) -> u64) {
    for run in words.chunk_by_mut(|a, b| are_equal(*a, *b)) {
        if run.len() > 1 {
            // The rest of the keys decides; the indices of equal keys ascend.
            run.sort_by_cached_key(|word| key(index_of(*word)));
        }
    }
}

const DIGIT_BITS: u32 = 10;
const DIGITS: usize = ((64 - INDEX_BITS) / DIGIT_BITS) as usize;

fn digit(word: u64, place: usize) -> usize {
    (word >> (INDEX_BITS + place as u32 * DIGIT_BITS) & ((1 << DIGIT_BITS) - 1)) as usize
}

/// Sorts by the bits above the index, least significant digit first; the sort is stable.
/// Digits in which all words agree are skipped.
fn radix_sort(words: &mut [u64], spare: &mut [u64]) {
    let mut counts = [[0_u32; 1 << DIGIT_BITS]; DIGITS];
    for word in words.iter() {
        for (place, counts) in counts.iter_mut().enumerate() {
            counts[digit(*word, place)] += 1;
        }
    }
    let (mut from, mut to) = (words, spare);
    let mut swapped = false;
    for (place, counts) in counts.iter_mut().enumerate() {
        if counts.iter().any(|c| *c as usize == from.len()) {
            continue;
        }
        let mut begin = 0;
        for count in counts.iter_mut() {
            begin += std::mem::replace(count, begin);
        }
        for word in from.iter() {
            let slot = &mut counts[digit(*word, place)];
            to[*slot as usize] = *word;
            *slot += 1;
        }
        std::mem::swap(&mut from, &mut to);
        swapped = !swapped;
    }
    if swapped {
        to.copy_from_slice(from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::random::Random;
    use crate::input::bounds::Floats;
    use crate::instances::keys::INVALID;

    fn order_of(centers: &[f64]) -> Vec<u32> {
        let n = centers.len() / 3;
        let radii = vec![0.5; n];
        order(&Bounds::Spheres { centers: Floats::F64(centers), radii: Floats::F64(&radii) }, 0..n)
            .unwrap()
    }

    fn assert_is_permutation(order: &[u32]) {
        let mut seen = vec![false; order.len()];
        for i in order {
            assert!(!std::mem::replace(&mut seen[*i as usize], true), "{i} twice");
        }
    }

    #[test]
    fn every_input_gives_a_permutation() {
        assert_eq!(order_of(&[]), [0_u32; 0]);
        assert_eq!(order_of(&[1.0, 2.0, 3.0]), [0]);
        for special in
            [0.0, 1.0, f64::NAN, f64::INFINITY, -1e300, f64::MAX, 1e30, -5e-324, 2.0_f64.powi(60)]
        {
            for n in [2, 63, 64, 1000, PARALLEL_FROM + 1] {
                // All instances have the special centre, then every seventh.
                let same = vec![special; 3 * n];
                assert_eq!(
                    order_of(&same),
                    (0..n as u32).collect::<Vec<_>>(),
                    "{special} {n}: equal keys keep their order"
                );
                let mut random = Random(n as u64);
                let centers: Vec<_> = (0..3 * n)
                    .map(|i| if i % 21 < 3 { special } else { random.unit() - 0.5 })
                    .collect();
                assert_is_permutation(&order_of(&centers));
                assert_eq!(order_of(&centers), order_of(&centers), "the same from every run");
            }
        }
    }

    #[test]
    fn what_is_no_volume_comes_last_in_its_order() {
        let centers = [[9.0; 3], [f64::NAN; 3], [0.0; 3], [f64::INFINITY; 3], [3.0; 3]].concat();
        assert_eq!(order_of(&centers)[3..], [1, 3]);
        let radii = [0.5, 0.5, -1.0, 0.5, f64::NAN];
        let bounds =
            Bounds::Spheres { centers: Floats::F64(&[0.0; 15]), radii: Floats::F64(&radii) };
        assert_eq!(order(&bounds, 0..5).unwrap(), [0, 1, 3, 2, 4]);
        assert_eq!(order(&bounds, 2..5).unwrap(), [1, 0, 2], "relative to the range's start");
    }

    /// Centres far apart, on a line so that many have their 40 highest bits in common, and in few
    /// places.
    #[test]
    fn the_order_is_that_of_the_whole_keys() {
        let n = PARALLEL_FROM + 77;
        for (step, size, axes) in [(1.0, 16.0, 3), (1e-7, 1e3, 3), (1e-3, 1e6, 3), (1e-3, 1e6, 1)] {
            let mut random = Random(5);
            let mut number = |i: usize| {
                let v = step * (random.unit() * size).floor();
                if i % 3 < axes { v } else { 0.0 }
            };
            let mut centers: Vec<_> = (0..3 * n).map(&mut number).collect();
            centers[..3].fill(1e4);
            let radii = vec![0.0; n];
            let bounds =
                Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
            let cube = Cube::new(&bounds, &(0..n)).unwrap();
            let key = |i: u32| cube.key(std::array::from_fn(|k| centers[3 * i as usize + k]));
            let mut expected: Vec<_> = (0..n as u32).collect();
            expected.sort_by_key(|i| key(*i));
            // Not `assert_eq`, which would print all of them.
            assert!(order(&bounds, 0..n).unwrap() == expected, "{step} {size}");
            let alike = expected.windows(2).filter(|pair| {
                let [a, b] = [key(pair[0]), key(pair[1])];
                a != b && a >> INDEX_BITS == b >> INDEX_BITS
            });
            assert!(axes == 3 || alike.count() > 1000, "{step} {size}");
        }
    }

    #[test]
    fn any_number_of_parts_gives_the_same_order() {
        let key = |i: usize| (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20 << 18;
        let n = 3 * KEYED_AT_A_TIME + 77;
        let words: Vec<u64> =
            (0..n).map(|i| key(i) >> INDEX_BITS << INDEX_BITS | i as u64).collect();
        let sorted = |words| {
            let mut sorted = sort_part(words).unwrap();
            settle_equal_words(&mut sorted, key);
            sorted
        };
        let whole = sorted(words.clone());
        assert!(whole.is_sorted_by_key(|w| (key(index_of(*w)), index_of(*w))));
        for parts in [1, 2, 3, 7, 16] {
            let starts = starts(n, key, parts).unwrap();
            let mut grouped = vec![0; n];
            let chunks = words.chunks(KEYED_AT_A_TIME).zip(grouped.chunks_mut(KEYED_AT_A_TIME));
            let ends: Vec<_> = chunks.map(|(words, to)| group(words, &starts, to)).collect();
            let part = |k| sorted(words_of(&grouped, &ends, k).unwrap());
            let joined: Vec<u64> = (0..parts).flat_map(part).collect();
            assert!(joined == whole, "{parts} parts");
        }
        // Words that begin a part, or are the greatest, belong to one part alone.
        let words = [5 << INDEX_BITS, u64::MAX, 9 << INDEX_BITS, 0, 9 << INDEX_BITS | 7];
        let mut grouped = [1; 5];
        let ends = group(&words, &[5 << INDEX_BITS, 9 << INDEX_BITS], &mut grouped);
        assert_eq!(grouped, [words[3], words[0], words[1], words[2], words[4]]);
        assert_eq!(ends[..3], [1, 2, 5]);
    }

    /// The order of a curve through 8 cells, written out.
    #[test]
    fn keys_follow_the_z_of_morton() {
        let cube = Cube { center: [0.0; 3], per_half_size: 1.0 };
        let corners = |scale: f64| {
            (0..8).map(move |i| {
                [i & 4, i & 2, i & 1].map(|bit| if bit == 0 { -0.5 * scale } else { 0.5 * scale })
            })
        };
        for scale in [1.0, 4.0, 32.0, 1e20] {
            let keys: Vec<_> = corners(scale).map(|c| cube.key(c)).collect();
            assert!(keys.is_sorted() && keys[7] < INVALID, "{scale}: {keys:?}");
        }
        assert!(cube.key([0.9; 3]) < cube.key([-1.5; 3]), "the inner cube comes first");
    }

    /// The cube root of the volume of the box around a group's centres.
    /// Returns the median over all groups of 64.
    fn mean_size(centers: &[f64], order: &[u32]) -> f64 {
        let sizes = order.chunks(64).map(|group| {
            let axis = |k: usize| {
                let values = group.iter().map(|i| centers[3 * *i as usize + k]);
                values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
            };
            (axis(0) * axis(1) * axis(2)).cbrt()
        });
        let sizes: Vec<_> = sizes.collect();
        // The median, because a group with an outlier is as large as the outlier is far.
        let mut sorted = sizes;
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    }

    /// Clusters, first without and then with outliers.
    /// The instances were made in random order.
    #[test]
    fn groups_are_small_with_and_without_outliers() {
        let mut random = Random(77);
        let homes: Vec<[f64; 3]> =
            (0..20).map(|_| std::array::from_fn(|_| 1000.0 * random.unit())).collect();
        let n = 40_000;
        let mut centers: Vec<f64> = (0..n)
            .flat_map(|_| {
                let home = homes[(random.unit() * 20.0) as usize];
                home.map(|h| h + 20.0 * random.unit())
            })
            .collect();
        let given: Vec<_> = (0..n as u32).collect();
        let (random_order, sorted) =
            (mean_size(&centers, &given), mean_size(&centers, &order_of(&centers)));
        assert!(sorted < random_order / 100.0, "{sorted} against {random_order}");
        for far in [1e5, 1e9, 1e17] {
            for i in (0..n).step_by(100) {
                for k in 0..3 {
                    centers[3 * i + k] = far * (random.unit() - 0.5);
                }
            }
            let with_outliers = mean_size(&centers, &order_of(&centers));
            assert!(with_outliers < 1.2 * sorted, "{far}: {with_outliers} against {sorted}");
        }
    }
}
