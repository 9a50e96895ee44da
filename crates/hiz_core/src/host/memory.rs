//! Host memory whose size a caller decides.
//!
//! `Vec` alone would abort the process when memory runs out; here that is an error.

use crate::error::{Error, Result};

/// Reserves room for at least `more` elements.
///
/// Like [`Vec::reserve`] it may reserve extra room, so repeated calls stay cheap.
pub(crate) fn reserve<T>(vec: &mut Vec<T>, more: usize, what: &str) -> Result<()> {
    vec.try_reserve(more).map_err(|_| {
        Error::OutOfMemory(format!(
            "no host memory for {more} elements of {} bytes ({what})",
            size_of::<T>()
        ))
    })
}

/// An empty list with room for `len` elements.
pub(crate) fn list<T>(len: usize, what: &str) -> Result<Vec<T>> {
    let mut vec = Vec::new();
    reserve(&mut vec, len, what)?;
    Ok(vec)
}

/// The elements of an iterator of known length.
pub(crate) fn collected<T>(items: impl ExactSizeIterator<Item = T>, what: &str) -> Result<Vec<T>> {
    let mut vec = list(items.len(), what)?;
    vec.extend(items);
    Ok(vec)
}

/// A list of equal values.
pub(crate) fn filled<T: Clone>(len: usize, value: T, what: &str) -> Result<Vec<T>> {
    let mut vec = list(len, what)?;
    vec.resize(len, value);
    Ok(vec)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_has_is_an_error() {
        let error = list::<u64>(1 << 55, "texels").unwrap_err().to_string();
        assert_eq!(
            error,
            "out of memory: no host memory for 36028797018963968 elements of 8 bytes (texels)"
        );
        assert_eq!(collected([1, 2, 3].into_iter(), "numbers").unwrap(), [1, 2, 3]);
    }
}
