//! The exact statistics against golden tables (exact binomial) and against SciPy.

use softdock_analysis::exact::{
    allowed_failures, clopper_pearson, lower_bound, pooled, smallest_runs, tolerance_rank, tolerated_rate, upper_bound,
    wilson,
};
use softdock_analysis::plan::{plan_line, plan_text};

fn close(value: f64, expected: f64, relative: f64) {
    assert!((value - expected).abs() <= relative * expected.abs(), "{value:e}, expected {expected:e}");
}

#[test]
fn smallest_runs_for_each_number_of_failures() {
    let failures = [0, 1, 2, 3, 5, 10];
    let golden = [
        (0.95, 0.95, [59, 93, 124, 153, 208, 336]),
        (0.99, 0.90, [230, 388, 531, 667, 926, 1538]),
        (0.9973, 0.90, [852, 1440, 1970, 2473, 3433, 5704]),
        (0.9973, 0.95, [1109, 1756, 2330, 2870, 3891, 6279]),
        (0.99865, 0.90, [1705, 2880, 3941, 4947, 6868, 11410]),
        (0.999, 0.90, [2302, 3889, 5321, 6679, 9273, 15404]),
        (0.9999, 0.90, [23025, 38896, 53222, 66806, 92745, 154064]),
    ];
    for (probability, confidence, row) in &golden {
        for (failures, runs) in failures.iter().zip(row) {
            assert_eq!(smallest_runs(*failures, *probability, *confidence), Some(*runs), "{probability} {failures}");
            assert_eq!(allowed_failures(*runs, *probability, *confidence), Some(*failures));
            assert!(allowed_failures(*runs - 1, *probability, *confidence) != Some(*failures));
        }
    }
    assert_eq!(smallest_runs(0, 1.0 - 1e-5, 0.9), Some(230_258));
    assert_eq!(smallest_runs(0, 1.0 - 1e-6, 0.9), Some(2_302_584));
}

#[test]
fn allowed_failures_of_round_campaigns() {
    for (runs, allowed) in [(2_000, 2), (10_000, 19), (20_000, 44), (100_000, 248), (1_000_000, 2_633)] {
        assert_eq!(allowed_failures(runs, 0.9973, 0.9), Some(allowed), "{runs}");
    }
    assert_eq!(allowed_failures(851, 0.9973, 0.9), None);
    assert_eq!(allowed_failures(0, 0.9973, 0.9), None);
}

#[test]
fn failure_rate_that_passes_with_90_percent_probability() {
    for (runs, rate) in [(852, 0.00012), (1_970, 0.00056), (5_704, 0.00123), (20_000, 0.00183), (100_000, 0.00229)] {
        let allowed = allowed_failures(runs, 0.9973, 0.9).expect("enough runs");
        assert!((tolerated_rate(runs, allowed) - rate).abs() < 5.0e-6, "{runs}: {}", tolerated_rate(runs, allowed));
    }
}

#[test]
fn clopper_pearson_and_wilson_of_seven_in_ten_thousand() {
    close(upper_bound(7, 10_000, 0.9), 1.1768e-3, 5e-5);
    // The one-sided bound at 90 % is the upper end of the two-sided interval at 80 %.
    close(wilson(7, 10_000, 0.8).hi, 1.1307e-3, 2e-4);
}

#[test]
fn bounds_agree_with_scipy() {
    let golden = [
        (0, 852, 0.9, 2.698_916_022_894_847e-3),
        (7, 10_000, 0.9, 1.176_810_658_399_167e-3),
        (44, 20_000, 0.9, 2.688_467_323_897_924e-3),
        (2_633, 1_000_000, 0.9, 2.699_892_366_304_707e-3),
        (5_000, 10_000, 0.975, 5.098_486_194_100_196e-1),
        (500_000, 1_000_000, 0.975, 5.009_804_808_046_882e-1),
        (1, 10, 0.975, 4.450_161_170_281_954e-1),
        (9, 10, 0.975, 9.974_714_214_555_382e-1),
    ];
    for (count, cases, confidence, expected) in golden {
        close(upper_bound(count, cases, confidence), expected, 1e-7);
    }
}

