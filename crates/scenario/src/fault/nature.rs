//! How kinds of faults fit into a plan: when they are at work, and what they strike.

use std::iter;

use crate::number::NonNegative;

/// When a fault is at work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// When it begins, seconds.
    pub from_s: NonNegative,
    /// When it ends, seconds; `None` with the run, or if its kind has no end. Who was killed is restarted then.
    pub until_s: Option<NonNegative>,
}

/// How a kind of fault fits into a plan.
#[derive(Clone, Copy, Debug)]
pub struct Nature {
    /// Things that it strikes, and so the keys by which they are chosen.
    pub strikes: Strikes,
    /// When it is at work, and so the keys of its window.
    pub timing: Timing,
    /// Whether it may let a robot that speaks go unheard for a neighbor cycle.
    pub silences: bool,
    /// Whether no robot may be struck by two of its kind at once.
    pub exclusive: bool,
}

/// When a kind of fault is at work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timing {
    /// From `from_s` to `until_s`.
    Lasting,
    /// At `at_s`, and at `restart_at_s`, if that is given, it is undone.
    Undone,
    /// At `at_s`, for good.
    ForGood,
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
    /// Neither robots nor packets, but what is around them; its own keys say what.
    Surroundings,
}

impl Nature {
    pub(super) const fn of(strikes: Strikes) -> Self {
        Self { strikes, timing: Timing::Lasting, silences: false, exclusive: false }
    }

    /// Whether it happens at `at_s`, all at once.
    pub fn is_at_once(self) -> bool {
        self.timing != Timing::Lasting
    }

    /// The keys of its window: when it begins, and when it ends, if it can.
    pub fn window(self) -> (&'static str, Option<&'static str>) {
        match self.timing {
            Timing::Lasting => ("from_s", Some("until_s")),
            Timing::Undone => ("at_s", Some("restart_at_s")),
            Timing::ForGood => ("at_s", None),
        }
    }

    /// The keys that kinds share and this one has.
    pub(super) fn keys(self) -> impl Iterator<Item = &'static str> {
        let (from, until) = self.window();
        iter::once(from).chain(until).chain(self.strikes.keys().iter().copied())
    }
}

impl Strikes {
    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Packets => &["robots", "region", "share", "pick", "direction", "links"],
            Self::Robots | Self::ChosenRobots => &["robots", "region", "share", "pick"],
            Self::ByItsKeys | Self::Surroundings => &[],
        }
    }
}
