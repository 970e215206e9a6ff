//! Targets of a fault.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::number::{Finite, Positive, Share, Xy};
use crate::robot_set::{Link, RobotSet};

/// Target of a fault.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// Robots.
    Robots(Choice),
    /// Packets of robots.
    Packets(Choice, Direction),
    /// Packets on links.
    Links(Vec<Link>),
    /// That which the parameters of its kind name.
    ByItsKeys,
}

/// A choice among all robots, made once, when the fault begins.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choice {
    /// Only these.
    pub robots: Option<RobotSet>,
    /// Of these only robots inside this disc.
    pub region: Option<Disc>,
    /// Of these only a share.
    pub share: Option<ShareOf>,
}

/// A share of some robots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShareOf {
    /// The share.
    pub share: Share,
    /// How it is chosen.
    pub pick: Pick,
}

/// How a share of some robots is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pick {
    /// At random.
    #[default]
    Random,
    /// The nearest to the middle of the lamps when it begins.
    NearestLamps,
}

/// A disc of the arena.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    /// Its center, [x, y] in meters.
    pub center_m: Xy<Finite>,
    /// Its radius in meters.
    pub radius_m: Positive,
}

/// Which packets of the chosen robots are struck.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// Packets they send and packets they hear.
    #[default]
    Both,
    /// Packets they send.
    Out,
    /// Packets they hear.
    In,
}

impl Target {
    /// The robots among whom it chooses, if it does.
    pub fn choice(&self) -> Option<&Choice> {
        match self {
            Self::Robots(choice) | Self::Packets(choice, _) => Some(choice),
            Self::Links(_) | Self::ByItsKeys => None,
        }
    }

    /// The links that it names.
    pub fn links(&self) -> &[Link] {
        if let Self::Links(links) = self { links } else { &[] }
    }

    /// Leaves the first `count` robots alone; whether there is something left to strike.
    pub(super) fn cut(&mut self, count: u32) -> bool {
        match self {
            Self::Robots(choice) | Self::Packets(choice, _) => {
                let Some(robots) = &mut choice.robots else { return true };
                robots.below(count).map(|left| *robots = left).is_some()
            }
            Self::Links(links) => {
                links.retain(|link| link.from < count && link.to < count);
                !links.is_empty()
            }
            Self::ByItsKeys => true,
        }
    }
}
