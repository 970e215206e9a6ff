//! Files of a run: `scenario.toml`, `metrics.csv`, and where it came to its end or was asked to,
//! `summary.json`, `robots.csv`, `ledger.csv`, `poses.csv`.

use std::{collections::BTreeMap, path::Path};

use arena::placement;
use scenario::Scenario;
use serde_json::Value;

use crate::{chart::Point, error::ReportError, plan::Body, rows::Rows, scene};

/// A run as read from its folder.
#[derive(Debug)]
pub struct Run {
    /// The scenario as resolved.
    pub scenario: Scenario,
    /// `summary.json`; `None` if the run did not come to its end.
    pub summary: Option<Value>,
    /// `metrics.csv`.
    pub metrics: Rows,
    /// `ledger.csv`.
    pub ledger: Option<Rows>,
    /// Where robots were at the start.
    pub start: Vec<Body>,
    /// Where they were at the end; empty if that is not known.
    pub end: Vec<Body>,
    /// Where they were in between.
    pub poses: Option<Poses>,
    /// Notes to read before trusting the rest.
    pub notes: Vec<String>,
}

/// A robot at some time, in seconds.
pub type Timed = (f64, Body);

/// `poses.csv`: robots over time.
#[derive(Debug)]
pub struct Poses {
    /// Each robot's path, by its index: seconds and the robot.
    pub paths: BTreeMap<u64, Vec<Timed>>,
}

impl Run {
    /// Reads the run in `folder`.
    pub fn read(folder: &Path) -> Result<Self, ReportError> {
        let hint = "a run writes it as it goes; give the folder that --out of `lamplight run` named";
        let metrics = Rows::read(&folder.join("metrics.csv"), hint)?;
        let scenario = scene::scenario(folder)?;
        let summary: Option<Value> = scene::json(&folder.join("summary.json"))?;
        let mut notes: Vec<String> = metrics.note().into_iter().collect();
        if summary.is_none() {
            notes.push("The run did not come to its end: there is no summary.json.".into());
        }
        if let Some(failure) = summary.as_ref().and_then(|summary| summary.get("failure")?.as_str()) {
            notes.push(format!("The run failed: {failure}"));
        }
        let open = summary.as_ref().and_then(|summary| summary.get("robots_with_open_cell")?.as_u64());
        if let Some(robots @ 1..) = open {
            notes.push(format!(
                "Open cells at the end: {robots}, with goals farther away than the arena's diagonal. \
                 controller.cell_cap_m or arena.boundary_sensing = true closes them."
            ));
        }
        let unwritten = summary.as_ref().and_then(|summary| summary.get("unwritten")?.as_array());
        notes.extend(unwritten.into_iter().flatten().filter_map(Value::as_str).map(str::to_owned));
        let mut read = |name: &str| -> Result<Option<Rows>, ReportError> {
            let rows = Rows::read_if_there(&folder.join(name))?;
            notes.extend(rows.as_ref().and_then(Rows::note));
            Ok(rows)
        };
        let ledger = read("ledger.csv")?;
        let poses = read("poses.csv")?.as_ref().map(Poses::of).transpose()?;
        let robots = read("robots.csv")?.as_ref().map(bodies).transpose()?;
        let placed = || {
            let poses = placement::start(&scenario).unwrap_or_default();
            let at = |pose: arena::frame::Pose| (pose.position.x, pose.position.y);
            poses.into_iter().map(|pose| Body { at: at(pose), present: true }).collect()
        };
        let start = poses.as_ref().and_then(Poses::first).unwrap_or_else(placed);
        let end = robots.or_else(|| poses.as_ref()?.last()).unwrap_or_default();
        Ok(Self { scenario, summary, metrics, ledger, start, end, poses, notes })
    }

    /// The scenario with the field as it was at the end, by the plan.
    pub fn at_end(&self) -> Scenario {
        let ticks = self.summary.as_ref().and_then(|summary| summary.get("ticks")?.as_u64());
        let field = self.scenario.field_at(ticks.unwrap_or(self.scenario.ticks()));
        Scenario { field, ..self.scenario.clone() }
    }

    /// Where each robot went; empty if that was not recorded.
    pub fn trajectories(&self) -> Vec<Vec<Point>> {
        let paths = self.poses.iter().flat_map(|poses| poses.paths.values());
        paths.map(|path| path.iter().map(|(_, body)| body.at).collect()).collect()
    }
}

impl Poses {
    fn of(rows: &Rows) -> Result<Self, ReportError> {
        let (times, robots) = (rows.full("time_s")?, rows.counts("robot")?);
        let mut paths: BTreeMap<u64, Vec<Timed>> = BTreeMap::new();
        for ((time_s, robot), body) in times.into_iter().zip(robots).zip(bodies(rows)?) {
            paths.entry(robot).or_default().push((time_s, body));
        }
        Ok(Self { paths })
    }

    fn first(&self) -> Option<Vec<Body>> {
        self.ends(|path| path.first())
    }

    fn last(&self) -> Option<Vec<Body>> {
        self.ends(|path| path.last())
    }

    fn ends(&self, pick: fn(&[Timed]) -> Option<&Timed>) -> Option<Vec<Body>> {
        let bodies: Vec<Body> = self.paths.values().filter_map(|path| Some(pick(path)?.1)).collect();
        (!bodies.is_empty()).then_some(bodies)
    }
}

fn bodies(rows: &Rows) -> Result<Vec<Body>, ReportError> {
    let is = |word: &str| matches!(word, "true" | "1");
    let (xs, ys, alive) = (rows.full("x_m")?, rows.full("y_m")?, rows.words("alive")?);
    // Older runs call who is paused not alive.
    let paused = if rows.has("paused") { rows.words("paused")? } else { vec!["false"; rows.len()] };
    let bodies = xs.into_iter().zip(ys).zip(alive.into_iter().zip(paused));
    Ok(bodies.map(|(at, (alive, paused))| Body { at, present: is(alive) && !is(paused) }).collect())
}
