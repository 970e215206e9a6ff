//! Limits of the operating system on a swarm of processes, checked before it starts.

use std::{fmt, fs, io, str::FromStr};

use anyhow::{anyhow, bail};
use observe::live::CLIENTS_MAX;
use protocol::setup::Plane;
use rustix::process::{Resource, Rlimit, geteuid, getrlimit, setrlimit};
use transport::shared_memory::{MORE_BYTES, MORE_FILES, SharedMemory};

/// Descriptors beside those: standard streams, the node, the lock; and clients of the two sockets that tell how a run
/// goes.
const DESCRIPTORS_SPARE: u64 = 64 + 2 * CLIENTS_MAX as u64;
/// Memory maps the arena holds per robot: measured with `wc -l < /proc/PID/maps`, see docs/performance.md.
const MAPS_PER_ROBOT: u64 = 6;
/// Maps beside those: programs, libraries, heap, stacks.
const MAPS_SPARE: u64 = 256;
/// Processes beside the robots: the supervisor, the arena, and their threads.
const PROCESSES_SPARE: u64 = 16;
/// Shared memory per robot, bytes, once every buffer has been used; see docs/performance.md.
const SHARED_MEMORY_PER_ROBOT: u64 = 120 * 1024;
/// Largest file in shared memory, bytes: 66 kB in real time, 28 kB in lock-step, rounded up.
const SHARED_FILE_MAX: u64 = 128 * 1024;
/// Files in shared memory per robot: measured with `find`, see docs/performance.md.
const FILES_PER_ROBOT: u64 = 21;
/// Files beside those: the run's own.
const FILES_SPARE: u64 = 16;
/// Memory of an agent, bytes: its PSS, rounded up; see docs/performance.md.
const MEMORY_PER_ROBOT: u64 = 640 * 1024;

/// The way out of every limit.
const WITHOUT: &str = "hint: or run with `--engine in-process`, which needs none of this";

/// Descriptors the arena holds per robot: measured with `ls /proc/PID/fd`, see docs/performance.md.
fn descriptors_per_robot(plane: Plane) -> u64 {
    match plane {
        Plane::Blackboard => 9,
        Plane::PublishSubscribe => 10,
    }
}

/// One thing of which robots need so much each, and of which there is only so much.
#[derive(Clone, Copy, Debug)]
struct Limit {
    /// Name of the resource, in the plural.
    what: &'static str,
    per_robot: u64,
    /// Needed beside the robots' share.
    spare: u64,
    /// Amount there is, in the same unit.
    available: u64,
    /// Where that number comes from.
    source: &'static str,
    unit: Unit,
    /// Way out for a user.
    remedy: Remedy,
}

#[derive(Clone, Copy, Debug)]
enum Unit {
    Count,
    Bytes,
}

#[derive(Clone, Copy, Debug)]
enum Remedy {
    /// The same words whatever is needed.
    Do(&'static str),
    /// A command that ends with the number needed, in all.
    Set(&'static str),
}

/// Raises the limit on open files as far as it goes, and refuses a swarm that is too large for this machine: by
/// every limit that it meets, with what can be done. Agents and arena inherit the limit.
pub(crate) fn prepare(robots: u32, plane: Plane) -> anyhow::Result<()> {
    raise_open_files(robots, plane)?;
    if let Some(bytes) = getrlimit(Resource::Fsize).current.filter(|&bytes| bytes < SHARED_FILE_MAX) {
        bail!(
            "processes share memory by files of up to {SHARED_FILE_MAX} bytes, and no file may be larger than {bytes} \
             bytes here\n\
             hint: `ulimit -f unlimited` lifts that limit; or run with `--engine in-process`"
        );
    }
    let met: Vec<_> = limits(plane)?.into_iter().filter(|limit| limit.most() < robots.into()).collect();
    let Some(most) = met.iter().map(Limit::most).min() else { return Ok(()) };
    let reasons: Vec<String> = met.iter().map(|limit| limit.told(robots)).collect();
    bail!(
        "{robots} robots as processes are too many here, {most} are possible\n{}\n{WITHOUT}",
        reasons.join("\n")
    );
}

/// The soft limit to the hard one; the hard one too, if that is too low and we may.
fn raise_open_files(robots: u32, plane: Plane) -> io::Result<()> {
    let limit = getrlimit(Resource::Nofile);
    let needed = u64::from(robots) * descriptors_per_robot(plane) + DESCRIPTORS_SPARE;
    if limit.maximum.is_some_and(|maximum| maximum < needed) {
        let raised = Rlimit { current: Some(needed), maximum: Some(needed) };
        if setrlimit(Resource::Nofile, raised).is_ok() {
            return Ok(());
        }
    }
    if limit.current != limit.maximum {
        setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, ..limit })?;
    }
    Ok(())
}

