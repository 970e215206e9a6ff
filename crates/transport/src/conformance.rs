//! Conformance suite of planes: checks that hold for whatever carries percepts and commands, as tests that panic.
//!
//! A plane is put under test by a [`Subject`], which opens its two ends; [`check`] runs every check on it. The crate's
//! own two planes are tested by this suite, and `tests/conformance.rs` tests a third, in memory: that is how the tests
//! of another crate can do it.

use protocol::{
    command::{Answer, Command},
    frame::BodyVector,
    granted::{Compass, Position},
    odometry::Odometry,
    packet::PacketView,
    payload::{PAYLOAD_BYTES_MAX, Payload, PayloadOverLimit},
    percept::{DELIVERIES_MAX, Delivery, FieldComponent, Percept, Tick, Wall},
    robot_id::RobotId,
    units::{Meters, Radians},
};

use crate::{
    ends::{AgentEnd, ArenaEnd, Received, ServiceError},
    frame_cache::Frames,
    raw::{CommandError, RawCommand},
};

/// A plane under test, within one run.
pub trait Subject: Sync {
    /// The arena's end.
    type Arena: ArenaEnd;
    /// An agent's end.
    type Agent: AgentEnd;

    /// How many messages wait unread, in either direction: 1 where only the latest counts, the length of the queue
    /// where there is one. The newest replaces the oldest.
    fn unread_max(&self) -> usize;

    /// Makes the services of one life of a robot, for packets with payloads of up to so many bytes.
    fn host(&self, life: RobotId, payload_bytes_max: usize) -> Result<Self::Arena, ServiceError>;

    /// Opens the agent's end of what was hosted with the same arguments. May be called in another thread.
    fn join(&self, life: RobotId, payload_bytes_max: usize) -> Result<Self::Agent, ServiceError>;
}

/// Limits of payloads that a scenario may set, bytes: around what is short, and the most.
const LIMITS: [usize; 5] = [0, 4, 9, 100, PAYLOAD_BYTES_MAX];
/// Lengths of payloads, bytes.
const LENGTHS: [usize; 5] = [4, 0, 9, 10, PAYLOAD_BYTES_MAX];
/// Numbers of deliveries, walls and components of the field in a percept: none, a few, and the most of each.
const SIZES: [[usize; 3]; 7] =
    [[0, 0, 0], [1, 4, 0], [8, 0, 3], [9, 8, 16], [DELIVERIES_MAX, 1, 1], [7, 0, 0], [0, 2, 0]];

/// Runs every check with every limit of payloads, each on a life of its own.
///
/// # Panics
/// If the plane does not conform.
pub fn check<S: Subject>(subject: &S) {
    let checks: [fn(&S, RobotId, usize); 8] = [
        percepts_go_down_and_commands_come_up,
        messages_that_wait_are_the_newest_in_their_order,
        the_same_message_again_is_a_new_one,
        a_payload_beyond_the_limit_is_refused_and_the_next_command_is_read,
        a_command_of_another_life_or_to_another_tick_is_refused,
        a_percept_that_is_replaced_while_it_is_read_is_never_a_mixture,
        a_second_agent_is_refused,
        an_agent_of_an_unknown_life_is_refused,
    ];
    let mut life = RobotId::first(0);
    for limit in LIMITS {
        for check in checks {
            check(subject, life, limit);
            life = life.reborn();
        }
    }
}

/// Whatever a percept or a command holds arrives, and is read once.
pub fn percepts_go_down_and_commands_come_up<S: Subject>(subject: &S, life: RobotId, limit: usize) {
    let (mut arena, mut agent) = open(subject, life, limit);
    let (mut read, mut frames) = (Percept::empty(0), Frames::of(DELIVERIES_MAX));
    assert_eq!(agent.receive(&mut read), Ok(None), "nothing was sent");
    assert_eq!(arena.receive(), Ok(None), "nothing was sent");
    for (tick, sizes) in (0..).zip(SIZES) {
        let sent = percept(tick, limit, sizes);
        assert_eq!(arena.send(&sent, &mut frames), Ok(()));
        assert_eq!(agent.receive(&mut read), Ok(Some(Ok(0))), "limit {limit}, tick {tick}");
        assert_eq!(read, sent, "limit {limit}");
        assert_eq!(agent.receive(&mut read), Ok(None), "a percept is read once");

        let answer = answer(life, tick as u32, limit);
        answer_with(&mut agent, tick, &answer);
        let received = received(&mut arena);
        assert_eq!(received.check(life, tick, &mut frames), Ok(answer), "limit {limit}");
        assert_eq!(received.notes, notes(tick as u32), "limit {limit}, tick {tick}");
        assert_eq!(arena.receive(), Ok(None), "a command is read once");
    }
}

