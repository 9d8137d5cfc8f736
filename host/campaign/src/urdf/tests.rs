//! Table and links of imported robots against the chain of the URDF, and faults with their line.

use super::*;
use crate::check::from_roll_pitch_yaw;
use softdock_kernels::manipulator::{link_frames, rigid_torques};

/// A chain of skew, parallel, intersecting and coincident axes.
const CHAIN: &str = r#"<robot name="skew">
  <link name="root"><inertial><mass value="4"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="a" type="revolute"><origin xyz="0.1 -0.2 0.3" rpy="0 0 0.4"/><axis xyz="0 0 1"/><parent link="root"/>
    <child link="l1"/><limit lower="-2" upper="3" effort="50" velocity="2"/><dynamics damping="1.5" friction="4"/></joint>
  <link name="l1"><inertial><origin xyz="0.1 0.2 0.3" rpy="0.3 0 0.1"/><mass value="3"/>
    <inertia ixx="0.3" iyy="0.2" izz="0.25" ixy="0.01" ixz="0.02" iyz="0"/></inertial></link>
  <joint name="b" type="revolute"><origin xyz="0.2 0.1 0.2" rpy="0.2 1.0 0.1"/><axis xyz="0 1 0"/><parent link="l1"/>
    <child link="l2"/><limit lower="-2" upper="2" effort="0" velocity="0"/></joint>
  <link name="l2"><inertial><origin xyz="0.2 0 0.1"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0.01"/></inertial></link>
  <joint name="c" type="continuous"><origin xyz="0.5 0.02 0"/><axis xyz="0 -1 0"/><parent link="l2"/><child link="l3"/></joint>
  <link name="l3"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="d" type="revolute"><origin xyz="0.3 0 0" rpy="0 0 0.7"/><axis xyz="1 0 0"/><parent link="l3"/>
    <child link="l4"/><limit lower="-2" upper="2" effort="5" velocity="1"/></joint>
  <link name="l4"><inertial><origin xyz="0.05 0.01 0"/><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"#;

/// Poses of the links' centres of mass, and the torques, of a chain by its own frames.
fn urdf_links(text: &str) -> Vec<Link> {
    {
        let source = Source::new("robot.urdf".into(), text.to_owned());
        arm::read(&source, Pose::identity(), BaseMass::Ignored, arm::Stated::default())
    }
    .expect("a chain")
    .links
}

fn check<const N: usize>(text: &str) {
    let robot = UrdfRobot::from_text(Path::new("robot.urdf"), text).expect("a robot");
    let links = urdf_links(text);
    assert_eq!(robot.joints.len(), N);
    let table = robot.rigid();
    let mut own = robot.rigid();
    own.joints.iter_mut().zip(&links).for_each(|(joint, link)| joint.link = *link);
    let base = Pose {
        position: vec3(robot.base[0], robot.base[1], robot.base[2]),
        attitude: from_roll_pitch_yaw(vec3(0.0, 0.0, robot.base_turn)),
    };
    let mut seed = 7_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) as f64 / f64::from(1 << 30) - 1.0
    };
    for _ in 0..20 {
        let (q, rate, acceleration): ([f64; N], [f64; N], [f64; N]) = (
            std::array::from_fn(|_| 2.0 * random()),
            std::array::from_fn(|_| random()),
            std::array::from_fn(|_| random()),
        );
        let (by_table, by_urdf) = (link_frames(&table, q), link_frames(&own, q));
        for i in 0..N {
            let com = |pose: Pose<f64>, link: &Link| pose.position + pose.attitude.rotate(link.com);
            let (table_com, urdf_com) =
                (com(base.compose(by_table[i]), &table.joints[i].link), com(by_urdf[i], &links[i]));
            assert!((table_com - urdf_com).norm() < 1e-12, "link {i}: {table_com:?} is not {urdf_com:?}");
        }
        let (by_table, by_urdf) =
            (rigid_torques(&table, q, rate, acceleration), rigid_torques(&own, q, rate, acceleration));
        for (a, b) in by_table.iter().zip(&by_urdf) {
            assert!((a - b).abs() < 1e-11, "{by_table:?} is not {by_urdf:?}");
        }
    }
}

#[test]
fn table_and_urdf_have_the_same_kinematics_and_torques() {
    check::<4>(CHAIN);
    // Axis 1 is tilted, then horizontal, then points downwards.
    check::<4>(&CHAIN.replace("rpy=\"0 0 0.4\"", "rpy=\"0.3 0.5 0.4\""));
    check::<4>(&CHAIN.replacen("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"1 0 0\"/>", 1));
    check::<4>(&CHAIN.replacen("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 -1\"/>", 1));
    // Coincident axes.
    check::<4>(&CHAIN.replace("xyz=\"0.5 0.02 0\"", "xyz=\"0 0.02 0\""));
    // A slender chain along its own axes: parallel and intersecting.
    check::<4>(&CHAIN.replace("rpy=\"0.2 1.0 0.1\"", "rpy=\"0 0 0\"").replace("rpy=\"0 0 0.7\"", ""));
}

#[test]
fn limits_and_friction_are_taken_where_they_are_stated() {
    let robot = UrdfRobot::from_text(Path::new("robot.urdf"), CHAIN).expect("a robot");
    let [a, b, c, _] = &robot.joints[..] else { panic!("four joints") };
    assert_eq!((a.effort, a.speed, a.damping, a.friction), (Some(50.0), Some(2.0), Some(1.5), Some(4.0)));
    assert_eq!((a.range, a.name.as_str()), (Some((-2.0, 3.0)), "a"));
    assert_eq!((b.effort, b.speed, b.damping, b.friction), (None, None, None, None));
    assert_eq!(c.range, None);
}

#[test]
fn fingers_are_fixed_and_a_sliding_axis_is_refused() {
    let finger = |name: &str, parent: &str| {
        format!(
            "<joint name=\"{name}\" type=\"prismatic\"><axis xyz=\"0 1 0\"/><parent link=\"{parent}\"/><child link=\"{name}l\"/>\
             <limit lower=\"0\" upper=\"0.04\" effort=\"20\" velocity=\"1\"/></joint><link name=\"{name}l\"/>"
        )
    };
    let gripper = CHAIN.replace("</robot>", &(finger("left", "l4") + &finger("right", "l4") + "</robot>"));
    let robot = UrdfRobot::from_text(Path::new("robot.urdf"), &gripper).expect("a robot with a gripper");
    assert_eq!((robot.joints.len(), robot.fixed.join(" ")), (4, "left right".to_owned()));
    let sliding = CHAIN.replacen("name=\"b\" type=\"revolute\"", "name=\"b\" type=\"prismatic\"", 1);
    let problem = UrdfRobot::from_text(Path::new("robot.urdf"), &sliding).expect_err("a sliding axis within the chain");
    assert_eq!(problem.into_iter().next().expect("one").key, "joint[b]");
}

#[test]
fn faults_are_named_with_line_and_element() {
    let faulty = CHAIN.replacen("mass value=\"2\"", "mass value=\"-2\"", 1);
    let problems = UrdfRobot::from_text(Path::new("robot.urdf"), &faulty).expect_err("a negative mass");
    let problem = problems.into_iter().next().expect("one");
    assert_eq!((problem.line, problem.key.as_str()), (9, "link[l2].mass"));
    let fixed = "<robot name=\"r\"><link name=\"a\"/></robot>";
    let problems = UrdfRobot::from_text(Path::new("robot.urdf"), fixed).expect_err("no joint");
    assert!(problems.into_iter().next().expect("one").message.contains("no joint that moves"));
}
