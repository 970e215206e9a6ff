//! Files that a run leaves on disk (`--out DIR`).
//!
//! `scenario.toml` comes first and marks the folder as used, `metrics.csv` (and `poses.csv`, where the
//! scenario asks for it) grow with the run, and `summary.json`, `robots.csv`, `ledger.csv` and `latency.hlog` are
//! written at its end, the most valuable first.
//!
//! A file that cannot be written costs neither the run nor the other files: it ends with its last whole line, and
//! the summary says so.

mod columns;
mod interval_log;
mod robot_row;

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use arena::metrics::Metrics;
use engine::{Observer, ObserverError, TickView, summary::Summary};
use files::{Lines, Reserve, WriteError};
use profile::ProfileSlot;
use scenario::Scenario;
use serde::Serialize;

use self::{columns::Columns, robot_row::RobotRow};

/// Files by which a folder is known to hold a run.
const MARKS: [&str; 2] = [SUMMARY, SCENARIO];
const SCENARIO: &str = "scenario.toml";
const SUMMARY: &str = "summary.json";
/// Room that is kept for it while other files grow: four times the summary of a run with ten faults.
const SUMMARY_BYTES: u64 = 16 << 10;

/// A folder that grows with the run.
#[derive(Debug)]
pub struct Outputs {
    folder: PathBuf,
    metrics: Rows,
    poses: Option<Rows>,
    /// Files that could not be written whole, and why.
    unwritten: Vec<String>,
    /// Room for the summary, which comes last.
    reserve: Option<Reserve>,
    /// Measurements of the agents, if there are any.
    profile: ProfileSlot,
    sample_every_ticks: u64,
    poses_every_ticks: Option<u64>,
}

/// A CSV file that is being written.
#[derive(Debug)]
struct Rows {
    path: PathBuf,
    rows: csv::Writer<Lines>,
    /// Whether a row could not be written: then none follows it.
    is_broken: bool,
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
    /// Makes the folder and begins the files that grow. At the end, what was measured of the agents is taken from
    /// `profile`.
    ///
    /// # Errors
    /// If there is a run in the folder already, or it cannot be written to.
    pub fn begin(folder: &Path, scenario: &Scenario, profile: ProfileSlot) -> anyhow::Result<Self> {
        prepare(folder)?;
        let mark = folder.join(SCENARIO);
        // Of two runs that begin at once, one finds the mark of the other here.
        files::create(&mark, scenario.to_toml())?;
        let begun = Self::begin_files(folder, scenario, profile).inspect_err(|_| {
            // The next attempt would take it for a run.
            let _ = fs::remove_file(&mark);
        });
        Ok(begun?)
    }

    fn begin_files(folder: &Path, scenario: &Scenario, profile: ProfileSlot) -> Result<Self, WriteError> {
        let metrics = Rows::begin(folder.join("metrics.csv"))?;
        let poses_every_ticks = scenario.poses_every_ticks();
        let poses = poses_every_ticks.map(|_| Rows::begin(folder.join("poses.csv"))).transpose()?;
        Ok(Self {
            folder: folder.to_path_buf(),
            metrics,
            poses,
            unwritten: Vec::new(),
            // Where there is none to be kept, the summary takes what there is.
            reserve: Reserve::in_folder(folder, SUMMARY_BYTES).ok(),
            profile,
            sample_every_ticks: scenario.sample_every_ticks(),
            poses_every_ticks,
        })
    }

    /// Takes back the mark of a run that is not to begin, so that the folder is free for the next attempt.
    pub fn take_back(&self) {
        // If it stays, the next attempt says what to remove.
        let _ = fs::remove_file(self.folder.join(SCENARIO));
    }

    /// A run is not lost with one of its files.
    fn go_on_without(&mut self, written: Result<(), WriteError>) {
        if let Err(error) = written {
            tracing::warn!("{error}; the run goes on, and the file ends here");
            self.unwritten.push(error.to_string());
        }
    }

    fn robots(&self, end: &TickView<'_>) -> Result<(), WriteError> {
        let robots = end.robots();
        let known = robots.iter().zip(end.answers()).zip(end.poses()).zip(end.heard()).enumerate();
        let rows = known.map(|(index, (((robot, answer), pose), heard))| {
            let columns = self.profile.get().map(|profile| Columns::of(profile, index)).unwrap_or_default();
            (RobotRow::new(robot, answer.as_ref(), pose, *heard), columns)
        });
        Rows::begin(self.folder.join("robots.csv"))?.add(rows)
    }
}

