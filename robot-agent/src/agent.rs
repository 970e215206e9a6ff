//! A controller with its ports: percepts in, commands out.

use coverage::Controller;
use protocol::{
    percept::Percept,
    raw::{BOOT_TICK, PerceptError, RawCommand},
    robot_id::RobotId,
    services::{AgentPorts, ServiceError},
    setup::ControllerSetup,
};

/// One robot's mind and its line to the world.
#[derive(Debug)]
pub(crate) struct Agent {
    pub(crate) id: RobotId,
    controller: Controller,
    ports: AgentPorts,
    percept: Percept,
    pid: u32,
}

impl Agent {
    pub(crate) fn new(id: RobotId, setup: ControllerSetup, ports: AgentPorts) -> Self {
        let controller = Controller::new(id, setup);
        Self { id, controller, ports, percept: Percept::empty(0), pid: std::process::id() }
    }

    /// Says that this robot is there.
    pub(crate) fn announce(&mut self) -> Result<(), ServiceError> {
        self.ports.send(RawCommand::new(BOOT_TICK, &self.controller.boot(), self.pid))
    }

    /// Answers the newest percept that waits. Returns whether there was one.
    pub(crate) fn answer(&mut self) -> Result<bool, ServiceError> {
        if !self.receive()? {
            return Ok(false);
        }
        let command = self.controller.step(&self.percept);
        self.ports.send(RawCommand::new(self.percept.tick, &command, self.pid))?;
        Ok(true)
    }

    /// Reads every percept that waits; the last one that makes sense stays.
    fn receive(&mut self) -> Result<bool, ServiceError> {
        let mut received = false;
        loop {
            let percept = &mut self.percept;
            let read: Option<Result<u32, PerceptError>> =
                self.ports.receive(|header, deliveries| header.read(deliveries, percept))?;
            match read {
                None => return Ok(received),
                Some(Ok(0)) => received = true,
                Some(Ok(refused)) => {
                    received = true;
                    tracing::debug!("tick {}: {refused} packets did not decode", self.percept.tick);
                }
                Some(Err(error)) => tracing::warn!("{}: percept refused: {error}", self.id),
            }
        }
    }
}
