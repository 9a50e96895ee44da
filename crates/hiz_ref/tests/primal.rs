//! A second method that shares nothing with the oracle.
//! The oracle decides by certificates that separate two sides.
//! Here the same questions are decided by points that belong to both sides.
//! It works in whole numbers, for every pixel of small images.
//!
//! All numbers are small integers.
//! So degenerate cases (touching, parallel, flat, singular) are the rule.

mod common;

use common::Random;
use hiz_ref::{
    Arithmetic, Coverage, Options, OwnDepth, Verdict, View, Volume, classify_with, is_outside,
    is_unoccluded, touched_pixels,
};

/// `v . s + m >= 0`, in the volume's local coordinates.
#[derive(Clone, Copy)]
struct Plane {
    v: [i128; 3],
    m: i128,
}

/// A case in whole numbers.
/// In local coordinates world = center + axes s, with s in the cube or in the unit ball.
struct Case {
    rows: [[i128; 4]; 4],
    center: [i128; 3],
    /// `axes[k]` is half axis k.
    axes: [[i128; 3]; 3],
    ball: bool,
    size: [i128; 2],
    reversed: bool,
    /// Depths in eighths.
    depth: Vec<i128>,
}

impl Case {
    fn random(random: &mut Random) -> Case {
        let mut w = |n: i64| i128::from(random.whole(-n, n));
        let rows = match w(3) {
            // A pinhole like those of real cameras, an orthographic view, or anything.
            -3..=0 => {
                let (a, b) = (w(2).abs() + 1, w(2).abs() + 1);
                let z = if w(1) > 0 { [0, 0, 0, 1] } else { [0, 0, 1, -1] };
                [[a, 0, w(1), 0], [0, b, w(1), 0], z, [0, 0, 1, 0]]
            }
            1 => {
                let r = |w: &mut dyn FnMut(i64) -> i128| [w(2), w(2), w(2), w(2)];
                [r(&mut w), r(&mut w), r(&mut w), [0, 0, 0, w(2) + 3]]
            }
            _ => [0; 4].map(|_| [w(3), w(3), w(3), w(3)]),
        };
        let ball = w(1) >= 0;
        let axes = if ball {
            let r = w(3).abs();
            [[r, 0, 0], [0, r, 0], [0, 0, r]]
        } else if w(1) > 0 {
            [[w(3).abs(), 0, 0], [0, w(3).abs(), 0], [0, 0, w(3).abs()]]
        } else {
            [0; 3].map(|_| [w(2), w(2), w(2)])
        };
        let center = [w(6), w(6), w(6) + 3];
        let size = [w(2).abs() + 1, w(2).abs() + 1];
        let reversed = rows[2] == [0, 0, 0, 1];
        let usual = w(4) + 4;
        let pixels = (0..size[0] * size[1]).map(|_| if w(2) > 1 { w(4) + 4 } else { usual });
        Case { rows, center, axes, ball, size, reversed, depth: pixels.collect() }
    }

    /// The case as the oracle takes it.
    fn view(&self) -> View {
        View {
            rows: self.rows.map(|row| row.map(float)),
            origin: [0.0; 3],
            width: u32::try_from(self.size[0]).expect("small"),
            height: u32::try_from(self.size[1]).expect("small"),
            reversed: self.reversed,
        }
    }

    fn volume(&self) -> Volume {
        let center = self.center.map(float);
        let [x, y, z] = self.axes.map(|axis| axis.map(float));
        if self.ball {
            return Volume::Sphere { center, radius: x[0] };
        }
        let diagonal = [x[0], y[1], z[2]];
        let off: f64 = [x, y, z].as_flattened().iter().map(|a| a.abs()).sum();
        if diagonal.iter().all(|&d| d >= 0.0) && off == diagonal.iter().sum() {
            let corner = |sign: f64| [0, 1, 2].map(|k| center[k] + sign * diagonal[k]);
            return Volume::Box { min: corner(-1.0), max: corner(1.0) };
        }
        // Column k of the matrix is axis k; the factor 2 moves into the half sizes.
        Volume::OrientedBox {
            center,
            half_sizes: [2.0; 3],
            axes: [0, 1, 2].map(|i| [x[i] / 2.0, y[i] / 2.0, z[i] / 2.0]),
        }
    }

