//! `lamplight top`: a live run in the terminal.

mod rates;
mod screen;
mod watch;

use std::{
    io::{self, IsTerminal},
    thread,
    time::Duration,
};

use anyhow::anyhow;
use clap::Args;
use transport::run_dir::{RunDir, RunDirError, RunName};

use crate::{failure::Failure, status::Status, stdout::say};
use screen::{Layout, View};
use watch::{Asked, Watcher};

/// Between the two looks of `--once`: what is measured, and how fast time passes, is known by then.
const LOOK: Duration = Duration::from_millis(500);
/// Robots that `--once` shows.
const ROBOTS_ONCE: usize = 20;

#[derive(Args, Debug)]
pub(crate) struct TopArgs {
    /// Name of the run [default: the one that is alive]
    #[arg(value_name = "NAME")]
    name: Option<RunName>,

    /// Print one view and exit; so too if standard output is no terminal
    #[arg(long)]
    once: bool,
}

pub(crate) fn top(args: &TopArgs) -> Result<Status, Failure> {
    let run = chosen(args.name.as_ref())?;
    let mut watcher = Watcher::of(run);
    match args.once || !io::stdout().is_terminal() {
        true => once(&mut watcher)?,
        false => watch::show(&mut watcher)?,
    }
    Ok(Status::SUCCESS)
}

fn once(watcher: &mut Watcher) -> Result<(), Failure> {
    watcher.ask()?;
    thread::sleep(LOOK);
    match (watcher.ask()?, watcher.view()) {
        (Asked::Ended, None) => say(&watcher.farewell()),
        (asked, Some(view)) => {
            let lines = view.lines(Layout { robots: ROBOTS_ONCE, keys: false });
            let text: String =
                lines.iter().map(|line| format!("{}\n", line.to_string().trim_end())).collect();
            let end = if asked == Asked::Ended { watcher.farewell() } else { String::new() };
            say(&(text + &end))
        }
        (Asked::Told | Asked::Silent, None) => Err(Failure::Run(anyhow!("{}", watcher.silence()))),
    }
}

/// The run to watch: `name`, or the one that is alive.
pub(crate) fn chosen(name: Option<&RunName>) -> Result<RunDir, Failure> {
    let is_alive = |run: &RunDir| RunDir::open(run.name().clone()).is_ok();
    let alive: Vec<RunDir> = RunDir::list().map_err(Failure::run)?.into_iter().filter(is_alive).collect();
    let names = || alive.iter().map(|run| format!("`{}`", run.name())).collect::<Vec<_>>().join(", ");
    let usage = |message: String| Err(Failure::Usage(anyhow!(message)));
    if let Some(Err(error @ RunDirError::Foreign { .. })) = name.map(|name| RunDir::open(name.clone())) {
        return Err(Failure::usage(error));
    }
    let hint = "start one with `lamplight run SCENARIO --name NAME`";
    match (name, &alive[..]) {
        (Some(name), _) if alive.iter().any(|run| run.name() == name) => Ok(RunDir::of(name.clone())),
        (None, [run]) => Ok(run.clone()),
        (Some(name), []) => usage(format!("no run named `{name}` is alive, nor is any other; {hint}")),
        (Some(name), _) => usage(format!("no run named `{name}` is alive; alive: {}", names())),
        (None, []) => usage(format!("no run is alive; {hint}")),
        (None, _) => usage(format!("several runs are alive; name one of {}", names())),
    }
}
