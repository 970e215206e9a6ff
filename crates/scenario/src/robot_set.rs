//! Robots and links by name: `"3, 7, 10-19"`, `[3, 7]`, `"3->7"`, `"3<->7"`.

use std::{borrow::Cow, fmt, ops::RangeInclusive, str::FromStr};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{self, SeqAccess, Visitor},
};

/// Some robots, by index: ascending ranges that neither overlap nor touch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotSet(Vec<RangeInclusive<u32>>);

/// Why a text names no robots.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must name robots such as \"3, 7, 10-19\", got `{0}`")]
pub struct RobotSetError(String);

impl RobotSet {
    /// The robots of some indices; `None` for none at all.
    pub fn of(indices: impl IntoIterator<Item = u32>) -> Option<Self> {
        Self::union(indices.into_iter().map(|index| index..=index).collect())
    }

    /// All of them, ascending.
    pub fn iter(&self) -> impl Iterator<Item = u32> {
        self.0.iter().cloned().flatten()
    }

    /// Whether robot `index` is one of them.
    pub fn contains(&self, index: u32) -> bool {
        self.0.iter().any(|range| range.contains(&index))
    }

    /// The highest index.
    pub fn highest(&self) -> u32 {
        self.0.last().map_or(0, |range| *range.end())
    }

    /// The lowest index that both have.
    pub fn lowest_common(&self, other: &Self) -> Option<u32> {
        let starts = self.0.iter().chain(&other.0).map(|range| *range.start());
        starts.filter(|start| self.contains(*start) && other.contains(*start)).min()
    }

    /// Returns the robots with an index below `count`; `None` if there are none.
    pub fn below(&self, count: u32) -> Option<Self> {
        let cut = |range: &RangeInclusive<u32>| *range.start()..=(*range.end()).min(count.saturating_sub(1));
        Self::union(self.0.iter().filter(|range| *range.start() < count).map(cut).collect())
    }

    fn union(mut ranges: Vec<RangeInclusive<u32>>) -> Option<Self> {
        ranges.sort_unstable_by_key(|range| *range.start());
        let mut merged: Vec<RangeInclusive<u32>> = Vec::new();
        for range in ranges {
            match merged.last_mut() {
                Some(last) if *range.start() <= last.end().saturating_add(1) => {
                    *last = *last.start()..=*last.end().max(range.end());
                }
                _ => merged.push(range),
            }
        }
        (!merged.is_empty()).then_some(Self(merged))
    }
}

impl FromStr for RobotSet {
    type Err = RobotSetError;

    fn from_str(text: &str) -> Result<Self, RobotSetError> {
        let range = |part: &str| {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let (first, last): (u32, u32) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
            (first <= last).then_some(first..=last)
        };
        let ranges = text.split(',').map(range).collect::<Option<Vec<_>>>();
        ranges.and_then(Self::union).ok_or_else(|| RobotSetError(text.into()))
    }
}

impl fmt::Display for RobotSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, range) in self.0.iter().enumerate() {
            let comma = if at > 0 { "," } else { "" };
            match range.start() == range.end() {
                true => write!(f, "{comma}{}", range.start())?,
                false => write!(f, "{comma}{}-{}", range.start(), range.end())?,
            }
        }
        Ok(())
    }
}

impl Serialize for RobotSet {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for RobotSet {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RobotSetVisitor)
    }
}

struct RobotSetVisitor;

impl<'de> Visitor<'de> for RobotSetVisitor {
    type Value = RobotSet;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("robots such as 3, [3, 7] or \"3, 7, 10-19\"")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<RobotSet, E> {
        text.parse().map_err(E::custom)
    }

    fn visit_i64<E: de::Error>(self, index: i64) -> Result<RobotSet, E> {
        index.to_string().parse().map_err(E::custom)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<RobotSet, A::Error> {
        let mut indices = Vec::new();
        while let Some(index) = entries.next_element::<u32>()? {
            indices.push(index);
        }
        RobotSet::of(indices).ok_or_else(|| de::Error::custom(RobotSetError("[]".into())))
    }
}

impl JsonSchema for RobotSet {
    fn schema_name() -> Cow<'static, str> {
        "RobotSet".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "Robots by index: 3, [3, 7] or \"3, 7, 10-19\".",
            "anyOf": [
                { "type": "integer", "minimum": 0 },
                { "type": "array", "items": { "type": "integer", "minimum": 0 }, "minItems": 1 },
                { "type": "string" }
            ]
        })
    }
}

/// Packets from one robot to another, or both ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// Index of the sender.
    pub from: u32,
    /// Index of the receiver.
    pub to: u32,
    /// Whether the way back is meant as well.
    pub both_ways: bool,
}

/// Why a text names no link.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be a link such as \"3->7\" (packets of 3 to 7) or \"3<->7\" (both ways), got `{0}`")]
pub struct LinkError(String);

impl Link {
    /// Whether packets from `sender` to `receiver` go over it.
    pub fn carries(&self, sender: u32, receiver: u32) -> bool {
        (self.from, self.to) == (sender, receiver)
            || self.both_ways && (self.to, self.from) == (sender, receiver)
    }
}

impl FromStr for Link {
    type Err = LinkError;

    fn from_str(text: &str) -> Result<Self, LinkError> {
        let ends = |arrow| {
            let (from, to) = text.split_once(arrow)?;
            Some((from.trim().parse::<u32>().ok()?, to.trim().parse::<u32>().ok()?))
        };
        let (both_ways, ends) = match text.contains("<->") {
            true => (true, ends("<->")),
            false => (false, ends("->")),
        };
        match ends {
            Some((from, to)) if from != to => Ok(Self { from, to, both_ways }),
            _ => Err(LinkError(text.into())),
        }
    }
}

impl fmt::Display for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}{}", self.from, if self.both_ways { "<->" } else { "->" }, self.to)
    }
}

impl Serialize for Link {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Link {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Cow::<'de, str>::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

impl JsonSchema for Link {
    fn schema_name() -> Cow<'static, str> {
        "Link".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A link: \"3->7\" (packets of 3 to 7) or \"3<->7\" (both ways).",
            "type": "string"
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_read_merged_and_written_back() {
        let set: RobotSet = " 7, 3,10-19 ,4, 15-25".parse().unwrap();
        assert_eq!(set.to_string(), "3-4,7,10-25");
        assert_eq!(set.iter().count(), 19);
        assert!(set.contains(25) && !set.contains(9));
        assert_eq!(set.below(8).unwrap().to_string(), "3-4,7");
        assert_eq!(set.below(3), None);
        assert_eq!(set.lowest_common(&"8-12".parse().unwrap()), Some(10));
        assert_eq!(set.lowest_common(&"8-9".parse().unwrap()), None);
    }

    #[test]
    fn what_names_nobody_is_refused() {
        for bad in ["", "-1", "5-3", "1,,2", "a", "1-2-3", "99999999999"] {
            assert!(bad.parse::<RobotSet>().is_err(), "{bad}");
        }
    }

    #[test]
    fn links_have_directions() {
        let one: Link = "3->7".parse().unwrap();
        assert!(one.carries(3, 7) && !one.carries(7, 3));
        let both: Link = " 3 <-> 7".parse().unwrap();
        assert!(both.carries(3, 7) && both.carries(7, 3) && !both.carries(3, 8));
        assert_eq!(both.to_string(), "3<->7");
        for bad in ["3", "3->", "3->3", "a->b", "3<-7"] {
            assert!(bad.parse::<Link>().is_err(), "{bad}");
        }
    }
}
