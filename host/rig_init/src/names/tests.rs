//! Names of real tools.

use super::*;

#[test]
fn names_of_real_tools_are_understood() {
    use Meaning::*;
    use Origin::{Derived, Link, Magnitude, Measured, Plain, Reference};
    /// Name, quantity, origin, axis, component, unit.
    type Case = (&'static str, Meaning, Origin, Option<u32>, Option<char>, Option<&'static str>);
    let cases: &[Case] = &[
        // UR RTDE.
        ("timestamp", Time, Plain, None, None, None),
        ("actual_q_0", Position, Measured, Some(0), None, None),
        ("target_qd_5", Rate, Reference, Some(5), None, None),
        ("target_qdd_2", Acceleration, Reference, Some(2), None, None),
        ("actual_current_3", Current, Measured, Some(3), None, None),
        ("target_moment_1", Torque, Reference, Some(1), None, None),
        ("actual_TCP_force_2", Force, Measured, None, Some('z'), None),
        ("actual_TCP_force_3", Moment, Measured, None, Some('x'), None),
        // ROS 2.
        ("/joint_states/position[0]", Position, Plain, Some(0), None, None),
        ("/joint_states/effort[5]", Torque, Plain, Some(5), None, None),
        ("/joint_states/velocity[2]", Rate, Plain, Some(2), None, None),
        ("/ft/wrench/force/x", Force, Plain, None, Some('x'), None),
        ("/ft/wrench/torque/z", Moment, Plain, None, Some('z'), None),
        ("/pose/orientation/w", Orientation, Plain, None, Some('w'), None),
        ("/imu/angular_velocity/y", BodyRate, Plain, None, Some('y'), None),
        ("/imu/linear_acceleration/y", BodyAcceleration, Plain, None, Some('y'), None),
        ("%time", Time, Plain, None, None, None),
        // KUKA RSI.
        ("AIPos.A1", Position, Measured, Some(1), None, None),
        ("ASPos.A6", Position, Reference, Some(6), None, None),
        ("MACur.A3", Current, Measured, Some(3), None, None),
        // Staubli and dSPACE.
        ("J4", Position, Plain, Some(4), None, None),
        ("Model Root/Out/q1[rad]", Position, Plain, Some(1), None, Some("rad")),
        ("Model Root/Out/tau2[Nm]", Torque, Plain, Some(2), None, Some("N m")),
        ("speed (deg/s)", Rate, Plain, None, None, Some("deg/s")),
        // Units at the end.
        ("t_s", Time, Plain, None, None, Some("s")),
        ("sys_time_us", Time, Plain, None, None, Some("us")),
        ("ref_pos_deg_1", Position, Reference, Some(1), None, Some("deg")),
        ("mot_vel_deg_s_2", Rate, Measured, Some(2), None, Some("deg/s")),
        ("link_pos_deg_3", Position, Link, Some(3), None, Some("deg")),
        ("tau_abs_nm_1", Torque, Plain, Some(1), None, Some("N m")),
        ("tau_ff_nm_1", Torque, Derived, Some(1), None, Some("N m")),
        ("torque_magnitude_1", Torque, Magnitude, Some(1), None, None),
        ("ddq_target_rad_s2_0", Acceleration, Reference, Some(0), None, Some("rad/s^2")),
        ("i_a_1", Current, Plain, Some(1), None, Some("A")),
        ("u_volt", Voltage, Plain, None, None, Some("V")),
        ("command_rad_1", Position, Reference, Some(1), None, Some("rad")),
        ("q_meas_m", Position, Measured, None, None, Some("m")),
        ("fx_n", Force, Plain, None, Some('x'), Some("N")),
        ("tz_nm", Moment, Plain, None, Some('z'), Some("N m")),
        ("qw", Orientation, Plain, None, Some('w'), None),
        ("px_m", Place, Plain, None, Some('x'), Some("m")),
        ("z_m", Place, Plain, None, Some('z'), Some("m")),
        ("wx_rad_s", BodyRate, Plain, None, Some('x'), Some("rad/s")),
        ("vx_m_s", Speed, Plain, None, Some('x'), Some("m/s")),
        ("toss", Experiment, Plain, None, None, None),
        ("k", Frame, Plain, None, None, None),
        ("sent_cmd", Event, Reference, None, None, None),
        ("q1", Position, Plain, Some(1), None, None),
        ("i1", Current, Plain, Some(1), None, None),
        ("vel_deg_s", Rate, Plain, None, None, Some("deg/s")),
    ];
    for (name, meaning, origin, axis, component, unit) in cases {
        let expected =
            ColumnName { meaning: Some(*meaning), origin: *origin, axis: *axis, component: *component, unit: *unit };
        assert_eq!(ColumnName::of(name), expected, "{name}");
    }
    for name in ["temperature", "comment", "x, y"] {
        assert_eq!(ColumnName::of(name).meaning, None, "{name}");
    }
}
