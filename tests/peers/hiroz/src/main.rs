//! The other side of rosz in its tests: a node of hiroz that does what its standard input says.
//!
//! `hiroz-peer router ENDPOINT` is a router as hiroz configures it, `hiroz-peer hashes` prints the
//! hash of each type, and `hiroz-peer MODE ENDPOINT NODE` is a node that links to an endpoint as
//! `peer` or `client`. A node reads commands, one a line: a verb, its words, and perhaps a JSON
//! text to the end of the line. What happens it prints as lines of a verb, a name and a JSON text.

mod actions;
mod hashes;
mod topics;

use std::any::Any;
use std::collections::HashMap;
use std::io::{BufRead, Write};
use std::sync::Arc;
use std::time::Duration;

use hiroz::action::ClientGoalHandle;
use hiroz::config::{RouterConfigBuilder, SessionConfigBuilder};
use hiroz::context::ZContextBuilder;
use hiroz::entity::{EndpointKind, Entity};
use hiroz::error::is_timeout;
use hiroz::node::ZNode;
use hiroz::parameter::{
    Parameter, ParameterClient, ParameterDescriptor, ParameterTarget, ParameterValue,
    SetParametersResult,
};
use hiroz::service::{ZClient, ZServer};
use hiroz::{Builder, Result};
use hiroz_msgs::example_interfaces::srv::AddTwoInts;
use hiroz_msgs::example_interfaces::{AddTwoIntsRequest, AddTwoIntsResponse};
use serde_json::{Value, json};
use tokio::sync::mpsc;

const PATIENCE: Duration = Duration::from_secs(50);

/// Prints a line at once, whole even beside other threads.
pub fn say(verb: &str, name: &str, value: impl Into<Value>) {
    let mut out = std::io::stdout().lock();
    let written = writeln!(out, "{verb} {name} {}", value.into()).and_then(|()| out.flush());
    if written.is_err() {
        std::process::exit(1); // the test has ended
    }
}

/// A node and what was made on it, by name.
pub struct Peer {
    pub node: Arc<ZNode>,
    pub publishers: HashMap<String, topics::Publish>,
    pub goals: HashMap<String, Arc<ClientGoalHandle<actions::Fibonacci>>>,
    pub kept: Vec<Box<dyn Any + Send>>,
    clients: HashMap<String, Arc<ZClient<AddTwoInts>>>,
    parameters: HashMap<String, Arc<ParameterClient>>,
    context: hiroz::context::ZContext,
}

impl Peer {
    async fn obey(&mut self, line: &str) -> Result<()> {
        let mut words = line.split(' ');
        let verb = words.next().unwrap_or_default();
        let mut next = || words.next().unwrap_or_default();
        match verb {
            "echo" => topics::echo(self, next(), next(), next())?,
            "listen" => topics::listen(self, next(), next(), next())?,
            "publish" => topics::publish(self, line)?,
            "discover" => topics::discover(self, next()).await?,
            "topics" => {
                let count: usize = next().parse()?;
                for number in 0..count {
                    let topic = format!("/many/topic_{number}");
                    topics::listen(self, "std_msgs/msg/String", &topic, "")?;
                }
            }
            "serve" => self.serve(next())?,
            "call" => self.call(next(), next().parse()?, next().parse()?, next().parse()?)?,
            "act" => actions::act(self, next())?,
            "send_goal" => actions::send_goal(self, next(), next().parse()?).await?,
            "cancel" => actions::cancel(self, next()).await?,
            "declare" => self.declare(next(), next())?,
            "get" => {
                let name = next();
                say("value", name, value_to_json(self.node.get_parameter(name)));
            }
            "parameters" => self.ask_parameters(next(), next(), next()).await?,
            "graph" => self.print_graph(),
            _ => return Err(format!("unknown command: {line}").into()),
        }
        say("done", verb, Value::Null);
        Ok(())
    }

    /// Adds two numbers; a request whose first number is negative is never answered.
    fn serve(&mut self, name: &str) -> Result<()> {
        let mut server: ZServer<AddTwoInts> = self.node.create_service(name).build()?;
        tokio::spawn(async move {
            while let Ok(request) = server.async_take_request().await {
                let AddTwoIntsRequest { a, b } = *request.message();
                say("asked", "", json!([a, b]));
                if a >= 0 {
                    let response = AddTwoIntsResponse { sum: a + b };
                    request.reply(&response).await.expect("a reply");
                }
            }
        });
        Ok(())
    }

