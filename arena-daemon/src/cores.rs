//! The cores of this machine, lent to the arena: for the stages of a tick that fall into parts, and for what can be
//! done beside others.

use std::{fmt, thread};

use arena::executor::{Executor, Sequential};
use rayon::{
    ThreadPool, ThreadPoolBuilder,
    iter::{IndexedParallelIterator, ParallelIterator},
    slice::ParallelSliceMut,
};

/// With fewer robots, waking another core takes longer than what it could take over; see docs/performance.md.
const ROBOTS_MIN: u32 = 200;
/// Cores that work together at most: a stage of a thousand robots is about a millisecond of work.
const CORES_MAX: usize = 8;
/// Parts per core, so that who is done early takes another one.
const PARTS_PER_CORE: usize = 2;

/// Cores that work at a tick.
pub enum Cores {
    /// The caller's core.
    One,
    /// Several, which sleep between stages.
    Several(ThreadPool),
}

impl Cores {
    /// As many as pay for so many robots.
    pub fn for_robots(robots: u32) -> Self {
        let cores = cores();
        if robots < ROBOTS_MIN || cores == 1 {
            return Self::One;
        }
        threads(cores).map_or(Self::One, Self::Several)
    }
}

impl Executor for Cores {
    fn share<T: Send>(&self, items: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
        match self {
            Self::One => Sequential.share(items, work),
            Self::Several(pool) => {
                let part = items.len().div_ceil(pool.current_num_threads() * PARTS_PER_CORE).max(1);
                pool.install(|| {
                    let parts = items.par_chunks_mut(part).enumerate();
                    parts.for_each(|(at, items)| work(at * part, items));
                });
            }
        }
    }
}

impl fmt::Debug for Cores {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::One => write!(f, "One"),
            Self::Several(pool) => write!(f, "Several({})", pool.current_num_threads()),
        }
    }
}

/// Another core, for what can be done beside something else.
#[derive(Debug)]
pub struct SecondCore(ThreadPool);

impl SecondCore {
    /// If there is one, and it pays for so many robots.
    pub fn for_robots(robots: u32) -> Option<Self> {
        let pays = robots >= ROBOTS_MIN && cores() > 1;
        pays.then(|| threads(1)).flatten().map(Self)
    }

    /// Does `here` in the caller's thread, and `beside` at the same time by the other core.
    pub fn both<T>(&self, beside: impl FnOnce() + Send, here: impl FnOnce() -> T) -> T {
        self.0.in_place_scope(|scope| {
            scope.spawn(|_| beside());
            here()
        })
    }
}

fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from).min(CORES_MAX)
}

/// Without threads of its own the arena does all by itself.
fn threads(count: usize) -> Option<ThreadPool> {
    ThreadPoolBuilder::new().num_threads(count).build().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_worked_on_once_and_knows_its_place() {
        for cores in [Cores::One, Cores::Several(threads(3).unwrap())] {
            for count in [0, 1, 5, 6, 7, 1000] {
                let mut items = vec![0; count];
                cores.share(&mut items, |first, part| {
                    part.iter_mut().zip(first..).for_each(|(item, place)| *item += place + 1);
                });
                assert!(items.iter().zip(1..).all(|(&item, place)| item == place), "{cores:?}, {count}");
            }
        }
    }

    #[test]
    fn both_are_done_before_it_goes_on() {
        let mut beside = 0;
        let here = SecondCore(threads(1).unwrap()).both(|| beside = 7, || 200);
        assert_eq!((beside, here), (7, 200));
    }

    #[test]
    fn few_robots_are_played_by_one_core() {
        assert!(matches!(Cores::for_robots(ROBOTS_MIN - 1), Cores::One));
        assert!(SecondCore::for_robots(ROBOTS_MIN - 1).is_none());
    }
}
