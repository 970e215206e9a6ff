//! Answers of the commands to what they cannot do: one clear line, the way out, the exit status.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs,
    io::Write,
    process::{Output, Stdio},
};

use scenario::{BYTES_MAX, SEED_MAX};
use tests::programs::{Run, lamplight, said, scenario};

fn run(args: &[&str]) -> Output {
    lamplight(["run"]).arg(scenario("swarmbots")).args(args).output().unwrap()
}

/// Exit status 2, nothing on standard output, and on standard error what is `expected`.
fn check(output: &Output, expected: &str) {
    assert_eq!(output.status.code(), Some(2), "{}", said(output));
    assert!(output.stdout.is_empty(), "{}", said(output));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains(expected), "expected {expected:?}\n{}", said(output));
}

#[test]
fn a_misspelled_key_gets_a_suggestion() {
    check(
        &run(&["--set", "channel.rnge_m=1"]),
        "error: --set channel.rnge_m=1: unknown key `rnge_m` in [channel]; did you mean `range_m`?\n",
    );
}

#[test]
fn errors_in_a_file_name_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    let good = fs::read_to_string(scenario("swarmbots")).unwrap();
    fs::write(&path, good.replace("radius_m = 0.065", "radius_m = -0.065")).unwrap();
    let line = good.lines().position(|line| line.starts_with("radius_m")).unwrap() + 1;
    let output = lamplight(["check"]).arg(&path).output().unwrap();
    check(
        &output,
        &format!("mine.toml:{line}: robots.radius_m: must be zero or a positive number, got -0.065"),
    );
}

#[test]
fn impossible_numbers_are_refused() {
    check(&run(&["--robots", "0"]), "error: --robots 0: must be from 1 to 1000000 robots, got 0");
    check(&run(&["--robots", "-3"]), "error: --robots -3: must be from 1 to 1000000 robots, got -3");
    check(&run(&["--duration", "-1"]), "error: --duration -1: must be a positive number, got -1");
    check(&run(&["--set", "step_s=nan"]), "--set step_s=nan: must be a finite number, got NaN");
    check(&run(&["--duration", "nan"]), "error: --duration nan: must be a finite number, got NaN");
    check(&run(&["--seed", "-1"]), "invalid value '-1' for '--seed <S>'");
    check(&run(&["--speed", "0"]), "it must be a positive number");
    check(
        &run(&["--speed", "1e-300"]),
        "error: --speed 1e-300: a step of 0.1 s would take 1e299 s, more than 3.1536e7, a year",
    );
    check(&run(&["--set", "field.lamp.0.half_distance_m=1e-200"]), "is beyond 1e-6 to 1e12");
    check(&run(&["--set", "arena.size_m=[1e100,1e100]"]), "is beyond 0.001 m to 100000 m a side");
    check(&run(&["--set", "step_s=2"]), "gain_per_s × step_s = 2 exceeds 1.5");
}

#[test]
fn a_seed_beyond_what_json_keeps_is_refused_wherever_one_is_given() {
    let beyond = (SEED_MAX + 1).to_string();
    let bound = format!("from 0 to {SEED_MAX}, got {beyond}\n");
    let set = format!("seed={beyond}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.toml");
    let good = fs::read_to_string(scenario("swarmbots")).unwrap();
    fs::write(&path, good.replace("\nseed = 1\n", &format!("\nseed = {beyond}\n"))).unwrap();
    check(&lamplight(["check"]).arg(&path).output().unwrap(), &format!("far.toml:13: seed: must be {bound}"));
    for command in [
        &["run"][..],
        &["batch", "--trials", "1", "--out", "never"],
        &["fuzz", "--runs", "1"],
        &["shrink", "--until", "robots == 50"],
    ] {
        let with = |args: &[&str]| {
            let mut lamplight = lamplight(command);
            lamplight.arg(scenario("swarmbots")).args(args).current_dir(folder.path()).output().unwrap()
        };
        check(&with(&["--seed", &beyond]), &bound);
        check(&with(&["--set", &set]), &bound);
    }
    let highest = SEED_MAX.to_string();
    let run = Run::of("swarmbots", &["--engine", "in-process", "--duration", "0.1", "--seed", &highest]);
    assert_eq!(run.number("seed") as u64, SEED_MAX, "as a reader of floating point has it");
}

