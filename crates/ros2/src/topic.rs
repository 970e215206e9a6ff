//! Topics of a bag.

use crate::definitions::MessageType;

/// A topic, which has messages of one type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Topic {
    /// As ROS 2 names it.
    pub(crate) name: &'static str,
    /// The type of its messages.
    pub(crate) message: MessageType,
}

/// Virtual time.
pub(crate) const CLOCK: Topic = Topic { name: "/clock", message: MessageType::Clock };
/// A frame for each robot.
pub(crate) const TRANSFORMS: Topic = Topic { name: "/tf", message: MessageType::TfMessage };
/// All robots' poses.
pub(crate) const POSES: Topic = Topic { name: "/robots", message: MessageType::PoseArray };
/// Bodies, cells, walls and lamps.
pub(crate) const SCENE: Topic = Topic { name: "/scene", message: MessageType::MarkerArray };

// The swarm in numbers: one topic for each.
pub(crate) const MEAN_ERROR_M: Topic = metric("/metrics/mean_error_m");
pub(crate) const MAX_ERROR_M: Topic = metric("/metrics/max_error_m");
pub(crate) const MEAN_TRUE_ERROR_M: Topic = metric("/metrics/mean_true_error_m");
pub(crate) const COST_H: Topic = metric("/metrics/cost_h");
pub(crate) const MEAN_LAMP_DISTANCE_M: Topic = metric("/metrics/mean_lamp_distance_m");
pub(crate) const ROBOTS_ALIVE: Topic = metric("/metrics/robots_alive");
pub(crate) const ROBOTS_PAUSED: Topic = metric("/metrics/robots_paused");
pub(crate) const PACKETS_SENT: Topic = metric("/metrics/packets_sent");
pub(crate) const PACKETS_HEARD: Topic = metric("/metrics/packets_heard");
pub(crate) const PACKETS_COLLIDED: Topic = metric("/metrics/packets_collided");
pub(crate) const PACKETS_LOST: Topic = metric("/metrics/packets_lost");

/// All topics, in the order in which a bag lists them.
pub(crate) const TOPICS: [Topic; 15] = [
    CLOCK,
    TRANSFORMS,
    POSES,
    SCENE,
    MEAN_ERROR_M,
    MAX_ERROR_M,
    MEAN_TRUE_ERROR_M,
    COST_H,
    MEAN_LAMP_DISTANCE_M,
    ROBOTS_ALIVE,
    ROBOTS_PAUSED,
    PACKETS_SENT,
    PACKETS_HEARD,
    PACKETS_COLLIDED,
    PACKETS_LOST,
];

const fn metric(name: &'static str) -> Topic {
    Topic { name, message: MessageType::Float64 }
}
