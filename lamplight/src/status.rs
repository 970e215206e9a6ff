//! Exit statuses: those of `std::process` cannot be read, and whoever hosts a command may have to hand it on.

use std::process::ExitCode;

/// The exit status of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status(pub u8);

impl Status {
    /// It did what it was told.
    pub const SUCCESS: Self = Self(0);
    /// It could not, or what it looked for is not so.
    pub const FAILURE: Self = Self(1);
    /// Bad arguments or a bad scenario.
    pub const USAGE: Self = Self(2);
}

impl From<Status> for ExitCode {
    fn from(status: Status) -> Self {
        Self::from(status.0)
    }
}
