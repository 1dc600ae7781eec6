//! `strapd serve`: samples over sockets -> attitudes over sockets. I/O.

use super::admission::Admission;
use super::calibration_files::{self, file_of};
use super::config::Layered;
use super::estimation::Estimation;
use super::frames::Frames;
use super::invitation::{self, Invitation};
use super::tables::Tables;
use super::{Global, Outcome, serial, service_manager};
use crate::address::Address;
use crate::client::remote::Remote;
use crate::client::secret::Secret;
use crate::error::{Error, Result};
use crate::serve::core::hub::{self, Hub};
use crate::serve::core::reading::LineParameters;
use crate::serve::core::recorder::{self, Recorder, Split};
use crate::serve::core::state::StateFile;
use crate::serve::edge::listen;
use crate::serve::edge::output::Output;
use crate::serve::edge::source::Endpoint;
use crate::serve::guard::limits::Limits;
use crate::serve::guard::shutdown::Signals;
use crate::serve::{Listening, Server, Settings};
use crate::sink::address::{DEFAULTS, LAN};
use crate::sink::{Format, Target};
use clap::Args;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use strapd_attitude::diagnostic::Diagnostic;

/// Most sources connected to.
const MAX_SOURCES: usize = 64;
/// Most sensors that can be asked for.
const MAX_SENSORS: u64 = 100_000;

/// Samples in over sockets, attitude out to whoever watches.
#[derive(Args, Debug)]
#[command(
    mut_arg("method", |method| method.default_value("commit")),
    mut_arg("topic", |topic| topic.hide(true)),
    mut_arg("accel_topic", |topic| topic.hide(true)),
    mut_arg("mag_topic", |topic| topic.hide(true)),
    after_help = "Examples:
  strapd serve                                           TCP on 127.0.0.1:4550, WebSocket and HTTP on 127.0.0.1:8765
  strapd serve --listen tcp-listen://127.0.0.1:0         a free port, named in the ready line
  strapd cat flight.mcap | strapd serve -                lines on standard input, too
  strapd serve tcp://imu.local:7000?id=imu0              samples from somebody who listens, for as long as it takes
  strapd serve 'ws://phone:8080/sensor/connect?type=android.sensor.gyroscope&id=phone'
  strapd serve 'serial:///dev/ttyUSB0?baud=115200&stamp=arrival'
                                                         a board that sends CSV or JSON without a clock
  strapd serve -o udp://127.0.0.1:9870?profile=plotjuggler
                                                         attitudes to PlotJuggler, as they come

Talk to it:
  echo '{\"class\":\"RATE\",\"id\":\"imu0\",\"stamp\":{\"sec\":1,\"nsec\":0},\"gyro\":[0.1,0,0]}' | nc 127.0.0.1 4550
  echo '{\"class\":\"WATCH\"}' | nc 127.0.0.1 4550             attitudes as they come
  http://127.0.0.1:8765/ in a browser                          the live page; /top: a top to spin
  strapd serve --lan                                           the same from a phone: scan the code
  curl 127.0.0.1:8765/metrics")]
