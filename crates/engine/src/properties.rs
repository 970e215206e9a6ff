//! Properties that controllers have stated of themselves, as a whole run has them.

use std::collections::{BTreeMap, BTreeSet};

use protocol::{
    percept::Tick,
    property::{Decided, Property, PropertyKind},
    robot_id::RobotId,
};
use serde::{Deserialize, Serialize};

/// Properties that controllers have stated, by name: of all robots and all their lives.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Properties {
    /// Properties that must hold whenever they are stated.
    #[serde(default)]
    pub always: BTreeMap<String, Always>,
    /// Properties that must be reached at least once.
    #[serde(default)]
    pub sometimes: BTreeMap<String, Sometimes>,
}

/// A property that must hold whenever it is stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Always {
    /// Robots that have stated it.
    pub robots: u32,
    /// Robots of which it did not hold at some time.
    pub broken_by: u32,
    /// Which was the first; `None` if it held.
    pub first: Option<First>,
}

/// A property that must be reached at least once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sometimes {
    /// Robots that have stated it.
    pub robots: u32,
    /// Robots that have reached it.
    pub reached_by: u32,
    /// Which was the first; `None` if none has.
    pub first: Option<First>,
}

/// The first robot that broke or reached a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct First {
    /// Index of the robot.
    pub robot: u32,
    /// Its life, from 1.
    pub life: u32,
    /// The tick of the percept that it was thinking about; `None` at the beginning of its life, before it had one.
    pub tick: Option<Tick>,
}

impl Properties {
    /// Puts together what lives of robots have stated.
    pub(crate) fn of(lives: &[(RobotId, Vec<Property>)]) -> Self {
        let mut tallies: BTreeMap<(PropertyKind, &str), Tally> = BTreeMap::new();
        for (id, properties) in lives {
            for Property { kind, name, decided } in properties {
                tallies.entry((*kind, name)).or_default().add(*id, *decided);
            }
        }
        let mut all = Self::default();
        for ((kind, name), Tally { robots, deciders, first }) in tallies {
            let (robots, deciders) = (robots.len() as u32, deciders.len() as u32);
            let first = first.map(|(decided, id)| First {
                robot: id.index,
                life: u32::from(id.incarnation) + 1,
                tick: decided.tick,
            });
            match kind {
                PropertyKind::Always => {
                    all.always.insert(name.into(), Always { robots, broken_by: deciders, first });
                }
                PropertyKind::Sometimes => {
                    all.sometimes.insert(name.into(), Sometimes { robots, reached_by: deciders, first });
                }
            }
        }
        all
    }

    /// Properties that must always hold and did not, by name.
    pub fn broken(&self) -> impl Iterator<Item = (&str, &Always)> {
        let all = self.always.iter().map(|(name, always)| (&name[..], always));
        all.filter(|(_, always)| always.broken_by > 0)
    }

    /// Properties that must be reached and were not, by name.
    pub fn unreached(&self) -> impl Iterator<Item = (&str, &Sometimes)> {
        let all = self.sometimes.iter().map(|(name, sometimes)| (&name[..], sometimes));
        all.filter(|(_, sometimes)| sometimes.reached_by == 0)
    }
}

/// Robots with a property, each counted once.
#[derive(Default)]
struct Tally {
    robots: BTreeSet<u32>,
    deciders: BTreeSet<u32>,
    first: Option<(Decided, RobotId)>,
}

impl Tally {
    fn add(&mut self, id: RobotId, decided: Option<Decided>) {
        self.robots.insert(id.index);
        if let Some(decided) = decided {
            self.deciders.insert(id.index);
            let this = (decided, id);
            self.first = Some(self.first.map_or(this, |first| first.min(this)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_count_once_and_the_first_is_by_tick_then_robot() {
        let stated = |kind, name: &str, decided: Option<Option<Tick>>| Property {
            kind,
            name: name.into(),
            decided: decided.map(|tick| Decided { tick }),
        };
        let (always, sometimes) = (PropertyKind::Always, PropertyKind::Sometimes);
        let (one, two) = (RobotId::first(1), RobotId::first(2));
        let lives = [
            (one, vec![stated(always, "sound", Some(Some(9))), stated(sometimes, "far", None)]),
            (one.reborn(), vec![stated(always, "sound", Some(Some(12)))]),
            (two, vec![stated(always, "sound", Some(Some(9))), stated(sometimes, "sound", Some(None))]),
            (RobotId::first(3), vec![stated(always, "sound", None), stated(always, "kept", None)]),
        ];
        let all = Properties::of(&lives);
        let first = Some(First { robot: 1, life: 1, tick: Some(9) });
        let sound = Always { robots: 3, broken_by: 2, first };
        assert_eq!(all.always["sound"], sound);
        assert_eq!(all.always["kept"], Always { robots: 1, broken_by: 0, first: None });
        assert_eq!(all.broken().collect::<Vec<_>>(), [("sound", &sound)]);
        let booted = Some(First { robot: 2, life: 1, tick: None });
        assert_eq!(all.sometimes["sound"], Sometimes { robots: 1, reached_by: 1, first: booted });
        assert_eq!(all.sometimes["far"], Sometimes { robots: 1, reached_by: 0, first: None });
    }
}
