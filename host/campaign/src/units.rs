//! Units in files: a small table over SI, products, quotients and powers of its rows.

/// Exponents of metre, kilogram, second and radian.
///
/// The radian counts, so that a rotational stiffness is not taken for a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Dimension {
    metre: i32,
    kilogram: i32,
    second: i32,
    radian: i32,
}

impl Dimension {
    /// The dimension of a product with a power of another quantity.
    pub(crate) fn product(self, other: Self, power: i32) -> Self {
        self.times(other, power)
    }

    /// The dimension of the square root; `None` if an exponent is odd.
    pub(crate) fn root(self) -> Option<Self> {
        let all = [self.metre, self.kilogram, self.second];
        let [metre, kilogram, second] = all.map(|exponent| exponent / 2);
        all.iter().all(|exponent| exponent % 2 == 0).then_some(Self { metre, kilogram, second, radian: 0 })
    }

    /// The same without the radian: in a calculation an angle is a pure number.
    pub(crate) fn without_angle(self) -> Self {
        Self { radian: 0, ..self }
    }

    /// The dimension in base units, as a unit is written: `kg m/s^2`.
    pub(crate) fn text(self) -> String {
        let all = [("kg", self.kilogram), ("m", self.metre), ("s", self.second), ("rad", self.radian)];
        let product = |sign: i32| {
            let factors = all.iter().filter(|(_, exponent)| exponent * sign > 0);
            let factors = factors.map(|(symbol, exponent)| match exponent.abs() {
                1 => (*symbol).to_owned(),
                power => format!("{symbol}^{power}"),
            });
            factors.collect::<Vec<_>>()
        };
        let (over, under) = (product(1), product(-1));
        let over = if over.is_empty() { "1".to_owned() } else { over.join(" ") };
        match under.as_slice() {
            [] => over,
            [one] => format!("{over}/{one}"),
            several => format!("{over}/({})", several.join(" ")),
        }
    }

    fn times(self, other: Self, power: i32) -> Self {
        Self {
            metre: self.metre + power * other.metre,
            kilogram: self.kilogram + power * other.kilogram,
            second: self.second + power * other.second,
            radian: self.radian + power * other.radian,
        }
    }
}

/// A unit: SI value = number * numerator / denominator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unit {
    numerator: f64,
    denominator: f64,
    pub(crate) dimension: Dimension,
}

const NONE: Unit =
    Unit { numerator: 1.0, denominator: 1.0, dimension: Dimension { metre: 0, kilogram: 0, second: 0, radian: 0 } };

