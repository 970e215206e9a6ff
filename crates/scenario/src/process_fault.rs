//! Effects of a fault plan on agents' processes: all that whoever runs them must know of it.

/// Something the plan does to an agent's process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessFault {
    /// Index of the robot.
    pub robot: u32,
    /// The action on its agent.
    pub action: ProcessAction,
}

/// Action of a fault on an agent's process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessAction {
    /// It is killed, and its memory with it.
    Kill,
    /// A new life of it begins, without memory.
    Restart,
    /// It is stopped.
    Pause,
    /// It goes on.
    Resume,
}