/// Of messages that nobody reads, the newest are kept, as many as the plane promises.
pub fn messages_that_wait_are_the_newest_in_their_order<S: Subject>(
    subject: &S,
    life: RobotId,
    limit: usize,
) {
    let (mut arena, mut agent) = open(subject, life, limit);
    let (mut read, mut frames) = (Percept::empty(0), Frames::of(DELIVERIES_MAX));
    let mut tick = 0;
    for count in 1..subject.unread_max() as Tick + 3 {
        let sent = tick + 1..tick + 1 + count;
        for tick in sent.clone() {
            assert_eq!(arena.send(&percept(tick, limit, [9, 1, 1]), &mut frames), Ok(()));
            answer_with(&mut agent, tick, &answer(life, tick as u32, limit));
        }
        tick += count;
        for tick in sent.skip((count as usize).saturating_sub(subject.unread_max())) {
            assert_eq!(agent.receive(&mut read), Ok(Some(Ok(0))), "tick {tick} of {count} percepts waits");
            assert_eq!(read, percept(tick, limit, [9, 1, 1]));
            let received = received(&mut arena);
            let answer = answer(life, tick as u32, limit);
            assert_eq!(received.check(life, tick, &mut frames), Ok(answer));
            assert_eq!(received.notes, notes(tick as u32));
        }
        assert_eq!(agent.receive(&mut read), Ok(None), "no older percept waits");
        assert_eq!(arena.receive(), Ok(None), "no older command waits");
    }
}

/// A new trial sends the same tick once more.
pub fn the_same_message_again_is_a_new_one<S: Subject>(subject: &S, life: RobotId, limit: usize) {
    let (mut arena, mut agent) = open(subject, life, limit);
    let (mut read, mut frames) = (Percept::empty(0), Frames::of(1));
    for _ in 0..2 {
        assert_eq!(arena.send(&percept(3, limit, [1, 1, 0]), &mut frames), Ok(()));
        assert_eq!(agent.receive(&mut read), Ok(Some(Ok(0))));
        answer_with(&mut agent, 3, &answer(life, 4, limit));
        received(&mut arena);
    }
}

/// A payload that is too long is told by its length, and hinders nothing that comes after it.
pub fn a_payload_beyond_the_limit_is_refused_and_the_next_command_is_read<S: Subject>(
    subject: &S,
    life: RobotId,
    limit: usize,
) {
    let (mut arena, mut agent) = open(subject, life, limit);
    let mut frames = Frames::of(1);
    for length in [limit + 1, PAYLOAD_BYTES_MAX, limit].into_iter().filter(|it| *it <= PAYLOAD_BYTES_MAX) {
        let mut answer = answer(life, length as u32, limit);
        answer.command.payload = payload_of(1, length);
        answer_with(&mut agent, 0, &answer);
        let expected = match length > limit {
            true => Err(CommandError::Payload(PayloadOverLimit { length, limit })),
            false => Ok(answer),
        };
        assert_eq!(received(&mut arena).check(life, 0, &mut frames), expected, "limit {limit}");
    }
}

/// A command counts only for the life and the tick that the arena waits for.
pub fn a_command_of_another_life_or_to_another_tick_is_refused<S: Subject>(
    subject: &S,
    life: RobotId,
    limit: usize,
) {
    let (mut arena, mut agent) = open(subject, life, limit);
    answer_with(&mut agent, 7, &answer(life, 0, limit));
    let received = received(&mut arena);
    let check = |life, tick| received.check(life, tick, &mut Frames::of(1));
    let RobotId { index, incarnation } = life;
    let expected = life.reborn();
    assert_eq!(check(expected, 7), Err(CommandError::Sender { expected, index, incarnation }));
    assert_eq!(check(life, 8), Err(CommandError::Tick { expected: 8, actual: 7 }));
    assert_eq!(check(life, 7), Ok(answer(life, 0, limit)));
}

