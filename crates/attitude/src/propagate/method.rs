//! The ways to integrate. Pure.

use crate::record::SampleKind;
use std::fmt;

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

impl Method {
    /// [`Method::Magnus`] in centred windows of 16, to [`Order::Exact`].
    pub const MAGNUS: Method = Method::Magnus {
        window: 16,
        order: Order::Exact,
        placement: Placement::Centred,
    };
    /// [`Method::Magnus`] that needs no later sample: windows of 5, to [`Order::M6`].
    pub const CAUSAL: Method = Method::Magnus {
        window: 5,
        order: Order::M6,
        placement: Placement::Causal,
    };
    /// [`Method::Live`] to [`Order::M8`], without final attitudes.
    pub const COMMIT: Method = Method::Live {
        order: Order::M8,
        finals: false,
    };

    /// Name of the method as a setting has it; a causal one is called `magnus`, too.
    #[must_use]
    pub const fn name(self) -> &'static str {
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
    /// Name of the order as a setting has it.
    #[must_use]
    pub const fn name(self) -> &'static str {
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
