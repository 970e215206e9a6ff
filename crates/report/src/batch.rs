//! The page of a batch.

mod convergence;
mod decay;
mod density;
mod folder;
mod panels;
mod settings;
mod sweep;

pub use convergence::{NORMS, Norm, TOLERANCES};
pub use decay::decay_panel;
pub use density::density_points;
pub use folder::{Batch, ByTrial, Meta, Setting, Sweep};

use crate::{
    error::ReportError,
    page::{Block, Cell, Page, Section, Table},
};

/// The page of `batch`.
pub fn page(batch: &Batch) -> Result<Page, ReportError> {
    let mut lead: Vec<Block> = batch.scenario.description.iter().cloned().map(Block::Text).collect();
    lead.extend(batch.notes.iter().cloned().map(Block::Note));
    lead.push(Block::Table(headline(batch)));
    lead.push(Block::Text("The command that made it, with the scenario as it wrote it down:".into()));
    lead.push(Block::Command(batch.meta.command()));
    let mut sections = vec![
        Section { blocks: convergence::blocks(batch)?, ..Section::new("convergence", "Convergence") },
        Section { blocks: settings::blocks(batch)?, ..Section::new("ends", "At the end") },
    ];
    let optional = [
        ("decay", "Error over time", decay::blocks(batch)?),
        ("sweep", "Over what was swept", sweep::blocks(batch)?),
        ("density", "Density", density::blocks(batch)?),
    ];
    for (id, title, blocks) in optional {
        if !blocks.is_empty() {
            sections.push(Section { blocks, ..Section::new(id, title) });
        }
    }
    Ok(Page { title: format!("Batch of {}", batch.meta.scenario), lead, sections })
}

fn headline(batch: &Batch) -> Table {
    let meta = &batch.meta;
    let mut pairs = vec![
        ("engine".to_owned(), Cell::words(meta.engine.clone())),
        ("trials per setting".into(), Cell::number(meta.trials.to_string())),
        ("settings".into(), Cell::number(batch.settings.len().to_string())),
        ("trials done".into(), Cell::number(batch.trials.len().to_string())),
        ("first seed".into(), Cell::number(meta.seed.to_string())),
    ];
    if let Some(digest) = &batch.digest {
        pairs.push(("digest of all trials".into(), Cell::Code(digest.clone())));
    }
    Table::of_pairs("The batch", pairs)
}
