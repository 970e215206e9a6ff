//! Names of what is made: of scenarios' files, and of runs.

use rustix::rand::{GetRandomFlags, getrandom};
use transport::run_dir::RunName;

/// Letters and digits that nobody takes for one another. There are 32, so that a random byte is fair to each.
const DRAWN_FROM: &[u8; 32] = b"abcdefghijkmnpqrstuvwxyz23456789";

/// The scenario's name, as far as the name of a run or of a file can hold it: at most 40 letters, digits, `-`
/// and `_`. It does not begin with `-`, or programs would take it for an option.
pub(crate) fn plain(scenario_name: &str) -> String {
    let clean = |(at, c): (usize, char)| match c {
        '-' if at > 0 => c,
        _ if c.is_ascii_alphanumeric() => c,
        _ => '_',
    };
    match scenario_name {
        "" => "unnamed".into(),
        name => name.chars().enumerate().map(clean).take(40).collect(),
    }
}

/// A name for a run that no other run has: `stem`, of at most 50 characters that are fit for one, and eight drawn at
/// random. A process number is no such name, because containers that share `/dev/shm` count their processes alike.
pub(crate) fn unique(stem: &str) -> RunName {
    let mut random = [0; 8];
    // The kernel gives up to 256 bytes at once, always.
    getrandom(&mut random, GetRandomFlags::empty()).expect("Linux has random bytes for everybody");
    let drawn: String = random.iter().map(|&byte| char::from(DRAWN_FROM[usize::from(byte) % 32])).collect();
    format!("{stem}-{drawn}").parse().expect("clean characters, few enough, make a name")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_name_of_a_scenario_makes_one_of_a_run() {
        let long = "ä".repeat(100);
        let names = [
            ("-3dB link", "_3dB_link"),
            ("--", "_-"),
            ("", "unnamed"),
            ("a/b.toml", "a_b_toml"),
            ("two-gaussians", "two-gaussians"),
            (&long, &"_".repeat(40)),
        ];
        for (scenario, expected) in names {
            assert_eq!(plain(scenario), expected);
            assert!(unique(&plain(scenario)).to_string().starts_with(expected));
        }
    }

    #[test]
    fn no_two_names_are_alike() {
        let names: BTreeSet<RunName> = (0..1000).map(|_| unique("swarmbots")).collect();
        assert_eq!(names.len(), 1000);
    }
}
