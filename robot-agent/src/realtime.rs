//! Real time: wake up on the robot's own timer and answer what has come.

use std::{
    thread,
    time::{Duration, Instant},
};

use anyhow::Context;
use protocol::{
    doorbell::Doorbell,
    run_dir::{ArenaWatch, RunDir},
    units::Seconds,
};

use crate::{Abandoned, agent::Agent};

/// Silence after which an agent asks whether its arena still lives.
const ALIVE_POLL: Duration = Duration::from_millis(250);
/// Silence after which it understands that it has been left out.
const LEFT_OUT: Duration = Duration::from_secs(10);
/// After a gap like this, which no nap explains, it was itself away, stopped perhaps.
const AWAY: Duration = Duration::from_secs(1);
/// Longest nap, so that the end of the run is noticed.
const NAP: Duration = Duration::from_millis(250);

pub(crate) fn run(
    agent: &mut Agent,
    bell: &Doorbell,
    run: &RunDir,
    arena: &ArenaWatch,
    cycle: Seconds,
) -> anyhow::Result<()> {
    let period =
        Duration::try_from_secs_f64(cycle.get()).context("the run's neighbor cycle is no duration")?;
    agent.announce()?;
    bell.answer();
    let (mut deadline, mut answered, mut asked) = (Instant::now(), Instant::now(), Instant::now());
    // Percepts begin when everyone is there; until then silence means nothing.
    let mut begun = false;
    let mut looked = Instant::now();
    while !bell.is_closed() {
        let now = Instant::now();
        if now - looked > AWAY {
            // Nobody could have answered in that time.
            answered = now;
        }
        looked = now;
        if now >= deadline {
            let late = now - deadline;
            agent.stopwatch.woke_late(late, periods_in(late, period));
            // A missed deadline is not made up for: there is one newest percept, and one answer to it.
            deadline = (deadline + period).max(now);
            if agent.answer(run)? {
                (answered, begun) = (now, true);
            } else if begun && now - answered > LEFT_OUT.max(period * 10) {
                return Err(Abandoned::LeftOut { run: run.name().clone(), id: agent.id }.into());
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
        thread::sleep(deadline.saturating_duration_since(Instant::now()).min(NAP));
    }
    Ok(())
}

/// Whole periods in `late`, each of which is a deadline that was missed.
fn periods_in(late: Duration, period: Duration) -> u32 {
    let periods = late.as_nanos() / period.as_nanos().max(1);
    u32::try_from(periods).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_timer_has_missed_only_whole_periods() {
        let ms = Duration::from_millis;
        let cases = [(0, 0), (99, 0), (100, 1), (250, 2)];
        for (late, missed) in cases {
            assert_eq!(periods_in(ms(late), ms(100)), missed, "{late} ms late");
        }
        assert_eq!(periods_in(Duration::MAX, Duration::ZERO), u32::MAX);
    }
}
