//! The node on the network: its topics and services.

use super::goals::GoalPose;
use super::rmw::{
    Attachment, EndpointKind, Gid, QualityOfService, RosEndpoint, RosNodeName, RosType,
    gid_of_token,
};
use super::trajectories::read_trajectory;
use super::types::{TRIGGER, TWIST_NAME, message_type};
use super::velocity::Velocity;
use crate::wire::endpoint::{WireSetupError, without_sources};
use crate::wire::zenoh::open_ros2_session;
use sidestep::import::bag::cdr::encode;
use sidestep::import::bag::messages::{JointTrajectory, Message, PoseStamped, TriggerResponse};
use sidestep::kernel::EntityId;
use sidestep_session::fleet::{Ros2Job, RosGraph, RosNetwork};
use sidestep_session::ros::RosMessage;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use zenoh::key_expr::KeyExpr;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable, ReplyKeyExpr};
use zenoh::{Session, Wait};

/// The name of the node of a run.
const NODE_NAME: &str = "sidestep";

/// Number of messages that are kept for a slow receiver of frames (as `tf2` has it).
const TF_DEPTH: u32 = 100;

/// What a service does with the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunService {
    /// Stops time.
    Pause,
    /// Lets time pass.
    Resume,
    /// Computes one cycle while time stands still.
    Step,
    /// Takes the run back to its start.
    Reset,
}

impl RunService {
    /// All services.
    pub const ALL: [Self; 4] = [Self::Pause, Self::Resume, Self::Step, Self::Reset];

    /// Returns its name, which is one of the node's own: `~/pause`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pause => "pause",
            Self::Resume => "resume",
            Self::Step => "step",
            Self::Reset => "reset",
        }
    }
}

/// A request to a service, which waits for its answer.
pub struct ServiceRequest {
    /// The service.
    pub service: RunService,
    query: Query,
    attachment: Attachment,
}

impl fmt::Debug for ServiceRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ServiceRequest").field("service", &self.service).finish_non_exhaustive()
    }
}

impl ServiceRequest {
    /// Answers whether the service has done it, with words for people.
    pub fn answer(self, success: bool, message: impl Into<String>) {
        let response = TriggerResponse { success, message: message.into() };
        // The client knows its response by the number and the identity of its request.
        let attachment = Attachment { source_time_ns: wall_clock_ns(), ..self.attachment };
        let key = self.query.key_expr().clone();
        let reply = self.query.reply(key, encode(&response)).attachment(attachment.to_bytes());
        // An error means that the client is gone.
        let _ = reply.wait();
    }
}

/// What comes in from others.
#[derive(Debug)]
pub enum RosInput {
    /// A request to a service.
    Request(ServiceRequest),
    /// A velocity for a robot.
    Velocity {
        /// The robot.
        robot: EntityId,
        /// What it is asked for.
        velocity: Velocity,
    },
    /// A place for a robot.
    Goal {
        /// The robot.
        robot: EntityId,
        /// Where it should go.
        goal: GoalPose,
    },
    /// A trajectory for an arm.
    Trajectory {
        /// The number of its chain.
        arm: EntityId,
        /// Where its joints should go.
        trajectory: JointTrajectory,
    },
}

/// A message and its attachment as they were sent.
type SentMessage = (Vec<u8>, Vec<u8>);

/// What late ones get of a latched topic.
struct History {
    last: Arc<Mutex<Option<SentMessage>>>,
    _queryable: Queryable<()>,
    /// By it those who are there already notice a new topic with a history.
    _token: LivelinessToken,
}

fn lock(last: &Mutex<Option<SentMessage>>) -> MutexGuard<'_, Option<SentMessage>> {
    last.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The publisher of a topic.
struct Publisher {
    key: KeyExpr<'static>,
    type_name: &'static str,
    gid: Gid,
    /// Number of messages sent.
    sent: i64,
    history: Option<History>,
    _token: LivelinessToken,
}

/// The subscription of a topic.
struct Subscription {
    name: String,
    type_name: &'static str,
    _subscriber: Subscriber<()>,
    _token: LivelinessToken,
}

/// The server of a service.
struct Server {
    name: String,
    _queryable: Queryable<()>,
    _token: LivelinessToken,
}

/// A node of ROS 2.
pub struct RosNode {
    name: RosNodeName,
    publishers: BTreeMap<String, Publisher>,
    servers: Vec<Server>,
    subscriptions: Vec<Subscription>,
    /// Number of topics and services that have had a token.
    endpoints: u32,
    /// What comes in, in its order.
    inputs: Receiver<RosInput>,
    input_sender: Sender<RosInput>,
    /// Number of requests and messages that were none.
    malformed: Arc<AtomicU64>,
    _token: LivelinessToken,
    session: Session,
}

