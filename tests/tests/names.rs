//! Names of runs and files, and who shares `/dev/shm` with whom: any name works or is refused before anything
//! starts, and other users and containers are in nobody's way.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs,
    os::{
        fd::OwnedFd,
        unix::{fs::PermissionsExt, net::UnixDatagram},
    },
    path::Path,
    process::{Command, Output},
};

use tests::programs::{lamplight, program, said, scenario};

/// A short run of few robots in `folder`.
fn run(folder: &Path, arguments: &[&str]) -> Output {
    lamplight(["run", "--quiet", "--robots", "3", "--duration", "1"])
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn a_name_that_begins_with_a_dash_runs_or_is_refused_before_anything_starts() {
    let folder = tempfile::tempdir().unwrap();
    let swarmbots = scenario("swarmbots");
    let swarmbots = swarmbots.to_str().unwrap();
    let nameless: String = fs::read_to_string(swarmbots).unwrap();
    let nameless: Vec<&str> = nameless.lines().filter(|line| !line.starts_with("name =")).collect();
    fs::write(folder.path().join("-draft.toml"), nameless.join("\n")).unwrap();
    let works: [&[&str]; 8] = [
        &["--set", "name=\"-3dB link\"", swarmbots],
        &["--set", "name=\"--help\"", swarmbots],
        &["--set", "name=\"\"", swarmbots],
        &["--set", "name=\"=\\n\"", swarmbots],
        &["./-draft.toml"],
        &["--", "-draft.toml"],
        &["--out=-out", "--trace=-trace", swarmbots],
        &["--out=a b=\nc", swarmbots],
    ];
    for arguments in works {
        let output = run(folder.path(), arguments);
        assert!(output.status.success(), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains("3 of 3 robots alive"), "{}", said(&output));
    }
    for made in ["-out/summary.json", "-trace", "a b=\nc/summary.json"] {
        assert!(folder.path().join(made).exists(), "{made}");
    }
    for name in ["-x", "--robots", ""] {
        let output = run(folder.path(), &[&format!("--name={name}"), swarmbots]);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains("--name"), "{}", said(&output));
    }
    let fuzz = lamplight(["fuzz", "--runs", "1", "--robots", "3", "--duration", "1", "--", "-draft.toml"])
        .env("TMPDIR", ".")
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(fuzz.status.success(), "{}", said(&fuzz));
}

#[test]
fn what_an_agent_says_of_its_command_line_comes_in_one_write_so_that_lines_of_many_do_not_mix() {
    let (ours, theirs) = UnixDatagram::pair().unwrap();
    let mut command = Command::new(program("robot-agent"));
    let mut agent =
        command.args(["--run", "-x", "--nonsense"]).stderr(OwnedFd::from(theirs)).spawn().unwrap();
    assert_eq!(agent.wait().unwrap().code(), Some(2));
    // A datagram is what was written at once.
    let mut written = [0; 4096];
    let length = ours.recv(&mut written).unwrap();
    let text = String::from_utf8_lossy(&written[..length]);
    assert!(text.starts_with("error: ") && text.ends_with("try '--help'.\n"), "{text:?}");
}

/// A shell script that is root in namespaces of its own; `None` if they cannot be had here.
fn apart(script: &str, folder: &Path) -> Option<Output> {
    let apart = ["--mount", "--pid", "--fork", "--mount-proc", "sh", "-ec"];
    let can = Command::new("unshare").args(apart).arg("setpriv --reuid=65534 true").output();
    if !can.is_ok_and(|output| output.status.success()) {
        println!("skipped: this needs root, namespaces and setpriv");
        return None;
    }
    let output = Command::new("unshare").args(apart).arg(script).current_dir(folder).output();
    Some(output.unwrap())
}

/// A folder that everybody may read, with our programs.
fn programs() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o777)).unwrap();
    for name in ["lamplight", "arena-daemon", "robot-agent"] {
        fs::copy(program(name), folder.path().join(name)).unwrap();
    }
    fs::copy(scenario("swarmbots"), folder.path().join("swarmbots.toml")).unwrap();
    folder
}

