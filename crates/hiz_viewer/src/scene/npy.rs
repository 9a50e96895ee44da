//! Arrays of `NumPy`'s file format, version 1: what the castle's data is unpacked to.

use std::path::Path;

use crate::Failure;

/// Numbers of an array in C order, whatever its dtype.
///
/// # Errors
/// For a file that is not there or is of another kind; the text names it.
pub(super) fn read(path: &Path) -> Result<Vec<f64>, Failure> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let wrong = |what: &str| format!("{}: {what}", path.display());
    if bytes.len() < 10 || !bytes.starts_with(b"\x93NUMPY\x01") {
        return Err(wrong("expected an .npy file of version 1").into());
    }
    let begin = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = String::from_utf8_lossy(bytes.get(10..begin).ok_or_else(|| wrong("cut off"))?);
    if header.contains("'fortran_order': True") {
        return Err(wrong("expected C order, got Fortran's").into());
    }
    let data = &bytes[begin..];
    let dtype = header.split('\'').nth(3).unwrap_or_default();
    Ok(match dtype {
        "<f4" => numbers(data, |b| f64::from(f32::from_le_bytes(b))),
        "<f8" => numbers(data, f64::from_le_bytes),
        "<i4" => numbers(data, |b| f64::from(i32::from_le_bytes(b))),
        "<u4" => numbers(data, |b| f64::from(u32::from_le_bytes(b))),
        "<i8" => numbers(data, |b| i64::from_le_bytes(b) as f64),
        _ => return Err(wrong(&format!("expected f4, f8, i4, u4 or i8, got {dtype:?}")).into()),
    })
}

fn numbers<const N: usize>(data: &[u8], number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    data.chunks_exact(N)
        .map(|bytes| number(bytes.try_into().expect("chunks have this length")))
        .collect()
}
