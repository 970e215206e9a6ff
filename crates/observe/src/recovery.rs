//! Recovery: how long a fault is felt.
//!
//! A quantity (mean ‖ê‖, or the coverage cost H) is back at the beginning of the first
//! `SPAN_CYCLES` neighbor cycles after the fault whose mean is at most 10 % above the mean of as
//! many cycles before it. So noise is no excursion, and what is felt only after some cycles (silence
//! takes time to be noticed) is not missed. While a fault lasts it is not recovered from, and neither is it
//! as long as the quantity has no value: nobody is left, or nobody has a cell.

use std::collections::VecDeque;

use arena::metrics::Disturbance;
use engine::{
    Acted, Observer, ObserverError, TickView,
    summary::{Recovered, Summary},
};
use protocol::percept::Tick;
use scenario::{Fault, Scenario};

/// Neighbor cycles that a value is the mean of: twice as many as it takes to forget a neighbor.
const SPAN_CYCLES: usize = 8;
/// By what share of its value before the fault a quantity may be above it and be back.
const BAND: f64 = 0.1;
/// Below this nothing is an excursion: rounding, in meters or in units of H.
const NOTHING: f64 = 1e-9;

/// The recovery of a swarm from every fault of a plan.
#[derive(Clone, Debug)]
pub struct Recovery {
    faults: Vec<Watch>,
    /// The last few values, and their ticks.
    span: VecDeque<(Tick, Disturbance)>,
    /// From when on values are needed.
    wanted_from: Tick,
}

#[derive(Clone, Debug)]
struct Watch {
    begins: Tick,
    ends: Tick,
    /// Means before it began; `None` until it begins.
    before: Option<Disturbance>,
    back_since: [Option<Tick>; 2],
}

impl Recovery {
    /// Nothing has happened yet.
    pub fn new(scenario: &Scenario) -> Self {
        let faults: Vec<Watch> = scenario.fault.iter().map(|fault| Watch::new(fault, scenario)).collect();
        let first = faults.iter().map(|watch| watch.begins).min().unwrap_or(Tick::MAX);
        let span_ticks = (SPAN_CYCLES as f64 * scenario.cycle_s() / scenario.step_s.get()).ceil() as Tick;
        Self { faults, span: VecDeque::new(), wanted_from: first.saturating_sub(span_ticks) }
    }

    /// Whether what happens at this tick matters: a fault is near, and one is not yet recovered from.
    fn wants(&self, tick: Tick) -> bool {
        tick >= self.wanted_from && !self.faults.iter().all(Watch::is_settled)
    }

    /// Notes what is felt at a tick at which a neighbor cycle began.
    fn observe(&mut self, tick: Tick, felt: Disturbance) {
        let before = self.means();
        for watch in self.faults.iter_mut().filter(|watch| watch.begins <= tick) {
            watch.before.get_or_insert(before);
        }
        if self.span.len() == SPAN_CYCLES {
            self.span.pop_front();
        }
        self.span.push_back((tick, felt));
        let (now, whole) = (self.means(), self.span.len() == SPAN_CYCLES);
        let Some(&(since, _)) = self.span.front() else { return };
        for watch in self.faults.iter_mut().filter(|watch| whole && watch.ends <= since) {
            watch.look(since, now);
        }
    }

    /// How each fault was recovered from, in the order of the plan.
    fn recovered(&self) -> impl Iterator<Item = Recovered> {
        self.faults.iter().map(|watch| {
            let [error, cost] = watch.back_since.map(|since| Some(since?.saturating_sub(watch.begins)));
            Recovered { mean_error_ticks: error, cost_h_ticks: cost }
        })
    }

    /// The means over the span; `None` for what has had no value at some time in it.
    fn means(&self) -> Disturbance {
        let count = self.span.len();
        let sum = |which: usize| self.span.iter().map(|(_, felt)| felt[which]).sum::<Option<f64>>();
        [0, 1].map(|which| sum(which).filter(|_| count > 0).map(|sum| sum / count as f64))
    }
}

impl Observer for Recovery {
    fn acted(&mut self, acted: &Acted<'_>) {
        let Some(scenario) = acted.scenario else { return };
        for (watch, fault) in self.faults.iter_mut().zip(&scenario.fault) {
            watch.ends = Watch::new(fault, scenario).ends;
        }
        if scenario.fault.len() > self.faults.len() && !self.wants(acted.tick) {
            // Values of long ago say nothing of the time before it.
            self.span.clear();
        }
        self.wanted_from = self.wanted_from.min(acted.tick);
        let added = &scenario.fault[self.faults.len()..];
        self.faults.extend(added.iter().map(|fault| Watch::new(fault, scenario)));
    }

    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        if self.wants(tick.tick()) && tick.percepts().is_some() {
            self.observe(tick.tick(), tick.disturbance());
        }
        Ok(())
    }

    fn summarize(&mut self, _: &TickView<'_>, summary: &mut Summary) -> Result<(), ObserverError> {
        let faults = summary.faults.iter_mut().zip(self.recovered());
        // Nobody recovers from what never was.
        for (fault, recovered) in faults.filter(|(fault, _)| fault.line.fired_tick.is_some()) {
            fault.recovered = recovered;
        }
        Ok(())
    }
}

impl Watch {
    /// A fault that is still to come.
    fn new(fault: &Fault, scenario: &Scenario) -> Self {
        let begins = scenario.tick_at(fault.begins_s());
        // Who is killed is gone at once; what comes later is the recovery.
        let ends = match fault.nature().is_at_once() {
            true => begins,
            false => fault.ends_s().map_or(Tick::MAX, |ends_s| scenario.tick_at(ends_s)),
        };
        Self { begins, ends, before: None, back_since: [None; 2] }
    }

