//! Handles of the columns of a runs table: each is a name with the type of its values.
//!
//! ```
//! use softdock_results::columns::{AGREEMENT, Loop, RUN};
//! # fn print(table: &softdock_results::Table) -> Result<(), softdock_results::columns::ColumnError> {
//! let (run, agreement) = (table.get(&RUN)?, table.get(&AGREEMENT)?);
//! let outcome = table.get(&Loop::Hil.outcome())?;
//! for row in 0..table.rows() {
//!     println!("{} {:?} {:?}", run[row], agreement.at(row), outcome.at(row));
//! }
//! # Ok(())
//! # }
//! ```

use super::{Agreement, Outcome, Phase, Status, input_fields, metric_fields};
use crate::table::{Table, Values};
use softdock_kernels::fields::Field;
use std::borrow::Cow;
use std::marker::PhantomData;

/// Run number.
pub static RUN: ColumnHandle<u64> = ColumnHandle::new("run");
/// Number of the outer draw.
pub static OUTER: ColumnHandle<u32> = ColumnHandle::new("outer");
/// Status of the run.
pub static STATUS: ColumnHandle<Status> = ColumnHandle::new("status");
/// The facility's verdict against the verdict of space.
pub static AGREEMENT: ColumnHandle<Agreement> = ColumnHandle::new("agreement");
/// Flag bits.
pub static FLAGS: ColumnHandle<u32> = ColumnHandle::new("flags");
/// Effective mass along the contact normal at first touch \[kg\].
pub static EFFECTIVE_MASS: ColumnHandle<f64> = ColumnHandle::new("effective_mass_kg");

/// Column of an input, from the field table of `Params`.
pub fn input(field: &Field) -> ColumnHandle<f64> {
    ColumnHandle::named(format!("{INPUT}{}", field.column()))
}

/// Column of the input with the name of a parameter.
///
/// # Panics
/// If there is no parameter of this name.
pub fn input_named(parameter: &str) -> ColumnHandle<f64> {
    let field = input_fields().into_iter().find(|field| field.name == parameter);
    input(&field.unwrap_or_else(|| panic!("`{parameter}` is a parameter")))
}

/// The parameter of an input column.
pub fn parameter_of(column: &str) -> Option<Field> {
    let name = column.strip_prefix(INPUT)?;
    input_fields().into_iter().find(|field| field.column() == name)
}

/// Prefix of the inputs.
const INPUT: &str = "in_";

/// The two loops of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loop {
    /// The task in space.
    Space,
    /// The task on the facility.
    Hil,
}

impl Loop {
    /// Space, then the facility.
    pub const BOTH: [Self; 2] = [Self::Space, Self::Hil];

    /// Prefix of its columns.
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Space => "space",
            Self::Hil => "hil",
        }
    }

    /// "in space", "on the facility".
    pub(crate) fn place(self) -> &'static str {
        match self {
            Self::Space => "in space",
            Self::Hil => "on the facility",
        }
    }

    /// How the loop ended.
    pub fn outcome(self) -> ColumnHandle<Outcome> {
        self.column("outcome")
    }

    /// Id of the criterion, rule or flag by which it did not pass; [`NO_CAUSE`] if it passed.
    pub fn cause(self) -> ColumnHandle<String> {
        self.column("cause")
    }

    /// Time of the cause \[s\].
    pub fn cause_time(self) -> ColumnHandle<f64> {
        self.column("cause_time_s")
    }

    /// Value of the cause, in SI units.
    pub fn cause_value(self) -> ColumnHandle<f64> {
        self.column("cause_value")
    }

    /// Limit of the cause, in SI units.
    pub fn cause_limit(self) -> ColumnHandle<f64> {
        self.column("cause_limit")
    }

    /// Phase of the run in which the cause was.
    pub fn cause_phase(self) -> ColumnHandle<Option<Phase>> {
        self.column("cause_phase")
    }

    /// A metric; `None` where the loop has no such column: in space no energy can be injected.
    pub fn metric(self, field: &Field) -> Option<ColumnHandle<f64>> {
        self.has_metric(&field.name).then(|| self.column(&field.column()))
    }

    /// The metric of this name.
    ///
    /// # Panics
    /// If the loop has no metric of this name.
    pub fn metric_named(self, metric: &str) -> ColumnHandle<f64> {
        let field = metric_fields().into_iter().find(|field| field.name == metric);
        field.and_then(|field| self.metric(&field)).unwrap_or_else(|| panic!("`{metric}` is a metric of {self:?}"))
    }

    /// Whether the loop has a column for a metric.
    pub fn has_metric(self, metric: &str) -> bool {
        self == Self::Hil || metric != "injected_energy"
    }

    /// A metric of the table or of the campaign; `name` with its unit as a suffix.
    pub fn metric_column(self, name: &str) -> ColumnHandle<f64> {
        self.column(name)
    }

    /// Margin of a requirement; `id` as in column names.
    pub fn margin(self, id: &str) -> ColumnHandle<f64> {
        self.column(&format!("margin_{id}"))
    }

    /// Whether a requirement holds; `id` as in column names.
    pub fn pass(self, id: &str) -> ColumnHandle<bool> {
        self.column(&format!("pass_{id}"))
    }

    /// The rest of a column's name if the column is one of this loop.
    pub fn strip(self, column: &str) -> Option<&str> {
        column.strip_prefix(self.prefix())?.strip_prefix('_')
    }

    /// Loop and requirement of a pass column.
    pub fn of_pass(column: &str) -> Option<(Self, &str)> {
        Self::BOTH.into_iter().find_map(|side| Some((side, side.strip(column)?.strip_prefix("pass_")?)))
    }

    /// Id of the requirement whose margin a column of this loop holds.
    pub(crate) fn margin_id(self, column: &str) -> Option<&str> {
        self.strip(column)?.strip_prefix("margin_")
    }

    fn column<T>(self, name: &str) -> ColumnHandle<T> {
        ColumnHandle::named(format!("{}_{name}", self.prefix()))
    }
}

