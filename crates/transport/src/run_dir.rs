//! Where a run keeps what its processes share: `/dev/shm/lamplight-NAME/`.
//!
//! ```text
//! owner       locked (flock) by who made the run and will remove it: the supervisor, or an arena alone
//! arena       locked by the arena while it lives: what agents ask
//! scenario.toml   the scenario as resolved
//! assignment.json what else the supervisor tells its arena
//! setup.bin   what agents are told at their start (`codec`); `setup.ROBOT` where controllers differ
//! doorbell    the page of `doorbell`
//! live        a socket that tells how the run goes, for its owner alone
//! watch       a socket that tells what happens in it, tick by tick, for its owner alone
//! acts        a socket that takes acts upon it, from its owner alone
//! by-hand     who is driven by hand and waits to be; for agents that are started by hand (`codec`)
//! over-ROBOT-LIFE   this life is over; for them
//! notes-ROBOT-LIFE  names of the notes of this life, if it has any
//! properties-ROBOT-LIFE  what this life states of itself, and what became of it
//! said-HASH   an agent has said this of its controller, so that others need not
//! iox2/       iceoryx2's service and node files
//! ```
//!
//! iceoryx2's shared memory itself lies beside the folder, as files named `lamplight-NAME.*`. A
//! name holds no dot, so the files of one run never carry the prefix of another.
//!
//! The operating system lets go of a lock whatever ends its holder, so locks tell the living from
//! the dead, in other containers too. Making and removing runs happens under one more lock, that of
//! `/dev/shm` itself: no run can be taken for dead while it is being made.
//!
//! Users share `/dev/shm`. What belongs to somebody else is theirs to remove, and is passed over; for root
//! everything is ours.

use std::{
    fmt, fs,
    fs::{File, TryLockError},
    hash::{DefaultHasher, Hash, Hasher},
    io,
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};

use crate::{
    owner::Owner,
    shared_memory::{PATH as SHARED_MEMORY, SharedMemory, SharedMemoryError},
};
use protocol::{
    codec,
    property::{PROPERTIES_MAX, PROPERTY_NAME_BYTES_MAX, Properties, Property},
    robot_id::RobotId,
};

const PREFIX: &str = "lamplight-";
const PROPERTIES: &str = "properties-";
/// More than the properties of a life take, bytes.
const PROPERTIES_BYTES_MAX: u64 = (PROPERTIES_MAX * (PROPERTY_NAME_BYTES_MAX + 32)) as u64;
/// Longest name of a run: iceoryx2 adds some 60 characters, a file name ends at 255.
pub const NAME_MAX: usize = 64;

/// How often, and how far apart, a lock is tried that others may look at for a moment.
const LOCK_TRIES: u32 = 20;
const LOCK_PAUSE: Duration = Duration::from_millis(5);
/// How long others are waited for that make or remove a run, which takes them milliseconds.
const TURN_TIMEOUT: Duration = Duration::from_secs(10);

/// A run's name: 1 to [`NAME_MAX`] letters, digits, `-` and `_`. It does not begin with `-`, or programs would take
/// it for an option.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RunName(String);

/// Properties that one life has told; or why they cannot be understood.
pub type ToldProperties = Result<Vec<Property>, String>;

/// Why a string is no name of a run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no name for a run: use 1 to {NAME_MAX} letters, digits, `-` and `_`, and no `-` in front")]
pub struct NameError(String);

impl std::str::FromStr for RunName {
    type Err = NameError;

    fn from_str(name: &str) -> Result<Self, NameError> {
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        let length = (1..=NAME_MAX).contains(&name.len());
        match length && name.chars().all(allowed) && !name.starts_with('-') {
            true => Ok(Self(name.to_string())),
            false => Err(NameError(name.to_string())),
        }
    }
}