/// A percept that is read while another thread writes as fast as it can is whole, and newer than the last.
pub fn a_percept_that_is_replaced_while_it_is_read_is_never_a_mixture<S: Subject>(
    subject: &S,
    life: RobotId,
    limit: usize,
) {
    const SIZES: [usize; 3] = [20, 3, 2];
    let mut arena = hosted(subject, life, limit);
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let mut agent = joined(subject, life, limit);
            let (mut read, mut newest) = (Percept::empty(0), 0);
            for _ in 0..50 {
                while agent.receive(&mut read).expect("the plane works") != Some(Ok(0)) {}
                assert!(read.tick > newest, "{} after {newest}", read.tick);
                newest = read.tick;
                assert_eq!(read, percept(newest, limit, SIZES), "limit {limit}");
            }
        });
        let (mut frames, mut tick) = (Frames::of(32), 0);
        while !reader.is_finished() {
            tick += 1;
            assert_eq!(arena.send(&percept(tick, limit, SIZES), &mut frames), Ok(()));
        }
    });
}

/// One agent drives a robot, and no other.
pub fn a_second_agent_is_refused<S: Subject>(subject: &S, life: RobotId, limit: usize) {
    let _ends = open(subject, life, limit);
    assert_eq!(subject.join(life, limit).err(), Some(ServiceError::Taken(life)));
}

/// An agent finds the life that is hosted, and no other of the same robot.
pub fn an_agent_of_an_unknown_life_is_refused<S: Subject>(subject: &S, life: RobotId, limit: usize) {
    let _arena = hosted(subject, life, limit);
    let unknown = life.reborn();
    assert_eq!(subject.join(unknown, limit).err(), Some(ServiceError::Unknown(unknown)));
}

fn hosted<S: Subject>(subject: &S, life: RobotId, limit: usize) -> S::Arena {
    subject.host(life, limit).expect("the arena can host a new life")
}

fn joined<S: Subject>(subject: &S, life: RobotId, limit: usize) -> S::Agent {
    subject.join(life, limit).expect("the first agent can join")
}

fn open<S: Subject>(subject: &S, life: RobotId, limit: usize) -> (S::Arena, S::Agent) {
    (hosted(subject, life, limit), joined(subject, life, limit))
}

fn received(arena: &mut impl ArenaEnd) -> Received<'_> {
    arena.receive().expect("the plane works").expect("a command was sent")
}

/// Sends it with as many notes as its number says, up to all there may be.
fn answer_with(agent: &mut impl AgentEnd, tick: Tick, answer: &Answer) {
    let frame = answer.packet().encode();
    let command = RawCommand::new(tick, answer, &frame, 1);
    assert_eq!(agent.send(command, &frame, &notes(answer.sequence)), Ok(()));
}

fn notes(sequence: u32) -> Vec<f64> {
    let count = [3, 0, 16, 1][sequence as usize % 4];
    (0..count).map(|at| f64::from(sequence + at) - 0.5).collect()
}

fn answer(sender: RobotId, sequence: u32, limit: usize) -> Answer {
    let command = Command {
        estimated_error: Some(BodyVector::new(1.0, 2.0)),
        velocity: BodyVector::HERE,
        payload: payload(sequence as usize, limit),
    };
    Answer { sender, sequence, command }
}

fn payload(at: usize, limit: usize) -> Payload {
    payload_of(at as u8, LENGTHS[at % LENGTHS.len()].min(limit))
}

fn payload_of(byte: u8, length: usize) -> Payload {
    Payload::try_from(&[byte; PAYLOAD_BYTES_MAX][..length]).expect("no payload is longer")
}

/// One with so much of everything, and payloads up to `limit`. What a scenario may grant is there in some ticks.
fn percept(tick: Tick, limit: usize, [deliveries, walls, field]: [usize; 3]) -> Percept {
    let mut percept = Percept::empty(tick);
    let length = |at: usize| Meters::new(at as f64).expect("a small number is a length");
    let bearing = Radians::new(0.5).expect("half a radian is an angle");
    let now = tick as usize;
    percept.light.value = tick as f64;
    percept.bump = now % 2 == 1;
    let odometry = Odometry { position: BodyVector::new(tick as f64, 0.25), heading: bearing };
    percept.odometry = now.is_multiple_of(2).then_some(odometry);
    percept.compass = now.is_multiple_of(3).then_some(Compass { heading: bearing });
    percept.position = (now % 3 == 1).then(|| Position { x: length(now), y: length(1) });
    for at in 0..deliveries {
        let payload = payload(at + now, limit);
        let sender = RobotId::first(at as u32);
        let packet = percept.packet(&PacketView { sender, sequence: tick as u32, payload: &payload });
        percept.deliveries.push(Delivery { packet, range: length(at), bearing, orientation: bearing });
    }
    percept.walls = (0..walls).map(|at| Wall { distance: length(at), bearing }).collect();
    percept.field = (0..field).map(|at| FieldComponent::Constant(at as f64)).collect();
    percept
}
