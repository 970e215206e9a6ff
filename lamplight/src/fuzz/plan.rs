//! A random fault plan, and perhaps a random channel, from one seed.
//!
//! In:  a sound scenario with the bounds of its `[fuzz]` table, and a seed.
//! Out: the same scenario with that seed, a plan drawn from it, and in half of the cases another channel;
//!      always one that parsing accepts.
//!
//! Every fault has a stream of draws of its own. Bounds hold as follows: no chance exceeds
//! `probability_max`, but for how soon a bad link recovers; no fault names more than `share_max` of the robots, nor
//! spans a disc larger than that share of the arena; nothing is later than `delay_max_s`, or one tick where that
//! is less. One robot, drawn for the whole plan, is never killed, so that somebody is always left.

use std::{collections::BTreeSet, f64::consts::PI, num::NonZeroU32};

use arena::random::{Draws, Purpose};
use protocol::packet::LOCALIZATION_BYTES;
use scenario::{
    Capture, ChannelModel, ChannelSpec, Direction, Disc, FaultKind, FaultSpec, Finite, FlipCount, Link,
    Medium, NonNegative, Pick, Positive, Probability, Profile, RobotSet, Scenario, Seed, Share, Xy,
    file::{AccessKey, ChannelKeys},
};

/// Most robots or links that a fault lists one by one: more are no other case.
const LISTED_MAX: u64 = 8;
/// Longest cycle of control times gain that a scenario may have.
const GAIN_CYCLE_MAX: f64 = scenario::MAX_GAIN_STEP;

/// `base` with this seed and what is drawn from it.
pub(crate) fn drawn(base: &Scenario, seed: Seed) -> Scenario {
    let mut scenario = Scenario { seed, fault: Vec::new(), ..base.clone() };
    let mut draws = Draws::of(seed.get(), Purpose::FuzzChannel, 0, 0, 0);
    if let ChannelModel::Range { range_m, .. } = base.channel.model
        && chance(&mut draws, 0.5)
    {
        scenario.channel = channel(base, range_m, &mut draws);
        // A hundred times worse than quartz, so that short runs feel it.
        if chance(&mut draws, 0.3) {
            let drift_ppm = nonnegative(short(draws.between(0.0, 5000.0)));
            scenario.processes.clock_drift_ppm = drift_ppm.unwrap_or(scenario.processes.clock_drift_ppm);
        }
    }
    scenario.fault = faults(&scenario);
    scenario
}

fn faults(scenario: &Scenario) -> Vec<FaultSpec> {
    let mut draws = Draws::of(scenario.seed.get(), Purpose::FuzzPlan, 0, 0, 0);
    let robots = scenario.robot_count();
    let spared = below(&mut draws, robots.into()) as u32;
    // A robot alone cannot be killed: the run would have nobody left.
    let kinds = scenario.fuzz.kinds.iter().copied().filter(|kind| *kind != FaultKind::Kill || robots > 1);
    let kinds: Vec<FaultKind> = kinds.collect();
    if kinds.is_empty() {
        return Vec::new();
    }
    let count = 1 + below(&mut draws, scenario.fuzz.faults_max.get().into());
    let mut faults: Vec<FaultSpec> = Vec::new();
    for place in 1..=count {
        let draws = Draws::of(scenario.seed.get(), Purpose::FuzzPlan, place, 0, 0);
        let mut fault = Drawer { draws, scenario, spared }.fault(&kinds);
        // Who a share strikes is known only when it does, so shares may overlap.
        if faults.iter().any(|earlier| excludes(scenario, earlier, &fault)) {
            fault.share = share(scenario.fuzz.share_max.get());
        }
        faults.push(fault);
    }
    faults
}

