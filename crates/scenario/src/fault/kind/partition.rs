//! `partition`: groups of robots cannot hear each other, or those in a disc and those out of it.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::fault::target::Disc;
use crate::problem::Problem;
use crate::robot_set::RobotSet;

/// Groups of robots cannot hear each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys", into = "Keys")]
pub struct Partition {
    /// The parts that it makes; robots in none of them are not struck.
    pub parts: Parts,
    /// Whether only packets from an earlier to a later part are dropped.
    pub one_way: bool,
}

/// Parts of a swarm, one before the other.
#[derive(Clone, Debug, PartialEq)]
pub enum Parts {
    /// Two groups or more.
    Groups(Vec<RobotSet>),
    /// Robots in a disc when it begins, and those out of it.
    Disc(Disc),
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Groups that cannot hear each other; robots in none of them are not struck.
    #[serde(skip_serializing_if = "Option::is_none")]
    groups: Option<Vec<RobotSet>>,
    /// The disc that robots are in or out of when it begins, in place of groups.
    #[serde(skip_serializing_if = "Option::is_none")]
    region: Option<Disc>,
    /// Whether only packets from an earlier to a later group (or out of the region) are dropped.
    #[serde(default)]
    one_way: bool,
}

impl TryFrom<Keys> for Partition {
    type Error = String;

    fn try_from(Keys { groups, region, one_way }: Keys) -> Result<Self, String> {
        let parts = match (groups, region) {
            (Some(groups), None) if groups.len() < 2 => {
                return Err(format!("a partition needs two groups or more, got {}", groups.len()));
            }
            (Some(groups), None) => Parts::Groups(groups),
            (None, Some(disc)) => Parts::Disc(disc),
            (Some(_), Some(_)) => return Err("give either `groups` or `region`, not both".into()),
            (None, None) => {
                return Err("a fault of kind \"partition\" needs one of `groups`, `region`".into());
            }
        };
        Ok(Self { parts, one_way })
    }
}

impl From<Partition> for Keys {
    fn from(Partition { parts, one_way }: Partition) -> Self {
        match parts {
            Parts::Groups(groups) => Self { groups: Some(groups), region: None, one_way },
            Parts::Disc(disc) => Self { groups: None, region: Some(disc), one_way },
        }
    }
}

impl JsonSchema for Partition {
    fn schema_name() -> Cow<'static, str> {
        "Partition".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        Keys::json_schema(generator)
    }
}

impl Parameters for Partition {
    const NATURE: Nature = Nature { silences: true, ..Nature::of(Strikes::ByItsKeys) };

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        match &self.parts {
            Parts::Groups(groups) => entry.groups_apart(groups),
            Parts::Disc(disc) => entry.reaches(*disc),
        }
    }

    fn cut(&mut self, count: u32) -> bool {
        let Parts::Groups(groups) = &mut self.parts else { return true };
        *groups = groups.iter().filter_map(|group| group.below(count)).collect();
        groups.len() >= 2
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        let one_way = draw.chance(0.5) && draw.chance(0.8);
        let parts = draw.groups().map_or_else(|| Parts::Disc(draw.disc()), Parts::Groups);
        Self { parts, one_way }
    }
}
