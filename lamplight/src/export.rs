//! `lamplight export`: a recording as other tools read it.

mod folder;

use std::{
    io::{self, BufWriter},
    path::PathBuf,
};

use anyhow::Context;
use clap::Args;
use engine::StopFlag;
use files::WriteError;
use logging::Format;
use observe::progress::Meter;
use processes::signals::{exit_status, raise_on_stop};
use recording::Topic;
use ros2::{Bag, Export, ExportError};

use self::folder::NewFolder;
use crate::{failure::Failure, log, recorded_run::Recording, status::Status, stdout::say};

#[derive(Args, Debug)]
pub(crate) struct ExportArgs {
    /// Recording of a run, such as DIR/run.mcap
    file: PathBuf,

    /// Write a bag of ROS 2 (Humble and later): the folder DIR with metadata.yaml and the storage file, which is named after DIR,
    /// such as bag/bag_0.mcap. DIR is made if it is not there, and must be empty if it is
    #[arg(long, value_name = "DIR")]
    ros2: PathBuf,

    /// No progress on standard error, only warnings and errors
    #[arg(long, short)]
    quiet: bool,
}

pub(crate) fn export(args: &ExportArgs) -> Result<Status, Failure> {
    log::begin(args.quiet, Format::Text);
    let mut recording = Recording::open(&args.file).map_err(Failure::Usage)?;
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen for signals").map_err(Failure::Run)?;
    let mut folder = NewFolder::claim(&args.ros2)?;
    match bag(&mut recording, &mut folder, args.quiet, &stop)? {
        Some(text) => {
            folder.keep();
            say(&format!("{}: {text}", args.ros2.display())).map(|()| Status::SUCCESS)
        }
        None => Ok(Status(exit_status(stop.signal().unwrap_or_default()))),
    }
}

/// Writes a bag into `folder` and says what it holds; `None` if it was told to stop.
fn bag(
    recording: &mut Recording,
    folder: &mut NewFolder,
    quiet: bool,
    stop: &StopFlag,
) -> Result<Option<String>, Failure> {
    // Only for the bar: another version's scenario is no reason not to export.
    let ticks = recording.scenario().ok().map(|scenario| scenario.ticks());
    let mut meter = Meter::begin(ticks, quiet);
    let storage_name = format!("{}_0.mcap", folder.name());
    let (storage, file) = folder.begin_file(&storage_name)?;
    let failed = |error: io::Error| Failure::from(WriteError::new(&storage, error));

    let mut export =
        Export::begin(BufWriter::new(file), storage_name).map_err(|error| failed(error.into()))?;
    let mut ticks_done = 0;
    while let Some(entry) = recording.next().map_err(Failure::Usage)? {
        if stop.is_raised() {
            return Ok(None);
        }
        export.add(&entry).map_err(|error| match error {
            ExportError::Read(error) => Failure::Usage(recording.fault(error)),
            ExportError::Write(error) => failed(error.into()),
        })?;
        if entry.topic == Topic::Robots {
            ticks_done += 1;
            meter.show(ticks_done, || format!("{:.1} s of virtual time", seconds(entry.time_ns)));
        }
    }
    let robots = export.robots();
    let bag = export.finish().map_err(|error| failed(error.into()))?;
    folder.end_file(&storage)?;
    // Last of all: it is what makes a bag of the folder.
    folder.write("metadata.yaml", &bag.metadata)?;
    Ok(Some(told(&bag, robots, recording.is_cut())))
}

/// Describes a bag for a person.
fn told(bag: &Bag, robots: usize, is_cut: bool) -> String {
    let seconds = seconds(bag.duration_ns);
    let mut text = format!("{robots} robots, {seconds:.1} s of virtual time, {} messages\n", bag.messages);
    if is_cut {
        text += "the recording was cut there: the run was killed, or had no room to write\n";
    }
    text
}

fn seconds(time_ns: u64) -> f64 {
    time_ns as f64 / 1e9
}
