//! Figures and one page from what a run or a batch left.
//!
//! In:  the folder of a run, of a batch, or of all that belongs to the paper.
//! Out: `report.html`, which needs nothing else, and `figures/*.svg` beside it. The same folder gives the
//!      same bytes.
//!
//! [`report`] is the whole of it. `run`, `batch` and `paper` read a folder and make a [`page::Page`];
//! `chart` and `plan` draw, `page` writes HTML, `folder` looks and writes.

#![forbid(unsafe_code)]

pub mod batch;
pub mod chart;
pub mod density;
pub mod error;
mod escape;
pub mod folder;
pub mod legend;
pub mod look;
pub mod number;
pub mod page;
pub mod paper;
pub mod plan;
pub mod rows;
pub mod run;
pub mod scene;
pub mod stats;
pub mod svg;
pub mod theme;

use std::path::{Path, PathBuf};

pub use error::ReportError;
use folder::Kind;

/// Writes the report on `folder` into it and says where the page is.
pub fn report(folder: &Path) -> Result<PathBuf, ReportError> {
    let page = match folder::kind(folder)? {
        Kind::Run => run::page(&run::Run::read(folder)?)?,
        Kind::Batch => batch::page(&batch::Batch::read(folder)?)?,
        Kind::Paper => paper::page(folder)?,
    };
    let path = folder.join("report.html");
    folder::write(&page, &path)?;
    Ok(path)
}
