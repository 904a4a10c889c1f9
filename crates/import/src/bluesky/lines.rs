//! Time-stamped commands with their words, read from the text of a scenario.

use std::borrow::Cow;
use std::fmt;

use crate::table::Token;
use sidestep_kernel::InputError;

/// The minimum number of characters of a line; shorter ones are skipped, as in the scenarios' own
/// simulator.
const MIN_LINE_CHARS: usize = 10;

/// The maximum length of a line in bytes, including its continuations. It bounds the time to find a
/// word's column.
const MAX_LINE_BYTES: usize = 10_000;

/// The separators of words other than the comma.
const BLANKS: [char; 2] = [' ', '\t'];

/// One command and its words, the first of which is its name or an aircraft.
#[derive(Debug)]
pub(super) struct Command<'a> {
    /// Seconds since the start of the scenario.
    pub(super) time_s: f64,
    /// Words, at least one. An argument that is left out is an empty word.
    pub(super) words: Vec<Token<'a>>,
}

/// A line with all its continuations, without the comment.
#[derive(Debug, Default)]
pub(super) struct LogicalLine<'a> {
    text: Cow<'a, str>,
    /// The index in `text` of the first byte of each physical line, and its number, from 1.
    pieces: Vec<(usize, usize)>,
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
            None => lines.push(LogicalLine { text: content.into(), pieces: vec![(0, number)] }),
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

impl<'a> LogicalLine<'a> {
    /// Appends a continuation unchanged, including its leading blanks.
    fn append(&mut self, number: usize, content: &str) {
        // A longer line is refused by `commands`, so the rest of it is not needed.
        if self.text.len() <= MAX_LINE_BYTES {
            self.pieces.push((self.text.len(), number));
            self.text.to_mut().push_str(content);
        }
    }

    /// Returns the commands on this line, all with the time at its start.
    pub(super) fn commands(
        &self,
        place: &dyn fmt::Display,
    ) -> Result<Vec<Command<'_>>, InputError> {
        if self.text.len() > MAX_LINE_BYTES {
            let cause = format!("the line has more than {MAX_LINE_BYTES} bytes");
            let error = InputError::new(place, cause, "write one command per line");
            return Err(error.with_position(self.pieces[0].1, 1));
        }
        let Some((stamp, content)) = self.text.split_once('>') else {
            let word = self.token(self.text.trim());
            return Err(word.error(place, "no `>` after a time".to_string(), STAMP_REMEDY));
        };
        let time_s = parse_stamp(place, self.token(stamp.trim()))?;
        let commands =
            content.split(';').map(|command| Command { time_s, words: self.tokens(command) });
        Ok(commands.filter(|command| !command.words.is_empty()).collect())
    }

    /// Splits at blanks, at commas with blanks around them, or both; two commas with nothing
    /// between them leave an argument out.
    fn tokens(&self, command: &str) -> Vec<Token<'_>> {
        let mut words = Vec::new();
        let mut rest = command.trim_matches(BLANKS);
        while !rest.is_empty() {
            let end = rest.find([',', ' ', '\t']).unwrap_or(rest.len());
            words.push(self.token(&rest[..end]));
            rest = rest[end..].trim_start_matches(BLANKS);
            rest = rest.strip_prefix(',').unwrap_or(rest).trim_start_matches(BLANKS);
        }
        words
    }

    /// Returns `part` of this line's text with its position in the file.
    fn token(&self, part: &str) -> Token<'_> {
        let offset = part.as_ptr() as usize - self.text.as_ptr() as usize;
        let piece = self.pieces.iter().rev().find(|(start, _)| *start <= offset);
        let &(start, line) = piece.unwrap_or(&self.pieces[0]);
        let column = self.text[start..offset].chars().count() + 1;
        Token { text: &self.text[offset..offset + part.len()], line, column }
    }
}

/// The largest number of hours of a time: no scenario lasts six weeks.
const MAX_HOURS: u32 = 999;

const STAMP_REMEDY: &str =
    "start the line with a time such as 00:01:30.00>, of up to 59 minutes and less than 60 seconds";

/// Reads `HH:MM:SS.ss` in seconds; one digit per part is enough.
fn parse_stamp(place: &dyn fmt::Display, stamp: Token) -> Result<f64, InputError> {
    stamp_seconds(stamp.text).ok_or_else(|| {
        let cause = "no time of the form HH:MM:SS.ss before `>`".to_string();
        stamp.error(place, cause, STAMP_REMEDY)
    })
}

fn stamp_seconds(text: &str) -> Option<f64> {
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let [hours, minutes, seconds] = parts[..] else { return None };
    let hours = hours.parse::<u32>().ok().filter(|hours| *hours <= MAX_HOURS)?;
    let minutes = minutes.parse::<u32>().ok().filter(|minutes| *minutes < 60)?;
    let seconds = seconds.parse::<f64>().ok().filter(|seconds| (0.0..60.0).contains(seconds))?;
    Some(f64::from(hours) * 3600.0 + f64::from(minutes) * 60.0 + seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Time and words of each command; words joined with `|`.
    fn read(text: &str) -> Vec<(f64, String)> {
        let (lines, _) = join_lines(text);
        let commands = lines.iter().flat_map(|line| {
            line.commands(&"f.scn").unwrap().into_iter().map(|command| {
                let words: Vec<_> = command.words.iter().map(|word| word.text).collect();
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
    fn wrong_stamps_and_lines_without_one_are_pointed_at() {
        let wrong = [
            ("CRE A B744 52 4", 1),
            ("  00:00>CRE A B744", 3),
            ("00:00:-1>CRE A B744", 1),
            ("00:xx:00>CRE A B744", 1),
            ("00:00:inf>CRE A B744", 1),
            ("99:99:99>CRE A B744", 1),
            ("00:60:00>CRE A B744", 1),
            ("00:00:60>CRE A B744", 1),
            ("1000:00:00>CRE A B744", 1),
        ];
        for (text, column) in wrong {
            let error = join_lines(text).0[0].commands(&"f.scn").unwrap_err();
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
            assert_eq!(lines[1].commands(&"f").unwrap()[0].words[0].line, 2, "{end:?}");
        }
    }

    #[test]
    fn a_backslash_continues_a_line_and_words_keep_their_places() {
        let text = "0:00:00.00>CRE A,B744, \\\n# between\n 52 4\\\n0 90\n0:00:00.00>OP\n";
        assert_eq!(read(text)[0].1, "CRE|A|B744|52|40|90");
        let (lines, _) = join_lines(text);
        let command = lines[0].commands(&"f").unwrap().remove(0);
        let places: Vec<_> = command.words.iter().map(|word| (word.line, word.column)).collect();
        assert_eq!(places, [(1, 12), (1, 16), (1, 18), (3, 2), (3, 5), (4, 3)]);
    }

    #[test]
    fn a_line_without_end_is_an_error_and_takes_no_memory() {
        let text = format!("0:00:00.00>A{}", "A,\\\n".repeat(100_000));
        let (lines, _) = join_lines(&text);
        assert!(lines[0].text.len() < 2 * MAX_LINE_BYTES);
        assert!(lines[0].commands(&"f").unwrap_err().cause().contains("bytes"));
    }
}
