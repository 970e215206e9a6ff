//! What `lamplight run` says at its end to a person.

use std::fmt::{self, Write};

use serde_json::Value;

/// A few lines about a run, from its `summary.json`.
pub(crate) fn lines(summary: &Value) -> String {
    let mut text = String::new();
    write_lines(&mut text, summary).expect("a string takes all that is written to it");
    text
}

fn write_lines(text: &mut String, summary: &Value) -> fmt::Result {
    let plain = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let number = |key: &str| plain(&summary[key]);
    let word = |key: &str| summary[key].as_str().unwrap_or_default();
    writeln!(
        text,
        "{}: {} after {:.1} s of virtual time in {:.1} s ({:.1}x real time), {} of {} robots alive",
        word("scenario"),
        word("ended"),
        number("virtual_time_s"),
        number("wall_time_s"),
        number("real_time_factor"),
        summary["robots_alive"],
        summary["robots"],
    )?;
    write!(text, "mean error {:.3e} m, cost H {:.6e}", number("mean_error_m"), number("cost_h"))?;
    if let Some(distance) = summary["mean_lamp_distance_m"].as_f64() {
        write!(text, ", mean distance to the lamps {distance:.3} m")?;
    }
    match summary["converged_at_s"].as_f64() {
        Some(time) => writeln!(text, ", converged at {time:.2} s")?,
        None => writeln!(text, ", not converged")?,
    }
    let packets = &summary["packets"];
    writeln!(text, "packets: {} sent, {} heard", packets["sent"], packets["heard"])?;
    let tick = &summary["tick_us"];
    writeln!(text, "tick: {:.0} us median, {:.0} us p99", plain(&tick["p50"]), plain(&tick["p99"]))?;
    writeln!(text, "digest {}", word("digest"))
}
