//! Memory: how much there is left, whether a need fits, and one message where it does not.
use crate::error::{Error, Result};
use mpi::topology::SimpleCommunicator;
use std::{
    alloc::{GlobalAlloc, Layout, System},
    fs::read_to_string,
    io::Write,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
};

/// What the program is busy with, for the message when memory runs out.
static BUSY: Mutex<String> = Mutex::new(String::new());

/// One message is enough.
static FAILED: AtomicBool = AtomicBool::new(false);

/// The system's allocator; where it has nothing left, all ranks end with one message and one exit code.
pub struct Allocator;

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

// SAFETY: everything is the system's allocator's; a failure does not return.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as promised to this function.
        got(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        // SAFETY: as promised to this function.
        unsafe { System.dealloc(p, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as promised to this function.
        got(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, p: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as promised to this function.
        got(unsafe { System.realloc(p, layout, size) }, size)
    }
}

fn got(p: *mut u8, size: usize) -> *mut u8 {
    if p.is_null() {
        out_of_memory(size);
    }
    p
}

/// Says what is missing and ends all ranks. Allocates nothing itself.
#[cold]
fn out_of_memory(size: usize) -> ! {
    if !FAILED.swap(true, Ordering::SeqCst) {
        let mut err = std::io::stderr().lock();
        let _ = write!(err, "kontakt: error: there is not enough memory: {size} more bytes were refused");
        if let Ok(busy) = BUSY.try_lock()
            && !busy.is_empty()
        {
            let _ = write!(err, ", {busy}");
        }
        let _ = writeln!(err, "; fewer unknowns or more memory help");
    }
    super::end_all(Error::MEMORY);
    // Without MPI, or if it cannot end them.
    std::process::exit(Error::MEMORY)
}

/// Notes what comes next, with its need: it stands in the message if an allocation fails.
pub fn busy_with(what: String) {
    if let Ok(mut busy) = BUSY.lock() {
        *busy = what;
    }
}

/// True if this many bytes can be had now. They are given back at once, and not touched.
pub fn can_have(bytes: usize) -> bool {
    let Ok(layout) = Layout::from_size_align(bytes.max(1), 16) else { return false };
    // SAFETY: the layout has a size; the block is given back as it was got.
    unsafe {
        // Seen by the optimiser as used: a block that is got and given back unseen is not asked for at all.
        let p = std::hint::black_box(System.alloc(layout));
        if !p.is_null() {
            System.dealloc(p, layout);
        }
        !p.is_null()
    }
}

/// Memory that is left, bytes, and what limits it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Room {
    bytes: f64,
    limit: &'static str,
}

/// An error if the ranks of `group` cannot have `bytes` more each. `what` needs them: "body 'a': its factorisation".
/// Collective.
pub fn demand(group: &SimpleCommunicator, bytes: f64, what: &str) -> Result<()> {
    let total = super::sum(group, &[bytes])[0];
    // An address limit is each rank's own, the others the machine's.
    let lacking = [(address_room(), bytes), (control_group_room(), total), (physical_room(), total)]
        .into_iter()
        .find_map(|(room, need)| room.filter(|room| need > room.bytes).map(|room| (room, need)));
    let fits = match lacking {
        None => Ok(()),
        Some((room, need)) => Err(Error::Memory(format!(
            "{what} needs about {:.0} MB more, {:.0} MB are left {}",
            need / 1e6,
            room.bytes.max(0.0) / 1e6,
            room.limit
        ))),
    };
    super::agree(group, fits)
}

/// A line `Name:   123 kB` of a file, in bytes.
fn kilobytes(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1024.0)
}

/// Under RLIMIT_AS.
fn address_room() -> Option<Room> {
    let limits = read_to_string("/proc/self/limits").ok()?;
    let limit = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: f64 = limit.split_whitespace().next()?.parse().ok()?;
    let used = kilobytes(&read_to_string("/proc/self/status").ok()?, "VmSize:")?;
    Some(Room { bytes: limit - used, limit: "under the address limit of the process (ulimit -v)" })
}

/// Under the limit of the process' control group: version 2, then version 1.
fn control_group_room() -> Option<Room> {
    let number = |path: String| read_to_string(path).ok()?.trim().parse::<f64>().ok();
    let groups = read_to_string("/proc/self/cgroup").ok()?;
    let own = groups.lines().find_map(|line| line.strip_prefix("0::")).unwrap_or("/").trim_end_matches('/');
    let two = [own, ""].into_iter().map(|path| format!("/sys/fs/cgroup{path}"));
    let two = two.map(|at| (at.clone() + "/memory.max", at.clone() + "/memory.current", at + "/memory.stat"));
    let at = "/sys/fs/cgroup/memory/memory.";
    let one = (format!("{at}limit_in_bytes"), format!("{at}usage_in_bytes"), format!("{at}stat"));
    two.chain([one]).find_map(|(limit, usage, stat)| {
        let (limit, used) = (number(limit)?, number(usage)?);
        // Pages of files are given up when memory is short.
        let stat = read_to_string(stat).ok()?;
        let file = stat.lines().find_map(|line| line.strip_prefix("inactive_file "));
        let file: f64 = file.and_then(|n| n.trim().parse().ok()).unwrap_or(0.0);
        Some(Room { bytes: limit - used + file, limit: "under the limit of the control group" })
    })
}

/// Of the machine, swap space included.
fn physical_room() -> Option<Room> {
    let text = read_to_string("/proc/meminfo").ok()?;
    let bytes = kilobytes(&text, "MemAvailable:")? + kilobytes(&text, "SwapFree:").unwrap_or(0.0);
    Some(Room { bytes, limit: "on this machine" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_with_their_unit() {
        assert_eq!(kilobytes("VmPeak:\t 7 kB\nVmSize:\t 12 kB\n", "VmSize:"), Some(12288.0));
        assert_eq!(kilobytes("VmPeak:\t 7 kB\n", "VmSize:"), None);
    }

    #[test]
    fn there_is_room_and_it_ends() {
        let room = physical_room().unwrap();
        assert!(room.bytes > 1e6, "{room:?}");
        assert!(can_have(1 << 20) && !can_have(1 << 62));
    }
}
