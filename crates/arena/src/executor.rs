//! Who does the work of a stage that falls into parts which know nothing of each other.
//!
//! The arena itself has no threads. Whoever plays it may lend it some: what comes out is the same to the last bit.

/// Hands that share work.
pub trait Executor {
    /// Calls `work` with successive parts of `items`, and for each the index of its first item. Every item is in
    /// one part; parts are worked on in any order, or at the same time.
    fn share<T: Send>(&self, items: &mut [T], work: impl Fn(usize, &mut [T]) + Sync);
}

/// One pair of hands: the caller's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequential;

impl Executor for Sequential {
    fn share<T: Send>(&self, items: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
        work(0, items);
    }
}
