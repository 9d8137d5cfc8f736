//! Columns of the log: maps the declared contents of a record to named scalar values.

use crate::signals::WireState;
use crate::signals::{AXES, LinkCounters, RAIL};
use crate::time::Nanos;
use softdock_kernels::fields::{self, Field, join, unit_suffix};
use softdock_kernels::space::{Motion, Wrench};
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};

/// Type of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// A real number; the quiet NaN of `f64::NAN` means missing.
    Real,
    /// A signed integer: times.
    Signed,
    /// An unsigned integer: counts, wide flags.
    Whole,
    /// A short unsigned integer: flags, counts of a protocol.
    Word,
    /// An index into an enumeration.
    Code(&'static [&'static str]),
}

/// One value of a record.
#[derive(Clone, Copy, Debug)]
pub enum LogValue {
    /// Of [`Type::Real`].
    Real(f64),
    /// Of [`Type::Signed`].
    Signed(i64),
    /// Of [`Type::Whole`].
    Whole(u64),
    /// Of [`Type::Word`] and [`Type::Code`].
    Word(u32),
}

impl LogValue {
    /// Missing value, the initial contents of a column.
    pub const fn blank(column: Type) -> Self {
        match column {
            Type::Real => Self::Real(f64::NAN),
            Type::Signed => Self::Signed(0),
            Type::Whole => Self::Whole(0),
            Type::Word | Type::Code(_) => Self::Word(0),
        }
    }

    /// Returns the bits of the value, of any type.
    pub const fn bits(self) -> u64 {
        match self {
            Self::Real(value) => value.to_bits(),
            Self::Signed(value) => value as u64,
            Self::Whole(value) => value,
            Self::Word(value) => value as u64,
        }
    }

    /// Returns the real number; NaN for another type.
    pub const fn real(self) -> f64 {
        match self {
            Self::Real(value) => value,
            Self::Signed(_) | Self::Whole(_) | Self::Word(_) => f64::NAN,
        }
    }

    /// Returns the signed integer; 0 for a real number.
    pub const fn signed(self) -> i64 {
        match self {
            Self::Real(_) => 0,
            other => other.bits() as i64,
        }
    }
}

/// Bitwise equality: a NaN equals itself, and 0 differs from -0.
impl PartialEq for LogValue {
    fn eq(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other) && self.bits() == other.bits()
    }
}

/// One column of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogColumn {
    /// snake_case, with the unit as a suffix (`robot_1_position_1_rad`).
    pub name: String,
    /// SI unit, `ns` for times that must be exact, `1` for a pure number.
    pub unit: &'static str,
    /// Meaning of the value, with its frame.
    pub meaning: String,
    /// Its type.
    pub kind: Type,
}

