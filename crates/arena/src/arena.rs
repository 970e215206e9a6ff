//! One tick of the world: commands in, percepts out.

use std::{
    collections::{BTreeMap, VecDeque},
    mem,
};

use arrayvec::ArrayVec;
use protocol::{
    command::Answer,
    frame::BodyVector,
    odometry::Motion,
    packet::Packet,
    percept::{DELIVERIES_MAX, Delivery, Percept, Tick, WALLS_MAX, Wall},
    robot_id::RobotId,
    units::{Meters, Radians, wrapped},
};

use crate::{
    channel::{Channel, Crowding, Moment, Reception},
    digest::{Digest, RobotTick},
    executor::{Executor, Sequential},
    fault::{FaultPlan, Passage, ledger::Line},
    field::Field,
    frame::Pose,
    light::LightSensors,
    losses::{Cause, Loss},
    measurement::Measurement,
    metrics::{Attendance, Disturbance, Metrics, Observer},
    neighbor_tables::NeighborTables,
    odometry::Odometers,
    packets::Packets,
    payloads::Payloads,
    placement::{self, PlacementError},
    random::{Draws, Purpose},
    voronoi::walls_around,
    world::World,
};
use scenario::{Controller, FieldSpec, ProcessFault, Scenario};

/// Filler for measurements to come.
const NOTHING_HEARD: Delivery = Delivery {
    packet: Packet::short(RobotId::first(0), 0, None),
    range: Meters::new(0.0).expect("zero is a length"),
    bearing: Radians::new(0.0).expect("zero is an angle"),
    orientation: Radians::new(0.0).expect("zero is an angle"),
};

/// A measured packet on its way into a percept.
#[derive(Clone, Copy, Debug)]
struct Heard {
    delivery: Delivery,
    /// When it was sent, seconds: for the observer alone.
    sent_s: f64,
}

/// Effect of an answer: what its robot does and says.
#[derive(Clone, Copy, Debug)]
struct Order {
    velocity: BodyVector,
    packet: Packet,
}

/// The physical world, the infrared medium, the lamps and the fault plan of one run.
#[derive(Debug)]
pub struct Arena {
    scenario: Scenario,
    world: World,
    field: Field,
    sensors: LightSensors,
    odometers: Option<Odometers>,
    channel: Channel,
    measurement: Measurement,
    plan: FaultPlan,
    hearing: NeighborTables,
    /// The tick that has been played last; `None` before the first.
    tick: Option<Tick>,
    /// The packet of each robot's last answer that has come into force; `None` while it is silent.
    said: Vec<Option<Packet>>,
    /// Payloads of these and all other packets, where they are long.
    payloads: Payloads,
    /// The life of each robot that was heard of last.
    lives: Vec<Option<RobotId>>,
    /// Answers that a fault holds back, and when they come into force.
    held_back: Vec<VecDeque<(Tick, Order)>>,
    /// Whether each robot is shown the true field.
    shown_field: Vec<bool>,
    /// Whether a robot's payloads are its user's; empty if nobody's are.
    says_own: Vec<bool>,
    /// Packets that each robot has heard since its last percept.
    inboxes: Vec<Vec<Heard>>,
    /// Whether each robot has bumped into something since.
    bumped: Vec<bool>,
    /// Deliveries that a fault delays, by the tick in which they come.
    delayed: BTreeMap<Tick, Vec<(u32, Heard)>>,
    percepts: Vec<Percept>,
    /// When the packets in the percept that is being made were sent, seconds.
    sent_s: Vec<f64>,
    /// Receptions that the channel lets through in this tick.
    receptions: Vec<Reception>,
    /// The same as their receivers measure them.
    measured: Vec<Delivery>,
    packets: Packets,
    heard: Vec<u64>,
    digest: Digest,
}