impl Unit {
    /// The SI value of a number as written. Powers of ten move its exponent, so that "99.73 %" is 0.9973 to the bit.
    fn to_si(self, number: &str) -> Option<f64> {
        let shift = (self.numerator / self.denominator).log10().round() as i32;
        let is_decimal = self.numerator == self.denominator * 10_f64.powi(shift)
            || self.denominator == self.numerator * 10_f64.powi(-shift);
        if is_decimal {
            let (digits, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
            let exponent = exponent.parse::<i32>().ok()?.saturating_add(shift);
            return format!("{digits}e{exponent}").parse().ok();
        }
        Some(number.parse::<f64>().ok()? * self.numerator / self.denominator)
    }

    fn times(self, other: Self, power: i32) -> Self {
        let dimension = self.dimension.times(other.dimension, power);
        let (up, down) = (other.numerator.powi(power.abs()), other.denominator.powi(power.abs()));
        let (up, down) = if power < 0 { (down, up) } else { (up, down) };
        Self { numerator: self.numerator * up, denominator: self.denominator * down, dimension }
    }
}

const PI: f64 = std::f64::consts::PI;

/// Symbol, SI value as numerator and denominator, exponents of metre, kilogram, second, radian.
pub(crate) type Row = (&'static str, f64, f64, [i32; 4]);

/// The units that may be written, alone or in products.
pub(crate) const UNITS: &[Row] = &[
    ("1", 1.0, 1.0, [0, 0, 0, 0]),
    ("%", 1.0, 100.0, [0, 0, 0, 0]),
    ("‰", 1.0, 1e3, [0, 0, 0, 0]),
    ("ppm", 1.0, 1e6, [0, 0, 0, 0]),
    ("m", 1.0, 1.0, [1, 0, 0, 0]),
    ("km", 1e3, 1.0, [1, 0, 0, 0]),
    ("cm", 1.0, 1e2, [1, 0, 0, 0]),
    ("mm", 1.0, 1e3, [1, 0, 0, 0]),
    ("um", 1.0, 1e6, [1, 0, 0, 0]),
    ("µm", 1.0, 1e6, [1, 0, 0, 0]),
    ("rad", 1.0, 1.0, [0, 0, 0, 1]),
    ("mrad", 1.0, 1e3, [0, 0, 0, 1]),
    ("deg", PI, 180.0, [0, 0, 0, 1]),
    ("°", PI, 180.0, [0, 0, 0, 1]),
    ("arcmin", PI, 10_800.0, [0, 0, 0, 1]),
    ("arcsec", PI, 648_000.0, [0, 0, 0, 1]),
    ("rev", 2.0 * PI, 1.0, [0, 0, 0, 1]),
    ("kg", 1.0, 1.0, [0, 1, 0, 0]),
    ("g", 1.0, 1e3, [0, 1, 0, 0]),
    ("t", 1e3, 1.0, [0, 1, 0, 0]),
    ("s", 1.0, 1.0, [0, 0, 1, 0]),
    ("ms", 1.0, 1e3, [0, 0, 1, 0]),
    ("us", 1.0, 1e6, [0, 0, 1, 0]),
    ("µs", 1.0, 1e6, [0, 0, 1, 0]),
    ("ns", 1.0, 1e9, [0, 0, 1, 0]),
    ("min", 60.0, 1.0, [0, 0, 1, 0]),
    ("h", 3600.0, 1.0, [0, 0, 1, 0]),
    ("Hz", 1.0, 1.0, [0, 0, -1, 0]),
    ("kHz", 1e3, 1.0, [0, 0, -1, 0]),
    ("rpm", PI, 30.0, [0, 0, -1, 1]),
    ("N", 1.0, 1.0, [1, 1, -2, 0]),
    ("mN", 1.0, 1e3, [1, 1, -2, 0]),
    ("kN", 1e3, 1.0, [1, 1, -2, 0]),
    ("MN", 1e6, 1.0, [1, 1, -2, 0]),
    ("Nm", 1.0, 1.0, [2, 1, -2, 0]),
    ("kNm", 1e3, 1.0, [2, 1, -2, 0]),
    ("Ns", 1.0, 1.0, [1, 1, -1, 0]),
    ("J", 1.0, 1.0, [2, 1, -2, 0]),
    ("mJ", 1.0, 1e3, [2, 1, -2, 0]),
    ("kJ", 1e3, 1.0, [2, 1, -2, 0]),
    ("W", 1.0, 1.0, [2, 1, -3, 0]),
    ("Pa", 1.0, 1.0, [-1, 1, -2, 0]),
    ("kPa", 1e3, 1.0, [-1, 1, -2, 0]),
    ("MPa", 1e6, 1.0, [-1, 1, -2, 0]),
    ("GPa", 1e9, 1.0, [-1, 1, -2, 0]),
];

/// Units that are not read, with what one of them is in SI.
const FOREIGN: &[(&str, f64, &str)] = &[
    ("kgf", 9.80665, "N"),
    ("kp", 9.80665, "N"),
    ("gf", 0.00980665, "N"),
    ("lbf", 4.448_221_615_260_5, "N"),
    ("dyn", 1e-5, "N"),
    ("lb", 0.453_592_37, "kg"),
    ("lbm", 0.453_592_37, "kg"),
    ("slug", 14.593_902_937, "kg"),
    ("oz", 0.028_349_523_125, "kg"),
    ("in", 0.0254, "m"),
    ("inch", 0.0254, "m"),
    ("ft", 0.3048, "m"),
    ("yd", 0.9144, "m"),
    ("knot", 0.514_444, "m/s"),
    ("gon", PI / 200.0, "rad"),
    ("erg", 1e-7, "J"),
    ("psi", 6_894.757_293_168_36, "Pa"),
    ("bar", 1e5, "Pa"),
    ("day", 86_400.0, "s"),
];

/// SI unit of a quantity, what it is called, and units to suggest.
pub(crate) const KINDS: &[(&str, &str, &str)] = &[
    ("1", "a pure number", "0.5 or \"50 %\""),
    ("kg", "a mass", "kg, g, t"),
    ("m", "a length", "m, mm, cm"),
    ("m^2", "an area", "mm^2, cm^2, m^2"),
    ("kg/m^3", "a density", "kg/m^3, g/cm^3"),
    ("s", "a time", "s, ms, us, ns, min"),
    ("rad", "an angle", "deg, rad, mrad"),
    ("N", "a force", "N, kN, mN"),
    ("N m", "a moment", "N m, kN m"),
    ("J", "an energy", "J, mJ, kJ"),
    ("N s", "an impulse", "N s"),
    ("m/s", "a speed", "m/s, mm/s"),
    ("m/s^2", "an acceleration", "m/s^2, mm/s^2"),
    ("m/s^3", "a jerk", "m/s^3, mm/s^3"),
    ("rad/s", "an angular rate", "deg/s, rad/s, rpm"),
    ("rad/s^2", "an angular acceleration", "deg/s^2, rad/s^2"),
    ("rad/s^3", "an angular jerk", "deg/s^3, rad/s^3"),
    ("Hz", "a frequency", "Hz, kHz"),
    ("1/s", "a gain", "1/s"),
    ("N/m", "a stiffness", "N/m, N/mm, kN/m"),
    ("Pa", "a modulus", "Pa, MPa, GPa"),
    ("m/N", "a compliance", "m/N, mm/N, mm / kN"),
    ("N s/m", "a damping", "N s/m, N s/mm"),
    ("s/m", "a dissipation", "s/m"),
    ("N/s", "a drift of a force", "N/s, N/min, mN/s"),
    ("N m/s", "a drift of a moment", "N m/s, N m/min"),
    ("N m/rad", "a rotational stiffness", "N m/rad, N m/deg"),
    ("N m s/rad", "a rotational damping", "N m s/rad, N m s/deg"),
    ("rad/(N m)", "a rotational compliance", "rad/(N m), mrad/(kNm)"),
    ("1/rad", "a number of cycles", "1/rad"),
    ("1/m", "a number of cycles", "1/m"),
    ("kg m^2", "a moment of inertia", "kg m^2, g mm^2"),
    ("kg m/s", "a momentum", "kg m/s, N s"),
    ("kg m^2/s", "an angular momentum", "kg m^2/s, N m s"),
];

/// Why a text is not a quantity of the wanted kind.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum UnitError {
    /// It does not begin with a finite number.
    NotANumber,
    /// A number with a dimension stands without its unit.
    Bare,
    /// A symbol that is no unit; a near one if there is any.
    Unknown { symbol: String, near: Option<&'static str> },
    /// A unit that is not read.
    Foreign { symbol: &'static str, factor: f64, si: &'static str },
    /// Misplaced `/`, `^` or `*`.
    Malformed,
    /// A unit of another kind.
    Mismatch { found: &'static str },
}

/// What a quantity with this SI unit is called (`a force`).
pub(crate) fn noun(si: &str) -> &'static str {
    kind(si).map_or("another quantity", |row| row.1)
}

/// Units to suggest for a quantity with this SI unit.
pub(crate) fn suggestions(si: &str) -> &str {
    kind(si).map_or(si, |row| row.2)
}

fn kind(si: &str) -> Option<&'static (&'static str, &'static str, &'static str)> {
    KINDS.iter().find(|row| row.0 == si)
}

/// Exponents of metre, kilogram, second and radian, as in a row of [`UNITS`].
pub(crate) fn exponents(dimension: Dimension) -> [i32; 4] {
    [dimension.metre, dimension.kilogram, dimension.second, dimension.radian]
}

/// The dimension of a unit; `None` if it is not read.
pub(crate) fn dimension(unit: &str) -> Option<Dimension> {
    parse(unit).ok().map(|unit| unit.dimension)
}

/// SI unit of the kind of quantity that a text is; `None` if it is none, or of a kind that has no name.
pub(crate) fn si_unit_of(text: &str) -> Option<&'static str> {
    let (_, unit) = split_number(text.trim())?;
    let dimension = if unit.is_empty() { Dimension::default() } else { parse(unit).ok()?.dimension };
    KINDS.iter().map(|row| row.0).find(|si| parse(si).is_ok_and(|own| own.dimension == dimension))
}

