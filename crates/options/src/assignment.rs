//! Assignment of an arena by its supervisor: a file in the run's folder, beside the scenario.

use std::fs;

use anyhow::Context;
use files::WriteError;
use scenario::{Origin, Place, RobotSet, Scenario};
use serde::{Deserialize, Serialize};
use transport::run_dir::RunDir;

use crate::run_options::PlayOptions;

/// All that a supervised arena is told beside the scenario.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Assignment {
    /// Its work.
    pub work: Work,
    /// Where the user has written each controller, as far as that is known: of the resolved scenario nobody knows the
    /// lines.
    places: Vec<Option<String>>,
}

/// Runs or trials that a supervised arena has to play.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Work {
    /// One run.
    Run {
        /// How it is played.
        options: PlayOptions,
        /// Robots that the supervisor leaves to be started by hand.
        by_hand: Option<RobotSet>,
        /// Whether the supervisor shows the progress.
        is_shown: bool,
    },
    /// Trial after trial of a batch, silently, as the supervisor orders.
    Trials,
}

impl Assignment {
    /// To do `work` with `scenario`.
    pub fn new(work: Work, scenario: &Scenario) -> Self {
        let place = |origin: &Origin| origin.0.as_ref().map(Place::to_string);
        Self {
            work,
            places: scenario.controllers.iter().map(|controller| place(&controller.origin)).collect(),
        }
    }

    /// Lets errors about controllers of the resolved `scenario` name the places where the user has written them.
    pub fn tell_places(&self, scenario: &mut Scenario) {
        for (controller, place) in scenario.controllers.iter_mut().zip(&self.places) {
            controller.origin = Origin(place.clone().map(Place::File));
        }
    }

    /// Writes it for the arena of `run`.
    ///
    /// # Errors
    /// If there is no room for it.
    pub fn write(&self, run: &RunDir) -> Result<(), WriteError> {
        files::replace(&run.assignment_path(), serde_json::to_vec(self).expect("an assignment is plain data"))
    }

    /// Reads what the supervisor of `run` has written.
    ///
    /// # Errors
    /// If it has written nothing, or is of another build.
    pub fn read(run: &RunDir) -> anyhow::Result<Self> {
        let path = run.assignment_path();
        let named = || path.display().to_string();
        serde_json::from_slice(&fs::read(&path).with_context(named)?).with_context(named)
    }
}

impl Work {
    /// Robots that the supervisor leaves to be started by hand.
    pub fn by_hand(&self) -> Option<&RobotSet> {
        match self {
            Self::Run { by_hand, .. } => by_hand.as_ref(),
            Self::Trials => None,
        }
    }

    /// Whether only warnings and errors are logged.
    pub fn is_quiet(&self) -> bool {
        match self {
            Self::Run { options, .. } => options.quiet,
            Self::Trials => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};

    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        options: PlayOptions,
    }

    #[test]
    fn an_assignment_is_read_as_it_was_written_whatever_the_bytes_of_its_paths() {
        let words = "run --mode=realtime --speed=0.3 --overload=slow-clock --metrics=:9464 --trace=t.json \
                     --trace-robots=0-3,7 --quiet";
        let words = words.split(' ').map(OsStr::new).chain([OsStr::from_bytes(b"--out=-caf\xe9")]);
        let options = Cli::try_parse_from(words).unwrap_or_else(|error| panic!("{error}")).options;
        let by_hand = Some("1,4-6".parse().unwrap());
        let work = Work::Run { options, by_hand, is_shown: true };
        let written = Assignment { work, places: vec![Some("s.toml:7".into()), None] };
        let read: Assignment = serde_json::from_slice(&serde_json::to_vec(&written).unwrap()).unwrap();
        assert_eq!(format!("{read:?}"), format!("{written:?}"));
        assert!(format!("{read:?}").contains(r"-caf\xE9"));
    }
}
