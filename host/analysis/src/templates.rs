//! Style sheet and templates of the pages.

use minijinja::syntax::SyntaxConfig;
use minijinja::{AutoEscape, Environment};

use crate::Result;
use crate::causes::{cause_text, cause_unit};
use crate::exact::Interval;
use crate::number::{digits_of, grouped, interval, percent, unit_text, with_unit};

/// The style sheet of every page, to stand inside it.
pub const STYLE: &str = include_str!("page/style.css");

/// The script of the results page, to stand inside it: `host/analysis/page` has its sources.
pub(crate) const APP: &str = include_str!("page/app.js");

/// SHA-256 of [`APP`] in base64, by which the page's content security policy admits the script and no other.
pub(crate) const APP_HASH: &str = include_str!("page/app.sha256");

/// The pages' templates with what they may call.
pub(crate) fn environment() -> Result<Environment<'static>> {
    let mut page = Environment::new();
    page.set_auto_escape_callback(|_| AutoEscape::Html);
    page.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    page.add_filter("grouped", grouped);
    page.add_filter("percent", percent);
    page.add_filter("sig", digits_of);
    page.add_filter("cause_text", |id: String, limit: Option<f64>| cause_text(&id, limit));
    page.add_filter("cause_unit", |id: String| cause_unit(&id));
    page.add_filter("unit_text", |unit: String| unit_text(&unit));
    page.add_filter("unit", |value: f64, unit: String| with_unit(value, &unit));
    page.add_filter("interval", |lo: f64, hi: f64, confidence: f64| {
        interval(&Interval { lo, hi, confidence }).replace(" %", "\u{a0}%")
    });
    page.add_template("report.html", include_str!("page/report.html"))?;
    page.add_template("compare.html", include_str!("page/compare.html"))?;
    Ok(page)
}
