//! Columns of a drive's log, named as the driver of a facility names them.

use crate::table::{Column, column};

/// Decimals of poses, of rates, of wrenches.
const POSE: usize = 8;
const RATE: usize = 7;
const WRENCH: usize = 4;

/// Position and attitude of a part.
macro_rules! pose {
    ($part:literal) => {
        [
            column(concat!($part, "_position_x_m"), POSE),
            column(concat!($part, "_position_y_m"), POSE),
            column(concat!($part, "_position_z_m"), POSE),
            column(concat!($part, "_attitude_w"), POSE),
            column(concat!($part, "_attitude_x"), POSE),
            column(concat!($part, "_attitude_y"), POSE),
            column(concat!($part, "_attitude_z"), POSE),
        ]
    };
}

/// Velocity and rate of a part.
macro_rules! twist {
    ($part:literal) => {
        [
            column(concat!($part, "_velocity_x_m_per_s"), RATE),
            column(concat!($part, "_velocity_y_m_per_s"), RATE),
            column(concat!($part, "_velocity_z_m_per_s"), RATE),
            column(concat!($part, "_omega_x_rad_per_s"), RATE),
            column(concat!($part, "_omega_y_rad_per_s"), RATE),
            column(concat!($part, "_omega_z_rad_per_s"), RATE),
        ]
    };
}

/// Returns the columns: time, simulated and measured parts, and the wrench used by the simulation.
pub(crate) fn columns() -> Vec<Column> {
    let mut all = vec![column("tick", 0), column("time_ns", 0)];
    all.extend(pose!("simulated_part_a").into_iter().chain(twist!("simulated_part_a")));
    all.extend(pose!("simulated_part_b").into_iter().chain(twist!("simulated_part_b")));
    all.extend(pose!("part_a").into_iter().chain(pose!("part_b")));
    all.extend([
        column("ft_compensated_force_x_n", WRENCH),
        column("ft_compensated_force_y_n", WRENCH),
        column("ft_compensated_force_z_n", WRENCH),
        column("ft_compensated_moment_x_n_m", WRENCH),
        column("ft_compensated_moment_y_n_m", WRENCH),
        column("ft_compensated_moment_z_n_m", WRENCH),
    ]);
    all
}
