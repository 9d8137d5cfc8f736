//! Interface of a session's operator: a terminal, a web page, a test.

use crate::answer::SessionAnswer;
use softdock_realtime::drive::controls::Controls;
use softdock_realtime::drive::feed::Samples;
use softdock_realtime::links::LinkNotice;
use softdock_realtime::process::Warning;
use softdock_realtime::view::model::Budgets;
use std::fmt;

/// Notice at the begin of a session.
#[derive(Debug)]
pub enum SessionNotice {
    /// A link reports at its opening.
    Link(LinkNotice),
    /// The operating system refuses a real-time right.
    Rights(Warning),
}

impl SessionNotice {
    /// Whether the notice is a warning.
    pub fn is_warning(&self) -> bool {
        match self {
            Self::Link(notice) => notice.is_warning(),
            Self::Rights(_) => true,
        }
    }
}

impl fmt::Display for SessionNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link(notice) => write!(f, "{notice}"),
            Self::Rights(warning) => write!(f, "warning: {warning}"),
        }
    }
}

/// An operator of a session. GO and stop go to the session's [`Controls`], from any thread.
pub trait Operator: Sync {
    /// Receives a notice at the begin of the session; called in the cycle's thread, before the first cycle.
    fn notice(&self, notice: &SessionNotice);

    /// Watches the session until it has ended ([`Controls::ended`]); called once, in the thread that runs the session.
    /// The session continues if this returns early.
    fn watch(&self, samples: Samples, budgets: Budgets, controls: &Controls);

    /// Receives the answer of a finished session; called in the cycle's thread, before [`Controls::ended`] holds.
    fn answered(&self, answer: &SessionAnswer);
}

/// An operator without output, for tests and programs that only need the answer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwatched;

impl Operator for Unwatched {
    fn notice(&self, _: &SessionNotice) {}

    fn watch(&self, _: Samples, _: Budgets, _: &Controls) {}

    fn answered(&self, _: &SessionAnswer) {}
}
