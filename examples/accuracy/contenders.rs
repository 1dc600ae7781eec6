//! Contenders: our methods and the peers' formulas, by what they read. Samples -> attitudes. Pure.

use crate::peers::{self, Peer};
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::propagate::{
    Method, Noise, Order, Placement, Propagator, Sequential, Settings, SettingsError,
};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{RateSample, SampleKind};

/// One way from samples to attitude.
#[derive(Clone, Copy)]
pub struct Contender {
    /// Name in tables and legends.
    pub name: &'static str,
    way: Way,
    /// Number of samples after which its attitudes are meant to be right.
    pub every: usize,
}

#[derive(Clone, Copy)]
enum Way {
    Ours(Method),
    Theirs(Peer),
}

impl Contender {
    const fn ours(name: &'static str, method: Method) -> Self {
        let every = match method {
            Method::Coning2 => 2,
            Method::Coning3 => 3,
            Method::Coning4 => 4,
            _ => 1,
        };
        Contender {
            name,
            way: Way::Ours(method),
            every,
        }
    }

    const fn theirs(name: &'static str, peer: Peer) -> Self {
        Contender {
            name,
            way: Way::Theirs(peer),
            every: 1,
        }
    }

    /// The attitude at every sample.
    ///
    /// # Errors
    /// A method that does not exist.
    pub fn run(
        &self,
        kind: SampleKind,
        start: Quaternion<Nav, Body>,
        samples: &[RateSample],
    ) -> Result<Vec<Quaternion<Nav, Body>>, SettingsError> {
        let method = match self.way {
            Way::Theirs(peer) => return Ok(peer(start, samples)),
            Way::Ours(method) => method,
        };
        let mut propagator = Propagator::new(Settings {
            method,
            kind,
            initial: start,
            noise: Noise::default(),
            ..Settings::default()
        })?;
        let mut out = Vec::new();
        propagator.push(samples, &Sequential, &mut out);
        propagator.finish(&Sequential, &mut out);
        Ok(out.iter().map(|a| a.q_nb).collect())
    }
}

const fn magnus(window: usize, order: Order, placement: Placement) -> Method {
    Method::Magnus {
        window,
        order,
        placement,
    }
}

const fn centred(window: usize) -> Method {
    magnus(window, Order::M8, Placement::Centred)
}

const fn causal(window: usize) -> Method {
    magnus(window, Order::M6, Placement::Causal)
}

const fn commit(window: usize) -> Method {
    Method::CommitProvisional {
        window,
        order: Order::M8,
        finals: false,
    }
}

/// All that read instantaneous rates, from the crudest.
pub const OF_RATES: [Contender; 20] = [
    Contender::theirs(
        "Euler angles, forward Euler (gnss-ins-sim)",
        peers::euler_angles,
    ),
    Contender::theirs("C (I + [w dt x]) (strapdown-rs)", peers::first_order_matrix),
    Contender::theirs("exp(w dt) (gyroflow, ahrs, VQF)", peers::one_exponential),
    Contender::ours("`dcm-left`: w(t_i)", Method::DcmLeft),
    Contender::ours("`dcm-right`: w(t_i+1)", Method::DcmRight),
    Contender::theirs(
        "w(t_i+1), 1/12 before (smsfusion)",
        peers::end_rate_and_one_before,
    ),
    Contender::ours("`dcm-mean`", Method::DcmMean),
    Contender::theirs(
        "trapezoid, 1/12 before (PX4)",
        peers::trapezoid_and_one_before,
    ),
    Contender::theirs("linear rate, 1/12 (pyins)", peers::linear_rate),
    Contender::theirs("Runge-Kutta 4, linear rate", peers::runge_kutta_linear),
    Contender {
        every: 2,
        ..Contender::theirs(
            "Runge-Kutta 4 over two samples",
            peers::runge_kutta_over_two,
        )
    },
    Contender::ours("causal 3, order 6", causal(3)),
    Contender::ours("causal 5, order 6 (`--method causal`)", causal(5)),
    Contender::ours("**commit 6**, order 8 (live, no latency)", commit(6)),
    Contender::ours("commit 8, order 8", commit(8)),
    Contender::ours("centred 4, order 8", centred(4)),
    Contender::ours("centred 6, order 8", centred(6)),
    Contender::ours("centred 8, order 8", centred(8)),
    Contender::ours("centred 10, order 8", centred(10)),
    Contender::ours("**auto**: centred 16, exact", Method::Auto),
];

/// All that read exact delta angles, from the crudest.
pub const OF_INCREMENTS: [Contender; 11] = [
    Contender::theirs(
        "exp(d) (gyroflow, ahrs, VQF given means)",
        peers::one_increment,
    ),
    Contender::theirs("1/12 before (pyins)", peers::increment_and_one_before),
    Contender::ours("`coning2`: optimal of 2", Method::Coning2),
    Contender::ours("`coning3`: optimal of 3", Method::Coning3),
    Contender::ours("`coning4`: optimal of 4", Method::Coning4),
    Contender::ours("causal 5, order 6 (`--method causal`)", causal(5)),
    Contender::ours("**commit 5**, order 8 (live, no latency)", commit(5)),
    Contender::ours("commit 7, order 8", commit(7)),
    Contender::ours("centred 7, order 8", centred(7)),
    Contender::ours("centred 9, order 8", centred(9)),
    Contender::ours("**auto**: centred 15, exact", Method::Auto),
];
