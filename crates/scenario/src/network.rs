//! The section of a network that may lose and delay messages: the same keys in every world with agents that
//! communicate.
//!
//! A world defines the notation of its agents in the lists of faults, and the agents that exist ([`AgentNaming`]).

use super::number::{Fraction, NonNegative, Number, Positive, RightOpen, Rule};
use super::schema;
use super::spanned::Spanned;
use schemars::{JsonSchema, Schema};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use sidestep_kernel::EntityId;
use sidestep_kernel::network::{
    GilbertElliott, Network, NetworkPartition, RadioBudget, RadioOutage, TimeWindow,
    UnidirectionalLink,
};
use std::fmt::Debug;
use std::marker::PhantomData;
use std::ops::Range;

/// The names of a world's agents in its network's section, and the defaults there.
pub trait AgentNaming {
    /// A radio outage as the file has it, with an agent in the world's own notation.
    type RadioOutage: DeserializeOwned + JsonSchema + Debug;
    /// A partition as the file has it, with sides in the world's own notation.
    type Partition: DeserializeOwned + JsonSchema + Debug;
    /// A link that works in one direction, as in the file.
    type UnidirectionalLink: DeserializeOwned + JsonSchema + Debug;

    /// Latency unless it is given, seconds.
    const DEFAULT_LATENCY_S: f64;
    /// The shortest latency that the world's clock can resolve, seconds.
    const MIN_LATENCY_S: f64;
    /// Number of conversations in a cycle: one follows the other, so they share its time.
    const CONVERSATIONS_PER_CYCLE: u32;
    /// Words for the longest deadline.
    const MAX_DEADLINE_TEXT: &str;

    /// Whether agents share one radio channel; they are wired otherwise.
    const SHARES_RADIO: bool = false;

    /// Returns the number of agents that share one radio channel; none in a world where agents are wired.
    fn radio_senders(&self) -> Option<u32> {
        None
    }

    /// Returns a radio outage by its agent's id on the network.
    ///
    /// # Errors
    /// When there is no such agent, or the times are impossible.
    fn radio_outage(&self, section: &Self::RadioOutage) -> Result<RadioOutage, SectionError>;

    /// Returns a partition by its agents' ids on the network.
    ///
    /// # Errors
    /// When there are no such agents or sides, or the times are impossible.
    fn partition(&self, section: &Self::Partition) -> Result<NetworkPartition, SectionError>;

    /// Returns a link by its agents' ids on the network.
    ///
    /// # Errors
    /// When there is no such link, or the times are impossible.
    fn unidirectional_link(
        &self,
        section: &Self::UnidirectionalLink,
    ) -> Result<UnidirectionalLink, SectionError>;
}

/// An error without the text's place, which the world's compiler adds.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionError {
    /// Its position in the text; none for the section itself.
    pub span: Option<Range<usize>>,
    /// The cause, in the words of the final error.
    pub cause: String,
    /// The remedy, in the words of the final error.
    pub remedy: String,
}

impl SectionError {
    /// Returns an error of the section as a whole, which no single fault causes.
    pub fn new(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { span: None, cause: cause.into(), remedy: remedy.into() }
    }
}

/// The section of a network.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, bound = "N: AgentNaming")]
#[schemars(rename = "NetworkSection", bound = "N: AgentNaming")]
#[schemars(transform = remove_radio_keys::<N>)]
pub struct NetworkSection<N: AgentNaming> {
    loss: Option<LossProbability>,
    duplication: Option<LossProbability>,
    latency_s: Option<Number<LatencyRule<N>>>,
    max_delay_s: Option<NonNegative>,
    patience_s: Option<Positive>,
    deadline_s: Option<Positive>,
    bandwidth_bit_s: Option<Number<BandwidthRule>>,
    /// Bytes per second that one radio channel carries for all agents together, headers and signatures included; each has an
    /// equal share. Unlimited unless given.
    budget_bytes_s: Option<Positive>,
    range_m: Option<Positive>,
    bursts: Option<BurstsSection>,
    silent: Vec<Spanned<N::RadioOutage>>,
    partitions: Vec<Spanned<N::Partition>>,
    one_way: Vec<Spanned<N::UnidirectionalLink>>,
}

/// Removes the keys of a radio channel from the schema of a world that has none, in which they are errors.
fn remove_radio_keys<N: AgentNaming>(schema: &mut Schema) {
    let properties = schema.get_mut("properties").and_then(Value::as_object_mut);
    if let Some(properties) = properties.filter(|_| !N::SHARES_RADIO) {
        properties.remove("budget_bytes_s");
    }
}

