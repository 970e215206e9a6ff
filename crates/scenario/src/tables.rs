//! Names of the tables of a scenario file.

/// Every table at the top of a scenario file.
pub(crate) const TABLES: [&str; 11] = [
    "arena",
    "robots",
    "field",
    "light",
    "sensors",
    "controller",
    "channel",
    "convergence",
    "processes",
    "output",
    "fuzz",
];
