//! Names that a scenario gives to what is made of it.

/// The scenario's name, as far as the name of a run or of a file can hold it: at most 40 letters, digits, `-`
/// and `_`.
pub(crate) fn plain(scenario_name: &str) -> String {
    let clean = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    scenario_name.chars().map(clean).take(40).collect()
}