#[test]
fn what_other_users_have_left_is_passed_over_and_named() {
    let folder = programs();
    let output = apart(
        "mount -t tmpfs -o mode=1777 tmpfs /dev/shm
         mkdir -m 700 /dev/shm/lamplight-closed
         mkdir /dev/shm/lamplight-open && touch /dev/shm/lamplight-open/owner
         touch /dev/shm/lamplight-loose.data
         mkdir /dev/shm/lamplight-mine && touch /dev/shm/lamplight-mine.data
         chown -R 65534 /dev/shm/lamplight-mine /dev/shm/lamplight-mine.data
         user='setpriv --reuid=65534 --regid=65534 --clear-groups'
         $user ./lamplight clean
         for name in closed open loose; do
             $user ./lamplight run swarmbots.toml -q --robots 2 --duration 1 --name $name 2>&1 || echo $?
         done
         $user ./robot-agent --run closed --robot 0 2>&1 || echo $?
         $user ./lamplight top closed 2>&1 || echo $?
         $user ./lamplight run swarmbots.toml -q --robots 2 --duration 1 --name mine | head -1
         ./lamplight clean
         ls /dev/shm",
        folder.path(),
    );
    let Some(output) = output else { return };
    let text = String::from_utf8_lossy(&output.stdout);
    let taken = |name: &str| {
        format!("error: `{name}` is the name of a run of user root in /dev/shm; choose another one\n")
    };
    let refused = ["closed", "open", "loose"].map(|name| taken(name) + "2\n").concat();
    let expected = format!(
        "removed 2 entries of 1 dead runs from shared memory; 0 runs are alive\n\
         passed over 3 runs of other users: `closed` of user root, `loose` of user root, `open` of user root\n\
         {refused}{closed}1\n{closed}2\n",
        closed = taken("closed")
    );
    assert!(text.starts_with(&expected), "{}", said(&output));
    assert!(text.contains("2 of 2 robots alive"), "{}", said(&output));
    // For root everything is ours.
    let end = "removed 3 entries of 3 dead runs from shared memory; 0 runs are alive\n";
    assert!(text.ends_with(end), "{}", said(&output));
}

#[test]
fn containers_that_share_memory_do_not_get_in_one_anothers_way() {
    let folder = programs();
    // In each the run has the same process number.
    let output = apart(
        "mount -t tmpfs -o mode=1777 tmpfs /dev/shm
         container() {
             unshare --pid --fork --mount-proc sh -c \\
                 './lamplight run swarmbots.toml -q --robots 4 --duration 20 --speed 10 --json; exit $?' > $1
         }
         container a & a=$!
         container b & b=$!
         for try in $(seq 300); do
             [ $(ls -d /dev/shm/lamplight-*/live 2>/dev/null | wc -l) = 2 ] && break
             sleep 0.1
         done
         ./lamplight clean
         wait $a
         wait $b
         ls /dev/shm
         grep -h '\"digest\"' a b | sort | uniq -c | wc -l",
        folder.path(),
    );
    let Some(output) = output else { return };
    let text = String::from_utf8_lossy(&output.stdout);
    let expected = "removed 0 entries of 0 dead runs from shared memory; 2 runs are alive\n1\n";
    assert_eq!(text, expected, "{}", said(&output));
}

#[test]
fn a_lock_that_nobody_lets_go_of_is_told() {
    let folder = programs();
    let output = apart(
        "mount -t tmpfs -o mode=1777 tmpfs /dev/shm
         flock /dev/shm sleep 60 & sleep 1
         ./lamplight run swarmbots.toml -q --robots 2 --duration 1 2>&1 || echo $?
         kill $!",
        folder.path(),
    );
    let Some(output) = output else { return };
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.starts_with("error: another process has locked /dev/shm for 10s"), "{}", said(&output));
    assert!(text.ends_with("2\n"), "{}", said(&output));
}
