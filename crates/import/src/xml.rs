//! The common parts of XML readers. Every error has its position in the file.

use std::borrow::Cow;
use std::path::Path;
use std::str::FromStr;

use super::{ImportReport, Treatment};
use roxmltree::{Attribute, Document, Node, ParsingOptions};
use sidestep_kernel::InputError;
use sidestep_scenario::file::{decode_text, read_bytes};

/// The maximum number of elements, comments and pieces of text in one file.
const MAX_NODES: u32 = 1 << 20;

/// The maximum number of prefixes that are declared in place of the file; each costs one more look at it.
const MAX_UNDECLARED: usize = 16;

/// Returns the text of the XML file at `path`: UTF-8, or UTF-16 if the file begins with its byte order mark.
pub(super) fn read_xml_text(path: &Path, max_bytes: u64) -> Result<String, InputError> {
    decode_text(path, read_bytes(path, max_bytes)?)
}

/// The maximum depth of elements in each other; a model has some ten, and a scene of nodes some dozens.
const MAX_DEPTH: usize = 256;

/// Returns the line of the first element that is too deep in others.
fn too_deep(document: &Document<'_>) -> Option<usize> {
    let mut depth = 0;
    let mut node = document.root();
    loop {
        if let Some(child) = node.first_child() {
            (node, depth) = (child, depth + 1);
            if depth > MAX_DEPTH {
                return Some(document.text_pos_at(node.range().start).row as usize);
            }
            continue;
        }
        while node.next_sibling().is_none() {
            (node, depth) = (node.parent()?, depth - 1);
        }
        node = node.next_sibling()?;
    }
}

/// The text of an XML file in which each prefix is declared.
///
/// Exporters and merged models leave declarations out, and the readers of robot programs do not ask for them. Missing
/// ones are inserted into the outermost element of a copy; positions are always those of the original.
pub(super) struct XmlSource<'a> {
    place: &'a str,
    original: &'a str,
    /// Number of bytes at the start of the original that are not parsed: byte order marks and blanks, which the
    /// format forbids before its first line and editors leave there.
    skipped: usize,
    /// The text that is parsed.
    text: Cow<'a, str>,
    /// The byte at which declarations were inserted.
    inserted_at: usize,
    undeclared: Vec<UndeclaredPrefix>,
}

/// A prefix that the file uses and does not declare.
struct UndeclaredPrefix {
    /// The prefix, without the colon.
    prefix: String,
    /// The place of its first use, for reports.
    place: String,
}

impl<'a> XmlSource<'a> {
    /// Checks that `text` is XML; `place` is its name in errors.
    pub(super) fn new(place: &'a str, text: &'a str) -> Result<Self, InputError> {
        let parsed = text.trim_start_matches(|c: char| c == '\u{feff}' || c.is_whitespace());
        let mut source = Self {
            place,
            original: text,
            skipped: text.len() - parsed.len(),
            text: Cow::Borrowed(parsed),
            inserted_at: root_name_end(parsed).unwrap_or(0),
            undeclared: Vec::new(),
        };
        loop {
            let error = match source.document() {
                Ok(document) => match too_deep(&document) {
                    Some(line) => return Err(source.too_deep(line)),
                    None => return Ok(source),
                },
                Err(error) => error,
            };
            let Some(prefix) = source.new_undeclared(&error) else {
                return Err(source.malformed(&error));
            };
            source.declare(prefix);
        }
    }

    fn too_deep(&self, line: usize) -> InputError {
        let skipped = self.original[..self.skipped].matches('\n').count();
        let cause = format!("has elements more than {MAX_DEPTH} deep in each other");
        InputError::new(self.place, cause, "check that this is the right kind of file")
            .with_position(line + skipped, 1)
    }

    /// Records the prefixes that were declared in place of the file, in the order of their first use.
    pub(super) fn record_undeclared(&self, report: &mut ImportReport) {
        for undeclared in &self.undeclared {
            let rule = format!("the prefix `{}:`, which is declared nowhere", undeclared.prefix);
            report.record(Treatment::Repaired, rule, undeclared.place.clone(), "");
        }
    }

