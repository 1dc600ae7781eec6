//! A topic's summary -> the few lines of it that everybody reads: what was done, and how good it is. Pure.

use super::{NO_SIGMA, TopicSummary};
use crate::finding::{AS_READ, Finding, Severity};
use crate::summary::against::against_text;
use crate::summary::significant;

/// Longest line, characters; the whole of one is in the full summary.
const LONGEST: usize = 160;

/// `text`, cut at the end of a word.
fn cut(text: &str) -> String {
    cut_to(text, LONGEST)
}

fn cut_to(text: &str, longest: usize) -> String {
    let text = text.lines().next().unwrap_or_default();
    match text.char_indices().nth(longest) {
        None => text.to_owned(),
        Some((at, _)) => {
            let head = text.get(..at).unwrap_or_default();
            let end = head.rfind(' ').unwrap_or(at);
            format!("{} ...", head.get(..end).unwrap_or_default())
        }
    }
}

/// A finding in one line: where it is too long its words are cut, and what helps is kept.
fn cut_before_advice(finding: &Finding) -> String {
    let line = finding.line();
    let advice = line.strip_prefix(&finding.what).unwrap_or_default();
    let (long, advised) = (line.chars().count(), advice.chars().count());
    if long <= LONGEST || advised == 0 {
        return cut(&line);
    }
    // Of advice that is itself too long, the settings.
    let flags = finding.flags();
    let kept = match advised > LONGEST / 2 {
        true if flags.is_empty() => return cut(&line),
        true => format!(": {flags}"),
        false => advice.to_owned(),
    };
    let left = LONGEST.saturating_sub(kept.chars().count());
    format!("{}{kept}", cut_to(&finding.what, left.max(LONGEST / 2)))
}

impl TopicSummary {
    /// Lines with their labels, at most five but for a reference that was asked for; `problems` are those of the file.
    #[must_use]
    pub(crate) fn brief(&self, problems: &[String]) -> Vec<(&'static str, String)> {
        let gaps = self.gaps.bridged + self.gaps.held + self.gaps.resets;
        let with_gaps = match gaps {
            0 => String::new(),
            _ => format!("; gaps {}", self.gaps.text()),
        };
        let maps = self.sensor_maps.as_ref();
        let maps = maps.map_or_else(String::new, |maps| format!("; {maps}"));
        let samples = format!("{}{maps}{with_gaps}", self.samples_text());
        let mut lines = vec![("samples", cut(&samples))];
        if self.has_attitude() {
            let (corrector, corrected) = self.correction();
            if let Some(said) = self.not_smoothed() {
                lines.push(("smooth", cut(&said)));
            } else {
                lines.extend(corrected.first().map(|said| (corrector, cut(said))));
            }
        }
        lines.extend(self.mended_text().map(|said| ("mended", cut(&said))));
        lines.push(("final", self.brief_final()));
        let lost = self.counts.lost() + self.left_out > 0;
        let lost = lost.then(|| self.lost_text(false));
        let file = problems.first().map(|first| match problems.len() {
            1 => first.clone(),
            n => format!("{first} (and {} more)", n - 1),
        });
        match (lost, file) {
            (Some(lost), Some(file)) => lines.push(("lost", cut(&format!("{lost}; {file}")))),
            (Some(lost), None) => lines.push(("lost", cut(&lost))),
            (None, Some(file)) => lines.push(("file", cut(&file))),
            (None, None) => {}
        }
        lines.extend(self.brief_warning().map(|said| ("warning", said)));
        for (n, line) in against_text(&self.against, self.recorded.as_ref())
            .into_iter()
            .enumerate()
        {
            lines.push((if n == 0 { "against" } else { "" }, line));
        }
        lines
    }