/// A value in the log: a scalar, or a fixed list of scalars in a fixed order.
pub trait Logged: Copy {
    /// The blank value: reals are NaN, integers 0.
    const BLANK: Self;
    /// Appends one [`LogColumn`] per scalar.
    fn describe(name: &str, unit: &'static str, meaning: &str, out: &mut Vec<LogColumn>);
    /// Passes its scalars to a function.
    fn write(&self, sink: &mut impl FnMut(LogValue));
    /// Builds the value from its scalars.
    fn read(source: &mut impl FnMut() -> LogValue) -> Self;
}

/// Returns the columns of a logged value.
pub fn columns<L: Logged>() -> Vec<LogColumn> {
    let mut out = Vec::new();
    L::describe("", "1", "", &mut out);
    out
}

/// Writes a logged value into a buffer of its table's length; allocates nothing.
pub fn store<L: Logged>(value: &L, buffer: &mut [LogValue]) {
    let mut places = buffer.iter_mut();
    value.write(&mut |value| *places.next().expect("a buffer as long as the table") = value);
}

/// Reads a logged value from a buffer of its table's length.
pub fn load<L: Logged>(buffer: &[LogValue]) -> L {
    let mut values = buffer.iter();
    L::read(&mut || *values.next().expect("a buffer as long as the table"))
}

/// Returns the column of one scalar.
pub(crate) fn scalar(name: &str, unit: &'static str, meaning: &str, kind: Type) -> LogColumn {
    let suffix = unit_suffix(unit);
    let name = if suffix.is_empty() { name.to_owned() } else { format!("{name}_{suffix}") };
    LogColumn { name, unit, meaning: meaning.to_owned(), kind }
}

/// Joins the meaning of a part to that of its whole.
pub(crate) fn within(whole: &str, part: &str) -> String {
    match (whole, part) {
        ("", alone) | (alone, "") => alone.to_owned(),
        _ => format!("{whole}: {part}"),
    }
}

/// Declares a scalar of the log: type, column type, blank value, to and from [`LogValue`].
macro_rules! scalar {
    ($ty:ty, $kind:expr, $blank:expr, $value:ident => $to:expr, $variant:ident($inner:ident) => $from:expr) => {
        impl Logged for $ty {
            const BLANK: Self = $blank;
            fn describe(name: &str, unit: &'static str, meaning: &str, out: &mut Vec<LogColumn>) {
                out.push(scalar(name, unit, meaning, $kind));
            }
            fn write(&self, sink: &mut impl FnMut(LogValue)) {
                let $value = *self;
                sink(LogValue::$variant($to));
            }
            fn read(source: &mut impl FnMut() -> LogValue) -> Self {
                match source() {
                    LogValue::$variant($inner) => $from,
                    _ => Self::BLANK,
                }
            }
        }
    };
}

scalar!(f64, Type::Real, f64::NAN, value => value, Real(real) => real);
scalar!(u64, Type::Whole, 0, value => value, Whole(whole) => whole);
scalar!(u32, Type::Word, 0, value => value, Word(word) => word);
scalar!(Nanos, Type::Signed, Nanos(0), value => value.0, Signed(time) => Nanos(time));

macro_rules! code {
    ($($ty:ident),*) => {$(
        impl Logged for super::codes::$ty {
            const BLANK: Self = Self::ALL[0];
            fn describe(name: &str, unit: &'static str, meaning: &str, out: &mut Vec<LogColumn>) {
                let words = Self::WORDS.iter().enumerate().map(|(code, word)| format!("{code} {word}"));
                let meaning = format!("{meaning}: {}", words.collect::<Vec<_>>().join(", "));
                out.push(scalar(name, unit, &meaning, Type::Code(Self::WORDS)));
            }
            fn write(&self, sink: &mut impl FnMut(LogValue)) {
                sink(LogValue::Word(self.code()));
            }
            fn read(source: &mut impl FnMut() -> LogValue) -> Self {
                match source() {
                    LogValue::Word(code) => Self::from_code(code),
                    _ => Self::BLANK,
                }
            }
        }
    )*};
}

code!(Phase, StopCause, OrderKind);

/// Axes count from 1; the rail is last, in the unit of a linear axis.
impl Logged for [f64; AXES] {
    const BLANK: Self = [f64::NAN; AXES];
    fn describe(name: &str, unit: &'static str, meaning: &str, out: &mut Vec<LogColumn>) {
        for axis in 0..RAIL {
            f64::describe(&join(name, &(axis + 1).to_string()), unit, &within(meaning, "joint"), out);
        }
        let straight = match unit {
            "rad" => "m",
            "N m" => "N",
            other => other,
        };
        f64::describe(&join(name, "rail"), straight, &within(meaning, "rail"), out);
    }
    fn write(&self, sink: &mut impl FnMut(LogValue)) {
        self.iter().for_each(|value| sink(LogValue::Real(*value)));
    }
    fn read(source: &mut impl FnMut() -> LogValue) -> Self {
        std::array::from_fn(|_| f64::read(source))
    }
}

/// Structs declared by the kernels keep their own names, units and meanings.
macro_rules! bundled {
    ($ty:ty, $blank:expr) => {
        impl Logged for $ty {
            const BLANK: Self = $blank;
            fn describe(name: &str, unit: &'static str, meaning: &str, out: &mut Vec<LogColumn>) {
                let mut parts: Vec<Field> = Vec::new();
                <$ty as fields::Bundle<f64>>::describe(name, unit, "", &mut parts);
                for field in parts {
                    out.push(scalar(&field.name, field.unit, &within(meaning, field.meaning), Type::Real));
                }
            }
            fn write(&self, sink: &mut impl FnMut(LogValue)) {
                fields::Bundle::<f64>::write(self, &mut |value| sink(LogValue::Real(value)));
            }
            fn read(source: &mut impl FnMut() -> LogValue) -> Self {
                <$ty as fields::Bundle<f64>>::read(&mut || f64::read(source))
            }
        }
    };
}

const NO_VECTOR: Vec3<f64> = vec3(f64::NAN, f64::NAN, f64::NAN);
const NO_ATTITUDE: Quat<f64> = Quat { w: f64::NAN, v: NO_VECTOR };

bundled!(Vec3<f64>, NO_VECTOR);
bundled!(Quat<f64>, NO_ATTITUDE);
bundled!(Wrench<f64>, Wrench { force: NO_VECTOR, moment: NO_VECTOR });
bundled!(Motion<f64>, Motion { position: NO_VECTOR, attitude: NO_ATTITUDE, velocity: NO_VECTOR, omega: NO_VECTOR });

/// Implements [`Logged`] for a struct of logged fields: `name: type, unit, meaning;` per field.
macro_rules! logged {
    ($name:ty { $($field:ident : $ty:ty, $unit:literal, $meaning:literal;)* }) => {
        impl $crate::log::table::Logged for $name {
            const BLANK: Self = Self { $($field: <$ty as $crate::log::table::Logged>::BLANK,)* };
            fn describe(name: &str, _unit: &'static str, meaning: &str, out: &mut Vec<$crate::log::table::LogColumn>) {
                $(<$ty as $crate::log::table::Logged>::describe(
                    &softdock_kernels::fields::join(name, stringify!($field)),
                    $unit,
                    &$crate::log::table::within(meaning, $meaning),
                    out,
                );)*
            }
            fn write(&self, sink: &mut impl FnMut($crate::log::table::LogValue)) {
                $($crate::log::table::Logged::write(&self.$field, sink);)*
            }
            fn read(source: &mut impl FnMut() -> $crate::log::table::LogValue) -> Self {
                Self { $($field: <$ty as $crate::log::table::Logged>::read(source),)* }
            }
        }
    };
}

/// Declares a struct and its columns in the log.
macro_rules! record {
    ($(#[$doc:meta])* $name:ident { $($field:ident : $ty:ty, $unit:literal, $meaning:literal;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name {
            $(#[doc = concat!($meaning, " \\[", $unit, "\\]")] pub $field: $ty,)*
        }
        logged!($name { $($field: $ty, $unit, $meaning;)* });
    };
}

logged!(Pose<f64> {
    position: Vec3<f64>, "m", "origin";
    attitude: Quat<f64>, "1", "rotation from its axes";
});

logged!(WireState {
    untaken: u64, "1", "answers that the robot has not taken";
    untaken_in_row: u32, "1", "successive answers that the robot has not taken";
    off_course: u32, "1", "successive cycles with a set-point that this machine has not sent";
    early: u32, "1", "early reports: the robot's cycle has become shorter";
    led_back: u32, "1", "successive cycles in which the robot is away from its commands and led back within its limits";
    moving: u32, "1", "1 while its commands move";
});

logged!(LinkCounters {
    received: u64, "1", "datagrams taken";
    lost: u64, "1", "lost datagrams, by the sender's own count";
    stale: u64, "1", "datagrams after a newer one, or repeated";
    malformed: u64, "1", "malformed datagrams";
    foreign: u64, "1", "datagrams from other hosts";
    overtaken: u64, "1", "reports replaced by a newer one before they were read";
    unsent: u64, "1", "answers not sent, because their cycle was over";
});
