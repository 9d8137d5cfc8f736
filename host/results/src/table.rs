//! A small columnar table: what goes into a Parquet file and comes out of it.

use std::collections::BTreeSet;
use std::sync::Arc;

use arrow_array::types::Int32Type;
use arrow_array::{
    Array, ArrayRef, BooleanArray, DictionaryArray, Float64Array, Int32Array, Int64Array, RecordBatch, StringArray,
    UInt32Array, UInt64Array,
};
use arrow_schema::{DataType, Field, Schema};

/// Role of a column; the file's metadata use the same words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnKind {
    /// Names the row.
    Key,
    /// What became of the run.
    Status,
    /// A drawn and applied input.
    Input,
    /// A measured outcome.
    Metric,
    /// Distance to a requirement's limit, positive inside.
    Margin,
    /// Passed or not.
    Verdict,
    /// A quantity over time.
    Signal,
}

const KINDS: [(ColumnKind, &str); 7] = [
    (ColumnKind::Key, "key"),
    (ColumnKind::Status, "status"),
    (ColumnKind::Input, "input"),
    (ColumnKind::Metric, "metric"),
    (ColumnKind::Margin, "margin"),
    (ColumnKind::Verdict, "verdict"),
    (ColumnKind::Signal, "signal"),
];

impl ColumnKind {
    /// The word in the field metadata.
    pub fn word(self) -> &'static str {
        KINDS[self as usize].1
    }

    fn from_word(word: &str) -> Option<Self> {
        KINDS.iter().find(|(_, other)| *other == word).map(|(kind, _)| *kind)
    }
}

/// The values of one column; a missing value is `None` here, null in the file, and never NaN.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Whole numbers, 64 bits.
    U64(Vec<u64>),
    /// Whole numbers with a sign, 64 bits: times in nanoseconds.
    I64(Vec<i64>),
    /// Whole numbers or flag bits, 32 bits.
    U32(Vec<u32>),
    /// Real numbers.
    F64(Vec<Option<f64>>),
    /// Truth values.
    Bool(Vec<Option<bool>>),
    /// Words of a small vocabulary, which is the same in every file of one kind.
    Words {
        /// The vocabulary.
        vocabulary: Vec<String>,
        /// Position of each row's word.
        codes: Vec<u32>,
    },
}

impl Values {
    /// Words with the given vocabulary; a row's code is a position in it.
    pub fn words(vocabulary: &[&str], codes: Vec<u32>) -> Self {
        Self::Words { vocabulary: vocabulary.iter().map(|word| (*word).to_owned()).collect(), codes }
    }

    /// Words whose vocabulary is what occurs, in alphabetical order.
    pub fn words_of<'a>(words: impl Iterator<Item = &'a str> + Clone) -> Self {
        let vocabulary: Vec<&str> = words.clone().collect::<BTreeSet<_>>().into_iter().collect();
        let code = |word| vocabulary.binary_search(&word).expect("every word is in the vocabulary") as u32;
        Self::words(&vocabulary, words.map(code).collect())
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Self::U64(values) => values.len(),
            Self::I64(values) => values.len(),
            Self::U32(values) => values.len(),
            Self::F64(values) => values.len(),
            Self::Bool(values) => values.len(),
            Self::Words { codes, .. } => codes.len(),
        }
    }

    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The word of a row, if this is a column of words.
    pub fn word(&self, row: usize) -> Option<&str> {
        match self {
            Self::Words { vocabulary, codes } => Some(vocabulary[codes[row] as usize].as_str()),
            _ => None,
        }
    }

    /// Puts the rows of another part of the same column behind these; false if the types differ.
    pub(crate) fn append(&mut self, other: Self) -> bool {
        match (self, other) {
            (Self::U64(values), Self::U64(mut more)) => values.append(&mut more),
            (Self::I64(values), Self::I64(mut more)) => values.append(&mut more),
            (Self::U32(values), Self::U32(mut more)) => values.append(&mut more),
            (Self::F64(values), Self::F64(mut more)) => values.append(&mut more),
            (Self::Bool(values), Self::Bool(mut more)) => values.append(&mut more),
            (Self::Words { vocabulary, codes }, Self::Words { vocabulary: words, codes: more }) => {
                // Parquet keeps only the words in use, in order of appearance: positions differ from part to part.
                let positions: Vec<u32> = words.into_iter().map(|word| position(vocabulary, word)).collect();
                codes.extend(more.into_iter().map(|code| positions[code as usize]));
            }
            _ => return false,
        }
        true
    }

    fn data_type(&self) -> DataType {
        match self {
            Self::U64(_) => DataType::UInt64,
            Self::I64(_) => DataType::Int64,
            Self::U32(_) => DataType::UInt32,
            Self::F64(_) => DataType::Float64,
            Self::Bool(_) => DataType::Boolean,
            Self::Words { .. } => DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8)),
        }
    }

    fn array(&self) -> ArrayRef {
        match self {
            Self::U64(values) => Arc::new(UInt64Array::from(values.clone())),
            Self::I64(values) => Arc::new(Int64Array::from(values.clone())),
            Self::U32(values) => Arc::new(UInt32Array::from(values.clone())),
            Self::F64(values) => {
                Arc::new(values.iter().map(|value| value.filter(|number| !number.is_nan())).collect::<Float64Array>())
            }
            Self::Bool(values) => Arc::new(BooleanArray::from(values.clone())),
            Self::Words { vocabulary, codes } => {
                let keys = Int32Array::from_iter_values(codes.iter().map(|code| *code as i32));
                Arc::new(DictionaryArray::<Int32Type>::new(keys, Arc::new(StringArray::from(vocabulary.clone()))))
            }
        }
    }

    /// The values of an array, or `None` for a type that the contract does not use.
    pub(crate) fn from_array(array: &dyn Array) -> Option<Self> {
        let any = array.as_any();
        if let Some(values) = any.downcast_ref::<UInt64Array>() {
            return Some(Self::U64(values.values().to_vec()));
        }
        if let Some(values) = any.downcast_ref::<Int64Array>() {
            return Some(Self::I64(values.values().to_vec()));
        }
        if let Some(values) = any.downcast_ref::<UInt32Array>() {
            return Some(Self::U32(values.values().to_vec()));
        }
        if let Some(values) = any.downcast_ref::<Float64Array>() {
            return Some(Self::F64(values.iter().collect()));
        }
        if let Some(values) = any.downcast_ref::<BooleanArray>() {
            return Some(Self::Bool(values.iter().collect()));
        }
        let words = any.downcast_ref::<DictionaryArray<Int32Type>>()?;
        let vocabulary = words.values().as_any().downcast_ref::<StringArray>()?;
        Some(Self::Words {
            vocabulary: vocabulary.iter().map(|word| word.unwrap_or_default().to_owned()).collect(),
            codes: words.keys().values().iter().map(|code| *code as u32).collect(),
        })
    }
}

