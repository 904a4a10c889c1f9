//! The page of a replay: the files of the studio's page, and the parts, in one document that loads nothing.

use super::parts::compress;
use crate::page::EntryFiles;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

/// The script that starts the page: it unpacks the page's own.
const START: &str = include_str!("start.js");

/// Returns the document; `parts` is text of base64 and line breaks.
pub(super) fn document(title: &str, files: &EntryFiles, parts: &str) -> String {
    let EntryFiles { script, style, icon } = files;
    // A policy by digests: of all that a document can hold, only these two scripts and this style have an effect.
    let policy = format!(
        "default-src 'none'; script-src {} {}; style-src {}; img-src data: blob:; base-uri 'none'; \
         form-action 'none'",
        source_of(START),
        source_of(script),
        source_of(style)
    );
    let title = escape(title);
    let icon = STANDARD.encode(icon);
    let code = compress(script.as_bytes());
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<meta name=\"referrer\" content=\"no-referrer\">\n\
         <title>{title}</title>\n<link rel=\"icon\" href=\"data:image/svg+xml;base64,{icon}\">\n\
         <style>{style}</style>\n</head>\n<body>\n<div id=\"app\"></div>\n\
         <noscript>This is a recorded run of Sidestep. To show it, the browser has to run its scripts.</noscript>\n\
         <script type=\"text/plain\" id=\"page-code\">{code}</script>\n\
         <script type=\"text/plain\" id=\"replay\">{parts}</script>\n\
         <script>{START}</script>\n</body>\n</html>\n"
    )
}

/// Returns the source of a policy that allows one text.
fn source_of(text: &str) -> String {
    format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text)))
}

/// Returns text that is safe in an element and in an attribute.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(script: &str) -> EntryFiles<'_> {
        EntryFiles { script, style: "p { margin: 0 }", icon: b"<svg/>" }
    }

    #[test]
    fn nothing_of_a_name_or_of_code_ends_an_element() {
        let title = "</title><script>alert(1)</script><p onclick='x' id=\"y\">&amp;";
        let text = document(title, &files("let a = '</script><script>alert(2)</script>';"), "AA==");
        assert_eq!(text.matches("<script").count(), 3);
        assert_eq!(text.matches("</script>").count(), 3);
        assert!(!text.contains("alert") || text.contains("&lt;script&gt;alert(1)&lt;/script&gt;"));
        assert!(!text.contains("alert(2)") && !text.contains("<p "));
    }

    #[test]
    fn the_policy_allows_no_network_and_no_other_script() {
        let text = document("a", &files("1;"), "AA==");
        let (_, after) = text.split_once("Content-Security-Policy\" content=\"").expect("a policy");
        let (policy, _) = after.split_once('"').expect("its end");
        assert!(policy.starts_with("default-src 'none'; script-src 'sha256-"), "{policy}");
        assert!(!policy.contains("unsafe") && !policy.contains("http") && !policy.contains('*'));
        assert!(
            policy.contains(&source_of("1;"))
                && !text.contains("http://")
                && !text.contains("https://")
        );
        assert!(text.find("Content-Security-Policy") < text.find("<style>"));
    }
}
