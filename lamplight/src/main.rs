//! The command people type.

#![forbid(unsafe_code)]

use std::{env, process::ExitCode};

fn main() -> ExitCode {
    lamplight::main(env::args_os(), None).into()
}
