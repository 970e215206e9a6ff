//! The log of a run: what its processes write and what this one does, gathered in one place.
//!
//! Our agents and the arena have one pipe for their standard error, all the same one. [`Gatherer`] reads it, and each line
//! goes on to our own standard error, around the live line, and to `log.txt` or `log.jsonl` in the folder of the
//! run. The pipe takes a line whole or not at all, and nobody waits for it: while we do not read (stopped, or our
//! own standard error is stuck), lines are lost and counted, and robots go on.
//!
//! Programs of the user's have a pipe each, which they wait for ([`programs`]): what they print is theirs, in pieces as
//! small as they like, and `eprintln!` panics where a pipe takes nothing.

mod programs;

use std::{
    convert::Infallible,
    io::{self, BufRead, BufReader, PipeReader, PipeWriter, Read},
    path::{Path, PathBuf},
    process::Stdio,
    sync::{
        Mutex, MutexGuard, PoisonError,
        mpsc::{self, Receiver},
    },
    thread,
    time::Duration,
};

use anstream::adapter::strip_bytes;
use anyhow::Context;
use files::{Lines, WriteError};
use logging::{
    Format,
    line::{JSON_BEGINS, MOST_BYTES},
};
use observe::progress::{beside_live_line, init_log};
use protocol::robot_id::RobotId;
use rustix::{
    fs::{OFlags, fcntl_setfl},
    pipe::fcntl_setpipe_size,
};
use tracing::Level;

use self::programs::Programs;
pub(crate) use self::programs::Whose;

/// Most bytes of a log that are kept in a run's folder: 64 MiB, some 300,000 lines.
const KEPT_BYTES_MAX: u64 = 64 << 20;

/// Room in the pipe for what a swarm says at once, bytes: as much as Linux grants everybody (pipe(7)).
const PIPE_BYTES: usize = 1 << 20;
/// Beginnings of lines that a program's log has written: it names the robot itself.
const LOGGED: [&[u8]; 5] = [b"ERROR ", b" WARN ", b" INFO ", b"DEBUG ", b"TRACE "];

/// How long the end of the pipe is waited for once all children have ended.
const STRAGGLERS: Duration = Duration::from_secs(1);

/// The log in the run's folder, if one is kept.
static KEPT: Mutex<Option<Kept>> = Mutex::new(None);

/// Begins to log. `quiet` leaves warnings and errors.
pub(crate) fn begin(quiet: bool, format: Format) {
    init_log(quiet, format, write, true);
}

/// Warns of what may not mean in a scenario what its author thinks.
pub(crate) fn warn_of(warnings: &[String]) {
    warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
}

/// Keeps from here on what is logged: in `log.txt` or `log.jsonl` in `folder`, made by the first line.
pub(crate) fn keep_in(folder: &Path) {
    let name = match logging::format() {
        Format::Text => "log.txt",
        Format::Json => "log.jsonl",
    };
    *kept() = Some(Kept::new(folder.join(name), KEPT_BYTES_MAX));
}

/// Ends the log in the run's folder; its last line says how many there was no room for. Returns whether the disk has
/// taken all that was to be kept.
pub(crate) fn end() -> bool {
    let Some(mut log) = kept().take() else { return true };
    if let Some(line) = log.last_line() {
        let _ = beside_live_line(line.bytes());
    }
    !log.is_broken
}

/// Where lines of this process go, and those that are gathered.
fn write(line: &[u8]) -> io::Result<()> {
    let trouble = kept().as_mut().and_then(|log| log.keep(line).err().map(|error| log.give_up(&error)));
    if let Some(trouble) = trouble {
        let _ = beside_live_line(trouble.bytes());
    }
    beside_live_line(line)
}

fn kept() -> MutexGuard<'static, Option<Kept>> {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A bounded file of lines.
#[derive(Debug)]
struct Kept {
    path: PathBuf,
    file: Option<Lines>,
    bytes: u64,
    /// Lines for which there was no room, or no disk.
    left_out: u64,
    /// Whether there was no disk.
    is_broken: bool,
    /// Bytes there is room for.
    most: u64,
}

impl Kept {
    fn new(path: PathBuf, most: u64) -> Self {
        Self { path, file: None, bytes: 0, left_out: 0, is_broken: false, most }
    }

