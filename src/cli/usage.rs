//! The time and memory that this process used.

use std::time::Instant;

use etendue::render::checkpoint::ResourceUse;

/// The wall time since a moment; CPU time and memory since the process began.
pub(super) fn since(start: Instant) -> ResourceUse {
    ResourceUse { seconds: start.elapsed().as_secs_f64(), core_seconds: core_seconds(), peak_bytes: peak_bytes() }
}

#[cfg(unix)]
fn core_seconds() -> f64 {
    use nix::sys::{
        resource::{UsageWho, getrusage},
        time::TimeValLike as _,
    };
    let usage = getrusage(UsageWho::RUSAGE_SELF);
    usage.map_or(0.0, |usage| (usage.user_time() + usage.system_time()).num_microseconds() as f64 * 1e-6)
}

/// The peak memory of this program from the kernel. The value of getrusage would include the memory of the parent
/// process.
#[cfg(target_os = "linux")]
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
    peak.map_or(0, |kilobytes: u64| kilobytes * 1024)
}

#[cfg(all(unix, not(target_os = "linux")))]
fn peak_bytes() -> u64 {
    use nix::sys::resource::{UsageWho, getrusage};
    // Apple's systems count bytes, other systems kilobytes.
    let unit = if cfg!(target_vendor = "apple") { 1 } else { 1024 };
    getrusage(UsageWho::RUSAGE_SELF).map_or(0, |usage| usage.max_rss().unsigned_abs() * unit)
}

#[cfg(not(unix))]
fn core_seconds() -> f64 {
    0.0
}

#[cfg(not(unix))]
fn peak_bytes() -> u64 {
    0
}
