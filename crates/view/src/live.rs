//! A run under way, as a source of what is shown.

use std::{
    io::ErrorKind,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use engine::act::{Done, Refused};
use observe::live::{acts, socket, stream};
use processes::cpu::Cpu;
use scenario::Scenario;
use transport::run_dir::RunDir;

use crate::{
    session::{Hub, Show, Source},
    swarm::{About, Swarm},
    wire::{EventKind, PageAct},
};

/// Between two looks at how the run goes.
const LOOK: Duration = Duration::from_millis(250);
/// Between two looks at what its agents take.
const LOOK_AT_CPU: Duration = Duration::from_secs(1);
/// Between two tries to reach an arena that has not begun.
const TRY_AGAIN: Duration = Duration::from_millis(20);

struct Live {
    run: RunDir,
    hub: Hub,
}

/// Shows the run in `run`, which is of `scenario`, or is about to be.
///
/// # Errors
/// If no thread can be made for it.
pub fn live(run: RunDir, scenario: Scenario, about: About) -> std::io::Result<Show> {
    let source = Arc::new(Live { run, hub: Hub::new(Swarm::new(about, scenario)) });
    let (told, looking) = (Arc::clone(&source), Arc::clone(&source));
    thread::Builder::new().name("told".into()).spawn(move || told.listen())?;
    thread::Builder::new().name("look".into()).spawn(move || looking.look())?;
    Ok(Show(source))
}

impl Live {
    /// Takes in what the arena tells, to its end.
    fn listen(&self) {
        let mut told = loop {
            match stream::watch(&self.run.watch_path()) {
                Ok(told) => break told,
                Err(error) if error.kind() == ErrorKind::NotFound && self.is_there() => {
                    thread::sleep(TRY_AGAIN);
                }
                Err(error) => return self.over(&format!("the run cannot be watched: {error}")),
            }
        };
        loop {
            match told.next_entry() {
                Ok(Some(entry)) => {
                    if let Err(error) = self.hub.swarm().apply(&entry) {
                        tracing::warn!("what the arena tells is not understood: {error}");
                    }
                }
                Ok(None) => return self.over("the arena has ended"),
                Err(error) => return self.over(&format!("the arena tells no more: {error}")),
            }
        }
    }

    /// Looks at how the run goes, a few times a second, until it is over.
    fn look(&self) {
        let (mut cpu, mut looked) = (Cpu::default(), None::<Instant>);
        while !self.hub.swarm().is_over {
            if let Ok(snapshot) = socket::ask(&self.run.live_path()) {
                if looked.is_none_or(|looked| looked.elapsed() >= LOOK_AT_CPU) {
                    looked = Some(Instant::now());
                    let pids =
                        || snapshot.robots.iter().filter_map(|robot| Some((robot.id.index, robot.pid?)));
                    let shares = cpu.shares(pids().map(|(_, pid)| pid));
                    let of_robots = pids().filter_map(|(robot, pid)| Some((robot, *shares.get(&pid)?)));
                    let of_robots = of_robots.collect();
                    self.hub.swarm().cpu = of_robots;
                }
                self.hub.swarm().look(snapshot);
            }
            thread::sleep(LOOK);
        }
    }

    /// Whether the run has a folder still.
    fn is_there(&self) -> bool {
        self.run.path().is_dir()
    }

    /// No more is told.
    fn over(&self, why: &str) {
        let mut swarm = self.hub.swarm();
        if !swarm.is_over {
            let time_s = swarm.time_s;
            swarm.add_event(time_s, EventKind::End, why.into());
            swarm.is_over = true;
        }
    }
}

impl Source for Live {
    fn hub(&self) -> &Hub {
        &self.hub
    }

    fn act(&self, act: PageAct) -> Result<Done, Refused> {
        match act {
            PageAct::Seek(_) => Err("a run under way cannot go to another time".into()),
            PageAct::Run(act) => match acts::ask(&self.run.acts_path(), &act) {
                Ok(outcome) => outcome,
                Err(_) if self.hub.swarm().is_over => Err("the run is over".into()),
                Err(error) => Err(format!("the run cannot be asked: {error}")),
            },
        }
    }
}
