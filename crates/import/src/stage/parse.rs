//! Text -> [`Item`]s.

use winnow::ascii::{digit1, multispace1, till_line_ending};
use winnow::combinator::{alt, cut_err, opt, preceded, repeat, terminated};
use winnow::error::{ContextError, StrContext, StrContextValue};
use winnow::prelude::*;
use winnow::stream::{LocatingSlice, Location};
use winnow::token::{take_till, take_while};

use sidestep_kernel::InputError;

type Input<'a> = LocatingSlice<&'a str>;

/// The maximum depth of models within models.
pub(super) const MAX_NESTING: usize = 64;

/// A top-level part of a file.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Item {
    Include(Value),
    Define { name: String, model: ModelBlock },
    Entry(Entry),
}

/// A part of a model, or of the whole world.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Entry {
    Property { key: String, value: Value },
    Model(ModelBlock),
}

/// `KIND ( ENTRIES )`
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ModelBlock {
    pub(super) kind: String,
    pub(super) entries: Vec<Entry>,
    pub(super) at: SourcePosition,
}

/// One word or text, or a list of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Value {
    pub(super) words: Vec<String>,
    pub(super) at: SourcePosition,
}

/// A file, and a byte offset in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SourcePosition {
    pub(super) file: usize,
    pub(super) offset: usize,
}

/// Parses the items of a file; `file` is its number among all that were read, for positions.
pub(super) fn items(place: &str, text: &str, file: usize) -> Result<Vec<Item>, InputError> {
    check_nesting(place, text)?;
    let mut parser = preceded(blank, repeat(0.., |input: &mut Input| item(input, file)));
    parser.parse(LocatingSlice::new(text)).map_err(|error| {
        let expected = error.inner().context().find_map(|context| match context {
            StrContext::Expected(value) => Some(value.to_string()),
            _ => None,
        });
        let expected = expected.unwrap_or_else(|| "a property or a model".into());
        let actual = match text[error.offset()..].chars().next() {
            Some(c) => format!("`{}`", c.escape_debug()),
            None => "the end of the file".into(),
        };
        let cause = format!("{actual} where {expected} is expected");
        InputError::new(place, cause, format!("write {expected} there"))
            .with_byte_offset(text, error.offset())
    })
}

/// Checks the depth of models, because the parser calls itself for each model in a model and must
/// not overflow the stack.
fn check_nesting(place: &str, text: &str) -> Result<(), InputError> {
    let mut depth = 0usize;
    let mut in_comment = false;
    let mut in_text = false;
    for (offset, c) in text.char_indices() {
        match c {
            '\n' => in_comment = false,
            _ if in_comment => {}
            '"' => in_text = !in_text,
            _ if in_text => {}
            '#' => in_comment = true,
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > MAX_NESTING {
            let cause = format!("more than {MAX_NESTING} models in each other");
            return Err(InputError::new(place, cause, "use fewer").with_byte_offset(text, offset));
        }
    }
    Ok(())
}

fn expected(what: &'static str) -> StrContext {
    StrContext::Expected(StrContextValue::Description(what))
}

/// Blanks, line breaks and comments.
fn blank(input: &mut Input) -> ModalResult<()> {
    let comment = ('#', till_line_ending).void();
    repeat(0.., alt((multispace1.void(), comment))).parse_next(input)
}

fn sign<'a>(sign: char) -> impl ModalParser<Input<'a>, char, ContextError> {
    terminated(sign, blank)
}

fn is_word(c: char) -> bool {
    !c.is_whitespace() && !"()[]\"#".contains(c)
}

/// A word, perhaps with an index: `point[3]`.
fn name(input: &mut Input) -> ModalResult<String> {
    let index = opt(('[', digit1, ']'));
    let name = (take_while(1.., is_word), index).take().map(str::to_owned);
    terminated(name, blank).parse_next(input)
}

/// A word or a text in quotes.
fn atom(input: &mut Input) -> ModalResult<String> {
    let closed = cut_err('"').context(expected("a closing `\"`"));
    let text = preceded('"', terminated(take_till(0.., ['"', '\n']), closed));
    let word = take_while(1.., is_word);
    terminated(alt((text, word)).map(str::to_owned), blank).parse_next(input)
}

fn value(input: &mut Input, file: usize) -> ModalResult<Value> {
    let at = SourcePosition { file, offset: input.current_token_start() };
    let closed = cut_err(sign(']')).context(expected("a value or `]`"));
    let list = preceded(sign('['), terminated(repeat(0.., atom), closed));
    let one = atom.map(|word| vec![word]);
    let words = cut_err(alt((list, one))).context(expected("a value")).parse_next(input)?;
    Ok(Value { words, at })
}

fn item(input: &mut Input, file: usize) -> ModalResult<Item> {
    let at = SourcePosition { file, offset: input.current_token_start() };
    let word = name.parse_next(input)?;
    match word.as_str() {
        "include" => value(input, file).map(Item::Include),
        "define" => {
            let name = cut_err(name).context(expected("a name")).parse_next(input)?;
            let at = SourcePosition { file, offset: input.current_token_start() };
            let kind = cut_err(self::name).context(expected("a model's name")).parse_next(input)?;
            cut_err(sign('(')).context(expected("`(`")).parse_next(input)?;
            Ok(Item::Define { name, model: model(input, kind, at)? })
        }
        _ => entry_of(input, word, at).map(Item::Entry),
    }
}

fn entry(input: &mut Input, file: usize) -> ModalResult<Entry> {
    let at = SourcePosition { file, offset: input.current_token_start() };
    let word = name.parse_next(input)?;
    entry_of(input, word, at)
}

/// Parses the entry that starts with a word: a model, or a property.
fn entry_of(input: &mut Input, word: String, at: SourcePosition) -> ModalResult<Entry> {
    if opt(sign('(')).parse_next(input)?.is_some() {
        return model(input, word, at).map(Entry::Model);
    }
    Ok(Entry::Property { key: word, value: value(input, at.file)? })
}

/// Parses the rest of a model, after its opening bracket.
fn model(input: &mut Input, kind: String, at: SourcePosition) -> ModalResult<ModelBlock> {
    let entries = repeat(0.., |input: &mut Input| entry(input, at.file)).parse_next(input)?;
    cut_err(sign(')')).context(expected("a property, a model or `)`")).parse_next(input)?;
    Ok(ModelBlock { kind, entries, at })
}
