//! Acts upon a run under way: they take effect at a tick, and can be saved and played again.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{path::Path, process::Output};

use serde_json::Value;
use tests::{
    live::LiveRun,
    programs::{lamplight, said},
};

fn ctl(run: &LiveRun, args: &[&str]) -> Output {
    lamplight(["ctl", &run.name]).args(args).output().unwrap()
}

/// The words said of an act: `from tick 7 on: fault 2 of its plan`.
fn told(run: &LiveRun, args: &[&str]) -> Vec<String> {
    let output = ctl(run, args);
    assert!(output.status.success(), "{args:?}: {}", said(&output));
    String::from_utf8(output.stdout).unwrap().split_whitespace().map(Into::into).collect()
}

/// Does it; returns the tick it takes effect at.
fn done(run: &LiveRun, args: &[&str]) -> u64 {
    told(run, args)[2].parse().unwrap()
}

/// Begins a fault; returns its number.
fn begun(run: &LiveRun, args: &[&str]) -> String {
    told(run, args)[5].clone()
}

fn refused(run: &LiveRun, args: &[&str]) -> String {
    let output = ctl(run, args);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {}", said(&output));
    String::from_utf8(output.stderr).unwrap()
}

fn digest_of(scenario: &Path) -> String {
    let output =
        lamplight(["run", "--quiet", "--json", "--engine", "in-process"]).arg(scenario).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    summary["digest"].as_str().unwrap().to_owned()
}

#[test]
fn what_is_done_to_a_run_is_saved_as_a_scenario_of_the_same_digest() {
    let folder = tempfile::tempdir().unwrap();
    let saved = folder.path().join("saved.toml");
    let run =
        LiveRun::start("swarmbots", &["--duration", "8", "--speed", "4", "--record=full", "--robots", "20"]);
    run.wait_until_moving();
    let held = done(&run, &["pause"]);
    assert_eq!(done(&run, &["kill", "3,7"]), held, "no tick passes meanwhile");
    assert_eq!(done(&run, &["stop", "10-12"]), held);
    assert_eq!(done(&run, &["move-lamp", "0", "2", "1.5"]), held);
    assert_eq!(done(&run, &["step", "4"]), held);
    let mut stepped = held;
    while stepped < held + 4 {
        stepped = done(&run, &["offset", "50"]);
    }
    assert_eq!(stepped, held + 4, "held again after four");
    done(&run, &["restart", "7"]);
    done(&run, &["continue", "11"]);
    let dropping = begun(&run, &["drop", "5"]);
    done(&run, &["drop-link", "1<->2"]);
    done(&run, &["jam", "1.2", "1", "0.3"]);
    done(&run, &["fault", "kind = \"slow\", delay_s = 0.2, robots = \"15\""]);
    let last = done(&run, &["resume"]);
    let end = done(&run, &["end", &dropping]);
    assert!(end >= last);
    done(&run, &["pause"]);
    let kept = lamplight(["ctl", &run.name, "save"]).arg(&saved).output().unwrap();
    assert!(kept.status.success(), "{}", said(&kept));
    let again = lamplight(["ctl", &run.name, "save"]).arg(&saved).output().unwrap();
    assert_eq!(again.status.code(), Some(2), "nothing is written over");
    done(&run, &["speed", "max"]);
    done(&run, &["resume"]);
    let (output, files) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let acts = summary["acts"].as_array().unwrap();
    assert_eq!(acts[0]["what"], "ticks are held");
    assert!(acts.iter().any(|act| act["what"] == "fault 0 (kill) is ended"), "{acts:?}");
    let faults = summary["faults"].as_array().unwrap();
    assert_eq!(faults[0]["planned_tick"], held);
    assert_eq!(faults[0]["effects"]["robots restarted"], 2);
    assert_eq!(faults[1]["effects"]["robots paused"], 3);
    let digest = summary["digest"].as_str().unwrap();
    assert_eq!(digest_of(&saved), digest, "as it was saved");
    let files = files.unwrap();
    let recording = files.file("run.mcap");
    for (args, told) in
        [(&[][..], "ticks are as recorded"), (&["--robot", "7"], "answers of robot 7 are as recorded")]
    {
        let verified =
            lamplight(["replay", "--quiet", "--verify"]).args(args).arg(&recording).output().unwrap();
        assert!(verified.status.success(), "{}", said(&verified));
        assert!(said(&verified).contains(told), "{}", said(&verified));
    }
}

#[test]
fn acts_that_cannot_be_are_refused_and_the_run_goes_on() {
    let run = LiveRun::start("swarmbots", &["--duration", "6", "--speed", "4", "--robots", "5"]);
    run.wait_until_moving();
    for (args, words) in [
        (&["kill", "9"][..], "robot"),
        (&["restart", "2"], "no fault of kind `kill`"),
        (&["end", "4"], "there is no fault 4"),
        (&["move-lamp", "7", "0", "0"], "lamp"),
        (&["fault", "kind = \"kil\""], "unknown variant"),
        (&["fault", "kind = \"kill\", robots = \"1\", at_s = 3"], "leave it out"),
        (&["fault", "kind = "], "kind ="),
        (&["speed", "0"], "more than 0"),
        (&["step", "0"], "0"),
    ] {
        let told = refused(&run, args);
        assert!(told.contains(words), "{args:?}: {told}");
    }
    let nobody = lamplight(["ctl", "nobody", "pause"]).output().unwrap();
    assert_eq!(nobody.status.code(), Some(2), "{}", said(&nobody));
    done(&run, &["speed", "max"]);
    let (output, _files) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["acts"].as_array().unwrap().len(), 1);
    assert_eq!(summary["faults"].as_array().unwrap().len(), 0);
}

#[test]
fn in_real_time_ticks_cannot_be_held_and_faults_can_begin() {
    let args = ["--duration", "3", "--mode", "realtime", "--robots", "5"];
    let run = LiveRun::start("swarmbots", &args);
    run.wait_until_moving();
    assert!(refused(&run, &["pause"]).contains("clocks of their own"));
    done(&run, &["drop", "2"]);
    let (output, _files) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["faults"][0]["kind"], "loss");
}
