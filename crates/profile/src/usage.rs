//! Resources that an agent's process has used, as the operating system and the processor count them.

/// Resources that one process has used. Times and switches are those of its main thread: agents have no other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Usage {
    /// Time on a processor, nanoseconds, user and kernel together.
    pub cpu_ns: u64,
    /// How often it gave its processor up to wait.
    pub switches_voluntary: u64,
    /// How often its processor was taken away.
    pub switches_involuntary: u64,
    /// Page faults that cost no disk.
    pub faults_minor: u64,
    /// Page faults that did.
    pub faults_major: u64,
    /// Memory it has mapped and touched, kB: what it shares counts in full.
    pub rss_kb: u64,
    /// The same, but what n processes share counts as a part in n. It is known only where the kernel tells.
    pub pss_kb: Option<u64>,
}

/// Processor counters of one agent in user space, from the time all had joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counted {
    /// Instructions carried out.
    pub instructions: u64,
    /// Cycles of the core, at whatever frequency it ran.
    pub core_cycles: u64,
}
