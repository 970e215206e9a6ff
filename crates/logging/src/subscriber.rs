//! The `tracing` subscriber: a filter, and a line for each event that it lets through.

use std::sync::atomic::{AtomicU64, Ordering};

use tracing::{
    Event, Level, Metadata, Subscriber,
    level_filters::LevelFilter,
    span::{Attributes, Id, Record as Values},
    subscriber::Interest,
};

use crate::{
    context::{run, tick},
    filter::Filter,
    line::{Line, Record, Words},
    settings::Settings,
};

/// Writes what happens.
#[derive(Debug)]
pub(crate) struct Book {
    settings: Settings,
    filter: Filter,
    /// Lines that nobody took, since the last one that somebody did.
    lost: AtomicU64,
}

impl Book {
    pub(crate) fn new(settings: Settings, filter: Filter) -> Self {
        Self { settings, filter, lost: AtomicU64::new(0) }
    }

    fn line(&self, level: Level, target: &str, words: Words<'_, '_>) -> Line {
        let Settings { format, robot, color, .. } = self.settings;
        Record { level, run: run(), robot, tick: tick(), target, words }.line(format, color)
    }

    fn write(&self, line: &Line) {
        let lost = self.lost.swap(0, Ordering::Relaxed);
        if lost > 0 {
            let words = format_args!("{lost} lines of this process are lost: nobody took them in time");
            let told = self.line(Level::WARN, module_path!(), Words::Plain(&words));
            if (self.settings.sink)(told.bytes()).is_err() {
                self.lost.fetch_add(lost + 1, Ordering::Relaxed);
                return;
            }
        }
        if (self.settings.sink)(line.bytes()).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Subscriber for Book {
    fn register_callsite(&self, metadata: &'static Metadata<'static>) -> Interest {
        match self.enabled(metadata) {
            true => Interest::always(),
            false => Interest::never(),
        }
    }

    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.is_event() && self.filter.lets_through(metadata)
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(self.filter.most())
    }

    fn event(&self, event: &Event<'_>) {
        let metadata = event.metadata();
        self.write(&self.line(*metadata.level(), metadata.target(), Words::Event(event)));
    }

    // Spans are not enabled, so none of these is called.
    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Values<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

#[cfg(test)]
mod tests {
    use std::{
        cell::{Cell, RefCell},
        io,
    };

    use protocol::robot_id::RobotId;
    use tracing::{debug, error, info, warn};

    use super::*;
    use crate::{Format, at_no_tick, at_tick};

    thread_local! {
        static WRITTEN: RefCell<String> = const { RefCell::new(String::new()) };
        static IS_FULL: Cell<bool> = const { Cell::new(false) };
    }

    fn keep(line: &[u8]) -> io::Result<()> {
        if IS_FULL.get() {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        WRITTEN.with_borrow_mut(|written| *written += std::str::from_utf8(line).unwrap());
        Ok(())
    }

    /// Returns what is logged while `work` runs.
    fn written(format: Format, robot: Option<RobotId>, filter: &str, work: impl FnOnce()) -> String {
        let settings =
            Settings { format, level: LevelFilter::WARN, robot, color: false, sink: keep, complains: false };
        let (filter, _) = Filter::parse(filter, settings.level);
        tracing::subscriber::with_default(Book::new(settings, filter), work);
        WRITTEN.take()
    }

    #[test]
    fn text_says_who_and_when_as_far_as_that_is_known() {
        let robot = RobotId::first(3).reborn();
        let lines = written(Format::Text, Some(robot), "", || {
            warn!("percept refused: {}", "no sense");
            at_tick(120);
            error!(received = 3, expected = "two", "frame is\tbroken");
            at_no_tick();
        });
        let expected = " WARN robot 3 (life 2): percept refused: no sense\n\
                        ERROR robot 3 (life 2) tick 120: frame is\\tbroken received=3 expected=two\n";
        assert_eq!(lines, expected);
        let lines = written(Format::Text, None, "info", || {
            info!("waiting");
            at_tick(0);
            warn!("gone");
            at_no_tick();
        });
        assert_eq!(lines, " INFO waiting\n WARN tick 0: gone\n");
    }

    #[test]
    fn json_has_the_same_keys_on_every_line() {
        let lines = written(Format::Json, Some(RobotId { index: 7, incarnation: 1 }), "debug", || {
            debug!("joined");
            at_tick(5);
            warn!(
                ratio = 0.5,
                worst = f64::NAN,
                whole = true,
                name = "a\"b\\c\n\u{1}",
                "é: {}",
                "\u{1b}[31m"
            );
            at_no_tick();
        });
        let lines: Vec<serde_json::Value> =
            lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        for line in &lines {
            assert!(line["unix_s"].as_f64().unwrap() > 1.7e9, "{line}");
            assert_eq!((&line["robot"], &line["incarnation"]), (&7.into(), &1.into()));
            assert!(line["run"].is_null(), "{line}");
            assert_eq!(line["target"], module_path!());
        }
        assert_eq!(lines[0]["level"], "DEBUG");
        assert!(lines[0]["tick"].is_null());
        assert_eq!(lines[0]["fields"], serde_json::json!({}));
        assert_eq!(lines[1]["tick"], 5);
        assert_eq!(lines[1]["message"], "é: \u{1b}[31m");
        let fields =
            serde_json::json!({ "ratio": 0.5, "worst": null, "whole": true, "name": "a\"b\\c\n\u{1}" });
        assert_eq!(lines[1]["fields"], fields);
    }

    #[test]
    fn what_the_filter_holds_back_is_not_written() {
        let lines = written(Format::Text, None, "error", || {
            error!("seen");
            warn!("not seen");
            tracing::error_span!("span").in_scope(|| debug!("not seen"));
        });
        assert_eq!(lines, "ERROR seen\n");
    }

    #[test]
    fn lost_lines_are_counted_and_told_before_the_next_one() {
        let lines = written(Format::Text, None, "", || {
            IS_FULL.set(true);
            warn!("first");
            warn!("second");
            IS_FULL.set(false);
            warn!("third");
            warn!("fourth");
        });
        let expected =
            " WARN 2 lines of this process are lost: nobody took them in time\n WARN third\n WARN fourth\n";
        assert_eq!(lines, expected);
    }

    #[test]
    fn a_long_line_is_cut_and_says_so_and_stays_whole_json() {
        // Characters of several bytes, and some that grow when escaped, at every offset to the limit.
        for filler in ["x", "é", "\u{1F916}", "\"", "\u{1}"] {
            for offset in 0..12 {
                let long = "o".repeat(offset) + &filler.repeat(5000);
                let work = || warn!(code = 7, long, "{long}");
                let lines = written(Format::Json, None, "", work);
                assert!(lines.len() <= crate::line::MOST_BYTES && lines.len() > 4000, "{}", lines.len());
                let line: serde_json::Value = serde_json::from_str(&lines).unwrap();
                assert_eq!(line["cut"], true);
                let message = line["message"].as_str().unwrap();
                assert!(long.starts_with(message.strip_suffix('…').unwrap()));
                let work = || warn!(code = 7, long, "short");
                let line: serde_json::Value =
                    serde_json::from_str(&written(Format::Json, None, "", work)).unwrap();
                assert_eq!(line["fields"], serde_json::json!({ "code": 7 }), "what does not fit is left out");
                assert_eq!((&line["message"], &line["cut"]), (&"short".into(), &true.into()));
                let lines = written(Format::Text, None, "", || warn!("{long}"));
                assert!(lines.len() <= crate::line::MOST_BYTES && lines.len() > 4000, "{}", lines.len());
                assert!(lines.ends_with("… [cut]\n"), "{lines}");
            }
        }
    }
}
