// Robots that follow their commands with a lag: contact does not push them.

// The controllers take a tick's command.
fn take_command(reference: Parts) {}

// One substep of both robots and the rail.
fn move_robots(reference: Parts) {
    robot = robots(p, robot, reference);
}

// The wrench on part A, laboratory axes, that the next substep feels.
fn push_robots(w: Wrench) {}

// Puts the robots on their first command.
fn place_robots(reference: Parts) {
    robot = robots_at(reference);
}
