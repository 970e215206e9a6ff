//! The state of each agent under the plan.

/// State of an agent under the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Fate {
    /// How often it has been restarted by plan.
    pub(super) life: u32,
    pub(super) state: AgentState,
}

/// Whether an agent is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum AgentState {
    #[default]
    Up,
    /// Stopped, by this many faults.
    Paused {
        holders: u32,
    },
    Down,
}
