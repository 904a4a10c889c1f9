//! Metrics -> numbers, in the order of their fields: without names, because a row is written for every so many cycles.

use crate::ports::ColumnType;
use serde::ser::{
    Serialize, SerializeMap, SerializeSeq, SerializeStruct, SerializeStructVariant, SerializeTuple,
    SerializeTupleStruct, SerializeTupleVariant, Serializer,
};
use std::fmt::Display;

/// One number of the metrics, and the type of its column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LeafValue {
    /// None, or a float that is no number.
    Missing,
    Unsigned(u64),
    Signed(i64),
    Float(f64),
    Truth(bool),
    /// A list, of which the length counts.
    Length(u64),
    /// Text, or another value that is no number.
    Other,
}

/// The sort of a leaf, which is the same in every cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LeafKind {
    Unsigned,
    Signed,
    Float,
    Truth,
    List,
    Other,
}

/// A leaf by its dotted name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LeafSpec {
    pub(crate) name: String,
    pub(crate) kind: LeafKind,
    /// Whether it may be missing.
    pub(crate) is_optional: bool,
}

impl LeafValue {
    pub(crate) fn unsigned(&self) -> Option<u64> {
        match *self {
            Self::Unsigned(value) | Self::Length(value) => Some(value),
            _ => None,
        }
    }

    pub(crate) fn signed(&self) -> Option<i64> {
        match *self {
            Self::Signed(value) => Some(value),
            _ => None,
        }
    }

    pub(crate) fn truth(&self) -> Option<bool> {
        match *self {
            Self::Truth(value) => Some(value),
            _ => None,
        }
    }

    /// Also of whole numbers: a column of numbers that may be missing has floats.
    pub(crate) fn float(&self) -> Option<f64> {
        match *self {
            Self::Float(value) => Some(value),
            Self::Unsigned(value) => Some(value as f64),
            Self::Signed(value) => Some(value as f64),
            _ => None,
        }
    }

    /// Returns the value as a number of any column: truth values are 0 and 1, and what is missing is no number (NaN).
    pub(crate) fn number(&self) -> f64 {
        match *self {
            Self::Length(length) => length as f64,
            Self::Truth(value) => f64::from(u8::from(value)),
            _ => self.float().unwrap_or(f64::NAN),
        }
    }

    fn kind(self) -> LeafKind {
        match self {
            Self::Unsigned(_) => LeafKind::Unsigned,
            Self::Signed(_) => LeafKind::Signed,
            Self::Missing | Self::Float(_) => LeafKind::Float,
            Self::Truth(_) => LeafKind::Truth,
            Self::Length(_) => LeafKind::List,
            Self::Other => LeafKind::Other,
        }
    }
}

impl LeafKind {
    /// Returns the type of its column; none for what is no number.
    pub(crate) fn column_type(self) -> Option<ColumnType> {
        match self {
            Self::Unsigned | Self::List => Some(ColumnType::U64),
            Self::Signed => Some(ColumnType::I64),
            Self::Float => Some(ColumnType::F64),
            Self::Truth => Some(ColumnType::Bool),
            Self::Other => None,
        }
    }
}

/// Returns the leaves of metrics with their names, in the order of [`leaf_values`]. Their kinds do not depend on the
/// values: a number that may be missing is a float, whatever it is now.
pub(crate) fn leaf_specs(metrics: &impl Serialize) -> Vec<LeafSpec> {
    let mut walk = LeafWalk { names: Some(Vec::new()), ..LeafWalk::default() };
    // The walk itself never fails, and what it has found until metrics refuse to be written still counts.
    let _ = metrics.serialize(&mut walk);
    walk.names.unwrap_or_default()
}

/// Returns the leaves of metrics, of which about `count` are expected.
pub(crate) fn leaf_values(metrics: &impl Serialize, count: usize) -> Vec<LeafValue> {
    let mut walk = LeafWalk { values: Vec::with_capacity(count), ..LeafWalk::default() };
    let _ = metrics.serialize(&mut walk);
    walk.values
}

/// A walk through all fields.
#[derive(Debug, Default)]
struct LeafWalk {
    values: Vec<LeafValue>,
    /// The names of the leaves so far, where they are wanted,
    names: Option<Vec<LeafSpec>>,
    /// that of the present field,
    path: String,
    /// and whether it may be missing.
    is_optional: bool,
}

impl LeafWalk {
    fn push(&mut self, value: LeafValue) -> Result<(), WalkError> {
        self.values.push(value);
        if let Some(names) = &mut self.names {
            let is_missing = value == LeafValue::Missing;
            let is_optional = self.is_optional || is_missing;
            let name = match value {
                LeafValue::Length(_) => format!("{}_count", self.path),
                _ => self.path.clone(),
            };
            let kind = match value.kind() {
                LeafKind::Unsigned | LeafKind::Signed if is_optional => LeafKind::Float,
                kind => kind,
            };
            names.push(LeafSpec { name, kind, is_optional });
        }
        Ok(())
    }

    /// Walks through a field.
    fn field<T: Serialize + ?Sized>(&mut self, name: &str, value: &T) -> Result<(), WalkError> {
        if self.names.is_none() {
            return value.serialize(self);
        }
        let length = self.path.len();
        if length > 0 {
            self.path.push('.');
        }
        self.path.push_str(name);
        self.is_optional = false;
        let walked = value.serialize(&mut *self);
        self.path.truncate(length);
        walked
    }
}

/// A list or an enum's variant with content, of which only the length counts.
struct ListWalk<'a> {
    walk: &'a mut LeafWalk,
    length: u64,
}

