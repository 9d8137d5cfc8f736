//! Regular expressions of quantities: a number with a unit of one kind, for the schemas of files.

use crate::units::{UNITS, dimension, exponents};

/// A number.
const NUMBER: &str = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?";

/// Units of pure numbers.
const PURE: &str = "(?:1|%|\u{2030}|ppm)";

/// Greatest power of a unit in a product of so many units that the pattern knows.
const MOST_POWER: [i32; 5] = [0, 3, 3, 2, 1];

/// The pattern of a quantity with this SI unit. A product of more units than the SI unit has, beside two and the base units, is
/// read from a file, but not known to the pattern.
pub(crate) fn pattern(si: &str) -> String {
    if si == "1" {
        let ratio = |class: &Class| format!(r"{0}\s*/\s*{0}", factor(class, 1));
        let ratios = classes().iter().map(ratio).collect::<Vec<_>>().join("|");
        return format!(r"^\s*{NUMBER}\s*(?:{PURE}|{ratios})?\s*$");
    }
    let products = products(si).iter().map(|product| written(product)).collect::<Vec<_>>().join("|");
    format!(r"^\s*{NUMBER}\s*(?:{products})\s*$")
}

/// The pattern of a quantity of any kind: every unit is known.
pub(crate) fn any_pattern() -> String {
    let mut symbols: Vec<&str> = UNITS.iter().map(|row| row.0).collect();
    symbols.sort_by_key(|symbol| std::cmp::Reverse(symbol.len()));
    let unit = format!(r"(?:{})(?:\^[1-6]|²)?", symbols.join("|"));
    format!(r"^\s*{NUMBER}\s*(?:{unit}(?:[ *·]+{unit})*(?:\s*/\s*(?:{unit}|\(\s*{unit}(?:\s+{unit})*\s*\)))*)?\s*$")
}

/// Units of one dimension.
struct Class {
    exponents: [i32; 4],
    symbols: Vec<&'static str>,
}

/// A product: classes with their powers.
type Product<'a> = Vec<(&'a Class, i32)>;

/// The products of units that have the dimension of an SI unit.
fn products(si: &str) -> Vec<Product<'static>> {
    let wanted = dimension(si).map(exponents).expect("an SI unit of the program");
    let classes = classes();
    let factors = si.split([' ', '/', '(', ')']).filter(|factor| !factor.is_empty() && *factor != "1").count();
    let mut found = Vec::new();
    let most = factors.clamp(2, 4);
    search(classes, wanted, (most, MOST_POWER[most]), &mut Vec::new(), &mut found);
    let base = classes.iter().filter(|class| class.exponents.iter().filter(|exponent| **exponent != 0).count() == 1);
    let base: Vec<&Class> = base.filter(|class| class.exponents.iter().all(|exponent| *exponent >= 0)).collect();
    let power = |class: &Class| {
        let at = class.exponents.iter().position(|exponent| *exponent != 0).expect("a base unit");
        wanted[at]
    };
    let of_base: Product = base.iter().map(|class| (*class, power(class))).filter(|(_, power)| *power != 0).collect();
    let is_new = |own: &Product| !found.iter().any(|other: &Product| same(own, other));
    if !of_base.is_empty() && is_new(&of_base) {
        found.push(of_base);
    }
    found
}

fn same(one: &Product, two: &Product) -> bool {
    one.len() == two.len()
        && one.iter().all(|(class, power)| two.iter().any(|(c, p)| c.exponents == class.exponents && p == power))
}

/// Extends a product by so many classes behind its last one, each to so great a power, until it has the wanted dimension.
fn search(
    rest: &'static [Class],
    missing: [i32; 4],
    (most, power): (usize, i32),
    begun: &mut Product<'static>,
    found: &mut Vec<Product<'static>>,
) {
    if missing == [0; 4] {
        if !begun.is_empty() {
            found.push(begun.clone());
        }
        return;
    }
    if most == 0 {
        return;
    }
    for (at, class) in rest.iter().enumerate() {
        for own in (-power..=power).filter(|own| *own != 0) {
            let mut next = missing;
            next.iter_mut().zip(class.exponents).for_each(|(missing, of_class)| *missing -= own * of_class);
            begun.push((class, own));
            search(&rest[at + 1..], next, (most - 1, power), begun, found);
            begun.pop();
        }
    }
}

/// All units but those of pure numbers, by their dimension.
fn classes() -> &'static [Class] {
    static CLASSES: std::sync::OnceLock<Vec<Class>> = std::sync::OnceLock::new();
    CLASSES.get_or_init(|| {
        let mut classes: Vec<Class> = Vec::new();
        for (symbol, _, _, exponents) in UNITS.iter().filter(|row| row.3 != [0; 4]) {
            match classes.iter_mut().find(|class| class.exponents == *exponents) {
                Some(class) => class.symbols.push(symbol),
                None => classes.push(Class { exponents: *exponents, symbols: vec![symbol] }),
            }
        }
        classes
    })
}

