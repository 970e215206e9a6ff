//! A page: sections of words, tables and figures, as one HTML file that needs nothing else.

use std::fmt::Write;

use crate::{escape::escape, svg::Svg, theme};

/// By this a page is known to be ours.
pub const MARK: &str = "<meta name=\"generator\" content=\"lamplight report\">";

/// A whole page.
#[derive(Clone, Debug)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// Blocks before the first section.
    pub lead: Vec<Block>,
    /// The rest.
    pub sections: Vec<Section>,
}

/// A part of a page.
#[derive(Clone, Debug)]
pub struct Section {
    /// Its name in links.
    pub id: String,
    /// Its title.
    pub title: String,
    /// Its content.
    pub blocks: Vec<Block>,
}

/// One element of a section.
#[derive(Clone, Debug)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A paragraph that begins with a word that says what it is.
    Labeled(String, String),
    /// Something to look at before the results are trusted.
    Note(String),
    /// A command to type.
    Command(String),
    /// A figure.
    Figure(Figure),
    /// A table.
    Table(Table),
}

/// One or more drawings under one caption.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Its name: that of its file, and of links.
    pub name: String,
    /// Text that says what it shows.
    pub caption: String,
    /// The drawings.
    pub panels: Vec<Svg>,
}

/// Rows of cells under a header.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Text that says what it holds.
    pub caption: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Cells, as many per row as there are columns.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words, to the left.
    Words(String),
    /// A number, to the right.
    Number(String),
    /// Letters and digits to compare, in letters of one width.
    Code(String),
    /// Words that lead to a section: its id, the words.
    Link(String, String),
    /// How a claim fared.
    Mark(Mark),
}

/// How a claim fared: a sign and a word, for a color alone says nothing to some.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// As claimed.
    Yes,
    /// As claimed, once something is corrected.
    Corrected,
    /// Not as claimed.
    No,
    /// Measured here; the paper claims nothing.
    Beyond,
    /// Nothing to judge by.
    Missing,
}

impl Cell {
    /// Words.
    pub fn words(text: impl Into<String>) -> Self {
        Self::Words(text.into())
    }

    /// A number.
    pub fn number(text: impl Into<String>) -> Self {
        Self::Number(text.into())
    }
}

impl Mark {
    /// The verdict in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Yes => "reproduced",
            Self::Corrected => "reproduced with a correction",
            Self::No => "not reproduced",
            Self::Beyond => "beyond the paper",
            Self::Missing => "missing",
        }
    }

    fn sign_and_class(self) -> (&'static str, &'static str) {
        match self {
            Self::Yes => ("✓", "yes"),
            Self::Corrected => ("≈", "corrected"),
            Self::No => ("✗", "no"),
            Self::Beyond => ("+", "beyond"),
            Self::Missing => ("–", "missing"),
        }
    }

    /// As HTML.
    fn html(self) -> String {
        let (sign, class) = self.sign_and_class();
        format!("<span class=\"mark {class}\">{sign} {}</span>", self.words())
    }
}

impl Table {
    /// A table of names and values.
    pub fn of_pairs(caption: &str, pairs: Vec<(String, Cell)>) -> Self {
        Self {
            caption: caption.into(),
            columns: vec!["quantity".into(), "value".into()],
            rows: pairs.into_iter().map(|(name, value)| vec![Cell::Words(name), value]).collect(),
        }
    }
}

impl Section {
    /// An empty section.
    pub fn new(id: &str, title: impl Into<String>) -> Self {
        Self { id: id.into(), title: title.into(), blocks: Vec::new() }
    }
}

impl Figure {
    /// Names of the files of its drawings, with each.
    pub fn files(&self) -> Vec<(String, &Svg)> {
        let one = self.panels.len() == 1;
        let name =
            |index: usize| if one { self.name.clone() } else { format!("{}-{}", self.name, index + 1) };
        self.panels.iter().enumerate().map(|(index, panel)| (name(index), panel)).collect()
    }
}

impl Page {
    /// All figures, in the order of the page.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        let blocks = self.lead.iter().chain(self.sections.iter().flat_map(|section| &section.blocks));
        blocks.filter_map(|block| match block {
            Block::Figure(figure) => Some(figure),
            _ => None,
        })
    }

    /// The page as one file.
    pub fn html(&self) -> String {
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n{MARK}\n\
             <title>{title}</title>\n<style>\n{inks}{CSS}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n",
            title = escape(&self.title),
            inks = theme::page_css(),
        );
        self.lead.iter().for_each(|block| html.push_str(&block.html()));
        if self.sections.len() > 2 {
            html.push_str("<nav aria-label=\"Sections\"><ul>\n");
            for section in &self.sections {
                let _ = writeln!(html, "<li>{}</li>", link(&section.id, &section.title));
            }
            html.push_str("</ul></nav>\n");
        }
        for section in &self.sections {
            let (id, title) = (escape(&section.id), escape(&section.title));
            let _ = writeln!(html, "<section id=\"{id}\">\n<h2>{title}</h2>");
            section.blocks.iter().for_each(|block| html.push_str(&block.html()));
            html.push_str("</section>\n");
        }
        html.push_str("</main>\n</body>\n</html>\n");
        html
    }
}

impl Block {
    fn html(&self) -> String {
        match self {
            Self::Text(text) => format!("<p>{}</p>\n", escape(text)),
            Self::Labeled(label, text) => {
                format!("<p><strong>{}</strong> {}</p>\n", escape(label), escape(text))
            }
            Self::Note(text) => format!("<p class=\"note\"><strong>Note.</strong> {}</p>\n", escape(text)),
            Self::Command(text) => format!("<pre><code>{}</code></pre>\n", escape(text)),
            Self::Figure(figure) => figure.html(),
            Self::Table(table) => table.html(),
        }
    }
}

