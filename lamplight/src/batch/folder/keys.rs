//! The fields by which a row is known to be a trial's.

use super::super::plan::Trial;

/// Fields that tell a trial apart in every file.
pub(super) fn keys(trial: &Trial<'_>) -> Vec<String> {
    vec![trial.setting.to_string(), trial.trial.to_string()]
}

/// The first fields of a trial's row: [`KEYS`](super::super::columns::KEYS) and the swept values.
pub(super) fn keys_of_row(trial: &Trial<'_>) -> Vec<String> {
    let mut keys = keys(trial);
    keys.extend([trial.scenario.seed.to_string(), trial.scenario.robot_count().to_string()]);
    keys.extend(trial.of.values.iter().cloned());
    keys
}
