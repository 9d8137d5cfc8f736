//! Rendering of a page from its template.

use crate::Result;
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

/// Renders a page; every value is escaped for HTML unless the template marks it as safe.
///
/// # Errors
/// A template that cannot be filled with the page.
pub fn render(name: &str, template: &str, page: &impl Serialize) -> Result<String> {
    let rendered = || {
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
        environment.add_template(name, template)?;
        environment.get_template(name)?.render(Serde(page))
    };
    Ok(rendered().map_err(softdock_analysis::AnalysisError::from)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn values_are_escaped_whatever_the_name_of_the_template() {
        let page = BTreeMap::from([("title", "<script>x</script>")]);
        for name in ["page.html", "page", "page.txt"] {
            assert_eq!(render(name, "{{ title }}", &page).unwrap(), "&lt;script&gt;x&lt;&#x2f;script&gt;", "{name}");
        }
    }
}
