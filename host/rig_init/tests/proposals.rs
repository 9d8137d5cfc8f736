//! Proposals from synthetic logs: kinds, units, start values, and what stays open.

use softdock_campaign::rig::RigModel;
use softdock_campaign::{Rig, Robot};
use softdock_rig_init::{ProposedRig, RigInitError, RigInitOptions};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Writes a log of rows by time; `step` in seconds.
fn log(folder: &Path, name: &str, header: &str, rows: usize, row: impl Fn(usize) -> Vec<f64>) -> PathBuf {
    let mut text = format!("{header}\n");
    for number in 0..rows {
        let cells: Vec<String> = row(number).iter().map(|value| format!("{value:.9}")).collect();
        let _ = writeln!(text, "{}", cells.join(","));
    }
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file");
    path
}

fn options() -> RigInitOptions {
    RigInitOptions { id: "bench".to_owned(), ..RigInitOptions::default() }
}

fn propose(log: &Path, options: &RigInitOptions) -> Result<ProposedRig, RigInitError> {
    ProposedRig::of(&[log.to_owned()], "rig.toml", options)
}

/// Reads the proposed rig as `diagnose` does; every open value is replaced by `values` in the order of the file.
fn load(folder: &Path, proposed: &ProposedRig, values: &[&str]) -> Result<Rig, String> {
    let mut texts = vec![("rig.toml".to_owned(), proposed.rig.clone())];
    texts.extend(proposed.robot.clone());
    let mut values = values.iter();
    for (name, text) in texts {
        let mut lines = Vec::new();
        for line in text.lines() {
            let is_open = line.contains("\"fill in\"") && !line.starts_with('#');
            let value = if is_open { values.next() } else { None };
            lines.push(value.map_or_else(|| line.to_owned(), |value| line.replace("\"fill in\"", value)));
        }
        std::fs::write(folder.join(name), lines.join("\n")).expect("a file");
    }
    Rig::load(&folder.join("rig.toml")).map_err(|problems| format!("{problems:?}"))
}

/// Angle, rate and acceleration of a motion with two frequencies.
fn motion(t: f64) -> (f64, f64, f64) {
    let (a, b) = (2.0_f64, 5.3_f64);
    let angle = 0.8 * (a * t).sin() + 0.2 * (b * t).cos();
    let rate = 0.8 * a * (a * t).cos() - 0.2 * b * (b * t).sin();
    (angle, rate, -0.8 * a * a * (a * t).sin() - 0.2 * b * b * (b * t).cos())
}

/// Torque of 3 kg m^2 with 5 N m s/rad, 7 N m of Coulomb friction and a weight of 20 N m.
fn torque(t: f64) -> f64 {
    let (angle, rate, acceleration) = motion(t);
    3.0 * acceleration + 5.0 * rate + 7.0 * (rate / 0.01).tanh() + 20.0 * angle.cos() + 1.5
}

#[test]
fn drive_with_torque_needs_no_value() {
    let folder = tempfile::tempdir().expect("a folder");
    let row = |n: usize| {
        let t = n as f64 * 0.004;
        vec![1e3 * t, motion(t).0.to_degrees(), torque(t)]
    };
    let path = log(folder.path(), "a.csv", "time_ms,q1_deg,tau1_nm", 4000, row);
    let proposed = propose(&path, &options()).expect("a drive");
    assert_eq!((proposed.kind.as_str(), proposed.open.len()), ("drive", 0), "{:?}\n{}", proposed.open, proposed.rig);
    let rig = load(folder.path(), &proposed, &[]).expect("complete");
    let RigModel::Drive(drive) = &rig.plant else { panic!("a drive") };
    let near = |value: f64, truth: f64, share: f64| {
        assert!((value / truth - 1.0).abs() < share, "{value} is not {truth}\n{}", proposed.rig);
    };
    near(drive.values.motor_inertia, 3.0, 0.02);
    near(drive.values.viscous, 5.0, 0.1);
    near(drive.values.coulomb, 7.0, 0.1);
    near(drive.gravity_torque, 20.0, 0.02);
    near(rig.log["q"].factor, 1f64.to_radians(), 1e-9);
    near(rig.log["t"].factor, 1e-3, 1e-9);
    assert!(drive.tolerance.iter().any(|row| row.0 == "motor_inertia"), "{:?}", drive.tolerance);
    assert!(proposed.rig.contains("250 Hz"), "{}", proposed.rig);
}

