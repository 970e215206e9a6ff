//! The fault plan: what goes wrong, to whom, and at which tick.
//!
//! A fault is a `Rule` with a window of ticks and a `Choice` of robots or links, made when it
//! begins. Faults are asked in the order of the scenario, so a plan means one thing only. A new
//! kind of fault is one file here and one line in `rule_of`. What each fault did is entered in its
//! line of the ledger.

mod burst;
pub mod caution;
mod choice;
mod corrupt;
mod delay;
mod duplicate;
mod jam;
mod kill;
pub mod ledger;
mod liar;
mod loss;
mod luck;
mod motion;
mod partition;
mod pause;
mod rule;
mod sensor;
mod slow;

use std::ops::Range;

use protocol::{
    frame::BodyVector,
    packet::Packet,
    percept::{Light, Tick},
};

use crate::{
    channel::Reception,
    frame::{ArenaPoint, Pose},
    scenario::{FaultKind, FaultSpec, Scenario},
};

use choice::{Choice, Scene};
use ledger::Line;
use luck::Luck;
use rule::{Flight, Rule, Verdict};

/// Something the plan does to an agent's process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strike {
    /// Index of the robot.
    pub robot: u32,
    /// What happens to its agent.
    pub act: Act,
}

/// What can happen to an agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// It is killed, and its memory with it.
    Kill,
    /// A new life of it begins, without memory.
    Restart,
    /// It is stopped.
    Pause,
    /// It goes on.
    Resume,
}

/// What the plan has made of an agent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Presence {
    #[default]
    Up,
    Paused,
    Down,
}

/// What becomes of a reception under the plan.
#[derive(Clone, Debug, PartialEq)]
pub enum Passage {
    /// Lost to a fault.
    Lost,
    /// Delivered so many ticks later, as this packet; and copies of it, each after its own delay.
    Delivered {
        /// What arrives.
        packet: Packet,
        /// How many ticks late.
        delay: Tick,
        /// Delays of second copies.
        copies: Vec<Tick>,
    },
}

/// All faults of a run and what they have done.
#[derive(Debug)]
pub struct FaultPlan {
    faults: Vec<Fault>,
    presences: Vec<Presence>,
    lamps: Vec<ArenaPoint>,
}

#[derive(Debug)]
struct Fault {
    rule: Box<dyn Rule>,
    choice: Choice,
    spec: FaultSpec,
    window: Range<Tick>,
    state: State,
    luck: Luck,
    line: Line,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    ToCome,
    Active,
    Over,
}

impl FaultPlan {
    /// The plan of a scenario, before anything has happened.
    pub fn new(scenario: &Scenario) -> Self {
        let lamps = scenario.lamps().iter().map(|lamp| lamp.position_m.get().into()).collect();
        let fault = |(index, spec): (usize, &FaultSpec)| {
            let begins = scenario.tick_at(spec.begins_s());
            let window = begins..spec.ends_s().map_or(Tick::MAX, |ends_s| scenario.tick_at(ends_s));
            Fault {
                rule: rule_of(spec, scenario),
                choice: Choice::none(),
                spec: spec.clone(),
                line: Line::new(spec.kind, window.clone()),
                window,
                state: State::ToCome,
                luck: Luck { seed: scenario.seed, fault: index as u32 },
            }
        };
        Self {
            faults: scenario.fault.iter().enumerate().map(fault).collect(),
            presences: vec![Presence::Up; scenario.robot_count() as usize],
            lamps,
        }
    }

    /// Begins and ends what begins and ends with tick `tick`; what happens to agents just before
    /// it, in the order in which it happens.
    pub fn strikes(&mut self, tick: Tick, poses: &[Pose]) -> Vec<Strike> {
        let mut strikes = Vec::new();
        let scene = Scene { poses, lamps: &self.lamps };
        for fault in &mut self.faults {
            if fault.state == State::ToCome && fault.window.contains(&tick) {
                fault.state = State::Active;
                fault.choice = Choice::made(&fault.spec, &scene, fault.luck);
                fault.rule.look(&scene);
                let presences = &mut self.presences;
                fault.rule.begin(tick, &fault.choice, presences, &mut strikes, &mut fault.line);
            }
            if fault.state == State::Active && tick >= fault.window.end {
                fault.state = State::Over;
                fault.rule.end(fault.luck, &mut self.presences, &mut strikes, &mut fault.line);
            }
        }
        strikes
    }