impl RunName {
    /// The command that starts `program`, with its first arguments, as the agent of this life of a robot by hand.
    pub fn agent_command(&self, program: &str, id: RobotId) -> String {
        let RobotId { index, incarnation } = id;
        let life = match incarnation {
            0 => String::new(),
            _ => format!(" --incarnation {incarnation}"),
        };
        format!("{program} --run {self} --robot {index}{life}")
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
    /// The name is somebody else's.
    #[error("`{name}` is the name of a run of {owner} in {SHARED_MEMORY}; choose another one")]
    Foreign {
        /// The name.
        name: RunName,
        /// Its owner.
        owner: Owner,
    },
    /// Another process makes or removes a run and does not get done.
    #[error(
        "another process has locked {SHARED_MEMORY} for {TURN_TIMEOUT:?}, as a stopped `lamplight` may have; \
         `fuser -v {SHARED_MEMORY}` names it"
    )]
    Locked,
    /// There is no shared memory to make it in.
    #[error(transparent)]
    SharedMemory(#[from] SharedMemoryError),
    /// The file system said no.
    #[error("{path}: {error}", path = path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        error: io::Error,
    },
}

/// Result of removing what a dead run had left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cleared {
    /// Entries that were removed.
    pub removed: usize,
    /// Owner of the others, if some were not ours to remove.
    pub foreign: Option<Owner>,
}

/// The folder of one run.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RunDir {
    name: RunName,
}

/// A robot that is driven by hand.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ByHand {
    /// Its present life.
    pub id: RobotId,
    /// Whether that waits to be started.
    pub is_awaited: bool,
    /// The program that thinks for it, with its first arguments.
    pub program: String,
}

/// Holds a lock of a run until it is dropped or its process ends.
#[derive(Debug)]
pub struct RunLock {
    _file: File,
}

/// An agent's view of its arena. It is bound to that very arena: another run that takes over the
/// name does not count.
#[derive(Debug)]
pub struct ArenaWatch {
    lock: File,
}

impl ArenaWatch {
    /// Whether the arena lives.
    pub fn is_alive(&self) -> bool {
        is_held(&self.lock)
    }
}

impl RunDir {
    /// The folder of the run `name`, whether there is one or not.
    pub fn of(name: RunName) -> Self {
        Self { name }
    }

    /// Makes the folder and owns it. What a dead run of the same name left is removed.
    pub fn create(name: RunName) -> Result<(Self, RunLock), RunDirError> {
        let dir = Self::of(name);
        SharedMemory::look()?;
        exclusively(|| {
            if dir.is_in_use()? {
                return Err(RunDirError::Alive(dir.name.clone()));
            }
            if let Some(owner) = dir.remove()?.foreign {
                return Err(RunDirError::Foreign { name: dir.name.clone(), owner });
            }
            let path = dir.path();
            fs::create_dir(&path).map_err(failed(&path))?;
            let owner = dir.lock("owner")?;
            Ok((dir.clone(), owner))
        })
    }

    /// The arena says that it lives: from now on agents may come.
    pub fn go_live(&self) -> Result<RunLock, RunDirError> {
        self.lock("arena")
    }

    /// The folder of a run whose arena lives, and a watch on that arena.
    pub fn open(name: RunName) -> Result<(Self, ArenaWatch), RunDirError> {
        let dir = Self::of(name);
        let watch = File::open(dir.path().join("arena")).map(|lock| ArenaWatch { lock });
        match watch {
            Ok(watch) if watch.is_alive() => Ok((dir, watch)),
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => Err(dir.not_ours(error)),
            _ => Err(RunDirError::NotFound(dir.name)),
        }
    }

