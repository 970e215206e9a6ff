//! `pause`: agents are stopped, and go on later as if nothing had been.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;

/// Agents are stopped (SIGSTOP), and go on later (SIGCONT).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pause {}

impl Parameters for Pause {
    // Their silence is no loss: they do not speak.
    const NATURE: Nature = Nature { exclusive: true, ..Nature::of(Strikes::Robots) };

    fn drawn(_: &mut Drawer<'_>, _: &Window) -> Self {
        Self {}
    }
}
