//! The connection to an MQTT broker: messages in, messages out, and again after it was lost.

use rumqttc::{Client, ConnectReturnCode, Connection, Event, MqttOptions, Packet, QoS};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::sleep;
use std::time::Duration;

/// The port of brokers (IANA).
const DEFAULT_PORT: u16 = 1883;

/// Environment variable with the password, where the broker asks for one: command lines are seen by others.
pub const PASSWORD_VARIABLE: &str = "SIDESTEP_MQTT_PASSWORD";

/// Time without a message after which both ends of a connection check that the other one is there.
const KEEP_ALIVE: Duration = Duration::from_secs(10);

/// Time after a lost connection before the next attempt.
const RETRY_DELAY: Duration = Duration::from_millis(500);

/// Longest packet in bytes that is read; longer ones end the connection. Messages above a sixteenth of it are dropped and
/// counted without that.
const MAX_PACKET_BYTES: usize = 16 << 20;

/// Messages that wait for the master control, before the broker has to wait: one of each of a thousand vehicles.
const QUEUE: usize = 1000;

/// Messages that wait to be sent, above those of all vehicles.
const SPARE_REQUESTS: usize = 64;

/// Where a broker is, and who asks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BrokerAddress {
    /// Name or address of its machine.
    pub host: String,
    /// Its port.
    pub port: u16,
    /// The name under which it knows the master control, where it asks for one.
    pub user: Option<String>,
}

impl BrokerAddress {
    /// Reads `mqtt://[USER@]HOST[:PORT]`.
    ///
    /// # Errors
    /// With what is wrong.
    pub fn parse(text: &str) -> Result<Self, String> {
        let form = "give mqtt://HOST:PORT, as in mqtt://127.0.0.1:1883";
        let Some(rest) = text.strip_prefix("mqtt://") else {
            return Err(format!("it does not begin with mqtt://: {form}"));
        };
        let rest = rest.strip_suffix('/').unwrap_or(rest);
        let at = rest.rsplit_once('@');
        let user = at.map(|(user, _)| user.to_string());
        if user.as_ref().is_some_and(|user| user.contains(':')) {
            return Err(format!("a password is seen by others there: set {PASSWORD_VARIABLE}"));
        }
        let address = at.map_or(rest, |(_, address)| address);
        let split = split_port(address);
        let port = match split.1 {
            None => DEFAULT_PORT,
            Some(port) => port.parse().map_err(|_| format!("`{port}` is no port: {form}"))?,
        };
        let host = split.0.trim_start_matches('[').trim_end_matches(']');
        if host.is_empty() || port == 0 || host.contains('/') {
            return Err(format!("it has no host or no port: {form}"));
        }
        Ok(Self { host: host.to_string(), port, user })
    }
}

/// Returns host and port; an IPv6 address is written between brackets.
fn split_port(address: &str) -> (&str, Option<&str>) {
    match address.rsplit_once(':') {
        Some((host, port)) if !port.ends_with(']') => (host, Some(port)),
        _ => (address, None),
    }
}

/// What has come from a broker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BrokerEvent {
    /// It has accepted the connection; the topics are asked for.
    Connected,
    /// The connection was lost, or could not be made; it is tried again.
    Lost(String),
    /// A message.
    Message {
        /// Its topic.
        topic: String,
        /// Its bytes.
        payload: Vec<u8>,
    },
}

/// A broker, as seen by a master control.
pub struct Broker {
    client: Client,
    events: Receiver<BrokerEvent>,
    topics: [String; 2],
    is_connected: bool,
}

impl Broker {
    /// Connects to a broker, under a name that no other client of it has.
    /// `topics` are those to listen to.
    pub fn connect(
        address: &BrokerAddress,
        name: &str,
        topics: [String; 2],
        vehicles: usize,
    ) -> Self {
        let mut options = MqttOptions::new(name, &address.host, address.port);
        options.set_keep_alive(KEEP_ALIVE);
        options.set_max_packet_size(MAX_PACKET_BYTES, MAX_PACKET_BYTES);
        if let Some(user) = &address.user {
            let password = std::env::var(PASSWORD_VARIABLE).unwrap_or_default();
            options.set_credentials(user, password);
        }
        let made = Client::new(options, vehicles + SPARE_REQUESTS);
        let connection = made.1;
        let (sender, events) = sync_channel(QUEUE);
        std::thread::spawn(move || forward(connection, &sender));
        Self { client: made.0, events, topics, is_connected: false }
    }

