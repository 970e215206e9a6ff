//! A `[[fault]]` table: the keys that kinds share, and those of one kind.
//!
//! The table is split in two, and serde reads each half; so each key has its line, and what a kind does not know is
//! refused. The schema is put together of the same halves.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::kind::{Fault, FaultKind, Kind};
use super::nature::{Strikes, Window};
use super::own_keys::OwnKeys;
use super::target::{Choice, Direction, Disc, Pick, ShareOf, Target};
use crate::document::Document;
use crate::error::{Origin, ScenarioError};
use crate::explain::suggestion;
use crate::number::{NonNegative, Share};
use crate::problem::{Problem, ensure, problem};
use crate::robot_set::{Link, RobotSet};

/// The keys that kinds share; which of them one has, its [`Nature`](super::nature::Nature) says.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
struct CommonKeys {
    /// When it begins, seconds; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    from_s: Option<NonNegative>,
    /// When it ends, seconds; default: with the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    until_s: Option<NonNegative>,
    /// When it happens, seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    at_s: Option<NonNegative>,
    /// When killed robots are restarted without their memory, seconds; without it they stay dead.
    #[serde(skip_serializing_if = "Option::is_none")]
    restart_at_s: Option<NonNegative>,
    /// Which robots it strikes, such as "3, 7, 10-19"; default all.
    #[serde(skip_serializing_if = "Option::is_none")]
    robots: Option<RobotSet>,
    /// Of these only robots inside this disc when it begins.
    #[serde(skip_serializing_if = "Option::is_none")]
    region: Option<Disc>,
    /// Of these only this share.
    #[serde(skip_serializing_if = "Option::is_none")]
    share: Option<Share>,
    /// How the share is chosen; default at random.
    #[serde(skip_serializing_if = "Option::is_none")]
    pick: Option<Pick>,
    /// Whether packets that these robots send, hear, or both are struck; default both.
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<Direction>,
    /// Which links it strikes, such as ["3->7", "4<->9"], in place of robots.
    #[serde(skip_serializing_if = "Option::is_none")]
    links: Option<Vec<Link>>,
}

/// Reads fault `index` of a document.
pub(crate) fn read(document: &Document<'_>, index: usize) -> Result<Fault, ScenarioError> {
    #[derive(Deserialize)]
    struct Named {
        kind: FaultKind,
    }
    let path = format!("fault.{index}");
    let Named { kind } = document.read(&path, |_| true)?;
    let is_common = |key: &str| kind.nature().keys().any(|common| common == key);
    let common: CommonKeys = document.read(&path, is_common)?;
    let parameters = kind
        .read(OwnKeys { document, path: &path, is_common: &is_common })
        .map_err(|error| misfit(document, &path, kind).map_or(error, |problem| document.blame(problem)))?;
    let blame = |problem| document.blame(problem);
    Ok(Fault {
        window: common.window(&path, kind).map_err(blame)?,
        target: common.target(&path, kind).map_err(blame)?,
        kind: parameters,
        origin: Origin(Some(document.place_of(&format!("{path}.kind")))),
    })
}

/// Returns the key that a fault of this kind lacks, or has and does not know.
fn misfit(document: &Document<'_>, path: &str, kind: FaultKind) -> Option<Problem> {
    let (schema, name) = (kind.schema(&mut SchemaGenerator::default()), kind.name());
    let mut given = document.keys(path);
    given.sort_unstable();
    let mut known = kind.keys();
    known.sort_unstable();
    let Some(key) = given.iter().find(|key| *key != "kind" && !known.contains(key)) else {
        let mut required = schema.get("required").and_then(Value::as_array)?.iter().filter_map(Value::as_str);
        return required
            .find(|key| !given.iter().any(|given| given == key))
            .map(|key| needs(path, name, key));
    };
    let at = format!("{path}.{key}");
    let (guess, _) = suggestion(key, &known.iter().map(String::as_str).collect::<Vec<_>>());
    Some(match guess.is_empty() {
        false => problem(&[&at], format!("unknown key `{}` in [[fault]]{guess}", key.escape_debug())),
        true => {
            let message = format!("`{}` has no meaning in a fault of kind \"{name}\"", key.escape_debug());
            problem(&[&at], message).hint(format!("it knows `{}`", known.join("`, `")))
        }
    })
}

fn needs(path: &str, kind: &str, key: &str) -> Problem {
    problem(&[&format!("{path}.kind")], format!("a fault of kind \"{kind}\" needs `{key}`"))
}