    fn document(&self) -> Result<Document<'_>, roxmltree::Error> {
        let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
        Document::parse_with_options(&self.text, options)
    }

    /// Returns the prefix that an error is about, if declaring it may help.
    fn new_undeclared(&self, error: &roxmltree::Error) -> Option<UndeclaredPrefix> {
        let roxmltree::Error::UnknownNamespace(prefix, at) = error else { return None };
        let is_known = self.undeclared.iter().any(|known| known.prefix == *prefix);
        if is_known || prefix.is_empty() || self.undeclared.len() == MAX_UNDECLARED {
            return None;
        }
        let place = self.line(offset_of(&self.text, *at));
        Some(UndeclaredPrefix { prefix: prefix.clone(), place })
    }

    fn declare(&mut self, prefix: UndeclaredPrefix) {
        let declaration = format!(" xmlns:{0}=\"undeclared:{0}\"", prefix.prefix);
        self.text.to_mut().insert_str(self.inserted_at, &declaration);
        self.undeclared.push(prefix);
    }

    /// Returns the position in the original of a position in the text that is parsed.
    fn original_offset(&self, offset: usize) -> usize {
        let inserted = self.text.len() + self.skipped - self.original.len();
        if offset <= self.inserted_at {
            return self.skipped + offset;
        }
        self.skipped + offset.saturating_sub(inserted).max(self.inserted_at)
    }

    /// Returns the line of a position in the text that is parsed, for reports.
    fn line(&self, offset: usize) -> String {
        let before = &self.original.as_bytes()[..self.original_offset(offset)];
        let breaks = before.iter().filter(|byte| **byte == b'\n');
        format!("line {}", breaks.count() + 1)
    }

    fn error_at(
        &self,
        offset: usize,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        let offset = self.original_offset(offset);
        InputError::new(self.place, cause, remedy).with_byte_offset(self.original, offset)
    }

    fn malformed(&self, error: &roxmltree::Error) -> InputError {
        use roxmltree::Error;
        let (cause, remedy) = match error {
            Error::UnknownNamespace(prefix, _) => (
                format!("the prefix `{prefix}:` is declared nowhere"),
                format!("write xmlns:{prefix}=\"...\" into the outermost element"),
            ),
            Error::UnexpectedCloseTag(expected, actual, _) => (
                format!("</{actual}> closes <{expected}>"),
                format!("write </{expected}> here, or open <{actual}> before"),
            ),
            Error::UnclosedRootNode | Error::UnexpectedEndOfStream => {
                ("the XML ends in the middle".into(), "download the whole file again".into())
            }
            Error::NodesLimitReached => (
                format!("has more than {MAX_NODES} elements"),
                "check that this is the file".into(),
            ),
            Error::DtdDetected => {
                ("has a document type definition".into(), "remove the <!DOCTYPE ...>".into())
            }
            other => (format!("is not well-formed XML: {other}"), "correct the XML there".into()),
        };
        let offset = match error {
            Error::UnclosedRootNode | Error::UnexpectedEndOfStream => self.text.trim_end().len(),
            other => offset_of(&self.text, other.pos()),
        };
        self.error_at(offset, cause, remedy)
    }
}

/// Returns the byte after the name of the outermost element, where a declaration can be inserted.
fn root_name_end(text: &str) -> Option<usize> {
    let mut rest = text;
    loop {
        let end = if rest.starts_with("<?") {
            "?>"
        } else if rest.starts_with("<!--") {
            "-->"
        } else {
            break;
        };
        let (_, after) = rest.split_once(end)?;
        rest = after.trim_start();
    }
    let name = rest.strip_prefix('<')?;
    let length = name.find(is_name_end)?;
    Some(text.len() - name.len() + length)
}

/// Returns whether a character ends the name of an element in its tag.
fn is_name_end(c: char) -> bool {
    c.is_whitespace() || c == '>' || c == '/'
}

/// An XML file in memory, with its text, at which errors point.
pub(super) struct XmlFile<'a> {
    source: &'a XmlSource<'a>,
    document: Document<'a>,
}

impl<'a> XmlFile<'a> {
    /// Parses a text.
    pub(super) fn parse(source: &'a XmlSource<'a>) -> Result<Self, InputError> {
        let document = source.document().map_err(|error| source.malformed(&error))?;
        Ok(Self { source, document })
    }

    /// Returns the outermost element, which must be called `name`.
    pub(super) fn root(&self, name: &str) -> Result<Element<'_>, InputError> {
        let root = self.root_element();
        if root.name() == name {
            return Ok(root);
        }
        let cause = format!("the outermost element is <{}>, not <{name}>", root.name());
        Err(root.error(cause, "check that this is the right kind of file"))
    }

    fn root_element(&self) -> Element<'_> {
        Element { file: self, node: self.document.root_element() }
    }
}

