//! The standard error of programs of the user's: a pipe for each, so that lines are whole and it is known whose they are.

use std::{
    collections::BTreeMap,
    fmt,
    io::{self, ErrorKind, PipeReader, PipeWriter, Read},
    os::fd::OwnedFd,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use logging::line::MOST_BYTES;
use protocol::robot_id::RobotId;
use rustix::{
    buffer::spare_capacity,
    event::epoll::{self, CreateFlags, EventData, EventFlags},
    fs::{OFlags, fcntl_setfl},
    io::Errno,
};

/// Pipes that are looked at in one go.
const AT_ONCE: usize = 64;
/// Bytes that are read from a program before others have their turn.
const IN_TURN: usize = 1 << 16;
/// Stands for the pipe whose end says that no program is to come.
const LAST: u64 = u64::MAX;

/// The pipes of all programs.
#[derive(Clone, Debug)]
pub(super) struct Programs {
    epoll: Arc<OwnedFd>,
    pipes: Arc<Mutex<Pipes>>,
}

#[derive(Debug, Default)]
struct Pipes {
    open: BTreeMap<u64, Pipe>,
    /// Pipes that have ever been.
    count: u64,
}

/// Source of printed lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Whose {
    /// The program that plays a life of a robot.
    Robot(RobotId),
    /// The fork server of this controller.
    Controller(String),
}

impl Whose {
    /// The robot, if it was one.
    pub(crate) fn robot(&self) -> Option<RobotId> {
        match self {
            Self::Robot(id) => Some(*id),
            Self::Controller(_) => None,
        }
    }
}

impl fmt::Display for Whose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Robot(id) => id.fmt(f),
            Self::Controller(name) => f.write_str(name),
        }
    }
}

#[derive(Debug)]
struct Pipe {
    whose: Whose,
    reader: PipeReader,
    /// The beginning of a line that is not whole yet.
    rest: Vec<u8>,
}

impl Programs {
    /// No program yet. When the writer is dropped, none is to come.
    pub(super) fn begin() -> io::Result<(Self, PipeReader, PipeWriter)> {
        let (reader, writer) = io::pipe()?;
        let epoll = epoll::create(CreateFlags::CLOEXEC)?;
        epoll::add(&epoll, &reader, EventData::new_u64(LAST), EventFlags::IN)?;
        Ok((Self { epoll: Arc::new(epoll), pipes: Arc::default() }, reader, writer))
    }

    /// The standard error of one more program.
    pub(super) fn add(&self, whose: Whose) -> io::Result<PipeWriter> {
        let (reader, writer) = io::pipe()?;
        // Of the reading end alone: programs wait for a full pipe.
        fcntl_setfl(&reader, OFlags::NONBLOCK)?;
        let mut pipes = self.pipes();
        let key = pipes.count;
        epoll::add(&self.epoll, &reader, EventData::new_u64(key), EventFlags::IN)?;
        pipes.open.insert(key, Pipe { whose, reader, rest: Vec::new() });
        pipes.count += 1;
        Ok(writer)
    }

    /// Hands lines to `take`, without their ends and with whose they are, until the last program that is to come has closed
    /// its end. `last` is held that long.
    pub(super) fn gather(&self, last: PipeReader, take: impl Fn(&Whose, &[u8])) {
        let (mut ready, mut chunk) = (Vec::with_capacity(AT_ONCE), vec![0; IN_TURN]);
        let mut last = Some(last);
        while last.is_some() || !self.pipes().open.is_empty() {
            match epoll::wait(&self.epoll, spare_capacity(&mut ready), None) {
                Ok(_) | Err(Errno::INTR) => {}
                Err(_) => return,
            }
            for event in ready.drain(..) {
                match event.data.u64() {
                    LAST => last = None,
                    key => self.read(key, &mut chunk, &take),
                }
            }
        }
    }

