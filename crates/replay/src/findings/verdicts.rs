//! Outcomes of samples -> findings, one for each verdict that there was. Pure.
//!
//! Apart from the rest because it must be complete: what conditioning turns away and nobody names is lost in silence.

use super::samples::{gyro_absent, some};
use super::{Finding, Severity};
use strapd_attitude::record::{Counts, Verdict};
use strapd_attitude::setting::{GYRO_UNIT, RATE_HZ, START, TIME, UNTIL};

/// Code of samples without a stamp.
pub(super) const NO_STAMP: &str = "no-stamp";

/// Each verdict that samples got, but for those that were plainly used.
pub(super) fn find(counts: &Counts) -> Vec<Finding> {
    let found = |verdict: &Verdict| of(*verdict, counts.get(*verdict), counts.total());
    Verdict::ALL.iter().filter_map(found).collect()
}

/// The finding of `n` samples of `total` with this verdict. What is lost is an error.
fn of(verdict: Verdict, n: u64, total: u64) -> Option<Finding> {
    use Severity::{Error, Note, Warning};
    let found = |(severity, code), what: &str, advice: &str| {
        some((n, total), (severity, code), what, advice)
    };
    match verdict {
        Verdict::Accepted => None,
        Verdict::Reordered => found(
            (Warning, "disorder"),
            "samples came after one that is newer, and were put back in place",
            "nothing is lost by it",
        ),
        Verdict::Undecodable => found(
            (Error, "undecodable"),
            "payloads cannot be decoded",
            "they are left out and counted",
        ),
        Verdict::NoGyro => gyro_absent(n, total),
        Verdict::NotFinite => found(
            (Error, "not-finite"),
            "samples have NaN or infinity in the gyro",
            "they are left out; the attitude is carried across them",
        ),
        Verdict::Huge => Some(
            found(
                (Error, "huge-rate"),
                "samples have a rate that no gyro can have (above 40,000 rad/s, or a delta angle above 1000 rad)",
                "they are left out: a damaged value, or raw counts or another unit",
            )?
            .help([GYRO_UNIT.to("deg|mrad")]),
        ),
        Verdict::Repeated => found(
            (Warning, "repeats"),
            "samples repeat their predecessor, stamp and data",
            "they are left out",
        ),
        Verdict::DuplicateStamp => found(
            (Error, "duplicate-stamp"),
            "samples share their stamp with another that has other data, and there is no room beside it",
            "they are left out; another clock may tell them apart",
        )
        .map(other_clock),
        Verdict::Late => found(
            (Error, "late"),
            "samples are older than what was integrated before they came",
            "they are left out; another clock may be in order",
        )
        .map(other_clock),
        Verdict::NoStamp => found(
            (Error, NO_STAMP),
            "samples have no stamp, or one of 0 amid others",
            "take the recorder's time",
        )
        .map(|found| found.help([TIME.to("log")])),
        Verdict::FarStamp => found(
            (Error, "far-stamp"),
            "samples have a stamp more than 146 years from 1970, before 1824 or after 2116",
            "they are left out: the clock, or the unit of its numbers, is wrong; take the recorder's time",
        )
        .map(|found| found.help([TIME.to("log")]).help([TIME.to("index"), RATE_HZ.to("HZ")])),
        Verdict::Trimmed => found(
            (Note, "trimmed"),
            &format!("samples lie outside {START}, {UNTIL}"),
            "they are left out, as was asked",
        ),
        Verdict::Restamped => found(
            (Warning, "shared-stamps"),
            "samples share their stamp with another that has other data",
            "each was given a stamp of its own between its neighbours",
        ),
        Verdict::StrayStamp => found(
            (Error, "stray-stamp"),
            "samples have a stamp far ahead of those before and after them",
            "they are left out; another clock may be steadier",
        )
        .map(other_clock),
    }
}

fn other_clock(finding: Finding) -> Finding {
    finding.help([TIME.to("log|header")])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_verdict_but_accepted_has_a_finding_and_every_loss_is_an_error() {
        let mut codes = std::collections::BTreeSet::new();
        for verdict in Verdict::ALL {
            let mut counts = Counts::default();
            counts.add_many(Verdict::Accepted, 10);
            counts.add_many(verdict, 2);
            let found = find(&counts);
            if verdict == Verdict::Accepted {
                assert_eq!(found, []);
                continue;
            }
            let [one] = found.as_slice() else {
                unreachable!("{verdict:?}: {found:?}")
            };
            let is_error = one.severity == Severity::Error;
            assert_eq!(is_error, verdict.is_loss(), "{one:?}");
            assert!(one.what.starts_with("2 of 12 "), "{one:?}");
            assert!(codes.insert(one.code), "{} twice", one.code);
        }
    }
}
