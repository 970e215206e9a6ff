//! All that is known of one robot.

use std::fmt::Write;

use protocol::percept::Percept;

use crate::{
    picture::area,
    swarm::Swarm,
    tell,
    wire::{CellOf, CommandOf, NeighborOf, Note, PoseOf, Robot},
};

/// Robot `robot`; `None` if there is no such one, or it is nowhere yet. `names` are those of the controllers.
pub(crate) fn robot<'a>(swarm: &'a mut Swarm, names: &'a [String], robot: u32) -> Option<Robot<'a>> {
    let at = robot as usize;
    let &[x_m, y_m, heading_rad] = swarm.poses.get(at)?;
    let has_percepts = !swarm.percepts.is_empty();
    let cell = has_percepts.then(|| {
        let pictures = swarm.pictures();
        let cell = &pictures.cells[at];
        (cell.len() >= 3).then(|| CellOf {
            area_m2: area(cell),
            positive_area_m2: area(&pictures.positive[at]),
            centroid_m: pictures.centroids[at],
        })
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
        cell: cell.flatten(),
        notes: notes.map(|(name, value)| Note { name, value: *value }).collect(),
    })
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
        None => {
            percept.deliveries.iter().map(|heard| told(heard, 0, Some(percept.payload(heard)))).collect()
        }
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
