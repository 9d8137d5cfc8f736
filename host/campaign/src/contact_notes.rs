//! Laws of contact of a scenario in words, with notes where a law is outside its valid range.

use crate::mobility::effective_mass;
use crate::overlap::without_robots;
use crate::scenario::contact::rebound_restitution;
use softdock_kernels::contact::space_pair;
use softdock_kernels::material::{NormalLaw, Pair};
use softdock_kernels::model::Model;
use softdock_kernels::plant::ContactPair;

/// Share of a solid's half thickness that a point may move in a substep.
const SHARE_OF_STEP: f64 = 0.2;

/// Returns a line for each law that points meet, each followed by its notes, for the nominal run.
pub fn contact_lines(model: &Model) -> Vec<String> {
    let plant = without_robots(model);
    let mass = effective_mass(model, model.nominal.base_mass, model.nominal.target_mass);
    let of_pair = |(index, of): (usize, &ContactPair)| {
        let pair: Pair<f64> = space_pair(of, &model.nominal);
        let of_shells = plant.shells.iter().filter(|shell| shell.pair == index).map(|shell| shell.points.len());
        let points = plant.contacts.iter().filter(|contact| contact.pair == index).count() + of_shells.sum::<usize>();
        let row = model.contact.pairs.iter().position(|row| Some(row.properties) == of.properties && row.law == of.law);
        let table = row.map_or("[contact]".to_owned(), |row| format!("[[contact.pair]] {}", row + 1));
        let mut lines = vec![format!(
            "{table}: {} of part {:?} on {}, {}",
            counted(points, "point"),
            of.points_of,
            counted(of.solids.len(), "solid"),
            of.law.text(&pair)
        )];
        lines.extend(notes(model, of, &pair, mass).into_iter().map(|note| format!("  note: {note}")));
        lines
    };
    plant.pairs.iter().enumerate().flat_map(of_pair).collect()
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn notes(model: &Model, of: &ContactPair, pair: &Pair<f64>, mass: Option<f64>) -> Vec<String> {
    let mut notes = Vec::new();
    let (speed, substep) = (model.nominal.closing_speed, model.timing.substep);
    // Kelvin-Voigt: the force falls from the touch on if b^2 >= K m.
    if let Some(mass) = mass.filter(|mass| of.law.jumps() && pair.damping.powi(2) >= pair.stiffness * mass) {
        notes.push(format!(
            "the peak force is the damper's jump at the touch, {:.3e} N at the closing speed (damping ratio {:.2}, from \
             0.5 on): with law = \"impact\" or \"power\" the force rises with depth",
            pair.damping * speed,
            pair.damping / (2.0 * (pair.stiffness * mass).sqrt())
        ));
    }
    if let NormalLaw::Rebound { slowest, .. } = of.law {
        notes.push(format!(
            "two free bodies separate with {:.3} of the speed of approach at every touch of {slowest:.3e} m/s or more",
            rebound_restitution(pair.dissipation * slowest)
        ));
    }
    let thinnest = of.solids.iter().map(|solid| solid.solid.shape.half_thickness()).fold(f64::INFINITY, f64::min);
    if speed * substep > SHARE_OF_STEP * thinnest {
        notes.push(format!(
            "a substep moves a point by {:.3e} m at the closing speed, and the thinnest solid is {:.3e} m thick: a point may \
             pass through it unseen; write timing.substep = \"{:.3e} ms\" or less",
            speed * substep,
            2.0 * thinnest,
            1e3 * SHARE_OF_STEP * thinnest / speed
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::tests::{FREE_BODY, scenario};

    fn lines(text: &str) -> String {
        contact_lines(&scenario(text).expect("valid").model).join("\n")
    }

    #[test]
    fn restitution_is_the_inverse_of_the_exact_factor() {
        for (e, factor) in [(0.95, 0.07893), (0.8, 0.37315), (0.5, 1.43275), (0.3, 3.087_082)] {
            assert!((rebound_restitution(factor) - e).abs() < 1e-4, "{factor}: {}", rebound_restitution(factor));
        }
    }

    #[test]
    fn laws_outside_their_range_have_notes() {
        assert!(!lines(FREE_BODY).contains("note"), "{}", lines(FREE_BODY));
        // 200 kg on 1e5 N/m: the jump is the peak from 4472 N s/m on.
        let damped = |value: &str| lines(&FREE_BODY.replace("[start]", &format!("damping = \"{value}\"\n[start]")));
        assert!(!damped("4400 N s/m").contains("note"), "{}", damped("4400 N s/m"));
        assert!(damped("4500 N s/m").contains("jump at the touch, 2.250e2 N"), "{}", damped("4500 N s/m"));
        // 0.75 (1 - 0.5^2) is the factor of a restitution of 0.72, not of 0.5.
        let text =
            FREE_BODY.replace("law = \"linear\"", "law = \"lankarani_nikravesh\"\nrestitution = 0.5\nexponent = 1");
        assert!(lines(&text).contains("separate with 0.7"), "{}", lines(&text));
        let thin = FREE_BODY.replace(
            "shape = \"plane\"",
            "shape = \"box\"\nposition = [\"5 um\", \"0 m\", \"0 m\"]\nsize = [\"10 um\", \"1 m\", \"1 m\"]",
        );
        assert!(lines(&thin).contains("may pass through it unseen"), "{}", lines(&thin));
    }
}
