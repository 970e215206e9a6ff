//! One tick of the world: commands in, percepts out.

use arrayvec::ArrayVec;
use protocol::{
    command::Command,
    percept::{DELIVERIES_MAX, Delivery, Percept, Tick, WALLS_MAX, Wall},
    robot_id::RobotId,
    setup::Law,
    units::{Meters, Radians, wrapped},
};

use crate::{
    channel::Channel,
    digest::Digest,
    field::Field,
    frame::{ArenaPoint, Pose},
    measurement::measured,
    metrics::{Metrics, Packets, Partition, estimated_errors, mean_lamp_distance},
    placement::{self, PlacementError},
    scenario::Scenario,
    voronoi::walls_around,
    world::World,
};

/// The physical world, the infrared medium and the lamps of one run.
#[derive(Debug)]
pub struct Arena {
    world: World,
    field: Field,
    channel: Channel,
    size_m: [f64; 2],
    step_s: f64,
    boundary_sensing: bool,
    /// Only the `exact` law is shown the field.
    shows_field: bool,
    /// The tick whose percepts stand; `None` before the first.
    tick: Option<Tick>,
    percepts: Vec<Percept>,
    packets: Packets,
    heard: Vec<u64>,
    digest: Digest,
}

impl Arena {
    /// The world of `scenario` before its first tick.
    pub fn new(scenario: &Scenario) -> Result<Self, PlacementError> {
        let poses = placement::start(scenario)?;
        Ok(Self {
            percepts: vec![Percept::empty(0); poses.len()],
            heard: vec![0; poses.len()],
            world: World::new(scenario, poses),
            field: Field::new(scenario),
            channel: Channel::new(scenario),
            size_m: scenario.arena.size_m.get(),
            step_s: scenario.step_s.get(),
            boundary_sensing: scenario.arena.boundary_sensing,
            shows_field: scenario.controller.law == Law::Exact,
            tick: None,
            packets: Packets::default(),
            digest: Digest::default(),
        })
    }

    /// One step of virtual time: bodies move as commanded, then each robot transmits its packet,
    /// hears its neighbors and senses the light.
    ///
    /// `commands` has one entry per robot in the order of their indices: the answer to the percept
    /// before (or, at first, the command given at boot), or `None` from a robot whose agent is
    /// silent. A silent robot stands still, says nothing and hears nothing.
    pub fn tick(&mut self, commands: &[Option<Command>]) -> &[Percept] {
        assert_eq!(commands.len(), self.percepts.len(), "one entry per robot");
        if self.tick.is_some() {
            self.world.advance(self.step_s, commands);
        }
        let tick = self.tick.map_or(0, |tick| tick + 1);
        self.tick = Some(tick);

        let speak: Vec<bool> = commands.iter().map(Option::is_some).collect();
        let heard = self.channel.who_hears_whom(self.world.poses(), &speak);
        for (robot, senders) in heard.iter().enumerate() {
            self.hear(robot, senders, commands);
            self.sense(robot, tick);
        }
        self.account(&speak, &heard);
        self.record(commands);
        &self.percepts
    }

    /// What the current percepts and the answers to them amount to.
    pub fn metrics(&self, answers: &[Option<Command>]) -> Metrics {
        let alive: Vec<usize> = (0..answers.len()).filter(|&robot| answers[robot].is_some()).collect();
        let poses = self.world.poses();
        let positions: Vec<ArenaPoint> = alive.iter().map(|&robot| poses[robot].position).collect();
        let lamps: Vec<ArenaPoint> = self.field.lamps().collect();
        let partition = Partition::new(positions.clone(), self.size_m);
        let (cost_h, mean_true_error_m) = partition.cost_and_true_error(&self.field);
        let heard = alive.iter().map(|&robot| (&poses[robot], &self.percepts[robot]));
        let (mean_error_m, max_error_m) = estimated_errors(answers);
        Metrics {
            mean_error_m,
            max_error_m,
            mean_true_error_m,
            cost_h,
            cell_agreement: partition.agreement(heard, self.size_m),
            mean_lamp_distance_m: mean_lamp_distance(&positions, &lamps),
            robots_alive: alive.len() as u32,
            packets: self.packets,
        }
    }

