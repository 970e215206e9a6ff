//! How a process logs.

use std::io;

use protocol::robot_id::RobotId;
use tracing::level_filters::LevelFilter;

use crate::format::Format;

/// Takes a line, newline included, in one piece or not at all.
pub type Sink = fn(&[u8]) -> io::Result<()>;

/// How a process logs.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// How lines are written.
    pub format: Format,
    /// Level of what is written where `RUST_LOG` does not say.
    pub level: LevelFilter,
    /// Robot of this process, if it is an agent's.
    pub robot: Option<RobotId>,
    /// Whether text may be colored.
    pub color: bool,
    /// Where lines go.
    pub sink: Sink,
    /// Warns of what in `RUST_LOG` and [`FORMAT_VARIABLE`](crate::FORMAT_VARIABLE) is not understood. One process of a run does.
    pub complains: bool,
}
