//! Topics of a few types, whose values go in and out as JSON.

use std::num::NonZeroUsize;

use hiroz::msg::{SerdeCdrSerdes, ZDeserializer, ZMessage};
use hiroz::qos::{QosDurability, QosHistory, QosProfile, QosReliability};
use hiroz::{Builder, MessageTypeInfo, Result, WithTypeInfo};
use hiroz_msgs::builtin_interfaces::Time;
use hiroz_msgs::geometry_msgs::Twist;
use hiroz_msgs::nav_msgs::Odometry;
use hiroz_msgs::rcl_interfaces::ParameterEvent;
use hiroz_msgs::sensor_msgs::{Image, JointState};
use hiroz_msgs::std_msgs::String as Text;
use hiroz_msgs::trajectory_msgs::JointTrajectory;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::{PATIENCE, Peer, say};

/// Publishes a JSON text.
pub type Publish = Box<dyn Fn(&str) -> Result<()> + Send>;

/// Longer messages are printed as their length only.
const LONGEST: usize = 10_000;

/// A message that goes both ways, and that JSON can tell.
trait Message:
    ZMessage<Serdes: Send + Sync + for<'a> ZDeserializer<Output = Self, Input<'a> = &'a [u8]>>
    + WithTypeInfo
    + Serialize
    + DeserializeOwned
{
}

impl<T> Message for T where
    T: ZMessage<Serdes: Send + Sync + for<'a> ZDeserializer<Output = T, Input<'a> = &'a [u8]>>
        + WithTypeInfo
        + Serialize
        + DeserializeOwned
{
}

/// A line of `/rosout`, which hiroz itself does not have.
#[derive(Clone, Debug, Default, Serialize, Deserialize, MessageTypeInfo)]
#[ros_msg(type_name = "rcl_interfaces/msg/Log")]
pub struct Log {
    stamp: Time,
    level: u8,
    name: String,
    msg: String,
    file: String,
    function: String,
    line: u32,
}

impl ZMessage for Log {
    type Serdes = SerdeCdrSerdes<Log>;
}

/// A type that no other program has a definition of.
#[derive(Clone, Debug, Default, Serialize, Deserialize, MessageTypeInfo)]
#[ros_msg(type_name = "peer_msgs/msg/Battery")]
pub struct Battery {
    stamp: Time,
    cells: Vec<f32>,
    limits: [f64; 2],
    name: String,
}

impl ZMessage for Battery {
    type Serdes = SerdeCdrSerdes<Battery>;
}

/// Calls a function with the type of a name.
macro_rules! of_type {
    ($name:expr, $function:ident($($argument:expr),*)) => {
        match $name {
            "std_msgs/msg/String" => $function::<Text>($($argument),*),
            "geometry_msgs/msg/Twist" => $function::<Twist>($($argument),*),
            "nav_msgs/msg/Odometry" => $function::<Odometry>($($argument),*),
            "peer_msgs/msg/Battery" => $function::<Battery>($($argument),*),
            "rcl_interfaces/msg/Log" => $function::<Log>($($argument),*),
            "rcl_interfaces/msg/ParameterEvent" => $function::<ParameterEvent>($($argument),*),
            "sensor_msgs/msg/Image" => $function::<Image>($($argument),*),
            "sensor_msgs/msg/JointState" => $function::<JointState>($($argument),*),
            "trajectory_msgs/msg/JointTrajectory" => $function::<JointTrajectory>($($argument),*),
            other => Err(format!("unknown type {other}").into()),
        }
    };
}

/// Returns a QoS by its words: `latched5`, `besteffort`, `keepall`, or nothing.
fn qos(words: &str) -> QosProfile {
    let mut qos = QosProfile::default();
    if let Some(depth) = words.strip_prefix("latched") {
        qos.durability = QosDurability::TransientLocal;
        qos.history = QosHistory::KeepLast(depth.parse().unwrap_or(NonZeroUsize::MIN));
    } else if words == "besteffort" {
        qos.reliability = QosReliability::BestEffort;
    } else if words == "keepall" {
        qos.history = QosHistory::KeepAll;
    }
    qos
}

fn print<T: Message>(topic: &str, message: &T) {
    let length = ZMessage::serialize(message).len();
    let shown = if length > LONGEST { json!(length) } else { json!(message) };
    say("heard", topic, shown);
}

pub fn listen(peer: &mut Peer, type_name: &str, topic: &str, words: &str) -> Result<()> {
    of_type!(type_name, listen_to(peer, topic, words))
}

fn listen_to<T: Message>(peer: &mut Peer, topic: &str, words: &str) -> Result<()> {
    let name = topic.to_string();
    let builder = peer.node.create_sub::<T>(topic).with_qos(qos(words));
    let subscription = builder.build_with_callback(move |message| print(&name, &message))?;
    peer.kept.push(Box::new(subscription));
    Ok(())
}

pub fn echo(peer: &mut Peer, type_name: &str, there: &str, back: &str) -> Result<()> {
    of_type!(type_name, echo_to(peer, there, back))
}

fn echo_to<T: Message>(peer: &mut Peer, there: &str, back: &str) -> Result<()> {
    let publisher = peer.node.create_pub::<T>(back).with_qos(qos("keepall")).build()?;
    let name = there.to_string();
    let builder = peer.node.create_sub::<T>(there).with_qos(qos("keepall"));
    let subscription = builder.build_with_callback(move |message: T| {
        print(&name, &message);
        publisher.publish(&message).expect("a publication");
    })?;
    peer.kept.push(Box::new(subscription));
    Ok(())
}

/// Publishes by `publish TYPE TOPIC QOS [JSON]`; the first time, it makes the publisher.
pub fn publish(peer: &mut Peer, line: &str) -> Result<()> {
    let mut parts = line.splitn(5, ' ').skip(1);
    let mut next = || parts.next().unwrap_or_default();
    let (type_name, topic, words, text) = (next(), next(), next(), next());
    if !peer.publishers.contains_key(topic) {
        let made = of_type!(type_name, publisher_of(peer, topic, words))?;
        peer.publishers.insert(topic.to_string(), made);
    }
    if text.is_empty() { Ok(()) } else { peer.publishers[topic](text) }
}

fn publisher_of<T: Message>(peer: &mut Peer, topic: &str, words: &str) -> Result<Publish> {
    let publisher = peer.node.create_pub::<T>(topic).with_qos(qos(words)).build()?;
    Ok(Box::new(move |text| publisher.publish(&serde_json::from_str::<T>(text)?)))
}

/// Asks the node that publishes for its type, and prints the fields and the next message.
pub async fn discover(peer: &mut Peer, topic: &str) -> Result<()> {
    let subscription = peer.node.create_dyn_sub_auto(topic, PATIENCE).await?;
    let schema = subscription.schema().map(|schema| format!("{schema:?}"));
    say("discovered", topic, json!(schema));
    let name = topic.to_string();
    tokio::spawn(async move {
        while let Ok(message) = subscription.async_recv().await {
            say("heard", &name, Value::String(format!("{message:?}")));
        }
    });
    Ok(())
}