/// Every limit on the size of a swarm that this machine tells of.
fn limits(plane: Plane) -> anyhow::Result<Vec<Limit>> {
    let shared_memory = SharedMemory::look().map_err(|error| anyhow!("{error}\n{WITHOUT}"))?;
    let processes = |available: u64, source, remedy| Limit {
        what: "processes",
        per_robot: 1,
        spare: PROCESSES_SPARE,
        available,
        source,
        unit: Unit::Count,
        remedy,
    };
    let running = threads_running().unwrap_or(0);
    let all = [
        getrlimit(Resource::Nofile).maximum.map(|available| Limit {
            what: "open files in the arena",
            per_robot: descriptors_per_robot(plane),
            spare: DESCRIPTORS_SPARE,
            available,
            source: "the hard limit of this shell",
            unit: Unit::Count,
            remedy: Remedy::Set("as root, before `su` to your user: ulimit -Hn "),
        }),
        kernel("/proc/sys/vm/max_map_count").map(|available| Limit {
            what: "memory maps in the arena",
            per_robot: MAPS_PER_ROBOT,
            spare: MAPS_SPARE,
            available,
            source: "vm.max_map_count",
            unit: Unit::Count,
            remedy: Remedy::Set("sudo sysctl vm.max_map_count="),
        }),
        // Root is exempt.
        getrlimit(Resource::Nproc).maximum.filter(|_| !geteuid().is_root()).map(|available| {
            let source = "the limit on processes of this user";
            processes(available, source, Remedy::Set("as root, before `su` to your user: ulimit -Hu "))
        }),
        kernel("/proc/sys/kernel/threads-max").map(|most| {
            let remedy = Remedy::Do("sudo sysctl kernel.threads-max=1000000");
            processes(most.saturating_sub(running), "kernel.threads-max without the threads that run", remedy)
        }),
        kernel("/proc/sys/kernel/pid_max").map(|most| {
            let remedy = Remedy::Do("sudo sysctl kernel.pid_max=4194304");
            processes(most.saturating_sub(running), "kernel.pid_max without the threads that run", remedy)
        }),
        kernel("/sys/fs/cgroup/pids.max").map(|most| {
            let running = kernel("/sys/fs/cgroup/pids.current").unwrap_or(0);
            let remedy = Remedy::Do("start the container without a limit on processes (--pids-limit=-1)");
            processes(
                most.saturating_sub(running),
                "pids.max of this container without those that run",
                remedy,
            )
        }),
        memory_available().map(|available| Limit {
            what: "memory",
            per_robot: MEMORY_PER_ROBOT,
            spare: 0,
            available,
            source: "MemAvailable",
            unit: Unit::Bytes,
            remedy: Remedy::Do("end other programs"),
        }),
        shared_memory.bytes.map(|available| Limit {
            what: "shared memory",
            per_robot: SHARED_MEMORY_PER_ROBOT,
            spare: 0,
            available,
            source: "what is left in /dev/shm",
            unit: Unit::Bytes,
            remedy: Remedy::Do(MORE_BYTES),
        }),
        shared_memory.files.map(|available| Limit {
            what: "files in shared memory",
            per_robot: FILES_PER_ROBOT,
            spare: FILES_SPARE,
            available,
            source: "the number of inodes left in /dev/shm",
            unit: Unit::Count,
            remedy: Remedy::Do(MORE_FILES),
        }),
    ];
    Ok(all.into_iter().flatten().collect())
}

