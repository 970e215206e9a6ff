//! Where a run keeps what its processes share: `/dev/shm/lamplight-NAME/`.
//!
//! ```text
//! lock        held by the arena while it lives (flock): tells a live run from a dead one's rest
//! setup.bin   what every agent is told at its start (`codec`)
//! doorbell    the page of `doorbell`
//! iox2/       iceoryx2's service and node files
//! ```
//!
//! iceoryx2's shared memory itself lies beside the folder, as files named `lamplight-NAME.*`. A
//! name holds no dot, so the files of one run never carry the prefix of another.

use std::{
    fmt, fs,
    fs::{File, TryLockError},
    io,
    path::{Path, PathBuf},
    process,
    string::{String, ToString},
    vec::Vec,
};

/// POSIX shared memory lives here on Linux; a tmpfs.
const SHARED_MEMORY: &str = "/dev/shm";
const PREFIX: &str = "lamplight-";
/// Longest name of a run: iceoryx2 adds some 60 characters, a file name ends at 255.
pub const NAME_MAX: usize = 64;

/// A run's name: 1 to [`NAME_MAX`] letters, digits, `-` and `_`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RunName(String);

/// Why a string is no name of a run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no name for a run: use 1 to {NAME_MAX} letters, digits, `-` and `_`")]
pub struct NameError(String);

impl std::str::FromStr for RunName {
    type Err = NameError;

    fn from_str(name: &str) -> Result<Self, NameError> {
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        match (1..=NAME_MAX).contains(&name.len()) && name.chars().all(allowed) {
            true => Ok(Self(name.to_string())),
            false => Err(NameError(name.to_string())),
        }
    }
}

impl fmt::Display for RunName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Why a run's folder cannot be made or found.
#[derive(Debug, thiserror::Error)]
pub enum RunDirError {
    /// The name is in use.
    #[error("a run named `{0}` is alive; choose another name, or none")]
    Alive(RunName),
    /// There is no such run.
    #[error("no run named `{0}` is alive; start one with `lamplight run SCENARIO --name {0}`")]
    NotFound(RunName),
    /// The file system said no.
    #[error("{path}: {error}", path = path.display())]
    Io {
        /// What was touched.
        path: PathBuf,
        /// What was said.
        error: io::Error,
    },
}

/// The folder of one run.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RunDir {
    name: RunName,
}

/// Held by the arena as long as its run lives. The operating system lets go of it whatever ends
/// the process.
#[derive(Debug)]
pub struct RunLock {
    _file: File,
}

impl RunDir {
    /// The folder of the run `name`, whether there is one or not.
    pub fn of(name: RunName) -> Self {
        Self { name }
    }

    /// Makes the folder and takes its lock. What a dead run of the same name left is removed.
    pub fn create(name: RunName) -> Result<(Self, RunLock), RunDirError> {
        let dir = Self::of(name);
        if dir.is_alive() {
            return Err(RunDirError::Alive(dir.name));
        }
        dir.remove()?;
        // The folder appears under its name with the lock already held, so nobody can take it for dead.
        let hidden = dir.hidden(process::id());
        let failed = |path: &Path, error| RunDirError::Io { path: path.to_path_buf(), error };
        fs::create_dir(&hidden).map_err(|error| failed(&hidden, error))?;
        let locked = File::create(hidden.join("lock")).and_then(|file| match file.try_lock() {
            Ok(()) => Ok(file),
            Err(TryLockError::Error(error)) => Err(error),
            Err(TryLockError::WouldBlock) => Err(io::ErrorKind::ResourceBusy.into()),
        });
        match locked.and_then(|file| fs::rename(&hidden, dir.path()).map(|()| file)) {
            Ok(file) => Ok((dir, RunLock { _file: file })),
            Err(error) => {
                let _ = fs::remove_dir_all(&hidden);
                match error.kind() {
                    io::ErrorKind::DirectoryNotEmpty | io::ErrorKind::AlreadyExists => {
                        Err(RunDirError::Alive(dir.name))
                    }
                    _ => Err(failed(&dir.path(), error)),
                }
            }
        }
    }

    /// The folder of a run that is alive.
    pub fn open(name: RunName) -> Result<Self, RunDirError> {
        let dir = Self::of(name);
        if dir.is_alive() { Ok(dir) } else { Err(RunDirError::NotFound(dir.name)) }
    }

    /// Every run that has left a trace in shared memory, alive or dead, sorted by name.
    pub fn list() -> io::Result<Vec<Self>> {
        let mut found = Vec::new();
        for entry in fs::read_dir(SHARED_MEMORY)? {
            let file_name = entry?.file_name();
            let name = file_name.to_str().and_then(|name| name.strip_prefix(PREFIX));
            let name = name.map(|name| name.split_once('.').map_or(name, |(name, _)| name));
            found.extend(name.and_then(|name| name.parse().ok()).map(Self::of));
        }
        found.sort();
        found.dedup();
        Ok(found)
    }

