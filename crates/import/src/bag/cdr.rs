//! CDR, the encoding of ROS 2 messages: values one after the other, each aligned to its own size; and that of ROS 1.
//!
//! The first four bytes of a message in CDR give the encoding and the byte order; alignment is relative to the byte
//! after them. Messages of ROS 1 have neither such a head nor gaps, texts without a zero at their end, and a counter
//! before each header. The fields of a message are listed once, by `message!`, for reading and writing.

/// The first four bytes of messages that are written here: plain CDR, little-endian.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// How messages are encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// CDR, as in ROS 2.
    Cdr,
    /// The encoding of ROS 1.
    Ros1,
}

/// Reads one message of an encoding from its bytes.
///
/// # Errors
/// Those of [`decode`]; in ROS 1, where lengths alone tell one value from the next, also when bytes are left over.
pub fn decode_as<T: Cdr>(encoding: Encoding, bytes: &[u8]) -> Result<T, CdrError> {
    if encoding == Encoding::Cdr {
        return decode(bytes);
    }
    let mut reader = Reader { body: bytes, offset: 0, is_little: true, is_ros1: true };
    let message = T::read(&mut reader)?;
    if reader.offset < bytes.len() {
        return Err(CdrError::LeftOver { at: reader.offset });
    }
    Ok(message)
}

/// Returns a message as bytes of ROS 1.
pub fn encode_ros1<T: Cdr>(message: &T) -> Vec<u8> {
    let mut writer = Writer { bytes: Vec::new(), head: 0, is_ros1: true };
    message.write(&mut writer);
    writer.bytes
}

/// Reads one message from its bytes in CDR, the head included.
///
/// # Errors
/// When the encoding is another one, or the bytes end too early.
pub fn decode<T: Cdr>(bytes: &[u8]) -> Result<T, CdrError> {
    let (head, body) = bytes.split_first_chunk::<4>().ok_or(CdrError::Cut { at: bytes.len() })?;
    let is_little = match head[..2] {
        [0, 0] => false,
        [0, 1] => true,
        _ => return Err(CdrError::Encoding([head[0], head[1]])),
    };
    T::read(&mut Reader { body, offset: 0, is_little, is_ros1: false })
}

/// Returns a message as bytes, the header included.
pub fn encode<T: Cdr>(message: &T) -> Vec<u8> {
    let head = LITTLE_ENDIAN.len();
    let mut writer = Writer { bytes: LITTLE_ENDIAN.to_vec(), head, is_ros1: false };
    message.write(&mut writer);
    writer.bytes
}

/// The reason why bytes are no message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CdrError {
    /// The encoding is not one that is read here; its two bytes.
    Encoding([u8; 2]),
    /// A value or its list is beyond the end.
    Cut {
        /// The offset of the value, after the header.
        at: usize,
    },
    /// A text is not UTF-8, or does not end with a zero.
    Text {
        /// The offset of the text, after the header.
        at: usize,
    },
    /// There are bytes after the last value: the message has another definition.
    LeftOver {
        /// The offset of the first of them.
        at: usize,
    },
}

impl std::fmt::Display for CdrError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Encoding([a, b]) => write!(f, "its encoding is {a:02x}{b:02x}, not plain CDR"),
            Self::Cut { at } => write!(f, "it ends before its value at byte {at}"),
            Self::Text { at } => write!(f, "the text at byte {at} is damaged"),
            Self::LeftOver { at } => write!(f, "it goes on after its last value, at byte {at}"),
        }
    }
}

/// A value that can be read from CDR and written to it.
pub trait Cdr: Sized {
    /// The minimum number of bytes of a value: a damaged length of a list is found before memory is allocated for it.
    const MIN_BYTES: usize;

    /// Reads a value.
    ///
    /// # Errors
    /// When the bytes end too early.
    fn read(reader: &mut Reader<'_>) -> Result<Self, CdrError>;

    /// Appends the value.
    fn write(&self, writer: &mut Writer);
}

/// The bytes of a message that is being read.
pub struct Reader<'a> {
    /// The bytes after the header.
    body: &'a [u8],
    /// The offset of the next value in `body`.
    offset: usize,
    is_little: bool,
    is_ros1: bool,
}

impl<'a> Reader<'a> {
    /// Returns whether the message is of ROS 1.
    pub(super) fn is_ros1(&self) -> bool {
        self.is_ros1
    }

