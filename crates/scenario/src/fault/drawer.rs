//! Parts of random faults.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use super::nature::{Strikes, Timing, Window};
use super::setting::Setting;
use super::target::{Choice, Direction, Disc, Pick, ShareOf, Target};
use crate::number::{Finite, NonNegative, Positive, Probability, Share, Xy};
use crate::robot_set::{Link, RobotSet};

/// Most robots or links that a fault lists one by one: more are no other case.
const LISTED_MAX: u64 = 8;

/// Draws parts of a fault.
pub(super) struct Drawer<'a> {
    pub(super) setting: &'a Setting<'a>,
    pub(super) spared: u32,
    pub(super) unit: &'a mut dyn FnMut() -> f64,
}

impl Drawer<'_> {
    /// From some tick to a later one; either may be the run's own.
    pub(super) fn window(&mut self, timing: Timing) -> Window {
        let ticks = self.setting.ticks;
        let is_lasting = timing == Timing::Lasting;
        let from = if !is_lasting || self.chance(0.8) { self.below(ticks) } else { 0 };
        let ends = timing != Timing::ForGood && self.chance(0.7);
        let until = ends.then(|| from + 1 + self.below(ticks - from));
        Window { from_s: self.time(from), until_s: until.map(|until| self.time(until)) }
    }

    pub(super) fn target(&mut self, strikes: Strikes) -> Target {
        match strikes {
            Strikes::ByItsKeys | Strikes::Surroundings => Target::ByItsKeys,
            Strikes::Robots => Target::Robots(self.choice()),
            Strikes::ChosenRobots => {
                let choice = self.choice();
                Target::Robots(Choice { robots: self.but_spared(choice.robots.as_ref()), ..choice })
            }
            Strikes::Packets if self.setting.robots > 1 && self.chance(0.3) => {
                let count = 1 + self.below(LISTED_MAX);
                Target::Links((0..count).map(|_| self.link()).collect())
            }
            Strikes::Packets => {
                let choice = self.choice();
                let directions = [Direction::Both, Direction::Out, Direction::In];
                let direction = if self.chance(0.6) { *self.one_of(&directions) } else { Direction::Both };
                Target::Packets(choice, direction)
            }
        }
    }

    /// Which robots are struck: by name, by place, by share, or by two of these at once.
    fn choice(&mut self) -> Choice {
        let share_max = self.setting.share_max;
        // Nothing said means all of them.
        let way = self.below(if share_max < 1.0 { 6 } else { 7 });
        let mut choice = Choice::default();
        if matches!(way, 0 | 4) {
            let count = 1 + self.below(self.most().min(LISTED_MAX));
            choice.robots = RobotSet::of(self.distinct(count));
        }
        if way == 1 {
            let (count, length) = (self.setting.robots, 1 + self.below(self.most()) as u32);
            let first = self.below(u64::from(count - length) + 1) as u32;
            choice.robots = RobotSet::of(first..first + length);
        }
        if matches!(way, 2 | 4 | 5) {
            choice.region = Some(self.disc());
        }
        if matches!(way, 3 | 5) {
            let share = self.share(share_max);
            let picks = [Pick::Random, Pick::Random, Pick::NearestLamps];
            let known = if self.setting.has_lamps() { &picks[..] } else { &picks[..2] };
            choice.share = share.map(|share| ShareOf { share, pick: *self.one_of(known) });
        }
        choice
    }

    /// These robots, or all, without the one that is spared; another one where nobody is left.
    fn but_spared(&self, robots: Option<&RobotSet>) -> Option<RobotSet> {
        let (count, spared) = (self.setting.robots, self.spared);
        let left = match robots {
            Some(robots) => RobotSet::of(robots.iter().filter(|robot| *robot != spared)),
            None => RobotSet::of((0..count).filter(|robot| *robot != spared)),
        };
        left.or_else(|| RobotSet::of([(spared + 1) % count]))
    }

    /// Groups of robots of which none is in two; `None` in some cases, and always where there are too few robots.
    pub(super) fn groups(&mut self) -> Option<Vec<RobotSet>> {
        if self.setting.robots < 2 || self.chance(0.4) {
            return None;
        }
        let struck = 2 + self.below(self.most().max(2) - 1);
        let groups = 2 + self.below(struck.min(4) - 1);
        let mut members = vec![BTreeSet::new(); groups as usize];
        for (place, robot) in self.distinct(struck).into_iter().enumerate() {
            members[place % groups as usize].insert(robot);
        }
        Some(members.into_iter().filter_map(RobotSet::of).collect())
    }

    /// A velocity, as fast along each axis as a robot may be, or a tenth of the arena per second.
    pub(super) fn velocity(&mut self) -> Option<Xy<Finite>> {
        let [width, height] = self.setting.size_m;
        let limit = self.setting.speed_limit_m_per_s.map(Positive::get);
        let speed = limit.unwrap_or(0.1 * width.min(height));
        Some(Xy { x: self.finite(speed)?, y: self.finite(speed)? })
    }

    /// Largest reading of a light sensor, about.
    pub(super) fn counts_max(&self) -> f64 {
        self.setting.counts_max
    }

    /// A disc that reaches into the arena.
    pub(super) fn disc(&mut self) -> Disc {
        let [width, height] = self.setting.size_m;
        let largest = (self.setting.share_max * width * height / PI).sqrt();
        let radius_m = short(self.between(0.1, 1.0) * largest);
        Disc { center_m: self.place(), radius_m: Positive::new(radius_m).expect("sides are positive") }
    }

    /// A place in the arena.
    pub(super) fn place(&mut self) -> Xy<Finite> {
        let [width, height] = self.setting.size_m;
        let mut along = |side: f64| {
            let place = short(self.between(0.0, side)).min(side);
            Finite::new(place).expect("sides are finite")
        };
        Xy { x: along(width), y: along(height) }
    }

    /// A width of up to half of the arena's shorter side.
    pub(super) fn width(&mut self) -> Option<Positive> {
        let [width, height] = self.setting.size_m;
        Positive::new(short(self.between(0.02, 0.5) * width.min(height)))
    }

    /// A robot of the scenario.
    pub(super) fn robot(&mut self) -> u32 {
        self.below(self.setting.robots.into()) as u32
    }

    /// A chance within the bound.
    pub(super) fn probability(&mut self) -> Probability {
        let most = self.setting.probability_max;
        let drawn = short(self.between(0.0, 1.0) * most).min(most);
        Probability::new(drawn).expect("it is from 0 to the bound")
    }

    /// A delay of whole ticks within the bound, at least one.
    pub(super) fn delay(&mut self) -> Positive {
        let step_s = self.setting.step_s;
        let most = (self.delay_max_s() / step_s) as u64;
        let ticks = 1 + self.below(most.clamp(1, self.setting.ticks));
        Positive::new(self.time(ticks).get()).expect("a step is longer than nothing")
    }

    /// The longest delay there may be, seconds.
    pub(super) fn delay_max_s(&self) -> f64 {
        self.setting.delay_max_s
    }

    /// A share of at most so much.
    pub(super) fn share(&mut self, most: f64) -> Option<Share> {
        let drawn = self.between(0.02, 1.0) * most;
        Share::new(short(drawn).min(drawn))
    }

    /// A number between `-most` and `most`.
    pub(super) fn finite(&mut self, most: f64) -> Option<Finite> {
        Finite::new(short(self.between(-1.0, 1.0) * most))
    }

    /// True with this chance.
    pub(super) fn chance(&mut self, probability: f64) -> bool {
        (self.unit)() < probability
    }

    /// Uniform from 0 to `end` without it; 0 if there is nothing to choose.
    pub(super) fn below(&mut self, end: u64) -> u64 {
        (((self.unit)() * end as f64) as u64).min(end.saturating_sub(1))
    }

    /// Uniform from `low` to `high`.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (self.unit)() * (high - low)
    }

    pub(super) fn one_of<'c, T>(&mut self, choices: &'c [T]) -> &'c T {
        &choices[self.below(choices.len() as u64) as usize]
    }

    fn link(&mut self) -> Link {
        let robots = u64::from(self.setting.robots);
        let (from, away) = (self.below(robots), 1 + self.below(robots - 1));
        Link { from: from as u32, to: ((from + away) % robots) as u32, both_ways: self.chance(0.4) }
    }

    /// Draws `count` different robots.
    fn distinct(&mut self, count: u64) -> BTreeSet<u32> {
        let robots = self.setting.robots;
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
        let robots = f64::from(self.setting.robots);
        ((robots * self.setting.share_max) as u64).max(1)
    }

    /// When a tick is.
    fn time(&self, tick: u64) -> NonNegative {
        NonNegative::new(self.setting.time_of(tick)).expect("ticks are finite times")
    }
}

/// Three digits: what a person can read, and nowhere zero where the value is not.
pub(super) fn short(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
