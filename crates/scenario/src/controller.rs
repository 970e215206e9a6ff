//! Controllers and their robots, resolved.

use std::num::NonZeroU32;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::{env, fs};

use coverage::law::Law;
use coverage::setup::GradientMode;
use neighborhood::Setup;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::error::{Origin, Place, ScenarioError};
use super::number::Positive;
use super::robot_set::RobotSet;

const FIT_FOR_JSON: &str = "reading has refused what JSON has not";

/// Some robots and the mind of each.
#[derive(Clone, Debug, PartialEq)]
pub struct Controller {
    /// The robots.
    pub robots: RobotSet,
    /// The mind of each of them.
    pub mind: Mind,
    /// Where it was written.
    pub origin: Origin,
}

/// The mind of a robot.
#[derive(Clone, Debug, PartialEq)]
pub enum Mind {
    /// A law of the paper.
    Law(LawSpec),
    /// A program of its own.
    Program(ProgramSpec),
    /// A class in Python.
    Python(PythonSpec),
}

/// A control law of the paper with its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct LawSpec {
    /// Control law.
    pub law: Law,
    /// Gain k of eq. 8, per second.
    pub gain_per_s: Positive,
    /// Where the gradient of φ comes from.
    pub gradient: Gradient,
    /// A neighbor not heard for this many neighbor cycles is forgotten.
    pub neighbor_timeout_cycles: NonZeroU32,
    /// Base in meters of the triangle that closes the cell of a robot with all neighbors on one bearing.
    pub triangle_base_m: Positive,
    /// Height of that triangle in meters.
    pub triangle_height_m: Positive,
    /// Distance in meters of the line that closes a bearing gap of π or more.
    pub close_distance_m: Positive,
    /// Distance in meters at which every cell is cut off, if it is.
    pub cell_cap_m: Option<Positive>,
}

/// A program that thinks for a robot, each in a process of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramSpec {
    /// The program and its first arguments: an absolute path, or a bare name that is looked for in PATH.
    pub command: Vec<String>,
    /// Language in which it gets percepts and gives commands.
    pub speaks: Speaks,
    /// Absolute path of the folder in which it is started; `None` for that of whoever starts it.
    pub folder: Option<String>,
    /// Parameters that only it understands.
    pub params: toml::Table,
    /// As many neighbor cycles as the laws of the paper would remember a neighbor: for those who watch.
    pub neighbor_timeout_cycles: NonZeroU32,
}

/// Language in which a program gets percepts and gives commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Speaks {
    /// Shared memory: the program is built on the library `robot-agent`.
    #[default]
    SharedMemory,
    /// A line of JSON for each percept on its standard input, and one for each command on its standard output.
    JsonLines,
}

/// A class in Python that thinks for a robot, in a process of its own each.
#[derive(Clone, Debug, PartialEq)]
pub struct PythonSpec {
    /// Absolute path of the file.
    pub file: String,
    /// The class in it; without one, the file's only controller.
    pub class: Option<String>,
    /// SHA-256 of the file, in hex, as [`find_controllers`](super::Scenario::find_controllers) has found it, or as it must be.
    pub sha256: Option<String>,
    /// Parameters that only it understands.
    pub params: toml::Table,
    /// For how many neighbor cycles its percepts tell of a neighbor that is not heard.
    pub neighbor_timeout_cycles: NonZeroU32,
}

/// Where a robot's gradient of φ comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gradient {
    /// The sensor measures it (Section IV).
    Measured,
    /// Its direction is towards the stimulus, its magnitude is fixed (Section V).
    Fixed {
        /// Sensor counts per meter.
        magnitude_per_m: Positive,
    },
}

impl From<Gradient> for GradientMode {
    fn from(gradient: Gradient) -> Self {
        match gradient {
            Gradient::Measured => Self::Measured,
            Gradient::Fixed { magnitude_per_m } => Self::Fixed(magnitude_per_m.get()),
        }
    }
}

