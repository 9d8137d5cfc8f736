//! The language of derived values and of a campaign's custom metrics: arithmetic in SI, of numbers, bounds or units.

use crate::units::Dimension;
use std::ops::Range;

/// Deepest nesting of parentheses and signs.
const DEEPEST: usize = 64;

/// Most numbers, names, signs, operators and calls of one expression; it bounds the depth of the tree.
const MOST_TERMS: usize = 500;

/// A parsed expression over numbered names.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expression {
    Number(f64),
    /// Index into the field table.
    Name(usize),
    Negative(Box<Expression>),
    Binary(Operator, Box<Expression>, Box<Expression>),
    Call(Function, Vec<Expression>),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Operator {
    Plus,
    Minus,
    Times,
    Over,
    Power,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Function {
    Min,
    Max,
    Sqrt,
    Abs,
    Sin,
    Cos,
    Exp,
    Log,
}

/// Name, function, number of arguments (`None`: two or more).
const FUNCTIONS: &[(&str, Function, Option<usize>)] = &[
    ("min", Function::Min, None),
    ("max", Function::Max, None),
    ("sqrt", Function::Sqrt, Some(1)),
    ("abs", Function::Abs, Some(1)),
    ("sin", Function::Sin, Some(1)),
    ("cos", Function::Cos, Some(1)),
    ("exp", Function::Exp, Some(1)),
    ("log", Function::Log, Some(1)),
];

/// What is wrong, where in the text, and what would do.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fault {
    pub(crate) place: Range<usize>,
    pub(crate) message: String,
    pub(crate) remedy: String,
}

/// Parses a text; `index` numbers the names, `names` are those to suggest.
pub(crate) fn parse(text: &str, names: &[&str]) -> Result<Expression, Fault> {
    let mut parser = Parser { text, at: 0, depth: 0, terms: 0, names };
    let expression = parser.sum()?;
    match parser.peek() {
        None => Ok(expression),
        Some(c) => {
            Err(parser.fault(format!("`{c}` does not belong here"), "write one expression; a product needs its `*`"))
        }
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    terms: usize,
    names: &'a [&'a str],
}

