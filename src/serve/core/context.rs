//! Hub, places and the way to the end, as every task of a listener, a source or an output needs them.

use super::hub::Hub;
use super::reading::Reading;
use crate::serve::guard::admission::Web;
use crate::serve::guard::places::Places;
use crate::serve::guard::shutdown::Running;
use std::sync::Arc;

/// Context that every listener needs.
#[derive(Clone, Debug)]
pub struct Context {
    /// The hub.
    pub hub: Arc<Hub>,
    /// Names and pages that may connect over HTTP.
    pub web: Arc<Web>,
    /// A place for each connection.
    pub places: Arc<Places>,
    /// Way in which lines are read that come to a listener.
    pub reading: Arc<Reading>,
    /// Lives as long as the task.
    pub running: Running,
}
