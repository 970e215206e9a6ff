//! The cores of this machine, lent to the arena for the stages of a tick that fall into parts.

use std::fmt;

use arena::executor::{Executor, Sequential};
use rayon::{
    ThreadPool,
    iter::{IndexedParallelIterator, ParallelIterator},
    slice::ParallelSliceMut,
};
use squad::cores::{threads, worth_using};

/// Parts per core, so that who is done early takes another one.
const PARTS_PER_CORE: usize = 2;

/// Cores that work at a tick.
pub(crate) enum Cores {
    /// The caller's core.
    One,
    /// Several, which sleep between stages.
    Several(ThreadPool),
}

impl Cores {
    /// As many as pay for so many robots.
    pub(crate) fn for_robots(robots: u32) -> Self {
        match worth_using(robots) {
            1 => Self::One,
            // Without threads of its own the arena does all by itself.
            cores => threads(cores).map_or(Self::One, Self::Several),
        }
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

#[cfg(test)]
mod tests {
    use squad::cores::ROBOTS_MIN;

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
    fn few_robots_are_played_by_one_core() {
        assert!(matches!(Cores::for_robots(ROBOTS_MIN - 1), Cores::One));
    }
}
