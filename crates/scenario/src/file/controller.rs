//! `[controller]` or `[[controller]]`: who thinks for whom.
//!
//! One table for all robots, or an array of them, each for some. A table has the keys of the paper's laws, or those of a
//! program; which, one look at its keys tells, and then serde reads it.

use std::num::NonZeroU32;
use std::path::{self, Path, PathBuf};

use coverage::law::Law;
use schemars::{JsonSchema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use toml::Value;

use super::choice::without_meaning;
use crate::controller::{Controller, Gradient, LawSpec, Mind, ProgramSpec, PythonSpec, Speaks};
use crate::document::Document;
use crate::error::{Origin, ScenarioError};
use crate::number::Positive;
use crate::problem::{Problem, ensure, problem};
use crate::robot_set::RobotSet;

/// One controller for all robots, or several, each for some.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum ControllerTables {
    /// One for all.
    One(ControllerTable),
    /// Each for some.
    Many(Vec<ControllerTable>),
}

/// A table about the mind of some robots.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum ControllerTable {
    /// A law of the paper.
    Law(LawKeys),
    /// A program of its own.
    Program(ProgramKeys),
    /// A class in Python.
    Python(PythonKeys),
}

/// A control law of the paper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LawKeys {
    /// Which robots it moves, such as "0-39"; may be left out where there is no other entry.
    #[serde(skip_serializing_if = "Option::is_none")]
    robots: Option<RobotSet>,
    /// Control law.
    #[serde(default = "linear")]
    law: Law,
    /// Gain k of eq. 8, per second; k times a neighbor cycle is at most 1.5.
    gain_per_s: Positive,
    /// Where the gradient of φ comes from.
    #[serde(default)]
    gradient: GradientSource,
    /// Magnitude of the gradient, sensor counts per meter; with `gradient = "fixed"` and only there.
    gradient_magnitude_per_m: Option<Positive>,
    /// A neighbor not heard for this many neighbor cycles is forgotten; default 4 wherever packets can be lost or
    /// late: with `channel.loss`, `channel.soft_edge_m`, `channel.occlusion`, any `channel.access` but `"instant"`, or
    /// a fault of kind `loss`, `burst`, `delay`, `corrupt`, `partition` or `jam`. Elsewhere 1, as silence means gone.
    neighbor_timeout_cycles: Option<NonZeroU32>,
    /// Base in meters of the triangle that closes the cell of a robot with all neighbors on one bearing.
    #[serde(default = "triangle_side")]
    triangle_base_m: Positive,
    /// Height of that triangle in meters.
    #[serde(default = "triangle_side")]
    triangle_height_m: Positive,
    /// Distance in meters of the line that closes a bearing gap of π or more.
    #[serde(default = "close_distance")]
    close_distance_m: Positive,
    /// Distance in meters at which every cell is cut off; without it cells are not capped.
    cell_cap_m: Option<Positive>,
}

/// A program that thinks for a robot, each in a process of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ProgramKeys {
    /// Which robots it thinks for, such as "40-49"; may be left out where there is no other entry.
    #[serde(skip_serializing_if = "Option::is_none")]
    robots: Option<RobotSet>,
    /// The program, or words before it, such as ["./my-robot"] or ["nice", "/opt/my-robot"]. A first word that is a path is
    /// relative to this file; a name without a slash is looked for in PATH.
    program: Vec<String>,
    /// Language in which it gets percepts and gives commands.
    #[serde(default)]
    speaks: Speaks,
    /// Folder in which a program that speaks "json-lines" is started, so that its files are found: by default that of this
    /// file. Any other is started in the folder that lamplight is started in.
    #[serde(skip_serializing_if = "Option::is_none")]
    folder: Option<String>,
    /// Parameters of the program: any table without dates, which it gets as JSON.
    #[serde(default)]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    params: toml::Table,
}

