//! The line to the supervisor, if there is one: events out, orders in (see [`transport::control`]).

use std::{
    io::{self, BufRead, Write},
    sync::mpsc::{self, Receiver},
    thread,
};

use protocol::robot_id::RobotId;
use transport::control::{Event, Order};

use signal_hook::consts::SIGTERM;

use squad::stop::StopFlag;

/// A robot whose process the supervisor has seen end, and how.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lost {
    /// The robot, and its life.
    pub id: RobotId,
    /// The process; `None` if it could not be started.
    pub pid: Option<u32>,
    /// How it ended, or why it could not be started.
    pub how: String,
}

/// The arena's end of the line.
#[derive(Debug)]
pub struct Link {
    lost: Option<Receiver<Lost>>,
}

/// Scenarios of further trials that the supervisor wants played, as they come.
#[derive(Debug)]
pub struct Trials(Receiver<String>);

impl Trials {
    /// Waits for the next one; `None` once there will be no more.
    pub fn next(&self) -> Option<String> {
        self.0.recv().ok()
    }
}

impl Link {
    /// No supervisor: agents are started by hand.
    pub fn none() -> Self {
        Self { lost: None }
    }

    /// A supervisor at the other end of standard input and output. Its order to stop, or its
    /// death, raises `stop`.
    pub fn to_supervisor(stop: StopFlag) -> (Self, Trials) {
        let (sender, lost) = mpsc::channel();
        let (scheduler, trials) = mpsc::channel();
        thread::spawn(move || {
            let mut scheduler = Some(scheduler);
            for line in io::stdin().lock().lines().map_while(Result::ok) {
                match serde_json::from_str(&line) {
                    Ok(Order::Trial(scenario)) => {
                        scheduler.iter().for_each(|scheduler| drop(scheduler.send(scenario.clone())));
                    }
                    Ok(Order::Stop) => {
                        scheduler = None;
                        stop.raise(SIGTERM);
                    }
                    Ok(Order::Lost { id, pid, how }) => drop(sender.send(Lost { id, pid, how })),
                    Err(error) => {
                        tracing::warn!("the supervisor's order `{line}` is not understood: {error}")
                    }
                }
            }
            stop.raise(SIGTERM);
        });
        (Self { lost: Some(lost) }, Trials(trials))
    }

    /// Whether somebody starts and ends agents for us.
    pub fn is_supervised(&self) -> bool {
        self.lost.is_some()
    }

    /// Tells the supervisor. If it is gone, so is the reason to tell.
    pub fn tell(&self, event: &Event) {
        if self.is_supervised() {
            tell(event);
        }
    }

    /// Processes that have ended since the last call.
    pub fn lost(&self) -> impl Iterator<Item = Lost> {
        self.lost.iter().flat_map(|lost| lost.try_iter())
    }
}

/// Tells the supervisor that is known to be there.
pub fn tell(event: &Event) {
    let line = serde_json::to_string(event).expect("events are plain data");
    let _ = writeln!(io::stdout(), "{line}");
}
