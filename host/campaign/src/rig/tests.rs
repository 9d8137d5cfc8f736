//! Rig files of each kind, whole and spoiled.

use super::{Rig, RigModel};
use std::fmt::Write;

/// A rig file of a kind with a line for each signal.
fn text(kind: &str, tables: &str, signals: &[(&str, &str)]) -> String {
    let mut text = format!("schema = \"rig/1\"\nkind = \"{kind}\"\nid = \"bench\"\n{tables}\n[log]\n");
    for (name, unit) in signals {
        let _ = writeln!(text, "\"{name}\" = {{ column = \"{name}\", unit = \"{unit}\" }}");
    }
    text
}

fn sensor(tables: &str) -> String {
    text("sensor", tables, &super::SENSOR_SIGNALS.map(|row| (row.0, row.1)))
}

fn contact(tables: &str) -> String {
    text("contact", tables, &super::CONTACT_SIGNALS.map(|row| (row.0, row.1)))
}

fn command(tables: &str, signals: &[&str]) -> String {
    let known = super::CommandRig::signals(false);
    let rows: Vec<_> = known.into_iter().filter(|row| signals.contains(&row.0)).collect();
    text("command", tables, &rows)
}

fn body(tables: &str) -> String {
    text("body", tables, &super::BODY_SIGNALS.map(|row| (row.0, row.1)))
}

fn load(text: &str) -> Result<Rig, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.toml");
    std::fs::write(&path, text).expect("room");
    Rig::load(&path).map_err(|problems| format!("{problems:?}"))
}

/// What is said of a file that is wrong.
fn refused(text: &str) -> String {
    load(text).expect_err("something is wrong")
}

#[test]
fn a_sensor_is_read_with_its_tool_and_its_tolerances() {
    let tables = "[sensor]\ntool_mass = \"500 g\"\ntool_centre = [\"1 cm\", \"0 m\", \"90 mm\"]\nrange_force = \"2 kN\"\n\
                  range_moment = \"100 N m\"\n[tolerance]\nbias_force = \"0.2 N\"\ngain = \"0.2 %\"\n";
    let rig = load(&sensor(tables)).expect("a legal file");
    let RigModel::Sensor(sensor) = &rig.plant else { panic!("a sensor") };
    let p = &sensor.values;
    assert_eq!((p.tool_mass, p.tool_centre.z, p.range, p.lever), (0.5, 0.09, 2000.0, 0.05));
    let names: Vec<&str> = sensor.tolerance.iter().map(|row| row.0).collect();
    assert_eq!(names, ["bias_force_x", "bias_force_y", "bias_force_z", "gain"]);
    assert!(sensor.noise.is_none() && sensor.gravity == 9.80665);
    assert_eq!(rig.log.len(), super::SENSOR_SIGNALS.len());
}

#[test]
fn a_contact_is_read_with_its_tolerances_as_sizes() {
    let tables =
        "[contact]\nstiffness = \"100 N/mm\"\nfriction = 0.2\n[tolerance]\nstiffness = \"2 %\"\nsurface = \"5 um\"\n";
    let rig = load(&contact(tables)).expect("a legal file");
    let RigModel::Contact(contact) = &rig.plant else { panic!("a contact") };
    assert_eq!((contact.values.stiffness, contact.values.friction, contact.values.exponent), (1e5, 0.2, 1.0));
    assert_eq!(contact.tolerance.len(), 2);
    assert!((contact.tolerance[0].1 - 2000.0).abs() < 1e-9 && (contact.tolerance[1].1 - 5e-6).abs() < 1e-15);
}

#[test]
fn what_is_wrong_is_said_with_its_range_and_a_remedy() {
    let has =
        |message: &str, words: &[&str]| words.iter().for_each(|word| assert!(message.contains(word), "{message}"));
    has(&refused(&sensor("")), &["needs the table [sensor]"]);
    has(&refused(&sensor("[sensor]\ntool_mass = \"-5 kg\"\n")), &["-5 kg is out of range", "at least 0 kg"]);
    has(&refused(&sensor("[sensor]\nrange_moment = \"9 N m\"\n")), &["needs `range_force`", "data sheet"]);
    has(&refused(&sensor("[sensor]\n[tolerance]\nstiffness = \"2 %\"\n")), &["has no tolerance `stiffness`"]);
    has(&refused(&contact("[contact]\nstiffness = \"0 N/m\"\n")), &["above 0 N/m"]);
    has(
        &refused(&contact("[contact]\nstiffness = \"1 N/m\"\n[tolerance]\ncoulomb = \"3 %\"\n")),
        &["no tolerance `coulomb`"],
    );
    let few = text(
        "contact",
        "[contact]\nstiffness = \"1 N/m\"\n",
        &[("t", "s"), ("position.z", "m"), ("force.y", "N"), ("force.q", "N")],
    );
    has(&refused(&few), &["`force.z`", "`position.y`", "add a line for each", "no signal `force.q`"]);
}