impl ListWalk<'_> {
    fn end_list(self) -> Result<(), WalkError> {
        self.walk.push(LeafValue::Length(self.length))
    }
}

/// A table of fields.
struct TableWalk<'a> {
    walk: &'a mut LeafWalk,
    key: String,
}

/// A message of metrics that refuse to be written.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct WalkError(String);

impl serde::ser::Error for WalkError {
    fn custom<T: Display>(message: T) -> Self {
        Self(message.to_string())
    }
}

/// Generates methods for values that are leaves.
macro_rules! leaves {
    ($($method:ident: $ty:ty => $leaf:expr;)*) => {$(
        fn $method(self, value: $ty) -> Result<(), WalkError> {
            let leaf: fn($ty) -> LeafValue = $leaf;
            self.push(leaf(value))
        }
    )*};
}

impl<'a> Serializer for &'a mut LeafWalk {
    type Ok = ();
    type Error = WalkError;
    type SerializeSeq = ListWalk<'a>;
    type SerializeTuple = ListWalk<'a>;
    type SerializeTupleStruct = ListWalk<'a>;
    type SerializeTupleVariant = ListWalk<'a>;
    type SerializeMap = TableWalk<'a>;
    type SerializeStruct = TableWalk<'a>;
    type SerializeStructVariant = ListWalk<'a>;

    leaves! {
        serialize_bool: bool => LeafValue::Truth;
        serialize_i8: i8 => |v| LeafValue::Signed(v.into());
        serialize_i16: i16 => |v| LeafValue::Signed(v.into());
        serialize_i32: i32 => |v| LeafValue::Signed(v.into());
        serialize_i64: i64 => LeafValue::Signed;
        serialize_u8: u8 => |v| LeafValue::Unsigned(v.into());
        serialize_u16: u16 => |v| LeafValue::Unsigned(v.into());
        serialize_u32: u32 => |v| LeafValue::Unsigned(v.into());
        serialize_u64: u64 => LeafValue::Unsigned;
        serialize_f32: f32 => |v| float_leaf(v.into());
        serialize_f64: f64 => float_leaf;
        serialize_char: char => |_| LeafValue::Other;
        serialize_str: &str => |_| LeafValue::Other;
        serialize_bytes: &[u8] => |_| LeafValue::Other;
    }

    fn serialize_none(self) -> Result<(), WalkError> {
        self.push(LeafValue::Missing)
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), WalkError> {
        self.is_optional = true;
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), WalkError> {
        self.push(LeafValue::Missing)
    }

    fn serialize_unit_struct(self, _: &'static str) -> Result<(), WalkError> {
        self.push(LeafValue::Other)
    }

    fn serialize_unit_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
    ) -> Result<(), WalkError> {
        self.push(LeafValue::Other)
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<(), WalkError> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: &T,
    ) -> Result<(), WalkError> {
        self.push(LeafValue::Other)
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<ListWalk<'a>, WalkError> {
        Ok(ListWalk { walk: self, length: 0 })
    }

    fn serialize_tuple(self, _: usize) -> Result<ListWalk<'a>, WalkError> {
        self.serialize_seq(None)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<ListWalk<'a>, WalkError> {
        self.serialize_seq(None)
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<ListWalk<'a>, WalkError> {
        self.serialize_seq(None)
    }

    fn serialize_map(self, _: Option<usize>) -> Result<TableWalk<'a>, WalkError> {
        Ok(TableWalk { walk: self, key: String::new() })
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<TableWalk<'a>, WalkError> {
        self.serialize_map(None)
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<ListWalk<'a>, WalkError> {
        self.serialize_seq(None)
    }
}

/// JSON has no other floats either: a summary says `null`.
fn float_leaf(value: f64) -> LeafValue {
    if value.is_finite() { LeafValue::Float(value) } else { LeafValue::Missing }
}

/// Generates the walk through the items of a list.
macro_rules! lists {
    ($($role:ident: $method:ident;)*) => {$(
        impl $role for ListWalk<'_> {
            type Ok = ();
            type Error = WalkError;

            fn $method<T: Serialize + ?Sized>(&mut self, _: &T) -> Result<(), WalkError> {
                self.length += 1;
                Ok(())
            }

            fn end(self) -> Result<(), WalkError> {
                self.end_list()
            }
        }
    )*};
}

lists! {
    SerializeSeq: serialize_element;
    SerializeTuple: serialize_element;
    SerializeTupleStruct: serialize_field;
    SerializeTupleVariant: serialize_field;
}

impl SerializeStructVariant for ListWalk<'_> {
    type Ok = ();
    type Error = WalkError;

    fn serialize_field<T: Serialize + ?Sized>(
        &mut self,
        _: &'static str,
        _: &T,
    ) -> Result<(), WalkError> {
        Ok(())
    }

    fn end(self) -> Result<(), WalkError> {
        self.walk.push(LeafValue::Other)
    }
}

impl SerializeStruct for TableWalk<'_> {
    type Ok = ();
    type Error = WalkError;

    fn serialize_field<T: Serialize + ?Sized>(
        &mut self,
        name: &'static str,
        value: &T,
    ) -> Result<(), WalkError> {
        self.walk.field(name, value)
    }

    fn end(self) -> Result<(), WalkError> {
        Ok(())
    }
}

impl SerializeMap for TableWalk<'_> {
    type Ok = ();
    type Error = WalkError;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), WalkError> {
        if self.walk.names.is_some() {
            let key = serde_json::to_value(key).unwrap_or_default();
            self.key = key.as_str().unwrap_or_default().to_string();
        }
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), WalkError> {
        self.walk.field(&self.key, value)
    }

    fn end(self) -> Result<(), WalkError> {
        Ok(())
    }
}
