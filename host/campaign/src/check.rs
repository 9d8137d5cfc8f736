//! From values as written to numbers in SI: units, ranges and lengths of lists, every problem noted.

use crate::problem::{LISTED, Problem, Problems};
use crate::ranges::{in_words, legal};
use crate::source::Source;
use crate::units::{UnitError, noun, quantity, show, suggestions};
use crate::written::scenario::InertiaTable;
use crate::written::{At, ParameterKey, Quantities, Quantity, Scalar};
use softdock_kernels::fields::{Bundle, fields, from_slice, join, to_vec};
use softdock_kernels::params::{self, Params};
use softdock_kernels::range::{ANGLE, INERTIA, LENGTH, Range};
use softdock_kernels::vector::{Pose, Quat, Sym3, Vec3, vec3};
use std::ops::Range as Span;

/// Value of a key that `softdock rig init` cannot derive: every reader refuses it and names the key.
pub const FILL_IN: &str = "fill in";

/// Reads the values of one file and collects what is wrong with them.
///
/// After a problem a reader gives a harmless value, so that the rest of the file is read too; nothing built from it
/// gets out, because the caller ends with [`Problems::check`](crate::problem::Problems::check).
pub(crate) struct Checker {
    pub(crate) source: Source,
    pub(crate) problems: Vec<Problem>,
    /// Files that need not be read again: those of the same scenario with other values.
    pub(crate) known: Vec<Source>,
}

impl Checker {
    pub(crate) fn new(source: Source) -> Self {
        Self { source, problems: Vec::new(), known: Vec::new() }
    }

    /// A file that a key of this one names, by its path relative to this file.
    pub(crate) fn read_beside(&self, written: &At<String>) -> Result<Source, Problems> {
        let path = self.source.sibling(&written.value);
        match self.known.iter().find(|known| known.path() == path) {
            Some(known) => Ok(known.clone()),
            None => Source::read(&path, Some((&self.source, written.span.clone()))),
        }
    }

    /// Notes a problem.
    pub(crate) fn refuse(&mut self, span: &Span<usize>, message: impl Into<String>, remedy: impl Into<String>) {
        // Those that are not listed are only counted: their places take long to find in a long file.
        let problem = match self.problems.len() < LISTED {
            true => Problem::at(&self.source, span.clone(), message).remedy(remedy),
            false => Problem::with_file(self.source.path().to_owned(), message),
        };
        self.problems.push(problem);
    }

    /// A number in SI from a scalar at a place.
    pub(crate) fn scalar(&mut self, scalar: &Scalar, span: &Span<usize>, unit: &str, range: Range) -> f64 {
        let harmless = range.max.min(1.0).max(range.min);
        if let Scalar::Text(text) = scalar
            && text == FILL_IN
        {
            let allowed = in_words(range, unit);
            let example = show_example(if range.contains(1.5) { "1.5" } else { "0.5" }, unit);
            self.refuse_open(span, &allowed, format!("write a value {allowed}, as in {example}"));
            return harmless;
        }
        let value = match scalar {
            Scalar::Number(number) if !number.is_finite() => Err(UnitError::NotANumber),
            Scalar::Number(number) if unit == "1" => Ok(*number),
            Scalar::Number(_) => Err(UnitError::Bare),
            Scalar::Text(text) => quantity(text, unit),
        };
        match value {
            Ok(value) if range.contains(value) => value,
            Ok(value) => {
                let allowed = in_words(range, unit);
                let shown = show(value, unit);
                let problem = Problem::at(&self.source, span.clone(), format!("{shown} is out of range"))
                    .expected(allowed.clone())
                    .remedy(format!("write a value {allowed}"));
                self.problems.push(problem);
                harmless
            }
            Err(error) => {
                self.problems.push(self.unit_problem(scalar, span, unit, &error));
                harmless
            }
        }
    }

    /// Refuses a key that still has the value [`FILL_IN`].
    pub(crate) fn refuse_open(&mut self, span: &Span<usize>, expected: &str, remedy: impl Into<String>) {
        let key = self.source.key_at(span);
        let message = format!("fill in `{key}`: the value is still open");
        self.problems.push(Problem::at(&self.source, span.clone(), message).expected(expected).remedy(remedy));
    }