    /// The run's name.
    pub fn name(&self) -> &RunName {
        &self.name
    }

    /// Whether the run's arena lives.
    pub fn is_alive(&self) -> bool {
        match File::open(self.path().join("lock")) {
            Ok(file) => matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)),
            Err(_) => false,
        }
    }

    /// Removes the folder and the run's shared memory; returns how many entries there were.
    /// The caller knows that the run is dead.
    pub fn remove(&self) -> Result<usize, RunDirError> {
        let (exact, prefix) = (std::format!("{PREFIX}{}", self.name), self.prefix());
        let mut removed = 0;
        let failed = |path: &Path, error| RunDirError::Io { path: path.to_path_buf(), error };
        let shared_memory = Path::new(SHARED_MEMORY);
        for entry in fs::read_dir(shared_memory).map_err(|error| failed(shared_memory, error))? {
            let Ok(entry) = entry else { continue };
            let file_name = entry.file_name();
            let Some(name) = file_name.to_str() else { continue };
            if name != exact && !name.starts_with(&prefix) || self.is_being_made(name) {
                continue;
            }
            let path = entry.path();
            let outcome = match path.is_dir() {
                true => fs::remove_dir_all(&path),
                false => fs::remove_file(&path),
            };
            match outcome {
                Ok(()) => removed += 1,
                // Somebody else cleans too.
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(failed(&path, error)),
            }
        }
        Ok(removed)
    }

    /// The folder.
    pub fn path(&self) -> PathBuf {
        Path::new(SHARED_MEMORY).join(std::format!("{PREFIX}{}", self.name))
    }

    /// What every agent is told at its start.
    pub fn setup_path(&self) -> PathBuf {
        self.path().join("setup.bin")
    }

    /// The doorbell page.
    pub fn doorbell_path(&self) -> PathBuf {
        self.path().join("doorbell")
    }

    /// iceoryx2's root.
    pub fn services_path(&self) -> PathBuf {
        self.path().join("iox2")
    }

    /// What iceoryx2 puts before the name of every file of this run.
    pub fn prefix(&self) -> String {
        std::format!("{PREFIX}{}.", self.name)
    }

    fn hidden(&self, pid: u32) -> PathBuf {
        Path::new(SHARED_MEMORY).join(std::format!("{}new-{pid}", self.prefix()))
    }

    /// Whether a file name is a folder under construction by a process that lives.
    fn is_being_made(&self, file_name: &str) -> bool {
        file_name
            .strip_prefix(&self.prefix())
            .and_then(|rest| rest.strip_prefix("new-"))
            .is_some_and(|pid| Path::new("/proc").join(pid).exists())
    }
}

/// Bytes left in shared memory.
pub fn free_shared_memory() -> io::Result<u64> {
    let stat = rustix::fs::statvfs(SHARED_MEMORY)?;
    Ok(stat.f_bavail * stat.f_frsize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(what: &str) -> RunName {
        std::format!("test-{what}-{}", process::id()).parse().unwrap()
    }

    #[test]
    fn names_cannot_leave_their_folder() {
        for bad in ["", "a/b", "..", "a.b", "a b", &"x".repeat(NAME_MAX + 1)] {
            assert!(bad.parse::<RunName>().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn a_live_run_keeps_its_name_and_a_dead_one_gives_it_back() {
        let (dir, lock) = RunDir::create(name("alive")).unwrap();
        assert!(dir.is_alive());
        assert!(matches!(RunDir::create(name("alive")), Err(RunDirError::Alive(_))));
        fs::write(dir.setup_path(), b"left over").unwrap();
        drop(lock);
        assert!(!dir.is_alive());
        assert!(matches!(RunDir::open(name("alive")), Err(RunDirError::NotFound(_))));
        let (dir, _lock) = RunDir::create(name("alive")).unwrap();
        assert!(!dir.setup_path().exists(), "the dead run's files are gone");
        dir.remove().unwrap();
    }

    #[test]
    fn removing_a_run_spares_others_whose_names_begin_alike() {
        let (short, _short_lock) = RunDir::create(name("p")).unwrap();
        let longer: RunName = std::format!("{}x", short.name()).parse().unwrap();
        let (long, _long_lock) = RunDir::create(longer).unwrap();
        let memory = Path::new(SHARED_MEMORY).join(std::format!("{}data", short.prefix()));
        fs::write(&memory, b"").unwrap();
        assert!(RunDir::list().unwrap().contains(&short));
        assert_eq!(short.remove().unwrap(), 2);
        assert!(!short.path().exists() && !memory.exists() && long.path().exists());
        long.remove().unwrap();
    }
}
