//! How does a formula reach the page? TeX becomes MathML Core, which browsers set with the book's own font.

use super::text::shield;
use math_core::{LatexToMathML, MathCoreConfig, MathDisplay};

/// The converter with the book's macros.
pub(super) struct Mathematics(LatexToMathML);

/// Names of the literature: vectors and matrices upright and bold are avoided, so that `K`, `R`, `t` look as
/// in the code.
const MACROS: [(&str, &str); 3] =
    [("T", r"\mathsf{T}"), ("norm", r"\lVert #1 \rVert"), ("unit", r"\,\mathrm{#1}")];

impl Mathematics {
    pub(super) fn new() -> Mathematics {
        let macros = MACROS.iter().map(|(name, body)| (name.to_string(), body.to_string())).collect();
        let config = MathCoreConfig { macros, annotation: true, ..MathCoreConfig::default() };
        Mathematics(LatexToMathML::new(config).expect("the book's macros are well formed"))
    }

    /// MathML for a formula in a line.
    pub(super) fn inline(&self, tex: &str) -> Result<String, String> {
        self.convert(tex, MathDisplay::Inline)
    }

    /// MathML for an equation.
    pub(super) fn display(&self, tex: &str) -> Result<String, String> {
        self.convert(tex, MathDisplay::Block)
    }

    fn convert(&self, tex: &str, display: MathDisplay) -> Result<String, String> {
        let converted = self.0.convert_with_local_state(tex, display);
        converted.map(|c| shield(&c.mathml)).map_err(|e| format!("formula `{tex}`: {e:?}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tex_becomes_mathml_that_markdown_leaves_alone() {
        let mathematics = Mathematics::new();
        let html = mathematics.display(r"\norm{m - \hat m}^2 * x_{1}").unwrap();
        assert!(html.contains("<math") && html.contains("</math>"), "{html}");
        assert!(!html.contains('*') && !html.contains('_') && !html.contains('\n'), "{html}");
        assert!(mathematics.inline(r"\nosuchcommand").is_err());
    }
}
