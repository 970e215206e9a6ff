//! `lamplight schema`: what files and lines have, as JSON Schema.

use clap::Args;
use json_lines::{BootLine, CommandLine, PerceptLine};
use schemars::{JsonSchema, schema_for};

use crate::{failure::Failure, status::Status, stdout::say};

#[derive(Args, Debug)]
#[group(multiple = false)]
pub(crate) struct SchemaArgs {
    /// Instead, of the lines that a controller with `speaks = "json-lines"` reads: its first one, and percepts
    #[arg(long)]
    percept: bool,

    /// Instead, of the lines that it writes
    #[arg(long)]
    command: bool,
}

/// A line that a controller reads.
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "only its schema is used")]
enum Question {
    Boot(BootLine),
    Percept(PerceptLine),
}

pub(crate) fn schema(args: &SchemaArgs) -> Result<Status, Failure> {
    let text = match (args.percept, args.command) {
        (true, _) => json(&schema_for!(Question)),
        (_, true) => json(&schema_for!(CommandLine)),
        _ => scenario::schema_json(),
    };
    say(&text)?;
    Ok(Status::SUCCESS)
}

fn json(schema: &schemars::Schema) -> String {
    let text = serde_json::to_string_pretty(schema).expect("a schema is JSON");
    text + "\n"
}