impl Controller {
    /// The law of the paper that moves its robots, if one does.
    pub fn law(&self) -> Option<&LawSpec> {
        match &self.mind {
            Mind::Law(law) => Some(law),
            Mind::Program(_) | Mind::Python(_) => None,
        }
    }

    /// The same, to be changed.
    pub fn law_mut(&mut self) -> Option<&mut LawSpec> {
        match &mut self.mind {
            Mind::Law(law) => Some(law),
            Mind::Program(_) | Mind::Python(_) => None,
        }
    }

    /// The program of the user's that thinks for its robots, if one does.
    pub fn program(&self) -> Option<&ProgramSpec> {
        match &self.mind {
            Mind::Program(program) => Some(program),
            Mind::Law(_) | Mind::Python(_) => None,
        }
    }

    /// The class in Python that thinks for its robots, if one does.
    pub fn python(&self) -> Option<&PythonSpec> {
        match &self.mind {
            Mind::Python(python) => Some(python),
            Mind::Law(_) | Mind::Program(_) => None,
        }
    }

    /// The name of what thinks for its robots, if that is the user's own.
    pub fn own_name(&self) -> Option<String> {
        match &self.mind {
            Mind::Law(_) => None,
            Mind::Program(program) => Some(program.command[0].clone()),
            Mind::Python(python) => Some(python.name()),
        }
    }

    /// The words that start an agent of its robots from a shell.
    pub fn agent_words(&self) -> Vec<String> {
        match &self.mind {
            Mind::Law(_) => vec!["robot-agent".into()],
            Mind::Program(ProgramSpec { command, speaks: Speaks::SharedMemory, .. }) => command.clone(),
            Mind::Program(ProgramSpec { command, speaks: Speaks::JsonLines, .. }) => {
                ["json-lines-agent".into()].into_iter().chain(command.iter().cloned()).collect()
            }
            Mind::Python(python) => ["python3", "-m", "lamplight.agent"]
                .map(Into::into)
                .into_iter()
                .chain([python.name()])
                .collect(),
        }
    }

    /// Returns the same without `robots`; `None` if it has no others.
    pub fn without(self, robots: &RobotSet) -> Option<Self> {
        Some(Self { robots: RobotSet::of(self.robots.iter().filter(|&it| !robots.contains(it)))?, ..self })
    }

    /// Returns the same for those of its robots that are among the first `count`; `None` if none is.
    pub fn among_first(&self, count: u32) -> Option<Self> {
        Some(Self { robots: self.robots.below(count)?, ..self.clone() })
    }

    /// Whether its robots are shown the true field.
    pub fn senses_field(&self) -> bool {
        self.law().is_some_and(|law| law.law.needs_field())
    }

    /// Whether its robots' ideal light sensors measure the gradient of φ, and not its direction alone.
    pub fn senses_gradient(&self) -> bool {
        self.law().is_none_or(|law| law.gradient == Gradient::Measured)
    }

    /// For how many neighbor cycles its robots remember a neighbor that they do not hear.
    pub fn neighbor_timeout_cycles(&self) -> NonZeroU32 {
        match &self.mind {
            Mind::Law(law) => law.neighbor_timeout_cycles,
            Mind::Program(program) => program.neighbor_timeout_cycles,
            Mind::Python(python) => python.neighbor_timeout_cycles,
        }
    }

    /// An error about this entry, where it was written.
    pub fn error(&self, message: String, hint: &str) -> ScenarioError {
        let place = self.origin.0.clone().unwrap_or_else(|| Place::File("the scenario".into()));
        ScenarioError { place, message, hint: Some(hint.into()) }
    }

    /// Makes sure that its program or file is there, and knows the path of the one and the contents of the other.
    pub(super) fn find(&mut self) -> Result<(), ScenarioError> {
        match &self.mind {
            Mind::Law(_) => Ok(()),
            Mind::Program(_) => self.find_program(),
            Mind::Python(_) => self.find_python(),
        }
    }

