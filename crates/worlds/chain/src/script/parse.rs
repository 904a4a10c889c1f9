//! The parser: text -> [`Script`].

use winnow::ascii::{digit0, digit1, multispace1, till_line_ending};
use winnow::combinator::{alt, cut_err, opt, peek, preceded, repeat, separated, terminated};
use winnow::error::{ContextError, ErrMode, ParserError, StrContext, StrContextValue};
use winnow::prelude::*;
use winnow::stream::{LocatingSlice, Location, Stream};
use winnow::token::{one_of, take_while};

use super::{
    Expression, ExpressionTerm, MAX_BYTES, MAX_NESTING, Procedure, Script, ScriptAction, Statement,
};
use sidestep_kernel::InputError;
use sidestep_scenario::suggestion;

type ParserInput<'a> = LocatingSlice<&'a str>;

/// Words that cannot name a procedure.
const RESERVED: [&str; 8] = ["forward", "turn", "pitch", "wait", "goto", "repeat", "to", "end"];

/// Statements, listed in errors if anything else is found.
const STATEMENTS: &str = "a statement (forward, turn, pitch, wait, goto, repeat, a procedure)";

pub(super) fn script(place: &str, text: &str) -> Result<Script, InputError> {
    if text.len() > MAX_BYTES {
        let cause = format!("has more than {MAX_BYTES} bytes");
        return Err(InputError::new(place, cause, "use procedures and repeat"));
    }
    check_nesting(place, text)?;
    let items = parse_program.parse(LocatingSlice::new(text)).map_err(|error| {
        let (cause, remedy) = describe_error(error.inner(), &text[error.offset()..]);
        InputError::new(place, cause, remedy).with_byte_offset(text, error.offset())
    })?;
    let mut main = Vec::new();
    let mut procedures = Vec::new();
    for item in items {
        match item {
            ScriptItem::Statement(statement) => main.push(statement),
            ScriptItem::Procedure(procedure) => procedures.push(procedure),
        }
    }
    let script = Script { place: place.into(), text: text.into(), main, procedures };
    resolve_names(script)
}

/// Limits nesting, because the parser recurses for each bracket and the stack must not set the
/// limit.
fn check_nesting(place: &str, text: &str) -> Result<(), InputError> {
    let mut depth: usize = 0;
    let mut in_comment = false;
    for (at, c) in text.char_indices() {
        match c {
            '#' => in_comment = true,
            '\n' => in_comment = false,
            '[' | '(' if !in_comment => depth += 1,
            ']' | ')' if !in_comment => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > MAX_NESTING {
            let cause = format!("more than {MAX_NESTING} brackets in each other");
            return Err(InputError::new(place, cause, "use procedures").with_byte_offset(text, at));
        }
    }
    Ok(())
}

/// Returns the expected and the found token, in words.
fn describe_error(error: &ContextError, rest: &str) -> (String, String) {
    let expected = error.context().find_map(|context| match context {
        StrContext::Expected(value) => Some(value.to_string()),
        _ => None,
    });
    let expected = expected.unwrap_or_else(|| STATEMENTS.into());
    let found = match rest.chars().next() {
        Some(c) if is_name_char(c) => {
            format!("`{}`", rest.split(|c| !is_name_char(c)).next().unwrap_or(""))
        }
        Some(c) => format!("`{}`", c.escape_debug()),
        None => "the end of the script".into(),
    };
    (format!("{found} where {expected} is expected"), format!("write {expected} there"))
}

fn is_name_char(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn expected(what: &'static str) -> StrContext {
    StrContext::Expected(StrContextValue::Description(what))
}

enum ScriptItem {
    Statement(Statement),
    Procedure(Procedure),
}

fn parse_program(input: &mut ParserInput) -> ModalResult<Vec<ScriptItem>> {
    let item = alt((
        parse_procedure.map(ScriptItem::Procedure),
        parse_statement.map(ScriptItem::Statement),
    ));
    preceded(skip_blank, repeat(0.., item)).parse_next(input)
}

fn skip_blank(input: &mut ParserInput) -> ModalResult<()> {
    let comment = ('#', till_line_ending).void();
    repeat(0.., alt((multispace1.void(), comment))).parse_next(input)
}

fn name<'a>(input: &mut ParserInput<'a>) -> ModalResult<&'a str> {
    let letters = (one_of(char::is_alphabetic), take_while(0.., is_name_char)).take();
    terminated(letters, skip_blank).parse_next(input)
}

fn parse_symbol<'a>(expected: char) -> impl ModalParser<ParserInput<'a>, char, ContextError> {
    terminated(expected, skip_blank)
}