impl Observer for Outputs {
    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        if tick.is_due(self.sample_every_ticks) {
            let added = self.metrics.add([MetricsRow::new(tick, tick.metrics())]);
            self.go_on_without(added);
        }
        if let (Some(rows), Some(every_ticks)) = (&mut self.poses, self.poses_every_ticks)
            && tick.is_due(every_ticks)
        {
            let added = rows.add(pose_rows(tick));
            self.go_on_without(added);
        }
        Ok(())
    }

    fn summarize(&mut self, _: &TickView<'_>, summary: &mut Summary) -> Result<(), ObserverError> {
        summary.unwritten.append(&mut self.unwritten);
        Ok(())
    }

    /// `summary.json`, `robots.csv`, `ledger.csv`, and `latency.hlog` if agents were measured.
    fn finished(&mut self, end: &TickView<'_>, summary: &Summary) -> Result<(), ObserverError> {
        drop(self.reserve.take());
        let path = self.folder.join(SUMMARY);
        let log =
            |path: PathBuf| self.profile.get().map_or(Ok(()), |profile| interval_log::write(profile, &path));
        let tried = [
            files::replace(&path, summary.json()),
            self.robots(end),
            Rows::begin(self.folder.join("ledger.csv")).and_then(|mut rows| rows.add_ledger(summary)),
            log(self.folder.join("latency.hlog")),
        ];
        let failed: Vec<String> =
            tried.iter().filter_map(|it| it.as_ref().err()).map(ToString::to_string).collect();
        if failed.is_empty() {
            return Ok(());
        }
        let unwritten = summary.unwritten.iter().chain(&failed).cloned().collect();
        // If not even this finds room, the first one stays, and standard output has the rest.
        let _ = files::replace(&path, Summary { unwritten, ..summary.clone() }.json());
        Err(ObserverError::Broken(failed.join("; ")))
    }
}

/// One row for every robot.
fn pose_rows(tick: &TickView<'_>) -> impl Iterator<Item = PoseRow> {
    tick.robots().into_iter().zip(tick.poses()).map(|(robot, pose)| PoseRow {
        tick: tick.tick(),
        time_s: tick.time_s(),
        robot: robot.id.index,
        x_m: pose.position.x,
        y_m: pose.position.y,
        heading_rad: pose.heading,
        alive: robot.is_alive(),
        paused: robot.is_paused(),
    })
}

impl Rows {
    fn begin(path: PathBuf) -> Result<Self, WriteError> {
        let rows = csv::Writer::from_writer(Lines::create(&path)?);
        Ok(Self { path, rows, is_broken: false })
    }

    /// Adds rows that belong together. A run that is killed leaves whole rows behind.
    fn add<R: Serialize>(&mut self, rows: impl IntoIterator<Item = R>) -> Result<(), WriteError> {
        self.write(|file| rows.into_iter().try_for_each(|row| file.serialize(row)))
    }

    fn add_ledger(&mut self, summary: &Summary) -> Result<(), WriteError> {
        self.write(|file| ledger(file, summary))
    }

    /// Tells of the first row that cannot be written; those after it are left out.
    fn write(
        &mut self,
        write: impl FnOnce(&mut csv::Writer<Lines>) -> csv::Result<()>,
    ) -> Result<(), WriteError> {
        if self.is_broken {
            return Ok(());
        }
        let written = write(&mut self.rows).map_err(io_error).and_then(|()| self.rows.flush());
        self.is_broken = written.is_err();
        written.map_err(|error| WriteError::new(&self.path, error))
    }
}

/// The error of the operating system, where it was one.
fn io_error(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        kind => io::Error::other(format!("{kind:?}")),
    }
}

fn ledger(rows: &mut csv::Writer<Lines>, summary: &Summary) -> csv::Result<()> {
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
    Ok(())
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
    robots_silent: u32,
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
    fn new(tick: &TickView<'_>, metrics: &Metrics) -> Self {
        let packets = metrics.packets;
        Self {
            tick: tick.tick(),
            time_s: tick.time_s(),
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
            robots_silent: metrics.robots_silent,
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
