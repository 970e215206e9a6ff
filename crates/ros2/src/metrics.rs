//! The swarm in numbers, each on a topic of its own, which is how ROS 2 plots.

use recording::lamplight::Metrics;

use crate::topic::{self, Topic};

/// The known values of a moment, with their topics. A value that is not known is left out, and has no message.
pub(crate) fn known(metrics: &Metrics) -> impl Iterator<Item = (Topic, f64)> {
    // Exact up to 2^53, as far as a run can count.
    let count = |number: u64| Some(number as f64);
    let values = [
        (topic::MEAN_ERROR_M, metrics.mean_error_m),
        (topic::MAX_ERROR_M, metrics.max_error_m),
        (topic::MEAN_TRUE_ERROR_M, metrics.mean_true_error_m),
        (topic::COST_H, metrics.cost_h),
        (topic::MEAN_LAMP_DISTANCE_M, metrics.mean_lamp_distance_m),
        (topic::ROBOTS_ALIVE, count(metrics.robots_alive.into())),
        (topic::ROBOTS_PAUSED, count(metrics.robots_paused.into())),
        (topic::PACKETS_SENT, count(metrics.packets_sent)),
        (topic::PACKETS_HEARD, count(metrics.packets_heard)),
        (topic::PACKETS_COLLIDED, count(metrics.packets_collided)),
        (topic::PACKETS_LOST, count(metrics.packets_lost)),
    ];
    values.into_iter().filter_map(|(topic, value)| value.map(|value| (topic, value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_error_is_not_told_and_a_count_of_nothing_is() {
        let metrics = Metrics { max_error_m: Some(0.5), packets_lost: 3, ..Metrics::default() };
        let told: Vec<_> = known(&metrics).map(|(topic, value)| (topic.name, value)).collect();
        assert_eq!(
            told,
            [
                ("/metrics/max_error_m", 0.5),
                ("/metrics/robots_alive", 0.0),
                ("/metrics/robots_paused", 0.0),
                ("/metrics/packets_sent", 0.0),
                ("/metrics/packets_heard", 0.0),
                ("/metrics/packets_collided", 0.0),
                ("/metrics/packets_lost", 3.0),
            ]
        );
    }
}
