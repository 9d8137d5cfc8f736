//! The sequence of states against an obedient drive, and against invalid statuswords.

use super::*;
use proptest::prelude::*;

/// Statusword of an obedient drive after a controlword.
fn obey(state: DriveState, word: u16) -> DriveState {
    use DriveState::*;
    match (state, word & 0x8F) {
        (Fault, 0x80) => SwitchOnDisabled,
        (Fault, _) => Fault,
        (OperationEnabled | QuickStopActive, w) if w & 0x06 == 0x02 => QuickStopActive,
        (_, w) if w & 0x02 == 0 => SwitchOnDisabled,
        (SwitchOnDisabled | SwitchedOn | OperationEnabled | ReadyToSwitchOn, w) if w & 0x07 == 0x06 => ReadyToSwitchOn,
        (ReadyToSwitchOn | SwitchedOn, w) if w & 0x0F == 0x07 => SwitchedOn,
        (SwitchedOn, w) if w & 0x0F == 0x0F => OperationEnabled,
        (same, _) => same,
    }
}

fn statusword(state: DriveState) -> u16 {
    match state {
        DriveState::NotReady => 0x00,
        DriveState::SwitchOnDisabled => 0x40,
        DriveState::ReadyToSwitchOn => 0x21,
        DriveState::SwitchedOn => 0x23,
        DriveState::OperationEnabled => 0x27,
        DriveState::QuickStopActive => 0x07,
        DriveState::FaultReaction => 0x0F,
        DriveState::Fault => 0x08,
    }
}

#[test]
fn statuswords_of_real_drives_are_decoded() {
    let read = [0x0250, 0x0231, 0x0233, 0x1237, 0x0217, 0x0218, 0x021F, 0x0200].map(DriveState::of);
    use DriveState::*;
    let meant = [
        SwitchOnDisabled,
        ReadyToSwitchOn,
        SwitchedOn,
        OperationEnabled,
        QuickStopActive,
        Fault,
        FaultReaction,
        NotReady,
    ];
    assert_eq!(read, meant);
}

#[test]
fn drive_reaches_operation_enabled_and_returns() {
    let (mut sequence, mut state, mut words) = (Sequence::new(false), DriveState::SwitchOnDisabled, Vec::new());
    for _ in 0..5 {
        words.push(sequence.step(Wish::On, statusword(state)));
        state = obey(state, words[words.len() - 1]);
    }
    assert_eq!(words, [0x06, 0x07, 0x0F, 0x0F, 0x0F]);
    assert!(sequence.on());
    assert_eq!(sequence.step(Wish::Off, statusword(state)), control::QUICK_STOP);
    assert_eq!(sequence.step(Wish::Off, statusword(DriveState::SwitchOnDisabled)), control::DISABLE_VOLTAGE);
}

#[test]
fn drive_left_on_is_first_switched_off() {
    for left in [DriveState::SwitchedOn, DriveState::OperationEnabled, DriveState::ReadyToSwitchOn] {
        let mut sequence = Sequence::new(false);
        assert_eq!(sequence.step(Wish::On, statusword(left)), control::SHUTDOWN, "{left:?}");
    }
}

#[test]
fn fault_reset_needs_permission_and_precedes_the_first_enabling() {
    let mut sequence = Sequence::new(true);
    let words: Vec<_> = (0..3).map(|_| sequence.step(Wish::On, 0x08)).collect();
    assert_eq!(words, [0x00, 0x80, 0x80]);
    assert_eq!(sequence.step(Wish::On, 0x40), 0x06);
    let mut forbidden = Sequence::new(false);
    assert!((0..10).all(|_| forbidden.step(Wish::On, 0x08) == 0));
}

#[test]
fn drive_in_quick_stop_is_switched_off() {
    let mut sequence = Sequence::new(false);
    let stopped = (0..2000).filter(|_| sequence.step(Wish::Off, 0x07) == control::QUICK_STOP).count();
    assert_eq!(stopped, usize::from(QUICK_STOP_CYCLES) - 1);
    assert_eq!(sequence.step(Wish::Off, 0x07), control::DISABLE_VOLTAGE);
}

#[test]
fn fault_reset_without_effect_times_out() {
    let mut sequence = Sequence::new(true);
    let high = (0..3000).filter(|_| sequence.step(Wish::On, 0x08) == control::FAULT_RESET).count();
    assert_eq!(high, usize::from(RESET_CYCLES) - 1);
}

#[test]
fn tripped_drive_stays_off() {
    let mut sequence = Sequence::new(true);
    for word in [0x40, 0x21, 0x23, 0x27, 0x27] {
        sequence.step(Wish::On, word);
    }
    assert_eq!(sequence.step(Wish::On, 0x08), control::DISABLE_VOLTAGE);
    assert!(sequence.tripped());
    for word in [0x08, 0x40, 0x21, 0x23, 0x27] {
        assert_ne!(sequence.step(Wish::On, word) & 0x0D, 0x0D);
        assert!(!sequence.on());
    }
    sequence.rearm();
    assert_eq!(sequence.step(Wish::On, 0x40), control::SHUTDOWN);
}

fn wishes() -> impl Strategy<Value = Wish> {
    prop_oneof![4 => Just(Wish::On), 1 => Just(Wish::Off)]
}

/// Statuswords: frequently valid ones, and any others.
fn statuswords() -> impl Strategy<Value = u16> {
    let meant = prop_oneof![Just(0x40u16), Just(0x21), Just(0x23), Just(0x27), Just(0x07), Just(0x08), Just(0x0F)];
    prop_oneof![3 => meant, 1 => any::<u16>()]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn operation_is_never_enabled_without_the_sequence(inputs in prop::collection::vec((wishes(), statuswords()), 1..60)) {
        let mut sequence = Sequence::new(true);
        // The oracle has no stages: it searches the history of sent and received words.
        let (mut shutdown, mut switched) = (false, false);
        for (wish, word) in inputs {
            let state = DriveState::of(word);
            let sent = sequence.step(wish, word);
            prop_assert!(wish == Wish::On || !matches!(sent, 0x06 | 0x07 | 0x0F), "{sent:#x} though to be off");
            match sent {
                control::SHUTDOWN => (shutdown, switched) = (true, false),
                control::SWITCH_ON => {
                    prop_assert!(shutdown && state == DriveState::ReadyToSwitchOn);
                    switched = true;
                }
                control::ENABLE_OPERATION => {
                    prop_assert!(shutdown && switched, "enabled without the sequence");
                    prop_assert!(matches!(state, DriveState::SwitchedOn | DriveState::OperationEnabled));
                }
                _ => (shutdown, switched) = (false, false),
            }
            prop_assert!(!sequence.on() || state == DriveState::OperationEnabled && sent == control::ENABLE_OPERATION);
        }
    }
}