impl Figure {
    fn html(&self) -> String {
        let panels: String = self.files().iter().map(|(name, panel)| panel.inline(name)).collect();
        let several = if self.panels.len() > 1 { " class=\"several\"" } else { "" };
        format!(
            "<figure{several}>\n<div class=\"panels\">\n{panels}</div>\n<figcaption>{}</figcaption>\n</figure>\n",
            escape(&self.caption)
        )
    }
}

impl Table {
    fn html(&self) -> String {
        let numeric = |column: usize| {
            let mut cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.any(|cell| matches!(cell, Cell::Number(_)))
        };
        let head: String = (self.columns.iter().enumerate())
            .map(|(column, name)| {
                let class = if numeric(column) { " class=\"number\"" } else { "" };
                format!("<th scope=\"col\"{class}>{}</th>", escape(name))
            })
            .collect();
        let mut html = format!(
            "<div class=\"table\"><table>\n<caption>{}</caption>\n<thead><tr>{head}</tr></thead>\n<tbody>\n",
            escape(&self.caption)
        );
        for row in &self.rows {
            let cells: String = row.iter().map(Cell::html).collect();
            let _ = writeln!(html, "<tr>{cells}</tr>");
        }
        html.push_str("</tbody>\n</table></div>\n");
        html
    }
}

impl Cell {
    fn html(&self) -> String {
        match self {
            Self::Words(text) => format!("<td>{}</td>", escape(text)),
            Self::Number(text) => format!("<td class=\"number\">{}</td>", escape(text)),
            Self::Code(text) => format!("<td><code>{}</code></td>", escape(text)),
            Self::Link(id, text) => format!("<td>{}</td>", link(id, text)),
            Self::Mark(mark) => format!("<td>{}</td>", mark.html()),
        }
    }
}

fn link(id: &str, text: &str) -> String {
    format!("<a href=\"#{}\">{}</a>", escape(id), escape(text))
}

/// Measures in rem, so that it grows with the reader's letters; on paper nothing is cut in two.
const CSS: &str = "\
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--text);font:1rem/1.5 system-ui,\"DejaVu Sans\",Verdana,sans-serif}
main{max-width:82rem;margin:0 auto;padding:1.5rem 1.25rem 4rem}
h1{font-size:1.8rem;line-height:1.2;margin:.5rem 0 1rem}
h2{font-size:1.3rem;margin:2.5rem 0 .75rem;padding-top:.5rem;border-top:1px solid var(--grid)}
p{max-width:50rem;margin:.6rem 0}
a{color:var(--blue)}
nav ul{columns:18rem;padding-left:1.2rem;max-width:60rem}
.note{border-left:.25rem solid var(--orange);padding:.3rem .8rem}
pre{white-space:pre-wrap;overflow-wrap:anywhere;border:1px solid var(--grid);border-radius:.3rem;padding:.6rem .8rem;max-width:60rem}
code{font-family:ui-monospace,\"DejaVu Sans Mono\",Menlo,Consolas,monospace;font-size:.9em}
figure{margin:1.25rem 0 1.75rem}
.panels{display:flex;flex-wrap:wrap;gap:1rem;align-items:flex-start}
.panels svg{max-width:100%;height:auto}
figcaption{max-width:50rem;margin-top:.4rem;font-size:.92rem}
.table{overflow-x:auto;margin:1rem 0 1.5rem}
table{border-collapse:collapse;font-size:.92rem;font-variant-numeric:tabular-nums}
caption{text-align:left;padding-bottom:.4rem;max-width:50rem}
th,td{text-align:left;vertical-align:top;padding:.25rem .75rem .25rem 0;border-bottom:1px solid var(--grid)}
thead th{border-bottom:2px solid var(--mark)}
.number{text-align:right;white-space:nowrap}
.mark{font-weight:600;white-space:nowrap}
.mark.yes{color:var(--green)}.mark.corrected{color:var(--orange)}.mark.no{color:var(--vermillion)}.mark.beyond{color:var(--blue)}
@media print{
@page{margin:15mm}
body{font-size:10pt}
main{max-width:none;padding:0}
nav{display:none}
a{color:inherit;text-decoration:none}
h2,caption{break-after:avoid}
figure,tr,pre{break-inside:avoid}
.panels svg{max-width:100%;height:auto}
.several .panels svg{max-width:48%}
thead{display:table-header-group}
.table{overflow-x:visible}
table{font-size:8pt}
.number,.mark{white-space:normal}
}
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_says_cannot_become_markup() {
        let page = Page {
            title: "<script>\"x\" & 'y'\u{1b}".into(),
            lead: vec![
                Block::Text("<b>".into()),
                Block::Table(Table {
                    caption: "<i>".into(),
                    columns: vec!["<u>".into()],
                    rows: vec![vec![Cell::words("</td><td>")]],
                }),
            ],
            sections: Vec::new(),
        };
        let html = page.html();
        for tag in ["<script>", "<b>", "<i>", "<u>", "</td><td>", "\u{1b}"] {
            assert!(!html.contains(tag), "{tag:?} in the page");
        }
        assert!(html.contains("&lt;script&gt;&quot;x&quot; &amp; &#39;y&#39;"));
    }

    #[test]
    fn a_verdict_reads_without_color() {
        let html = Cell::Mark(Mark::No).html();
        assert!(html.contains("✗ not reproduced"));
    }
}