impl Parser<'_> {
    fn fault(&self, message: String, remedy: impl Into<String>) -> Fault {
        let end = self.text[self.at..].chars().next().map_or(self.at, |c| self.at + c.len_utf8());
        Fault { place: self.at..end, message, remedy: remedy.into() }
    }

    /// The next character that is no space.
    fn peek(&mut self) -> Option<char> {
        self.at += self.text[self.at..].len() - self.text[self.at..].trim_start().len();
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.at += if found { wanted.len_utf8() } else { 0 };
        found
    }

    /// Takes the first of several operators.
    fn operator(&mut self, choices: &[(char, Operator)]) -> Option<Operator> {
        choices.iter().find(|choice| self.take(choice.0)).map(|choice| choice.1)
    }

    fn sum(&mut self) -> Result<Expression, Fault> {
        let mut left = self.product()?;
        while let Some(operator) = self.operator(&[('+', Operator::Plus), ('-', Operator::Minus)]) {
            left = Expression::Binary(operator, Box::new(left), Box::new(self.product()?));
        }
        Ok(left)
    }

    fn product(&mut self) -> Result<Expression, Fault> {
        let mut left = self.signed()?;
        while let Some(operator) = self.operator(&[('*', Operator::Times), ('/', Operator::Over)]) {
            left = Expression::Binary(operator, Box::new(left), Box::new(self.signed()?));
        }
        Ok(left)
    }

    /// A sign binds weaker than a power: -2^2 = -4.
    fn signed(&mut self) -> Result<Expression, Fault> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.fault(format!("more than {DEEPEST} nested parentheses or signs"), "write it flatter"));
        }
        let result =
            if self.take('-') { self.signed().map(|e| Expression::Negative(Box::new(e))) } else { self.power() };
        self.depth -= 1;
        result
    }

    /// Powers group from the right: 2^3^2 = 2^9.
    fn power(&mut self) -> Result<Expression, Fault> {
        let base = self.atom()?;
        if !self.take('^') {
            return Ok(base);
        }
        Ok(Expression::Binary(Operator::Power, Box::new(base), Box::new(self.signed()?)))
    }

    fn atom(&mut self) -> Result<Expression, Fault> {
        self.terms += 1;
        if self.terms > MOST_TERMS {
            let remedy = format!("write at most {MOST_TERMS} terms; split the value into several derived ones");
            return Err(self.fault(format!("the expression has more than {MOST_TERMS} terms"), remedy));
        }
        match self.peek() {
            Some('(') => {
                self.take('(');
                let inner = self.sum()?;
                self.close()?;
                Ok(inner)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() => self.name(),
            Some(c) => Err(self.fault(format!("`{c}` does not belong here"), "write a number, a parameter or `(`")),
            None => Err(self.fault("the expression ends too early".to_owned(), "write a number, a parameter or `(`")),
        }
    }

    fn close(&mut self) -> Result<(), Fault> {
        if self.take(')') { Ok(()) } else { Err(self.fault("`)` is missing".to_owned(), "close the parenthesis")) }
    }

    fn number(&mut self) -> Result<Expression, Fault> {
        let rest = &self.text[self.at..];
        let mut end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        // An exponent only if digits follow: `2e3`, but `2*exp(1)`.
        if let Some(exponent) = rest[end..].strip_prefix(['e', 'E']) {
            let digits = exponent.strip_prefix(['+', '-']).unwrap_or(exponent);
            let count = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
            end += if count > 0 { 1 + exponent.len() - digits.len() + count } else { 0 };
        }
        match rest[..end].parse::<f64>() {
            Ok(number) if number.is_finite() => {
                self.at += end;
                Ok(Expression::Number(number))
            }
            _ => Err(self.fault(format!("`{}` is not a finite number", &rest[..end]), "write a number as 1.5 or 2e3")),
        }
    }

    fn name(&mut self) -> Result<Expression, Fault> {
        let rest = &self.text[self.at..];
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (word, place) = (&rest[..end], self.at..self.at + end);
        self.at += end;
        if self.take('(') {
            return self.call(word, place);
        }
        let index = self.names.iter().position(|name| *name == word);
        index.map(Expression::Name).ok_or_else(|| Fault {
            place,
            message: format!("there is no parameter `{word}`"),
            remedy: crate::suggest::did_you_mean(word, self.names)
                .unwrap_or_else(|| "write a parameter's name; `softdock params` lists them".to_owned()),
        })
    }

    fn call(&mut self, word: &str, place: Range<usize>) -> Result<Expression, Fault> {
        let words: Vec<&str> = FUNCTIONS.iter().map(|row| row.0).collect();
        let Some((_, function, count)) = FUNCTIONS.iter().find(|row| row.0 == word) else {
            let remedy = crate::suggest::suggestion(word, &words);
            return Err(Fault { place, message: format!("there is no function `{word}`"), remedy });
        };
        let mut arguments = vec![self.sum()?];
        while self.take(',') {
            arguments.push(self.sum()?);
        }
        self.close()?;
        let fits = count.map_or(arguments.len() >= 2, |count| arguments.len() == count);
        if !fits {
            let wanted = count.map_or("two or more".to_owned(), |count| count.to_string());
            let message = format!("`{word}` has {} arguments", arguments.len());
            return Err(Fault { place, message, remedy: format!("give it {wanted}") });
        }
        Ok(Expression::Call(*function, arguments))
    }
}

/// What an expression can be evaluated in: numbers, or bounds of numbers.
pub(crate) trait Value: Copy {
    fn number(value: f64) -> Self;
    fn binary(operator: Operator, a: Self, b: Self) -> Self;
    fn call(function: Function, arguments: &[Self]) -> Self;
}

impl Expression {
    /// The value, with the names' values given.
    pub(crate) fn value<V: Value>(&self, names: &[V]) -> V {
        match self {
            Self::Number(number) => V::number(*number),
            Self::Name(index) => names[*index],
            Self::Negative(inner) => V::binary(Operator::Minus, V::number(0.0), inner.value(names)),
            Self::Binary(operator, a, b) => V::binary(*operator, a.value(names), b.value(names)),
            Self::Call(function, arguments) => {
                let values: Vec<V> = arguments.iter().map(|argument| argument.value(names)).collect();
                V::call(*function, &values)
            }
        }
    }

    /// The names that it uses.
    pub(crate) fn names(&self) -> Vec<usize> {
        match self {
            Self::Number(_) => Vec::new(),
            Self::Name(index) => vec![*index],
            Self::Negative(inner) => inner.names(),
            Self::Binary(_, a, b) => [a.names(), b.names()].concat(),
            Self::Call(_, arguments) => arguments.iter().flat_map(Expression::names).collect(),
        }
    }
}