/// The unit behind a number, empty for a pure number; `None` if a text does not begin with a number.
pub(crate) fn unit_of(text: &str) -> Option<&str> {
    split_number(text.trim()).map(|(_, unit)| unit.trim())
}

/// Whether a unit is a product of SI units without a factor (`N s/m`, not `N s/mm`).
pub(crate) fn is_coherent(unit: &str) -> Result<bool, UnitError> {
    parse(unit).map(|unit| unit.numerator == unit.denominator)
}

/// The SI value of `text`, which must be a number with a unit of the same kind as `si`.
pub(crate) fn quantity(text: &str, si: &str) -> Result<f64, UnitError> {
    let text = text.trim();
    let (number, rest) = split_number(text).ok_or(UnitError::NotANumber)?;
    let wanted = parse(si)?.dimension;
    if rest.is_empty() {
        let pure = wanted == Dimension::default();
        return if pure { number.parse().map_err(|_| UnitError::NotANumber) } else { Err(UnitError::Bare) };
    }
    let unit = parse(rest)?;
    if unit.dimension != wanted {
        let found = KINDS.iter().find(|row| parse(row.0).is_ok_and(|u| u.dimension == unit.dimension));
        return Err(UnitError::Mismatch { found: found.map_or("another quantity", |row| row.1) });
    }
    unit.to_si(number).ok_or(UnitError::NotANumber)
}

