//! `strapd report FILE... -o r.html`: one self-contained page about a log, or about several. I/O.

use super::estimation::Estimation;
use super::frames::BaseFrame;
use super::progress::Reporter;
use super::setting_args::{Given, Smoothing};
use super::tables::Tables;
use super::{Global, Outcome, allan, own_output, print, with_each};
use crate::error::{Error, Result};
use crate::pipeline::attitude_track::{self, Side, Track};
use crate::pipeline::check::{Drawing, Examination, examine};
use crate::pipeline::opening;
use crate::pipeline::provenance::sha256;
use crate::report::page::{DRAWN, FindingRow, Noise, Page, STRETCHES, Several, longest_rest};
use crate::report::summary::{human_bytes, significant};
use crate::sink::Document;
use clap::Args;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::setting::SMOOTH;
use strapd_recording::Input;
use strapd_recording::Selection;
use strapd_recording::decode::Options;
use strapd_recording::pool::Pool;
use strapd_replay::inspection::CheckedTopic;

/// Rest from which an Allan deviation is worth having, s.
const ENOUGH: f64 = 600.0;

/// One self-contained HTML page about a log, or several: what is good and what is wrong, rates and attitude,
/// gaps, jitter, rest and bias, noise, error against a reference.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd report flight.mcap -o flight.html
  strapd report flight.mcap -o r.html --bias auto --init gravity     every flag of replay's estimation
  strapd report flight.mcap -o r.html --reference truth.csv          the error against another file
  strapd report *.mcap -o all.html                                   several, side by side in one page
  strapd report flight.mcap --json | jq .verdict                     the same numbers, no page

The page needs no network, and no script but to look into its charts; it opens from a file, prints, and is at most 2 MB for any log.
Exit codes: 0 done; 3 done, but an error was found (the verdict is `bad`): samples were lost, or the attitude will be wrong.")]
pub struct Report {
    #[arg(value_name = "FILE", required = true, help = super::recordings("Recordings", ", or folders of one"))]
    pub files: Vec<PathBuf>,
    /// The page; - is standard output
    #[arg(short, long, value_name = "FILE.html")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub estimation: Estimation,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub smoothing: Given<Smoothing>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub base: BaseFrame,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
    /// Hold the attitude against the one in this file (.mcap, .ndjson, .csv), not the one in the log
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// Topic or id of the reference, in --reference or in the log itself
    #[arg(long, value_name = "NAME")]
    pub ref_topic: Option<String>,
    /// Replace a page that exists
    #[arg(long)]
    pub force: bool,
    /// Keep in the page where the log and the files of this command lie, not their names alone
    #[arg(long)]
    pub record_paths: bool,
}

/// Runs it.
///
/// # Errors
/// A file cannot be read, the page exists, or the topic named is not in the log. What is wrong with
/// the samples is no error: the page says it.
pub fn run(global: &Global, mut args: Report) -> Result<Outcome> {
    args.files = own_output::without(args.files, args.estimation.topic.as_deref())?;
    let args = &args;
    args.check_output(global)?;
    args.check_reference()?;
    let plan = args
        .estimation
        .plan_of_a_recording(args.smoothing.is(SMOOTH, "true"))?;
    let mut selection = args.estimation.selection()?;
    args.tables.put(&mut selection.decode)?;
    let output = args.output.as_deref();
    let inputs: Vec<PathBuf> = args.files.iter().chain(&args.reference).cloned().collect();
    let document = output
        .map(|path| Document::create(path, &inputs, args.force))
        .transpose()?;
    let pool = Pool::new(global.threads)?;
    let reference = args.read_reference(&pool)?;
    let asked = Examination {
        selection,
        plan,
        reference_topic: match &reference {
            Some(_) => String::new(),
            None => args.ref_topic.clone().unwrap_or_default(),
        },
        drawing: Some(Drawing {
            stretches: STRETCHES,
            reference: reference.as_ref(),
        }),
        command: super::shell::recorded_command(args.record_paths),
    };
    let (outcome, html) = match args.files.as_slice() {
        [file] => args.one(global, file, (&asked, &pool))?,
        files => args.several(global, files, (&asked, &pool))?,
    };
    if let (Some(document), Some(path)) = (document, output) {
        document.write(&html)?;
        let size = human_bytes(html.len() as u64);
        tracing::info!("wrote {}  {size}", path.display());
    }
    Ok(outcome)
}

fn said(global: &Global, page: &Page<'_>) -> Result<Outcome> {
    if global.json {
        print(&format!("{}\n", page.json()))?;
    }
    Ok(match page.is_lossy() {
        true => Outcome::Lossy,
        false => Outcome::Done,
    })
}

impl Report {
    /// Checks that the page or its numbers have somewhere to go, and that the name of the page fits it.
    fn check_output(&self, global: &Global) -> Result<()> {
        let output = self.output.as_deref();
        match output {
            None if !global.json => {
                return Err(Error::usage(Diagnostic::new("report: where to?").help(
                    "-o report.html writes the page, --json prints the numbers alone",
                )));
            }
            Some(path) if global.json && path.as_os_str() == "-" => {
                return Err(Error::usage(
                    Diagnostic::new("--json and -o - would both write to stdout")
                        .help("give the page a file name"),
                ));
            }
            _ => {}
        }
        let ending = output
            .and_then(Path::extension)
            .map(|ending| ending.to_ascii_lowercase());
        if let (Some(path), Some(ending)) = (output, ending)
            && ["pdf", "png", "svg", "jpg", "docx", "md"]
                .iter()
                .any(|other| ending == *other)
        {
            let what = format!("-o {}: a report is HTML", path.display());
            let help = "-o report.html; a browser prints it, as PDF too";
            return Err(Error::usage(Diagnostic::new(what).help(help)));
        }
        Ok(())
    }

