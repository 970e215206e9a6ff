//! The fault plan: what goes wrong, to whom, and at which tick.
//!
//! A fault is a `Rule` with a window of ticks and a `Target` of robots or links, made when it
//! begins. Faults are asked in the order of the scenario, so a plan means one thing only. What a kind of fault does is one
//! file here and one line in `rules!`; its parameters are a file of the same name in the crate `scenario`. What each fault
//! did is entered in its line of the ledger.

mod fate;
pub mod ledger;
mod rng;
mod rule;
mod target;

use std::ops::Range;

use protocol::{
    frame::BodyVector,
    packet::Packet,
    percept::{Light, Tick},
};

use crate::{
    channel::Reception,
    field::Field,
    frame::{ArenaPoint, Pose},
    payloads::Payloads,
};
use scenario::{
    ProcessFault, Scenario,
    fault::{self, Kind, Timing},
};

use fate::{AgentState, Fate};
use ledger::{Entry, Line};
use rng::FaultRng;
use rule::{Flight, Rule, Verdict};
use target::{Scene, Target};

/// Most copies of one packet under way to one receiver, itself included; what duplicates beyond that does not.
const COPIES_MAX: usize = 16;

/// Outcome of a reception under the plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Passage {
    /// Packets that arrive, and how many ticks late: the packet itself, altered or not, and its copies.
    pub arrivals: Vec<(Packet, Tick)>,
    /// Number of packets, copies included, that are lost.
    pub lost: u64,
}

/// All faults of a run and what they have done.
#[derive(Debug)]
pub struct FaultPlan {
    faults: Vec<Fault>,
    fates: Vec<Fate>,
}

#[derive(Debug)]
struct Fault {
    rule: Box<dyn Rule>,
    target: Target,
    spec: fault::Target,
    window: Range<Tick>,
    is_for_good: bool,
    state: State,
    rng: FaultRng,
    entry: Entry,
}

impl Fault {
    /// Fault `index` of a scenario, which is still to come.
    fn of(scenario: &Scenario, index: usize) -> Self {
        let spec = &scenario.fault[index];
        let window = window_of(spec, scenario);
        Self {
            rule: rule_of(&spec.kind, scenario),
            target: Target::none(),
            spec: spec.target.clone(),
            entry: Entry::new(spec.kind.kind(), window.clone()),
            window,
            is_for_good: spec.nature().timing == Timing::ForGood,
            state: State::ToCome,
            rng: FaultRng { seed: scenario.seed.get(), fault: index as u32, copy: 0 },
        }
    }
}

