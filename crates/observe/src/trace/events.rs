//! Events of the Trace Event Format, as text.
//!
//! In:  nanoseconds since all agents had joined.
//! Out: JSON objects, each with a comma before it: something is always written before them. Times are microseconds
//!      with three decimals, so no nanosecond is lost.

use std::{fmt, io::Write};

use protocol::percept::Tick;

/// A row of the viewer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Track {
    pid: u32,
    tid: u32,
}

impl Track {
    /// The arena's own.
    pub(super) const ARENA: Self = Self { pid: 1, tid: 1 };

    /// That of one robot, whatever life it is in.
    ///
    /// To Perfetto a thread has the same number in no other process, 0 is the idle one, and a thread with the number
    /// of its process comes before all others. So robots have numbers of their own.
    pub(super) fn robot(index: u32) -> Self {
        Self { pid: 2, tid: 1000 + index }
    }
}

/// Tracks on which an instant is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scope {
    /// Its track.
    Track,
    /// All tracks.
    All,
}

/// Events that have not been written to the file yet.
#[derive(Debug, Default)]
pub(super) struct Events {
    text: Vec<u8>,
    cuts: Vec<Cut>,
}

/// The end of events that belong together, as both ends of an arrow do: on a full disk all of them are kept, or none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// Where it is, bytes.
    pub(super) end: usize,
    /// The tick of the agent's cycle that they are, if they are one.
    pub(super) cycle: Option<Tick>,
}

