//! Facility rig against its model and closed forms.

use super::*;
use crate::catalogue::{Hidden, Rig};
use crate::session::exact;

/// Columns of a log by their names.
struct Log {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Log {
    fn of(hidden: &[Hidden], file: &str) -> Self {
        let set = exact(Rig::Facility, hidden, 3).expect("a set");
        Self::read(&set.logs.iter().find(|log| log.0 == file).expect("an experiment").1)
    }

    fn read(text: &str) -> Self {
        let mut lines = text.lines();
        let names = lines.next().expect("a header").split(',').map(str::to_owned).collect();
        let numbers = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        Self { names, rows: lines.map(numbers).collect() }
    }

    fn column(&self, name: &str) -> Vec<f64> {
        let place = self.names.iter().position(|own| own == name).unwrap_or_else(|| panic!("no column {name}"));
        self.rows.iter().map(|row| row[place]).collect()
    }
}

/// The longest stretch of a series that exceeds a bound in absolute value.
fn touching(force: &[f64]) -> std::ops::Range<usize> {
    let first = force.iter().position(|force| force.abs() > 0.1).expect("a touch");
    let last = force.iter().rposition(|force| force.abs() > 0.1).expect("a touch");
    first..last + 1
}

fn plant(hidden: &[Hidden]) -> Plant {
    let sizes = Sizes::check(Rig::Facility, hidden).expect("an effect");
    Plant::new(&sizes, Law::new(&sizes, 3))
}

#[test]
fn robot_step_response_is_exact() {
    let mut plant = plant(&[]);
    plant.commanded.iter_mut().for_each(|commanded| commanded.attitude = [1.0, 0.0, 0.0, 0.0]);
    let mut state = plant.at_command();
    plant.commanded[0].position = [-0.2, 0.001, 0.0];
    state[0] = -0.2;
    let [lag, damping, _] = nominal::RESPONSE;
    // Two real poles p < q: 1 - (q e^-pt - p e^-qt) / (q - p).
    let spread = (damping * damping - 1.0).sqrt();
    let [p, q] = [(damping - spread) / lag, (damping + spread) / lag];
    for step in 1..=1000 {
        state = plant.settled(advance(&plant, &state, 1e-4));
        let t = f64::from(step) * 1e-4;
        let expected = 1e-3 * (1.0 - (q * (-p * t).exp() - p * (-q * t).exp()) / (q - p));
        let [a, _] = plant.held(&state);
        assert!((a.position[1] - expected).abs() < 1e-10, "{t}: {} {expected}", a.position[1]);
    }
}

#[test]
fn moving_robot_lags_by_response_and_delay() {
    let log = Log::of(&[], "head_on_1.csv");
    let (commanded, held) = (log.column("simulated_part_a_position_x_m"), log.column("part_a_position_x_m"));
    let clock = FacilityRig::new(&Sizes::none(), 3).clock_offset;
    // Commanded a steady speed v, w^2 (1 + T s) / (s^2 + 2 z w s + w^2) lags by (2 z / w - T) v.
    let [lag, damping, zero] = nominal::RESPONSE;
    let late = 2.0 * damping * lag - zero + LOOP_DELAY - SENSOR_DELAY - 0.5 * CYCLE + clock;
    let half_speed = 0.5 * 0.055;
    for row in [2, 20, 80] {
        // A pose is measured when a cycle begins: at the time for which the previous row was commanded.
        let behind = commanded[row - 1] - held[row];
        assert!((behind / half_speed - late).abs() < 1e-7, "{row}: {} {late}", behind / half_speed);
    }
}

#[test]
fn force_and_depth_follow_the_law_and_friction_is_at_its_limit() {
    let log = Log::of(&[], "head_on_1.csv");
    let of = |name: &str| log.column(name);
    let (force, aside) = (of("ft_compensated_force_x_n"), of("ft_compensated_force_y_n"));
    let (a, b) = (of("part_a_position_x_m"), of("part_b_position_x_m"));
    let touch = touching(&force);
    assert!((100..600).contains(&touch.len()), "{touch:?}");
    // Where the depth is greatest its rate is nothing; it is read a delay and a filter later.
    let late = (1e3 * (SENSOR_DELAY + nominal::SENSOR_LAG)).round() as usize;
    // What is laid back onto both parts is the whole of the simulated gap less the whole of it.
    let gap = |row: usize| a[row] - b[row];
    let deepest = touch.clone().max_by(|i, j| gap(*i).total_cmp(&gap(*j))).expect("a touch");
    let depth = nominal::RADIUS + gap(deepest);
    let expected = -nominal::STIFFNESS * depth.powf(nominal::EXPONENT);
    assert!((force[deepest + late] / expected - 1.0).abs() < 0.01, "{} {expected}", force[deepest + late]);
    let middle = touch.start + touch.len() / 2;
    let sideways = aside[middle].hypot(log.column("ft_compensated_force_z_n")[middle]);
    assert!((sideways / force[middle].abs() / nominal::FRICTION - 1.0).abs() < 0.01, "{sideways}");
}

#[test]
fn the_parts_slide_from_the_first_touch_to_the_last() {
    for name in motions::TRAINING {
        let log = Log::of(&[], &format!("{name}_1.csv"));
        let force = log.column("ft_compensated_force_x_n");
        let [y, z] = ["y", "z"].map(|axis| log.column(&format!("ft_compensated_force_{axis}_n")));
        let touch = touching(&force);
        let pressed = touch.filter(|row| force[*row].abs() > 5.0);
        // Turned by some hundredths of a radian, the sensor's axes are not the plate's.
        let ratio = pressed.map(|row| y[row].hypot(z[row]) / force[row].abs());
        let (least, most) = ratio.fold((1.0_f64, 0.0_f64), |(lo, hi), ratio| (lo.min(ratio), hi.max(ratio)));
        assert!(least > 0.11 && most < 0.19, "{name}: {least} to {most}");
    }
}

#[test]
fn hidden_effects_change_the_columns_where_they_act() {
    let force = |hidden: &[Hidden]| Log::of(hidden, "aslant_1.csv").column("ft_compensated_force_x_n");
    let plain = force(&[]);
    let first = |force: &[f64]| touching(force).start;
    let hidden = |id, size| [Hidden { id, size }];
    // 0.3 mm at 40 mm/s: 7.5 ms earlier.
    let sooner = first(&plain) - first(&force(&hidden("K7_surface_offset", 3e-4)));
    assert!((6..=9).contains(&sooner), "{sooner}");
    let later = first(&force(&hidden("C1_transport_delay", 0.01))) - first(&plain);
    assert!((9..=11).contains(&later), "{later}");
    let later = first(&force(&hidden("S5_delay", 0.005))) - first(&plain);
    assert_eq!(later, 5);
    let peak = |force: &[f64]| force.iter().fold(0.0_f64, |peak, force| peak.max(force.abs()));
    let harder = peak(&force(&hidden("K1_stiffness", 0.2))) / peak(&plain);
    assert!((1.04..1.2).contains(&harder), "{harder}");
}

#[test]
fn repeats_differ_by_micrometres_of_noise() {
    let set = crate::session::generate(Rig::Facility, &[], crate::random::NoiseColour::FirstOrder, 5).expect("a set");
    let column = |file: &str| -> Vec<f64> {
        let text = &set.logs.iter().find(|log| log.0 == file).expect("an experiment").1;
        let place = text.lines().next().and_then(|h| h.split(',').position(|name| name == "part_b_position_y_m"));
        let place = place.expect("a column");
        text.lines()
            .skip(1)
            .map(|line| line.split(',').nth(place).expect("a cell").parse().expect("a number"))
            .collect()
    };
    let (one, two) = (column("head_on_1.csv"), column("head_on_2.csv"));
    let squares: f64 = one.iter().zip(&two).take(150).map(|(a, b)| (a - b).powi(2)).sum();
    let off = (squares / 150.0 / 2.0).sqrt();
    assert!((2e-6..2e-5).contains(&off), "{off}");
}

#[test]
fn unmoved_effect_changes_readings_and_not_the_simulation() {
    let log = |hidden: &[Hidden]| {
        let set = crate::session::unmoved(Rig::Facility, hidden, 3).expect("a set");
        Log::read(&set.logs.iter().find(|log| log.0 == "head_on_1.csv").expect("an experiment").1)
    };
    let still = Log::of(&[], "head_on_1.csv");
    let (simulated, held, force) = ("simulated_part_a_position_x_m", "part_a_position_x_m", "ft_compensated_force_x_n");
    let apart = |log: &Log, name: &str| {
        let pairs = log.column(name).into_iter().zip(still.column(name));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let none = log(&[]);
    assert!([simulated, held, force].iter().all(|name| apart(&none, name) == 0.0), "nothing is hidden");
    let stiffer = log(&[Hidden { id: "K1_stiffness", size: 0.2 }]);
    assert!(
        apart(&stiffer, simulated) == 0.0 && apart(&stiffer, held) == 0.0 && apart(&stiffer, force) > 5.0,
        "{}",
        apart(&stiffer, force)
    );
    let later = log(&[Hidden { id: "C1_transport_delay", size: 2e-3 }]);
    assert!(apart(&later, simulated) == 0.0 && apart(&later, held) > 5e-5, "{}", apart(&later, held));
}