impl Arena {
    /// The world of `scenario` before its first tick.
    pub fn new(scenario: &Scenario) -> Result<Self, PlacementError> {
        let poses = placement::start(scenario)?;
        let robots = poses.len();
        let controllers = || (0..scenario.robot_count()).map(|robot| scenario.controller_of(robot));
        let timeouts = controllers().map(|it| scenario.neighbor_timeout_ticks(it)).collect();
        Ok(Self {
            world: World::new(scenario, poses),
            field: Field::new(scenario),
            sensors: LightSensors::new(scenario),
            odometers: Odometers::new(scenario),
            channel: Channel::new(scenario),
            measurement: Measurement::new(&scenario.channel),
            plan: FaultPlan::new(scenario),
            hearing: NeighborTables::new(timeouts),
            tick: None,
            said: vec![None; robots],
            payloads: Payloads::default(),
            lives: vec![None; robots],
            shown_field: controllers().map(Controller::senses_field).collect(),
            says_own: match scenario.controllers.iter().all(|controller| controller.law().is_some()) {
                true => Vec::new(),
                false => controllers().map(|controller| controller.law().is_none()).collect(),
            },
            held_back: vec![VecDeque::new(); robots],
            inboxes: vec![Vec::new(); robots],
            bumped: vec![false; robots],
            delayed: BTreeMap::new(),
            percepts: vec![Percept::empty(0); robots],
            sent_s: Vec::new(),
            receptions: Vec::new(),
            measured: Vec::new(),
            packets: Packets::default(),
            heard: vec![0; robots],
            digest: Digest::default(),
            scenario: scenario.clone(),
        })
    }

    /// Begins and ends faults of the next tick, and returns those of processes; to be called once before each.
    /// Robots that are `left_out` for good, which nobody planned, can no longer be struck.
    pub fn process_faults(&mut self, left_out: &[u32]) -> Vec<ProcessFault> {
        let tick = self.next_tick();
        self.plan.process_faults(tick, self.world.poses(), &mut self.field, left_out)
    }

    /// The field as it is by now: that of the scenario, and what has changed of it since.
    pub fn field_spec(&self) -> &FieldSpec {
        self.field.spec()
    }

    /// Goes on with the plan of `scenario`, which is this arena's with some more faults, or some that end earlier: what is
    /// done to a run under way. To be called between two ticks, before [`process_faults`](Self::process_faults).
    pub fn change_plan(&mut self, scenario: &Scenario) {
        self.plan.change(scenario);
        self.scenario.fault.clone_from(&scenario.fault);
    }

    /// One step of virtual time: bodies move as commanded, packets fly, and where a neighbor cycle
    /// begins, each robot gets a percept of what it has heard since the last one and of what it
    /// senses now. At other ticks there are none, and commands stand.
    ///
    /// `answers` has one entry per robot in the order of their indices: the answer to the last
    /// percept (or, at first, the command given at boot), or `None` from a robot whose agent is
    /// silent. A silent robot stands still, says nothing and hears nothing.
    pub fn tick(&mut self, answers: &[Option<Answer>]) -> Option<&[Percept]> {
        self.tick_by(&Sequential, answers)
    }

    /// Like [`tick`](Self::tick), with the work split by `executor`.
    pub fn tick_by(&mut self, executor: &impl Executor, answers: &[Option<Answer>]) -> Option<&[Percept]> {
        assert_eq!(answers.len(), self.percepts.len(), "one entry per robot");
        let tick = self.next_tick();
        if self.percepts().is_some() {
            self.channel.losses_mut().clear();
        }
        self.forget_payloads();
        self.take_in(tick, answers);
        self.move_bodies(tick);
        self.tick = Some(tick);
        self.play_channel(executor, tick);
        let begins_cycle = self.scenario.begins_cycle(tick);
        if begins_cycle {
            for robot in 0..self.percepts.len() {
                self.hand_over(robot);
                self.sense(robot, tick);
            }
        }
        self.record();
        begins_cycle.then_some(&self.percepts)
    }

    /// Returns the metrics for the current percepts and the answers to them.
    pub fn metrics(&self, answers: &[Option<Answer>], attendance: Attendance) -> Metrics {
        self.observer().measure(self.world.poses(), answers, attendance, self.packets, self.time_s())
    }

    /// Quantities in which faults can be felt, by now.
    pub fn disturbance(&self, answers: &[Option<Answer>]) -> Disturbance {
        self.observer().disturbance(self.world.poses(), answers)
    }

    /// The tick whose percepts stand; 0 before the first.
    pub fn current_tick(&self) -> Tick {
        self.tick.unwrap_or(0)
    }

    /// The tick to come.
    pub fn next_tick(&self) -> Tick {
        self.tick.map_or(0, |tick| tick + 1)
    }

    /// Virtual time of the current tick, seconds.
    pub fn time_s(&self) -> f64 {
        self.current_tick() as f64 * self.scenario.step_s.get()
    }

    /// Pose of every robot.
    pub fn poses(&self) -> &[Pose] {
        self.world.poses()
    }

    /// Percepts of the current tick, by robot; `None` if no neighbor cycle began with it.
    pub fn percepts(&self) -> Option<&[Percept]> {
        self.tick.filter(|&tick| self.scenario.begins_cycle(tick)).map(|_| &self.percepts[..])
    }

