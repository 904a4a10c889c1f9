//! What a process has used of its machine.

/// Returns the time in milliseconds that processors have spent on this process, with all of its threads; none where the
/// system does not tell.
pub(crate) fn processor_time_ms() -> Option<u64> {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        let seconds = u64::try_from(time.tv_sec).ok()?;
        let nanoseconds = u64::try_from(time.tv_nsec).ok()?;
        Some(1_000 * seconds + nanoseconds / 1_000_000)
    }
    #[cfg(not(unix))]
    None
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn work_takes_processor_time() {
        let before_ms = processor_time_ms().expect("Unix tells");
        let mut sum = 0u64;
        while processor_time_ms().expect("Unix tells") < before_ms + 2 {
            sum = std::hint::black_box(sum + 1);
        }
    }
}
