//! Commands for people to paste into a shell.

use crate::terminal::is_invisible;
use std::fmt::Write;
use std::path::Path;

/// Characters beside letters and digits that no POSIX shell reads as anything but themselves.
const PLAIN: &str = "/._-=:,+@%";

/// Returns the command that applies a command of this program, `report`, to a path, ready to paste; further options may
/// follow it.
///
/// Every hint that names a path is made by it, and a test reads all of them by the definition of the command line.
pub fn sidestep_command(command: &str, path: impl AsRef<Path>) -> String {
    format!("sidestep {command} {}", shell_path(path))
}

/// Returns a word as a POSIX shell must read it: as it is where that is safe, else in quotes.
///
/// Controls are written as escapes of `printf`, because a terminal would not show them, and [`crate::InputError`] and
/// the command's output escape them.
pub fn shell_quote(word: &str) -> String {
    quote_bytes(word.as_bytes())
}

/// Returns a path as a word of a shell. One that begins with a dash gets `./` before it, so that no program takes it
/// for an option; one that is not UTF-8 keeps its bytes.
pub fn shell_path(path: impl AsRef<Path>) -> String {
    let path = path.as_ref();
    let bytes = path.as_os_str().as_encoded_bytes();
    if bytes.starts_with(b"-") {
        return quote_bytes(Path::new(".").join(path).as_os_str().as_encoded_bytes());
    }
    quote_bytes(bytes)
}

fn quote_bytes(bytes: &[u8]) -> String {
    let Ok(word) = std::str::from_utf8(bytes) else { return printf_of(bytes) };
    if word.chars().any(is_invisible) {
        return printf_of(bytes);
    }
    let is_plain = |c: char| c.is_ascii_alphanumeric() || PLAIN.contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.into();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Returns a word as the output of `printf`, whose octal escapes every POSIX shell knows.
fn printf_of(bytes: &[u8]) -> String {
    // A shell removes the line feeds at the end of a command's output.
    let end = bytes.iter().rposition(|byte| *byte != b'\n').map_or(0, |last| last + 1);
    let mut format = String::new();
    for &byte in &bytes[..end] {
        let is_plain =
            byte == b' ' || (byte.is_ascii_graphic() && !matches!(byte, b'\'' | b'\\' | b'%'));
        if is_plain {
            format.push(char::from(byte));
        } else {
            let _ = write!(format, "\\{byte:03o}");
        }
    }
    let line_feeds = "$'\\n'".repeat(bytes.len() - end);
    format!("\"$(printf -- '{format}')\"{line_feeds}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_words_stay_and_others_are_quoted() {
        assert_eq!(shell_quote("runs/a-1"), "runs/a-1");
        assert_eq!(shell_quote("airspace.generator.n=1,2"), "airspace.generator.n=1,2");
        assert_eq!(shell_quote("my runs/it's"), "'my runs/it'\\''s'");
        assert_eq!(
            ["", "$(rm)", "a\"b", "~", "über"].map(shell_quote),
            ["''", "'$(rm)'", "'a\"b'", "'~'", "'über'"]
        );
    }

    #[test]
    fn a_path_is_never_an_option() {
        assert_eq!(shell_path("-rf"), "./-rf");
        assert_eq!(shell_path("-a b"), "'./-a b'");
        assert_eq!(shell_path("a/-b"), "a/-b");
    }

    #[cfg(unix)]
    #[test]
    fn a_shell_reads_back_every_word_and_every_path() {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;
        let words: [&[u8]; 12] = [
            b"",
            b"plain",
            b"dir with space/sw",
            b"it's \"quoted\"",
            b"$HOME `id` $(id) !! *?[a] {a,b} a&b;c|d<e>f#g",
            b"~root",
            "Z\u{fc}rich 東京".as_bytes(),
            b"back\\slash %d",
            b"\x1b[31mred\x1b]0;title\x07",
            "a\u{202e}b\u{200b}".as_bytes(),
            b"not \xff utf-8 'x'",
            b"two\nlines\n",
        ];
        for bytes in words {
            let word = OsStr::from_bytes(bytes);
            let quoted = shell_path(word);
            assert!(!quoted.chars().any(is_invisible), "{quoted:?}");
            let ends_in_line_feed = bytes.ends_with(b"\n");
            let shell = if ends_in_line_feed { "bash" } else { "sh" };
            let script = format!("printf %s {quoted}");
            let output = std::process::Command::new(shell).args(["-c", &script]).output();
            let Ok(output) = output else {
                println!("skipped: there is no {shell}");
                continue;
            };
            assert_eq!(output.stdout, bytes, "{quoted}");
        }
    }
}
