//! Another core, for what can be done beside something else.

use rayon::ThreadPool;
use squad::cores::{threads, worth_using};

/// Another core.
#[derive(Debug)]
pub(crate) struct SecondCore(ThreadPool);

impl SecondCore {
    /// If there is one, and it pays for so many robots.
    pub(crate) fn for_robots(robots: u32) -> Option<Self> {
        (worth_using(robots) > 1).then(|| threads(1)).flatten().map(Self)
    }

    /// Does `here` in the caller's thread, and `beside` at the same time by the other core.
    pub(crate) fn both<T>(&self, beside: impl FnOnce() + Send, here: impl FnOnce() -> T) -> T {
        self.0.in_place_scope(|scope| {
            scope.spawn(|_| beside());
            here()
        })
    }
}

#[cfg(test)]
mod tests {
    use squad::cores::ROBOTS_MIN;

    use super::*;

    #[test]
    fn both_are_done_before_it_goes_on() {
        let mut beside = 0;
        let here = SecondCore(threads(1).unwrap()).both(|| beside = 7, || 200);
        assert_eq!((beside, here), (7, 200));
    }

    #[test]
    fn few_robots_are_measured_by_one_core() {
        assert!(SecondCore::for_robots(ROBOTS_MIN - 1).is_none());
    }
}
