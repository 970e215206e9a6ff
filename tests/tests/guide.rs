//! The guides are true: every example of the one to faults runs, and ends with the lines that it shows
//! (`UPDATE_EXPECT=1` writes what they are now), and the tests that they name are there.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{env, fs, path::Path};

use tests::programs::{lamplight, said};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const GUIDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/faults.md");
/// How a paragraph begins that names tests: `` `path`: `test`, `test`; `path`: `test` ``.
const HELD: &str = "Held by ";
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
        .current_dir(ROOT)
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
    assert!(examples >= scenario::FaultKind::ALL.len(), "an example for each kind, not {examples}");
    for kind in scenario::FaultKind::ALL {
        assert!(guide.contains(&format!("### `{}`: ", kind.name())), "no section about {}", kind.name());
    }
    if env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(GUIDE, &fresh).unwrap();
    } else {
        assert_eq!(fresh, guide, "set UPDATE_EXPECT=1 to write what the examples show now");
    }
}

#[test]
fn a_packet_that_comes_after_its_sender_is_forgotten_is_warned_of_as_the_guide_says() {
    let guide = fs::read_to_string(GUIDE).unwrap();
    let command = guide.lines().find(|line| line.contains("kind = \"delay\"")).unwrap();
    let output = lamplight(words(command).into_iter().skip(1))
        .args(["--engine", "in-process", "--set", "duration_s=101"])
        .current_dir(ROOT)
        .output()
        .unwrap();
    for told in
        ["packets come up to 1.5 s late", "forgotten after 0.4 s", "with 16 it is remembered until then"]
    {
        assert!(said(&output).contains(told), "{told}: {}", said(&output));
    }
}

/// Whether a test of this name is in the text of its file.
fn is_there(test: &str, text: &str) -> bool {
    let at = text.find(&format!("fn {test}("));
    at.is_some_and(|at| text[..at].lines().rev().take(3).any(|line| line.trim() == "#[test]"))
}

/// Words in back quotes.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

#[test]
fn every_section_of_the_guides_names_tests_that_are_there() {
    for guide in ["docs/physics.md", "docs/faults.md"] {
        let text = fs::read_to_string(Path::new(ROOT).join(guide)).unwrap();
        let mut named = 0;
        for held in text.split("\n\n").filter(|paragraph| paragraph.starts_with(HELD)) {
            let mut file = None;
            for word in quoted(held) {
                if word.ends_with(".rs") {
                    let found = fs::read_to_string(Path::new(ROOT).join(word));
                    file = Some(found.unwrap_or_else(|error| panic!("{guide}: {word}: {error}")));
                } else {
                    let file = file.as_ref().unwrap_or_else(|| panic!("{guide}: `{word}` is in no file"));
                    assert!(is_there(word, file), "{guide}: no test `{word}` where it is said to be: {held}");
                    named += 1;
                }
            }
        }
        assert!(named > 20, "{guide} names {named} tests");
        for section in text.split("\n## ").skip(1).flat_map(|section| section.split("\n### ")) {
            let title = section.lines().next().unwrap_or_default();
            let is_held = section.split("\n\n").any(|paragraph| paragraph.starts_with(HELD));
            let is_only_a_title = section.lines().skip(1).all(str::is_empty);
            assert!(is_held || is_only_a_title, "{guide}, {title}: nothing is said to hold it");
        }
    }
}