impl fmt::Debug for RosNode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RosNode").field("name", &self.name).finish_non_exhaustive()
    }
}

/// The time that the first connection to a router may take.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

impl RosNode {
    /// Joins the network as the job of a run says, with its services and no topics yet.
    ///
    /// # Errors
    /// When an endpoint cannot be bound, or no router answers.
    pub fn join(job: &Ros2Job) -> Result<Self, WireSetupError> {
        let network = RosNetwork {
            domain: job.domain,
            namespace: job.namespace.clone(),
            distribution: job.distribution,
            listen: job.listen.clone(),
            connect: job.connect.clone(),
        };
        let mut node = Self::open(&network, NODE_NAME)?;
        for service in RunService::ALL {
            let server = node.serve(service)?;
            node.servers.push(server);
        }
        Ok(node)
    }

    /// Joins a network as a node with a name and no topics or services yet.
    ///
    /// # Errors
    /// When an endpoint cannot be bound, or no router answers.
    pub fn open(network: &RosNetwork, name: &str) -> Result<Self, WireSetupError> {
        let session = open_ros2_session(&network.listen, &network.connect, CONNECT_TIMEOUT)?;
        let name = RosNodeName {
            domain: network.domain,
            namespace: network.namespace.clone(),
            name: name.into(),
            distribution: network.distribution,
            session: session.zid().to_string(),
        };
        let token = declare_token(&session, name.node_token())?;
        let (input_sender, inputs) = channel();
        Ok(Self {
            name,
            publishers: BTreeMap::new(),
            servers: Vec::new(),
            subscriptions: Vec::new(),
            endpoints: 0,
            inputs,
            input_sender,
            malformed: Arc::default(),
            _token: token,
            session,
        })
    }

    /// Returns the full name of a topic: one without a slash at its beginning is of the namespace of the node.
    pub fn resolve(&self, topic: &str) -> String {
        self.name.resolve(topic)
    }

    /// Returns the full name of the node.
    pub fn full_name(&self) -> String {
        self.name.full_name()
    }

    /// Listens to a topic by its full name, and calls `on_message` with the bytes of each message. A latched topic brings
    /// the messages before this, too.
    ///
    /// # Errors
    /// When the session is closed, or the type is not one of [`super::types`].
    pub fn subscribe(
        &mut self,
        topic: &str,
        type_name: &str,
        quality: QualityOfService,
        on_message: impl Fn(&[u8]) + Send + Sync + Clone + 'static,
    ) -> Result<(), WireSetupError> {
        let ros_type = known_type(type_name)?;
        let kind = EndpointKind::Subscription;
        let endpoint = RosEndpoint { kind, name: topic.into(), ros_type, quality };
        let key = self.name.data_key(&endpoint);
        let on_sample = on_message.clone();
        let declared = self.session.declare_subscriber(key.clone()).callback(move |sample| {
            on_sample(&sample.payload().to_bytes());
        });
        let subscriber = declared.wait().map_err(|error| closed_session(&*error))?;
        let token = self.next_token(&endpoint);
        let token = declare_token(&self.session, token)?;
        self.subscriptions.push(Subscription {
            name: topic.into(),
            type_name: ros_type.name,
            _subscriber: subscriber,
            _token: token,
        });
        if !quality.is_latched {
            return Ok(());
        }
        let history = self.session.get(format!("{key}/@adv/pub/**"));
        let history = history.accept_replies(ReplyKeyExpr::Any).callback(move |reply| {
            if let Ok(sample) = reply.result() {
                on_message(&sample.payload().to_bytes());
            }
        });
        history.wait().map_err(|error| closed_session(&*error))
    }

    /// Returns what the node shows by now.
    pub fn graph(&self) -> RosGraph {
        let mut topics = BTreeMap::new();
        for (name, topic) in &self.publishers {
            topics.insert(name.clone(), topic.type_name.to_string());
        }
        for subscription in &self.subscriptions {
            topics.insert(subscription.name.clone(), subscription.type_name.to_string());
        }
        let services = self.servers.iter();
        RosGraph {
            node: self.name.full_name(),
            topics: topics.into_iter().collect(),
            services: services.map(|server| (server.name.clone(), TRIGGER.name.into())).collect(),
        }
    }

    /// Sends a message. The first one of a topic makes the topic known.
    ///
    /// # Errors
    /// When the session is closed, or the type is not one of [`super::types`].
    pub fn publish(&mut self, message: &RosMessage) -> Result<(), WireSetupError> {
        let topic = self.topic_name(&message.topic);
        self.publish_as(&topic, message)
    }

