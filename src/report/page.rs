//! A log, examined -> one self-contained HTML page, and the same as JSON. Pure.
//!
//! No script, no font, no picture from anywhere else: the page is to be shared, printed and opened
//! ten years on. Its own script is named by its hash, and may ask nobody. What cannot be said is said to be so, with
//! the reason.

mod charts;
mod findings;
mod looking;
mod markup;
mod numbers;
mod reference;
mod several;
mod timeline;
mod topic;
mod verdict;

pub use findings::FindingRow;
pub use numbers::{comparison_json, longest_rest};
pub use several::Several;

use crate::report::calendar::date;
use crate::report::summary::human_bytes;
use markup::{Rows, escaped, folded};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use strapd_replay::inspection::Checked;
use verdict::{Level, Verdict};

/// Largest page, bytes.
pub const LARGEST: usize = 2_000_000;
/// Stretches of time a series is drawn in: about two to a pixel.
pub const STRETCHES: usize = 1400;
/// Topics that are drawn; of the others the numbers are told.
pub const DRAWN: usize = 6;
/// Fewest stretches, when all must fit.
const FEWEST: usize = 64;

/// A page with its one script, which may ask nobody, and `data` for machines.
fn document(title: &str, body: &str, data: &Value) -> String {
    let script = looking::script();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src {hash}; connect-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" href=\"data:,\">\n\
         <title>{title} - strapd report</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n{body}\
         </main>\n<script type=\"application/json\" id=\"report\">{data}</script>\n<script type=\"module\">{script}</script>\n</body>\n</html>\n",
        title = escaped(title),
        style = include_str!("page/page.css"),
        hash = looking::hash(&script),
        data = looking::inert(data),
    )
}

/// Allan deviation of a topic, or why there is none.
#[derive(Clone, Debug)]
pub enum Noise {
    /// Measured at rest.
    Measured {
        /// The curves, as SVG.
        svg: String,
        /// The fitted terms, as text for people.
        text: String,
        /// The same for machines.
        json: Value,
    },
    /// Text of what is missing.
    Missing(String),
}

/// Everything a report is made of.
#[derive(Debug)]
pub struct Page<'a> {
    /// The file's name.
    pub file: String,
    /// SHA-256 of all of it, hexadecimal.
    pub sha256: String,
    /// The command as typed.
    pub command: String,
    /// Name of the reference; empty = what the log holds.
    pub reference: String,
    /// Results of checking it.
    pub checked: &'a Checked,
    /// Findings of `check` about it.
    pub findings: Vec<FindingRow>,
    /// Noise by topic.
    pub noise: Vec<Noise>,
}

