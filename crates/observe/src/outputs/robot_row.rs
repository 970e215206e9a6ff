//! One row of `robots.csv`, but for the columns of what was measured.

use arena::frame::Pose;
use engine::RobotStatus;
use protocol::command::Answer;
use serde::Serialize;

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
}

impl RobotRow {
    pub(super) fn new(robot: &RobotStatus, answer: Option<&Answer>, pose: &Pose, heard: u64) -> Self {
        Self {
            robot: robot.id.index,
            incarnation: robot.id.incarnation,
            alive: robot.is_alive(),
            paused: robot.is_paused(),
            x_m: pose.position.x,
            y_m: pose.position.y,
            heading_rad: pose.heading,
            error_m: answer.and_then(|answer| Some(answer.command.estimated_error?.length())),
            packets_heard: heard,
            commands_refused: robot.refused,
            pid: robot.pid,
        }
    }
}
