//! A run of a robot swarm, resolved: every default is filled in.

use coverage::setup::{Closure, CoverageSetup};
use protocol::params::Params;
use protocol::setup::{AgentSetup, ClockSetup, Mode, Plane};
use protocol::units::{Meters, MetersPerSecond, Seconds};

use crate::channel::ChannelSpec;
use crate::controller::{Controller, LawSpec, Mind, ProgramSpec, PythonSpec, Speaks, setup_of};
use crate::error::ScenarioError;
use crate::fault::draw;
use crate::fault::kind::{Fault, FaultKind};
use crate::fault::setting::Setting;
use crate::file::arena::ArenaSpec;
use crate::file::convergence::ConvergenceSpec;
use crate::file::field::{FieldSpec, LampSpec};
use crate::file::fuzz::FuzzSpec;
use crate::file::output::OutputSpec;
use crate::file::processes::ProcessesSpec;
use crate::light::LightSpec;
use crate::number::{Positive, Seed};
use crate::robots::RobotsSpec;
use crate::sensors::{Sensor, SensorsSpec};
use crate::steps::{self, Roundings};

/// A run of a robot swarm: the arena, the robots, what they sense, how they move and what is recorded.
///
/// Resolved: every default is filled in. An `Option` is something that a run may really be without.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Name of the scenario.
    pub name: String,
    /// One line about what the scenario shows.
    pub description: Option<String>,
    /// Seed of every random draw: the same seed gives the same run.
    pub seed: Seed,
    /// Length of the run in seconds of virtual time: a whole number of steps.
    pub duration_s: Positive,
    /// Length of one tick in seconds of virtual time.
    pub step_s: Positive,
    /// The arena the robots move in.
    pub arena: ArenaSpec,
    /// The robots' bodies and where they start.
    pub robots: RobotsSpec,
    /// The sensory function φ.
    pub field: FieldSpec,
    /// The light sensor of every robot.
    pub light: LightSpec,
    /// Other sensors.
    pub sensors: SensorsSpec,
    /// Controllers and their robots: each robot is in one of them.
    pub controllers: Vec<Controller>,
    /// The infrared channel: who hears whom, and how well.
    pub channel: ChannelSpec,
    /// When the swarm counts as converged.
    pub convergence: ConvergenceSpec,
    /// How the robots' processes are supervised.
    pub processes: ProcessesSpec,
    /// Recorded outputs.
    pub output: OutputSpec,
    /// The fault plan: what shall go wrong, in the order in which faults see each packet and robot.
    pub fault: Vec<Fault>,
    /// Bounds of random fault plans, for `lamplight fuzz`.
    pub fuzz: FuzzSpec,

    /// The times above that were written otherwise: they were no whole numbers of steps.
    pub roundings: Roundings,
}

impl Scenario {
    /// Length of a neighbor cycle, seconds.
    pub fn cycle_s(&self) -> f64 {
        self.channel.cycle_s.get()
    }

    /// The neighbor cycle that tick `tick` lies in, counted from 0.
    pub fn cycle_of(&self, tick: u64) -> u64 {
        steps::whole_part(tick as f64 * self.step_s.get() / self.cycle_s())
    }

    /// Whether a neighbor cycle begins at this tick: agents then get a percept, and answer it.
    pub fn begins_cycle(&self, tick: u64) -> bool {
        tick == 0 || self.cycle_of(tick) != self.cycle_of(tick - 1)
    }

    /// The controller of a robot.
    pub fn controller_of(&self, robot: u32) -> &Controller {
        let controller = self.controllers.iter().find(|it| it.robots.contains(robot));
        controller.expect("reading has made sure that every robot has one")
    }

    /// The laws of the paper among the controllers.
    pub fn laws(&self) -> impl Iterator<Item = &LawSpec> + Clone {
        self.controllers.iter().filter_map(Controller::law)
    }