#[test]
fn what_is_rounded_to_whole_steps_is_said_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output =
        run(&["--engine", "in-process", "--quiet", "--duration", "1.02", "--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let warning = "WARN --duration 1.02: duration_s = 1.02 is not a whole number of steps of 0.1 s: 10 steps, 1 s, \
                   will be run\n";
    assert_eq!(String::from_utf8_lossy(&output.stderr).trim_start(), warning);
    let resolved = fs::read_to_string(out.join("scenario.toml")).unwrap();
    assert!(resolved.contains("\nduration_s = 1.0\n"), "{resolved}");
    let whole = Run::of("swarmbots", &["--engine", "in-process", "--duration", "1"]);
    assert_eq!(Run::in_folder(folder).digest(), whole.digest());
}

#[test]
fn a_check_says_what_will_be_run_and_refuses_what_cannot_be_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.toml");
    let good = fs::read_to_string(scenario("swarmbots")).unwrap();
    let checked = |duration: &str| {
        fs::write(&path, good.replace("\nduration_s = 120.0\n", duration)).unwrap();
        lamplight(["check"]).arg(&path).output().unwrap()
    };
    let output = checked("\nduration_s = 1.23\n");
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(String::from_utf8_lossy(&output.stderr).contains(": 12 steps, 1.2 s, will be run\n"));
    assert!(String::from_utf8_lossy(&output.stdout).ends_with(" 12 ticks of 0.1 s, 0 faults\n"));
    check(
        &checked("\nduration_s = 1e300\n"),
        ": duration_s = 1e300 is more than 1000000000 steps of 0.1 s, ",
    );
    check(&run(&["--duration", "1e300"]), "error: --duration 1e300: duration_s = 1e300 is more than ");
}

#[test]
fn a_scenario_without_an_end_is_refused_at_a_bound_from_files_and_pipes() {
    let refusal = format!(" is longer than {BYTES_MAX} bytes, the most that a scenario may have\n");
    check(&lamplight(["check", "/dev/zero"]).output().unwrap(), &format!("error: /dev/zero:{refusal}"));
    let mut reader = lamplight(["run", "/dev/stdin"]);
    reader.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut reader = reader.spawn().unwrap();
    let mut pipe = reader.stdin.take().unwrap();
    let nothing = vec![b'\n'; 1 << 16];
    while pipe.write_all(&nothing).is_ok() {}
    check(&reader.wait_with_output().unwrap(), &format!("error: /dev/stdin:{refusal}"));
}

#[test]
fn a_swarm_beyond_every_limit_is_explained() {
    let output = run(&["--robots", "500000"]);
    check(&output, "error: 500000 robots as processes are too many here, ");
    // Root may be able to raise the limit on open files; nobody raises these.
    check(&output, "memory maps in the arena: they need 3000256 (6 each), and vm.max_map_count is ");
    check(&output, "hint: sudo sysctl vm.max_map_count=3000256");
    check(&output, "hint: or run with `--engine in-process`");
}

#[test]
fn a_start_without_room_names_the_robot() {
    let output = run(&["--robots", "300", "--engine", "in-process"]);
    check(&output, "error: cannot place robot ");
    check(&output, "use fewer robots, a smaller robots.radius_m (now 0.065) or a larger arena.size_m");
}

#[test]
fn a_folder_with_a_run_in_it_is_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("summary.json"), "precious").unwrap();
    for engine in ["processes", "in-process"] {
        let output = run(&["--engine", engine, "--out", folder.path().to_str().unwrap()]);
        check(&output, "already holds a run (summary.json); give --out another folder, or remove this one");
    }
    assert_eq!(fs::read_to_string(folder.path().join("summary.json")).unwrap(), "precious");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_folder_that_cannot_be_made_is_refused() {
    check(&run(&["--out", "/proc/nowhere/out"]), "error: cannot make the folder /proc/nowhere/out");
}

#[test]
fn a_missing_scenario_is_missed() {
    let output = lamplight(["run", "/nowhere/x.toml"]).output().unwrap();
    check(&output, "error: /nowhere/x.toml: no such file\n");
}

#[test]
fn options_that_mean_nothing_together_are_refused() {
    check(
        &run(&["--engine", "in-process", "--mode", "realtime"]),
        "use --engine processes for --mode realtime",
    );
    check(&run(&["--engine", "in-process", "--by-hand", "1"]), "use --engine processes");
    check(&run(&["--mode", "realtime", "--speed", "2"]), "in --mode realtime virtual time is real time");
    check(&run(&["--by-hand", "50"]), "--by-hand 50: the scenario has robots 0 to 49");
    check(&run(&["--name", "a/b"]), "use 1 to 64 letters, digits, `-` and `_`");
}

#[test]
fn a_scenario_may_come_through_a_pipe() {
    let read = || fs::File::open(scenario("swarmbots")).unwrap();
    for engine in ["processes", "in-process"] {
        let output = lamplight(["run", "/dev/stdin", "--duration", "1", "--engine", engine])
            .stdin(read())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", said(&output));
    }
}

#[test]
fn a_reader_who_has_seen_enough_is_no_failure() {
    let full = || fs::File::create("/dev/full").unwrap();
    let output = lamplight(["schema"]).stdout(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).starts_with("error: cannot write to standard output: "));
    let mut child = lamplight(["schema"]).stdout(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert!(child.wait().unwrap().success());
}

#[test]
fn every_ready_scenario_is_sound() {
    for entry in fs::read_dir(scenario("swarmbots").parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            let output = lamplight(["check"]).arg(&path).output().unwrap();
            assert!(output.status.success(), "{}", said(&output));
        }
    }
}

