//! Screen of `lamplight top`, as lines of text: on a terminal, or plain.

use std::{cmp::Ordering, collections::HashMap};

use engine::{Participation, Waited};
use observe::live::{Phase, Robot, Snapshot};
use profile::{Quantiles, Stage};
use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::Stylize,
    text::Line,
    widgets::{Paragraph, Widget},
};

use super::rates::Rate;

/// Robots that have their share of a processor read, though the screen may show fewer.
const SHOWN_MAX: usize = 64;

/// By what robots are sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Sort {
    /// The slowest first: 99th percentile of the cycle.
    #[default]
    P99,
    /// The longest last cycle first.
    Last,
    /// The latest to wake up first.
    Wake,
    /// By number.
    Index,
}

/// State that keys change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Screen {
    sort: Sort,
    /// Robots that have been scrolled past.
    first: usize,
}

/// A run at one moment, on a screen.
pub(super) struct View<'a> {
    pub(super) snapshot: &'a Snapshot,
    pub(super) rate: Option<Rate>,
    /// Of a processor, by process.
    pub(super) shares: &'a HashMap<u32, f64>,
    /// The arena does not answer.
    pub(super) silence: Option<String>,
    pub(super) screen: &'a Screen,
}

/// How much is shown.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// Robots at most.
    pub(super) robots: usize,
    /// Whether keys are explained.
    pub(super) keys: bool,
}

impl Screen {
    pub(super) fn sort_next(&mut self) {
        self.first = 0;
        self.sort = match self.sort {
            Sort::P99 => Sort::Last,
            Sort::Last => Sort::Wake,
            Sort::Wake => Sort::Index,
            Sort::Index => Sort::P99,
        };
    }

    /// By so many robots, down if positive.
    pub(super) fn scroll(&mut self, robots: isize) {
        self.first = self.first.saturating_add_signed(robots);
    }

    /// Robots on the screen, in their order, and perhaps some more.
    pub(super) fn shown<'a>(&self, snapshot: &'a Snapshot) -> impl Iterator<Item = &'a Robot> {
        self.sorted(snapshot).into_iter().take(SHOWN_MAX)
    }

    /// Sorts robots: those waited for come first; those scrolled past are left out.
    fn sorted<'a>(&self, snapshot: &'a Snapshot) -> Vec<&'a Robot> {
        let key = |robot: &Robot| {
            let cycles = robot.cycles.as_ref();
            let longest_first = match self.sort {
                Sort::P99 => cycles.map_or(0.0, |cycles| cycles.p99_us),
                Sort::Last => cycles.map_or(0.0, |cycles| cycles.last_us),
                Sort::Wake => cycles.map_or(0.0, |cycles| cycles.wake_us),
                Sort::Index => 0.0,
            };
            (waited(snapshot, robot).is_none(), -longest_first)
        };
        let mut robots: Vec<&Robot> = snapshot.robots.iter().collect();
        robots.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal));
        robots.split_off(self.first.min(robots.len().saturating_sub(1)))
    }
}

impl Sort {
    fn name(self) -> &'static str {
        match self {
            Self::P99 => "slowest first",
            Self::Last => "longest last cycle first",
            Self::Wake => "latest wake-up first",
            Self::Index => "by number",
        }
    }
}

/// Returns the entry of a robot that is waited for.
fn waited<'a>(snapshot: &'a Snapshot, robot: &Robot) -> Option<&'a Waited> {
    snapshot.waiting.iter().flat_map(|waiting| &waiting.robots).find(|waited| waited.id == robot.id)
}

