//! Machines that lack something: a usable /dev/shm, inodes, a view of the agents' processes. By namespaces of our own.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::process::Command;

use serde_json::Value;
use tests::{
    live::LiveRun,
    programs::{lamplight, program, said, scenario, under},
};

/// `unshare` with `flags`; `None`, and a line that says so, where we may not have such a namespace.
fn unshare(flags: &[&str]) -> Option<Command> {
    under(&[&["unshare"], flags].concat())
}

#[test]
fn a_shared_memory_that_cannot_be_used_is_named_with_a_remedy_before_anything_starts() {
    let tmpfs = "mount -t tmpfs -o";
    for (mounted, expected, remedy) in [
        // An empty /dev: nothing there but what is made anew.
        ("mount -t tmpfs tmpfs /dev".into(), "/dev/shm: No such file or directory", "sudo mkdir -p /dev/shm"),
        (format!("{tmpfs} ro tmpfs /dev/shm"), "/dev/shm cannot be written to: Read-only file system", "rw"),
        (
            format!("{tmpfs} nr_inodes=50 tmpfs /dev/shm"),
            "files in shared memory: they need 226 (21 each), and the number of inodes left in /dev/shm is 49",
            "nr_inodes=1000000",
        ),
    ] {
        let Some(mut command) = unshare(&["--map-root-user", "--mount"]) else { return };
        let run = lamplight(["run", "--quiet", "--robots", "10", "--duration", "1"]);
        let output = command
            .args(["sh", "-c", &format!("{mounted} && exec \"$0\" \"$@\"")])
            .arg(run.get_program())
            .args(run.get_args())
            .arg(scenario("swarmbots"))
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2), "{mounted}: {}", said(&output));
        for part in [expected, remedy, "hint: or run with `--engine in-process`"] {
            assert!(said(&output).contains(part), "{mounted}: `{part}` is not said: {}", said(&output));
        }
    }
}

#[test]
fn what_agents_use_in_another_namespace_of_processes_is_unknown_and_not_somebody_elses() {
    let flags = ["--map-root-user", "--pid", "--fork", "--mount-proc"];
    let options = ["--robots", "2", "--duration", "5", "--by-hand", "0,1"];
    if unshare(&flags).is_none() {
        return;
    }
    let run = LiveRun::start("swarmbots", &options);
    run.wait_until_open();
    let agents = [0, 1].map(|robot| {
        let mut command = unshare(&flags).unwrap();
        run.agent_under(command.arg(program("robot-agent")), robot)
    });
    for agent in agents {
        let output = agent.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
    }
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    let agents = &left.summary["agents"];
    assert_eq!(agents["processes"]["count"], 0, "each is number 1 there, which is another process here");
    for (key, used) in agents["processes"].as_object().unwrap() {
        assert!(key == "count" || used.is_null(), "{key}: {used}");
    }
    assert!(
        agents["cycle_us"]["p50"].as_f64().unwrap() > 0.0,
        "what agents say themselves is known: {agents}"
    );
    #[derive(serde::Deserialize)]
    struct Used {
        cpu_ms: Option<f64>,
        rss_kb: Option<u64>,
    }
    for robot in left.rows::<Used>("robots.csv") {
        assert_eq!((robot.cpu_ms, robot.rss_kb), (None, None));
    }
    assert_eq!(left.summary["incidents"], Value::Array(Vec::new()));
}
