//! Depths one and two: every function of the hand-written frame, and one whole tick, from recorded states.

use super::rounding::F32;
use super::samples::{CASES, Case, MESHED, OBSERVED, PREDICTED, SAMPLES, Snapshot, Stream};
use super::stages::{SLACK, scales};
use super::table::Row;
use super::{POISON, WORKGROUP, adapters, words, written};
use softdock_engine::gpu::GpuEngine;
use softdock_kernels::delay_line::{line_places, line_slots};
use softdock_kernels::fields::{Field, fields, from_slice, join, to_vec};
use softdock_kernels::frame::Tile;
use softdock_kernels::frame::functions::{FrameFunction, frame_functions};
use softdock_kernels::frame::lane_state::{LaneState, state_fields};
use softdock_kernels::plant::Plant;
use softdock_kernels::quads::{self, quads, word};
use softdock_kernels::robot::commands_poses;
use softdock_kernels::space::{Parts, Wrench};
use softdock_test_size::is_full;
use softdock_tracer::kernel::{Kernel, kernel};
use std::fmt::Write;

/// How a frame function is called on the device.
pub(crate) struct Call {
    /// Statements; what it returns goes into `r0` and `r1`.
    text: &'static str,
    /// Structs of `r0` and `r1`.
    results: &'static [&'static str],
    /// Whether it writes this tick's slot of the commands, and of the wrenches.
    writes: [bool; 2],
}

const fn row(name: &'static str, allowed: f64, reason: &'static str, twin: Call) -> Row<Call> {
    Row { name, allowed, reason, twin }
}

