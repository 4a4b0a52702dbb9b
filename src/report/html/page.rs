//! The page around the body.

use super::HtmlReport;
use super::escape::{html, prose};

const STYLE: &str = include_str!("page/page.css");
const LIBRARY: &str = include_str!("vendor/echarts.min.js");
/// Our own script, in the order that its parts need one another.
const SCRIPT: [&str; 10] = [
    include_str!("page/base.js"),
    include_str!("page/map.js"),
    include_str!("page/lap.js"),
    include_str!("page/curves.js"),
    include_str!("page/front.js"),
    include_str!("page/bars.js"),
    include_str!("page/surface.js"),
    include_str!("page/heat.js"),
    include_str!("page/units.js"),
    include_str!("page/start.js"),
];
/// Nothing may be loaded from anywhere; what the page needs stands in it.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; \
                      base-uri 'none'; form-action 'none'";

pub fn assemble(report: &HtmlReport, data: &str) -> String {
    let mut page = String::with_capacity(LIBRARY.len() + data.len() + 100_000);
    page += "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
    page += &format!("<meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n");
    page += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
    page += "<meta name=\"color-scheme\" content=\"light dark\">\n";
    page += &format!("<title>{} \u{2013} lapswarm</title>\n", html(&report.title));
    page += &format!("<style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n");
    page += &format!(
        "<p class=\"study\">lapswarm {}</p>\n<h1>{}</h1>\n</header>\n<main>\n",
        html(&report.study),
        html(&report.title)
    );
    page += &summary(report);
    page += "<noscript><p class=\"warning\">The charts need JavaScript; words and tables do not.</p></noscript>\n";
    body(report, &mut page);
    page += &origin(report);
    page += "</main>\n<footer>Charts by <a href=\"https://echarts.apache.org\">Apache ECharts</a>, Apache License \
             2.0, \u{a9} The Apache Software Foundation.</footer>\n";
    page += &format!("<script type=\"application/json\" id=\"charts\">{data}</script>\n");
    page += &format!("<script>\n{LIBRARY}\n</script>\n<script>\n\"use strict\";\n(() => {{\n");
    for part in SCRIPT {
        page += part;
    }
    page += "})();\n</script>\n</body>\n</html>\n";
    page
}

/// Two narrow figures stand beside each other; the last of an odd number takes the whole width.
fn body(report: &HtmlReport, page: &mut String) {
    let mut blocks = report.body.iter().peekable();
    let mut beside = false;
    while let Some(block) = blocks.next() {
        let another = beside || blocks.peek().is_some_and(|next| next.half);
        beside = block.half && another && !beside;
        let class = if block.half && another {
            " class=\"half\""
        } else {
            ""
        };
        *page += &block.html.replacen("<figure>", &format!("<figure{class}>"), 1);
    }
}

fn summary(report: &HtmlReport) -> String {
    let mut text = String::from("<section class=\"summary\">\n");
    for sentence in &report.sentences {
        text += &format!("<p>{}</p>\n", prose(sentence));
    }
    if !report.tiles.is_empty() {
        text += "<dl class=\"tiles\">\n";
        for [label, value, unit] in &report.tiles {
            let unit = match unit.as_str() {
                "" => String::new(),
                unit => format!(" <span class=\"unit\">{}</span>", html(unit)),
            };
            text += &format!(
                "<div><dt>{}</dt><dd>{}{unit}</dd></div>\n",
                html(label),
                html(value)
            );
        }
        text += "</dl>\n";
    }
    for warning in &report.warnings {
        text += &format!("<p class=\"warning\">{}</p>\n", prose(warning));
    }
    text += "</section>\n";
    let contents = report.sections.iter().enumerate();
    let links: Vec<String> = contents
        .map(|(i, title)| format!("<a href=\"#section-{i}\">{}</a>", html(title)))
        .chain([String::from("<a href=\"#origin\">Settings and provenance</a>")])
        .collect();
    text + &format!("<nav>{}</nav>\n", links.join("\n"))
}

fn origin(report: &HtmlReport) -> String {
    let mut text = String::from("<h2 id=\"origin\">Settings and provenance</h2>\n<dl class=\"origin\">\n");
    let program = ["program", concat!("lapswarm ", env!("CARGO_PKG_VERSION"))].map(str::to_owned);
    for [what, value] in std::iter::once(&program).chain(&report.provenance) {
        text += &format!("<dt>{}</dt><dd>{}</dd>\n", html(what), html(value));
    }
    text += "</dl>\n";
    for [name, contents] in &report.settings {
        let (name, contents) = (html(name), html(contents));
        text += &format!("<details><summary>{name}</summary><pre>{contents}</pre></details>\n");
    }
    text
}
