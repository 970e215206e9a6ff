//! The live page: a run, or a recording of one, in a browser.
//!
//! ```text
//! arena's process --messages (socket `watch`)--> Swarm --frames, JSON (WebSocket)--> page
//! recording ------messages------------------------^                                   |
//! arena's process <--acts (socket `acts`)------------------------- acts --------------+
//! ```
//!
//! All of it is outside the arena's process, which only hands over what a tick was. Local cells are computed again here, by
//! `coverage` from the percepts that robots got; global ones from poses. So nothing that is shown was made for showing.

#![forbid(unsafe_code)]

mod door;
mod frame;
mod inspect;
mod live;
mod page;
mod picture;
mod playback;
mod server;
mod session;
mod swarm;
mod tell;
mod wire;

pub use live::live;
pub use playback::playback;
pub use server::{ServeError, Server, Serving};
pub use session::Show;
pub use swarm::About;