const fn call(text: &'static str, results: &'static [&'static str], writes: [bool; 2]) -> Call {
    Call { text, results, writes }
}

const NONE: [bool; 2] = [false, false];

/// What `end` writes: metrics of both loops, and what the flags are made of.
const OUTCOME: [&str; 18] = {
    let mut names = ["f32"; 18];
    (names[0], names[1]) = ("Metrics", "Metrics");
    names
};

/// Functions that the kernel's own code writes for a scenario, besides those of `wgsl/frame.wgsl`.
pub(crate) const WRITTEN_OUT: [&str; 3] = ["touch_space", "touch_facility", "reset_contacts"];

/// Every function of `wgsl/frame.wgsl`; its Rust twin is that of the same name in `frame_functions`.
pub(crate) const FRAME_ROWS: [Row<Call>; 25] = [
    row("zero_wrench", 0.0, "no arithmetic", call("let r0 = zero_wrench();", &["Wrench"], NONE)),
    row(
        "touch_space",
        400.0,
        "forces of overlaps that are differences of positions",
        call(
            "let r0 = touch_space(space_pairs(p), parts_of(kinematics(space_masses(p), space)), Grip(space_motion.grip_share, space_motion.grip_rate));",
            &["Touch"],
            NONE,
        ),
    ),
    row(
        "touch_facility",
        400.0,
        "as touch_space",
        call(
            "let r0 = touch_facility(hil_pairs(p), mounted_parts(p, robot), Grip(hil_motion.grip_share, hil_motion.grip_rate));",
            &["Touch"],
            NONE,
        ),
    ),
    row("reset_contacts", 0.0, "no arithmetic", call("reset_contacts();", &[], NONE)),
    row(
        "tick_space",
        1000.0,
        "four substeps of stiff contact: 1e-7 m at a stiffness of 2e5 N/m^1.5",
        call("if (space_watch.done <= 0.0) { tick_space(now, last); }", &[], NONE),
    ),
    row(
        "tick_hil",
        200.0,
        "the contact of the robots' parts; the rounding of the inputs alone moves it by hundreds",
        call("if (hil_watch.done <= 0.0) { tick_hil(now, last); }", &[], [true, true]),
    ),
    row(
        "send_command",
        200.0,
        "a deviate from a logarithm near 1",
        call(
            "let r0 = send_command(with_test(p, command(parts_of(kinematics(hil_masses(p), hil))), now));",
            &["f32"],
            [true, false],
        ),
    ),
    row(
        "tick_facility",
        600.0,
        "four substeps of the robots' parts in contact; the load's acceleration, a difference of velocities over one",
        call(
            "let parts = parts_of(kinematics(hil_masses(p), hil));
    put_command(tick % SLOTS, command(parts));
    tick_facility(parts, now, f32(tick % 7u) * 1e-4);",
            &[],
            [true, false],
        ),
    ),
    row(
        "take_command",
        100.0,
        "angles of a posture found in f32 to 1e-7 of metres, then to 1e-7 of their change",
        call("take_command(command(parts_of(kinematics(hil_masses(p), hil))));", &[], NONE),
    ),
    row(
        "move_robots",
        2000.0,
        "one substep; accelerations of a chain of six behind springs",
        call("move_robots(command(parts_of(kinematics(hil_masses(p), hil))));", &[], NONE),
    ),
    row("push_robots", 0.0, "no arithmetic", call("push_robots(held);", &[], NONE)),
    row(
        "place_robots",
        2000.0,
        "as drives_at1, which it calls",
        call("place_robots(command(parts_of(kinematics(hil_masses(p), hil))));", &[], NONE),
    ),
    row(
        "receive_wrench",
        400.0,
        "one interpolation; a spring on the difference of two places",
        call("receive_wrench(parts_of(kinematics(hil_masses(p), hil)), arriving_wrench());", &[], [false, true]),
    ),
    row("arriving_wrench", 20.0, "one interpolation", call("let r0 = arriving_wrench();", &["Wrench"], [false, true])),
    row(
        "watch_session",
        400.0,
        "as supervise",
        call(
            "watch_session(with_test(p, command(parts_of(kinematics(hil_masses(p), hil))), now), held, now);",
            &[],
            NONE,
        ),
    ),
    row(
        "compensated_wrench",
        100.0,
        "as compensate",
        call("let r0 = compensated_wrench(parts_of(kinematics(hil_masses(p), hil)), held);", &["Wrench"], NONE),
    ),
    row(
        "tick_simulation",
        40.0,
        "four substeps without contact; the parts that it gives are a row of the stages (kinematics)",
        call("tick_simulation(hil_masses(p), kinematics(hil_masses(p), hil));", &[], NONE),
    ),
    row("sensor_noise", 60.0, "deviates from logarithms near 1", call("let r0 = sensor_noise();", &["Wrench"], NONE)),
    row("camera_noise", 60.0, "as sensor_noise", call("let r0 = camera_noise();", &["Wrench"], NONE)),
    row("deviates", 60.0, "as sensor_noise", call("let r0 = deviates(SENSOR_A, SENSOR_B);", &["Wrench"], NONE)),
    row(
        "reset",
        100.0,
        "the start carried back along its twist, through roots that SwiftShader rounds coarsely",
        call("reset();", &[], NONE),
    ),
    row(
        "enter",
        0.0,
        "no arithmetic",
        call("let r0 = f32(enter(id, RUNNING)) + 2.0 * f32(enter(id, FRESH));", &["f32"], NONE),
    ),
    row("begin", 90.0, "as reset", call("", &[], NONE)),
    row(
        "end",
        100_000.0,
        "as metrics; the rounding of the state alone moves momentum errors by thousands",
        call("", &OUTCOME, NONE),
    ),
    row(
        "slice",
        4000.0,
        "a contact moment: overlaps to 1e-7 m times the stiffness, at the end of an arm of six joints",
        call("", &[], [true, true]),
    ),
];

/// The case on which the frame's functions are run one by one.
const ALONE: &str = "smoke";
/// The one on which, besides it, a whole tick is run: with an arm.
const WHOLE: &str = "probe_drogue";
/// Robots with joints, and what is run on them.
const JOINTS: &str = "smoke_joint";
const ON_JOINTS: [&str; 5] = ["take_command", "move_robots", "push_robots", "place_robots", "slice"];
/// What is run on meshes: the loops over their shells. Those of `touch_space` have the same text, on states of which half
/// are badly conditioned: many points near their touch.
const ON_MESHES: [&str; 2] = ["touch_facility", "reset_contacts"];
/// What those that have a compensator are run for besides.
const COMPENSATING: [&str; 5] = ["tick_facility", "receive_wrench", "compensated_wrench", "reset", "slice"];
/// What the short check runs on a case: the functions that call all others, and two that have compensators.
fn short(case: &str) -> &'static [&'static str] {
    match case {
        ALONE => &["begin", "end", "slice"],
        JOINTS => &["slice"],
        PREDICTED => &["compensated_wrench"],
        OBSERVED => &["tick_facility"],
        MESHED => &ON_MESHES,
        _ => &[],
    }
}

