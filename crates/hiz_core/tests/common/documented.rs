//! The tables of counts in `docs/accuracy_log.md`.
//! The tests that print them compare them with the page.

/// Whether the tests run on the driver that the page names.
/// On another driver nothing is compared: its guesses differ, and a few counts with them.
pub(crate) fn is_of_this_driver(engine: &hiz_core::headless::Engine) -> bool {
    let adapter = engine.adapter();
    // A name may continue on the page's next line.
    let text = page().split_whitespace().collect::<Vec<_>>().join(" ");
    [&adapter.name, &adapter.driver_info].iter().all(|part| text.contains(part.as_str()))
}

/// Asserts that the page has a line that begins like this.
///
/// # Panics
/// If it has none.
/// Then print the table again with the command on the page, and put it there.
pub(crate) fn assert_said(beginning: &str) {
    let is_there = page().lines().any(|line| line.starts_with(beginning));
    assert!(is_there, "no line of docs/accuracy_log.md begins with {beginning:?}");
}

fn page() -> &'static str {
    include_str!("../../../../docs/accuracy_log.md")
}
