//! Our build against another one: both run the same in turn, pair by pair, and ratios are formed within a pair.
//!
//! Noise of the machine falls on both halves of a pair alike, and which half comes first alternates. `scripts/bench
//! --against COMMIT` builds the other and calls this.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use anyhow::ensure;
use clap::Args;
use squad::stop::StopFlag;

use crate::{
    lamplight::{Engine, Program, Summary, side_m},
    spread::{Spread, figures},
    table::{dash, table},
};

const LEGEND: &str = "\
Medians of the pairs. Ratios are ours / theirs within a pair: median, in parentheses the least and the greatest; less \
than 1 is less than theirs. A control cycle is timed, as the agents do it; `scripts/bench` alone counts its instructions.";

/// Robots of `thousand.toml`, and the side of their square, meters.
const THOUSAND: (u32, f64) = (1000, 10.905);

#[derive(Args, Debug)]
pub(crate) struct AgainstArgs {
    /// The other build's `lamplight`, with its other programs beside it
    #[arg(long, value_name = "FILE")]
    theirs: PathBuf,

    /// How the other build is called
    #[arg(long, value_name = "NAME", default_value = "theirs")]
    name: String,

    /// Folder of the scenarios that both run
    #[arg(long, value_name = "FOLDER", default_value = "scenarios")]
    scenarios: PathBuf,

    /// How often both are measured [default: 10, with --quick 3]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..))]
    pairs: Option<u32>,

    /// Fewer robots, shorter runs and fewer pairs
    #[arg(long)]
    quick: bool,
}

/// Runs all cases in turn and returns what there is once `stop` is raised, as Markdown.
pub(crate) fn measured(args: &AgainstArgs, stop: &StopFlag) -> anyhow::Result<String> {
    let theirs = args.theirs.canonicalize().unwrap_or_else(|_| args.theirs.clone());
    let ours = Program::beside_us()?;
    let theirs = Program::at(&theirs)?;
    let mut cases = cases(&args.scenarios, args.quick);
    let pairs = args.pairs.unwrap_or(if args.quick { 3 } else { 10 });
    for number in 1..=pairs {
        for case in &mut cases {
            eprintln!("pair {number} of {pairs}: {}", case.name);
            case.measure(number, stop, |side, engine, arguments| match side {
                Side::Ours => ours.run(engine, arguments, stop),
                Side::Theirs => theirs.run(engine, arguments, stop),
            });
            if stop.is_raised() {
                return markdown(&cases, &args.name);
            }
        }
    }
    markdown(&cases, &args.name)
}

/// Which of the two builds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Ours,
    Theirs,
}

/// Which build runs first, and which second: every other pair the other way round.
fn order(pair: u32) -> [Side; 2] {
    match pair % 2 {
        1 => [Side::Theirs, Side::Ours],
        _ => [Side::Ours, Side::Theirs],
    }
}

/// One run that both builds do again and again.
#[derive(Debug)]
struct Case {
    name: String,
    engine: Engine,
    /// Arguments of `lamplight run`: the scenario and its options.
    arguments: Vec<String>,
    pairs: Vec<Pair>,
    /// Why there are no more pairs.
    failure: Option<String>,
}

/// One run of each build, one right after the other.
#[derive(Clone, Debug)]
struct Pair {
    ours: Summary,
    theirs: Summary,
}

impl Case {
    fn new(name: String, engine: Engine, scenario: &Path, options: &[String]) -> Self {
        let arguments = [&[scenario.display().to_string()], options].concat();
        Self { name, engine, arguments, pairs: Vec::new(), failure: None }
    }

    /// Adds a pair. A run that fails will not do better next time, so it is the last, unless it was told to stop.
    fn measure(
        &mut self,
        pair: u32,
        stop: &StopFlag,
        run: impl Fn(Side, Engine, &[String]) -> anyhow::Result<Summary>,
    ) {
        if self.failure.is_some() {
            return;
        }
        let run = |side| run(side, self.engine, &self.arguments);
        let [first, second] = order(pair);
        let both = run(first).map_err(|error| (first, error));
        let both =
            both.and_then(|one| run(second).map(|other| (one, other)).map_err(|error| (second, error)));
        match both {
            Ok((one, other)) => self.pairs.push(match first {
                Side::Ours => Pair { ours: one, theirs: other },
                Side::Theirs => Pair { ours: other, theirs: one },
            }),
            Err(_) if stop.is_raised() => {}
            Err((side, error)) => {
                eprintln!("{} is measured no further: {error:#}", self.name);
                let side = if side == Side::Ours { "ours" } else { "theirs" };
                self.failure = Some(format!("{side}: {error:#}"));
            }
        }
    }
}

