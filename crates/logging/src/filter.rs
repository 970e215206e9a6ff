//! Which events are logged: what `RUST_LOG` says, as `tracing-subscriber`'s `EnvFilter` reads the simple cases, but for one:
//! a list about targets alone leaves the rest as it is. Whoever asks for more of one robot is not to lose the run's warnings.

use tracing::{Metadata, level_filters::LevelFilter};

/// Levels by target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Filter {
    /// Where no target fits.
    rest: LevelFilter,
    /// Beginnings of targets, the longest first.
    targets: Vec<(String, LevelFilter)>,
}

impl Filter {
    /// Reads a list of `LEVEL`, `TARGET=LEVEL` and `TARGET` (all of it), separated by commas; and what in it makes
    /// no sense. Where no level is given for all, that is `level`.
    pub(crate) fn parse(text: &str, level: LevelFilter) -> (Self, Vec<String>) {
        let (mut rest, mut targets, mut unknown) = (None, Vec::new(), Vec::new());
        for directive in text.split(',').map(str::trim).filter(|directive| !directive.is_empty()) {
            // Brackets are about spans, which nobody opens; the last one stands for what is no Unicode.
            let unclear = ['[', ']', '{', '}', '=', char::REPLACEMENT_CHARACTER];
            let plain = |target: &str| !target.is_empty() && !target.contains(unclear);
            match directive.split_once('=') {
                None => match directive.parse() {
                    Ok(level) => rest = Some(level),
                    Err(_) if plain(directive) => targets.push((directive.to_owned(), LevelFilter::TRACE)),
                    Err(_) => unknown.push(directive.to_owned()),
                },
                Some((target, level)) if plain(target) && !level.is_empty() => match level.parse() {
                    Ok(level) => targets.push((target.to_owned(), level)),
                    Err(_) => unknown.push(directive.to_owned()),
                },
                Some(_) => unknown.push(directive.to_owned()),
            }
        }
        // Of equals the last one counts, so it must come first.
        targets.reverse();
        targets.sort_by_key(|(target, _)| std::cmp::Reverse(target.len()));
        (Self { rest: rest.unwrap_or(level), targets }, unknown)
    }

    /// Whether an event like this is logged.
    pub(crate) fn lets_through(&self, event: &Metadata<'_>) -> bool {
        *event.level() <= self.level(event.target())
    }

    /// The most verbose level of any target.
    pub(crate) fn most(&self) -> LevelFilter {
        self.targets.iter().map(|(_, level)| *level).fold(self.rest, Ord::max)
    }

    fn level(&self, target: &str) -> LevelFilter {
        let fitting = self.targets.iter().find(|(beginning, _)| target.starts_with(beginning.as_str()));
        fitting.map_or(self.rest, |(_, level)| *level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(text: &str, target: &str) -> LevelFilter {
        Filter::parse(text, LevelFilter::WARN).0.level(target)
    }

    #[test]
    fn nothing_said_leaves_the_default() {
        for text in ["", " ", ",", "a=b=c"] {
            assert_eq!(level(text, "robot_agent"), LevelFilter::WARN, "{text:?}");
        }
    }

    #[test]
    fn a_level_is_for_all_and_a_target_for_what_begins_like_it() {
        assert_eq!(level("debug", "robot_agent"), LevelFilter::DEBUG);
        assert_eq!(level("Info,robot_agent=trace", "robot_agent::agent"), LevelFilter::TRACE);
        assert_eq!(level("info,robot_agent=trace", "arena_daemon"), LevelFilter::INFO);
        assert_eq!(level("robot_agent", "robot_agent"), LevelFilter::TRACE);
        assert_eq!(level("robot_agent=debug", "arena_daemon"), LevelFilter::WARN);
        assert_eq!(level("off,robot_agent=debug", "arena_daemon"), LevelFilter::OFF);
        assert_eq!(level("off", "robot_agent"), LevelFilter::OFF);
    }

    #[test]
    fn the_longest_target_counts_and_of_equals_the_last() {
        assert_eq!(level("a::b=error,a=trace", "a::b::c"), LevelFilter::ERROR);
        assert_eq!(level("a=error,a=trace", "a"), LevelFilter::TRACE);
    }

    #[test]
    fn what_makes_no_sense_is_told_and_the_rest_counts() {
        let (filter, unknown) =
            Filter::parse("a=loud,debug,[span]=info,=info,b=,\u{FFFD}", LevelFilter::WARN);
        assert_eq!(unknown, ["a=loud", "[span]=info", "=info", "b=", "\u{FFFD}"]);
        assert_eq!(filter.level("a"), LevelFilter::DEBUG);
    }

    #[test]
    fn the_most_verbose_level_is_that_of_any_target() {
        assert_eq!(Filter::parse("info,a=trace,b=error", LevelFilter::WARN).0.most(), LevelFilter::TRACE);
        assert_eq!(Filter::parse("", LevelFilter::WARN).0.most(), LevelFilter::WARN);
    }
}
