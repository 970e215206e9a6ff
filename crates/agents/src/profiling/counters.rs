//! Counters of the processor, for each agent: where the machine has them, we may read them, and descriptors last.

use std::{fs, io};

use perf_event::{Builder, Counter, events::Hardware};
use profile::Counted;
use rustix::process::{Resource, getrlimit};

use processes::Process;

/// Counters that run.
#[derive(Debug)]
pub(super) struct Counters {
    /// By robot.
    agents: Vec<Option<Agent>>,
    told: String,
}

#[derive(Debug)]
struct Agent {
    process: Process,
    counters: [Counter; EVENTS.len()],
}

/// In the order of [`Counted`].
const EVENTS: [Hardware; 2] = [Hardware::INSTRUCTIONS, Hardware::CPU_CYCLES];

impl Counters {
    /// Begins to count for `processes`, those of all robots. For all of them, or for none: then
    /// [`Counters::told`] says why.
    pub(super) fn open(processes: &[Option<Process>]) -> Self {
        let open = || -> Result<Vec<Option<Agent>>, String> {
            let count = |process: &Process| {
                Agent::count(*process, EVENTS).map_err(|error| format!("cannot be opened: {error}"))
            };
            if processes.iter().all(Option::is_none) {
                return Err("no process of theirs can be seen".into());
            }
            let mut processes = processes.iter().map(Option::as_ref);
            // The first one tells whether the machine has counters at all, the rest whether there is room.
            let first = processes.next().into_iter().map(|process| process.map(count).transpose());
            let first = first.collect::<Result<Vec<_>, _>>()?;
            let rest = processes.len() as u64;
            room_for(rest * EVENTS.len() as u64)?;
            let rest = processes.map(|process| process.map(count).transpose());
            first.into_iter().map(Ok).chain(rest).collect()
        };
        match open() {
            Ok(agents) => Self { agents, told: "instructions and cycles in user space".into() },
            Err(reason) => Self { agents: Vec::new(), told: format!("none ({reason})") },
        }
    }

    /// Which counters are read; or why none.
    pub(super) fn told(&self) -> &str {
        &self.told
    }

    /// Reads the counters of robot `index`, if it is still in the life that it had at the beginning.
    pub(super) fn read(&mut self, index: usize, process: Process) -> Option<Counted> {
        let agent = self.agents.get_mut(index)?.as_mut()?;
        let [instructions, core_cycles] =
            if agent.process == process { agent.read().ok()? } else { return None };
        Some(Counted { instructions, core_cycles })
    }
}

impl Agent {
    fn count(process: Process, events: [Hardware; EVENTS.len()]) -> io::Result<Self> {
        let [first, second] = events.map(|event| {
            let mut counter = Builder::new(event).observe_pid(process.pid() as i32).build()?;
            counter.enable()?;
            Ok::<_, io::Error>(counter)
        });
        Ok(Self { process, counters: [first?, second?] })
    }

    fn read(&mut self) -> io::Result<[u64; EVENTS.len()]> {
        let [first, second] = &mut self.counters;
        Ok([first.read()?, second.read()?])
    }
}

/// Whether so many more descriptors leave half of what is free for restarts.
fn room_for(descriptors: u64) -> Result<(), String> {
    let held = fs::read_dir("/proc/self/fd").map_or(0, Iterator::count) as u64;
    let free = getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX).saturating_sub(held);
    match descriptors <= free / 2 {
        true => Ok(()),
        false => Err(format!("they need {descriptors} descriptors, {free} are free")),
    }
}

#[cfg(test)]
mod tests {
    use std::process::id;

    use super::*;

    #[test]
    fn counters_count_or_say_why_not() {
        let us = Process::find(id()).unwrap();
        let mut counters = Counters::open(&[None, Some(us)]);
        let work = (0..100_000_u64).map(std::hint::black_box).sum::<u64>();
        assert!(std::hint::black_box(work) > 0);
        let counted = counters.read(1, us);
        match counters.told().strip_prefix("none (") {
            Some(reason) => assert!(reason.len() > 1 && counted.is_none(), "{reason}"),
            None => assert!(counted.unwrap().core_cycles > 0, "{counted:?}"),
        }
        assert_eq!(counters.read(0, us), None);
        assert_eq!(counters.read(7, us), None);
    }

    #[test]
    fn nobody_is_not_counted() {
        assert_eq!(Counters::open(&[None, None]).told(), "none (no process of theirs can be seen)");
    }

    #[test]
    fn too_many_descriptors_are_refused() {
        assert!(room_for(0).is_ok());
        assert!(room_for(1 << 62).unwrap_err().contains("4611686018427387904 descriptors"));
    }
}
