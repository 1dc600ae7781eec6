//! Summaries of several recordings -> whether they are parts of one. Pure.
//!
//! Apart from the run because it is seen when all are done: a recorder that began a new file every minute leaves
//! many, and each of them alone begins with an attitude of its own.

use crate::report::summary::{RunSummary, TopicSummary};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::JOIN;

/// A pause that is none between two files of one recorder, s.
const AT_ONCE_SECS: f64 = 1.0;

/// Notice, given once, of files that continue each other.
pub(super) fn said(summaries: &[RunSummary]) -> Option<Diagnostic> {
    let mut parts: Vec<(&RunSummary, &TopicSummary)> = summaries
        .iter()
        .filter_map(|summary| Some((summary, summary.topics.first()?)))
        .filter(|(_, topic)| topic.span.is_some())
        .collect();
    parts.sort_by_key(|(_, topic)| topic.span);
    let pairs = parts.windows(2).filter_map(|pair| match pair {
        [a, b] => Some((a, b)),
        _ => None,
    });
    let mut continued = pairs.filter(|((_, a), (_, b))| is_continued(a, b));
    let ((a, _), (b, _)) = continued.next()?;
    let more = match continued.count() {
        0 => String::new(),
        more => format!(", and {more} more like it"),
    };
    Some(
        Diagnostic::new(format!(
            "{} goes on where {} ends{more}",
            b.source, a.source
        ))
        .help(format!(
            "{JOIN} makes one recording of files that continue each other"
        )),
    )
}

/// Whether samples of the same sensor follow at once.
fn is_continued(a: &TopicSummary, b: &TopicSummary) -> bool {
    let (Some((_, end)), Some((begin, _))) = (a.span, b.span) else {
        return false;
    };
    let secs = begin.secs_since(end);
    a.topic == b.topic && a.decoded_as == b.decoded_as && secs > 0.0 && secs <= AT_ONCE_SECS
}
