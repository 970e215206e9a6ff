//! The limit on a file's size (`ulimit -f`), as an error like any other.

use std::{
    io,
    sync::{Arc, atomic::AtomicBool},
};

use signal_hook::consts::SIGXFSZ;

/// From here on a write beyond the limit fails, as on a full disk. Unless a process says so, the kernel kills it
/// there (SIGXFSZ), with all that it has not written yet.
///
/// # Errors
/// If the signal cannot be handled.
pub fn survive_size_limit() -> io::Result<()> {
    // That there is a handler is enough: the write itself says what is wrong.
    signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))).map(drop)
}
