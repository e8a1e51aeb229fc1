//! What does a program say of itself before it answers? Version 2 of the protocol: which lens models it
//! knows, and how long it takes to start.
//!
//! A program that says nothing is one of version 1: it knows Brown-Conrady's lens and starts at once.

use super::protocol::Problem;
use calibench::camera::{FreeParameters, Model};
use calibench::synth::Scene;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The version of the protocol that this gate speaks.
const VERSION: u32 = 2;
/// Longest warm-up that is granted, s: compilers that compile while a program runs take a minute or two.
pub const MOST_WARM_UP_S: f64 = 600.0;

/// A line that a program may write before its first answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Greeting {
    /// Version of the protocol that it speaks: 2.
    pub protocol: u32,
    /// Names of the lens models it knows, `brown-conrady` among them; unknown names are no fault.
    #[serde(default = "only_brown_conrady")]
    pub models: Vec<String>,
    /// Time in addition to the limit that its first answer may take, s; at most 600 are granted.
    #[serde(default)]
    pub warm_up_seconds: f64,
}

fn only_brown_conrady() -> Vec<String> {
    vec![Model::BrownConrady.name().to_string()]
}

impl Greeting {
    /// The greeting that a line holds, if it holds one: an object with `protocol` that is no answer.
    ///
    /// # Errors
    /// What is wrong with it, for people.
    pub fn read(line: &str) -> Result<Option<Greeting>, String> {
        let Ok(value) = serde_json::from_str::<serde_json::Value>(line) else { return Ok(None) };
        if value.get("protocol").is_none() || value.get("id").is_some() {
            return Ok(None);
        }
        let greeting: Greeting = serde_json::from_value(value).map_err(|error| error.to_string())?;
        if greeting.protocol != VERSION {
            return Err(format!(
                "protocol {}, and a greeting is of protocol {VERSION}: programs of version 1 write none",
                greeting.protocol
            ));
        }
        if !(0.0..=MOST_WARM_UP_S).contains(&greeting.warm_up_seconds) {
            let seconds = greeting.warm_up_seconds;
            return Err(format!("warm_up_seconds {seconds}, and it may be 0 to {MOST_WARM_UP_S}"));
        }
        Ok(Some(greeting))
    }

    /// The models that it names and that the gate knows, in the gate's order.
    pub fn models(&self) -> Vec<Model> {
        Model::ALL.into_iter().filter(|model| self.models.iter().any(|name| name == model.name())).collect()
    }

    /// Time in addition to the limit for the first answer.
    pub fn warm_up(&self) -> Duration {
        Duration::from_secs_f64(self.warm_up_seconds)
    }
}

/// A first problem, asked to hear the greeting: four views of a board without noise.
pub(super) fn probe() -> Problem {
    let Scene { truth, .. } = Scene::example();
    let views = Scene::example().exact();
    Problem::of_views(
        "first".into(),
        truth.image_size,
        &views,
        &truth.camera.into(),
        FreeParameters::STANDARD,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_greeting_may_say_little_and_too_much() {
        let read = |line: &str| Greeting::read(line).unwrap().unwrap();
        let short = read(r#"{"protocol":2}"#);
        assert_eq!((short.models(), short.warm_up()), (vec![Model::BrownConrady], Duration::ZERO));
        let long = read(
            r#"{"protocol":2,"models":["splined","kannala-brandt"],"warm_up_seconds":600,"author":"x"}"#,
        );
        assert_eq!(long.models(), [Model::KannalaBrandt]);
        assert_eq!(long.warm_up(), Duration::from_secs(600));
    }

    #[test]
    fn what_is_wrong_with_a_greeting_is_said() {
        for (line, said) in [
            (r#"{"protocol":3}"#, "protocol 3"),
            (r#"{"protocol":1}"#, "version 1 write none"),
            (r#"{"protocol":"2"}"#, "invalid type"),
            (r#"{"protocol":2,"models":"rational"}"#, "expected a sequence"),
            (r#"{"protocol":2,"warm_up_seconds":-1}"#, "may be 0 to 600"),
            (r#"{"protocol":2,"warm_up_seconds":1e9}"#, "may be 0 to 600"),
        ] {
            let fault = Greeting::read(line).unwrap_err();
            assert!(fault.contains(said), "{fault}");
        }
    }

    #[test]
    fn an_answer_is_no_greeting() {
        assert_eq!(Greeting::read(r#"{"id":"a","status":"refused","protocol":2}"#), Ok(None));
        assert_eq!(Greeting::read("ready"), Ok(None));
    }
}
