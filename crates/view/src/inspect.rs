//! All that is known of one robot.

use std::fmt::Write;

use protocol::percept::Percept;

use crate::{
    picture::area,
    swarm::Swarm,
    tell,
    wire::{Bin, CellOf, CommandOf, CyclesOf, NeighborOf, Note, PoseOf, Robot},
};

/// Robot `robot`; `None` if there is no such one, or it is nowhere yet. `names` are those of the controllers.
pub(crate) fn robot<'a>(swarm: &'a Swarm, names: &'a [String], robot: u32) -> Option<Robot<'a>> {
    let at = robot as usize;
    let &[x_m, y_m, heading_rad] = swarm.poses.get(at)?;
    let has_percepts = !swarm.percepts.is_empty();
    let pictures = swarm.pictures();
    let cell = pictures.cells.get(at).filter(|cell| has_percepts && cell.len() >= 3).map(|cell| CellOf {
        area_m2: area(cell),
        positive_area_m2: area(&pictures.positive[at]),
        centroid_m: pictures.centroids[at],
    });
    let percept = swarm.percepts.get(at);
    let answer = swarm.answers.get(at).and_then(Option::as_ref);
    let notes = swarm.notes.get(&robot).into_iter().flatten();
    Some(Robot {
        agent: tell::agent(swarm, names, robot),
        pose: PoseOf { x_m, y_m, heading_rad },
        light: percept.map(|percept| percept.light.value),
        bump: percept.is_some_and(|percept| percept.bump),
        command: answer.map(|answer| CommandOf {
            velocity_m_per_s: [answer.command.velocity.0.x, answer.command.velocity.0.y],
            estimated_error_m: answer.command.estimated_error.map(|error| error.length()),
            payload_hex: hex(&answer.command.payload),
        }),
        neighbors: percept.map_or(Vec::new(), |percept| neighbors(swarm, robot, percept)),
        cell,
        notes: notes.map(|(name, value)| Note { name, value: *value }).collect(),
        cycles: cycles(swarm, at),
    })
}

/// Cycles up to these times are counted together, microseconds.
const BINS_US: [f64; 14] =
    [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, f64::MAX];

fn cycles(swarm: &Swarm, robot: usize) -> Option<CyclesOf> {
    let told = swarm.snapshot.as_ref()?.robots.get(robot)?.cycles?;
    let seen = swarm.cycles_us.get(robot)?;
    let bin = |(at, &up_to_us): (usize, &f64)| {
        let from_us = at.checked_sub(1).map_or(0.0, |before| BINS_US[before]);
        let count = seen.iter().filter(|&&us| from_us < us && us <= up_to_us).count() as u32;
        Bin { up_to_us, count }
    };
    let histogram = BINS_US.iter().enumerate().map(bin).collect();
    Some(CyclesOf { last_us: told.last_us, p99_us: told.p99_us, histogram })
}

/// Neighbors that the robot's controller remembers; where that is not of the paper, those of its last percept.
fn neighbors(swarm: &Swarm, robot: u32, percept: &Percept) -> Vec<NeighborOf> {
    let ticks_per_cycle = (swarm.scenario.cycle_s() / swarm.scenario.step_s.get()).round().max(1.0) as u64;
    let told = |delivery: &protocol::percept::Delivery, age_ticks: u64, payload: Option<&[u8]>| NeighborOf {
        robot: delivery.packet.sender().index,
        range_m: delivery.range.get(),
        bearing_rad: delivery.bearing.get(),
        orientation_rad: delivery.orientation.get(),
        age_cycles: age_ticks / ticks_per_cycle,
        payload_hex: payload.map(hex).unwrap_or_default(),
    };
    let heard_now = |sender| {
        let heard = percept.deliveries.iter().find(|heard| heard.packet.sender() == sender)?;
        Some(percept.payload(heard))
    };
    match swarm.mind(robot) {
        Some(mind) => (mind.neighbors().iter())
            .map(|neighbor| {
                let payload = heard_now(neighbor.delivery.packet.sender());
                told(&neighbor.delivery, percept.tick.saturating_sub(neighbor.heard), payload)
            })
            .collect(),
        None => percept.deliveries.iter().map(|heard| told(heard, 0, Some(percept.payload(heard)))).collect(),
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
