//! Costs of a tick: our lock-step tick and our in-process tick beside the bare mechanisms.
//!
//! All are measured in turn, round by round, so that what else the machine does falls on all of
//! them alike. Progress goes to standard error, the result (Markdown) to standard output.

#![forbid(unsafe_code)]

mod against;
mod bench;
mod figure;
mod floor;
mod lamplight;
mod machine;
mod peer;
mod results;
mod spread;
mod table;

use std::{
    fs::File,
    io::Write,
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::{Context, bail, ensure};
use clap::{Args, Parser, Subcommand, ValueEnum};
use processes::signals::{exit_status, raise_on_stop};
use squad::stop::StopFlag;

#[cfg(feature = "zeromq")]
use crate::floor::zeromq;
use crate::{
    bench::Plan,
    floor::{ROBOTS_MAX, futex, idle, streams},
    lamplight::Lamplight,
    peer::Peer,
};

/// Measure what a tick costs, beside the least it could cost
///
/// Prints Markdown tables. Run it on a quiet machine: a tick of N processes is N context
/// switches, and whatever else runs gets in between.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(flatten)]
    bench: BenchArgs,

    #[command(subcommand)]
    other: Option<Other>,
}

#[derive(Args, Debug)]
struct BenchArgs {
    /// Peers to measure [default: all that this build can measure]
    #[arg(long, value_name = "PEER,PEER,..", value_delimiter = ',', value_enum)]
    peers: Vec<Peer>,

    /// Swarm sizes to measure
    #[arg(long, value_name = "N,N,..", value_delimiter = ',', default_value = "10,50,100,500,1000,2000")]
    robots: Vec<u32>,

    /// How often each is measured, in turn with the others
    #[arg(long, value_name = "COUNT", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,

    /// Ticks of each measurement; its result is their median
    #[arg(long, value_name = "COUNT", default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..))]
    ticks: u32,

    /// Scenario to run, with 50 robots on a square of 2.4384 m; other sizes get its density
    #[arg(long, value_name = "FILE", default_value = "scenarios/swarmbots.toml")]
    scenario: PathBuf,

    /// Set any key of the scenario, such as channel.range_m=0.6; may be repeated
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    sets: Vec<String>,

    /// Draw the medians over N, with each one's multiple of the floor, as SVG
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,

    /// Write every measurement as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

/// Something other than the tables.
#[derive(Debug, Subcommand)]
enum Other {
    /// Measure this build against another one, pair by pair; `scripts/bench --against COMMIT` does all of it
    Against(against::AgainstArgs),
    #[command(flatten)]
    Internal(Internal),
}

/// One process of a floor; started by this program only.
#[derive(Debug, Subcommand)]
enum Internal {
    #[command(hide = true, name = futex::AGENT)]
    Futex(futex::AgentArgs),
    #[command(hide = true, name = streams::AGENT)]
    Stream,
    #[cfg(feature = "zeromq")]
    #[command(hide = true, name = zeromq::AGENT)]
    Zeromq(zeromq::AgentArgs),
    #[command(hide = true, name = idle::AGENT)]
    Idle(idle::AgentArgs),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match &cli.other {
        None => run(&cli.bench),
        Some(Other::Against(args)) => compare(args),
        Some(Other::Internal(agent)) => live(agent).map(|()| ExitCode::SUCCESS),
    };
    done.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}

fn live(agent: &Internal) -> anyhow::Result<()> {
    match agent {
        Internal::Futex(args) => futex::agent(args),
        Internal::Stream => streams::agent(),
        #[cfg(feature = "zeromq")]
        Internal::Zeromq(args) => zeromq::agent(args),
        Internal::Idle(args) => idle::agent(args),
    }
}

fn run(args: &BenchArgs) -> anyhow::Result<ExitCode> {
    for &robots in &args.robots {
        ensure!((1..=ROBOTS_MAX).contains(&robots), "--robots {robots}: it must be 1 to {ROBOTS_MAX}");
    }
    let (peers, left_out) = chosen(&args.peers)?;
    let runs = peers.iter().any(|peer| peer.engine().is_some());
    let lamplight = runs.then(|| Lamplight::beside_us(&args.scenario, &args.sets)).transpose()?;
    // Made before anything is measured: a path that is wrong should not cost an hour.
    let (svg, csv) = (created(args.svg.as_deref())?, created(args.csv.as_deref())?);
    machine::raise_open_files().context("cannot raise the limit on open files")?;
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen to signals")?;

    let plan = Plan { peers, robots: args.robots.clone(), rounds: args.rounds, ticks: args.ticks };
    let sizes = bench::measure(&plan, lamplight.as_ref(), &stop)?;

    println!("{}\n", machine::described());
    print!("{}", table::markdown(&sizes, &plan.peers));
    left_out.iter().for_each(|reason| println!("\n{reason}"));
    if let Some(mut svg) = svg {
        svg.write_all(figure::svg(&sizes, &plan.peers).as_bytes()).context("cannot write the figure")?;
    }
    if let Some(csv) = csv {
        results::write_csv(&sizes, csv).context("cannot write the measurements")?;
    }
    Ok(ended(&stop, "rounds"))
}

fn compare(args: &against::AgainstArgs) -> anyhow::Result<ExitCode> {
    machine::raise_open_files().context("cannot raise the limit on open files")?;
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen to signals")?;
    let text = against::measured(args, &stop)?;
    println!("{}\n", machine::described());
    print!("{text}");
    Ok(ended(&stop, "pairs"))
}

/// How the program ends: `what` is missing if it was interrupted.
fn ended(stop: &StopFlag, what: &str) -> ExitCode {
    let Some(signal) = stop.signal() else { return ExitCode::SUCCESS };
    eprintln!("interrupted: {what} are missing");
    exit_status(signal).into()
}

/// Returns the peers to measure, in the order of the columns, and lines about those left out although nobody said so,
/// with the reason. A peer that is named but cannot be measured is an error.
fn chosen(named: &[Peer]) -> anyhow::Result<(Vec<Peer>, Vec<String>)> {
    let all = named.is_empty();
    let (mut peers, mut left_out) = (Vec::new(), Vec::new());
    for &peer in Peer::value_variants().iter().filter(|peer| all || named.contains(peer)) {
        match peer.lacking() {
            None => peers.push(peer),
            Some(reason) if all => left_out.push(format!("Left out, {}: {reason}.", peer.name())),
            Some(reason) => bail!("--peers {}: {reason}", peer.name()),
        }
    }
    Ok((peers, left_out))
}

fn created(path: Option<&Path>) -> anyhow::Result<Option<File>> {
    let created =
        |path: &Path| File::create(path).with_context(|| format!("cannot write {}", path.display()));
    path.map(created).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_come_in_the_order_of_the_columns_and_once() {
        let named = [Peer::Idle, Peer::Futex, Peer::Idle];
        assert_eq!(chosen(&named).unwrap(), (vec![Peer::Futex, Peer::Idle], Vec::new()));
    }

    #[test]
    fn zeromq_is_measured_left_out_with_a_reason_or_refused() {
        let (peers, left_out) = chosen(&[]).unwrap();
        let can = cfg!(feature = "zeromq");
        assert_eq!(peers.contains(&Peer::Zeromq), can);
        assert_eq!(left_out.is_empty(), can);
        assert_eq!(chosen(&[Peer::Zeromq]).is_ok(), can);
    }
}