/// Whether two faults would strike the same named robot at once, which a plan must not do.
fn excludes(scenario: &Scenario, one: &FaultSpec, other: &FaultSpec) -> bool {
    let exclusive = matches!(one.kind, FaultKind::Kill | FaultKind::Pause | FaultKind::Slow);
    let named = |fault: &FaultSpec| fault.share.is_none() && fault.region.is_none();
    let everyone = RobotSet::of(0..scenario.robot_count());
    let whom = |fault: &FaultSpec| fault.robots.clone().or(everyone.clone());
    let until = |fault: &FaultSpec| fault.ends_s().unwrap_or(f64::INFINITY);
    exclusive
        && one.kind == other.kind
        && named(one)
        && named(other)
        && one.begins_s() < until(other)
        && other.begins_s() < until(one)
        && whom(one).zip(whom(other)).is_some_and(|(these, those)| these.lowest_common(&those).is_some())
}

/// Draws one fault.
struct Drawer<'a> {
    draws: Draws,
    scenario: &'a Scenario,
    /// The robot that is never killed.
    spared: u32,
}

impl Drawer<'_> {
    fn fault(&mut self, kinds: &[FaultKind]) -> FaultSpec {
        let mut fault = FaultSpec::new(one_of(&mut self.draws, kinds));
        match fault.kind {
            FaultKind::Kill => self.kill(&mut fault),
            FaultKind::Partition => self.partition(&mut fault),
            FaultKind::Jam => {
                self.window(&mut fault);
                fault.region = Some(self.disc());
            }
            FaultKind::Pause | FaultKind::Slow | FaultKind::Sensor | FaultKind::Motion | FaultKind::Liar => {
                self.window(&mut fault);
                self.robots(&mut fault);
            }
            FaultKind::Loss
            | FaultKind::Burst
            | FaultKind::Delay
            | FaultKind::Duplicate
            | FaultKind::Corrupt => {
                self.window(&mut fault);
                self.packets(&mut fault);
            }
        }
        self.parameters(&mut fault);
        fault
    }

    /// From some tick to a later one; either may be left out.
    fn window(&mut self, fault: &mut FaultSpec) {
        let ticks = self.scenario.ticks();
        let from = if self.chance(0.8) { self.below(ticks) } else { 0 };
        fault.from_s = (from > 0).then(|| self.time(from));
        if self.chance(0.7) {
            let until = from + 1 + self.below(ticks - from);
            fault.until_s = Some(self.time(until));
        }
    }

    fn kill(&mut self, fault: &mut FaultSpec) {
        let ticks = self.scenario.ticks();
        let at = self.below(ticks);
        fault.at_s = Some(self.time(at));
        if self.chance(0.7) {
            let restart = at + 1 + self.below(ticks - at);
            fault.restart_at_s = Some(self.time(restart));
            fault.restart_share = self.chance(0.4).then(|| share(self.between(0.02, 1.0))).flatten();
        }
        self.robots(fault);
        let (count, spared) = (self.scenario.robot_count(), self.spared);
        let all_but_one = || RobotSet::of((0..count).filter(|robot| *robot != spared));
        let robots = match &fault.robots {
            Some(robots) => RobotSet::of(robots.iter().filter(|robot| *robot != spared)),
            None => all_but_one(),
        };
        fault.robots = robots.or_else(|| RobotSet::of([(spared + 1) % count]));
    }

    fn partition(&mut self, fault: &mut FaultSpec) {
        self.window(fault);
        fault.one_way = self.chance(0.5).then(|| self.chance(0.8));
        let robots = u64::from(self.scenario.robot_count());
        if robots < 2 || self.chance(0.4) {
            fault.region = Some(self.disc());
            return;
        }
        let most = self.most().max(2);
        let struck = 2 + self.below(most - 1);
        let groups = 2 + self.below(struck.min(4) - 1);
        let mut members = vec![BTreeSet::new(); groups as usize];
        for (place, robot) in self.distinct(struck).into_iter().enumerate() {
            members[place % groups as usize].insert(robot);
        }
        fault.groups = Some(members.into_iter().filter_map(RobotSet::of).collect());
    }

    /// Which packets are struck.
    fn packets(&mut self, fault: &mut FaultSpec) {
        if self.scenario.robot_count() > 1 && self.chance(0.3) {
            let count = 1 + self.below(LISTED_MAX);
            fault.links = Some((0..count).map(|_| self.link()).collect());
            return;
        }
        self.robots(fault);
        if self.chance(0.6) {
            let direction = one_of(&mut self.draws, &[Direction::Both, Direction::Out, Direction::In]);
            fault.direction = Some(direction);
        }
    }

    /// Which robots are struck: by name, by place, by share, or by two of these at once.
    fn robots(&mut self, fault: &mut FaultSpec) {
        let share_max = self.scenario.fuzz.share_max.get();
        // Nothing said means all of them.
        let ways = if share_max < 1.0 { 6 } else { 7 };
        let way = self.below(ways);
        if matches!(way, 0 | 4) {
            let count = 1 + self.below(self.most().min(LISTED_MAX));
            fault.robots = RobotSet::of(self.distinct(count));
        }
        if way == 1 {
            let (count, length) = (self.scenario.robot_count(), 1 + self.below(self.most()) as u32);
            let first = self.below(u64::from(count - length) + 1) as u32;
            fault.robots = RobotSet::of(first..first + length);
        }
        if matches!(way, 2 | 4 | 5) {
            fault.region = Some(self.disc());
        }
        if matches!(way, 3 | 5) {
            let of_max = self.between(0.02, 1.0);
            fault.share = share(of_max * share_max);
            fault.pick = self.pick();
        }
    }

    fn pick(&mut self) -> Option<Pick> {
        let lamps = !self.scenario.lamps().is_empty();
        let picks = [None, Some(Pick::Random), Some(Pick::NearestLamps)];
        one_of(&mut self.draws, if lamps { &picks } else { &picks[..2] })
    }

    /// Draws the parameters of a fault.
    fn parameters(&mut self, fault: &mut FaultSpec) {
        match fault.kind {
            FaultKind::Loss => fault.probability = self.probability(),
            FaultKind::Burst => {
                fault.p = self.probability();
                fault.r = Probability::new(short(self.between(0.05, 1.0)).min(1.0));
                fault.loss_bad = self.chance(0.5).then(|| self.probability()).flatten();
                fault.loss_good = self.chance(0.5).then(|| self.probability()).flatten();
            }
            FaultKind::Delay => {
                fault.delay_s = self.delay();
                let most = self.scenario.fuzz.delay_max_s.get();
                fault.jitter_s =
                    self.chance(0.6).then(|| nonnegative(short(self.between(0.0, most)))).flatten();
            }
            FaultKind::Duplicate => {
                fault.probability = self.probability();
                fault.delay_s = self.chance(0.5).then(|| self.delay()).flatten();
            }
            FaultKind::Corrupt => {
                fault.probability = self.probability();
                let bits = 8 * LOCALIZATION_BYTES as u64;
                fault.flips = self.chance(0.7).then(|| FlipCount::new(1 + self.below(bits) as u32)).flatten();
            }
            FaultKind::Slow => fault.delay_s = self.delay(),
            FaultKind::Sensor => {
                let (given, counts) = (1 + self.below(7), self.counts());
                fault.bias_counts = (given & 1 > 0).then(|| self.finite(counts)).flatten();
                fault.noise_counts =
                    (given & 2 > 0).then(|| Positive::new(short(self.between(0.01, 1.0) * counts))).flatten();
                fault.stuck = (given & 4 > 0).then_some(true);
            }
            FaultKind::Motion => {
                let given = 1 + self.below(3);
                fault.stuck = (given & 1 > 0).then_some(true);
                fault.drift_m_per_s = (given & 2 > 0).then(|| self.drift()).flatten();
            }
            FaultKind::Liar => {
                let (given, counts) = (1 + self.below(3), self.counts());
                fault.light_counts = (given & 1 > 0).then(|| self.finite(counts)).flatten();
                let robots = u64::from(self.scenario.robot_count());
                fault.identity = (given & 2 > 0).then(|| self.below(robots) as u32);
            }
            FaultKind::Partition | FaultKind::Jam | FaultKind::Kill | FaultKind::Pause => {}
        }
    }

    /// As fast as a robot may be, or a tenth of the arena per second.
    fn drift(&mut self) -> Option<Xy<Finite>> {
        let [width, height] = self.scenario.arena.size_m.get();
        let limit = self.scenario.robots.speed_limit_m_per_s.map(Positive::get);
        let speed = limit.unwrap_or(0.1 * width.min(height));
        Some(Xy { x: self.finite(speed)?, y: self.finite(speed)? })
    }

    /// Largest reading of a light sensor, about.
    fn counts(&self) -> f64 {
        let field = &self.scenario.field;
        let peaks = field.lamp.iter().map(|lamp| lamp.peak.get().abs());
        let gaussians = field.gaussian.iter().map(|peak| (peak.gamma.get() / peak.sigma_m.get()).abs());
        let sum = field.offset.get().abs() + peaks.chain(gaussians).sum::<f64>();
        if sum > 0.0 { sum } else { 1.0 }
    }

    /// Reaches into the arena.
    fn disc(&mut self) -> Disc {
        let [width, height] = self.scenario.arena.size_m.get();
        let largest = (self.scenario.fuzz.share_max.get() * width * height / PI).sqrt();
        let radius_m = short(self.between(0.1, 1.0) * largest);
        let mut along = |side: f64| {
            let place = short(self.between(0.0, side)).min(side);
            Finite::new(place).expect("sides are finite")
        };
        let center_m = Xy { x: along(width), y: along(height) };
        Disc { center_m, radius_m: Positive::new(radius_m).expect("sides are positive") }
    }

    fn link(&mut self) -> Link {
        let robots = u64::from(self.scenario.robot_count());
        let (from, away) = (self.below(robots), 1 + self.below(robots - 1));
        Link { from: from as u32, to: ((from + away) % robots) as u32, both_ways: self.chance(0.4) }
    }

    /// Draws `count` different robots.
    fn distinct(&mut self, count: u64) -> BTreeSet<u32> {
        let robots = self.scenario.robot_count();
        // Floyd's algorithm: each choice is new, or else the highest so far is.
        let mut chosen = BTreeSet::new();
        for highest in u64::from(robots).saturating_sub(count)..robots.into() {
            let robot = self.below(highest + 1) as u32;
            if !chosen.insert(robot) {
                chosen.insert(highest as u32);
            }
        }
        chosen
    }

    /// Most robots that a fault may strike.
    fn most(&self) -> u64 {
        let robots = f64::from(self.scenario.robot_count());
        ((robots * self.scenario.fuzz.share_max.get()) as u64).max(1)
    }

    fn probability(&mut self) -> Option<Probability> {
        let most = self.scenario.fuzz.probability_max.get();
        Probability::new(short(self.between(0.0, 1.0) * most).min(most))
    }

    /// Whole ticks, at least one.
    fn delay(&mut self) -> Option<Positive> {
        let step_s = self.scenario.step_s.get();
        let most = (self.scenario.fuzz.delay_max_s.get() / step_s) as u64;
        let ticks = 1 + self.below(most.clamp(1, self.scenario.ticks()));
        Positive::new(self.time(ticks).get())
    }

    fn finite(&mut self, most: f64) -> Option<Finite> {
        Finite::new(short(self.between(-1.0, 1.0) * most))
    }

    /// When a tick is.
    fn time(&self, tick: u64) -> NonNegative {
        nonnegative(self.scenario.time_of(tick)).expect("ticks are finite times")
    }

    fn chance(&mut self, probability: f64) -> bool {
        chance(&mut self.draws, probability)
    }

    fn below(&mut self, end: u64) -> u64 {
        below(&mut self.draws, end)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.draws.between(low, high)
    }
}

