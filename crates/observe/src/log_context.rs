//! The tick of a run, as the log has it in each line.

use engine::{Observer, ObserverError, TickView, summary::Summary};
use protocol::percept::Tick;
use scenario::ProcessFault;

/// Tells the log which tick it is.
#[derive(Debug)]
pub struct LogContext;

impl Observer for LogContext {
    fn tick_begins(&mut self, tick: Tick, _: &[ProcessFault]) {
        logging::at_tick(tick);
    }

    fn summarize(&mut self, _: &TickView<'_>, _: &mut Summary) -> Result<(), ObserverError> {
        logging::at_no_tick();
        Ok(())
    }
}
