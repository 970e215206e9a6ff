//! Acts upon a run under way, as changes of its fault plan.
//!
//! An act begins a fault, or ends one, at a tick. So a run with its acts is a scenario like any other, which can be kept
//! and played again.

use serde_json::{Map, Value};

use crate::error::ScenarioError;
use crate::fault::kind::FaultKind;
use crate::number::NonNegative;
use crate::scenario::Scenario;

/// Why an act is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ActError(String);

impl From<ScenarioError> for ActError {
    /// Without the line: nobody has written the file.
    fn from(error: ScenarioError) -> Self {
        Self(error.hint.map_or(error.message.clone(), |hint| format!("{} ({hint})", error.message)))
    }
}

impl Scenario {
    /// Returns the same scenario with one more fault, which begins at `tick`. `table` has the keys that a `[[fault]]` has, but
    /// for the one that says when it begins.
    ///
    /// # Errors
    /// If a scenario could not have such a fault.
    pub fn with_fault(&self, table: &Map<String, Value>, tick: u64) -> Result<Self, ActError> {
        let kind = table.get("kind").ok_or_else(|| ActError("the fault has no `kind`".into()))?;
        let kind: FaultKind =
            serde_json::from_value(kind.clone()).map_err(|error| ActError(format!("kind: {error}")))?;
        let (begins, _) = kind.nature().window();
        if table.contains_key(begins) {
            return Err(ActError(format!("`{begins}` is when the act comes: leave it out")));
        }
        let mut fault = toml::Table::try_from(table).map_err(|error| ActError(error.to_string()))?;
        fault.insert(begins.into(), self.time_of(tick).into());
        let text = self.to_toml();
        let mut file: toml::Table = text.parse().expect("a scenario is written as TOML");
        let plan = file.entry("fault").or_insert_with(|| toml::Value::Array(Vec::new()));
        plan.as_array_mut().expect("a plan is an array of faults").push(fault.into());
        let scenario = Self::parse(&self.name, &file.to_string(), &[])?;
        match scenario.fault.last().map(|fault| self.tick_at(fault.begins_s())) {
            Some(begins) if begins == tick => Ok(scenario),
            _ => Err(ActError(format!("tick {tick} is not a time that a fault can begin at"))),
        }
    }

    /// Returns the same scenario in which fault `index` ends with `tick`: who was killed is restarted then.
    ///
    /// # Errors
    /// If there is no such fault, or it is not at work then.
    pub fn with_fault_ended(&self, index: usize, tick: u64) -> Result<Self, ActError> {
        let refuse = |why: &str| Err(ActError(format!("fault {index} {why}")));
        let Some(fault) = self.fault.get(index) else {
            return Err(ActError(format!("there is no fault {index}; the plan has {}", self.fault.len())));
        };
        let ends = fault.ends_s().map_or(u64::MAX, |ends_s| self.tick_at(ends_s));
        if self.tick_at(fault.begins_s()) >= tick {
            return refuse("has not begun");
        }
        if ends <= tick {
            return refuse("is over");
        }
        if fault.nature().window().1.is_none() {
            return refuse("cannot be ended: what it did is done");
        }
        let mut scenario = self.clone();
        scenario.fault[index].window.until_s = NonNegative::try_from(self.time_of(tick)).ok();
        Ok(scenario)
    }
}
