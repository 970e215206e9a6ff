//! A run's snapshots over a Unix socket in its folder: one line of JSON to whoever connects.

use std::{
    fs, io,
    io::{BufRead, BufReader},
    os::unix::{
        fs::PermissionsExt,
        net::{UnixListener, UnixStream},
    },
    path::Path,
    sync::Arc,
    time::Duration,
};

use super::{server, snapshot::Snapshot, state::Live};

/// How long whoever asks waits for the arena.
const PATIENCE: Duration = Duration::from_secs(1);

/// Hands out snapshots at `path`, in the run's folder, until this process ends. The socket is for its owner alone, and
/// is removed with the folder.
///
/// # Errors
/// If the socket cannot be made.
pub fn serve(path: &Path, live: Arc<Live>) -> io::Result<()> {
    let listener = UnixListener::bind(path)?;
    fs::set_permissions(path, fs::Permissions::from_mode(0o600))?;
    server::serve("live", listener.into(), live, answer)
}

/// The snapshot as a line of JSON, without being asked.
fn answer(live: &Live, _: &[u8], _: bool) -> Option<Vec<u8>> {
    let mut line = serde_json::to_vec(&live.ask()).expect("a snapshot is plain data");
    line.push(b'\n');
    Some(line)
}

/// Asks the arena of a run whose socket is at `path` for a snapshot.
///
/// # Errors
/// `NotFound` if the run cannot be watched or has ended; `ConnectionRefused` if its arena has just ended; `WouldBlock`
/// if the arena does not answer within a second; `InvalidData` if it is of another version.
pub fn ask(path: &Path) -> io::Result<Snapshot> {
    let stream = UnixStream::connect(path)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    let mut line = String::new();
    match BufReader::new(stream).read_line(&mut line)? {
        0 => Err(io::ErrorKind::ConnectionRefused.into()),
        _ => Ok(serde_json::from_str(&line)?),
    }
}

#[cfg(test)]
mod tests {
    use engine::{Awaited, Waiting};

    use super::{super::snapshot::about, *};

    #[test]
    fn a_snapshot_crosses_the_socket_for_its_owner_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("live");
        assert_eq!(ask(&path).unwrap_err().kind(), io::ErrorKind::NotFound);
        let live = Arc::new(Live::new(about(), 2400, false));
        serve(&path, Arc::clone(&live)).unwrap();
        let mode = fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        assert_eq!(ask(&path).unwrap(), live.ask());
        let waiting = Waiting { what: Awaited::Join, tick: 0, count: 3, robots: Vec::new() };
        live.tell(|snapshot| snapshot.waiting = Some(waiting.clone()));
        assert_eq!(ask(&path).unwrap().waiting, Some(waiting));
        drop(folder);
        assert_eq!(ask(&path).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
