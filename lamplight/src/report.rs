//! `lamplight report`: figures and one page from what a run or a batch left.

use std::path::PathBuf;

use clap::Args;
use report::ReportError;

use crate::{failure::Failure, status::Status, stdout::say};

#[derive(Args, Debug)]
pub(crate) struct ReportArgs {
    /// Folder of a run, of a batch, or of scripts/reproduce-paper
    dir: PathBuf,
}

pub(crate) fn report(args: &ReportArgs) -> Result<Status, Failure> {
    let page = report::report(&args.dir).map_err(|error| match error {
        ReportError::Unwritten(error) => error.into(),
        error => Failure::usage(error),
    })?;
    say(&format!("{}\n", page.display()))?;
    Ok(Status::SUCCESS)
}
