//! Properties that a controller states of itself while it thinks: what must always hold, and what must be reached at
//! least once. They are in no packet and not in the digest, and change nothing in a run, which reports them.
//!
//! ```
//! use protocol::property::{Properties, always, sometimes};
//!
//! let mut properties = Properties::default();
//! properties.during(Some(7), || {
//!     let (value, heard): (f64, u32) = (0.5, 0);
//!     always((0.0..=1.0).contains(&value), "the value is a share");
//!     sometimes(heard > 0, "somebody was heard");
//! });
//! assert!(properties.list().iter().all(|property| property.decided.is_none()));
//! ```

use std::{
    boxed::Box,
    cell::RefCell,
    fmt, mem,
    string::{String, ToString},
    vec::Vec,
};

use serde::{Deserialize, Serialize};

use crate::{giving_up::give_up, percept::Tick};

/// Most properties of a controller.
pub const PROPERTIES_MAX: usize = 64;
/// Longest name of a property, in bytes.
pub const PROPERTY_NAME_BYTES_MAX: usize = 80;

/// The demand that a property makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum PropertyKind {
    /// The condition holds whenever it is stated.
    Always,
    /// The condition holds at least once.
    Sometimes,
}

/// A property as one life of a robot has stated it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Property {
    /// Its demand.
    pub kind: PropertyKind,
    /// How people call it.
    pub name: String,
    /// When it was decided: [`Always`](PropertyKind::Always) broken, [`Sometimes`](PropertyKind::Sometimes) reached.
    pub decided: Option<Decided>,
}

/// When a property was decided for the first time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Decided {
    /// The tick of the percept; `None` while the controller was made or booted.
    pub tick: Option<Tick>,
}

/// Why a property is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PropertyError {
    /// More than [`PROPERTIES_MAX`].
    #[error(
        "it states more than {PROPERTIES_MAX} properties; `{0}` is one too many (a name should not change)"
    )]
    Many(String),
    /// Empty, too long, or with something in it that is no character to be read, or a quote.
    #[error(
        "a property's name is `{0}`: it must have 1 to {PROPERTY_NAME_BYTES_MAX} bytes, no control characters and no \""
    )]
    Name(String),
}

/// Properties that one life of a robot has stated. Empty, it has no memory; it is handed over twice a step, so it is small.
#[derive(Default)]
pub struct Properties(Option<Box<Stated>>);

/// Properties that were stated, and who is to know.
#[derive(Default)]
struct Stated {
    list: Vec<Property>,
    /// Told of all of them when one is added or decided.
    tell: Option<Box<Tell>>,
}

/// Takes all properties of a life, as they are now.
pub type Tell = dyn FnMut(&[Property]);

/// The controller that is thinking on a thread.
struct Thinking {
    /// The tick of the percept that it thinks about, if there is one.
    tick: Option<Tick>,
    properties: Properties,
}

std::thread_local! {
    /// The controller that is thinking on this thread, if one is.
    static PRESENT: RefCell<Option<Thinking>> = const { RefCell::new(None) };
}

impl fmt::Debug for Properties {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Properties").field(&self.list()).finish()
    }
}

impl Properties {
    /// None yet, and `tell` is told at once of each that is added or decided, whatever the controller does after that.
    pub fn telling(tell: impl FnMut(&[Property]) + 'static) -> Self {
        Self(Some(Box::new(Stated { list: Vec::new(), tell: Some(Box::new(tell)) })))
    }

    /// Has a controller `think` about the percept of `tick`, or about none, and takes in what it states meanwhile on this
    /// thread, also if it panics.
    #[inline]
    pub fn during<T>(&mut self, tick: Option<Tick>, think: impl FnOnce() -> T) -> T {
        /// Puts things back where they were.
        struct Turn<'a> {
            properties: &'a mut Properties,
            before: Option<Thinking>,
        }

        impl Drop for Turn<'_> {
            #[inline]
            fn drop(&mut self) {
                if let Some(present) = PRESENT.replace(self.before.take()) {
                    *self.properties = present.properties;
                }
            }
        }

        let before = PRESENT.replace(Some(Thinking { tick, properties: mem::take(self) }));
        let _turn = Turn { properties: self, before };
        think()
    }

    /// The properties, in the order in which they were first stated.
    pub fn list(&self) -> &[Property] {
        self.0.as_ref().map_or(&[], |stated| &stated.list)
    }

    /// The same, to be kept.
    pub fn into_list(self) -> Vec<Property> {
        self.0.map(|stated| stated.list).unwrap_or_default()
    }

    /// Properties as somebody else has written them down.
    ///
    /// # Errors
    /// If a controller cannot have stated them.
    pub fn check(list: &[Property]) -> Result<(), PropertyError> {
        if let Some(extra) = list.get(PROPERTIES_MAX) {
            return Err(PropertyError::Many(extra.name.clone()));
        }
        list.iter().try_for_each(|property| checked(&property.name))
    }
}

impl Stated {
    fn state(
        &mut self,
        tick: Option<Tick>,
        kind: PropertyKind,
        condition: bool,
        name: &str,
    ) -> Result<(), PropertyError> {
        let known = self.list.iter().position(|property| property.kind == kind && property.name == name);
        let place = match known {
            Some(place) => place,
            None if self.list.len() == PROPERTIES_MAX => return Err(PropertyError::Many(name.into())),
            None => {
                checked(name)?;
                self.list.push(Property { kind, name: name.into(), decided: None });
                self.list.len() - 1
            }
        };
        let decides = condition == (kind == PropertyKind::Sometimes);
        let decided = &mut self.list[place].decided;
        let is_decided = decides && decided.is_none();
        if is_decided {
            *decided = Some(Decided { tick });
        }
        if let Some(tell) = self.tell.as_mut().filter(|_| is_decided || known.is_none()) {
            tell(&self.list);
        }
        Ok(())
    }
}

