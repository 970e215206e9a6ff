//! The cores of this machine, lent to the arena for the stages of a tick that fall into parts.

use std::{fmt, thread};

use arena::hands::{Alone, Hands};
use rayon::{
    ThreadPool, ThreadPoolBuilder,
    iter::{IndexedParallelIterator, ParallelIterator},
    slice::ParallelSliceMut,
};

/// With fewer robots, waking another core for a stage takes longer than what it could take over; see
/// docs/performance.md.
const ROBOTS_MIN: u32 = 200;
/// Cores that work together at most: a stage of a thousand robots is about a millisecond of work.
const CORES_MAX: usize = 8;
/// Parts per core, so that who is done early takes another one.
const PARTS_PER_CORE: usize = 2;

/// Who works at a tick.
pub enum Cores {
    /// The caller's.
    One,
    /// The caller's, and one that does what comes up beside.
    Two(ThreadPool),
    /// Several, which sleep between stages.
    Several(ThreadPool),
}

impl Cores {
    /// As many as pay for so many robots; at least two, where there are, if something `comes_up` to be done beside.
    pub fn for_robots(robots: u32, comes_up: bool) -> Self {
        let cores = thread::available_parallelism().map_or(1, usize::from).min(CORES_MAX);
        // Without threads of its own the arena does all by itself.
        let pool = |threads| ThreadPoolBuilder::new().num_threads(threads).build();
        match (cores > 1, robots >= ROBOTS_MIN, comes_up) {
            (true, true, _) => pool(cores).map_or(Self::One, Self::Several),
            (true, false, true) => pool(1).map_or(Self::One, Self::Two),
            _ => Self::One,
        }
    }

    /// Does `here` in the caller's thread, and `beside` at the same time if there are several, else before it.
    pub fn both<T>(&self, beside: impl FnOnce() + Send, here: impl FnOnce() -> T) -> T {
        match self {
            Self::One => {
                beside();
                here()
            }
            Self::Two(pool) | Self::Several(pool) => pool.in_place_scope(|scope| {
                scope.spawn(|_| beside());
                here()
            }),
        }
    }
}

impl Hands for Cores {
    fn share<T: Send>(&self, items: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
        match self {
            Self::One | Self::Two(_) => Alone.share(items, work),
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
            Self::Two(_) => write!(f, "Two"),
            Self::Several(pool) => write!(f, "Several({})", pool.current_num_threads()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all_kinds() -> [Cores; 3] {
        let pool = |threads| ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        [Cores::One, Cores::Two(pool(1)), Cores::Several(pool(3))]
    }

    #[test]
    fn every_item_is_worked_on_once_and_knows_its_place() {
        for cores in all_kinds() {
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
    fn both_are_done_and_one_may_share_its_work_meanwhile() {
        for cores in all_kinds() {
            let (mut beside, mut items) = (0, vec![1; 100]);
            let here = cores.both(
                || beside = 7,
                || {
                    cores.share(&mut items, |_, part| part.iter_mut().for_each(|item| *item *= 2));
                    items.iter().sum::<i32>()
                },
            );
            assert_eq!((beside, here), (7, 200), "{cores:?}");
        }
    }

    #[test]
    fn few_robots_are_played_by_one_core() {
        assert!(matches!(Cores::for_robots(ROBOTS_MIN - 1, false), Cores::One));
        assert!(!matches!(Cores::for_robots(ROBOTS_MIN - 1, true), Cores::Several(_)));
    }
}
