//! Parquet files as pandas and Polars write them, built here.

use super::tests::finding;
use super::{TrafficOptions, from_bytes};
use parquet::basic::{Compression, GzipLevel, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use std::sync::Arc;

const SCHEMA: &str = "message schema {
    OPTIONAL INT64 timestamp (TIMESTAMP(NANOS,true));
    OPTIONAL BYTE_ARRAY icao24 (STRING);
    OPTIONAL BYTE_ARRAY callsign (STRING);
    OPTIONAL DOUBLE latitude;
    OPTIONAL DOUBLE longitude;
    REQUIRED DOUBLE altitude;
    OPTIONAL DOUBLE groundspeed;
    OPTIONAL BOOLEAN onground;
}";

/// Writes a column with a value for each row that has one.
fn write<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    values: &[T::T],
    levels: Option<&[i16]>,
) {
    let mut column = group.next_column().unwrap().unwrap();
    column.typed::<T>().write_batch(values, levels, None).unwrap();
    column.close().unwrap();
}

/// Returns a file of four rows, the third of them without a position.
fn file(compression: Compression) -> Vec<u8> {
    let schema = Arc::new(parse_message_type(SCHEMA).unwrap());
    let properties = WriterProperties::builder().set_compression(compression).build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties)).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let all: &[i16] = &[1; 4];
    let times: Vec<i64> = (0..4).map(|k| (1_533_114_900 + 10 * k) * 1_000_000_000).collect();
    write::<Int64Type>(&mut group, &times, Some(all));
    let text = |text: &str| vec![ByteArray::from(text); 4];
    write::<ByteArrayType>(&mut group, &text("4b1234"), Some(all));
    write::<ByteArrayType>(&mut group, &text("ABC1"), Some(all));
    write::<DoubleType>(&mut group, &[47.0; 3], Some(&[1, 1, 0, 1]));
    write::<DoubleType>(&mut group, &[7.0, 7.03, f64::NAN, 7.09], Some(all));
    write::<DoubleType>(&mut group, &[35_000.0; 4], None);
    write::<DoubleType>(&mut group, &[440.0; 4], Some(all));
    write::<BoolType>(&mut group, &[false; 4], Some(all));
    group.close().unwrap();
    writer.into_inner().unwrap()
}

#[test]
fn tables_of_the_library_traffic_are_read_plain_and_compressed() {
    for compression in [
        Compression::UNCOMPRESSED,
        Compression::SNAPPY,
        Compression::ZSTD(ZstdLevel::default()),
        Compression::GZIP(GzipLevel::default()),
    ] {
        let bytes = file(compression);
        let traffic = from_bytes(&"f.parquet", bytes, &TrafficOptions::default()).unwrap();
        assert_eq!(traffic.report.format, "tracks of the library traffic (Parquet)");
        assert_eq!((traffic.rows, traffic.tracks[0].samples.len()), (4, 3));
        let sample = traffic.tracks[0].samples[1];
        assert_eq!((sample.time_s, sample.position.lon_deg), (1_533_114_910.0, 7.03));
        assert_eq!(traffic.tracks[0].callsign, "ABC1");
        assert_eq!(finding(&traffic, "without a position").unwrap().places, ["row 3"]);
    }
}

#[test]
fn a_damaged_file_is_refused_and_stops_nothing() {
    let whole = file(Compression::SNAPPY);
    for k in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[k] ^= 0x55;
        let _ = from_bytes(&"f.parquet", bytes, &TrafficOptions::default());
        let _ = from_bytes(&"f.parquet", whole[..k].to_vec(), &TrafficOptions::default());
    }
}
