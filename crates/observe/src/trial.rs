//! One trial of a batch: a run of which only what can be compared with others is kept.
//!
//! The [`Record`] is the same to the last bit by whatever squad, and without any wall time.

use anyhow::Context;
use arena::{
    Arena,
    metrics::{EstimatedErrors, Metrics},
};
use engine::{
    Incident, Observer, ObserverError, Plan, RobotStatus, StopFlag, TickView,
    properties::Properties,
    summary::{Ending, Summary},
};
use scenario::Scenario;
use serde::{Deserialize, Serialize};
use squad::Squad;

use crate::log_context::LogContext;

/// Tolerances in meters for which a trial notes when ‖ê‖ fell below them, from the coarsest on.
pub const TOLERANCES_M: [f64; 5] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7];

/// For each of [`TOLERANCES_M`] the first time, in seconds, at which an error was below it.
pub type FirstBelow = [Option<f64>; TOLERANCES_M.len()];

/// Result of a trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// How it ended.
    pub ended: Ending,
    /// Why it failed, if it did.
    pub failure: Option<String>,
    /// Steps of virtual time.
    pub ticks: u64,
    /// The same in seconds.
    pub virtual_time_s: f64,
    /// When the mean ‖ê‖ fell below each tolerance, every robot that took part having one.
    pub mean_below_s: FirstBelow,
    /// When the largest ‖ê‖ fell below each tolerance, likewise.
    pub max_below_s: FirstBelow,
    /// The swarm at the end.
    pub end: Metrics,
    /// Hash over all ticks.
    pub digest: String,
    /// Errors over time, as often as `metrics.csv` of a run would have them.
    pub errors: Vec<Errors>,
    /// Where each robot was at first and at last.
    pub places: Vec<Place>,
    /// Properties that its controllers have stated.
    pub properties: Properties,
    /// Unplanned incidents: with any of them, the numbers are not those of the scenario.
    pub incidents: Vec<Incident>,
    /// Whether the same squad can play another trial: every robot takes part in its first life.
    pub squad_is_whole: bool,
}

/// Estimated errors of the robots that had one at some time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Virtual time, seconds.
    pub time_s: f64,
    /// Mean ‖ê‖, meters; `None` if no robot had one.
    pub mean_m: Option<f64>,
    /// Largest ‖ê‖, meters; likewise.
    pub max_m: Option<f64>,
}

/// Where one robot began and ended, in meters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Before the first tick.
    pub start_m: [f64; 2],
    /// After the last.
    pub end_m: [f64; 2],
    /// Whether it was neither killed nor left out.
    pub alive: bool,
}

/// Plays one trial of `scenario` in lock-step by `squad`, which goes by the name of `engine`, as one of many runs on this
/// machine.
///
/// # Errors
/// If the scenario has no room for its robots. A squad that fails ends the trial, and the record says so.
pub fn play(
    scenario: &Scenario,
    squad: &mut dyn Squad,
    engine: &'static str,
    stop: &StopFlag,
) -> anyhow::Result<Record> {
    let mut arena = Arena::new(scenario)?;
    let start = arena.poses().iter().map(|pose| [pose.position.x, pose.position.y]).collect();
    let mut trial = Trial::new(scenario, start);
    let plan = Plan { engine, shares: false, ..Plan::IN_PROCESS };
    let observers: &mut [&mut dyn Observer] = &mut [&mut LogContext, &mut trial];
    engine::play(scenario, &mut arena, squad, plan, observers, stop);
    trial.record().context("the loop tells every observer of the end")
}

fn is_fresh(robot: &RobotStatus) -> bool {
    robot.is_alive() && !robot.is_paused() && robot.id.incarnation == 0
}

/// Keeps the record of a trial.
#[derive(Debug)]
pub struct Trial {
    every_ticks: u64,
    start_m: Vec<[f64; 2]>,
    mean_below_s: FirstBelow,
    max_below_s: FirstBelow,
    errors: Vec<Errors>,
    record: Option<Record>,
}

impl Trial {
    /// Of `scenario`, whose robots begin at `start_m`.
    pub fn new(scenario: &Scenario, start_m: Vec<[f64; 2]>) -> Self {
        Self {
            every_ticks: scenario.sample_every_ticks(),
            start_m,
            mean_below_s: FirstBelow::default(),
            max_below_s: FirstBelow::default(),
            errors: Vec::new(),
            record: None,
        }
    }

