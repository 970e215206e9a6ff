//! Packets in the air: those that overlap at a receiver destroy each other, or the first one wins. Where a scenario
//! asks for it, packets that nobody can read there destroy as well.
//!
//! All packets last equally long, so in the order in which they start they also end, and what
//! overlaps with a packet at a receiver is its neighbor in that order.

use std::mem;

use protocol::{packet::Packet, robot_id::RobotId};

use super::{
    Moment, Reception,
    access::{Rhythm, Schedule},
    reach::{Reach, Reached},
};
use crate::{
    index_lists::IndexLists,
    losses::{Cause, Losses},
    packets::Packets,
};
use scenario::{Air, Capture, Scenario};

/// Packets that overlap by less than this touch: rounding, not air. Seconds.
const TOUCH_S: f64 = 1e-9;
/// Most disturbers that are told apart in [`Crowding`]; packets with more count with these.
const DISTURBERS_MAX: usize = 255;

/// The medium.
#[derive(Clone, Debug)]
pub(super) struct TimedChannel {
    schedule: Schedule,
    airtime_s: f64,
    half_duplex: bool,
    capture: Capture,
    /// Up to when the air has been played.
    played_s: f64,
    /// The clock of each robot.
    rhythms: Vec<Rhythm>,
    /// Each robot's next packet.
    next: Vec<Next>,
    /// Packets in the order of their starts: those still in the air, and before them those that
    /// have ended but may overlap with them.
    packets: Vec<Transmission>,
    /// How many of them have been resolved.
    resolved: usize,
    /// Until when each receiver follows the packet it has locked to.
    locked_s: Vec<f64>,
    /// Whether some packets may disturb others without being read.
    disturbs_unread: bool,
    /// How many robots each robot's last packet reached, to be read or only to disturb: as many disturb it.
    degrees: Vec<Option<u32>>,
    crowding: Crowding,
    by_robot: ByRobot,
    /// Start, sender and number of packets that start in a tick; kept for its memory alone.
    starting: Vec<(f64, u32, u64)>,
    /// Memory of packets that are forgotten, for those to come.
    spare: Vec<Reached>,
}

/// Indices of `packets`, robot by robot; kept for its memory alone.
#[derive(Clone, Debug, Default)]
struct ByRobot {
    /// Which packets reach it, in order.
    arrivals: IndexLists,
    /// Which packets only disturb it, in order; kept only if some may.
    disturbing: IndexLists,
    /// Which are its own, in order.
    own: IndexLists,
    /// (robot, packet), while they are grouped.
    entries: Vec<(usize, usize)>,
}

impl ByRobot {
    fn sort(&mut self, robots: usize, packets: &[Transmission], disturbs_unread: bool) {
        let Self { arrivals, disturbing, own, entries } = self;
        if disturbs_unread {
            entries.clear();
            for (at, packet) in packets.iter().enumerate() {
                entries.extend(packet.reached.disturbed.iter().map(|&receiver| (receiver as usize, at)));
            }
            disturbing.regroup(robots, entries);
        }
        entries.clear();
        for (at, packet) in packets.iter().enumerate() {
            entries.extend(packet.reached.robots.iter().map(|&receiver| (receiver as usize, at)));
        }
        arrivals.regroup(robots, entries);
        entries.clear();
        entries.extend(packets.iter().enumerate().map(|(at, packet)| (packet.sender as usize, at)));
        own.regroup(robots, entries);
    }
}

#[derive(Clone, Copy, Debug)]
struct Next {
    number: u64,
    start_s: f64,
}

/// A packet in the air.
#[derive(Clone, Debug)]
struct Transmission {
    sender: u32,
    number: u64,
    start_s: f64,
    packet: Packet,
    reached: Reached,
}

/// Fate of a packet at a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Heard,
    Collided,
    /// The receiver was transmitting itself.
    Deaf,
}

/// How packets fared in the crowd, by the number of robots that could disturb them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Crowding {
    /// For each number of disturbers: packets at receivers, and how many of them got through.
    counts: Vec<[u64; 2]>,
}

impl Crowding {
    /// Number of disturbers (the receiver itself among them in half duplex), packets at receivers
    /// with so many, and how many got through; only numbers that have been seen.
    pub fn iter(&self) -> impl Iterator<Item = (u32, u64, u64)> {
        let seen = (0..).zip(&self.counts).filter(|(_, counts)| counts[0] > 0);
        seen.map(|(disturbers, &[packets, through])| (disturbers, packets, through))
    }

    fn count(&mut self, disturbers: usize, through: bool) {
        let at = disturbers.min(DISTURBERS_MAX);
        if self.counts.len() <= at {
            self.counts.resize(at + 1, [0, 0]);
        }
        self.counts[at][0] += 1;
        self.counts[at][1] += u64::from(through);
    }
}