    fn unit_problem(&self, scalar: &Scalar, span: &Span<usize>, unit: &str, error: &UnitError) -> Problem {
        let expected = format!("{}: {}", noun(unit), suggestions(unit));
        let number = match scalar {
            Scalar::Number(number) => number.to_string(),
            Scalar::Text(text) => text.split([' ', '%']).next().unwrap_or("1").to_owned(),
        };
        let example = show_example(&number, unit);
        let (message, remedy) = match error {
            UnitError::NotANumber => {
                ("this is not a finite number".into(), format!("write {}", show_example("1.5", unit)))
            }
            UnitError::Bare => (format!("{} needs its unit", noun(unit)), format!("write {example}")),
            UnitError::Unknown { symbol, near } => (
                format!("there is no unit `{symbol}`"),
                near.map_or_else(|| format!("write {example}"), |near| format!("did you mean `{near}`?")),
            ),
            UnitError::Foreign { symbol, factor, si } => {
                (format!("the unit `{symbol}` is not read"), format!("1 {symbol} is {factor} {si}"))
            }
            UnitError::Malformed => (
                "this unit cannot be read".into(),
                format!("write products first and then each divisor, as in {example}"),
            ),
            UnitError::Mismatch { found } => {
                (format!("this is {found}, not {}", noun(unit)), format!("write {example}"))
            }
        };
        Problem::at(&self.source, span.clone(), message).expected(expected).remedy(remedy)
    }

    pub(crate) fn number(&mut self, written: &Quantity, unit: &str, range: Range) -> f64 {
        self.scalar(&written.value, &written.span, unit, range)
    }

    pub(crate) fn number_or(&mut self, written: &Option<Quantity>, default: f64, unit: &str, range: Range) -> f64 {
        written.as_ref().map_or(default, |written| self.number(written, unit, range))
    }

    /// The nominal value of a parameter, in the unit and range of its field.
    pub(crate) fn parameter(&mut self, written: &Quantity, field: &str) -> f64 {
        self.number(written, unit_of(field), legal(field))
    }

    /// The nominal value of a parameter in SI, or `default` without one; a value out of range is a problem.
    pub(crate) fn parameter_or(&mut self, written: &Option<Quantity>, field: &str, default: f64) -> f64 {
        written.as_ref().map_or(default, |written| self.parameter(written, field))
    }

    /// Takes parameters from the keys that hold them, each in the unit and range of its row. The others stay as they are: at
    /// their null values, until something else has given them another.
    pub(crate) fn take(&mut self, keys: Vec<(&'static str, ParameterKey<'_>)>, p: &mut Params<f64>) {
        self.take_of("", keys, p);
    }

    /// [`Self::take`] of a bundle within the parameters, whose rows begin with its name.
    pub(crate) fn take_of<B: Bundle<f64>>(
        &mut self,
        name: &str,
        keys: Vec<(&'static str, ParameterKey<'_>)>,
        bundle: &mut B,
    ) {
        let (fields, mut values) = (fields::<f64, B>(), to_vec::<f64, B>(bundle));
        for (field, key) in keys {
            let row = join(name, field);
            let at = |field: &str| fields.iter().position(|row| row.name == field).expect("a field of the bundle");
            match key {
                ParameterKey::Number(written) => values[at(field)] = self.parameter(written, &row),
                ParameterKey::Vector(written) => {
                    let Vec3 { x, y, z } = self.vector(written, unit_of(&join(&row, "x")), legal(&row));
                    let first = at(&join(field, "x"));
                    values[first..first + 3].copy_from_slice(&[x, y, z]);
                }
            }
        }
        *bundle = from_slice(&values);
    }

    /// A list of exactly `count` numbers.
    pub(crate) fn list(&mut self, written: &Quantities, count: usize, unit: &str, range: Range) -> Vec<f64> {
        if written.value.len() != count {
            let found = written.value.len();
            let remedy = format!("write {count} values in brackets, each as {}", show_example("1.5", unit));
            self.refuse(&written.span, format!("{found} values where {count} belong"), remedy);
            return vec![range.max.min(1.0).max(range.min); count];
        }
        written.value.iter().map(|item| self.number(item, unit, range)).collect()
    }

    /// A list with one number for each of the units, which belong to joints.
    pub(crate) fn list_of(&mut self, written: &Quantities, units: &[&str], range: Range) -> Vec<f64> {
        if written.value.len() != units.len() {
            return self.list(written, units.len(), units.first().unwrap_or(&"1"), range);
        }
        written.value.iter().zip(units).map(|(item, unit)| self.number(item, unit, range)).collect()
    }

    pub(crate) fn vector(&mut self, written: &Quantities, unit: &str, range: Range) -> Vec3<f64> {
        let list = self.list(written, 3, unit, range);
        vec3(list[0], list[1], list[2])
    }

    pub(crate) fn vector_or_zero(&mut self, written: &Option<Quantities>, unit: &str, range: Range) -> Vec3<f64> {
        written.as_ref().map_or(Vec3::zero(), |written| self.vector(written, unit, range))
    }

    /// A pose from a position and roll, pitch, yaw (about fixed axes, as in URDF).
    pub(crate) fn pose(&mut self, position: &Option<Quantities>, rotation: &Option<Quantities>) -> Pose<f64> {
        let position = self.vector_or_zero(position, "m", Range::size(LENGTH));
        let rpy = self.vector_or_zero(rotation, "rad", Range::size(ANGLE));
        Pose { position, attitude: from_roll_pitch_yaw(rpy) }
    }

