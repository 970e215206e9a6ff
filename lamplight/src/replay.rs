//! `lamplight replay`: what a recording holds, and whether it is what happens.

mod robot;
mod verdict;

use std::path::{Path, PathBuf};

use ::view::Server;
use anyhow::{Context, anyhow};
use clap::Args;
use engine::{Observer, ObserverError, StopFlag, TickView};
use logging::Format;
use observe::progress::Meter;
use processes::signals::{exit_status, raise_on_stop};
use protocol::{percept::Tick, setup::Mode};
use recording::lamplight::{End, Run, Tick as RecordedTick};
use scenario::Scenario;
use serde_json::Value;

use self::verdict::{SHOW_EVERY, Verdict};
use crate::{
    failure::Failure,
    in_process, limits, log,
    recorded_run::{Recording, Step},
    status::Status,
    stdout::say,
    view,
    view::ViewOptions,
    workshop::Workshop,
};

#[derive(Args, Debug)]
pub(crate) struct ReplayArgs {
    /// Recording of a run, such as DIR/run.mcap
    file: PathBuf,

    /// Run the scenario of the recording again, in this process or, where programs think for robots, as processes, and
    /// compare each tick of it
    #[arg(long, conflicts_with = "view")]
    verify: bool,

    /// With --verify: give one robot's controller the percepts that it got, and nothing else, and compare its answers to the
    /// bit; the recording must be of --record=full
    #[arg(long, value_name = "N", requires = "verify")]
    robot: Option<u32>,

    #[command(flatten)]
    view: ViewOptions,

    /// No progress on standard error, only warnings and errors
    #[arg(long, short)]
    quiet: bool,
}

pub(crate) fn replay(args: &ReplayArgs) -> Result<Status, Failure> {
    log::begin(args.quiet, Format::Text);
    if let Some(address) = args.view.view {
        let server = Server::bind(address).map_err(Failure::usage)?;
        let recording = Recording::open(&args.file).map_err(Failure::Usage)?;
        let scenario = recording.scenario().map_err(Failure::usage)?;
        let show = view::of_recording(&args.file, scenario, &recording.run.engine, &recording.run.mode)?;
        return view::until_stopped(server, show);
    }
    match args.verify {
        false => say(&contents(&args.file).map_err(Failure::Usage)?).map(|()| Status::SUCCESS),
        true => verify(args),
    }
}

impl Recording {
    /// Compares the next tick with what it is now, if there is one and it is not the same.
    fn compare(&mut self, tick: Tick, hashes: &[u64]) -> anyhow::Result<Option<Verdict>> {
        let recorded = match self.next_tick()? {
            Some(Step::Tick(recorded)) => recorded,
            Some(Step::End(_)) => {
                let what = format!("the recorded run ended there, and this one does not (tick {tick})");
                return Ok(Some(Verdict::Different(what)));
            }
            None => return Ok(Some(Verdict::Same("the recording was cut there".into()))),
        };
        if recorded.tick != tick {
            let what = format!("tick {} follows in the recording, and not {tick}", recorded.tick);
            return Ok(Some(Verdict::Different(what)));
        }
        let differs = hashes.iter().zip(&recorded.hashes).position(|(ours, theirs)| ours != theirs);
        let robot = differs.or((hashes.len() != recorded.hashes.len()).then_some(0));
        let what = |robot| format!("in tick {tick} robot {robot} is another than was recorded");
        Ok(robot.map(|robot| Verdict::Different(what(robot))))
    }
}

/// Describes a recording for a person.
fn contents(path: &Path) -> anyhow::Result<String> {
    let mut recording = Recording::open(path)?;
    let scenario = recording.scenario()?;
    let (mut last, mut end) = (None, None);
    while let Some(step) = recording.next_tick()? {
        match step {
            Step::Tick(tick) => last = Some(tick.tick),
            Step::End(it) => end = Some(it),
        }
    }
    let Run { lamplight, engine, mode, .. } = &recording.run;
    let mut text = format!(
        "{}: {} robots, seed {}, {engine}, {mode}, recorded by lamplight {lamplight}\n",
        scenario.name,
        scenario.robot_count(),
        scenario.seed
    );
    text += &match last {
        None => "no tick was recorded\n".into(),
        Some(last) => format!(
            "ticks 0 to {last} of {} ({:.1} s of virtual time)\n",
            scenario.ticks(),
            last as f64 * scenario.step_s.get()
        ),
    };
    text += &match end {
        Some(End { summary }) => {
            let summary: Value = serde_json::from_str(&summary).context("its summary is not understood")?;
            let of = |key: &str| summary[key].as_str().unwrap_or_default().to_owned();
            format!("the run {}; digest {}\n", of("ended"), of("digest"))
        }
        None => "it was cut: the run was killed, or had no room to write\n".into(),
    };
    Ok(text)
}