impl TimedChannel {
    pub(super) fn new(air: &Air, scenario: &Scenario, reach: &Reach) -> Self {
        let schedule = Schedule::new(air.access, scenario);
        let robots = scenario.robot_count();
        // The channel has been at work for a cycle when the run begins.
        let played_s = -scenario.cycle_s();
        let rhythms: Vec<Rhythm> = (0..robots).map(|sender| schedule.first_rhythm(sender)).collect();
        let first = |(sender, rhythm)| {
            let starts =
                (0..).map(|number| Next { number, start_s: schedule.start_s(rhythm, sender, number) });
            starts.into_iter().find(|next| next.start_s >= played_s).expect("later packets start later")
        };
        Self {
            airtime_s: air.airtime_s.get(),
            half_duplex: air.half_duplex,
            capture: air.capture,
            played_s,
            next: (0..).zip(&rhythms).map(first).collect(),
            rhythms,
            schedule,
            packets: Vec::new(),
            resolved: 0,
            locked_s: vec![f64::NEG_INFINITY; robots as usize],
            disturbs_unread: reach.disturbs_unread(),
            degrees: vec![None; robots as usize],
            crowding: Crowding::default(),
            by_robot: ByRobot::default(),
            starting: Vec::new(),
            spare: Vec::new(),
        }
    }

    /// Packets that have begun and are not forgotten.
    pub(super) fn packets(&self) -> impl Iterator<Item = &Packet> {
        self.packets.iter().map(|transmission| &transmission.packet)
    }

    pub(super) fn crowding(&self) -> &Crowding {
        &self.crowding
    }

    /// Plays the air up to `moment`: packets that start go up, packets that end come down.
    /// Returns how many pairs of robots were looked at.
    pub(super) fn play(
        &mut self,
        reach: &mut Reach,
        moment: &Moment<'_>,
        packets: &mut Packets,
        losses: &mut Losses,
        transmit: &mut dyn FnMut(u32, Packet) -> Packet,
        received: &mut Vec<Reception>,
    ) -> u64 {
        self.played_s = moment.time_s;
        let known = self.packets.len();
        let listeners = self.send_up(reach, moment, transmit);
        let examined = self.packets[known..].iter().map(|packet| u64::from(packet.reached.examined)).sum();
        self.bring_down(moment, listeners, packets, losses, received);
        self.forget();
        examined
    }

    /// Sends up what starts before the moment. Returns how many robots listen.
    fn send_up(
        &mut self,
        reach: &mut Reach,
        moment: &Moment<'_>,
        transmit: &mut dyn FnMut(u32, Packet) -> Packet,
    ) -> u64 {
        let mut starting = mem::take(&mut self.starting);
        for (sender, (next, rhythm)) in self.next.iter_mut().zip(&self.rhythms).enumerate() {
            while next.start_s < self.played_s {
                starting.push((next.start_s, sender as u32, next.number));
                let number = next.number + 1;
                *next = Next { number, start_s: self.schedule.start_s(rhythm, sender as u32, number) };
            }
        }
        if self.schedule.has_own_clocks() {
            self.wind_clocks(moment);
        }
        starting.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        reach.look(moment.poses, |robot| moment.said[robot].is_some());
        for (start_s, sender, number) in starting.drain(..) {
            let Some(packet) = moment.said[sender as usize] else { continue };
            let mut reached = self.spare.pop().unwrap_or_default();
            reach.of(sender, number, &mut reached);
            self.degrees[sender as usize] = Some((reached.robots.len() + reached.disturbed.len()) as u32);
            let packet = transmit(sender, packet);
            self.packets.push(Transmission { sender, number, start_s, packet, reached });
        }
        self.starting = starting;
        reach.listeners()
    }

    /// Gives robots that have been restarted the clocks of their new lives, from the packet after the next one on.
    fn wind_clocks(&mut self, moment: &Moment<'_>) {
        for (index, (rhythm, said)) in (0..).zip(self.rhythms.iter_mut().zip(moment.said)) {
            let Some(incarnation) = said.map(|packet| packet.sender().incarnation) else { continue };
            if rhythm.incarnation() != incarnation {
                let id = RobotId { index, incarnation };
                *rhythm = self.schedule.next_rhythm(rhythm, id, self.next[index as usize].number + 1);
            }
        }
    }

