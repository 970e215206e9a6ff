//! How kinds of faults fit into a plan: when they are at work, and what they strike.

use crate::number::NonNegative;

/// When a fault is at work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// When it begins, seconds.
    pub from_s: NonNegative,
    /// When it ends, seconds; `None` with the run. Who was killed is restarted then.
    pub until_s: Option<NonNegative>,
}

/// How a kind of fault fits into a plan.
#[derive(Clone, Copy, Debug)]
pub struct Nature {
    /// Things that it strikes, and so the keys by which they are chosen.
    pub strikes: Strikes,
    /// Whether it happens at `at_s`, and ends by being undone at `restart_at_s`; others last from `from_s` to `until_s`.
    pub at_once: bool,
    /// Whether it may let a robot that speaks go unheard for a neighbor cycle.
    pub silences: bool,
    /// Whether no robot may be struck by two of its kind at once.
    pub exclusive: bool,
}

/// Things that a kind of fault strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strikes {
    /// Packets that some robots send or hear, or on some links.
    Packets,
    /// Robots.
    Robots,
    /// Robots that must be chosen: never all of them for want of a key.
    ChosenRobots,
    /// Robots or packets that its own keys name.
    ByItsKeys,
}

impl Nature {
    pub(super) const fn of(strikes: Strikes) -> Self {
        Self { strikes, at_once: false, silences: false, exclusive: false }
    }

    /// The keys of its window.
    pub fn window(self) -> [&'static str; 2] {
        if self.at_once { ["at_s", "restart_at_s"] } else { ["from_s", "until_s"] }
    }

    /// The keys that kinds share and this one has.
    pub(super) fn keys(self) -> impl Iterator<Item = &'static str> {
        self.window().into_iter().chain(self.strikes.keys().iter().copied())
    }
}

impl Strikes {
    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Packets => &["robots", "region", "share", "pick", "direction", "links"],
            Self::Robots | Self::ChosenRobots => &["robots", "region", "share", "pick"],
            Self::ByItsKeys => &[],
        }
    }
}