impl CommonKeys {
    /// The keys of a fault, with every default.
    fn of(fault: &Fault) -> Self {
        let mut keys = Self::default();
        let (from_s, until_s) = match fault.nature().is_at_once() {
            true => (&mut keys.at_s, &mut keys.restart_at_s),
            false => (&mut keys.from_s, &mut keys.until_s),
        };
        (*from_s, *until_s) = (Some(fault.window.from_s), fault.window.until_s);
        match &fault.target {
            Target::Robots(choice) => keys.choose(choice),
            Target::Packets(choice, direction) => {
                keys.choose(choice);
                keys.direction = Some(*direction);
            }
            Target::Links(links) => keys.links = Some(links.clone()),
            Target::ByItsKeys => {}
        }
        keys
    }

    fn choose(&mut self, Choice { robots, region, share }: &Choice) {
        (self.robots, self.region) = (robots.clone(), *region);
        (self.share, self.pick) = (share.map(|of| of.share), share.map(|of| of.pick));
    }

    fn window(&self, path: &str, kind: FaultKind) -> Result<Window, Problem> {
        if kind.nature().is_at_once() {
            let from_s = self.at_s.ok_or_else(|| needs(path, kind.name(), "at_s"))?;
            return Ok(Window { from_s, until_s: self.restart_at_s });
        }
        Ok(Window { from_s: self.from_s.unwrap_or(constant!(NonNegative, 0.0)), until_s: self.until_s })
    }

    fn target(self, path: &str, kind: FaultKind) -> Result<Target, Problem> {
        let at = |key: &str, message: String| problem(&[&format!("{path}.{key}")], message);
        if let Some(links) = self.links {
            ensure(!links.is_empty(), || at("links", "`links` is empty: no packet is struck".into()))?;
            let besides = [
                ("robots", self.robots.is_some()),
                ("region", self.region.is_some()),
                ("share", self.share.is_some()),
                ("direction", self.direction.is_some()),
            ];
            return match besides.into_iter().find(|(_, given)| *given) {
                Some((key, _)) => Err(at(key, format!("give either `links` or `{key}`, not both"))),
                None => Ok(Target::Links(links)),
            };
        }
        let share = match (self.share, self.pick) {
            (None, Some(_)) => {
                let message = "`pick` says how a `share` is chosen, and there is none";
                return Err(at("pick", message.into()));
            }
            (share, pick) => share.map(|share| ShareOf { share, pick: pick.unwrap_or_default() }),
        };
        let choice = Choice { robots: self.robots, region: self.region, share };
        match kind.nature().strikes {
            Strikes::ByItsKeys | Strikes::Surroundings => Ok(Target::ByItsKeys),
            Strikes::Packets => Ok(Target::Packets(choice, self.direction.unwrap_or_default())),
            Strikes::ChosenRobots if choice == Choice::default() => {
                let name = kind.name();
                let message = format!("a fault of kind \"{name}\" needs one of `robots`, `region`, `share`");
                Err(at("kind", message))
            }
            Strikes::Robots | Strikes::ChosenRobots => Ok(Target::Robots(choice)),
        }
    }
}

/// As a table of a scenario file, with every default.
impl Serialize for Fault {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Table<'a> {
            kind: FaultKind,
            #[serde(flatten)]
            common: CommonKeys,
            #[serde(flatten)]
            parameters: &'a Kind,
        }
        let table = Table { kind: self.kind.kind(), common: CommonKeys::of(self), parameters: &self.kind };
        table.serialize(serializer)
    }
}

impl JsonSchema for Fault {
    fn schema_name() -> Cow<'static, str> {
        "Fault".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let properties = |schema: &Schema| {
            schema.get("properties").and_then(Value::as_object).cloned().unwrap_or_default()
        };
        let common = properties(&CommonKeys::json_schema(generator));
        let mut of = |kind: FaultKind| {
            let mut schema = kind.schema(generator);
            let mut keys = Map::new();
            keys.insert("kind".into(), serde_json::json!({ "const": kind.name() }));
            keys.extend(
                kind.nature()
                    .keys()
                    .filter_map(|key| common.get_key_value(key))
                    .map(|(key, value)| (key.clone(), value.clone())),
            );
            keys.extend(properties(&schema));
            let own = schema.get("required").and_then(Value::as_array).cloned().unwrap_or_default();
            let at = kind.nature().is_at_once().then(|| "at_s".into());
            schema.insert("properties".into(), keys.into());
            schema.insert("required".into(), ["kind".into()].into_iter().chain(at).chain(own).collect());
            schema
        };
        let kinds: Vec<Schema> = FaultKind::ALL.iter().map(|&kind| of(kind)).collect();
        json_schema!({ "description": "One rule of the fault plan.", "oneOf": kinds })
    }
}
