//! Packets that somebody within reach has not heard, one by one: for those who want to see which.
//!
//! [`Packets`](crate::packets::Packets) counts them in any case.

/// Most that are noted between two neighbor cycles; more are counted in [`Packets`](crate::packets::Packets) alone.
pub const LOSSES_MAX: usize = 1 << 16;

/// A packet that a robot within reach has not heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Loss {
    /// Index of the robot that transmitted it.
    pub sender: u32,
    /// Index of the robot that has not heard it.
    pub receiver: u32,
    /// Why.
    pub cause: Cause,
}

/// Reason why a packet was not heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    /// Another packet was in the air.
    Collision,
    /// The channel's own chance.
    Chance,
    /// A planned fault.
    Fault,
    /// The receiver was transmitting itself.
    HalfDuplex,
}

/// Losses since the last neighbor cycle, if they are noted.
#[derive(Clone, Debug, Default)]
pub struct Losses(Option<Vec<Loss>>);

impl Losses {
    /// From here on they are noted, or not.
    pub fn note(&mut self, is_wanted: bool) {
        if is_wanted != self.0.is_some() {
            self.0 = is_wanted.then(Vec::new);
        }
    }

    /// Returns those that were noted.
    pub fn noted(&self) -> &[Loss] {
        self.0.as_deref().unwrap_or_default()
    }

    pub(crate) fn add(&mut self, sender: u32, receiver: u32, cause: Cause) {
        if let Some(noted) = self.0.as_mut().filter(|noted| noted.len() < LOSSES_MAX) {
            noted.push(Loss { sender, receiver, cause });
        }
    }

    pub(crate) fn clear(&mut self) {
        self.0.iter_mut().for_each(Vec::clear);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_noted_that_nobody_wants_and_no_more_than_the_bound() {
        let mut losses = Losses::default();
        losses.add(1, 2, Cause::Chance);
        assert!(losses.noted().is_empty());
        losses.note(true);
        (0..=LOSSES_MAX as u32).for_each(|sender| losses.add(sender, 0, Cause::Collision));
        assert_eq!(losses.noted().len(), LOSSES_MAX);
        losses.clear();
        losses.add(1, 2, Cause::Fault);
        assert_eq!(losses.noted(), [Loss { sender: 1, receiver: 2, cause: Cause::Fault }]);
        losses.note(false);
        assert!(losses.noted().is_empty());
    }
}
