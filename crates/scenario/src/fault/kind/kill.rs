//! `kill`: agents die, and perhaps begin a new life without their memory.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Timing, Window};
use crate::fault::parameters::Parameters;
use crate::number::Share;
use crate::problem::{Problem, ensure};

/// Agents are killed (SIGKILL), and perhaps restarted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Kill {
    /// The share of the killed robots that is restarted, drawn at random; without it all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restart_share: Option<Share>,
}

impl Parameters for Kill {
    // Their silence is no loss: they do not speak.
    const NATURE: Nature =
        Nature { timing: Timing::Undone, exclusive: true, ..Nature::of(Strikes::ChosenRobots) };

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        ensure(self.restart_share.is_none() || entry.gives("restart_at_s"), || {
            entry.problem(&["restart_share"], "`restart_share` needs `restart_at_s`")
        })
    }

    fn drawn(draw: &mut Drawer<'_>, window: &Window) -> Self {
        let restarts = window.until_s.is_some() && draw.chance(0.4);
        Self { restart_share: restarts.then(|| draw.share(1.0)).flatten() }
    }
}