fn window_of(spec: &fault::Fault, scenario: &Scenario) -> Range<Tick> {
    let begins = scenario.tick_at(spec.begins_s());
    begins..spec.ends_s().map_or(Tick::MAX, |ends_s| scenario.tick_at(ends_s))
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
        Self {
            faults: (0..scenario.fault.len()).map(|index| Fault::of(scenario, index)).collect(),
            fates: vec![Fate::default(); scenario.robot_count() as usize],
        }
    }

    /// Goes on with the plan of `scenario`, which is this one with some more faults, or some that end earlier than they did:
    /// none of that before the tick to come.
    pub fn change(&mut self, scenario: &Scenario) {
        for (fault, spec) in self.faults.iter_mut().zip(&scenario.fault) {
            let window = window_of(spec, scenario);
            fault.entry.until(window.end);
            fault.window = window;
        }
        self.faults.extend((self.faults.len()..scenario.fault.len()).map(|index| Fault::of(scenario, index)));
    }

    /// Begins and ends what begins and ends with tick `tick`; what happens to agents just before
    /// it, in the order in which it happens. What happens to `field` has happened by then.
    ///
    /// Robots that are `left_out` count as dead from here on.
    pub fn process_faults(
        &mut self,
        tick: Tick,
        poses: &[Pose],
        field: &mut Field,
        left_out: &[u32],
    ) -> Vec<ProcessFault> {
        for &robot in left_out {
            self.fates[robot as usize].state = AgentState::Down;
        }
        let mut process_faults = Vec::new();
        // What ends makes room for what begins, in whichever order they are planned.
        for fault in self.faults.iter_mut().filter(|fault| fault.state == State::Active) {
            if tick >= fault.window.end {
                fault.state = State::Over;
                fault.rule.end(fault.rng, &mut self.fates, &mut process_faults, &mut fault.entry);
            }
        }
        for fault in self.faults.iter_mut().filter(|fault| fault.state == State::ToCome) {
            if fault.window.contains(&tick) {
                // What is changed for good has nothing to do any more.
                fault.state = if fault.is_for_good { State::Over } else { State::Active };
                let scene = Scene { poses, field };
                fault.target = Target::made(&fault.spec, &scene, fault.rng);
                fault.rule.look(&scene);
                fault.rule.begin(tick, &fault.target, &mut self.fates, &mut process_faults, &mut fault.entry);
                if fault.rule.change_field(field) {
                    fault.entry.happened(tick, "field changes");
                }
            }
        }
        process_faults
    }

    /// Whether the plan lets this robot's agent be.
    pub fn is_up(&self, robot: u32) -> bool {
        self.fates[robot as usize].state == AgentState::Up
    }

    /// Whether the plan has paused this robot's agent.
    pub fn is_paused(&self, robot: u32) -> bool {
        matches!(self.fates[robot as usize].state, AgentState::Paused { .. })
    }

    /// Whether no fault is at work just now.
    pub fn is_idle(&self) -> bool {
        self.faults.iter().all(|fault| fault.state != State::Active)
    }

    /// A packet of robot `robot` as it goes out.
    pub fn transmitted(&mut self, tick: Tick, robot: u32, packet: Packet, payloads: &mut Payloads) -> Packet {
        let mut packet = packet;
        for fault in self.active_on(robot) {
            if fault.rule.speak(&mut packet, payloads) {
                fault.entry.did(tick, "packets falsified", robot);
            }
        }
        packet
    }

    /// Judges a packet that the channel has let through. Each fault sees what those before it
    /// have left; copies go their own ways from where they were made.
    pub fn passage(
        &mut self,
        tick: Tick,
        reception: &Reception,
        receiver_at: ArenaPoint,
        payloads: &mut Payloads,
    ) -> Passage {
        let Reception { sender, receiver, packet, .. } = *reception;
        let mut under_way: Vec<(Packet, Tick)> = vec![(packet, 0)];
        let mut made = 1;
        let mut lost = 0;
        for fault in self.faults.iter_mut().filter(|fault| fault.state == State::Active) {
            if !fault.rule.chooses_itself() && !fault.target.links(sender, receiver) {
                continue;
            }
            let mut left: Vec<(Packet, Tick)> = Vec::with_capacity(under_way.len());
            for (copy, (packet, late)) in (0..).zip(under_way) {
                let flight = Flight { reception: Reception { packet, ..*reception }, receiver_at };
                let verdict = fault.rule.judge(&flight, fault.rng.of_copy(copy), payloads);
                let over_bound = matches!(verdict, Verdict::Repeat(_)) && made == COPIES_MAX;
                match (verdict.entry(), over_bound) {
                    (Some(_), true) => {
                        fault.entry.did(tick, "packets not duplicated, too many copies", receiver)
                    }
                    (Some(what), false) => fault.entry.did(tick, what, receiver),
                    (None, _) => {}
                }
                match verdict {
                    Verdict::Drop(_) => lost += 1,
                    Verdict::Delay(ticks) => left.push((packet, late.saturating_add(ticks))),
                    Verdict::Alter(altered) => left.push((altered, late)),
                    Verdict::Repeat(ticks) if !over_bound => {
                        left.extend([(packet, late), (packet, late.saturating_add(ticks))]);
                        made += 1;
                    }
                    Verdict::Pass | Verdict::Repeat(_) => left.push((packet, late)),
                }
            }
            under_way = left;
        }
        Passage { arrivals: under_way, lost }
    }

    /// Applies faults to a reading of robot `robot`.
    pub fn sensed(&mut self, tick: Tick, robot: u32, light: &mut Light) {
        for fault in self.active_on(robot) {
            if fault.rule.sense(tick, robot, fault.rng, light) {
                fault.entry.did(tick, "readings falsified", robot);
            }
        }
    }

    /// How robot `robot` moves when it is told to move with `velocity`; `None` if it is stuck, and yields to nobody.
    pub fn driven(&mut self, tick: Tick, robot: u32, velocity: BodyVector) -> Option<BodyVector> {
        let mut velocity = Some(velocity);
        for fault in self.active_on(robot) {
            if fault.rule.drive(&mut velocity) {
                fault.entry.did(tick, "moves falsified", robot);
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
                fault.entry.did(tick, "answers delayed", robot);
            }
            late = late.saturating_add(ticks);
        }
        late
    }

    /// Returns the ledger of all faults, in the order of the plan.
    pub fn ledger(&self) -> impl Iterator<Item = &Line> {
        self.faults.iter().map(|fault| &fault.entry.line)
    }

    fn active_on(&mut self, robot: u32) -> impl Iterator<Item = &mut Fault> {
        self.faults.iter_mut().filter(move |fault| fault.state == State::Active && fault.target.robot(robot))
    }
}

/// Every kind, as the crate `scenario` has them, with its rule.
macro_rules! rules {
    ($($file:ident::$Kind:ident,)*) => {
        $(mod $file;)*

        fn rule_of(kind: &Kind, scenario: &Scenario) -> Box<dyn Rule> {
            match kind {
                $(Kind::$Kind(spec) => Box::new($file::$Kind::new(spec, scenario)),)*
            }
        }
    };
}

rules! {
    loss::Loss,
    burst::Burst,
    delay::Delay,
    duplicate::Duplicate,
    corrupt::Corrupt,
    partition::Partition,
    jam::Jam,
    kill::Kill,
    pause::Pause,
    slow::Slow,
    sensor::Sensor,
    motion::Motion,
    liar::Liar,
    field::Field,
}
