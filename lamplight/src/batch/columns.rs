//! Columns of `trials.csv`.

/// Columns of `trials.csv` before those of the sweeps.
pub(super) const KEYS: [&str; 4] = ["setting", "trial", "seed", "robots"];
/// Columns of `trials.csv` that name no sweep.
pub(super) const COLUMNS: [&str; 36] = [
    "setting",
    "trial",
    "seed",
    "robots",
    "ended",
    "ticks",
    "virtual_time_s",
    "mean_below_1e-3_s",
    "mean_below_1e-4_s",
    "mean_below_1e-5_s",
    "mean_below_1e-6_s",
    "mean_below_1e-7_s",
    "max_below_1e-3_s",
    "max_below_1e-4_s",
    "max_below_1e-5_s",
    "max_below_1e-6_s",
    "max_below_1e-7_s",
    "mean_error_m",
    "max_error_m",
    "mean_true_error_m",
    "cost_h",
    "exact_cost_h",
    "cell_agreement",
    "mean_peak_distance_m",
    "mean_lamp_distance_m",
    "robots_alive",
    "robots_paused",
    "robots_silent",
    "robots_without_error",
    "robots_with_open_cell",
    "robots_without_mass",
    "packets_in_range",
    "packets_heard",
    "always_broken",
    "sometimes_unreached",
    "digest",
];
/// How a trial ended that lost agents which nobody planned to lose, each time it was played.
pub(super) const LOST_AGENTS: &str = "lost-agents";
