//! Share of a processor that agents take, as `/proc` tells: of those alone that are on the screen.

use std::{collections::HashMap, fs, time::Instant};

/// Time on a processor, and when that was read, by process.
#[derive(Debug, Default)]
pub struct Cpu(HashMap<u32, (Instant, u64)>);

impl Cpu {
    /// Shares since the last call of those of `pids` that were there then.
    pub fn shares(&mut self, pids: impl Iterator<Item = u32>) -> HashMap<u32, f64> {
        let now = Instant::now();
        let read: HashMap<_, _> = pids.filter_map(|pid| Some((pid, (now, used_ns(pid)?)))).collect();
        let shares = read.iter().filter_map(|(pid, (now, used))| {
            let (before, used_before) = self.0.get(pid)?;
            let wall_ns = now.saturating_duration_since(*before).as_nanos() as f64;
            (wall_ns > 0.0).then(|| (*pid, used.saturating_sub(*used_before) as f64 / wall_ns))
        });
        let shares = shares.collect();
        self.0 = read;
        shares
    }
}

/// Nanoseconds that a process of one thread, as agents are, has been on a processor; `None` if it has ended or the
/// kernel does not tell.
fn used_ns(pid: u32) -> Option<u64> {
    fs::read_to_string(format!("/proc/{pid}/schedstat")).ok()?.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use std::{
        process::{Command, id},
        thread,
        time::Duration,
    };

    use super::*;

    #[test]
    fn who_works_takes_a_share_of_what_there_is() {
        let mut busy = Command::new("sh").args(["-c", "while :; do :; done"]).spawn().unwrap();
        let mut cpu = Cpu::default();
        assert!(cpu.shares([busy.id()].into_iter()).is_empty(), "nothing to compare with");
        thread::sleep(Duration::from_millis(200));
        let shares = cpu.shares([busy.id(), id(), 0].into_iter());
        busy.kill().unwrap();
        busy.wait().unwrap();
        assert!(shares.len() == 1 && shares[&busy.id()] > 0.0, "{shares:?}");
        assert!(cpu.shares([busy.id()].into_iter()).is_empty(), "it has ended");
    }
}
