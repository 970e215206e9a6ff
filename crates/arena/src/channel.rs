//! The infrared channel: who hears whom, and what becomes of packets in the air.
//!
//! In:  one moment of the world: poses, and what each live robot says.
//! Out: the receptions that the medium lets through, in the order of receivers; everything else is
//! counted by its cause in [`Packets`].
//!
//! ```text
//! access (when) -> reach (to whom) -> air (what overlaps) -> receptions -> faults, measurement
//! ```

mod access;
pub mod closed_form;
mod moment;
mod reach;
mod reception;
mod timed;

use protocol::packet::Packet;

pub use moment::Moment;
pub use reception::Reception;
pub use timed::Crowding;

use crate::{
    executor::Executor,
    index_lists::IndexLists,
    losses::{Cause, Losses},
    packets::Packets,
    random::{Draws, Purpose},
};
use scenario::Scenario;

use reach::{Reach, Reached};
use timed::TimedChannel;

/// A channel with what is in the air.
#[derive(Clone, Debug)]
pub struct Channel {
    reach: Reach,
    /// Pairs of robots that were looked at.
    examined: u64,
    medium: Medium,
    loss: f64,
    seed: u64,
    losses: Losses,
}

#[derive(Clone, Debug)]
enum Medium {
    /// All packets at once and in no time, at the beginning of a cycle.
    Instant(InstantChannel),
    /// Packets last, and meet.
    Timed(Box<TimedChannel>),
}

impl Channel {
    /// The channel of a scenario, before anything was said.
    pub fn new(scenario: &Scenario) -> Self {
        let reach = Reach::new(scenario);
        let medium = match scenario.channel.air() {
            None => Medium::Instant(InstantChannel::default()),
            Some(air) => Medium::Timed(Box::new(TimedChannel::new(air, scenario, &reach))),
        };
        let (loss, seed) = (scenario.channel.loss.get(), scenario.seed.get());
        Self { reach, examined: 0, medium, loss, seed, losses: Losses::default() }
    }

    /// Plays the channel up to `moment`. `transmit` is asked once per packet, when it goes out, and
    /// may change it. `executor` shares what can be shared. Receptions are written over `received`, in the order of
    /// receivers, then of time; their fate is not in `packets` yet, since faults may still be in their way.
    pub fn play(
        &mut self,
        executor: &impl Executor,
        moment: &Moment<'_>,
        packets: &mut Packets,
        transmit: &mut dyn FnMut(u32, Packet) -> Packet,
        received: &mut Vec<Reception>,
    ) {
        received.clear();
        self.examined += match &mut self.medium {
            Medium::Instant(instant) => {
                if moment.cycle.is_some() {
                    self.reach.look(moment.poses, |robot| moment.said[robot].is_some());
                }
                instant.play(executor, &self.reach, moment, packets, transmit, received)
            }
            Medium::Timed(air) => {
                air.play(&mut self.reach, moment, packets, &mut self.losses, transmit, received)
            }
        };
        if self.loss > 0.0 {
            let before = received.len();
            received.retain(|reception| {
                let Reception { sender, receiver, number, .. } = *reception;
                let draws = || Draws::of(self.seed, Purpose::ChannelLoss, number, sender, receiver);
                let is_lost = draws().chance(self.loss);
                if is_lost {
                    self.losses.add(sender, receiver, Cause::Chance);
                }
                !is_lost
            });
            packets.lost_loss += (before - received.len()) as u64;
        }
    }

    /// Packets that were not heard since the last neighbor cycle.
    pub fn losses(&self) -> &Losses {
        &self.losses
    }

    /// The same, to be changed.
    pub fn losses_mut(&mut self) -> &mut Losses {
        &mut self.losses
    }

    /// Packets that are in the air, or have been until now.
    pub fn in_the_air(&self) -> impl Iterator<Item = &Packet> {
        let timed = match &self.medium {
            Medium::Instant(_) => None,
            Medium::Timed(air) => Some(air.packets()),
        };
        timed.into_iter().flatten()
    }

    /// How many packets got through the crowd, by the number of robots that could disturb them;
    /// `None` on a channel where none can.
    pub fn crowding(&self) -> Option<&Crowding> {
        match &self.medium {
            Medium::Instant(_) => None,
            Medium::Timed(air) => Some(air.crowding()),
        }
    }

    /// Pairs of robots that were looked at: what a tick costs.
    pub fn examined(&self) -> u64 {
        self.examined
    }
}

/// Every speaker is heard by all in reach. What is kept from one moment to the next is memory alone.
#[derive(Clone, Debug, Default)]
struct InstantChannel {
    spoken: Vec<Option<Packet>>,
    /// (receiver, sender)
    flights: Vec<(usize, usize)>,
    senders: IndexLists,
    /// By sender.
    reached: Vec<Reached>,
}

impl InstantChannel {
    /// Returns how many pairs were looked at.
    fn play(
        &mut self,
        executor: &impl Executor,
        reach: &Reach,
        moment: &Moment<'_>,
        packets: &mut Packets,
        transmit: &mut dyn FnMut(u32, Packet) -> Packet,
        received: &mut Vec<Reception>,
    ) -> u64 {
        let Some(cycle) = moment.cycle else { return 0 };
        let Self { spoken, flights, senders, reached } = self;
        reached.resize_with(moment.said.len(), Reached::default);
        executor.share(reached, |first, reached| {
            for (sender, reached) in (first..).zip(reached) {
                match moment.said[sender] {
                    Some(_) => reach.of(sender as u32, cycle, reached),
                    None => reached.clear(),
                }
            }
        });
        spoken.clear();
        spoken.extend_from_slice(moment.said);
        flights.clear();
        for (sender, (spoken, reached)) in spoken.iter_mut().zip(&*reached).enumerate() {
            let Some(packet) = spoken else { continue };
            *packet = transmit(sender as u32, *packet);
            packets.sent += 1;
            packets.in_range += reached.in_range();
            packets.lost_range += reach.listeners() - 1 - reached.in_range();
            packets.lost_edge += u64::from(reached.faded);
            packets.occluded += u64::from(reached.occluded);
            flights.extend(reached.robots.iter().map(|&receiver| (receiver as usize, sender)));
        }
        senders.regroup(spoken.len(), flights);
        for (receiver, senders) in (0..).zip(senders.iter()) {
            received.extend(senders.iter().filter_map(|&sender| {
                let packet = spoken[sender]?;
                Some(Reception {
                    sender: sender as u32,
                    receiver,
                    number: cycle,
                    sent_s: moment.time_s,
                    packet,
                })
            }));
        }
        reached.iter().map(|reached| u64::from(reached.examined)).sum()
    }
}