/// A class in Python that thinks for a robot, in a process of its own each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PythonKeys {
    /// Which robots it thinks for, such as "40-49"; may be left out where there is no other entry.
    #[serde(skip_serializing_if = "Option::is_none")]
    robots: Option<RobotSet>,
    /// The file and the class in it, such as "my.py:ToTheLight"; a file with one controller needs no class. A relative
    /// path is relative to this file.
    python: String,
    /// SHA-256 of the file, in hex: a resolved scenario has it, and is not run with another file.
    #[serde(skip_serializing_if = "Option::is_none")]
    sha256: Option<String>,
    /// A neighbor not heard for this many neighbor cycles is in no percept's table any more; by default as with the laws
    /// of the paper.
    neighbor_timeout_cycles: Option<NonZeroU32>,
    /// Parameters of the controller: any table without dates, whose keys its constructor gets by name.
    #[serde(default)]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    params: toml::Table,
}

/// Where a robot's gradient of φ comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum GradientSource {
    /// The sensor measures it (Section IV).
    #[default]
    Measured,
    /// Its magnitude is fixed, its direction is towards the stimulus (Section V).
    Fixed,
}

/// A table that has been read.
pub(crate) struct Entry {
    path: String,
    table: ControllerTable,
    origin: Origin,
    /// Its robots are taken from the entries before it: the command line names them.
    takes: bool,
}

/// Reads the tables of a document.
pub(crate) fn read(document: &Document<'_>) -> Result<Vec<Entry>, ScenarioError> {
    let entry = |path: String, takes: bool| {
        let table = table(document, &path)?;
        Ok(Entry { origin: Origin(Some(document.place_of(&path))), table, path, takes })
    };
    match document.entries("controller") {
        None => Ok(vec![entry("controller".into(), false)?]),
        Some(0) => {
            let message = "controller is empty: nobody thinks for the robots";
            let hint = "give one [controller] for all robots, or a [[controller]] for some each";
            Err(document.blame(problem(&["controller"], message).hint(hint)))
        }
        Some(count) => {
            let given = count - document.appended();
            (0..count).map(|index| entry(format!("controller.{index}"), index >= given)).collect()
        }
    }
}

fn table(document: &Document<'_>, path: &str) -> Result<ControllerTable, ScenarioError> {
    let keys = document.keys(path);
    let gives = |key: &str| keys.iter().any(|given| given == key);
    let refused = |key: &str, message: &str, hint: &str| {
        Err(document.blame(problem(&[&format!("{path}.{key}")], message).hint(hint)))
    };
    if keys == ["robots"] {
        let message =
            "nobody thinks for these robots: there is neither a `law` nor a `program`, nor `python`";
        let hint = "give the law of the paper its gain, such as gain_per_s = 1.0, or name a `program` or a class in `python`";
        return Err(document.blame(problem(&[path], message).hint(hint)));
    }
    let minds: Vec<&str> = ["law", "program", "python"].into_iter().filter(|key| gives(key)).collect();
    if let [first, second, ..] = minds[..] {
        let message = format!("an entry has either `{first}` or `{second}`, not both");
        let hint = "give each an entry in [[controller]], with its `robots`";
        return refused(first, &message, hint);
    }
    let own = match minds[..] {
        [own @ ("program" | "python")] => own,
        _ => {
            if gives("params") {
                let message =
                    "`params` has no meaning without `program` or `python`: laws have keys of their own";
                return refused("params", message, "name the `program` that they are for, or remove them");
            }
            return document.read(path, |_| true).map(ControllerTable::Law);
        }
    };
    let is_of_python = |key: &str| own == "python" && key == "neighbor_timeout_cycles";
    let of_laws = LawKeys::json_schema(&mut SchemaGenerator::default());
    let is_of_laws = |key: &str| key != "robots" && of_laws.pointer(&format!("/properties/{key}")).is_some();
    if let Some(key) = keys.iter().find(|key| is_of_laws(key) && !is_of_python(key)) {
        let message = format!("`{key}` has no meaning beside `{own}`: it is for the laws of the paper");
        let hint = format!(
            "a {} has its parameters in `params = {{ {key} = ... }}`",
            if own == "python" { "controller" } else { "program" }
        );
        return refused(key, &message, &hint);
    }
    if own == "python" {
        let keys: PythonKeys = document.read(path, |_| true)?;
        if let Err(message) = PythonKeys::split(&keys.python) {
            let hint = "name a file and a class in it, such as python = \"my.py:ToTheLight\"";
            return refused("python", &message, hint);
        }
        refuse_foreign_params(document, path, &keys.params)?;
        return Ok(ControllerTable::Python(keys));
    }
    let keys: ProgramKeys = document.read(path, |_| true)?;
    if keys.program.first().is_none_or(String::is_empty) {
        let hint = "name it, such as program = [\"./my-robot\"], or give a `law`";
        return refused("program", "`program` is empty", hint);
    }
    if keys.folder.is_some() && keys.speaks != Speaks::JsonLines {
        let message = "`folder` has no meaning without `speaks = \"json-lines\"`";
        return refused("folder", message, "remove it, or put `env -C FOLDER` before the program");
    }
    if let Some(at) = keys.program.iter().position(|word| word.contains('\0')) {
        let hint = "the operating system ends a word there; leave it out";
        return refused(&format!("program.{at}"), "a word of `program` has a NUL character", hint);
    }
    refuse_foreign_params(document, path, &keys.params)?;
    Ok(ControllerTable::Program(keys))
}