/// Position of a word in a vocabulary, which grows if it is new.
fn position(vocabulary: &mut Vec<String>, word: String) -> u32 {
    let known = vocabulary.iter().position(|other| *other == word);
    known.unwrap_or_else(|| {
        vocabulary.push(word);
        vocabulary.len() - 1
    }) as u32
}

/// One named column with what a reader needs to understand it.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// snake_case, with the unit as a suffix.
    pub name: String,
    /// SI unit, `1` for a pure number.
    pub unit: String,
    /// What the number means, with its frame.
    pub description: String,
    /// Which part of softdock wrote it.
    pub source: String,
    /// What part it plays.
    pub kind: ColumnKind,
    /// Its values, one per row.
    pub values: Values,
}

impl Column {
    fn field(&self) -> Field {
        let nullable = matches!(self.values, Values::F64(_) | Values::Bool(_));
        Field::new(&self.name, self.values.data_type(), nullable).with_metadata([
            ("unit", self.unit.as_str()),
            ("description", &self.description),
            ("source", &self.source),
            ("kind", self.kind.word()),
        ])
    }

    fn from_arrow(field: &Field, array: &dyn Array) -> Option<Self> {
        let text = |key: &str| field.metadata().get(key).cloned().unwrap_or_default();
        Some(Self {
            name: field.name().clone(),
            unit: text("unit"),
            description: text("description"),
            source: text("source"),
            kind: ColumnKind::from_word(&text("kind"))?,
            values: Values::from_array(array)?,
        })
    }
}

/// Columns of equal length.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Table {
    /// The columns, in file order.
    pub columns: Vec<Column>,
}

impl Table {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// A column by its name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The real numbers of a column by its name.
    pub fn f64s(&self, name: &str) -> Option<&[Option<f64>]> {
        match &self.column(name)?.values {
            Values::F64(values) => Some(values),
            _ => None,
        }
    }

    /// The truth values of a column by its name.
    pub fn bools(&self, name: &str) -> Option<&[Option<bool>]> {
        match &self.column(name)?.values {
            Values::Bool(values) => Some(values),
            _ => None,
        }
    }

    /// The 64-bit whole numbers of a column by its name.
    pub fn u64s(&self, name: &str) -> Option<&[u64]> {
        match &self.column(name)?.values {
            Values::U64(values) => Some(values),
            _ => None,
        }
    }

    /// The 64-bit whole numbers with a sign of a column by its name.
    pub fn i64s(&self, name: &str) -> Option<&[i64]> {
        match &self.column(name)?.values {
            Values::I64(values) => Some(values),
            _ => None,
        }
    }

    /// The 32-bit whole numbers of a column by its name.
    pub fn u32s(&self, name: &str) -> Option<&[u32]> {
        match &self.column(name)?.values {
            Values::U32(values) => Some(values),
            _ => None,
        }
    }

    /// Puts the rows of a table with the same columns behind these; false if the columns differ.
    #[must_use]
    pub fn append(&mut self, other: Self) -> bool {
        let alike = self.columns.len() == other.columns.len()
            && self.columns.iter().zip(&other.columns).all(|(one, two)| one.name == two.name);
        alike && self.columns.iter_mut().zip(other.columns).all(|(one, two)| one.values.append(two.values))
    }

    pub(crate) fn schema(&self) -> Schema {
        Schema::new(self.columns.iter().map(Column::field).collect::<Vec<_>>())
    }

    pub(crate) fn batch(&self) -> std::result::Result<RecordBatch, arrow_schema::ArrowError> {
        let arrays = self.columns.iter().map(|column| column.values.array()).collect();
        RecordBatch::try_new(Arc::new(self.schema()), arrays)
    }

    /// The table of a batch, or the name of the column that the contract does not know.
    pub(crate) fn from_batch(batch: &RecordBatch) -> std::result::Result<Self, String> {
        let schema = batch.schema();
        let columns = schema.fields().iter().zip(batch.columns());
        let columns = columns
            .map(|(field, array)| Column::from_arrow(field, array).ok_or_else(|| field.name().clone()))
            .collect::<std::result::Result<_, _>>()?;
        Ok(Self { columns })
    }
}
