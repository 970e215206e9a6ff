//! Instructions of one `Controller::step`, counted by callgrind: the same on every run.
//!
//! The controller has already heard the same neighbors a tick before, as it has in all but the
//! first tick of a run. Making controller and percept is outside what is counted.

#![forbid(unsafe_code)]
#![allow(missing_docs)] // Gungraun's macros make public items that nobody can document.

use std::{f64::consts::TAU, hint::black_box};

use coverage::{
    CoverageController,
    law::Law,
    setup::{Closure, CoverageSetup, GradientMode},
};
use gungraun::{library_benchmark, library_benchmark_group, main};
use protocol::{
    command::Command,
    controller::Controller,
    frame::BodyVector,
    packet::Packet,
    percept::{Delivery, Light, Percept, Stimulus},
    robot_id::RobotId,
    units::{Meters, MetersPerSecond, Radians},
};

/// Robot 0 and what it perceives next.
struct Robot {
    controller: CoverageController,
    percept: Percept,
}

/// A robot that has heard its neighbors at tick 0 and is about to hear them at tick 1. Boxed, so
/// that no copy of it is counted.
fn robot_among(neighbors: u32) -> Box<Robot> {
    let mut controller = CoverageController::new(RobotId::first(0), setup());
    black_box(controller.step(&percept(0, neighbors), &mut ()));
    Box::new(Robot { controller, percept: percept(1, neighbors) })
}

// The robot is handed back, so that dropping it is not counted either.
#[library_benchmark]
#[bench::eight_neighbors(robot_among(8))]
#[bench::sixteen_neighbors(robot_among(16))]
fn control_step(mut robot: Box<Robot>) -> (Command, Box<Robot>) {
    let command = robot.controller.step(black_box(&robot.percept), &mut ());
    (black_box(command), robot)
}

library_benchmark_group!(name = controller, benchmarks = control_step);
main!(library_benchmark_groups = controller);

/// That of the SwarmBots, but with the gradient as measured (Section IV of the paper).
fn setup() -> CoverageSetup {
    CoverageSetup {
        law: Law::Linear,
        gain_per_s: 1.0,
        speed_cap: MetersPerSecond::new(0.3),
        gradient: GradientMode::Measured,
        closure: Closure {
            triangle_base: meters(0.6),
            triangle_height: meters(0.6),
            close_distance: meters(0.25),
            cap: None,
        },
        neighbor_timeout_ticks: 1,
    }
}

/// A ring of neighbors, evenly spread in bearing, at ranges that go up and down by half: each of
/// the eight has an edge of the cell, of the sixteen some are cut off by others.
fn percept(tick: u64, neighbors: u32) -> Percept {
    let mut percept = Percept::empty(tick);
    percept.light = Light { value: 300.0, stimulus: Stimulus::Gradient(BodyVector::new(400.0, -250.0)) };
    percept.deliveries.extend((1..=neighbors).map(|index| Delivery {
        packet: Packet::short(RobotId::first(index), tick as u32, Some(250.0_f32.to_le_bytes())),
        range: meters(0.4 + 0.05 * f64::from(index * 3 % 5)),
        bearing: radians(TAU * f64::from(index) / f64::from(neighbors)),
        orientation: radians(0.5),
    }));
    percept
}

fn meters(value: f64) -> Meters {
    Meters::new(value).expect("a finite length")
}

fn radians(value: f64) -> Radians {
    Radians::new(value).expect("a finite angle")
}