/// The longest leading finite number and what follows it.
fn split_number(text: &str) -> Option<(&str, &str)> {
    let end = text.find(|c: char| !matches!(c, '0'..='9' | '+' | '-' | '.' | 'e' | 'E')).unwrap_or(text.len());
    let (number, end) = (1..=end).rev().find_map(|end| Some((text.get(..end)?.parse::<f64>().ok()?, end)))?;
    number.is_finite().then(|| (&text[..end], text[end..].trim_start()))
}

/// A product of units: factors apart by a space, `*` or `·`, then divisors after `/` each, several in parentheses.
fn parse(text: &str) -> Result<Unit, UnitError> {
    let mut product = NONE;
    let mut parts = text.split('/');
    let factors = parts.next().unwrap_or("");
    for factor in factors.split([' ', '*', '·']).filter(|factor| !factor.is_empty()) {
        product = factor_times(product, factor, 1)?;
    }
    if factors.trim().is_empty() {
        return Err(UnitError::Malformed);
    }
    for divisor in parts {
        let divisor = divisor.trim();
        match divisor.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')) {
            None => product = factor_times(product, divisor, -1)?,
            Some(several) => {
                for factor in several.split_whitespace() {
                    product = factor_times(product, factor, -1)?;
                }
            }
        }
    }
    Ok(product)
}

fn factor_times(product: Unit, factor: &str, sign: i32) -> Result<Unit, UnitError> {
    let (symbol, power) = match factor.split_once('^') {
        Some((symbol, power)) => (symbol, power.parse::<i32>().ok().filter(|p| (1..=6).contains(p))),
        None => match factor.strip_suffix('²') {
            Some(symbol) => (symbol, Some(2)),
            None => (factor, Some(1)),
        },
    };
    let power = power.ok_or(UnitError::Malformed)?;
    if symbol.is_empty() || symbol.contains(' ') {
        return Err(UnitError::Malformed);
    }
    let row = UNITS.iter().find(|row| row.0 == symbol).ok_or_else(|| unknown(symbol))?;
    let [metre, kilogram, second, radian] = row.3;
    let unit = Unit { numerator: row.1, denominator: row.2, dimension: Dimension { metre, kilogram, second, radian } };
    Ok(product.times(unit, sign * power))
}

fn unknown(symbol: &str) -> UnitError {
    if let Some(&(symbol, factor, si)) = FOREIGN.iter().find(|row| row.0 == symbol) {
        return UnitError::Foreign { symbol, factor, si };
    }
    let near = crate::suggest::nearest(symbol, UNITS.iter().map(|row| row.0));
    UnitError::Unknown { symbol: symbol.to_owned(), near }
}

