//! Result files that hold nothing but whole records, and errors that say why one could not be written.
//!
//! [`Lines`] grows by whole lines; [`replace`] and [`create`] write a file whole or not at all. So a full disk or a
//! limit costs what did not fit, and never what was there, nor the next attempt.

#![forbid(unsafe_code)]

mod error;
mod lines;
pub mod os_path;
mod reserve;
mod size_limit;
mod whole;

pub use error::{WriteError, why};
pub use lines::Lines;
pub use reserve::Reserve;
pub use size_limit::survive_size_limit;
pub use whole::{create, draft_of, replace};