/// Returns the byte offset of a position that is given by line and column, the column in
/// characters.
fn offset_of(text: &str, at: roxmltree::TextPos) -> usize {
    let mut lines = text.split_inclusive('\n');
    let before: usize = lines.by_ref().take(at.row as usize - 1).map(str::len).sum();
    let line = lines.next().unwrap_or("");
    before + line.chars().take(at.col as usize - 1).map(char::len_utf8).sum::<usize>()
}

/// An element of a file, which knows the file for its errors.
#[derive(Clone, Copy)]
pub(super) struct Element<'a> {
    file: &'a XmlFile<'a>,
    node: Node<'a, 'a>,
}

impl<'a> Element<'a> {
    pub(super) fn name(&self) -> &'a str {
        self.node.tag_name().name()
    }

    /// Returns the address of its namespace, if it has one.
    pub(super) fn namespace(&self) -> Option<&'a str> {
        self.node.tag_name().namespace()
    }

    /// Returns the prefix of its name as the file writes it. The parser keeps only what a prefix stands for, and with
    /// that, elements of a default namespace could not be told from those with a prefix.
    pub(super) fn prefix(&self) -> Option<&'a str> {
        let tag = &self.file.source.text[self.node.range().start + 1..];
        let name = tag.split(is_name_end).next()?;
        name.split_once(':').map(|(prefix, _)| prefix)
    }

    /// Returns whether it belongs to the format of the file: it has no prefix, or that of the outermost element.
    /// Elements with other prefixes are those of other programs.
    pub(super) fn is_of_format(&self) -> bool {
        let prefix = self.prefix();
        prefix.is_none() || prefix == self.file.root_element().prefix()
    }

    /// Returns the outermost element of its file.
    pub(super) fn root(&self) -> Element<'a> {
        self.file.root_element()
    }

    /// Returns the place of its tag, for reports.
    pub(super) fn line(&self) -> String {
        self.file.source.line(self.node.range().start)
    }

    /// Returns the text at its beginning, up to the first element in it.
    pub(super) fn text(&self) -> &'a str {
        self.node.text().unwrap_or_default()
    }

    /// Returns its direct children that are called `name`, without those of other programs.
    pub(super) fn children(self, name: &'a str) -> impl Iterator<Item = Element<'a>> {
        self.child_elements().filter(move |child| child.name() == name && child.is_of_format())
    }

    /// Returns all its direct children.
    pub(super) fn child_elements(self) -> impl Iterator<Item = Element<'a>> {
        let nodes = self.node.children().filter(Node::is_element);
        nodes.map(move |node| Element { node, ..self })
    }

    /// Returns itself and all elements in it, in the order of the file.
    pub(super) fn descendants(self) -> impl Iterator<Item = Element<'a>> {
        let nodes = self.node.descendants().filter(Node::is_element);
        nodes.map(move |node| Element { node, ..self })
    }

    /// Returns its first direct child that is none of another program.
    pub(super) fn first_child(self) -> Option<Element<'a>> {
        self.child_elements().find(Self::is_of_format)
    }

    /// Returns its direct child called `name`, if there is one.
    pub(super) fn child(self, name: &'a str) -> Result<Option<Element<'a>>, InputError> {
        let mut children = self.children(name);
        let first = children.next();
        match children.next() {
            None => Ok(first),
            Some(second) => {
                Err(second.error(format!("a second <{name}>"), format!("keep one <{name}>")))
            }
        }
    }

    /// Returns its direct child called `name`, which must exist.
    pub(super) fn required_child(self, name: &'a str) -> Result<Element<'a>, InputError> {
        self.child(name)?.ok_or_else(|| {
            let cause = format!("<{}> lacks <{name}>", self.description());
            self.error(cause, format!("add <{name} .../>"))
        })
    }

    /// Returns the value of an attribute, if it exists.
    pub(super) fn attribute(self, name: &str) -> Option<XmlAttribute<'a>> {
        self.node.attribute_node(name).map(|attribute| XmlAttribute { element: self, attribute })
    }

    /// Returns the value of an attribute that must exist and not be empty.
    pub(super) fn required(self, name: &str) -> Result<XmlAttribute<'a>, InputError> {
        let value = self.attribute(name).ok_or_else(|| {
            let cause = format!("<{}> has no `{name}`", self.description());
            self.error(cause, format!("write {name}=\"...\" into it"))
        })?;
        if value.text().is_empty() {
            return Err(value.error(format!("`{name}` is empty"), "write a name"));
        }
        Ok(value)
    }

    pub(super) fn attributes(self) -> impl Iterator<Item = XmlAttribute<'a>> {
        self.node.attributes().map(move |attribute| XmlAttribute { element: self, attribute })
    }

    pub(super) fn error(&self, cause: impl Into<String>, remedy: impl Into<String>) -> InputError {
        self.file.source.error_at(self.node.range().start, cause, remedy)
    }

    /// Returns the element's name, and the attribute that identifies it.
    fn description(&self) -> String {
        match self.node.attribute("name") {
            Some(name) => format!("{} name=\"{name}\"", self.name()),
            None => self.name().into(),
        }
    }
}