#[test]
fn current_without_a_constant_stays_open_and_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let row = |n: usize| {
        let t = n as f64 * 0.01;
        vec![t, motion(t).0, torque(t) / 11.0]
    };
    let path = log(folder.path(), "a.csv", "t,q1,i1", 2000, row);
    let proposed = propose(&path, &options()).expect("a drive");
    let keys: Vec<&str> = proposed.open.iter().map(|open| open.key.as_str()).collect();
    assert_eq!(keys, ["motor_inertia", "motor_inertia", "tau"], "{}", proposed.rig);
    for open in &proposed.open {
        let line = proposed.rig.lines().nth(open.line - 1).expect("a line");
        assert!(line.contains("fill in") && line.contains(&open.key), "{line}");
    }
    let refusal = load(folder.path(), &proposed, &[]).expect_err("open");
    for key in ["drive.motor_inertia", "tolerance.motor_inertia", "log.tau.scale"] {
        assert!(refusal.contains(&format!("fill in `{key}`")), "{refusal}");
    }
    load(folder.path(), &proposed, &["\"3 kg m^2\"", "\"5 %\"", "11.0"]).expect("filled in");
    // With the constant, all follows from the log.
    let scaled = RigInitOptions { torque_scale: Some(11.0), ..options() };
    let proposed = propose(&path, &scaled).expect("a drive");
    assert!(proposed.open.is_empty(), "{:?}", proposed.open);
    let RigModel::Drive(drive) = load(folder.path(), &proposed, &[]).expect("complete").plant else {
        panic!("a drive")
    };
    assert!((drive.values.motor_inertia / 3.0 - 1.0).abs() < 0.05, "{}", proposed.rig);
}

#[test]
fn constant_follows_from_the_pair_of_wanted_torque_and_current() {
    let folder = tempfile::tempdir().expect("a folder");
    let row = |n: usize| {
        let t = n as f64 * 0.008;
        let (angle, rate, _) = motion(t);
        let wanted = 0.9 * torque(t);
        // The controller adds its own friction to the current, not to the torque.
        let friction = 0.4 * rate + 0.6 * (rate / 0.02).tanh();
        vec![t, angle, rate, torque(t) / 11.0, wanted / 11.0 + friction, wanted]
    };
    let header = "timestamp,actual_q_0,actual_qd_0,actual_current_0,target_current_0,target_moment_0";
    let path = log(folder.path(), "a.csv", header, 2000, row);
    let proposed = propose(&path, &options()).expect("a drive");
    assert!(proposed.open.is_empty(), "{:?}", proposed.open);
    let rig = load(folder.path(), &proposed, &[]).expect("complete");
    assert!((rig.log["tau"].factor - 11.0).abs() < 0.05, "{}", proposed.rig);
}

#[test]
fn unit_of_an_unnamed_position_follows_from_its_rate() {
    let folder = tempfile::tempdir().expect("a folder");
    // Small angles in degrees: their size alone would be taken for radians.
    let row = |n: usize| {
        let t = n as f64 * 0.004;
        let (angle, rate, _) = motion(t);
        vec![t, 0.1 * angle.to_degrees(), 0.1 * rate, torque(t)]
    };
    let header = "__time,/joint_states/position[0],/joint_states/velocity[0],/joint_states/effort[0]";
    let path = log(folder.path(), "a.csv", header, 2000, row);
    let proposed = propose(&path, &options()).expect("a drive");
    assert!(proposed.rig.contains("unit = \"deg\""), "{}", proposed.rig);
    assert!(proposed.rig.contains("its derivative is 57."), "{}", proposed.rig);
}

#[test]
fn clock_since_1970_and_torque_without_a_sign() {
    let folder = tempfile::tempdir().expect("a folder");
    let row = |n: usize| {
        let t = n as f64 * 0.02;
        vec![1_700_000_000_000.0 + 1e3 * t, motion(t - 0.05).0, motion(t).0, torque(t).abs()]
    };
    let path = log(folder.path(), "a.csv", "stamp,position_rad_1,command_rad_1,torque_1", 2000, row);
    let proposed = propose(&path, &options()).expect("a command");
    assert_eq!(proposed.kind, "command");
    assert!(proposed.notes.iter().any(|note| note.contains("never negative")), "{:?}", proposed.notes);
    let rig = load(folder.path(), &proposed, &[]).expect("complete");
    let RigModel::Command(command) = &rig.plant else { panic!("a command") };
    assert!((command.period - 0.02).abs() < 1e-9 && (rig.log["t"].factor - 1e-3).abs() < 1e-12);
}

