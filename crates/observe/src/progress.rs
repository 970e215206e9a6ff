//! How work looks while it goes on: one live line on a terminal, a plain line now and then elsewhere.

use std::{
    io::{self, IsTerminal, Write},
    sync::OnceLock,
    time::{Duration, Instant},
};

use engine::{Observer, ObserverError, RunInfo, TickView};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use logging::{Format, Settings, Sink};
use tracing::level_filters::LevelFilter;

/// Time between plain lines.
const PLAIN_EVERY: Duration = Duration::from_secs(10);
/// Time between updates of the live line.
const LIVE_EVERY: Duration = Duration::from_millis(100);

/// The live line, known to the log so that both can share the terminal.
static LIVE: OnceLock<ProgressBar> = OnceLock::new();

/// Where a run stands, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Ticks done.
    pub position: u64,
    /// Ticks in all.
    pub total: u64,
    /// Further text to show.
    pub text: String,
}

/// Destination of progress reports.
pub enum Audience {
    /// Standard error, for a person.
    StandardError,
    /// Another display: that of the supervisor, which has the terminal.
    Elsewhere(Box<dyn FnMut(Report)>),
}

/// The display of one run.
pub struct Progress {
    started: Instant,
    audience: Audience,
    meter: Meter,
    told: Instant,
}

impl Progress {
    /// For `audience`; it begins when the run does.
    pub fn new(audience: Audience) -> Self {
        let now = Instant::now();
        Self { started: now, audience, meter: Meter::begin(None, true), told: now }
    }
}

impl Observer for Progress {
    fn started(&mut self, run: &RunInfo<'_>) -> Result<(), ObserverError> {
        self.started = Instant::now();
        self.told = self.started;
        if let Audience::StandardError = self.audience {
            self.meter = Meter::begin(Some(run.scenario.ticks()), false);
        }
        Ok(())
    }

    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        let started = self.started;
        let text = || text(tick, started.elapsed().as_secs_f64());
        match &mut self.audience {
            Audience::StandardError => self.meter.show(tick.tick(), text),
            Audience::Elsewhere(tell) if self.told.elapsed() >= LIVE_EVERY => {
                self.told = Instant::now();
                tell(Report { position: tick.tick(), total: tick.ticks(), text: text() });
            }
            Audience::Elsewhere(_) => {}
        }
        Ok(())
    }
}

/// Virtual time, speed, mean estimated error and robots that take part; beside the bar it fits 80 columns.
fn text(tick: &TickView<'_>, wall_s: f64) -> String {
    let error = tick.errors().mean_m.map_or("-".into(), |mean_m| format!("{mean_m:.2e} m"));
    format!(
        "{:.1} s, {:.0} ticks/s, {:.1}x real time, ê {error}, {} robots",
        tick.time_s(),
        tick.tick() as f64 / wall_s,
        tick.time_s() / wall_s,
        tick.answers().iter().flatten().count(),
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
            Some(_) => self.put(position, text()),
            None => tracing::info!("{}", text()),
        }
    }

    /// Shows a position and a text on the live line, if there is one.
    pub fn put(&self, position: u64, text: String) {
        if let Some(line) = &self.live {
            line.set_position(position);
            line.set_message(text);
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

/// Begins to log, to `sink`. `RUST_LOG` overrides the default level.
pub fn init_log(quiet: bool, format: Format, sink: Sink, complains: bool) {
    logging::begin(Settings {
        format,
        level: if quiet { LevelFilter::WARN } else { LevelFilter::INFO },
        robot: None,
        color: io::stderr().is_terminal(),
        sink,
        complains,
    });
}

/// Writes a line to standard error, around the live line.
pub fn beside_live_line(line: &[u8]) -> io::Result<()> {
    match LIVE.get() {
        Some(live) => live.suspend(|| io::stderr().write_all(line)),
        None => io::stderr().write_all(line),
    }
}
