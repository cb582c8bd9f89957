//! Long work in short slices: between them the page's thread can draw and listen.

use std::future::Future;
use std::pin::Pin;

/// What gives up the thread for a moment.
type Rest = Box<dyn Fn() -> Pin<Box<dyn Future<Output = ()>>>>;

/// How often work is interrupted.
pub struct Pace {
    /// None where nobody waits.
    rest: Option<Rest>,
    /// Milliseconds of some clock.
    now: fn() -> f64,
    slice_began: f64,
}

/// Milliseconds after which work is interrupted: with what is done between two questions, well below the 50 that a person
/// notices.
const SLICE: f64 = 8.0;

/// Bytes that are copied between two questions: a few milliseconds' worth.
pub const SLICE_BYTES: usize = 4 << 20;

impl Pace {
    /// Without interruption: futures that only wait for this are ready at once.
    pub fn unbroken() -> Self {
        Pace { rest: None, now: || 0.0, slice_began: 0.0 }
    }

    /// Interrupted by `rest` whenever a slice of work has taken long enough by the clock `now`, in milliseconds.
    pub fn sliced(now: fn() -> f64, rest: impl Fn() -> Pin<Box<dyn Future<Output = ()>>> + 'static) -> Self {
        Pace { rest: Some(Box::new(rest)), now, slice_began: now() }
    }

    /// Interrupts the work if it is time.
    pub async fn breathe(&mut self) {
        if let Some(rest) = &self.rest
            && (self.now)() - self.slice_began >= SLICE
        {
            rest().await;
            self.slice_began = (self.now)();
        }
    }
}
