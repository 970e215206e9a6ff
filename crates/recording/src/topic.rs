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
    /// Percepts of robots, to the bit.
    Percepts,
    /// Their answers, to the bit.
    Answers,
    /// Packets that were not heard.
    Losses,
    /// Notes of controllers.
    Notes,
    /// The swarm in numbers.
    Metrics,
    /// Faults that strike.
    Faults,
    /// Acts upon the run.
    Acts,
    /// Faults and what went wrong without being planned.
    Log,
    /// Hashes that make each tick this tick and no other: its last message.
    Ticks,
    /// How the run ended: the last message.
    End,
}

impl Topic {
    /// All topics.
    pub const ALL: [Self; 16] = [
        Self::Run,
        Self::Frame,
        Self::Robots,
        Self::Points,
        Self::Scene,
        Self::Commands,
        Self::Percepts,
        Self::Answers,
        Self::Losses,
        Self::Notes,
        Self::Metrics,
        Self::Faults,
        Self::Acts,
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
            Self::Percepts => "/percepts",
            Self::Answers => "/answers",
            Self::Losses => "/losses",
            Self::Notes => "/notes",
            Self::Metrics => "/metrics",
            Self::Faults => "/faults",
            Self::Acts => "/acts",
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
            Self::Percepts => "lamplight.Percepts",
            Self::Answers => "lamplight.Answers",
            Self::Losses => "lamplight.Losses",
            Self::Notes => "lamplight.Notes",
            Self::Metrics => "lamplight.Metrics",
            Self::Faults => "lamplight.Fault",
            Self::Acts => "lamplight.Act",
            Self::Log => "foxglove.Log",
            Self::Ticks => "lamplight.Tick",
            Self::End => "lamplight.End",
        }
    }
}