    /// The record, once the trial is over.
    pub fn record(self) -> Option<Record> {
        self.record
    }
}

impl Observer for Trial {
    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        let EstimatedErrors { mean_m, max_m, .. } = tick.errors();
        let time_s = tick.time_s();
        // The last state of the trial is the last sample.
        if tick.is_due(self.every_ticks) {
            self.errors.push(Errors { time_s, mean_m, max_m });
        }
        if let (true, Some(mean_m), Some(max_m)) = (tick.errors().are_of_everyone(), mean_m, max_m) {
            note(&mut self.mean_below_s, mean_m, time_s);
            note(&mut self.max_below_s, max_m, time_s);
        }
        Ok(())
    }

    fn finished(&mut self, end: &TickView<'_>, summary: &Summary) -> Result<(), ObserverError> {
        let robots = end.robots();
        let places = self.start_m.iter().zip(end.poses()).zip(&robots);
        self.record = Some(Record {
            ended: summary.ended,
            failure: summary.failure.clone(),
            ticks: summary.ticks,
            virtual_time_s: summary.virtual_time_s,
            mean_below_s: self.mean_below_s,
            max_below_s: self.max_below_s,
            end: summary.end,
            digest: summary.digest.clone(),
            errors: std::mem::take(&mut self.errors),
            places: places
                .map(|((&start_m, pose), robot)| Place {
                    start_m,
                    end_m: [pose.position.x, pose.position.y],
                    alive: robot.is_alive(),
                })
                .collect(),
            properties: summary.properties.clone(),
            squad_is_whole: summary.incidents.is_empty() && robots.iter().all(is_fresh),
            incidents: summary.incidents.clone(),
        });
        Ok(())
    }
}

fn note(first: &mut FirstBelow, error_m: f64, time_s: f64) {
    for (first, tolerance_m) in first.iter_mut().zip(TOLERANCES_M) {
        if error_m < tolerance_m {
            first.get_or_insert(time_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use arena::Arena;
    use coverage::CoverageController;

    use super::*;

    fn record(overrides: &[&str]) -> Record {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let overrides: Vec<_> = overrides.iter().map(|entry| entry.parse().unwrap()).collect();
        let scenario = Scenario::load(&folder.join("../../scenarios/one-gaussian.toml"), &overrides).unwrap();
        let start = Arena::new(&scenario)
            .unwrap()
            .poses()
            .iter()
            .map(|pose| [pose.position.x, pose.position.y])
            .collect();
        let mut trial = Trial::new(&scenario, start);
        let paper =
            engine::controller(|id, params| params.decode().map(|setup| CoverageController::new(id, setup)));
        engine::run(&scenario, &[&paper], &mut [&mut trial]).unwrap();
        trial.record().unwrap()
    }

    #[test]
    fn finer_tolerances_are_met_later_and_the_largest_error_meets_them_last() {
        let record = record(&["duration_s=20", "step_s=0.05"]);
        for (mean, max) in record.mean_below_s.iter().zip(&record.max_below_s) {
            assert!(max.is_none() || mean <= max);
        }
        let met: Vec<f64> = record.mean_below_s.iter().flatten().copied().collect();
        assert!(met.len() >= 2 && met.is_sorted(), "{met:?}");
    }

    #[test]
    fn errors_are_sampled_from_the_first_tick_to_the_last() {
        let record = record(&["duration_s=1.05", "step_s=0.05", "output.metrics_every_s=0.1"]);
        let times: Vec<f64> = record.errors.iter().map(|sample| sample.time_s).collect();
        assert_eq!((times[0], times.len()), (0.0, 12));
        assert!((times[11] - 1.05).abs() < 1e-12);
    }

    #[test]
    fn a_squad_that_lost_a_robot_is_not_whole() {
        let healthy = ["duration_s=1"];
        let killed = ["duration_s=1", "fault=[{ kind = \"kill\", at_s = 0.5, robots = \"3\" }]"];
        assert!(record(&healthy).squad_is_whole);
        let record = record(&killed);
        assert!(!record.squad_is_whole);
        assert_eq!(record.places.iter().filter(|place| !place.alive).count(), 1);
    }
}
