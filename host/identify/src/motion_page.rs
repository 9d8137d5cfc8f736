//! Files of a designed motion: set points in the robot's own columns, page and JSON summary.

use crate::Result;
use crate::excitation::{Excitation, Uses};
use serde::Serialize;
use serde_json::{Value, json};
use softdock_analysis::number::{digits_of, significant};
use softdock_analysis::plots::axis::Axis;
use softdock_analysis::plots::figure::{Figure, Size, colour};
use softdock_analysis::{PageOrigin, render_page};
use softdock_campaign::Robot;
use softdock_campaign::robot::Quantity;
use softdock_input::csv_cell;
use std::fmt::Write;

/// Points of a line on the page.
const POINTS: usize = 400;

#[derive(Serialize)]
struct Page {
    title: String,
    facts: Vec<(String, String)>,
    uses: Vec<(String, String)>,
    drawings: Vec<(String, String)>,
}

/// Returns one period as CSV with sampling period `step` \[s\]: time and joint angles, in the columns, units and
/// offsets of the robot's `[log]`.
///
/// Joints without a column there are written as `q_N_rad`. The motion begins and ends at rest, so that periods follow
/// one another without a step.
pub fn csv(robot: &Robot, motion: &Excitation, step: f64) -> String {
    let channel =
        |joint: usize| robot.log.iter().find(|c| c.signal.quantity == Quantity::Angle && c.signal.joint == joint);
    let name =
        |joint: usize| channel(joint).map_or_else(|| format!("q_{}_rad", joint + 1), |c| csv_cell(&c.column.name));
    let names: Vec<String> = (0..motion.joints.len()).map(name).collect();
    let mut text = format!("t_s,{}\n", names.join(","));
    let samples = (motion.period / step).round() as usize;
    for k in 0..=samples {
        let time = motion.period * k as f64 / samples as f64;
        let _ = write!(text, "{time:.6}");
        for (joint, series) in motion.joints.iter().enumerate() {
            let angle = series.at(time)[0];
            let shown = channel(joint).map_or(angle, |c| (angle - c.column.offset) / c.column.factor);
            let _ = write!(text, ",{shown:.9}");
        }
        text.push('\n');
    }
    text
}

/// Returns the JSON summary: coefficients, condition number, use of the limits.
pub fn summary(robot: &Robot, motion: &Excitation) -> Value {
    let joint = |(series, facts): (&crate::series::Series, &softdock_campaign::robot::JointFacts)| {
        json!({
            "joint": facts.name, "mean_rad": series.mean,
            "cosine_rad": series.coefficients.iter().map(|c| c.0).collect::<Vec<_>>(),
            "sine_rad": series.coefficients.iter().map(|c| c.1).collect::<Vec<_>>(),
        })
    };
    json!({
        "robot": robot.id,
        "period_s": motion.period,
        "condition": motion.condition,
        "random_condition": motion.random_condition,
        "uses": uses(&motion.uses).into_iter().map(|(name, share)| (name.to_owned(), json!(share))).collect::<serde_json::Map<_, _>>(),
        "joints": motion.joints.iter().zip(&robot.joints).map(joint).collect::<Vec<_>>(),
    })
}

fn uses(uses: &Uses) -> [(&'static str, f64); 5] {
    [
        ("angle", uses.angle),
        ("speed", uses.speed),
        ("acceleration", uses.acceleration),
        ("torque", uses.torque),
        ("workspace", uses.workspace),
    ]
}

/// Renders the page: angles and speeds of every joint within their limits.
pub fn page(robot: &Robot, motion: &Excitation, origin: &PageOrigin) -> Result<String> {
    let mut drawings = Vec::new();
    for joint in 0..motion.joints.len() {
        drawings.push(drawing(robot, motion, joint, 0)?);
        drawings.push(drawing(robot, motion, joint, 1)?);
    }
    let page = Page {
        title: robot.title.clone(),
        facts: [
            ("period", format!("{} s", significant(motion.period, 4))),
            ("condition number of the base-parameter regressor", significant(motion.condition, 4)),
            ("the same for a random motion inside the limits (median)", significant(motion.random_condition, 4)),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .into(),
        uses: uses(&motion.uses).map(|(name, share)| (name.to_owned(), digits_of(100.0 * share, 3))).into(),
        drawings,
    };
    Ok(render_page("motion.html", include_str!("page/motion.html"), origin, &page)?)
}

/// Angle (order 0) or speed (order 1) of a joint between its limits, in degrees.
fn drawing(robot: &Robot, motion: &Excitation, joint: usize, order: usize) -> Result<(String, String)> {
    let (name, limits) = (&robot.joints[joint].name, &robot.model.joints[joint].limits);
    let (lo, hi, what) = match order {
        0 => (limits.lower, limits.upper, "angle [deg]"),
        _ => (-limits.speed, limits.speed, "speed [deg/s]"),
    };
    let (lo, hi) = (lo.to_degrees(), hi.to_degrees());
    let at = |k: usize| motion.period * k as f64 / POINTS as f64;
    let points = (0..=POINTS).map(|k| (at(k), motion.joints[joint].at(at(k))[order].to_degrees())).collect();
    let x = Axis::linear("time [s]", 0.0, motion.period);
    let y = Axis::linear(what, lo, hi).padded(0.05);
    let svg = Figure::new(format!("{name} {what}"), Size::Half, x, y)
        .line(vec![(0.0, lo), (motion.period, lo)], colour::LIMIT, 1.0)
        .line(vec![(0.0, hi), (motion.period, hi)], colour::LIMIT, 1.0)
        .line(points, colour::SPACE, 1.3)
        .svg()?;
    let what = if order == 0 { "angle" } else { "speed" };
    Ok((svg, format!("{name}: {what}, between its limits")))
}
