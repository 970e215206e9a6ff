//! How a controller ends that cannot go on: its life is over, and nobody else's.

use std::{
    any::Any,
    boxed::Box,
    format,
    panic::{self, AssertUnwindSafe},
    string::String,
};

/// Words of a controller that has given up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GaveUp(pub String);

/// Ends the life of the controller that calls it, with these words. Like a panic, it unwinds to whoever hosts the
/// controller ([`contained`]); unlike one, it prints nothing by itself.
pub fn give_up(why: impl Into<String>) -> ! {
    panic::resume_unwind(Box::new(GaveUp(why.into())))
}

/// Calls a controller. If it panics or gives up, the error says in what words, and it must not be called again.
///
/// # Errors
/// If it has ended.
pub fn contained<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    panic::catch_unwind(AssertUnwindSafe(call)).map_err(|words| said(&*words))
}

/// The words that came with a panic.
fn said(words: &(dyn Any + Send)) -> String {
    match (words.downcast_ref::<GaveUp>(), words.downcast_ref::<String>(), words.downcast_ref::<&str>()) {
        (Some(GaveUp(why)), ..) => why.clone(),
        (_, Some(message), _) => format!("its controller panicked: {message}"),
        (.., Some(message)) => format!("its controller panicked: {message}"),
        _ => "its controller panicked".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_of_one_that_ends_come_with_the_error() {
        assert_eq!(contained(|| 3), Ok(3));
        assert_eq!(contained(|| give_up("no way on")), Err::<(), _>("no way on".into()));
        let panicked = contained(|| panic!("at {}", 3));
        assert_eq!(panicked, Err::<(), _>("its controller panicked: at 3".into()));
        assert_eq!(contained(|| panic!("here")), Err::<(), _>("its controller panicked: here".into()));
    }
}