fn checked(name: &str) -> Result<(), PropertyError> {
    let is_odd = |c: char| c.is_control() || c == '"';
    let is_name = (1..=PROPERTY_NAME_BYTES_MAX).contains(&name.len()) && !name.contains(is_odd);
    if is_name { Ok(()) } else { Err(PropertyError::Name(name.into())) }
}

/// States that `condition` must hold whenever this is called, by any robot. A run reports the first time that it did not, and
/// goes on; `lamplight fuzz` takes it for a failure. It counts on the thread that calls the controller; where no host does, as in
/// a test, nothing happens.
///
/// A name that is none, or more than [`PROPERTIES_MAX`] of them, ends the controller's life.
#[inline]
pub fn always(condition: bool, name: &str) {
    state(PropertyKind::Always, condition, name).unwrap_or_else(|error| give_up(error.to_string()));
}

/// States that `condition` must hold at least once when this is called, by some robot. A run reports the first time that it
/// did; `lamplight fuzz` lists what no run has reached. What is never called is never known, so call it each time, and not
/// only where the condition holds. Otherwise as [`always`].
#[inline]
pub fn sometimes(condition: bool, name: &str) {
    state(PropertyKind::Sometimes, condition, name).unwrap_or_else(|error| give_up(error.to_string()));
}

/// Does what [`always`] and [`sometimes`] do, for other languages.
///
/// # Errors
/// If the name is none, or one too many.
pub fn state(kind: PropertyKind, condition: bool, name: &str) -> Result<(), PropertyError> {
    PRESENT.with_borrow_mut(|present| match present {
        Some(Thinking { tick, properties }) => {
            properties.0.get_or_insert_default().state(*tick, kind, condition, name)
        }
        None => checked(name),
    })
}

#[cfg(test)]
mod tests {
    use std::{cell::Cell, format, rc::Rc, vec};

    use super::*;
    use crate::giving_up::contained;

    fn property(kind: PropertyKind, name: &str, decided: Option<Option<Tick>>) -> Property {
        Property { kind, name: name.to_string(), decided: decided.map(|tick| Decided { tick }) }
    }

    #[test]
    fn a_property_is_decided_once_and_by_the_first_tick() {
        let told = Rc::new(Cell::new(0));
        let mut properties = Properties::telling({
            let told = Rc::clone(&told);
            move |_| told.set(told.get() + 1)
        });
        for (tick, is_sound, is_reached) in
            [(None, true, false), (Some(3), false, false), (Some(4), false, true), (Some(5), true, false)]
        {
            properties.during(tick, || {
                always(is_sound, "sound");
                sometimes(is_reached, "reached");
                sometimes(tick.is_none(), "booted");
            });
        }
        assert_eq!(told.get(), 3 + 2, "once for each that is new, and once for each that was decided later");
        let expected = [
            property(PropertyKind::Always, "sound", Some(Some(3))),
            property(PropertyKind::Sometimes, "reached", Some(Some(4))),
            property(PropertyKind::Sometimes, "booted", Some(None)),
        ];
        assert_eq!(properties.list(), expected);
    }

    #[test]
    fn each_controller_has_its_own_whatever_ends_its_turn() {
        let (mut first, mut second) = (Properties::default(), Properties::default());
        first.during(None, || {
            always(true, "outer");
            second.during(Some(1), || always(false, "inner"));
            always(false, "outer");
        });
        let ended = contained(|| {
            first.during(Some(2), || {
                sometimes(true, "seen");
                give_up("no more");
            })
        });
        assert_eq!(ended, Err::<(), _>("no more".into()));
        let of_first = [
            property(PropertyKind::Always, "outer", Some(None)),
            property(PropertyKind::Sometimes, "seen", Some(Some(2))),
        ];
        assert_eq!(first.list(), of_first);
        assert_eq!(second.list(), [property(PropertyKind::Always, "inner", Some(Some(1)))]);
    }

    #[test]
    fn names_that_cannot_be_read_and_names_without_end_are_refused() {
        let mut properties = Properties::default();
        for name in ["", "a\nb", "a \"b\"", &"x".repeat(PROPERTY_NAME_BYTES_MAX + 1)] {
            let words = contained(|| properties.during(None, || always(true, name))).unwrap_err();
            assert!(words.starts_with("a property's name is `"), "{words}");
        }
        assert!(properties.list().is_empty());
        let words = contained(|| {
            properties.during(None, || (0..=PROPERTIES_MAX).for_each(|at| always(true, &format!("{at}"))))
        });
        assert_eq!(words, Err(PropertyError::Many(PROPERTIES_MAX.to_string()).to_string()));
        assert_eq!(properties.list().len(), PROPERTIES_MAX);
        assert_eq!(Properties::check(properties.list()), Ok(()));
        (0..=PROPERTIES_MAX).for_each(|at| always(false, &format!("{at} is said to nobody")));
        let bad = vec![property(PropertyKind::Always, "", None)];
        assert_eq!(Properties::check(&bad), Err(PropertyError::Name(String::new())));
    }
}