/// Text of a cause column for a loop that passed.
pub const NO_CAUSE: &str = "none";

/// A column of a runs table: its name and the type of its values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnHandle<T> {
    name: Cow<'static, str>,
    values: PhantomData<fn() -> T>,
}

impl<T> ColumnHandle<T> {
    const fn new(name: &'static str) -> Self {
        Self { name: Cow::Borrowed(name), values: PhantomData }
    }

    /// The handle of a column that is known by its name alone.
    pub fn named(name: String) -> Self {
        Self { name: Cow::Owned(name), values: PhantomData }
    }

    /// Name in the file.
    pub const fn name(&self) -> &str {
        match &self.name {
            Cow::Borrowed(name) => name,
            Cow::Owned(name) => name.as_str(),
        }
    }

    /// Name in the file.
    pub fn into_name(self) -> String {
        self.name.into_owned()
    }
}

/// A table without a column of the expected type.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ColumnError {
    /// It is absent, or of another type.
    #[error("no column `{0}` of the expected type")]
    Missing(String),
    /// A text is none of the expected ones.
    #[error("column `{column}` holds the unknown word `{word}`")]
    UnknownWord {
        /// Name of the column.
        column: String,
        /// The text.
        word: String,
    },
}

impl From<ColumnError> for String {
    fn from(error: ColumnError) -> Self {
        error.to_string()
    }
}

/// A type of values that columns hold.
pub trait ColumnType {
    /// The values, one per row.
    type View<'a>;

    /// The values of a column.
    ///
    /// # Errors
    /// If they are of another type.
    fn view<'a>(name: &str, values: &'a Values) -> Result<Self::View<'a>, ColumnError>;
}

macro_rules! plain_column {
    ($($ty:ty => $variant:ident as $value:ty;)*) => {$(
        impl ColumnType for $ty {
            type View<'a> = &'a [$value];
            fn view<'a>(name: &str, values: &'a Values) -> Result<Self::View<'a>, ColumnError> {
                match values {
                    Values::$variant(values) => Ok(values),
                    _ => Err(ColumnError::Missing(name.to_owned())),
                }
            }
        }
    )*};
}

plain_column! {
    u64 => U64 as u64;
    u32 => U32 as u32;
    f64 => F64 as Option<f64>;
    bool => Bool as Option<bool>;
}

/// Texts of a column.
#[derive(Clone, Copy, Debug)]
pub struct Texts<'a> {
    vocabulary: &'a [String],
    codes: &'a [u32],
}

impl<'a> Texts<'a> {
    /// The text of a row.
    pub fn at(&self, row: usize) -> &'a str {
        &self.vocabulary[self.codes[row] as usize]
    }
}

impl ColumnType for String {
    type View<'a> = Texts<'a>;
    fn view<'a>(name: &str, values: &'a Values) -> Result<Self::View<'a>, ColumnError> {
        match values {
            Values::Words { vocabulary, codes } => Ok(Texts { vocabulary, codes }),
            _ => Err(ColumnError::Missing(name.to_owned())),
        }
    }
}

/// A value that a file holds as one of a few words.
pub trait Word: Copy {
    /// The value of a word.
    fn of_word(word: &str) -> Option<Self>;
}

/// Values of a column of words.
#[derive(Clone, Debug)]
pub struct Words<'a, W> {
    vocabulary: Vec<W>,
    codes: &'a [u32],
}

impl<W: Word> Words<'_, W> {
    /// The value of a row.
    pub fn at(&self, row: usize) -> W {
        self.vocabulary[self.codes[row] as usize]
    }
}

macro_rules! word_column {
    ($($ty:ty => $from:expr;)*) => {$(
        impl Word for $ty {
            fn of_word(word: &str) -> Option<Self> {
                $from(word)
            }
        }
        impl ColumnType for $ty {
            type View<'a> = Words<'a, $ty>;
            fn view<'a>(name: &str, values: &'a Values) -> Result<Self::View<'a>, ColumnError> {
                let Texts { vocabulary, codes } = String::view(name, values)?;
                let unknown = |word: &String| ColumnError::UnknownWord { column: name.to_owned(), word: word.clone() };
                let known = |word: &String| <$ty>::of_word(word).ok_or_else(|| unknown(word));
                Ok(Words { vocabulary: vocabulary.iter().map(known).collect::<Result<_, _>>()?, codes })
            }
        }
    )*};
}

word_column! {
    Status => Status::from_word;
    Agreement => Agreement::from_word;
    Outcome => Outcome::from_word;
    Option<Phase> => Phase::of_column;
}

impl Table {
    /// The values of a column.
    ///
    /// # Errors
    /// If there is no such column, or its values are of another type.
    pub fn get<T: ColumnType>(&self, handle: &ColumnHandle<T>) -> Result<T::View<'_>, ColumnError> {
        let column = self.column(handle.name()).ok_or_else(|| ColumnError::Missing(handle.name().to_owned()))?;
        T::view(handle.name(), &column.values)
    }
}