    /// Sends a message to a topic by its full name.
    ///
    /// # Errors
    /// Those of [`Self::publish`].
    pub fn publish_as(&mut self, topic: &str, message: &RosMessage) -> Result<(), WireSetupError> {
        if !self.publishers.contains_key(topic) {
            let publisher = self.declare_publisher(topic, message)?;
            self.publishers.insert(topic.into(), publisher);
        }
        let Some(publisher) = self.publishers.get_mut(topic) else { return Ok(()) };
        publisher.sent += 1;
        let attachment = Attachment {
            sequence_number: publisher.sent,
            source_time_ns: wall_clock_ns(),
            gid: publisher.gid,
        };
        let attachment = attachment.to_bytes();
        if let Some(history) = &publisher.history {
            *lock(&history.last) = Some((message.bytes.clone(), attachment.to_vec()));
        }
        let put = self.session.put(&publisher.key, message.bytes.clone()).attachment(attachment);
        put.wait().map_err(|error| closed_session(&*error))
    }

    /// Hears velocities for a robot from now on.
    ///
    /// # Errors
    /// When the session is closed.
    pub fn hear_velocities(&mut self, robot: EntityId) -> Result<(), WireSetupError> {
        let topic = format!("robot_{robot}/cmd_vel");
        self.hear(&topic, TWIST_NAME, move |bytes| {
            let velocity = Velocity::from_twist(bytes)?;
            Some(RosInput::Velocity { robot, velocity })
        })
    }

    /// Hears goals for a robot from now on.
    ///
    /// # Errors
    /// When the session is closed.
    pub fn hear_goals(&mut self, robot: EntityId) -> Result<(), WireSetupError> {
        let topic = format!("robot_{robot}/goal_pose");
        self.hear(&topic, PoseStamped::NAME, move |bytes| {
            let goal = GoalPose::from_pose_stamped(bytes)?;
            Some(RosInput::Goal { robot, goal })
        })
    }

    /// Hears trajectories for an arm, by the number of its chain, from now on.
    ///
    /// # Errors
    /// When the session is closed.
    pub fn hear_trajectories(&mut self, arm: EntityId) -> Result<(), WireSetupError> {
        let topic = format!("chain_{arm}/joint_trajectory");
        self.hear(&topic, JointTrajectory::NAME, move |bytes| {
            let trajectory = read_trajectory(bytes)?;
            Some(RosInput::Trajectory { arm, trajectory })
        })
    }

    /// Hears a topic of the namespace from now on; bytes that `read` does not know are counted.
    fn hear(
        &mut self,
        topic: &str,
        type_name: &str,
        read: impl Fn(&[u8]) -> Option<RosInput> + Send + Sync + Clone + 'static,
    ) -> Result<(), WireSetupError> {
        let inputs = self.input_sender.clone();
        let malformed = self.malformed.clone();
        let topic = self.resolve(topic);
        self.subscribe(&topic, type_name, QualityOfService::DEFAULT, move |bytes| {
            let Some(input) = read(bytes) else {
                malformed.fetch_add(1, Ordering::Relaxed);
                return;
            };
            // An error means that the node has ended.
            let _ = inputs.send(input);
        })
    }

    /// Returns what has come in next; waits for it at most the given time.
    pub fn next_input(&self, within: Duration) -> Option<RosInput> {
        // An error means that nothing has come in time: the node itself keeps a sender.
        self.inputs.recv_timeout(within).ok()
    }

    /// Returns the number of requests and messages so far that were none: requests without a proper attachment, and what
    /// is no CDR of its type.
    pub fn malformed_inputs(&self) -> u64 {
        self.malformed.load(Ordering::Relaxed)
    }

    /// Leaves the network: the others see that the node and all that it had is gone.
    pub fn leave(self) {
        let Self { publishers, servers, subscriptions, session, .. } = self;
        drop(publishers);
        drop(servers);
        drop(subscriptions);
        // An error means that it is closed already.
        let _ = session.close().wait();
    }

    /// Returns the full name of a topic. Clock and frames are one for a whole domain: programs of ROS look for them nowhere
    /// else.
    fn topic_name(&self, topic: &str) -> String {
        use sidestep_session::ros::{CLOCK_TOPIC, STATIC_TF_TOPIC, TF_TOPIC};
        match topic {
            CLOCK_TOPIC | TF_TOPIC | STATIC_TF_TOPIC => topic.into(),
            _ => self.name.resolve(topic.trim_start_matches('/')),
        }
    }

    fn next_token(&mut self, endpoint: &RosEndpoint) -> String {
        self.endpoints += 1;
        self.name.endpoint_token(endpoint, self.endpoints)
    }

