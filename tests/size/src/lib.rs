//! The two sizes of a slow test: short in `tests/run.sh`, full in `tests/run.sh --full`.
//!
//! `CONTRIBUTING.md` lists every test that has two sizes.

/// Whether the full size is asked for: the environment variable `SOFTDOCK_FULL` is set, as `tests/run.sh --full` does.
pub fn is_full() -> bool {
    std::env::var_os("SOFTDOCK_FULL").is_some()
}

/// Selects the size of a slow test.
pub fn sized<T>(short: T, full: T) -> T {
    if is_full() { full } else { short }
}

/// Selects the cases of a slow test: the first `short` of them, or all in the full size.
///
/// Put the case first that fails soonest when the property breaks.
pub fn first<T>(short: usize, cases: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
    cases.into_iter().take(sized(short, usize::MAX))
}
