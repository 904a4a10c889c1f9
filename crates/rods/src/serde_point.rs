//! Points in messages: as many numbers as there are dimensions, in any number of dimensions.

use super::geometry::Point;
use serde::de::{Error, SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// A point as it travels, meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WirePoint<const D: usize>(pub Point<D>);

impl<const D: usize> Serialize for WirePoint<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serialize(&self.0, serializer)
    }
}

impl<'de, const D: usize> Deserialize<'de> for WirePoint<D> {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        deserialize(deserializer).map(Self)
    }
}

/// Writes a point as `D` numbers without their count; for `#[serde(with = "...")]`.
pub fn serialize<const D: usize, S: Serializer>(
    point: &Point<D>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let mut tuple = serializer.serialize_tuple(D)?;
    point.iter().try_for_each(|x| tuple.serialize_element(x))?;
    tuple.end()
}

/// Reads a point of exactly `D` numbers; for `#[serde(with = "...")]`.
pub fn deserialize<'de, const D: usize, S: Deserializer<'de>>(
    deserializer: S,
) -> Result<Point<D>, S::Error> {
    deserializer.deserialize_tuple(D, CoordinatesVisitor::<D>)
}

struct CoordinatesVisitor<const D: usize>;

impl<'de, const D: usize> Visitor<'de> for CoordinatesVisitor<D> {
    type Value = Point<D>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{D} coordinates")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<Point<D>, A::Error> {
        let mut point = [0.0; D];
        for (i, x) in point.iter_mut().enumerate() {
            *x = numbers.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
        }
        Ok(point)
    }
}
