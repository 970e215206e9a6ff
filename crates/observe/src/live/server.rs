//! Serves a listening socket: a request from each client, one answer, the end of the connection.
//!
//! One thread waits with `poll` for whoever is ready, so a client that sends or reads slowly, or not at all, holds up
//! nobody else. Each has [`PATIENCE`], and there are at most [`CLIENTS_MAX`] at once: one more, and the oldest is
//! dropped. Who is dropped is counted ([`Dropped`](super::snapshot::Dropped)).

use std::{
    fs::File,
    io::{self, Read, Write},
    os::fd::OwnedFd,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    io::ioctl_fionbio,
    net::{SocketFlags, accept_with},
};

use super::state::Live;

/// Most clients of one socket at once; each takes a descriptor.
pub const CLIENTS_MAX: usize = 96;
/// How long a client gets in all, for its request and for its answer: as long as Prometheus waits.
const PATIENCE: Duration = Duration::from_secs(10);
/// Pause after a connection that could not be made, as when no descriptor is free.
const PAUSE: Duration = Duration::from_millis(100);
/// Most bytes read at once.
const CHUNK: usize = 1024;

/// Answers what a client has sent so far; `None` if more must come. The flag says that nothing more will.
pub(super) type Answer = fn(&Live, &[u8], bool) -> Option<Vec<u8>>;

/// Serves `listener` until this process ends, in a thread called `name`.
///
/// # Errors
/// If the socket cannot be set up, or no thread made.
pub(super) fn serve(name: &str, listener: OwnedFd, live: Arc<Live>, answer: Answer) -> io::Result<()> {
    let mut server = Server::of(listener, live, answer, PATIENCE)?;
    thread::Builder::new().name(name.into()).spawn(move || {
        loop {
            server.turn();
        }
    })?;
    Ok(())
}

#[derive(Debug)]
struct Server {
    listener: OwnedFd,
    live: Arc<Live>,
    answer: Answer,
    patience: Duration,
    /// In the order in which they came.
    clients: Vec<Client>,
    /// Until then, no client is let in.
    paused: Option<Instant>,
}

#[derive(Debug)]
struct Client {
    stream: File,
    since: Instant,
    exchange: Exchange,
}

#[derive(Debug)]
enum Exchange {
    /// As much of the request as has come.
    Request(Vec<u8>),
    /// The answer, of which so many bytes are sent.
    Answer(Vec<u8>, usize),
}

impl Server {
    fn of(listener: OwnedFd, live: Arc<Live>, answer: Answer, patience: Duration) -> io::Result<Self> {
        // A client that has gone again must not be waited for.
        ioctl_fionbio(&listener, true)?;
        Ok(Self { listener, live, answer, patience, clients: Vec::new(), paused: None })
    }

    /// Waits until somebody is ready or has had their time, and does for everybody what can be done at once.
    fn turn(&mut self) {
        let Ok(mut ready) = self.wait() else {
            // Interrupted, or without memory: either passes.
            thread::sleep(PAUSE);
            return;
        };
        let now = Instant::now();
        let may_enter = ready.pop() == Some(true);
        let mut ready = ready.into_iter();
        let Self { clients, live, answer, patience, .. } = self;
        clients.retain_mut(|client| {
            let goes_on = ready.next() == Some(false) || client.serve(live, *answer);
            let in_time = now < client.since + *patience;
            if goes_on && !in_time {
                live.tell(|snapshot| snapshot.dropped.late += 1);
            }
            goes_on && in_time
        });
        if may_enter {
            self.admit(now);
        }
    }

    /// Which clients are ready, in their order, and at the end whether somebody wants to come in.
    fn wait(&mut self) -> io::Result<Vec<bool>> {
        let now = Instant::now();
        self.paused = self.paused.filter(|&until| now < until);
        let first_late = self.clients.first().map(|client| client.since + self.patience);
        let until = self.paused.into_iter().chain(first_late).min();
        let timeout = until.map(|until| Timespec::try_from(until.saturating_duration_since(now)));
        let timeout = timeout.transpose().expect("it is shorter than the patience, or the pause");
        let entrance = if self.paused.is_some() { PollFlags::empty() } else { PollFlags::IN };
        let clients = self.clients.iter().map(|client| PollFd::new(&client.stream, client.awaits()));
        let mut all: Vec<_> = clients.chain([PollFd::new(&self.listener, entrance)]).collect();
        poll(&mut all, timeout.as_ref())?;
        Ok(all.iter().map(|polled| !polled.revents().is_empty()).collect())
    }

    /// Lets a client in.
    fn admit(&mut self, now: Instant) {
        match accept_with(&self.listener, SocketFlags::NONBLOCK | SocketFlags::CLOEXEC) {
            Ok(stream) => {
                let exchange = Exchange::Request(Vec::new());
                let mut client = Client { stream: stream.into(), since: now, exchange };
                if client.serve(&self.live, self.answer) {
                    self.clients.push(client);
                }
            }
            // It has gone again.
            Err(rustix::io::Errno::AGAIN | rustix::io::Errno::CONNABORTED) => {}
            Err(_) => self.paused = Some(now + PAUSE),
        }
        if self.clients.len() > CLIENTS_MAX {
            // Counted first: whoever notices that it was dropped finds it counted.
            self.live.tell(|snapshot| snapshot.dropped.crowded_out += 1);
            self.clients.remove(0);
        }
    }
}

impl Client {
    /// Events that its socket is polled for.
    fn awaits(&self) -> PollFlags {
        match self.exchange {
            Exchange::Request(_) => PollFlags::IN,
            Exchange::Answer(..) => PollFlags::OUT,
        }
    }