#[test]
fn a_commands_way_is_read_with_an_echo_or_with_an_event() {
    let tables = "[command]\nperiod = \"1 ms\"\ntransport_delay = \"2 ms\"\nquantum = \"0.001 mrad\"\n\
                  [tolerance]\nclock_offset = \"0.2 ms\"\ndelay_noise = \"20 us\"\n";
    let rig = load(&command(tables, &["t", "sent", "received"])).expect("a legal file");
    let RigModel::Command(rig) = &rig.plant else { panic!("a command's way") };
    assert_eq!((rig.period, rig.values.transport_delay, rig.delay_noise), (1e-3, 2e-3, Some(2e-5)));
    assert_eq!(rig.tolerance, [("clock_offset", 2e-4)]);
    let has = |message: String, word: &str| assert!(message.contains(word), "{message}");
    load(&command(tables, &["t", "sent.event", "motion.rate"])).expect("a legal file");
    has(refused(&command(tables, &["t", "sent"])), "`received`");
    has(refused(&command(tables, &["t", "sent.event"])), "none for what it moved");
}

#[test]
fn a_body_is_read_with_what_a_diagnosis_found() {
    let tables = "[body]\nmass = \"300 kg\"\ninertia_x = \"90 kg m^2\"\ninertia_y = \"110 kg m^2\"\n\
                  inertia_z = \"100 kg m^2\"\n[tolerance]\nmass = \"0.3 %\"\ncentre = \"1 mm\"\n";
    let effect = "[[effect]]\nid = \"P2_slosh\"\n[effect.parameters]\nslosh_mass = \"12 kg\"\n";
    let rig = load(&body(&format!("{tables}{effect}"))).expect("a legal file");
    let RigModel::Body(rig) = &rig.plant else { panic!("a body") };
    assert_eq!((rig.values.mass, rig.values.inertia.y, rig.values.slosh.mass), (300.0, 110.0, 12.0));
    assert!(rig.tolerance.len() == 4 && (rig.tolerance[0].1 - 0.9).abs() < 1e-12);
    let wrong = refused(&body(&format!("{tables}{}", effect.replace("slosh_mass", "slosh_share"))));
    assert!(wrong.contains("no parameter `slosh_share`"), "{wrong}");
}

#[test]
fn a_tossed_body_is_read_with_what_a_diagnosis_found() {
    let tables = "[toss]\nmass = \"370 g\"\ninertia = \"0.00081 kg m^2\"\nhalf_width = \"52.4 mm\"\nrestitution = 0.125\n\
                  friction = 0.18\nstiffness = \"100 N/mm\"\n[tolerance]\nrestitution = \"10 %\"\nsurface = \"1 mm\"\n";
    let effect = "[[effect]]\nid = \"K11_shape\"\n[effect.parameters]\ncorner_radius = \"2 mm\"\n";
    let all = super::TOSS_SIGNALS.map(|row| (row.0, row.1));
    let rig = load(&text("toss", &format!("{tables}{effect}"), &all)).expect("a legal file");
    let RigModel::Toss(rig) = &rig.plant else { panic!("a tossed body") };
    assert_eq!((rig.values.half_width, rig.values.corner_radius, rig.values.gravity.z), (0.0524, 2e-3, -9.80665));
    assert_eq!(rig.tolerance, [("restitution", 0.0125), ("surface", 1e-3)]);
    let wrong = refused(&text("toss", &tables.replace("0.125", "1.5"), &all));
    assert!(wrong.contains("at most 1"), "{wrong}");
    let wrong = refused(&text("toss", &format!("{tables}{}", effect.replace("K11", "K13")), &all));
    assert!(wrong.contains("no effect `K13_shape`"), "{wrong}");
}

