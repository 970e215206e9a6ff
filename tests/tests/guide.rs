//! The guide to faults is true: every example in it runs, and ends with the lines that it shows.
//! `UPDATE_EXPECT=1` writes what they are now.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{env, fs, path::Path};

use tests::programs::{lamplight, said};

const GUIDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/faults.md");
/// Between a command and what it shows.
const BETWEEN: &str = "\n```\n```text\n";

/// Words of a command line; single quotes keep spaces.
fn words(command: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (at, part) in command.split('\'').enumerate() {
        match at % 2 {
            0 => words.extend(part.split_whitespace().map(str::to_owned)),
            _ => words.push(part.to_owned()),
        }
    }
    words
}

/// The ledger that a run of the guide ends with.
fn ledger_of(command: &str) -> String {
    let mut words = words(command).into_iter();
    assert_eq!(words.next().as_deref(), Some("lamplight"));
    let output = lamplight(words)
        .args(["--engine", "in-process", "--quiet", "--strict-faults"])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .output()
        .unwrap();
    assert!(output.status.success(), "{command}: {}", said(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().filter(|line| line.starts_with("fault ")).collect::<Vec<_>>().join("\n")
}

#[test]
fn every_example_ends_as_the_guide_shows() {
    let guide = fs::read_to_string(GUIDE).unwrap();
    let mut fresh = String::new();
    let mut rest = guide.as_str();
    let mut examples = 0;
    while let Some(at) = rest.find(BETWEEN) {
        let (before, after) = (&rest[..at], &rest[at + BETWEEN.len()..]);
        let command = before.lines().last().unwrap();
        let end = after.find("\n```").unwrap();
        fresh += before;
        fresh += BETWEEN;
        fresh += &ledger_of(command);
        rest = &after[end..];
        examples += 1;
    }
    fresh += rest;
    assert!(examples >= arena::scenario::FaultKind::ALL.len(), "an example for each kind, not {examples}");
    for kind in arena::scenario::FaultKind::ALL {
        assert!(guide.contains(&format!("### `{}`: ", kind.name())), "no section about {}", kind.name());
    }
    if env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(GUIDE, &fresh).unwrap();
    } else {
        assert_eq!(fresh, guide, "set UPDATE_EXPECT=1 to write what the examples show now");
    }
}
