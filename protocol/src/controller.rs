//! The trait of a robot's controller: percepts in, commands out.
//!
//! A controller knows what its percepts say and nothing else: no clock, no pose, no number of robots. Whoever has
//! one of these has a robot: the crate `robot-agent` makes a process of it.
//!
//! ```
//! use protocol::{
//!     command::Command,
//!     controller::{Controller, StageObserver},
//!     frame::BodyVector,
//!     percept::{Percept, Stimulus},
//! };
//!
//! /// Drives towards the light.
//! struct Phototaxis;
//!
//! impl Controller for Phototaxis {
//!     fn boot(&mut self) -> Command {
//!         Command::REST
//!     }
//!
//!     fn step(&mut self, percept: &Percept, _: &mut dyn StageObserver) -> Command {
//!         let velocity = match percept.light.stimulus {
//!             Stimulus::Gradient(gradient) => gradient.capped(0.1),
//!             Stimulus::Bearing(bearing) => BodyVector::new(0.1, 0.0).turned(bearing.get()),
//!             Stimulus::None => BodyVector::HERE,
//!         };
//!         Command { velocity, ..Command::REST }
//!     }
//! }
//!
//! assert_eq!(Phototaxis.step(&Percept::empty(0), &mut ()), Command::REST, "it is dark");
//! ```

use alloc::boxed::Box;

use crate::{
    command::{Answer, Command, Transmitter},
    percept::Percept,
    robot_id::RobotId,
};

/// The controller of one robot.
///
/// Determinism is its own: the same percepts must give the same commands, or runs cannot be repeated.
pub trait Controller {
    /// Returns the first command, before anything was sensed: usually to stand still and be heard.
    fn boot(&mut self) -> Command;

    /// Takes in what was heard in a percept that will not be answered, because a newer one has come: in real time
    /// only. The same percept may come more than once, and to [`step`](Controller::step) after it.
    fn hear(&mut self, percept: &Percept) {
        let _ = percept;
    }

    /// Plays one neighbor cycle: percept in, command out. `stages` may be told where time goes; it changes nothing.
    fn step(&mut self, percept: &Percept, stages: &mut dyn StageObserver) -> Command;

    /// Tells `note` numbers for those who watch, each with its name; a flag is 0 or 1. Asked after
    /// [`boot`](Controller::boot) and after each [`step`](Controller::step).
    ///
    /// They must be as many each time, at most [`NOTES_MAX`](crate::notes::NOTES_MAX), and in the same order: their names
    /// are those told at boot. They are in no packet and not in the digest. Without any, nobody asks again.
    #[inline]
    fn notes(&self, note: &mut dyn FnMut(&str, f64)) {
        let _ = note;
    }
}

impl<C: Controller + ?Sized> Controller for Box<C> {
    fn boot(&mut self) -> Command {
        (**self).boot()
    }

    fn hear(&mut self, percept: &Percept) {
        (**self).hear(percept);
    }

    fn step(&mut self, percept: &Percept, stages: &mut dyn StageObserver) -> Command {
        (**self).step(percept, stages)
    }

    fn notes(&self, note: &mut dyn FnMut(&str, f64)) {
        (**self).notes(note);
    }
}

/// A controller with what its host does for it: each command becomes an answer, with a packet in the robot's name.
#[derive(Clone, Debug)]
pub struct Hosted<C> {
    /// The controller.
    pub controller: C,
    transmitter: Transmitter,
}

impl<C: Controller> Hosted<C> {
    /// A life of robot `id` that begins, with a controller that has not booted.
    #[inline]
    pub fn new(id: RobotId, controller: C) -> Self {
        Self { controller, transmitter: Transmitter::new(id) }
    }

    /// Returns the first answer.
    pub fn boot(&mut self) -> Answer {
        self.transmitter.answer(self.controller.boot())
    }

    /// Plays one neighbor cycle.
    #[inline]
    pub fn step(&mut self, percept: &Percept, stages: &mut dyn StageObserver) -> Answer {
        self.transmitter.answer(self.controller.step(percept, stages))
    }
}

/// Parts of a control step, in their order. A controller without such parts passes none, and its profile shows
/// the whole step as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Deliveries are in the neighbor table.
    Neighbors,
    /// The local cell is cut, and closed where it was open.
    Cell,
    /// φ̂ is estimated and the cell is cut to V+, by the laws that do so.
    Truncation,
    /// Mass and centroid are integrated: the goal is known.
    Centroid,
}

impl Stage {
    /// All stages, in their order.
    pub const ALL: [Self; 4] = [Self::Neighbors, Self::Cell, Self::Truncation, Self::Centroid];
}

/// Receives the end of each stage of a control step: a controller knows no clock, but somebody outside may have one.
pub trait StageObserver {
    /// `stage` is over.
    fn passed(&mut self, stage: Stage);
}

/// Observes nothing, for free.
impl StageObserver for () {
    #[inline]
    fn passed(&mut self, _: Stage) {}
}
