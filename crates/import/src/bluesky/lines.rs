//! Time-stamped commands with their words, read from the text of a scenario.

use std::borrow::Cow;
use std::fmt;
use std::rc::Rc;

use crate::table::Token;
use sidestep_kernel::InputError;

/// The minimum number of characters of a line; shorter ones are skipped, as in the scenarios' own
/// simulator.
const MIN_LINE_CHARS: usize = 10;

/// The maximum length of a line in bytes, including its continuations. It bounds the time to find a
/// word's column.
pub(super) const MAX_LINE_BYTES: usize = 10_000;

/// The separators of words other than the comma.
const BLANKS: [char; 2] = [' ', '\t'];

/// A file that commands come from.
#[derive(Debug)]
pub(super) struct CommandFile {
    /// Its name in errors.
    pub(super) name: String,
    /// What precedes a line number in reports: empty for the scenario itself, `sub.scn ` for a file that it calls.
    pub(super) prefix: String,
    /// Number of calls that led to it.
    pub(super) depth: usize,
}

/// One command, with its time and its place.
#[derive(Debug, Clone)]
pub(super) struct CommandText {
    /// Seconds since the start of its file.
    pub(super) time_s: f64,
    pub(super) file: Rc<CommandFile>,
    /// The command and its arguments, without blanks around them.
    pub(super) text: String,
    /// The parts of physical lines that it consists of.
    pieces: Vec<TextPiece>,
}

/// The place of a part of a text in its file.
#[derive(Debug, Clone, Copy)]
struct TextPiece {
    /// Index of its first byte in the text.
    start: usize,
    /// Its physical line, from 1.
    line: usize,
    /// The column of its first character, from 1.
    column: usize,
}

impl CommandText {
    /// Returns the number of its line.
    pub(super) fn line(&self) -> usize {
        self.pieces[0].line
    }

    /// Returns its place in reports.
    pub(super) fn place(&self) -> String {
        format!("{}line {}", self.file.prefix, self.line())
    }

    /// Returns its words: split at blanks, at commas with blanks around them, or both; two commas with nothing
    /// between them leave an argument out, and quotes hold an argument together.
    pub(super) fn words(&self) -> Vec<Token<'_>> {
        let mut words = Vec::new();
        let mut rest = self.text.trim_matches(BLANKS);
        while !rest.is_empty() {
            let quoted = rest.strip_prefix(['\'', '"']);
            let start = quoted.unwrap_or(rest);
            let end = match quoted {
                Some(text) => text.find(['\'', '"']),
                None => rest.find([',', ' ', '\t']),
            };
            let end = end.unwrap_or(start.len());
            words.push(self.token(&start[..end]));
            rest = &start[end..];
            if quoted.is_some() {
                rest = rest.strip_prefix(['\'', '"']).unwrap_or(rest);
            }
            rest = rest.trim_start_matches(BLANKS);
            rest = rest.strip_prefix(',').unwrap_or(rest).trim_start_matches(BLANKS);
        }
        words
    }

    /// Returns the text from a word on.
    pub(super) fn text_from(&self, word: Token<'_>) -> &str {
        let offset = (word.text.as_ptr() as usize).saturating_sub(self.text.as_ptr() as usize);
        self.text.get(offset..).unwrap_or("")
    }

    /// Returns another command at the place of this one.
    pub(super) fn with_text(&self, text: String) -> Self {
        let pieces = vec![TextPiece { start: 0, ..self.pieces[0] }];
        Self { text, pieces, file: Rc::clone(&self.file), time_s: self.time_s }
    }

    /// Returns the command with `%0`, `%1`, ... replaced; `None` where it becomes too long.
    pub(super) fn with_arguments(&self, arguments: &[String]) -> Option<Self> {
        let mut text = Cow::Borrowed(self.text.as_str());
        for (k, argument) in arguments.iter().enumerate() {
            let name = format!("%{k}");
            if !text.contains(&name) {
                continue;
            }
            let uses = text.matches(&name).count();
            if text.len() + uses * argument.len() > MAX_LINE_BYTES {
                return None;
            }
            text = Cow::Owned(text.replace(&name, argument));
        }
        match text {
            Cow::Borrowed(_) => Some(self.clone()),
            Cow::Owned(text) => Some(self.with_text(text)),
        }
    }

    /// Returns `part` of the text with its position in the file.
    fn token<'a>(&'a self, part: &'a str) -> Token<'a> {
        let offset = part.as_ptr() as usize - self.text.as_ptr() as usize;
        let (line, column) = position(&self.text, &self.pieces, offset);
        Token { text: part, line, column }
    }
}