/// A number in SI with its unit, for messages.
pub(crate) fn show(value: f64, si: &str) -> String {
    let number = if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) {
        format!("{value:e}")
    } else {
        let text = format!("{value:.6}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    if si == "1" { number } else { format!("{number} {si}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::fields::fields;
    use softdock_kernels::metrics::Metrics;
    use softdock_kernels::params::Params;

    #[test]
    fn hand_values() {
        let cases = [
            ("0.5 mm", "m", 0.5e-3),
            ("-1.5e-3 km", "m", -1.5),
            ("90 deg", "rad", std::f64::consts::FRAC_PI_2),
            ("90°", "rad", std::f64::consts::FRAC_PI_2),
            ("30 rpm", "rad/s", PI),
            ("1 kN/mm", "N/m", 1e6),
            ("2 N s/mm", "N s/m", 2e3),
            ("2 N*s/mm", "N s/m", 2e3),
            ("3 Nm/deg", "N m/rad", 540.0 / PI),
            ("5 g mm²", "kg m^2", 5e-9),
            ("5 g mm^2", "kg m^2", 5e-9),
            ("1 J", "N m", 1.0),
            ("1.2 t", "kg", 1200.0),
            ("99.73 %", "1", 0.9973),
            ("50%", "1", 0.5),
            ("0.25", "1", 0.25),
            ("250 us", "s", 0.25e-3),
            ("2 min", "s", 120.0),
            ("4 kHz", "Hz", 4000.0),
            ("6 N s", "kg m/s", 6.0),
            ("1e4 N/m", "N/m", 1e4),
            (" 7 N ", "N", 7.0),
        ];
        for (text, si, value) in cases {
            let got = quantity(text, si).unwrap_or_else(|error| panic!("{text}: {error:?}"));
            assert!((got - value).abs() <= 1e-15 * value.abs(), "{text}: {got} instead of {value}");
        }
        for (text, si, value) in [("0.5 mm", "m", 0.0005), ("99.73 %", "1", 0.9973), ("1e3 N/mm", "N/m", 1e6)] {
            assert_eq!(quantity(text, si), Ok(value), "{text}: to the bit");
        }
    }

    #[test]
    fn wrong_units_are_named() {
        assert_eq!(quantity("0.5 mm", "N"), Err(UnitError::Mismatch { found: "a length" }));
        assert_eq!(quantity("5 N m", "N m/rad"), Err(UnitError::Mismatch { found: "a moment" }));
        assert_eq!(quantity("5 Hz", "rad/s"), Err(UnitError::Mismatch { found: "a frequency" }));
        assert_eq!(quantity("1.5", "N"), Err(UnitError::Bare));
        assert_eq!(quantity("1.5 kgf", "N"), Err(UnitError::Foreign { symbol: "kgf", factor: 9.80665, si: "N" }));
        assert_eq!(quantity("1.5 Newton", "N"), Err(UnitError::Unknown { symbol: "Newton".into(), near: None }));
        assert_eq!(quantity("1 mmm", "m"), Err(UnitError::Unknown { symbol: "mmm".into(), near: Some("mm") }));
        for text in ["", "N", "inf N", "nan N", "1e999 N", "--1 N"] {
            assert_eq!(quantity(text, "N"), Err(UnitError::NotANumber), "{text}");
        }
        for text in ["1 /s", "1 m^", "1 m^x", "1 m/", "1 m/s kg"] {
            assert_eq!(quantity(text, "m"), Err(UnitError::Malformed), "{text}");
        }
    }

    #[test]
    fn every_unit_of_the_field_tables_is_a_kind() {
        for field in fields::<f64, Params<f64>>().iter().chain(&fields::<f64, Metrics<f64>>()) {
            assert!(KINDS.iter().any(|row| row.0 == field.unit), "{}: {}", field.name, field.unit);
            let one = quantity(&format!("1 {}", field.unit), field.unit);
            assert_eq!(one, Ok(1.0), "{} reads back", field.unit);
        }
        for row in KINDS {
            assert_eq!(quantity(&format!("1 {}", row.0), row.0), Ok(1.0), "{}", row.0);
        }
    }

    #[test]
    fn a_dimension_is_written_as_it_is_read() {
        for unit in ["1", "N", "m/s", "J", "1/s", "N s/m", "m/N", "N m/rad", "rad/(N m)", "kg m^2/s"] {
            let own = dimension(unit).expect(unit);
            assert_eq!(dimension(&own.text()), Some(own), "{unit}: {}", own.text());
        }
        assert_eq!(dimension("N").map(Dimension::text), Some("kg m/s^2".to_owned()));
    }

    #[test]
    fn numbers_in_messages_are_short() {
        assert_eq!(show(0.128, "s"), "0.128 s");
        assert_eq!(show(1e9, "kg"), "1e9 kg");
        assert_eq!(show(2.5e-4, "s"), "2.5e-4 s");
        assert_eq!(show(0.0, "1"), "0");
    }
}
