//! Chapters of the page: what the paper claims, and how it fared.

use crate::page::{Block, Mark, Section};

/// A claim of the paper, and how it fared.
pub(super) struct Verdict {
    pub(super) claim: &'static str,
    pub(super) mark: Mark,
    /// Ours, in few words.
    pub(super) ours: String,
}

/// A section with what it shows to be so.
pub(super) struct Chapter {
    pub(super) section: Section,
    pub(super) verdicts: Vec<Verdict>,
}

impl Chapter {
    pub(super) fn new(id: &str, title: &str, claim: &str) -> Self {
        let mut section = Section::new(id, title);
        section.blocks.push(Block::Labeled("The paper:".into(), claim.into()));
        Self { section, verdicts: Vec::new() }
    }

    pub(super) fn add(&mut self, block: Block) {
        self.section.blocks.push(block);
    }

    pub(super) fn say(&mut self, label: &str, text: impl Into<String>) {
        self.add(Block::Labeled(label.into(), text.into()));
    }

    pub(super) fn verdict(&mut self, claim: &'static str, mark: Mark, ours: impl Into<String>) {
        self.verdicts.push(Verdict { claim, mark, ours: ours.into() });
    }

    /// The results of `name` are not there.
    pub(super) fn missing(&mut self, claim: &'static str, name: &str) {
        self.add(Block::Note(format!("{name}/ is not there: scripts/reproduce-paper makes it.")));
        self.verdict(claim, Mark::Missing, "no results");
    }
}
