//! From the text of a scenario file to what it means, and back.

use std::path::Path;

use crate::check::check;
use crate::document::Document;
use crate::error::{Place, ScenarioError};
use crate::fault::kind::Fault;
use crate::fault::table;
use crate::file::controller::{self, ControllerTables};
use crate::file::whole::{Deferred, File};
use crate::overrides::Override;
use crate::problem::Problem;
use crate::scenario::Scenario;
use crate::steps::{Roundings, Settling};
use crate::time_out;

impl Scenario {
    /// The scenario of a text; `source_name` (a path) names it in errors and gives its default name.
    pub fn parse(source_name: &str, text: &str, overrides: &[Override]) -> Result<Self, ScenarioError> {
        let document = Document::parse(source_name, text, overrides)?;
        let file: File = document.deserialize()?;
        let plan = (0..file.fault.len()).map(|index| table::read(&document, index));
        let plan = plan.collect::<Result<Vec<_>, _>>()?;
        let controllers = controller::read(&document)?;
        let resolved = file.resolve(source_name, controllers, plan).and_then(|mut scenario| {
            check(&scenario, &|path| document.place_of_given(path).is_some())?;
            settle(&mut scenario, &|path| document.place_of_given(path))?;
            Ok(scenario)
        });
        resolved.map_err(|problem| document.blame(problem))
    }

    /// The scenario as a file, with every default written out; it parses to an equal scenario.
    pub fn to_toml(&self) -> String {
        toml::to_string(&File::from(self.clone()))
            .expect("a scenario is tables of numbers and names, all of which TOML has")
    }
}

impl File {
    /// Resolves the file named `source_name`, with its controllers and its fault plan.
    fn resolve(
        self,
        source_name: &str,
        controllers: Vec<controller::Entry>,
        fault: Vec<Fault>,
    ) -> Result<Scenario, Problem> {
        let robots = self.robots.resolve()?;
        let channel = self.channel.resolve(self.step_s)?;
        let sensors = self.sensors.resolve(robots.drive)?;
        let light = self.light.resolve()?;
        let timeout_cycles = time_out::default_cycles(&channel, &fault);
        let controllers = controller::resolve(controllers, source_name, robots.count, timeout_cycles)?;
        Ok(Scenario {
            name: if self.name.is_empty() { file_stem(source_name) } else { self.name },
            description: self.description,
            seed: self.seed,
            duration_s: self.duration_s,
            step_s: self.step_s,
            arena: self.arena,
            robots,
            field: self.field,
            light,
            sensors,
            controllers,
            channel,
            convergence: self.convergence,
            processes: self.processes,
            output: self.output,
            fault,
            fuzz: self.fuzz,
            roundings: Roundings::default(),
        })
    }
}

impl From<Scenario> for File {
    fn from(scenario: Scenario) -> Self {
        let count = scenario.robot_count();
        Self {
            name: scenario.name,
            description: scenario.description,
            seed: scenario.seed,
            duration_s: scenario.duration_s,
            step_s: scenario.step_s,
            arena: scenario.arena,
            robots: scenario.robots.into(),
            field: scenario.field,
            light: scenario.light.into(),
            sensors: scenario.sensors.into(),
            controller: Deferred::written(ControllerTables::of(scenario.controllers, count)),
            channel: scenario.channel.into(),
            convergence: scenario.convergence,
            processes: scenario.processes,
            output: scenario.output,
            fault: scenario.fault.into_iter().map(Deferred::written).collect(),
            fuzz: scenario.fuzz,
        }
    }
}

/// Makes every time of `scenario` that is counted in steps a whole number of them, the nearest. `place_of` knows where
/// a value was written, if it was.
fn settle(scenario: &mut Scenario, place_of: &dyn Fn(&str) -> Option<Place>) -> Result<(), Problem> {
    let mut settling = Settling { step_s: scenario.step_s.get(), place_of, rounded: Vec::new() };
    settling.settle("duration_s", 1, Some(&mut scenario.duration_s))?;
    settling.settle("output.metrics_every_s", 1, Some(&mut scenario.output.metrics_every_s))?;
    settling.settle("output.poses_every_s", 1, scenario.output.poses_every_s.as_mut())?;
    settling.settle("output.scene_every_s", 1, Some(&mut scenario.output.scene_every_s))?;
    for (index, fault) in scenario.fault.iter_mut().enumerate() {
        fault.settle(&|key| format!("fault.{index}.{key}"), &mut settling)?;
    }
    // These are the bounds of scenarios to come, which are settled in their turn.
    let fuzz = &scenario.fuzz;
    settling.bound("fuzz.duration_s", fuzz.duration_s.map_or(0.0, |duration| duration.get()))?;
    settling.bound("fuzz.delay_max_s", fuzz.delay_max_s.get())?;
    scenario.roundings = Roundings(settling.rounded);
    Ok(())
}

fn file_stem(path: &str) -> String {
    Path::new(path).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
