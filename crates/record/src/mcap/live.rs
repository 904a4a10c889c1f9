//! Frames for viewers that watch while a run advances.
//!
//! The server is the library's, with the library's threads: viewers and their delays affect only those. It keeps some
//! messages for each viewer and drops the oldest, so that frames are passed on without waiting.

use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use foxglove::websocket::{
    Capability, ChannelView, Client, PlaybackCommand, PlaybackControlRequest, PlaybackState,
    PlaybackStatus, ServerListener,
};
use foxglove::{
    ChannelBuilder, Context, Encode, FoxgloveError, PartialMetadata, RawChannel, WebSocketServer,
    WebSocketServerHandle,
};
use sidestep_kernel::ports::RecordError;
use sidestep_kernel::view::{Frame, Scenery};

use super::frame_encoder::{FrameEncoder, MessageSink};
use super::messages::to_ns;

/// Bytes that wait for a viewer before the oldest ones are dropped, about.
const MAX_BACKLOG_BYTES: usize = 64 << 20;
/// Fewest messages that may wait: as many as there can be topics, so that each has its newest.
const MIN_BACKLOG_MESSAGES: usize = 128;
const MAX_BACKLOG_MESSAGES: usize = 1024;

/// The request of a viewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaybackRequest {
    /// Whether the run is to continue.
    pub play: bool,
    /// Simulated seconds per second; any number at all, because it comes from outside.
    pub speed: f64,
    /// The time to go to.
    pub seek_s: Option<f64>,
}

/// The state of the run, as reported to viewers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Playback {
    /// Whether it advances, and if not, why.
    pub playing: PlaybackPhase,
    /// Simulated seconds since the start of the run.
    pub time_s: f64,
    /// Simulated seconds per second of the viewers' clock.
    pub speed: f64,
    /// Whether the time has jumped.
    pub did_seek: bool,
}

/// Whether a run advances.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaybackPhase {
    /// It advances.
    Playing,
    /// It stands still, and goes on when a viewer asks.
    Paused,
    /// It stands still, and cannot go on.
    Ended,
}

/// The server of viewers. It ends when this is dropped.
pub struct LiveServer {
    /// `None` once it has ended.
    handle: Option<WebSocketServerHandle>,
    _context: Arc<Context>,
}

/// The frames of a server, in a form that viewers understand.
pub struct LiveFrameWriter {
    topics: FrameEncoder,
    output: LiveOutput,
}

/// A run that a server shows to viewers.
#[derive(Debug, Clone, Copy)]
pub struct ServedRun<'a> {
    /// Everything that stays the same.
    pub scenery: &'a Scenery,
    /// The first frame, whose size helps to decide how many messages may wait for a viewer.
    pub first: &'a Frame,
    /// The end of the run in simulated seconds, up to which viewers show a time line.
    pub end_s: f64,
}

/// Starts a server for `run` at `host` and `port` (0 for any free one). Viewers' requests are
/// handed to `steer` in threads of the server, where it must not wait: all viewers would.
///
/// # Errors
/// When the address cannot be used.
pub fn start_live_server(
    host: &str,
    port: u16,
    run: &ServedRun<'_>,
    steer: impl Fn(PlaybackRequest) -> Playback + Send + Sync + 'static,
) -> io::Result<(LiveServer, LiveFrameWriter)> {
    let context = Context::new();
    let handler = Arc::new(RequestHandler { latest: Mutex::default(), steer: Box::new(steer) });
    let output = LiveOutput {
        context: context.clone(),
        handler: handler.clone(),
        channels: BTreeMap::new(),
    };
    let ServedRun { scenery, first, end_s } = *run;
    let mut frames = LiveFrameWriter { topics: FrameEncoder::new(scenery), output };
    // Before the server starts: the size of these messages determines how many may wait.
    frames.topics.write_scenery(scenery, &mut frames.output).map_err(io::Error::other)?;
    frames.write_frame(first).map_err(io::Error::other)?;
    let server = WebSocketServer::new()
        .context(&context)
        .name(format!("sidestep: {}", scenery.name))
        .bind(host, port)
        .capabilities([Capability::PlaybackControl, Capability::Time])
        .playback_time_range(0, to_ns(end_s))
        .message_backlog_size(handler.max_backlog_messages())
        .listener(handler)
        .start_blocking();
    let handle = server.map_err(|error| match error {
        FoxgloveError::Bind(error) => error,
        other => io::Error::other(other),
    })?;
    Ok((LiveServer { handle: Some(handle), _context: context }, frames))
}

impl LiveServer {
    /// Returns the port at which it listens.
    pub fn port(&self) -> u16 {
        self.handle.as_ref().map_or(0, WebSocketServerHandle::port)
    }

