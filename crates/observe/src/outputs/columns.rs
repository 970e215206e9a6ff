//! Columns of `robots.csv` about the agent of one robot. A column is empty where nothing was measured.

use profile::{Profile, Source, Span, Spread, Stage};
use serde::Serialize;

/// The columns of one robot; `_us` are microseconds, and docs/profiling.md says what each means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(super) struct Columns {
    pub(super) cycle_p50_us: Option<f64>,
    pub(super) cycle_p99_us: Option<f64>,
    pub(super) cycle_max_us: Option<f64>,
    pub(super) wake_p50_us: Option<f64>,
    pub(super) wake_p99_us: Option<f64>,
    pub(super) receive_p50_us: Option<f64>,
    pub(super) neighbors_p50_us: Option<f64>,
    pub(super) cell_p50_us: Option<f64>,
    pub(super) truncation_p50_us: Option<f64>,
    pub(super) centroid_p50_us: Option<f64>,
    pub(super) step_p50_us: Option<f64>,
    pub(super) publish_p50_us: Option<f64>,
    pub(super) packet_p50_us: Option<f64>,
    pub(super) packet_p99_us: Option<f64>,
    pub(super) missed_deadlines: Option<u64>,
    pub(super) cycles_per_tick: Option<f64>,
    pub(super) instructions: Option<u64>,
    pub(super) core_cycles: Option<u64>,
    pub(super) cpu_ms: Option<f64>,
    pub(super) switches_voluntary: Option<u64>,
    pub(super) switches_involuntary: Option<u64>,
    pub(super) faults_minor: Option<u64>,
    pub(super) faults_major: Option<u64>,
    pub(super) rss_kb: Option<u64>,
    pub(super) pss_kb: Option<u64>,
}

impl Columns {
    /// Of robot `index`.
    pub(super) fn of(profile: &Profile, index: usize) -> Self {
        let robot = &profile.robots[index];
        let spread = |span| Spread::of(robot.histograms.of(span));
        let median = |stage| spread(Span::Stage(stage)).map(|spread| spread.p50);
        let (cycle, wake) = (spread(Span::Cycle), spread(Span::Stage(Stage::Wake)));
        let (packet, usage) = (spread(Span::Packet), robot.usage);
        Self {
            cycle_p50_us: cycle.map(|cycle| cycle.p50),
            cycle_p99_us: cycle.map(|cycle| cycle.p99),
            cycle_max_us: cycle.map(|cycle| cycle.max),
            wake_p50_us: wake.map(|wake| wake.p50),
            wake_p99_us: wake.map(|wake| wake.p99),
            receive_p50_us: median(Stage::Receive),
            neighbors_p50_us: median(Stage::Neighbors),
            cell_p50_us: median(Stage::Cell),
            truncation_p50_us: median(Stage::Truncation),
            centroid_p50_us: median(Stage::Centroid),
            step_p50_us: median(Stage::Step),
            publish_p50_us: median(Stage::Publish),
            packet_p50_us: packet.map(|packet| packet.p50),
            packet_p99_us: packet.map(|packet| packet.p99),
            missed_deadlines: Some(robot.missed_deadlines),
            cycles_per_tick: robot.counts_per_cycle().filter(|_| profile.clock.source == Source::Tsc),
            instructions: robot.counted.map(|counted| counted.instructions),
            core_cycles: robot.counted.map(|counted| counted.core_cycles),
            cpu_ms: usage.map(|usage| usage.cpu_ns as f64 / 1e6),
            switches_voluntary: usage.map(|usage| usage.switches_voluntary),
            switches_involuntary: usage.map(|usage| usage.switches_involuntary),
            faults_minor: usage.map(|usage| usage.faults_minor),
            faults_major: usage.map(|usage| usage.faults_major),
            rss_kb: usage.map(|usage| usage.rss_kb),
            pss_kb: usage.and_then(|usage| usage.pss_kb),
        }
    }
}
