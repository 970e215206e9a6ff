//! Context of lines: the run of this process, and the tick of this thread.

use std::{cell::Cell, fmt::Display, sync::OnceLock};

/// Tick number of a thread that has no tick: no tick of a run has it (it is `transport::raw::BOOT_TICK`).
const NO_TICK: u64 = u64::MAX;

/// Name of the run that this process is in.
static RUN: OnceLock<String> = OnceLock::new();

thread_local! {
    /// A thread's own, because the trials of a batch run side by side.
    static TICK: Cell<u64> = const { Cell::new(NO_TICK) };
}

/// From here on lines name this run. The first name stays.
pub fn in_run(name: impl Display) {
    let _ = RUN.set(name.to_string());
}

/// From here on the lines of this thread are about this tick; costs one store.
pub fn at_tick(tick: u64) {
    TICK.set(tick);
}

/// From here on the lines of this thread are about no tick.
pub fn at_no_tick() {
    TICK.set(NO_TICK);
}

pub(crate) fn run() -> Option<&'static str> {
    RUN.get().map(String::as_str)
}

pub(crate) fn tick() -> Option<u64> {
    Some(TICK.get()).filter(|&tick| tick != NO_TICK)
}