#[test]
fn a_robot_is_read_axis_by_axis_with_what_a_diagnosis_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/models/kr300_r2500.toml");
    std::fs::copy(model, folder.path().join("kr300.toml")).expect("room");
    let load = |tables: &str| {
        let text =
            format!("schema = \"rig/1\"\nkind = \"robot\"\nid = \"cell\"\n[robot]\nmodel = \"kr300.toml\"\n{tables}");
        let path = folder.path().join("model.toml");
        std::fs::write(&path, &text).expect("room");
        Rig::load(&path).map_err(|problems| format!("{problems:?}"))
    };
    let refused = |tables: &str| load(tables).expect_err("something is wrong");
    let rig = load("").expect("a legal file");
    let RigModel::Robot(robot) = &rig.plant else { panic!("a robot") };
    let first = &robot.drives[0].values;
    assert_eq!((robot.drives.len(), first.coulomb, first.stribeck), (6, 355.495, 177.748));
    assert!((first.compliance * 4_577_800.0 - 1.0).abs() < 1e-12 && first.half_backlash > 0.0);
    assert!((first.motor_inertia / (0.00923 * 256.857_142_857_142_83_f64.powi(2)) - 1.0).abs() < 1e-12);
    // A KR 300's arm weighs some hundred kilograms, a metre out.
    assert!((100.0..2000.0).contains(&robot.drives[0].link_inertia), "{}", robot.drives[0].link_inertia);
    let torque = &rig.log["tau.1"];
    assert!(torque.name == "tau_abs_nm_1" && (torque.factor - 256.857_142_857_142_83).abs() < 1e-9, "{torque:?}");
    assert!(rig.log.contains_key("q_link.3") && !rig.log.contains_key("q_link.4"));

    let found = "rigid_gears = true\nplain_friction = true\n[tolerance]\nviscous = \"10 %\"\n\
                 [[effect]]\nid = \"J8_elasticity\"\njoint = 2\n[effect.parameters]\ncompliance = \"1e-7 rad/(N m)\"\n";
    let rig = load(found).expect("a legal file");
    let RigModel::Robot(robot) = &rig.plant else { panic!("a robot") };
    let compliances: Vec<f64> = robot.drives.iter().map(|drive| drive.values.compliance).collect();
    assert_eq!(compliances, [0.0, 1e-7, 0.0, 0.0, 0.0, 0.0]);
    assert!(robot.drives.iter().all(|drive| drive.values.stribeck == 0.0 && drive.tolerance.len() == 1));
    let (text, beside) = rig.gathered();
    assert!(text.contains("model = \"kr300.toml\"") && beside[0].0 == "kr300.toml");

    // Loads add up: each is beyond the model that it was found with.
    let load_of = |mass: &str| {
        format!(
            "[[effect]]\nid = \"J14_payload\"\n[effect.parameters]\npayload = \"{mass} kg\"\npayload_place_z = \"0.1 m\"\n"
        )
    };
    let laden = load(&format!("{}{}", load_of("30"), load_of("-10"))).expect("a legal file");
    let RigModel::Robot(laden) = &laden.plant else { panic!("a robot") };
    let last = |rig: &super::RobotRig| rig.model.joints.last().expect("joints").link.mass;
    assert!((last(laden) - last(robot) - 20.0).abs() < 1e-9);
    let coupled = "[[effect]]\nid = \"J22_axis_coupling\"\njoint = 6\n[effect.parameters]\ncoupling_ratio = -1\n\
                   coupling_viscous = \"50 N m s/rad\"\n";
    let coupled = load(coupled).expect("a legal file");
    let RigModel::Robot(coupled) = &coupled.plant else { panic!("a robot") };
    assert_eq!((coupled.couplings[5].coupling_ratio, coupled.couplings[5].coupling_viscous), (-1.0, 50.0));

    let has = |message: String, word: &str| assert!(message.contains(word), "{message}");
    has(refused(&found.replace("joint = 2\n", "")), "none is named");
    has(refused(&found.replace("joint = 2", "joint = 7")), "from 1 to 6");
    has(refused("[log]\n\"t\" = { column = \"t\", unit = \"s\" }\n"), "its own model file");
    has(refused("[tolerance]\nviscous = \"200 %\"\n"), "at most 1");
    let elsewhere = "[body]\nmass = \"300 kg\"\ninertia_x = \"90 kg m^2\"\ninertia_y = \"110 kg m^2\"\n\
                     inertia_z = \"100 kg m^2\"\n[[effect]]\nid = \"P2_slosh\"\njoint = 1\n[effect.parameters]\n";
    has(self::refused(&body(elsewhere)), "no axis to choose");
    std::fs::remove_file(folder.path().join("kr300.toml")).expect("it was there");
    has(refused(""), "kr300.toml");
}

#[test]
fn open_values_are_refused_with_their_key_and_range() {
    let signals = [("t", "s"), ("q", "rad"), ("tau", "N m")];
    let drive = |table: &str| text("drive", &format!("[drive]\n{table}\n"), &signals);
    let refusal = refused(&drive("motion = \"revolute\"\nmotor_inertia = \"fill in\""));
    assert!(refusal.contains("fill in `drive.motor_inertia`") && refusal.contains("above 0 kg m^2"), "{refusal}");
    let refusal = refused(&drive("motion = \"fill in\"\nmotor_inertia = \"1 kg m^2\""));
    assert!(refusal.contains("fill in `drive.motion`") && refusal.contains("prismatic"), "{refusal}");
    // An optional key counts as open too: its default would decide a verdict.
    let open = "motion = \"revolute\"\nmotor_inertia = \"1 kg m^2\"\n[tolerance]\nmotor_inertia = \"fill in\"";
    assert!(refused(&drive(open)).contains("fill in `tolerance.motor_inertia`"));
    let whole = drive("motion = \"revolute\"\nmotor_inertia = \"1 kg m^2\"");
    for (old, new, key) in [
        ("column = \"tau\"", "column = \"fill in\"", "log.tau.column"),
        ("unit = \"N m\"", "unit = \"fill in\"", "log.tau.unit"),
        ("unit = \"N m\"", "unit = \"N m\", scale = \"fill in\"", "log.tau.scale"),
    ] {
        let refusal = refused(&whole.replacen(old, new, 1));
        assert!(refusal.contains(&format!("fill in `{key}`")), "{refusal}");
    }
    assert!(load(&whole).is_ok());
}
