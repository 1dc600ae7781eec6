//! A record without messages -> what it says of the log. Pure.
//!
//! Apart from the scan because nothing is read: what a record says depends on no other, but for the CRC over all.

use crate::mcap::Facts;
use crate::records::problem::ProblemKind;
use crate::records::record::{DataEnd, HeaderRecord, MetadataRecord, Record};

/// Takes what a record says: who wrote the log, how many messages there should be (`claimed`). The CRC so far (`crc`)
/// ends with the data: a problem if it is another one.
pub(super) fn learn(
    record: Record<'_>,
    facts: &mut Facts,
    claimed: &mut Option<u64>,
    crc: &mut Option<crc32fast::Hasher>,
) -> Option<ProblemKind> {
    match record {
        Record::Header(HeaderRecord { profile, library }) if facts.profile.is_empty() => {
            facts.profile = profile.to_owned();
            facts.library = library.to_owned();
        }
        Record::Metadata(MetadataRecord {
            name: "strapd",
            metadata,
        }) if facts.provenance.is_empty() => {
            facts.provenance = metadata
                .into_iter()
                .map(|(key, value)| (key.to_owned(), value.to_owned()))
                .collect();
        }
        Record::Statistics(s) => *claimed = Some(s.message_count),
        Record::DataEnd(DataEnd {
            data_section_crc: stored,
        }) if stored != 0 => {
            let computed = crc.take().map(crc32fast::Hasher::finalize)?;
            return (computed != stored).then_some(ProblemKind::DataCrc { stored, computed });
        }
        _ => {}
    }
    None
}