impl<N: AgentNaming> Default for NetworkSection<N> {
    fn default() -> Self {
        Self {
            loss: None,
            duplication: None,
            latency_s: None,
            max_delay_s: None,
            patience_s: None,
            deadline_s: None,
            bandwidth_bit_s: None,
            budget_bytes_s: None,
            range_m: None,
            bursts: None,
            silent: Vec::new(),
            partitions: Vec::new(),
            one_way: Vec::new(),
        }
    }
}

#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct BurstsSection {
    /// Probability of a loss within a burst.
    loss: Fraction,
    /// Mean length of a burst.
    lasts_s: Positive,
    /// Mean time between two bursts.
    every_s: Positive,
}

impl BurstsSection {
    fn bursts(&self) -> GilbertElliott {
        let Self { loss, lasts_s, every_s } = self;
        GilbertElliott { loss: loss.get(), mean_burst_s: lasts_s.get(), mean_gap_s: every_s.get() }
    }
}

/// A probability below 1, because some messages must get through in the end.
type LossProbability = Number<RightOpen<0, 1>>;

/// A time that the clock of a world can resolve.
#[derive(Debug)]
struct LatencyRule<N>(PhantomData<N>);

impl<N> Clone for LatencyRule<N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<N> Copy for LatencyRule<N> {}

impl<N: AgentNaming> Rule for LatencyRule<N> {
    fn allows(number: f64) -> bool {
        number >= N::MIN_LATENCY_S && number.is_finite()
    }

    fn description() -> String {
        format!("at least {:e} s", N::MIN_LATENCY_S)
    }

    fn limits() -> Value {
        json!({ "minimum": N::MIN_LATENCY_S })
    }
}

/// A bandwidth that carries a message in the time of a run.
#[derive(Debug, Clone, Copy)]
struct BandwidthRule;

impl Rule for BandwidthRule {
    fn allows(number: f64) -> bool {
        number >= 1.0
    }

    fn description() -> String {
        "at least 1 bit/s".into()
    }

    fn limits() -> Value {
        schema::with_infinity(json!({ "minimum": 1 }))
    }
}

/// Fraction of a cycle after which its conversations end, unless it is given: the rest is left for acting on their
/// result.
const CONVERSATION_FRACTION: f64 = 0.9;
/// Waits for an answer that fit into a conversation at least: with fewer, one lost message could end it.
const MIN_WAITS_PER_CONVERSATION: f64 = 8.0;

impl<N: AgentNaming> NetworkSection<N> {
    /// Returns the network, in a world with cycles of `dt_s` seconds.
    ///
    /// # Errors
    /// When times do not fit into a cycle, or a fault is impossible: the first one of these.
    pub fn network(&self, dt_s: f64, names: &N) -> Result<Network, SectionError> {
        let latency_s = self.latency_s.map_or(N::DEFAULT_LATENCY_S, f64::from);
        let max_delay_s = self.max_delay_s.map_or(0.0, f64::from);
        let deadline_s = CONVERSATION_FRACTION / f64::from(N::CONVERSATIONS_PER_CYCLE) * dt_s;
        let network = Network {
            loss: self.loss.map_or(0.0, f64::from),
            duplication: self.duplication.map_or(0.0, f64::from),
            latency_s,
            bandwidth_bit_s: self.bandwidth_bit_s.map_or(f64::INFINITY, f64::from),
            budget: None,
            max_delay_s,
            // A request and its answer take twice the latency and the delay; 3 leaves room for the answer's work.
            patience_s: self.patience_s.map_or(3.0 * (latency_s + max_delay_s), f64::from),
            deadline_s: self.deadline_s.map_or(deadline_s, f64::from),
            range_m: self.range_m.map_or(f64::INFINITY, f64::from),
            bursts: self.bursts.as_ref().map(BurstsSection::bursts),
            radio_outages: Vec::new(),
            partitions: Vec::new(),
            unidirectional_links: Vec::new(),
        };
        check_times::<N>(&network, dt_s)?;
        Ok(Network {
            budget: self.budget(names, network.deadline_s)?,
            radio_outages: read_faults(&self.silent, |section| names.radio_outage(section))?,
            partitions: read_faults(&self.partitions, |section| names.partition(section))?,
            unidirectional_links: read_faults(&self.one_way, |section| {
                names.unidirectional_link(section)
            })?,
            ..network
        })
    }
}