    /// `sum_r weights[r] * rows[r]` as a function of local coordinates.
    fn plane(&self, weights: [i128; 4]) -> Plane {
        let row: [i128; 4] =
            [0, 1, 2, 3].map(|c| (0..4).map(|r| weights[r] * self.rows[r][c]).sum());
        let along = |p: [i128; 3]| (0..3).map(|i| row[i] * p[i]).sum::<i128>();
        Plane { v: self.axes.map(along), m: along(self.center) + row[3] }
    }

    /// Planes of 0 <= z <= w and of a range of pixel coordinates, given in halves.
    fn frustum(&self, [left, right]: [i128; 2], [top, bottom]: [i128; 2]) -> Vec<Plane> {
        let [width, height] = self.size;
        [
            [width, 0, 0, width - left],
            [-width, 0, 0, right - width],
            [0, -height, 0, height - top],
            [0, height, 0, bottom - height],
            [0, 0, 1, 0],
            [0, 0, -1, 1],
        ]
        .map(|weights| self.plane(weights))
        .to_vec()
    }

    fn meets(&self, mut planes: Vec<Plane>) -> bool {
        if self.ball {
            return ball_meets(&planes);
        }
        for k in 0..3 {
            for sign in [-1, 1] {
                let mut v = [0; 3];
                v[k] = sign;
                planes.push(Plane { v, m: 1 });
            }
        }
        polytope_is_not_empty(&planes)
    }

    /// Points that are not farther than a depth (in eighths).
    fn before(&self, depth: i128) -> Plane {
        self.plane(if self.reversed { [0, 0, 8, -depth] } else { [0, 0, -8, depth] })
    }

    /// Whether a depth (in eighths) is nearer than every point.
    fn is_hidden_by(&self, depth: i128) -> bool {
        let plane = if self.reversed {
            self.plane([0, 0, -8, depth])
        } else {
            self.plane([0, 0, 8, -depth])
        };
        self.is_positive(plane)
    }

    /// Whether every point is nearer than a depth (in eighths).
    fn is_before(&self, depth: i128) -> bool {
        self.is_positive(if self.reversed {
            self.plane([0, 0, 8, -depth])
        } else {
            self.plane([0, 0, -8, depth])
        })
    }

    /// Whether every point is strictly inside the frustum.
    fn is_inside(&self) -> bool {
        let image = self.size.map(|side| [0, 2 * side]);
        self.frustum(image[0], image[1]).into_iter().all(|plane| self.is_positive(plane))
    }

    /// Whether a plane is positive at every point.
    fn is_positive(&self, plane: Plane) -> bool {
        if self.ball {
            return plane.m > 0 && plane.m * plane.m > dot(plane.v, plane.v);
        }
        (0..8).all(|corner| {
            let sign = |k: usize| if corner >> k & 1 == 0 { -1 } else { 1 };
            plane.m + (0..3).map(|k| sign(k) * plane.v[k]).sum::<i128>() > 0
        })
    }
}

fn float(x: i128) -> f64 {
    f64::from(i32::try_from(x).expect("small"))
}

fn dot(a: [i128; 3], b: [i128; 3]) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn det([a, b, c]: [[i128; 3]; 3]) -> i128 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// Solves `matrix x = right` by Cramer's rule: numerators and a positive denominator.
fn solve(matrix: [[i128; 3]; 3], right: [i128; 3]) -> Option<([i128; 3], i128)> {
    let denominator = det(matrix);
    if denominator == 0 {
        return None;
    }
    let numerator = |k: usize| {
        let mut replaced = matrix;
        for i in 0..3 {
            replaced[i][k] = right[i];
        }
        det(replaced) * denominator.signum()
    };
    Some(([0, 1, 2].map(numerator), denominator.abs()))
}

fn satisfies(planes: &[Plane], (x, d): ([i128; 3], i128)) -> bool {
    planes.iter().all(|plane| dot(plane.v, x) + plane.m * d >= 0)
}

/// A bounded polytope is not empty if three of its planes meet in one of its points.
fn polytope_is_not_empty(planes: &[Plane]) -> bool {
    let n = planes.len();
    (0..n).any(|i| {
        (i + 1..n).any(|j| {
            (j + 1..n).any(|l| {
                let [a, b, c] = [planes[i], planes[j], planes[l]];
                solve([a.v, b.v, c.v], [-a.m, -b.m, -c.m])
                    .is_some_and(|point| satisfies(planes, point))
            })
        })
    })
}