/// Returns line and column of a byte of a text.
fn position(text: &str, pieces: &[TextPiece], offset: usize) -> (usize, usize) {
    let piece = pieces.iter().rev().find(|piece| piece.start <= offset);
    let &TextPiece { start, line, column } = piece.unwrap_or(&pieces[0]);
    (line, column + text[start..offset].chars().count())
}

/// A line with all its continuations, without the comment.
#[derive(Debug, Default)]
pub(super) struct LogicalLine<'a> {
    text: Cow<'a, str>,
    pieces: Vec<TextPiece>,
}

/// Returns the lines that hold commands, and the number of those skipped because they are short.
pub(super) fn join_lines(text: &str) -> (Vec<LogicalLine<'_>>, u64) {
    let mut lines: Vec<LogicalLine> = Vec::new();
    let mut short_lines = 0;
    let mut is_continued = false;
    for (number, physical) in physical_lines(text) {
        let content = before_comment(physical);
        if content.trim().is_empty() {
            continue;
        }
        // Only a short line that is no continuation is skipped, because the end of a continued line
        // counts.
        if !is_continued && physical.trim().chars().count() < MIN_LINE_CHARS {
            short_lines += 1;
            continue;
        }
        let continued = content.trim_end().strip_suffix('\\');
        let content = continued.unwrap_or(content);
        match lines.last_mut().filter(|_| is_continued) {
            Some(line) => line.append(number, content),
            None => {
                let pieces = vec![TextPiece { start: 0, line: number, column: 1 }];
                lines.push(LogicalLine { text: content.into(), pieces });
            }
        }
        is_continued = continued.is_some();
    }
    (lines, short_lines)
}

/// Returns lines and their numbers from 1. They end with LF, CR LF, CR CR LF or a lone CR, because
/// files from three systems are in use, and some have been converted twice.
fn physical_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let ended_by_lf = text.split('\n').map(|line| line.trim_end_matches('\r'));
    ended_by_lf.flat_map(|line| line.split('\r')).enumerate().map(|(i, line)| (i + 1, line))
}

fn before_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or("")
}

impl LogicalLine<'_> {
    /// Appends a continuation after one blank.
    fn append(&mut self, number: usize, content: &str) {
        // A longer line is refused by `commands`, so the rest of it is not needed.
        if self.text.len() > MAX_LINE_BYTES {
            return;
        }
        let text = self.text.to_mut();
        text.truncate(text.trim_end().len());
        text.push(' ');
        let trimmed = content.trim_start();
        let column = content[..content.len() - trimmed.len()].chars().count() + 1;
        self.pieces.push(TextPiece { start: text.len(), line: number, column });
        text.push_str(trimmed);
    }

    /// Returns the commands on this line, all with the time at its start.
    pub(super) fn commands(&self, file: &Rc<CommandFile>) -> Result<Vec<CommandText>, InputError> {
        let place: &dyn fmt::Display = &file.name;
        if self.text.len() > MAX_LINE_BYTES {
            let cause = format!("the line has more than {MAX_LINE_BYTES} bytes");
            let error = InputError::new(place, cause, "write one command per line");
            return Err(error.with_position(self.pieces[0].line, 1));
        }
        let Some((stamp, content)) = self.text.split_once('>') else {
            let word = self.token(self.text.trim());
            return Err(word.error(place, "no `>` after a time".to_string(), STAMP_REMEDY));
        };
        let time_s = parse_stamp(place, self.token(stamp.trim()))?;
        let mut commands = Vec::new();
        for part in content.split(';') {
            let command = part.trim_matches(BLANKS);
            if !command.is_empty() {
                let text = command.to_string();
                let pieces = self.pieces_of(command);
                commands.push(CommandText { time_s, file: Rc::clone(file), text, pieces });
            }
        }
        Ok(commands)
    }

    /// Returns the physical lines that a part of this line's text consists of.
    fn pieces_of(&self, part: &str) -> Vec<TextPiece> {
        let offset = part.as_ptr() as usize - self.text.as_ptr() as usize;
        let (line, column) = position(&self.text, &self.pieces, offset);
        let mut pieces = vec![TextPiece { start: 0, line, column }];
        let later = self.pieces.iter().filter(|piece| piece.start > offset);
        for piece in later.filter(|piece| piece.start < offset + part.len()) {
            pieces.push(TextPiece { start: piece.start - offset, ..*piece });
        }
        pieces
    }

    /// Returns `part` of this line's text with its position in the file.
    fn token<'b>(&'b self, part: &'b str) -> Token<'b> {
        let offset = part.as_ptr() as usize - self.text.as_ptr() as usize;
        let (line, column) = position(&self.text, &self.pieces, offset);
        Token { text: part, line, column }
    }
}

