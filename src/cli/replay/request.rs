//! Flags and one log -> the run over it, and who is served by it. I/O: reads what a run knows before it begins, and
//! starts the server.
//!
//! Apart from the flags because it is of one log: with several each has a run of its own.

use super::{EncodingArg, Replay};
use crate::cli::outputs;
use crate::cli::serving::{Played, Served};
use crate::cli::shell::recorded_command;
use crate::error::{Error, Result};
use crate::pipeline::attitude_track::{self, Side, Track};
use crate::pipeline::opening;
use crate::pipeline::request::ReplayRequest;
use crate::sink::{Encoding, Options, Precision, Target};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::record::Nanos;
use strapd_recording::Selection;
use strapd_recording::Source;
use strapd_recording::decode::Options as DecodeOptions;
use strapd_recording::pool::Pool;
use strapd_recording::recording::instants::Instants;

impl Replay {
    /// The run for one log, into the outputs of these names.
    ///
    /// # Errors
    /// [`Error::Usage`] for a flag that cannot be.
    pub(super) fn request(
        &self,
        log: &str,
        names: &[String],
        (selection, plan): (&Selection, &EstimationSettings),
        pool: &Pool,
    ) -> Result<(ReplayRequest, Served)> {
        self.check_out_rate()?;
        let targets = names.iter().map(|name| Target::parse(name));
        let targets = targets.collect::<Result<_>>()?;
        let source = self.source(log);
        let plan = self.with_base((selection, plan), &source, pool)?;
        let reference = self.read_reference(pool)?;
        let instants = self.read_instants(&source, &selection.decode, pool)?;
        let body = self.base.base_frame.as_ref().or(self.frame_id.as_ref());
        let frames = self.frames.names(body.cloned());
        let played = Played {
            name: &outputs::shown(log),
            can_rewind: can_rewind(&source),
            brings_samples: false,
        };
        let served = self
            .serving
            .start(targets, self.speed.as_deref(), played, &frames)?;
        let request = ReplayRequest {
            source,
            targets: served.targets.clone(),
            audience: served.audience(),
            selection: selection.clone(),
            plan,
            options: self.options(),
            copy_input: self.copy_input,
            out_rate: self.out_rate,
            instants,
            frames,
            speed: served.speed,
            against: match (&self.against_recorded, &reference) {
                (None, Some(_)) => Some(String::new()),
                (asked, _) => asked.clone(),
            },
            reference,
            command: recorded_command(self.record_paths),
            record_paths: self.record_paths,
        };
        Ok((request, served))
    }

    fn check_out_rate(&self) -> Result<()> {
        let is_rate = |hz: f64| hz.is_finite() && hz > 0.0;
        match self.out_rate.is_none_or(is_rate) {
            true => Ok(()),
            false => Err(Error::usage("--out-rate: a rate above 0 Hz".to_owned())),
        }
    }

    /// Source of the samples of a log: with `--join` all parts of the recording that it stands for.
    fn source(&self, log: &str) -> Source {
        match self.sources.as_slice() {
            several @ [_, _, ..] if self.join => {
                Source::Parts(several.iter().map(PathBuf::from).collect())
            }
            _ => Source::parse(log),
        }
    }

    /// The settings for a recording, with the way to `--base-frame` that it states.
    fn with_base(
        &self,
        (selection, plan): (&Selection, &EstimationSettings),
        source: &Source,
        pool: &Pool,
    ) -> Result<EstimationSettings> {
        let mut plan = plan.clone();
        if let Some(base) = &self.base.base_frame {
            let path = Self::file_read_twice(source, &format!("--base-frame {base}"))?;
            let input = opening::open(path)?;
            self.base.put(&mut plan, (&input, selection), pool)?;
        }
        Ok(plan)
    }

    /// The reference from another file, if one is given: attitudes as `compare` reads them.
    fn read_reference(&self, pool: &Pool) -> Result<Option<Arc<Track>>> {
        let Some(path) = &self.reference else {
            return Ok(None);
        };
        let input = opening::open(path)?;
        let track = attitude_track::read(
            &input,
            Side::Reference,
            None,
            &DecodeOptions::default(),
            pool,
        )?;
        for problem in &track.problems {
            tracing::warn!("{problem}");
        }
        Ok(Some(Arc::new(track)))
    }

    /// The file of a recording that is read beforehand, too.
    fn file_read_twice<'s>(source: &'s Source, asked: &str) -> Result<&'s Path> {
        match source {
            Source::File(path) => Ok(path),
            _ => {
                let what = format!("{asked}: the recording is to be one file, which is read twice");
                Err(Error::usage(Diagnostic::new(what).help("keep it as one")))
            }
        }
    }

    /// The instants at which attitudes are wanted, if somebody says any.
    fn read_instants(
        &self,
        source: &Source,
        decode: &DecodeOptions,
        pool: &Pool,
    ) -> Result<Option<Arc<[Nanos]>>> {
        let Some(asked) = &self.at else {
            return Ok(None);
        };
        let instants = Instants::named(asked);
        let path = match &instants {
            Instants::Table(path) => path,
            Instants::Frames | Instants::Topic(_) => {
                Self::file_read_twice(source, &format!("--at {asked}"))?
            }
        };
        let (read, note) = instants.read(path, decode, pool)?;
        if let Some(note) = note {
            tracing::warn!("{note}");
        }
        Ok(Some(read.into()))
    }

    /// Forms of the outputs.
    fn options(&self) -> Options {
        Options {
            force: self.force,
            encoding: match self.encoding {
                EncodingArg::Cdr => Encoding::Cdr,
                EncodingArg::Json => Encoding::Json,
            },
            compression: self.compression.into(),
            precision: self.precision(),
        }
    }

    #[cfg(feature = "parquet")]
    fn precision(&self) -> Precision {
        match self.parquet_f32 {
            true => Precision::Single,
            false => Precision::Double,
        }
    }

    #[cfg(not(feature = "parquet"))]
    fn precision(&self) -> Precision {
        Precision::default()
    }
}

/// Whether a source can be read again from its start.
fn can_rewind(source: &Source) -> bool {
    match source {
        Source::File(path) => path.is_file(),
        Source::Parts(_) => true,
        Source::Stdin => false,
        Source::Elsewhere(_) => true,
    }
}
