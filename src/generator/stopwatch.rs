//! Processor time of one thread, to foresee how long a scene takes.

use std::time::Duration;

/// Start of a piece of work on this thread.
pub struct Stopwatch(Duration);

impl Stopwatch {
    /// A watch that counts from now on.
    pub fn start() -> Self {
        Self(now())
    }

    /// Processor's seconds since the start, on the thread that started it.
    pub fn elapsed_s(&self) -> f64 {
        now().saturating_sub(self.0).as_secs_f64()
    }
}

#[cfg(unix)]
fn now() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.try_into().unwrap_or(0), time.tv_nsec.try_into().unwrap_or(0))
}

/// Time of the clock on the wall: systems without a thread's clock count what other programs take, too.
#[cfg(not(unix))]
fn now() -> Duration {
    use std::sync::LazyLock;
    use std::time::Instant;

    static FIRST: LazyLock<Instant> = LazyLock::new(Instant::now);
    FIRST.elapsed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_counts_and_sleep_does_not() {
        let watch = Stopwatch::start();
        std::thread::sleep(Duration::from_millis(50));
        let slept_s = watch.elapsed_s();
        let mut sum = 0.0_f64;
        while watch.elapsed_s() < slept_s + 1e-3 {
            sum += libm::sin(std::hint::black_box(sum));
        }
        assert!(cfg!(not(unix)) || slept_s < 0.04, "{slept_s}");
    }
}
