//! `lamplight clean`: remove what dead runs have left in shared memory.

use anyhow::anyhow;
use logging::Format;
use transport::{
    owner::Owner,
    run_dir::{Cleared, RunDir, RunName},
};

use crate::{failure::Failure, log, status::Status, stdout::say};

/// Runs of others that are named.
const NAMED_MAX: usize = 10;

pub(crate) fn clean() -> Result<Status, Failure> {
    log::begin(false, Format::Text);
    let (mut runs, mut entries, mut alive, mut failed) = (0, 0, 0, 0);
    let mut foreign = Vec::new();
    for run in RunDir::list().map_err(Failure::run)? {
        match run.remove_if_dead() {
            Ok(None) => alive += 1,
            Ok(Some(Cleared { removed, foreign: owner })) => {
                entries += removed;
                runs += u32::from(removed > 0);
                foreign.extend(owner.map(|owner| (run.name().clone(), owner)));
            }
            // The others are not to wait for it.
            Err(error) => {
                failed += 1;
                tracing::warn!("what run `{}` has left stays: {error}", run.name());
            }
        }
    }
    say(&format!(
        "removed {entries} entries of {runs} dead runs from shared memory; {alive} runs are alive\n{}",
        passed_over(&foreign)
    ))?;
    match failed {
        0 => Ok(Status::SUCCESS),
        _ => Err(Failure::Run(anyhow!("what {failed} runs have left could not be removed"))),
    }
}

/// Says which runs are not ours to remove, if any are.
fn passed_over(foreign: &[(RunName, Owner)]) -> String {
    if foreign.is_empty() {
        return String::new();
    }
    let named = foreign.iter().take(NAMED_MAX).map(|(name, owner)| format!("`{name}` of {owner}"));
    let named = named.collect::<Vec<_>>().join(", ");
    let more = foreign.len().saturating_sub(NAMED_MAX);
    let and_more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("passed over {} runs of other users: {named}{and_more}\n", foreign.len())
}
