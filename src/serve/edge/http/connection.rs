//! An HTTP connection, as those who answer its requests know it.

use crate::serve::core::hub::Hub;
use crate::serve::core::reading::Reading;
use crate::serve::edge::samples::posters::Posters;
use crate::serve::guard::peer::Peer;
use crate::serve::guard::places::Place;
use crate::serve::guard::shutdown::Running;
use std::net::IpAddr;
use std::sync::Arc;

/// One HTTP connection, handed to what answers its requests.
#[derive(Clone, Debug)]
pub(crate) struct Connection {
    pub(crate) hub: Arc<Hub>,
    pub(crate) peer: Peer,
    /// Address, without the port.
    pub(crate) from: IpAddr,
    pub(crate) posters: Arc<Posters>,
    /// The client has shown the token with the request.
    pub(crate) trusted: bool,
    /// A browser says that the request is of a page it has from here.
    pub(crate) is_own_page: bool,
    pub(crate) running: Running,
    /// Way in which lines of a WebSocket are read.
    pub(crate) reading: Arc<Reading>,
    /// Held as long as the connection, or the WebSocket it becomes, lives.
    pub(crate) place: Arc<Place>,
}
