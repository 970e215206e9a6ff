//! The conformance suite on a plane that is not this crate's: queues in the memory of one process.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{Arc, Mutex},
};

use protocol::{percept::Percept, robot_id::RobotId};
use transport::{
    conformance::{self, Subject},
    ends::{AgentEnd, ArenaEnd, Received, ServiceError},
    frame_cache::Frames,
    raw::{PerceptError, RawCommand},
};

/// A queue of a few messages, in which the newest replaces the oldest.
type Queue<T> = Arc<Mutex<VecDeque<T>>>;

const QUEUE_LEN: usize = 3;

fn push<T>(queue: &Queue<T>, message: T) {
    let mut queue = queue.lock().unwrap();
    if queue.len() == QUEUE_LEN {
        queue.pop_front();
    }
    queue.push_back(message);
}

#[derive(Debug)]
struct Message {
    command: RawCommand,
    frame: Vec<u8>,
    notes: Vec<f64>,
}

#[derive(Debug)]
struct Arena {
    inbox: Queue<Percept>,
    uplink: Queue<Message>,
    last: Option<Message>,
    payload_bytes_max: usize,
}

#[derive(Debug)]
struct Agent {
    inbox: Queue<Percept>,
    uplink: Queue<Message>,
}

impl ArenaEnd for Arena {
    fn send(&mut self, percept: &Percept, _: &mut Frames) -> Result<(), ServiceError> {
        push(&self.inbox, percept.clone());
        Ok(())
    }

    fn receive(&mut self) -> Result<Option<Received<'_>>, ServiceError> {
        self.last = self.uplink.lock().unwrap().pop_front();
        let payload_bytes_max = self.payload_bytes_max;
        Ok(self.last.as_ref().map(|Message { command, frame, notes }| Received {
            command,
            frame,
            notes,
            payload_bytes_max,
        }))
    }
}

impl AgentEnd for Agent {
    fn receive(&mut self, percept: &mut Percept) -> Result<Option<Result<u32, PerceptError>>, ServiceError> {
        Ok(self.inbox.lock().unwrap().pop_front().map(|sent| {
            *percept = sent;
            Ok(0)
        }))
    }

    fn send(&mut self, command: RawCommand, frame: &[u8], notes: &[f64]) -> Result<(), ServiceError> {
        push(&self.uplink, Message { command, frame: frame.to_vec(), notes: notes.to_vec() });
        Ok(())
    }
}

/// Ends that agents may take; `None` once one has.
#[derive(Debug, Default)]
struct InMemory(Mutex<BTreeMap<RobotId, Option<Agent>>>);

impl Subject for InMemory {
    type Arena = Arena;
    type Agent = Agent;

    fn unread_max(&self) -> usize {
        QUEUE_LEN
    }

    fn host(&self, life: RobotId, payload_bytes_max: usize) -> Result<Arena, ServiceError> {
        let (inbox, uplink) = (Queue::default(), Queue::default());
        let agent = Agent { inbox: Arc::clone(&inbox), uplink: Arc::clone(&uplink) };
        self.0.lock().unwrap().insert(life, Some(agent));
        Ok(Arena { inbox, uplink, last: None, payload_bytes_max })
    }

    fn join(&self, life: RobotId, _: usize) -> Result<Agent, ServiceError> {
        let mut places = self.0.lock().unwrap();
        let place = places.get_mut(&life).ok_or(ServiceError::Unknown(life))?;
        place.take().ok_or(ServiceError::Taken(life))
    }
}

#[test]
fn a_plane_of_another_crate_can_be_held_to_the_suite() {
    conformance::check(&InMemory::default());
}
