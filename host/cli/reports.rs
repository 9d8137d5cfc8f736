//! Errors of the library crates as the command reports them.

use crate::words::{explain, refuse};
use miette::{IntoDiagnostic, Report};
use softdock_session::SessionError;

/// An error of a session with its remedy; of input files, all problems with their places.
pub(crate) fn session_failed(error: SessionError) -> Report {
    let remedy = error.remedy().map(str::to_owned);
    match (error, remedy) {
        (SessionError::Files(problems), _) => explain(problems),
        (error, Some(remedy)) => refuse(error, remedy),
        (error, None) => Err::<(), _>(error).into_diagnostic().expect_err("an error"),
    }
}
