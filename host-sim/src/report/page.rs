//! The page.

use std::fmt::Write;
use std::path::Path;

use plotters::style::RGBColor;

use super::figure::{Figure, Mark, Shape};
use crate::output_file;

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1a1a1a;--soft:#444;--paper:#fff;--line:#ddd;--shade:rgba(0,0,0,.28)}\
body{font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:52rem;margin:0 auto;padding:1rem}\
h1{font-size:1.6rem;line-height:1.2}h2{font-size:1.2rem;margin-top:2.2rem;border-bottom:1px solid var(--line)}\
h2.part{font-size:1.4rem;border-bottom:3px solid #0072b2}\
figure{margin:1.2rem 0;break-inside:avoid}h2{break-after:avoid}tr{break-inside:avoid}\
@media print{body{max-width:none;font-size:11px;padding:0}.wide{overflow:visible}figure{max-width:17cm}}figure>svg{width:100%;height:auto}figcaption{color:var(--soft)}\
details>summary{cursor:pointer}nav ol{margin:.4rem 0;padding-left:1.4rem}nav a{color:inherit}\
.verdict{border-left:.5rem solid var(--line);padding:.4rem .8rem;font-size:1.1rem}\
.good{border-color:#009e73}.partly{border-color:#e69f00}.poor{border-color:#d55e00}\
.key{display:flex;flex-wrap:wrap;gap:.2rem 1.2rem;list-style:none;margin:.2rem 0;padding:0}\
.key svg{width:1.8rem;height:.9rem;vertical-align:middle;margin-right:.4rem}\
.wide{overflow-x:auto;background:linear-gradient(90deg,var(--paper) 30%,transparent) local,\
linear-gradient(270deg,var(--paper) 30%,transparent) 100% 0 local,radial-gradient(farthest-side at 0 50%,var(--shade),transparent),\
radial-gradient(farthest-side at 100% 50%,var(--shade),transparent) 100% 0;background-repeat:no-repeat;\
background-size:2.5rem 100%,2.5rem 100%,.8rem 100%,.8rem 100%;background-attachment:local,local,scroll,scroll}\
@media(max-width:30rem){td,th{padding-right:.5rem}.pairs td{overflow-wrap:anywhere}}\
@media(prefers-color-scheme:dark){:root{--ink:#e8e8e8;--soft:#bbb;--paper:#161616;--line:#444;--shade:rgba(255,255,255,.35)}\
figure>svg,.key svg{filter:invert(.91) hue-rotate(180deg)}}\
@media print{:root{--ink:#1a1a1a;--soft:#444;--paper:#fff;--line:#ddd}figure>svg,.key svg{filter:none}nav{display:none}}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums}\
th,td{padding:.25rem .8rem .25rem 0;text-align:left;border-bottom:1px solid var(--line);vertical-align:top}\
td.number,th.number{text-align:right}";

/// A table for people.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Headings of the columns.
    pub heading: Vec<String>,
    /// Rows; cells that are numbers are aligned to the right.
    pub rows: Vec<Vec<String>>,
}

/// A self-contained HTML page: no scripts, no other files.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    body: String,
    /// Headings of parts and sections.
    contents: Vec<String>,
}

impl Page {
    /// An empty page.
    #[must_use]
    pub fn new(title: &str) -> Self {
        Self { title: title.to_owned(), body: String::new(), contents: Vec::new() }
    }

    /// Begins a part, which has sections.
    pub fn part(&mut self, heading: &str) -> &mut Self {
        let place = self.place(heading);
        self.add(&format!("<h2 class=\"part\" id=\"{place}\">{}</h2>\n", escape(heading)))
    }

    /// Begins a section.
    pub fn section(&mut self, heading: &str) -> &mut Self {
        let place = self.place(heading);
        self.add(&format!("<h2 id=\"{place}\">{}</h2>\n", escape(heading)))
    }

    /// Names the place of a heading, for the list of contents.
    fn place(&mut self, heading: &str) -> String {
        self.contents.push(heading.to_owned());
        format!("s{}", self.contents.len())
    }

    /// Adds what the page says at a glance: `class` is `good`, `partly` or `poor`.
    pub fn verdict(&mut self, class: &'static str, text: &str) -> &mut Self {
        self.add(&format!("<p class=\"verdict {class}\">{}</p>\n", escape(text)))
    }

    /// Adds a paragraph of plain text.
    pub fn paragraph(&mut self, text: &str) -> &mut Self {
        self.add(&format!("<p>{}</p>\n", escape(text)))
    }

    /// Adds a table.
    pub fn table(&mut self, table: &Table) -> &mut Self {
        // Names and values stay on a narrow screen; what is wider is drawn aside, with a shadow where it goes on.
        let is_pairs = table.rows.iter().all(|row| row.len() <= 2);
        let class = if is_pairs { "pairs" } else { "wide" };
        let mut html = format!("<div class=\"{class}\"><table>\n");
        let is_number = |column: usize| {
            let mut cells =
                table.rows.iter().filter_map(|row| row.get(column)).filter(|cell| !cell.is_empty()).peekable();
            cells.peek().is_some() && cells.all(|cell| cell.parse::<f64>().is_ok())
        };
        let class = |column: usize| if is_number(column) { " class=\"number\"" } else { "" };
        if !table.heading.is_empty() {
            html.push_str("<thead><tr>");
            for (column, cell) in table.heading.iter().enumerate() {
                let _ = write!(html, "<th{}>{}</th>", class(column), escape(cell));
            }
            html.push_str("</tr></thead>\n");
        }
        html.push_str("<tbody>\n");
        for row in &table.rows {
            html.push_str("<tr>");
            for (column, cell) in row.iter().enumerate() {
                let _ = write!(html, "<td{}>{}</td>", class(column), escape(cell));
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody></table></div>\n");
        self.add(&html)
    }

    /// Adds a picture with its legend and a caption. The caption is also what a screen reader says.
    pub fn figure(&mut self, figure: &Figure, caption: &str) -> &mut Self {
        let caption = escape(caption);
        let svg = figure.svg.replacen("<svg ", &format!("<svg role=\"img\" aria-label=\"{caption}\" "), 1);
        let mut html = format!("<figure>\n{svg}\n");
        if !figure.legend.is_empty() {
            html.push_str("<ul class=\"key\">");
            for (mark, colour, name) in &figure.legend {
                let _ = write!(html, "<li>{}{}</li>", swatch(*mark, *colour), escape(name));
            }
            html.push_str("</ul>\n");
        }
        // The first sentence says what it is; the rest explains it to who asks.
        let _ = match caption.split_once(". ") {
            Some((first, rest)) => {
                writeln!(
                    html,
                    "<figcaption><details><summary>{first}.</summary>{rest}</details></figcaption>\n</figure>"
                )
            }
            None => writeln!(html, "<figcaption>{caption}</figcaption>\n</figure>"),
        };
        self.add(&html)
    }

    fn add(&mut self, html: &str) -> &mut Self {
        self.body.push_str(html);
        self
    }

    /// The page as HTML.
    #[must_use]
    pub fn html(&self) -> String {
        let title = escape(&self.title);
        let entry =
            |(number, heading): (usize, &String)| format!("<li><a href=\"#s{number}\">{}</a></li>", escape(heading));
        let entries: String = (1..).zip(&self.contents).map(entry).collect();
        let contents = match self.contents.len() {
            0..FEWEST_ENTRIES => String::new(),
            _ => format!("<nav><details><summary>Contents</summary><ol>{entries}</ol></details></nav>\n"),
        };
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n{contents}{}</body>\n</html>\n",
            self.body
        )
    }

    /// Writes the page to a file; missing folders are made.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        output_file::write(path, self.html())
    }
}

/// A page with fewer sections has no list of contents.
const FEWEST_ENTRIES: usize = 4;

/// Text that means nothing to HTML, inside and outside of attributes.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            other => escaped.push(other),
        }
    }
    escaped
}