    fn is_settled(&self) -> bool {
        self.back_since.iter().all(Option::is_some)
    }

    /// Is a span that began at `since`, after the fault, back where things were before it?
    fn look(&mut self, since: Tick, now: Disturbance) {
        let Some(before) = self.before else { return };
        for ((back_since, before), now) in self.back_since.iter_mut().zip(before).zip(now) {
            // What had no value before cannot be recovered.
            let (Some(before), Some(now)) = (before, now) else { continue };
            // H is negative where φ is.
            if now <= before + (before.abs() * BAND).max(NOTHING) {
                back_since.get_or_insert(since);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn watched(faults: &str) -> Recovery {
        let text = format!(
            "duration_s = 100\nstep_s = 0.1\narena.size_m = [2, 1]\nrobots.count = 3\n\
             controller.gain_per_s = 1\nchannel.range_m = 1\n{faults}"
        );
        Recovery::new(&Scenario::parse("test", &text, &[]).unwrap_or_else(|error| panic!("{error}")))
    }

    /// Feeds a mean error per tick; H stays as it is.
    fn fed(faults: &str, error: impl Fn(Tick) -> f64) -> Vec<Option<Tick>> {
        fed_perhaps(faults, |tick| Some(error(tick)))
    }

    /// The same with an error that may have no value.
    fn fed_perhaps(faults: &str, error: impl Fn(Tick) -> Option<f64>) -> Vec<Option<Tick>> {
        let mut recovery = watched(faults);
        for tick in (0..1000).filter(|&tick| recovery.wants(tick)).collect::<Vec<_>>() {
            recovery.observe(tick, [error(tick), Some(5.0)]);
        }
        recovery.recovered().map(|recovered| recovered.mean_error_ticks).collect()
    }

    const KILL: &str = "[[fault]]\nkind = \"kill\"\nat_s = 50\nrobots = 1\n";

    #[test]
    fn a_whole_span_must_be_back_and_one_is_enough() {
        // Up for 20 ticks, back for 5, up again for 5; then back, with an excursion long after.
        let up =
            |tick| (500..520).contains(&tick) || (525..530).contains(&tick) || (700..900).contains(&tick);
        let recovered = fed(KILL, |tick| if up(tick) { 2.0 } else { 1.0 })[0];
        assert_eq!(recovered, Some(30));
    }

    #[test]
    fn eight_cycles_at_most_a_tenth_above_eight_before_are_back_and_seven_or_more_above_are_not() {
        assert_eq!(fed(KILL, |tick| if tick >= 500 { 1.0999 } else { 1.0 }), [Some(0)]);
        assert_eq!(fed(KILL, |tick| if tick >= 500 { 1.1001 } else { 1.0 }), [None]);
        let back_for = |ticks: Tick| {
            fed(KILL, move |tick| if tick >= 500 && !(600..600 + ticks).contains(&tick) { 99.0 } else { 1.0 })
        };
        assert_eq!((back_for(8), back_for(7)), (vec![Some(100)], vec![None]));
        // The eight before: what was long ago does not count.
        assert_eq!(fed(KILL, |tick| if tick < 492 { 1.0 } else { 2.0 }), [Some(0)]);
    }

    #[test]
    fn what_is_felt_only_after_some_cycles_is_not_missed() {
        assert_eq!(fed(KILL, |tick| if (505..600).contains(&tick) { 2.0 } else { 1.0 }), [Some(100)]);
    }

    #[test]
    fn what_is_not_felt_is_recovered_from_at_once() {
        assert_eq!(fed(KILL, |_| 1.0), [Some(0)]);
    }

    #[test]
    fn a_swarm_in_which_nobody_has_a_cell_has_not_recovered() {
        assert_eq!(fed_perhaps(KILL, |tick| (tick < 500).then_some(1.0)), [None]);
        let lost_for_a_while = |tick| (!(500..600).contains(&tick)).then_some(1.0);
        assert_eq!(fed_perhaps(KILL, lost_for_a_while), [Some(100)], "it waits until somebody has one");
    }

    #[test]
    fn what_had_no_value_before_a_fault_is_not_recovered() {
        assert_eq!(fed_perhaps(KILL, |tick| (tick >= 500).then_some(0.0)), [None]);
    }

    #[test]
    fn what_stays_up_is_not_recovered() {
        assert_eq!(fed(KILL, |tick| if tick >= 500 { 1.2 } else { 1.0 }), [None]);
    }

    #[test]
    fn a_fault_that_lasts_is_not_recovered_from() {
        let jam = "[[fault]]\nkind = \"jam\"\nfrom_s = 50\nuntil_s = 60\n\
                   region = { center_m = [1, 1], radius_m = 1 }\n";
        assert_eq!(fed(jam, |_| 1.0), [Some(100)], "it ends after 100 ticks");
    }

    #[test]
    fn each_fault_is_measured_by_what_was_before_it() {
        let later = KILL.replace("50", "80").replace("= 1\n", "= 2\n");
        let error = |tick| if tick >= 500 { 2.0 } else { 1.0 };
        assert_eq!(fed(&format!("{KILL}{later}"), error), [None, Some(0)]);
    }

    #[test]
    fn before_the_first_fault_nothing_is_asked_for() {
        let recovery = watched(KILL);
        assert!(!recovery.wants(491) && recovery.wants(492));
        assert!(!watched("").wants(1_000_000_000));
    }
}
