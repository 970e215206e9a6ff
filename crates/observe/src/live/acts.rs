//! Acts upon a run: the socket `acts` in its folder. A line of JSON asks for an act, a line of JSON says what became of it.

use std::{
    fs,
    io::{self, BufRead, BufReader, Read, Write},
    os::unix::{
        fs::PermissionsExt,
        net::{UnixListener, UnixStream},
    },
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use engine::act::{Act, Acts, Done, Refused};

/// Longest line of a client, bytes.
const LINE_BYTES_MAX: u64 = 1 << 16;
/// Most clients at once; one more is turned away.
const CLIENTS_MAX: usize = 16;
/// How long a client may take to ask.
const PATIENCE: Duration = Duration::from_secs(10);

/// Takes acts at `path`, in the run's folder, until this process ends. The socket is for its owner alone, and is removed
/// with the folder.
///
/// # Errors
/// If the socket cannot be made.
pub fn serve(path: &Path, acts: Acts) -> io::Result<()> {
    let listener = UnixListener::bind(path)?;
    fs::set_permissions(path, fs::Permissions::from_mode(0o600))?;
    let count = Arc::new(AtomicUsize::new(0));
    thread::Builder::new().name("acts".into()).spawn(move || {
        for stream in listener.incoming().flatten() {
            if count.fetch_add(1, Ordering::Relaxed) >= CLIENTS_MAX {
                count.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            let (acts, counted) = (acts.clone(), Arc::clone(&count));
            let served = thread::Builder::new().name("acts-client".into()).spawn(move || {
                // A client that has gone does not want to know.
                let _ = answer(stream, &acts);
                counted.fetch_sub(1, Ordering::Relaxed);
            });
            if served.is_err() {
                count.fetch_sub(1, Ordering::Relaxed);
            }
        }
    })?;
    Ok(())
}

/// Answers the one act that a client asks for.
fn answer(stream: UnixStream, acts: &Acts) -> io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut line = String::new();
    BufReader::new((&stream).take(LINE_BYTES_MAX)).read_line(&mut line)?;
    let outcome: Result<Done, Refused> = match serde_json::from_str::<Act>(&line) {
        Ok(act) => acts.ask(act).recv().unwrap_or_else(|_| Err("the run is over".into())),
        Err(error) => Err(format!("that is no act: {error}")),
    };
    let mut answer = serde_json::to_vec(&outcome)?;
    answer.push(b'\n');
    (&stream).write_all(&answer)
}

/// Asks the run whose socket is at `path` for an act; what becomes of it is known before its next tick.
///
/// # Errors
/// `NotFound` or `ConnectionRefused` if the run has ended; `InvalidData` if its arena is of another version.
pub fn ask(path: &Path, act: &Act) -> io::Result<Result<Done, Refused>> {
    let mut stream = UnixStream::connect(path)?;
    let mut line = serde_json::to_vec(act)?;
    line.push(b'\n');
    stream.write_all(&line)?;
    let mut answer = String::new();
    match BufReader::new(stream).read_line(&mut answer)? {
        0 => Ok(Err("the run is over".into())),
        _ => Ok(serde_json::from_str(&answer)?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_act_or_comes_too_late_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (path, acts) = (folder.path().join("acts"), Acts::default());
        serve(&path, acts.clone()).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        let mut stream = UnixStream::connect(&path).unwrap();
        stream.write_all(b"{\"do\":\"fly\"}\n").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.contains("no act") && answer.contains("fly"), "{answer}");
        acts.close();
        let asked = thread::spawn(move || ask(&path, &Act::Pause));
        assert_eq!(asked.join().unwrap().unwrap(), Err("the run is over".into()));
    }
}
