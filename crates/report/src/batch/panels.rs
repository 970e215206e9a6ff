//! The number of settings that a figure shows.

use crate::{batch::folder::Batch, page::Block};

/// Figures show so many settings at most, one beside the other; tables show all.
pub(super) const PANELS_MAX: usize = 12;

/// A note that not all settings are drawn.
pub(super) fn panels_note(batch: &Batch) -> Option<Block> {
    let count = batch.settings.len();
    (count > PANELS_MAX).then(|| {
        Block::Note(format!("Drawn are the first {PANELS_MAX} of {count} settings; the table has all."))
    })
}
