//! Controllers and their robots, resolved.

use std::num::NonZeroU32;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::{env, fs};

use coverage::law::Law;
use coverage::setup::GradientMode;

use super::error::{Origin, Place, ScenarioError};
use super::number::Positive;
use super::robot_set::RobotSet;

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
    /// Parameters that only it understands.
    pub params: toml::Table,
    /// As many neighbor cycles as the laws of the paper would remember a neighbor: for those who watch.
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
            Mind::Program(_) => None,
        }
    }

    /// The same, to be changed.
    pub fn law_mut(&mut self) -> Option<&mut LawSpec> {
        match &mut self.mind {
            Mind::Law(law) => Some(law),
            Mind::Program(_) => None,
        }
    }

    /// The program that thinks for its robots, if one does.
    pub fn program(&self) -> Option<&ProgramSpec> {
        match &self.mind {
            Mind::Law(_) => None,
            Mind::Program(program) => Some(program),
        }
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
        }
    }

    /// An error about this entry, where it was written.
    pub fn error(&self, message: String, hint: &str) -> ScenarioError {
        let place = self.origin.0.clone().unwrap_or_else(|| Place::File("the scenario".into()));
        ScenarioError { place, message, hint: Some(hint.into()) }
    }

    /// Makes sure that its program can be started, and knows its path.
    pub(super) fn find_program(&mut self) -> Result<(), ScenarioError> {
        let Mind::Program(program) = &mut self.mind else { return Ok(()) };
        let name = program.command[0].clone();
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

impl ProgramSpec {
    /// Its parameters as JSON.
    pub fn json(&self) -> Vec<u8> {
        serde_json::to_vec(&self.params).expect("reading has refused what JSON has not")
    }
}

fn is_executable(file: &fs::Metadata) -> bool {
    file.is_file() && file.permissions().mode() & 0o111 != 0
}
