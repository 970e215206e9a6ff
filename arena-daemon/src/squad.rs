//! The robots of a run behind one small interface: percepts go in, commands come out.

pub mod in_process;
pub mod lockstep;
pub mod realtime;
mod roster;
mod watching;

pub use roster::HostConfig;

use std::{sync::Arc, thread, time::Instant};

use arena::fault::ProcessFault;
use protocol::{
    command::Answer,
    notes::Notes,
    percept::{Percept, Tick},
    robot_id::RobotId,
};
use serde::{Deserialize, Serialize};

use crate::{
    live::{Live, SquadStatus},
    profile::Profile,
    stop::StopFlag,
};

/// One entry per robot: its command, or `None` while its agent is silent.
pub type Answers = Vec<Option<Answer>>;

/// The agents of a run, wherever they are.
pub trait Squad {
    /// Waits until every robot is there and returns the first commands: stand still and send
    /// a first packet. May return early, with robots missing, once `stop` is raised.
    fn join_all(&mut self, stop: &StopFlag) -> Result<Answers, SquadError>;

    /// Applies to agents what the fault plan says for `tick`, the tick to come. A robot killed or paused
    /// is silent at once and gets no percepts; one resumed takes part again from the next exchange
    /// on; one restarted begins a new life, whose first command is in `answers` as soon as it
    /// has come. Robots that are left out stay so.
    fn apply_process_faults(
        &mut self,
        tick: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
    ) -> Result<(), SquadError>;

    /// Robots that are left out for good, though nobody planned it.
    fn left_out(&self) -> Vec<u32> {
        Vec::new()
    }

    /// Gives each robot its percept and puts what they answer into `answers`.
    fn exchange(&mut self, percepts: &[Percept], answers: &mut Answers) -> Result<(), SquadError>;

    /// Waits until `due`, and takes in what comes meanwhile if that is of interest.
    fn poll_until(&mut self, due: Instant) -> Result<(), SquadError> {
        thread::sleep(due.saturating_duration_since(Instant::now()));
        Ok(())
    }

    /// Returns what its agents took until now; `None` if nobody measured. Asked once, before they are dismissed.
    fn profile(&mut self) -> Option<Profile> {
        None
    }

    /// Returns the live state, for those who watch the run; `None` if nobody can.
    fn live(&self) -> Option<Arc<Live>> {
        None
    }

    /// Returns the status of its robots. What they take is measured from now on if the run is `watched`, and
    /// no longer if not.
    fn status_of_robots(&mut self, watched: bool) -> SquadStatus;

    /// Returns what robot `index` notes for those who watch, with its last answer; empty if it notes nothing.
    fn notes(&self, index: usize) -> &Notes;

    /// Ends every agent.
    fn dismiss(&mut self);

    /// Returns the status of each robot.
    fn robot_statuses(&self) -> Vec<RobotStatus>;

    /// Returns what went wrong without being planned, in order.
    fn incidents(&self) -> &[Incident] {
        &[]
    }
}

/// Status of one robot's agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobotStatus {
    /// The robot and its present life.
    pub id: RobotId,
    /// Process of its agent, if it has one.
    pub pid: Option<u32>,
    /// Whether it is neither left out nor killed by the plan.
    pub alive: bool,
    /// Whether the plan has paused it.
    pub paused: bool,
    /// Commands that were refused.
    pub refused: u64,
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

/// Why a run cannot go on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SquadError(pub String);

impl From<transport::services::ServiceError> for SquadError {
    fn from(error: transport::services::ServiceError) -> Self {
        Self(error.to_string())
    }
}
