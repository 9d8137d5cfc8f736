//! Usual mappings of drives, unusable ones, and arbitrary ones.

use super::*;
use proptest::prelude::*;

fn entries(words: &[u32]) -> Vec<PdoEntry> {
    words.iter().map(|word| PdoEntry::from_word(*word)).collect()
}

#[test]
fn usual_mapping_is_located() {
    let outputs = DriveOutputs::find(&entries(&[0x6040_0010, 0x607A_0020, 0x60FF_0020, 0x6060_0008])).unwrap();
    assert_eq!(outputs, DriveOutputs { controlword: 0, target: 2, mode: Some(10), length: 11 });
    let inputs = DriveInputs::find(&entries(&[0x6041_0010, 0x6064_0020, 0x606C_0020, 0x6061_0008])).unwrap();
    let none = (inputs.torque, inputs.error);
    assert_eq!(
        (inputs.statusword, inputs.position, inputs.velocity, inputs.mode, inputs.length),
        (0, 2, Some(6), Some(10), 11)
    );
    assert_eq!(none, (None, None));
}

#[test]
fn other_order_and_gaps_are_supported() {
    // A gap of one byte has the index 0.
    let outputs = DriveOutputs::find(&entries(&[0x6060_0008, 0x0000_0008, 0x607A_0020, 0x6040_0010])).unwrap();
    assert_eq!(outputs, DriveOutputs { controlword: 6, target: 2, mode: Some(0), length: 8 });
    let inputs = DriveInputs::find(&entries(&[0x603F_0010, 0x6077_0010, 0x6064_0020, 0x6041_0010])).unwrap();
    assert_eq!((inputs.error, inputs.torque, inputs.position, inputs.statusword), (Some(0), Some(2), 4, 8));
}

#[test]
fn refusals_state_the_object() {
    let text = |words: &[u32]| DriveOutputs::find(&entries(words)).unwrap_err().to_string();
    assert_eq!(
        text(&[0x6040_0010, 0x60FF_0020]),
        "object 607A (target position) is not mapped in its outputs: choose a PDO with it in 1C12"
    );
    assert!(text(&[0x6040_0010, 0x607A_0010]).contains("607A (target position) is mapped with 16 bit instead of 32"));
    assert!(
        text(&[0x60FE_0101, 0x6040_0010, 0x607A_0020]).contains("6040 (controlword) does not begin at a byte boundary")
    );
    assert!(DriveInputs::find(&[]).unwrap_err().to_string().contains("6041 (statusword) is not mapped in its inputs"));
    assert!(DriveInputs::find(&entries(&[0x6041_0010])).unwrap_err().to_string().contains("6064"));
}

#[test]
fn commands_and_reports_use_their_offsets() {
    let outputs = DriveOutputs::find(&entries(&[0x6040_0010, 0x607A_0020, 0x6060_0008])).unwrap();
    let mut bytes = [0u8; 7];
    assert!(outputs.write(&mut bytes, &ServoCommand { controlword: 0x0F, target: -2 }, 8));
    assert_eq!(bytes, [0x0F, 0, 0xFE, 0xFF, 0xFF, 0xFF, 8]);
    assert!(!outputs.write(&mut bytes[..6], &ServoCommand::default(), 8));
    let inputs = DriveInputs::find(&entries(&[0x6041_0010, 0x6064_0020, 0x6077_0010])).unwrap();
    let report = inputs.read(&[0x37, 0x02, 1, 0, 0, 0, 0xFF, 0xFF]).unwrap();
    assert_eq!((report.statusword, report.position, report.torque, report.velocity), (0x0237, 1, Some(-1), None));
    assert_eq!(inputs.read(&[0; 5]), None);
}

proptest! {
    #[test]
    fn arbitrary_mappings_stay_within_their_bytes(
        words in prop::collection::vec(
            prop_oneof![any::<u32>(), Just(0x6040_0010), Just(0x607A_0020), Just(0x6041_0010), Just(0x6064_0020), Just(0x6060_0008)],
            0..24,
        )
    ) {
        let entries = entries(&words);
        if let Ok(outputs) = DriveOutputs::find(&entries) {
            let mut bytes = vec![0; outputs.length];
            let all = ServoCommand { controlword: 0xFFFF, target: -1 };
            prop_assert!(outputs.write(&mut bytes, &all, -1));
        }
        if let Ok(inputs) = DriveInputs::find(&entries) {
            prop_assert!(inputs.read(&vec![0; inputs.length]).is_some());
        }
        prop_assert!(entries.iter().zip(&words).all(|(entry, word)| entry.to_word() == *word));
    }

    #[test]
    fn arbitrary_inputs_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..20)) {
        let inputs = DriveInputs::find(&entries(&[0x6041_0010, 0x6064_0020, 0x606C_0020, 0x6077_0010])).unwrap();
        prop_assert_eq!(inputs.read(&bytes).is_some(), bytes.len() >= 6);
    }
}
