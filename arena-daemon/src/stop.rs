//! The wish to end a run early, from a signal or a supervisor.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicI32, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM},
    iterator::Signals,
};

/// Signals that end a run cleanly.
pub const STOP_SIGNALS: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];

/// Signals this close together are one wish: `timeout` and some shells send two.
pub const ONE_WISH: Duration = Duration::from_secs(1);

/// Exit status of a process that `signal` has ended, as shells report it.
pub fn exit_status(signal: i32) -> u8 {
    (128 + signal).clamp(0, 255) as u8
}

/// Raised once, seen by everyone who holds a clone.
#[derive(Clone, Debug, Default)]
pub struct StopFlag(Arc<AtomicI32>);

impl StopFlag {
    /// Asks the run to end at its next tick, in the name of `signal`.
    pub fn raise(&self, signal: i32) {
        self.0.store(signal, Ordering::Relaxed);
    }

    /// Whether somebody asked.
    pub fn is_raised(&self) -> bool {
        self.signal().is_some()
    }

    /// By which signal somebody asked.
    pub fn signal(&self) -> Option<i32> {
        Some(self.0.load(Ordering::Relaxed)).filter(|&signal| signal != 0)
    }

    /// Raises the flag at the first of [`STOP_SIGNALS`]; a second one, not at the heels of the
    /// first, ends the process at once.
    pub fn on_signals(&self) -> io::Result<()> {
        let mut signals = Signals::new(STOP_SIGNALS)?;
        let flag = self.clone();
        thread::spawn(move || {
            let mut raised = None;
            for signal in signals.forever() {
                let raised = raised.get_or_insert_with(Instant::now);
                flag.raise(signal);
                if raised.elapsed() > ONE_WISH {
                    std::process::exit(exit_status(signal).into());
                }
            }
        });
        Ok(())
    }
}