    /// Receptions of every robot since the start.
    pub fn heard(&self) -> &[u64] {
        &self.heard
    }

    /// Counts of all packets so far, by fate.
    pub fn packets(&self) -> Packets {
        self.packets
    }

    /// From here on packets that are not heard are noted one by one, or not.
    pub fn note_losses(&mut self, is_wanted: bool) {
        self.channel.losses_mut().note(is_wanted);
    }

    /// Packets that were not heard since the neighbor cycle before, if they are noted.
    pub fn losses(&self) -> &[Loss] {
        self.channel.losses().noted()
    }

    /// How often bodies stayed where they were because their contacts had no solution that could be found.
    pub fn contacts_unsolved(&self) -> u64 {
        self.world.contacts_unsolved()
    }

    /// How often a group of bodies in contact moved in steps longer than they should be, because a tick had too many.
    pub fn contacts_coarse(&self) -> u64 {
        self.world.contacts_coarse()
    }

    /// How packets fared in the crowd, where the channel lets them meet.
    pub fn crowding(&self) -> Option<&Crowding> {
        self.channel.crowding()
    }

    /// Returns how many long payloads the arena has room for: memory, not something that robots feel.
    pub fn payload_places(&self) -> usize {
        self.payloads.places()
    }

    /// Returns the ledger of all faults.
    pub fn ledger(&self) -> impl Iterator<Item = &Line> {
        self.plan.ledger()
    }

    /// The digest of everything so far.
    pub fn digest(&self) -> String {
        self.digest.hex()
    }

