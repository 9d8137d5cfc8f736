//! Parts that overlap at the start: refused where every run would be invalid at once.

use crate::check::Checker;
use crate::written::scenario::ScenarioFile;
use softdock_kernels::contact::overlap::{Overlap, deepest_overlap, retreat, start_parts};
use softdock_kernels::model::{Model, Side};
use softdock_kernels::plant::{Plant, PointSource};
use softdock_kernels::range::LENGTH;

/// Steps in which a gap is proposed \[m\].
const GAP_STEP: f64 = 1e-4;

/// Share of a step by which the computed retreat may be too long: it is exact to a micrometre.
const EXCESS: f64 = 0.011;

/// Keys of the point and of the solid of an overlap in the scenario; entries count from 1.
pub fn keys(overlap: &Overlap) -> [String; 2] {
    let solid = PointSource::Solid(overlap.solid);
    [key(overlap.side, overlap.source), key(overlap.side.other(), solid)]
}

/// Key of a point or solid of a part in the scenario, `part_a.solid[1]`; entries count from 1.
pub(crate) fn key(side: Side, source: PointSource) -> String {
    let table = if side == Side::A { "part_a" } else { "part_b" };
    match source {
        PointSource::Point(index) => format!("{table}.point[{}]", index + 1),
        PointSource::Solid(index) => format!("{table}.solid[{}]", index + 1),
    }
}

/// A length in millimetres, to a micrometre: `110 mm`.
pub fn millimetres(length: f64) -> String {
    let text = format!("{:.3}", length * 1e3);
    let number = text.trim_end_matches('0').trim_end_matches('.');
    format!("{} mm", if number == "-0" { "0" } else { number })
}

/// The plant of a model without the joints of the facility's robots: the start in space needs none, and robots that
/// cannot stand in their places are refused elsewhere.
pub fn without_robots(model: &Model) -> Plant {
    let mut model = model.clone();
    (model.facility.joint_level, model.facility.session_robots) = (None, None);
    Plant::new(model)
}

/// Refuses parts that can never touch, and a nominal start at which the parts overlap by more than `task.max_depth`.
pub(crate) fn refuse(c: &mut Checker, file: &ScenarioFile, model: &Model) {
    let plant = without_robots(model);
    let parts = start_parts(&plant, &model.nominal);
    let Some(overlap) = deepest_overlap(&plant, &parts) else {
        let span = c.source.span_of("part_b");
        let message = "no contact point of one part meets a solid of the other";
        c.refuse(&span, message, "add a [[part_a.point]] or [[part_a.solid]], and a [[part_b.solid]]");
        return;
    };
    if overlap.depth <= model.task.max_depth {
        return;
    }
    let [point, solid] = keys(&overlap);
    let message = format!(
        "`{}` overlaps `{}` by {} at the start, more than `task.max_depth` ({}): every run would be invalid",
        point,
        solid,
        millimetres(overlap.depth),
        millimetres(model.task.max_depth)
    );
    let back = retreat(&plant, &parts, LENGTH);
    let stated = [&file.base.position, &file.base.rotation].into_iter().flatten().next();
    let (span, remedy) = match (&file.start.gap, stated, back) {
        (Some(gap), _, Some(back)) => {
            let written = c.number(gap, "m", softdock_kernels::range::Range::size(LENGTH));
            let least = ((written + back) / GAP_STEP - EXCESS).ceil() * GAP_STEP;
            (gap.span.clone(), format!("write gap = \"{}\" or more: then no parts overlap", millimetres(least)))
        }
        (Some(gap), _, None) => (gap.span.clone(), "correct the positions of the points and solids".to_owned()),
        (None, Some(base), Some(back)) => {
            let remedy = format!("move the base back by {} along -x: then no parts overlap", millimetres(back));
            (base.span.clone(), remedy)
        }
        (None, base, _) => {
            let span = base.map_or_else(|| c.source.span_of("start"), |base| base.span.clone());
            (span, "correct the positions of base, points and solids".to_owned())
        }
    };
    c.refuse(&span, message, remedy);
}
