//! Parts of a campaign, for several workers.

/// Part `index` (from 0) of `count` of a campaign: every `count`-th shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Index of the part, from 0.
    pub index: u32,
    /// Number of parts.
    pub count: u32,
}

impl Part {
    /// The whole campaign.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// Returns whether a shard belongs to the part.
    pub fn holds(self, shard: u32) -> bool {
        shard % self.count == self.index
    }
}

impl std::str::FromStr for Part {
    type Err = String;

    /// Reads `I/N`, with I from 1 to N.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse::<u32>().ok()?, n.parse::<u32>().ok()?)));
        match numbers {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index: index - 1, count }),
            _ => Err("write I/N with I from 1 to N: 2/8 is the second of eight parts".to_owned()),
        }
    }
}

/// Reads a part of `I/N`, or of `array/N` with the index that a scheduler has set in the environment.
///
/// # Errors
/// If the text is neither, or this process is no task of an array.
pub fn array_part(text: &str) -> std::result::Result<Part, String> {
    let Some(count) = text.strip_prefix("array/") else { return text.parse() };
    let count: Option<u32> = count.parse().ok().filter(|count| *count > 0);
    Part::of_array(count.ok_or("write array/N with N from 1")?, |name| std::env::var(name).ok())
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index + 1, self.count)
    }
}

/// Variables in which schedulers give a task of an array its index: Slurm, PBS Pro, Torque, LSF, Grid Engine, and an
/// indexed Job of Kubernetes.
pub const ARRAY_INDICES: [&str; 6] =
    ["SLURM_ARRAY_TASK_ID", "PBS_ARRAY_INDEX", "PBS_ARRAYID", "LSB_JOBINDEX", "SGE_TASK_ID", "JOB_COMPLETION_INDEX"];

impl Part {
    /// Returns the part of a task in a scheduler's array with the indices 0 to `count` - 1.
    ///
    /// # Errors
    /// If no variable of [`ARRAY_INDICES`] is set, or its value is out of range.
    pub fn of_array(count: u32, variable: impl Fn(&str) -> Option<String>) -> std::result::Result<Self, String> {
        let found = ARRAY_INDICES.iter().find_map(|name| Some((name, variable(name)?)));
        let Some((name, text)) = found else {
            return Err(format!("this is no task of an array: none of {} is set", ARRAY_INDICES.join(", ")));
        };
        match text.parse() {
            Ok(index) if index < count => Ok(Self { index, count }),
            _ => Err(format!("{name} is `{text}`, and an array of {count} tasks has the indices 0 to {}", count - 1)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_of_a_task_is_its_index_in_the_array() {
        let slurm = |name: &str| (name == "SLURM_ARRAY_TASK_ID").then(|| "3".to_owned());
        assert_eq!(Part::of_array(16, slurm), Ok(Part { index: 3, count: 16 }));
        let error = Part::of_array(3, slurm).expect_err("beyond the array");
        assert!(error.contains("SLURM_ARRAY_TASK_ID is `3`") && error.contains("0 to 2"), "{error}");
        let error = Part::of_array(3, |_| None).expect_err("no array");
        assert!(error.contains("PBS_ARRAY_INDEX"), "{error}");
    }
}
