//! The paper's page: every figure and table of Schwager, McLurkin and Rus (RSS 2006) beside ours.
//!
//! In:  a folder that `scripts/reproduce-paper` has filled with runs and batches. What is missing is said to be.
//! Out: a page that begins with every claim and how it fared; each verdict is computed from the numbers below it.

mod chapter;
mod evidence;
mod faults;
mod fig2;
mod local_cells;
mod near_optimal;
mod quadratic;
mod section_v;
mod table1;

use std::path::Path;

use serde::Deserialize;

use crate::{
    error::ReportError,
    page::{Block, Cell, Page, Table},
    scene,
};

use chapter::{Chapter, Verdict};
use evidence::Evidence;

/// `paper.json`.
#[derive(Debug, Deserialize)]
struct Meta {
    version: String,
}

/// The page of all that is in `folder`.
pub fn page(folder: &Path) -> Result<Page, ReportError> {
    let path = folder.join("paper.json");
    let missing = || ReportError::Missing {
        file: path.display().to_string(),
        hint: "scripts/reproduce-paper writes it first",
    };
    let meta: Meta = scene::json(&path)?.ok_or_else(missing)?;
    let evidence = Evidence::in_folder(folder);
    let chapters = [
        fig2::chapter(&evidence)?,
        table1::chapter(&evidence)?,
        section_v::chapter(&evidence)?,
        near_optimal::chapter(&evidence)?,
        quadratic::chapter(&evidence)?,
        local_cells::chapter(&evidence)?,
        faults::chapter(&evidence)?,
    ];
    let lead = vec![
        Block::Text(
            "Distributed Coverage Control with Sensory Feedback for Networked Robots (Schwager, McLurkin and Rus, \
             RSS 2006), run again by Lamplight. All figures and numbers on this page are from the runs in this \
             folder; each section ends with the commands that made them."
                .into(),
        ),
        Block::Text(format!("This is the {} version of scripts/reproduce-paper.", meta.version)),
        Block::Table(overview(&chapters)),
    ];
    let sections = chapters.into_iter().map(|chapter| chapter.section).collect();
    Ok(Page { title: "The paper, reproduced".into(), lead, sections })
}

fn overview(chapters: &[Chapter]) -> Table {
    let rows = chapters.iter().flat_map(|chapter| {
        let link = |verdict: &Verdict| Cell::Link(chapter.section.id.clone(), verdict.claim.into());
        let row = move |verdict: &Verdict| {
            vec![link(verdict), Cell::Mark(verdict.mark), Cell::words(verdict.ours.clone())]
        };
        chapter.verdicts.iter().map(row)
    });
    Table {
        caption: "What the paper claims, and how it fared here".into(),
        columns: ["claim", "verdict", "here"].map(str::to_owned).to_vec(),
        rows: rows.collect(),
    }
}
