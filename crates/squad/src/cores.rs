//! Cores of this machine beside that of the loop, and when it pays to use them.

use std::thread;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// With fewer robots, waking another core takes longer than what it could take over; see docs/performance.md.
pub const ROBOTS_MIN: u32 = 200;
/// Cores that work together at most: a stage of a thousand robots is about a millisecond of work.
const CORES_MAX: usize = 8;

/// Returns how many cores are worth using for so many robots: one if others do not pay.
pub fn worth_using(robots: u32) -> usize {
    let cores = thread::available_parallelism().map_or(1, usize::from).min(CORES_MAX);
    if robots < ROBOTS_MIN { 1 } else { cores }
}

/// Makes so many threads; `None` if the operating system grants none.
pub fn threads(count: usize) -> Option<ThreadPool> {
    ThreadPoolBuilder::new().num_threads(count).build().ok()
}
