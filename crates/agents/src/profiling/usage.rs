//! Resources that a process has used so far, as the operating system tells in `/proc/PID`.

use std::fs;

use profile::Usage;

use processes::{Process, State};

/// Returns what `process` has used until now; `None` if it has ended, or the system does not tell.
pub(super) fn of(process: Process) -> Option<Usage> {
    let read = |what: &str| fs::read_to_string(format!("/proc/{}/{what}", process.pid())).ok();
    let (stat, status) = (read("stat")?, read("status")?);
    let [faults_minor, faults_major] = faults(&stat)?;
    let usage = Usage {
        cpu_ns: read("schedstat")?.split_whitespace().next()?.parse().ok()?,
        switches_voluntary: field(&status, "voluntary_ctxt_switches:")?,
        switches_involuntary: field(&status, "nonvoluntary_ctxt_switches:")?,
        faults_minor,
        faults_major,
        rss_kb: field(&status, "VmRSS:")?,
        pss_kb: read("smaps_rollup").and_then(|text| field(&text, "Pss:")),
    };
    // Still the same process, after all was read.
    (process.state() != State::Dead).then_some(usage)
}

/// Minor and major faults of a line of `/proc/PID/stat`: its fields 10 and 12.
fn faults(stat: &str) -> Option<[u64; 2]> {
    // The second field is the command in parentheses, which may hold spaces and parentheses.
    let mut fields = stat.rsplit_once(") ")?.1.split(' ').skip(10 - 3);
    let minor = fields.next()?.parse().ok()?;
    Some([minor, fields.nth(1)?.parse().ok()?])
}

/// The number after `name` at the beginning of a line.
fn field(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use std::{
        io::{Read, Write},
        process::{Command, Stdio},
    };

    use super::*;

    /// Waits until a process sleeps, and looks what it has used by then.
    fn asleep(process: Process) -> Usage {
        while process.state() != State::Sleeping {
            std::thread::yield_now();
        }
        of(process).unwrap()
    }

    #[test]
    fn work_costs_time_and_every_wait_a_switch() {
        let script = "while read line; do i=0; while [ $i -lt 20000 ]; do i=$((i + 1)); done; echo; done";
        let pipe = Stdio::piped;
        let mut child = Command::new("sh").args(["-c", script]).stdin(pipe()).stdout(pipe()).spawn().unwrap();
        let (mut work, mut done) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let process = Process::find(child.id()).unwrap();
        let before = asleep(process);
        for _ in 0..3 {
            work.write_all(b"\n").unwrap();
            done.read_exact(&mut [0]).unwrap();
            asleep(process);
        }
        let after = asleep(process);
        drop(work);
        child.wait().unwrap();
        assert!(after.cpu_ns > before.cpu_ns + 1_000_000, "{before:?} {after:?}");
        assert!(after.switches_voluntary >= before.switches_voluntary + 3, "{before:?} {after:?}");
        assert!(after.faults_minor >= before.faults_minor && after.faults_minor > 50, "{after:?}");
        assert!(after.rss_kb > 100 && after.pss_kb.is_none_or(|pss_kb| pss_kb <= after.rss_kb), "{after:?}");
    }

    #[test]
    fn who_is_dead_has_used_nothing_that_we_could_read() {
        let mut child = Command::new("sleep").arg("60").spawn().unwrap();
        let process = Process::find(child.id()).unwrap();
        assert!(of(process).is_some());
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(of(process), None);
    }

    #[test]
    fn faults_are_found_whatever_the_command_is_called() {
        let stat = "42 (a) (b c) S 1 42 42 0 -1 4194304 123 7 4 0 1 2 0 0";
        assert_eq!(faults(stat), Some([123, 4]));
        assert_eq!(faults("42 (a) S 1"), None);
    }

    #[test]
    fn fields_are_told_from_those_that_end_alike() {
        let status =
            "Name:\tx\nVmRSS:\t    4404 kB\nvoluntary_ctxt_switches:\t15\nnonvoluntary_ctxt_switches:\t3\n";
        assert_eq!(field(status, "voluntary_ctxt_switches:"), Some(15));
        assert_eq!(field(status, "nonvoluntary_ctxt_switches:"), Some(3));
        assert_eq!(field(status, "VmRSS:"), Some(4404));
        assert_eq!(field(status, "Pss:"), None);
    }
}
