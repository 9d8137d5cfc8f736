//! ATI.