    /// Makes sure that every program and file of a controller is there, and knows the path of the one and the contents of
    /// the other.
    ///
    /// # Errors
    /// If one is missing, a program is not executable, or a file is another one than it was.
    pub fn find_controllers(&mut self) -> Result<(), ScenarioError> {
        self.controllers.iter_mut().try_for_each(Controller::find)
    }

    /// Makes sure that laws think for all robots, or also classes in Python where `plays_python`: for who starts no
    /// processes. `instead` says what is to be done.
    ///
    /// # Errors
    /// If a program thinks for some.
    pub fn refuse_programs(&self, plays_python: bool, instead: &str) -> Result<(), ScenarioError> {
        let is_refused = |it: &&Controller| it.law().is_none() && !(plays_python && it.python().is_some());
        match self.controllers.iter().find(is_refused) {
            None => Ok(()),
            Some(controller) => {
                let (robots, name) = (&controller.robots, controller.own_name().unwrap_or_default());
                Err(controller.error(format!("robots {robots} need processes: they run {name}"), instead))
            }
        }
    }

    /// Ticks for which robots with this controller remember a neighbor that is not heard: rounded down, so that silence
    /// of as many cycles is always seen; at least 1. What a `u32` cannot hold is longer than any run.
    pub fn neighbor_timeout_ticks(&self, controller: &Controller) -> u32 {
        let cycles = controller.neighbor_timeout_cycles().get();
        let ticks = steps::whole_part(f64::from(cycles) * self.cycle_s() / self.step_s.get());
        u32::try_from(ticks).unwrap_or(u32::MAX).max(1)
    }

    /// The tick nearest to a time.
    pub fn tick_at(&self, time_s: f64) -> u64 {
        steps::nearest(time_s, self.step_s.get())
    }

    /// When a tick is, seconds.
    pub fn time_of(&self, tick: u64) -> f64 {
        steps::time_of(tick, self.step_s.get())
    }

    /// Number of ticks in the run: `duration_s` in steps.
    pub fn ticks(&self) -> u64 {
        self.whole_steps(self.duration_s)
    }

    /// Ticks between two rows of `metrics.csv`: `metrics_every_s` in steps.
    pub fn sample_every_ticks(&self) -> u64 {
        self.whole_steps(self.output.metrics_every_s)
    }

    /// Ticks between two times at which a recording holds shapes: `scene_every_s` in steps.
    pub fn scene_every_ticks(&self) -> u64 {
        self.whole_steps(self.output.scene_every_s)
    }

    /// Ticks between two times in `poses.csv`, if the scenario asks for one: `poses_every_s` in steps.
    pub fn poses_every_ticks(&self) -> Option<u64> {
        self.output.poses_every_s.map(|every_s| self.whole_steps(every_s))
    }

    /// Number of robots in the run, at least one.
    pub fn robot_count(&self) -> u32 {
        self.robots.count
    }

    /// The lamps, in the order of the file.
    pub fn lamps(&self) -> &[LampSpec] {
        &self.field.lamp
    }

    /// Returns what robots are granted to sense, beside the packets that they hear: each sensor that one of them has.
    pub fn granted(&self) -> Vec<Sensor> {
        let sensors = [
            (Sensor::Light, true),
            (Sensor::Bump, true),
            (Sensor::Walls, self.arena.boundary_sensing),
            (Sensor::Odometry, self.sensors.odometry.is_some()),
            (Sensor::Compass, self.sensors.compass),
            (Sensor::Position, self.sensors.position),
            (Sensor::Field, self.controllers.iter().any(Controller::senses_field)),
        ];
        sensors.into_iter().filter(|(_, granted)| *granted).map(|(sensor, _)| sensor).collect()
    }

    /// Returns the setup of an agent with this controller before its first tick: the same for all such, and silent about
    /// how many there are.
    pub fn agent_setup(&self, mode: Mode, controller: &Controller) -> AgentSetup {
        let cycle = seconds(self.channel.cycle_s);
        let clock = ClockSetup {
            drift_ppm: self.processes.clock_drift_ppm.get(),
            jitter: Seconds::new(self.processes.timer_jitter_s.get()).expect("it is a finite number"),
            seed: self.seed.get(),
        };
        AgentSetup {
            mode,
            plane: self.plane(mode),
            payload_bytes_max: self.channel.payload_bytes_max.get(),
            cycle,
            clock,
            params: self.params(controller),
            memory_max_bytes: self.processes.memory_max_bytes(),
            pid_namespace: None,
        }
    }