impl<N: AgentNaming> NetworkSection<N> {
    /// Returns the radio's budget, if there is one, which must let each agent send something in a conversation.
    fn budget(&self, names: &N, deadline_s: f64) -> Result<Option<RadioBudget>, SectionError> {
        let Some(bytes_s) = self.budget_bytes_s.map(f64::from) else { return Ok(None) };
        let Some(senders) = names.radio_senders() else {
            let cause = "budget_bytes_s, but the agents of this world share no radio channel";
            let remedy = "leave it out; bandwidth_bit_s limits each link";
            return Err(SectionError::new(cause, remedy));
        };
        let min_bytes_s = RadioBudget::min_bytes_s(senders, deadline_s);
        // A tick is lost at both ends of a conversation, so that the bound itself carries nothing.
        if bytes_s <= min_bytes_s {
            let cause = format!(
                "budget_bytes_s = {bytes_s}, of which each of {senders} agents has an equal share: no message can be \
                 sent in deadline_s = {deadline_s}"
            );
            let remedy = format!("give more than {} bytes/s", min_bytes_s.ceil());
            return Err(SectionError::new(cause, remedy));
        }
        Ok(Some(RadioBudget { bytes_s, senders }))
    }
}

/// Reads a list of faults, each by `read`; errors get the position of the fault.
fn read_faults<A, B>(
    sections: &[Spanned<A>],
    read: impl Fn(&A) -> Result<B, SectionError>,
) -> Result<Vec<B>, SectionError> {
    let mut faults = Vec::with_capacity(sections.len());
    for section in sections {
        let fault = read(section.get_ref())
            .map_err(|error| SectionError { span: Some(section.span()), ..error })?;
        faults.push(fault);
    }
    Ok(faults)
}

/// Checks that times fit into a cycle.
fn check_times<N: AgentNaming>(network: &Network, dt_s: f64) -> Result<(), SectionError> {
    let &Network { latency_s, max_delay_s, patience_s, deadline_s, .. } = network;
    let wait_s = patience_s.max(latency_s + max_delay_s);
    let fits_cycle = f64::from(N::CONVERSATIONS_PER_CYCLE) * deadline_s <= dt_s;
    if fits_cycle && MIN_WAITS_PER_CONVERSATION * wait_s <= deadline_s {
        return Ok(());
    }
    let cause = format!(
        "latency_s = {latency_s}, max_delay_s = {max_delay_s}, patience_s = {patience_s}, \
         deadline_s = {deadline_s}"
    );
    let remedy = format!(
        "give a patience of at most an eighth of the deadline, latency and delay of no more, and a \
         deadline of {}",
        N::MAX_DEADLINE_TEXT
    );
    Err(SectionError::new(cause, remedy))
}

/// Returns a period from its two times.
///
/// # Errors
/// When its times are invalid.
pub fn time_window(from_s: f64, until_s: f64) -> Result<TimeWindow, SectionError> {
    if from_s >= 0.0 && from_s.is_finite() && until_s > from_s {
        return Ok(TimeWindow { from_s, until_s });
    }
    let cause = format!("from_s = {from_s}, until_s = {until_s}");
    Err(SectionError::new(cause, "give times in seconds from 0 on, the end after the start"))
}

/// Checks the sides of a partition; `agent` is the word for its agents.
///
/// # Errors
/// When an agent is on two sides, or there are fewer than two sides.
pub fn check_sides(sides: &[Vec<EntityId>], agent: &str) -> Result<(), SectionError> {
    check_unique(sides.concat(), agent)?;
    if sides.len() >= 2 {
        return Ok(());
    }
    let remedy = "give at least two, e.g. sides = [[0, 2], [1, 3]]";
    Err(SectionError::new("a partition with fewer than two sides", remedy))
}

/// Checks that no agent is given twice.
///
/// # Errors
/// For the lowest id that is.
pub fn check_unique(mut ids: Vec<EntityId>, agent: &str) -> Result<(), SectionError> {
    ids.sort_unstable();
    match ids.windows(2).find(|pair| pair[0] == pair[1]) {
        None => Ok(()),
        Some(pair) => {
            let cause = format!("{agent} {} is listed twice", pair[0]);
            Err(SectionError::new(cause, format!("name each {agent} once")))
        }
    }
}

/// The end of a period without an end, in seconds; a function, because serde takes defaults from functions.
pub fn endless_s() -> f64 {
    f64::INFINITY
}
