//! Style sheet, shell and templates of the pages.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

use crate::Result;
use crate::causes::{cause_text, cause_unit};
use crate::exact::Interval;
use crate::number::{digits_of, grouped, interval, percent, unit_text, with_unit};

/// The style sheet of every page, to stand inside it.
pub const STYLE: &str = include_str!("page/style.css");

/// A script that stands inside a page; `host/analysis/page` has its sources.
#[derive(Clone, Copy)]
pub(crate) struct Script {
    text: &'static str,
    /// SHA-256 in base64, by which the page's content security policy admits the script and no other.
    hash: &'static str,
}

/// The script of the results page.
pub(crate) const APP: Script = Script { text: include_str!("page/app.js"), hash: include_str!("page/app.sha256") };

/// The script of the other pages: contents list, colours, saved figures.
const SHELL: Script = Script { text: include_str!("page/shell.js"), hash: include_str!("page/shell.sha256") };

/// What made a page.
#[derive(Clone, Copy, Debug, Default)]
pub struct PageOrigin<'a> {
    /// Version of softdock.
    pub version: &'a str,
    /// Commit that it was built from.
    pub commit: &'a str,
    /// Command line that makes the page again; empty where the page lists its own commands.
    pub command: &'a str,
}

/// Renders a page, whose template extends `shell.html`. Every value is escaped for HTML unless the template marks it as
/// safe.
///
/// # Errors
/// A template that cannot be filled with the page.
pub fn render_page(name: &str, template: &str, origin: &PageOrigin, page: &impl Serialize) -> Result<String> {
    render_with(SHELL, name, template, origin, page)
}

/// Renders a page with a script.
pub(crate) fn render_with(
    script: Script,
    name: &str,
    template: &str,
    origin: &PageOrigin,
    page: &impl Serialize,
) -> Result<String> {
    let mut shell = Environment::new();
    shell.set_auto_escape_callback(|_| AutoEscape::Html);
    shell.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    shell.add_filter("grouped", grouped);
    shell.add_filter("percent", percent);
    shell.add_filter("sig", digits_of);
    shell.add_filter("cause_text", |id: String, limit: Option<f64>| cause_text(&id, limit));
    shell.add_filter("cause_unit", |id: String| cause_unit(&id));
    shell.add_filter("unit_text", |unit: String| unit_text(&unit));
    shell.add_filter("unit", |value: f64, unit: String| with_unit(value, &unit));
    shell.add_filter("interval", |lo: f64, hi: f64, confidence: f64| {
        interval(&Interval { lo, hi, confidence }).replace(" %", "\u{a0}%")
    });
    for (name, value) in [
        ("style", STYLE),
        ("script", script.text),
        ("script_hash", script.hash.trim_ascii_end()),
        ("version", origin.version),
        ("commit", origin.commit),
        ("command", origin.command),
    ] {
        shell.add_global(name, value);
    }
    shell.add_template("shell.html", include_str!("page/shell.html"))?;
    shell.add_template(name, template)?;
    Ok(shell.get_template(name)?.render(Serde(page))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    const ORIGIN: PageOrigin = PageOrigin { version: "1", commit: "<b>0123456789ab</b>", command: "softdock '<i>'" };

    #[test]
    fn values_are_escaped_whatever_the_name_of_the_template() {
        let page = BTreeMap::from([("title", "<script>x</script>")]);
        for name in ["page.html", "page", "page.txt"] {
            let text = render_page(name, "{{ title }}", &ORIGIN, &page).unwrap();
            assert_eq!(text, "&lt;script&gt;x&lt;&#x2f;script&gt;", "{name}");
        }
    }

    /// The same dark colours by the system's scheme and by the reader's choice.
    #[test]
    fn dark_colours_are_the_same_in_both_places() {
        let blocks: Vec<&str> = STYLE
            .split('}')
            .filter(|block| block.contains("--dark: 1"))
            .filter_map(|block| block.rsplit_once('{'))
            .map(|(_, colours)| colours)
            .collect();
        assert_eq!(blocks.len(), 2);
        let lines = |block: &str| block.lines().map(str::trim).map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(lines(blocks[0]), lines(blocks[1]));
    }

    #[test]
    fn shell_states_what_made_the_page() {
        let page = BTreeMap::from([("title", "a title")]);
        let template = "{% extends \"shell.html\" %}{% block header %}<h1>{{ title }}</h1>{% endblock %}";
        let text = render_page("page.html", template, &ORIGIN, &page).unwrap();
        let commit = "commit <code>&lt;b&gt;012345678</code>";
        for part in ["<h1>a title</h1>", "softdock 1, ", commit, "softdock &#x27;&lt;i&gt;&#x27;", SHELL.hash.trim()] {
            assert!(text.contains(part), "{part}");
        }
    }
}
