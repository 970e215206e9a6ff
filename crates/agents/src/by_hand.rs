//! Robots that are driven by hand: who waits to be started, and by which command.

use std::{collections::BTreeMap, io, mem, time::Duration};

use scenario::RobotSet;
use squad::moment::Moment;
use transport::run_dir::{ByHand, RunDir};

/// Time between two lines that tell which robots wait to be started by hand: whoever is busy with a debugger should
/// not have to look for it, nor be disturbed.
const CALL_EVERY: Duration = Duration::from_secs(30);

/// Calls for those who start agents by hand: in the run's folder, and now and then in the log.
#[derive(Debug)]
pub(crate) struct HandCalls {
    /// As the run's folder tells.
    robots: Vec<ByHand>,
    /// When somebody was last called.
    called: Option<Moment>,
}

impl HandCalls {
    /// Tells the folder of `run` of `robots`. Nobody is called yet.
    pub(crate) fn begin(run: &RunDir, robots: Vec<ByHand>) -> io::Result<Self> {
        run.tell_by_hand(&robots)?;
        Ok(Self { robots, called: None })
    }

    /// Robots as the folder tells of them.
    pub(crate) fn robots(&self) -> &[ByHand] {
        &self.robots
    }

    /// Tells the folder of `run` that it is `robots` now.
    pub(crate) fn change(&mut self, run: &RunDir, robots: Vec<ByHand>) {
        let known = mem::replace(&mut self.robots, robots);
        // Who is fewer than before need not be called again.
        if self.robots.iter().any(|robot| robot.is_awaited && !known.contains(robot)) {
            self.called = None;
        }
        if let Err(error) = run.tell_by_hand(&self.robots) {
            tracing::warn!("agents started by hand cannot be told what they may join: {error}");
        }
    }

    /// Tells whoever reads the log which robots wait to be started, if some do and it is time to. They are waited
    /// for as long as `patience`, or without limit.
    pub(crate) fn call(&mut self, run: &RunDir, patience: Option<Duration>) {
        if self.called.is_some_and(|called| called.elapsed() < CALL_EVERY) {
            return;
        }
        self.called = Some(Moment::now());
        let within = patience.map_or(String::new(), |patience| format!(" within {patience:?}"));
        let name = run.name();
        // Those whose commands differ by the number of the robot alone.
        let mut alike = BTreeMap::<(&str, u16), Vec<&ByHand>>::new();
        for robot in self.robots.iter().filter(|robot| robot.is_awaited) {
            alike.entry((&robot.program, robot.id.incarnation)).or_default().push(robot);
        }
        for ((program, _), awaited) in alike {
            let set = RobotSet::of(awaited.iter().map(|robot| robot.id.index)).expect("one is awaited");
            let (robots, each) =
                if awaited.len() == 1 { ("robot", "") } else { ("robots", ", each by its number") };
            let command = name.agent_command(program, awaited[0].id);
            // A warning, because without a hand the run stands, with --quiet too.
            tracing::warn!(
                "run `{name}` waits for {robots} {set} to be started by hand{within}{each}: {command}"
            );
        }
    }
}
