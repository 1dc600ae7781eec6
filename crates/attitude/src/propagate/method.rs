//! A name on the command line -> which way to integrate. Pure.

use crate::diagnostic::Diagnostic;
use crate::record::SampleKind;
use std::fmt;
use std::str::FromStr;

/// Largest window: beyond 24 samples equidistant interpolation has nothing left to give in `f64`.
pub const LARGEST_WINDOW: usize = 24;

/// Method by which samples become turns.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum Method {
    /// The best for a log: centred windows of 16 rates or 15 increments, [`Order::Exact`].
    #[default]
    Auto,
    /// A polynomial through a sliding window of samples, integrated in closed form.
    Magnus {
        /// Samples in the window, 1 or 2 to [`LARGEST_WINDOW`]: fewer at the ends of a run and near gaps.
        window: usize,
        /// Order to which the non-commutativity is kept.
        order: Order,
        /// Placement of the interval in its window.
        placement: Placement,
    },
    /// Zero latency with the drift of centred windows: what is committed comes from centred windows,
    /// and the few intervals not yet centred are added provisionally (`docs/theory/attitude.md` 4.3).
    CommitProvisional {
        /// Samples in the window.
        window: usize,
        /// Order to which the non-commutativity is kept.
        order: Order,
        /// Whether each committed attitude is output a second time, without
        /// [`Status::PROVISIONAL`](crate::record::Status::PROVISIONAL).
        finals: bool,
    },
    /// The best for a stream: [`Method::CommitProvisional`] with 6 rates or 5 increments, whose errors are
    /// alike. [`Method::for_kind`] says which.
    Live {
        /// Order, as of [`Method::Magnus`].
        order: Order,
        /// Whether final attitudes follow, as of [`Method::Magnus`].
        finals: bool,
    },
    /// The rate at the start of the interval, held: the document's `w(t_i)`. First order.
    DcmLeft,
    /// The rate at the end of the interval, held: the document's `w(t_i+1)`. First order on gyro data.
    DcmRight,
    /// The mean of both. Second order.
    DcmMean,
    /// The document's eq. 13: one rotation by the sum of all rotation vectors. Right only while all of
    /// them, the initial attitude included, are small or parallel; 25 degrees wrong on generic motion.
    RotvecSum,
    /// Coning-optimised blocks of 2 increments (Miller 1983), for comparison.
    Coning2,
    /// Coning-optimised blocks of 3 increments, for comparison.
    Coning3,
    /// Coning-optimised blocks of 4 increments, for comparison.
    Coning4,
    /// Classical Runge-Kutta on the quaternion, rate linear over the interval, for comparison.
    Rk4,
}

/// Order to which the non-commutativity of rotation over one interval is kept.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum Order {
    /// The delta angle taken for a rotation vector; local error of order 3 in the interval.
    M2,
    /// One cross product; order 5.
    M4,
    /// Order 7.
    M6,
    /// Order 9.
    M8,
    /// Order 9 where its error is bounded below notice, otherwise a power series summed to the last bit.
    #[default]
    Exact,
}

/// Placement of an interval in its window.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum Placement {
    /// Middle: needs later samples, has by far the smaller error.
    #[default]
    Centred,
    /// End: needs no later sample.
    Causal,
}

const NAMES: [(&str, Method); 11] = [
    ("auto", Method::Auto),
    (
        "magnus",
        Method::Magnus {
            window: 16,
            order: Order::Exact,
            placement: Placement::Centred,
        },
    ),
    (
        "commit",
        Method::Live {
            order: Order::M8,
            finals: false,
        },
    ),
    ("dcm-left", Method::DcmLeft),
    ("dcm-right", Method::DcmRight),
    ("dcm-mean", Method::DcmMean),
    ("rotvec-sum", Method::RotvecSum),
    ("coning2", Method::Coning2),
    ("coning3", Method::Coning3),
    ("coning4", Method::Coning4),
    ("rk4", Method::Rk4),
];