    /// An inertia tensor; whether a body can have it is not checked here.
    pub(crate) fn inertia(&mut self, t: &InertiaTable) -> Sym3<f64> {
        let unit = "kg m^2";
        let (moment, product) = (Range::above(0.0, INERTIA), Range::size(INERTIA));
        Sym3 {
            xx: self.number(&t.ixx, unit, moment),
            yy: self.number(&t.iyy, unit, moment),
            zz: self.number(&t.izz, unit, moment),
            xy: self.number_or(&t.ixy, 0.0, unit, product),
            xz: self.number_or(&t.ixz, 0.0, unit, product),
            yz: self.number_or(&t.iyz, 0.0, unit, product),
        }
    }

    /// One of several words.
    pub(crate) fn choice<T: Copy>(&mut self, written: &At<String>, choices: &[(&str, T)]) -> T {
        if let Some(choice) = choices.iter().find(|choice| choice.0 == written.value) {
            return choice.1;
        }
        let words: Vec<&str> = choices.iter().map(|choice| choice.0).collect();
        if written.value == FILL_IN {
            self.refuse_open(&written.span, &words.join(", "), format!("write one of: {}", words.join(", ")));
            return choices[0].1;
        }
        let problem = Problem::at(&self.source, written.span.clone(), format!("`{}` is not known here", written.value))
            .expected(words.join(", "))
            .remedy(crate::suggest::suggestion(&written.value, &words));
        self.problems.push(problem);
        choices[0].1
    }

    /// A name that is used for files and folders.
    pub(crate) fn name(&mut self, written: &At<String>) -> String {
        let name = &written.value;
        let legal = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || name.len() > 64 || !name.chars().all(legal) || name.starts_with('-') {
            let remedy = "write letters, digits, - and _ (it names a folder), 64 at most";
            self.refuse(&written.span, "this cannot be a name", remedy);
        }
        name.clone()
    }

    /// A whole number in a range.
    pub(crate) fn count(&mut self, written: &At<u64>, min: u64, max: u64) -> u64 {
        if (min..=max).contains(&written.value) {
            return written.value;
        }
        let problem = Problem::at(&self.source, written.span.clone(), format!("{} is out of range", written.value))
            .expected(format!("a whole number from {min} to {max}"))
            .remedy(format!("write a whole number from {min} to {max}"));
        self.problems.push(problem);
        min
    }

    /// Refuses keys that the chosen kind does not take, and asks for those that it needs.
    ///
    /// `keys`: name, span if written, whether this kind takes it, whether it needs it.
    pub(crate) fn keys_of_kind(&mut self, kind: &At<String>, keys: &[(&str, Option<Span<usize>>, bool, bool)]) -> bool {
        let takes: Vec<&str> = keys.iter().filter(|key| key.2).map(|key| key.0).collect();
        let mut complete = true;
        for (name, span, taken, needed) in keys {
            match span {
                Some(span) if !taken => {
                    let message = format!("`{}` does not take the key `{name}`", kind.value);
                    self.refuse(span, message, format!("remove it; `{}` takes: {}", kind.value, takes.join(", ")));
                    complete = false;
                }
                None if *needed => {
                    let message = format!("`{}` needs the key `{name}`", kind.value);
                    self.refuse(
                        &kind.span,
                        message,
                        format!("add {name} = ...; `{}` takes: {}", kind.value, takes.join(", ")),
                    );
                    complete = false;
                }
                _ => {}
            }
        }
        complete
    }
}

/// SI unit of a field of `Params`.
fn unit_of(field: &str) -> &'static str {
    params::row_of(field).expect("the name of a field of Params").unit
}

/// `"1.5 N"`, or `0.5` for a pure number.
fn show_example(number: &str, unit: &str) -> String {
    let number = number.parse::<f64>().ok().filter(|n| n.is_finite()).map_or("1.5".to_owned(), |n| n.to_string());
    if unit == "1" { number } else { format!("\"{number} {unit}\"") }
}

/// The place of a value, if it is written.
pub(crate) fn span_of<T>(written: &Option<At<T>>) -> Option<Span<usize>> {
    written.as_ref().map(|written| written.span.clone())
}

/// Rotation by roll about x, then pitch about y, then yaw about z, all about fixed axes.
pub(crate) fn from_roll_pitch_yaw(rpy: Vec3<f64>) -> Quat<f64> {
    let about = |angle: f64, axis: Vec3<f64>| Quat { w: (0.5 * angle).cos(), v: axis * (0.5 * angle).sin() };
    let roll = about(rpy.x, vec3(1.0, 0.0, 0.0));
    let pitch = about(rpy.y, vec3(0.0, 1.0, 0.0));
    let yaw = about(rpy.z, vec3(0.0, 0.0, 1.0));
    yaw.compose(pitch).compose(roll).normalized()
}
