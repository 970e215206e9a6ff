//! One robot's agent as the arena knows it: its life, its process, its state.

use processes::Process;
use protocol::{command::Answer, notes::Notes, percept::Tick, robot_id::RobotId, setup::Plane};
use squad::{Participation, SquadError, moment::Moment};
use transport::services::{ArenaPorts, Session};

/// Content of an uplink.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Heard {
    /// Nothing of use.
    Nothing,
    /// A command, and the tick it answers.
    Command(Tick, Answer),
    /// An answer that cannot be carried out: the robot stands still and is silent.
    Refused,
}

/// One robot's agent.
#[derive(Debug)]
pub(crate) struct Member {
    pub(crate) id: RobotId,
    pub(crate) ports: Option<ArenaPorts>,
    pub(crate) process: Option<Process>,
    pub(crate) state: AgentState,
    pub(crate) refused: u64,
    /// Whether a life of it has joined.
    pub(crate) has_joined: bool,
    /// Lives in a row that have ended before they joined, or never did.
    pub(crate) stillborn: u32,
    /// When its process was first found dead, while nobody has said how it ended.
    pub(crate) found_dead: Option<Moment>,
    /// Its notes for those who watch, with its last command.
    pub(crate) notes: Notes,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum AgentState {
    /// Its services stand since then; nobody has come yet.
    Expected { since: Moment },
    /// It takes part.
    Present,
    /// The plan has stopped it; it may not have come before that.
    Paused { joined: bool },
    /// The plan has killed it.
    Down,
    /// It is left out for good, unplanned.
    Out,
}

impl Member {
    /// A robot whose agent may come.
    pub(crate) fn hosted(
        session: &Session,
        plane: Plane,
        payload_bytes_max: usize,
        id: RobotId,
    ) -> Result<Self, SquadError> {
        let ports = Some(session.host(id, plane, payload_bytes_max).map_err(SquadError::new)?);
        Ok(Self {
            id,
            ports,
            process: None,
            state: AgentState::expected(),
            refused: 0,
            has_joined: false,
            stillborn: 0,
            found_dead: None,
            notes: Notes::default(),
        })
    }

    pub(crate) fn is_expected(&self) -> bool {
        matches!(self.state, AgentState::Expected { .. })
    }

    pub(crate) fn named(&self) -> String {
        match self.process {
            Some(process) => format!("{} (pid {})", self.id, process.pid()),
            None => self.id.to_string(),
        }
    }
}

impl AgentState {
    /// From now on.
    pub(crate) fn expected() -> Self {
        Self::Expected { since: Moment::now() }
    }
}

impl From<AgentState> for Participation {
    fn from(state: AgentState) -> Self {
        match state {
            AgentState::Expected { .. } | AgentState::Paused { joined: false } => Self::Expected,
            AgentState::Present => Self::Present,
            AgentState::Paused { joined: true } => Self::Paused,
            AgentState::Down => Self::Down,
            AgentState::Out => Self::Out,
        }
    }
}