pub struct Serve {
    /// Other sources of samples: tcp://HOST:PORT, ws://HOST:PORT/PATH, unix:///PATH,
    /// serial:///dev/PORT?baud=RATE (connected to, and again whenever lost; ?id=NAME names the sensor; serial: lists
    /// the ports), or - for standard input
    #[arg(value_name = "SOURCE")]
    pub sources: Vec<String>,
    /// Listeners: tcp-listen://HOST:PORT, udp-listen://HOST:PORT, ws-listen://HOST:PORT (with
    /// HTTP), unix-listen:///PATH. May be given several times; port 0 takes a free one
    /// [default: tcp-listen://127.0.0.1:4550 and ws-listen://127.0.0.1:8765]
    #[arg(long, value_name = "URI")]
    pub listen: Vec<String>,
    /// Show the page to this network: listen on ws-listen://0.0.0.0:8765 (and on tcp-listen://127.0.0.1:4550; --listen
    /// chooses others), and print links that hold the token, with a QR code. Without --token-file a token is
    /// made for this run; a FILE that does not exist yet is made, and keeps it
    #[arg(long)]
    pub lan: bool,
    /// Send every attitude there, too: tcp://HOST:PORT, udp://HOST:PORT[?profile=plotjuggler], or in the protocol of
    /// another program opentrack://, osc://, vmc://, slimevr://, mavlink://HOST:PORT[?id=NAME&rate=HZ]. May be given
    /// several times
    #[arg(short, long = "output", value_name = "SINK")]
    pub output: Vec<String>,
    /// Take what is not given as a flag or in the environment from this TOML file
    #[arg(long, value_name = "FILE", env = "STRAPD_CONFIG")]
    pub config: Option<PathBuf>,
    /// Stamps of samples that have none: those of their arrival, made even. Without it such samples are not used; of one
    /// address ?stamp=arrival
    #[arg(long, value_name = "WHEN", value_parser = ["arrival"])]
    pub stamp: Option<String>,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub estimation: Estimation,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub frames: Frames,
    /// Record what comes in and the attitudes to this MCAP file
    #[arg(long, value_name = "FILE", help_heading = "Recording")]
    pub record: Option<PathBuf>,
    /// Go on in a new file after this size or time (512MiB, 10min); files are numbered
    #[arg(
        long,
        value_name = "SIZE|TIME",
        requires = "record",
        help_heading = "Recording"
    )]
    pub record_split: Option<String>,
    /// Stop recording, and go on serving, with less than this free on the disk
    #[arg(
        long,
        value_name = "SIZE",
        default_value = "256MiB",
        help_heading = "Recording"
    )]
    pub min_free: String,
    /// Replace the recording if it exists
    #[arg(long, requires = "record", help_heading = "Recording")]
    pub force: bool,
    /// Keep this command in the recording with the folders of its files
    #[arg(long, requires = "record", help_heading = "Recording")]
    pub record_paths: bool,
    /// Go on from the attitudes in this file, and keep it no more than a second behind: a restart
    /// loses no heading
    #[arg(long, value_name = "FILE")]
    pub state: Option<PathBuf>,
    /// Save what was learned of each sensor in this folder at the end, as ID.toml: --calibration takes the folder
    #[arg(long, value_name = "DIR")]
    pub save_calibration: Option<PathBuf>,
    /// A sensor that connects again and sends again what it has sent may begin so many seconds back:
    /// those samples count as late. One that begins further back begins a new run
    #[arg(long, value_name = "SECS", value_parser = window, default_value = "60")]
    pub state_window: Duration,
    /// Most sensors at once. One more takes the place of the sensor that nobody sends and that has been
    /// silent longest; one connection sends at most 256 or a quarter of all, one peer half of all
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=MAX_SENSORS))]
    pub max_sensors: usize,
    /// Give up the place of a sensor that was silent for so many seconds; it goes on from its last attitude when it
    /// comes back [default: its place is another's when all are taken]
    #[arg(long, value_name = "SECS", value_parser = window)]
    pub forget_after: Option<Duration>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub admission: Admission,
}

/// `--state-window`.
fn window(text: &str) -> std::result::Result<Duration, String> {
    let secs: Option<f64> = text.strip_suffix('s').unwrap_or(text).parse().ok();
    secs.filter(|secs| (0.0..=86_400.0).contains(secs))
        .map(Duration::from_secs_f64)
        .ok_or_else(|| "expected seconds, 0 to 86400".to_owned())
}

/// Runs it until a signal.
///
/// # Errors
/// An address cannot be listened on, or the arguments cannot be.
pub fn run(global: &Global, args: &Serve) -> Result<Outcome> {
    if args
        .sources
        .iter()
        .any(|source| serial::asks_for_ports(source.as_ref()))
    {
        return serial::list();
    }
    let layered = match &args.config {
        Some(file) => Some(super::config::layered(file, std::env::args_os().collect())?),
        None => None,
    };
    let asked = args;
    let args = layered.as_ref().map_or(args, Layered::serve);
    let calibrations = args.save_calibration.as_deref();
    // A folder that is kept up to date begins empty: it is read, too.
    if let Some(folder) = calibrations {
        std::fs::create_dir_all(folder).map_err(|source| Error::Write {
            path: folder.to_owned(),
            source,
        })?;
    }
    // Before it is read.
    if let (true, Some(path)) = (args.lan, &args.admission.token_file) {
        Secret::random()?.keep(path)?;
    }
    let mut settings = match &layered {
        Some(layered) => layered.settings()?,
        None => asked.settings()?,
    };
    let recording = args.recording()?;
    let state = match &args.state {
        Some(path) => {
            let (file, saved) = StateFile::open(path)?;
            settings.hub.saved = saved;
            Some(Arc::new(Mutex::new(file)))
        }
        None => None,
    };
    // After the state, which may be another daemon's: a recording that is replaced is gone.
    let recorder = recording.map(Recorder::start).transpose()?;
    settings.hub.recorder = recorder.as_ref().map(Recorder::handle);
    let runtime = runtime(global.threads)?;
    let has_stdin = args.sources.iter().any(|s| s == "-");
    let inviting = args.lan.then(|| Invitation {
        token: settings.invitation.take(),
        is_made: args.admission.token_file.is_none(),
    });
    let kept = (state, calibrations);
    let outcome = runtime.block_on(serve(settings, has_stdin, inviting, kept));
    // A thread that waits for standard input would otherwise be waited for.
    runtime.shutdown_background();
    let Some(status) = recorder.map(Recorder::finish) else {
        return outcome;
    };
    tracing::info!(
        "recorded {} samples and {} attitudes in {} files, {} bytes",
        status.samples,
        status.attitudes,
        status.files.len(),
        status.bytes
    );
    outcome.map(|done| {
        if status.is_lossy() {
            Outcome::Lossy
        } else {
            done
        }
    })
}

