//! Invariants that must hold in every run, whatever goes wrong in it.

use arena::metrics::Partition;
use coverage::{moments::Moments, polygon::Polygon};
use engine::{
    Observer, ObserverError, TickView,
    summary::{Ending, Summary},
};
use scenario::Scenario;

use crate::summary_text;

/// How far rounding may put a body into a wall, meters.
const SLACK_M: f64 = 1e-9;

/// Invariants of every tick of one run; it ends where one does not hold.
#[derive(Debug)]
pub(crate) struct Invariants {
    size_m: [f64; 2],
    radius_m: f64,
    /// Ticks between two looks at the cells: a second of virtual time.
    cells_every: u64,
}

impl Invariants {
    pub(crate) fn of(scenario: &Scenario) -> Self {
        Self {
            size_m: scenario.arena.size_m.get(),
            radius_m: scenario.robots.radius_m.get(),
            cells_every: scenario.tick_at(1.0).max(1),
        }
    }

    /// Is everybody inside?
    fn places(&self, view: &TickView<'_>) -> Result<(), String> {
        let inside = |along: f64, side: f64| {
            (self.radius_m - SLACK_M..=side - self.radius_m + SLACK_M).contains(&along)
        };
        for (robot, pose) in view.poses().iter().enumerate() {
            let ([width, height], position) = (self.size_m, pose.position);
            // No NaN is inside of anything.
            if !(inside(position.x, width) && inside(position.y, height) && pose.heading.is_finite()) {
                return Err(format!(
                    "robot {robot} is at [{}, {}], heading {}, at tick {}: not inside the arena of {width} m x \
                     {height} m",
                    position.x,
                    position.y,
                    pose.heading,
                    view.tick()
                ));
            }
        }
        Ok(())
    }

    /// Is every robot that takes part responsible for some ground?
    fn cells(&self, view: &TickView<'_>) -> Result<(), String> {
        let answers = view.answers();
        let alive: Vec<usize> = (0..answers.len()).filter(|&robot| answers[robot].is_some()).collect();
        let sites = alive.iter().map(|&robot| view.poses()[robot].position).collect();
        let partition = Partition::new(sites, self.size_m);
        let mut cells = alive.iter().zip(partition.cells());
        cells.find(|(_, cell)| !has_ground(cell)).map_or(Ok(()), |(robot, _)| {
            Err(format!("the cell of robot {robot}, which takes part, is empty at tick {}", view.tick()))
        })
    }
}

impl Observer for Invariants {
    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        let cells = || if tick.is_due(self.cells_every) { self.cells(tick) } else { Ok(()) };
        self.places(tick).and_then(|()| cells()).map_err(ObserverError::Objection)
    }
}

fn has_ground(cell: &Polygon) -> bool {
    cell.first().is_some_and(|&about| Moments::of(cell, about).area > 0.0)
}

/// Did the run end as it should, with every robot and packet accounted for, and what its controllers state?
pub(crate) fn at_end(summary: &Summary) -> Result<(), String> {
    match summary.ended {
        Ending::Finished | Ending::Converged => {}
        Ending::Interrupted => return Err("the run was interrupted".into()),
        Ending::Failed => {
            return Err(summary.failure.clone().unwrap_or_else(|| "the run failed, nobody knows why".into()));
        }
    }
    if let Some(incident) = summary.incidents.first() {
        return Err(format!("tick {}: {}", incident.tick, incident.what));
    }
    if summary.commands_refused > 0 {
        return Err(format!("{} commands were refused", summary.commands_refused));
    }
    if let Some(broken) = summary.properties.broken().next() {
        return Err(summary_text::broken(broken));
    }
    summary.end.packets.check()
}