fn parse_procedure(input: &mut ParserInput) -> ModalResult<Procedure> {
    let at = input.current_token_start();
    name.verify(|word: &str| word == "to").parse_next(input)?;
    let free = name.verify(|word: &str| !RESERVED.contains(&word));
    let called = cut_err(free).context(expected("a name for the procedure")).parse_next(input)?;
    let parameter = preceded(':', cut_err(name).context(expected("a parameter's name")));
    let parameters: Vec<&str> = repeat(0.., parameter).parse_next(input)?;
    let body = repeat(0.., parse_statement).parse_next(input)?;
    let end = name.verify(|word: &str| word == "end");
    cut_err(end).context(expected("a statement or `end`")).parse_next(input)?;
    let parameters = parameters.into_iter().map(str::to_owned).collect();
    Ok(Procedure { name: called.into(), parameters, body, at })
}

fn parse_statement(input: &mut ParserInput) -> ModalResult<Statement> {
    let start = input.checkpoint();
    let at = input.current_token_start();
    let action = match name.parse_next(input)? {
        "forward" => ScriptAction::Forward(parse_argument(input)?),
        "turn" => ScriptAction::Turn(parse_argument(input)?),
        "pitch" => ScriptAction::Pitch(parse_argument(input)?),
        "wait" => ScriptAction::Wait(parse_argument(input)?),
        "goto" => ScriptAction::Goto(parse_coordinates(input)?),
        "repeat" => ScriptAction::Repeat(parse_argument(input)?, parse_block(input)?),
        // They end the statements before them, and are for the caller to parse.
        "to" | "end" => {
            input.reset(&start);
            return Err(ErrMode::Backtrack(ContextError::from_input(input)));
        }
        name => ScriptAction::Call {
            name: name.into(),
            procedure: 0,
            arguments: parse_arguments(input)?,
        },
    };
    Ok(Statement { at, action })
}

fn parse_block(input: &mut ParserInput) -> ModalResult<Vec<Statement>> {
    cut_err(parse_symbol('[')).context(expected("`[`")).parse_next(input)?;
    let statements = repeat(0.., parse_statement).parse_next(input)?;
    cut_err(parse_symbol(']')).context(expected("a statement or `]`")).parse_next(input)?;
    Ok(statements)
}

fn parse_argument(input: &mut ParserInput) -> ModalResult<Expression> {
    cut_err(parse_expression).context(expected("a value")).parse_next(input)
}

fn parse_coordinates(input: &mut ParserInput) -> ModalResult<Vec<Expression>> {
    let mut found = vec![parse_argument(input)?];
    cut_err(parse_symbol(',')).context(expected("`,`")).parse_next(input)?;
    found.push(parse_argument(input)?);
    if opt(parse_symbol(',')).parse_next(input)?.is_some() {
        found.push(parse_argument(input)?);
    }
    Ok(found)
}

/// Parses the values behind a procedure's name; none if no value starts there.
fn parse_arguments(input: &mut ParserInput) -> ModalResult<Vec<Expression>> {
    let begins = one_of(|c: char| c.is_ascii_digit() || ".:(-".contains(c));
    if opt(peek(begins)).parse_next(input)?.is_none() {
        return Ok(Vec::new());
    }
    separated(1.., parse_argument, parse_symbol(',')).parse_next(input)
}

fn parse_expression(input: &mut ParserInput) -> ModalResult<Expression> {
    let at = input.current_token_start();
    let mut terms = Vec::new();
    parse_sum(input, &mut terms)?;
    Ok(Expression { at, terms })
}

fn parse_sum(input: &mut ParserInput, terms: &mut Vec<ExpressionTerm>) -> ModalResult<()> {
    parse_product(input, terms)?;
    while let Some(operator) = opt(alt((parse_symbol('+'), parse_symbol('-')))).parse_next(input)? {
        parse_operand(input, terms, parse_product)?;
        terms.push(if operator == '+' { ExpressionTerm::Add } else { ExpressionTerm::Subtract });
    }
    Ok(())
}

fn parse_product(input: &mut ParserInput, terms: &mut Vec<ExpressionTerm>) -> ModalResult<()> {
    parse_factor(input, terms)?;
    while let Some(operator) = opt(alt((parse_symbol('*'), parse_symbol('/')))).parse_next(input)? {
        parse_operand(input, terms, parse_factor)?;
        terms.push(if operator == '*' { ExpressionTerm::Multiply } else { ExpressionTerm::Divide });
    }
    Ok(())
}

/// Parses the operand that has to follow an operator.
fn parse_operand(
    input: &mut ParserInput,
    terms: &mut Vec<ExpressionTerm>,
    parse: fn(&mut ParserInput, &mut Vec<ExpressionTerm>) -> ModalResult<()>,
) -> ModalResult<()> {
    let operand = |input: &mut ParserInput| parse(input, terms);
    cut_err(operand).context(expected("a value")).parse_next(input)
}