/// Threads for so many sensors at once; 0: as many as there are cores.
fn runtime(threads: usize) -> Result<tokio::runtime::Runtime> {
    let mut builder = tokio::runtime::Builder::new_multi_thread();
    if threads > 0 {
        builder.worker_threads(threads);
    }
    builder
        .thread_name("strapd-serve")
        .enable_all()
        .build()
        .map_err(|e| Error::usage(format!("--threads {threads}: {e}")))
}

async fn serve(
    settings: Settings,
    has_stdin: bool,
    inviting: Option<Invitation>,
    (state, calibrations): (Option<Arc<Mutex<StateFile>>>, Option<&Path>),
) -> Result<Outcome> {
    // Signals first: from the ready line on, one drains.
    let mut signals = Signals::new().map_err(|e| Error::usage(format!("signals: {e}")))?;
    let server = Server::bind(settings).await?;
    let addresses: Vec<String> = server.addresses().iter().map(ToString::to_string).collect();
    let hub = server.hub().clone();
    tracing::info!(session = hub.session(), "ready {}", addresses.join(" "));
    invitation::show(server.addresses(), inviting.as_ref());
    service_manager::ready();
    let keeping = state
        .clone()
        .map(|file| tokio::spawn(hub.clone().keep_saving(file)));
    if has_stdin {
        let hub = hub.clone();
        std::thread::spawn(move || listen::read_stdin(&hub, std::io::stdin().lock()));
    }
    let drained = server
        .run(async {
            let signal = signals.first(|| reopen(&hub)).await;
            tracing::info!("{}: shutting down", signal.name());
            service_manager::stopping();
        })
        .await;
    if !drained {
        tracing::warn!("not everything could be sent in time");
    }
    if let Some(keeping) = keeping {
        keeping.abort();
    }
    if let Some(file) = state {
        let hub = hub.clone();
        let limit = hub.limits().drain;
        // Behind whatever save is still under way; a disk that hangs is not waited for.
        let saving = tokio::task::spawn_blocking(move || hub.save(&file));
        if tokio::time::timeout(limit, saving).await.is_err() {
            tracing::warn!("the attitudes could not be saved in time");
        }
    }
    for (id, known) in calibrations.map(|_| hub.calibrations()).unwrap_or_default() {
        let folder = calibrations.unwrap_or(Path::new("."));
        // The others are saved all the same.
        if let Err(e) = calibration_files::write(&file_of(folder, &id), &known) {
            tracing::warn!("--save-calibration: {e}");
        }
    }
    let of = |n: &std::sync::atomic::AtomicU64| n.load(Ordering::Relaxed);
    tracing::info!(
        "served {:.1} s: {} samples in, {} attitudes, {} bad lines",
        hub.uptime_secs(),
        of(&hub.counters.samples),
        of(&hub.counters.attitudes),
        of(&hub.counters.faults)
    );
    Ok(Outcome::Done)
}

/// A hang-up: the wish to go on in a new file, as of a log rotation. In a terminal it means that the
/// terminal has gone, and the daemon goes with it.
fn reopen(hub: &Hub) -> bool {
    let reopens = !std::io::stderr().is_terminal() && hub.reopen_recording();
    if reopens {
        tracing::info!("SIGHUP: the recording goes on in a new file");
    }
    reopens
}

