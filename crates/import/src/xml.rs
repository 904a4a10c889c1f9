//! The common parts of XML readers. Every error has its position in the file.

use std::str::FromStr;

use roxmltree::{Attribute, Document, Node, ParsingOptions};
use sidestep_kernel::InputError;

/// The maximum number of elements, comments and pieces of text in one file.
const MAX_NODES: u32 = 1 << 20;

/// An XML file in memory, with its text, at which errors point.
pub(super) struct XmlFile<'a> {
    place: &'a str,
    text: &'a str,
    document: Document<'a>,
}

impl<'a> XmlFile<'a> {
    /// Parses `text`; `place` is its name in errors.
    pub(super) fn parse(place: &'a str, text: &'a str) -> Result<Self, InputError> {
        let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options)
            .map_err(|error| malformed(place, text, &error))?;
        Ok(Self { place, text, document })
    }

    /// Returns the outermost element, which must be called `name`.
    pub(super) fn root(&self, name: &str) -> Result<Element<'_>, InputError> {
        let root = Element { file: self, node: self.document.root_element() };
        if root.name() == name {
            return Ok(root);
        }
        let cause = format!("the outermost element is <{}>, not <{name}>", root.name());
        Err(root.error(cause, "check that this is the right kind of file"))
    }

    pub(super) fn elements(&self) -> impl Iterator<Item = Element<'_>> {
        let nodes = self.document.descendants().filter(Node::is_element);
        nodes.map(|node| Element { file: self, node })
    }
}

fn malformed(place: &str, text: &str, error: &roxmltree::Error) -> InputError {
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
        Error::NodesLimitReached => {
            (format!("has more than {MAX_NODES} elements"), "check that this is the file".into())
        }
        Error::DtdDetected => {
            ("has a document type definition".into(), "remove the <!DOCTYPE ...>".into())
        }
        other => (format!("is not well-formed XML: {other}"), "correct the XML there".into()),
    };
    let offset = match error {
        Error::UnclosedRootNode | Error::UnexpectedEndOfStream => text.trim_end().len(),
        other => offset_of(text, other.pos()),
    };
    InputError::new(place, cause, remedy).with_byte_offset(text, offset)
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

    /// Returns the namespace that its prefix stands for, if it has a prefix.
    pub(super) fn namespace(&self) -> Option<&'a str> {
        self.node.tag_name().namespace()
    }

    /// Returns its direct children that are called `name` and have no prefix.
    pub(super) fn children(self, name: &'a str) -> impl Iterator<Item = Element<'a>> {
        let nodes = self.node.children().filter(move |n| {
            n.is_element() && n.tag_name().name() == name && n.tag_name().namespace().is_none()
        });
        nodes.map(move |node| Element { node, ..self })
    }

    /// Returns its first direct child that has no prefix.
    pub(super) fn first_child(self) -> Option<Element<'a>> {
        let mut nodes = self.node.children();
        let node = nodes.find(|n| n.is_element() && n.tag_name().namespace().is_none())?;
        Some(Element { node, ..self })
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
        let offset = self.node.range().start;
        InputError::new(self.file.place, cause, remedy).with_byte_offset(self.file.text, offset)
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
    /// Returns the text between the quotation marks, without blanks around it.
    pub(super) fn text(&self) -> &'a str {
        self.attribute.value().trim()
    }

    /// Reads one finite number.
    pub(super) fn number(&self) -> Result<f64, InputError> {
        self.parse_number(self.text())
    }

    /// Reads three finite numbers between blanks.
    pub(super) fn triple(&self) -> Result<[f64; 3], InputError> {
        let numbers: Result<Vec<_>, _> =
            self.text().split_whitespace().map(|word| self.parse_number(word)).collect();
        numbers?.try_into().map_err(|numbers: Vec<f64>| {
            let cause = format!("`{}` has {} numbers, not 3", self.attribute.name(), numbers.len());
            self.error(cause, "write three numbers between blanks, e.g. \"0 0 1\"")
        })
    }

    fn parse_number(&self, word: &str) -> Result<f64, InputError> {
        let number = f64::from_str(word).ok().filter(|number| number.is_finite());
        number.ok_or_else(|| {
            let cause = format!("`{word}` is no finite number");
            self.error(cause, "write a number such as 0.5 or -1e-3")
        })
    }

    pub(super) fn error(&self, cause: impl Into<String>, remedy: impl Into<String>) -> InputError {
        let file = self.element.file;
        let offset = self.attribute.range_value().start;
        InputError::new(file.place, cause, remedy).with_byte_offset(file.text, offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(text: &str) -> InputError {
        XmlFile::parse("f.xml", text).err().expect("an error")
    }

    #[test]
    fn malformed_xml_is_pointed_at() {
        let error = error_of("<a>\n  <b></c>\n</a>");
        assert_eq!(error.line_and_column(), Some((2, 6)), "{error}");
        assert!(error.cause().contains("</c> closes <b>"), "{error}");
        assert_eq!(error_of("<a>\n<b>").line_and_column(), Some((2, 4)));
        assert!(error_of("<a><x:b/></a>").remedy().contains("xmlns:x"));
        for text in ["", "<", "<a", "no xml", "<!DOCTYPE a><a/>", "<a b=\"1\" b=\"2\"/>"] {
            assert!(!error_of(text).remedy().is_empty());
        }
    }

    #[test]
    fn values_are_read_and_wrong_ones_pointed_at() {
        let file = XmlFile::parse("f.xml", "<a n=' 1.5 ' t='0 0. 1e-3' w='1 x 2' i='inf'/>");
        let file = file.expect("XML");
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
}
