//! The free body.

use super::assert_nothing_found;
use softdock_gauntlet::Rig as Bench;

#[test]
fn null_recordings_give_no_effect() {
    assert_nothing_found(Bench::Body);
}