fn swatch(mark: Mark, RGBColor(red, green, blue): RGBColor) -> String {
    let ink = format!("#{red:02x}{green:02x}{blue:02x}");
    let drawing = match mark {
        Mark::Line => format!("<path d=\"M0 8H32\" stroke=\"{ink}\" stroke-width=\"4\"/>"),
        Mark::Dashes => {
            format!("<path d=\"M0 8H32\" stroke=\"{ink}\" stroke-width=\"3\" stroke-dasharray=\"8 4\"/>")
        }
        Mark::Square => format!("<rect x=\"8\" y=\"1\" width=\"16\" height=\"14\" fill=\"{ink}\" stroke=\"#555\"/>"),
        Mark::Point(Shape::Disc) => format!("<circle cx=\"16\" cy=\"8\" r=\"5\" fill=\"{ink}\"/>"),
        Mark::Point(Shape::Cross) => {
            format!("<path d=\"M11 3L21 13M11 13L21 3\" stroke=\"{ink}\" stroke-width=\"2\"/>")
        }
        Mark::Point(Shape::Square) => format!("<rect x=\"11\" y=\"3\" width=\"10\" height=\"10\" fill=\"{ink}\"/>"),
        Mark::Point(Shape::Frame) => {
            format!(
                "<rect x=\"11\" y=\"3\" width=\"10\" height=\"10\" fill=\"none\" stroke=\"{ink}\" stroke-width=\"2\"/>"
            )
        }
        Mark::Point(Shape::Triangle) => format!("<path d=\"M16 2L22 14H10Z\" fill=\"{ink}\"/>"),
    };
    format!("<svg viewBox=\"0 0 32 16\" aria-hidden=\"true\">{drawing}</svg>")
}