/// Another channel of the same range; the cycle stays the scenario's where the profile's would not do.
fn channel(base: &Scenario, range_m: Positive, draws: &mut Draws) -> ChannelSpec {
    let accesses = [
        AccessKey::Instant,
        AccessKey::Random,
        AccessKey::Aligned,
        AccessKey::Slotted,
        AccessKey::FixedPhase,
    ];
    let profile = one_of(draws, &[Profile::Ideal, Profile::Isis, Profile::ROne]);
    let access = chance(draws, 0.6).then(|| one_of(draws, &accesses));
    let mut channel = ChannelKeys { profile, range_m: Some(range_m), access, ..Default::default() };
    if chance(draws, 0.5) {
        channel.soft_edge_m = nonnegative(short(draws.between(0.0, 0.5) * range_m.get()));
    }
    channel.occlusion = sometimes(draws);
    channel.loss = chance(draws, 0.5).then(|| Probability::new(short(draws.between(0.0, 0.5)))).flatten();
    let mut noise = |share: f64, most: f64| match chance(draws, share) {
        true => nonnegative(short(draws.between(0.0, most))),
        false => None,
    };
    channel.sigma_range = noise(0.3, 0.2);
    channel.sigma_bearing_deg = noise(0.3, 10.0);
    channel.sigma_orientation_deg = noise(0.3, 10.0);
    channel.range_step_m = noise(0.2, 0.3);
    // As many whole steps to a turn as there would be of the step that was drawn.
    let whole = |step: Option<NonNegative>| {
        step.filter(|step| step.get() > 0.0)
            .and_then(|step| nonnegative(360.0 / (360.0 / step.get()).round()))
    };
    channel.bearing_step_deg = whole(noise(0.2, 30.0));
    channel.orientation_step_deg = whole(noise(0.2, 30.0));

    let resolved = |keys: &ChannelKeys| {
        keys.clone().resolve(base.step_s).expect("all keys have a meaning beside each other")
    };
    let as_drawn = resolved(&channel);
    let (own_cycle_s, longest_s) = (base.cycle_s(), GAIN_CYCLE_MAX / base.controller.gain_per_s.get());
    let its_cycle_s = as_drawn.cycle_s.get();
    let fits = base.step_s.get() <= its_cycle_s && its_cycle_s <= longest_s.min(base.duration_s.get());
    let cycle_s = if fits { its_cycle_s } else { own_cycle_s };
    channel.cycle_s = Positive::new(cycle_s).filter(|_| !fits);
    if as_drawn.medium == Medium::Instant {
        return resolved(&channel);
    }
    channel.half_duplex = sometimes(draws);
    channel.capture = one_of(draws, &[None, Some(Capture::None), Some(Capture::FirstLock)]);
    // The longest packet of any profile takes 0.03 s; eight fit into a cycle of it, or shorter ones.
    let airtime_s = (cycle_s / 8.0).min(0.03) * draws.between(0.05, 1.0);
    if !fits || chance(draws, 0.3) {
        channel.airtime_s = Positive::new(short(airtime_s));
    }
    match access {
        Some(AccessKey::FixedPhase) => {
            channel.jitter_s =
                chance(draws, 0.6).then(|| nonnegative(short(cycle_s * draws.between(0.0, 0.5)))).flatten();
        }
        Some(AccessKey::Slotted) if chance(draws, 0.5) => {
            channel.slots = NonZeroU32::new(1 + below(draws, 8) as u32);
        }
        _ => {}
    }
    // Drawn last, so that a seed's other keys stay what they were before there were these.
    if chance(draws, 0.3) {
        let farther = Positive::new(short(draws.between(1.05, 2.0) * range_m.get()));
        channel.interference_range_m = farther.filter(|farther| *farther >= range_m);
    }
    if channel.occlusion == Some(true) {
        channel.occluded_interference = sometimes(draws);
    }
    resolved(&channel)
}