impl View<'_> {
    /// The whole view.
    pub(super) fn lines(&self, layout: Layout) -> Vec<Line<'static>> {
        let mut lines = self.head();
        lines.push(self.waiting());
        lines.push(Line::default());
        lines.extend(self.times());
        lines.push(Line::default());
        lines.extend(self.robots(layout.robots));
        if layout.keys {
            lines.push(format!("q quit   s sort ({})   arrows scroll", self.screen.sort.name()).dim().into());
        }
        lines
    }

    fn head(&self) -> Vec<Line<'static>> {
        let Snapshot { of, tick, ticks, time_s, wall_s, mean_error_m, packets, .. } = self.snapshot;
        let (alive, all) = (self.snapshot.count(Participation::Present), self.snapshot.robots.len());
        let mode = format!("{:?}", of.mode).to_lowercase();
        let (rate, factor) = match self.rate {
            Some(rate) => (format!("{:.0} ticks/s", rate.ticks_per_s), Some(rate.real_time_factor)),
            None => ("- ticks/s".into(), self.snapshot.real_time_factor()),
        };
        let factor = factor.map_or_else(|| "-".into(), |factor| format!("{factor:.1}"));
        let error = mean_error_m.map_or_else(|| "-".into(), |error_m| format!("{error_m:.3e} m"));
        let state = match self.snapshot.phase {
            Phase::Gathering => "robots join".into(),
            Phase::Running => format!("{alive} of {all} robots take part"),
            Phase::Over => "the last tick has passed".into(),
        };
        let lost = packets.lost_edge + packets.lost_loss + packets.lost_fault + packets.over_bound;
        let missed = packets.half_duplex + packets.occluded;
        vec![
            Line::from(format!("run {}: {} ({}, {mode})", of.run, of.scenario, of.engine)).bold(),
            format!("tick {tick} of {ticks}, {time_s:.1} s of virtual time in {wall_s:.1} s; {state}").into(),
            format!("{rate}, {factor}x real time, mean error {error}").into(),
            format!(
                "packets: {} sent, {} heard, {} collided, {missed} missed, {lost} lost, {} delayed",
                packets.sent, packets.heard, packets.collided, packets.delayed
            )
            .into(),
        ]
    }

    /// Line about the robots that are waited for.
    fn waiting(&self) -> Line<'static> {
        match (&self.silence, &self.snapshot.waiting) {
            (Some(silence), _) => Line::from(silence.clone()).bold().white().on_red(),
            (None, Some(waiting)) => Line::from(waiting.to_string()).bold().white().on_red(),
            (None, None) => Line::from("nobody is waited for").green(),
        }
    }

    /// Ticks and stages.
    fn times(&self) -> Vec<Line<'static>> {
        let head = format!("{:<12}{:>11}{:>11}{:>11}{:>11}", "last seconds", "p50", "p90", "p99", "max");
        let row = |name: &str, times: Option<Quantiles>| {
            let cells = match times {
                Some(Quantiles { p50_us, p90_us, p99_us, max_us, .. }) => {
                    [p50_us, p90_us, p99_us, max_us].map(span)
                }
                None => [(); 4].map(|()| "-".into()),
            };
            let [p50, p90, p99, max] = cells;
            Line::from(format!("{name:<12}{p50:>11}{p90:>11}{p99:>11}{max:>11}"))
        };
        let mut lines = vec![Line::from(head).bold(), row("tick", self.snapshot.tick_time)];
        if let Some(agents) = &self.snapshot.agents {
            let stages = Stage::ALL.iter().zip(agents.stages);
            lines.extend(stages.map(|(stage, times)| row(&format!("  {}", stage.name()), times)));
            lines.push(row("cycle", agents.cycle));
            lines.push(row("packet", agents.packet));
        }
        lines
    }

    fn robots(&self, at_most: usize) -> Vec<Line<'static>> {
        let head = format!(
            "{:>6}{:>5}{:>8}  {:<8}{:>10}{:>10}{:>10}{:>6}{:>7}{:>8}",
            "robot", "life", "pid", "state", "cycle p99", "last", "wake-up", "cpu", "missed", "refused"
        );
        let row = |robot: &Robot| {
            let dash = || "-".to_owned();
            let cycles = robot.cycles.map(|cycles| [cycles.p99_us, cycles.last_us, cycles.wake_us]);
            let [p99, last, wake] = cycles.map_or_else(|| [(); 3].map(|()| dash()), |us| us.map(span));
            let share = robot.pid.and_then(|pid| self.shares.get(&pid));
            let cpu = share.map_or_else(dash, |share| format!("{:.1}%", share * 100.0));
            let waited = waited(self.snapshot, robot);
            let state = waited.and_then(|waited| waited.state.clone());
            let line = format!(
                "{:>6}{:>5}{:>8}  {:<8.8}{p99:>10}{last:>10}{wake:>10}{cpu:>6}{:>7}{:>8}",
                robot.id.index,
                u32::from(robot.id.incarnation) + 1,
                robot.pid.map_or_else(dash, |pid| pid.to_string()),
                state.unwrap_or_else(|| robot.participation.name().into()),
                robot.missed_deadlines.map_or_else(dash, |missed| missed.to_string()),
                robot.refused,
            );
            match (waited, robot.participation) {
                (Some(_), _) => Line::from(line).red().bold(),
                (None, Participation::Present) => Line::from(line),
                (None, _) => Line::from(line).dim(),
            }
        };
        let mut lines = vec![Line::from(head).bold()];
        lines.extend(self.screen.sorted(self.snapshot).into_iter().take(at_most).map(row));
        lines
    }
}

impl Widget for View<'_> {
    /// As many robots as there is room for.
    fn render(self, area: Rect, buffer: &mut Buffer) {
        let fixed = self.lines(Layout { robots: 0, keys: true }).len();
        let robots = usize::from(area.height).saturating_sub(fixed);
        Paragraph::new(self.lines(Layout { robots, keys: true })).render(area, buffer);
    }
}

/// Microseconds in the unit that suits.
fn span(us: f64) -> String {
    match us {
        us if us < 1e3 => format!("{us:.1} us"),
        us if us < 1e6 => format!("{:.2} ms", us / 1e3),
        us => format!("{:.2} s", us / 1e6),
    }
}

#[cfg(test)]
mod tests;
