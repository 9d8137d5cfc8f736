//! Empty: nothing of criterion is used, and its 30 crates are not compiled.