impl Limit {
    /// The most robots it allows.
    fn most(&self) -> u64 {
        self.available.saturating_sub(self.spare) / self.per_robot
    }

    fn needed(&self, robots: u32) -> u64 {
        u64::from(robots) * self.per_robot + self.spare
    }

    /// Why it stops so many `robots`, and what can be done.
    fn told(&self, robots: u32) -> String {
        let amount = |number| Amount(number, self.unit);
        let Self { what, per_robot, available, source, .. } = *self;
        let needed = self.needed(robots);
        let remedy = match self.remedy {
            Remedy::Do(words) => words.to_string(),
            Remedy::Set(command) => format!("{command}{needed}"),
        };
        format!(
            "  {what}: they need {} ({} each), and {source} is {}\n  hint: {remedy}",
            amount(needed),
            amount(per_robot),
            amount(available),
        )
    }
}

/// A number as a user reads it.
struct Amount(u64, Unit);

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self(number, Unit::Count) => write!(f, "{number}"),
            Self(bytes, Unit::Bytes) if bytes < 1 << 20 => write!(f, "{} KiB", bytes.div_ceil(1 << 10)),
            Self(bytes, Unit::Bytes) => write!(f, "{} MiB", bytes.div_ceil(1 << 20)),
        }
    }
}

/// A setting of the kernel; `None` where it has none of that name.
fn kernel(path: &str) -> Option<u64> {
    parsed(fs::read_to_string(path).ok()?.trim())
}

/// Threads of the whole machine: the second number of "running/all" in /proc/loadavg.
fn threads_running() -> Option<u64> {
    let text = fs::read_to_string("/proc/loadavg").ok()?;
    parsed(text.split_whitespace().nth(3)?.split_once('/')?.1)
}

/// Bytes that can be had without swapping.
fn memory_available() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    parsed::<u64>(line.split_whitespace().next()?).map(|kibibytes| kibibytes * 1024)
}

fn parsed<T: FromStr>(text: &str) -> Option<T> {
    text.parse().ok()
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use super::*;

    const FILES: Limit = Limit {
        what: "open files in the arena",
        per_robot: 10,
        spare: 64,
        available: 20_000,
        source: "the hard limit of this shell",
        unit: Unit::Count,
        remedy: Remedy::Set("ulimit -Hn "),
    };

    #[test]
    fn the_largest_swarm_is_the_last_that_fits() {
        assert_eq!(FILES.most(), 1993);
        assert!(FILES.needed(1993) <= FILES.available && FILES.needed(1994) > FILES.available);
        assert_eq!(Limit { available: 3, ..FILES }.most(), 0);
    }

    #[test]
    fn a_limit_names_its_numbers_and_the_way_out() {
        let memory = Limit {
            what: "shared memory",
            per_robot: 120 << 10,
            spare: 0,
            available: 64 << 20,
            source: "what is left in /dev/shm",
            unit: Unit::Bytes,
            remedy: Remedy::Do("enlarge it"),
        };
        expect![[r"
            open files in the arena: they need 40064 (10 each), and the hard limit of this shell is 20000
            hint: ulimit -Hn 40064
            shared memory: they need 469 MiB (120 KiB each), and what is left in /dev/shm is 64 MiB
            hint: enlarge it
        "]]
        .assert_eq(&format!("{}\n{}\n", FILES.told(4000), memory.told(4000)).replace("  ", ""));
    }

    #[test]
    fn this_machine_tells_of_its_limits() {
        let limits = limits(Plane::Blackboard).unwrap();
        let names: Vec<_> = limits.iter().map(|limit| limit.what).collect();
        assert!(names.contains(&"memory maps in the arena") && names.contains(&"memory"), "{names:?}");
        assert!(limits.iter().all(|limit| limit.most() > 0), "{limits:?}");
    }
}
