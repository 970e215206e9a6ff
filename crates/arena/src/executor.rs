//! Splits independent work items over threads.
//!
//! The arena itself has no threads. Its caller may lend it some: what comes out is the same to the last bit.

/// Runs the parts of a stage's work.
pub trait Executor {
    /// Calls `work` with successive parts of `items`, and for each the index of its first item. Every item is in
    /// one part; parts are worked on in any order, or at the same time.
    fn share<T: Send>(&self, items: &mut [T], work: impl Fn(usize, &mut [T]) + Sync);
}

/// Does all work on the caller's thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequential;

impl Executor for Sequential {
    fn share<T: Send>(&self, items: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
        work(0, items);
    }
}
