//! Acts upon a run under way, by those who watch it.
//!
//! ```text
//! whoever acts --Act--> Acts (a queue) --> the loop, before its next tick --Done--> whoever acts
//! ```
//!
//! Holding a run and its speed change when ticks pass, and nothing of what happens in them. Whatever else is done becomes a
//! fault of the plan that begins, or ends, with the next tick: so a run with its acts is a scenario, which can be saved and
//! played again.

use std::sync::{
    Arc, Mutex, PoisonError,
    mpsc::{self, Receiver, Sender},
};

use protocol::percept::Tick;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Most acts that wait for a tick; one more is refused.
pub const ACTS_MAX: usize = 256;

/// An act upon a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Act {
    /// Let no more ticks pass.
    Pause,
    /// Let ticks pass again.
    Resume,
    /// Let so many ticks pass, and pause then.
    Step {
        /// How many; 1 or more.
        #[serde(default = "one")]
        ticks: u64,
    },
    /// Hold virtual time back to a multiple of real time.
    Speed {
        /// Virtual seconds per real second; without it as fast as the run can.
        factor: Option<f64>,
    },
    /// Begin a fault with the next tick.
    Begin {
        /// Its keys, as `[[fault]]` has them, but for when it begins.
        fault: Map<String, Value>,
    },
    /// End a fault with the next tick: who was killed is restarted, who was paused goes on.
    End {
        /// Its number in the plan, from 0.
        fault: usize,
    },
    /// Tell the scenario with everything that was done.
    Save,
}

/// Outcome of an act.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Done {
    /// The tick it takes effect at.
    pub tick: Tick,
    /// The number of the fault that it begins or ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<usize>,
    /// The scenario, if that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
}

/// Why an act is refused, in words for whoever acts.
pub type Refused = String;

/// Acts upon one run, from whichever threads.
#[derive(Clone, Debug, Default)]
pub struct Acts(Arc<Mutex<Queue>>);

#[derive(Debug, Default)]
struct Queue {
    waiting: Vec<Asked>,
    /// The run is over.
    is_closed: bool,
}

/// An act, and whom to tell what becomes of it.
#[derive(Debug)]
pub(crate) struct Asked {
    pub(crate) act: Act,
    pub(crate) reply: Sender<Result<Done, Refused>>,
}

fn one() -> u64 {
    1
}

impl Acts {
    /// Asks for an act. What becomes of it is told before the next tick; nothing is if the run has ended without it.
    pub fn ask(&self, act: Act) -> Receiver<Result<Done, Refused>> {
        let (reply, told) = mpsc::channel();
        let mut queue = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if queue.is_closed {
            let _ = reply.send(Err("the run is over".into()));
        } else if queue.waiting.len() == ACTS_MAX {
            let _ = reply.send(Err(format!("{ACTS_MAX} acts wait already")));
        } else {
            queue.waiting.push(Asked { act, reply });
        }
        told
    }

    /// Takes what waits.
    pub(crate) fn take(&self) -> Vec<Asked> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner).waiting)
    }

    /// The run is over: what waits is refused, and so is what comes.
    pub fn close(&self) {
        let mut queue = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        queue.is_closed = true;
        for asked in queue.waiting.drain(..) {
            let _ = asked.reply.send(Err("the run is over".into()));
        }
    }
}

/// When ticks may pass, by what was asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Hold {
    is_held: bool,
    /// Ticks that may pass though it is held.
    steps: u64,
}

impl Hold {
    pub(crate) fn pause(&mut self) {
        *self = Self { is_held: true, steps: 0 };
    }

    pub(crate) fn resume(&mut self) {
        *self = Self::default();
    }

    pub(crate) fn step(&mut self, ticks: u64) {
        *self = Self { is_held: true, steps: self.steps.saturating_add(ticks) };
    }

    /// Whether ticks are held back, but for steps.
    pub(crate) fn is_held(&self) -> bool {
        self.is_held
    }

    /// Whether the next tick has to wait.
    pub(crate) fn holds(&self) -> bool {
        self.is_held && self.steps == 0
    }

    /// A tick has passed.
    pub(crate) fn passed(&mut self) {
        self.steps = self.steps.saturating_sub(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn acts_are_read_as_they_are_written() {
        for (text, act) in [
            (r#"{"do":"pause"}"#, Act::Pause),
            (r#"{"do":"step"}"#, Act::Step { ticks: 1 }),
            (r#"{"do":"speed","factor":2.5}"#, Act::Speed { factor: Some(2.5) }),
            (r#"{"do":"speed","factor":null}"#, Act::Speed { factor: None }),
            (r#"{"do":"end","fault":3}"#, Act::End { fault: 3 }),
        ] {
            assert_eq!(serde_json::from_str::<Act>(text).unwrap(), act, "{text}");
        }
        assert!(serde_json::from_str::<Act>(r#"{"do":"stop"}"#).is_err());
        assert!(serde_json::from_str::<Act>(r#"{"do":"end"}"#).is_err());
    }

    #[test]
    fn what_comes_too_late_or_is_too_much_is_refused() {
        let acts = Acts::default();
        let told: Vec<_> = (0..=ACTS_MAX).map(|_| acts.ask(Act::Pause)).collect();
        assert!(told[ACTS_MAX].recv().unwrap().unwrap_err().contains("256"));
        assert_eq!(acts.take().len(), ACTS_MAX);
        let waiting = acts.ask(Act::Resume);
        acts.close();
        assert_eq!(waiting.recv().unwrap(), Err("the run is over".into()));
        assert_eq!(acts.ask(Act::Save).recv().unwrap(), Err("the run is over".into()));
    }

    #[test]
    fn a_held_run_lets_through_as_many_ticks_as_are_asked_for() {
        let mut hold = Hold::default();
        assert!(!hold.holds());
        hold.step(2);
        for _ in 0..2 {
            assert!(!hold.holds());
            hold.passed();
        }
        assert!(hold.holds());
        hold.resume();
        assert!(!hold.holds());
    }
}
