//! Units in which the page shows numbers: the campaign author's, or else of a readable size.

use softdock_campaign::in_si;
use softdock_results::arrow_table::OtherUnit;

/// Units that are read more easily than the SI unit of small values, with the least size of those that need none.
const READABLE: [(&str, &str, f64); 6] = [
    ("mm", "m", 0.5),
    ("mm/s", "m/s", 0.5),
    ("ms", "s", 0.5),
    ("deg", "rad", f64::INFINITY),
    ("deg/s", "rad/s", f64::INFINITY),
    ("mJ", "J", 0.01),
];

/// A unit with its factor from SI.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct ShownUnit {
    pub(crate) unit: String,
    pub(crate) factor: f64,
}

/// The unit for values up to a size: the author's, or else one of a readable size.
pub(crate) fn shown(si: &str, author: Option<&OtherUnit>, largest: f64) -> Option<ShownUnit> {
    let of_size = |(unit, of, enough): &(&str, &str, f64)| {
        let fits = *of == si && largest > 0.0 && largest < *enough;
        if fits { Some(((*unit).to_owned(), in_si(unit, of)?)) } else { None }
    };
    let of_author = author.map(|author| (author.unit.clone(), author.in_si));
    let (unit, in_si) = of_author.or_else(|| READABLE.iter().find_map(of_size))?;
    Some(ShownUnit { unit: unit.replace("um", "\u{b5}m").replace("us", "\u{b5}s"), factor: 1.0 / in_si })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_is_the_authors_or_of_a_readable_size() {
        let force =
            OtherUnit { column: "hil_peak_force_n".to_owned(), name: String::new(), unit: "kN".to_owned(), in_si: 1e3 };
        let kilo = ShownUnit { unit: "kN".to_owned(), factor: 1e-3 };
        assert_eq!(shown("N", Some(&force), 300.0), Some(kilo));
        let unit = |si, largest| shown(si, None, largest).map(|shown| (shown.unit, shown.factor));
        assert_eq!(unit("m", 0.01), Some(("mm".to_owned(), 1e3)));
        assert_eq!(unit("rad", 4.0), Some(("deg".to_owned(), 180.0 / std::f64::consts::PI)));
        assert_eq!((unit("m", 3.0), unit("N", 0.1), unit("s", 0.0)), (None, None, None));
    }
}
