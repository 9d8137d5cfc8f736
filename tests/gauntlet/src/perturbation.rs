//! Perturbations: small deviations of a machine from its model, drawn from a seed.

use crate::catalogue::{EffectCase, Rig, Stronger, effects, outside};
use crate::random::Stream;

/// Smallest and largest number of perturbations of a machine.
pub const PERTURBATIONS: [usize; 2] = [3, 8];
/// Smallest and largest share of a perturbation in the size at which it would be detectable alone.
pub const SHARES: [f64; 2] = [0.3, 1.0];

/// Small deviation of a machine from its model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perturbation {
    /// The effect, or a form outside the catalogue.
    pub effect: &'static EffectCase,
    /// Size as a share of that at which the effect would be detectable alone.
    pub share: f64,
}

/// Draws the perturbations of a machine: 3 to 8, at least one of them a form outside the catalogue, such as another
/// friction law or an elastic part. A rig with fewer effects gets all that it has.
///
/// Effects of `excluded` are replaced by the next of the same order, so that the others do not change. Limits are not
/// drawn: they act fully or not at all.
pub fn perturbations(rig: Rig, seed: u64, excluded: &[&str]) -> Vec<Perturbation> {
    let mut stream = Stream::new(seed, "perturbations", 0);
    let [fewest, most] = PERTURBATIONS;
    let number = fewest + ((most - fewest + 1) as f64 * stream.uniform()) as usize;
    let all = effects(rig).iter().chain(outside(rig));
    let mut drawn: Vec<(f64, Perturbation)> = all
        .map(|effect| (stream.uniform(), Perturbation { effect, share: stream.between(SHARES[0], SHARES[1]) }))
        .filter(|(_, own)| own.effect.stronger == Stronger::Larger && !excluded.contains(&own.effect.id))
        .collect();
    drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut ordered: Vec<Perturbation> = drawn.into_iter().map(|(_, own)| own).collect();
    if let Some(place) = ordered.iter().position(|own| outside(rig).contains(own.effect)) {
        ordered[..=place].rotate_right(1);
    }
    ordered.truncate(number);
    ordered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::Hidden;
    use crate::random::NoiseColour;
    use crate::session::{RIGS, generate};

    #[test]
    fn machine_has_three_to_eight_small_perturbations_and_one_outside_the_catalogue() {
        for (rig, seed) in RIGS.into_iter().flat_map(|rig| (0..40).map(move |seed| (rig, seed))) {
            let own = perturbations(rig, seed, &[]);
            assert_eq!(own, perturbations(rig, seed, &[]), "the same seed draws the same");
            assert!((PERTURBATIONS[0]..=PERTURBATIONS[1]).contains(&own.len()), "{rig:?} {seed}: {}", own.len());
            assert!(own.iter().all(|one| (SHARES[0]..=SHARES[1]).contains(&one.share)));
            let has_form = own.iter().any(|one| outside(rig).contains(one.effect));
            assert!(has_form || outside(rig).is_empty(), "{rig:?} {seed}");
            let ids: std::collections::BTreeSet<&str> = own.iter().map(|one| one.effect.id).collect();
            assert_eq!(ids.len(), own.len(), "{rig:?} {seed}: an effect is drawn twice");
        }
    }

    #[test]
    fn excluded_effect_is_replaced_and_the_others_remain() {
        for rig in RIGS {
            let all = perturbations(rig, 5, &[]);
            let last = all[all.len() - 1];
            let without = perturbations(rig, 5, &[last.effect.id]);
            assert!(without.iter().all(|own| own.effect.id != last.effect.id), "{rig:?}");
            assert!(all[..all.len() - 1].iter().all(|own| without.contains(own)), "{rig:?}");
        }
    }

    #[test]
    fn generator_accepts_every_combination_at_plausible_sizes() {
        for (rig, seed) in RIGS.into_iter().zip([3, 4, 5, 6, 7, 8, 9]) {
            let own = perturbations(rig, seed, &[]);
            let size = |own: &Perturbation| (own.share * own.effect.size).max(own.effect.smallest);
            let hidden: Vec<Hidden> = own.iter().map(|own| Hidden { id: own.effect.id, size: size(own) }).collect();
            let set = generate(rig, &hidden, NoiseColour::White, seed).expect("sizes of the rig");
            assert_eq!(set.truth.hidden.len(), own.len());
            assert!(set.logs.iter().all(|(_, text)| !text.contains("NaN") && !text.contains("inf")), "{rig:?}");
        }
    }
}
