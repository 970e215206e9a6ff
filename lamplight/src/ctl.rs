//! `lamplight ctl`: acts upon a live run.

use std::{fs, io, path::PathBuf};

use anyhow::{Context, anyhow};
use clap::{Args, Subcommand};
use engine::act::{Act, Done};
use observe::live;
use scenario::{FaultKind, RobotSet, Scenario, fault::Target};
use serde_json::{Map, Value, json};
use transport::run_dir::{RunDir, RunName};

use crate::{failure::Failure, status::Status, stdout::say, top};

#[derive(Args, Debug)]
pub(crate) struct CtlArgs {
    /// Name of the run
    #[arg(value_name = "NAME")]
    name: RunName,

    #[command(subcommand)]
    what: What,
}

/// Acts, as the command line spells them.
#[derive(Debug, Subcommand)]
enum What {
    /// Hold its ticks back (lock-step only, as for resume, step and speed)
    Pause,
    /// Let ticks pass again
    Resume,
    /// Let so many ticks pass, and hold the next one back
    Step {
        /// Ticks
        #[arg(default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
        ticks: u64,
    },
    /// Hold virtual time back to a multiple of real time
    Speed {
        /// Virtual seconds per real second, or `max` for as fast as it can
        #[arg(value_parser = factor)]
        factor: Factor,
    },
    /// Kill agents (SIGKILL); `restart` gives them a new life
    Kill {
        /// Robots, such as 3 or 0-9,17
        robots: RobotSet,
    },
    /// Begin the next life of robots that were killed: ends the fault that killed them
    Restart {
        /// One of the robots
        robot: u32,
    },
    /// Stop agents (SIGSTOP); `continue` lets them go on
    Stop {
        /// Robots, such as 3 or 0-9,17
        robots: RobotSet,
    },
    /// Let robots go on that were stopped: ends the fault that stopped them
    Continue {
        /// One of the robots
        robot: u32,
    },
    /// Drop the packets that robots send and hear
    Drop {
        /// Robots, such as 3 or 0-9,17
        robots: RobotSet,
    },
    /// Drop the packets on a link
    DropLink {
        /// The link: 3->7 from 3 to 7, 3<->7 both ways
        link: String,
    },
    /// Drop all that is heard inside a disc
    Jam {
        /// Its center, meters
        x: f64,
        /// Its center, meters
        y: f64,
        /// Its radius, meters
        radius: f64,
    },
    /// Move a lamp
    MoveLamp {
        /// Its number, from 0
        lamp: usize,
        /// Where to, meters
        #[arg(allow_negative_numbers = true)]
        x: f64,
        /// Where to, meters
        #[arg(allow_negative_numbers = true)]
        y: f64,
    },
    /// Change the offset Φ of the sensory function
    Offset {
        /// Its value, as `field.offset`
        value: f64,
    },
    /// Begin a fault of any kind with the next tick
    Fault {
        /// Its keys as in TOML, but for when it begins: `kind = "burst", p = 0.1, r = 0.3`
        #[arg(value_name = "KEYS")]
        keys: String,
    },
    /// End a fault with the next tick
    End {
        /// Its number in the plan, from 0
        fault: usize,
    },
    /// Save the scenario with all that was done as its fault plan: in lock-step it replays to the same digest
    Save {
        /// New file
        file: PathBuf,
    },
}

/// A speed; `None` for as fast as it can.
#[derive(Clone, Copy, Debug)]
struct Factor(Option<f64>);

fn factor(text: &str) -> Result<Factor, String> {
    match text {
        "max" => Ok(Factor(None)),
        _ => match text.parse() {
            Ok(factor) if factor > 0.0 && f64::is_finite(factor) => Ok(Factor(Some(factor))),
            _ => Err("give virtual seconds per real second, more than 0, or `max`".into()),
        },
    }
}

pub(crate) fn ctl(args: &CtlArgs) -> Result<Status, Failure> {
    let run = top::chosen(Some(&args.name))?;
    if let What::Save { file } = &args.what {
        save(&run, file)?;
        return say(&format!("saved as {}\n", file.display())).map(|()| Status::SUCCESS);
    }
    let act = act(&run, &args.what)?;
    let done = ask(&run, &act)?;
    let fault = done.fault.map(|fault| format!(": fault {fault} of its plan")).unwrap_or_default();
    say(&format!("from tick {} on{fault}\n", done.tick)).map(|()| Status::SUCCESS)
}

