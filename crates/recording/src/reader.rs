//! Reads a recording from its beginning to its end, or to where it was cut.

use std::{
    collections::BTreeMap,
    io::{self, Read},
};

use mcap::{
    McapError, parse_record,
    records::Record,
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};
use prost::Message;

use crate::topic::Topic;

/// Longest record that is read, bytes: longer than any that is written.
const RECORD_BYTES_MAX: usize = 1 << 28;

/// Why a file is no recording that can be read on.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system said no.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is another kind of file.
    #[error("it is no MCAP file")]
    Foreign,
    /// A message does not decode.
    #[error("a message on {0} does not decode: {1}")]
    Message(&'static str, prost::DecodeError),
}

/// A message of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its topic.
    pub topic: Topic,
    /// Virtual time, nanoseconds.
    pub time_ns: u64,
    pub(crate) data: Vec<u8>,
}

impl Entry {
    /// Reads it as a message of its topic's kind.
    ///
    /// # Errors
    /// If it is none.
    pub fn message<M: Message + Default>(&self) -> Result<M, ReadError> {
        M::decode(&self.data[..]).map_err(|error| ReadError::Message(self.topic.name(), error))
    }
}

/// Messages of a recording in their order. Topics of others are passed over.
pub struct Reader<R> {
    file: R,
    records: LinearReader,
    topics: BTreeMap<u16, Topic>,
    has_begun: bool,
    /// Why it ended before its end, if it did.
    cut: Option<String>,
}

/// The next record, as a reader of messages sees it.
enum Next {
    More(usize),
    Channel(u16, Option<Topic>),
    Entry(Entry),
    Other,
    End(Option<McapError>),
}

impl<R: Read> Reader<R> {
    /// Reads from the beginning of `file`.
    pub fn new(file: R) -> Self {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(RECORD_BYTES_MAX);
        let records = LinearReader::new_with_options(options);
        Self { file, records, topics: BTreeMap::new(), has_begun: false, cut: None }
    }

    /// Returns the next message, or `None` if there is no other that is whole.
    ///
    /// # Errors
    /// If the file cannot be read, or is no recording at all.
    pub fn next_entry(&mut self) -> Result<Option<Entry>, ReadError> {
        while self.cut.is_none() {
            match self.next_record() {
                Next::More(bytes) => {
                    let read = self.file.read(self.records.insert(bytes))?;
                    self.records.notify_read(read);
                }
                Next::Channel(id, topic) => {
                    self.has_begun = true;
                    topic.map(|topic| self.topics.insert(id, topic));
                }
                Next::Entry(entry) => return Ok(Some(entry)),
                Next::Other => self.has_begun = true,
                Next::End(None) => return Ok(None),
                Next::End(Some(_)) if !self.has_begun => return Err(ReadError::Foreign),
                Next::End(Some(why)) => self.cut = Some(why.to_string()),
            }
        }
        Ok(None)
    }

    /// Returns why the recording ended before its end, once it has.
    pub fn cut(&self) -> Option<&str> {
        self.cut.as_deref()
    }

    fn next_record(&mut self) -> Next {
        let (opcode, data) = match self.records.next_event() {
            None => return Next::End(None),
            Some(Err(error)) => return Next::End(Some(error)),
            Some(Ok(LinearReadEvent::ReadRequest(bytes))) => return Next::More(bytes),
            Some(Ok(LinearReadEvent::Record { opcode, data })) => (opcode, data),
        };
        match parse_record(opcode, data) {
            Err(error) => Next::End(Some(error)),
            Ok(Record::Channel(channel)) => {
                let topic = Topic::ALL.into_iter().find(|topic| topic.name() == channel.topic);
                Next::Channel(channel.id, topic)
            }
            Ok(Record::Message { header, data }) => match self.topics.get(&header.channel_id) {
                Some(&topic) => {
                    Next::Entry(Entry { topic, time_ns: header.log_time, data: data.into_owned() })
                }
                None => Next::Other,
            },
            Ok(_) => Next::Other,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::{
        messages::lamplight::{End, Tick},
        writer::Writer,
    };

    fn tick(tick: u64) -> Tick {
        // Hardly to be compressed, as true hashes are.
        let hash = |robot: u64| (tick * 1000 + robot).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Tick { tick, hashes: (0..30).map(hash).collect() }
    }

    /// A recording of ten ticks that was flushed after the fifth.
    fn recording() -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = Writer::new(&mut bytes).unwrap();
        for number in 0..10 {
            writer.write(Topic::Ticks, number * 100, &tick(number)).unwrap();
            if number == 4 {
                writer.flush().unwrap();
            }
        }
        writer.write(Topic::End, 900, &End { summary: "{}".into() }).unwrap();
        writer.finish().unwrap();
        bytes.into_inner()
    }

    fn read(bytes: &[u8]) -> Result<(Vec<Entry>, bool), ReadError> {
        let mut reader = Reader::new(bytes);
        let mut entries = Vec::new();
        while let Some(entry) = reader.next_entry()? {
            entries.push(entry);
        }
        Ok((entries, reader.cut().is_some()))
    }

    #[test]
    fn what_was_written_is_read() {
        let (entries, is_cut) = read(&recording()).unwrap();
        assert!(!is_cut && entries.len() == 11);
        for (number, entry) in (0..10).zip(&entries) {
            assert_eq!((entry.topic, entry.time_ns), (Topic::Ticks, number * 100));
            assert_eq!(entry.message::<Tick>().unwrap(), tick(number));
        }
        assert_eq!(entries[10].message::<End>().unwrap().summary, "{}");
    }

    #[test]
    fn wherever_it_is_cut_what_was_flushed_before_is_read() {
        let whole = recording();
        let (all, _) = read(&whole).unwrap();
        let mut most = 0;
        // Every seventh place, and all of the last ones.
        for length in (0..whole.len()).filter(|length| length % 7 == 0 || length + 100 > whole.len()) {
            let Ok((entries, is_cut)) = read(&whole[..length]) else {
                assert!(length < 1000, "{length}");
                continue;
            };
            assert_eq!(entries[..], all[..entries.len()]);
            assert!(entries.len() >= most, "{length}");
            assert!(is_cut, "{length} of {}", whole.len());
            most = entries.len();
        }
        assert_eq!(most, all.len());
    }

    #[test]
    fn other_files_are_no_recordings() {
        for bytes in [&b""[..], b"hello, this is some text and no recording at all", &[0; 100]] {
            assert!(matches!(read(bytes), Err(ReadError::Foreign)));
        }
    }
}