#[test]
fn missing_cells_do_not_spoil_a_fit() {
    let folder = tempfile::tempdir().expect("a folder");
    let row = |n: usize| {
        let t = n as f64 * 0.004;
        let gap = |every: usize| if n.is_multiple_of(every) { f64::NAN } else { 0.0 };
        vec![t + gap(5000), motion(t).0 + gap(400), torque(t) + gap(300)]
    };
    let path = log(folder.path(), "a.csv", "t_s,q_rad,tau_nm", 4000, row);
    let proposed = propose(&path, &options()).expect("a drive");
    let RigModel::Drive(drive) = load(folder.path(), &proposed, &[]).expect("complete").plant else {
        panic!("a drive")
    };
    assert!((drive.values.motor_inertia / 3.0 - 1.0).abs() < 0.02, "{}", proposed.rig);
    // A joint at rest has no direction, so its torque counts as one.
    let path = log(folder.path(), "b.csv", "t_s,q_rad,tau_nm", 400, |n| vec![n as f64 * 0.004, 1.0, 2.0]);
    let proposed = propose(&path, &options()).expect("a drive at rest");
    assert_eq!(proposed.open.len(), 2, "{:?}", proposed.open);
}

#[test]
fn every_unit_of_a_clock_is_read_back() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, first, second) in [
        ("t", 0.0, 1.0),
        ("t_ms", 0.0, 1e3),
        ("t", 1e5, 1e6),
        ("%time", 1.7e18, 1e9),
        ("stamp", 1.7e15, 1e6),
        ("stamp", 1.7e9, 1.0),
    ] {
        let row = |n: usize| {
            let t = n as f64 * 0.01;
            vec![first + second * t, motion(t).0, torque(t)]
        };
        let path = log(folder.path(), "a.csv", &format!("{name},q_rad,tau_nm"), 1000, row);
        let proposed = propose(&path, &options()).expect("a drive");
        let rig = load(folder.path(), &proposed, &[]).unwrap_or_else(|problems| panic!("{name}, {first}: {problems}"));
        assert!((rig.log["t"].factor * second - 1.0).abs() < 1e-9, "{name}, {first}: {}", proposed.rig);
    }
}

#[test]
fn frame_rate_of_a_toss_follows_from_positions_and_speeds() {
    let folder = tempfile::tempdir().expect("a folder");
    let row = |n: usize| {
        let (toss, k) = ((n / 60 + 1) as f64, (n % 60) as f64);
        let t = k / 148.0;
        let place = [0.3 * t, -0.2 * t, 0.5 + t - 4.905 * t * t];
        vec![toss, k, place[0], place[1], place[2], 1.0, 0.0, 0.0, 0.0, 0.3, -0.2, 1.0 - 9.81 * t]
    };
    let header = "toss,k,px_m,py_m,pz_m,qw,qx,qy,qz,vx_m_s,vy_m_s,vz_m_s";
    let path = log(folder.path(), "a.csv", header, 600, row);
    let proposed = propose(&path, &options()).expect("a toss");
    assert_eq!((proposed.kind.as_str(), proposed.open.len()), ("toss", 7), "{:?}", proposed.open);
    let values = ["\"0.37 kg\"", "\"0.0008 kg m^2\"", "\"52 mm\"", "0.1", "0.2", "\"10 %\"", "\"5 %\""];
    let rig = load(folder.path(), &proposed, &values).expect("filled in");
    assert!((148.0 * rig.log["t"].factor - 1.0).abs() < 1e-3, "{}", proposed.rig);
}

#[test]
fn wrench_logs_are_sensors_contacts_and_bodies() {
    let folder = tempfile::tempdir().expect("a folder");
    let wave = |n: usize, k: usize| (n as f64 * 0.01 * (1.0 + k as f64)).sin();
    let rows = |columns: usize| {
        move |n: usize| (0..columns).map(|k| if k == 0 { n as f64 * 0.001 } else { wave(n, k) }).collect()
    };
    let cases = [
        ("sensor", "t_s,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,ref_fx_n,ref_fy_n,ref_fz_n,ref_mx_nm,ref_my_nm,ref_mz_nm", 13),
        ("contact", "t_s,fx_n,fy_n,fz_n,px_mm,py_mm,pz_mm", 7),
        ("body", "t_s,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,ax_m_s2,ay_m_s2,az_m_s2,wx_rad_s,wy_rad_s,wz_rad_s", 13),
    ];
    for (kind, header, columns) in cases {
        let path = log(folder.path(), &format!("{kind}.csv"), header, 400, rows(columns));
        let proposed = propose(&path, &options()).expect(kind);
        assert_eq!(proposed.kind, kind);
        let refusal = load(folder.path(), &proposed, &[]).expect_err("open");
        assert_eq!(refusal.matches("fill in `").count(), proposed.open.len(), "{kind}: {refusal}");
    }
}

#[test]
fn log_that_fits_no_kind_is_refused_with_its_columns() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = log(folder.path(), "a.csv", "t_s,temperature", 100, |n| vec![n as f64, 20.0]);
    let error = propose(&path, &options()).expect_err("no kind").to_string();
    assert!(error.contains("a.csv fit no kind") && error.contains("temperature"), "{error}");
    let path = log(folder.path(), "b.csv", "t_s,temperature", 5, |n| vec![n as f64, 20.0]);
    assert!(propose(&path, &options()).expect_err("short").to_string().contains("5 rows"));
    let error = propose(&folder.path().join("none.csv"), &options()).expect_err("absent").to_string();
    assert!(error.contains("there is no such file"), "{error}");
}

