//! Gives memory back that setting up has used and the rest of a run does not.
//!
//! With a thousand agents on a machine, what each of them holds decides how much of it stays in the caches.
//! Opening iceoryx2's services needs some 150 KB of stack once; see docs/performance.md for what this saves.

#![allow(unsafe_code)]

use std::{fs, ops::Range};

use rustix::mm::{Advice, madvise};

/// Kept below the stack's present end: more than [`trim`] itself needs.
const KEPT_BELOW: usize = 8 * 1024;

/// Returns unused heap and unused stack to the operating system. Call it in the main thread, from a frame as
/// shallow as possible; in any other thread only the heap is trimmed. Costs some 50 µs. What cannot be given
/// back stays.
pub fn trim() {
    // This needs some pages of heap too, so it comes first.
    let stack = stack_of(&fs::read_to_string("/proc/self/maps").unwrap_or_default());
    #[cfg(target_env = "gnu")]
    // SAFETY: it has no preconditions, and takes the allocator's own locks.
    unsafe {
        libc::malloc_trim(0);
    }
    if let Some(stack) = stack {
        trim_stack(&stack);
    }
}

/// Gives back the pages of `stack` below this frame.
#[inline(never)]
fn trim_stack(stack: &Range<usize>) {
    let Some(page_size) = page_size() else { return };
    let here = std::ptr::from_ref(&stack).addr();
    let end = here.saturating_sub(KEPT_BELOW) & !(page_size - 1);
    if !stack.contains(&here) || end <= stack.start {
        return;
    }
    let start = std::ptr::with_exposed_provenance_mut(stack.start);
    // SAFETY: this is the stack we run on, which grows downwards. No frame lives more than KEPT_BELOW below
    // this one but those of the call itself, which are far smaller. What later frames find there are zeros
    // instead of what dead ones left; both are uninitialized memory to them.
    let _ = unsafe { madvise(start, end - stack.start, Advice::LinuxDontNeed) };
}

/// Bytes of a page, as the C library tells.
fn page_size() -> Option<usize> {
    // SAFETY: it has no preconditions.
    let bytes = unsafe { libc::sysconf(libc::_SC_PAGESIZE) };
    usize::try_from(bytes).ok().filter(|bytes| bytes.is_power_of_two())
}

/// Where /proc/PID/maps says the main thread's stack is.
fn stack_of(maps: &str) -> Option<Range<usize>> {
    let line = maps.lines().find(|line| line.ends_with("[stack]"))?;
    let (start, end) = line.split_once(' ')?.0.split_once('-')?;
    let address = |hex| usize::from_str_radix(hex, 16).ok();
    Some(address(start)?..address(end)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stack_is_found_among_the_maps() {
        let maps = "00400000-00452000 r-xp 00000000 08:02 173521 /bin/a\n\
                    7ffc46fae000-7ffc46fda000 rw-p 00000000 00:00 0    [stack]\n";
        assert_eq!(stack_of(maps), Some(0x7ffc_46fa_e000..0x7ffc_46fd_a000));
        assert_eq!(stack_of("00400000-00452000 r-xp 0 0 0 /bin/a\n"), None);
    }

    /// Uses `depth` KiB of stack.
    #[inline(never)]
    fn deep(depth: usize) -> u8 {
        let frame = std::hint::black_box([depth as u8; 1024]);
        if depth == 0 { frame[0] } else { deep(depth - 1).wrapping_add(frame[512]) }
    }

    #[test]
    fn whoever_runs_on_goes_on_with_all_it_had() {
        let kept: Vec<usize> = (0..10_000).collect();
        let on_stack = std::hint::black_box([7u8; 4096]);
        let before = deep(500);
        trim();
        assert_eq!(deep(500), before);
        assert!(on_stack.iter().all(|&byte| byte == 7));
        assert!(kept.iter().enumerate().all(|(at, &value)| at == value));
    }
}
