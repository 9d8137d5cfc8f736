//! Cubes tossed onto a board, tracked by a camera: rigid bodies with impulsive impacts.

mod body;

use crate::catalogue::EffectCase;
use crate::random::Stream;
use crate::space::{Vector, from_angles, turned};
use crate::table::{Column, Table, column};
use crate::{Error, Hidden};
use body::{Body, Cube};

/// Effects of the catalogue.
const EFFECTS: &[EffectCase] = &[
    EffectCase::growing("K4_friction", ("coefficient", 0.12, ""), "dmu N").up_to(0.8),
    EffectCase::growing("K11_shape", ("radius", 0.005, "m"), "corners are balls of this radius").up_to(0.04),
    EffectCase::growing("P6_gravity", ("deficit", 0.2, "m/s^2"), "g - deficit").up_to(5.0),
];

/// From one frame to the next \[s\], and integration steps in it: 23 us.
const FRAME: f64 = 1.0 / 148.0;
const STEPS: usize = 300;
/// Frames of a toss.
const FRAMES: usize = 90;
/// Noise of a frame, each axis \[m, rad\].
const POSITION_NOISE: f64 = 2e-4;
const ATTITUDE_NOISE: f64 = 2e-3;

const COLUMNS: [Column; 9] = [
    column("toss", 0),
    column("t_s", 6),
    column("x_m", 6),
    column("y_m", 6),
    column("z_m", 6),
    column("qw", 6),
    column("qx", 6),
    column("qy", 6),
    column("qz", 6),
];

/// The model file's text.
const MODEL: &str = r#"schema = "rig/1"
kind = "toss"
id = "bench-toss"

[toss]
mass = "0.37 kg"
inertia = "0.00081 kg m^2"
half_width = "0.0524 m"
restitution = 0.125
friction = 0.18
stiffness = "300 N/mm"

[log]
"t" = { column = "t_s", unit = "s" }
"experiment" = { column = "toss", unit = "1" }
"position.x" = { column = "x_m", unit = "m" }
"position.y" = { column = "y_m", unit = "m" }
"position.z" = { column = "z_m", unit = "m" }
"orientation.w" = { column = "qw", unit = "1" }
"orientation.x" = { column = "qx", unit = "1" }
"orientation.y" = { column = "qy", unit = "1" }
"orientation.z" = { column = "qz", unit = "1" }
"#;

/// Data set of a tossed cube.
#[derive(Clone, Debug, PartialEq)]
pub struct Tosses {
    /// TOML text of the nominal model.
    pub model: String,
    /// CSV text of all tosses, numbered from 1.
    pub log: String,
}

/// Generates `count` tosses of a cube with hidden effects.
///
/// # Errors
/// An effect that a toss does not have, a size out of its range.
pub fn tosses(hidden: &[Hidden], count: u64, seed: u64) -> Result<Tosses, Error> {
    let mut cube = Cube {
        mass: 0.37,
        inertia: 8.1e-4,
        half: 0.0524,
        radius: 0.0,
        restitution: 0.125,
        friction: 0.18,
        gravity: 9.80665,
    };
    for &Hidden { id, size } in hidden {
        let Some(case) = EFFECTS.iter().find(|case| case.id == id) else {
            return Err(Error::UnknownEffect { id: id.into(), known: EFFECTS.iter().map(|case| case.id).collect() });
        };
        if !(size > case.smallest && size <= case.largest) {
            return Err(Error::Size { size, case: *case });
        }
        match id {
            "K4_friction" => cube.friction += size,
            "K11_shape" => cube.radius = size,
            _ => cube.gravity -= size,
        }
    }
    let mut table = Table::new(&COLUMNS);
    (1..=count).for_each(|number| record(&cube, number, seed, &mut table));
    Ok(Tosses { model: MODEL.into(), log: table.csv() })
}

/// One toss, frame by frame.
fn record(cube: &Cube, number: u64, seed: u64, table: &mut Table) {
    let mut throw = Stream::new(seed, "throw", number);
    let mut noise = Stream::new(seed, "camera", number);
    let [speed, heading] = [throw.between(0.6, 1.4), throw.between(0.0, std::f64::consts::TAU)];
    let mut body = Body {
        position: [0.0, 0.0, throw.between(0.16, 0.22)],
        attitude: from_angles([throw.between(-3.0, 3.0), throw.between(-1.4, 1.4), throw.between(-3.0, 3.0)]),
        velocity: [speed * heading.cos(), speed * heading.sin(), throw.between(-0.5, 0.5)],
        rate: throw.normals().map(|rate: f64| 3.0 * rate),
    };
    for frame in 0..FRAMES {
        let position: Vector = std::array::from_fn(|i| body.position[i] + POSITION_NOISE * noise.normal());
        let [w, i, j, k] = turned(body.attitude, noise.normals().map(|angle: f64| ATTITUDE_NOISE * angle));
        let [x, y, z] = position;
        table.push(&[number as f64, frame as f64 * FRAME, x, y, z, w, i, j, k]);
        (0..STEPS).for_each(|_| body.advance(cube, FRAME / STEPS as f64));
    }
}