    fn observer(&self) -> Observer<'_> {
        Observer { field: &self.field, hearing: &self.hearing, size_m: self.size_m() }
    }

    fn size_m(&self) -> [f64; 2] {
        self.scenario.arena.size_m.get()
    }

    /// Answers come into force: at once, or as late as a fault has it. The first command of a new life
    /// answers no percept, and is never late.
    fn take_in(&mut self, tick: Tick, answers: &[Option<Answer>]) {
        let asked = tick == 0 || self.scenario.begins_cycle(tick - 1);
        for (robot, answer) in answers.iter().enumerate() {
            let Some(answer) = answer else {
                self.said[robot] = None;
                self.world.halt(robot);
                self.held_back[robot].clear();
                continue;
            };
            let life = Some(answer.sender);
            let is_new = self.lives[robot] != life;
            self.lives[robot] = life;
            if is_new {
                self.held_back[robot].clear();
                self.odometers.iter_mut().for_each(|odometers| odometers.restart(robot));
                let order = self.order(answer);
                self.obey(robot, order);
            } else if asked {
                let order = self.order(answer);
                match self.plan.lateness(tick, robot as u32) {
                    0 => {
                        self.held_back[robot].clear();
                        self.obey(robot, order);
                    }
                    late => self.held_back[robot].push_back((tick.saturating_add(late), order)),
                }
            }
            while let Some(&(_, held)) = self.held_back[robot].front().filter(|(due, _)| *due <= tick) {
                self.held_back[robot].pop_front();
                self.obey(robot, held);
            }
        }
    }

    fn order(&mut self, answer: &Answer) -> Order {
        Order { velocity: answer.command.velocity, packet: self.payloads.packet(&answer.packet()) }
    }

    fn obey(&mut self, robot: usize, order: Order) {
        self.world.set_course(robot, order.velocity);
        self.said[robot] = Some(order.packet);
    }

    /// Makes room for long payloads to come, if it is time for that.
    fn forget_payloads(&mut self) {
        if !self.payloads.is_full() {
            return;
        }
        let held_back = self.held_back.iter().flatten().map(|(_, order)| &order.packet);
        let inboxes = self.inboxes.iter().flatten();
        let delayed = self.delayed.values().flatten().map(|(_, heard)| heard);
        let heard = inboxes.chain(delayed).map(|heard| &heard.delivery.packet);
        let held = self.said.iter().flatten().chain(held_back).chain(heard).chain(self.channel.in_the_air());
        self.payloads.sweep(held);
    }

    fn move_bodies(&mut self, tick: Tick) {
        if self.tick.is_none() {
            return;
        }
        let plan = &mut self.plan;
        self.world
            .advance(self.scenario.step_s.get(), |robot, course| plan.driven(tick, robot as u32, course));
        for (bumped, now) in self.bumped.iter_mut().zip(self.world.bumped()) {
            *bumped |= now;
        }
        if let Some(odometers) = &mut self.odometers {
            odometers.count(tick, self.world.rolled());
            carry_along(&mut self.inboxes, odometers.counted());
        }
    }

    /// Packets fly: what the channel lets through meets the fault plan, and what is left is
    /// measured and put into the receiver's inbox, now or later.
    fn play_channel(&mut self, executor: &impl Executor, tick: Tick) {
        let (said, mut receptions) = (mem::take(&mut self.said), mem::take(&mut self.receptions));
        let cycle = self.scenario.begins_cycle(tick).then(|| self.scenario.cycle_of(tick));
        let time_s = tick as f64 * self.scenario.step_s.get();
        let moment = Moment { tick, cycle, time_s, poses: self.world.poses(), said: &said };
        let (plan, payloads) = (&mut self.plan, &mut self.payloads);
        let mut transmit = |robot, packet| plan.transmitted(tick, robot, packet, payloads);
        self.channel.play(executor, &moment, &mut self.packets, &mut transmit, &mut receptions);
        self.measure(executor, &receptions);
        for (robot, said) in said.iter().enumerate() {
            if said.is_none() {
                self.inboxes[robot].clear();
            }
        }
        self.arrive_late(tick, &said);
        let measured = mem::take(&mut self.measured);
        for (reception, measured) in receptions.iter().zip(&measured) {
            self.receive(tick, reception, measured);
        }
        self.measured = measured;
        (self.said, self.receptions) = (said, receptions);
    }

    /// Deliveries that a fault has delayed until now; who is silent by now misses them.
    fn arrive_late(&mut self, tick: Tick, said: &[Option<Packet>]) {
        for (receiver, heard) in self.delayed.remove(&tick).unwrap_or_default() {
            self.packets.delayed -= 1;
            if said[receiver as usize].is_some() {
                self.put(receiver, heard);
            } else {
                self.packets.lost_fault += 1;
            }
        }
    }

    /// Passes a reception through the fault plan; most of the time no fault is active.
    fn receive(&mut self, tick: Tick, reception: &Reception, measured: &Delivery) {
        let sent_s = reception.sent_s;
        if self.plan.is_idle() {
            return self.put(reception.receiver, Heard { delivery: *measured, sent_s });
        }
        let receiver_at = self.world.poses()[reception.receiver as usize].position;
        let Passage { arrivals, lost } = self.plan.passage(tick, reception, receiver_at, &mut self.payloads);
        self.packets.duplicated += arrivals.len() as u64 + lost - 1;
        self.packets.lost_fault += lost;
        if lost > 0 {
            self.channel.losses_mut().add(reception.sender, reception.receiver, Cause::Fault);
        }
        for (packet, late) in arrivals {
            let heard = Heard { delivery: Delivery { packet, ..*measured }, sent_s };
            if late == 0 {
                self.put(reception.receiver, heard);
            } else {
                self.packets.delayed += 1;
                let due = self.delayed.entry(tick.saturating_add(late)).or_default();
                due.push((reception.receiver, heard));
            }
        }
    }

    /// Measures the senders of all receptions, as their receivers do.
    fn measure(&mut self, executor: &impl Executor, receptions: &[Reception]) {
        let (poses, seed, measurement) = (self.world.poses(), self.scenario.seed.get(), &self.measurement);
        let measured = |reception: &Reception| {
            let Reception { sender, receiver, number, packet, .. } = *reception;
            let draws = || Draws::of(seed, Purpose::Measurement, number, sender, receiver);
            measurement.of(packet, &poses[sender as usize], &poses[receiver as usize], draws)
        };
        self.measured.resize(receptions.len(), NOTHING_HEARD);
        executor.share(&mut self.measured, |first, deliveries| {
            for (slot, reception) in deliveries.iter_mut().zip(&receptions[first..]) {
                *slot = measured(reception);
            }
        });
    }

    /// Puts a packet into the receiver's inbox. Beyond what a percept holds it takes the place of another, since the
    /// nearest are handed over: whichever that will be, it is one.
    fn put(&mut self, receiver: u32, heard: Heard) {
        let inbox = &mut self.inboxes[receiver as usize];
        if inbox.len() < DELIVERIES_MAX {
            self.packets.heard += 1;
            self.heard[receiver as usize] += 1;
        } else {
            self.packets.over_bound += 1;
        }
        inbox.push(heard);
    }

    /// Moves what a robot has heard into its percept, ordered by senders; the nearest if it is
    /// more than a percept holds.
    fn hand_over(&mut self, robot: usize) {
        let mut heard = mem::take(&mut self.inboxes[robot]);
        if heard.len() > DELIVERIES_MAX {
            heard.sort_by(|a, b| a.delivery.range.get().total_cmp(&b.delivery.range.get()));
            heard.truncate(DELIVERIES_MAX);
        }
        let sender = |heard: &Heard| heard.delivery.packet.sender().index;
        // Most channels and plans leave nothing to sort.
        if !heard.is_sorted_by_key(sender) {
            heard.sort_by_key(sender);
        }
        let (percept, payloads) = (&mut self.percepts[robot], &self.payloads);
        percept.clear_deliveries();
        if payloads.is_unused() {
            percept.deliveries.extend(heard.iter().map(|heard| heard.delivery));
        } else {
            for Heard { delivery, .. } in &heard {
                let packet = percept.packet(&delivery.packet.view(payloads.of(&delivery.packet)));
                percept.deliveries.push(Delivery { packet, ..*delivery });
            }
        }
        self.sent_s.clear();
        self.sent_s.extend(heard.drain(..).map(|heard| heard.sent_s));
        // The inbox keeps its memory.
        self.inboxes[robot] = heard;
    }

    /// Writes everything but deliveries, which have just been handed over, into a robot's percept.
    fn sense(&mut self, robot: usize, tick: Tick) {
        let pose = self.world.poses()[robot];
        let seen = self.field.seen_from(&pose);
        let mut light = self.sensors.read(&self.field, &seen, robot as u32, &pose, tick);
        if self.said[robot].is_some() {
            self.plan.sensed(tick, robot as u32, &mut light);
        }
        let size_m = self.size_m();
        let percept = &mut self.percepts[robot];
        percept.tick = tick;
        percept.light = light;
        percept.bump = mem::take(&mut self.bumped[robot]);
        percept.odometry = self.odometers.as_ref().map(|odometers| odometers.reading(robot));
        percept.compass = self.scenario.sensors.compass.then(|| pose.compass());
        percept.position = self.scenario.sensors.position.then(|| pose.told());
        if self.scenario.arena.boundary_sensing {
            percept.walls = walls(&pose, size_m);
        }
        if self.shown_field[robot] {
            percept.field = seen;
        }
        // Who has just been resumed gets a percept before it has answered one.
        if let Some(life) = self.lives[robot].filter(|_| self.plan.is_up(robot as u32)) {
            self.hearing.record(life, percept, &self.sent_s);
        }
    }

    fn record(&mut self) {
        let (tick, with_percepts) = (self.current_tick(), self.percepts().is_some());
        let Self { digest, said, world, percepts, says_own, .. } = self;
        let percepts = with_percepts.then_some(&percepts[..]);
        robot_ticks(tick, said, world.poses(), percepts, says_own).for_each(|robot| digest.record(robot));
    }

    /// A number for each robot, which says what the [digest](Self::digest) takes in of it in the current tick.
    pub fn hashes(&self) -> Vec<u64> {
        let mut digest = Digest::default();
        let robots =
            robot_ticks(self.current_tick(), &self.said, self.poses(), self.percepts(), &self.says_own);
        robots.map(|robot| digest.of_robot(robot)).collect()
    }
}