    fn find_python(&mut self) -> Result<(), ScenarioError> {
        let Mind::Python(python) = &self.mind else { return Ok(()) };
        let (file, robots) = (&python.file, &self.robots);
        let contents = fs::read(file).map_err(|error| {
            let message = format!("the controller {file} of robots {robots} cannot be read: {error}");
            let on_command_line =
                matches!(&self.origin.0, Some(Place::Override(it)) if it.starts_with("--controller"));
            let hint = match (file.contains(".py"), on_command_line) {
                (true, false) => "correct its path, which is relative to the scenario file",
                (true, true) => "correct its path, which is relative to the folder that you are in",
                (false, _) => "a controller in Python is named FILE.py:CLASS, or FILE.py",
            };
            self.error(message, hint)
        })?;
        let found: String = Sha256::digest(&contents).iter().map(|byte| format!("{byte:02x}")).collect();
        if let Some(expected) =
            python.sha256.as_ref().filter(|expected| !expected.eq_ignore_ascii_case(&found))
        {
            let message = format!(
                "the controller {file} of robots {robots} is another one: its SHA-256 is {found}, not {expected}"
            );
            return Err(
                self.error(message, "put back the file that it was, or remove `sha256` to run this one")
            );
        }
        if let Mind::Python(python) = &mut self.mind {
            python.sha256 = Some(found);
        }
        Ok(())
    }

    fn find_program(&mut self) -> Result<(), ScenarioError> {
        let Mind::Program(program) = &mut self.mind else { return Ok(()) };
        let name = program.command[0].clone();
        if let Some(folder) = program.folder.clone().filter(|folder| !Path::new(folder).is_dir()) {
            return Err(self.error(
                format!("the folder {folder} of the program {name} of robots {} is none", self.robots),
                "name one that there is, relative to the scenario file",
            ));
        }
        if name.contains('/') {
            return match fs::metadata(&name) {
                Ok(file) if is_executable(&file) => Ok(()),
                Ok(file) if file.is_dir() => Err(self.error(
                    format!("the program {name} of robots {} is a directory", self.robots),
                    "name a program in it",
                )),
                Ok(_) => Err(self.error(
                    format!("the program {name} of robots {} is not executable", self.robots),
                    "make it so with `chmod +x`, or name another one",
                )),
                Err(error) => Err(self.error(
                    format!("the program {name} of robots {} cannot be started: {error}", self.robots),
                    "build it, or correct its path, which is relative to the scenario file",
                )),
            };
        }
        let folders = env::var_os("PATH").unwrap_or_default();
        let is_there = |path: &Path| fs::metadata(path).is_ok_and(|file| is_executable(&file));
        match env::split_paths(&folders).map(|folder| folder.join(&name)).find(|path| is_there(path)) {
            Some(path) => program.command[0] = path.to_string_lossy().into_owned(),
            None => {
                return Err(self.error(
                    format!("the program `{name}` of robots {} is not in PATH", self.robots),
                    &format!("give its path, such as ./{name}, which is relative to the scenario file"),
                ));
            }
        }
        Ok(())
    }
}

impl PythonSpec {
    /// File and class as a scenario spells them.
    pub fn name(&self) -> String {
        let Self { file, class, .. } = self;
        class.as_ref().map_or_else(|| file.clone(), |class| format!("{file}:{class}"))
    }
}

/// The parameters of a controller in another language, which remembers neighbors for so many ticks.
pub(crate) fn setup_of(params: &toml::Table, neighbor_timeout_ticks: u32) -> Setup {
    let params = serde_json::to_value(params).expect(FIT_FOR_JSON);
    let serde_json::Value::Object(params) = params else { unreachable!("a table is an object") };
    Setup { params, neighbor_timeout_ticks }
}

impl ProgramSpec {
    /// Its parameters as JSON.
    pub fn json(&self) -> Vec<u8> {
        serde_json::to_vec(&self.params).expect(FIT_FOR_JSON)
    }
}

fn is_executable(file: &fs::Metadata) -> bool {
    file.is_file() && file.permissions().mode() & 0o111 != 0
}
