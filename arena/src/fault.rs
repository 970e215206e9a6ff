//! The fault plan: what goes wrong, to whom, and at which tick.

/// Something the plan does to an agent's process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strike {
    /// Index of the robot.
    pub robot: u32,
    /// What happens to its agent.
    pub act: Act,
}

/// What can happen to an agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// It is killed, and its memory with it.
    Kill,
    /// A new life of it begins, without memory.
    Restart,
    /// It is stopped.
    Pause,
    /// It goes on.
    Resume,
}
