//! The infrared channel: who hears whom in a tick.

mod range;
mod voronoi;

use crate::{
    frame::Pose,
    scenario::{ChannelModel, Scenario},
};

/// A channel model with its parameters.
#[derive(Clone, Debug)]
pub struct Channel {
    model: ChannelModel,
    range_m: f64,
    size_m: [f64; 2],
}

impl Channel {
    /// The channel of a scenario.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            model: scenario.channel.model,
            range_m: scenario.channel.range_m.map_or(f64::INFINITY, |range| range.get()),
            size_m: scenario.arena.size_m.get(),
        }
    }

    /// For each robot, the indices of those it hears, ascending. Only robots that `speak` are
    /// heard, and only they listen.
    pub fn who_hears_whom(&self, poses: &[Pose], speak: &[bool]) -> Vec<Vec<usize>> {
        let speakers: Vec<usize> = (0..poses.len()).filter(|&robot| speak[robot]).collect();
        let positions: Vec<_> = speakers.iter().map(|&robot| poses[robot].position).collect();
        let among_speakers = match self.model {
            ChannelModel::Range => range::heard(&positions, self.range_m, self.size_m),
            ChannelModel::Voronoi => voronoi::heard(&positions),
        };
        let mut heard = vec![Vec::new(); poses.len()];
        for (&robot, senders) in speakers.iter().zip(among_speakers) {
            heard[robot] = senders.into_iter().map(|sender| speakers[sender]).collect();
        }
        heard
    }
}