/// Refuses parameters of the entry at `path` that cannot be handed on.
fn refuse_foreign_params(
    document: &Document<'_>,
    path: &str,
    params: &toml::Table,
) -> Result<(), ScenarioError> {
    let foreign = params.iter().find_map(|(key, value)| foreign_to_json(&format!("params.{key}"), value));
    match foreign {
        None => Ok(()),
        Some((at, what)) => {
            let message =
                format!("{path}.{at}: {what}, which JSON has not; programs get their params as JSON");
            let problem = problem(&[&format!("{path}.{at}")], message);
            Err(document.blame(problem.hint("give it as text, in quotes, or as another number")))
        }
    }
}

/// The first value at or below `path` that JSON cannot say, and what it is.
fn foreign_to_json(path: &str, value: &Value) -> Option<(String, String)> {
    match value {
        Value::Datetime(date) => Some((path.into(), format!("{date} is a date or a time"))),
        Value::Float(number) if !number.is_finite() => Some((path.into(), format!("this is {number}"))),
        Value::Array(entries) => {
            entries.iter().enumerate().find_map(|(at, entry)| foreign_to_json(&format!("{path}.{at}"), entry))
        }
        Value::Table(table) => {
            table.iter().find_map(|(key, value)| foreign_to_json(&format!("{path}.{key}"), value))
        }
        _ => None,
    }
}