impl Serve {
    /// Settings of a recording, if there is to be one.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag.
    pub(super) fn recording(&self) -> Result<Option<recorder::Settings>> {
        let named = |flag: &str, error: Error| {
            Error::usage(Diagnostic::from(&error).at(format_args!("--{flag}")))
        };
        // `0` alone is no size with a unit, and the only one that needs none.
        let min_free = match self.min_free.as_str() {
            "0" => 0,
            text => match text.parse::<Split>() {
                Ok(Split::Bytes(bytes)) => bytes,
                _ => {
                    return Err(Error::usage(format!(
                        "--min-free {text}: expected a size such as 256MiB or 1GB, or 0"
                    )));
                }
            },
        };
        let Some(path) = &self.record else {
            return Ok(None);
        };
        if Target::from_path(path)?.format() != Some(Format::Mcap) {
            return Err(Error::usage(
                Diagnostic::new(format!(
                    "--record {}: a recording is an MCAP file",
                    path.display()
                ))
                .help("give it a name that ends in .mcap"),
            ));
        }
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            return Err(Error::usage(
                Diagnostic::new(format!(
                    "--record {}: there is no folder {}",
                    path.display(),
                    folder.display()
                ))
                .help("a recording makes files, and no folders"),
            ));
        }
        let mut settings = recorder::Settings::new(path);
        settings.force = self.force;
        settings.min_free = min_free;
        settings.split = match &self.record_split {
            Some(text) => Some(text.parse().map_err(|e| named("record-split", e))?),
            None => None,
        };
        settings.provenance.metadata = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("command", super::shell::recorded_command(self.record_paths)),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into();
        Ok(Some(settings))
    }

    /// The sources to connect to.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the source.
    fn outgoing(&self) -> Result<Vec<Endpoint>> {
        let mut sources: Vec<Endpoint> = Vec::new();
        for text in self.sources.iter().filter(|s| *s != "-") {
            if !Remote::is_meant(text) {
                return Err(Error::usage(
                    Diagnostic::new(format!(
                        "serve {}: is no source of a daemon; known: tcp://HOST:PORT, ws://HOST:PORT/PATH, unix:///PATH, serial:///dev/PORT, -",
                        Address::from(text)
                    ))
                    .help(
                        "--listen waits for senders; strapd replay reads a log",
                    )
                ));
            }
            let mut source = Endpoint::parse(text)?;
            if sources.iter().any(|s| s.is_same_place(&source)) {
                return Err(Error::usage(format!(
                    "serve {}: is given twice",
                    source.name()
                )));
            }
            // What tells two apart may be what is not printed.
            let alike = |s: &&Endpoint| {
                s.name() == source.name() || s.name().starts_with(&format!("{} (", source.name()))
            };
            match sources.iter().filter(alike).count() {
                0 => {}
                others => source.is_one_of(others + 1),
            }
            sources.push(source);
        }
        #[cfg(feature = "nats")]
        {
            let is_leased =
                |s: &&Endpoint| matches!(s, Endpoint::Nats(address) if address.lease.is_some());
            if sources.iter().filter(is_leased).count() > 1 {
                return Err(Error::usage(
                    Diagnostic::new("serve: two partitions, and one daemon takes one").help(
                        "start a daemon for each: they are cheap, and each can be taken over alone",
                    ),
                ));
            }
        }
        if sources.len() > MAX_SOURCES {
            return Err(Error::usage(format!(
                "serve: {} sources, at most {MAX_SOURCES} can be connected to",
                sources.len()
            )));
        }
        Ok(sources)
    }

    /// The arguments, checked.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag; the token file cannot be read.
    pub(crate) fn settings(&self) -> Result<Settings> {
        let given: Vec<&str> = if self.listen.is_empty() {
            if self.lan { LAN } else { DEFAULTS }.to_vec()
        } else {
            self.listen.iter().map(String::as_str).collect()
        };
        let (plan, plans) = self.estimation.live_plans()?;
        let mut decode = self.estimation.selection()?.decode;
        self.tables.put(&mut decode)?;
        let settings = Settings {
            hub: hub::Settings {
                decode,
                lines: LineParameters {
                    by_arrival: self.stamp.is_some(),
                    ..LineParameters::default()
                },
                plan,
                plans,
                frames: self.frames.names(None),
                limits: Limits {
                    state_window: self.state_window,
                    forget_after: self.forget_after,
                    ..Limits::of_sensors(self.max_sensors)
                },
                ..hub::Settings::default()
            },
            listen: given
                .into_iter()
                .map(Listening::parse)
                .collect::<Result<_>>()?,
            sources: self.outgoing()?,
            outputs: self
                .output
                .iter()
                .map(|o| Output::parse(o))
                .collect::<Result<_>>()?,
            #[cfg(unix)]
            passed: listen::Passed::from_env(),
            ..Settings::default()
        };
        self.admission.apply(settings, self.lan)
    }
}
