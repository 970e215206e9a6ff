//! Recordings exported for ROS 2: what a bag holds by a reader of others, and what is left where there is none.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    thread,
    time::Duration,
};

use recording::{Topic, lamplight::Run};
use rustix::process::{Pid, Signal, kill_process};
use tests::{
    live::wait_until,
    programs::{interpreter, lamplight, program, recorded, said, scenario},
};

/// Options of a recorded run of five seconds in which robots die, come back, and die all.
const RUN: [&str; 8] = [
    "--duration",
    "5",
    "--engine",
    "in-process",
    "--set",
    "output.poses_every_s=0.1",
    "--set",
    r#"fault=[{ kind = "kill", at_s = 1, restart_at_s = 2, robots = "5-14" },
              { kind = "kill", at_s = 4, robots = "0-49" }]"#,
];

fn export(file: &Path, to: &Path) -> Output {
    lamplight(["export", "--quiet", "--ros2"]).arg(to).arg(file).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Python with the package `rosbags`; `None`, said aloud, where that cannot be installed.
fn interpreter_with_rosbags() -> Option<PathBuf> {
    let python = interpreter()?;
    let has_package = || {
        let import = Command::new(&python).args(["-c", "import rosbags"]).output();
        import.is_ok_and(|output| output.status.success())
    };
    if !has_package() {
        let _ = Command::new(&python).args(["-m", "pip", "install", "--quiet", "rosbags>=0.11"]).output();
    }
    if !has_package() {
        eprintln!("SKIPPED: the package rosbags cannot be installed");
        return None;
    }
    Some(python)
}

/// Compares a bag with the recording in `run` that it was made of, by `read_bag.py`, and returns what that says.
fn read(python: &Path, bag: &Path, run: &Path, args: &[&str]) -> String {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/read_bag.py");
    let output = Command::new(python).arg(script).args([bag, run]).args(args).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    stdout(&output)
}

#[test]
fn a_bag_is_what_was_recorded_by_a_reader_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = recorded(&folder, &scenario("swarmbots"), &RUN);
    let bag = folder.path().join("new/bag");
    let output = export(&file, &bag);
    assert!(output.status.success(), "{}", said(&output));
    assert!(
        stdout(&output).ends_with("/bag: 50 robots, 5.0 s of virtual time, 221 messages\n"),
        "{}",
        said(&output)
    );
    let mut files: Vec<_> = fs::read_dir(&bag).unwrap().map(|file| file.unwrap().file_name()).collect();
    files.sort();
    assert_eq!(files, ["bag_0.mcap", "metadata.yaml"]);
    // The same again into an empty folder that was there.
    let here = folder.path().join("here/bag");
    fs::create_dir_all(&here).unwrap();
    let output =
        lamplight(["export", "--quiet", "--ros2", "."]).arg(&file).current_dir(&here).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    for name in ["bag_0.mcap", "metadata.yaml"] {
        assert_eq!(fs::read(here.join(name)).unwrap(), fs::read(bag.join(name)).unwrap(), "{name}");
    }

    let Some(python) = interpreter_with_rosbags() else { return };
    let told = read(&python, &bag, file.parent().unwrap(), &[]);
    // All cells are gone in the scenes of 4, 4.5 and 5 s; five numbers are unknown in the metrics of 4 and 5 s.
    assert_eq!(told, "51 ticks, 50 robots, 3 taken back, 10 unknown\n");
}

#[test]
fn a_recording_that_was_cut_is_exported_up_to_there_and_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--duration", "60", "--engine", "in-process", "--set", "output.poses_every_s=0.1"];
    let (_, file) = recorded(&folder, &scenario("swarmbots"), &args);
    let bytes = fs::read(&file).unwrap();
    let cut = folder.path().join("cut.mcap");
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let bag = folder.path().join("bag");
    let output = export(&cut, &bag);
    assert!(output.status.success(), "{}", said(&output));
    let told = stdout(&output);
    let (first, second) = told.split_once('\n').unwrap();
    assert!(second.starts_with("the recording was cut there"), "{told}");
    let seconds: f64 = first.split(' ').nth(3).unwrap().parse().unwrap();
    assert!(seconds > 10.0 && seconds < 60.0, "{told}");

    let Some(python) = interpreter_with_rosbags() else { return };
    let ticks = (seconds * 10.0).round() as u64 + 1;
    let read = read(&python, &bag, file.parent().unwrap(), &[&ticks.to_string()]);
    assert!(read.starts_with(&format!("{ticks} ticks, 50 robots, ")), "{read}");
}

#[test]
fn what_cannot_be_replayed_cannot_be_exported_either() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("empty"), b"").unwrap();
    fs::write(path("text"), b"no recording at all").unwrap();
    let mut writer = recording::Writer::new(File::create(path("another-version")).unwrap()).unwrap();
    writer.write(Topic::Run, 0, &Run { format: 99, ..Run::default() }).unwrap();
    writer.finish().unwrap();
    let writer = recording::Writer::new(File::create(path("nothing-in-it")).unwrap()).unwrap();
    writer.finish().unwrap();
    let bag = path("bag");
    for name in ["empty", "text", "another-version", "nothing-in-it", "missing"] {
        let replayed = lamplight(["replay", "--quiet"]).arg(path(name)).output().unwrap();
        let exported = export(&path(name), &bag);
        assert_eq!(exported.status.code(), Some(2), "{name}: {}", said(&exported));
        assert_eq!(said(&exported), said(&replayed));
        assert!(said(&exported).contains(name) && !bag.exists(), "{}", said(&exported));
    }
}

#[test]
fn nothing_is_written_over_and_nothing_half_made_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = recorded(&folder, &scenario("swarmbots"), &RUN);
    // A folder with something in it, and a file.
    let run = file.parent().unwrap();
    let before = fs::read_dir(run).unwrap().count();
    for (path, what) in [(run, "is not empty"), (&file, "is a file")] {
        let output = export(&file, path);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        let told = said(&output);
        assert!(told.contains(&format!("{} {what}", path.display())), "{told}");
    }
    assert_eq!(fs::read_dir(run).unwrap().count(), before);
    // No room for it.
    let bag = folder.path().join("a/bag");
    let output = Command::new("bash")
        .args(["-c", "ulimit -f 20; exec \"$@\"", "bash"])
        .arg(program("lamplight"))
        .args(["export", "--quiet", "--ros2"])
        .args([&bag, &file])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("bag_0.mcap: File too large"), "{}", said(&output));
    assert!(!folder.path().join("a").exists());
}

#[test]
fn an_export_that_is_interrupted_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = recorded(&folder, &scenario("swarmbots"), &RUN);
    let bytes = fs::read(&file).unwrap();
    // It waits for the rest of its recording as long as we like.
    let (pipe, bag) = (folder.path().join("pipe"), folder.path().join("bag"));
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let export = lamplight(["export", "--quiet", "--ros2"])
        .args([&bag, &pipe])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut recording = File::options().write(true).open(&pipe).unwrap();
    let (first, rest) = bytes.split_at(bytes.len() / 2);
    recording.write_all(first).unwrap();
    wait_until("the bag is begun", || bag.join("bag_0.mcap.draft").exists());
    kill_process(Pid::from_child(&export), Signal::INT).unwrap();
    // Listening is another thread's; then each message is a chance to stop.
    thread::sleep(Duration::from_secs(1));
    // It may be gone before it has read all of it.
    let _ = recording.write_all(rest);
    drop(recording);
    let output = export.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    assert!(!bag.exists() && stdout(&output).is_empty(), "{}", said(&output));
}
