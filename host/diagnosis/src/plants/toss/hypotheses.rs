//! Effects of a tossed body: impact law, friction, the plane, its shape and mass, gravity and air.

use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::{Entry, Hypothesis, Shelf, size};
use crate::model::unknown::{ParameterPrior, Role};

/// Prior standard deviation of an unmeasured stiffness, as the natural logarithm of a factor.
const STIFFNESS_FACTOR: f64 = 1.0;
/// Hardening within a millimetre, and share of the restitution, that are plausible.
const HARDENING: f64 = 0.3;
const RESTITUTION: f64 = 0.3;
/// Plausible misplacement of the plane \[m\] and its slope: boards on tables, cameras beside them.
const SURFACE: f64 = 2e-3;
const SLOPE: f64 = 0.02;
/// Plausible error of the body's size \[m\], and radius of a corner in half widths.
const WIDTH: f64 = 1e-3;
const CORNER: f64 = 0.05;
/// Lever of the moment against rolling in half widths.
const ROLLING: f64 = 0.02;
/// Share by which free fall may be wrong, along and across.
const FALL: f64 = 0.02;
/// Plausible deceleration by the air over the square of the speed \[1/m\]: three times that of a box of 1 dm and 0.4 kg.
const DRAG: f64 = 0.05;

/// Returns the hypotheses of a tossed body.
pub fn effects(block: &MeasuredBlock) -> Vec<Hypothesis> {
    let mut shelf = Shelf::of(block);
    blows(&mut shelf);
    friction(&mut shelf);
    plane(&mut shelf);
    body(&mut shelf);
    flight(&mut shelf);
    shelf.all
}

/// A size of either sign about its nominal value.
fn either(shelf: &Shelf, name: &'static str, sd: f64) -> Entry {
    (name, ParameterPrior::Normal { mean: shelf.base(name), sd }, Role::Size)
}

fn blows(shelf: &mut Shelf) {
    let stiffness = shelf.base("stiffness");
    let factor = ParameterPrior::LogNormal { centre: stiffness, spread: STIFFNESS_FACTOR };
    shelf.add("K1_stiffness", "stiffness", &[("stiffness", factor, Role::Size)], &[0.5], &[]);
    let hardening = either(shelf, "hardening", HARDENING);
    shelf.add("K2_exponent", "stiffness that grows with the depth", &[hardening], &[0.5], &[]);
    let restitution = either(shelf, "restitution", RESTITUTION);
    // As much as the spring gives at a tenth of a metre a second, so that the restitution changes within the speeds of a toss.
    let deep = either(shelf, "depth_damping", stiffness);
    shelf.add("K3_damping", "restitution and its dependence on the speed", &[restitution, deep], &[0.3], &[]);
}

fn friction(shelf: &mut Shelf) {
    let nominal = shelf.base("friction");
    let level = if nominal > 0.0 { nominal } else { 0.1 };
    let coefficient = either(shelf, "friction", size("K4_friction", "contact_friction_error") * level);
    shelf.add("K4_friction", "friction", &[coefficient], &[1.0], &[]);
    let entries = [
        ("stribeck", ParameterPrior::Positive { scale: size("K5_stribeck", "contact_stribeck") * level }, Role::Size),
        ("stribeck_speed", ParameterPrior::LogNormal { centre: 0.1, spread: 1.0 }, Role::Form),
    ];
    let speeds: Vec<Vec<f64>> = [-1.5, 0.0, 1.5].map(|z| vec![z]).into();
    shelf.add("K5_stribeck", "friction that decreases with the sliding speed", &entries, &[1.0], &speeds);
    let share = size("K6_anisotropy", "contact_anisotropy");
    let entries = [either(shelf, "anisotropy", share), either(shelf, "anisotropy_across", share)];
    shelf.add("K6_anisotropy", "friction that depends on the direction of sliding", &entries, &[0.5], &[]);
    let scale = ROLLING * shelf.base("half_width");
    let entries = [("rolling", ParameterPrior::Positive { scale }, Role::Size)];
    shelf.add("K12_rolling", "friction against rolling and spinning", &entries, &[1.0], &[]);
}

fn plane(shelf: &mut Shelf) {
    let entries = [either(shelf, "surface", SURFACE), either(shelf, "slope_x", SLOPE), either(shelf, "slope_y", SLOPE)];
    shelf.add("K7_surface_offset", "height and slope of the plane", &entries, &[0.3], &[]);
}

fn body(shelf: &mut Shelf) {
    let width = either(shelf, "half_width", WIDTH);
    let corner = either(shelf, "corner_radius", CORNER * shelf.base("half_width"));
    shelf.add("K11_shape", "size and radius of its corners", &[width, corner], &[0.5], &[]);
    let centre = 0.1 * size("P1_mass", "target_com_error_x");
    let centres = ["centre_x", "centre_y", "centre_z"].map(|name| either(shelf, name, centre));
    let share = size("P1_mass", "inertia_error");
    let inertias = ["inertia_x", "inertia_y", "inertia_z"].map(|name| either(shelf, name, share * shelf.base(name)));
    shelf.add("P1_mass", "centre and inertia", &[centres, inertias].concat(), &[0.5], &[]);
}

fn flight(shelf: &mut Shelf) {
    let fall = FALL * shelf.base("gravity_z").abs();
    let entries = ["gravity_x", "gravity_y", "gravity_z"].map(|name| either(shelf, name, fall));
    shelf.add("P6_gravity", "free fall, by the scale of lengths and of time", &entries, &[0.5], &[]);
    let entries = [("drag", ParameterPrior::Positive { scale: DRAG }, Role::Size)];
    shelf.add("P7_drag", "drag", &entries, &[1.0], &[]);
}
