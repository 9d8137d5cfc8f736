//! Calibration of a Net Box in its `netftapi2.xml`: counts to force and moment.

use crate::signals::MAX_EFFORT;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::vec3;
use std::fmt::Write;

/// Units of force with their size \[N\]; exact by definition (g = 9.80665 m/s^2, 1 lb = 0.45359237 kg).
const FORCE_UNITS: [(&str, f64); 8] = [
    ("N", 1.0),
    ("kN", 1e3),
    ("lbf", 4.448_221_615_260_5),
    ("klbf", 4_448.221_615_260_5),
    ("kgf", 9.806_65),
    ("kg", 9.806_65),
    ("gf", 9.806_65e-3),
    ("g", 9.806_65e-3),
];

/// Units of moment with their size \[N m\].
const MOMENT_UNITS: [(&str, f64); 13] = [
    ("Nm", 1.0),
    ("N-m", 1.0),
    ("Nmm", 1e-3),
    ("N-mm", 1e-3),
    ("kNm", 1e3),
    ("kN-m", 1e3),
    ("lbf-in", 0.112_984_829_027_616_7),
    ("lb-in", 0.112_984_829_027_616_7),
    ("lbf-ft", 1.355_817_948_331_400_4),
    ("lb-ft", 1.355_817_948_331_400_4),
    ("kgf-cm", 9.806_65e-2),
    ("kg-cm", 9.806_65e-2),
    ("kgfcm", 9.806_65e-2),
];

/// Scale from counts to newtons and newton metres.
#[derive(Clone, Debug, PartialEq)]
pub struct NetFtCalibration {
    /// Product name, as reported by the box.
    pub product: String,
    /// Serial number of the calibration, equal to the sensor's (`cfgcalsn`), if reported.
    pub serial: Option<String>,
    /// Tool transformation that the box applies to its measurements (`cfgtfx`): three distances, three angles, in box
    /// units.
    pub transform: Option<[f64; 6]>,
    /// Rated range of each channel (`cfgmr`), in the units of force and moment.
    pub ratings: Option<[f64; 6]>,
    /// Counts per unit of force (`cfgcpf`).
    pub counts_per_force: f64,
    /// Counts per unit of moment (`cfgcpt`).
    pub counts_per_moment: f64,
    /// Name of the unit of force (`scfgfu`).
    pub force_unit: String,
    /// Name of the unit of moment (`scfgtu`).
    pub moment_unit: String,
    newtons_per_count: f64,
    newton_metres_per_count: f64,
}

/// Error in a `netftapi2.xml`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CalibrationError {
    /// A field is missing or duplicate.
    #[error("the sensor's netftapi2.xml must have one <{0}>")]
    Field(&'static str),
    /// Counts per unit are outside the accepted range.
    #[error("the sensor's <{field}> is {value}: expected counts per unit, 1e-3 to 1e12")]
    Counts {
        /// The field.
        field: &'static str,
        /// Value.
        value: String,
    },
    /// Unknown unit.
    #[error("the sensor's <{field}> is {value}: unknown unit")]
    Unit {
        /// The field.
        field: &'static str,
        /// Value.
        value: String,
    },
}

impl NetFtCalibration {
    /// Creates a calibration in N and N m.
    ///
    /// # Errors
    /// If the counts per unit are not within 1e-3 to 1e12.
    pub fn new(counts_per_force: f64, counts_per_moment: f64) -> Result<Self, CalibrationError> {
        Self::with_units("ATI Net F/T", counts_per_force, counts_per_moment, "N", "Nm")
    }

    /// Creates a calibration in named units.
    ///
    /// # Errors
    /// If a unit is unknown or the counts per unit are not within 1e-3 to 1e12.
    pub fn with_units(
        product: &str,
        counts_per_force: f64,
        counts_per_moment: f64,
        force_unit: &str,
        moment_unit: &str,
    ) -> Result<Self, CalibrationError> {
        check_counts("cfgcpf", counts_per_force)?;
        check_counts("cfgcpt", counts_per_moment)?;
        let newtons = size("scfgfu", &FORCE_UNITS, force_unit)?;
        let newton_metres = size("scfgtu", &MOMENT_UNITS, moment_unit)?;
        Ok(Self {
            product: product.to_owned(),
            serial: None,
            transform: None,
            ratings: None,
            counts_per_force,
            counts_per_moment,
            force_unit: force_unit.to_owned(),
            moment_unit: moment_unit.to_owned(),
            newtons_per_count: newtons / counts_per_force,
            newton_metres_per_count: newton_metres / counts_per_moment,
        })
    }

