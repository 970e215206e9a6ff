//! What the operating system must grant before a swarm of processes can start.

use anyhow::bail;
use protocol::run_dir::free_shared_memory;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Descriptors the arena holds per robot: measured with `ls /proc/PID/fd`, see docs/performance.md.
const DESCRIPTORS_PER_ROBOT: u64 = 10;
/// Descriptors beside those: standard streams, the node, the lock.
const DESCRIPTORS_SPARE: u64 = 64;
/// Shared memory per robot, bytes, once every buffer has been used; see docs/performance.md.
const SHARED_MEMORY_PER_ROBOT: u64 = 120 * 1024;

/// Raises the soft limit on open files to the hard one and refuses a swarm that is too large.
/// Agents and arena inherit the limit.
pub(crate) fn prepare(robots: u32) -> anyhow::Result<()> {
    let limit = getrlimit(Resource::Nofile);
    if limit.current != limit.maximum {
        setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, ..limit })?;
    }
    let needed = u64::from(robots) * DESCRIPTORS_PER_ROBOT + DESCRIPTORS_SPARE;
    if let Some(allowed) = limit.maximum.filter(|&allowed| allowed < needed) {
        let most = allowed.saturating_sub(DESCRIPTORS_SPARE) / DESCRIPTORS_PER_ROBOT;
        bail!(
            "{robots} robots as processes need {needed} open files in the arena ({DESCRIPTORS_PER_ROBOT} each), \
             and the hard limit of this shell is {allowed}, enough for {most} robots\n\
             hint: raise it (`ulimit -Hn`, as root), or run with `--engine in-process`"
        );
    }
    let (needed, free) = (u64::from(robots) * SHARED_MEMORY_PER_ROBOT, free_shared_memory()?);
    if free < needed {
        let mebibytes = |bytes: u64| bytes.div_ceil(1 << 20);
        bail!(
            "{robots} robots as processes need {} MiB of shared memory, and /dev/shm has {} MiB left\n\
             hint: `lamplight clean` removes what crashed runs left; or enlarge /dev/shm, \
             or run with `--engine in-process`",
            mebibytes(needed),
            mebibytes(free)
        );
    }
    Ok(())
}