#[cfg(test)]
mod tests {
    use super::{Page, Table, escape};
    use crate::report::{PointSet, Series, line_chart, scatter_chart};

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(escape("<b a=\"1\" c='2'>&"), "&lt;b a=&quot;1&quot; c=&#39;2&#39;&gt;&amp;");
        let mut page = Page::new("<title>");
        let hostile = "<script>";
        let figure = scatter_chart([hostile; 2], &[PointSet { name: hostile, points: &[(0.0, 1.0)] }], None).unwrap();
        page.section(hostile).paragraph(hostile).figure(&figure, hostile);
        page.table(&Table { heading: vec![hostile.into()], rows: vec![vec![hostile.into()]] });
        let html = page.html();
        assert!(!html.contains("<script"));
        assert!(html.matches("&lt;script&gt;").count() >= 7);
    }

    #[test]
    fn a_page_needs_no_other_file() {
        let mut page = Page::new("report");
        let figure = line_chart(["s, m", "error, mm"], &[Series { name: "a", points: &[] }], None).unwrap();
        page.figure(&figure, "nothing");
        let html = page.html();
        assert!(
            html.matches("href=").count() == html.matches("href=\"#s").count()
                && !html.contains("src=")
                && !html.contains("@import")
                && !html.contains("url(")
        );
        assert!(html.contains("<svg role=\"img\" aria-label=\"nothing\""));
    }

    #[test]
    fn the_list_of_contents_leads_to_each_section() {
        let mut page = Page::new("report");
        ["a", "<b>", "c", "d"].iter().for_each(|heading| {
            page.section(heading);
        });
        let html = page.html();
        for number in 1..=4 {
            let (from, to) = (format!("href=\"#s{number}\""), format!("id=\"s{number}\""));
            assert!(html.matches(&from).count() == 1 && html.matches(&to).count() == 1, "{html}");
        }
        assert!(html.contains("&lt;b&gt;</a>"));
    }

    #[test]
    fn columns_of_numbers_are_aligned_to_the_right() {
        let mut page = Page::new("report");
        page.table(&Table {
            heading: vec!["name".into(), "value".into()],
            rows: vec![vec!["1 of 2".into(), "1.5".into()], vec!["2 of 2".into(), "-7".into()]],
        });
        assert!(page.html().contains("<td>2 of 2</td><td class=\"number\">-7</td>"));
    }
}
