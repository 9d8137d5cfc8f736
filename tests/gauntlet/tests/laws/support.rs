//! Reading recordings back, and runs that the tests of all rigs make.

use softdock_gauntlet::{Hidden, NoiseColour, Rig, Set, generate};

/// All rigs.
pub(crate) const RIGS: &[Rig] = &[
    Rig::Drive { link_encoder: false },
    Rig::Drive { link_encoder: true },
    Rig::Contact,
    Rig::Sensor,
    Rig::Command,
    Rig::Body,
];

/// A recording's columns.
pub(crate) struct Recording {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Recording {
    pub(crate) fn read(csv: &str) -> Self {
        let mut lines = csv.lines();
        let names = lines.next().expect("a head").split(',').map(String::from).collect();
        let number = |cell: &str| cell.parse::<f64>().expect("a number");
        Self { names, rows: lines.map(|line| line.split(',').map(number).collect()).collect() }
    }

    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    pub(crate) fn column(&self, name: &str) -> Vec<f64> {
        let at = self.names.iter().position(|known| known == name).expect(name);
        self.rows.iter().map(|row| row[at]).collect()
    }

    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }
}

/// A set with one effect, or none, first-order noise.
pub(crate) fn set(rig: Rig, hidden: &[Hidden], seed: u64) -> Set {
    generate(rig, hidden, NoiseColour::FirstOrder, seed).expect("a set")
}

/// Root mean square of the difference of two columns.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}
