//! Runs that an agent leaves before they end.

use protocol::robot_id::RobotId;
use transport::run_dir::RunName;

/// Why an agent leaves before its run has ended.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Abandoned {
    /// The arena has died.
    #[error("the arena of run `{run}` has died; {id} leaves")]
    ArenaDied { run: RunName, id: RobotId },
    /// The arena has excluded this robot.
    #[error("run `{run}` goes on without {id}")]
    LeftOut { run: RunName, id: RobotId },
}