impl Value for f64 {
    fn number(value: f64) -> Self {
        value
    }
    fn binary(operator: Operator, a: f64, b: f64) -> f64 {
        match operator {
            Operator::Plus => a + b,
            Operator::Minus => a - b,
            Operator::Times => a * b,
            Operator::Over => a / b,
            Operator::Power => a.powf(b),
        }
    }
    fn call(function: Function, arguments: &[f64]) -> f64 {
        let first = arguments[0];
        match function {
            // Of a value that is no number there is neither a least nor a greatest.
            Function::Min | Function::Max if arguments.iter().any(|argument| argument.is_nan()) => f64::NAN,
            Function::Min => arguments.iter().copied().fold(f64::INFINITY, f64::min),
            Function::Max => arguments.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            Function::Sqrt => first.sqrt(),
            Function::Abs => first.abs(),
            Function::Sin => first.sin(),
            Function::Cos => first.cos(),
            Function::Exp => first.exp(),
            Function::Log => first.ln(),
        }
    }
}

/// Bounds of a value: every value inside, never too narrow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) least: f64,
    pub(crate) greatest: f64,
}

impl Bounds {
    const ANY: Self = Self { least: f64::NEG_INFINITY, greatest: f64::INFINITY };

    /// Bounds around some values; anything if one of them is undefined.
    fn around(values: &[f64]) -> Self {
        if values.iter().any(|value| value.is_nan()) {
            return Self::ANY;
        }
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        Self { least, greatest: values.iter().copied().fold(f64::NEG_INFINITY, f64::max) }
    }

    /// Bounds of a rising function.
    fn rising(self, f: impl Fn(f64) -> f64) -> Self {
        Self::around(&[f(self.least), f(self.greatest)])
    }

    fn corners(a: Self, b: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self::around(&[f(a.least, b.least), f(a.least, b.greatest), f(a.greatest, b.least), f(a.greatest, b.greatest)])
    }

    fn power(self, exponent: Self) -> Self {
        let corners = Self::corners(self, exponent, f64::powf);
        if self.least >= 0.0 {
            return corners;
        }
        // Below zero only a constant power is defined, and across zero only a positive one has no pole.
        let crosses = self.greatest > 0.0;
        let constant = exponent.least == exponent.greatest;
        match constant && (exponent.least >= 0.0 || !crosses) {
            false => Self::ANY,
            true if crosses && exponent.least % 2.0 == 0.0 => Self { least: 0.0, ..corners },
            true => corners,
        }
    }
}

impl Value for Bounds {
    fn number(value: f64) -> Self {
        Self { least: value, greatest: value }
    }
    fn binary(operator: Operator, a: Self, b: Self) -> Self {
        match operator {
            Operator::Over if b.least <= 0.0 && b.greatest >= 0.0 => Self::ANY,
            Operator::Power => a.power(b),
            _ => Self::corners(a, b, |a, b| f64::binary(operator, a, b)),
        }
    }
    fn call(function: Function, arguments: &[Self]) -> Self {
        let first = arguments[0];
        match function {
            Function::Min | Function::Max => {
                let of = |end: fn(&Self) -> f64| f64::call(function, &arguments.iter().map(end).collect::<Vec<_>>());
                Self { least: of(|bounds| bounds.least), greatest: of(|bounds| bounds.greatest) }
            }
            Function::Abs if first.least < 0.0 && first.greatest > 0.0 => {
                Self { least: 0.0, greatest: first.greatest.max(-first.least) }
            }
            Function::Abs => Self::around(&[first.least.abs(), first.greatest.abs()]),
            Function::Sin | Function::Cos if first.least != first.greatest => Self { least: -1.0, greatest: 1.0 },
            _ => first.rising(|value| f64::call(function, &[value])),
        }
    }
}

/// The unit of a value, and the value itself where it is a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Measure {
    unit: Result<Dimension, UnitFault>,
    constant: Option<f64>,
}

/// Why a value has no unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum UnitFault {
    /// A sum, or the least or greatest, of quantities of two kinds.
    Unlike(Dimension, Dimension),
    /// A function of pure numbers is given a quantity.
    NotPure(Dimension),
    /// The square root of a quantity whose exponents are odd.
    NoRoot(Dimension),
    /// A power of a quantity whose exponent is no whole number.
    NoPower(Dimension),
}