/// Repetitions of the truth from inputs moved by their own rounding: what shows how well a sample is conditioned.
const REPETITIONS: usize = 3;
/// The allowance grows by so many times the spread of these repetitions.
const SPREADS: f64 = 8.0;
/// Roundings of a commanded pose of size 1: attitude and place at the end of an arm of six joints.
const POSE_ROUNDINGS: f64 = 30.0;
/// So many samples may lie so close to an event that the spread is what bounds them.
const UNDECIDED_SHARE: f64 = 0.4;
/// So many samples may be beyond their allowance: an event (slip, touch, a quantum of the sensor) that no repetition met.
const MISSED_SHARE: f64 = 0.02;

/// Returns the output of a sample: state, results, delay lines.
fn flat(lane: &LaneState, results: &[f64]) -> Vec<f64> {
    [&lane.state[..], results, &lane.lines].concat()
}

/// Names of what [`flat`] gives.
fn names<const N: usize>(kernel: &Kernel, call: &Call, plant: &Plant, lane: &LaneState) -> Vec<Field> {
    let named = |prefix: &str, fields: Vec<Field>| -> Vec<Field> {
        fields.into_iter().map(|f| Field { name: join(prefix, &f.name), ..f }).collect()
    };
    let mut out = state_fields::<N>(plant);
    for result in call.results {
        let one = vec![Field::new("", "1", "")];
        let structure = kernel.structs.iter().find(|s| s.name == *result);
        out.extend(named("result", structure.map_or(one, |s| s.fields.clone())));
    }
    let (command, wrench) = (fields::<f64, Parts<f64>>(), fields::<f64, Wrench<f64>>());
    let slots = lane.lines.len() / (command.len() + wrench.len());
    (0..slots).for_each(|_| out.extend(named("command", command.clone())));
    (0..slots).for_each(|_| out.extend(named("wrench", wrench.clone())));
    out
}

/// The Rust twin from a snapshot.
fn truth<const N: usize>(case: &Case, shot: &Snapshot, twin: FrameFunction<N>) -> Vec<f64> {
    let mut tile = Tile::resume(&case.plant, case.batch, shot.run, shot.tick, shot.params, &shot.lane);
    let results = twin(&mut tile, &case.plant);
    flat(&tile.lane_state(&case.plant), &results)
}

/// How far the truth moves when every input moves by up to its f32 rounding.
fn spread<const N: usize>(case: &Case, shot: &Snapshot, twin: FrameFunction<N>, truth_here: &[f64]) -> Vec<f64> {
    let mut draws = Stream::new("spread", (shot.run << 16) as usize + shot.tick as usize);
    let mut spread = vec![0.0_f64; truth_here.len()];
    for _ in 0..REPETITIONS {
        let mut moved = shot.clone();
        let mut parameters = to_vec(&moved.params);
        let mut move_all = |values: &mut [f64]| {
            values.iter_mut().for_each(|value| *value *= 1.0 + 2.0 * F32 * (2.0 * draws.uniform() - 1.0));
        };
        move_all(&mut parameters);
        move_all(&mut moved.lane.state);
        move_all(&mut moved.lane.lines);
        moved.params = from_slice(&parameters);
        for (spread, (a, b)) in spread.iter_mut().zip(truth(case, &moved, twin).iter().zip(truth_here)) {
            *spread = spread.max((a - b).abs());
        }
    }
    spread
}

