//! Control laws: cell and percept -> goal.
//!
//! A law is one file here and one line in `laws!`.

use protocol::{
    controller::{Stage, StageObserver},
    frame::BodyVector,
};
use serde::{Deserialize, Serialize};

use crate::control_law::{ControlLaw, Situation};

macro_rules! laws {
    ($($(#[$doc:meta])* $file:ident::$Law:ident,)*) => {
        $(mod $file;)*

        /// Which control law moves the robot.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
        #[serde(rename_all = "kebab-case")]
        pub enum Law {
            $($(#[$doc])* $Law,)*
        }

        impl Law {
            /// All laws.
            pub const ALL: &[Self] = &[$(Self::$Law,)*];

            /// Whether the robot must be shown the true field, which nobody senses.
            pub fn needs_field(self) -> bool {
                match self {
                    $(Self::$Law => $file::$Law::NEEDS_FIELD,)*
                }
            }

            /// Whether the law goes by the light, of which there must then be some.
            pub fn goes_by_light(self) -> bool {
                match self {
                    $(Self::$Law => $file::$Law::GOES_BY_LIGHT,)*
                }
            }

            /// Whether the law cuts the cell to V+.
            pub fn truncates(self) -> bool {
                match self {
                    $(Self::$Law => $file::$Law::TRUNCATES,)*
                }
            }

            fn goal(self, situation: &Situation<'_>, stages: &mut dyn StageObserver) -> Option<BodyVector> {
                match self {
                    $(Self::$Law => goal_by::<$file::$Law>(situation, stages),)*
                }
            }
        }
    };
}

laws! {
    /// The paper: φ estimated by value and gradient at the robot (eq. 10 to 18).
    linear::Linear,
    /// The paper's outlook: φ fitted by a quadratic to the robot's own reading and its neighbors'.
    quadratic::Quadratic,
    /// φ constant: plain Lloyd descent, no light needed.
    uniform::Uniform,
    /// The optimal baseline: the true field is known (Cortés et al.).
    exact::Exact,
}

/// The goal by one law. In a frame of its own: in one with the others', each cycle of each robot would touch pages of
/// code and stack that its law has no use for.
#[inline(never)]
fn goal_by<L: ControlLaw>(situation: &Situation<'_>, stages: &mut dyn StageObserver) -> Option<BodyVector> {
    L::goal(situation, stages)
}

/// The estimated centroid Ĉ relative to the robot by `law`; `None` means stay. An empty cell has none.
///
/// Tells `stages` of [`Stage::Truncation`] once, at once where nothing is truncated; what comes after it is the
/// centroid's.
pub fn goal(law: Law, situation: &Situation<'_>, stages: &mut dyn StageObserver) -> Option<BodyVector> {
    let is_empty = situation.cell.is_empty();
    if is_empty || !law.truncates() {
        stages.passed(Stage::Truncation);
    }
    if is_empty {
        return None;
    }
    law.goal(situation, stages)
}
