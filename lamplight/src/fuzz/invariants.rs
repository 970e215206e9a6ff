//! Invariants that must hold in every run, whatever goes wrong in it.

use arena::{Arena, metrics::Partition};
use arena_daemon::summary::{Ending, Summary};
use coverage::{moments::Moments, polygon::Polygon};
use protocol::command::Answer;
use scenario::Scenario;

/// How far rounding may put a body into a wall, meters.
const SLACK_M: f64 = 1e-9;

/// Looks at one run while it goes on.
#[derive(Debug)]
pub(crate) struct Watcher {
    size_m: [f64; 2],
    radius_m: f64,
    /// Ticks between two looks at the cells: a second of virtual time.
    cells_every: u64,
    last_tick: u64,
}

impl Watcher {
    pub(crate) fn of(scenario: &Scenario) -> Self {
        Self {
            size_m: scenario.arena.size_m.get(),
            radius_m: scenario.robots.radius_m.get(),
            cells_every: scenario.tick_at(1.0).max(1),
            last_tick: scenario.ticks(),
        }
    }

    /// Is everybody inside, and is every robot that takes part responsible for some ground?
    pub(crate) fn look(&self, arena: &Arena, answers: &[Option<Answer>]) -> Result<(), String> {
        let tick = arena.current_tick();
        let inside = |along: f64, side: f64| {
            (self.radius_m - SLACK_M..=side - self.radius_m + SLACK_M).contains(&along)
        };
        for (robot, pose) in arena.poses().iter().enumerate() {
            let ([width, height], position) = (self.size_m, pose.position);
            // No NaN is inside of anything.
            if !(inside(position.x, width) && inside(position.y, height) && pose.heading.is_finite()) {
                return Err(format!(
                    "robot {robot} is at [{}, {}], heading {}, at tick {tick}: not inside the arena of \
                     {width} m x {height} m",
                    position.x, position.y, pose.heading
                ));
            }
        }
        if tick.is_multiple_of(self.cells_every) || tick == self.last_tick {
            self.cells(arena, answers).map_err(|robot| {
                format!("the cell of robot {robot}, which takes part, is empty at tick {tick}")
            })?;
        }
        Ok(())
    }

    /// The first robot with an empty cell is the error.
    fn cells(&self, arena: &Arena, answers: &[Option<Answer>]) -> Result<(), usize> {
        let alive: Vec<usize> = (0..answers.len()).filter(|&robot| answers[robot].is_some()).collect();
        let sites = alive.iter().map(|&robot| arena.poses()[robot].position).collect();
        let partition = Partition::new(sites, self.size_m);
        let mut cells = alive.iter().zip(partition.cells());
        cells.find(|(_, cell)| !has_ground(cell)).map_or(Ok(()), |(&robot, _)| Err(robot))
    }
}

fn has_ground(cell: &Polygon) -> bool {
    cell.first().is_some_and(|&about| Moments::of(cell, about).area > 0.0)
}

/// Did the run end as it should, with every packet accounted for?
pub(crate) fn at_end(summary: &Summary) -> Result<(), String> {
    match summary.ended {
        Ending::Finished | Ending::Converged => {}
        Ending::Interrupted => return Err("the run was interrupted".into()),
        Ending::Failed => {
            return Err(summary.failure.clone().unwrap_or_else(|| "the run failed, nobody knows why".into()));
        }
    }
    summary.end.packets.check()
}
