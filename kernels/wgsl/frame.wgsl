// The frame: ticks, substeps, contact points, delay lines and random numbers around the traced stage functions.
// The twin of `frame.rs`, function for function; one run per invocation, its state in private variables for a slice.
//
// Loops over ticks and substeps end by a `break` behind their last statement. A driver that steps many invocations in
// the lanes of a vector (lavapipe) leaves a loop only at its end: one that finds out at its head that no lane goes on
// runs its whole body once more for nothing, which is as much as a substep. A `continuing` block counts as the head.

const IDLE = 0u;
const FRESH = 1u;
const RUNNING = 2u;
const FINISHED = 3u;

const TICK = SUBSTEP * f32(SUBSTEPS);

struct Batch {
    lanes: u32,
    ticks: u32, // at least 1
    key: vec2u,
}

struct Control {
    run: vec2u,
    status: u32,
    tick: u32,
}

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read_write> controls: array<Control>;
@group(0) @binding(2) var<storage, read> inputs: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> states: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> lines: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> outcomes: array<f32>;

var<private> lane: u32;
var<private> run: vec2u;
var<private> tick: u32;
var<private> p: Params;
// What a lane keeps from tick to tick is declared behind the structs, from the table of `frame/lane_state.rs`.

fn zero_wrench() -> Wrench {
    return Wrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
}

// The ideal twin: contact and space closed directly, every substep.
fn tick_space(now: f32, last: f32) {
    let masses = space_masses(p);
    let pairs = space_pairs(p);
    var u: Actuation;
    var parts: Parts;
    var substep = 0u;
    loop {
        let k = kinematics(masses, space);
        parts = parts_of(k);
        if (substep == 0u) {
            if (PLANNED) {
                space_motion = follow(p, space_motion, space, k, space_felt, space_watch, camera_noise());
            }
            if (FIRES) {
                space_firing = fire(space_firing, space, k, space_watch);
            }
            u = guide(p, masses, space, k, space_watch, space_motion, space_firing);
        }
        let grip = grip_after(Grip(space_motion.grip_share, space_motion.grip_rate), f32(substep) * SUBSTEP);
        var touching = parts;
        if (RINGED) {
            touching = on_ring(space_ring, parts);
        }
        let touch = touch_space(pairs, touching, grip);
        let hold = latch(p, touching, space_watch.closed, grip.share);
        space_watch = observe(space_watch, now + f32(substep) * SUBSTEP, touching, parts, touch, hold);
        let pushed = total_wrench(touch, hold);
        if (PLANNED) {
            space_felt = feel(space_felt, parts, pushed);
        }
        var back = pushed;
        if (RINGED) {
            space_ring = push_ring(space_ring, parts, pushed);
            back = back_of(space_ring);
        }
        space = advance(masses, space, k, u, pushed, back);
        substep++;
        if (substep == SUBSTEPS) {
            break;
        }
    }
    space = settle(space);
    if (RINGED) {
        space_ring = settle_ring(space_ring);
    }
    space_watch = finish(space_watch, now + TICK, parts, last, 0.0);
}

// The HIL loop: command, robots, contact and sensor up to now; then the simulation under the fed-back wrench.
fn tick_hil(now: f32, last: f32) {
    let masses = hil_masses(p);
    let k = kinematics(masses, hil);
    let parts = parts_of(k);
    let reference = with_test(p, command(parts), now);
    let jitter = send_command(reference);
    tick_facility(parts, now, jitter);
    let measured = arriving_wrench();
    watch_session(reference, measured, now);
    // A session that a rule has stopped just now goes no further.
    if (hil_watch.done > 0.0) {
        return;
    }
    receive_wrench(parts, measured);
    let reached = tick_simulation(masses, k);
    hil_watch = finish(hil_watch, now + TICK, reached, last, 1.0);
}

// Sends the command of this tick, or loses it; gives the jitter of its packet [s].
fn send_command(reference: Parts) -> f32 {
    var sent = reference;
    if (POSES) {
        let first = get_command((tick + SLOTS - 2u) % SLOTS);
        let second = get_command((tick + SLOTS - 1u) % SLOTS);
        sent = by_differences(first, second, sent);
    }
    if (!NOISY) {
        put_command(tick % SLOTS, sent);
        return 0.0;
    }
    let draws = uniforms(run, tick, LINK);
    if (draws.z < p.drop_probability && tick > 0u) {
        put_command(tick % SLOTS, substitute(get_command((tick + SLOTS - 1u) % SLOTS), link.lost));
        link = LinkCounts(link.lost + 1.0, 1.0);
    } else {
        put_command(tick % SLOTS, sent);
        link.lost = 0.0;
    }
    return normals(draws.x, draws.y).first * p.delay_jitter;
}

