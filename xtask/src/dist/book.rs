//! The book as HTML pages that need nothing else.

use std::path::Path;

use anyhow::Context;
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, html};

use super::copy;

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;color:#1a1a1a;background:#fff;max-width:60rem;margin:0 auto;padding:1rem}\
pre{background:#f4f4f4;padding:.6rem;overflow-x:auto}code{font-size:.95em}table{border-collapse:collapse;display:block;overflow-x:auto}\
th,td{padding:.25rem .6rem;text-align:left;border-bottom:1px solid #ddd;vertical-align:top}nav{border-bottom:1px solid #ddd}\
nav ul{columns:3;padding-left:1.2rem}img{max-width:100%}";

/// Writes every page of the book in `source` to `folder`; the first is `index.html`.
fn write_pages(source: &Path, folder: &Path, below: &Path) -> anyhow::Result<()> {
    let entries = std::fs::read_dir(source.join(below)).with_context(|| source.join(below).display().to_string())?;
    let contents = std::fs::read_to_string(source.join("SUMMARY.md"))?;
    for entry in entries {
        let entry = entry?;
        let name = below.join(entry.file_name());
        if entry.path().is_dir() {
            write_pages(source, folder, &name)?;
            continue;
        }
        if name.extension().is_none_or(|ending| ending != "md") {
            copy(&entry.path(), &folder.join(&name))?;
            continue;
        }
        let up = "../".repeat(below.components().count());
        let text = std::fs::read_to_string(entry.path()).with_context(|| name.display().to_string())?;
        let page = page(&text, &contents, &up);
        super::write(&folder.join(name.with_extension("html")), page.as_bytes())?;
    }
    Ok(())
}

/// Writes the book in `source` to `folder`.
pub fn write(source: &Path, folder: &Path) -> anyhow::Result<()> {
    write_pages(source, folder, Path::new(""))?;
    copy(&folder.join("introduction.html"), &folder.join("index.html"))
}

fn page(text: &str, contents: &str, up: &str) -> String {
    let title = text.lines().find_map(|line| line.strip_prefix("# ")).unwrap_or("The AGV localisation controller");
    let links = rendered(contents.split_once('\n').map_or("", |(_, links)| links), up);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<nav>\n{links}</nav>\n<main>\n{}</main>\n</body>\n</html>\n",
        rendered(text, "")
    )
}

/// Markdown as HTML; chapters are linked to as pages, with `up` before.
fn rendered(text: &str, up: &str) -> String {
    let parser = Parser::new_ext(text, Options::ENABLE_TABLES).map(|event| match event {
        Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
            Event::Start(Tag::Link { link_type, dest_url: linked(&dest_url, up), title, id })
        }
        other => other,
    });
    let mut page = String::new();
    html::push_html(&mut page, parser);
    page
}

fn linked<'a>(target: &str, up: &str) -> CowStr<'a> {
    if target.contains("://") || target.starts_with('#') {
        return target.to_owned().into();
    }
    let (path, part) =
        target.split_once('#').map_or((target, String::new()), |(path, part)| (path, format!("#{part}")));
    let path = path.strip_suffix(".md").map_or_else(|| path.to_owned(), |stem| format!("{stem}.html"));
    format!("{up}{path}{part}").into()
}

#[cfg(test)]
mod tests {
    use super::{linked, page};

    #[test]
    fn chapters_are_linked_to_as_pages() {
        assert_eq!(&*linked("theory.md", ""), "theory.html");
        assert_eq!(&*linked("trust/soak.md#a-day", "../"), "../trust/soak.html#a-day");
        assert_eq!(&*linked("data-flow.svg", ""), "data-flow.svg");
        assert_eq!(&*linked("https://example.org/a.md", "../"), "https://example.org/a.md");
        let html =
            page("# A chapter\n\n| a | b |\n|---|---|\n| 1 | 2 |\n", "# Summary\n\n- [Theory](theory.md)\n", "../");
        assert!(html.contains("<title>A chapter</title>") && html.contains("<table>"), "{html}");
        assert!(html.contains("href=\"../theory.html\""), "{html}");
    }
}
