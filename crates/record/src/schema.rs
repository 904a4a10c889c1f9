//! A table's schema in terms of Parquet, and the key-value pairs in every file.

use std::ops::Not;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::errors::Result;
use parquet::file::metadata::{KeyValue, ParquetMetaData};
use parquet::schema::types::{Type, TypePtr};
use serde::{Deserialize, Serialize};
use sidestep_kernel::ports::{ColumnSpec, ColumnType, RecordError, TableSchema};

use crate::format;

/// Key of the [`FormatVersion`](format::FormatVersion).
pub(crate) const FORMAT: &str = "sidestep.format";
/// Key of the version of the program that wrote the file.
pub(crate) const VERSION: &str = "sidestep.version";
/// Key of the scenario's text.
pub(crate) const SCENARIO: &str = "sidestep.scenario";
/// Key of the seed, in decimal.
pub(crate) const SEED: &str = "sidestep.seed";
/// Key of the columns: a JSON list of [`ColumnEntry`].
pub(crate) const COLUMNS: &str = "sidestep.columns";
/// Key of [`TableSchema::about`]: a JSON object of texts.
pub(crate) const ABOUT: &str = "sidestep.about";
/// Key of the row groups' checksums: a CRC-32 of each one's bytes, in hexadecimal.
pub(crate) const CHECKSUMS: &str = "sidestep.crc32";
/// Key of the cycle at which the next part starts; `end` in the last part of a run.
pub(crate) const NEXT_CYCLE: &str = "sidestep.next_cycle";

/// The origin of a run, recorded in each of its files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// Version of the program that made the run.
    pub program_version: String,
    /// The scenario's text, with every default and include resolved.
    pub scenario: String,
    /// The seed of the run, in case an option has replaced that of the scenario.
    pub seed: u64,
}

/// One column in [`COLUMNS`], with what the Parquet schema cannot express.
#[derive(Debug, Serialize, Deserialize)]
struct ColumnEntry {
    name: String,
    #[serde(rename = "type", with = "type_name")]
    ty: ColumnType,
    meaning: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    labels: Vec<String>,
    #[serde(default, skip_serializing_if = "Not::not")]
    nullable: bool,
}

/// Writes column types by the kernel's names for them, which files keep even if the variants in Rust change.
mod type_name {
    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::Serializer;
    use sidestep_kernel::ports::ColumnType;

    pub(super) fn serialize<S: Serializer>(ty: &ColumnType, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(ty.name())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<ColumnType, D::Error> {
        let name = String::deserialize(from)?;
        ColumnType::from_name(&name)
            .ok_or_else(|| D::Error::custom(format!("there is no column type `{name}`")))
    }
}

/// Refuses a schema that cannot become a file: a name that is not a plain file name, no columns,
/// two columns with the same name, two labels with the same text.
pub(crate) fn check_schema(schema: &TableSchema) -> std::result::Result<(), RecordError> {
    match schema_fault(schema) {
        Some(cause) => Err(RecordError::new(&schema.name, cause)),
        None => Ok(()),
    }
}

fn schema_fault(schema: &TableSchema) -> Option<String> {
    let mut characters = schema.name.chars();
    let is_plain = characters.all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if schema.name.is_empty() || !is_plain {
        return Some("a table's name has letters, digits, `_` and `-` only".into());
    }
    if schema.columns.is_empty() {
        return Some("a table has at least one column".into());
    }
    if let Some(name) = first_duplicate(schema.columns.iter().map(|c| &c.name)) {
        return Some(format!("two columns are named `{name}`"));
    }
    for column in &schema.columns {
        if let Some(label) = first_duplicate(column.labels.iter()) {
            return Some(format!("column `{}` has the label `{label}` twice", column.name));
        }
    }
    None
}

/// Returns the first text, in sorted order, that occurs more than once.
fn first_duplicate<'a>(texts: impl Iterator<Item = &'a String>) -> Option<&'a String> {
    let mut sorted: Vec<_> = texts.collect();
    sorted.sort();
    sorted.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0])
}

/// Returns the Parquet schema: unsigned integers are marked as such, labels are text, and columns
/// are required unless values may be missing.
pub(crate) fn parquet_schema(schema: &TableSchema) -> Result<TypePtr> {
    let fields = schema.columns.iter().map(field).collect::<Result<_>>()?;
    Ok(Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?))
}

fn field(column: &ColumnSpec) -> Result<TypePtr> {
    let logical = match column.ty {
        ColumnType::U32 => Some(LogicalType::integer(32, false)),
        ColumnType::I32 => Some(LogicalType::integer(32, true)),
        ColumnType::U64 => Some(LogicalType::integer(64, false)),
        ColumnType::I64 => Some(LogicalType::integer(64, true)),
        ColumnType::F64 | ColumnType::Bool => None,
        ColumnType::Label | ColumnType::Text => Some(LogicalType::String),
    };
    let repetition = if column.is_nullable { Repetition::OPTIONAL } else { Repetition::REQUIRED };
    let field = Type::primitive_type_builder(&column.name, physical_type(column.ty))
        .with_repetition(repetition)
        .with_logical_type(logical)
        .build()?;
    Ok(Arc::new(field))
}

