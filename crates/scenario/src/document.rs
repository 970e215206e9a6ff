//! A scenario file as a TOML tree that knows where each key and value was written.
//!
//! Spans count bytes in one text: the file, then one line per override. So a later stage that refuses a
//! value need not know whether the file or the command line gave it; its span does.

use std::borrow::Cow;
use std::ops::Range;
use std::{iter, mem};

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Error, ValueDeserializer};

use super::error::{Place, ScenarioError};
use super::overrides::Override;
use super::problem::{Problem, problem};
use super::tables::TABLES;

/// The table that may be several.
const MAY_BE_ARRAY: &str = "controller";

/// In the path of an override: every entry of an array.
const EVERY: &str = "*";

type Span = Range<usize>;
type Node<'a> = Spanned<DeValue<'a>>;

/// A TOML tree with the origin of each value.
pub(super) struct Document<'a> {
    source: Source<'a>,
    root: Node<'a>,
}

impl<'a> Document<'a> {
    /// The tree of a file's text, changed by the overrides in their order.
    pub(super) fn parse(
        name: &'a str,
        text: &'a str,
        overrides: &'a [Override],
    ) -> Result<Self, ScenarioError> {
        let source = Source { name, text, overrides };
        let table = DeTable::parse(text).map_err(|error| syntax(&error, &source))?;
        let mut root = Spanned::new(table.span(), DeValue::Table(table.into_inner()));
        for (start, entry) in source.override_starts() {
            apply(&mut root, entry, start).map_err(|Problem { message, hint, .. }| ScenarioError {
                place: Place::Override(entry.spelling().into()),
                message,
                hint,
            })?;
        }
        Ok(Self { source, root })
    }

    /// The tree as a value, or serde's reason.
    pub(super) fn value<T: DeserializeOwned>(&self) -> Result<T, Error> {
        T::deserialize(ValueDeserializer::from(self.root.clone()))
    }

    /// The part of the table at a path with the keys that `keep` keeps, or serde's reason.
    pub(super) fn part<T: DeserializeOwned>(
        &self,
        path: &str,
        keep: impl Fn(&str) -> bool,
    ) -> Result<T, Error> {
        let node = path.split('.').try_fold(&self.root, child).unwrap_or(&self.root);
        let part = match node.get_ref() {
            DeValue::Table(table) => {
                let kept = table.iter().filter(|(key, _)| keep(key.get_ref()));
                DeValue::Table(kept.map(|(key, value)| (key.clone(), value.clone())).collect())
            }
            other => other.clone(),
        };
        T::deserialize(ValueDeserializer::from(Spanned::new(node.span(), part)))
    }

    /// The keys of the table at a path.
    pub(super) fn keys(&self, path: &str) -> Vec<String> {
        let node = path.split('.').try_fold(&self.root, child);
        let table = node.and_then(|node| node.get_ref().as_table()).into_iter().flatten();
        table.map(|(key, _)| key.get_ref().to_string()).collect()
    }

    /// How many entries of [`MAY_BE_ARRAY`] the command line has added, behind those of the file.
    pub(super) fn appended(&self) -> usize {
        self.source.overrides.iter().filter(|entry| entry.appends()).count()
    }

    /// How many entries the array at a path has; `None` if there is none.
    pub(super) fn entries(&self, path: &str) -> Option<usize> {
        let node = path.split('.').try_fold(&self.root, child)?;
        node.get_ref().as_array().map(|entries| entries.len())
    }

    /// Serde would read `[[channel]]` as a list of the fields of `[channel]`, and forget those to spare.
    pub(super) fn refuse_arrays_for_tables(&self) -> Result<(), ScenarioError> {
        let mut tables = TABLES
            .iter()
            .filter(|name| **name != MAY_BE_ARRAY)
            .filter_map(|name| Some((name, child(&self.root, name)?)));
        match tables.find(|(_, node)| node.get_ref().is_array()) {
            None => Ok(()),
            Some((name, array)) => Err(ScenarioError {
                place: self.place(&array.span()),
                message: format!("expected one table [{name}], found an array"),
                hint: None,
            }),
        }
    }

    /// A problem together with its place.
    pub(super) fn blame(&self, problem: Problem) -> ScenarioError {
        let places = problem.paths.iter().map(|path| self.source.place(&self.nearest(path)));
        let place = places
            .reduce(|first, next| match (&first, &next) {
                (Place::Override(_), _) => first,
                (_, Place::Override(_)) => next,
                _ => first,
            })
            .unwrap_or_else(|| Place::File(self.source.name.into()));
        ScenarioError { place, message: problem.message, hint: problem.hint }
    }

    /// Where a span of the tree was written.
    pub(super) fn place(&self, span: &Span) -> Place {
        self.source.place(span)
    }

    /// Where the value at a path was written, or the innermost table that would hold it.
    pub(super) fn place_of(&self, path: &str) -> Place {
        self.source.place(&self.nearest(path))
    }

