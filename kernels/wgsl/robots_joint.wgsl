// Robots joint by joint: controllers once a tick, drives and links every substep, pushed by the contact.

// The controllers take a tick's command.
fn take_command(reference: Parts) {
    set_a = set_point1(p, drives_a, set_a, reference);
    set_b = set_point2(p, drives_b, set_b, reference);
}

// One substep of both robots and the rail.
fn move_robots(reference: Parts) {
    let push_b = reaction(mounted_parts(p, robot), push);
    drives_a = drive1(p, drives_a, set_a, push);
    drives_b = drive2(p, drives_b, set_b, push_b);
    robot = held_parts(robot, drives_a, drives_b);
}

// The wrench on part A, laboratory axes, that the next substep feels.
fn push_robots(w: Wrench) {
    push = w;
}

// Puts the robots on their first command.
fn place_robots(reference: Parts) {
    drives_a = drives_at1(p, reference);
    drives_b = drives_at2(p, reference);
    set_a = first_set_point(drives_a);
    set_b = first_set_point(drives_b);
    push = zero_wrench();
    robot = held_parts(robots_at(reference), drives_a, drives_b);
}