#[test]
fn the_schema_command_prints_what_is_committed() {
    let output = lamplight(["schema"]).output().unwrap();
    let committed = fs::read(scenario("swarmbots").with_file_name("scenario.schema.json")).unwrap();
    let json = |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).unwrap();
    // Both are too long to be shown.
    let same = json(&output.stdout) == json(&committed);
    assert!(same, "write it anew: lamplight schema > scenarios/scenario.schema.json");
}

#[test]
fn summaries_have_the_keys_that_scripts_rely_on() {
    let output = run(&["--engine", "in-process", "--duration", "1", "--json"]);
    assert!(output.status.success(), "{}", said(&output));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    for key in [
        "scenario",
        "seed",
        "robots",
        "engine",
        "mode",
        "ticks",
        "virtual_time_s",
        "wall_time_s",
        "real_time_factor",
        "digest",
        "converged_at_s",
        "mean_error_m",
        "cost_h",
        "mean_lamp_distance_m",
        "robots_alive",
        "packets",
        "faults",
        "tick_us",
    ] {
        assert!(summary.get(key).is_some(), "{key} is missing");
    }
    for key in ["sent", "heard", "collided", "lost_range", "lost_loss", "lost_fault"] {
        assert!(summary["packets"][key].is_u64(), "packets.{key} is missing");
    }
    for key in ["p50", "p90", "p99", "max"] {
        assert!(summary["tick_us"][key].is_f64(), "tick_us.{key} is missing");
    }
    let packets = |key: &str| summary["packets"][key].as_u64().unwrap();
    assert_eq!(packets("sent") * 49, packets("heard") + packets("lost_range"), "packets are accounted for");
}

#[test]
fn a_fault_that_never_fires_is_a_warning_with_its_line_and_under_strict_faults_a_failure() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plan.toml");
    let good = fs::read_to_string(scenario("swarmbots")).unwrap();
    // A disc in a corner, before anybody has come there, and a link that is too long.
    let faults = "\n[[fault]]\nkind = \"kill\"\nat_s = 1\nrobots = 3\n\
                  \n[[fault]]\nkind = \"jam\"\nfrom_s = 50\nregion = { center_m = [1, 1], radius_m = 1 }\n";
    fs::write(&path, format!("{good}{faults}")).unwrap();
    let line = good.lines().count() + 8;
    let run = |args: &[&str]| {
        lamplight(["run", "--engine", "in-process", "--duration", "2"])
            .arg(&path)
            .args(args)
            .output()
            .unwrap()
    };
    let (lenient, strict) = (run(&[]), run(&["--strict-faults"]));
    assert_eq!(lenient.status.code(), Some(0), "{}", said(&lenient));
    assert_eq!(strict.status.code(), Some(1), "{}", said(&strict));
    for output in [&lenient, &strict] {
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(
            stderr.contains(&format!(
                "plan.toml:{line}: fault 1 (jam): begins at 50 s, after the end of the run (2 s)"
            )),
            "{}",
            said(output)
        );
        assert!(stderr.contains(&format!("plan.toml:{line}: fault 1 (jam) never fired")), "{}", said(output));
        assert!(!stderr.contains("(kill)"), "{}", said(output));
    }
    assert!(String::from_utf8_lossy(&strict.stderr).ends_with("error: 1 of 2 faults never fired\n"));
}

#[test]
fn a_swarm_that_hears_nobody_has_not_converged() {
    for fault in [
        "{ kind = \"loss\", probability = 1.0, from_s = 20, until_s = 25 }",
        "{ kind = \"delay\", delay_s = 0.5 }",
        "{ kind = \"pause\", from_s = 10, until_s = 12 }",
        "{ kind = \"kill\", at_s = 10, robots = \"0-48\" }",
    ] {
        let plan = format!("fault=[{fault}]");
        let options =
            ["--engine", "in-process", "--duration", "30", "--json", "--set", "convergence.stop=true"];
        let output = run(&[&options[..], &["--set", &plan]].concat());
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(summary["converged_at_s"].is_null(), "{fault}: {}", summary["converged_at_s"]);
        assert_eq!(summary["ended"], "finished");
    }
}

#[test]
fn a_crowd_is_shown_beside_its_closed_form_if_the_scenario_asks_for_it() {
    let args = ["run", "--engine", "in-process", "--quiet", "--duration", "60"];
    let output = lamplight(args).arg(scenario("collisions")).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let mut rows = 0;
    for line in
        text.lines().skip_while(|line| !line.contains("disturbers")).skip(1).take_while(|l| !l.is_empty())
    {
        let numbers: Vec<f64> = line.split_whitespace().map(|number| number.parse().unwrap()).collect();
        let [_, packets, measured, predicted] = numbers[..] else { panic!("{line}") };
        // Packets that share a receiver or a collision are not independent: six naive standard errors.
        let error = (predicted * (1.0 - predicted) / packets).sqrt();
        assert!((measured - predicted).abs() < 6.0 * error + 1e-3, "{line}");
        rows += 1;
    }
    assert!(rows > 10, "{text}");
}
