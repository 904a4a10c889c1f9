//! The script that draws figures: plotly.js, as the crate `plotly` carries it.

use std::sync::LazyLock;

/// The text of plotly.js. The crate gives it as a script element before one of MathJax, of which
/// a report has no use.
pub(super) static SCRIPT: LazyLock<String> = LazyLock::new(|| {
    let elements = plotly::Plot::offline_js_sources();
    let inside = elements.split_once('>').map_or("", |(_, rest)| rest);
    inside.split_once("</script>").map_or("", |(script, _)| script).into()
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_is_plotly_and_nothing_else() {
        let head = &SCRIPT[..SCRIPT.len().min(200)];
        assert!(head.contains("plotly.js v3") && head.contains("MIT"), "{head}");
        assert!(!SCRIPT.contains("MathJax.loader") && !SCRIPT.contains("<!--"));
        assert!(SCRIPT.len() > 1_000_000 && SCRIPT.len() < 5_000_000, "{}", SCRIPT.len());
    }
}
