//! A viewer of a log places the robots of the URDF where the log states their parts.

use crate::fixture::{CYCLE, Setting};
use crate::urdf::{apart, pose_of};
use softdock_kernels::vector::{Pose, Quat, vec3};
use softdock_realtime::clock::Virtual;
use softdock_realtime::drive::session::Session;
use softdock_realtime::emulation::in_process::{InProcessRig, links};
use softdock_realtime::log::cdr::Decoder;
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::log::mcap::{LogFile, Setup};
use softdock_realtime::log::reader::LogReader;
use softdock_realtime::log::scene::{LABORATORY_FRAME, LoggedScene};
use softdock_realtime::log::topics::default_names;
use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;
use std::rc::Rc;

/// Returns the log of a session of emulated robots.
fn logged(setting: &Setting) -> Vec<u8> {
    let clock = Virtual::default();
    let bench = InProcessRig::new(setting.world(), Rc::new(clock.clone()), CYCLE);
    let mut session = Session::new(setting.task(), links(&bench), None, Rc::new(clock)).expect("a drive");
    session.go();
    let scene = LoggedScene::new(&setting.plant, &setting.station, &default_names()).expect("in reach");
    let setup = Setup { scene: Some(scene), ..Setup::default() };
    let mut log = LogFile::new(Cursor::new(Vec::new()), &setup).expect("a log");
    for _ in 0..40_000 {
        let over = session.cycle(None);
        log.write(session.record()).expect("a record");
        if over {
            assert_eq!(session.record().cause, StopCause::Completed);
            return log.finish().expect("an end").1.into_inner();
        }
    }
    panic!("the session does not end");
}

/// Reads past a std_msgs/Header; returns its frame.
fn header<'a>(read: &mut Decoder<'a>) -> &'a str {
    read.i32().and_then(|_| read.u32()).expect("a stamp");
    read.string().expect("a frame")
}

fn number(read: &mut Decoder) -> f64 {
    read.f64().expect("a number")
}

/// Names and positions of a sensor_msgs/JointState.
fn joint_state(message: &[u8]) -> BTreeMap<String, f64> {
    let mut read = Decoder::new(message).expect("CDR");
    header(&mut read);
    let count = read.u32().expect("a count");
    let names: Vec<String> = (0..count).map(|_| read.string().expect("a name").to_owned()).collect();
    assert_eq!(read.u32(), Some(count));
    names.into_iter().map(|name| (name, number(&mut read))).collect()
}

/// Parents and poses of a tf2_msgs/TFMessage, by their frames.
fn transforms(message: &[u8]) -> HashMap<String, (String, Pose<f64>)> {
    let mut read = Decoder::new(message).expect("CDR");
    let count = read.u32().expect("a count");
    let rows = (0..count).map(|_| {
        let parent = header(&mut read).to_owned();
        let child = read.string().expect("a frame").to_owned();
        let [x, y, z, qx, qy, qz, w] = std::array::from_fn(|_| number(&mut read));
        (child, (parent, Pose { position: vec3(x, y, z), attitude: Quat { w, v: vec3(qx, qy, qz) } }))
    });
    rows.collect()
}

/// Pose of a frame in the laboratory.
fn in_laboratory(frames: &HashMap<String, (String, Pose<f64>)>, frame: &str) -> Pose<f64> {
    if frame == LABORATORY_FRAME {
        return Pose::identity();
    }
    let (parent, pose) = frames.get(frame).unwrap_or_else(|| panic!("no transform of {frame}"));
    in_laboratory(frames, parent).compose(*pose)
}

#[test]
fn urdf_and_joint_states_match_logged_tools_and_parts() {
    let bytes = logged(&Setting::docking());
    let records: Vec<_> = LogReader::new(&bytes[..]).map(|record| record.expect("a record")).collect();
    let (mut urdf, mut fixed, mut states) = (None, HashMap::new(), BTreeMap::new());
    let (mut compared, mut moved, mut first) = (0, 0.0_f64, None);
    for message in mcap::MessageStream::new(&bytes).expect("a file") {
        let message = message.expect("a message");
        let (topic, data, number) = (message.channel.topic.as_str(), &message.data, message.sequence as usize);
        match topic {
            "/robot_description" => {
                let text = Decoder::new(data).and_then(|mut read| read.string().map(str::to_owned)).expect("a text");
                urdf = Some(urdf_rs::read_from_string(&text).expect("a URDF"));
            }
            "/tf_static" => fixed = transforms(data),
            "/robot_1/joint_states" | "/robot_2/joint_states" => states.extend(joint_state(data)),
            "/tf" => {
                let (urdf, mut frames) = (urdf.as_ref().expect("described first"), transforms(data));
                if frames.len() < 15 {
                    continue; // No robot has reported yet.
                }
                frames.extend(fixed.clone());
                let record = &records[number];
                for (robot, (report, part)) in
                    [(&record.robot_1, "part_a"), (&record.robot_2, "part_b")].into_iter().enumerate()
                {
                    let name = |frame: &str| format!("robot_{}_{frame}", robot + 1);
                    let [base, tool, held] = ["base", "tool", "part"].map(|frame| pose_of(urdf, &name(frame), &states));
                    let reported = base.inverse().compose(tool);
                    assert!(apart(&reported, &report.tool) < 1e-9, "tool of robot {}", robot + 1);
                    for frame in ["base", "link_1", "link_6", "tool", "part"].map(name) {
                        let of_urdf = pose_of(urdf, &frame, &states);
                        assert!(apart(&of_urdf, &in_laboratory(&frames, &frame)) < 1e-9, "{frame}");
                    }
                    assert!(apart(&held, &in_laboratory(&frames, part)) < 1e-9, "{part} in record {number}");
                }
                let held = pose_of(urdf, "robot_1_part", &states);
                moved = moved.max((held.position - first.get_or_insert(held).position).norm());
                let sensor = pose_of(urdf, "ft_sensor", &states);
                assert!(apart(&sensor, &in_laboratory(&frames, "ft_sensor")) < 1e-9, "the sensor");
                compared += 1;
            }
            _ => {}
        }
    }
    assert!(compared > 500 && moved > 0.01, "{compared} of {} records compared", records.len());
}
