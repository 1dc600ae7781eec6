//! A batch of samples -> bytes, in the form of its output. Pure.
//!
//! A stage of its own because this is the part that runs on every thread at once: what a batch
//! becomes depends on nothing but the batch.

use super::batch::Batch;
use super::csv;
use super::json::Objects;
use super::mcap::Layout;
use super::mcap::chunk::{Chunk, Compression};
#[cfg(feature = "parquet")]
use super::parquet::Table;
use super::tum;

/// Form in which a batch becomes bytes.
#[derive(Debug)]
pub(super) enum Form {
    Mcap {
        layout: Layout,
        compression: Compression,
    },
    Ndjson(Vec<Objects>),
    /// CSV, with what is in the last column of every row.
    Csv(String),
    Tum,
    /// Rows are gathered, and so packed where batches are written in order.
    #[cfg(feature = "parquet")]
    Parquet(Box<Table>),
    Null,
}

/// One batch on its way into bytes.
#[derive(Debug, Default)]
pub(super) struct Slot {
    /// Empty when the chunk holds copied messages already.
    pub(super) batch: Batch,
    pub(super) chunk: Chunk,
    pub(super) text: Vec<u8>,
    pub(super) outcome: Option<std::io::Error>,
}

impl Slot {
    /// The parallel part: nothing here depends on any other batch.
    pub(super) fn encode(&mut self, form: &Form) {
        self.text.clear();
        match form {
            Form::Mcap {
                layout,
                compression,
            } => {
                // Without samples the chunk holds copied messages.
                if !self.batch.is_empty() {
                    layout.fill(&mut self.chunk, &self.batch);
                }
                self.outcome = self.chunk.seal(*compression).err();
            }
            Form::Ndjson(objects) => {
                if let Some(objects) = objects.get(self.batch.stream) {
                    objects.push(&mut self.text, &self.batch);
                }
            }
            Form::Csv(last) => {
                for sample in &self.batch.samples {
                    csv::push_row(&mut self.text, sample, last);
                }
                for sample in &self.batch.raw {
                    csv::push_raw_row(&mut self.text, sample, last);
                }
            }
            Form::Tum => {
                for sample in &self.batch.samples {
                    tum::push_row(&mut self.text, sample);
                }
            }
            #[cfg(feature = "parquet")]
            Form::Parquet(_) => {}
            Form::Null => {}
        }
    }
}
