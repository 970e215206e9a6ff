//! Notes: numbers that a controller tells to those who watch. They are in no packet, and change nothing in a run.

use alloc::{borrow::ToOwned, string::String, vec::Vec};

use crate::controller::Controller;

/// Most notes of a robot.
pub const NOTES_MAX: usize = 16;
/// Longest name of a note, in bytes.
pub const NOTE_NAME_BYTES_MAX: usize = 32;

/// The notes of one robot: their names as they were when it booted, and their values now. Empty, it has no memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Notes {
    names: Vec<String>,
    values: Vec<f64>,
}

/// Why a controller's notes are refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotesError {
    /// More than [`NOTES_MAX`].
    #[error("a controller has {0} notes, at most {NOTES_MAX} are shown")]
    Many(usize),
    /// Empty, too long, or with something in it that is no character to be read.
    #[error(
        "a note's name is `{0}`: it must have 1 to {NOTE_NAME_BYTES_MAX} bytes and no control characters"
    )]
    Name(String),
}

impl Notes {
    /// The notes of a controller that has just booted.
    pub fn of(controller: &impl Controller) -> Result<Self, NotesError> {
        let mut names = Vec::new();
        controller.notes(&mut |name, _| names.push(name.to_owned()));
        let mut notes = Self::named(names)?;
        notes.update(controller);
        Ok(notes)
    }

    /// Notes of these names without values.
    pub fn named(names: Vec<String>) -> Result<Self, NotesError> {
        let is_name = |name: &&String| {
            (1..=NOTE_NAME_BYTES_MAX).contains(&name.len()) && !name.chars().any(char::is_control)
        };
        match names.iter().find(|name| !is_name(name)) {
            _ if names.len() > NOTES_MAX => Err(NotesError::Many(names.len())),
            Some(name) => Err(NotesError::Name(name.clone())),
            None => Ok(Self { names, values: Vec::new() }),
        }
    }

    /// Asks `controller` for the values of now.
    #[inline]
    pub fn update(&mut self, controller: &impl Controller) {
        let Self { names, values } = self;
        values.clear();
        if names.is_empty() {
            return;
        }
        controller.notes(&mut |_, value| values.extend((values.len() < names.len()).then_some(value)));
    }

    /// Takes the values of now, in the order of the names.
    pub fn set(&mut self, values: &[f64]) {
        self.values.clear();
        self.values.extend(values.iter().take(self.names.len()));
    }

    /// Names, in the order in which the controller tells them.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Values of now, in the same order.
    pub fn values(&self) -> &[f64] {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use std::{format, string::ToString};

    use super::*;
    use crate::{command::Command, controller::StageObserver, percept::Percept};

    /// Notes how many percepts it has had under so many names.
    struct Counter(usize, f64);

    impl Controller for Counter {
        fn boot(&mut self) -> Command {
            Command::REST
        }

        fn step(&mut self, _: &Percept, _: &mut dyn StageObserver) -> Command {
            self.1 += 1.0;
            Command::REST
        }

        fn notes(&self, note: &mut dyn FnMut(&str, f64)) {
            for at in 0..self.0 {
                note(&format!("count {at}"), self.1 + at as f64);
            }
        }
    }

    #[test]
    fn names_are_asked_for_once_and_values_each_time() {
        let mut counter = Counter(2, 0.0);
        let mut notes = Notes::of(&counter).unwrap();
        assert_eq!(
            (notes.names(), notes.values()),
            (&["count 0".to_string(), "count 1".to_string()][..], &[0.0, 1.0][..])
        );
        counter.step(&Percept::empty(0), &mut ());
        notes.update(&counter);
        assert_eq!(notes.values(), [1.0, 2.0]);
        counter.0 = 5;
        notes.update(&counter);
        assert_eq!(notes.values(), [1.0, 2.0], "what had no name has none later");
    }

    #[test]
    fn too_many_notes_and_names_that_cannot_be_read_are_refused() {
        assert_eq!(Notes::of(&Counter(17, 0.0)), Err(NotesError::Many(17)));
        for name in ["", "a\nb", &"x".repeat(33)] {
            assert_eq!(Notes::named([name.to_string()].into()), Err(NotesError::Name(name.to_string())));
        }
    }
}