/// Robots of a tick, as the digest takes them in.
fn robot_ticks<'a>(
    tick: Tick,
    said: &'a [Option<Packet>],
    poses: &'a [Pose],
    percepts: Option<&'a [Percept]>,
    says_own: &'a [bool],
) -> impl Iterator<Item = RobotTick<'a>> {
    said.iter().zip(poses).zip(0..).map(move |((packet, pose), index)| {
        let robot = packet.as_ref().map_or(RobotId::first(index), Packet::sender);
        let percept = percepts.map(|percepts| &percepts[index as usize]);
        RobotTick { tick, robot, pose, percept, says_own }
    })
}

/// Carries what robots have heard and not been handed yet along with their bodies, as far as they know their motion.
fn carry_along(inboxes: &mut [Vec<Heard>], motions: &[Motion]) {
    for (inbox, motion) in inboxes.iter_mut().zip(motions) {
        for heard in inbox {
            motion.carry_along(&mut heard.delivery);
        }
    }
}

/// The four walls as a robot at `pose` senses them.
fn walls(pose: &Pose, size_m: [f64; 2]) -> ArrayVec<Wall, WALLS_MAX> {
    walls_around(pose.position, size_m)
        .into_iter()
        .map(|(bearing, distance_m)| Wall {
            distance: Meters::new(distance_m.max(0.0)).expect("poses are finite"),
            bearing: Radians::new(wrapped(bearing - pose.heading)).expect("poses are finite"),
        })
        .collect()
}
