//! The free body.

use super::assert_nothing_found;
use softdock_gauntlet::Rig as Bench;

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    assert_nothing_found(Bench::Body);
}
