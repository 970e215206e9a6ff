//! The object `agents` of `summary.json`: all agents in a few numbers.

use serde::{Deserialize, Serialize};

use crate::{
    cycle_times::Stage,
    histograms::{Histograms, Span, Spread},
    profile::{ClockUsed, Profile, RobotProfile, Source},
    usage::Usage,
};

/// All agents of a run. Times in microseconds; a [`Spread`] is `null` where nothing was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// The clock they were measured by.
    pub clock: ClockUsed,
    /// Which counters of the processor were read beside it; or why none.
    pub hardware_counters: String,
    /// Each stage of a cycle.
    pub stages_us: StagesUs,
    /// From wake-up until the command was sent.
    pub cycle_us: Option<Spread>,
    /// Transport time of a packet, beyond what is modeled.
    pub packet_latency_us: Option<Spread>,
    /// In real time: how much later or earlier in its period an agent woke up than the time before.
    pub period_jitter_us: Option<Spread>,
    /// Whole cycles measured.
    pub cycles: u64,
    /// Packets measured: one that is heard by eight robots counts eight times.
    pub packets: u64,
    /// Packets handed out whose latency is not known.
    pub packets_unknown: u64,
    /// Cycles left out: their stamps made no sense, or in real time the answer came several cycles late.
    pub cycles_left_out: u64,
    /// In real time: timer periods that went by without a cycle.
    pub missed_deadlines: u64,
    /// Reference cycles of the processor per whole cycle, on average; `null` if the clock does not count them.
    pub reference_cycles_per_cycle: Option<f64>,
    /// Use of the processes that were there at the end, as far as `/proc` shows them.
    pub processes: Processes,
}

/// A [`Spread`] for each stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "each is named after its stage")]
pub struct StagesUs {
    pub wake: Option<Spread>,
    pub receive: Option<Spread>,
    pub neighbors: Option<Spread>,
    pub cell: Option<Spread>,
    pub truncation: Option<Spread>,
    pub centroid: Option<Spread>,
    pub step: Option<Spread>,
    pub publish: Option<Spread>,
}

/// Sums over processes; `null` where none could be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Processes {
    /// How many were read.
    pub count: u64,
    /// Time on a processor.
    pub cpu_ms: Option<f64>,
    /// How often one gave its processor up to wait.
    pub switches_voluntary: Option<u64>,
    /// How often a processor was taken away.
    pub switches_involuntary: Option<u64>,
    /// Page faults that cost no disk.
    pub faults_minor: Option<u64>,
    /// Page faults that did.
    pub faults_major: Option<u64>,
    /// Memory in use; what they share counts once for each.
    pub rss_kb: Option<u64>,
    /// Memory in use; what they share counts once. `null` where the kernel does not tell.
    pub pss_kb: Option<u64>,
}

impl Totals {
    /// Of all robots of `profile`.
    pub fn of(profile: &Profile) -> Self {
        let all = profile.over_all();
        let spread = |span| Spread::of(all.of(span));
        let sum = |value: fn(&RobotProfile) -> u64| profile.robots.iter().map(value).sum::<u64>();
        let cycles = sum(|robot| robot.cycles);
        Self {
            clock: profile.clock,
            hardware_counters: profile.hardware_counters.clone(),
            stages_us: StagesUs::of(&all),
            cycle_us: spread(Span::Cycle),
            packet_latency_us: spread(Span::Packet),
            period_jitter_us: spread(Span::Jitter),
            cycles,
            packets: all.of(Span::Packet).len(),
            packets_unknown: profile.packets_unknown,
            cycles_left_out: profile.cycles_left_out,
            missed_deadlines: sum(|robot| robot.missed_deadlines),
            reference_cycles_per_cycle: (profile.clock.source == Source::Tsc && cycles > 0)
                .then(|| sum(|robot| robot.counts) as f64 / cycles as f64),
            processes: Processes::of(profile.robots.iter().filter_map(|robot| robot.usage.as_ref())),
        }
    }
}

impl StagesUs {
    fn of(all: &Histograms) -> Self {
        let spread = |stage| Spread::of(all.of(Span::Stage(stage)));
        Self {
            wake: spread(Stage::Wake),
            receive: spread(Stage::Receive),
            neighbors: spread(Stage::Neighbors),
            cell: spread(Stage::Cell),
            truncation: spread(Stage::Truncation),
            centroid: spread(Stage::Centroid),
            step: spread(Stage::Step),
            publish: spread(Stage::Publish),
        }
    }
}

impl Processes {
    fn of<'a>(processes: impl Iterator<Item = &'a Usage> + Clone) -> Self {
        let count = processes.clone().count() as u64;
        // A sum over nobody would say that they took nothing.
        let sum = |value: fn(&Usage) -> Option<u64>| {
            if count > 0 { processes.clone().map(value).sum::<Option<u64>>() } else { None }
        };
        Self {
            count,
            cpu_ms: sum(|usage| Some(usage.cpu_ns)).map(|ns| ns as f64 / 1e6),
            switches_voluntary: sum(|usage| Some(usage.switches_voluntary)),
            switches_involuntary: sum(|usage| Some(usage.switches_involuntary)),
            faults_minor: sum(|usage| Some(usage.faults_minor)),
            faults_major: sum(|usage| Some(usage.faults_major)),
            rss_kb: sum(|usage| Some(usage.rss_kb)),
            pss_kb: sum(|usage| usage.pss_kb),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_over_nobody_is_unknown_and_not_zero() {
        let nobody = Processes::of([].iter());
        assert_eq!(nobody, Processes { count: 0, ..Processes::default() });
        assert_eq!((nobody.cpu_ms, nobody.rss_kb, nobody.pss_kb), (None, None, None));
        let one = Usage { cpu_ns: 2_000_000, rss_kb: 7, ..Usage::default() };
        let both = Processes::of([one, one].iter());
        assert_eq!((both.count, both.cpu_ms, both.rss_kb, both.pss_kb), (2, Some(4.0), Some(14), None));
    }
}
