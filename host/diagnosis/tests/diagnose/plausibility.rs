//! Signs and units that contradict physics are refused or reported, whatever the parameters of the model.

use crate::bench::Bench;
use crate::bench::Kind;
use softdock_diagnosis::diagnosis::DiagnosisOptions;
use softdock_gauntlet::NoiseColour;

/// A drive whose friction and inertia differ from its model, with one column changed.
fn drive(column: usize, change: impl Fn(f64) -> f64) -> Bench {
    let hidden = [("J1_coulomb", 12.0), ("J15_link_inertia", 0.15)];
    let bench = Bench::of(Kind::Drive { link_encoder: false }, NoiseColour::FirstOrder, &hidden, 5);
    bench.with_recordings(|text| {
        let row = |(number, line): (usize, &str)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if number > 0 {
                cells[column] = format!("{}", change(cells[column].parse().expect("a number")));
            }
            cells.join(",") + "\n"
        };
        text.lines().enumerate().map(row).collect()
    })
}

fn refusal(bench: &Bench) -> String {
    match bench.prepared(&DiagnosisOptions::default()) {
        Ok(prepared) => panic!("accepted with {:?}", prepared.findings),
        Err(error) => format!("{error} | {}", error.remedy()),
    }
}

#[test]
fn reversed_and_unsigned_channels_are_refused() {
    for column in [2, 3] {
        let message = refusal(&drive(column, |value| -value));
        assert!(message.contains("is reversed") && message.contains("scale = -1"), "{column}: {message}");
    }
    let message = refusal(&drive(3, f64::abs));
    assert!(message.contains("`tau` is unsigned"), "{message}");
}

#[test]
fn degrees_for_radians_are_reported_although_parameters_are_off() {
    let prepared = drive(2, f64::to_degrees).prepared(&DiagnosisOptions::default()).expect("legal recordings");
    let is_reported =
        prepared.findings.iter().any(|finding| finding.what.contains("in degrees and declared in radians"));
    assert!(is_reported, "{:?}", prepared.findings);
    let prepared = drive(2, |value| value).prepared(&DiagnosisOptions::default()).expect("legal recordings");
    assert!(prepared.findings.is_empty(), "{:?}", prepared.findings);
}

/// The quality names a clipped torque and nothing else of a good recording.
#[test]
fn saturated_torque_is_in_the_data_quality() {
    let quality = |bench: Bench| bench.prepared(&DiagnosisOptions::default()).expect("legal recordings").data_quality;
    let cut = quality(drive(3, |value| value.clamp(-40.0, 40.0)));
    let found = cut.iter().filter_map(|own| own.signals["tau"].saturated).collect::<Vec<_>>();
    assert!(found.iter().any(|cut| cut.value.abs() == 40.0 && cut.samples > 20), "{found:?}");
    let good = quality(drive(3, |value| value));
    assert!(good.iter().flat_map(|own| own.signals.values()).all(|own| own.saturated.is_none() && own.gaps == 0));
}
