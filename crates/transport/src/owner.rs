//! The user that a file belongs to.

use std::{fmt, fs, io, os::unix::fs::MetadataExt, path::Path};

/// Where names of users are, for those who are not kept elsewhere.
const USERS: &str = "/etc/passwd";

/// A user, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Owner(u32);

impl Owner {
    /// Owner of `path` itself, even if that is a link.
    pub fn of(path: &Path) -> io::Result<Self> {
        fs::symlink_metadata(path).map(|file| Self(file.uid()))
    }

    /// The user that this process acts as.
    pub fn us() -> Self {
        Self(rustix::process::geteuid().as_raw())
    }

    /// Whether this process acts as that user.
    pub fn is_us(self) -> bool {
        self == Self::us()
    }

    /// Whether that is the user who may do everything.
    pub fn is_root(self) -> bool {
        self.0 == 0
    }
}

impl fmt::Display for Owner {
    /// By name, where it is known here.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let users = fs::read_to_string(USERS).unwrap_or_default();
        match name_in(&users, self.0) {
            Some(name) => write!(f, "user {name}"),
            None => write!(f, "user number {}", self.0),
        }
    }
}

/// The name that a table of users (passwd(5)) has for one of them.
fn name_in(users: &str, number: u32) -> Option<String> {
    users.lines().find_map(|line| {
        let mut fields = line.split(':');
        let (name, theirs) = (fields.next()?, fields.nth(1)?);
        (theirs.parse() == Ok(number)).then(|| name.to_string())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn users_are_named_where_they_are_known() {
        let users = "root:x:0:0:root:/root:/bin/sh\n# a comment\n\nann:x:1000:100::/home/ann:\n";
        assert_eq!(name_in(users, 1000).as_deref(), Some("ann"));
        assert_eq!(name_in(users, 100), None, "that is a group");
        assert_eq!(Owner(u32::MAX - 1).to_string(), "user number 4294967294");
    }

    #[test]
    fn what_we_make_is_ours() {
        let file = tempfile::NamedTempFile::new().unwrap();
        assert!(Owner::of(file.path()).unwrap().is_us());
    }
}
