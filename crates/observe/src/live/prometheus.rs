//! A snapshot as Prometheus text (format 0.0.4): base units in names, counters end in `_total`, times are summaries.
//!
//! A summary's quantiles are those of the last 5 to 10 s, its count and sum those of the whole run.

use std::fmt::{Display, Write};

use engine::Participation;
use profile::{Quantiles, RecentTimes, Stage};

use super::snapshot::{Dropped, Snapshot};

/// Robots with metrics of their own: those with the lowest indices. `lamplight_robots_without_metrics` counts the
/// others.
pub const ROBOTS_MAX: usize = 1024;

/// Type of a metric, as the format spells it.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Counter,
    Gauge,
    Summary,
}

/// One metric, being written.
struct Metric<'a> {
    text: &'a mut String,
    name: &'static str,
}

/// `snapshot` as text.
pub fn text(snapshot: &Snapshot) -> String {
    let mut text = String::new();
    run(&mut text, snapshot);
    packets(&mut text, snapshot);
    times(&mut text, snapshot);
    waiting(&mut text, snapshot);
    robots(&mut text, snapshot);
    dropped(&mut text, snapshot);
    text
}

fn run(text: &mut String, snapshot: &Snapshot) {
    let mut gauge = |name, help, value: Option<f64>| {
        let mut metric = begin(text, Kind::Gauge, name, help);
        value.into_iter().for_each(|value| metric.value(&[], value));
    };
    gauge("lamplight_ticks_planned", "Ticks the run has in all.", Some(snapshot.ticks as f64));
    let help = "Mean estimated error of the robots that estimate one.";
    gauge("lamplight_mean_error_meters", help, snapshot.mean_error_m);
    let help = "Virtual over wall time since the first tick.";
    gauge("lamplight_real_time_factor", help, snapshot.real_time_factor());
    let mut counter = |name, help, value: f64| begin(text, Kind::Counter, name, help).value(&[], value);
    counter("lamplight_ticks_total", "Ticks that have passed.", snapshot.tick as f64);
    counter("lamplight_virtual_time_seconds_total", "Virtual time that has passed.", snapshot.time_s);
    counter("lamplight_wall_time_seconds_total", "Wall time since the first tick.", snapshot.wall_s);
    let of = &snapshot.of;
    let mode = format!("{:?}", of.mode).to_lowercase();
    let labels: [(&str, &dyn Display); 4] =
        [("run", &of.run), ("scenario", &of.scenario), ("engine", &of.engine), ("mode", &mode)];
    begin(text, Kind::Gauge, "lamplight_run_info", "Which run it is; always 1.").value(&labels, 1.0);
}

fn packets(text: &mut String, snapshot: &Snapshot) {
    let packets = snapshot.packets;
    begin(text, Kind::Counter, "lamplight_packets_sent_total", "Packets transmitted.")
        .value(&[], packets.sent as f64);
    let help = "What became of packets at listeners: one that eight robots hear counts eight times.";
    let mut metric = begin(text, Kind::Counter, "lamplight_receptions_total", help);
    for (fate, count) in [
        ("heard", packets.heard),
        ("collided", packets.collided),
        ("half_duplex", packets.half_duplex),
        ("lost_range", packets.lost_range),
        ("lost_edge", packets.lost_edge),
        ("occluded", packets.occluded),
        ("lost_loss", packets.lost_loss),
        ("lost_fault", packets.lost_fault),
        ("over_bound", packets.over_bound),
    ] {
        metric.value(&[("fate", &fate)], count as f64);
    }
    begin(text, Kind::Gauge, "lamplight_receptions_delayed", "Receptions that a fault delays, under way.")
        .value(&[], packets.delayed as f64);
}

fn times(text: &mut String, snapshot: &Snapshot) {
    begin(text, Kind::Summary, "lamplight_tick_duration_seconds", "Wall time of a tick.")
        .summary(&[], snapshot.tick_time);
    let Some(RecentTimes { stages, cycle, packet }) = &snapshot.agents else { return };
    let help = "Stages of the agents' cycles.";
    let mut metric = begin(text, Kind::Summary, "lamplight_agent_stage_duration_seconds", help);
    for (stage, times) in Stage::ALL.iter().zip(stages) {
        metric.summary(&[("stage", &stage.name())], *times);
    }
    let help = "Cycles of the agents, from wake-up until the command was sent.";
    begin(text, Kind::Summary, "lamplight_agent_cycle_duration_seconds", help).summary(&[], *cycle);
    let help = "What carrying a packet took beyond what is modeled.";
    begin(text, Kind::Summary, "lamplight_packet_latency_seconds", help).summary(&[], *packet);
}

fn waiting(text: &mut String, snapshot: &Snapshot) {
    let (count, longest_s, named) = match &snapshot.waiting {
        Some(waiting) => (waiting.count, waiting.longest_s(), &waiting.robots[..]),
        None => (0, 0.0, &[][..]),
    };
    begin(text, Kind::Gauge, "lamplight_waiting_robots", "Robots that are waited for.")
        .value(&[], count as f64);
    begin(text, Kind::Gauge, "lamplight_waiting_seconds", "How long the longest of them is waited for.")
        .value(&[], longest_s);
    let help = "Robots that are waited for by name: how long, and what their process does.";
    let mut metric = begin(text, Kind::Gauge, "lamplight_robot_waiting_seconds", help);
    for robot in named {
        let state = robot.state.as_deref().unwrap_or("unknown");
        metric.value(&[("robot", &robot.id.index), ("state", &state)], robot.for_s);
    }
}