    /// Returns the parameters of a controller as its robots get them.
    pub fn params(&self, controller: &Controller) -> Params {
        match &controller.mind {
            Mind::Law(law) => {
                Params::encoded(&self.setup_of_law(law, self.neighbor_timeout_ticks(controller)))
            }
            Mind::Program(program @ ProgramSpec { speaks: Speaks::SharedMemory, .. }) => {
                Params::of_json(program.json())
            }
            Mind::Program(ProgramSpec { params, speaks: Speaks::JsonLines, .. })
            | Mind::Python(PythonSpec { params, .. }) => {
                let setup = setup_of(params, self.neighbor_timeout_ticks(controller));
                Params::of_json(serde_json::to_vec(&setup).expect("its parameters are JSON"))
            }
        }
    }

    /// Returns the setup of a robot's law; `None` if a program thinks for it.
    pub fn coverage_setup(&self, robot: u32) -> Option<CoverageSetup> {
        let controller = self.controller_of(robot);
        let law = controller.law()?;
        Some(self.setup_of_law(law, self.neighbor_timeout_ticks(controller)))
    }

    /// Returns the plane for messages between the arena and agents that keep time like this.
    pub fn plane(&self, mode: Mode) -> Plane {
        self.processes.plane.unwrap_or(mode.plane())
    }

    /// Draws one fault of one of these kinds. `unit` draws evenly from 0 to 1; robot `spared` is never killed.
    pub fn draw_fault(&self, kinds: &[FaultKind], spared: u32, unit: &mut dyn FnMut() -> f64) -> Fault {
        draw::drawn(&self.setting(), kinds, spared, unit)
    }

    /// The scenario as far as its faults ask.
    pub(crate) fn setting(&self) -> Setting<'_> {
        Setting {
            robots: self.robot_count(),
            speed_limit_m_per_s: self.robots.speed_limit_m_per_s,
            step_s: self.step_s.get(),
            ticks: self.ticks(),
            size_m: self.arena.size_m.get(),
            lamps: self.field.lamp.len(),
            gaussians: self.field.gaussian.len(),
            counts_max: self.field.counts_max(),
            light: &self.light,
            payload_bytes_max: self.channel.payload_bytes_max.get(),
            controllers: &self.controllers,
            probability_max: self.fuzz.probability_max.get(),
            share_max: self.fuzz.share_max.get(),
            delay_max_s: self.fuzz.delay_max_s.get(),
        }
    }

    fn whole_steps(&self, time_s: Positive) -> u64 {
        steps::nearest(time_s.get(), self.step_s.get()).max(1)
    }

    fn setup_of_law(&self, spec: &LawSpec, neighbor_timeout_ticks: u32) -> CoverageSetup {
        CoverageSetup {
            law: spec.law,
            gain_per_s: spec.gain_per_s.get(),
            speed_cap: self.robots.speed_limit_m_per_s.map(meters_per_second),
            gradient: spec.gradient.into(),
            closure: Closure {
                triangle_base: meters(spec.triangle_base_m),
                triangle_height: meters(spec.triangle_height_m),
                close_distance: meters(spec.close_distance_m),
                cap: spec.cell_cap_m.map(meters),
            },
            neighbor_timeout_ticks,
        }
    }
}

fn meters(value: Positive) -> Meters {
    Meters::new(value.get()).expect("a Positive is finite")
}

fn seconds(value: Positive) -> Seconds {
    Seconds::new(value.get()).expect("a Positive is finite")
}

fn meters_per_second(value: Positive) -> MetersPerSecond {
    MetersPerSecond::new(value.get()).expect("a Positive is finite")
}