    /// Reads and writes what can be at once. Returns whether there is more to do: not if it has its answer, or has
    /// broken off, which it has its reasons for.
    fn serve(&mut self, live: &Live, answer: Answer) -> bool {
        use io::ErrorKind::{Interrupted, WouldBlock};
        match self.exchange(live, answer) {
            Ok(()) => false,
            Err(error) => matches!(error.kind(), WouldBlock | Interrupted),
        }
    }

    /// To the end of the exchange.
    fn exchange(&mut self, live: &Live, answer: Answer) -> io::Result<()> {
        let mut ended = false;
        loop {
            match &mut self.exchange {
                Exchange::Request(request) => match answer(live, request, ended) {
                    Some(bytes) => self.exchange = Exchange::Answer(bytes, 0),
                    None if ended => return Ok(()),
                    None => {
                        let mut chunk = [0; CHUNK];
                        let read = self.stream.read(&mut chunk)?;
                        request.extend_from_slice(&chunk[..read]);
                        ended = read == 0;
                    }
                },
                Exchange::Answer(bytes, sent) if *sent == bytes.len() => return Ok(()),
                Exchange::Answer(bytes, sent) => *sent += self.stream.write(&bytes[*sent..])?,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{
        net::Shutdown,
        os::unix::net::{UnixListener, UnixStream},
        path::Path,
    };

    use super::*;
    use crate::live::{Dropped, snapshot::about};

    /// More than the buffers of a socket hold.
    const LARGE: usize = 16 << 20;

    /// A line is answered by itself, `large` by a great deal.
    fn echo(_: &Live, request: &[u8], _: bool) -> Option<Vec<u8>> {
        let line = request.strip_suffix(b"\n")?;
        Some(if line == b"large" { vec![b'x'; LARGE] } else { line.to_vec() })
    }

    /// A socket that is served, in a folder of its own.
    fn served(patience: Duration) -> (tempfile::TempDir, Arc<Live>) {
        let folder = tempfile::tempdir().unwrap();
        let listener = OwnedFd::from(UnixListener::bind(folder.path().join("socket")).unwrap());
        let live = Arc::new(Live::new(about(), 10, true));
        let mut server = Server::of(listener, Arc::clone(&live), echo, patience).unwrap();
        thread::spawn(move || {
            loop {
                server.turn();
            }
        });
        (folder, live)
    }

    fn connect(folder: &Path) -> UnixStream {
        UnixStream::connect(folder.join("socket")).unwrap()
    }

    /// The rest of an exchange.
    fn ask(mut stream: UnixStream, line: &str) -> String {
        stream.write_all(line.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    #[test]
    fn idle_slow_and_deaf_clients_hold_up_nobody() {
        let (folder, live) = served(Duration::from_secs(3600));
        let idle: Vec<_> = (0..CLIENTS_MAX / 3).map(|_| connect(folder.path())).collect();
        let mut slow: Vec<_> = (0..CLIENTS_MAX / 3).map(|_| connect(folder.path())).collect();
        slow.iter_mut().for_each(|stream| stream.write_all(b"half of ").unwrap());
        let mut deaf: Vec<_> = (0..2).map(|_| connect(folder.path())).collect();
        deaf.iter_mut().for_each(|stream| stream.write_all(b"large\n").unwrap());
        for _ in 0..10 {
            assert_eq!(ask(connect(folder.path()), "quick\n"), "quick");
        }
        assert_eq!(live.ask().dropped, Dropped::default(), "all of them are still there");
        idle.into_iter().for_each(|stream| assert_eq!(ask(stream, "late\n"), "late"));
        slow.into_iter().for_each(|stream| assert_eq!(ask(stream, "it\n"), "half of it"));
        deaf.into_iter().for_each(|stream| assert_eq!(ask(stream, "").len(), LARGE));
    }

    #[test]
    fn beyond_the_bound_the_oldest_client_is_dropped_and_counted() {
        let (folder, live) = served(Duration::from_secs(3600));
        let mut idle: Vec<_> = (0..CLIENTS_MAX + 2).map(|_| connect(folder.path())).collect();
        let kept = idle.split_off(2);
        idle.iter_mut().for_each(|stream| assert_eq!(stream.read(&mut [0]).unwrap(), 0));
        assert_eq!(live.ask().dropped, Dropped { crowded_out: 2, ..Dropped::default() });
        kept.into_iter().for_each(|stream| assert_eq!(ask(stream, "kept\n"), "kept"));
    }

    #[test]
    fn who_takes_too_long_is_dropped_and_counted_whatever_they_wait_for() {
        let (folder, live) = served(Duration::from_millis(50));
        let (mut idle, mut deaf) = (connect(folder.path()), connect(folder.path()));
        deaf.write_all(b"large\n").unwrap();
        assert_eq!(idle.read(&mut [0]).unwrap(), 0);
        while live.ask().dropped.late < 2 {
            thread::sleep(Duration::from_millis(1));
        }
        assert!(ask(deaf, "").len() < LARGE, "a part of the answer is all it gets");
    }

    #[test]
    fn a_request_that_ends_too_early_has_no_answer() {
        let (folder, live) = served(Duration::from_secs(3600));
        let stream = connect(folder.path());
        stream.shutdown(Shutdown::Write).unwrap();
        let mut answer = String::new();
        (&stream).read_to_string(&mut answer).unwrap();
        assert_eq!((answer.as_str(), live.ask().dropped), ("", Dropped::default()));
    }
}
