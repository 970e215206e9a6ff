//! The live page: who may see it, what it is told, what it may do, and that a run does not feel it.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    collections::BTreeMap,
    io::{BufRead, BufReader, Read, Write},
    net::{TcpListener, TcpStream},
    path::Path,
    process::{Child, Stdio},
    thread,
    time::Duration,
};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use tests::{
    live::LiveRun,
    programs::{lamplight, said, scenario},
};
use tungstenite::{Message, WebSocket, client::IntoClientRequest};

/// A page that somebody may open.
struct Address {
    host: String,
    token: String,
}

impl Address {
    /// Of the line that tells it: `page: http://HOST/?token=TOKEN`.
    fn of(line: &str) -> Self {
        let url = line.split("http://").nth(1).unwrap_or_else(|| panic!("{line}"));
        let (host, token) = url.trim().split_once("/?token=").unwrap();
        Self { host: host.into(), token: token.into() }
    }

    fn port(&self) -> &str {
        self.host.rsplit(':').next().unwrap()
    }

    fn cookie(&self) -> String {
        format!("lamplight_{}={}", self.port(), self.token)
    }

    /// Sends a request; returns the answer.
    fn ask(&self, path: &str, headers: &[(&str, &str)]) -> String {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        let headers: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        write!(stream, "GET {path} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn open(&self) -> Page {
        let mut request = format!("ws://{}/stream", self.host).into_client_request().unwrap();
        let headers = request.headers_mut();
        headers.insert("cookie", self.cookie().parse().unwrap());
        headers.insert("origin", format!("http://{}", self.host).parse().unwrap());
        let stream = TcpStream::connect(&self.host).unwrap();
        let (socket, _) = tungstenite::client(request, stream).unwrap();
        Page { socket, told: BTreeMap::new(), frames: Vec::new() }
    }
}

/// An open page.
struct Page {
    socket: WebSocket<TcpStream>,
    /// Messages that it was told last, by type.
    told: BTreeMap<String, Value>,
    frames: Vec<Frame>,
}

/// The head of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    sections: u32,
    tick: u64,
    robots: u32,
    first_x: f32,
}

impl Page {
    fn say(&mut self, what: &Value) {
        self.socket.send(Message::text(what.to_string())).unwrap();
    }

    /// Reads on until `is_so`.
    fn read_until(&mut self, mut is_so: impl FnMut(&Self) -> bool) {
        while !is_so(self) {
            match self.socket.read().unwrap() {
                Message::Text(text) => {
                    let told: Value = serde_json::from_str(&text).unwrap();
                    self.told.insert(told["type"].as_str().unwrap().into(), told);
                }
                Message::Binary(bytes) => {
                    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
                    assert_eq!(word(0), 1, "version");
                    assert_eq!(bytes.len() % 4, 0);
                    let tick = f64::from_le_bytes(bytes[8..16].try_into().unwrap()) as u64;
                    let (sections, robots, first_x) = (word(4), word(24), f32::from_bits(word(32)));
                    self.frames.push(Frame { sections, tick, robots, first_x });
                    self.say(&json!({ "type": "drawn" }));
                }
                other => panic!("{other:?}"),
            }
        }
    }

    /// Asks for an act; returns what has become of it.
    fn act(&mut self, act: &Value) -> Value {
        self.told.remove("done");
        self.say(&json!({ "type": "act", "id": 7, "act": act }));
        self.read_until(|page| page.told.contains_key("done"));
        self.told["done"].clone()
    }
}

fn page_of(run: &mut LiveRun) -> Address {
    Address::of(&run.hear("page: "))
}

#[test]
fn only_who_has_the_token_sees_the_page() {
    let mut run =
        LiveRun::start("swarmbots", &["--duration", "100", "--speed", "2", "--robots", "3", "--view"]);
    let page = page_of(&mut run);
    assert!(page.host.starts_with("127.0.0.1:"), "{}", page.host);
    let host = ("Host", page.host.as_str());
    let entered = page.ask(&format!("/?token={}", page.token), &[host]);
    assert!(entered.starts_with("HTTP/1.1 303"), "{entered}");
    assert!(
        entered.to_lowercase().contains("samesite=strict") && entered.contains(&page.cookie()),
        "{entered}"
    );
    let cookie = page.cookie();
    let shown = page.ask("/", &[host, ("Cookie", &cookie)]);
    assert!(shown.starts_with("HTTP/1.1 200") && shown.contains("<!doctype html>"), "{shown}");
    assert!(shown.to_lowercase().contains("content-security-policy: default-src 'self'"), "{shown}");
    let evil = format!("evil.example:{}", page.port());
    let origin = [host, ("Cookie", cookie.as_str()), ("Origin", "http://evil.example")];
    for (path, headers) in [
        ("/", &[host][..]),
        ("/style.css", &[host]),
        ("/stream", &[host]),
        ("/?token=", &[host]),
        ("/?token=0123456789abcdef0123456789abcdef", &[host]),
        ("/", &[("Host", &evil), ("Cookie", &cookie)]),
        ("/stream", &origin),
    ] {
        let answer = page.ask(path, headers);
        assert!(answer.starts_with("HTTP/1.1 403"), "{path}: {answer}");
    }
    let absent = page.ask("/../Cargo.toml", &[host, ("Cookie", &cookie)]);
    assert!(absent.starts_with("HTTP/1.1 404"), "{absent}");
    kill_process(run.supervisor(), Signal::INT).unwrap();
    run.finish();
}