    /// The tick whose percepts stand; 0 before the first.
    pub fn current_tick(&self) -> Tick {
        self.tick.unwrap_or(0)
    }

    /// Virtual time of that tick, seconds.
    pub fn time_s(&self) -> f64 {
        self.current_tick() as f64 * self.step_s
    }

    /// Pose of every robot.
    pub fn poses(&self) -> &[Pose] {
        self.world.poses()
    }

    /// Receptions of every robot since the start.
    pub fn heard(&self) -> &[u64] {
        &self.heard
    }

    /// The digest of everything so far.
    pub fn digest(&self) -> String {
        self.digest.hex()
    }

    /// Writes what robot `receiver` hears of `senders` into its percept, measured in its body
    /// frame; the nearest if they are more than a percept holds.
    fn hear(&mut self, receiver: usize, senders: &[usize], commands: &[Option<Command>]) {
        let poses = self.world.poses();
        let heard = senders.iter().filter_map(|&sender| {
            commands[sender].map(|said| measured(said.packet, &poses[sender], &poses[receiver]))
        });
        let deliveries = &mut self.percepts[receiver].deliveries;
        deliveries.clear();
        if senders.len() <= DELIVERIES_MAX {
            deliveries.extend(heard);
            return;
        }
        let mut all: Vec<Delivery> = heard.collect();
        all.sort_by(|a, b| a.range.get().total_cmp(&b.range.get()));
        all.truncate(DELIVERIES_MAX);
        all.sort_by_key(|delivery| delivery.packet.sender.index);
        deliveries.extend(all);
    }

    /// Writes everything but deliveries into a robot's percept.
    fn sense(&mut self, robot: usize, tick: Tick) {
        let pose = self.world.poses()[robot];
        let seen = self.field.seen_from(&pose);
        let percept = &mut self.percepts[robot];
        percept.tick = tick;
        percept.light = self.field.light(&seen);
        percept.bump = self.world.bumped()[robot];
        if self.boundary_sensing {
            percept.walls = walls(&pose, self.size_m);
        }
        if self.shows_field {
            percept.field = seen;
        }
    }

    fn account(&mut self, speak: &[bool], heard: &[Vec<usize>]) {
        let speakers = speak.iter().filter(|&&speaks| speaks).count() as u64;
        let in_range: u64 = heard.iter().map(|senders| senders.len() as u64).sum();
        let delivered: u64 = self.percepts.iter().map(|percept| percept.deliveries.len() as u64).sum();
        for (total, percept) in self.heard.iter_mut().zip(&self.percepts) {
            *total += percept.deliveries.len() as u64;
        }
        self.packets.sent += speakers;
        self.packets.heard += delivered;
        self.packets.over_bound += in_range - delivered;
        self.packets.lost_range += speakers * speakers.saturating_sub(1) - in_range;
    }

    fn record(&mut self, commands: &[Option<Command>]) {
        let ids = commands.iter().zip(0..).map(|(command, index)| match command {
            Some(command) => command.packet.sender,
            None => RobotId::first(index),
        });
        for ((id, pose), percept) in ids.zip(self.world.poses()).zip(&self.percepts) {
            self.digest.record(id, pose, percept);
        }
    }
}

/// The four walls as a robot at `pose` senses them.
fn walls(pose: &Pose, size_m: [f64; 2]) -> ArrayVec<Wall, WALLS_MAX> {
    walls_around(pose.position, size_m)
        .into_iter()
        .map(|wall| Wall {
            distance: Meters::new(wall.distance.max(0.0)).expect("poses are finite"),
            bearing: Radians::new(wrapped(wall.bearing - pose.heading)).expect("poses are finite"),
        })
        .collect()
}
