//! Parquet files as pandas and Polars write them, built here.

use super::tests::finding;
use super::{TrafficOptions, from_bytes};
use parquet::basic::{Compression, GzipLevel, ZstdLevel};
use parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FixedLenByteArray,
    FixedLenByteArrayType, Int32Type, Int64Type,
};
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

/// Columns of decimals, as databases write them, and of short floats.
const DECIMAL_SCHEMA: &str = "message schema {
    REQUIRED INT64 timestamp (TIMESTAMP(MICROS,true));
    REQUIRED BYTE_ARRAY icao24 (STRING);
    REQUIRED FIXED_LEN_BYTE_ARRAY(5) latitude (DECIMAL(10,4));
    REQUIRED INT64 longitude (DECIMAL(12,3));
    REQUIRED INT32 altitude (DECIMAL(9,1));
    REQUIRED FIXED_LEN_BYTE_ARRAY(2) groundspeed (FLOAT16);
    REQUIRED FIXED_LEN_BYTE_ARRAY(3) track;
}";

#[test]
fn decimals_and_short_floats_have_their_values_and_other_types_are_named() {
    let schema = Arc::new(parse_message_type(DECIMAL_SCHEMA).unwrap());
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, properties).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let times: Vec<i64> = (0..2).map(|k| (1_533_114_900 + 10 * k) * 1_000_000).collect();
    write::<Int64Type>(&mut group, &times, None);
    write::<ByteArrayType>(&mut group, &vec![ByteArray::from("4b1234"); 2], None);
    let fixed = |bytes: &[u8]| vec![FixedLenByteArray::from(bytes.to_vec()); 2];
    // -470000 as five bytes, the first the greatest.
    write::<FixedLenByteArrayType>(&mut group, &fixed(&(-470_000_i64).to_be_bytes()[3..]), None);
    write::<Int64Type>(&mut group, &[7_000, 7_030], None);
    write::<Int32Type>(&mut group, &[350_000; 2], None);
    // 440 is 1.71875 times 256: exponent 23, fraction 736.
    write::<FixedLenByteArrayType>(&mut group, &fixed(&0x5ee0_u16.to_le_bytes()), None);
    write::<FixedLenByteArrayType>(&mut group, &fixed(b"abc"), None);
    group.close().unwrap();
    let bytes = writer.into_inner().unwrap();
    let traffic = from_bytes(&"f.parquet", bytes, &TrafficOptions::default()).unwrap();
    let sample = traffic.tracks[0].samples[1];
    assert_eq!((sample.position.lat_deg, sample.position.lon_deg), (-47.0, 7.03));
    assert_eq!((sample.altitude_ft, sample.ground_speed_kt), (35_000.0, Some(440.0)));
    assert_eq!(finding(&traffic, "of a type that is not read").unwrap().places, ["`track`"]);
}

#[test]
fn a_compression_that_is_not_read_is_named_with_a_command_that_changes_it() {
    // In the footer the number of the codec stands between two fields: 1 is Snappy, 4 Brotli, 5 and 7 LZ4.
    let error = |codec: u8, path: &str| {
        let mut bytes = file(Compression::SNAPPY);
        for at in 0..bytes.len() - 3 {
            if bytes[at..at + 3] == [0x15, 0x02, 0x16] {
                bytes[at + 1] = 2 * codec;
            }
        }
        from_bytes(&path, bytes, &TrafficOptions::default()).unwrap_err()
    };
    for (codec, name) in [(4, "BROTLI"), (5, "LZ4"), (7, "LZ4_RAW")] {
        let error = error(codec, "my tracks.parquet");
        assert_eq!(error.cause(), format!("is Parquet compressed with {name}, which is not read"));
        let remedy = error.remedy();
        assert!(remedy.contains("read_table(sys.argv[1])"), "{error}");
        assert!(remedy.ends_with("' 'my tracks.parquet'"), "{error}");
    }
    let quoted = error(4, "$(id) `id` \"it's\".parquet");
    assert!(quoted.remedy().ends_with(r#"' '$(id) `id` "it'\''s".parquet'"#), "{quoted}");
    let lzo = error(3, "a.parquet");
    assert!(!lzo.remedy().contains("pyarrow") && lzo.remedy().contains("Zstandard"), "{lzo}");
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
