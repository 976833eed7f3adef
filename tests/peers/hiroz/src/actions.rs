//! The Fibonacci action of ROS 2's tutorials, as server and as client.

use std::sync::Arc;
use std::time::Duration;

use hiroz::action::ZAction;
use hiroz::action::server::ZActionServer;
use hiroz::entity::{TypeHash, TypeInfo};
use hiroz::prelude::{Executing, GoalStatus};
use hiroz::{Builder, Result};
use hiroz_msgs::action_tutorials_interfaces::action::Fibonacci as Generated;
use hiroz_msgs::action_tutorials_interfaces::{FibonacciFeedback, FibonacciGoal, FibonacciResult};
use serde_json::{Value, json};

use crate::{PATIENCE, Peer, say};

/// What ROS 2 computes for `action_msgs/srv/CancelGoal`; hiroz 0.2.1 computes another hash.
const CANCEL_HASH: &str = "RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a";

/// The action as hiroz generates it, with a cancel service that ROS 2 and rosz reach.
pub struct Fibonacci;

impl ZAction for Fibonacci {
    type Goal = FibonacciGoal;
    type Result = FibonacciResult;
    type Feedback = FibonacciFeedback;

    fn name() -> &'static str {
        Generated::name()
    }

    fn send_goal_type_info() -> TypeInfo {
        Generated::send_goal_type_info()
    }

    fn get_result_type_info() -> TypeInfo {
        Generated::get_result_type_info()
    }

    fn cancel_goal_type_info() -> TypeInfo {
        let hash = TypeHash::from_rihs_string(CANCEL_HASH).expect("a hash");
        TypeInfo::new(&Generated::cancel_goal_type_info().name, hash)
    }

    fn feedback_type_info() -> TypeInfo {
        Generated::feedback_type_info()
    }

    fn status_type_info() -> TypeInfo {
        Generated::status_type_info()
    }
}

/// The order from which a goal goes on until it is cancelled, after a few numbers.
const ENDLESS: i32 = 40;

/// Serves an action: negative orders are rejected, zero is aborted.
pub fn act(peer: &mut Peer, name: &str) -> Result<()> {
    let server: ZActionServer<Fibonacci> = peer.node.create_action_server(name).build()?;
    tokio::spawn(async move {
        while let Ok(goal) = server.recv_goal().await {
            say("goal", "", goal.goal().order);
            if goal.goal().order < 0 {
                goal.reject().expect("a rejection");
            } else {
                tokio::spawn(execute(goal.accept().execute()));
            }
        }
    });
    Ok(())
}

async fn execute(goal: hiroz::action::server::GoalHandle<Fibonacci, Executing>) {
    let order = goal.goal().order;
    let mut sequence = vec![0, 1];
    for _ in 1..if order < ENDLESS { order } else { 5 } {
        sequence.push(sequence.iter().rev().take(2).sum());
        let feedback = FibonacciFeedback { partial_sequence: sequence.clone() };
        goal.publish_feedback(feedback).expect("feedback");
    }
    let ended = if order == 0 {
        goal.abort(FibonacciResult { sequence })
    } else if order < ENDLESS {
        goal.succeed(FibonacciResult { sequence })
    } else {
        while !goal.try_process_cancel() {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
        goal.canceled(FibonacciResult { sequence })
    };
    ended.expect("the end of a goal");
}

/// Sends a goal, and prints whether it is accepted, its feedback, its end, and its result.
pub async fn send_goal(peer: &mut Peer, name: &str, order: i32) -> Result<()> {
    let client = peer.node.create_action_client::<Fibonacci>(name).build()?;
    if !client.wait_for_server(PATIENCE).await {
        return Err("no server of the action".into());
    }
    let mut goal = match client.send_goal(FibonacciGoal { order }).await {
        Ok(goal) => goal,
        Err(error) => {
            say("rejected", name, error.to_string());
            return Ok(());
        }
    };
    say("accepted", name, Value::Null);
    let mut feedback = goal.feedback().ok_or("no feedback")?;
    let mut status = goal.status_watch().ok_or("no status")?;
    let goal = Arc::new(goal);
    peer.goals.insert(name.to_string(), goal.clone());
    let topic = name.to_string();
    tokio::spawn(async move {
        while let Some(part) = feedback.recv().await {
            say("feedback", &topic, json!(part.partial_sequence));
        }
    });
    let name = name.to_string();
    tokio::spawn(async move {
        let result = client.get_result(goal.id()).await;
        let result = result.map(|result| result.sequence).map_err(|error| error.to_string());
        let ended = status.wait_for(GoalStatus::is_terminal).await.map(|end| format!("{:?}", *end));
        say("result", &name, json!([ended.unwrap_or_default(), result]));
    });
    Ok(())
}

/// Cancels the goal that was sent last, and prints the return code.
pub async fn cancel(peer: &mut Peer, name: &str) -> Result<()> {
    let goal = peer.goals.get(name).ok_or("no goal")?;
    say("canceling", name, goal.cancel().await?.return_code);
    Ok(())
}
