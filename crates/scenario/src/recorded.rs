//! Scenarios that somebody else has resolved: another version of this program, perhaps.

use toml::Value;

use super::error::{Place, ScenarioError};
use super::scenario::Scenario;

impl Scenario {
    /// Reads the scenario `text` that a run went by, written with every default: it must mean here what it meant there.
    ///
    /// # Errors
    /// If it is no scenario, or this program understands one of its keys otherwise, or knows others.
    pub fn recorded(name: &str, text: &str) -> Result<Self, ScenarioError> {
        let scenario = Self::parse(name, text, &[])?;
        let value = |text: &str| text.parse::<toml::Table>().map(Value::from).ok();
        let differs = match (value(text), value(&scenario.to_toml())) {
            (Some(theirs), Some(ours)) => difference(&theirs, &ours, ""),
            _ => None,
        };
        match differs {
            None => Ok(scenario),
            Some(key) => Err(ScenarioError {
                place: Place::File(name.into()),
                message: format!("this program understands `{key}` of the recorded scenario differently"),
                hint: Some("use the version of lamplight that has recorded it".into()),
            }),
        }
    }
}

/// The path of the first key in which two scenarios differ.
fn difference(theirs: &Value, ours: &Value, path: &str) -> Option<String> {
    let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match (theirs, ours) {
        (Value::Table(theirs), Value::Table(ours)) => {
            let changed = theirs.iter().find_map(|(key, value)| match ours.get(key) {
                Some(other) => difference(value, other, &below(key)),
                None => Some(below(key)),
            });
            changed.or_else(|| ours.keys().find(|key| !theirs.contains_key(*key)).map(|key| below(key)))
        }
        (Value::Array(theirs), Value::Array(ours)) if theirs.len() == ours.len() => {
            let mut pairs = theirs.iter().zip(ours).enumerate();
            pairs.find_map(|(at, (value, other))| difference(value, other, &below(&at.to_string())))
        }
        _ => (theirs != ours).then(|| path.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_resolved_elsewhere_must_mean_the_same_here() {
        let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 1]\nrobots.count = 3\nchannel.range_m = 1\n\
                    [controller]\nprogram = [\"beacon\"]\n";
        let resolved = Scenario::parse("s", text, &[]).unwrap().to_toml();
        assert_eq!(Scenario::recorded("s", &resolved).unwrap().to_toml(), resolved);
        let refused = |text: &str| Scenario::recorded("run.mcap", text).unwrap_err().to_string();
        // Without a key whose default may have been another one.
        let without: String = resolved
            .lines()
            .filter(|line| !line.starts_with("radius_m"))
            .map(|line| format!("{line}\n"))
            .collect();
        let words = refused(&without);
        assert!(words.contains("understands `robots.radius_m` of the recorded"), "{words}");
        assert!(refused(&resolved.replace("[robots]", "[robots]\nwings = 2")).contains("wings"));
    }
}