// Robots, contact and sensor over the tick that ends now.
fn tick_facility(simulated: Parts, now: f32, jitter: f32) {
    let pairs = hil_pairs(p);
    let delay = max(transport(p, now) + jitter * (1.0 / TICK), 0.0);
    let oldest = max(floor(1.0 / f32(SUBSTEPS) - delay), 3.0 - f32(SLOTS));
    // Three neighbouring commands cover the tick; they are read once, since storage is far away.
    let back = i32(1.0 - oldest);
    let first = get_command((tick + SLOTS - u32(back)) % SLOTS);
    let second = get_command((tick + SLOTS - u32(max(back - 1, 0))) % SLOTS);
    let third = get_command((tick + SLOTS - u32(max(back - 2, 0))) % SLOTS);
    let begin = (1.0 / f32(SUBSTEPS) - delay) - oldest;
    take_command(displaced(interpolate(first, second, third, begin), admittance));
    var substep = 1u;
    loop {
        let place = (progress(p, f32(substep) / f32(SUBSTEPS)) - delay) - oldest;
        move_robots(displaced(interpolate(first, second, third, place), admittance));
        let mount = mounted_parts(p, robot);
        var parts = mount;
        if (RINGED) {
            parts = on_ring(hil_ring, mount);
        }
        let time = now - f32(SUBSTEPS - substep) * SUBSTEP;
        // The fingers go on from the simulation's last tick.
        let grip = grip_after(Grip(hil_motion.grip_share, hil_motion.grip_rate), f32(substep) * SUBSTEP);
        let touch = touch_facility(pairs, parts, grip);
        let hold = latch(p, parts, hil_watch.closed, grip.share);
        hil_watch = observe(hil_watch, time, parts, simulated, touch, hold);
        let pushed = total_wrench(touch, hold);
        var back = pushed;
        if (RINGED) {
            hil_ring = push_ring(hil_ring, mount, pushed);
            back = back_of(hil_ring);
        }
        push_robots(pushed);
        if (COMPLIANT_FIXTURE) {
            robot = push_fixture(p, robot, back);
        }
        var wrench = to_sensor(parts, pushed);
        if (LOADED) {
            load = carry(load, parts);
            wrench = felt(load, parts, wrench);
        }
        sensed = low_pass(p, sensed, wrench);
        if (substep % SENSOR_SUBSTEPS == 0u) {
            sensed = sample(p, sensed, time, sensor_noise());
            if (LOADED) {
                sensed = without_load(p, load, parts, sensed);
            }
        }
        admittance = step_admittance(admittance, parts, output_of(sensed));
        if (substep == SUBSTEPS) {
            break;
        }
        substep++;
    }
    if (RINGED) {
        hil_ring = settle_ring(hil_ring);
    }
    tracking = track(p, tracking, mounted_parts(p, robot), now);
}

// The measured wrench as it arrives: delayed, between two samples.
fn arriving_wrench() -> Wrench {
    put_wrench(tick % SLOTS, output_of(sensed));
    let age = wrench_age(p);
    let whole = floor(age);
    let newer = get_wrench((tick + SLOTS - u32(whole)) % SLOTS);
    let older = get_wrench((tick + SLOTS - u32(whole) - 1u) % SLOTS);
    return blend(newer, older, age - whole);
}

// Applies the session's rules for one cycle to the reference at its beginning.
fn watch_session(reference: Parts, measured: Wrench, now: f32) {
    if (!SUPERVISED) {
        return;
    }
    let commanded = displaced(reference, admittance);
    let asked = axes_asked(commanded);
    var used = 0.0;
    if (asked.near_limit > 0.0) {
        used = range_used(asked, commanded);
    }
    var apart = far_apart();
    if (asked.near_body > 0.0) {
        apart = clearance(asked, commanded);
    }
    let parts = mounted_parts(p, robot);
    session = supervise(session, parts, commanded, asked, used, apart, measured, sensed, hil_watch.port_energy, TICK);
    if (session.rule > 0.0) {
        hil_watch.done = 1.0;
        hil_watch.end_time = now;
    }
}

// What the compensator makes of the measured wrench that has arrived.
fn receive_wrench(parts: Parts, measured: Wrench) {
    let next = compensated_wrench(parts, measured);
    let change = port_power(parts, feed_back(parts, held)) - port_power(parts, feed_back(parts, next));
    hil_watch.port_energy += change * (0.5 * SUBSTEP);
    held = next;
}

// What acts on the simulated bodies for a measured wrench.
fn compensated_wrench(parts: Parts, measured: Wrench) -> Wrench {
    if (!COMPENSATED) {
        return measured;
    }
    var past = parts;
    if (PREDICTED) {
        let back = prediction_horizon(p);
        let whole = floor(back);
        let newer = get_command((tick + SLOTS - u32(whole)) % SLOTS);
        let older = get_command((tick + SLOTS - u32(whole) - 1u) % SLOTS);
        past = interpolate(older, newer, newer, (whole - back) + 1.0);
    }
    compensation = compensate(p, compensation, parts, past, measured);
    return acting_of(compensation);
}

