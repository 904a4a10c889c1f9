//! Runs that are watched live, by viewers of Foxglove's protocol.
//!
//! A frame is made if there are viewers and the one before is encoded, which happens on a thread of its own: frames
//! that no viewer could take in time are not made, and the run does not wait for them.

mod address;
mod control;

pub use address::{ViewerAddress, next_free_port};
pub use control::LiveControl;

use crate::Error;
use crate::frame_sink::FRAME_OPTIONS;
use sidestep_kernel::Simulation;
use sidestep_kernel::view::{Frame, FrameOptions, Scenery};
use sidestep_record::{
    LiveFrameWriter, LiveServer, Playback, PlaybackPhase, PlaybackRequest, ServedRun,
    start_live_server,
};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, Builder, JoinHandle};
use std::time::{Duration, Instant};

/// The time between two frames: 30 a second, as viewers draw them.
const FRAME_INTERVAL: Duration = Duration::from_millis(33);
/// The time between two playback states of a run that advances; viewers move their clock by themselves in between.
const PLAYBACK_INTERVAL: Duration = Duration::from_millis(100);
/// Half a second in all, in which a server that ends gives its port back.
const MAX_BIND_ATTEMPTS: u32 = 50;
const BIND_RETRY_DELAY: Duration = Duration::from_millis(10);
/// The speeds that viewers can ask for, in simulated seconds per second; others are clamped.
const SPEED_RANGE: std::ops::RangeInclusive<f64> = 0.1..=100.0;

/// The viewers of one run. They are disconnected when this is dropped.
pub struct ViewerServer {
    server: LiveServer,
    requests: Arc<PlaybackRequests>,
    /// `None` after the last frame.
    frames: Option<SyncSender<Frame>>,
    is_encoding: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// The time that the last frame shows.
    shown_s: f64,
    frame_due: Instant,
    playback_due: Instant,
}

/// Properties of a run that viewers may watch.
#[derive(Debug, Clone, Copy)]
pub struct ViewerOptions {
    /// The end of the run, in simulated seconds.
    pub end_s: f64,
    /// Whether viewers may ask for times.
    pub can_seek: bool,
    /// The state of the run.
    pub playback: Playback,
}

/// The requests of viewers, and the playback state that they were sent last. The server's threads accept requests, and
/// the run's thread takes them.
struct PlaybackRequests {
    can_seek: bool,
    sent: Mutex<Playback>,
    waiting: Mutex<Option<PlaybackRequest>>,
}

impl ViewerServer {
    /// The options with which callers make the frames that they send: scans of the first bodies only.
    pub const FRAME_OPTIONS: FrameOptions = FRAME_OPTIONS;

    /// Starts to serve viewers of a run.
    ///
    /// # Errors
    /// When the address cannot be taken.
    pub fn start(
        at: &ViewerAddress,
        run: &mut dyn Simulation,
        scenery: &Scenery,
        options: ViewerOptions,
    ) -> Result<Self, Error> {
        let requests = Arc::new(PlaybackRequests {
            can_seek: options.can_seek,
            sent: Mutex::new(options.playback),
            waiting: Mutex::default(),
        });
        let first = run.frame(FRAME_OPTIONS);
        let served_run = ServedRun { scenery, first: &first, end_s: options.end_s };
        let host = at.host();
        let served = retry_bind(|| {
            let requests = requests.clone();
            start_live_server(&host, at.port(), &served_run, move |one| requests.accept(one))
        });
        let (server, encoder) = served.map_err(|e| at.bind_error(&e))?;
        // One frame, so that the run never gets ahead of the encoder.
        let (frames, received) = sync_channel(1);
        let is_encoding = Arc::new(AtomicBool::new(false));
        let encoder_state = is_encoding.clone();
        let thread = Builder::new()
            .name("viewers".into())
            .spawn(move || encode_frames(encoder, &received, &encoder_state))
            .map_err(|e| {
                Error::other(format!("no thread for viewers: {e}"), "end other programs")
            })?;
        Ok(Self {
            server,
            requests,
            frames: Some(frames),
            is_encoding,
            thread: Some(thread),
            shown_s: first.time_s,
            frame_due: Instant::now(),
            playback_due: Instant::now(),
        })
    }

    /// Returns whether anyone would see a frame: without viewers none is worth making.
    pub fn has_viewers(&self) -> bool {
        self.server.has_viewers()
    }

    /// Returns the request of viewers since the last call.
    pub fn take_request(&self) -> Option<PlaybackRequest> {
        lock(&self.requests.waiting).take()
    }

    /// Returns whether a frame of this time is due for them now: it differs from the last, and that one is encoded.
    pub fn is_frame_due(&self, time_s: f64, now: Instant) -> bool {
        self.has_viewers()
            && time_s != self.shown_s
            && now >= self.frame_due
            && !self.is_encoding.load(Ordering::Acquire)
    }