/// The value of an attribute, which knows its element for its errors.
#[derive(Clone, Copy)]
pub(super) struct XmlAttribute<'a> {
    element: Element<'a>,
    attribute: Attribute<'a, 'a>,
}

impl<'a> XmlAttribute<'a> {
    /// Returns its name without a prefix.
    pub(super) fn name(&self) -> &'a str {
        self.attribute.name()
    }

    /// Returns the text between the quotation marks, without blanks around it.
    pub(super) fn text(&self) -> &'a str {
        self.attribute.value().trim()
    }

    /// Reads one finite number.
    pub(super) fn number(&self) -> Result<f64, InputError> {
        self.parse_number(self.text())
    }

    /// Reads one number, which may be infinite: too large a one is read so as well.
    pub(super) fn extended_number(&self) -> Result<f64, InputError> {
        match f64::from_str(self.text()) {
            Ok(number) if !number.is_nan() => Ok(number),
            _ => self.number(),
        }
    }

    /// Reads three finite numbers between blanks.
    pub(super) fn triple(&self) -> Result<[f64; 3], InputError> {
        self.numbers("write three numbers between blanks, e.g. \"0 0 1\"")
    }

    /// Reads four finite numbers between blanks.
    pub(super) fn quadruple(&self) -> Result<[f64; 4], InputError> {
        self.numbers("write four numbers between blanks, e.g. \"0 0 0 1\"")
    }

    fn numbers<const N: usize>(&self, remedy: &str) -> Result<[f64; N], InputError> {
        let words = self.text().split_whitespace();
        let numbers: Result<Vec<_>, _> = words.map(|word| self.parse_number(word)).collect();
        numbers?.try_into().map_err(|numbers: Vec<f64>| {
            let name = self.attribute.name();
            let cause = format!("`{name}` has {} numbers, not {N}", numbers.len());
            self.error(cause, remedy)
        })
    }

    /// Returns the place of its element's tag, for reports.
    pub(super) fn line(&self) -> String {
        self.element.line()
    }

    fn parse_number(&self, word: &str) -> Result<f64, InputError> {
        let number = f64::from_str(word).ok().filter(|number| number.is_finite());
        number.ok_or_else(|| {
            let cause = format!("`{word}` is no finite number");
            self.error(cause, "write a number such as 0.5 or -1e-3")
        })
    }

    pub(super) fn error(&self, cause: impl Into<String>, remedy: impl Into<String>) -> InputError {
        let offset = self.attribute.range_value().start;
        self.element.file.source.error_at(offset, cause, remedy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(text: &str) -> InputError {
        XmlSource::new("f.xml", text).err().expect("an error")
    }

    #[test]
    fn malformed_xml_is_pointed_at() {
        let error = error_of("<a>\n  <b></c>\n</a>");
        assert_eq!(error.line_and_column(), Some((2, 6)), "{error}");
        assert!(error.cause().contains("</c> closes <b>"), "{error}");
        assert_eq!(error_of("<a>\n<b>").line_and_column(), Some((2, 4)));
        for text in ["", "<", "<a", "no xml", "<!DOCTYPE a><a/>", "<a b=\"1\" b=\"2\"/>"] {
            assert!(!error_of(text).remedy().is_empty());
        }
    }

    #[test]
    fn values_are_read_and_wrong_ones_pointed_at() {
        let text = "<a n=' 1.5 ' t='0 0. 1e-3' w='1 x 2' i='inf'/>";
        let source = XmlSource::new("f.xml", text).expect("XML");
        let file = XmlFile::parse(&source).expect("XML");
        let a = file.root("a").expect("a");
        assert_eq!(a.required("n").and_then(|v| v.number()), Ok(1.5));
        assert_eq!(a.required("t").and_then(|v| v.triple()), Ok([0.0, 0.0, 1e-3]));
        let wrong = a.required("w").and_then(|v| v.triple()).expect_err("no number");
        assert_eq!(wrong.line_and_column(), Some((1, 31)), "{wrong}");
        assert!(a.required("i").and_then(|v| v.number()).is_err());
        assert!(a.required("n").and_then(|v| v.triple()).is_err());
        assert!(a.required("missing").is_err());
        assert!(file.root("b").is_err());
    }

    #[test]
    fn a_prefix_that_is_declared_nowhere_moves_no_position() {
        let text = "<?xml version='1.0'?><!-- <x> --><a n='1'>\n<x:b/><y:c x:d='2'/><e f='?'/></a>";
        let source = XmlSource::new("f.xml", text).expect("XML");
        let known: Vec<_> =
            source.undeclared.iter().map(|u| (u.prefix.as_str(), u.place.as_str())).collect();
        assert_eq!(known, [("x", "line 2"), ("y", "line 2")]);
        let file = XmlFile::parse(&source).expect("XML");
        let a = file.root("a").expect("a");
        let prefixes: Vec<_> = a.child_elements().map(|child| child.prefix()).collect();
        assert_eq!(prefixes, [Some("x"), Some("y"), None]);
        let value = a.required("n").expect("n");
        assert_eq!(value.error("c", "r").line_and_column(), Some((1, 40)));
        let wrong = a.required_child("e").and_then(|e| e.required("f")?.number()).expect_err("?");
        assert_eq!(wrong.line_and_column(), Some((2, 27)), "{wrong}");
        // What declaring does not help is an error as before.
        assert_eq!(error_of("<a>\n<x:b></x:c></a>").line_and_column(), Some((2, 6)));
        let many: String = (0..40).map(|k| format!("<p{k}:b/>")).collect();
        assert!(error_of(&format!("<a>{many}</a>")).remedy().contains("xmlns:p"));
    }

    #[test]
    fn what_editors_leave_before_the_first_line_changes_nothing() {
        let text = "<?xml version='1.0' encoding='UTF-16'?>\n<a n='x'/>";
        for before in ["\u{feff}", "\u{feff}\u{feff}", "\n", " \r\n\u{feff}"] {
            let lines = before.matches('\n').count();
            let text = format!("{before}{text}");
            let source = XmlSource::new("f.xml", &text).expect("XML");
            let file = XmlFile::parse(&source).expect("XML");
            let a = file.root("a").expect("a");
            let error = a.required("n").and_then(|n| n.number()).expect_err("no number");
            assert_eq!(error.line_and_column(), Some((2 + lines, 7)), "{error}");
            assert_eq!(a.line(), format!("line {}", 2 + lines));
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("f.xml");
        let units: Vec<u16> = format!("\u{feff}{text}").encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for bytes in [little, big, text.as_bytes().to_vec()] {
            std::fs::write(&path, bytes).expect("written");
            assert_eq!(read_xml_text(&path, 1 << 10).as_deref(), Ok(text));
        }
        std::fs::write(&path, [0xff, 0xfe, 0x00, 0xd8]).expect("written");
        assert!(read_xml_text(&path, 1 << 10).is_err());
        assert!(read_xml_text(&path, 3).is_err());
    }

    #[test]
    fn elements_in_each_other_are_limited() {
        let nested = |n: usize| format!("<robot>\n{}{}</robot>", "<a>".repeat(n), "</a>".repeat(n));
        assert!(XmlSource::new("a.urdf", &nested(MAX_DEPTH - 1)).is_ok());
        let error = XmlSource::new("a.urdf", &nested(20_000)).err().expect("too deep");
        assert!(error.cause().contains("more than 256 deep"), "{error}");
        assert_eq!(error.line_and_column().map(|(line, _)| line), Some(2));
    }

    #[test]
    fn a_default_namespace_and_the_prefix_of_the_outermost_element_are_the_format() {
        for text in [
            "<a xmlns='http://x'><b/><o:b xmlns:o='http://x'/></a>",
            "<p:a xmlns:p='http://x'><p:b/></p:a>",
            "<p:a><p:b/></p:a>",
            "<p:a xmlns:p='http://x'><b/><o:b xmlns:o='http://y'/></p:a>",
        ] {
            let source = XmlSource::new("f.xml", text).expect("XML");
            let file = XmlFile::parse(&source).expect("XML");
            assert_eq!(file.root("a").expect("a").children("b").count(), 1, "{text}");
        }
    }
}
