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

mod filter;
pub mod line;
mod subscriber;

use std::{
    cell::Cell,
    env,
    fmt::{self, Display},
    io::{self, Write},
    str::FromStr,
    sync::OnceLock,
};

use protocol::robot_id::RobotId;
use tracing::{Level, level_filters::LevelFilter};

use crate::{
    filter::Filter,
    line::{Line, Record, Words},
    subscriber::Book,
};

/// The environment variable by which a supervisor tells its children the format: `text` or `json`.
pub const FORMAT_VARIABLE: &str = "LAMPLIGHT_LOG";

/// Tick number of a thread that has no tick: no tick of a run has it (it is `transport::raw::BOOT_TICK`).
const NO_TICK: u64 = u64::MAX;

/// How [`begin`] has begun.
static SETTINGS: OnceLock<Settings> = OnceLock::new();
/// Name of the run that this process is in.
static RUN: OnceLock<String> = OnceLock::new();

thread_local! {
    /// A thread's own, because the trials of a batch run side by side.
    static TICK: Cell<u64> = const { Cell::new(NO_TICK) };
}

/// How lines are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// For people: ` WARN robot 3 tick 120: percept refused: ...`
    #[default]
    Text,
    /// For programs: an object per line, with the same keys whoever writes it
    Json,
}

impl Format {
    /// All there are, as the command line spells them.
    pub const NAMES: [&'static str; 2] = ["text", "json"];

    /// The format that [`FORMAT_VARIABLE`] names; text if it names none.
    ///
    /// # Errors
    /// If it says something else.
    pub fn from_env() -> Result<Self, UnknownFormat> {
        said(FORMAT_VARIABLE).map_or(Ok(Self::default()), |name| name.parse())
    }
}

impl Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Text => "text",
            Self::Json => "json",
        })
    }
}

/// A format that is none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownFormat(String);

impl Display for UnknownFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is no log format; there are text and json", self.0)
    }
}

impl std::error::Error for UnknownFormat {}

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(name: &str) -> Result<Self, UnknownFormat> {
        match name {
            "text" => Ok(Self::Text),
            "json" => Ok(Self::Json),
            _ => Err(UnknownFormat(name.into())),
        }
    }
}

/// Takes a line, newline included, in one piece or not at all.
pub type Sink = fn(&[u8]) -> io::Result<()>;

/// How a process logs.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// How lines are written.
    pub format: Format,
    /// Level of what is written where `RUST_LOG` does not say.
    pub level: LevelFilter,
    /// Robot of this process, if it is an agent's.
    pub robot: Option<RobotId>,
    /// Whether text may be colored.
    pub color: bool,
    /// Where lines go.
    pub sink: Sink,
    /// Warns of what in `RUST_LOG` and [`FORMAT_VARIABLE`] is not understood. One process of a run does.
    pub complains: bool,
}

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

/// The value of a variable of the environment, with replacement characters for what is no Unicode.
fn said(variable: &str) -> Option<String> {
    env::var_os(variable).map(|text| text.to_string_lossy().into_owned())
}

/// Warns, whatever the filter: it is what may be wrong.
fn complain(message: &str) {
    let sink = SETTINGS.get().map_or(to_stderr as Sink, |settings| settings.sink);
    // If nobody takes it, there is nobody to tell.
    let _ = sink(line(Level::WARN, module_path!(), &message).bytes());
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
    let robot = SETTINGS.get().and_then(|settings| settings.robot);
    let words = Words::Plain(message);
    Record { level, run: run(), robot, tick: tick(), target, words }.line(format(), false)
}

/// The sink that is standard error.
pub fn to_stderr(line: &[u8]) -> io::Result<()> {
    io::stderr().write_all(line)
}

fn run() -> Option<&'static str> {
    RUN.get().map(String::as_str)
}

fn tick() -> Option<u64> {
    Some(TICK.get()).filter(|&tick| tick != NO_TICK)
}
