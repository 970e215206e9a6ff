//! Results on standard output.

use std::io::{self, ErrorKind, Write};

use anyhow::anyhow;

use crate::failure::Failure;

/// Writes `text` to standard output. A reader who has seen enough (`| head -1`) is no failure.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    let mut output = io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::Run(anyhow!("cannot write to standard output: {}", files::why(&error))))
        }
        _ => Ok(()),
    }
}
