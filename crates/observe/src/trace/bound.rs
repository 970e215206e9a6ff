//! Whole ticks, as long as there is room for them.
//!
//! Cycles are known some neighbor cycles later than the arena's tick that they belong to. So when the file is nearly
//! full, the present tick and all later ones are left out, while cycles of earlier ticks still find the room that was
//! kept for them.

use std::mem;

use files::WriteError;
use protocol::percept::Tick;
use serde_json::{Value, json};

use super::{
    events::{Events, Scope, Track},
    file::{Lost, TraceFile},
};

/// Neighbor cycles that a robot's cycle may come late: in real time four percepts may be unanswered, and the next
/// command is needed as well.
const LATE_CYCLES: u64 = 6;
/// Kept for the mark where the trace is full, and for larger numbers in what is said at the end: less than half of
/// this, in bytes.
const MARGIN: u64 = 512;

/// A file, and what of a run still fits into it.
#[derive(Debug)]
pub(super) struct Bound {
    file: TraceFile,
    /// Most bytes of cycles that have come in one tick.
    cycles_bytes_max: u64,
    left_out_from: Option<Tick>,
    cycles_left_out: u64,
    /// Why the file cannot be written any more.
    broken: Option<WriteError>,
}

/// Cycles that have come, as events, and how many they are.
#[derive(Debug, Default)]
pub(super) struct Cycles {
    pub(super) events: Events,
    pub(super) count: u64,
}

/// Facts about a trace that is not full.
pub(super) fn about_left_out() -> [(String, Value); 2] {
    [("first_tick_left_out".into(), Value::Null), ("cycles_left_out".into(), 0.into())]
}

impl Bound {
    pub(super) fn new(file: TraceFile) -> Self {
        Self { file, cycles_bytes_max: 0, left_out_from: None, cycles_left_out: 0, broken: None }
    }

    /// Whether nothing of `tick` is kept any more.
    pub(super) fn leaves_out(&self, tick: Tick) -> bool {
        self.left_out_from.is_some_and(|from| tick >= from)
    }

    /// One more cycle is not kept.
    pub(super) fn leave_out_a_cycle(&mut self) {
        self.cycles_left_out += 1;
    }

    /// Keeps the arena's events of `tick`, which ends now, and cycles of earlier ticks, if there is room; forgets
    /// them in any case.
    pub(super) fn keep(&mut self, tick: Tick, now_ns: u64, arena: &mut Events, cycles: &mut Cycles) {
        self.cycles_bytes_max = self.cycles_bytes_max.max(cycles.events.length());
        let under_way = LATE_CYCLES * self.cycles_bytes_max;
        let needed = arena.length() + cycles.events.length() + under_way + MARGIN;
        let is_full = self.left_out_from.is_none() && needed > self.file.room();
        self.keep_cycles(tick, now_ns, cycles);
        if is_full {
            self.cut(tick, now_ns);
        }
        if !self.leaves_out(tick) {
            self.add(tick, arena);
        }
        arena.clear();
    }

    /// Keeps cycles of ticks before or at `tick`, if there is room; forgets them in any case.
    pub(super) fn keep_cycles(&mut self, tick: Tick, now_ns: u64, cycles: &mut Cycles) {
        let count = mem::take(&mut cycles.count);
        if self.broken.is_none() && cycles.events.length() + MARGIN <= self.file.room() {
            self.add(tick, &cycles.events);
        } else {
            // More of them have come than room was kept for, or there is no room at all.
            self.cycles_left_out += count;
            self.cut(tick, now_ns);
        }
        cycles.events.clear();
    }

    /// From `tick` on everything is left out, if nothing is so far.
    fn cut(&mut self, tick: Tick, now_ns: u64) {
        if self.left_out_from.is_some() {
            return;
        }
        self.left_out_from = Some(tick);
        let mut mark = Events::default();
        let args = json!({ "tick": tick });
        mark.instant(Scope::All, Track::ARENA, now_ns, "trace", "the trace is full", &args);
        self.add(tick, &mark);
        self.file.say("first_tick_left_out", tick);
        tracing::warn!(
            "the trace is full: from tick {tick} on everything is left out (--trace-max-mb makes it longer, \
             --trace-robots picks fewer robots)"
        );
    }

    /// Nothing more comes.
    ///
    /// # Errors
    /// If the trace ends early, because it could not be written.
    pub(super) fn finish(&mut self) -> Result<(), WriteError> {
        self.file.say("cycles_left_out", self.cycles_left_out);
        let written = self.file.write();
        if self.broken.is_none() {
            self.see(written);
        }
        match self.broken.take() {
            Some(error) => Err(error),
            None => {
                let (path, kb) = (self.file.path().display(), self.file.length() / 1000);
                tracing::info!("trace: {path} ({kb} kB)");
                Ok(())
            }
        }
    }

    /// Adds events of `tick`, and of cycles before it.
    fn add(&mut self, tick: Tick, events: &Events) {
        if self.broken.is_some() {
            return;
        }
        let written = self.file.add(tick, events.bytes(), events.cuts());
        self.see(written);
    }

    /// Sees whether the file can still be written, and what is lost if it cannot.
    fn see(&mut self, written: Result<(), (WriteError, Lost)>) {
        let Err((error, lost)) = written else { return };
        tracing::warn!("the trace ends here: {error}");
        self.broken = Some(error);
        self.cycles_left_out += lost.cycles;
        self.file.say("cycles_left_out", self.cycles_left_out);
        if let Some(tick) = lost.first_tick {
            let from = self.left_out_from.map_or(tick, |from| from.min(tick));
            self.left_out_from = Some(from);
            self.file.say("first_tick_left_out", from);
        }
        // Where this has no room, the trace is whole without it.
        let _ = self.file.write();
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::Map;

    use super::*;

    #[test]
    fn more_cycles_than_room_was_kept_for_are_left_out_and_counted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trace.json");
        let about = Map::from_iter(about_left_out());
        let mut bound = Bound::new(TraceFile::begin(&path, 20_000, "0", about).unwrap());
        let mut arena = Events::default();
        let mut cycles_of = |count: u64, tick| {
            let mut cycles = Cycles { count, ..Cycles::default() };
            (0..count).for_each(|_| cycles.events.slice(Track::robot(0), "cycle", 0, 1));
            arena.slice(Track::ARENA, "tick", 0, 1);
            bound.keep(tick, 0, &mut arena, &mut cycles);
            assert!(arena.bytes().is_empty() && cycles.events.bytes().is_empty() && cycles.count == 0);
        };
        (0..10).for_each(|tick| cycles_of(2, tick));
        cycles_of(1000, 10);
        cycles_of(2, 11);
        bound.finish().unwrap();
        let text = fs::read(&path).unwrap();
        let whole: Value = serde_json::from_slice(&text).unwrap();
        assert_eq!(whole["otherData"], json!({ "first_tick_left_out": 10, "cycles_left_out": 1000 }));
        let events = whole["traceEvents"].as_array().unwrap();
        let count = |name| events.iter().filter(|event| event["name"] == name).count();
        assert_eq!((count("cycle"), count("tick"), count("the trace is full")), (22, 10, 1));
        assert!(text.len() <= 20_000, "{}", text.len());
    }
}