/// The runs: in process a thousand robots, loose and in a crowd; in lock-step a few and many.
fn cases(scenarios: &Path, quick: bool) -> Vec<Case> {
    let (robots, seconds) = if quick { (100, 5) } else { (THOUSAND.0, 20) };
    let thousand_side_m = THOUSAND.1 * (f64::from(robots) / f64::from(THOUSAND.0)).sqrt();
    let options = |robots: u32, side_m: f64, seconds: u32, sets: &[&str]| {
        let mut options = vec![format!("--robots={robots}"), format!("--duration={seconds}")];
        options.push(format!("--set=arena.size_m=[{side_m}, {side_m}]"));
        options.extend(sets.iter().map(|set| format!("--set={set}")));
        options
    };
    let in_process = |what: &str, sets: &[&str]| {
        let scenario = scenarios.join("thousand.toml");
        let name = format!("thousand.toml{what} with {robots} robots, in process");
        Case::new(name, Engine::InProcess, &scenario, &options(robots, thousand_side_m, seconds, sets))
    };
    let lockstep = |robots: u32| {
        let scenario = scenarios.join("swarmbots.toml");
        let name = format!("swarmbots.toml with {robots} robots, lock-step");
        Case::new(name, Engine::Lockstep, &scenario, &options(robots, side_m(robots), seconds, &[]))
    };
    let [few, many] = if quick { [10, 50] } else { [50, 500] };
    let crowd = " (robots.radius_m=0.1 field.offset=10)";
    vec![
        in_process("", &[]),
        in_process(crowd, &["robots.radius_m=0.1", "field.offset=10"]),
        lockstep(few),
        lockstep(many),
    ]
}

