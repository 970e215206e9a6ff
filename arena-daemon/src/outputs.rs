//! What a run leaves on disk (`--out DIR`).
//!
//! `scenario.toml` comes first and marks the folder as used, `metrics.csv` (and `poses.csv`, where the
//! scenario asks for it) grow with the run, and `robots.csv`, `latency.hlog`, `ledger.csv` and `summary.json` are
//! written at its end.

mod robot_row;

use std::{
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use arena::{Arena, metrics::Metrics, scenario::Scenario};
use protocol::command::Command;
use serde::Serialize;

use self::robot_row::RobotRow;
use crate::{
    profile::{Columns, Profile},
    progress::Status,
    squad::Standing,
    summary::Summary,
};

/// Files by which a folder is known to hold a run.
const MARKS: [&str; 2] = ["summary.json", "scenario.toml"];

/// Where results go; or nowhere.
#[derive(Debug)]
pub struct Outputs {
    kept: Option<Kept>,
}

/// A folder that grows with the run.
#[derive(Debug)]
struct Kept {
    folder: PathBuf,
    metrics: Rows,
    poses: Option<Rows>,
}

/// A CSV file that is being written.
#[derive(Debug)]
struct Rows {
    path: PathBuf,
    rows: csv::Writer<File>,
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
struct PoseRow {
    tick: u64,
    time_s: f64,
    robot: u32,
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
    alive: bool,
    paused: bool,
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
    /// Makes the folder and begins the files that grow.
    pub fn begin(folder: Option<&Path>, scenario: &Scenario) -> anyhow::Result<Self> {
        let Some(folder) = folder else { return Ok(Self { kept: None }) };
        prepare(folder)?;
        // Of two runs that begin at once, one finds the mark of the other here.
        File::create_new(folder.join("scenario.toml"))
            .and_then(|mut file| file.write_all(scenario.to_toml().as_bytes()))
            .with_context(|| format!("cannot write to {}", folder.display()))?;
        let metrics = Rows::begin(folder.join("metrics.csv"))?;
        let poses = scenario.output.poses_every_s.map(|_| Rows::begin(folder.join("poses.csv")));
        Ok(Self { kept: Some(Kept { folder: folder.to_path_buf(), metrics, poses: poses.transpose()? }) })
    }

    /// Whether anything is kept at all: what nobody reads need not be measured.
    pub fn are_kept(&self) -> bool {
        self.kept.is_some()
    }

    /// One more row of `metrics.csv`.
    pub fn sample(&mut self, status: &Status, metrics: &Metrics) -> anyhow::Result<()> {
        let Some(kept) = &mut self.kept else { return Ok(()) };
        kept.metrics.add([MetricsRow::new(status, metrics)])
    }

    /// One more row of `poses.csv` for every robot, if the scenario asks for it. Who has not answered is not
    /// alive, unless the plan has paused it.
    pub fn poses(
        &mut self,
        status: &Status,
        arena: &Arena,
        answers: &[Option<Command>],
    ) -> anyhow::Result<()> {
        let Some(rows) = self.kept.as_mut().and_then(|kept| kept.poses.as_mut()) else { return Ok(()) };
        rows.add((0..).zip(arena.poses()).zip(answers).map(|((robot, pose), answer)| PoseRow {
            tick: status.tick,
            time_s: status.time_s,
            robot,
            x_m: pose.position.x,
            y_m: pose.position.y,
            heading_rad: pose.heading,
            alive: answer.is_some() || arena.is_paused(robot),
            paused: arena.is_paused(robot),
        }))
    }

    /// `robots.csv`, `latency.hlog` if agents were measured, `ledger.csv` and `summary.json`.
    pub fn finish(
        &mut self,
        summary: &Summary,
        arena: &Arena,
        standings: &[Standing],
        answers: &[Option<Command>],
        profile: Option<&Profile>,
    ) -> anyhow::Result<()> {
        let Some(Kept { folder, .. }) = &self.kept else { return Ok(()) };
        let known = standings.iter().zip(answers).zip(arena.poses()).zip(arena.heard());
        Rows::begin(folder.join("robots.csv"))?.add(known.enumerate().map(
            |(index, (((standing, answer), pose), heard))| {
                let columns = profile.map(|profile| Columns::of(profile, index)).unwrap_or_default();
                RobotRow::new(standing, answer.as_ref(), pose, *heard, &columns)
            },
        ))?;
        if let Some(profile) = profile {
            profile.write_log(&folder.join("latency.hlog"))?;
        }
        ledger(&folder.join("ledger.csv"), summary)?;
        let path = folder.join("summary.json");
        fs::write(&path, summary.json()).with_context(|| format!("cannot write {}", path.display()))
    }
}

impl Rows {
    fn begin(path: PathBuf) -> anyhow::Result<Self> {
        let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Self { path, rows: csv::Writer::from_writer(file) })
    }

    /// Adds rows that belong together. A run that is killed leaves whole rows behind.
    fn add<R: Serialize>(&mut self, rows: impl IntoIterator<Item = R>) -> anyhow::Result<()> {
        let write = || -> csv::Result<()> {
            rows.into_iter().try_for_each(|row| self.rows.serialize(row))?;
            Ok(self.rows.flush()?)
        };
        write().with_context(|| format!("cannot write {}", self.path.display()))
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

/// `csv` writes no flattened structures, so the packet columns are spelled out.
#[derive(Serialize)]
struct MetricsRow {
    tick: u64,
    time_s: f64,
    mean_error_m: Option<f64>,
    max_error_m: Option<f64>,
    robots_without_error: u32,
    robots_with_open_cell: u32,
    mean_true_error_m: Option<f64>,
    robots_without_mass: u32,
    cost_h: Option<f64>,
    cell_agreement: Option<f64>,
    hearing_components: usize,
    staleness_s: Option<f64>,
    mean_lamp_distance_m: Option<f64>,
    mean_peak_distance_m: Option<f64>,
    robots_alive: u32,
    robots_paused: u32,
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
            robots_without_error: metrics.robots_without_error,
            robots_with_open_cell: metrics.robots_with_open_cell,
            mean_true_error_m: metrics.mean_true_error_m,
            robots_without_mass: metrics.robots_without_mass,
            cost_h: metrics.cost_h,
            cell_agreement: metrics.cell_agreement,
            hearing_components: metrics.hearing_components,
            staleness_s: metrics.staleness_s,
            mean_lamp_distance_m: metrics.mean_lamp_distance_m,
            mean_peak_distance_m: metrics.mean_peak_distance_m,
            robots_alive: metrics.robots_alive,
            robots_paused: metrics.robots_paused,
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