    /// Where the value at a path was written, if it was.
    pub(super) fn place_of_given(&self, path: &str) -> Option<Place> {
        let node = path.split('.').try_fold(&self.root, child)?;
        Some(self.source.place(&node.span()))
    }

    /// The override that a span was written in, if it was in one.
    pub(super) fn override_at(&self, span: &Span) -> Option<&'a Override> {
        self.source.override_at(span)
    }

    /// The date or time with this span, if one is there: to serde it is a table.
    pub(super) fn date_at(&self, span: &Span) -> Option<String> {
        let path = path_of(&self.root, span)?;
        let node = path.iter().try_fold(&self.root, |node, key| child(node, key))?;
        match node.get_ref() {
            // The span may be that of its key.
            DeValue::Datetime(date) if node.span() == *span => Some(date.to_string()),
            _ => None,
        }
    }

    /// The path, joined by dots, of the key or value with this span; empty for the whole document.
    pub(super) fn path_of(&self, span: &Span) -> String {
        path_of(&self.root, span).unwrap_or_default().join(".")
    }

    /// Span of the value at a path, or of the innermost table that would hold it.
    fn nearest(&self, path: &str) -> Span {
        let nodes = path.split('.').scan(&self.root, |node, key| {
            *node = child(node, key)?;
            Some(*node)
        });
        nodes.last().unwrap_or(&self.root).span()
    }
}

/// Where the tree comes from: a file and the overrides behind it.
pub(super) struct Source<'a> {
    name: &'a str,
    text: &'a str,
    overrides: &'a [Override],
}

impl<'a> Source<'a> {
    /// The text of the file at a span.
    pub(super) fn excerpt(&self, span: &Span) -> &'a str {
        self.text.get(span.clone()).unwrap_or_default()
    }

    /// Where a span was written.
    pub(super) fn place(&self, span: &Span) -> Place {
        match self.override_at(span) {
            Some(entry) => Place::Override(entry.spelling().into()),
            None if span.is_empty() && span.start == 0 => Place::File(self.name.into()),
            None => Place::Line(self.name.into(), self.line(span.start)),
        }
    }

    /// The override that a span was written in, if it was in one.
    fn override_at(&self, span: &Span) -> Option<&'a Override> {
        let before = self.override_starts().take_while(|(start, _)| *start <= span.start);
        before.last().map(|(_, entry)| entry)
    }

    /// Each override with the offset of its first byte behind the file.
    fn override_starts(&self) -> impl Iterator<Item = (usize, &'a Override)> + use<'a> {
        let first = self.text.len() + 1;
        let length = |entry: &Override| entry.path().len() + "=".len() + entry.value().len() + "\n".len();
        self.overrides.iter().scan(first, move |next, entry| {
            let start = *next;
            *next += length(entry);
            Some((start, entry))
        })
    }

    /// The line of a byte, counted from 1.
    fn line(&self, offset: usize) -> usize {
        1 + self.text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
    }
}

/// Changes the tree as an override says, whose first byte counts as byte `start`.
fn apply<'a>(root: &mut Node<'a>, entry: &'a Override, start: usize) -> Result<(), Problem> {
    let value = match entry.value() {
        "" => None,
        text => Some(value_node(text, start + entry.path().len() + "=".len())),
    };
    match value {
        Some(value) if entry.appends() => {
            append(child_or_table(root, entry.path(), start..start + entry.path().len())?, value);
            Ok(())
        }
        value => set(root, entry.path(), 0, start, value.as_ref()),
    }
}

/// Adds an entry to the array that a node is, or becomes with what it was as its first entry.
fn append<'a>(node: &mut Node<'a>, entry: Node<'a>) {
    if let DeValue::Array(entries) = node.get_mut() {
        return entries.push(entry);
    }
    let span = node.span();
    let before = mem::replace(node, Spanned::new(span, DeValue::Array(DeArray::new())));
    let DeValue::Array(entries) = node.get_mut() else { unreachable!("it is one now") };
    let is_anything = before.get_ref().as_table().is_none_or(|table| !table.is_empty());
    is_anything.then_some(before).into_iter().chain([entry]).for_each(|entry| entries.push(entry));
}

/// Sets what is below `node` at the rest of a path from `at` on, or removes it. The path was written at byte `start`.
fn set<'a>(
    node: &mut Node<'a>,
    path: &'a str,
    at: usize,
    start: usize,
    value: Option<&Node<'a>>,
) -> Result<(), Problem> {
    let rest = &path[at..];
    let (key, below) = match rest.split_once('.') {
        Some((key, _)) => (key, Some(at + key.len() + ".".len())),
        None => (rest, None),
    };
    let change = |node: &mut Node<'a>| match (below, value) {
        (Some(below), _) => set(node, path, below, start, value),
        (None, Some(value)) => {
            *node = value.clone();
            Ok(())
        }
        (None, None) => Ok(()),
    };
    match node.get_mut() {
        _ if below.is_none() && value.is_none() => remove(node, key),
        DeValue::Array(entries) if entries.is_empty() => {
            Err(no_entry(path[..at].trim_end_matches('.'), rest))
        }
        DeValue::Array(entries) if key == EVERY => entries.iter_mut().try_for_each(change),
        _ => change(child_or_table(node, key, start + at..start + at + key.len())?),
    }
}