    fn call(&mut self, name: &str, a: i64, b: i64, milliseconds: u64) -> Result<()> {
        if !self.clients.contains_key(name) {
            let client = self.node.create_client::<AddTwoInts>(name).build()?;
            self.clients.insert(name.to_string(), Arc::new(client));
        }
        let client = self.clients[name].clone();
        let name = name.to_string();
        tokio::spawn(async move {
            let limit = Duration::from_millis(milliseconds);
            match client.call_with_timeout(&AddTwoIntsRequest { a, b }, limit).await {
                Ok(response) => say("answer", &name, response.sum),
                Err(error) if is_timeout(&*error) => say("late", &name, a),
                Err(error) => say("failed", &name, error.to_string()),
            }
        });
        Ok(())
    }

    /// Declares a parameter. Others may set numbers below 100 and anything else.
    fn declare(&mut self, name: &str, text: &str) -> Result<()> {
        let value = value_of_json(&serde_json::from_str(text)?);
        let descriptor = ParameterDescriptor::new(name, value.parameter_type());
        self.node.declare_parameter(name, value, descriptor)?;
        self.node.on_set_parameters(|parameters| {
            for parameter in parameters {
                say("set", &parameter.name, value_to_json(Some(parameter.value.clone())));
                if matches!(parameter.value, ParameterValue::Integer(number) if number >= 100) {
                    return SetParametersResult::failure("it is too large");
                }
            }
            SetParametersResult::success()
        });
        Ok(())
    }

    /// Uses one of the parameter services of another node; prints what came, or the error.
    async fn ask_parameters(&mut self, node: &str, verb: &str, text: &str) -> Result<()> {
        if !self.parameters.contains_key(node) {
            let target = ParameterTarget::from_fqn(node).ok_or("no name of a node")?;
            let client = ParameterClient::new(self.node.clone(), target)?;
            self.parameters.insert(node.to_string(), Arc::new(client));
        }
        let client = self.parameters[node].clone();
        let given: Value = serde_json::from_str(text)?;
        let names: Vec<&str> =
            given.as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let values = || -> Vec<Parameter> {
            let fields = given.as_object().into_iter().flatten();
            fields.map(|(name, value)| Parameter::new(name, value_of_json(value))).collect()
        };
        let asked = async {
            Result::Ok(match verb {
                "get" => {
                    client.get(&names).await?.into_iter().map(|v| value_to_json(Some(v))).collect()
                }
                "types" => client.get_types(&names).await?.into_iter().map(u8::from).collect(),
                "list" => json!(client.list(&names, None).await?.names),
                "describe" => {
                    let described = client.describe(&names).await?;
                    described
                        .iter()
                        .map(|d| json!([d.name, u8::from(d.type_), d.read_only]))
                        .collect()
                }
                "set" => {
                    let results = client.set(&values()).await?;
                    results.into_iter().map(|r| json!([r.successful, r.reason])).collect()
                }
                "set_atomically" => {
                    let result = client.set_atomically(&values()).await?;
                    json!([result.successful, result.reason])
                }
                _ => {
                    return Err(format!("unknown service {verb}").into());
                }
            })
        };
        let answer: Result<Value> = asked.await;
        match answer {
            Ok(value) => say("parameters", node, value),
            Err(error) => say("failed", node, error.to_string()),
        }
        Ok(())
    }

    fn print_graph(&self) {
        let graph = self.node.graph();
        let snapshot = graph.snapshot(self.context.domain_id());
        let mut endpoints = Vec::new();
        for topic in &snapshot.topics {
            for kind in [EndpointKind::Publisher, EndpointKind::Subscription] {
                for entity in graph.get_entities_by_topic(kind, &topic.name) {
                    if let Entity::Endpoint(end) = &*entity {
                        let info = end.type_info.as_ref();
                        endpoints.push(json!([
                            kind.to_string(),
                            end.topic,
                            end.node.as_ref().map(|node| &node.name),
                            info.map(|info| info.hash.to_rihs_string()),
                            end.qos.encode(),
                        ]));
                    }
                }
            }
        }
        let all = json!({
            "snapshot": snapshot,
            "endpoints": endpoints,
            "actions": graph.get_action_names_and_types(),
        });
        say("graph", "", all);
    }
}