    /// Every run that has left a trace in shared memory, alive or dead, sorted by name.
    pub fn list() -> Result<Vec<Self>, RunDirError> {
        SharedMemory::look()?;
        let (mut found, shared_memory) = (Vec::new(), Path::new(SHARED_MEMORY));
        for entry in fs::read_dir(shared_memory).map_err(failed(shared_memory))? {
            let file_name = entry.map_err(failed(shared_memory))?.file_name();
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

    /// Removes what the run has left if it is dead: if it has neither an owner nor an arena.
    /// Returns what became of it, or `None` if it is not dead. A run of somebody else that cannot be looked into
    /// is passed over.
    pub fn remove_if_dead(&self) -> Result<Option<Cleared>, RunDirError> {
        exclusively(|| match self.is_in_use() {
            Ok(true) => Ok(None),
            Ok(false) => self.remove().map(Some),
            Err(RunDirError::Foreign { owner, .. }) => Ok(Some(Cleared { removed: 0, foreign: Some(owner) })),
            Err(error) => Err(error),
        })
    }

    /// Removes the run's folder and shared memory. For its owner, once nobody else is left.
    pub fn remove_own(&self, owner: RunLock) -> Result<(), RunDirError> {
        exclusively(|| self.remove())?;
        drop(owner);
        Ok(())
    }

    fn is_in_use(&self) -> Result<bool, RunDirError> {
        Ok(self.is_locked("owner")? || self.is_locked("arena")?)
    }

    fn is_locked(&self, lock: &str) -> Result<bool, RunDirError> {
        match File::open(self.path().join(lock)) {
            Ok(file) => Ok(is_held(&file)),
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => Err(self.not_ours(error)),
            Err(_) => Ok(false),
        }
    }

    /// Why the run's folder cannot be looked into: it is somebody else's, or else what was said.
    fn not_ours(&self, error: io::Error) -> RunDirError {
        let path = self.path();
        match Owner::of(&path) {
            Ok(owner) if !owner.is_us() => RunDirError::Foreign { name: self.name.clone(), owner },
            _ => failed(&path)(error),
        }
    }

    fn lock(&self, lock: &str) -> Result<RunLock, RunDirError> {
        let path = self.path().join(lock);
        let file = File::create(&path).map_err(failed(&path))?;
        for _ in 0..LOCK_TRIES {
            match file.try_lock() {
                Ok(()) => return Ok(RunLock { _file: file }),
                // Perhaps somebody only looks whether it is locked.
                Err(TryLockError::WouldBlock) => thread::sleep(LOCK_PAUSE),
                Err(TryLockError::Error(error)) => return Err(failed(&path)(error)),
            }
        }
        Err(RunDirError::Alive(self.name.clone()))
    }

    /// Removes the folder and every file with the run's prefix, as far as they are ours.
    fn remove(&self) -> Result<Cleared, RunDirError> {
        let (exact, prefix) = (format!("{PREFIX}{}", self.name), self.prefix());
        let mut cleared = Cleared::default();
        let shared_memory = Path::new(SHARED_MEMORY);
        for entry in fs::read_dir(shared_memory).map_err(failed(shared_memory))? {
            let Ok(entry) = entry else { continue };
            let file_name = entry.file_name();
            if !file_name.to_str().is_some_and(|name| name == exact || name.starts_with(&prefix)) {
                continue;
            }
            let path = entry.path();
            let foreign = Owner::of(&path).ok().filter(|owner| !owner.is_us());
            let outcome = match foreign {
                Some(_) if !Owner::us().is_root() => Err(io::ErrorKind::PermissionDenied.into()),
                _ if path.is_dir() => fs::remove_dir_all(&path),
                _ => fs::remove_file(&path),
            };
            match outcome {
                Ok(()) => cleared.removed += 1,
                // An agent that leaves removes its own files.
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                // The root of a container is not everybody's.
                Err(error) if error.kind() == io::ErrorKind::PermissionDenied && foreign.is_some() => {
                    cleared.foreign = foreign;
                }
                Err(error) => return Err(failed(&path)(error)),
            }
        }
        Ok(cleared)
    }

    /// The folder.
    pub fn path(&self) -> PathBuf {
        Path::new(SHARED_MEMORY).join(format!("{PREFIX}{}", self.name))
    }

    /// The scenario as resolved.
    pub fn scenario_path(&self) -> PathBuf {
        self.path().join("scenario.toml")
    }

    /// Path of what else the supervisor tells its arena.
    pub fn assignment_path(&self) -> PathBuf {
        self.path().join("assignment.json")
    }

    /// Path of the setup that every agent reads at its start that has none of its own.
    pub fn setup_path(&self) -> PathBuf {
        self.path().join("setup.bin")
    }

    /// Writes the setups of all agents. Robots of `others` find theirs under their own names, linked to one file for
    /// each, and all the rest find `common`: so no robot learns who else there is.
    pub fn tell_setups(&self, common: &[u8], others: &[(Vec<u32>, Vec<u8>)]) -> io::Result<()> {
        fs::write(self.setup_path(), common)?;
        for (entry, (robots, setup)) in (1..).zip(others) {
            let file = self.path().join(format!("setup-{entry}.bin"));
            fs::write(&file, setup)?;
            for robot in robots {
                match fs::hard_link(&file, self.own_setup_path(*robot)) {
                    // Of an earlier trial: it is the same file.
                    Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                    linked => linked?,
                }
            }
        }
        Ok(())
    }

    /// An agent reads its setup.
    pub fn setup_of(&self, robot: u32) -> io::Result<Vec<u8>> {
        match fs::read(self.own_setup_path(robot)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => fs::read(self.setup_path()),
            read => read,
        }
    }

    fn own_setup_path(&self, robot: u32) -> PathBuf {
        self.path().join(format!("setup.{robot}"))
    }

    /// The doorbell page.
    pub fn doorbell_path(&self) -> PathBuf {
        self.path().join("doorbell")
    }

    /// The socket of those who watch the run. Its path is no longer than a socket's can be (107 bytes).
    pub fn live_path(&self) -> PathBuf {
        self.path().join("live")
    }

    /// Path of the socket that tells what happens, tick by tick.
    pub fn watch_path(&self) -> PathBuf {
        self.path().join("watch")
    }

    /// Path of the socket that takes acts upon the run.
    pub fn acts_path(&self) -> PathBuf {
        self.path().join("acts")
    }

    /// The arena says which robots are driven by hand.
    pub fn tell_by_hand(&self, robots: &[ByHand]) -> io::Result<()> {
        let draft = self.path().join("by-hand.new");
        fs::write(&draft, codec::encode(&robots))?;
        fs::rename(draft, self.by_hand_path())
    }

    /// An agent asks which robots are driven by hand.
    pub fn by_hand(&self) -> io::Result<Vec<ByHand>> {
        codec::decode(&fs::read(self.by_hand_path())?).map_err(io::Error::other)
    }

    fn by_hand_path(&self) -> PathBuf {
        self.path().join("by-hand")
    }

    /// An agent tells the names of its notes, before its first command.
    pub fn tell_note_names(&self, id: RobotId, names: &[String]) -> io::Result<()> {
        fs::write(self.note_names_path(id), codec::encode(&names))
    }

    /// Reads the names of a robot's notes.
    pub fn note_names(&self, id: RobotId) -> io::Result<Vec<String>> {
        codec::decode(&fs::read(self.note_names_path(id))?).map_err(io::Error::other)
    }

    fn note_names_path(&self, id: RobotId) -> PathBuf {
        self.path().join(format!("notes-{}-{}", id.index, id.incarnation))
    }

    /// An agent tells what its controller states, in place of what it has told before. Whole or not at all: it may be
    /// killed at any time.
    pub fn tell_properties(&self, id: RobotId, properties: &[Property]) -> io::Result<()> {
        let RobotId { index, incarnation } = id;
        let draft = self.path().join(format!("new-{PROPERTIES}{index}-{incarnation}"));
        fs::write(&draft, codec::encode(&properties))?;
        fs::rename(draft, self.path().join(format!("{PROPERTIES}{index}-{incarnation}")))
    }

    /// Takes what controllers have stated, by life.
    pub fn take_properties(&self) -> io::Result<Vec<(RobotId, ToldProperties)>> {
        let mut taken = Vec::new();
        for entry in fs::read_dir(self.path())? {
            let path = entry?.path();
            let Some(id) = path.file_name().and_then(|name| name.to_str()).and_then(life_of_properties)
            else {
                continue;
            };
            taken.push((id, read_properties(&path)));
            fs::remove_file(path)?;
        }
        taken.sort_by_key(|(id, _)| *id);
        Ok(taken)
    }

    /// An agent asks whether it is the first of the run to say `words`: a swarm that has one reason gives it once.
    pub fn is_first_to_say(&self, words: &str) -> bool {
        let mut hasher = DefaultHasher::new();
        words.hash(&mut hasher);
        let file = File::create_new(self.path().join(format!("said-{:016x}", hasher.finish())));
        // What cannot be known is said.
        !file.is_err_and(|error| error.kind() == io::ErrorKind::AlreadyExists)
    }

    /// The arena says that a life is over that nobody ends: its agent may be asleep until the next
    /// round, which may wait for its successor.
    pub fn end_life(&self, id: RobotId) -> io::Result<()> {
        File::create(self.over_path(id)).map(drop)
    }

    /// An agent asks whether its life is over.
    pub fn life_is_over(&self, id: RobotId) -> bool {
        self.over_path(id).exists()
    }

    fn over_path(&self, id: RobotId) -> PathBuf {
        self.path().join(format!("over-{}-{}", id.index, id.incarnation))
    }

    /// iceoryx2's root.
    pub fn services_path(&self) -> PathBuf {
        self.path().join("iox2")
    }

    /// Prefix that iceoryx2 puts before the name of every file of this run.
    pub fn prefix(&self) -> String {
        format!("{PREFIX}{}.", self.name)
    }
}

/// The life whose properties are in a file of this name, if it is one.
fn life_of_properties(name: &str) -> Option<RobotId> {
    let (index, incarnation) = name.strip_prefix(PROPERTIES)?.split_once('-')?;
    Some(RobotId { index: index.parse().ok()?, incarnation: incarnation.parse().ok()? })
}

fn read_properties(path: &Path) -> Result<Vec<Property>, String> {
    let length = fs::metadata(path).map_err(|error| error.to_string())?.len();
    if length > PROPERTIES_BYTES_MAX {
        return Err(format!("{length} bytes are more than {PROPERTIES_BYTES_MAX}"));
    }
    let properties: Vec<Property> = fs::read(path)
        .map_err(|error| error.to_string())
        .and_then(|bytes| codec::decode(&bytes).map_err(|error| error.to_string()))?;
    Properties::check(&properties).map_err(|error| error.to_string()).map(|()| properties)
}

/// Does something that must not overlap with another run's making or removal on this machine.
fn exclusively<T>(act: impl FnOnce() -> Result<T, RunDirError>) -> Result<T, RunDirError> {
    let shared_memory = Path::new(SHARED_MEMORY);
    let folder = File::open(shared_memory).map_err(failed(shared_memory))?;
    let began = Instant::now();
    loop {
        match folder.try_lock() {
            Ok(()) => return act(),
            Err(TryLockError::WouldBlock) if began.elapsed() < TURN_TIMEOUT => thread::sleep(LOCK_PAUSE),
            Err(TryLockError::WouldBlock) => return Err(RunDirError::Locked),
            Err(TryLockError::Error(error)) => return Err(failed(shared_memory)(error)),
        }
    }
}

/// Whether somebody holds the lock on `file`. Looking takes it for a moment if nobody does.
fn is_held(file: &File) -> bool {
    match file.try_lock_shared() {
        Ok(()) => {
            // A lock that cannot be let go of ends with its descriptor.
            let _ = file.unlock();
            false
        }
        Err(TryLockError::WouldBlock) => true,
        Err(TryLockError::Error(_)) => false,
    }
}

fn failed(path: &Path) -> impl FnOnce(io::Error) -> RunDirError {
    move |error| RunDirError::Io { path: path.to_path_buf(), error }
}

#[cfg(test)]
mod tests {
    use protocol::property::always;

    use super::*;

    fn name(what: &str) -> RunName {
        format!("test-{what}-{}", std::process::id()).parse().unwrap()
    }

    #[test]
    fn names_cannot_leave_their_folder_nor_be_taken_for_options() {
        for bad in ["", "a/b", "..", "a.b", "a b", "-", "-a", &"x".repeat(NAME_MAX + 1)] {
            assert!(bad.parse::<RunName>().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn a_run_in_use_keeps_its_name_and_a_dead_one_gives_it_back() {
        let (dir, owner) = RunDir::create(name("alive")).unwrap();
        assert!(RunDir::open(name("alive")).is_err(), "no arena yet");
        assert!(matches!(RunDir::create(name("alive")), Err(RunDirError::Alive(_))));
        let arena = dir.go_live().unwrap();
        let (_, watch) = RunDir::open(name("alive")).unwrap();
        assert!(watch.is_alive());
        assert!(matches!(dir.go_live(), Err(RunDirError::Alive(_))), "one arena is enough");
        fs::write(dir.setup_path(), b"left over").unwrap();
        drop(owner);
        assert_eq!(dir.remove_if_dead().unwrap(), None, "the arena still lives");
        assert!(matches!(RunDir::create(name("alive")), Err(RunDirError::Alive(_))));
        drop(arena);
        assert!(matches!(RunDir::open(name("alive")), Err(RunDirError::NotFound(_))));
        let (dir, owner) = RunDir::create(name("alive")).unwrap();
        assert!(!dir.setup_path().exists(), "the dead run's files are gone");
        let _another_arena = dir.go_live().unwrap();
        assert!(!watch.is_alive(), "a watch is bound to its arena, not to the name");
        dir.remove_own(owner).unwrap();
        assert!(!dir.path().exists());
    }

    #[test]
    fn names_of_notes_are_read_as_they_were_told_by_each_life() {
        let (dir, owner) = RunDir::create(name("notes")).unwrap();
        let id = RobotId::first(3);
        let names = ["goal".to_string(), "distance, m".to_string()];
        dir.tell_note_names(id, &names).unwrap();
        assert_eq!(dir.note_names(id).unwrap(), names);
        assert!(dir.note_names(id.reborn()).is_err());
        fs::write(dir.note_names_path(id), b"garbled").unwrap();
        assert!(dir.note_names(id).is_err());
        dir.remove_own(owner).unwrap();
    }

    #[test]
    fn properties_are_taken_as_each_life_has_told_them_last() {
        let (dir, owner) = RunDir::create(name("properties")).unwrap();
        let (id, mut properties) = (RobotId::first(30), Properties::default());
        properties.during(Some(2), || always(true, "sound"));
        dir.tell_properties(id, properties.list()).unwrap();
        properties.during(Some(3), || always(false, "sound"));
        dir.tell_properties(id, properties.list()).unwrap();
        dir.tell_properties(id.reborn(), &[]).unwrap();
        fs::write(dir.path().join("properties-4-0"), b"garbled").unwrap();
        fs::write(dir.path().join("properties-5-0"), [0; PROPERTIES_BYTES_MAX as usize + 1]).unwrap();
        fs::write(dir.path().join("properties-of-nobody"), b"").unwrap();
        let [(garbled, why), (long, too_long), (first, told), (second, none)] =
            &dir.take_properties().unwrap()[..]
        else {
            panic!("there are four lives");
        };
        assert_eq!((garbled.index, long.index, *first, *second), (4, 5, id, id.reborn()));
        assert!(why.as_ref().unwrap_err().contains("not a Lamplight blob"));
        assert!(too_long.as_ref().unwrap_err().contains("bytes are more than"));
        assert_eq!((told, none), (&Ok(properties.list().to_vec()), &Ok(Vec::new())));
        assert_eq!(dir.take_properties().unwrap(), []);
        dir.remove_own(owner).unwrap();
    }

    #[test]
    fn removing_a_run_spares_others_whose_names_begin_alike() {
        let (short, short_owner) = RunDir::create(name("p")).unwrap();
        let longer: RunName = format!("{}x", short.name()).parse().unwrap();
        let (long, long_owner) = RunDir::create(longer).unwrap();
        let memory = Path::new(SHARED_MEMORY).join(format!("{}data", short.prefix()));
        fs::write(&memory, b"").unwrap();
        assert!(RunDir::list().unwrap().contains(&short));
        drop(short_owner);
        assert_eq!(short.remove_if_dead().unwrap(), Some(Cleared { removed: 2, foreign: None }));
        assert!(!short.path().exists() && !memory.exists() && long.path().exists());
        long.remove_own(long_owner).unwrap();
    }
}
