//! How the processes of a run log: one line per event, one write per line, in text or JSON.
//!
//! A `tracing` subscriber of our own, because `tracing-subscriber`'s registry takes 32 KB of private memory and a
//! thousand agents pay it a thousand times. This one holds a filter and a few words, and makes each line on the
//! stack. It keeps no spans: nobody here opens one.
//!
//! Agents and arena share one pipe to their supervisor. A line is no longer than what a pipe takes in one piece
//! ([`line::MOST_BYTES`]), so lines never mix. A line that cannot be written is lost, not waited for; the next one
//! that can be is preceded by how many were.

#![forbid(unsafe_code)]

mod context;
mod filter;
mod format;
pub mod line;
mod settings;
mod subscriber;

use std::{
    fmt::Display,
    io::{self, Write},
    sync::OnceLock,
};

use protocol::robot_id::RobotId;
use tracing::Level;

pub use crate::{
    context::{at_no_tick, at_tick, in_run},
    format::{FORMAT_VARIABLE, Format, UnknownFormat},
    settings::{Settings, Sink},
};

use crate::{
    context::{run, tick},
    filter::Filter,
    format::said,
    line::{Line, Record, Words},
    subscriber::Book,
};

/// How [`begin`] has begun.
static SETTINGS: OnceLock<Settings> = OnceLock::new();

/// Begins to log. A second call, as in tests, changes nothing.
pub fn begin(settings: Settings) {
    let text = said("RUST_LOG").unwrap_or_default();
    let (filter, unknown) = Filter::parse(&text, settings.level);
    let book = Book::new(settings, filter);
    if SETTINGS.set(settings).is_err() || tracing::subscriber::set_global_default(book).is_err() {
        return;
    }
    if !settings.complains {
        return;
    }
    for directive in unknown {
        complain(&format!("RUST_LOG: `{directive}` is not understood; there are LEVEL and TARGET=LEVEL"));
    }
    if let Err(unknown) = Format::from_env() {
        complain(&format!("{FORMAT_VARIABLE}: {unknown}"));
    }
}

/// Warns, whatever the filter: it is what may be wrong.
fn complain(message: &str) {
    let sink = SETTINGS.get().map_or(to_stderr as Sink, |settings| settings.sink);
    // If nobody takes it, there is nobody to tell.
    let _ = sink(line(Level::WARN, module_path!(), &message).bytes());
}

/// How this process writes lines.
pub fn format() -> Format {
    SETTINGS.get().map_or(Format::Text, |settings| settings.format)
}

/// Why a program fails, in its last line: `error: ...` where lines are text, whatever the filter. Where nothing
/// has begun to log yet, to standard error.
/// `target` is the program.
pub fn fatal(target: &str, message: &str) {
    // If nobody takes it, there is nobody to tell.
    let sink = SETTINGS.get().map_or(to_stderr as Sink, |settings| settings.sink);
    let _ = match format() {
        Format::Text => sink(format!("error: {message}\n").as_bytes()),
        Format::Json => sink(line(Level::ERROR, target, &message).bytes()),
    };
}

/// A line of this process that no event makes, in its format.
pub fn line(level: Level, target: &str, message: &dyn Display) -> Line {
    line_of(SETTINGS.get().and_then(|settings| settings.robot), level, target, message)
}

/// The same about a robot that another process plays.
pub fn line_of(robot: Option<RobotId>, level: Level, target: &str, message: &dyn Display) -> Line {
    let words = Words::Plain(message);
    Record { level, run: run(), robot, tick: tick(), target, words }.line(format(), false)
}

/// The sink that is standard error.
pub fn to_stderr(line: &[u8]) -> io::Result<()> {
    io::stderr().write_all(line)
}
