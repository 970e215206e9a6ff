//! Where it was measured, in one line: figures mean nothing without it.

use std::{
    fs, io,
    process::{self, Command},
    thread::available_parallelism,
};

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Processor, cores, kernel, compiler, and how we are linked; what cannot be found out is named as unknown.
pub(crate) fn described() -> String {
    let cores = available_parallelism().map_or_else(|_| unknown("number of"), |cores| cores.to_string());
    let linked = if cfg!(target_feature = "crt-static") { "statically" } else { "dynamically" };
    let (processor, kernel, compiler) = (processor(), kernel(), compiler());
    format!("Machine: {processor}, {cores} cores, Linux {kernel}, {compiler}; floors are linked {linked}.")
}

/// Raises our limit on open files, which processes that we start inherit, as far as everybody may.
pub(crate) fn raise_open_files() -> io::Result<()> {
    let limit = getrlimit(Resource::Nofile);
    Ok(setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, ..limit })?)
}

/// Name, or its beginning, of all that is ours alone on this machine: runs, files, addresses.
pub(crate) fn our_name() -> String {
    format!("tick-cost-{}", process::id())
}

/// How many files we have open, of how many: what a swarm that is too large fails by first.
pub(crate) fn open_files() -> String {
    let most = getrlimit(Resource::Nofile).current.map_or_else(|| unknown("limit"), |most| most.to_string());
    match fs::read_dir("/proc/self/fd") {
        Ok(open) => format!("{} of at most {most} files are open", open.count()),
        Err(error) => format!("no file can be opened, the limit is {most} ({error})"),
    }
}

fn processor() -> String {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    model_name(&info).map_or_else(|| unknown("processor"), str::to_owned)
}

fn kernel() -> String {
    fs::read_to_string("/proc/sys/kernel/osrelease")
        .map_or_else(|_| unknown("release"), |release| release.trim().to_owned())
}

/// The compiler of this shell; `scripts/bench` has just built us with it.
fn compiler() -> String {
    let output =
        Command::new("rustc").arg("--version").output().ok().filter(|output| output.status.success());
    output.map_or_else(
        || unknown("compiler"),
        |output| String::from_utf8_lossy(&output.stdout).trim().to_owned(),
    )
}

fn model_name(cpuinfo: &str) -> Option<&str> {
    let line = cpuinfo.lines().find_map(|line| line.strip_prefix("model name"))?;
    line.split_once(':').map(|(_, name)| name.trim())
}

fn unknown(what: &str) -> String {
    format!("unknown {what}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_that_of_the_first_core() {
        let info = "processor\t: 0\nmodel name\t: Abacus 3000: fast\nprocessor\t: 1\nmodel name\t: other\n";
        assert_eq!(model_name(info), Some("Abacus 3000: fast"));
        assert_eq!(model_name("processor : 0"), None);
    }
}