/// Whether the unit ball meets the polytope.
/// Its point nearest to the centre is the centre, or the centre projected onto one to three planes.
/// Tries all of these that are inside.
fn ball_meets(planes: &[Plane]) -> bool {
    let close = |(x, d): ([i128; 3], i128)| dot(x, x) <= d * d && satisfies(planes, (x, d));
    if close(([0; 3], 1)) {
        return true;
    }
    let n = planes.len();
    (0..n).any(|i| {
        let a = planes[i];
        let square = dot(a.v, a.v);
        if square > 0 && close((a.v.map(|v| -v * a.m), square)) {
            return true;
        }
        (i + 1..n).any(|j| {
            let b = planes[j];
            // The foot is in both planes.
            // It is also in the plane through the centre that their normals span.
            let across = [
                a.v[1] * b.v[2] - a.v[2] * b.v[1],
                a.v[2] * b.v[0] - a.v[0] * b.v[2],
                a.v[0] * b.v[1] - a.v[1] * b.v[0],
            ];
            if solve([a.v, b.v, across], [-a.m, -b.m, 0]).is_some_and(close) {
                return true;
            }
            planes[j + 1..]
                .iter()
                .any(|c| solve([a.v, b.v, c.v], [-a.m, -b.m, -c.m]).is_some_and(close))
        })
    })
}

#[test]
fn certificates_and_points_agree() {
    let mut random = Random(1);
    let mut tally = std::collections::BTreeMap::new();
    let mut gained = 0;
    for number in 0..20_000 {
        let case = Case::random(&mut random);
        let (view, volume) = (case.view(), case.volume());
        let depth: Vec<f32> = case.depth.iter().map(|&d| float(d) as f32 / 8.0).collect();
        for coverage in [Coverage::Area, Coverage::Sample] {
            let inset = i128::from(coverage == Coverage::Sample);
            let far = if case.reversed { 0 } else { 8 };
            let (mut touched, mut visible, mut open) = (Vec::new(), false, Vec::new());
            let mut unoccluded = case.is_inside();
            for y in 0..case.size[1] {
                for x in 0..case.size[0] {
                    let edges = |i: i128| [2 * i + inset, 2 * i + 2 - inset];
                    if case.meets(case.frustum(edges(x), edges(y))) {
                        touched.push([x as u32, y as u32]);
                        let pixel = case.depth[(y * case.size[0] + x) as usize];
                        visible |= pixel == far || !case.is_hidden_by(pixel);
                        unoccluded &= pixel == far || case.is_before(pixel);
                        let mut planes = case.frustum(edges(x), edges(y));
                        planes.push(case.before(pixel));
                        if pixel == far || case.meets(planes) {
                            open.push([x as u32, y as u32]);
                        }
                    }
                }
            }
            let expected = if visible { Verdict::Visible } else { Verdict::Hidden };
            let name = || format!("case {number}, {coverage:?}: {view:?} {volume:?} {depth:?}");
            let found = touched_pixels(&view, &volume, coverage).expect("valid");
            assert_eq!(found, touched, "{}", name());
            let outside = touched.is_empty();
            let answer = is_unoccluded(&view, &volume, &depth, coverage);
            assert_eq!(answer, Ok(unoccluded), "{}", name());
            assert!(!unoccluded || !outside || coverage == Coverage::Sample, "{}", name());
            *tally
                .entry((format!("{coverage:?} unoccluded {unoccluded}"), outside))
                .or_insert(0) += 1;
            if coverage == Coverage::Area {
                assert_eq!(is_outside(&view, &volume), Ok(outside), "{}", name());
            }
            let modes = [Arithmetic::Escalate, Arithmetic::Exact, Arithmetic::Float];
            for arithmetic in modes {
                // The slowest arithmetic is tried in one case of 16.
                if arithmetic == Arithmetic::Exact && number % 16 != 0 {
                    continue;
                }
                let options = Options { arithmetic, coverage, own_depth: OwnDepth::Nearest };
                let outcome = classify_with(&view, &volume, &depth, options).expect("valid");
                if outcome.verdict != Verdict::Undecided {
                    assert_eq!(outcome.verdict, expected, "{arithmetic:?} {}", name());
                }
                if let Some([x, y]) = outcome.witness {
                    let pixel = case.depth[(y * view.width + x) as usize];
                    assert!(touched.contains(&[x, y]), "{}", name());
                    assert!(pixel == far || !case.is_hidden_by(pixel), "{}", name());
                }
                let key = (format!("{coverage:?} {arithmetic:?} {:?}", outcome.verdict), outside);
                *tally.entry(key).or_insert(0) += 1;

                let options = Options { arithmetic, coverage, own_depth: OwnDepth::PerPixel };
                let outcome = classify_with(&view, &volume, &depth, options).expect("valid");
                if outcome.verdict != Verdict::Undecided {
                    let expected = if open.is_empty() { Verdict::Hidden } else { Verdict::Visible };
                    assert_eq!(
                        outcome.verdict,
                        expected,
                        "{arithmetic:?}, own depth in a pixel, {}",
                        name()
                    );
                }
                if let Some(witness) = outcome.witness {
                    assert!(open.contains(&witness), "{}", name());
                }
                gained += usize::from(visible && open.is_empty());
            }
        }
    }
    println!("{tally:#?}, hidden only by their own depth in each pixel: {gained}");
    assert!(gained > 1000, "{gained}");
    // The cases prove something only if every kind of answer is among them.
    for (verdict, outside) in [("Visible", false), ("Hidden", false), ("Hidden", true)] {
        let count = tally[&(format!("Area Escalate {verdict}"), outside)];
        assert!(count > 1000, "{verdict} {outside}: {count}");
    }
}

