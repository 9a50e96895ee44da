//! Tables of `docs/accuracy_log.md` that are counts: the tests that print them hold them against
//! the page.

/// Nothing is compared on another driver than the one that the page names: its guesses are others,
/// and a few counts with them.
pub(crate) fn is_of_this_driver(engine: &hiz_core::headless::Engine) -> bool {
    let adapter = engine.adapter();
    // A name may go on in the page's next line.
    let text = page().split_whitespace().collect::<Vec<_>>().join(" ");
    [&adapter.name, &adapter.driver_info].iter().all(|part| text.contains(part.as_str()))
}

/// That the page has a line that begins so.
///
/// # Panics
/// Where it has none: print the table again (the page says by which command) and put it there.
pub(crate) fn assert_said(beginning: &str) {
    let is_there = page().lines().any(|line| line.starts_with(beginning));
    assert!(is_there, "no line of docs/accuracy_log.md begins with {beginning:?}");
}

fn page() -> &'static str {
    include_str!("../../../../docs/accuracy_log.md")
}
