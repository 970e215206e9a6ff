//! Whether a run that is to stop at convergence ever can.

use engine::{Observer, ObserverError, TickView};
use scenario::RobotSet;

/// Warns, after the first neighbor cycle, of robots whose controllers give no estimated error in a run that is to stop at
/// convergence: it asks for that of every robot. A law of the paper gives one as soon as it has a cell, a program may
/// never.
#[derive(Debug, Default)]
pub struct ConvergenceWarning {
    has_looked: bool,
}

impl Observer for ConvergenceWarning {
    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        if self.has_looked || tick.percepts().is_none() {
            return Ok(());
        }
        self.has_looked = true;
        if let (true, Some(robots)) = (tick.scenario().convergence.stop, without_error(tick)) {
            tracing::warn!(
                "the controller of robots {robots} gives no estimated error, and convergence.stop waits for one of every \
                 robot: the run goes on to its end unless that changes"
            );
        }
        Ok(())
    }
}

/// The robots that answer without an estimated error, and that a controller of the user's thinks for.
fn without_error(tick: &TickView<'_>) -> Option<RobotSet> {
    let answers = (0..).zip(tick.answers());
    let without = answers
        .filter(|(_, answer)| answer.as_ref().is_some_and(|answer| answer.command.estimated_error.is_none()));
    let is_users = |robot: &u32| tick.scenario().controller_of(*robot).law().is_none();
    RobotSet::of(without.map(|(robot, _)| robot).filter(is_users))
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use protocol::{
        command::Command,
        controller::{Controller, StageObserver},
        percept::Percept,
    };
    use scenario::Scenario;

    use super::*;

    struct Beacon;

    impl Controller for Beacon {
        fn boot(&mut self) -> Command {
            Command::REST
        }

        fn step(&mut self, _: &Percept, _: &mut dyn StageObserver) -> Command {
            Command::REST
        }
    }

    /// Looks as the warning does.
    #[derive(Default)]
    struct Named(Option<String>);

    impl Observer for Named {
        fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
            self.0 = without_error(tick).map(|robots| robots.to_string());
            Ok(())
        }
    }

    #[test]
    fn robots_of_programs_that_give_no_estimated_error_are_named() {
        let text = "duration_s = 0.2\nstep_s = 0.1\narena.size_m = [2, 1]\nrobots.count = 5\nchannel.range_m = 1\n\
                    [[controller]]\nrobots = \"0-2\"\nlaw = \"uniform\"\ngain_per_s = 1\n\
                    [[controller]]\nrobots = \"3-4\"\nprogram = [\"beacon\"]";
        let scenario = Scenario::parse("test", text, &[]).unwrap();
        let beacon = engine::controller(|_, _| Ok::<_, Infallible>(Beacon));
        let mut named = Named::default();
        engine::run(&scenario, &[&beacon, &beacon], &mut [&mut named, &mut ConvergenceWarning::default()])
            .unwrap();
        assert_eq!(named.0.as_deref(), Some("3-4"), "the others have a law, which may give one yet");
    }
}
