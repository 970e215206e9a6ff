//! Instructions of whole ticks in process, counted by callgrind: `Arena::tick` and the
//! `Controller::step` of every robot, in `scenarios/one-gaussian.toml`.
//!
//! Divide by the ticks counted and by the robots: instructions per robot-step. The world has been
//! made, and has played some ticks, outside what is counted.

#![forbid(unsafe_code)]
#![allow(missing_docs)] // Gungraun's macros make public items that nobody can document.

use std::{hint::black_box, path::Path};

use arena::Arena;
use coverage::CoverageController;
use gungraun::{library_benchmark, library_benchmark_group, main};
use protocol::{command::Answer, controller::Hosted, robot_id::RobotId};
use scenario::Scenario;

/// Ticks before those that are counted: the tables are full and memory has been touched.
const TICKS_BEFORE: usize = 5;
/// Ticks that are counted.
const TICKS_COUNTED: usize = 20;

/// An arena, the controllers in it, and their last answers.
struct Swarm {
    arena: Arena,
    controllers: Vec<Hosted<CoverageController>>,
    answers: Vec<Option<Answer>>,
}

impl Swarm {
    fn tick(&mut self) {
        // In this scenario every tick begins a neighbor cycle.
        let percepts = self.arena.tick(&self.answers).expect("percepts for everyone");
        for ((controller, percept), answer) in
            self.controllers.iter_mut().zip(percepts).zip(&mut self.answers)
        {
            *answer = Some(controller.step(percept, &mut ()));
        }
    }
}

fn swarm_of(robots: u32) -> Box<Swarm> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let count = format!("robots.count={robots}").parse().expect("an override");
    let scenario = Scenario::load(&folder.join("../scenarios/one-gaussian.toml"), &[count])
        .unwrap_or_else(|error| panic!("{error}"));
    let setup = scenario.coverage_setup(0).expect("robots have a law");
    let mut controllers: Vec<_> = (0..robots)
        .map(RobotId::first)
        .map(|id| Hosted::new(id, CoverageController::new(id, setup)))
        .collect();
    let answers = controllers.iter_mut().map(|controller| Some(controller.boot())).collect();
    let arena = Arena::new(&scenario).expect("robots without a radius find room");
    let mut swarm = Box::new(Swarm { arena, controllers, answers });
    (0..TICKS_BEFORE).for_each(|_| swarm.tick());
    swarm
}

// The swarm is handed back, so that dropping it is not counted.
#[library_benchmark]
#[bench::ten_robots(swarm_of(10))]
#[bench::hundred_robots(swarm_of(100))]
#[bench::thousand_robots(swarm_of(1000))]
fn twenty_ticks(mut swarm: Box<Swarm>) -> Box<Swarm> {
    (0..TICKS_COUNTED).for_each(|_| swarm.tick());
    black_box(swarm)
}

library_benchmark_group!(name = in_process, benchmarks = twenty_ticks);
main!(library_benchmark_groups = in_process);
