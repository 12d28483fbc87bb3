//! What examples that measure share.

use std::fs;

/// CPU time of this process, of all its threads, the user's and the system's [s]; 0 where it is not known (only Linux tells).
pub fn cpu_seconds() -> f64 {
    // What follows the name in proc_pid_stat(5) begins with field 3; 14 and 15 are utime and stime, in hundredths of a second.
    let ticks = fs::read_to_string("/proc/self/stat").ok().and_then(|text| {
        let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
        Some(fields.next()?.parse::<f64>().ok()? + fields.next()?.parse::<f64>().ok()?)
    });
    ticks.map_or(0.0, |ticks| ticks * 0.01)
}
