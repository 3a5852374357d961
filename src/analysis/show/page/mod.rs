//! Reports as one HTML file, which opens without a network.
//!
//! Text and tables stand in the file as HTML. Pictures are data in a JSON block, which the page's own script
//! draws, magnifies and links. A content security policy allows that script and that style sheet by their
//! hashes and nothing else: no other script, no request. Everything that comes from files is escaped. The
//! same report gives the same bytes. Limits: without JavaScript there are no pictures.

mod data;
mod encode;
mod items;
pub mod live;
#[cfg(test)]
mod tests;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::show::document::{Item, Report};
use crate::show::plot::ZOOMED;
use crate::show::plot::chart::Scale;
use crate::show::plot::sketch::{Figure, Sketch};
use data::Data;
use encode::{escaped, inert};
use items::Writer;
use live::LivePage;

/// Draws the plots and filters the tables.
const SCRIPT: &str = include_str!("../../assets/page.js");
/// Look of the page, on paper too.
const STYLE: &str = include_str!("../../assets/page.css");

/// Use of the plots, and choice of their points.
const HELP: &str = "Click a plot or tab to it, then turn the wheel, or hold Ctrl and turn the wheel anywhere: the plot \
                    is magnified, with Shift its vertical axis. Drag to magnify a part, drag with Shift to move, \
                    double click to reset. Keys: arrows move, + and − magnify, F fits the vertical axis, comma and \
                    full stop step through the values, 0 resets. The axes of time move together. Points: in Over time \
                    a series of more than 1000 keeps the least and the greatest of each run of neighbours, and so do \
                    lines elsewhere. Other clouds of points are thinned evenly, to 4000 in a plot. Values are rounded \
                    to 1/65 535 of their range.";

/// Heading of the chapter with plots over time.
const OVER_TIME: &str = "Over time";

/// Items under one heading.
struct Chapter<'r> {
    title: &'r str,
    items: Vec<&'r Item>,
}

impl Report {
    /// The report as an HTML file.
    pub fn html(&self) -> String {
        self.page(&[SCRIPT], "").0
    }

    /// The report as a page that its server fills by the script of a live page.
    pub(crate) fn live(&self) -> LivePage {
        let (html, policy) = self.page(&[SCRIPT, live::SCRIPT], " connect-src 'self';");
        LivePage { html, policy }
    }

    /// The page with these scripts, and its content security policy with one more rule.
    fn page(&self, scripts: &[&str], rule: &str) -> (String, String) {
        let mut data = Data::default();
        let (overview, chapters) = self.chapters();
        let is_of_figures = |chapter: &&Chapter<'_>| {
            let all = chapter.items.iter().all(|item| matches!(item, Item::Figure(_) | Item::Note(_)));
            all && chapter.items.iter().any(|item| matches!(item, Item::Figure(_)))
        };
        let (plots, words): (Vec<&Chapter<'_>>, Vec<&Chapter<'_>>) = chapters.iter().partition(is_of_figures);
        let mut body = Writer::new(&mut data);
        body.section("Overview", &overview);
        if !plots.is_empty() {
            body.push("<div id=\"plots\">");
            plots.iter().for_each(|chapter| body.section(chapter.title, &chapter.items));
            body.push("</div>");
        }
        words.iter().for_each(|chapter| body.section(chapter.title, &chapter.items));
        let body = body.finish();
        let titles = ["Overview"].into_iter().chain(plots.iter().chain(&words).map(|chapter| chapter.title));
        let hashes: String = scripts.iter().map(|script| format!(" 'sha256-{}'", hash(script))).collect();
        let policy = format!(
            "default-src 'none'; script-src{hashes}; style-src 'sha256-{}';{rule} base-uri 'none'; form-action 'none'",
            hash(STYLE)
        );
        let scripts: String = scripts.iter().map(|script| format!("<script>{script}</script>\n")).collect();
        (self.file(titles, &body, &data.json(), (&policy, &scripts)), policy)
    }

    /// Items before the first heading, and chapters. Pictures over time get a chapter of their own.
    fn chapters(&self) -> (Vec<&Item>, Vec<Chapter<'_>>) {
        let (mut overview, mut chapters): (Vec<&Item>, Vec<Chapter<'_>>) = (Vec::new(), Vec::new());
        let mut over_time: Vec<&Item> = Vec::new();
        for item in &self.items {
            match (item, chapters.last_mut()) {
                (Item::NewPage, _) => {}
                (Item::Heading(title), _) => chapters.push(Chapter { title, items: Vec::new() }),
                (Item::Figure(figure), Some(_)) if is_over_time(figure) => over_time.push(item),
                (_, Some(chapter)) => chapter.items.push(item),
                (_, None) => overview.push(item),
            }
        }
        let rank = |item: &&Item| match item {
            Item::Figure(figure) => ZOOMED.iter().position(|name| *name == figure.name),
            _ => None,
        };
        over_time.sort_by_key(|item| rank(item).unwrap_or(ZOOMED.len()));
        chapters.insert(0, Chapter { title: OVER_TIME, items: over_time });
        chapters.retain(|chapter| !chapter.items.is_empty());
        (overview, chapters)
    }

    fn file<'t>(
        &self,
        titles: impl Iterator<Item = &'t str>,
        body: &str,
        data: &str,
        (policy, scripts): (&str, &str),
    ) -> String {
        let link = |title: &str| format!("<a href=\"#{}\">{}</a>\n", items::anchor(title), escaped(title));
        let links: String = titles.map(link).collect();
        let (title, subtitle, head) = (escaped(&self.title), escaped(&self.subtitle), escaped(&self.head));
        let program = concat!("gnss-twin ", env!("CARGO_PKG_VERSION"));
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta \
             http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n<meta name=\"viewport\" \
             content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light \
             dark\">\n<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n\
             <p class=\"subtitle\">{subtitle}</p>\n<p class=\"head\">{head} · {program}</p>\n</header>\n<nav \
             aria-label=\"Chapters\">\n{links}</nav>\n<main>\n<noscript><p class=\"banner caution\">Pictures and \
             filters need JavaScript.</p></noscript>\n{body}</main>\n<p id=\"help\" hidden>{HELP}</p>\n\
             <p id=\"readout\" \
             class=\"unseen\" aria-live=\"polite\"></p>\n<script type=\"application/json\" \
             id=\"data\">{}</script>\n{scripts}</body>\n</html>\n",
            inert(data)
        )
    }
}

/// True if all charts of a figure are over time in seconds.
fn is_over_time(figure: &Figure) -> bool {
    let Sketch::Charts { charts, .. } = &figure.sketch else { return false };
    charts.iter().all(|chart| chart.x.label.ends_with("(s)") && matches!(chart.x.scale, Scale::Linear))
}

/// Hash of an element's text, as a content security policy names it.
fn hash(text: &str) -> String {
    use sha2::Digest;
    STANDARD.encode(sha2::Sha256::digest(text.as_bytes()))
}