    /// Reads the next bytes, which in CDR start at a multiple of `alignment`.
    fn read_bytes(&mut self, n: usize, alignment: usize) -> Result<&'a [u8], CdrError> {
        let start =
            if self.is_ros1 { self.offset } else { self.offset.next_multiple_of(alignment) };
        let bytes = self.body.get(start..).and_then(|rest| rest.get(..n));
        let bytes = bytes.ok_or(CdrError::Cut { at: start })?;
        self.offset = start + n;
        Ok(bytes)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.read_bytes(N, N)?);
        if !self.is_little {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

/// The bytes of a message that is being written.
pub struct Writer {
    bytes: Vec<u8>,
    /// The number of bytes before the first value.
    head: usize,
    is_ros1: bool,
}

impl Writer {
    /// Returns whether the message is of ROS 1.
    pub(super) fn is_ros1(&self) -> bool {
        self.is_ros1
    }

    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        let body = self.bytes.len() - self.head;
        let padding = if self.is_ros1 { 0 } else { body.next_multiple_of(N) - body };
        self.bytes.extend(std::iter::repeat_n(0, padding));
        self.bytes.extend(bytes);
    }

    /// Panics where the length does not fit: no message of a robot has a list of that length.
    fn write_length(&mut self, length: usize) {
        u32::try_from(length).expect("fewer than four billion values").write(self);
    }
}

macro_rules! number {
    ($($type:ty),*) => {$(
        impl Cdr for $type {
            const MIN_BYTES: usize = size_of::<Self>();

            fn read(reader: &mut Reader<'_>) -> Result<Self, CdrError> {
                reader.number().map(Self::from_le_bytes)
            }

            fn write(&self, writer: &mut Writer) {
                writer.number(self.to_le_bytes());
            }
        }
    )*};
}

number!(f32, f64, i8, i32, u8, u32);

impl Cdr for bool {
    const MIN_BYTES: usize = 1;

    fn read(reader: &mut Reader<'_>) -> Result<Self, CdrError> {
        // Programs write 1; any other number but 0 means the same to them.
        u8::read(reader).map(|byte| byte != 0)
    }

    fn write(&self, writer: &mut Writer) {
        u8::from(*self).write(writer);
    }
}

impl Cdr for String {
    const MIN_BYTES: usize = 4;

    fn read(reader: &mut Reader<'_>) -> Result<Self, CdrError> {
        let length = u32::read(reader)? as usize;
        let at = reader.offset;
        let bytes = reader.read_bytes(length, 1)?;
        if reader.is_ros1 {
            return std::str::from_utf8(bytes).map(Self::from).map_err(|_| CdrError::Text { at });
        }
        // Some programs write an empty text without the zero at its end.
        let Some((&0, text)) = bytes.split_last() else {
            return if bytes.is_empty() { Ok(Self::new()) } else { Err(CdrError::Text { at }) };
        };
        std::str::from_utf8(text).map(Self::from).map_err(|_| CdrError::Text { at })
    }

    fn write(&self, writer: &mut Writer) {
        let zeros = usize::from(!writer.is_ros1);
        writer.write_length(self.len() + zeros);
        writer.bytes.extend(self.as_bytes());
        writer.bytes.extend(std::iter::repeat_n(0, zeros));
    }
}

impl<T: Cdr> Cdr for Vec<T> {
    const MIN_BYTES: usize = 4;

    fn read(reader: &mut Reader<'_>) -> Result<Self, CdrError> {
        let length = u32::read(reader)? as usize;
        let remaining = reader.body.len() - reader.offset;
        if length > remaining / T::MIN_BYTES {
            return Err(CdrError::Cut { at: reader.offset });
        }
        (0..length).map(|_| T::read(reader)).collect()
    }

    fn write(&self, writer: &mut Writer) {
        writer.write_length(self.len());
        self.iter().for_each(|value| value.write(writer));
    }
}

impl<T: Cdr + Copy + Default, const N: usize> Cdr for [T; N] {
    const MIN_BYTES: usize = N * T::MIN_BYTES;

    fn read(reader: &mut Reader<'_>) -> Result<Self, CdrError> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = T::read(reader)?;
        }
        Ok(values)
    }

    fn write(&self, writer: &mut Writer) {
        self.iter().for_each(|value| value.write(writer));
    }
}

/// Declares a message by its fields, in their order in ROS.
macro_rules! message {
    ($(#[$doc:meta])* $name:ident { $($(#[$of:meta])* $field:ident: $type:ty),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $($(#[$of])* pub $field: $type),*
        }

        impl Cdr for $name {
            const MIN_BYTES: usize = 0 $(+ <$type as Cdr>::MIN_BYTES)*;

            fn read(reader: &mut Reader<'_>) -> Result<Self, CdrError> {
                $(let $field = Cdr::read(reader)?;)*
                Ok(Self { $($field),* })
            }

            fn write(&self, writer: &mut Writer) {
                $(self.$field.write(writer);)*
            }
        }
    };
}

