//! A trace, read back and found to be what Chrome's Trace Event Format says.

use std::{collections::BTreeMap, fs, path::Path};

use serde_json::Value;

/// A process and a thread of it, as a trace numbers them.
pub type Track = (u64, u64);

/// The arena's.
pub const ARENA: Track = (1, 1);

/// That of a robot.
pub fn robot(index: u64) -> Track {
    (2, 1000 + index)
}

/// A trace.
#[derive(Debug)]
pub struct Trace {
    /// Metadata of the trace.
    pub other: Value,
    events: Vec<Value>,
}

impl Trace {
    /// Reads it and checks every event: it has the fields of its phase, slices nest, arrows go forward.
    ///
    /// # Panics
    /// If one is not what the format says.
    pub fn read(path: &Path) -> Self {
        let mut whole: Value =
            serde_json::from_slice(&fs::read(path).expect("a trace is there")).expect("a trace is JSON");
        assert_eq!(whole["displayTimeUnit"], "ns");
        let Value::Array(events) = whole["traceEvents"].take() else { panic!("no events") };
        let trace = Self { other: whole["otherData"].take(), events };
        trace.events.iter().for_each(has_its_fields);
        trace.slices_nest();
        trace.arrows_go_forward();
        trace
    }

    /// Events of one phase.
    pub fn of<'a>(&'a self, ph: &'a str) -> impl Iterator<Item = &'a Value> {
        self.events.iter().filter(move |event| event["ph"] == ph)
    }

    /// Events of one phase with this name.
    pub fn named<'a>(&'a self, ph: &'a str, name: &'a str) -> impl Iterator<Item = &'a Value> {
        self.of(ph).filter(move |event| event["name"] == name)
    }

    /// Ticks of the slices `name` of one track.
    ///
    /// # Panics
    /// If one of them has no tick.
    pub fn ticks(&self, of: Track, name: &str) -> Vec<u64> {
        let slices = self.named("X", name).filter(|slice| track(slice) == of);
        slices.map(|slice| slice["args"]["tick"].as_u64().expect("it has a tick")).collect()
    }

    /// Tracks with names.
    ///
    /// # Panics
    /// If one has none.
    pub fn tracks(&self) -> BTreeMap<Track, &str> {
        let names = self.named("M", "thread_name");
        names.map(|event| (track(event), event["args"]["name"].as_str().expect("it is a name"))).collect()
    }

    /// Of two slices of one track, one lies in the other or follows it.
    fn slices_nest(&self) {
        let mut tracks = BTreeMap::<Track, Vec<(u64, u64)>>::new();
        for slice in self.of("X") {
            let begin = ns(&slice["ts"]);
            tracks.entry(track(slice)).or_default().push((begin, begin + ns(&slice["dur"])));
        }
        let named = self.tracks();
        for (track, mut slices) in tracks {
            assert!(named.contains_key(&track), "{track:?} has no name");
            slices.sort_by_key(|&(begin, end)| (begin, u64::MAX - end));
            let mut open: Vec<(u64, u64)> = Vec::new();
            for (begin, end) in slices {
                open.retain(|around| around.1 > begin);
                let fits = open.last().is_none_or(|around| end <= around.1);
                assert!(fits, "{track:?}: {begin}..{end} overlaps {open:?}");
                open.push((begin, end));
            }
        }
    }

    /// Each arrow that ends has begun before, once, in a stage that publishes; and it ends in one that receives.
    fn arrows_go_forward(&self) {
        let mut stages = BTreeMap::<(Track, &str), Vec<(u64, u64)>>::new();
        for slice in self.of("X") {
            let begin = ns(&slice["ts"]);
            let spans = stages
                .entry((track(slice), slice["name"].as_str().expect("a slice has a name")))
                .or_default();
            spans.push((begin, begin + ns(&slice["dur"])));
        }
        let lies_in = |event: &Value, stage| {
            let at = ns(&event["ts"]);
            stages[&(track(event), stage)].iter().any(|&(begin, end)| begin <= at && at <= end)
        };
        let mut begun = BTreeMap::new();
        for event in self.of("s") {
            assert!(lies_in(event, "publish"), "{event}");
            assert_eq!(begun.insert(event["id"].as_u64(), ns(&event["ts"])), None, "{event}");
        }
        for event in self.of("f") {
            assert!(lies_in(event, "receive"), "{event}");
            let sent = begun.remove(&event["id"].as_u64()).expect("what arrives has begun, and arrives once");
            assert!(sent <= ns(&event["ts"]), "{event} was sent at {sent} ns");
        }
        assert_eq!(begun.len(), 0, "all arrive");
    }
}

/// Where an event is.
///
/// # Panics
/// If it is on no track.
pub fn track(event: &Value) -> Track {
    let id = |key: &str| event[key].as_u64().expect("an event on a track has its numbers");
    (id("pid"), id("tid"))
}

/// Microseconds of the file as whole nanoseconds.
fn ns(us: &Value) -> u64 {
    (us.as_f64().expect("a time is a number") * 1e3).round() as u64
}

/// Asserts that an event has the fields of its phase.
fn has_its_fields(event: &Value) {
    let has = |key: &str, is: fn(&Value) -> bool| assert!(is(&event[key]), "{key} of {event}");
    has("name", Value::is_string);
    has("pid", Value::is_u64);
    let ph = event["ph"].as_str().expect("an event has a phase");
    if ph == "M" {
        let known = ["process_name", "process_sort_index", "thread_name", "thread_sort_index"];
        assert!(known.iter().any(|name| event["name"] == *name), "{event}");
        has("args", Value::is_object);
        return;
    }
    has("tid", Value::is_u64);
    has("ts", |ts| ts.as_f64().is_some_and(|ts| ts >= 0.0));
    match ph {
        "X" => has("dur", |dur| dur.as_f64().is_some_and(|dur| dur >= 0.0)),
        "s" | "f" => {
            has("id", Value::is_u64);
            has("cat", Value::is_string);
            assert!(ph == "s" || event["bp"] == "e", "{event}");
        }
        "i" => {
            has("s", |scope| ["t", "g"].iter().any(|known| scope == known));
            has("args", Value::is_object);
        }
        _ => panic!("{event}"),
    }
}