/// Returns the Parquet type that stores the values of a column.
pub(crate) fn physical_type(ty: ColumnType) -> PhysicalType {
    match ty {
        ColumnType::U32 | ColumnType::I32 => PhysicalType::INT32,
        ColumnType::U64 | ColumnType::I64 => PhysicalType::INT64,
        ColumnType::F64 => PhysicalType::DOUBLE,
        ColumnType::Bool => PhysicalType::BOOLEAN,
        ColumnType::Label | ColumnType::Text => PhysicalType::BYTE_ARRAY,
    }
}

/// Returns the key-value pairs of a file of `schema`.
pub(crate) fn key_values(schema: &TableSchema, origin: &Provenance) -> Vec<KeyValue> {
    let pairs = [
        (FORMAT, format::CURRENT.to_string()),
        (VERSION, origin.program_version.clone()),
        (SCENARIO, origin.scenario.clone()),
        (SEED, origin.seed.to_string()),
        (COLUMNS, columns_to_json(&schema.columns)),
        (ABOUT, about_to_json(&schema.about)),
    ];
    pairs.into_iter().map(|(key, value)| KeyValue::new(key.to_string(), value)).collect()
}

/// Returns the value of `key` in a file's footer.
pub(crate) fn key_value<'a>(metadata: &'a ParquetMetaData, key: &str) -> Option<&'a str> {
    let mut pairs = metadata.file_metadata().key_value_metadata().into_iter().flatten();
    pairs.find(|pair| pair.key == key)?.value.as_deref()
}

fn columns_to_json(columns: &[ColumnSpec]) -> String {
    let entries = columns.iter().map(|c| ColumnEntry {
        name: c.name.clone(),
        ty: c.ty,
        meaning: c.meaning.clone(),
        labels: c.labels.clone(),
        nullable: c.is_nullable,
    });
    let entries: Vec<_> = entries.collect();
    serde_json::to_string(&entries).expect("texts and lists always become JSON")
}

/// Reads the columns that [`key_values`] wrote.
///
/// # Errors
/// Text that is not a list of columns.
pub(crate) fn columns_from_json(text: &str) -> serde_json::Result<Vec<ColumnSpec>> {
    let entries: Vec<ColumnEntry> = serde_json::from_str(text)?;
    let specs = entries.into_iter().map(|e| ColumnSpec {
        name: e.name,
        ty: e.ty,
        meaning: e.meaning,
        labels: e.labels,
        is_nullable: e.nullable,
    });
    Ok(specs.collect())
}

fn about_to_json(about: &[(String, String)]) -> String {
    let facts = about.iter().map(|(name, fact)| (name.clone(), fact.as_str().into()));
    serde_json::Value::Object(facts.collect()).to_string()
}

/// Reads the facts that [`key_values`] wrote.
///
/// # Errors
/// Text that is not an object of texts.
pub(crate) fn about_from_json(text: &str) -> serde_json::Result<Vec<(String, String)>> {
    let facts: serde_json::Map<String, serde_json::Value> = serde_json::from_str(text)?;
    let mut about = Vec::with_capacity(facts.len());
    for (name, value) in facts {
        about.push((name, serde_json::from_value(value)?));
    }
    Ok(about)
}

/// Returns the value of [`CHECKSUMS`].
pub(crate) fn checksums_to_text(checksums: &[u32]) -> String {
    checksums.iter().map(|c| format!("{c:08x}")).collect::<Vec<_>>().join(" ")
}

/// Reads the checksums that [`checksums_to_text`] wrote.
pub(crate) fn checksums_from_text(
    text: &str,
) -> std::result::Result<Vec<u32>, std::num::ParseIntError> {
    text.split_ascii_whitespace().map(|c| u32::from_str_radix(c, 16)).collect()
}

#[cfg(test)]
mod tests {
    use sidestep_kernel::ports::recorder::conformance_test_schemas;

    use super::*;

    #[test]
    fn columns_survive_their_json() {
        for schema in conformance_test_schemas() {
            let text = columns_to_json(&schema.columns);
            assert_eq!(columns_from_json(&text).unwrap(), schema.columns);
        }
    }

    #[test]
    fn facts_about_a_table_survive_their_json_in_their_order() {
        let fact = |name: &str, fact: &str| (name.to_string(), fact.to_string());
        for about in [vec![], vec![fact("box_m", "0.25"), fact("a", "\"ü\"")]] {
            assert_eq!(about_from_json(&about_to_json(&about)).unwrap(), about);
        }
        assert!(about_from_json("{\"a\": 1}").is_err());
    }

    #[test]
    fn checksums_survive_their_text() {
        for checksums in [vec![], vec![0, u32::MAX]] {
            let text = checksums_to_text(&checksums);
            assert_eq!(checksums_from_text(&text).unwrap(), checksums);
        }
    }

    #[test]
    fn schemas_that_cannot_become_a_file_are_refused() {
        let [good, labelled] = conformance_test_schemas().try_into().unwrap();
        assert!(check_schema(&good).is_ok());
        let with = |change: &dyn Fn(&mut TableSchema)| {
            let mut schema = labelled.clone();
            change(&mut schema);
            check_schema(&schema).unwrap_err().to_string()
        };
        assert!(with(&|s| s.name = "../etc".into()).contains("letters"));
        assert!(with(&|s| s.name.clear()).contains("letters"));
        assert!(with(&|s| s.columns.clear()).contains("at least one"));
        assert!(with(&|s| s.columns[0].name = "event".into()).contains("two columns"));
        assert!(with(&|s| s.columns[1].labels.push("trip".into())).contains("`trip` twice"));
    }
}