fn value_of_json(value: &Value) -> ParameterValue {
    match value {
        Value::Bool(value) => ParameterValue::Bool(*value),
        Value::Number(number) => match number.as_i64() {
            Some(number) => ParameterValue::Integer(number),
            None => ParameterValue::Double(number.as_f64().unwrap_or_default()),
        },
        Value::String(text) => ParameterValue::String(text.clone()),
        Value::Array(items) if items.iter().all(Value::is_boolean) => {
            ParameterValue::BoolArray(items.iter().filter_map(Value::as_bool).collect())
        }
        Value::Array(items) if items.iter().all(Value::is_i64) => {
            ParameterValue::IntegerArray(items.iter().filter_map(Value::as_i64).collect())
        }
        Value::Array(items) if items.iter().all(Value::is_number) => {
            ParameterValue::DoubleArray(items.iter().filter_map(Value::as_f64).collect())
        }
        Value::Array(items) => {
            let texts = items.iter().filter_map(Value::as_str);
            ParameterValue::StringArray(texts.map(str::to_string).collect())
        }
        _ => ParameterValue::NotSet,
    }
}

fn value_to_json(value: Option<ParameterValue>) -> Value {
    match value {
        None | Some(ParameterValue::NotSet) => Value::Null,
        Some(ParameterValue::Bool(value)) => json!(value),
        Some(ParameterValue::Integer(value)) => json!(value),
        Some(ParameterValue::Double(value)) => json!(value),
        Some(ParameterValue::String(value)) => json!(value),
        Some(ParameterValue::ByteArray(value)) => json!(value),
        Some(ParameterValue::BoolArray(value)) => json!(value),
        Some(ParameterValue::IntegerArray(value)) => json!(value),
        Some(ParameterValue::DoubleArray(value)) => json!(value),
        Some(ParameterValue::StringArray(value)) => json!(value),
    }
}

async fn route(endpoint: &str) -> Result<()> {
    let config = RouterConfigBuilder::new()
        .with_override("listen/endpoints", json!([endpoint]), "the port of the test")
        .build_config()?;
    let router = zenoh::open(config).await?;
    say("ready", &router.zid().to_string(), Value::Null);
    let mut lines = commands();
    while lines.recv().await.is_some() {}
    Ok(())
}

/// Returns the lines of the standard input, which ends when the test does.
fn commands() -> mpsc::UnboundedReceiver<String> {
    let (lines, read) = mpsc::unbounded_channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(|line| line.ok()) {
            if lines.send(line).is_err() {
                break;
            }
        }
    });
    read
}

async fn run(mode: &str, endpoint: &str, name: &str) -> Result<()> {
    let config = SessionConfigBuilder::new()
        .with_router_endpoint(endpoint)
        .with_override("mode", json!(mode), "the test chooses")
        .build_config()?;
    let context = ZContextBuilder::default().with_zenoh_config(config).build()?;
    let (namespace, name) = name.rsplit_once('/').ok_or("the name of the node is not absolute")?;
    let node = context
        .create_node(name)
        .with_namespace(if namespace.is_empty() { "/" } else { namespace })
        .with_type_description_service()
        .build()?;
    let mut peer = Peer {
        context,
        node: Arc::new(node),
        publishers: HashMap::new(),
        goals: HashMap::new(),
        kept: Vec::new(),
        clients: HashMap::new(),
        parameters: HashMap::new(),
    };
    let mut lines = commands();
    say("ready", &peer.node.session().zid().to_string(), Value::Null);
    while let Some(line) = lines.recv().await {
        if let Err(error) = peer.obey(&line).await {
            say("error", "", format!("{line}: {error}"));
        }
    }
    Ok(())
}

#[tokio::main]
async fn main() -> Result<()> {
    zenoh::init_log_from_env_or("error");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["hashes"] => hashes::print(),
        ["router", endpoint] => route(endpoint).await?,
        [mode, endpoint, name] => run(mode, endpoint, name).await?,
        _ => return Err("expected: hashes | router ENDPOINT | MODE ENDPOINT NODE".into()),
    }
    Ok(())
}
