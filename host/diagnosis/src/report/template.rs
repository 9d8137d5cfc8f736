//! Rendering of a page from its template.

use crate::Result;
use minijinja::Environment;
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use serde::Serialize;

/// Renders a page; values are escaped if `name` ends in `.html`.
///
/// # Errors
/// A template that cannot be filled with the page.
pub fn render(name: &str, template: &str, page: &impl Serialize) -> Result<String> {
    let rendered = || {
        let mut environment = Environment::new();
        environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
        environment.add_template(name, template)?;
        environment.get_template(name)?.render(Serde(page))
    };
    Ok(rendered().map_err(softdock_analysis::AnalysisError::from)?)
}