pub(super) use message;

#[cfg(test)]
#[allow(unreachable_pub, reason = "messages are public wherever they are declared")]
mod tests {
    use super::*;

    message!(
        /// A message with gaps.
        Sample { flag: u32, value: f64, name: String, list: Vec<f32>, pair: [f64; 2] }
    );

    fn sample() -> Sample {
        Sample { flag: 7, value: 0.5, name: "ab".into(), list: vec![1.0, 2.0], pair: [3.0, 4.0] }
    }

    /// The example of the standard: values begin at multiples of their size.
    const LITTLE: [u8; 60] = [
        0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xe0, 0x3f, 3, 0, 0, 0, b'a', b'b',
        0, 0, 2, 0, 0, 0, 0, 0, 0x80, 0x3f, 0, 0, 0, 0x40, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 8, 0x40,
        0, 0, 0, 0, 0, 0, 0x10, 0x40,
    ];

    #[test]
    fn values_are_aligned_to_their_own_size() {
        let bytes = encode(&sample());
        assert_eq!(decode::<Sample>(&bytes), Ok(sample()));
        assert_eq!(bytes, LITTLE);
    }

    #[test]
    fn numbers_with_the_big_end_first_are_read_too() {
        let big = [0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 0, 0x3f, 0xe0, 0, 0, 0, 0, 0, 0];
        message!(
            /// Two numbers.
            Two { flag: u32, value: f64 }
        );
        assert_eq!(decode(&big), Ok(Two { flag: 7, value: 0.5 }));
    }

    #[test]
    fn another_encoding_and_a_cut_message_are_errors() {
        let bytes = encode(&sample());
        for end in 0..bytes.len() {
            let found = decode::<Sample>(&bytes[..end]);
            assert!(matches!(found, Err(CdrError::Cut { .. })), "{end}: {found:?}");
        }
        let parameters = [&[0, 3], &bytes[2..]].concat();
        assert_eq!(decode::<Sample>(&parameters), Err(CdrError::Encoding([0, 3])));
    }

    #[test]
    fn a_list_longer_than_the_message_takes_no_memory() {
        let bytes = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0];
        assert_eq!(decode::<Vec<f64>>(&bytes), Err(CdrError::Cut { at: 4 }));
        assert_eq!(decode::<String>(&bytes), Err(CdrError::Cut { at: 4 }));
    }

    #[test]
    fn a_text_ends_with_a_zero_and_is_utf8() {
        let text = |bytes: &[u8]| {
            let length = u32::try_from(bytes.len()).unwrap().to_le_bytes();
            decode::<String>(&[&[0, 1, 0, 0], &length[..], bytes].concat())
        };
        assert_eq!(text(b"a\0"), Ok("a".into()));
        assert_eq!(text(b""), Ok(String::new()));
        assert_eq!(text(b"a"), Err(CdrError::Text { at: 4 }));
        assert_eq!(text(b"\xff\0"), Err(CdrError::Text { at: 4 }));
    }

    #[test]
    fn messages_of_ros_1_have_no_gaps_and_are_read_to_their_end() {
        let bytes = encode_ros1(&sample());
        assert_eq!(bytes.len(), 4 + 8 + 4 + 2 + 4 + 2 * 4 + 2 * 8);
        assert_eq!(decode_as(Encoding::Ros1, &bytes), Ok(sample()));
        let longer = [&bytes[..], &[0]].concat();
        let found = decode_as::<Sample>(Encoding::Ros1, &longer);
        assert_eq!(found, Err(CdrError::LeftOver { at: bytes.len() }));
        for end in 0..bytes.len() {
            let found = decode_as::<Sample>(Encoding::Ros1, &bytes[..end]);
            assert!(matches!(found, Err(CdrError::Cut { .. })), "{end}: {found:?}");
        }
    }

    proptest::proptest! {
        #[test]
        fn any_bytes_are_a_message_of_ros_1_or_an_error(bytes: Vec<u8>) {
            let _ = decode_as::<Vec<Sample>>(Encoding::Ros1, &bytes);
        }

        #[test]
        fn any_bytes_are_a_message_or_an_error(mut bytes: Vec<u8>, is_little: bool) {
            bytes.splice(0..0, [0, u8::from(is_little), 0, 0]);
            let _ = decode::<Vec<Sample>>(&bytes);
        }
    }
}
