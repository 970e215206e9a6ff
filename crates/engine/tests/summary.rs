//! `summary.json` is read back as it was written.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::path::Path;

use coverage::CoverageController;
use engine::summary::Summary;
use scenario::Scenario;

#[test]
fn a_summary_is_read_back_to_the_last_bit() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let crowded = ["output.crowding=true"].as_slice();
    for (name, extra) in [("ten-faults", [].as_slice()), ("r-one", crowded)] {
        let overrides = ["duration_s=4"].iter().chain(extra).map(|text| text.parse().unwrap());
        let overrides: Vec<_> = overrides.collect();
        let scenario = Scenario::load(&folder.join(name).with_extension("toml"), &overrides).unwrap();
        let paper =
            engine::controller(|id, params| params.decode().map(|setup| CoverageController::new(id, setup)));
        let written = engine::run(&scenario, &[&paper], &mut []).unwrap();
        let read: Summary = serde_json::from_str(&written.json()).unwrap();
        assert_eq!(read, written, "{name}");
        assert_eq!(read.json(), written.json(), "{name}");
    }
}