impl std::fmt::Display for UnitFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unlike(one, two) => write!(f, "it adds or compares {} and {}", one.text(), two.text()),
            Self::NotPure(unit) => write!(f, "sin, cos, exp and log take pure numbers, not {}", unit.text()),
            Self::NoRoot(unit) => write!(f, "the square root of {} has no unit", unit.text()),
            Self::NoPower(unit) => write!(f, "{} is raised to a power that is no whole number", unit.text()),
        }
    }
}

impl Measure {
    /// A quantity of a unit; in calculations an angle is a pure number.
    pub(crate) fn of(unit: Dimension) -> Self {
        Self { unit: Ok(unit.without_angle()), constant: None }
    }

    /// The unit, or why there is none.
    pub(crate) fn unit(self) -> Result<Dimension, UnitFault> {
        self.unit
    }

    fn is_zero(self) -> bool {
        self.constant == Some(0.0)
    }

    /// The common unit of two values; zero has any.
    fn alike(one: Self, two: Self) -> Result<Dimension, UnitFault> {
        let (own, other) = (one.unit?, two.unit?);
        match (one.is_zero(), two.is_zero()) {
            (true, _) => Ok(other),
            (_, true) => Ok(own),
            _ if own == other => Ok(own),
            _ => Err(UnitFault::Unlike(own, other)),
        }
    }

    fn raised(self, exponent: Self) -> Result<Dimension, UnitFault> {
        let (unit, pure) = (self.unit?, exponent.unit?);
        let whole = exponent.constant.filter(|value| value.fract() == 0.0 && value.abs() <= 12.0);
        match whole {
            _ if pure != Dimension::default() => Err(UnitFault::NotPure(pure)),
            _ if unit == Dimension::default() => Ok(unit),
            Some(power) => Ok(Dimension::default().product(unit, power as i32)),
            None => Err(UnitFault::NoPower(unit)),
        }
    }
}

