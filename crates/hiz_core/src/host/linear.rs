//! Algebra of 3-vectors and of 3x3 and 4x4 matrices in float64.
//!
//! Small functions are `#[inline]`: loops over pixels and instances in other rooms call them.

/// A 3-vector of float64.
pub type Vec3 = [f64; 3];
/// A row-major 3x3 matrix of float64 for column vectors.
pub type Mat3 = [[f64; 3]; 3];
/// A row-major 4x4 matrix of float64 for column vectors.
pub type Mat4 = [[f64; 4]; 4];

#[inline]
pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The unit vector along `v`; `None` for a vector that is zero or not finite.
///
/// `v` is scaled by its largest coordinate first, so that no square overflows or underflows.
#[inline]
pub(crate) fn normalized(v: Vec3) -> Option<Vec3> {
    let largest = v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let v = v.map(|x| x / largest);
    let length = dot(v, v).sqrt();
    Some(v.map(|x| x / length))
}

/// The solution of `m x = b`; `None` where the rows are linearly dependent or nearly so.
pub(crate) fn solve3(m: &Mat3, b: Vec3) -> Option<Vec3> {
    let inverse = inverse3(m)?;
    let x = mul3(&inverse, b);
    x.iter().all(|v| v.is_finite()).then_some(x)
}

#[inline]
pub(crate) fn mul3(m: &Mat3, v: Vec3) -> Vec3 {
    m.map(|row| dot(row, v))
}

/// The inverse by cofactors; `None` where the rows are linearly dependent or nearly so.
///
/// The rows are scaled to length 1 first, so that the threshold for singularity has no units.
pub(crate) fn inverse3(m: &Mat3) -> Option<Mat3> {
    let mut unit = [[0.0; 3]; 3];
    let mut length = [0.0; 3];
    for i in 0..3 {
        unit[i] = normalized(m[i])?;
        let along = m[i].iter().zip(&unit[i]).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        length[i] = along.0 / along.1;
    }
    let columns = [cross(unit[1], unit[2]), cross(unit[2], unit[0]), cross(unit[0], unit[1])];
    let determinant = dot(unit[0], columns[0]);
    if determinant.abs() < 1e-12 {
        return None;
    }
    Some(std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i] / determinant / length[j])))
}
