//! An event -> its line, text or JSON, on the stack.
//!
//! Text: `LEVEL robot N tick T: message key=value`. JSON: `unix_s, level, run, robot, incarnation, tick, target,
//! message, fields`, always all of them, `null` where unknown; and `cut`, where the line was too long.

use std::{
    fmt::{self, Debug, Display, Write},
    time::{SystemTime, UNIX_EPOCH},
};

use protocol::robot_id::RobotId;
use tracing::{
    Event, Level,
    field::{Field, Visit},
};

use crate::format::Format;

/// Longest line, bytes, newline included: what Linux writes to a pipe in one piece (PIPE_BUF, pipe(7)).
pub const MOST_BYTES: usize = 4096;

/// Bytes kept free for what ends a line. The longest end is `…","fields":{},"cut":true}` and a newline, 29 bytes.
const TAIL: usize = 32;

/// How every line of JSON begins, by which a reader tells it from what something else wrote.
pub const JSON_BEGINS: &str = "{\"unix_s\":";

/// Name of the field that `tracing` puts an event's text in.
const MESSAGE: &str = "message";

/// Content of a line.
#[derive(Clone, Copy)]
pub(crate) enum Words<'a, 'b> {
    Event(&'a Event<'b>),
    Plain(&'a dyn Display),
}

/// All that a line tells.
pub(crate) struct Record<'a, 'b> {
    pub(crate) level: Level,
    pub(crate) run: Option<&'a str>,
    pub(crate) robot: Option<RobotId>,
    pub(crate) tick: Option<u64>,
    pub(crate) target: &'a str,
    pub(crate) words: Words<'a, 'b>,
}

/// One line, newline included, of at most [`MOST_BYTES`].
pub struct Line {
    bytes: [u8; MOST_BYTES],
    length: usize,
    /// Something did not fit.
    cut: bool,
}

impl Line {
    fn new() -> Self {
        Self { bytes: [0; MOST_BYTES], length: 0, cut: false }
    }

    /// Returns the bytes to write.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    /// Adds `text`, if it all fits before the tail.
    fn add(&mut self, text: &str) -> fmt::Result {
        self.add_below(MOST_BYTES - TAIL, text)
    }

    /// Adds what ends a line, for which there is room.
    fn end(&mut self, text: &str) {
        self.add_below(MOST_BYTES, text).expect("the ends of a line are shorter than its tail");
    }

    fn add_below(&mut self, limit: usize, text: &str) -> fmt::Result {
        let end = self.length + text.len();
        if end > limit {
            self.cut = true;
            return Err(fmt::Error);
        }
        self.bytes[self.length..end].copy_from_slice(text.as_bytes());
        self.length = end;
        Ok(())
    }

    /// Adds what `add` adds, or nothing if it does not fit.
    fn whole(&mut self, add: impl FnOnce(&mut Self) -> fmt::Result) {
        let length = self.length;
        if add(self).is_err() {
            (self.length, self.cut) = (length, true);
        }
    }
}

impl Debug for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Debug::fmt(&String::from_utf8_lossy(self.bytes()), f)
    }
}

impl Write for Line {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.add(text)
    }
}

impl Record<'_, '_> {
    pub(crate) fn line(&self, format: Format, color: bool) -> Line {
        let mut line = Line::new();
        match format {
            Format::Text => self.text(&mut line, color),
            Format::Json => self.json(&mut line),
        }
        line
    }

    fn text(&self, line: &mut Line, color: bool) {
        line.whole(|line| {
            match color {
                true => write!(line, "\x1b[{}m{:>5}\x1b[0m", color_of(self.level), self.level)?,
                false => write!(line, "{:>5}", self.level)?,
            }
            if let Some(robot) = self.robot {
                write!(line, " {robot}")?;
            }
            if let Some(tick) = self.tick {
                write!(line, " tick {tick}")?;
            }
            line.add(if self.robot.is_some() || self.tick.is_some() { ": " } else { " " })
        });
        self.message(&mut Escaped { line, escape: for_people });
        if line.cut {
            line.end("…");
        }
        self.fields(&mut |name, value| {
            line.whole(|line| {
                write!(line, " {name}=")?;
                match value {
                    Value::Raw(raw) => write!(line, "{raw}"),
                    Value::Text(text) => write!(Escaped { line, escape: for_people }, "{text}"),
                }
            });
        });
        line.end(if line.cut { " [cut]\n" } else { "\n" });
    }