    /// Checks that a reference of one log is given with no other.
    fn check_reference(&self) -> Result<()> {
        if let (Some(path), [_, _, ..]) = (&self.reference, self.files.as_slice()) {
            let what = format!("--reference {} is of one log", path.display());
            return Err(Error::usage(Diagnostic::new(what).help(
                "one log, or --ref-topic NAME for a reference in each of them",
            )));
        }
        Ok(())
    }

    /// Examines the only log. The page is empty where none is to be written.
    fn one(
        &self,
        global: &Global,
        file: &Path,
        (asked, pool): (&Examination<'_>, &Pool),
    ) -> Result<(Outcome, String)> {
        let mut html = String::new();
        let outcome = self.with_page(global, file, (asked, pool), &mut |page| {
            if self.output.is_some() {
                html = page.html();
                tracing::info!("{}", page.sentence());
            }
            said(global, page)
        })?;
        Ok((outcome, html))
    }

    /// Examines logs one by one, side by side in one page; what cannot be read stands in it, too. The page is empty where
    /// none is to be written.
    fn several(
        &self,
        global: &Global,
        files: &[PathBuf],
        (asked, pool): (&Examination<'_>, &Pool),
    ) -> Result<(Outcome, String)> {
        let mut several = Several::of(files.len());
        let outcome = with_each(files, |file| {
            let done = self.with_page(global, file, (asked, pool), &mut |page| {
                several.add(page);
                tracing::info!("{}: {}", page.file, page.sentence());
                said(global, page)
            });
            if let Err(why) = &done {
                let name = self.shown(file);
                let why = why.to_string().replace('\n', " ");
                several.add_unread(&name, &why.replace(&file.display().to_string(), &name));
            }
            done
        })?;
        let mut html = String::new();
        if self.output.is_some() {
            html = several.html();
            tracing::info!("{} logs: {}", files.len(), several.sentence());
        }
        Ok((outcome, html))
    }

    /// Name of a file in the page, which is shown to others.
    fn shown(&self, file: &Path) -> String {
        match (self.record_paths, file.file_name()) {
            (false, Some(name)) => name.to_string_lossy().into_owned(),
            _ => file.display().to_string(),
        }
    }

    /// Examines a log, and hands over all that its page says.
    fn with_page(
        &self,
        global: &Global,
        file: &Path,
        (asked, pool): (&Examination<'_>, &Pool),
        take: &mut dyn FnMut(&Page<'_>) -> Result<Outcome>,
    ) -> Result<Outcome> {
        let input = opening::open(file)?;
        let mut asked = asked.clone();
        let with = (&input, &asked.selection);
        self.base.put(&mut asked.plan, with, pool)?;
        let mut reporter = Reporter::new(global, &input.name().display().to_string());
        let checked = examine(&input, &asked, pool, &mut |position| {
            reporter.update(position);
        });
        reporter.finish();
        let mut checked = checked?;
        let file = self.shown(input.name());
        checked.rename(&input.name().display().to_string(), &file);
        let track = asked.drawing.as_ref().and_then(|d| d.reference);
        take(&Page {
            sha256: sha256(input.name(), input.bytes()?)?,
            command: asked.command.clone(),
            reference: match (track, asked.reference_topic.as_str()) {
                (Some(track), _) => match &self.reference {
                    Some(path) => track
                        .name
                        .replace(&path.display().to_string(), &self.shown(path)),
                    None => track.name.clone(),
                },
                (None, "") => String::new(),
                (None, topic) => format!("the orientation on {topic}"),
            },
            findings: FindingRow::all(&checked, &checked.plan),
            noise: checked
                .topics
                .iter()
                .enumerate()
                .map(|(n, topic)| match n {
                    0..DRAWN => self.noise(&input, (&asked.selection, &asked.plan), topic, pool),
                    // Each takes a pass over the log.
                    _ => Noise::Missing(
                        "Not measured of so many topics: strapd report --topic NAME does."
                            .to_owned(),
                    ),
                })
                .collect(),
            checked: &checked,
            file,
        })
    }

    fn read_reference(&self, pool: &Pool) -> Result<Option<Track>> {
        let Some(path) = &self.reference else {
            return Ok(None);
        };
        let track = attitude_track::read(
            &opening::open(path)?,
            Side::Reference,
            self.ref_topic.as_deref(),
            &Options::default(),
            pool,
        )?;
        for problem in &track.problems {
            tracing::warn!("{problem}");
        }
        Ok(Some(track))
    }

    /// The Allan deviation of a topic's longest rest, or what is missing.
    fn noise(
        &self,
        input: &Input,
        (selection, plan): (&Selection, &EstimationSettings),
        topic: &CheckedTopic,
        pool: &Pool,
    ) -> Noise {
        let Some((begins, secs)) = longest_rest(topic) else {
            return Noise::Missing(format!(
                "Needs {ENOUGH:.0} s of rest, and there is none in this log."
            ));
        };
        if secs < ENOUGH {
            return Noise::Missing(format!(
                "Needs {ENOUGH:.0} s of rest; the longest in this log lasts {} s, so {} s are missing.",
                significant(secs, 3),
                significant(ENOUGH - secs, 3)
            ));
        }
        let begins = plan.start.unwrap_or(0.0) + begins;
        let plan = EstimationSettings {
            start: Some(begins),
            until: Some(begins + secs),
            ..plan.clone()
        };
        let selection = Selection {
            topic: Some(topic.looked.topic.clone()),
            ..selection.clone()
        };
        allan::examined(input, (&selection, &plan), pool).unwrap_or_else(|why| {
            let why = why.to_string().replace('\n', " ");
            Noise::Missing(format!("It could not be had: {why}"))
        })
    }
}
