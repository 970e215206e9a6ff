//! A controller with its ports: percepts in, commands out.

use std::mem;

use anyhow::Context;
use protocol::{
    codec,
    command::{Answer, Transmitter},
    controller::Controller,
    notes::Notes,
    packet::Frame,
    params::Params,
    percept::{Percept, Tick},
    property::Properties,
    robot_id::RobotId,
    setup::AgentSetup,
};
use transport::{
    ends::{AgentEnd, ServiceError},
    pid_namespace::our_pid_in,
    raw::{BOOT_TICK, RawCommand, RawTimes},
    run_dir::RunDir,
    services::AgentPorts,
};

use crate::{refusal::Refusal, stopwatch::Stopwatch};

/// Reads the setup of a robot's agent.
pub(crate) fn setup_of(run: &RunDir, id: RobotId) -> anyhow::Result<AgentSetup> {
    let setup = run.setup_of(id.index).context("cannot read the run's setup")?;
    Ok(codec::decode(&setup)?)
}

/// Properties that a run is told of as soon as the controller of `id` states them.
fn told_to(run: &RunDir, id: RobotId) -> Properties {
    let run = run.clone();
    Properties::telling(move |properties| {
        if let Err(error) = run.tell_properties(id, properties) {
            tracing::warn!("what the controller states cannot be told: {error}");
        }
    })
}

/// One robot's controller with its ports.
#[derive(Debug)]
pub(crate) struct Agent<C, N> {
    pub(crate) id: RobotId,
    pub(crate) stopwatch: Stopwatch,
    controller: C,
    transmitter: Transmitter,
    notes: Notes,
    properties: Properties,
    new: N,
    // It has room for far more than it mostly holds. Made where it stays, and not moved there, it takes the memory that
    // it uses and no more.
    percept: Box<Percept>,
    ports: AgentPorts,
    /// Whether the percept waits for an answer.
    waits: bool,
    /// Name of the controller in messages.
    program: Box<str>,
    /// The number of this process where the arena is; 0 if it has none there.
    pid: u32,
}

impl<C: Controller, N: Fn(RobotId, &Params) -> anyhow::Result<C>> Agent<C, N> {
    pub(crate) fn new(
        id: RobotId,
        program: &str,
        run: &RunDir,
        setup: &AgentSetup,
        ports: AgentPorts,
        new: N,
    ) -> anyhow::Result<Self> {
        let mut properties = told_to(run, id);
        let controller = properties.during(None, || new(id, &setup.params))?;
        let (stopwatch, percept) = (Stopwatch::new(), Box::new(Percept::empty(0)));
        Ok(Self {
            id,
            stopwatch,
            controller,
            transmitter: Transmitter::new(id),
            notes: Notes::default(),
            properties,
            new,
            ports,
            percept,
            waits: false,
            pid: our_pid_in(setup.pid_namespace),
            program: program.into(),
        })
    }

    /// Says that this robot is there, and the names of its notes.
    pub(crate) fn announce(&mut self, run: &RunDir) -> anyhow::Result<()> {
        let Self { controller, transmitter, properties, .. } = self;
        let (command, notes) = properties.during(None, || (controller.boot(), Notes::of(controller)));
        let answer = transmitter.answer(command);
        self.notes = notes.map_err(|reason| Refusal::new(self.id, &self.program, "cannot begin", reason))?;
        if !self.notes.names().is_empty() {
            run.tell_note_names(self.id, self.notes.names()).context("cannot tell the names of notes")?;
        }
        Ok(self.send(BOOT_TICK, &answer, RawTimes::default())?)
    }

    /// Sends the answer to `tick`.
    #[inline]
    fn send(&mut self, tick: Tick, answer: &Answer, times: RawTimes) -> Result<(), ServiceError> {
        let mut frame = Frame::new();
        answer.packet().encode_to(&mut frame);
        self.ports.send(
            RawCommand::new(tick, answer, &frame, self.pid).timed(times, self.stopwatch.missed()),
            &frame,
            self.notes.values(),
        )
    }

    /// Answers the newest percept that waits. Returns whether there was one. Asked to boot, it begins anew
    /// with what the agents of the run are told by now.
    pub(crate) fn answer(&mut self, run: &RunDir) -> anyhow::Result<bool> {
        self.receive(|_| ())?;
        if !mem::take(&mut self.waits) {
            return Ok(false);
        }
        if self.percept.tick == BOOT_TICK {
            tracing::debug!("begins anew");
            self.begin_anew(run)?;
            self.announce(run)?;
            self.stopwatch.booted();
            return Ok(true);
        }
        self.stopwatch.received();
        let answer = self.step();
        self.stopwatch.stepped();
        self.send(self.percept.tick, &answer, self.stopwatch.times())?;
        self.stopwatch.published();
        tracing::trace!(deliveries = self.percept.deliveries.len(), "has answered");
        Ok(true)
    }

    #[inline]
    fn step(&mut self) -> Answer {
        let Self { controller, percept, stopwatch, notes, properties, .. } = self;
        let command = properties.during(Some(percept.tick), || {
            let command = controller.step(percept, stopwatch);
            notes.update(controller);
            command
        });
        self.transmitter.answer(command)
    }

    /// Forgets everything. A frame of its own: a controller on the stack would push that of each cycle onto fresh pages.
    #[inline(never)]
    fn begin_anew(&mut self, run: &RunDir) -> anyhow::Result<()> {
        let params = setup_of(run, self.id)?.params;
        self.properties = told_to(run, self.id);
        let Self { new, id, properties, .. } = self;
        self.controller = properties.during(None, || new(*id, &params))?;
        self.transmitter = Transmitter::new(self.id);
        Ok(())
    }

    /// Takes in what has come between two cycles, so that what is heard is known even if another percept comes
    /// before the next cycle, which will be the one to be answered.
    pub(crate) fn listen(&mut self) -> Result<(), ServiceError> {
        self.receive(|agent| {
            agent.controller.hear(&agent.percept);
            agent.stopwatch.heard();
        })
    }

    /// Reads every percept that is unread; the last one that makes sense waits for an answer.
    fn receive(&mut self, take_in: impl Fn(&mut Self)) -> Result<(), ServiceError> {
        loop {
            match self.ports.receive(&mut self.percept)? {
                None => return Ok(()),
                Some(Ok(refused)) => {
                    self.waits = true;
                    logging::at_tick(self.percept.tick);
                    if refused > 0 {
                        tracing::debug!(refused, "packets did not decode");
                    }
                    take_in(self);
                }
                Some(Err(error)) => tracing::warn!("percept refused: {error}"),
            }
        }
    }
}
