//! `lamplight clean`: remove what dead runs have left in shared memory.

use std::process::ExitCode;

use protocol::run_dir::RunDir;

use crate::failure::Failure;

pub(crate) fn clean() -> Result<ExitCode, Failure> {
    let (mut runs, mut entries, mut alive) = (0, 0, 0);
    for run in RunDir::list().map_err(Failure::run)? {
        if run.is_alive() {
            alive += 1;
            continue;
        }
        let removed = run.remove().map_err(Failure::run)?;
        entries += removed;
        runs += u32::from(removed > 0);
    }
    println!("removed {entries} entries of {runs} dead runs from shared memory; {alive} runs are alive");
    Ok(ExitCode::SUCCESS)
}