    /// The last attitude with its sigma, in digits that the sigma leaves.
    fn brief_final(&self) -> String {
        if !self.has_attitude() {
            return self.final_text();
        }
        let [yaw, pitch, roll] = self.final_ypr.map(f64::to_degrees);
        let sigma = self.final_sigma.map(f64::to_degrees);
        let most = sigma.into_iter().fold(0.0, f64::max);
        let digits = match most {
            most if most >= 3.0 => 0,
            most if most >= 0.3 => 1,
            _ => 3,
        };
        let attitude =
            format!("roll {roll:.digits$}, pitch {pitch:.digits$}, yaw {yaw:.digits$} deg");
        if self.has_no_sigma() {
            return format!("{attitude}; sigma {NO_SIGMA}");
        }
        let [x, y, z] = sigma.map(|v| significant(v, 2));
        let holds = match self.sigma_holds() {
            true => "",
            false => " DOES NOT HOLD: see warning",
        };
        format!("{attitude}; sigma {x}, {y}, {z} deg about x, y, z{holds}")
    }

    /// The worst of the warnings, and how many more there are.
    fn brief_warning(&self) -> Option<String> {
        // What a rule found in the data comes before how they were read.
        let rank = |finding: &&Finding| (finding.severity, finding.code != AS_READ);
        // The first of the worst.
        let first = self.findings.iter().rev().max_by_key(rank)?;
        let more = self.findings.len() - 1;
        let more = match (more, first.severity) {
            (0, _) => String::new(),
            (n, Severity::Note) => format!(" (and {n} more notes)"),
            (n, _) => format!(" (and {n} more)"),
        };
        Some(format!("{}{more}", cut_before_advice(first)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strapd_attitude::record::Verdict;
    use strapd_attitude::setting::GYRO_UNIT;

    #[test]
    fn the_worst_warning_is_shown_and_the_others_are_counted() {
        let mut topic = TopicSummary::default();
        topic.counts.add(Verdict::Accepted);
        for (severity, what) in [
            (Severity::Note, "a note"),
            (Severity::Error, "the worst"),
            (Severity::Warning, "a warning"),
        ] {
            topic.findings.push(Finding::new(severity, "code", what));
        }
        let lines = topic.brief(&[]);
        assert!(lines.len() <= 5, "{lines:?}");
        assert!(lines.contains(&("warning", "the worst (and 2 more)".to_owned())));
        // What was said of the reading is not the worst of its kind, and what helps is not cut off.
        let long = "word ".repeat(100);
        topic.findings = vec![
            Finding::new(Severity::Warning, AS_READ, "beside it"),
            Finding::new(Severity::Warning, "code", long).advise("this helps"),
            Finding::new(Severity::Warning, "code", "another"),
        ];
        let Some((_, said)) = topic.brief(&[]).pop() else {
            unreachable!()
        };
        assert!(
            said.starts_with("word word ") && said.ends_with("word ...; this helps (and 2 more)"),
            "{said}"
        );
        assert!(said.len() < LONGEST + 30);
        // Of a long advice the settings are left.
        topic.findings = vec![
            Finding::new(Severity::Warning, "code", "what it is ".repeat(5))
                .advise("why it helps ".repeat(20))
                .help([GYRO_UNIT.to("deg")]),
        ];
        let said = topic.brief(&[]).pop().unwrap_or_default().1;
        assert!(said.ends_with("what it is : gyro_unit deg"), "{said}");
        let whole = topic.rows(false).len();
        assert!(whole > lines.len());
    }

    #[test]
    fn a_long_line_is_cut_at_a_word_and_digits_are_those_of_the_sigma() {
        assert!(cut(&"word ".repeat(100)).len() <= LONGEST + 4);
        assert_eq!(cut("short"), "short");
        let mut topic = TopicSummary::default();
        topic.counts.add(Verdict::Accepted);
        topic.final_ypr = [1.0, 0.5, 0.25];
        topic.final_sigma = [0.2, 0.1, 0.1];
        assert!(
            topic
                .brief_final()
                .starts_with("roll 14, pitch 29, yaw 57 deg; sigma 11, ")
        );
        topic.final_sigma = [1e-3; 3];
        assert!(topic.brief_final().starts_with("roll 14.324, "));
    }
}
