//! Headers of pages, with a checksum, which the `parquet` crate does not write: any reader can check each page by itself.
//!
//! They are structs of Thrift's compact protocol. Source: Apache Parquet, `parquet.thrift`, `PageHeader`.

/// The type of a page of values.
pub(super) const DATA_PAGE: i32 = 0;
/// The type of a page with a vocabulary.
pub(super) const DICTIONARY_PAGE: i32 = 2;

/// A field of a struct, with its number. Numbers rise.
pub(super) enum Field<'a> {
    Number(u8, i32),
    Bool(u8, bool),
    Struct(u8, &'a [Field<'a>]),
}

impl Field<'_> {
    fn number(&self) -> u8 {
        match self {
            Self::Number(number, _) | Self::Bool(number, _) | Self::Struct(number, _) => *number,
        }
    }
}

/// Returns the header of a page that is not compressed. The fields are its type, and the struct for that type.
pub(super) fn page_header(page: &[u8], checksum: u32, [kind, about]: &[Field<'_>; 2]) -> Vec<u8> {
    let size = page.len() as i32;
    let mut header = Vec::with_capacity(32);
    let mut last = 0;
    put_field(kind, &mut last, &mut header);
    put_field(&Field::Number(2, size), &mut last, &mut header);
    put_field(&Field::Number(3, size), &mut last, &mut header);
    put_field(&Field::Number(4, checksum as i32), &mut last, &mut header);
    put_field(about, &mut last, &mut header);
    header.push(0);
    header
}

/// Appends a field. Its number is stored as the difference to the last one.
fn put_field(field: &Field<'_>, last: &mut u8, out: &mut Vec<u8>) {
    let step = (field.number() - *last) << 4;
    *last = field.number();
    match field {
        Field::Number(_, value) => {
            out.push(step | 5);
            put_number(*value, out);
        }
        Field::Bool(_, value) => out.push(step | if *value { 1 } else { 2 }),
        Field::Struct(_, fields) => {
            out.push(step | 12);
            let mut last = 0;
            fields.iter().for_each(|field| put_field(field, &mut last, out));
            out.push(0);
        }
    }
}

/// Appends a number: its sign in the lowest bit, seven bits a byte.
fn put_number(value: i32, out: &mut Vec<u8>) {
    let mut rest = ((value << 1) ^ (value >> 31)) as u32;
    while rest >= 0x80 {
        out.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    out.push(rest as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_has_the_bytes_that_the_format_says() {
        let about = [Field::Number(1, 300), Field::Number(2, 5), Field::Bool(3, false)];
        let header = page_header(
            b"123456789",
            crc32fast::hash(b"123456789"),
            &[Field::Number(1, DICTIONARY_PAGE), Field::Struct(7, &about)],
        );
        // The checksum of these digits is 0xcbf43926, negative as a number with a sign.
        let checksum = [0x15, 0xb3, 0x9b, 0xde, 0xc0, 0x06];
        let expected = [
            &[0x15, 4, 0x15, 18, 0x15, 18][..],
            &checksum,
            &[0x3c, 0x15, 0xd8, 4, 0x15, 10, 0x12, 0, 0],
        ];
        assert_eq!(header, expected.concat());
    }
}
