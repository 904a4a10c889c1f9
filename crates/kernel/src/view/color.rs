//! Colors of bodies and surroundings, the same in pictures, animations and recordings.

/// Red, green and blue, 0 to 255 each.
pub type Color = [u8; 3];

/// Colors that distinguish numbered bodies: Okabe and Ito's palette for all kinds of color vision, without yellow,
/// which is faint on white, and black, which is the color of text.
pub const BODY_COLORS: [Color; 6] = [
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xE6, 0x9F, 0x00],
    [0x56, 0xB4, 0xE9],
];
/// Dark gray, for walls and everything else that stands still.
pub const WALL_COLOR: Color = [0x3C, 0x3C, 0x3C];
/// Nearly white, because a map may consist mostly of unmapped boxes.
pub const UNKNOWN_COLOR: Color = [0xED, 0xEB, 0xE6];
/// Light gray, for things that move but do not act.
pub const MOBILE_COLOR: Color = [0xA6, 0xA6, 0xA6];
/// Brown, like wood; an open door has a low opacity.
pub const DOOR_COLOR: Color = [0x8B, 0x5A, 0x2B];
/// Color of conditions that should not occur.
pub const ALERT_COLOR: Color = [0xD0, 0x10, 0x10];

/// Returns the color of a number; numbers that differ by a multiple of six share one.
pub fn body_color(number: u32) -> Color {
    BODY_COLORS[number as usize % BODY_COLORS.len()]
}