/// Small volumes before a pinhole, in images with a few touched pixels.
/// Many are unoccluded, and many fail by one plane or one pixel.
#[test]
fn certificates_and_points_agree_on_what_is_unoccluded() {
    let mut random = Random(2);
    let mut tally = std::collections::BTreeMap::new();
    for number in 0..20_000 {
        let mut case = Case::random(&mut random);
        let mut w = |n: i64| i128::from(random.whole(-n, n));
        case.reversed = w(1) > 0;
        let z = if case.reversed { [0, 0, 0, 1] } else { [0, 0, 1, -1] };
        case.rows = [[1, 0, 0, 0], [0, 1, 0, 0], z, [0, 0, 1, 0]];
        let r = w(1).abs();
        case.axes = if case.ball || w(1) > 0 {
            [[r, 0, 0], [0, r, 0], [0, 0, r]]
        } else {
            [[w(1), 1, 0], [w(1), w(1), 0], [0, 0, w(1)]]
        };
        case.center = [w(3), w(3), w(2) + 4];
        case.size = [w(2).abs() + 1, w(2).abs() + 1];
        let (near, far) = if case.reversed { (8, 0) } else { (0, 8) };
        let between = case.size[0] * case.size[1];
        case.depth = (0..between)
            .map(|_| match w(4) {
                -4 => near,
                -3 | -2 => far,
                _ => (7 * far + near) / 8 + if case.reversed { w(1).abs() } else { -w(1).abs() },
            })
            .collect();
        let (view, volume) = (case.view(), case.volume());
        let depth: Vec<f32> = case.depth.iter().map(|&d| float(d) as f32 / 8.0).collect();
        for coverage in [Coverage::Area, Coverage::Sample] {
            let inset = i128::from(coverage == Coverage::Sample);
            let is_inside = case.is_inside();
            let mut covering = 0;
            for y in 0..case.size[1] {
                for x in 0..case.size[0] {
                    let edges = |i: i128| [2 * i + inset, 2 * i + 2 - inset];
                    let pixel = case.depth[(y * case.size[0] + x) as usize];
                    if pixel != far && !case.is_before(pixel) {
                        covering += usize::from(case.meets(case.frustum(edges(x), edges(y))));
                    }
                }
            }
            let answer = is_unoccluded(&view, &volume, &depth, coverage).expect("valid");
            let name = || format!("case {number}, {coverage:?}: {view:?} {volume:?} {depth:?}");
            assert_eq!(answer, is_inside && covering == 0, "{}", name());
            *tally.entry((format!("{coverage:?}"), is_inside, covering.min(2))).or_insert(0) += 1;
        }
    }
    println!("coverage, inside, pixels in the way (2: or more): {tally:#?}");
    for coverage in ["Area", "Sample"] {
        for covering in 0..2 {
            let count = tally[&(coverage.to_owned(), true, covering)];
            assert!(count > 100, "{coverage} {covering}: {count}");
        }
    }
}
