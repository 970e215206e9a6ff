//! One trial of a batch.

use anyhow::Context;
use arena::Arena;
use engine::{Observer, Plan, StopFlag};
use observe::{
    log_context::LogContext,
    trial::{Record, Trial},
};
use scenario::Scenario;
use squad::Squad;

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