    /// Keeps a line, without the colors of a terminal.
    fn keep(&mut self, line: &[u8]) -> Result<(), WriteError> {
        let line = &strip_bytes(line).into_vec()[..];
        // Once something is left out, so is all that follows: a log with holes would deceive.
        if self.left_out > 0 || self.bytes + line.len() as u64 > self.most {
            self.left_out += 1;
            return Ok(());
        }
        self.bytes += line.len() as u64;
        self.append(line)
    }

    fn append(&mut self, line: &[u8]) -> Result<(), WriteError> {
        let file = match &mut self.file {
            Some(file) => file,
            None => {
                let length = self.path.metadata().map_or(0, |file| file.len());
                self.file.insert(Lines::go_on(&self.path, length)?)
            }
        };
        file.add(line)
    }

    /// From here on all is left out.
    fn give_up(&mut self, error: &WriteError) -> logging::line::Line {
        self.left_out = 1;
        self.is_broken = true;
        let words = format_args!("{error}; the rest of the log is left out");
        logging::line(Level::WARN, module_path!(), &words)
    }

    /// Returns a last line that counts what was left out, written to the file too.
    fn last_line(&mut self) -> Option<logging::line::Line> {
        let left_out = self.left_out;
        let words = format_args!("{}: {left_out} lines are left out", self.path.display());
        let line = (left_out > 0).then(|| logging::line(Level::WARN, module_path!(), &words))?;
        // If the disk is full, the line on standard error has to do.
        let _ = self.append(line.bytes());
        Some(line)
    }
}

/// Reads what children write to their standard error.
#[derive(Debug)]
pub(crate) struct Gatherer {
    programs: Programs,
    /// Of our own programs, and one whose end says that no program of the user's is to come; `None` once no child is.
    writers: Option<[PipeWriter; 2]>,
    /// Ends with the last reader.
    readers: Receiver<Infallible>,
}

impl Gatherer {
    /// Opens the pipes and reads each in a thread.
    pub(crate) fn begin() -> anyhow::Result<Self> {
        let (at_work, readers) = mpsc::channel::<Infallible>();
        let (reader, ours) = io::pipe().context("cannot open a pipe for the log")?;
        // Where the user's pipes take too much already, this one stays smaller, and fills earlier.
        let _ = fcntl_setpipe_size(&ours, PIPE_BYTES);
        // All duplicates of a descriptor share this: no child waits for a full pipe.
        fcntl_setfl(&ours, OFlags::NONBLOCK).context("cannot set up the pipe for the log")?;
        let (programs, last, theirs) = Programs::begin().context("cannot set up the programs' log")?;
        let (also_at_work, pipes) = (at_work.clone(), programs.clone());
        thread::spawn(move || {
            gather(reader);
            drop(at_work);
        });
        thread::spawn(move || {
            // If standard error is gone, the file may still be there.
            pipes.gather(last, |whose, printed| drop(write(&told(whose, printed))));
            drop(also_at_work);
        });
        Ok(Self { programs, writers: Some([ours, theirs]), readers })
    }

    /// The standard error of one more child, which is a program of ours.
    pub(crate) fn standard_error(&self) -> io::Result<Stdio> {
        let [ours, _] = self.writers.as_ref().expect("they are there until this is dropped");
        ours.try_clone().map(Stdio::from)
    }

    /// The same for a program of the user's.
    pub(crate) fn standard_error_of_program(&self, whose: Whose) -> io::Result<PipeWriter> {
        self.programs.add(whose)
    }
}

impl Drop for Gatherer {
    /// Once all children have ended: until then the pipe has no end. Whoever of theirs holds it all the same, out of our
    /// reach, is not waited for.
    fn drop(&mut self) {
        self.writers = None;
        let _ = self.readers.recv_timeout(STRAGGLERS);
    }
}

/// Hands on every line until the last writer is gone.
fn gather(pipe: PipeReader) {
    let mut pipe = BufReader::with_capacity(PIPE_BYTES / 16, pipe);
    let mut line = Vec::with_capacity(MOST_BYTES);
    loop {
        line.clear();
        // What is longer than a line can be is no line of ours, and comes in pieces.
        match (&mut pipe).take(MOST_BYTES as u64).read_until(b'\n', &mut line) {
            Ok(1..) => {}
            Ok(0) | Err(_) => return,
        }
        if line.last() != Some(&b'\n') {
            line.push(b'\n');
        }
        // If standard error is gone, the file may still be there.
        let _ = match logging::format() {
            Format::Json if !line.starts_with(JSON_BEGINS.as_bytes()) => write(foreign(None, &line).bytes()),
            _ => write(&line),
        };
    }
}

