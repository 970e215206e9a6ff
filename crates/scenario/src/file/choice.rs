//! Keys that depend on the choice of another.

use serde::Serialize;

use crate::problem::{Problem, problem};

/// A key that the file gives and that means nothing beside the choice of another.
pub(super) fn without_meaning(path: &str, choice: &str, chosen: &str) -> Problem {
    problem(&[path, choice], format!("{path} has no meaning with {choice} = \"{chosen}\""))
        .hint(format!("remove it (on the command line: --set {path}=)"))
}

/// As the file spells it.
pub(super) fn spelled(choice: &impl Serialize) -> String {
    let value = toml::Value::try_from(choice).expect("a choice is a name");
    value.as_str().unwrap_or_default().to_owned()
}