fn robots(text: &mut String, snapshot: &Snapshot) {
    let mut metric = begin(text, Kind::Gauge, "lamplight_robots", "Robots by whether they take part.");
    for participation in Participation::ALL {
        metric.value(&[("standing", &participation.name())], snapshot.count(participation) as f64);
    }
    let named = &snapshot.robots[..snapshot.robots.len().min(ROBOTS_MAX)];
    let help = "Robots beyond the bound on metrics of their own.";
    begin(text, Kind::Gauge, "lamplight_robots_without_metrics", help)
        .value(&[], (snapshot.robots.len() - named.len()) as f64);
    let mut metric = begin(text, Kind::Gauge, "lamplight_robot_present", "1 if the robot takes part.");
    for robot in named {
        let present = robot.participation == Participation::Present;
        metric.value(&[("robot", &robot.id.index)], f64::from(u8::from(present)));
    }
    let mut metric =
        begin(text, Kind::Counter, "lamplight_robot_restarts_total", "Lives of the robot before this one.");
    named.iter().for_each(|robot| metric.value(&[("robot", &robot.id.index)], robot.id.incarnation.into()));
    let help = "99th percentile of the robot's last 256 cycles.";
    let mut metric = begin(text, Kind::Gauge, "lamplight_robot_cycle_p99_seconds", help);
    for robot in named {
        if let Some(cycles) = robot.cycles {
            metric.value(&[("robot", &robot.id.index)], cycles.p99_us / 1e6);
        }
    }
    let help = "In real time, timer periods that went by without a cycle.";
    let mut metric = begin(text, Kind::Counter, "lamplight_robot_missed_deadlines_total", help);
    for robot in named {
        if let Some(missed) = robot.missed_deadlines {
            metric.value(&[("robot", &robot.id.index)], missed as f64);
        }
    }
    let mut metric = begin(
        text,
        Kind::Counter,
        "lamplight_robot_commands_refused_total",
        "Commands of the robot refused.",
    );
    named.iter().for_each(|robot| metric.value(&[("robot", &robot.id.index)], robot.refused as f64));
}

fn dropped(text: &mut String, snapshot: &Snapshot) {
    let Dropped { late, crowded_out, ticks } = snapshot.dropped;
    let help =
        "Clients that asked for metrics, or for the run's state, and were dropped without their answer.";
    let mut metric = begin(text, Kind::Counter, "lamplight_clients_dropped_total", help);
    for (reason, count) in [("late", late), ("crowded_out", crowded_out)] {
        metric.value(&[("reason", &reason)], count as f64);
    }
    let help = "Ticks that those who watch were not told of, because they had not read the ones before.";
    begin(text, Kind::Counter, "lamplight_watch_ticks_dropped_total", help).value(&[], ticks as f64);
}

/// A metric's head; its values follow.
fn begin<'a>(text: &'a mut String, kind: Kind, name: &'static str, help: &str) -> Metric<'a> {
    let kind = match kind {
        Kind::Counter => "counter",
        Kind::Gauge => "gauge",
        Kind::Summary => "summary",
    };
    put(text, format_args!("# HELP {name} {help}\n# TYPE {name} {kind}\n"));
    Metric { text, name }
}

impl Metric<'_> {
    fn value(&mut self, labels: &[(&str, &dyn Display)], value: f64) {
        self.sample("", labels, None, value);
    }

    /// Nothing was measured: there is no summary yet.
    fn summary(&mut self, labels: &[(&str, &dyn Display)], times: Option<Quantiles>) {
        let Some(Quantiles { p50_us, p90_us, p99_us, max_us, count, sum_s }) = times else { return };
        for (quantile, us) in [("0.5", p50_us), ("0.9", p90_us), ("0.99", p99_us), ("1", max_us)] {
            self.sample("", labels, Some(quantile), us / 1e6);
        }
        self.sample("_sum", labels, None, sum_s);
        self.sample("_count", labels, None, count as f64);
    }

    fn sample(&mut self, suffix: &str, labels: &[(&str, &dyn Display)], quantile: Option<&str>, value: f64) {
        let quantile = quantile.map(|quantile| ("quantile", escaped(&quantile)));
        let labels = labels.iter().map(|&(name, value)| (name, escaped(value))).chain(quantile);
        let labels = labels.map(|(name, value)| format!("{name}=\"{value}\"")).collect::<Vec<_>>().join(",");
        let labels = if labels.is_empty() { labels } else { format!("{{{labels}}}") };
        put(self.text, format_args!("{}{suffix}{labels} {value}\n", self.name));
    }
}

fn put(text: &mut String, what: std::fmt::Arguments<'_>) {
    text.write_fmt(what).expect("a string takes everything");
}

/// As the value of a label.
fn escaped(value: &dyn Display) -> String {
    value.to_string().replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

#[cfg(test)]
mod tests;