/// Makes a line of the log of one that a program has printed.
fn told(whose: &Whose, printed: &[u8]) -> Vec<u8> {
    let as_it_is = || [printed, b"\n"].concat();
    match logging::format() {
        Format::Json if printed.starts_with(JSON_BEGINS.as_bytes()) => as_it_is(),
        Format::Json => foreign(whose.robot(), printed).bytes().to_vec(),
        Format::Text if LOGGED.iter().any(|begin| printed.starts_with(begin)) => as_it_is(),
        Format::Text => [format!("{whose}: ").as_bytes(), printed, b"\n"].concat(),
    }
}

/// Makes a line of JSON of what no log has written, such as the message of a panic; of the robot's, if it is known whose.
fn foreign(robot: Option<RobotId>, line: &[u8]) -> logging::line::Line {
    logging::line_of(robot, Level::WARN, "stderr", &String::from_utf8_lossy(line).trim_end())
}

#[cfg(test)]
mod tests {
    use std::{fs, io::Write};

    use super::*;

    #[test]
    fn a_log_that_is_full_says_how_much_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.txt");
        let mut log = Kept::new(path.clone(), 10);
        for line in ["1234\n", "longer\n", "6789\n", "x\n"] {
            log.keep(line.as_bytes()).unwrap();
        }
        let told = log.last_line().unwrap();
        let expected = format!(" WARN {}: 3 lines are left out\n", path.display());
        assert_eq!(std::str::from_utf8(told.bytes()).unwrap(), expected);
        assert_eq!(fs::read_to_string(path).unwrap(), format!("1234\n{expected}"));
    }

    #[test]
    fn what_is_colored_on_a_terminal_is_kept_plain() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.txt");
        Kept::new(path.clone(), 100).keep(b"\x1b[33m WARN\x1b[0m tick 3: look\n").unwrap();
        assert_eq!(fs::read_to_string(path).unwrap(), " WARN tick 3: look\n");
    }

    #[test]
    fn a_log_without_a_line_is_no_file_and_a_folder_that_is_gone_is_told_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("nowhere/log.txt");
        let mut log = Kept::new(path.clone(), 10);
        assert!(log.last_line().is_none() && !path.exists());
        let error = log.keep(b"1234\n").unwrap_err();
        let told = log.give_up(&error);
        assert!(std::str::from_utf8(told.bytes()).unwrap().contains("the rest of the log is left out"));
        log.keep(b"5678\n").unwrap();
        assert_eq!(log.left_out, 2);
    }

    #[test]
    fn what_is_no_json_becomes_the_message_of_some() {
        let words = "thread 'main' panicked at \"here\"";
        // Text is the format of a process that has not begun to log.
        let line = foreign(None, format!("{words}\n").as_bytes());
        assert_eq!(std::str::from_utf8(line.bytes()).unwrap(), format!(" WARN {words}\n"));
    }

    #[test]
    fn printed_lines_name_their_robot_and_those_of_a_log_do_already() {
        let id = RobotId::first(3).reborn();
        let whose = Whose::Robot(id);
        assert_eq!(told(&whose, b"hello"), b"robot 3 (life 2): hello\n");
        assert_eq!(told(&whose, b" WARN robot 3 tick 5: look"), b" WARN robot 3 tick 5: look\n");
    }

    #[test]
    fn a_pipe_that_nobody_reads_holds_nobody_up() {
        let (mut reader, mut writer) = io::pipe().unwrap();
        fcntl_setfl(&writer, OFlags::NONBLOCK).unwrap();
        let line = [b'x'; MOST_BYTES];
        let mut taken = 0;
        let error = loop {
            match writer.write(&line) {
                // In one piece, or it would mix with others.
                Ok(bytes) => taken += usize::from(bytes == MOST_BYTES),
                Err(error) => break error,
            }
        };
        assert_eq!(error.kind(), io::ErrorKind::WouldBlock);
        drop(writer);
        let mut all = Vec::new();
        reader.read_to_end(&mut all).unwrap();
        assert_eq!(all.len(), taken * MOST_BYTES, "every line that was taken is whole");
    }
}