/// The texts of a product: factors in any order, then divisors, each behind its `/` or all in parentheses.
fn written(product: &Product) -> String {
    let (over, under): (Vec<_>, Vec<_>) = product.iter().partition(|(_, power)| *power > 0);
    let orders = |factors: &[(&Class, i32)], between: &str| {
        let orders = orders(factors.len());
        let order = |order: &Vec<usize>| {
            order.iter().map(|at| factor(factors[*at].0, factors[*at].1.abs())).collect::<Vec<_>>().join(between)
        };
        let orders: Vec<String> = orders.iter().map(order).collect();
        if orders.len() == 1 { orders[0].clone() } else { format!("(?:{})", orders.join("|")) }
    };
    let numerator = if over.is_empty() { "1".to_owned() } else { orders(&over, "[ *·]+") };
    let slash = r"\s*/\s*";
    match under.as_slice() {
        [] => numerator,
        [(class, power)] => {
            let once = factor(class, power.abs());
            let unit = factor(class, 1);
            match power.abs() {
                1 => format!("{numerator}{slash}{once}"),
                power => format!("{numerator}(?:{slash}{once}|(?:{slash}{unit}){{{power}}})"),
            }
        }
        several => {
            let (each, together) = (orders(several, slash), orders(several, r"\s+"));
            format!(r"{numerator}{slash}(?:{each}|\(\s*{together}\s*\))")
        }
    }
}

/// A unit of a class with a power.
fn factor(class: &Class, power: i32) -> String {
    let symbols = match class.symbols.as_slice() {
        [one] => (*one).to_owned(),
        several => format!("(?:{})", several.join("|")),
    };
    match power {
        1 => symbols,
        2 => format!(r"{symbols}(?:\^2|²)"),
        power => format!(r"{symbols}\^{power}"),
    }
}

/// All orders of so many items.
fn orders(count: usize) -> Vec<Vec<usize>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let shorter = orders(count - 1);
    let insert = |order: &Vec<usize>, at: usize| {
        let mut order = order.clone();
        order.insert(at, count - 1);
        order
    };
    shorter.iter().flat_map(|order| (0..count).map(move |at| insert(order, at))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{KINDS, quantity};
    use regex::Regex;

    #[test]
    fn a_pattern_matches_what_is_read_and_nothing_else() {
        let mut texts: Vec<String> = Vec::new();
        let symbols: Vec<&str> = UNITS.iter().map(|row| row.0).collect();
        texts.extend(symbols.iter().flat_map(|unit| [format!("1.5 {unit}"), format!("-2e3{unit}^2")]));
        let firsts: Vec<&str> = classes().iter().map(|class| class.symbols[class.symbols.len() - 1]).collect();
        for one in &firsts {
            for two in &firsts {
                texts.extend([format!("3 {one}/{two}"), format!("3 {one} {two}"), format!("3 {one} / {two}^2")]);
            }
        }
        let more = ["2 N s/mm", "2 N*s/mm", "3 Nm/deg", "5 g mm²", "1 kg m/s/s", "4 1/s", "1 rad/(N m)", "2 N m s/deg"];
        let wrong =
            ["", "N", "1.5", "1.5 kgf", "1.5 Newton", "1 mmm", "1 /s", "1 m^", "1 m/", "inf N", "--1 N", "fill in"];
        texts.extend(more.into_iter().chain(wrong).map(str::to_owned));
        for (si, ..) in KINDS {
            let pattern = Regex::new(&pattern(si)).expect(si);
            let differs: Vec<&String> = texts
                .iter()
                .filter(|text| pattern.is_match(text) != quantity(text, si).is_ok())
                // Units that cancel, and pure numbers in products, are read; nobody writes them.
                .filter(|text| !text.contains(['%', '\u{2030}', '1']) && !text.contains("ppm"))
                .collect();
            let missed = differs.iter().filter(|text| pattern.is_match(text)).count();
            assert_eq!(missed, 0, "{si}: matched, but not read: {differs:?}");
            assert!(differs.len() <= 4, "{si}: read, but not matched: {differs:?}");
            assert!(pattern.is_match(&format!("1 {si}")), "{si}");
        }
        for text in ["2 N s/mm", "2 N*s/mm"] {
            assert!(Regex::new(&pattern("N s/m")).expect("a pattern").is_match(text), "{text}");
        }
    }

    #[test]
    fn the_pattern_of_any_quantity_knows_every_unit() {
        let any = Regex::new(&any_pattern()).expect("a pattern");
        for text in ["0.5 mm", "5", "50 %", "1.5e3 N s/mm", "2 rad/(N m)", "90°", "5 g mm²"] {
            assert!(any.is_match(text), "{text}");
        }
        for text in ["0.5 mmm", "5 Newton", "N", "1 /s", ""] {
            assert!(!any.is_match(text), "{text}");
        }
    }
}
