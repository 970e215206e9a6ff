//! What an observer measures: errors, coverage cost, local against global cells.

use coverage::{
    moments::Moments,
    polygon::Polygon,
    quadrature::integrate,
    sensory_field::{length_scale, value},
};
use nalgebra::Vector2;
use protocol::{command::Command, percept::Percept};
use serde::{Deserialize, Serialize};

use crate::{
    field::Field,
    frame::{ArenaPoint, Pose},
    voronoi::{cell_in_arena, delaunay_neighbors},
};

/// A local and a global cell are the same if their areas agree to this share.
const SAME_CELL: f64 = 1e-9;

/// Packets since the start of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Packets {
    /// Packets transmitted.
    pub sent: u64,
    /// Receptions: one packet heard by eight robots counts eight times.
    pub heard: u64,
    /// Receptions destroyed by another packet in the air.
    pub collided: u64,
    /// Packet and listener pairs out of range (or not Voronoi neighbors).
    pub lost_range: u64,
    /// Receptions lost by chance.
    pub lost_loss: u64,
    /// Receptions lost to a planned fault.
    pub lost_fault: u64,
    /// Receptions beyond what one percept holds; the nearest senders were kept.
    pub over_bound: u64,
}

/// The state of a swarm as an observer sees it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Mean ‖ê‖ over the robots alive, meters, as they estimate it.
    pub mean_error_m: f64,
    /// Largest ‖ê‖.
    pub max_error_m: f64,
    /// Mean ‖C − p‖ with the true centroid of the global cell.
    pub mean_true_error_m: f64,
    /// Coverage cost H (eq. 1 with f(x) = x²/2) of the robots alive.
    pub cost_h: f64,
    /// Share of robots alive whose local cell, from the packets heard in this tick and cut to the
    /// arena, is the global one.
    pub cell_agreement: f64,
    /// Mean distance of robots alive to the middle of the lamps, if there are lamps.
    pub mean_lamp_distance_m: Option<f64>,
    /// Robots whose agent answered this tick.
    pub robots_alive: u32,
    /// Packets since the start.
    pub packets: Packets,
}

/// Mean and largest ‖ê‖ among the robots that answered; zero if none did.
pub fn estimated_errors(commands: &[Option<Command>]) -> (f64, f64) {
    let errors = commands.iter().flatten().map(|command| command.goal.length());
    let (count, sum, max) = errors
        .fold((0_u32, 0.0, 0.0_f64), |(count, sum, max), error| (count + 1, sum + error, max.max(error)));
    (if count > 0 { sum / f64::from(count) } else { 0.0 }, max)
}

/// The global cells of some robots, relative to each in the arena's axes.
#[derive(Clone, Debug)]
pub struct Partition {
    sites: Vec<ArenaPoint>,
    cells: Vec<Polygon>,
}

impl Partition {
    /// The Voronoi partition of the arena by `sites`.
    pub fn new(sites: Vec<ArenaPoint>, size_m: [f64; 2]) -> Self {
        let neighbors = delaunay_neighbors(&sites);
        let cells = sites
            .iter()
            .zip(neighbors)
            .map(|(&site, near)| cell_in_arena(site, near.into_iter().map(|other| sites[other]), size_m))
            .collect();
        Self { sites, cells }
    }

    /// The cells, in the order of the sites.
    pub fn cells(&self) -> &[Polygon] {
        &self.cells
    }

    /// Coverage cost H = Σ ∫ ½‖q − p‖² φ(q) dq (eq. 1) and mean ‖C − p‖ with true centroids.
    /// Relative accuracy 1e-10, see [`coverage::quadrature`]. A cell without mass is at its goal.
    pub fn cost_and_true_error(&self, field: &Field) -> (f64, f64) {
        let (mut cost, mut error) = (0.0, 0.0);
        for (&site, cell) in self.sites.iter().zip(&self.cells) {
            let seen = field.seen_from(&Pose::unturned(site));
            let [mass, x, y, inertia] = integrate(cell, length_scale(&seen) / 2.0, |q| {
                let phi = value(&seen, q);
                [phi, phi * q.x, phi * q.y, phi * q.norm_squared() / 2.0]
            });
            cost += inertia;
            error += if mass > 0.0 { Vector2::new(x, y).norm() / mass } else { 0.0 };
        }
        (cost, error / self.sites.len().max(1) as f64)
    }

    /// Share of sites whose local cell equals the global one, both cut to the arena. `percepts`
    /// are those of the sites, in their order; `headings` turn what they heard to the arena's axes.
    pub fn agreement<'a>(
        &self,
        heard: impl Iterator<Item = (&'a Pose, &'a Percept)>,
        size_m: [f64; 2],
    ) -> f64 {
        let agree = heard
            .zip(&self.cells)
            .filter(|((pose, percept), global)| {
                let others = percept.deliveries.iter().map(|delivery| {
                    let away = protocol::frame::BodyVector::polar(delivery.range, delivery.bearing);
                    pose.position + pose.outward(away)
                });
                let local = cell_in_arena(pose.position, others, size_m);
                let global = area(global);
                (area(&local) - global).abs() <= SAME_CELL * global
            })
            .count();
        agree as f64 / self.sites.len().max(1) as f64
    }
}

/// Mean distance of `positions` to the middle of `lamps`; `None` without lamps or robots.
pub fn mean_lamp_distance(positions: &[ArenaPoint], lamps: &[ArenaPoint]) -> Option<f64> {
    if lamps.is_empty() || positions.is_empty() {
        return None;
    }
    let middle = lamps.iter().sum::<ArenaPoint>() / lamps.len() as f64;
    Some(positions.iter().map(|position| (position - middle).norm()).sum::<f64>() / positions.len() as f64)
}

fn area(cell: &Polygon) -> f64 {
    cell.first().map_or(0.0, |&about| Moments::of(cell, about).area)
}
