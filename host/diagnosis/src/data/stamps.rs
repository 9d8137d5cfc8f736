//! Time stamps that are missing or repeated.

use crate::data::clock::SignalTable;

/// Largest share of rows with a repeated time stamp, or none, that are omitted.
const MOST_STAMPS: f64 = 0.02;

/// Merges rows with one time stamp that complement each other, as tables with several rates have them, and omits rows
/// whose stamp is missing or repeats that of the row before, if they are few. Returns statements about the rows.
pub(crate) fn with_clock(time: Vec<f64>, signals: SignalTable) -> (Vec<f64>, SignalTable, Vec<String>) {
    let (mut rows, mut merged, mut repeated, mut absent) = (Vec::<usize>::new(), 0, 0, 0);
    let mut own = signals.clone();
    for (row, stamp) in time.iter().enumerate() {
        match rows.last().copied().filter(|last| time[*last] == *stamp) {
            _ if !stamp.is_finite() => absent += 1,
            None => rows.push(row),
            Some(last) if own.values().any(|values| values[row].is_finite() && values[last].is_finite()) => {
                repeated += 1
            }
            Some(last) => {
                own.values_mut().filter(|values| values[row].is_finite()).for_each(|values| values[last] = values[row]);
                merged += 1;
            }
        }
    }
    if (repeated + absent) as f64 > MOST_STAMPS * time.len() as f64 {
        return (time, signals, Vec::new());
    }
    let counts = [
        (repeated, "repeat the time stamp of the row before and are omitted"),
        (absent, "have no time stamp and are omitted"),
        (merged, "complete the row before, whose time stamp they have, and are merged with it"),
    ];
    let note = |(count, what): &(usize, &str)| format!("{count} of {} rows {what}", time.len());
    let notes = counts.iter().filter(|(count, _)| *count > 0).map(note).collect();
    let of = |values: &Vec<f64>| rows.iter().map(|row| values[*row]).collect();
    (of(&time), own.iter().map(|(name, values)| (name.clone(), of(values))).collect(), notes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: f64 = f64::NAN;

    #[test]
    fn complementary_rows_are_merged_and_repeated_ones_omitted() {
        let time: Vec<f64> = [0.0, 1.0, 1.0, 2.0, 2.0].into_iter().chain((3..100).map(f64::from)).collect();
        let mut signals = SignalTable::from([("a".to_owned(), time.clone()), ("b".to_owned(), time.clone())]);
        let set = |signals: &mut SignalTable, name: &str, row: usize| signals.get_mut(name).expect("it")[row] = NONE;
        set(&mut signals, "a", 1);
        set(&mut signals, "b", 2);
        let (stamps, own, notes) = with_clock(time, signals);
        assert_eq!((stamps.len(), own["a"][1], own["b"][1], own["a"][2]), (100, 1.0, 1.0, 2.0));
        assert!(notes.len() == 2 && notes[0].starts_with("1 of 102") && notes[1].contains("merged"), "{notes:?}");
    }

    #[test]
    fn many_repeated_stamps_are_kept_for_the_message() {
        let time = vec![0.0, 1.0, 1.0, 1.0, 2.0];
        let signals = SignalTable::from([("a".to_owned(), time.clone())]);
        assert_eq!(with_clock(time.clone(), signals.clone()), (time, signals, Vec::new()));
    }
}