#[test]
fn a_page_sees_the_swarm_think_and_acts_upon_it() {
    let mut run =
        LiveRun::start("swarmbots", &["--duration", "60", "--speed", "2", "--robots", "12", "--view=:0"]);
    let address = page_of(&mut run);
    let mut page = address.open();
    page.say(&json!({ "type": "show", "cells": true, "global": true, "edges": true }));
    page.read_until(|page| page.frames.len() > 5);
    page.read_until(|page| page.told.get("agents").is_some_and(|told| told["agents"][4]["pid"].is_u64()));
    let hello = &page.told["hello"];
    assert_eq!((&hello["robots"], &hello["source"]), (&json!(12), &json!("live")));
    assert_eq!(page.frames[5].robots, 12);
    assert_ne!(page.frames[0].first_x, page.frames[5].first_x, "they move");
    page.read_until(|page| page.frames.last().unwrap().sections == 15);
    let agents = page.told["agents"]["agents"].as_array().unwrap();
    assert_eq!(agents.len(), 12);
    page.say(&json!({ "type": "select", "robot": 4 }));
    page.read_until(|page| page.told.contains_key("robot"));
    let robot = &page.told["robot"];
    assert!(!robot["neighbors"].as_array().unwrap().is_empty(), "{robot}");
    assert!(robot["cell"]["area_m2"].as_f64().unwrap() > 0.0, "{robot}");
    let held = page.act(&json!({ "do": "pause" }));
    assert_eq!(held["ok"], true);
    let killed = page.act(&json!({ "do": "begin", "fault": { "kind": "kill", "robots": "4" } }));
    assert_eq!((&killed["ok"], &killed["tick"], &killed["fault"]), (&json!(true), &held["tick"], &json!(0)));
    let refused = page.act(&json!({ "do": "begin", "fault": { "kind": "kill", "robots": "99" } }));
    assert!(refused["error"].as_str().unwrap().contains("99"), "{refused}");
    let saved = page.act(&json!({ "do": "save" }));
    assert!(saved["text"].as_str().unwrap().contains("kind = \"kill\""));
    page.told.remove("events");
    page.act(&json!({ "do": "step", "ticks": 2 }));
    page.read_until(|page| {
        page.told.get("events").is_some_and(|events| events.to_string().contains("strikes"))
    });
    page.read_until(|page| page.told["faults"]["faults"][0]["fired_tick"] == held["tick"]);
    page.act(&json!({ "do": "speed", "factor": null }));
    page.act(&json!({ "do": "resume" }));
    page.read_until(|page| page.told["state"]["phase"] == "over");
    let summary = page.told["state"]["summary"]["text"].as_str().unwrap().to_owned();
    let (output, _files) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let ours: Value = serde_json::from_slice(&output.stdout).unwrap();
    let theirs: Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(theirs["digest"], ours["digest"]);
    assert_eq!(ours["faults"][0]["effects"]["robots killed"], 1);
}

#[test]
fn pages_that_misbehave_are_dropped_and_the_run_does_not_feel_it() {
    let digest = |view: &[&str]| {
        let args = [&["--duration", "20", "--robots", "30"], view].concat();
        let mut run = LiveRun::start("swarmbots", &args);
        let mut open = Vec::new();
        if !view.is_empty() {
            let address = page_of(&mut run);
            // Some never read.
            open.extend((0..20).map(|_| address.open()));
            for text in ["", "hello", "{\"type\":\"fly\"}", &"[".repeat(60_000), &"x".repeat(200_000)] {
                let mut page = address.open();
                // It may be closed while it is being written.
                let _ = page.socket.send(Message::text(text));
                while page.socket.read().is_ok() {}
            }
            let mut page = address.open();
            let _ = page.socket.send(Message::binary(vec![0; 100]));
            while page.socket.read().is_ok() {}
        }
        let (output, _files) = run.finish();
        assert!(output.status.success(), "{}", said(&output));
        let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
        summary["digest"].clone()
    };
    assert_eq!(digest(&["--view"]), digest(&[]));
}

