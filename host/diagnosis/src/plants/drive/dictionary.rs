//! Dictionary of forms outside the catalogue, for unexplained residuals.

use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::{Hypothesis, Shelf};
use crate::model::unknown::{ParameterPrior, Role};
use crate::plants::drive::hypotheses::Spans;
use softdock_engine::blocks::BlockKind;

/// What a form may take of the torque where it is largest.
const SHARE: f64 = 0.3;

/// Returns the forms of a block; empty for blocks without a dictionary.
pub fn forms(block: &MeasuredBlock) -> Vec<Hypothesis> {
    let mut shelf = Shelf::of(block);
    if block.section.is(BlockKind::Drive) {
        drive(&mut shelf, &Spans::of(block));
    }
    shelf.all
}

fn drive(shelf: &mut Shelf, spans: &Spans) {
    let (v, q) = (spans.rate, spans.farthest);
    let torque = SHARE * spans.torque;
    let mut form = |field: &'static str, name: &'static str, largest: f64| {
        shelf.form(name, (field, ParameterPrior::Normal { mean: 0.0, sd: torque / largest }, Role::Size));
    };
    form("form_drag_square", "drag that grows with v |v|", v * v);
    form("form_drag_cube", "drag that grows with v^3", v * v * v);
    form("form_drag_even", "a torque that grows with v^2 whatever the direction", v * v);
    form("form_drag_slope", "drag that grows with q v", q * v);
    form("form_spring_square", "a torque that grows with q^2", q * q);
    form("form_spring_cube", "a torque that grows with q^3", q * q * q);
    form("form_friction_slope", "dry friction that grows with q", q);
    form("form_friction_square", "dry friction that grows with q^2", q * q);
    form("form_torque_square", "a torque deficit that grows with T |T|", spans.peak * spans.peak);
}
