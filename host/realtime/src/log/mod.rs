//! The log of a drive: every signal of the loop, written beside the cycle and readable up to the last second.
