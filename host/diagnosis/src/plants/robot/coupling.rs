//! Torques of a motor that turns with the axis before its own.

/// Motion of all axes at an instant \[rad, rad/s, rad/s^2\], with their measured torques \[N m\].
#[derive(Clone, Copy)]
pub(super) struct Instant<const N: usize> {
    pub(super) angle: [f64; N],
    pub(super) rate: [f64; N],
    pub(super) acceleration: [f64; N],
    pub(super) torque: [f64; N],
}

/// Returns the torques on all axes per unit of the terms of a coupling: inertia, viscous and Coulomb friction of the motor,
/// reported torque; without what the motor loads its axis with while the one before rests.
///
/// `axis` counts from 0; `sign` is the direction of a rate.
pub(super) fn coupled<const N: usize>(
    now: &Instant<N>,
    axis: usize,
    ratio: f64,
    sign: impl Fn(f64) -> f64,
) -> [[f64; N]; 4] {
    let at = |own: f64, before: f64| -> [f64; N] {
        std::array::from_fn(|place| match place {
            _ if place == axis => own,
            _ if place + 1 == axis => before,
            _ => 0.0,
        })
    };
    let (rate, before) = (now.rate[axis], ratio * now.rate[axis - 1]);
    let (turned, turned_before) = (now.acceleration[axis], ratio * now.acceleration[axis - 1]);
    [
        at(turned_before, ratio * (turned + turned_before)),
        at(before, ratio * (rate + before)),
        at(sign(rate + before) - sign(rate), ratio * sign(rate + before)),
        at(0.0, ratio * now.torque[axis]),
    ]
}