    fn json(&self, line: &mut Line) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        // Names of runs and targets need no escaping; but who knows who will call one what.
        let text = |line: &mut Line, text: &str| write!(Escaped { line, escape: for_json }, "{text}");
        line.whole(|line| {
            write!(line, "{JSON_BEGINS}{:.6},\"level\":\"{}\",\"run\":", now.as_secs_f64(), self.level)?;
            match self.run {
                Some(run) => {
                    line.add("\"")?;
                    text(line, run)?;
                    line.add("\"")?;
                }
                None => line.add("null")?,
            }
            match self.robot {
                Some(RobotId { index, incarnation }) => {
                    write!(line, ",\"robot\":{index},\"incarnation\":{incarnation}")?;
                }
                None => line.add(",\"robot\":null,\"incarnation\":null")?,
            }
            match self.tick {
                Some(tick) => write!(line, ",\"tick\":{tick}")?,
                None => line.add(",\"tick\":null")?,
            }
            line.add(",\"target\":\"")?;
            text(line, self.target)?;
            line.add("\",\"message\":\"")
        });
        self.message(&mut Escaped { line, escape: for_json });
        line.end(if line.cut { "…\",\"fields\":{" } else { "\",\"fields\":{" });
        let mut between = "";
        self.fields(&mut |name, value| {
            // A name is an identifier of Rust, or a literal somewhere in our code.
            line.whole(|line| {
                write!(line, "{between}\"{name}\":")?;
                match value {
                    Value::Raw(raw) => write!(line, "{raw}")?,
                    Value::Text(text) => {
                        line.add("\"")?;
                        write!(Escaped { line, escape: for_json }, "{text}")?;
                        line.add("\"")?;
                    }
                }
                between = ",";
                Ok(())
            });
        });
        line.end(if line.cut { "},\"cut\":true}\n" } else { "}}\n" });
    }

    /// Writes the message, as much of it as fits.
    fn message(&self, to: &mut Escaped<'_>) {
        // What does not fit has marked the line as cut.
        let mut add = |text: &dyn Display| {
            let _ = write!(to, "{text}");
        };
        match self.words {
            Words::Plain(text) => add(text),
            Words::Event(event) => event.record(&mut Picked(&mut |name, value| match value {
                Value::Raw(text) | Value::Text(text) if name == MESSAGE => add(text),
                _ => {}
            })),
        }
    }

    /// Hands over every field that is not the message.
    fn fields(&self, to: &mut dyn FnMut(&str, Value<'_>)) {
        if let Words::Event(event) = self.words {
            event.record(&mut Picked(&mut |name, value| {
                if name != MESSAGE {
                    to(name, value);
                }
            }));
        }
    }
}

/// A field's value: as JSON spells it too, or as text.
#[derive(Clone, Copy)]
enum Value<'a> {
    Raw(&'a dyn Display),
    Text(&'a dyn Display),
}

/// Hands on each field.
struct Picked<'a>(&'a mut dyn FnMut(&str, Value<'_>));

impl Visit for Picked<'_> {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        (self.0)(field.name(), Value::Text(&format_args!("{value:?}")));
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        (self.0)(field.name(), Value::Text(&value));
    }

    fn record_bool(&mut self, field: &Field, value: bool) {
        (self.0)(field.name(), Value::Raw(&value));
    }

    fn record_i64(&mut self, field: &Field, value: i64) {
        (self.0)(field.name(), Value::Raw(&value));
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        (self.0)(field.name(), Value::Raw(&value));
    }

    fn record_f64(&mut self, field: &Field, value: f64) {
        match value.is_finite() {
            // Debug tells tiny and huge numbers by an exponent.
            true => (self.0)(field.name(), Value::Raw(&format_args!("{value:?}"))),
            false => (self.0)(field.name(), Value::Raw(&"null")),
        }
    }
}

/// Writes text to a line, each character as `escape` has it, up to the last one that fits.
struct Escaped<'a> {
    line: &'a mut Line,
    escape: fn(char, &mut Line) -> fmt::Result,
}

impl Write for Escaped<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.chars().try_for_each(|c| (self.escape)(c, self.line))
    }
}

/// Nothing that a terminal would obey; lines may go on below.
fn for_people(c: char, line: &mut Line) -> fmt::Result {
    match c.is_control() && c != '\n' {
        true => add_whole(c.escape_default(), line),
        false => line.add(c.encode_utf8(&mut [0; 4])),
    }
}

fn for_json(c: char, line: &mut Line) -> fmt::Result {
    match c {
        '"' => line.add("\\\""),
        '\\' => line.add("\\\\"),
        '\n' => line.add("\\n"),
        c if c.is_control() => add_whole(format_args!("\\u{:04x}", u32::from(c)), line),
        c => line.add(c.encode_utf8(&mut [0; 4])),
    }
}

/// An escape sequence is not cut in two.
fn add_whole(text: impl Display, line: &mut Line) -> fmt::Result {
    let length = line.length;
    write!(line, "{text}").inspect_err(|_| line.length = length)
}

/// As terminals number them: red, yellow, green, blue, purple.
fn color_of(level: Level) -> u8 {
    match level {
        Level::ERROR => 31,
        Level::WARN => 33,
        Level::INFO => 32,
        Level::DEBUG => 34,
        Level::TRACE => 35,
    }
}