    /// Reads what one program has printed. Nobody is held up meanwhile who adds another.
    fn read(&self, key: u64, chunk: &mut [u8], take: impl Fn(&Whose, &[u8])) {
        let Some(mut pipe) = self.pipes().open.remove(&key) else { return };
        let is_open = match pipe.reader.read(chunk) {
            Ok(0) => false,
            Ok(bytes) => {
                pipe.rest.extend(&chunk[..bytes]);
                true
            }
            Err(error) => matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted),
        };
        lines(&mut pipe.rest, !is_open, |line| take(&pipe.whose, line));
        if is_open {
            self.pipes().open.insert(key, pipe);
        }
    }

    fn pipes(&self) -> MutexGuard<'_, Pipes> {
        self.pipes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Takes whole lines out of `text`, without their ends; at the end of all also one that is not whole. What is longer than
/// a line can be comes in pieces.
fn lines(text: &mut Vec<u8>, is_end: bool, mut take: impl FnMut(&[u8])) {
    let mut done = 0;
    loop {
        let left = &text[done..];
        let newline = left.iter().take(MOST_BYTES).position(|&byte| byte == b'\n');
        let (line, taken) = match newline {
            Some(at) => (&left[..at], at + 1),
            None if left.len() >= MOST_BYTES => (&left[..MOST_BYTES], MOST_BYTES),
            None if is_end && !left.is_empty() => (left, left.len()),
            None => break,
        };
        take(line);
        done += taken;
    }
    text.drain(..done);
}

#[cfg(test)]
mod tests {
    use std::{
        process::{Command, Stdio},
        sync::mpsc,
        thread,
    };

    use super::*;

    fn of(text: &str, is_end: bool) -> (Vec<String>, String) {
        let (mut text, mut taken) = (text.as_bytes().to_vec(), Vec::new());
        lines(&mut text, is_end, |line| taken.push(String::from_utf8(line.to_vec()).unwrap()));
        (taken, String::from_utf8(text).unwrap())
    }

    #[test]
    fn lines_are_taken_when_they_are_whole() {
        assert_eq!(of("a\n\nbc", false), (vec!["a".into(), String::new()], "bc".into()));
        assert_eq!(of("a\nbc", true), (vec!["a".into(), "bc".into()], String::new()));
        let long = "x".repeat(MOST_BYTES + 3);
        assert_eq!(of(&long, false), (vec!["x".repeat(MOST_BYTES)], "xxx".into()));
    }

    #[test]
    fn programs_that_print_at_once_do_not_mix_and_the_last_one_ends_it() {
        let (programs, last_reader, last) = Programs::begin().unwrap();
        let (sender, printed) = mpsc::channel();
        let reader = programs.clone();
        let gathering = thread::spawn(move || {
            reader.gather(last_reader, |whose, line| {
                let Whose::Robot(id) = whose else { unreachable!("they are all robots") };
                sender.send((id.index, String::from_utf8(line.to_vec()).unwrap())).unwrap();
            });
        });
        let mut children: Vec<_> = (0..4)
            .map(|robot| {
                let script =
                    "for i in 1 2 3 4 5; do printf a; printf '%s\\n' b >&2; printf c >&2; echo d >&2; done";
                let mut command = Command::new("sh");
                let error = programs.add(Whose::Robot(RobotId::first(robot))).unwrap();
                command.args(["-c", script]).stdout(Stdio::null()).stderr(error).spawn().unwrap()
            })
            .collect();
        drop(last);
        assert!(children.iter_mut().all(|child| child.wait().unwrap().success()));
        gathering.join().unwrap();
        let mut lines: Vec<(u32, String)> = printed.iter().collect();
        lines.sort();
        let of_robot = |robot| {
            let line = |text: &str| std::iter::repeat_n((robot, text.to_owned()), 5);
            line("b").chain(line("cd"))
        };
        assert_eq!(lines, (0..4).flat_map(of_robot).collect::<Vec<_>>());
    }
}