    fn declare_publisher(
        &mut self,
        topic: &str,
        message: &RosMessage,
    ) -> Result<Publisher, WireSetupError> {
        let ros_type = known_type(message.type_name)?;
        let quality = match () {
            () if message.is_latched => QualityOfService::LATCHED,
            () if topic == sidestep_session::ros::TF_TOPIC => {
                QualityOfService { depth: TF_DEPTH, ..QualityOfService::DEFAULT }
            }
            () => QualityOfService::DEFAULT,
        };
        let kind = EndpointKind::Publisher;
        let endpoint = RosEndpoint { kind, name: topic.into(), ros_type, quality };
        let token = self.next_token(&endpoint);
        let key = KeyExpr::try_from(self.name.data_key(&endpoint)).map_err(|e| bad_key(&*e))?;
        let history = if message.is_latched {
            Some(self.declare_history(&endpoint, key.clone())?)
        } else {
            None
        };
        Ok(Publisher {
            key,
            type_name: message.type_name,
            gid: gid_of_token(&token),
            sent: 0,
            history,
            // Last: whoever sees the token may ask at once.
            _token: declare_token(&self.session, token)?,
        })
    }

    fn declare_history(
        &self,
        endpoint: &RosEndpoint,
        key: KeyExpr<'static>,
    ) -> Result<History, WireSetupError> {
        let at = self.name.history_key(endpoint);
        let last: Arc<Mutex<Option<SentMessage>>> = Arc::default();
        let answers = last.clone();
        let queryable = self.session.declare_queryable(at.clone()).callback(move |query| {
            let sent = lock(&answers).clone();
            if let Some((bytes, attachment)) = sent {
                // An error means that the other one is gone, or allows no replies with the key of the topic.
                let _ = query.reply(key.clone(), bytes).attachment(attachment).wait();
            }
        });
        let queryable = queryable.wait().map_err(|error| closed_session(&*error))?;
        let token = declare_token(&self.session, at)?;
        Ok(History { last, _queryable: queryable, _token: token })
    }

    fn serve(&mut self, service: RunService) -> Result<Server, WireSetupError> {
        let name = self.name.resolve_private(service.name());
        let endpoint = RosEndpoint {
            kind: EndpointKind::Service,
            name: name.clone(),
            ros_type: TRIGGER,
            quality: QualityOfService::DEFAULT,
        };
        let inputs = self.input_sender.clone();
        let malformed = self.malformed.clone();
        let key = self.name.data_key(&endpoint);
        // Complete: clients ask only servers that can answer everything on their key.
        let queryable = self.session.declare_queryable(key).complete(true).callback(move |query| {
            let attachment = query.attachment().map(|bytes| bytes.to_bytes());
            let attachment = attachment.and_then(|bytes| Attachment::from_bytes(&bytes));
            let is_cdr = query.payload().is_none_or(|bytes| is_plain_cdr(&bytes.to_bytes()));
            let Some(attachment) = attachment.filter(|_| is_cdr) else {
                malformed.fetch_add(1, Ordering::Relaxed);
                return;
            };
            // An error means that the node has ended.
            let request = ServiceRequest { service, query, attachment };
            let _ = inputs.send(RosInput::Request(request));
        });
        let queryable = queryable.wait().map_err(|error| closed_session(&*error))?;
        let token = self.next_token(&endpoint);
        let token = declare_token(&self.session, token)?;
        Ok(Server { name, _queryable: queryable, _token: token })
    }
}

/// Returns whether bytes begin as plain CDR does, in either byte order. The request itself has no content: ROS puts one
/// byte into it, because its languages have no empty structures.
fn is_plain_cdr(bytes: &[u8]) -> bool {
    matches!(bytes, [0, 0 | 1, ..]) && bytes.len() >= 4
}

fn known_type(name: &str) -> Result<RosType, WireSetupError> {
    message_type(name).ok_or_else(|| closed_session(&format!("the type {name} has no hash here")))
}

fn declare_token(session: &Session, key: String) -> Result<LivelinessToken, WireSetupError> {
    let declared = session.liveliness().declare_token(key).wait();
    declared.map_err(|error| closed_session(&*error))
}

fn bad_key(error: &dyn fmt::Display) -> WireSetupError {
    closed_session(&format!("a name is no key of Zenoh: {error}"))
}

fn closed_session(error: &dyn fmt::Display) -> WireSetupError {
    let reason = without_sources(&error.to_string());
    WireSetupError::NoAnswer { endpoint: "the network of ROS 2".into(), reason }
}

/// Returns the time of this machine, nanoseconds since 1970: by it others know how old a message is. No result depends
/// on it.
fn wall_clock_ns() -> i64 {
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
    since_1970.map_or(0, |since| i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}
