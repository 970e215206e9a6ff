//! Runs that are watched: metrics over HTTP, and `lamplight top`.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs::File,
    io::{ErrorKind, Read, Write},
    net::{TcpListener, TcpStream},
    os::unix::net::UnixStream,
    process::{Child, Command, Output, Stdio},
    thread,
    time::{Duration, Instant},
};

use rustix::{
    process::{Pid, Signal},
    pty::{OpenptFlags, openpt, ptsname, unlockpt},
    termios::{Winsize, tcsetwinsize},
};
use serde_json::Value;
use tests::{
    live::{LiveRun, heard, signal, wait_until},
    programs::{Run, lamplight, said, scenario},
};

/// Where a line says that metrics are.
fn address(line: &str) -> String {
    let (_, rest) = line.split_once("http://").unwrap();
    rest.strip_suffix("/metrics").unwrap().to_owned()
}

fn scrape(address: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET /metrics HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer}");
    answer.split_once("\r\n\r\n").unwrap().1.to_owned()
}

/// The value of a sample; `None` if it is not there.
fn sample(text: &str, key: &str) -> Option<f64> {
    let value = text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(' '))?;
    Some(value.parse().unwrap())
}

/// Snapshot that the run's socket gives.
fn snapshot(run: &LiveRun) -> Value {
    let mut stream = UnixStream::connect(format!("/dev/shm/lamplight-{}/live", run.name)).unwrap();
    let mut line = String::new();
    stream.read_to_string(&mut line).unwrap();
    serde_json::from_str(&line).unwrap()
}

fn top_once(run: &LiveRun) -> Output {
    lamplight(["top", &run.name, "--once"]).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Stops the process of robot 17 and lets it go on, three times. Returns how long the run took to name it as
/// stopped, at best: the machine may be busy with something else. It is stopped once more at the end.
fn time_until_named(run: &LiveRun, agent: Pid) -> Duration {
    let once = || {
        signal(agent, Signal::STOP);
        let began = Instant::now();
        wait_until("it is named", || {
            let robot = &snapshot(run)["waiting"]["robots"][0];
            robot["id"]["index"] == 17 && robot["state"] == "stopped"
        });
        let elapsed = began.elapsed();
        let told = snapshot(run);
        let ticks = [&told["tick"], &told["waiting"]["tick"]].map(|tick| tick.as_u64().unwrap());
        assert!(ticks[1] <= ticks[0] + 1, "what is told is of the last tick that is over: {ticks:?}");
        elapsed
    };
    let go_on = || {
        signal(agent, Signal::CONT);
        wait_until("nobody is waited for", || snapshot(run)["waiting"].is_null());
    };
    let first = once();
    go_on();
    let second = once();
    go_on();
    first.min(second).min(once())
}

#[test]
fn a_stopped_agent_is_named_within_a_second_and_nothing_changes() {
    let args = ["--speed", "10", "--duration", "40", "--set", "processes.hang_timeout_s=60"];
    let mut run = LiveRun::start("swarmbots", &[&args[..], &["--metrics", "127.0.0.1:0"]].concat());
    let address = address(&run.hear("metrics at"));
    run.wait_until_moving();
    let ticks = || sample(&scrape(&address), "lamplight_ticks_total").unwrap();
    let before = ticks();
    wait_until("ticks pass", || ticks() > before);
    let cycle = "lamplight_agent_cycle_duration_seconds{quantile=\"0.99\"}";
    wait_until("cycles are measured", || sample(&scrape(&address), cycle).is_some_and(|s| s > 0.0));
    let agent = run.agents()[&17];
    let took = time_until_named(&run, agent);
    assert!(took < Duration::from_secs(1), "{took:?}");
    let (output, text) = (top_once(&run), scrape(&address));
    assert!(output.status.success(), "{}", said(&output));
    let named = format!(" waits for robot 17 (pid {}, stopped) since ", agent.as_raw_pid());
    assert!(stdout(&output).contains(&named), "{}", said(&output));
    assert!(stdout(&output).contains("50 of 50 robots take part"), "{}", said(&output));
    let waited = sample(&text, "lamplight_robot_waiting_seconds{robot=\"17\",state=\"stopped\"}");
    assert!(waited.is_some_and(|s| s > 0.4), "{text}");
    assert_eq!(sample(&text, "lamplight_waiting_robots"), Some(1.0));
    signal(agent, Signal::CONT);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_eq!(left.summary["robots_alive"], 50);
    let unwatched = Run::of("swarmbots", &["--engine", "in-process", "--duration", "40"]);
    assert_eq!(left.digest(), unwatched.digest());
}

#[test]
fn in_real_time_a_silent_agent_is_named() {
    let args = ["--mode", "realtime", "--duration", "60", "--set", "processes.hang_timeout_s=60"];
    let run = LiveRun::start("swarmbots", &args);
    run.wait_until_moving();
    let agent = run.agents()[&17];
    time_until_named(&run, agent);
    let output = top_once(&run);
    let named = format!("silent: robot 17 (pid {}, stopped)", agent.as_raw_pid());
    assert!(stdout(&output).contains(&named), "{}", said(&output));
    signal(agent, Signal::CONT);
    signal(run.supervisor(), Signal::TERM);
    let (output, left) = run.finish();
    assert_eq!(output.status.code(), Some(143), "{}", said(&output));
    assert_eq!(left.unwrap().summary["incidents"], Value::Array(Vec::new()), "nobody was given up");
}

#[test]
fn a_run_that_gathers_names_who_is_missing() {
    let run = LiveRun::start("swarmbots", &["--by-hand", "3", "--duration", "1"]);
    wait_until("robot 3 alone is missing", || {
        let output = top_once(&run);
        let text = stdout(&output);
        text.contains("the run waits for the agent of robot 3 since") && text.contains("robots join")
    });
    let mut agent = run.agent(3);
    let (output, _) = run.finish();
    assert!(output.status.success() && agent.wait().unwrap().success(), "{}", said(&output));
}

#[test]
fn an_arena_that_does_not_answer_is_named() {
    let run = LiveRun::start("swarmbots", &["--speed", "10", "--duration", "2000"]);
    run.wait_until_moving();
    let arena = run.arena().unwrap();
    signal(arena, Signal::STOP);
    let output = top_once(&run);
    signal(arena, Signal::CONT);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("the arena has not answered for 2."), "{}", said(&output));
    signal(run.supervisor(), Signal::TERM);
    run.finish();
}

