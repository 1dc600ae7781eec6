//! Counts of a run for the summary. Pure.

/// Counts and totals of one stream, from its first sample on.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Report {
    /// Samples taken in; as many attitudes come out.
    pub samples: u64,
    /// Sum of the angles of all steps, rad.
    pub angle_turned: f64,
    /// Largest angle in one step, rad.
    pub largest_step: f64,
    /// Steps of more than half a turn: too few samples for what the body does.
    pub undersampled: u64,
    /// Intervals integrated although samples are missing in them.
    pub bridged: u64,
    /// Times the attitude was held over a break.
    pub holds: u64,
    /// Times the attitude went back to the initial one.
    pub resets: u64,
    /// Intervals with fewer samples than the method's window: ends of runs, irregular stamps.
    pub reduced: u64,
    /// Samples whose value was not finite or impossible, replaced by the rate before.
    pub rejected: u64,
    /// Samples not later than their predecessor, which turned nothing.
    pub stalled: u64,
    /// Intervals whose turn came out not finite and was left out.
    pub refused: u64,
    /// A bound on the worst attitude error the integration itself has made so far, rad: by
    /// how much a window of four samples less would have come out differently, and rounding. What bridges
    /// and holds may hide is not in it but in the covariance. `None` where the method has no narrower window
    /// to be held against: fewer than six rates or five increments, an order its own truncation limits, and
    /// the classical methods.
    pub integration_error: Option<f64>,
    /// Integrated time, seconds: breaks not counted.
    pub integrated_secs: f64,
}
