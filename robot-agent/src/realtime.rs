//! Real time: wake up on the robot's own timer and answer what has come; in between, listen.

use std::time::{Duration, Instant};

use anyhow::Context;
use protocol::{controller::Controller, params::Params, robot_id::RobotId, setup::AgentSetup};
use transport::{
    doorbell::{Doorbell, Ring},
    run_dir::{ArenaWatch, RunDir},
};

use crate::{abandoned::Abandoned, agent::Agent, timer::Timer};

/// Silence after which an agent asks whether its arena still lives.
const ALIVE_POLL: Duration = Duration::from_millis(250);
/// How long rounds may pass it by before it understands that it has been left out.
const LEFT_OUT: Duration = Duration::from_secs(10);
/// After a gap like this, which no nap explains, it was itself away, stopped perhaps; or, if no round has begun for
/// so long and two cycles, the arena was.
const AWAY: Duration = Duration::from_secs(1);
/// Longest nap, so that a dead arena is noticed.
const NAP: Duration = Duration::from_millis(250);

pub(crate) fn run<C: Controller, N: Fn(RobotId, &Params) -> anyhow::Result<C>>(
    agent: &mut Agent<C, N>,
    bell: &Doorbell,
    run: &RunDir,
    arena: &ArenaWatch,
    setup: &AgentSetup,
) -> anyhow::Result<()> {
    let mut seen = bell.round();
    agent.announce(run)?;
    bell.answer();
    let mut now = Instant::now();
    let mut timer = Timer::new(agent.id, setup.cycle, &setup.clock, now)
        .context("the run's neighbor cycle is longer than a clock can count")?;
    let patience = LEFT_OUT.max(timer.period().saturating_mul(10));
    let absence = AWAY.max(timer.period().saturating_mul(2));
    let (mut answered, mut asked, mut rung) = (now, now, now);
    // Percepts begin when everyone is there; until then silence means nothing.
    let mut begun = false;
    loop {
        let left = timer.fires().saturating_duration_since(now);
        let ring = if left.is_zero() { bell.look(seen) } else { bell.wait_for_ring(seen, left.min(NAP)) };
        match ring {
            Ring::Closed => return Ok(()),
            Ring::Silence => {}
            Ring::Round(round) => {
                seen = round;
                let before = std::mem::replace(&mut rung, Instant::now());
                if rung - before > absence {
                    // Nobody was called in that time.
                    answered = rung;
                }
                agent.listen()?;
            }
        }
        let before = std::mem::replace(&mut now, Instant::now());
        if now - before > AWAY {
            // Nobody could have answered in that time.
            answered = now;
        }
        if now >= timer.fires() {
            let fired = timer.fired(now);
            agent.stopwatch.woke_late(fired.late);
            // Before percepts begin, there is nothing to be in time for.
            agent.stopwatch.miss(if begun { fired.skipped } else { 0 });
            agent.listen()?;
            if agent.answer(run)? {
                bell.answer_as(agent.id.index);
                (answered, begun) = (now, true);
            } else if begun && rung.saturating_duration_since(answered) > patience {
                return Err(Abandoned::LeftOut { run: run.name().clone(), id: agent.id }.into());
            }
            if begun && !timer.is_in_time(Instant::now()) {
                agent.stopwatch.miss(1);
            }
        }
        if now - asked.max(answered) > ALIVE_POLL {
            asked = now;
            if run.life_is_over(agent.id) {
                return Err(Abandoned::LeftOut { run: run.name().clone(), id: agent.id }.into());
            }
            if !arena.is_alive() {
                return Err(Abandoned::ArenaDied { run: run.name().clone(), id: agent.id }.into());
            }
        }
    }
}
