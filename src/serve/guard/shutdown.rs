//! Signals -> an orderly end. I/O.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use tokio::time::timeout;

/// Tells every task that it is time to end, and waits until they have.
///
/// In two steps, so that what has arrived still reaches whoever watches: first everybody reads what
/// is there, then everybody sends what waits.
#[derive(Debug)]
pub struct Shutdown {
    step: watch::Sender<ShutdownStage>,
    reading: (mpsc::Sender<()>, mpsc::Receiver<()>),
    working: (mpsc::Sender<()>, mpsc::Receiver<()>),
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum ShutdownStage {
    Serve,
    Read,
    Send,
}

/// A task's end of it. While one exists, its task counts as running.
#[derive(Clone, Debug)]
pub struct Running {
    step: watch::Receiver<ShutdownStage>,
    reading: Option<mpsc::Sender<()>>,
    _working: mpsc::Sender<()>,
}

impl Default for Shutdown {
    fn default() -> Shutdown {
        Shutdown {
            step: watch::Sender::new(ShutdownStage::Serve),
            reading: mpsc::channel(1),
            working: mpsc::channel(1),
        }
    }
}

impl Shutdown {
    /// Guard for a task that starts.
    #[must_use]
    pub fn running(&self) -> Running {
        Running {
            step: self.step.subscribe(),
            reading: Some(self.reading.0.clone()),
            _working: self.working.0.clone(),
        }
    }

    /// Asks every task to read what has arrived, for no longer than `reading`, then to send what
    /// waits and end, and waits for the last.
    pub async fn drain(self, reading: Duration) {
        let Shutdown {
            step,
            reading: (reader, mut read),
            working: (worker, mut worked),
        } = self;
        drop((reader, worker));
        step.send_replace(ShutdownStage::Read);
        // Nothing is ever sent: it ends when the last sender has gone.
        let _ = timeout(reading, read.recv()).await;
        step.send_replace(ShutdownStage::Send);
        let _ = worked.recv().await;
    }
}

impl Running {
    /// Waits until it is time to end: then read what is there and call [`Running::has_read`].
    pub async fn asked(&mut self) {
        self.reached(ShutdownStage::Read).await;
    }

    /// Everything that had arrived was read.
    pub fn has_read(&mut self) {
        self.reading = None;
    }

    /// Waits until everybody has read: then send what waits and end.
    pub async fn asked_to_send(&mut self) {
        self.reached(ShutdownStage::Send).await;
    }

    /// [`Running::asked`], or [`Running::asked_to_send`] for a task that was `asked` already.
    pub async fn asked_further(&mut self, asked: bool) {
        self.reached(if asked {
            ShutdownStage::Send
        } else {
            ShutdownStage::Read
        })
        .await;
    }

    async fn reached(&mut self, wanted: ShutdownStage) {
        // An error means that the daemon has gone altogether.
        let _ = self.step.wait_for(|step| *step >= wanted).await;
    }
}

/// Signal that ended the daemon.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Signal {
    /// Ctrl-C.
    Interrupt,
    /// Request of a service manager.
    Terminate,
    /// The terminal has gone.
    HangUp,
}

impl Signal {
    /// Name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Signal::Interrupt => "SIGINT",
            Signal::Terminate => "SIGTERM",
            Signal::HangUp => "SIGHUP",
        }
    }

    /// The exit code of a process that obeys it at once.
    #[must_use]
    pub fn exit_code(self) -> i32 {
        match self {
            Signal::HangUp => 129,
            Signal::Interrupt => 130,
            Signal::Terminate => 143,
        }
    }
}

/// The signals as they come, heard on a thread of their own: whatever the others are busy with, the
/// second that means the end ends the process at once.
#[derive(Debug)]
pub struct Signals {
    came: mpsc::UnboundedReceiver<Signal>,
    /// Whether one that means the end has come.
    is_ending: Arc<AtomicBool>,
}

/// Somebody listens to them.
static ARE_HEARD: AtomicBool = AtomicBool::new(false);

impl Signals {
    /// Whether anybody in this process listens, so that they end nothing by themselves.
    #[cfg(feature = "object-store")]
    #[must_use]
    pub fn are_heard() -> bool {
        ARE_HEARD.load(Ordering::SeqCst)
    }

    /// Starts to listen to them.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn new() -> std::io::Result<Signals> {
        let (tell, came) = mpsc::unbounded_channel();
        let (ready, is_ready) = std::sync::mpsc::channel();
        let is_ending = Arc::new(AtomicBool::new(false));
        let ending = is_ending.clone();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .build()?;
        std::thread::Builder::new()
            .name("strapd-signals".to_owned())
            .spawn(move || {
                runtime.block_on(async {
                    let mut heard = match Heard::new() {
                        Ok(heard) => heard,
                        Err(why) => return drop(ready.send(Err(why))),
                    };
                    // Who asked for it has gone, or it is heard from now on.
                    let _ = ready.send(Ok(()));
                    loop {
                        let signal = heard.next().await;
                        if ending.load(Ordering::SeqCst) && signal != Signal::HangUp {
                            std::process::exit(signal.exit_code());
                        }
                        if signal != Signal::HangUp {
                            ending.store(true, Ordering::SeqCst);
                        }
                        // Nobody waits for it any more: the next one ends the process.
                        let _ = tell.send(signal);
                    }
                });
            })?;
        is_ready
            .recv()
            .map_err(|_| std::io::Error::other("the thread for signals has gone"))??;
        ARE_HEARD.store(true, Ordering::SeqCst);
        Ok(Signals { came, is_ending })
    }

    /// The next one.
    pub async fn next(&mut self) -> Signal {
        // The thread ends with the process.
        self.came.recv().await.unwrap_or(Signal::Terminate)
    }

    /// The first that ends the daemon; from then on a second one ends the process. A hang-up ends
    /// nothing where `reopen` has taken it for the wish to go on in a new file.
    pub async fn first(&mut self, mut reopen: impl FnMut() -> bool) -> Signal {
        loop {
            match self.next().await {
                Signal::HangUp if reopen() => {}
                signal => {
                    self.is_ending.store(true, Ordering::SeqCst);
                    return signal;
                }
            }
        }
    }
}

#[cfg(unix)]
struct Heard {
    interrupt: tokio::signal::unix::Signal,
    terminate: tokio::signal::unix::Signal,
    hang_up: tokio::signal::unix::Signal,
}

#[cfg(unix)]
impl Heard {
    fn new() -> std::io::Result<Heard> {
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Heard {
            interrupt: signal(SignalKind::interrupt())?,
            terminate: signal(SignalKind::terminate())?,
            hang_up: signal(SignalKind::hangup())?,
        })
    }

    async fn next(&mut self) -> Signal {
        tokio::select! {
            _ = self.interrupt.recv() => Signal::Interrupt,
            _ = self.terminate.recv() => Signal::Terminate,
            _ = self.hang_up.recv() => Signal::HangUp,
        }
    }
}

/// Signals where there is only Ctrl-C.
#[cfg(not(unix))]
struct Heard;

#[cfg(not(unix))]
impl Heard {
    fn new() -> std::io::Result<Heard> {
        Ok(Heard)
    }

    async fn next(&mut self) -> Signal {
        // An error leaves nothing to wait for.
        let _ = tokio::signal::ctrl_c().await;
        Signal::Interrupt
    }
}
