//! Legal ranges of numbers, and the largest sizes that a contact task can have.

/// From `min` to `max`; `above` excludes `min` itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Least value.
    pub min: f64,
    /// Greatest value, included.
    pub max: f64,
    /// The least value itself is not legal.
    pub above: bool,
}

impl Range {
    /// Both ends included.
    pub const fn within(min: f64, max: f64) -> Self {
        Self { min, max, above: false }
    }

    /// Above `min`, up to `max`.
    pub const fn above(min: f64, max: f64) -> Self {
        Self { min, max, above: true }
    }

    /// `-size` to `size`.
    pub const fn size(size: f64) -> Self {
        Self::within(-size, size)
    }

    /// Whether a value is legal.
    pub fn contains(&self, value: f64) -> bool {
        value <= self.max && if self.above { value > self.min } else { value >= self.min }
    }
}

/// Longest delay of the loop, of commands or of the sensor \[s\]: the span of the delay lines.
pub const MAX_DELAY_S: f64 = 0.128;

/// Half a turn: attitudes and angles \[rad\].
pub const HALF_TURN: f64 = std::f64::consts::PI;

/// A quarter turn: beyond it the start's rotation vector is no longer exact to rounding \[rad\].
pub const QUARTER_TURN: f64 = std::f64::consts::FRAC_PI_2;

// Largest lengths, speeds and so on that a contact task can have: wide, but far from the overflow of f32 squares.

/// Length \[m\].
pub const LENGTH: f64 = 1e3;
/// Speed \[m/s\].
pub const SPEED: f64 = 1e2;
/// Angular rate \[rad/s\].
pub const RATE: f64 = 1e2;
/// Mass \[kg\].
pub const MASS: f64 = 1e7;
/// Inertia \[kg m^2\].
pub const INERTIA: f64 = 1e9;
/// Force \[N\], moment \[N m\].
pub const FORCE: f64 = 1e9;
/// Stiffness \[N/m\], \[N m/rad\].
pub const STIFFNESS: f64 = 1e12;
/// Damping \[N s/m\], \[N m s/rad\].
pub const DAMPING: f64 = 1e9;
/// Angle \[rad\].
pub const ANGLE: f64 = 4.0 * HALF_TURN;

/// "No limit": far beyond any real sensor, far below the f32 overflow of its square.
pub const UNLIMITED: f64 = 1.0e15;

/// Most hooks of a latch.
pub const MOST_HOOKS: usize = 16;