// The simulation computer's tick: guidance, then the bodies under the held wrench; gives the parts at the last substep.
fn tick_simulation(masses: Masses, first: Kinematics) -> Parts {
    if (PLANNED) {
        hil_motion = follow(p, hil_motion, hil, first, hil_felt, hil_watch, camera_noise());
    }
    if (FIRES) {
        hil_firing = fire(hil_firing, hil, first, hil_watch);
    }
    let u = guide(p, masses, hil, first, hil_watch, hil_motion, hil_firing);
    var k = first;
    var parts: Parts;
    var substep = 0u;
    loop {
        if (substep > 0u) {
            k = kinematics(masses, hil);
        }
        parts = parts_of(k);
        let fed = feed_back(parts, held);
        hil_watch.port_energy = fma(port_power(parts, fed), SUBSTEP, hil_watch.port_energy);
        if (PLANNED) {
            hil_felt = feel(hil_felt, parts, fed);
        }
        hil = advance(masses, hil, k, u, fed, fed);
        substep++;
        if (substep == SUBSTEPS) {
            break;
        }
    }
    hil = settle(hil);
    return parts;
}

// Six normal deviates for a sample of the sensor.
fn sensor_noise() -> Wrench {
    if (!NOISY) {
        return zero_wrench();
    }
    return deviates(SENSOR_A, SENSOR_B);
}

// Six normal deviates for an image of the arm's camera; both loops have the same.
fn camera_noise() -> Wrench {
    if (!NOISY || !NOISY_CAMERA) {
        return zero_wrench();
    }
    return deviates(CAMERA_A, CAMERA_B);
}

// Six normal deviates of two channels.
fn deviates(first: u32, second: u32) -> Wrench {
    let a = uniforms(run, tick, first);
    let b = uniforms(run, tick, second);
    let x = normals(a.x, a.y);
    let y = normals(a.z, a.w);
    let z = normals(b.x, b.y);
    return Wrench(x.first, x.second, y.first, y.second, z.first, z.second);
}

// Starts a run: bodies at their dispersed poses, the lines hold the start, extrapolated backwards.
fn reset() {
    space = start(p, space_masses(p));
    hil = start(p, hil_masses(p));
    space_watch = new_watch();
    hil_watch = new_watch();
    hil_watch.done = select(1.0, 0.0, FACILITY);
    space_motion = no_motion();
    hil_motion = no_motion();
    space_firing = no_firing();
    hil_firing = no_firing();
    space_felt = zero_wrench();
    hil_felt = zero_wrench();
    reset_contacts();
    let reference = command(parts_of(kinematics(hil_masses(p), hil)));
    if (FACILITY) {
        for (var age = 1u; age < SLOTS; age++) {
            put_command(SLOTS - age, extrapolate(reference, -f32(age)));
            put_wrench(SLOTS - age, zero_wrench());
        }
    }
    place_robots(on_course(p, reference));
    let mounted = mounted_parts(p, robot);
    if (RINGED) {
        space_ring = ring_at(parts_of(kinematics(space_masses(p), space)));
        hil_ring = ring_at(mounted);
    }
    load = load_at(p, mounted);
    sensed = sensor_at(load, mounted);
    held = zero_wrench();
    compensation = new_compensation();
    session = new_session();
    link = LinkCounts();
    tracking = no_tracking();
    admittance = no_admittance();
    tick = 0u;
}

// Makes this invocation's lane known; false if the lane is not in the given status.
fn enter(id: vec3u, status: u32) -> bool {
    lane = id.x;
    if (lane >= batch.lanes) {
        return false;
    }
    let control = controls[lane];
    run = control.run;
    tick = control.tick;
    return control.status == status;
}

// Puts fresh runs at their start.
@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    if (!enter(id, FRESH)) {
        return;
    }
    load_params();
    reset();
    store_state();
    controls[lane] = Control(run, RUNNING, 0u);
}

// A slice of one run per invocation.
@compute @workgroup_size(64)
fn slice(@builtin(global_invocation_id) id: vec3u) {
    if (!enter(id, RUNNING)) {
        return;
    }
    load_params();
    load_state();
    var status = RUNNING;
    let until = tick + batch.ticks;
    loop {
        let now = f32(tick) * TICK;
        let last = select(0.0, 1.0, tick + 1u >= MAX_TICKS);
        if (space_watch.done <= 0.0) {
            tick_space(now, last);
        }
        if (FACILITY && hil_watch.done <= 0.0) {
            tick_hil(now, last);
        }
        tick++;
        status = select(RUNNING, FINISHED, space_watch.done > 0.0 && hil_watch.done > 0.0);
        if (status == FINISHED || tick == until) {
            break;
        }
    }
    store_state();
    controls[lane] = Control(run, status, tick);
}

// Writes down what the finished runs have shown.
@compute @workgroup_size(64)
fn end(@builtin(global_invocation_id) id: vec3u) {
    if (!enter(id, FINISHED)) {
        return;
    }
    load_params();
    load_state();
    let seen = followed(p, tracking);
    store_outcome(metrics(space_watch, space, space_ring, seen, 0.0), metrics(hil_watch, hil, hil_ring, seen, 1.0));
}
