//! One robot of a full recording, once more: its controller gets the percepts that it got, and nothing else.

use anyhow::Context;
use engine::StopFlag;
use observe::progress::Meter;
use protocol::{command::Answer, percept::Tick};
use recording::{
    Topic,
    lamplight::{Answers, End, Percepts},
};
use scenario::{ProcessAction, ProcessFault, Scenario};
use squad::Squad;

use super::verdict::{SHOW_EVERY, Verdict};
use crate::{in_process, recorded_run::Recording};

/// A robot, alone with its percepts.
struct Alone<'a> {
    robot: u32,
    squad: Box<dyn Squad>,
    answers: Vec<Option<Answer>>,
    /// Its present life.
    life: u16,
    stop: &'a StopFlag,
}

/// Compares all answers of `robot` with those that its controller gives to the same percepts. Returns how many are as
/// recorded, and what that comes to.
pub(super) fn verify(
    mut recording: Recording,
    scenario: &Scenario,
    robot: u32,
    quiet: bool,
    stop: &StopFlag,
) -> (Tick, anyhow::Result<Verdict>) {
    let mut compared = 0;
    let verdict = (|| {
        let mut alone = Alone::begin(scenario, robot, stop)?;
        let mut meter = Meter::begin(Some(scenario.ticks()), quiet);
        let (mut percepts, mut is_full) = (Vec::new(), false);
        while let Some(entry) = recording.next()? {
            match entry.topic {
                Topic::Percepts => {
                    is_full = true;
                    let columns: Percepts = recording.named(entry.message())?;
                    columns.read(&mut percepts).context("percepts of the recording")?;
                }
                Topic::Answers => {
                    let columns: Answers = recording.named(entry.message())?;
                    let told = columns.read().context("answers of the recording")?;
                    let Some(recorded) = told.get(robot as usize).and_then(Option::as_ref) else { continue };
                    let answer = alone.answer(recorded.sender.incarnation, columns.tick, &percepts)?;
                    if let Some(what) = difference(recorded, answer) {
                        let tick = columns.tick;
                        let what = format!(
                            "in tick {tick} robot {robot} answers otherwise than was recorded: {what}"
                        );
                        return Ok(Verdict::Different(what));
                    }
                    compared += 1;
                    if columns.tick.is_multiple_of(SHOW_EVERY) {
                        meter.show(columns.tick, || format!("{compared} answers are as recorded"));
                    }
                }
                Topic::End => {
                    let End { .. } = recording.named(entry.message())?;
                    let what = match is_full {
                        true => "the run ended there",
                        false => "the recording has no percepts: record it with --record=full",
                    };
                    return Ok(if is_full { Verdict::Same } else { Verdict::Different }(what.into()));
                }
                _ => {}
            }
            if stop.is_raised() {
                break;
            }
        }
        Ok(Verdict::Same("the recording was cut there".into()))
    })();
    (compared, verdict)
}

impl<'a> Alone<'a> {
    fn begin(scenario: &Scenario, robot: u32, stop: &'a StopFlag) -> anyhow::Result<Self> {
        let mut squad = in_process::squad_of(scenario, robot..robot + 1)?;
        let mut answers = vec![None; scenario.robot_count() as usize];
        squad.join_all(&mut answers, stop, &mut |_| {})?;
        Ok(Self { robot, squad, answers, life: 0, stop })
    }

    /// Returns its answer, in this life, to its percept among those of `tick`.
    fn answer(
        &mut self,
        life: u16,
        tick: Tick,
        percepts: &[protocol::percept::Percept],
    ) -> anyhow::Result<Option<&Answer>> {
        let Self { robot, squad, answers, .. } = self;
        while self.life < life && !self.stop.is_raised() {
            let fault = |action| ProcessFault { robot: *robot, action };
            let faults = [fault(ProcessAction::Kill), fault(ProcessAction::Restart)];
            squad.apply_process_faults(tick, &faults, answers, &mut |_| {})?;
            self.life += 1;
        }
        squad.send(percepts)?;
        squad.collect(answers, &mut |_| {})?;
        Ok(answers[*robot as usize].as_ref())
    }
}

/// Returns what differs between two answers, to the bit.
fn difference(recorded: &Answer, answer: Option<&Answer>) -> Option<String> {
    let Some(answer) = answer else { return Some("it gives none".into()) };
    let (theirs, ours) = (&recorded.command, &answer.command);
    let bits = |vector: protocol::frame::BodyVector| [vector.0.x.to_bits(), vector.0.y.to_bits()];
    let said = |what: &str, ours: String, theirs: String| Some(format!("{what} {ours}, recorded {theirs}"));
    if bits(ours.velocity) != bits(theirs.velocity) {
        let told = |vector: protocol::frame::BodyVector| format!("({}, {}) m/s", vector.0.x, vector.0.y);
        return said("velocity", told(ours.velocity), told(theirs.velocity));
    }
    if ours.estimated_error.map(bits) != theirs.estimated_error.map(bits) {
        let told = |error: Option<protocol::frame::BodyVector>| match error {
            Some(error) => format!("({}, {}) m", error.0.x, error.0.y),
            None => "none".into(),
        };
        return said("estimated error", told(ours.estimated_error), told(theirs.estimated_error));
    }
    if ours.payload != theirs.payload {
        return said(
            "payload",
            format!("{:02x?}", &ours.payload[..]),
            format!("{:02x?}", &theirs.payload[..]),
        );
    }
    if (answer.sender, answer.sequence) != (recorded.sender, recorded.sequence) {
        let told = |answer: &Answer| format!("{} of {}", answer.sequence, answer.sender);
        return said("packet", told(answer), told(recorded));
    }
    None
}
