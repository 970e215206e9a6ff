//! Topics of a recording: one for each kind of message.

/// A topic, which has messages of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Topic {
    /// The run itself: the first message.
    Run,
    /// The frame that all places are in.
    Frame,
    /// Robots as poses.
    Robots,
    /// Robots as points, for viewers that draw no poses.
    Points,
    /// Bodies, cells and lamps, as shapes.
    Scene,
    /// Decisions of robots.
    Commands,
    /// The swarm in numbers.
    Metrics,
    /// Faults and what went wrong without being planned.
    Log,
    /// Hashes that make each tick this tick and no other: its last message.
    Ticks,
    /// How the run ended: the last message.
    End,
}

impl Topic {
    /// All topics.
    pub const ALL: [Self; 10] = [
        Self::Run,
        Self::Frame,
        Self::Robots,
        Self::Points,
        Self::Scene,
        Self::Commands,
        Self::Metrics,
        Self::Log,
        Self::Ticks,
        Self::End,
    ];

    /// As the file names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Run => "/run",
            Self::Frame => "/tf",
            Self::Robots => "/robots",
            Self::Points => "/robots/points",
            Self::Scene => "/scene",
            Self::Commands => "/commands",
            Self::Metrics => "/metrics",
            Self::Log => "/log",
            Self::Ticks => "/ticks",
            Self::End => "/end",
        }
    }

    /// Full name of its messages.
    pub fn schema(self) -> &'static str {
        match self {
            Self::Run => "lamplight.Run",
            Self::Frame => "foxglove.FrameTransform",
            Self::Robots => "foxglove.PosesInFrame",
            Self::Points => "foxglove.PointCloud",
            Self::Scene => "foxglove.SceneUpdate",
            Self::Commands => "lamplight.Commands",
            Self::Metrics => "lamplight.Metrics",
            Self::Log => "foxglove.Log",
            Self::Ticks => "lamplight.Tick",
            Self::End => "lamplight.End",
        }
    }
}
