//! `[processes]`: how the robots' processes are supervised.

use std::time::Duration;

use protocol::setup::Plane;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::number::{NonNegative, Positive};

/// How long a robot may take to join that the run starts, unless the scenario says otherwise: a thousand take two
/// seconds on two cores.
const JOIN_TIMEOUT: Duration = Duration::from_secs(30);

/// How the robots' processes are supervised.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ProcessesSpec {
    /// A robot that has not answered a tick for this long, in seconds of wall time, hangs.
    pub hang_timeout_s: Positive,
    /// Treatment of a robot that hangs.
    pub on_hang: OnHang,
    /// How long the arena waits for a robot to join, in seconds of wall time. Without it, 30 seconds for robots that
    /// the run starts, and without limit for those that are driven by hand.
    pub join_timeout_s: Option<Positive>,
    /// Transport of messages; without it blackboards in lock-step, publish-subscribe in real time.
    #[schemars(with = "Option<PlaneName>")]
    pub plane: Option<Plane>,
    /// Most private memory that a robot's process may have, in megabytes (10^6 bytes); one that asks for more gets none,
    /// which mostly ends it. Without it there is no limit. It does not count what it shares with others.
    pub memory_max_mb: Option<Positive>,
    /// Each robot's clock runs fast or slow by a share of its own, drawn evenly, of up to this many parts per million;
    /// a restarted robot draws another. In every engine robots send by it with `channel.access = "random"` or
    /// `"fixed-phase"` (other cycles are shared, and stay so); in real time they wake up by it as well.
    pub clock_drift_ppm: NonNegative,
    /// In real time, each wake-up of a robot's timer comes late by a time of its own, drawn evenly, of up to
    /// this many seconds; less than a neighbor cycle.
    pub timer_jitter_s: NonNegative,
}

/// Treatment of a robot that hangs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OnHang {
    /// The run fails.
    Fail,
    /// The run goes on without it.
    #[default]
    Exclude,
    /// It is killed and started anew.
    Restart,
}

impl ProcessesSpec {
    /// `hang_timeout_s` as a duration of wall time.
    pub fn hang_timeout(&self) -> Duration {
        duration(self.hang_timeout_s)
    }

    /// `memory_max_mb` in bytes.
    pub fn memory_max_bytes(&self) -> Option<u64> {
        self.memory_max_mb.map(|megabytes| (megabytes.get() * 1e6) as u64)
    }

    /// How long a robot may take to join, of wall time; `None` if as long as it likes.
    pub fn join_timeout(&self, by_hand: bool) -> Option<Duration> {
        let unless_said = if by_hand { None } else { Some(JOIN_TIMEOUT) };
        self.join_timeout_s.map(duration).or(unless_said)
    }
}

/// Converts seconds; more than a clock can count is forever.
fn duration(seconds: Positive) -> Duration {
    Duration::try_from_secs_f64(seconds.get()).unwrap_or(Duration::MAX)
}

impl Default for ProcessesSpec {
    fn default() -> Self {
        Self {
            hang_timeout_s: constant!(Positive, 2.0),
            on_hang: OnHang::default(),
            join_timeout_s: None,
            plane: None,
            memory_max_mb: None,
            clock_drift_ppm: constant!(NonNegative, 0.0),
            timer_jitter_s: constant!(NonNegative, 0.0),
        }
    }
}

// `protocol::setup::Plane` as the schema sees it, so that `protocol` need not know schemars.
/// Transport of percepts and commands between the arena and its agents.
#[derive(JsonSchema)]
#[serde(rename = "Plane", rename_all = "kebab-case")]
#[allow(dead_code, reason = "only its schema is used")]
enum PlaneName {
    /// One latest value per direction, which the next one replaces: what lock-step needs.
    Blackboard,
    /// Short queues: in real time a message that comes while another waits does not replace it.
    PublishSubscribe,
}