/// The kernel with an entry point around one frame function; stored state lies behind the loaded one.
fn module(kernel: &Kernel, row: &Row<Call>) -> String {
    let behind = format!("states[batch.lanes * {}u + ", quads(kernel.state));
    let (before, rest) = kernel.text.split_once("fn store_state() {").expect("the frame stores its state");
    let (store, after) = rest.split_once("}\n").expect("a body");
    let mut text = format!("{before}fn store_state() {{{}}}\n{after}", store.replace("states[", &behind))
        .replace("var<uniform> batch", "var<storage, read_write> batch")
        .replace("    let seen = followed(", "    store_state();\n    let seen = followed(");
    // Every binding must be used by every entry point, if only where no lane comes.
    for status in ["FRESH", "RUNNING", "FINISHED"] {
        let enter = format!("    if (!enter(id, {status})) {{\n");
        let used = format!("{enter}        outcomes[0] = lines[0].x + inputs[0].x + states[0].x;\n");
        text = text.replace(&enter, &used);
    }
    if !kernel.tables.is_empty() {
        text = text.replace("outcomes[0] = lines[0].x", "outcomes[0] = tables[0] + lines[0].x");
    }
    let mut results = String::new();
    let mut index = 0;
    let returned = if ENTRIES.contains(&row.name) { &[] } else { row.twin.results };
    for (number, result) in returned.iter().enumerate() {
        let structure = kernel.structs.iter().find(|s| s.name == *result);
        let members =
            structure.map_or(vec![String::new()], |s| s.fields.iter().map(|f| format!(".{}", f.name)).collect());
        for member in members {
            let _ = writeln!(results, "    outcomes[{index}u * batch.lanes + lane] = r{number}{member};");
            index += 1;
        }
    }
    let _ = write!(
        text,
        "\n@compute @workgroup_size(64)
fn try_function(@builtin(global_invocation_id) id: vec3u) {{
    lane = id.x;
    if (lane >= batch.lanes) {{ // every binding must be used
        outcomes[0] = lines[0].x;
        return;
    }}
    run = controls[lane].run;
    tick = controls[lane].tick;
    load_params();
    load_state();
    let now = f32(tick) * TICK;
    let last = select(0.0, 1.0, tick + 1u >= MAX_TICKS);
    {}
{results}    store_state();
}}\n",
        row.twin.text
    );
    if !kernel.tables.is_empty() {
        text = text.replace("        outcomes[0] = lines[0].x;", "        outcomes[0] = lines[0].x + tables[0];");
    }
    text
}

/// The farm's buffers over all snapshots of a case; what the function must write is poisoned.
fn buffers(case: &Case, kernel: &Kernel, row: &Row<Call>, sends: &[bool]) -> Vec<Vec<u32>> {
    let shots = &case.snapshots;
    let vectors = |numbers: usize, value: &dyn Fn(&Snapshot, usize) -> f64, places: &mut dyn Iterator<Item = usize>| {
        let mut out = vec![0; quads::words(numbers) * SAMPLES];
        for (index, place) in places.enumerate() {
            let column = words(shots.iter().map(|shot| value(shot, index)));
            column.into_iter().enumerate().for_each(|(sample, w)| out[word(place, SAMPLES, sample)] = w);
        }
        out
    };
    let [low, high] = case.batch.key;
    let controls = shots.iter().flat_map(|s| [s.run as u32, (s.run >> 32) as u32, status(row), s.tick]);
    let count = kernel.inputs.len();
    let inputs = vectors(count, &|s, index| to_vec(&s.params)[kernel.inputs[index]], &mut (0..count));
    let mut states = vectors(kernel.state, &|s, index| s.lane.state[index], &mut (0..kernel.state));
    states.resize(2 * states.len(), POISON);
    let places = line_places(line_slots(&case.plant));
    let mut lines = vectors(kernel.lines, &|s, index| s.lane.lines[index], &mut places.iter().copied());
    poison(case, row, sends, &mut lines);
    let mut buffers = vec![
        vec![SAMPLES as u32, 1, low, high],
        controls.collect(),
        inputs,
        states,
        lines,
        vec![POISON; kernel.outcome * SAMPLES],
    ];
    if !kernel.tables.is_empty() {
        buffers.push(words(kernel.tables.iter().map(|number| f64::from(*number))));
    }
    buffers
}