#[test]
fn a_hundred_pages_are_a_bound_and_not_a_burden() {
    let mut run =
        LiveRun::start("swarmbots", &["--duration", "100", "--speed", "2", "--robots", "3", "--view"]);
    let address = page_of(&mut run);
    let mut open: Vec<Page> = (0..32).map(|_| address.open()).collect();
    let cookie = address.cookie();
    let headers = [
        ("Host", address.host.as_str()),
        ("Cookie", &cookie),
        ("Upgrade", "websocket"),
        ("Connection", "Upgrade"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
    ];
    for _ in 32..100 {
        let answer = address.ask("/stream", &headers);
        assert!(answer.starts_with("HTTP/1.1 503"), "{answer}");
    }
    open[31].read_until(|page| page.frames.len() > 2);
    open.truncate(5);
    // Those who have gone make room.
    let mut again = loop {
        let answer = address.ask("/style.css", &headers[..2]);
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
        thread::sleep(Duration::from_millis(100));
        let stream = TcpStream::connect(&address.host).unwrap();
        let mut request = format!("ws://{}/stream", address.host).into_client_request().unwrap();
        request.headers_mut().insert("cookie", cookie.parse().unwrap());
        if let Ok((socket, _)) = tungstenite::client(request, stream) {
            break Page { socket, told: BTreeMap::new(), frames: Vec::new() };
        }
    };
    again.read_until(|page| page.frames.len() > 2);
    kill_process(run.supervisor(), Signal::INT).unwrap();
    run.finish();
}

#[test]
fn an_address_that_is_taken_is_said_before_anything_begins() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let output = lamplight(["run", "--quiet"])
        .arg(scenario("swarmbots"))
        .arg(format!("--view={address}"))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(
        said(&output).contains(&address) && said(&output).contains("choose another port"),
        "{}",
        said(&output)
    );
    let output =
        lamplight(["run", "--view", "--engine", "in-process"]).arg(scenario("swarmbots")).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("replay --view"), "{}", said(&output));
}

/// A command that serves a page until it is told to end.
struct Serving {
    child: Child,
    address: Address,
}

impl Serving {
    fn start(args: &[&str], file: &Path) -> Self {
        let mut child = lamplight(args.iter().copied()).arg(file).stderr(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stderr.as_mut().unwrap()).read_line(&mut line).unwrap();
        Self { address: Address::of(&line), child }
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = kill_process(Pid::from_child(&self.child), Signal::INT);
        let _ = self.child.wait();
    }
}

#[test]
fn a_recording_plays_at_any_speed_from_any_time() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let recorded =
        lamplight(["run", "--quiet", "--engine", "in-process", "--record=full", "--duration", "20"])
            .args(["--set", "fault=[{ kind = \"kill\", at_s = 4, robots = \"5\" }]", "--out"])
            .arg(&out)
            .arg(scenario("swarmbots"))
            .output()
            .unwrap();
    assert!(recorded.status.success(), "{}", said(&recorded));
    let serving = Serving::start(&["replay", "--view"], &out.join("run.mcap"));
    let mut page = serving.address.open();
    page.say(&json!({ "type": "show", "cells": true, "global": false, "edges": false }));
    page.read_until(|page| page.frames.len() > 2);
    assert_eq!(page.told["hello"]["source"], "recording");
    assert_eq!(page.frames[2].robots, 50);
    assert_eq!(page.act(&json!({ "do": "pause" }))["ok"], true);
    let reaches = |page: &mut Page, tick: u64| {
        page.read_until(|page| page.frames.last().is_some_and(|frame| frame.tick == tick));
    };
    for (time_s, tick) in [(15.0, 150), (2.0, 20), (2.5, 25)] {
        assert_eq!(page.act(&json!({ "do": "seek", "time_s": time_s }))["ok"], true);
        reaches(&mut page, tick);
    }
    page.act(&json!({ "do": "speed", "factor": 100.0 }));
    page.act(&json!({ "do": "resume" }));
    reaches(&mut page, 200);
    let refused = page.act(&json!({ "do": "begin", "fault": { "kind": "kill", "robots": "4" } }));
    assert!(refused["error"].as_str().unwrap().contains("what has happened"), "{refused}");
}
