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

/// Says what does not hold of a run that is over, each in a line: it should end, with every robot and packet accounted for, and
/// with what its controllers state.
pub(crate) fn at_end(summary: &Summary) -> Result<(), String> {
    let ended = match summary.ended {
        Ending::Finished | Ending::Converged => None,
        Ending::Interrupted => Some("the run was interrupted".into()),
        Ending::Failed => {
            Some(summary.failure.clone().unwrap_or_else(|| "the run failed, nobody knows why".into()))
        }
    };
    let died = summary.incidents.first().filter(|incident| ended.as_ref() != Some(&incident.what));
    let died = died.map(|incident| format!("tick {}: {}", incident.tick, incident.what));
    let refused = summary.commands_refused;
    let refused = (refused > 0).then(|| format!("commands that were refused: {refused}"));
    let broken = summary.properties.broken().map(summary_text::broken);
    let uncounted = summary.end.packets.check().err();
    let all = ended.into_iter().chain(died).chain(refused).chain(broken).chain(uncounted);
    let all: Vec<String> = all.collect();
    if all.is_empty() { Ok(()) } else { Err(all.join("\n  and ")) }
}
