//! One row of `robots.csv`. `csv` writes no flattened structures, so all columns are spelled out.

use arena::frame::Pose;
use protocol::command::Answer;
use serde::Serialize;

use crate::{profile::Columns, squad::RobotStatus};

#[derive(Serialize)]
pub(super) struct RobotRow {
    robot: u32,
    incarnation: u16,
    alive: bool,
    paused: bool,
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
    error_m: Option<f64>,
    packets_heard: u64,
    commands_refused: u64,
    pid: Option<u32>,
    cycle_p50_us: Option<f64>,
    cycle_p99_us: Option<f64>,
    cycle_max_us: Option<f64>,
    wake_p50_us: Option<f64>,
    wake_p99_us: Option<f64>,
    receive_p50_us: Option<f64>,
    neighbors_p50_us: Option<f64>,
    cell_p50_us: Option<f64>,
    truncation_p50_us: Option<f64>,
    centroid_p50_us: Option<f64>,
    publish_p50_us: Option<f64>,
    packet_p50_us: Option<f64>,
    packet_p99_us: Option<f64>,
    missed_deadlines: Option<u64>,
    cycles_per_tick: Option<f64>,
    instructions: Option<u64>,
    core_cycles: Option<u64>,
    cpu_ms: Option<f64>,
    switches_voluntary: Option<u64>,
    switches_involuntary: Option<u64>,
    faults_minor: Option<u64>,
    faults_major: Option<u64>,
    rss_kb: Option<u64>,
    pss_kb: Option<u64>,
}

impl RobotRow {
    pub(super) fn new(
        standing: &RobotStatus,
        answer: Option<&Answer>,
        pose: &Pose,
        heard: u64,
        columns: &Columns,
    ) -> Self {
        Self {
            robot: standing.id.index,
            incarnation: standing.id.incarnation,
            alive: standing.alive,
            paused: standing.paused,
            x_m: pose.position.x,
            y_m: pose.position.y,
            heading_rad: pose.heading,
            error_m: answer.and_then(|answer| Some(answer.command.estimated_error?.length())),
            packets_heard: heard,
            commands_refused: standing.refused,
            pid: standing.pid,
            cycle_p50_us: columns.cycle_p50_us,
            cycle_p99_us: columns.cycle_p99_us,
            cycle_max_us: columns.cycle_max_us,
            wake_p50_us: columns.wake_p50_us,
            wake_p99_us: columns.wake_p99_us,
            receive_p50_us: columns.receive_p50_us,
            neighbors_p50_us: columns.neighbors_p50_us,
            cell_p50_us: columns.cell_p50_us,
            truncation_p50_us: columns.truncation_p50_us,
            centroid_p50_us: columns.centroid_p50_us,
            publish_p50_us: columns.publish_p50_us,
            packet_p50_us: columns.packet_p50_us,
            packet_p99_us: columns.packet_p99_us,
            missed_deadlines: columns.missed_deadlines,
            cycles_per_tick: columns.cycles_per_tick,
            instructions: columns.instructions,
            core_cycles: columns.core_cycles,
            cpu_ms: columns.cpu_ms,
            switches_voluntary: columns.switches_voluntary,
            switches_involuntary: columns.switches_involuntary,
            faults_minor: columns.faults_minor,
            faults_major: columns.faults_major,
            rss_kb: columns.rss_kb,
            pss_kb: columns.pss_kb,
        }
    }
}
