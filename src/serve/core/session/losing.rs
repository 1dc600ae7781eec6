//! Lines of a sender that bring no sample -> whose loss they are. Pure.

use super::{Session, Side};
use crate::serve::guard::fault::Fault;
use crate::serve::guard::losses::Lost;
use serde::Deserialize;
use strapd_recording::decode::exact_name;

/// Fields that a line which is no sample may still state.
#[derive(Deserialize)]
struct Named {
    id: Option<String>,
}

/// Sensor that a line states which is no sample.
pub(super) fn stated(line: &[u8]) -> Option<String> {
    let said: Named = serde_json::from_slice(line).ok()?;
    exact_name(&said.id?).ok().filter(|id| !id.is_empty())
}

impl Session {
    /// A line brought no sample, though it should have.
    pub(super) fn lose(&self, fault: &Fault, number: u64, line: &[u8]) {
        // Requests bring none.
        if !fault.is_loss() {
            return;
        }
        let sensor = self.subject().or_else(|| stated(line));
        self.hub.losses.add(&Lost {
            source: sensor.as_ref().unwrap_or(&self.client.peer.name),
            fault,
            first: (number, line),
            count: 1,
            is_whole: !self.has_sent(),
        });
    }

    /// The sensor whose message is read, of a broker.
    pub(super) fn subject(&self) -> Option<String> {
        let Side::Source(naming) = &self.side else {
            return None;
        };
        let subject = naming.subject.as_ref()?;
        Some(naming.id.as_ref().unwrap_or(subject).clone())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::serve::core::hub::{Hub, Settings};
    use crate::serve::core::session::Scratch;
    use std::sync::Arc;
    use strapd_attitude::record::Nanos;

    #[test]
    fn bad_lines_of_a_key_are_those_of_its_sensor() {
        let hub = Arc::new(Hub::new(Settings::default()).unwrap());
        let mut session = Session::with(&hub, "broker".to_owned(), Side::broker(None));
        let mut scratch = Scratch::default();
        let mut message = |id: &str, text: &str| {
            session.of_subject(id);
            session.message(text.as_bytes(), Nanos(0), &mut scratch);
        };
        let good = "{\"gyro\":[0.1,0,0],\"stamp\":{\"sec\":1,\"nsec\":0}}";
        message("a", good);
        message("b", good);
        for _ in 0..12 {
            message("a", "nonsense");
        }
        let status: serde_json::Value = serde_json::from_slice(&hub.status()).unwrap();
        let bad = |n: usize| &status["sources"][n]["counts"]["undecodable"];
        assert_eq!(
            (bad(0), bad(1)),
            (&12.into(), &serde_json::Value::Null),
            "{status}"
        );
        assert_eq!(status["refused"][0]["source"], "a");
        assert_eq!(status["refused"].as_array().map(Vec::len), Some(1));
    }

    #[test]
    fn a_bad_line_that_states_its_sensor_is_that_ones_and_not_of_whoever_came_last() {
        let hub = Arc::new(Hub::new(Settings::default()).unwrap());
        let mut session = Session::new(&hub, "both".to_owned(), true);
        let mut scratch = Scratch::default();
        let mut send = |line: String| session.bytes(line.as_bytes(), Nanos(0), &mut scratch);
        for n in 1..=3 {
            let stamp = format!("\"stamp\":{{\"sec\":{n},\"nsec\":0}}");
            send(format!("{{\"id\":\"b\",\"gyro\":[0.1,0,0],{stamp}}}\n"));
            send(format!("{{\"id\":\"a\",\"gyro\":[0.1,0,0],{stamp}}}\n"));
            send(format!("{{\"id\":\"b\",\"gyro\":null,{stamp}}}\n"));
        }
        let status: serde_json::Value = serde_json::from_slice(&hub.status()).unwrap();
        let bad = |n: usize| &status["sources"][n]["counts"]["undecodable"];
        assert_eq!(
            (bad(0), bad(1)),
            (&serde_json::Value::Null, &3.into()),
            "{status}"
        );
    }
}