impl Value for Measure {
    fn number(value: f64) -> Self {
        Self { unit: Ok(Dimension::default()), constant: Some(value) }
    }
    fn binary(operator: Operator, a: Self, b: Self) -> Self {
        let product = |power| Ok(a.unit?.product(b.unit?, power));
        let unit = match operator {
            Operator::Plus | Operator::Minus => Self::alike(a, b),
            Operator::Times => product(1),
            Operator::Over => product(-1),
            Operator::Power => a.raised(b),
        };
        let constant = a.constant.zip(b.constant).map(|(a, b)| f64::binary(operator, a, b));
        Self { unit, constant }
    }
    fn call(function: Function, arguments: &[Self]) -> Self {
        let first = arguments[0];
        let unit = match function {
            Function::Min | Function::Max => {
                let together = |one: Self, two: &Self| Self { unit: Self::alike(one, *two), constant: None };
                arguments[1..].iter().fold(first, together).unit
            }
            Function::Abs => first.unit,
            Function::Sqrt => first.unit.and_then(|unit| unit.root().ok_or(UnitFault::NoRoot(unit))),
            Function::Sin | Function::Cos | Function::Exp | Function::Log => match first.unit {
                Ok(unit) if unit != Dimension::default() => Err(UnitFault::NotPure(unit)),
                unit => unit,
            },
        };
        let constants: Option<Vec<f64>> = arguments.iter().map(|argument| argument.constant).collect();
        Self { unit, constant: constants.map(|values| f64::call(function, &values)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: &[&str] = &["a", "b", "target_mass"];

    fn value(text: &str) -> f64 {
        parse(text, NAMES).unwrap_or_else(|fault| panic!("{text}: {fault:?}")).value(&[3.0, -2.0, 400.0])
    }

    #[test]
    fn arithmetic_binds_as_on_paper() {
        let cases = [
            ("1 + 2 * 3", 7.0),
            ("(1 + 2) * 3", 9.0),
            ("2^3^2", 512.0),
            ("-2^2", -4.0),
            ("2^-1", 0.5),
            ("8 / 4 / 2", 1.0),
            ("7 - 2 - 1", 4.0),
            ("a * b", -6.0),
            ("min(a, b, 5) + max(1, 2)", 0.0),
            ("sqrt(abs(b) * 8)", 4.0),
            ("2e3 + 1.5E-1", 2000.15),
            ("2*exp(0) + log(1) + sin(0) + cos(0)", 3.0),
            ("0.2 * sqrt(1e4 * target_mass)", 400.0),
            ("--3", 3.0),
        ];
        for (text, expected) in cases {
            assert!((value(text) - expected).abs() < 1e-12, "{text} = {}", value(text));
        }
    }

    #[test]
    fn slips_are_pointed_at() {
        let cases = [
            ("a +", 3, "ends too early"),
            ("(a", 2, "`)` is missing"),
            ("a b", 2, "`b`"),
            ("target_mas", 0, "no parameter"),
            ("sqr(a)", 0, "no function"),
            ("min(a)", 0, "1 arguments"),
            ("1..2", 0, "not a finite number"),
            ("a $ b", 2, "`$`"),
            ("", 0, "ends too early"),
        ];
        for (text, place, message) in cases {
            let fault = parse(text, NAMES).expect_err(text);
            assert_eq!(fault.place.start, place, "{text}");
            assert!(fault.message.contains(message), "{text}: {}", fault.message);
        }
        let deep = format!("{}a{}", "(".repeat(100_000), ")".repeat(100_000));
        assert!(parse(&deep, NAMES).expect_err("deep").message.contains("nested"));
        assert!(parse(&"-".repeat(100_000), NAMES).is_err());
        assert!(parse("target_mas", NAMES).expect_err("slip").remedy.contains("`target_mass`"));
    }

    #[test]
    fn units_follow_the_arithmetic() {
        let unit = |text: &str| crate::units::dimension(text).expect("a unit");
        let names = ["force", "mass", "speed", "angle"];
        let known = ["N", "kg", "m/s", "rad"].map(|text| Measure::of(unit(text)));
        let of = |text: &str| parse(text, &names).expect(text).value(&known).unit();
        let cases = [
            ("force / mass", "m/s^2"),
            ("mass * speed^2 / 2", "J"),
            ("sqrt(2 * mass * speed^2 / mass)", "m/s"),
            ("max(force, 0) + abs(-force)", "N"),
            ("force * sin(angle)", "N"),
            ("speed * angle", "m/s"),
            ("exp(speed / speed)", "1"),
            ("(force / force)^0.5", "1"),
        ];
        for (text, expected) in cases {
            assert_eq!(of(text), Ok(unit(expected)), "{text}");
        }
        let (newton, kilogram) = (unit("N"), unit("kg"));
        assert_eq!(of("force + mass"), Err(UnitFault::Unlike(newton, kilogram)));
        assert_eq!(of("max(force, 250)"), Err(UnitFault::Unlike(newton, Dimension::default())));
        assert_eq!(of("log(force)"), Err(UnitFault::NotPure(newton)));
        assert_eq!(of("sqrt(mass)"), Err(UnitFault::NoRoot(kilogram)));
        assert_eq!(of("mass^0.5"), Err(UnitFault::NoPower(kilogram)));
        assert_eq!(of("2^force"), Err(UnitFault::NotPure(newton)));
    }

    #[test]
    fn the_least_of_no_number_is_no_number() {
        assert!(value("min(0 / 0, 5)").is_nan() && value("max(5, sqrt(-1))").is_nan());
    }

    /// Bounds hold every value of a grid over the arguments.
    #[test]
    fn bounds_are_never_too_narrow() {
        let texts = [
            "a*b",
            "a/b",
            "a^2",
            "a^3",
            "b^a",
            "abs(a)-b",
            "sin(a)*b",
            "min(a,b)",
            "max(a,b)^2",
            "sqrt(b)",
            "1/a",
            "exp(a)",
            "log(b)",
            "-a^2",
            "a^-2",
        ];
        let (a, b) = (Bounds { least: -1.5, greatest: 2.0 }, Bounds { least: 0.25, greatest: 4.0 });
        for text in texts {
            let expression = parse(text, NAMES).expect(text);
            let bounds = expression.value(&[a, b]);
            for (i, j) in (0..=20).flat_map(|i| (0..=20).map(move |j| (f64::from(i) / 20.0, f64::from(j) / 20.0))) {
                let value = expression.value(&[a.least + i * 3.5, b.least + j * 3.75]);
                let inside = value.is_nan() || (bounds.least - 1e-12..=bounds.greatest + 1e-12).contains(&value);
                assert!(inside, "{text}: {value} outside {bounds:?}");
            }
        }
    }
}