    /// Returns the next event, if one comes within a time.
    pub fn next(&mut self, timeout: Duration) -> Option<BrokerEvent> {
        match self.events.recv_timeout(timeout) {
            Ok(event) => {
                match event {
                    BrokerEvent::Connected => {
                        self.is_connected = true;
                        self.subscribe();
                    }
                    BrokerEvent::Lost(_) => self.is_connected = false,
                    BrokerEvent::Message { .. } => {}
                }
                Some(event)
            }
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                // The thread has ended, which it does only when this is gone.
                sleep(timeout);
                None
            }
        }
    }

    /// Asks for the topics of all vehicles. The broker answers with the last `connection` of each.
    fn subscribe(&self) {
        for topic in &self.topics {
            // The quality with which vehicles send: once at most for states, at least once for connections.
            if let Err(error) = self.client.try_subscribe(topic, QoS::AtLeastOnce) {
                tracing::error!("cannot ask for {topic}: {error}");
            }
        }
    }

    /// Sends a message, once at most as the standard asks (VDA 5050, 6.2); one that is lost is sent again by the master
    /// control. Returns whether it could be sent.
    pub fn publish(&self, topic: &str, payload: String) -> bool {
        if !self.is_connected {
            // It would be old when it is sent.
            return false;
        }
        self.client.try_publish(topic, QoS::AtMostOnce, false, payload).is_ok()
    }

    /// Leaves the broker after what was sent, and waits until it is gone, for a time at most.
    pub fn disconnect(self, timeout: Duration) {
        if !self.is_connected || self.client.try_disconnect().is_err() {
            return;
        }
        // States that come meanwhile have no effect anymore.
        while let Ok(event) = self.events.recv_timeout(timeout) {
            if matches!(event, BrokerEvent::Lost(_)) {
                return;
            }
        }
    }
}

/// Hands over what comes from a broker, until nobody wants it anymore.
fn forward(mut connection: Connection, events: &SyncSender<BrokerEvent>) {
    for event in connection.iter() {
        let event = match event {
            Ok(Event::Incoming(Packet::ConnAck(ack))) if ack.code == ConnectReturnCode::Success => {
                BrokerEvent::Connected
            }
            Ok(Event::Incoming(Packet::Publish(message))) => {
                BrokerEvent::Message { topic: message.topic, payload: message.payload.to_vec() }
            }
            Ok(_) => continue,
            Err(error) => {
                sleep(RETRY_DELAY);
                BrokerEvent::Lost(error.to_string())
            }
        };
        if events.send(event).is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_a_host_and_may_have_a_port_and_a_user() {
        let parse = |text: &str| BrokerAddress::parse(text).expect(text);
        let address = |host: &str, port, user: Option<&str>| BrokerAddress {
            host: host.into(),
            port,
            user: user.map(str::to_string),
        };
        assert_eq!(parse("mqtt://127.0.0.1:7"), address("127.0.0.1", 7, None));
        assert_eq!(parse("mqtt://hall.example/"), address("hall.example", 1883, None));
        assert_eq!(parse("mqtt://[::1]"), address("::1", 1883, None));
        assert_eq!(parse("mqtt://me@[::1]:18"), address("::1", 18, Some("me")));
    }

    #[test]
    fn what_is_no_address_is_refused_with_the_form() {
        for (text, cause) in [
            ("127.0.0.1:1883", "mqtt://"),
            ("mqtts://127.0.0.1", "mqtt://"),
            ("mqtt://:7", "no host"),
            ("mqtt://a:b", "no port"),
            ("mqtt://a:0", "no port"),
            ("mqtt://me:secret@a:7", PASSWORD_VARIABLE),
        ] {
            let error = BrokerAddress::parse(text).expect_err(text);
            assert!(error.contains(cause), "{text}: {error}");
        }
    }
}