/// A pendulum of two links; every link is a rod along x.
const URDF: &str = r#"<robot name="rods"><link name="base"/>
<joint name="shoulder" type="revolute"><axis xyz="0 1 0"/><parent link="base"/><child link="upper"/>
<limit lower="-3" upper="3" effort="80" velocity="3"/></joint>
<link name="upper"><inertial><origin xyz="0.4 0 0"/><mass value="5"/>
<inertia ixx="0.01" iyy="0.3" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><origin xyz="0.8 0 0"/><axis xyz="0 1 0"/><parent link="upper"/><child link="lower"/>
<limit lower="-3" upper="3" effort="40" velocity="3"/><dynamics damping="0.5" friction="1"/></joint>
<link name="lower"><inertial><origin xyz="0.3 0 0"/><mass value="2"/>
<inertia ixx="0.01" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;

#[test]
fn robot_from_urdf_gets_drives_from_the_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let urdf = folder.path().join("rods.urdf");
    std::fs::write(&urdf, URDF).expect("a file");
    let model = softdock_campaign::urdf::UrdfRobot::load(&urdf).expect("a robot").rigid();
    let second = |t: f64| {
        let (angle, rate, acceleration) = motion(1.3 * t + 0.4);
        (angle, 1.3 * rate, 1.69 * acceleration)
    };
    let rotors = [1.2, 0.4];
    let row = |currents: bool| {
        let model = model.clone();
        move |n: usize| {
            let t = n as f64 * 0.004;
            let (a, b) = (motion(t), second(t));
            let rigid = softdock_kernels::manipulator::rigid_torques(&model, [a.0, b.0], [a.1, b.1], [a.2, b.2]);
            let drive = |i: usize, (_, rate, acceleration): (f64, f64, f64)| {
                let own = rotors[i] * acceleration + 2.0 * rate + 3.0 * (rate / 0.01).tanh();
                (rigid[i] + own) / if currents { 8.0 } else { 1.0 }
            };
            vec![t, a.0, b.0, drive(0, a), drive(1, b)]
        }
    };
    let robot = RigInitOptions { urdf: Some(urdf.clone()), ..options() };
    for (header, currents) in
        [("t_s,shoulder_pos_rad,elbow_pos_rad,tau_nm_1,tau_nm_2", false), ("t_s,q_rad_1,q_rad_2,i_a_1,i_a_2", true)]
    {
        let path = log(folder.path(), "a.csv", header, 5000, row(currents));
        let proposed = propose(&path, &robot).unwrap_or_else(|error| panic!("{header}: {error}"));
        assert_eq!(proposed.kind, "robot");
        let keys: Vec<&str> = proposed.open.iter().map(|open| open.key.as_str()).collect();
        assert_eq!(keys, ["link_inertia", "payload", "repeatability"], "{:?}", proposed.robot);
        let values = ["\"5 %\"", "\"2 kg\"", "\"0.1 mm\""];
        let rig = load(folder.path(), &proposed, &values).expect("filled in");
        let RigModel::Robot(read) = &rig.plant else { panic!("a robot") };
        for (i, drive) in read.drives.iter().enumerate() {
            let near = |value: f64, truth: f64| {
                assert!((value / truth - 1.0).abs() < 0.15, "{header}, axis {}: {value} is not {truth}", i + 1);
            };
            near(drive.values.motor_inertia, rotors[i]);
            near(drive.values.coulomb, 3.0);
            near(drive.values.viscous, 2.0);
            near(rig.log[&format!("tau.{}", i + 1)].factor, if currents { 8.0 } else { 1.0 });
        }
        let model = Robot::load(&folder.path().join("rig_robot.toml")).expect("the model file");
        assert_eq!(model.joints[1].name, "elbow");
    }
    // Another number of joints is an error, and a fault of the URDF has its line.
    let path = log(folder.path(), "b.csv", "t_s,q_rad_1,tau_nm_1", 500, |n| vec![n as f64 * 0.004, 0.1, 0.2]);
    let error = propose(&path, &robot).expect_err("one joint").to_string();
    assert!(error.contains("positions of 1 joints, and the URDF has 2"), "{error}");
    std::fs::write(&urdf, URDF.replace("mass value=\"2\"", "mass value=\"-2\"")).expect("a file");
    let RigInitError::Urdf(problems) = propose(&path, &robot).expect_err("a mass below 0") else { panic!("a URDF") };
    let problem = problems.into_iter().next().expect("one");
    assert_eq!((problem.line, problem.key.as_str()), (8, "link[lower].mass"));
}