impl Events {
    /// As bytes.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.text
    }

    /// Where they may be cut, in their order.
    pub(super) fn cuts(&self) -> &[Cut] {
        &self.cuts
    }

    /// Makes what follows the first so many `cuts` one agent's cycle in `tick`.
    pub(super) fn join_cycle(&mut self, cuts: usize, tick: Tick) {
        self.cuts.truncate(cuts);
        self.cuts.push(Cut { end: self.text.len(), cycle: Some(tick) });
    }

    /// How many bytes.
    pub(super) fn length(&self) -> u64 {
        self.text.len() as u64
    }

    /// Forgets them.
    pub(super) fn clear(&mut self) {
        self.text.clear();
        self.cuts.clear();
    }

    /// The name of a process.
    pub(super) fn name_process(&mut self, Track { pid, .. }: Track, name: &str) {
        self.add(format_args!(
            r#"{{"ph":"M","pid":{pid},"name":"process_name","args":{{"name":"{name}"}}}}"#
        ));
        self.add(format_args!(
            r#"{{"ph":"M","pid":{pid},"name":"process_sort_index","args":{{"sort_index":{pid}}}}}"#
        ));
    }

    /// The name of a track, and its place among those of its process.
    pub(super) fn name_track(&mut self, track: Track, name: impl fmt::Display) {
        let Track { pid, tid } = track;
        self.add(format_args!(
            r#"{{"ph":"M","pid":{pid},"tid":{tid},"name":"thread_name","args":{{"name":"{name}"}}}}"#
        ));
        self.add(format_args!(
            r#"{{"ph":"M","pid":{pid},"tid":{tid},"name":"thread_sort_index","args":{{"sort_index":{tid}}}}}"#
        ));
    }

    /// Something that took time.
    pub(super) fn slice(&mut self, track: Track, name: &str, begin_ns: u64, end_ns: u64) {
        let (at, dur) = (At(track, begin_ns), Us(end_ns - begin_ns));
        self.add(format_args!(r#"{{"ph":"X",{at},"dur":{dur},"name":"{name}"}}"#));
    }

    /// Something that took time, in `tick`.
    pub(super) fn slice_of_tick(&mut self, track: Track, name: &str, tick: Tick, begin_ns: u64, end_ns: u64) {
        let (at, dur) = (At(track, begin_ns), Us(end_ns - begin_ns));
        self.add(format_args!(r#"{{"ph":"X",{at},"dur":{dur},"name":"{name}","args":{{"tick":{tick}}}}}"#));
    }

    /// A packet on its way. `id` is of no other packet.
    pub(super) fn packet(&mut self, id: u64, (sender, sent_ns): (Track, u64), (receiver, ns): (Track, u64)) {
        let (sent, received) = (At(sender, sent_ns), At(receiver, ns));
        self.add_part(format_args!(r#"{{"ph":"s",{sent},"id":{id},"cat":"packet","name":"packet"}}"#));
        self.add(format_args!(
            r#"{{"ph":"f","bp":"e",{received},"id":{id},"cat":"packet","name":"packet"}}"#
        ));
    }

    /// Something that happened. `args` is a JSON object.
    pub(super) fn instant(
        &mut self,
        scope: Scope,
        track: Track,
        at_ns: u64,
        category: &str,
        name: &str,
        args: &serde_json::Value,
    ) {
        let at = At(track, at_ns);
        let scope = match scope {
            Scope::Track => "t",
            Scope::All => "g",
        };
        self.add(format_args!(
            r#"{{"ph":"i","s":"{scope}",{at},"cat":"{category}","name":"{name}","args":{args}}}"#
        ));
    }

    fn add(&mut self, event: fmt::Arguments<'_>) {
        self.add_part(event);
        self.cuts.push(Cut { end: self.text.len(), cycle: None });
    }

    /// Adds an event that belongs to the next one.
    fn add_part(&mut self, event: fmt::Arguments<'_>) {
        self.text.extend_from_slice(b",\n");
        self.text.write_fmt(event).expect("memory takes all that is written to it");
    }
}

/// A moment on a track.
struct At(Track, u64);

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(Track { pid, tid }, ns) = self;
        write!(f, r#""pid":{pid},"tid":{tid},"ts":{}"#, Us(*ns))
    }
}

/// Nanoseconds, written as microseconds.
struct Us(u64);

impl fmt::Display for Us {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:03}", self.0 / 1000, self.0 % 1000)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    #[test]
    fn events_are_what_the_format_says() {
        let mut events = Events::default();
        let robot = Track::robot(17);
        events.name_process(robot, "robots");
        events.name_track(robot, "robot 17");
        events.slice_of_tick(robot, "cycle", 3, 1_000_007, 1_250_000);
        events.slice(robot, "cell", 1_000_007, 1_000_007);
        events.packet(9, (robot, 1_249_999), (Track::robot(0), 2_000_000));
        events.instant(
            Scope::Track,
            robot,
            5,
            "incident",
            "incident",
            &json!({ "what": "a \"quoted\" word" }),
        );
        events.instant(Scope::All, Track::ARENA, 5, "fault", "loss", &json!({ "tick": 3 }));
        let text = [b"[0", events.bytes(), b"]"].concat();
        let read: Vec<Value> = serde_json::from_slice(&text).unwrap();
        let expected = json!([
            0,
            { "ph": "M", "pid": 2, "name": "process_name", "args": { "name": "robots" } },
            { "ph": "M", "pid": 2, "name": "process_sort_index", "args": { "sort_index": 2 } },
            { "ph": "M", "pid": 2, "tid": 1017, "name": "thread_name", "args": { "name": "robot 17" } },
            { "ph": "M", "pid": 2, "tid": 1017, "name": "thread_sort_index", "args": { "sort_index": 1017 } },
            { "ph": "X", "pid": 2, "tid": 1017, "ts": 1000.007, "dur": 249.993, "name": "cycle", "args": { "tick": 3 } },
            { "ph": "X", "pid": 2, "tid": 1017, "ts": 1000.007, "dur": 0.0, "name": "cell" },
            { "ph": "s", "pid": 2, "tid": 1017, "ts": 1249.999, "id": 9, "cat": "packet", "name": "packet" },
            { "ph": "f", "bp": "e", "pid": 2, "tid": 1000, "ts": 2000.0, "id": 9, "cat": "packet", "name": "packet" },
            { "ph": "i", "s": "t", "pid": 2, "tid": 1017, "ts": 0.005, "cat": "incident", "name": "incident",
              "args": { "what": "a \"quoted\" word" } },
            { "ph": "i", "s": "g", "pid": 1, "tid": 1, "ts": 0.005, "cat": "fault", "name": "loss",
              "args": { "tick": 3 } },
        ]);
        assert_eq!(Value::from(read), expected);
    }
}
