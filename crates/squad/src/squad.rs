//! The interface of a squad, and what is said across it.

use std::{thread, time::Instant};

use profile::CycleTimes;
use protocol::{
    command::Answer,
    notes::Notes,
    percept::{Percept, Tick},
    property::Property,
    robot_id::RobotId,
};
use scenario::ProcessFault;
use serde::{Deserialize, Serialize};

use crate::{status::RobotStatus, stop::StopFlag, waiting::Waiting};

/// One entry per robot of the run: its command, or `None` while its agent is silent.
pub type Answers = [Option<Answer>];

/// Takes word of who is waited for, again and again while that goes on; `None` once it is nobody.
pub type WaitingSink<'a> = dyn FnMut(Option<Waiting>) + 'a;

/// Robots of a run, wherever they are: all of them, or some.
///
/// Percepts and answers come in slices with one entry per robot of the run, by index. A squad reads and writes the
/// entries of its own robots, and leaves the others alone.
pub trait Squad {
    /// Waits until every robot is there and writes the first commands: stand still and send
    /// a first packet. May return early, with robots missing, once `stop` is raised.
    ///
    /// # Errors
    /// If the run cannot begin.
    fn join_all(
        &mut self,
        answers: &mut Answers,
        stop: &StopFlag,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError>;

    /// Applies to agents what the fault plan says for `tick`, the tick to come. A robot killed or paused
    /// is silent at once and gets no percepts; one resumed takes part again from the next exchange
    /// on; one restarted begins a new life, whose first command is in `answers` as soon as it
    /// has come. Robots that are left out stay so. Faults of others' robots are passed over.
    ///
    /// # Errors
    /// If the run cannot go on.
    fn apply_process_faults(
        &mut self,
        tick: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError>;

    /// Returns the robots that are left out for good, though nobody planned it.
    fn left_out(&self) -> Vec<u32> {
        Vec::new()
    }

    /// Gives each robot its percept and sets it to work.
    ///
    /// # Errors
    /// If the run cannot go on.
    fn send(&mut self, percepts: &[Percept]) -> Result<(), SquadError>;

    /// Puts what robots answer to the percepts that were sent last into `answers`.
    ///
    /// # Errors
    /// If the run cannot go on.
    fn collect(&mut self, answers: &mut Answers, waiting: &mut WaitingSink<'_>) -> Result<(), SquadError>;

    /// Waits until `due`, and takes in what comes meanwhile if that is of interest.
    ///
    /// # Errors
    /// If the run cannot go on.
    fn poll_until(&mut self, due: Instant, waiting: &mut WaitingSink<'_>) -> Result<(), SquadError> {
        let _ = waiting;
        thread::sleep(due.saturating_duration_since(Instant::now()));
        Ok(())
    }

    /// Returns the time by the clock that its agents are measured by, nanoseconds since all had joined; `None` if
    /// nobody measures them. [`CycleTimes`] count by the same.
    fn now_ns(&self) -> Option<u64> {
        None
    }

    /// Moves whole cycles that have become known to the end of `cycles`, those of a robot in their order; all that are
    /// left once it is dismissed. None unless somebody has asked for them when the squad was made.
    fn take_cycles(&mut self, cycles: &mut Vec<CycleTimes>) {
        let _ = cycles;
    }

    /// Moves what went wrong without being planned to the end of `incidents`, in order.
    fn take_incidents(&mut self, incidents: &mut Vec<Incident>) {
        let _ = incidents;
    }

    /// Returns what a robot notes for those who watch, with its last answer; `None` of others' robots.
    fn notes(&self, robot: u32) -> Option<&Notes>;

    /// Takes what the controllers of its robots have stated, by life: asked once the run is over. None of a robot that has
    /// stated nothing.
    fn take_properties(&mut self) -> Vec<(RobotId, Vec<Property>)>;

    /// Returns the status of each of its robots, by index.
    fn robot_statuses(&self) -> Vec<RobotStatus>;

    /// Ends every agent, and completes what was measured of them.
    fn dismiss(&mut self);
}

/// Something unplanned that happened to a robot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Incident {
    /// Index of the robot.
    pub robot: u32,
    /// The tick it happened in.
    pub tick: u64,
    /// The event and what was done about it.
    pub what: String,
}

/// Reason why a run cannot go on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SquadError(pub String);

impl SquadError {
    /// In the words of what has failed.
    pub fn new(error: impl ToString) -> Self {
        Self(error.to_string())
    }
}
