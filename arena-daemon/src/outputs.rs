//! What a run leaves on disk (`--out DIR`).
//!
//! `scenario.toml` comes first and marks the folder as used, `metrics.csv` grows with the run, and
//! `robots.csv`, `ledger.csv` and `summary.json` are written at its end.

use std::{
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use arena::{Arena, metrics::Metrics, scenario::Scenario};
use protocol::command::Command;
use serde::Serialize;

use crate::{progress::Status, squad::Standing, summary::Summary};

/// Files by which a folder is known to hold a run.
const MARKS: [&str; 2] = ["summary.json", "scenario.toml"];

/// Where results go; or nowhere.
#[derive(Debug)]
pub struct Outputs {
    folder: Option<(PathBuf, csv::Writer<File>)>,
}

const LEDGER_COLUMNS: [&str; 10] = [
    "fault",
    "kind",
    "planned_tick",
    "until_tick",
    "fired_tick",
    "last_tick",
    "robots",
    "effects",
    "mean_error_back_ticks",
    "cost_h_back_ticks",
];

#[derive(Serialize)]
struct RobotRow {
    robot: u32,
    incarnation: u16,
    alive: bool,
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
    error_m: Option<f64>,
    packets_heard: u64,
    commands_refused: u64,
    pid: Option<u32>,
}

/// Makes the folder, and refuses one that already holds a run, so that nothing is overwritten.
pub fn prepare(folder: &Path) -> anyhow::Result<()> {
    let name = folder.display();
    if let Some(mark) = MARKS.iter().find(|mark| folder.join(mark).exists()) {
        bail!("{name} already holds a run ({mark}); give --out another folder, or remove this one");
    }
    if folder.exists() && !folder.is_dir() {
        bail!("{name} is a file; give --out the name of a folder");
    }
    fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {name}; give --out another one"))
}

impl Outputs {
    /// Makes the folder and begins `metrics.csv`.
    pub fn begin(folder: Option<&Path>, scenario: &Scenario) -> anyhow::Result<Self> {
        let Some(folder) = folder else { return Ok(Self { folder: None }) };
        prepare(folder)?;
        let write = || -> io::Result<File> {
            // Of two runs that begin at once, one finds the mark of the other here.
            File::create_new(folder.join("scenario.toml"))?.write_all(scenario.to_toml().as_bytes())?;
            File::create(folder.join("metrics.csv"))
        };
        let metrics = write().with_context(|| format!("cannot write to {}", folder.display()))?;
        Ok(Self { folder: Some((folder.to_path_buf(), csv::Writer::from_writer(metrics))) })
    }

    /// One more row of `metrics.csv`.
    pub fn sample(&mut self, status: &Status, metrics: &Metrics) -> anyhow::Result<()> {
        let Some((folder, rows)) = &mut self.folder else { return Ok(()) };
        metrics_row(rows, &MetricsRow::new(status, metrics))
            .with_context(|| format!("cannot write {}", folder.join("metrics.csv").display()))
    }

    /// `robots.csv`, `ledger.csv` and `summary.json`.
    pub fn finish(
        &mut self,
        summary: &Summary,
        arena: &Arena,
        standings: &[Standing],
        answers: &[Option<Command>],
    ) -> anyhow::Result<()> {
        let Some((folder, rows)) = &mut self.folder else { return Ok(()) };
        rows.flush().context("cannot finish metrics.csv")?;
        let robots = folder.join("robots.csv");
        let mut rows = csv::Writer::from_path(&robots).with_context(|| robots.display().to_string())?;
        let known = standings.iter().zip(answers).zip(arena.poses()).zip(arena.heard());
        for (((standing, answer), pose), heard) in known {
            rows.serialize(RobotRow {
                robot: standing.id.index,
                incarnation: standing.id.incarnation,
                alive: standing.alive,
                x_m: pose.position.x,
                y_m: pose.position.y,
                heading_rad: pose.heading,
                error_m: answer.as_ref().map(|command| command.goal.length()),
                packets_heard: *heard,
                commands_refused: standing.refused,
                pid: standing.pid,
            })?;
        }
        rows.flush().with_context(|| format!("cannot write {}", robots.display()))?;
        ledger(&folder.join("ledger.csv"), summary)?;
        let path = folder.join("summary.json");
        fs::write(&path, summary.json()).with_context(|| format!("cannot write {}", path.display()))
    }
}

fn ledger(path: &Path, summary: &Summary) -> anyhow::Result<()> {
    let write = || -> csv::Result<()> {
        let mut rows = csv::Writer::from_path(path)?;
        rows.write_record(LEDGER_COLUMNS)?;
        for (index, fault) in summary.faults.iter().enumerate() {
            let tick = |tick: Option<u64>| tick.map(|tick| tick.to_string()).unwrap_or_default();
            let back = |ticks: Option<u64>| match (fault.line.fired_tick, ticks) {
                (None, _) => String::new(),
                (Some(_), None) => "not recovered".into(),
                (Some(_), Some(ticks)) => ticks.to_string(),
            };
            rows.write_record([
                index.to_string(),
                fault.line.kind.name().into(),
                fault.line.planned_tick.to_string(),
                tick(fault.line.until_tick),
                tick(fault.line.fired_tick),
                tick(fault.line.last_tick),
                fault.line.robots.to_string(),
                fault.line.told(),
                back(fault.recovered.mean_error_ticks),
                back(fault.recovered.cost_h_ticks),
            ])?;
        }
        Ok(rows.flush()?)
    };
    write().with_context(|| format!("cannot write {}", path.display()))
}

fn metrics_row(rows: &mut csv::Writer<File>, row: &MetricsRow) -> anyhow::Result<()> {
    rows.serialize(row)?;
    // A run that is killed leaves whole rows behind.
    rows.flush()?;
    Ok(())
}

/// `csv` writes no flattened structures, so the packet columns are spelled out.
#[derive(Serialize)]
struct MetricsRow {
    tick: u64,
    time_s: f64,
    mean_error_m: f64,
    max_error_m: f64,
    mean_true_error_m: f64,
    cost_h: f64,
    cell_agreement: f64,
    hearing_components: usize,
    staleness_s: f64,
    mean_lamp_distance_m: Option<f64>,
    robots_alive: u32,
    packets_sent: u64,
    packets_heard: u64,
    packets_in_range: u64,
    packets_duplicated: u64,
    packets_collided: u64,
    packets_half_duplex: u64,
    packets_lost_range: u64,
    packets_lost_edge: u64,
    packets_occluded: u64,
    packets_lost_loss: u64,
    packets_lost_fault: u64,
    packets_over_bound: u64,
    packets_delayed: u64,
}

impl MetricsRow {
    fn new(status: &Status, metrics: &Metrics) -> Self {
        let packets = metrics.packets;
        Self {
            tick: status.tick,
            time_s: status.time_s,
            mean_error_m: metrics.mean_error_m,
            max_error_m: metrics.max_error_m,
            mean_true_error_m: metrics.mean_true_error_m,
            cost_h: metrics.cost_h,
            cell_agreement: metrics.cell_agreement,
            hearing_components: metrics.hearing_components,
            staleness_s: metrics.staleness_s,
            mean_lamp_distance_m: metrics.mean_lamp_distance_m,
            robots_alive: metrics.robots_alive,
            packets_sent: packets.sent,
            packets_heard: packets.heard,
            packets_in_range: packets.in_range,
            packets_duplicated: packets.duplicated,
            packets_collided: packets.collided,
            packets_half_duplex: packets.half_duplex,
            packets_lost_range: packets.lost_range,
            packets_lost_edge: packets.lost_edge,
            packets_occluded: packets.occluded,
            packets_lost_loss: packets.lost_loss,
            packets_lost_fault: packets.lost_fault,
            packets_over_bound: packets.over_bound,
            packets_delayed: packets.delayed,
        }
    }
}
