//! The namespace that a process's number belongs to: in another one it means another process, or none.

use std::{fs, os::unix::fs::MetadataExt};

/// The namespace of this process, by the inode that `/proc` has for it; `None` if `/proc` does not tell.
pub fn ours() -> Option<u64> {
    fs::metadata("/proc/self/ns/pid").ok().map(|namespace| namespace.ino())
}

/// The number of this process, for whoever lives in namespace `theirs`; 0 if it has none there that we know.
pub fn our_pid_in(theirs: Option<u64>) -> u32 {
    match (ours(), theirs) {
        (Some(ours), Some(theirs)) if ours == theirs => std::process::id(),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_has_its_number_in_its_own_namespace_alone() {
        assert_eq!(our_pid_in(ours()), std::process::id());
        assert_eq!(our_pid_in(ours().map(|namespace| namespace + 1)), 0);
        assert_eq!(our_pid_in(None), 0);
    }
}