/// Resolves the tables of the file named `source_name` for a swarm of `count` robots, which remember neighbors for
/// `timeout_cycles` unless one says otherwise.
pub(crate) fn resolve(
    entries: Vec<Entry>,
    source_name: &str,
    count: u32,
    timeout_cycles: NonZeroU32,
) -> Result<Vec<Controller>, Problem> {
    let is_alone = entries.iter().filter(|entry| !entry.takes).count() == 1;
    let mut controllers: Vec<Controller> = Vec::new();
    for Entry { path, table, origin, takes } in entries {
        let at = format!("{path}.robots");
        let (robots, mind) = match table {
            ControllerTable::Law(keys) => {
                (keys.robots.clone(), Mind::Law(keys.resolve(&path, timeout_cycles)?))
            }
            ControllerTable::Program(keys) => {
                (keys.robots.clone(), Mind::Program(keys.resolve(source_name, &path, timeout_cycles)?))
            }
            ControllerTable::Python(keys) => {
                (keys.robots.clone(), Mind::Python(keys.resolve(source_name, &path, timeout_cycles)?))
            }
        };
        let robots = robots.or_else(|| RobotSet::of(0..count).filter(|_| is_alone)).ok_or_else(|| {
            let message = "`robots` is missing in [[controller]]: there is more than one entry";
            problem(&[&path], message).hint("say which robots each is for, such as robots = \"0-9\"")
        })?;
        ensure(robots.highest() < count, || {
            let message =
                format!("there is no robot {}: the scenario has robots 0 to {}", robots.highest(), count - 1);
            problem(&[&at, "robots.count"], message).hint("name those that there are, or take more robots")
        })?;
        if takes {
            controllers = controllers.into_iter().filter_map(|it| it.without(&robots)).collect();
        }
        for (first, other) in controllers.iter().enumerate() {
            if let Some(robot) = robots.lowest_common(&other.robots) {
                let message =
                    format!("robot {robot} is named by two controllers: this one and number {first}");
                return Err(problem(&[&at], message).hint("name each robot once"));
            }
        }
        controllers.push(Controller { robots, mind, origin });
    }
    let forgotten = (0..count).find(|&robot| controllers.iter().all(|it| !it.robots.contains(robot)));
    match forgotten {
        None => Ok(controllers),
        Some(robot) => {
            let message = format!("robot {robot} has no controller: no entry names it");
            Err(problem(&["controller.0.robots", "controller"], message)
                .hint(format!("the scenario has robots 0 to {}; name each once", count - 1)))
        }
    }
}

impl LawKeys {
    fn resolve(self, path: &str, timeout_cycles: NonZeroU32) -> Result<LawSpec, Problem> {
        let (source, magnitude) = (format!("{path}.gradient"), format!("{path}.gradient_magnitude_per_m"));
        let gradient = match (self.gradient, self.gradient_magnitude_per_m) {
            (GradientSource::Measured, None) => Gradient::Measured,
            (GradientSource::Fixed, Some(magnitude_per_m)) => Gradient::Fixed { magnitude_per_m },
            (GradientSource::Fixed, None) => {
                let message =
                    format!("{source} = \"fixed\" needs `gradient_magnitude_per_m` in [controller]");
                return Err(problem(&[&source], message));
            }
            (GradientSource::Measured, Some(_)) => {
                return Err(without_meaning(&magnitude, &source, "measured"));
            }
        };
        Ok(LawSpec {
            law: self.law,
            gain_per_s: self.gain_per_s,
            gradient,
            neighbor_timeout_cycles: self.neighbor_timeout_cycles.unwrap_or(timeout_cycles),
            triangle_base_m: self.triangle_base_m,
            triangle_height_m: self.triangle_height_m,
            close_distance_m: self.close_distance_m,
            cell_cap_m: self.cell_cap_m,
        })
    }
}

impl ProgramKeys {
    fn resolve(
        self,
        source_name: &str,
        path: &str,
        neighbor_timeout_cycles: NonZeroU32,
    ) -> Result<ProgramSpec, Problem> {
        let mut command = self.program;
        if let Some(program) = command.first_mut().filter(|program| program.contains('/')) {
            *program = beside(source_name, program, &format!("{path}.program"))?;
        }
        let key = format!("{path}.folder");
        let folder = match self.speaks {
            Speaks::SharedMemory => None,
            Speaks::JsonLines => Some(beside(source_name, self.folder.as_deref().unwrap_or("."), &key)?),
        };
        Ok(ProgramSpec { command, speaks: self.speaks, folder, params: self.params, neighbor_timeout_cycles })
    }
}

impl PythonKeys {
    fn resolve(
        self,
        source_name: &str,
        path: &str,
        timeout_cycles: NonZeroU32,
    ) -> Result<PythonSpec, Problem> {
        let (file, class) = Self::split(&self.python).expect("reading has refused what names no file");
        Ok(PythonSpec {
            file: beside(source_name, file, &format!("{path}.python"))?,
            class: class.map(Into::into),
            sha256: self.sha256,
            params: self.params,
            neighbor_timeout_cycles: self.neighbor_timeout_cycles.unwrap_or(timeout_cycles),
        })
    }

