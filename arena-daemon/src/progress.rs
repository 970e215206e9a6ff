//! How work looks while it goes on: one live line on a terminal, a plain line now and then elsewhere.

use std::{
    io::{self, IsTerminal, Write},
    sync::OnceLock,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use tracing_subscriber::{EnvFilter, fmt::MakeWriter};

/// Time between plain lines.
const PLAIN_EVERY: Duration = Duration::from_secs(10);
/// Time between updates of the live line.
const LIVE_EVERY: Duration = Duration::from_millis(100);

/// The live line, known to the log so that both can share the terminal.
static LIVE: OnceLock<ProgressBar> = OnceLock::new();

/// Where a run stands.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// Tick reached.
    pub tick: u64,
    /// Ticks in all.
    pub ticks: u64,
    /// Virtual time reached.
    pub time_s: f64,
    /// Mean ‖ê‖.
    pub mean_error_m: f64,
    /// Robots that take part.
    pub alive: usize,
}

/// The display of one run.
#[derive(Debug)]
pub struct Progress {
    meter: Meter,
    started: Instant,
}

impl Progress {
    /// Begins now. `quiet` shows nothing.
    pub fn begin(ticks: u64, quiet: bool) -> Self {
        Self { meter: Meter::begin(Some(ticks), quiet), started: Instant::now() }
    }

    /// Shows `status` if it is time to.
    pub fn show(&mut self, status: &Status) {
        let started = self.started;
        self.meter.show(status.tick, || text(status, started.elapsed().as_secs_f64()));
    }
}

/// Virtual time, speed, mean estimated error and robots alive; beside the bar it fits 80 columns.
fn text(status: &Status, wall_s: f64) -> String {
    format!(
        "{:.1} s, {:.0} ticks/s, {:.1}x real time, ê {:.2e} m, {} alive",
        status.time_s,
        status.tick as f64 / wall_s,
        status.time_s / wall_s,
        status.mean_error_m,
        status.alive,
    )
}

/// One live line on a terminal, a plain line now and then elsewhere.
#[derive(Debug)]
pub struct Meter {
    quiet: bool,
    live: Option<ProgressBar>,
    shown: Instant,
}

impl Meter {
    /// Begins now: a bar if the end is known, `total` steps away. `quiet` shows nothing.
    pub fn begin(total: Option<u64>, quiet: bool) -> Self {
        let live = (!quiet && io::stderr().is_terminal()).then(|| live_line(total));
        Self { quiet, live, shown: Instant::now() }
    }

    /// Shows a position and what `text` says, if it is time to.
    pub fn show(&mut self, position: u64, text: impl FnOnce() -> String) {
        let every = if self.live.is_some() { LIVE_EVERY } else { PLAIN_EVERY };
        if self.quiet || self.shown.elapsed() < every {
            return;
        }
        self.shown = Instant::now();
        match &self.live {
            Some(line) => {
                line.set_position(position);
                line.set_message(text());
            }
            None => tracing::info!("{}", text()),
        }
    }

    /// Does what writes to the terminal, without the live line in its way.
    pub fn aside<T>(&self, act: impl FnOnce() -> T) -> T {
        match &self.live {
            Some(line) => line.suspend(act),
            None => act(),
        }
    }
}

impl Drop for Meter {
    /// Clears the live line.
    fn drop(&mut self) {
        if let Some(line) = &self.live {
            line.finish_and_clear();
        }
    }
}

fn live_line(total: Option<u64>) -> ProgressBar {
    let template = match total {
        Some(_) => "{bar:10} {percent:>3}% {wide_msg}",
        None => "{spinner} {wide_msg}",
    };
    let style =
        ProgressStyle::with_template(template).expect("the templates are fixed and have been seen to parse");
    let line = ProgressBar::with_draw_target(total, ProgressDrawTarget::stderr()).with_style(style);
    LIVE.get_or_init(|| line).clone()
}

/// Sends logs to standard error, around the live line. `RUST_LOG` overrides the default level.
pub fn init_log(quiet: bool) {
    let default = if quiet { "warn" } else { "info" };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default));
    let log = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(BesideLiveLine)
        .with_ansi(io::stderr().is_terminal())
        .without_time()
        .with_target(false);
    // A second call, as in tests, keeps the first log.
    let _ = log.try_init();
}

struct BesideLiveLine;

impl<'a> MakeWriter<'a> for BesideLiveLine {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        Self
    }
}

impl Write for BesideLiveLine {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match LIVE.get() {
            Some(line) => line.suspend(|| io::stderr().write(bytes)),
            None => io::stderr().write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}
