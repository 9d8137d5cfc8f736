//! Effects of a free body: mass, centre and inertia, liquid slosh, a flexible boom.

use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::{Entry, Hypothesis, Shelf, size};
use crate::model::unknown::{ParameterPrior, Role};

/// Returns the hypotheses of a body.
pub fn effects(block: &MeasuredBlock) -> Vec<Hypothesis> {
    let mut shelf = Shelf::of(block);
    whole(&mut shelf);
    slosh(&mut shelf);
    appendage(&mut shelf);
    shelf.all
}

/// Numbers of the whole, each about its nominal value.
fn whole(shelf: &mut Shelf) {
    let about = |shelf: &Shelf, name, sd: f64| -> Entry {
        (name, ParameterPrior::Normal { mean: shelf.base(name), sd }, Role::Size)
    };
    let mut entries = vec![about(shelf, "mass", size("P1_mass", "mass_error") * shelf.base("mass"))];
    let centres = [("centre_x", "x"), ("centre_y", "y"), ("centre_z", "z")];
    entries
        .extend(centres.map(|(name, axis)| about(shelf, name, size("P1_mass", &format!("target_com_error_{axis}")))));
    let inertias = ["inertia_x", "inertia_y", "inertia_z"];
    let share = size("P1_mass", "inertia_error");
    entries.extend(inertias.map(|name| about(shelf, name, share * shelf.base(name))));
    shelf.add("P1_mass", "mass, centre and inertia", &entries, &[1.0], &[]);
}

/// Radius at which the whole's mass would have its mean moment of inertia \[m\].
fn radius(shelf: &Shelf) -> f64 {
    let inertia: f64 = ["inertia_x", "inertia_y", "inertia_z"].iter().map(|name| shelf.base(name)).sum();
    (0.5 * inertia / shelf.base("mass")).sqrt()
}

/// Liquid lies inside the body.
fn slosh(shelf: &mut Shelf) {
    let scale = size("P2_slosh", "slosh_share") * shelf.base("mass");
    let frequency = size("P2_slosh", "slosh_frequency");
    let inside = ParameterPrior::Normal { mean: 0.0, sd: radius(shelf) };
    let entries = [
        ("slosh_mass", ParameterPrior::Positive { scale }, Role::Size),
        ("slosh_frequency", ParameterPrior::LogNormal { centre: frequency, spread: FACTOR }, Role::Form),
        (
            "slosh_damping",
            ParameterPrior::LogNormal { centre: size("P2_slosh", "slosh_damping"), spread: 1.0 },
            Role::Form,
        ),
        ("slosh_place_x", inside, Role::Form),
        ("slosh_place_y", inside, Role::Form),
        ("slosh_place_z", inside, Role::Form),
    ];
    shelf.add("P2_slosh", "liquid slosh", &entries, &[0.1], &forms(None));
}

/// The tip of a boom lies outside the body, up to several of its radii.
fn appendage(shelf: &mut Shelf) {
    let scale = size("P3_appendage", "appendage_share") * shelf.base("mass");
    let frequency = size("P3_appendage", "appendage_frequency");
    let outside = ParameterPrior::Normal { mean: 0.0, sd: BOOM * radius(shelf) };
    let damping = size("P3_appendage", "appendage_damping");
    let entries = [
        ("appendage_mass", ParameterPrior::Positive { scale }, Role::Size),
        ("appendage_frequency", ParameterPrior::LogNormal { centre: frequency, spread: FACTOR }, Role::Form),
        ("appendage_damping", ParameterPrior::LogNormal { centre: damping, spread: 1.0 }, Role::Form),
        ("appendage_place_x", outside, Role::Form),
        ("appendage_place_y", outside, Role::Form),
        ("appendage_place_z", outside, Role::Form),
    ];
    shelf.add("P3_appendage", "flexible boom", &entries, &[0.05], &forms(Some(1.0)));
}

/// Natural logarithm of the factor to which the frequency of what hangs in a body is known: liquid sways at some tenths
/// of a hertz, booms bend at some hertz.
const FACTOR: f64 = 0.5;
/// Length of a boom in radii of the body.
const BOOM: f64 = 3.0;

/// Forms (frequency, damping, place) that are tried: frequencies a twentieth apart, in the middle and, where what hangs
/// may lie far out, on either side of every axis.
fn forms(aside: Option<f64>) -> Vec<Vec<f64>> {
    let sides = aside.into_iter().flat_map(|aside| (0..3).flat_map(move |axis| [(axis, -aside), (axis, aside)]));
    let place =
        |(axis, side): (usize, f64)| -> [f64; 3] { std::array::from_fn(|k| if k == axis { side } else { 0.0 }) };
    let places: Vec<[f64; 3]> = std::iter::once([0.0; 3]).chain(sides.map(place)).collect();
    let of = |k: i32| places.iter().map(move |place| [&[0.1 * f64::from(k), 0.0][..], place].concat());
    (-20..=20).flat_map(of).collect()
}