/// The act that the command line asks for.
fn act(run: &RunDir, what: &What) -> Result<Act, Failure> {
    let begin = |fault: Value| match fault {
        Value::Object(fault) => Ok(Act::Begin { fault }),
        _ => Err(Failure::Usage(anyhow!("a fault is a table of keys"))),
    };
    match what {
        What::Pause => Ok(Act::Pause),
        What::Resume => Ok(Act::Resume),
        What::Step { ticks } => Ok(Act::Step { ticks: *ticks }),
        What::Speed { factor: Factor(factor) } => Ok(Act::Speed { factor: *factor }),
        What::Kill { robots } => begin(json!({ "kind": "kill", "robots": robots })),
        What::Restart { robot } => ending(run, *robot, FaultKind::Kill),
        What::Stop { robots } => begin(json!({ "kind": "pause", "robots": robots })),
        What::Continue { robot } => ending(run, *robot, FaultKind::Pause),
        What::Drop { robots } => begin(json!({ "kind": "loss", "probability": 1, "robots": robots })),
        What::DropLink { link } => begin(json!({ "kind": "loss", "probability": 1, "links": [link] })),
        What::Jam { x, y, radius } => {
            begin(json!({ "kind": "jam", "region": { "center_m": [x, y], "radius_m": radius } }))
        }
        What::MoveLamp { lamp, x, y } => {
            begin(json!({ "kind": "field", "lamp": lamp, "position_m": [x, y] }))
        }
        What::Offset { value } => begin(json!({ "kind": "field", "offset": value })),
        What::Fault { keys } => Ok(Act::Begin { fault: table(keys)? }),
        What::End { fault } => Ok(Act::End { fault: *fault }),
        What::Save { .. } => Ok(Act::Save),
    }
}

/// Keys of a fault, which are written as a table in one line.
fn table(keys: &str) -> Result<Map<String, Value>, Failure> {
    let keys = keys.trim().trim_start_matches('{').trim_end_matches('}');
    let file: toml::Table = format!("fault = {{ {keys} }}")
        .parse()
        .map_err(|error: toml::de::Error| Failure::Usage(anyhow!("`{keys}`: {}", error.message())))?;
    match serde_json::to_value(&file["fault"]) {
        Ok(Value::Object(fault)) => Ok(fault),
        _ => Err(Failure::Usage(anyhow!("`{keys}` is no table of keys"))),
    }
}

/// The act that ends the fault of this kind that strikes `robot` now.
fn ending(run: &RunDir, robot: u32, kind: FaultKind) -> Result<Act, Failure> {
    let Done { tick, scenario, .. } = ask(run, &Act::Save)?;
    let text = scenario.unwrap_or_default();
    let scenario = Scenario::parse(&run.name().to_string(), &text, &[]).map_err(Failure::run)?;
    let strikes = |target: &Target| match target.choice() {
        Some(choice) => choice.robots.as_ref().is_some_and(|robots| robots.contains(robot)),
        None => false,
    };
    let is_active = |fault: &scenario::Fault| {
        let ends = fault.ends_s().map_or(u64::MAX, |ends_s| scenario.tick_at(ends_s));
        (scenario.tick_at(fault.begins_s())..ends).contains(&tick)
    };
    let of_robot =
        |fault: &scenario::Fault| fault.kind.kind() == kind && is_active(fault) && strikes(&fault.target);
    match scenario.fault.iter().rposition(of_robot) {
        Some(fault) => Ok(Act::End { fault }),
        None => Err(Failure::Usage(anyhow!(
            "no fault of kind `{}` that is at work names robot {robot}; `lamplight ctl {} end N` ends fault N",
            kind.name(),
            run.name()
        ))),
    }
}

/// Writes the scenario with what was done.
fn save(run: &RunDir, file: &PathBuf) -> Result<(), Failure> {
    let text = ask(run, &Act::Save)?.scenario.unwrap_or_default();
    let write = || -> io::Result<()> {
        let mut to = fs::File::create_new(file)?;
        io::Write::write_all(&mut to, text.as_bytes())
    };
    write().with_context(|| format!("cannot write {}", file.display())).map_err(Failure::Usage)
}

fn ask(run: &RunDir, act: &Act) -> Result<Done, Failure> {
    let asked = live::acts::ask(&run.acts_path(), act);
    let told = asked.with_context(|| format!("run `{}` cannot be acted upon", run.name()));
    told.map_err(Failure::Run)?.map_err(|why| Failure::Usage(anyhow!(why)))
}