fn verify(args: &ReplayArgs) -> Result<Status, Failure> {
    let recording = Recording::open(&args.file).map_err(Failure::Usage)?;
    if args.robot.is_none() && recording.run.mode != "lockstep" {
        return Err(Failure::Usage(anyhow!(
            "{} was recorded in real time, which depends on its machine; only runs in lock-step can be verified, and \
             single robots of others (--robot N)",
            args.file.display()
        )));
    }
    let mut scenario = recording.scenario_with_acts()?;
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen for signals").map_err(Failure::Run)?;
    if let Some(robot) = args.robot.filter(|robot| *robot >= scenario.robot_count()) {
        let robots = scenario.robot_count();
        return Err(Failure::Usage(anyhow!("--robot {robot}: the scenario has robots 0 to {}", robots - 1)));
    }
    let (compared, verdict) = if let Some(robot) = args.robot {
        let instead = "a robot is verified in this process, which plays laws and classes in Python";
        in_process::prepare(&mut scenario, instead).map_err(Failure::usage)?;
        robot::verify(recording, &scenario, robot, args.quiet, &stop)
    } else if in_process::can_play(&scenario) {
        in_process::prepare(&mut scenario, in_process::INSTEAD).map_err(Failure::usage)?;
        in_this_process(recording, &scenario, args.quiet, &stop)
    } else {
        scenario.find_controllers().map_err(Failure::usage)?;
        limits::prepare(scenario.robot_count(), scenario.plane(Mode::Lockstep)).map_err(Failure::Usage)?;
        as_processes(recording, &scenario, &stop)
    };
    let compared = match args.robot {
        Some(robot) => format!("{compared} answers of robot {robot}"),
        None => format!("{compared} ticks"),
    };
    if let Some(signal) = stop.signal() {
        say(&format!("{compared} are as recorded; interrupted\n"))?;
        return Ok(Status(exit_status(signal)));
    }
    match verdict.map_err(Failure::Run)? {
        Verdict::Same(what) => {
            say(&format!("{compared} are as recorded; {what}\n")).map(|()| Status::SUCCESS)
        }
        Verdict::Different(what) => {
            say(&format!("{compared} are as recorded; {what}\n"))?;
            Ok(Status::FAILURE)
        }
    }
}

/// Compares as the scenario is played once more. Returns how many ticks are as recorded, and what that comes to.
fn in_this_process(
    recording: Recording,
    scenario: &Scenario,
    quiet: bool,
    stop: &StopFlag,
) -> (Tick, anyhow::Result<Verdict>) {
    let enough = StopFlag::default();
    let mut comparison = Comparison {
        recording,
        meter: Meter::begin(Some(scenario.ticks()), quiet),
        stop: stop.clone(),
        enough: enough.clone(),
        compared: 0,
        verdict: None,
    };
    let summary = in_process::run_quietly(scenario, &enough, vec![&mut comparison]);
    let Comparison { mut recording, compared, verdict, .. } = comparison;
    let verdict = match (verdict, summary) {
        (Some(verdict), _) => verdict,
        (None, Ok(summary)) => ending(&mut recording, compared, &summary.digest),
        (None, Err(error)) => Err(error),
    };
    (compared, verdict)
}

/// Compares with another recording, of a run of processes.
fn as_processes(
    mut recording: Recording,
    scenario: &Scenario,
    stop: &StopFlag,
) -> (Tick, anyhow::Result<Verdict>) {
    let mut compared = 0;
    let verdict = (|| {
        let workshop = Workshop::open("replay")?;
        let again = workshop.record(&scenario.to_toml(), scenario.seed, stop)?;
        let mut again = Recording::open(&again)?;
        loop {
            match again.next_tick()?.context("the run that was to be compared was not recorded whole")? {
                Step::End(End { summary }) => {
                    return ending(&mut recording, compared, &digest_of(&summary)?.unwrap_or_default());
                }
                Step::Tick(RecordedTick { tick, hashes }) => match recording.compare(tick, &hashes)? {
                    Some(verdict) => return Ok(verdict),
                    None => compared += 1,
                },
            }
        }
    })();
    (compared, verdict)
}

/// The run is over: so must the recording be.
fn ending(recording: &mut Recording, compared: Tick, digest: &str) -> anyhow::Result<Verdict> {
    match recording.next_tick()? {
        None => Ok(Verdict::Same("the recording was cut there".into())),
        Some(Step::Tick(tick)) => Ok(Verdict::Different(format!(
            "tick {} was recorded, and the run ends at tick {compared}",
            tick.tick
        ))),
        Some(Step::End(End { summary })) => {
            let recorded = digest_of(&summary)?;
            match recorded.as_deref() {
                Some(recorded) if recorded == digest => Ok(Verdict::Same(format!("digest {digest}"))),
                recorded => Ok(Verdict::Different(format!(
                    "the recorded digest is {}, and not {digest}",
                    recorded.unwrap_or("missing")
                ))),
            }
        }
    }
}

/// The digest in a `summary.json`.
fn digest_of(summary: &str) -> anyhow::Result<Option<String>> {
    let summary: Value = serde_json::from_str(summary).context("its summary is not understood")?;
    Ok(summary["digest"].as_str().map(Into::into))
}

/// Compares a run, tick by tick, with what was recorded of it, until one differs or there is no more.
struct Comparison {
    recording: Recording,
    meter: Meter,
    /// Raised by whoever interrupts us.
    stop: StopFlag,
    /// Raised by us, when nothing is left to be compared.
    enough: StopFlag,
    compared: Tick,
    verdict: Option<anyhow::Result<Verdict>>,
}

impl Observer for Comparison {
    fn ticked(&mut self, view: &TickView<'_>) -> Result<(), ObserverError> {
        if self.verdict.is_some() {
            return Ok(());
        }
        match self.recording.compare(view.tick(), &view.hashes()).transpose() {
            Some(verdict) => {
                self.verdict = Some(verdict);
                self.enough.raise(1);
            }
            None => self.compared += 1,
        }
        if let Some(signal) = self.stop.signal() {
            self.enough.raise(signal);
        }
        let (compared, ticks) = (self.compared, view.ticks());
        if compared.is_multiple_of(SHOW_EVERY) {
            self.meter.show(compared, || format!("{compared} of {ticks} ticks are as recorded"));
        }
        Ok(())
    }
}