    /// Shows a frame that was due.
    pub fn send_frame(&mut self, frame: Frame, now: Instant) {
        self.shown_s = frame.time_s;
        // Counted from the time when it was due, so that small delays do not lower the rate.
        self.frame_due = (self.frame_due + FRAME_INTERVAL).max(now);
        self.is_encoding.store(true, Ordering::Release);
        if let Some(frames) = &self.frames {
            // It is taken, because the one before is encoded.
            let _ = frames.try_send(frame);
        }
    }

    /// Sends them the state of the run: at once if its activity changes or its time has jumped, otherwise at intervals.
    pub fn send_playback(&mut self, playback: Playback, now: Instant) {
        let mut sent = lock(&self.requests.sent);
        let did_seek = playback.did_seek || playback.time_s < sent.time_s;
        let is_other = sent.playing != playback.playing || sent.speed != playback.speed || did_seek;
        let is_later = sent.time_s != playback.time_s && now >= self.playback_due;
        if is_other || is_later {
            *sent = Playback { did_seek: false, ..playback };
            // Not held while it is sent: a thread of the server may be about to accept a request.
            drop(sent);
            self.playback_due = now + PLAYBACK_INTERVAL;
            self.server.broadcast(Playback { did_seek, ..playback });
        }
    }
}

impl Drop for ViewerServer {
    fn drop(&mut self) {
        // Ends the loop of the thread.
        self.frames = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl PlaybackRequests {
    /// Accepts a request in bounds, and returns the playback that viewers shall show until the run follows it.
    fn accept(&self, request: PlaybackRequest) -> Playback {
        let sent = *lock(&self.sent);
        let mut speed = sent.speed;
        // Any number may come from outside.
        if request.speed.is_finite() && request.speed > 0.0 {
            speed = request.speed.clamp(*SPEED_RANGE.start(), *SPEED_RANGE.end());
        }
        let seek_s = request.seek_s.filter(|_| self.can_seek);
        let mut waiting = lock(&self.waiting);
        // A viewer that asks for a time, and then to play, means both.
        let earlier_s = waiting.as_ref().and_then(|earlier| earlier.seek_s);
        *waiting = Some(PlaybackRequest { speed, seek_s: seek_s.or(earlier_s), ..request });
        let playing = if request.play { PlaybackPhase::Playing } else { PlaybackPhase::Paused };
        let time_s = seek_s.unwrap_or(sent.time_s);
        Playback { playing, time_s, speed, did_seek: seek_s.is_some() }
    }
}

/// Locks, also after a thread has panicked with the lock: each value is written in one step, so it is whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Tries to get a port several times: the server that had it before may be about to end.
fn retry_bind<T>(start: impl Fn() -> io::Result<T>) -> io::Result<T> {
    for _ in 0..MAX_BIND_ATTEMPTS {
        match start() {
            Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
                thread::sleep(BIND_RETRY_DELAY)
            }
            other => return other,
        }
    }
    start()
}

/// Encodes frames until the last one.
fn encode_frames(mut encoder: LiveFrameWriter, frames: &Receiver<Frame>, is_encoding: &AtomicBool) {
    for frame in frames {
        // A frame that cannot be encoded is not shown; the next one may be.
        let _ = encoder.write_frame(&frame);
        is_encoding.store(false, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLD: Playback =
        Playback { playing: PlaybackPhase::Playing, time_s: 5.0, speed: 2.0, did_seek: false };

    fn wishes(can_seek: bool) -> PlaybackRequests {
        PlaybackRequests { can_seek, sent: Mutex::new(TOLD), waiting: Mutex::default() }
    }

    fn wish(play: bool, speed: f64, seek_s: Option<f64>) -> PlaybackRequest {
        PlaybackRequest { play, speed, seek_s }
    }

    #[test]
    fn a_wish_for_a_time_is_not_lost_when_another_wish_follows() {
        let wishes = wishes(true);
        let came = wishes.accept(wish(false, 1.0, Some(7.0)));
        assert_eq!((came.playing, came.time_s, came.did_seek), (PlaybackPhase::Paused, 7.0, true));
        wishes.accept(wish(true, 4.0, None));
        assert_eq!(lock(&wishes.waiting).take(), Some(wish(true, 4.0, Some(7.0))));
    }

    #[test]
    fn times_are_refused_where_a_run_cannot_go_back() {
        let wishes = wishes(false);
        let came = wishes.accept(wish(true, 1.0, Some(7.0)));
        assert_eq!((came.time_s, came.did_seek), (5.0, false));
        assert_eq!(lock(&wishes.waiting).take().and_then(|wish| wish.seek_s), None);
    }

    #[test]
    fn speeds_that_are_none_leave_the_speed_and_others_are_kept_in_bounds() {
        let wishes = wishes(false);
        let speeds = [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e9, 1e-9, 3.0];
        let came = speeds.map(|speed| wishes.accept(wish(true, speed, None)).speed);
        assert_eq!(came, [2.0, 2.0, 2.0, 2.0, 100.0, 0.1, 3.0]);
    }
}
