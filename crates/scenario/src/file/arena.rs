//! `[arena]`: the rectangle that robots move in.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::number::{Positive, Xy};

/// The arena: a rectangle with walls, [0, width] x [0, height].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArenaSpec {
    /// Width and height in meters.
    pub size_m: Xy<Positive>,
    /// Whether robots sense the walls: if so, percepts carry them.
    #[serde(default)]
    pub boundary_sensing: bool,
}
