//! Measurements of the agents, as the object `agents` of the summary.

use engine::{Observer, ObserverError, TickView, summary::Summary};
use profile::{ProfileSlot, Totals};

/// Adds the totals of the profile that the squad leaves here.
#[derive(Debug)]
pub struct AgentTotals(pub ProfileSlot);

impl Observer for AgentTotals {
    fn summarize(&mut self, _: &TickView<'_>, summary: &mut Summary) -> Result<(), ObserverError> {
        summary.agents = self.0.get().map(Totals::of);
        Ok(())
    }
}
