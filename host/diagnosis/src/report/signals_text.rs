//! Text of the signals of each kind of plant.

use softdock_campaign::rig::{
    BODY_SIGNALS, COMMAND_SIGNALS, CONTACT_SIGNALS, DRIVE_SIGNALS, SENSOR_SIGNALS, TOSS_SIGNALS,
};

/// Returns the kinds of plants with their signals, one per line.
pub fn signals_text() -> String {
    let mut out = String::from("drive: one joint with its drive, turning or sliding\n");
    let either = |(name, turning, sliding, meaning): &(&str, &str, &str, &str)| {
        let unit = if turning == sliding { (*turning).to_owned() } else { format!("{turning} or {sliding}") };
        signal(name, &unit, meaning)
    };
    DRIVE_SIGNALS.iter().for_each(|row| out += &either(row));
    out += "\nrobot: per axis; the [log] of the robot's model file names signals r1.NAME.AXIS\n";
    let named = |name: &str| if name == "t" { name.to_owned() } else { format!("r1.{name}.1") };
    softdock_campaign::robot::SIGNALS
        .iter()
        .for_each(|(name, _, unit, meaning)| out += &signal(&named(name), unit, meaning));
    out += "\nsensor: a force/torque sensor under known loads\n";
    SENSOR_SIGNALS.iter().for_each(|(name, unit, meaning)| out += &signal(name, unit, meaning));
    out += "\ncontact: one body against a plate\n";
    CONTACT_SIGNALS.iter().for_each(|(name, unit, meaning)| out += &signal(name, unit, meaning));
    out += "\ncommand: transmission of a command from sender to receiver, by its echo or by events\n";
    COMMAND_SIGNALS.iter().for_each(|row| out += &either(row));
    out += "\nbody: a free body under known wrenches\n";
    BODY_SIGNALS.iter().for_each(|(name, unit, meaning)| out += &signal(name, unit, meaning));
    out += "\ntoss: a body tossed onto a plane\n";
    TOSS_SIGNALS.iter().for_each(|(name, unit, meaning)| out += &signal(name, unit, meaning));
    out
}

fn signal(name: &str, unit: &str, meaning: &str) -> String {
    format!("  {name:<20}{unit:<12}{meaning}\n")
}
