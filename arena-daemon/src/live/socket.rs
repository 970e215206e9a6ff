//! A run's snapshots over a Unix socket in its folder: one line of JSON to whoever connects.

use std::{
    fs, io,
    io::{BufRead, BufReader},
    os::unix::{
        fs::PermissionsExt,
        net::{UnixListener, UnixStream},
    },
    sync::Arc,
    time::Duration,
};

use transport::run_dir::RunDir;

use super::{Live, Snapshot, server};

/// How long whoever asks waits for the arena.
const PATIENCE: Duration = Duration::from_secs(1);

/// Hands out snapshots of `run` until this process ends. The socket is for its owner alone, and is removed with the
/// run's folder.
///
/// # Errors
/// If the socket cannot be made.
pub fn serve(run: &RunDir, live: Arc<Live>) -> io::Result<()> {
    let path = run.live_path();
    let listener = UnixListener::bind(&path)?;
    fs::set_permissions(&path, fs::Permissions::from_mode(0o600))?;
    server::serve("live", listener.into(), live, answer)
}

/// The snapshot as a line of JSON, without being asked.
fn answer(live: &Live, _: &[u8], _: bool) -> Option<Vec<u8>> {
    let mut line = serde_json::to_vec(&live.ask()).expect("a snapshot is plain data");
    line.push(b'\n');
    Some(line)
}

/// Asks the arena of `run` for a snapshot.
///
/// # Errors
/// `NotFound` if the run cannot be watched or has ended; `ConnectionRefused` if its arena has just ended; `WouldBlock`
/// if the arena does not answer within a second; `InvalidData` if it is of another version.
pub fn ask(run: &RunDir) -> io::Result<Snapshot> {
    let stream = UnixStream::connect(run.live_path())?;
    stream.set_read_timeout(Some(PATIENCE))?;
    let mut line = String::new();
    match BufReader::new(stream).read_line(&mut line)? {
        0 => Err(io::ErrorKind::ConnectionRefused.into()),
        _ => Ok(serde_json::from_str(&line)?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::{Waiting, tests::about};

    #[test]
    fn a_snapshot_crosses_the_socket_for_its_owner_alone() {
        let name = format!("test-live-{}", std::process::id()).parse().unwrap();
        let (run, owner) = RunDir::create(name).unwrap();
        assert_eq!(ask(&run).unwrap_err().kind(), io::ErrorKind::NotFound);
        let live = Arc::new(Live::new(about(), 2400, false));
        serve(&run, Arc::clone(&live)).unwrap();
        let mode = fs::metadata(run.live_path()).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        assert_eq!(ask(&run).unwrap(), live.ask());
        let waiting = Waiting { what: crate::live::Awaited::Join, tick: 0, count: 3, robots: Vec::new() };
        live.wait_for(Some(waiting.clone()));
        assert_eq!(ask(&run).unwrap().waiting, Some(waiting));
        run.remove_own(owner).unwrap();
        assert_eq!(ask(&run).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
