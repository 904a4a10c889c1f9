//! Commands that read files, wait, and end.

use super::{CommandOutcome, CommandResult, Interpreter, refusal, upper};
use crate::bluesky::calls::{MAX_CALL_DEPTH, MAX_CALLS};
use crate::bluesky::lines::{CommandFile, CommandText, MAX_LINE_BYTES, join_lines};
use crate::bluesky::schedule::MAX_COMMANDS;
use crate::bluesky::text::ScnText;
use crate::bluesky::traffic::Setting;
use crate::bluesky::values::{Arguments, duration_s};
use crate::report::Treatment;
use crate::table::Token;
use sidestep_kernel::InputError;
use std::rc::Rc;

impl Interpreter {
    /// `PCALL file[,ABS|REL][,argument,...]`, also with an aircraft in front, which is the first argument.
    pub(super) fn call(&mut self, arguments: &mut Arguments) -> CommandResult {
        let mut name = arguments.required("a file")?;
        let mut values = Vec::new();
        if self.by_id.contains_key(&upper(name)) && arguments.peek().is_some() {
            values.push(name.text.to_string());
            name = arguments.required("a file")?;
        }
        let mode = arguments.peek().unwrap_or("").to_ascii_uppercase();
        let is_absolute = mode == "ABS";
        if is_absolute || mode == "REL" {
            arguments.next();
            if self.now_s > 0.0 {
                let rule =
                    "PCALL with ABS or REL: as documented; BlueSky 1.1.1 takes each for the other";
                self.note(Treatment::Suspicious, rule, "");
            }
        }
        while let Some(word) = arguments.take() {
            values.push(word.text.to_string());
        }
        let start_s = if is_absolute { 0.0 } else { self.now_s };
        self.read_file(arguments, name, &values, start_s)
    }

    /// `IC file`: everything ends, and another scenario begins.
    pub(super) fn load(&mut self, arguments: &mut Arguments) -> CommandResult {
        let Some(name) = arguments.next() else { return Ok(CommandOutcome::Done) };
        self.restart("IC");
        let now_s = self.now_s;
        self.read_file(arguments, name, &[], now_s)
    }

    fn read_file(
        &mut self,
        arguments: &Arguments,
        name: Token,
        values: &[String],
        start_s: f64,
    ) -> CommandResult {
        let depth = self.source.depth + 1;
        self.calls += 1;
        if depth > MAX_CALL_DEPTH || self.calls > MAX_CALLS {
            let cause = format!(
                "more than {MAX_CALL_DEPTH} files that call each other, or {MAX_CALLS} calls"
            );
            return Err(refusal(arguments, name, cause, "call fewer"));
        }
        let (path, text) = self
            .folder
            .read(name.text)
            .map_err(|(cause, remedy)| refusal(arguments, name, cause, remedy))?;
        if (0..values.len()).any(|k| !text.text.contains(&format!("%{k}"))) {
            let rule = "further arguments of PCALL, for which the file has no %0, %1, ...";
            self.note(Treatment::NotUsed, rule, "leave them out");
        }
        let prefix = format!("{} ", path.file_name().unwrap_or_default().to_string_lossy());
        let file = CommandFile { name: path.display().to_string(), prefix, depth };
        self.add_file(Rc::new(file), &text, values, start_s);
        Ok(CommandOutcome::Done)
    }

    /// Adds the commands of a file, whose times are in seconds after `start_s`.
    pub(super) fn add_file(
        &mut self,
        file: Rc<CommandFile>,
        text: &ScnText,
        values: &[String],
        start_s: f64,
    ) {
        for line in &text.replaced_lines {
            self.place = format!("{}line {line}", file.prefix);
            let rule = "lines with characters that are not UTF-8, which are replaced";
            self.note(Treatment::Repaired, rule, "save the file as UTF-8");
        }
        let (lines, short_lines) = join_lines(&text.text);
        self.result.short_lines += short_lines;
        let mut commands: Vec<CommandText> = Vec::new();
        for line in &lines {
            match line.commands(&file) {
                Ok(line_commands) => {
                    self.result.command_lines += u64::from(!line_commands.is_empty());
                    let told = line_commands.iter().map(|one| one.with_arguments(values));
                    commands
                        .extend(told.map(|one| one.unwrap_or_else(|| too_long(&line_commands[0]))));
                }
                Err(error) => self.add_unreadable_line(&file, error),
            }
        }
        // A stable sort, so that commands of one time stay in the order of the file.
        commands.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let left_out = self.schedule.add(commands, start_s, self.now_s);
        if left_out > 0 {
            let rule = format!("{left_out} commands behind the first {MAX_COMMANDS}");
            self.note(Treatment::Dropped, &rule, "write or call fewer");
        }
    }

    /// Lists a line that holds no command.
    fn add_unreadable_line(&mut self, file: &CommandFile, error: InputError) {
        let line = error.line_and_column().map_or(0, |(line, _)| line);
        self.place = format!("{}line {line}", file.prefix);
        self.note_unused("", error.cause());
        self.note(Treatment::Dropped, "lines that cannot be read", "see each error");
        self.result.unparsed.push(error);
    }

    /// `SCHEDULE time,command` at a time of the simulation, and `DELAY time,command` after a time.
    pub(super) fn schedule_command(
        &mut self,
        command: &CommandText,
        arguments: &mut Arguments,
        name: &str,
    ) -> CommandResult {
        let time = arguments.required("a time")?;
        let given_s = duration_s(arguments.place, time)?;
        let first = arguments.required("a command")?;
        let text = command.text_from(first).to_string();
        arguments.skip_all();
        let at_s = if name == "DELAY" { self.now_s + given_s } else { given_s.max(self.now_s) };
        if !self.schedule.add_last(at_s, command.with_text(text)) {
            let cause = format!("more than {MAX_COMMANDS} commands");
            return Err(refusal(arguments, first, cause, "write fewer"));
        }
        Ok(CommandOutcome::Done)
    }

    /// `RESET`: aircraft, way-points, settings and all commands that wait are gone, but not those of `CRECMD`.
    pub(super) fn reset(&mut self) -> CommandResult {
        self.restart("RESET");
        Ok(CommandOutcome::Done)
    }

    fn restart(&mut self, name: &str) {
        self.drop_waiting(name);
        self.delete_all();
        self.defined.clear();
        self.defaults = Default::default();
        if !self.result.traffic.settings.is_empty() {
            self.add_setting("RESET", Setting::Reset);
        }
    }

    /// `QUIT`: the simulation ends.
    pub(super) fn quit(&mut self) -> CommandResult {
        self.result.traffic.ends_s = Some(self.now_s);
        self.drop_waiting("QUIT");
        Ok(CommandOutcome::Done)
    }

    /// Lists the commands that wait for a later time, and drops them.
    fn drop_waiting(&mut self, name: &str) {
        let reason = format!("{name} at {} drops all commands of later times", self.place);
        let place = self.place.clone();
        let waiting: Vec<CommandText> = self.schedule.take_after(self.now_s).collect();
        for command in waiting {
            self.place = command.place();
            let first = command.words().first().map(|word| upper(*word)).unwrap_or_default();
            self.note_unused(&first, &reason);
            self.note(Treatment::Dropped, &reason, "give them earlier times");
        }
        self.place = place;
    }
}

/// Returns a command without words in place of one that its arguments make too long.
fn too_long(command: &CommandText) -> CommandText {
    command.with_text(format!("ARGUMENTS-LONGER-THAN-{MAX_LINE_BYTES}-BYTES"))
}
