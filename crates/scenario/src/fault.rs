//! `[[fault]]`: what shall go wrong, when, and to whom.
//!
//! A kind of fault is one file in `kind/`, with its parameters (the keys that only it has, with their defaults), what is
//! checked of them, and how a random one is drawn; and one line in `kinds!` (`kind.rs`). What it does to packets and robots
//! is a rule of the same name in the crate `arena`. Everything else asks the kind for its [`Nature`].

pub(crate) mod check;
pub(crate) mod draw;
mod drawer;
mod entry;
pub(crate) mod kind;
mod nature;
mod own_keys;
mod parameters;
pub(crate) mod setting;
pub(crate) mod table;
mod target;

pub use kind::*;
pub use nature::{Nature, Strikes, Timing, Window};
pub use target::{Choice, Direction, Disc, Pick, ShareOf, Target};