/// A value of a run, with its name and unit; `None` where it is not measured.
type Measure = (&'static str, fn(&Summary) -> Option<f64>);

/// Measures of a run, in the order of the rows.
const MEASURES: [Measure; 4] = [
    ("tick, µs", |summary| Some(summary.tick_us.p50)),
    ("control cycle of an agent, µs", Summary::control_cycle_us),
    ("PSS per agent, kB", Summary::pss_kb_per_agent),
    ("start-up, s", Summary::start_up_of_processes_s),
];

fn markdown(cases: &[Case], name: &str) -> anyhow::Result<String> {
    let header = ["run", "what", "pairs", name, "ours", "ratio"].map(str::to_owned);
    let rows = cases.iter().flat_map(|case| MEASURES.iter().filter_map(|measure| row(case, measure)));
    let digest_rows = cases.iter().map(digest_row).collect::<anyhow::Result<Vec<_>>>()?;
    let digests = table(["run", name, "ours", ""].map(str::to_owned).into_iter(), digest_rows.into_iter());
    let failures: String = cases
        .iter()
        .filter_map(|case| case.failure.as_ref().map(|failure| format!("- {}: {failure}\n", case.name)))
        .collect();
    let mut text = format!(
        "{LEGEND}\n\n{}\nDigests:\n\n{digests}",
        table(header.into_iter(), rows.collect::<Vec<_>>().into_iter())
    );
    if !failures.is_empty() {
        text.push_str(&format!("\nWhat failed is measured no further:\n\n{failures}"));
    }
    Ok(text)
}

/// One line of the table; `None` where this is not measured at all.
fn row(case: &Case, (what, of): &Measure) -> Option<Vec<String>> {
    let pairs: Vec<(f64, f64)> =
        case.pairs.iter().filter_map(|pair| of(&pair.ours).zip(of(&pair.theirs))).collect();
    if pairs.is_empty() {
        return None;
    }
    let median = |values: Vec<f64>| figures(Spread::of(values).median(), 3);
    let ratios = Spread::of(pairs.iter().map(|(ours, theirs)| ours / theirs));
    Some(vec![
        case.name.clone(),
        (*what).to_owned(),
        pairs.len().to_string(),
        median(pairs.iter().map(|pair| pair.1).collect()),
        median(pairs.iter().map(|pair| pair.0).collect()),
        format!("{:.3} ({:.3}–{:.3})", ratios.median(), ratios.least(), ratios.greatest()),
    ])
}

/// Both digests of a case. An error if a build disagrees with itself: then nothing that was measured is to be believed.
fn digest_row(case: &Case) -> anyhow::Result<Vec<String>> {
    let of = |side: fn(&Pair) -> &Summary| -> anyhow::Result<Option<&str>> {
        let digests: BTreeSet<&str> = case.pairs.iter().map(|pair| side(pair).digest.as_str()).collect();
        ensure!(digests.len() <= 1, "{}: a build disagrees with itself: {digests:?}", case.name);
        Ok(digests.into_iter().next())
    };
    let (ours, theirs) = (of(|pair| &pair.ours)?, of(|pair| &pair.theirs)?);
    let verdict = match ours.zip(theirs) {
        None => String::new(),
        Some((ours, theirs)) if ours == theirs => "equal".to_owned(),
        Some(_) => "**different**".to_owned(),
    };
    let shown = |digest: Option<&str>| digest.map_or_else(dash, str::to_owned);
    Ok(vec![case.name.clone(), shown(theirs), shown(ours), verdict])
}

#[cfg(test)]
mod tests {
    use anyhow::bail;

    use super::*;

    fn summary(tick_us: f64, digest: &str) -> Summary {
        serde_json::from_value(serde_json::json!({
            "robots": 2, "ticks": 9, "ended": "finished", "packets": { "heard": 1 }, "engine": "processes",
            "digest": digest, "tick_us": { "p50": tick_us }, "start_up_s": 0.5,
            "agents": { "cycle_us": { "p50": 2.0 }, "processes": { "count": 2, "pss_kb": 600 } }
        }))
        .unwrap()
    }

    fn case() -> Case {
        Case::new("a run".into(), Engine::Lockstep, Path::new("x.toml"), &[])
    }

    #[test]
    fn who_runs_first_alternates_and_a_pair_knows_whose_each_half_is() {
        assert_eq!(order(1), [Side::Theirs, Side::Ours]);
        assert_eq!(order(2), [Side::Ours, Side::Theirs]);
        let mut case = case();
        for pair in 1..=4 {
            case.measure(pair, &StopFlag::default(), |side, _, _| {
                Ok(summary(if side == Side::Ours { 1.0 } else { 2.0 }, "d"))
            });
        }
        assert!(case.pairs.iter().all(|pair| pair.ours.tick_us.p50 == 1.0 && pair.theirs.tick_us.p50 == 2.0));
        assert_eq!(case.pairs.len(), 4);
    }

    #[test]
    fn ratios_are_formed_within_a_pair() {
        // The machine slowed down tenfold in the second pair.
        let pair = |by: f64| Pair { ours: summary(30.0 * by, "aa"), theirs: summary(20.0 * by, "aa") };
        let case = Case { pairs: vec![pair(1.0), pair(10.0)], ..case() };
        let text = markdown(&[case], "abc1234").unwrap();
        let lines: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
        assert_eq!(
            lines,
            [
                "| run | what | pairs | abc1234 | ours | ratio |",
                "|--:|--:|--:|--:|--:|--:|",
                "| a run | tick, µs | 2 | 110 | 165 | 1.500 (1.500–1.500) |",
                "| a run | control cycle of an agent, µs | 2 | 2.00 | 2.00 | 1.000 (1.000–1.000) |",
                "| a run | PSS per agent, kB | 2 | 300 | 300 | 1.000 (1.000–1.000) |",
                "| a run | start-up, s | 2 | 0.500 | 0.500 | 1.000 (1.000–1.000) |",
                "| run | abc1234 | ours |  |",
                "|--:|--:|--:|--:|",
                "| a run | aa | aa | equal |",
            ]
        );
    }

    #[test]
    fn digests_that_differ_are_both_shown_and_a_build_that_disagrees_with_itself_is_an_error() {
        let pair = |ours, theirs| Pair { ours: summary(1.0, ours), theirs: summary(1.0, theirs) };
        let differ = Case { pairs: vec![pair("aa", "bb")], ..case() };
        assert_eq!(digest_row(&differ).unwrap(), ["a run", "bb", "aa", "**different**"]);
        let torn = Case { pairs: vec![pair("aa", "bb"), pair("ab", "bb")], ..case() };
        assert!(digest_row(&torn).unwrap_err().to_string().contains("disagrees with itself"));
    }

    #[test]
    fn a_run_that_fails_is_not_tried_again_and_says_whose_it_was() {
        let mut case = case();
        for pair in 1..=3 {
            case.measure(pair, &StopFlag::default(), |side, _, _| match side {
                Side::Ours => Ok(summary(1.0, "aa")),
                Side::Theirs => bail!("unknown key"),
            });
        }
        let text = markdown(&[case], "abc1234").unwrap();
        assert!(text.ends_with("no further:\n\n- a run: theirs: unknown key\n"), "{text}");
    }

    #[test]
    fn a_quick_comparison_has_the_same_runs_with_fewer_robots() {
        let [quick, full] = [true, false].map(|quick| cases(Path::new("s"), quick));
        assert_eq!(quick.len(), full.len());
        assert!(full[0].arguments.contains(&"--set=arena.size_m=[10.905, 10.905]".to_owned()));
        assert!(full[1].arguments.contains(&"--set=field.offset=10".to_owned()), "{:?}", full[1].arguments);
        assert!(full[2].name.contains("50 robots"));
    }
}