fn sometimes(draws: &mut Draws) -> Option<bool> {
    one_of(draws, &[None, Some(false), Some(true)])
}

fn chance(draws: &mut Draws, probability: f64) -> bool {
    draws.unit() < probability
}

/// Uniform from 0 to `end` without it; 0 if there is nothing to choose.
fn below(draws: &mut Draws, end: u64) -> u64 {
    ((draws.unit() * end as f64) as u64).min(end.saturating_sub(1))
}

fn one_of<T: Copy>(draws: &mut Draws, choices: &[T]) -> T {
    choices[below(draws, choices.len() as u64) as usize]
}

fn share(value: f64) -> Option<Share> {
    Share::new(short(value).min(value))
}

fn nonnegative(value: f64) -> Option<NonNegative> {
    NonNegative::new(value)
}

/// Three digits: what a person can read, and nowhere zero where the value is not.
fn short(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use scenario::{Access, Air};

    use super::*;

    fn drawn(base: &Scenario, seed: u32) -> Scenario {
        super::drawn(base, Seed::new(seed.into()).unwrap())
    }

    fn parsed(text: &str) -> Scenario {
        Scenario::parse("fuzzed.toml", text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    fn swarmbots() -> Scenario {
        let base = parsed(include_str!("../../../scenarios/swarmbots.toml"));
        Scenario { duration_s: Positive::new(20.0).unwrap(), ..base }
    }

    fn points() -> Scenario {
        parsed(include_str!("../../../scenarios/one-gaussian.toml"))
    }

    /// Every key that some fault of this kind may have.
    fn keys(kind: FaultKind) -> Vec<&'static str> {
        let packets =
            ["from_s", "until_s", "robots", "region", "share", "pick", "direction", "links"].as_slice();
        let robots = ["from_s", "until_s", "robots", "region", "share", "pick"].as_slice();
        let (choice, own): (&[&str], &[&str]) = match kind {
            FaultKind::Loss => (packets, &["probability"]),
            FaultKind::Burst => (packets, &["p", "r", "loss_bad", "loss_good"]),
            FaultKind::Delay => (packets, &["delay_s", "jitter_s"]),
            FaultKind::Duplicate => (packets, &["probability", "delay_s"]),
            FaultKind::Corrupt => (packets, &["probability", "flips"]),
            FaultKind::Partition => (&["from_s", "until_s"], &["groups", "region", "one_way"]),
            FaultKind::Jam => (&["from_s", "until_s"], &["region"]),
            FaultKind::Kill => {
                (&["robots", "region", "share", "pick"], &["at_s", "restart_at_s", "restart_share"])
            }
            FaultKind::Pause => (robots, &[]),
            FaultKind::Slow => (robots, &["delay_s"]),
            FaultKind::Sensor => (robots, &["bias_counts", "noise_counts", "stuck"]),
            FaultKind::Motion => (robots, &["stuck", "drift_m_per_s"]),
            FaultKind::Liar => (robots, &["light_counts", "identity"]),
        };
        [choice, own].concat()
    }

    #[test]
    fn plans_have_every_kind_and_every_key() {
        let base = swarmbots();
        let mut seen = BTreeSet::new();
        for fault in (0..1000).flat_map(|seed| drawn(&base, seed).fault) {
            let value = serde_json::to_value(&fault).unwrap();
            for (key, _) in value.as_object().unwrap().iter().filter(|(_, value)| !value.is_null()) {
                seen.insert((fault.kind, key.clone()));
            }
        }
        for kind in FaultKind::ALL {
            for key in keys(kind) {
                assert!(seen.contains(&(kind, key.into())), "{} never has {key}", kind.name());
            }
        }
    }

    #[test]
    fn channels_vary_in_some_runs_and_not_in_all() {
        let base = swarmbots();
        let channels: Vec<ChannelSpec> = (0..300).map(|seed| drawn(&base, seed).channel).collect();
        let same = channels.iter().filter(|channel| **channel == base.channel).count();
        assert!((100..200).contains(&same), "{same}");
        for profile in [Profile::Ideal, Profile::Isis, Profile::ROne] {
            assert!(channels.iter().any(|channel| channel.profile == profile));
        }
        let some = |is: fn(&Air) -> bool| channels.iter().filter_map(ChannelSpec::air).any(is);
        assert!(some(|air| matches!(air.access, Access::FixedPhase { .. })));
        assert!(some(|air| air.capture == Capture::FirstLock));
        let voronoi = points();
        assert!((0..50).all(|seed| drawn(&voronoi, seed).channel == voronoi.channel));
    }

    #[test]
    fn the_same_seed_draws_the_same_plan() {
        let base = swarmbots();
        assert_eq!(drawn(&base, 7), drawn(&base, 7));
        assert_ne!(drawn(&base, 7).fault, drawn(&base, 8).fault);
    }

    #[test]
    fn somebody_is_never_killed() {
        for robots in [2, 3, 50] {
            let base = with_fuzz(robots, "kinds = [\"kill\"]\nfaults_max = 64\nshare_max = 1.0");
            for seed in 0..50 {
                let plan = drawn(&base, seed).fault;
                let survives =
                    |robot| plan.iter().all(|fault| !fault.robots.as_ref().unwrap().contains(robot));
                assert!((0..robots).any(survives), "seed {seed} of {robots} robots");
            }
        }
        assert!(drawn(&with_fuzz(1, "kinds = [\"kill\"]"), 1).fault.is_empty());
    }

    #[test]
    fn bounds_hold() {
        let base = with_fuzz(
            20,
            "faults_max = 64\nprobability_max = 0.013\nshare_max = 0.25\ndelay_max_s = 0.35\n\
             kinds = [\"loss\", \"delay\", \"pause\", \"slow\"]",
        );
        for fault in (0..200).flat_map(|seed| drawn(&base, seed).fault) {
            assert!(matches!(
                fault.kind,
                FaultKind::Loss | FaultKind::Delay | FaultKind::Pause | FaultKind::Slow
            ));
            assert!(fault.probability.is_none_or(|probability| probability.get() <= 0.013));
            assert!(fault.share.is_none_or(|share| share.get() <= 0.25));
            assert!(fault.robots.as_ref().is_none_or(|robots| robots.iter().count() <= 5));
            assert!(fault.delay_s.is_none_or(|delay| delay.get() <= 0.35));
            assert!(fault.jitter_s.is_none_or(|jitter| jitter.get() <= 0.35));
            let chosen = fault.robots.is_some() || fault.share.is_some() || fault.region.is_some();
            assert!(chosen || fault.links.is_some(), "{fault:?}");
        }
    }

    fn with_fuzz(robots: u32, fuzz: &str) -> Scenario {
        parsed(&format!(
            "duration_s = 10.0\nstep_s = 0.1\narena = {{ size_m = [2, 3] }}\nrobots = {{ count = {robots} }}\n\
             controller = {{ gain_per_s = 1.0 }}\nchannel = {{ range_m = 1.0 }}\n[fuzz]\n{fuzz}\n"
        ))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn a_plan_is_always_accepted(seed in any::<u32>(), points_instead in any::<bool>()) {
            let base = if points_instead { points() } else { swarmbots() };
            let scenario = drawn(&base, seed);
            prop_assert_eq!(&parsed(&scenario.to_toml()).fault, &scenario.fault);
        }

        #[test]
        fn a_plan_is_accepted_whatever_the_bounds_and_the_scenario(
            seed in any::<u32>(),
            robots in 1_u32..12,
            (faults_max, share_max, probability_max) in (1_u32..=64, 0.001_f64..=1.0, 0.0_f64..=1.0),
            (delay_max_s, step_s, ticks, gain) in (1e-4_f64..10.0, 0.001_f64..0.5, 1_u32..500, 0.1_f64..3.0),
            side in 0.01_f64..1e4,
        ) {
            let base = parsed(&format!(
                "duration_s = {}\nstep_s = {step_s}\narena = {{ size_m = [{side}, {}] }}\n\
                 robots = {{ count = {robots} }}\ncontroller = {{ gain_per_s = {gain} }}\n\
                 channel = {{ range_m = {} }}\n[fuzz]\nfaults_max = {faults_max}\nshare_max = {share_max}\n\
                 probability_max = {probability_max}\ndelay_max_s = {delay_max_s}\n",
                f64::from(ticks) * step_s,
                side * 1.5,
                side / 3.0,
            ));
            parsed(&drawn(&base, seed).to_toml());
        }
    }
}