/// The largest time in seconds: no scenario lasts six weeks.
const MAX_TIME_S: f64 = 1000.0 * 3600.0;

const STAMP_REMEDY: &str = "start the line with a time such as 00:01:30.00>: hours, minutes and seconds, less than 1000 hours in all";

/// Reads `HH:MM:SS.ss` in seconds; one digit per part is enough, and further parts have no meaning.
fn parse_stamp(place: &dyn fmt::Display, stamp: Token) -> Result<f64, InputError> {
    stamp_seconds(stamp.text).ok_or_else(|| {
        let cause = "no time of the form HH:MM:SS.ss before `>`".to_string();
        stamp.error(place, cause, STAMP_REMEDY)
    })
}

/// Reads hours and minutes as whole numbers and seconds as any number, as the scenarios' own simulator does. A time
/// before the start is the start.
fn stamp_seconds(text: &str) -> Option<f64> {
    let mut parts = text.split(':').map(str::trim);
    let hours: i32 = parts.next()?.parse().ok()?;
    let minutes: i32 = parts.next()?.parse().ok()?;
    let seconds: f64 = parts.next()?.parse().ok()?;
    let time_s = f64::from(hours) * 3600.0 + f64::from(minutes) * 60.0 + seconds;
    (time_s.abs() < MAX_TIME_S).then_some(time_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> Rc<CommandFile> {
        Rc::new(CommandFile { name: "f.scn".into(), prefix: String::new(), depth: 0 })
    }

    /// Time and words of each command; words joined with `|`.
    fn read(text: &str) -> Vec<(f64, String)> {
        let (lines, _) = join_lines(text);
        let commands = lines.iter().flat_map(|line| {
            line.commands(&file()).unwrap().into_iter().map(|command| {
                let words: Vec<_> = command.words().iter().map(|word| word.text).collect();
                (command.time_s, words.join("|"))
            })
        });
        commands.collect()
    }

    fn words(command: &str) -> String {
        read(&format!("00:00:00.00>{command}\n")).remove(0).1
    }

    #[test]
    fn stamps_may_have_blanks_one_digit_and_fractions() {
        for (stamp, time_s) in
            [("00:00:26.9", 26.9), (" 0:15:00.00", 900.0), ("1:01:01", 3661.0), ("0:0:59.", 59.0)]
        {
            assert_eq!(read(&format!("{stamp}>HOLD IT")), [(time_s, "HOLD|IT".to_string())]);
        }
    }

    #[test]
    fn of_a_stamp_the_first_three_parts_count_and_none_has_a_limit_of_its_own() {
        for (stamp, time_s) in [
            (" 0:00:00:00", 0.0),
            ("0:00:05:99", 5.0),
            ("00:01:02.5:x:y", 62.5),
            ("00:90:00", 5400.0),
            ("00:00:75.5", 75.5),
            ("+0:01:00", 60.0),
        ] {
            assert_eq!(read(&format!("{stamp}>HOLD IT")), [(time_s, "HOLD|IT".to_string())]);
        }
    }

    #[test]
    fn wrong_stamps_and_lines_without_one_are_pointed_at() {
        let wrong = [
            ("CRE A B744 52 4", 1),
            ("  00:00>CRE A B744", 3),
            ("0.5:00:00>CRE A B744", 1),
            ("00:1.5:00>CRE A B744", 1),
            ("00:xx:00>CRE A B744", 1),
            ("00:00:inf>CRE A B744", 1),
            ("00::00>CRE A B744", 1),
            ("1000:00:00>CRE A B744", 1),
        ];
        for (text, column) in wrong {
            let error = join_lines(text).0[0].commands(&file()).unwrap_err();
            assert_eq!(error.line_and_column(), Some((1, column)), "{text}");
        }
    }

    #[test]
    fn words_are_split_at_blanks_and_commas_and_two_commas_leave_one_out() {
        assert_eq!(words("CRE A, B744,52  4.0 , 90"), "CRE|A|B744|52|4.0|90");
        assert_eq!(words("WIND 0,,180 ,, 25"), "WIND|0||180||25");
        assert_eq!(words("WIND 0, ,180"), "WIND|0||180");
        assert_eq!(words("DEST OU106   ,EKKA"), "DEST|OU106|EKKA");
        assert_eq!(words("ADDWPT,KL204,PAM,"), "ADDWPT|KL204|PAM");
        assert_eq!(words(" TEST\tLNAV ON "), "TEST|LNAV|ON");
        assert_eq!(words("ECHO 'a, b' \"c d\",e N52'14'13"), "ECHO|a, b|c d|e|N52'14'13");
    }

    #[test]
    fn semicolons_separate_commands_and_comments_end_them() {
        let both = "0:00:00.00>SYN SUPER 8;TRAILS ON # and; this > not\n#0:00:00.00>HOLD\n # x\n";
        let expected = [(0.0, "SYN|SUPER|8".to_string()), (0.0, "TRAILS|ON".to_string())];
        assert_eq!(read(both), expected);
        assert_eq!(read("0:00:00.00>;; HOLD ;").len(), 1);
    }

    #[test]
    fn short_lines_are_skipped_and_counted() {
        let (lines, short_lines) = join_lines("0:00:0>OP\n\n# note\n0:00:00>OP\n0:0:0>X \n");
        assert_eq!((lines.len(), short_lines), (1, 2));
    }

    #[test]
    fn every_kind_of_line_end_ends_a_line_once() {
        for end in ["\n", "\r\n", "\r\r\n", "\r"] {
            let text = format!("00:00:00.00>HOLD{end}00:00:01.00>OP{end}");
            assert_eq!(read(&text).len(), 2, "{end:?}");
            let (lines, _) = join_lines(&text);
            assert_eq!(lines[1].commands(&file()).unwrap()[0].words()[0].line, 2, "{end:?}");
        }
    }

    #[test]
    fn a_backslash_continues_a_line_and_words_keep_their_places() {
        let text = "0:00:00.00>CRE A,B744, \\\n# between\n 52 4\\\n0 90\n0:00:00.00>OP\n";
        assert_eq!(read(text)[0].1, "CRE|A|B744|52|4|0|90");
        let (lines, _) = join_lines(text);
        let command = lines[0].commands(&file()).unwrap().remove(0);
        let places: Vec<_> = command.words().iter().map(|word| (word.line, word.column)).collect();
        assert_eq!(places, [(1, 12), (1, 16), (1, 18), (3, 2), (3, 5), (4, 1), (4, 3)]);
    }

    #[test]
    fn a_line_without_end_is_an_error_and_takes_no_memory() {
        let text = format!("0:00:00.00>A{}", "A,\\\n".repeat(100_000));
        let (lines, _) = join_lines(&text);
        assert!(lines[0].text.len() < 2 * MAX_LINE_BYTES);
        assert!(lines[0].commands(&file()).unwrap_err().cause().contains("bytes"));
    }
}