#[test]
fn bounds_at_the_edges() {
    assert_eq!(upper_bound(10, 10, 0.9), 1.0);
    assert_eq!(upper_bound(0, 0, 0.9), 1.0);
    assert_eq!(lower_bound(0, 10, 0.9), 0.0);
    close(lower_bound(10, 10, 0.9), 0.1f64.powf(0.1), 1e-12);
    close(upper_bound(0, 59, 0.95), 1.0 - 0.05f64.powf(1.0 / 59.0), 1e-12);
    let none = clopper_pearson(0, 0, 0.95);
    assert_eq!((none.lo, none.hi), (0.0, 1.0));
    let all = clopper_pearson(5, 5, 0.95);
    close(all.lo, 0.025f64.powf(0.2), 1e-12);
    assert_eq!(all.hi, 1.0);
    let empty = wilson(0, 0, 0.95);
    assert_eq!((empty.lo, empty.hi), (0.0, 1.0));
}

#[test]
fn two_sided_intervals_contain_the_share_and_are_symmetric() {
    for (count, cases) in [(1, 20), (7, 20), (19, 20), (300, 1_000)] {
        let (one, other) = (clopper_pearson(count, cases, 0.95), clopper_pearson(cases - count, cases, 0.95));
        let share = count as f64 / cases as f64;
        assert!(one.lo < share && share < one.hi);
        close(one.lo, 1.0 - other.hi, 1e-6);
        let wilson = wilson(count, cases, 0.95);
        assert!(wilson.lo < share && share < wilson.hi);
    }
}

#[test]
fn wilks_tolerance_limits() {
    assert_eq!(tolerance_rank(58, 0.95, 0.95), None);
    for (runs, rank) in [(59, 1), (93, 2), (124, 3)] {
        assert_eq!(tolerance_rank(runs, 0.95, 0.95), Some(rank));
        assert!(tolerance_rank(runs - 1, 0.95, 0.95) < Some(rank));
    }
}

#[test]
fn invalid_rates_have_no_plan() {
    assert_eq!(smallest_runs(0, 1.0, 0.9), None);
    assert_eq!(smallest_runs(0, 0.99, 1.0), None);
}

#[test]
fn plan_states_the_allowed_failures_of_the_campaign() {
    let text = plan_text(0.9973, 0.9, Some(3_000));
    assert!(text.starts_with("99.73 % of all cases, shown with 90 % confidence\n"), "{text}");
    for line in [
        "               0           852   0.000124",
        "            3000                  4   0.000811  <- this campaign",
    ] {
        assert!(text.lines().any(|other| other == line), "{text}");
    }
    let line = plan_line(0.9973, 0.9, 2_000);
    assert_eq!(line, "99.73 %/90 %: 2000 runs allow 2 failures; passed 9 times in 10 if the true rate is 0.00055");
    assert!(plan_line(0.9973, 0.9, 500).ends_with("cannot be shown by 500 runs; at least 852 are needed"));
}

#[test]
fn shares_over_draws_have_their_mean_and_variance() {
    let chance = clopper_pearson(400, 2000, 0.95);
    let (share, alone) = pooled(&[(400, 2000)], 0.95);
    assert_eq!((share, alone), (0.2, chance), "one draw has no spread");
    let (_, even) = pooled(&[(40, 200); 10], 0.95);
    assert_eq!(even, chance, "nor have equal ones");
    // Shares of 0.1 and 0.3 in turn: a standard deviation of 0.1, of which chance explains 0.028.
    let draws: Vec<(u64, u64)> = (0..10).map(|k| (if k % 2 == 0 { 20 } else { 60 }, 200)).collect();
    let (share, wide) = pooled(&draws, 0.95);
    let spread = 1.96 * (0.01_f64 - 0.16 / 200.0).sqrt();
    close(share - wide.lo, (0.2 - chance.lo).hypot(spread), 1e-3);
    close(wide.hi - share, (chance.hi - 0.2).hypot(spread), 1e-3);
    assert_eq!(pooled(&[], 0.95).1, clopper_pearson(0, 0, 0.95), "nothing is known of nothing");
}
