//! Signals that ask a process of a run to end, or to stand still.
//!
//! A terminal stops a job (Ctrl-Z) by signals that reach its own process group alone. They are caught: what belongs to
//! this process is stopped first, then this process stops itself; once it is continued, so are the others. The
//! [clock](squad::moment) by which timeouts count stands meanwhile.
//!
//! SIGSTOP cannot be caught: whoever sends it stops one process, and time goes on.

use std::{
    io, process, thread,
    time::{Duration, Instant},
};

use nix::sys::signal::{SigSet, SigmaskHow, Signal};
use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGSTOP, SIGTERM, SIGTSTP, SIGTTOU},
    iterator::Signals,
    low_level::raise,
};
use squad::{moment::Standstill, stop::StopFlag};

/// Signals that end a run cleanly.
pub const STOP_SIGNALS: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];

/// Signals this close together are one wish: `timeout` and some shells send two.
pub const ONE_WISH: Duration = Duration::from_secs(1);

/// Signals by which a terminal stops a job: Ctrl-Z, and output from the background where that is to wait
/// (`stty tostop`).
const TERMINAL_STOPS: [i32; 2] = [SIGTSTP, SIGTTOU];

/// The same, as signal masks have them.
const STOPS_MASKED: [Signal; 2] = [Signal::SIGTSTP, Signal::SIGTTOU];

/// Exit status of a process that `signal` has ended, as shells report it.
pub fn exit_status(signal: i32) -> u8 {
    (128 + signal).clamp(0, 255) as u8
}

/// Raises `stop` at the first of [`STOP_SIGNALS`]; a second one, not at the heels of the first, ends the process at
/// once.
///
/// # Errors
/// If the operating system does not let us listen.
pub fn raise_on_stop(stop: &StopFlag) -> io::Result<()> {
    let mut signals = Signals::new(STOP_SIGNALS)?;
    let stop = stop.clone();
    thread::spawn(move || {
        let mut raised = None;
        for signal in signals.forever() {
            let raised = raised.get_or_insert_with(Instant::now);
            stop.raise(signal);
            if raised.elapsed() > ONE_WISH {
                process::exit(exit_status(signal).into());
            }
        }
    });
    Ok(())
}

/// From here on this process stands still when a terminal stops its job: `around` stops what belongs to it, calls
/// what it is given, which returns when this process is continued, and lets the others go on. It runs in a thread of
/// its own, whatever the others are doing.
///
/// # Errors
/// If the operating system does not let us listen.
pub fn stand_still_on_terminal_stop(mut around: impl FnMut(fn()) + Send + 'static) -> io::Result<()> {
    let mut signals = Signals::new(TERMINAL_STOPS)?;
    thread::spawn(move || {
        // Who started this process may have held them back.
        SigSet::from_iter(STOPS_MASKED).thread_unblock().expect("every thread may change its mask");
        loop {
            if signals.wait().next().is_none() {
                continue;
            }
            let standstill = Standstill::begin();
            around(stop_this_process);
            // Each write to a terminal that does not want it sends one more, until this process stands.
            signals.pending().for_each(drop);
            standstill.end();
        }
    });
    Ok(())
}

/// Calls `start`, which starts a child in a process group of its own, and holds back meanwhile what stops a terminal's
/// job. A child is of our group until it has left it, just before its own program begins: stopped there, it would
/// be continued by nobody, and whoever starts it would wait for that program for ever. The child goes on to hold
/// them back; [`stand_still_on_terminal_stop`] ends that.
pub fn unstoppable<T>(start: impl FnOnce() -> T) -> T {
    let stops = SigSet::from_iter(STOPS_MASKED);
    let before = stops.thread_swap_mask(SigmaskHow::SIG_BLOCK).expect("every thread may change its mask");
    let started = start();
    before.thread_set_mask().expect("it has been the mask before");
    started
}

/// Returns when somebody has it continued.
fn stop_this_process() {
    raise(SIGSTOP).expect("every process may stop itself");
}
