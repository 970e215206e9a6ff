//! A steady tick asks for no memory: neither the arena, nor a controller, nor the transport between them.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use allocation_counter::measure;
use arena::Arena;
use coverage::CoverageController;
use protocol::{
    controller::Hosted, payload::SHORT_PAYLOAD_BYTES, percept::Percept, robot_id::RobotId, setup::Plane,
};
use scenario::{Override, Scenario};
use transport::{
    ends::{AgentEnd, ArenaEnd},
    frame_cache::Frames,
    raw::RawCommand,
    run_dir::RunDir,
    services::Session,
};

/// Ticks until every crowd has been seen, and ticks in which nothing new is.
const WARM_UP: u32 = 1500;
const STEADY: u32 = 100;

#[test]
fn a_steady_tick_in_process_allocates_nothing() {
    for set in ["channel.profile=ideal", "channel.profile=isis"] {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/swarmbots.toml");
        let overrides: Vec<Override> = [set, "robots.count=40"].map(|set| set.parse().unwrap()).into();
        let scenario = Scenario::load(&file, &overrides).unwrap();
        let mut arena = Arena::new(&scenario).unwrap();
        let setup = scenario.coverage_setup(0).unwrap();
        let mut minds: Vec<_> = (0..40)
            .map(RobotId::first)
            .map(|id| Hosted::new(id, CoverageController::new(id, setup)))
            .collect();
        let mut answers: Vec<_> = minds.iter_mut().map(|mind| Some(mind.boot())).collect();
        let mut tick = || {
            arena.process_faults(&[]);
            let Some(percepts) = arena.tick(&answers) else { return };
            for ((mind, percept), answer) in minds.iter_mut().zip(percepts).zip(&mut answers) {
                *answer = Some(mind.step(percept, &mut ()));
            }
        };
        (0..WARM_UP).for_each(|_| tick());
        // By chance a crowd may still be larger than any before it, and a list grow once more.
        let grown = measure(|| (0..STEADY).for_each(|_| tick())).count_total;
        println!("{set}: {grown} allocations in {STEADY} ticks of 40 robots");
        assert!(grown <= 3, "{set}: {grown} allocations in {STEADY} ticks");
    }
}

#[test]
fn a_steady_exchange_allocates_nothing_on_a_blackboard() {
    let name = format!("test-allocations-{}", std::process::id());
    let (run, owner) = RunDir::create(name.parse().unwrap()).unwrap();
    let robot = RobotId::first(0);
    let arena = Session::enter(&run).unwrap();
    let mut host = arena.host(robot, Plane::Blackboard, SHORT_PAYLOAD_BYTES).unwrap();
    let mut agent =
        Session::enter(&run).unwrap().join(robot, Plane::Blackboard, SHORT_PAYLOAD_BYTES).unwrap();
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/swarmbots.toml");
    let setup = Scenario::load(&file, &[]).unwrap().coverage_setup(0).unwrap();
    let (mut mind, mut frames) = (Hosted::new(robot, CoverageController::new(robot, setup)), Frames::of(1));
    let (mut sent, mut read) = (Percept::empty(0), Percept::empty(0));
    let exchanged = measure(|| {
        for tick in 0..u64::from(STEADY) {
            sent.tick = tick;
            host.send(&sent, &mut frames).unwrap();
            assert_eq!(agent.receive(&mut read), Ok(Some(Ok(0))));
            let answer = mind.step(&read, &mut ());
            let frame = answer.packet().encode();
            agent.send(RawCommand::new(tick, &answer, &frame, 1), &frame, &[]).unwrap();
            let received = host.receive().unwrap().unwrap();
            assert_eq!(received.check(robot, tick, &mut frames), Ok(answer));
        }
    });
    assert_eq!(exchanged.count_total, 0);
    drop((host, agent, arena));
    run.remove_own(owner).unwrap();
}