    /// Decides at every receiver about the packets that have ended.
    fn bring_down(
        &mut self,
        moment: &Moment<'_>,
        listeners: u64,
        tally: &mut Packets,
        losses: &mut Losses,
        received: &mut Vec<Reception>,
    ) {
        let ended_by = self.played_s - self.airtime_s + TOUCH_S;
        let ended = self.packets.partition_point(|packet| packet.start_s <= ended_by);
        let listens = |robot: u32| moment.said[robot as usize].is_some();
        for packet in &self.packets[self.resolved..ended] {
            let Reached { robots, faded, occluded, .. } = &packet.reached;
            let (faded, occluded) = (u64::from(*faded), u64::from(*occluded));
            let in_range = robots.iter().filter(|&&robot| listens(robot)).count() as u64 + faded + occluded;
            tally.sent += 1;
            tally.in_range += in_range;
            tally.lost_range += (listeners - u64::from(listens(packet.sender))).saturating_sub(in_range);
            tally.lost_edge += faded;
            tally.occluded += occluded;
        }
        let mut by_robot = mem::take(&mut self.by_robot);
        by_robot.sort(moment.poses.len(), &self.packets, self.disturbs_unread);
        for (receiver, (arrivals, own)) in by_robot.arrivals.iter().zip(by_robot.own.iter()).enumerate() {
            for (place, &at) in arrivals.iter().enumerate() {
                if !(self.resolved..ended).contains(&at) {
                    continue;
                }
                let disturbing = if self.disturbs_unread { &by_robot.disturbing[receiver] } else { &[] };
                let fate = self.fate(receiver, place, arrivals, disturbing, own);
                if !listens(receiver as u32) {
                    continue;
                }
                self.note_crowd(receiver, fate);
                match fate {
                    Fate::Heard => {
                        let Transmission { sender, number, start_s: sent_s, packet, .. } = self.packets[at];
                        let receiver = receiver as u32;
                        received.push(Reception { sender, receiver, number, sent_s, packet });
                    }
                    Fate::Collided => {
                        tally.collided += 1;
                        losses.add(self.packets[at].sender, receiver as u32, Cause::Collision);
                    }
                    Fate::Deaf => {
                        tally.half_duplex += 1;
                        losses.add(self.packets[at].sender, receiver as u32, Cause::HalfDuplex);
                    }
                }
            }
        }
        self.by_robot = by_robot;
        self.resolved = ended;
    }

    /// Decides the fate of the packet at `place` of a receiver's arrivals.
    fn fate(
        &mut self,
        receiver: usize,
        place: usize,
        arrivals: &[usize],
        disturbing: &[usize],
        own: &[usize],
    ) -> Fate {
        let start_at = |place: usize| self.packets[arrivals[place]].start_s;
        let start_s = start_at(place);
        let overlap = |other_s: f64| (other_s - start_s).abs() < self.airtime_s - TOUCH_S;
        if self.half_duplex && own.iter().any(|&at| overlap(self.packets[at].start_s)) {
            return Fate::Deaf;
        }
        let before = place > 0 && overlap(start_at(place - 1));
        let after = place + 1 < arrivals.len() && overlap(start_at(place + 1));
        if self.is_disturbed(start_s, disturbing) {
            // It does not lock the receiver either: nothing tells that it begins.
            return Fate::Collided;
        }
        match self.capture {
            Capture::None if before || after => Fate::Collided,
            Capture::None => Fate::Heard,
            Capture::FirstLock => {
                // Of packets that start as one, none is first.
                let together = |other: usize| (start_at(other) - start_s).abs() < TOUCH_S;
                let alone = !(before && together(place - 1) || after && together(place + 1));
                let free = self.locked_s[receiver] <= start_s + TOUCH_S;
                if free {
                    self.locked_s[receiver] = start_s + self.airtime_s;
                }
                if free && alone { Fate::Heard } else { Fate::Collided }
            }
        }
    }

    /// Whether a packet that begins at `start_s` is destroyed by one of those that cannot be read: by any that overlaps
    /// with it, or, if the receiver locks to the first packet, by one that is in the air already.
    fn is_disturbed(&self, start_s: f64, disturbing: &[usize]) -> bool {
        let other_s = |at: &usize| self.packets[*at].start_s;
        let ended = disturbing.partition_point(|at| other_s(at) <= start_s - (self.airtime_s - TOUCH_S));
        let begins_by = match self.capture {
            Capture::None => start_s + (self.airtime_s - TOUCH_S),
            Capture::FirstLock => start_s + TOUCH_S,
        };
        disturbing.get(ended).is_some_and(|at| other_s(at) < begins_by)
    }

    /// Counts a packet by how many could have disturbed it, once the receiver's own has told.
    fn note_crowd(&mut self, receiver: usize, fate: Fate) {
        if let Some(degree) = self.degrees[receiver] {
            let others = (degree as usize).saturating_sub(1);
            self.crowding.count(others + usize::from(self.half_duplex), fate == Fate::Heard);
        }
    }

    /// Forgets packets that nothing in the air or to come overlaps with.
    fn forget(&mut self) {
        let oldest_s = self.played_s - 2.0 * self.airtime_s - TOUCH_S;
        let first_kept = self.packets[..self.resolved].partition_point(|packet| packet.start_s < oldest_s);
        self.spare.extend(self.packets.drain(..first_kept).map(|packet| packet.reached));
        self.resolved -= first_kept;
    }
}
