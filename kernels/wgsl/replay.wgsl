// The frame around a block: steps it through a recording, one parameter set a lane; twin of block/replay.rs.

fn lanes() -> u32 {
    return batch[0];
}

fn instants() -> u32 {
    return batch[1];
}

fn stride() -> u32 {
    return batch[2];
}

// The late signals as they reach the block at an instant: between two instants linear, before the first one held.
fn late_at(p: Params, instant: u32) -> Late {
    let behind = lateness(p, f32(instant) * STEP) / STEP;
    let whole = floor(behind);
    let newer = clamp(i32(instant) - i32(whole), 0, i32(instants()) - 1);
    let older = clamp(i32(instant) - i32(whole) - 1, 0, i32(instants()) - 1);
    return late_between(u32(newer), u32(older), behind - whole);
}

@compute @workgroup_size(64)
fn replay(@builtin(global_invocation_id) id: vec3u) {
    let lane = id.x;
    if lane >= lanes() {
        return;
    }
    let p = params_of(lane);
    var s = start(p, input_at(0u), late_at(p, 0u));
    var sample = 0u;
    for (var instant = 0u; instant < instants(); instant++) {
        let u = input_at(instant);
        let late = late_at(p, instant);
        if instant > 0u {
            s = advance(p, s, u, late);
        }
        if instant % stride() == 0u {
            put_output(lane, sample, output(p, s, u, late));
            sample++;
        }
    }
}