    /// A packet of robot `robot` as it goes out.
    pub fn transmitted(&mut self, tick: Tick, robot: u32, packet: Packet) -> Packet {
        let mut packet = packet;
        for fault in self.active_on(robot) {
            if fault.rule.speak(&mut packet) {
                fault.line.did(tick, "packets falsified", robot);
            }
        }
        packet
    }

    /// What becomes of a packet that the channel has let through.
    pub fn passage(&mut self, tick: Tick, reception: &Reception, receiver_at: ArenaPoint) -> Passage {
        let mut flight = Flight { reception: *reception, receiver_at };
        let (mut delay, mut copies): (Tick, Vec<Tick>) = (0, Vec::new());
        for fault in self.faults.iter_mut().filter(|fault| fault.state == State::Active) {
            let Flight { reception: Reception { sender, receiver, .. }, .. } = flight;
            if !fault.rule.chooses_itself() && !fault.choice.links(sender, receiver) {
                continue;
            }
            let verdict = fault.rule.judge(&flight, fault.luck);
            if let Some(what) = verdict.entry() {
                fault.line.did(tick, what, receiver);
            }
            match verdict {
                Verdict::Pass => {}
                Verdict::Drop(_) => return Passage::Lost,
                Verdict::Delay(ticks) => delay = delay.saturating_add(ticks),
                Verdict::Repeat(ticks) => copies.push(ticks),
                Verdict::Alter(altered) => flight.reception.packet = altered,
            }
        }
        let copies = copies.into_iter().map(|ticks| delay.saturating_add(ticks)).collect();
        Passage::Delivered { packet: flight.reception.packet, delay, copies }
    }

    /// What robot `robot` senses.
    pub fn sensed(&mut self, tick: Tick, robot: u32, light: &mut Light) {
        for fault in self.active_on(robot) {
            if fault.rule.sense(tick, robot, fault.luck, light) {
                fault.line.did(tick, "readings falsified", robot);
            }
        }
    }

    /// How robot `robot` moves when it is told to move with `velocity`.
    pub fn driven(&mut self, tick: Tick, robot: u32, velocity: BodyVector) -> BodyVector {
        let mut velocity = velocity;
        for fault in self.active_on(robot) {
            if fault.rule.drive(&mut velocity) {
                fault.line.did(tick, "moves falsified", robot);
            }
        }
        velocity
    }

    /// By how many ticks the answers of robot `robot` come late.
    pub fn lateness(&mut self, tick: Tick, robot: u32) -> Tick {
        let mut late: Tick = 0;
        for fault in self.active_on(robot) {
            let ticks = fault.rule.lateness();
            if ticks > 0 {
                fault.line.did(tick, "answers delayed", robot);
            }
            late = late.saturating_add(ticks);
        }
        late
    }

    /// What each fault has done, in the order of the plan.
    pub fn ledger(&self) -> impl Iterator<Item = &Line> {
        self.faults.iter().map(|fault| &fault.line)
    }

    fn active_on(&mut self, robot: u32) -> impl Iterator<Item = &mut Fault> {
        self.faults.iter_mut().filter(move |fault| fault.state == State::Active && fault.choice.robot(robot))
    }
}

/// The rule of a fault. A new kind is one more line here.
fn rule_of(spec: &FaultSpec, scenario: &Scenario) -> Box<dyn Rule> {
    match spec.kind {
        FaultKind::Loss => Box::new(loss::Loss::new(spec)),
        FaultKind::Burst => Box::new(burst::Burst::new(spec)),
        FaultKind::Delay => Box::new(delay::Delay::new(spec, scenario)),
        FaultKind::Duplicate => Box::new(duplicate::Duplicate::new(spec, scenario)),
        FaultKind::Corrupt => Box::new(corrupt::Corrupt::new(spec)),
        FaultKind::Partition => Box::new(partition::Partition::new(spec)),
        FaultKind::Jam => Box::new(jam::Jam::new(spec)),
        FaultKind::Kill => Box::new(kill::Kill::new(spec)),
        FaultKind::Pause => Box::new(pause::Pause::default()),
        FaultKind::Slow => Box::new(slow::Slow::new(spec, scenario)),
        FaultKind::Sensor => Box::new(sensor::Sensor::new(spec)),
        FaultKind::Motion => Box::new(motion::Motion::new(spec)),
        FaultKind::Liar => Box::new(liar::Liar::new(spec)),
    }
}