    /// Parses a `netftapi2.xml`. Reads these fields only, because other contents differ between firmware versions.
    ///
    /// # Errors
    /// If a field is missing, duplicate or invalid. The product name is optional: old firmware has none.
    pub fn from_xml(xml: &str) -> Result<Self, CalibrationError> {
        let product = field(xml, "prodname").unwrap_or("ATI Net F/T");
        let counts = |name| {
            let value = field(xml, name)?;
            value.parse().map_err(|_| CalibrationError::Counts { field: name, value: value.to_owned() })
        };
        let (force_unit, moment_unit) = (field(xml, "scfgfu")?, field(xml, "scfgtu")?);
        let read = Self::with_units(product, counts("cfgcpf")?, counts("cfgcpt")?, force_unit, moment_unit)?;
        let serial = field(xml, "cfgcalsn").ok().filter(|serial| !serial.is_empty()).map(str::to_owned);
        Ok(Self { serial, transform: six(xml, "cfgtfx"), ratings: six(xml, "cfgmr"), ..read })
    }

    /// Whether the box applies a tool transformation.
    pub fn is_transformed(&self) -> bool {
        self.transform.is_some_and(|transform| transform.iter().any(|value| *value != 0.0))
    }

    /// Returns the least rated force \[N\] and moment \[N m\] of the channels, if reported.
    pub fn range(&self) -> Option<[f64; 2]> {
        let ratings = self.ratings?;
        let least = |of: &[f64]| of.iter().copied().fold(f64::INFINITY, f64::min);
        let force = least(&ratings[..3]) * self.newtons_per_count * self.counts_per_force;
        Some([force, least(&ratings[3..]) * self.newton_metres_per_count * self.counts_per_moment])
    }

    /// Returns the `netftapi2.xml` of an emulated box.
    pub fn to_xml(&self) -> String {
        let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<netft>\n");
        let (force, moment) = (self.counts_per_force.to_string(), self.counts_per_moment.to_string());
        for (name, value) in [
            ("prodname", self.product.as_str()),
            ("cfgcpf", &force),
            ("cfgcpt", &moment),
            ("scfgfu", &self.force_unit),
            ("scfgtu", &self.moment_unit),
            ("cfgcalsn", self.serial.as_deref().unwrap_or_default()),
        ] {
            // Writing to a String cannot fail.
            let _ = writeln!(xml, "<{name}>{value}</{name}>");
        }
        xml + "</netft>\n"
    }

    /// Returns force \[N\] and moment \[N m\] of a record's counts; `None` for implausible values.
    pub fn wrench(&self, counts: [i32; 6]) -> Option<Wrench<f64>> {
        let force = |axis: usize| f64::from(counts[axis]) * self.newtons_per_count;
        let moment = |axis: usize| f64::from(counts[3 + axis]) * self.newton_metres_per_count;
        let believable = (0..3).all(|axis| force(axis).abs() <= MAX_EFFORT && moment(axis).abs() <= MAX_EFFORT);
        believable.then(|| Wrench {
            force: vec3(force(0), force(1), force(2)),
            moment: vec3(moment(0), moment(1), moment(2)),
        })
    }

    /// Returns the counts of a wrench, saturated at the ends of their range (NaN gives 0).
    pub fn counts(&self, wrench: Wrench<f64>) -> [i32; 6] {
        // `as` saturates.
        let force = wrench.force.map(|value| (value / self.newtons_per_count).round() as i32);
        let moment = wrench.moment.map(|value| (value / self.newton_metres_per_count).round() as i32);
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }
}

fn check_counts(field: &'static str, counts: f64) -> Result<(), CalibrationError> {
    // Refuses NaN too.
    if (1e-3..=1e12).contains(&counts) {
        return Ok(());
    }
    Err(CalibrationError::Counts { field, value: counts.to_string() })
}

fn size(field: &'static str, units: &[(&str, f64)], name: &str) -> Result<f64, CalibrationError> {
    let unit = units.iter().find(|(known, _)| *known == name);
    unit.map(|&(_, size)| size).ok_or_else(|| CalibrationError::Unit { field, value: name.to_owned() })
}