#[test]
fn who_asks_for_a_run_that_is_not_there_is_told_which_are() {
    let run = LiveRun::start("swarmbots", &["--speed", "10", "--duration", "2000"]);
    run.wait_until_moving();
    let output = lamplight(["top", "nobody"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    let said = said(&output);
    assert!(said.contains("no run named `nobody` is alive; alive: ") && said.contains(&run.name), "{said}");
    signal(run.supervisor(), Signal::TERM);
    run.finish();
}

#[test]
fn whoever_watches_leaves_when_the_terminal_is_closed() {
    let run = LiveRun::start("swarmbots", &["--speed", "10", "--duration", "2000"]);
    run.wait_until_moving();
    let mut ours =
        File::from(openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap());
    unlockpt(&ours).unwrap();
    tcsetwinsize(&ours, Winsize { ws_row: 40, ws_col: 120, ws_xpixel: 0, ws_ypixel: 0 }).unwrap();
    let path = ptsname(&ours, Vec::new()).unwrap();
    let theirs = File::options().read(true).write(true).open(path.to_str().unwrap()).unwrap();
    let top = lamplight(["top", &run.name]);
    // A session of its own, with that terminal: its hangup is what tells.
    let mut watcher = Command::new("setsid")
        .arg("--ctty")
        .arg(top.get_program())
        .args(top.get_args())
        .stdin(theirs.try_clone().unwrap())
        .stdout(theirs)
        .spawn()
        .unwrap();
    let (mut shown, mut part) = (String::new(), [0; 4096]);
    while !shown.contains("robots") {
        let read = ours.read(&mut part).unwrap();
        shown.push_str(&String::from_utf8_lossy(&part[..read]));
    }
    assert_eq!(watcher.try_wait().unwrap(), None, "it goes on watching");
    drop(ours);
    let closed = Instant::now();
    while watcher.try_wait().unwrap().is_none() && closed.elapsed() < Duration::from_secs(30) {
        thread::sleep(Duration::from_millis(10));
    }
    let left = watcher.try_wait().unwrap();
    let _ = watcher.kill();
    assert!(left.is_some(), "it watches on without a terminal");
    signal(run.supervisor(), Signal::TERM);
    run.finish();
}

#[test]
fn a_port_in_use_is_an_error_before_anything_is_started() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    for engine in ["processes", "in-process"] {
        let mut command = lamplight(["run", "--engine", engine, "--metrics", &address]);
        let output = command.arg(scenario("swarmbots")).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains(&format!("--metrics {address}: ")), "{}", said(&output));
        assert!(said(&output).contains("in use"), "{}", said(&output));
    }
}

/// A run in process that serves metrics, and where.
fn in_process() -> (Child, String) {
    let args = ["run", "--engine", "in-process", "--speed", "10", "--duration", "2000", "--metrics", ":0"];
    let mut child = lamplight(args)
        .arg(scenario("swarmbots"))
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let address = address(&heard(child.stderr.as_mut().unwrap(), "metrics at"));
    (child, address)
}

#[test]
fn metrics_are_served_while_64_idle_and_half_open_connections_stay() {
    let (mut child, address) = in_process();
    let connect = |request: &str| {
        let mut stream = TcpStream::connect(&address).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        stream
    };
    let waiting: Vec<_> = (0..64).map(|at| connect(if at % 2 == 0 { "" } else { "GET /met" })).collect();
    for _ in 0..3 {
        let text = scrape(&address);
        for reason in ["late", "crowded_out"] {
            let key = format!("lamplight_clients_dropped_total{{reason=\"{reason}\"}}");
            assert_eq!(sample(&text, &key), Some(0.0), "{text}");
        }
    }
    // Nobody had to be sent away for that.
    for stream in waiting {
        stream.set_nonblocking(true).unwrap();
        assert_eq!((&stream).read(&mut [0]).unwrap_err().kind(), ErrorKind::WouldBlock);
    }
    signal(Pid::from_child(&child), Signal::TERM);
    assert_eq!(child.wait().unwrap().code(), Some(143));
}

#[test]
fn a_run_in_process_serves_metrics_too() {
    let (mut child, address) = in_process();
    wait_until("ticks pass", || sample(&scrape(&address), "lamplight_ticks_total").unwrap() > 3.0);
    let text = scrape(&address);
    signal(Pid::from_child(&child), Signal::TERM);
    assert_eq!(child.wait().unwrap().code(), Some(143));
    assert_eq!(sample(&text, "lamplight_robots{standing=\"present\"}"), Some(50.0), "{text}");
    assert!(sample(&text, "lamplight_tick_duration_seconds{quantile=\"0.5\"}").unwrap() > 0.0, "{text}");
    assert_eq!(sample(&text, "lamplight_agent_cycle_duration_seconds_count"), None, "nobody measures");
}