fn parse_factor(input: &mut ParserInput, terms: &mut Vec<ExpressionTerm>) -> ModalResult<()> {
    let is_negative = opt(parse_symbol('-')).parse_next(input)?.is_some();
    if opt(parse_symbol('(')).parse_next(input)?.is_some() {
        parse_operand(input, terms, parse_sum)?;
        cut_err(parse_symbol(')')).context(expected("`)`")).parse_next(input)?;
    } else {
        terms.push(alt((parse_number, parse_parameter)).parse_next(input)?);
    }
    if is_negative {
        terms.push(ExpressionTerm::Negate);
    }
    Ok(())
}

fn parse_number(input: &mut ParserInput) -> ModalResult<ExpressionTerm> {
    let digits = alt(((digit1, opt(('.', digit0))).void(), ('.', digit1).void()));
    let exponent = (one_of(['e', 'E']), opt(one_of(['+', '-'])), digit1);
    let number = (digits, opt(exponent)).take().parse_to().map(ExpressionTerm::Number);
    terminated(number, skip_blank).parse_next(input)
}

fn parse_parameter(input: &mut ParserInput) -> ModalResult<ExpressionTerm> {
    let at = input.current_token_start();
    let named = cut_err(name).context(expected("a parameter's name"));
    preceded(':', named).map(|name| ExpressionTerm::Named(name.into(), at)).parse_next(input)
}

/// Replaces names of procedures and parameters by indices.
fn resolve_names(mut script: Script) -> Result<Script, InputError> {
    for (i, procedure) in script.procedures.iter().enumerate() {
        if script.procedures[..i].iter().any(|earlier| earlier.name == procedure.name) {
            let cause = format!("a second procedure `{}`", procedure.name);
            return Err(script.error(procedure.at, cause, "give each a name of its own"));
        }
    }
    let mut main = std::mem::take(&mut script.main);
    resolve(&script, &mut main, &[])?;
    let mut bodies = Vec::with_capacity(script.procedures.len());
    for procedure in &script.procedures {
        let mut body = procedure.body.clone();
        resolve(&script, &mut body, &procedure.parameters)?;
        bodies.push(body);
    }
    for (procedure, body) in script.procedures.iter_mut().zip(bodies) {
        procedure.body = body;
    }
    Ok(Script { main, ..script })
}

fn resolve(
    script: &Script,
    statements: &mut [Statement],
    parameters: &[String],
) -> Result<(), InputError> {
    for Statement { at, action } in statements {
        match action {
            ScriptAction::Forward(e)
            | ScriptAction::Turn(e)
            | ScriptAction::Pitch(e)
            | ScriptAction::Wait(e) => {
                resolve_parameters(script, std::slice::from_mut(e), parameters)?;
            }
            ScriptAction::Goto(coordinates) => resolve_parameters(script, coordinates, parameters)?,
            ScriptAction::Repeat(count, body) => {
                resolve_parameters(script, std::slice::from_mut(count), parameters)?;
                resolve(script, body, parameters)?;
            }
            ScriptAction::Call { name, procedure, arguments } => {
                *procedure = find_procedure(script, *at, name, arguments.len())?;
                resolve_parameters(script, arguments, parameters)?;
            }
        }
    }
    Ok(())
}

fn find_procedure(
    script: &Script,
    at: usize,
    name: &str,
    arguments: usize,
) -> Result<usize, InputError> {
    let Some(index) = script.procedures.iter().position(|p| p.name == name) else {
        let procedures = script.procedures.iter().map(|p| p.name.as_str());
        let known: Vec<&str> = RESERVED.into_iter().chain(procedures).collect();
        let cause = format!("there is no procedure `{name}`");
        return Err(script.error(at, cause, suggestion(name, &known)));
    };
    let parameters = &script.procedures[index].parameters;
    if parameters.len() != arguments {
        let cause = format!("`{name}` takes {} values, not {arguments}", parameters.len());
        let remedy = match &parameters[..] {
            [] => format!("write `{name}` alone"),
            _ => format!("write {name} {}", parameters.join(", ")),
        };
        return Err(script.error(at, cause, remedy));
    }
    Ok(index)
}

fn resolve_parameters(
    script: &Script,
    values: &mut [Expression],
    parameters: &[String],
) -> Result<(), InputError> {
    for term in values.iter_mut().flat_map(|value| &mut value.terms) {
        let ExpressionTerm::Named(name, at) = term else { continue };
        let Some(index) = parameters.iter().position(|parameter| parameter == name) else {
            let known: Vec<&str> = parameters.iter().map(String::as_str).collect();
            let cause = format!("there is no parameter `:{name}` here");
            return Err(script.error(*at, cause, suggestion(name, &known)));
        };
        *term = ExpressionTerm::Parameter(index);
    }
    Ok(())
}