    /// The file and the class that `python` names, or what is wrong with it.
    fn split(python: &str) -> Result<(&str, Option<&str>), String> {
        let (file, class) = match python.rsplit_once(':') {
            Some((file, class)) => (file, Some(class)),
            None => (python, None),
        };
        let is_name = |class: &str| {
            !class.starts_with(|first: char| first.is_ascii_digit())
                && class.chars().all(|char| char.is_alphanumeric() || char == '_')
        };
        match class {
            _ if file.is_empty() || file.ends_with('/') => Err(format!("`{python}` names no file")),
            _ if file.contains('\0') => Err("`python` has a NUL character".into()),
            Some(class) if class.is_empty() || !is_name(class) => {
                Err(format!("`{class}` is no name of a class"))
            }
            class => Ok((file, class)),
        }
    }
}

/// The absolute path of a file whose path is relative to that of the scenario `source_name`; `key` is where it was written.
fn beside(source_name: &str, file: &str, key: &str) -> Result<String, Problem> {
    let folder = Path::new(source_name).parent().filter(|folder| !folder.as_os_str().is_empty());
    let absolute = path::absolute(folder.unwrap_or(Path::new(".")).join(file))
        .map(PathBuf::into_os_string)
        .unwrap_or_default();
    // A name with such a character has been read from one that is no UTF-8.
    let named = absolute.into_string().ok().filter(|named| !named.contains(char::REPLACEMENT_CHARACTER));
    named.ok_or_else(|| {
        let message =
            format!("the folder of {source_name} has a name that is no UTF-8, and so has the program");
        problem(&[key], message).hint("move them into another folder")
    })
}

impl ControllerTables {
    /// The tables of a scenario with `count` robots.
    pub(crate) fn of(controllers: Vec<Controller>, count: u32) -> Self {
        let everyone = RobotSet::of(0..count);
        let mut tables: Vec<ControllerTable> = controllers
            .into_iter()
            .map(|controller| {
                let robots = Some(controller.robots).filter(|robots| Some(robots) != everyone.as_ref());
                ControllerTable::of(robots, controller.mind)
            })
            .collect();
        match tables.len() {
            1 => Self::One(tables.remove(0)),
            _ => Self::Many(tables),
        }
    }
}

impl ControllerTable {
    fn of(robots: Option<RobotSet>, mind: Mind) -> Self {
        let law = match mind {
            Mind::Law(law) => law,
            Mind::Program(ProgramSpec { command, speaks, folder, params, .. }) => {
                return Self::Program(ProgramKeys { robots, program: command, speaks, folder, params });
            }
            Mind::Python(python) => {
                return Self::Python(PythonKeys {
                    robots,
                    python: python.name(),
                    sha256: python.sha256,
                    neighbor_timeout_cycles: Some(python.neighbor_timeout_cycles),
                    params: python.params,
                });
            }
        };
        let (gradient, gradient_magnitude_per_m) = match law.gradient {
            Gradient::Measured => (GradientSource::Measured, None),
            Gradient::Fixed { magnitude_per_m } => (GradientSource::Fixed, Some(magnitude_per_m)),
        };
        Self::Law(LawKeys {
            robots,
            law: law.law,
            gain_per_s: law.gain_per_s,
            gradient,
            gradient_magnitude_per_m,
            neighbor_timeout_cycles: Some(law.neighbor_timeout_cycles),
            triangle_base_m: law.triangle_base_m,
            triangle_height_m: law.triangle_height_m,
            close_distance_m: law.close_distance_m,
            cell_cap_m: law.cell_cap_m,
        })
    }
}

fn linear() -> Law {
    Law::Linear
}

fn triangle_side() -> Positive {
    constant!(Positive, 0.6)
}

fn close_distance() -> Positive {
    constant!(Positive, 0.25)
}
