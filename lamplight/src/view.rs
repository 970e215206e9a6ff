//! `lamplight view`, and the page of `run --view` and `replay --view`.

use std::{
    io::{self, Write},
    path::Path,
    thread,
    time::Duration,
};

use anyhow::{Context, anyhow};
use clap::Args;
use engine::StopFlag;
use logging::Format;
use observe::live::{ListenAddr, socket};
use processes::signals::{exit_status, raise_on_stop};
use protocol::setup::Mode;
use scenario::Scenario;
use transport::run_dir::{RunDir, RunName};
use view::{About, Server, Serving, Show};

use crate::{failure::Failure, log, status::Status, top};

/// Between two looks whether somebody wants to end the page.
const LOOK: Duration = Duration::from_millis(50);

/// Whether and where a page is shown.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct ViewOptions {
    /// Show it on a page in the browser, at ADDR [default: 127.0.0.1 and any free port]; :8080 is this machine alone
    #[arg(long, value_name = "ADDR", num_args = 0..=1, require_equals = true, default_missing_value = ":0")]
    pub(crate) view: Option<ListenAddr>,
}

#[derive(Args, Debug)]
pub(crate) struct ViewArgs {
    /// Name of the run [default: the one that is alive]
    #[arg(value_name = "NAME")]
    name: Option<RunName>,

    /// Address and port; :8080 is this machine alone [default: 127.0.0.1 and any free port]
    #[arg(long, value_name = "ADDR", default_value = ":0", hide_default_value = true)]
    at: ListenAddr,
}

pub(crate) fn view(args: &ViewArgs) -> Result<Status, Failure> {
    log::begin(false, Format::Text);
    let run = top::chosen(args.name.as_ref())?;
    let server = Server::bind(args.at).map_err(Failure::usage)?;
    let scenario = Scenario::load(&run.scenario_path(), &[]).map_err(Failure::run)?;
    let mode = socket::ask(&run.live_path()).map_or(Mode::Lockstep, |snapshot| snapshot.of.mode);
    let show = of_run(&run, scenario, mode)?;
    until_stopped(server, show)
}

/// The run in `run`, which is of `scenario`.
pub(crate) fn of_run(run: &RunDir, scenario: Scenario, mode: Mode) -> Result<Show, Failure> {
    let mode = match mode {
        Mode::Lockstep => "lockstep",
        Mode::Realtime => "realtime",
    };
    let about = About {
        run: run.name().to_string(),
        engine: "processes".into(),
        mode: mode.into(),
        is_recording: false,
    };
    let show = view::live(run.clone(), scenario, about).context("cannot watch the run");
    show.map_err(Failure::Run)
}

/// The recording at `path`, of a run of `scenario`.
pub(crate) fn of_recording(
    path: &Path,
    scenario: Scenario,
    engine: &str,
    mode: &str,
) -> Result<Show, Failure> {
    let about = About {
        run: path.display().to_string(),
        engine: engine.into(),
        mode: mode.into(),
        is_recording: true,
    };
    let show = view::playback(path, scenario, about);
    show.with_context(|| format!("cannot read {}", path.display())).map_err(Failure::Usage)
}

/// Serves the page beside what this process does, and says where.
pub(crate) fn serve(server: Server, show: Show) -> Result<Serving, Failure> {
    let url = server.url();
    let serving = server.serve(show).map_err(|error| Failure::Run(anyhow!(error)))?;
    // To be seen with --quiet too: without it nobody finds the page.
    let _ = writeln!(io::stderr(), "page: {url}");
    Ok(serving)
}

/// Serves the page until somebody has seen enough.
pub(crate) fn until_stopped(server: Server, show: Show) -> Result<Status, Failure> {
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen for signals").map_err(Failure::Run)?;
    serve(server, show)?;
    let _ = writeln!(io::stderr(), "Ctrl-C ends it");
    loop {
        if let Some(signal) = stop.signal() {
            return Ok(Status(exit_status(signal)));
        }
        thread::sleep(LOOK);
    }
}