const ORDERS: [(&str, Order); 5] = [
    ("2", Order::M2),
    ("4", Order::M4),
    ("6", Order::M6),
    ("8", Order::M8),
    ("exact", Order::Exact),
];

const PLACEMENTS: [(&str, Placement); 2] = [
    ("centred", Placement::Centred),
    ("causal", Placement::Causal),
];

impl Method {
    /// The name `--method` takes.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Method::Auto => "auto",
            Method::Magnus { .. } => "magnus",
            Method::CommitProvisional { .. } | Method::Live { .. } => "commit",
            Method::DcmLeft => "dcm-left",
            Method::DcmRight => "dcm-right",
            Method::DcmMean => "dcm-mean",
            Method::RotvecSum => "rotvec-sum",
            Method::Coning2 => "coning2",
            Method::Coning3 => "coning3",
            Method::Coning4 => "coning4",
            Method::Rk4 => "rk4",
        }
    }

    /// The method itself, [`Method::Live`] with the window that suits the samples. Of turns that are whole by
    /// themselves the best is each alone, whether there are later ones or not.
    #[must_use]
    pub fn for_kind(self, kind: SampleKind) -> Method {
        let alone = Method::Magnus {
            window: 1,
            order: Order::Exact,
            placement: Placement::Causal,
        };
        match self {
            Method::Auto | Method::Live { .. } if kind == SampleKind::Rotation => alone,
            Method::Live { order, finals } => Method::CommitProvisional {
                window: if kind == SampleKind::Rate { 6 } else { 5 },
                order,
                finals,
            },
            other => other,
        }
    }

    /// Every name, in the order of the documentation.
    pub fn names() -> impl Iterator<Item = &'static str> {
        NAMES.iter().map(|(name, _)| *name)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Method::Magnus {
                window,
                order,
                placement,
            } => {
                let placement = placement.name();
                write!(
                    f,
                    "magnus (window {window}, order {}, {placement})",
                    order.name()
                )
            }
            Method::CommitProvisional { window, order, .. } => {
                write!(f, "commit (window {window}, order {})", order.name())
            }
            Method::Live { order, .. } => write!(f, "commit (order {})", order.name()),
            other => f.write_str(other.name()),
        }
    }
}

impl Order {
    /// The name `--order` takes.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Order::M2 => "2",
            Order::M4 => "4",
            Order::M6 => "6",
            Order::M8 => "8",
            Order::Exact => "exact",
        }
    }
}

impl Placement {
    /// `centred` or `causal`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Placement::Centred => "centred",
            Placement::Causal => "causal",
        }
    }
}

/// A name nobody knows; says which ones there are.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct UnknownName {
    what: &'static str,
    given: String,
    known: Vec<&'static str>,
}

impl From<&UnknownName> for Diagnostic {
    fn from(error: &UnknownName) -> Diagnostic {
        let shown: String = error.given.chars().take(40).collect();
        Diagnostic::new(format!("unknown {} `{}`", error.what, shown.escape_debug()))
            .help(format!("one of {}", error.known.join(", ")))
    }
}

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for UnknownName {}

fn parse<T: Copy>(
    what: &'static str,
    table: &[(&'static str, T)],
    s: &str,
) -> Result<T, UnknownName> {
    table
        .iter()
        .find(|(name, _)| *name == s)
        .map(|(_, value)| *value)
        .ok_or_else(|| UnknownName {
            what,
            given: s.to_owned(),
            known: table.iter().map(|(name, _)| *name).collect(),
        })
}

impl FromStr for Method {
    type Err = UnknownName;
    /// `magnus` and `commit` come with their default window and order.
    fn from_str(s: &str) -> Result<Self, UnknownName> {
        parse("method", &NAMES, s)
    }
}

impl FromStr for Order {
    type Err = UnknownName;
    fn from_str(s: &str) -> Result<Self, UnknownName> {
        parse("order", &ORDERS, s)
    }
}

impl FromStr for Placement {
    type Err = UnknownName;
    fn from_str(s: &str) -> Result<Self, UnknownName> {
        parse("placement", &PLACEMENTS, s)
    }
}
