//! Records for the tests: a plausible session, and arbitrary values.

use super::codes::{LimitKind, OrderKind, Phase, StopCause, force_flags, robot_flags};
use super::record::{CycleRecord, ForceRecord, RobotRecord};
use super::table::{LogValue, Logged, Type, columns, load};
use crate::signals::WireState;
use crate::signals::{AXES, LinkCounters};
use crate::time::Nanos;
use softdock_kernels::space::{Motion, Wrench};
use softdock_kernels::vector::{Pose, Quat, vec3};

/// Start of the sample session since the Unix epoch \[ns\].
pub(crate) const STARTED: i64 = 1_800_000_000_000_000_000;

/// Returns record number `n` of a dry run at 1 kHz: smooth motion, a contact from half a second on.
pub(crate) fn cycle(n: u64) -> CycleRecord {
    let time = n as f64 * 1e-3;
    let force = if time < 0.5 { 0.0 } else { 40.0 * (3.0 * (time - 0.5)).sin().max(0.0) };
    let wrench = Wrench { force: vec3(-force, 0.1 * force, 0.3), moment: vec3(0.01, 0.02 * force, -0.03) };
    let robot = |number: u32| robot(n, f64::from(number), number <= 2);
    CycleRecord {
        cycle: n,
        tick: n,
        time: Nanos(n as i64 * 1_000_000),
        wall_offset: Nanos(STARTED),
        phase: if force > 0.0 { Phase::Contact } else { Phase::Approach },
        cause: StopCause::None,
        flags: 0,
        busy: Nanos(180_000 + (n % 17) as i64 * 1_000),
        overruns: n / 10_000,
        log_dropped: 0,
        robot_1: robot(1),
        robot_2: robot(2),
        emulated_1: robot(3),
        emulated_2: robot(4),
        ft: sensor(n, wrench),
        emulated_ft: ForceRecord::BLANK,
        part_a: pose(0.1 * time, 0.002),
        part_b: pose(0.5, 0.0),
        commanded_part_a: pose(0.1 * time, 0.001),
        commanded_part_b: pose(0.5, 0.0),
        simulated_part_a: motion(0.1 * time, 0.0),
        simulated_part_b: motion(0.5, 0.0),
        fed_back: wrench,
        contact_energy: 1e-3 * force,
        broken: 0,
        request: StopCause::None,
        go: 0,
    }
}

fn robot(n: u64, number: f64, real: bool) -> RobotRecord {
    let time = n as f64 * 1e-3;
    let axis = |axis: usize| 0.3 * (0.2 * time + number + axis as f64).sin();
    let axes: [f64; AXES] = std::array::from_fn(axis);
    RobotRecord {
        flags: robot_flags::PRESENT | robot_flags::FRESH | robot_flags::READY | robot_flags::TORQUE,
        order: if real { OrderKind::Hold } else { OrderKind::Move },
        stamp: Nanos(n as i64 * 1_000_000 + 77),
        received: Nanos(n as i64 * 1_000_000 + 50_000),
        position: axes,
        asked: Logged::BLANK,
        torque: axes.map(|angle| 100.0 * angle),
        tool: Logged::BLANK,
        command: if real { Logged::BLANK } else { axes.map(|angle| angle + 1e-4) },
        computed: axes.map(|angle| angle + 1e-4),
        lateness: Nanos((n * 7919 % 23_000) as i64),
        round_trip: Nanos(250_000 + (n * 104_729 % 41_000) as i64),
        late_answers: 0,
        link: LinkCounters { received: n, lost: n / 5_000, ..LinkCounters::default() },
        wire: WireState { moving: 1, ..WireState::default() },
        limits: super::record::LimitFlags(0),
        limit_used: axes.map(f64::abs),
    }
}

fn sensor(n: u64, wrench: Wrench<f64>) -> ForceRecord {
    ForceRecord {
        flags: force_flags::PRESENT | force_flags::FRESH,
        sequence: (n * 7) as u32,
        received: Nanos(n as i64 * 1_000_000 - 300_000),
        age: Nanos(300_000),
        raw: Wrench { force: vec3(wrench.force.x, wrench.force.y, wrench.force.z - 98.1), moment: wrench.moment },
        peak: wrench,
        compensated: wrench,
        link: LinkCounters { received: n * 7, ..LinkCounters::default() },
    }
}

fn pose(x: f64, y: f64) -> Pose<f64> {
    Pose { position: vec3(x, y, 0.25), attitude: Quat { w: 0.8, v: vec3(0.0, 0.6, 0.0) } }
}