/// Parses six numbers separated by semicolons, commas or blanks; `None` for a missing field or other contents.
fn six(xml: &str, name: &'static str) -> Option<[f64; 6]> {
    let words = field(xml, name).ok()?.split([';', ',', ' ']).filter(|word| !word.is_empty());
    words.map(|word| word.parse().ok()).collect::<Option<Vec<f64>>>()?.try_into().ok()
}

/// Returns the trimmed text between `<name>` and `</name>`.
fn field<'a>(xml: &'a str, name: &'static str) -> Result<&'a str, CalibrationError> {
    let missing = || CalibrationError::Field(name);
    let (_, after) = xml.split_once(&format!("<{name}>")).ok_or_else(missing)?;
    let (value, rest) = after.split_once(&format!("</{name}>")).ok_or_else(missing)?;
    let plain = !value.contains('<') && !rest.contains(&format!("<{name}>")) && value.len() <= 128;
    if plain { Ok(value.trim()) } else { Err(missing()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const XML: &str = "<?xml version=\"1.0\"?><netft><runstat>00000000</runstat><prodname>Gamma</prodname>\
        <cfgcpf> 1000000 </cfgcpf><cfgcpt>1e6</cfgcpt><scfgfu>lbf</scfgfu><scfgtu>lbf-in</scfgtu></netft>";

    #[test]
    fn box_units_convert_to_si() {
        let calibration = NetFtCalibration::from_xml(XML).unwrap();
        assert_eq!(calibration.product, "Gamma");
        let wrench = calibration.wrench([2_000_000, 0, -1_000_000, 3_000_000, 0, 0]).unwrap();
        assert!((wrench.force.x - 8.896_443_230_521).abs() < 1e-12);
        assert!((wrench.force.z + 4.448_221_615_260_5).abs() < 1e-12);
        assert!((wrench.moment.x - 0.338_954_487_082_850_1).abs() < 1e-12);
    }

    #[test]
    fn serial_number_tool_transformation_and_ranges_are_read() {
        let more =
            "<cfgcalsn>FT27462</cfgcalsn><cfgtfx>0;0;132.710;0;0;0</cfgtfx><cfgmr>330;330;990;30;30;30</cfgmr></netft>";
        let xml = XML.replace("lbf-in", "Nm").replace("lbf", "N").replace("</netft>", more);
        let calibration = NetFtCalibration::from_xml(&xml).unwrap();
        assert_eq!(calibration.serial.as_deref(), Some("FT27462"));
        assert!(calibration.is_transformed());
        let [force, moment] = calibration.range().unwrap();
        assert!((force - 330.0).abs() < 1e-9 && (moment - 30.0).abs() < 1e-9, "{force} {moment}");
        let plain = NetFtCalibration::from_xml(&xml.replace("132.710", "0")).unwrap();
        assert!(!plain.is_transformed());
        assert!(!NetFtCalibration::from_xml(XML).unwrap().is_transformed(), "old firmware has no such field");
    }

    #[test]
    fn invalid_calibration_is_refused() {
        for (good, bad) in [
            ("<cfgcpf>", "<cfgcpx>"),
            ("<cfgcpt>", "<cfgcpf>"),
            (" 1000000 ", "0"),
            (" 1000000 ", "-5"),
            (" 1000000 ", "nan"),
            (" 1000000 ", "inf"),
            (" 1000000 ", "1e300"),
            (" 1000000 ", "many"),
            ("lbf-in", "ell"),
            (">lbf<", ">dyn<"),
            ("1e6", "<b>1e6</b>"),
        ] {
            assert!(NetFtCalibration::from_xml(&XML.replacen(good, bad, 1)).is_err(), "{bad}");
        }
        assert!(NetFtCalibration::from_xml(&XML.replace("prodname", "name")).is_ok());
    }

    proptest! {
        #[test]
        fn file_of_the_emulated_box_parses_to_its_calibration(force in 1.0..1e7f64, moment in 1.0..1e7f64, unit in 0..8usize) {
            let unit = FORCE_UNITS[unit].0;
            let calibration = NetFtCalibration::with_units("Omega", force, moment, unit, "N-mm").unwrap();
            prop_assert_eq!(NetFtCalibration::from_xml(&calibration.to_xml()), Ok(calibration));
        }

        #[test]
        fn counts_return(counts: [i16; 6]) {
            let calibration = NetFtCalibration::new(1e6, 1e6).unwrap();
            let counts = counts.map(i32::from);
            prop_assert_eq!(calibration.counts(calibration.wrench(counts).unwrap()), counts);
        }
    }
}
