//! The messages of the TOML parser and of serde in a user's words: a path, what is wrong, a way out.
//!
//! Serde names keys and types only in its message text, so this file reads that text; a test pins each form.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::de::Error;

use super::document::{Document, no_entry};
use super::error::{Place, ScenarioError};
use super::overrides::Override;
use super::problem::Problem;
use super::tables::TABLES;

/// Below this similarity (Jaro-Winkler, 0 to 1) a valid word is not what the user meant.
const SIMILAR: f64 = 0.8;
/// By how much the best word must beat the next to be suggested alone.
const CLEARLY: f64 = 0.03;

/// Serde's message about a table where an array is to be.
const NO_ARRAY: &str = "invalid type: map, expected a sequence";
/// Serde's message about a choice that is neither.
const NEITHER: &str = "wanted string or table";

impl Document<'_> {
    /// The tree as a value, or what the value's types say about the tree.
    pub(super) fn deserialize<T: DeserializeOwned>(&self) -> Result<T, ScenarioError> {
        self.refuse_arrays_for_tables()?;
        self.value().map_err(|error| refusal(&error, self))
    }

    /// The part of the table at a path with the keys that `keep` keeps.
    pub(super) fn read<T: DeserializeOwned>(
        &self,
        path: &str,
        keep: impl Fn(&str) -> bool,
    ) -> Result<T, ScenarioError> {
        self.part(path, keep).map_err(|error| refusal(&error, self))
    }
}

/// Why a TOML tree is not a scenario.
fn refusal(error: &Error, document: &Document<'_>) -> ScenarioError {
    let span = error.span().unwrap_or_default();
    let place = document.place(&span);
    let path = document.path_of(&span);
    let text = error.message();
    let (message, hint) = if let Some(date) = document.date_at(&span) {
        let message = format!("expected {}, found {date}, a date or a time to TOML", in_place_of_table(text));
        (prefixed(&place, &path, message), None)
    } else if let Some(key) = between(text, "missing field `", "`") {
        (missing(key, &path), None)
    } else if let Some((key, valid)) = unknown(text, "unknown field `") {
        let table = path.rsplit_once('.').map_or("", |(table, _)| table);
        let (guess, hint) = suggestion(key, &valid);
        (format!("unknown key `{}`{}{guess}", key.escape_debug(), in_table(table)), hint)
    } else if let Some((value, valid)) = unknown(text, "unknown variant `") {
        let (guess, hint) = suggestion(value, &valid);
        (prefixed(&place, &path, format!("unknown value `{}`{guess}", value.escape_debug())), hint)
    } else if let (NO_ARRAY, Some(rest)) = (text, rest_of_override(document, &span, &path)) {
        let Problem { message, hint, .. } = no_entry(&path, rest);
        (message, hint)
    } else {
        (prefixed(&place, &path, plain(text)), None)
    };
    let text_wanted = text.ends_with(", expected a string");
    let quoted =
        document.override_at(&span).filter(|entry| text_wanted && entry.path() == path).map(in_quotes);
    ScenarioError { place, message, hint: hint.or(quoted) }
}

/// Where an override goes on below a path.
fn rest_of_override<'a>(document: &Document<'a>, span: &Range<usize>, path: &str) -> Option<&'a str> {
    document.override_at(span)?.path().strip_prefix(path)?.strip_prefix('.')
}

/// How an override gives its value as text.
fn in_quotes(entry: &Override) -> String {
    format!("in quotes it is text: --set '{}=\"{}\"'", entry.path(), entry.value())
}

fn missing(key: &str, table: &str) -> String {
    if table.is_empty() && TABLES.contains(&key) {
        format!("the table [{key}] is missing")
    } else {
        format!("`{key}` is missing{}", in_table(table))
    }
}

/// Which of the valid words was meant, as the end of a message; or all of them, as a hint.
pub(super) fn suggestion(word: &str, valid: &[&str]) -> (String, Option<String>) {
    let mut ranked: Vec<_> = valid.iter().map(|v| (strsim::jaro_winkler(word, v), *v)).collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    match ranked[..] {
        [(best, guess), ref rest @ ..]
            if best >= SIMILAR && rest.first().is_none_or(|next| best - next.0 >= CLEARLY) =>
        {
            (format!("; did you mean `{guess}`?"), None)
        }
        _ => (String::new(), Some(format!("one of `{}`", valid.join("`, `")))),
    }
}

/// An override shows its own path.
fn prefixed(place: &Place, path: &str, message: String) -> String {
    match place {
        Place::Override(_) => message,
        Place::File(_) | Place::Line(..) if path.is_empty() => message,
        Place::File(_) | Place::Line(..) => format!("{path}: {message}"),
    }
}

/// ` in [channel]`, ` in [[field.lamp]]`, or nothing for the top of the file.
fn in_table(path: &str) -> String {
    match path.rsplit_once('.') {
        Some((array, index)) if index.parse::<usize>().is_ok() => format!(" in [[{array}]]"),
        _ if path.is_empty() => String::new(),
        _ => format!(" in [{path}]"),
    }
}

/// The word that serde does not know, and those it does.
fn unknown<'m>(message: &'m str, start: &str) -> Option<(&'m str, Vec<&'m str>)> {
    let (word, valid) = message.strip_prefix(start)?.rsplit_once("`, expected ")?;
    Some((word, valid.split('`').skip(1).step_by(2).collect()))
}

/// Serde's message about a type, without the names of Rust's types; any other message as it is.
fn plain(message: &str) -> String {
    let found = ["invalid type: ", "invalid value: "].iter().find_map(|start| message.strip_prefix(start));
    match found.and_then(|rest| rest.rsplit_once(", expected ")) {
        Some((found, expected)) => format!("expected {}, found {}", expectation(expected), finding(found)),
        None if message == NEITHER => "expected a string".into(),
        None => message.into(),
    }
}

/// The type that serde expected where it found a table.
fn in_place_of_table(message: &str) -> &str {
    match message.strip_prefix("invalid type: map, expected ") {
        Some(expected) => expectation(expected),
        None if message == NEITHER => "a string",
        // It looked into it.
        None => "a table",
    }
}

fn expectation(expected: &str) -> &str {
    match expected {
        "f64" => "a number",
        "i128" => "a whole number",
        "u32" => "a whole number from 0 to 4294967295",
        "a nonzero u32" => "a whole number from 1 to 4294967295",
        "a boolean" => "true or false",
        "a sequence" => "an array",
        "a map" => "a table",
        _ if expected.starts_with("struct ") => "a table",
        other => other,
    }
}

fn finding(found: &str) -> &str {
    match found.strip_suffix(" as i128").unwrap_or(found) {
        "map" => "a table",
        "sequence" => "an array",
        other => other.strip_prefix("floating point ").unwrap_or(other),
    }
}

fn between<'m>(text: &'m str, start: &str, end: &str) -> Option<&'m str> {
    text.strip_prefix(start)?.strip_suffix(end)
}