fn motion(x: f64, y: f64) -> Motion<f64> {
    let Pose { position, attitude } = pose(x, y);
    Motion { position, attitude, velocity: vec3(0.1, 0.0, 0.0), omega: vec3(0.0, 0.0, 0.01) }
}

/// Returns a stop by an axis limit, as the sample's last record.
pub(crate) fn stopping(n: u64) -> CycleRecord {
    let mut record = cycle(n);
    record.phase = Phase::Stopping;
    record.cause = StopCause::AxisLimit;
    record.robot_1.limits.set(LimitKind::Velocity, 2);
    record
}

/// Like [`cycle`], with the noise of encoders, torques and sensor, which reduces compression.
pub(crate) fn noisy(n: u64) -> CycleRecord {
    let mut record = cycle(n);
    let mut next = mixer(n);
    let mut noise = move |size: f64| size * ((next() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
    for robot in [&mut record.robot_1, &mut record.robot_2, &mut record.emulated_1, &mut record.emulated_2] {
        for axis in 0..AXES {
            robot.position[axis] += noise(1e-5);
            robot.torque[axis] += noise(1.0);
            robot.computed[axis] += noise(1e-5);
            robot.limit_used[axis] += noise(1e-3);
        }
        if robot.order == OrderKind::Move {
            robot.command = robot.computed;
        }
    }
    for wrench in [&mut record.ft.raw, &mut record.ft.compensated, &mut record.fed_back] {
        wrench.force = wrench.force.map(|force| force + noise(0.5));
        wrench.moment = wrench.moment.map(|moment| moment + noise(0.05));
    }
    let poses = [&mut record.part_a, &mut record.part_b, &mut record.commanded_part_a, &mut record.commanded_part_b];
    for pose in poses {
        pose.position = pose.position.map(|place| place + noise(1e-5));
        pose.attitude.v = pose.attitude.v.map(|part| part + noise(1e-5));
    }
    for motion in [&mut record.simulated_part_a, &mut record.simulated_part_b] {
        motion.position = motion.position.map(|place| place + noise(1e-5));
        motion.attitude.v = motion.attitude.v.map(|part| part + noise(1e-5));
        motion.velocity = motion.velocity.map(|speed| speed + noise(1e-4));
        motion.omega = motion.omega.map(|rate| rate + noise(1e-4));
    }
    record
}

/// SplitMix64 (Steele, Lea and Flood, 2014).
fn mixer(mut state: u64) -> impl FnMut() -> u64 {
    move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }
}

/// Returns a record of arbitrary bits from a seed: NaN with payloads, -0, infinities, blank parts.
pub(crate) fn any(seed: u64) -> CycleRecord {
    let mut next = mixer(seed);
    let mut blank = false;
    let values = columns::<CycleRecord>().into_iter().map(|column| {
        let (choice, bits) = (next(), next());
        if choice % 16 == 0 {
            blank = !blank;
        }
        match column.kind {
            _ if blank => LogValue::blank(column.kind),
            Type::Real => LogValue::Real(real(choice >> 32, bits)),
            Type::Signed => LogValue::Signed(bits as i64),
            Type::Whole => LogValue::Whole(bits),
            Type::Word => LogValue::Word(bits as u32),
            Type::Code(words) => LogValue::Word((bits % words.len() as u64) as u32),
        }
    });
    load(&values.collect::<Vec<_>>())
}

fn real(choice: u64, bits: u64) -> f64 {
    match choice % 8 {
        0 => f64::from_bits(0x7ff0_0000_0000_0001 | (bits & 0x800f_ffff_ffff_ffff)),
        1 => -0.0,
        2 => f64::INFINITY,
        3 => f64::NEG_INFINITY,
        4 => f64::from_bits(bits & 0x000f_ffff_ffff_ffff),
        5 => f64::NAN,
        _ => f64::from_bits(bits),
    }
}

/// Returns a record's values, for bitwise comparison.
pub(crate) fn values(record: &CycleRecord) -> Vec<LogValue> {
    let mut out = Vec::new();
    record.write(&mut |value| out.push(value));
    out
}

/// Panics unless two lists of records are equal bit by bit.
#[track_caller]
pub(crate) fn assert_same(read: &[CycleRecord], written: &[CycleRecord]) {
    assert_eq!(read.len(), written.len(), "records");
    for (read, written) in read.iter().zip(written) {
        if values(read) != values(written) {
            let columns = columns::<CycleRecord>();
            let both = values(read).into_iter().zip(values(written)).zip(columns);
            let differ = both.filter(|((read, written), _)| read != written);
            let differ: Vec<_> = differ.map(|(values, column)| (column.name, values)).collect();
            panic!("cycle {}: {differ:?}", written.cycle);
        }
    }
}
