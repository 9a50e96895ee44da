//! Twins: what the shaders and this crate both say is compared, number by number and struct by
//! struct.
//! The lists are complete: a constant, a struct or an entry point of a shader that is in none of
//! them fails a test.

mod constants;
mod structs;

/// The names that a file declares by `keyword`.
fn declared<'a>(text: &'a str, keyword: &str) -> impl Iterator<Item = &'a str> {
    text.lines()
        .filter_map(move |line| line.strip_prefix(keyword))
        .filter_map(|rest| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next())
}