/// Poisons the slots that a function writes (a loop that has ended sends nothing).
fn poison(case: &Case, row: &Row<Call>, sends: &[bool], lines: &mut [u32]) {
    let widths = [fields::<f64, Parts<f64>>().len(), fields::<f64, Wrench<f64>>().len()];
    let slots = line_slots(&case.plant);
    let places = line_places(slots);
    for (sample, shot) in case.snapshots.iter().enumerate() {
        for (line, width) in widths.into_iter().enumerate() {
            let offset = if line == 0 { 0 } else { slots * widths[0] };
            let written = |slot: usize| match row.name {
                "reset" | "begin" => slot > 0,
                _ => sends[sample] && row.twin.writes[line] && slot == shot.tick as usize % slots,
            };
            for slot in (0..slots).filter(|slot| written(*slot)) {
                let numbers = &places[offset + slot * width..][..width];
                numbers.iter().for_each(|place| lines[word(*place, SAMPLES, sample)] = POISON);
            }
        }
    }
}

/// Runs one function over a case; gives the largest error in f32 roundings of the field, and the undecided share.
fn compare<const N: usize>(
    gpu: &GpuEngine,
    case: &Case,
    row: &Row<Call>,
    faults: &mut Vec<String>,
) -> (f64, f64, String) {
    let kernel = kernel(&case.plant, case.batch);
    let twins = frame_functions::<N>();
    let twin = twins.iter().find(|(name, _)| *name == row.name).expect("no orphan: the table's own test").1;
    let names = names::<N>(&kernel, &row.twin, &case.plant, &case.snapshots[0].lane);
    let places = line_places(line_slots(&case.plant));
    let results = names.len() - kernel.state - places.len();
    let flats: Vec<Vec<f64>> = case.snapshots.iter().map(|shot| truth(case, shot, twin)).collect();
    let done = names.iter().position(|field| field.name == "hil_watch_done").expect("a row of the state");
    let sends: Vec<bool> = case.snapshots.iter().map(|shot| shot.lane.state[done] <= 0.0).collect();
    let entry = if ENTRIES.contains(&row.name) { row.name } else { "try_function" };
    let out = gpu
        .compute(&module(&kernel, row), entry, (SAMPLES / WORKGROUP) as u32, &buffers(case, &kernel, row, &sends))
        .unwrap_or_else(|error| panic!("{} of {}: {error}", row.name, case.name));
    let scales = scales(&names, &flats);
    let (mut seen, mut undecided, mut missed, mut where_seen) = (0.0_f64, 0.0, Vec::new(), String::new());
    for (sample, (shot, truth)) in case.snapshots.iter().zip(&flats).enumerate() {
        let spread = spread(case, shot, twin, truth);
        let number = |buffer: &[u32], index: usize| buffer[word(index, SAMPLES, sample)];
        let state = (0..kernel.state).map(|i| number(&out[3], quads::words(kernel.state) + i));
        let results = (0..results).map(|i| out[5][i * SAMPLES + sample]);
        let given = state.chain(results).chain(places.iter().map(|place| number(&out[4], *place)));
        let (mut well, mut beyond) = (true, String::new());
        for (index, word) in given.enumerate() {
            let what = || {
                format!("{} of {}, sample {sample} at tick {}: {}", row.name, case.name, shot.tick, names[index].name)
            };
            let value = written(word, what);
            let (error, unit) = ((value - truth[index]).abs(), scales[index] * F32);
            // A copied number moves by two roundings at most: only what moves more is badly conditioned.
            let slack = SPREADS * (spread[index] - 2.0 * unit).max(0.0);
            let rate = differenced(case, &names[index].name);
            let allowed = row.allowed * unit + slack + rate;
            if error > allowed {
                beyond = format!(
                    "{}: {value} for {}, {:.1} roundings, slack {:.1}",
                    what(),
                    truth[index],
                    error / unit,
                    slack / unit
                );
            }
            if (slack > row.allowed * unit && rate == 0.0) || error > allowed {
                well = false;
            } else {
                if error / unit > seen && rate == 0.0 {
                    (seen, where_seen) = (error / unit, names[index].name.clone());
                }
            }
        }
        missed.extend((!beyond.is_empty()).then_some(beyond));
        undecided += f64::from(u8::from(!well)) / SAMPLES as f64;
        check_control(case, row, shot, sample, &out);
    }
    if missed.len() as f64 > MISSED_SHARE * SAMPLES as f64 {
        faults.push(format!("{} of {}: {} samples beyond", row.name, case.name, missed.len()));
        faults.append(&mut missed);
    }
    (seen, undecided, where_seen)
}