    /// Returns whether a viewer watches.
    pub fn has_viewers(&self) -> bool {
        self.handle.as_ref().is_some_and(|handle| handle.client_count() > 0)
    }

    /// Tells all viewers the state of the run.
    pub fn broadcast(&self, playback: Playback) {
        if let Some(handle) = &self.handle {
            handle.broadcast_time(to_ns(playback.time_s));
            handle.broadcast_playback_state(playback_state(playback));
        }
    }
}

impl Drop for LiveServer {
    fn drop(&mut self) {
        if let Some(handle) = self.handle.take() {
            // Viewers that do not read are not waited for: connections end with this.
            drop(handle.stop());
        }
    }
}

impl LiveFrameWriter {
    /// Passes a frame on to viewers.
    ///
    /// # Errors
    /// When it cannot be encoded.
    pub fn write_frame(&mut self, frame: &Frame) -> Result<(), RecordError> {
        self.topics.write_frame(frame, &mut self.output)
    }
}

struct LiveOutput {
    context: Arc<Context>,
    handler: Arc<RequestHandler>,
    /// Channels by topic; a channel exists from the first message of its topic on.
    channels: BTreeMap<String, Arc<RawChannel>>,
}

impl LiveOutput {
    fn channel<T: Encode>(&mut self, topic: &str) -> Result<Arc<RawChannel>, RecordError> {
        if let Some(channel) = self.channels.get(topic) {
            return Ok(channel.clone());
        }
        let builder = ChannelBuilder::new(topic).context(&self.context);
        let builder = builder.schema(T::get_schema()).message_encoding(T::get_message_encoding());
        let channel = builder.build_raw().map_err(|e| RecordError::new(topic, e))?;
        self.channels.insert(topic.into(), channel.clone());
        Ok(channel)
    }
}

impl MessageSink for LiveOutput {
    fn write<T: Encode>(
        &mut self,
        topic: &str,
        log_time: u64,
        message: &T,
    ) -> Result<(), RecordError> {
        let channel = self.channel::<T>(topic)?;
        let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or(0));
        message.encode(&mut bytes).map_err(|e| RecordError::new(topic, e))?;
        channel.log_with_meta(&bytes, PartialMetadata::with_log_time(log_time));
        // An event is sent once, not whenever a viewer comes.
        if topic != "/log" {
            let id = u64::from(channel.id());
            self.handler.lock().insert(id, LatestMessage { channel, log_time, bytes });
        }
        Ok(())
    }

    fn is_lossy(&self) -> bool {
        true
    }
}

struct LatestMessage {
    channel: Arc<RawChannel>,
    log_time: u64,
    bytes: Vec<u8>,
}

/// The server's side of viewers' requests.
struct RequestHandler {
    /// The last message of each channel, for viewers that come later.
    latest: Mutex<BTreeMap<u64, LatestMessage>>,
    steer: Box<dyn Fn(PlaybackRequest) -> Playback + Send + Sync>,
}

impl RequestHandler {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<u64, LatestMessage>> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the number of messages that may wait for a viewer.
    fn max_backlog_messages(&self) -> usize {
        let largest = self.lock().values().map(|message| message.bytes.len()).max();
        (MAX_BACKLOG_BYTES / largest.unwrap_or(0).max(1))
            .clamp(MIN_BACKLOG_MESSAGES, MAX_BACKLOG_MESSAGES)
    }
}

impl ServerListener for RequestHandler {
    fn on_subscribe(&self, client: Client, channel: ChannelView) {
        if let Some(message) = self.lock().get(&u64::from(channel.id())) {
            let meta = PartialMetadata::with_log_time(message.log_time);
            message.channel.log_with_meta_to_sink(&message.bytes, meta, client.sink_id());
        }
    }

    fn on_playback_control_request(
        &self,
        request: PlaybackControlRequest,
    ) -> Option<PlaybackState> {
        let request = PlaybackRequest {
            play: request.playback_command == PlaybackCommand::Play,
            speed: f64::from(request.playback_speed),
            seek_s: request.seek_time.map(|ns| ns as f64 * 1e-9),
        };
        Some(playback_state((self.steer)(request)))
    }
}

fn playback_state(playback: Playback) -> PlaybackState {
    let status = match playback.playing {
        PlaybackPhase::Playing => PlaybackStatus::Playing,
        PlaybackPhase::Paused => PlaybackStatus::Paused,
        PlaybackPhase::Ended => PlaybackStatus::Ended,
    };
    PlaybackState {
        status,
        current_time: to_ns(playback.time_s),
        playback_speed: playback.speed as f32,
        did_seek: playback.did_seek,
        request_id: None,
    }
}
