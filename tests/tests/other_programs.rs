//! Programs that think for robots and turn out to be none: one line says which, and where it was named.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

use tests::programs::{lamplight, said};

/// Six robots with the program `a mind` beside the file, which is whose entry is in line 6.
const SCENARIO: &str = "duration_s = 2\nstep_s = 0.1\narena.size_m = [2, 2]\nrobots.count = 6\nchannel.range_m = 1\n\
                        [[controller]]\nprogram = [\"./a mind\"]\n[processes]\njoin_timeout_s = 1\n";

fn scenario(folder: &Path, program: &str) -> PathBuf {
    let mind = folder.join("a mind");
    fs::write(&mind, program).unwrap();
    fs::set_permissions(&mind, fs::Permissions::from_mode(0o755)).unwrap();
    let file = folder.join("six.toml");
    fs::write(&file, SCENARIO).unwrap();
    file
}

/// Runs the six robots with `program`, which ends with this exit status, and returns the lines of standard error, of which the last is the error.
fn lines_of(program: &str, status: i32) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let name = format!("test-programs-{}-{}", std::process::id(), program.len());
    let run = lamplight(["run", "--quiet", "--name", &name])
        .arg(scenario(folder.path(), program))
        .output()
        .unwrap();
    assert_eq!(run.status.code(), Some(status), "{}", said(&run));
    let left: Vec<_> = fs::read_dir("/dev/shm").unwrap().flatten().map(|entry| entry.file_name()).collect();
    assert!(!left.iter().any(|file| file.to_string_lossy().contains(&name)), "{left:?}");
    String::from_utf8(run.stderr).unwrap().lines().map(Into::into).collect()
}

#[test]
fn a_program_that_cannot_be_executed_is_named_with_its_line() {
    for program in ["hello\n", "#!/no/such/interpreter\n"] {
        let lines = lines_of(program, 2);
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert!(
            lines[0].contains("six.toml:6: the program ")
                && lines[0].contains("of robots 0-5 cannot be started")
        );
        assert!(lines[1].starts_with("hint: "), "{lines:?}");
    }
}

#[test]
fn a_program_that_never_joins_is_told_once_and_named_with_its_line() {
    for program in ["#!/bin/sh\nexit 3\n", "#!/bin/sh\nexec sleep 100\n"] {
        let lines = lines_of(program, 1);
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert!(lines[0].contains("more of its program are counted, not shown"), "{lines:?}");
        assert!(
            lines[1].contains("six.toml:6: of robots 0-5 none has joined; their program is "),
            "{lines:?}"
        );
    }
}

#[test]
fn params_that_all_robots_refuse_are_told_once() {
    let agent = tests::programs::program("robot-agent");
    let lines = lines_of(&format!("#!/bin/sh\nexec {} \"$@\"\n", agent.display()), 1);
    let refusals = lines.iter().filter(|line| line.contains("refuses its params")).count();
    assert_eq!((refusals, lines.len()), (1, 3), "{lines:?}");
    assert!(lines[2].contains("six.toml:6: of robots 0-5 none has joined"), "{lines:?}");
}
