//! `lamplight clean`: remove what dead runs have left in shared memory.

use std::process::ExitCode;

use protocol::run_dir::RunDir;

use crate::{failure::Failure, say::say};

pub(crate) fn clean() -> Result<ExitCode, Failure> {
    let (mut runs, mut entries, mut alive) = (0, 0, 0);
    for run in RunDir::list().map_err(Failure::run)? {
        match run.remove_if_dead().map_err(Failure::run)? {
            None => alive += 1,
            Some(removed) => {
                entries += removed;
                runs += u32::from(removed > 0);
            }
        }
    }
    say(&format!(
        "removed {entries} entries of {runs} dead runs from shared memory; {alive} runs are alive\n"
    ))?;
    Ok(ExitCode::SUCCESS)
}