/// What a velocity by differences of commanded poses may be off besides: the rounding of a pose over a tick.
///
/// From tick to tick it cancels, so that the robots' poses do not drift by it.
fn differenced(case: &Case, field: &str) -> f64 {
    let is_rate = field.starts_with("command_") && (field.contains("velocity") || field.contains("omega"));
    if is_rate && commands_poses(&case.plant) { POSE_ROUNDINGS * F32 / case.plant.timing.tick() } else { 0.0 }
}

/// The control block afterwards.
fn check_control(case: &Case, row: &Row<Call>, shot: &Snapshot, sample: usize, out: &[Vec<u32>]) {
    let control = &out[1][4 * sample..][..4];
    assert_eq!(control[..2], [shot.run as u32, (shot.run >> 32) as u32], "{}: run", case.name);
    let tick = match row.name {
        "slice" => shot.tick + 1,
        "begin" => 0,
        _ => shot.tick,
    };
    assert_eq!(control[3], tick, "{} of {}: tick", row.name, case.name);
}

/// The kernel's entry points.
const ENTRIES: [&str; 3] = ["begin", "slice", "end"];

/// The status of a lane that a function finds, as the frame has it.
fn status(row: &Row<Call>) -> u32 {
    match row.name {
        "begin" => 1,
        "end" => 3,
        _ => 2,
    }
}

#[test]
fn frame_functions_and_a_tick_match_their_rust_twins() {
    for gpu in adapters() {
        let mut faults = Vec::new();
        println!("{:<16} {:>9} {:>8} {:>9}  reason", "function", "roundings", "allowed", "undecided");
        for row in &FRAME_ROWS {
            let mut worst = 0.0_f64;
            let runs_on = |case: &&Case| match case.name {
                name if !is_full() => short(name).contains(&row.name),
                ALONE => true,
                WHOLE => row.name == "slice",
                JOINTS => ON_JOINTS.contains(&row.name),
                PREDICTED | OBSERVED => COMPENSATING.contains(&row.name),
                MESHED => ON_MESHES.contains(&row.name),
                _ => false,
            };
            for case in CASES.iter().filter(runs_on) {
                let (seen, undecided, at) = match case.plant.joints() {
                    0 => compare::<0>(&gpu, case, row, &mut faults),
                    _ => compare::<6>(&gpu, case, row, &mut faults),
                };
                println!(
                    "{:<16} {seen:>9.2} {:>8} {undecided:>9.4}  {} ({}; {at})",
                    row.name, row.allowed, row.reason, case.name
                );
                if undecided > UNDECIDED_SHARE {
                    faults.push(format!("{} of {}: {undecided} undecided", row.name, case.name));
                }
                worst = worst.max(seen);
            }
            // Only all cases together come near to what is allowed.
            if is_full() && row.allowed > SLACK * worst {
                faults.push(format!("{}: {worst} roundings seen, {} allowed", row.name, row.allowed));
            }
        }
        assert!(faults.is_empty(), "{} faults: {:#?}", faults.len(), &faults[..faults.len().min(20)]);
    }
}