/// Why a text is not TOML.
fn syntax(error: &Error, source: &Source<'_>) -> ScenarioError {
    let span = error.span().unwrap_or_default();
    let message = match error.message() {
        "duplicate key" => format!("`{}` is given twice", source.excerpt(&span)),
        "string values must be quoted, expected literal string" => {
            "expected a value: a number, true, false, a \"quoted string\", an array or a table".into()
        }
        other => other.into(),
    };
    // Never empty: an empty span at the very start would mean the whole document.
    ScenarioError { place: source.place(&(span.start..span.start + 1)), message, hint: None }
}

/// Why an override cannot step into the array at a path by `rest`, an index and what is below.
pub(super) fn no_entry(array: &str, rest: &str) -> Problem {
    let (index, entry) = match rest.split_once('.') {
        Some((index, below)) => (index, format!("{{ {below} = ... }}")),
        None => (rest, "...".into()),
    };
    problem(&[], format!("there is no entry `{index}`: `{array}` is empty or not given"))
        .hint(format!("give the array whole: --set '{array}=[{entry}]'"))
}

/// The value of an override: TOML if it is, else a bare string.
fn value_node(text: &str, start: usize) -> Node<'_> {
    let value = DeValue::parse(text)
        .unwrap_or_else(|_| Spanned::new(0..text.len(), DeValue::String(Cow::Borrowed(text))));
    shifted(value, start)
}

/// The same tree, all spans moved by an offset.
fn shifted(node: Node<'_>, offset: usize) -> Node<'_> {
    let moved = |span: Span| span.start + offset..span.end + offset;
    let span = moved(node.span());
    let value = match node.into_inner() {
        DeValue::Array(entries) => {
            DeValue::Array(entries.into_iter().map(|entry| shifted(entry, offset)).collect())
        }
        DeValue::Table(table) => DeValue::Table(
            table
                .into_iter()
                .map(|(key, value)| {
                    (Spanned::new(moved(key.span()), key.into_inner()), shifted(value, offset))
                })
                .collect(),
        ),
        scalar => scalar,
    };
    Spanned::new(span, value)
}

fn child<'n, 'a>(node: &'n Node<'a>, key: &str) -> Option<&'n Node<'a>> {
    match node.get_ref() {
        DeValue::Table(table) => table.get(key),
        DeValue::Array(entries) => entries.get(key.parse::<usize>().ok()?),
        _ => None,
    }
}

/// The child at a key, which a table gains as an empty table if it lacks it.
fn child_or_table<'n, 'a>(
    node: &'n mut Node<'a>,
    key: &'a str,
    span: Span,
) -> Result<&'n mut Node<'a>, Problem> {
    match node.get_mut() {
        DeValue::Table(table) => Ok(table
            .entry(Spanned::new(span.clone(), Cow::Borrowed(key)))
            .or_insert_with(|| Spanned::new(span, DeValue::Table(DeTable::new())))),
        DeValue::Array(entries) => {
            let length = entries.len();
            let entry = key.parse::<usize>().ok().and_then(|index| entries.get_mut(index));
            entry.ok_or_else(|| {
                problem(&[], format!("there is no entry `{key}` in an array of {length}"))
                    .hint("name an entry by its number from 0 on, or all of them by *")
            })
        }
        scalar => Err(problem(&[], format!("there is no `{key}` in a value of type {}", scalar.type_str()))),
    }
}

fn remove(node: &mut Node<'_>, key: &str) -> Result<(), Problem> {
    let removed = match node.get_mut() {
        DeValue::Table(table) => table.remove(key),
        _ => None,
    };
    removed.map(drop).ok_or_else(|| problem(&[], format!("there is no key `{key}` to remove")))
}

/// Children come before their parent: an array of tables shares its span with its first table.
fn path_of(node: &Node<'_>, span: &Span) -> Option<Vec<String>> {
    let below = |key: &str, value| {
        path_of(value, span).map(|path| iter::once(key.to_owned()).chain(path).collect::<Vec<_>>())
    };
    let found = match node.get_ref() {
        DeValue::Table(table) => table.iter().find_map(|(key, value)| {
            let name = key.get_ref();
            below(name, value).or_else(|| (key.span() == *span).then(|| vec![name.to_string()]))
        }),
        DeValue::Array(entries) => {
            entries.iter().enumerate().find_map(|(index, entry)| below(&index.to_string(), entry))
        }
        _ => None,
    };
    found.or_else(|| (node.span() == *span).then(Vec::new))
}