impl Page<'_> {
    /// The page, at most [`LARGEST`] bytes: drawn more coarsely where it would be larger.
    #[must_use]
    pub fn html(&self) -> String {
        let topics = self.checked.topics.len().clamp(1, DRAWN);
        let mut stretches = STRETCHES / topics;
        loop {
            let html = self.html_in(stretches);
            if html.len() <= LARGEST || stretches <= FEWEST {
                return html;
            }
            stretches /= 2;
        }
    }

    fn html_in(&self, stretches: usize) -> String {
        document(self.name(), &self.body(Some(stretches)), &self.json())
    }

    /// All that is said of the log; no stretches: without a chart.
    fn body(&self, stretches: Option<usize>) -> String {
        let verdict = self.verdict();
        let mut out = format!(
            "<h1>{}</h1>\n<p id=\"verdict\" class=\"{}\"><strong>{}</strong> {}</p>\n",
            escaped(self.name()),
            verdict.level.name(),
            verdict.level.word(),
            escaped(&verdict.text)
        );
        let is_any_used = self.checked.topics.iter().any(|t| t.looked.is_likely);
        for (index, topic) in self.checked.topics.iter().enumerate() {
            let drawn = stretches.filter(|_| index < DRAWN);
            let is_folded = is_any_used && !topic.looked.is_likely;
            topic::section(
                self,
                topic,
                self.noise.get(index),
                (drawn, is_folded),
                &mut out,
            );
        }
        if self.checked.topics.is_empty() {
            out.push_str("<section><h2>Attitude</h2>\n<p>There is no topic of gyro samples, so there is nothing to draw.</p></section>\n");
        }
        findings::section(&self.findings, &mut out);
        self.facts(&mut out);
        self.made(&mut out);
        out
    }

    /// The verdict, as the page begins.
    #[must_use]
    pub fn sentence(&self) -> String {
        let verdict = self.verdict();
        format!("{} {}", verdict.level.word(), verdict.text)
    }

    /// JSON for machines: one object, the one in the page.
    #[must_use]
    pub fn json(&self) -> Value {
        let verdict = self.verdict();
        let topics = self.checked.topics.iter().enumerate();
        json!({
            "strapd": env!("CARGO_PKG_VERSION"),
            "command": self.command,
            "file": self.file,
            "bytes": self.checked.file_size,
            "sha256": self.sha256,
            "verdict": { "level": verdict.level.name(), "text": verdict.text },
            "file_problems": self.checked.problems,
            "file_losses": self.checked.file_losses,
            "findings": self.findings.iter().map(FindingRow::json).collect::<Vec<_>>(),
            "reference": self.reference,
            "topics": topics.map(|(i, t)| numbers::topic(t, self.noise.get(i))).collect::<Vec<_>>(),
            "lossy": self.is_lossy(),
        })
    }

    /// Whether anything was lost or could not be done, by the verdict: exit code 3.
    #[must_use]
    pub fn is_lossy(&self) -> bool {
        self.verdict().level == Level::Bad
    }

    /// The file's name without its directory.
    fn name(&self) -> &str {
        let name = Path::new(&self.file).file_name();
        name.and_then(|n| n.to_str()).unwrap_or(&self.file)
    }

    fn verdict(&self) -> Verdict {
        Verdict::of(self.checked, &self.findings)
    }

    fn facts(&self, out: &mut String) {
        let mut rows = Rows::default();
        rows.add("file", &self.file);
        if let Some(bytes) = self.checked.file_size {
            rows.add("size", &human_bytes(bytes));
        }
        if !self.checked.profile.is_empty() {
            rows.add("profile", &self.checked.profile);
        }
        let spans = self.checked.topics.iter().filter_map(|t| {
            let quality = &t.looked.quality;
            quality.first.zip(quality.newest)
        });
        let first = spans.clone().map(|(first, _)| first).min();
        let last = spans.map(|(_, last)| last).max();
        if let (Some(first), Some(last)) = (first, last) {
            let dated =
                |stamp: strapd_attitude::record::Nanos| date(u64::try_from(stamp.0).unwrap_or(0));
            match (dated(first), dated(last)) {
                (Some(first), Some(last)) => {
                    rows.add("time span, UTC", &format!("{first} to {last}"))
                }
                _ => rows.add(
                    "time span",
                    &format!(
                        "{:.3} s to {:.3} s on the log's own clock, which is not UTC",
                        first.0 as f64 * 1e-9,
                        last.0 as f64 * 1e-9
                    ),
                ),
            }
        }
        for topic in &self.checked.topics {
            let looked = &topic.looked;
            let frame = match looked.frame.as_str() {
                "" => String::new(),
                frame => format!(", frame {frame}"),
            };
            rows.add(
                &format!("sensor {}", looked.topic),
                &format!(
                    "{}{frame}, {} samples",
                    looked.described, looked.quality.count
                ),
            );
        }
        for problem in &self.checked.problems {
            rows.add("damage", problem);
        }
        let _ = writeln!(
            out,
            "<section><h2>The log</h2>\n{}</section>",
            folded("size, span, sensors", &rows.html())
        );
    }

    fn made(&self, out: &mut String) {
        let mut rows = Rows::default();
        rows.add_code("command", &self.command);
        rows.add("strapd", env!("CARGO_PKG_VERSION"));
        rows.add_code("SHA-256 of the log", &self.sha256);
        let _ = writeln!(
            out,
            "<section><h2>How this was made</h2>\n{}<p class=\"small\">The same numbers for machines are in this page as JSON (<code>script#report</code>), and from <code>strapd report --json</code>.</p></section>",
            rows.html()
        );
    }
}
