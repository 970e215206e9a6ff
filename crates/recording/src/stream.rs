//! Messages one after the other, as they go from process to process: without chunks, compression or schemas.
//!
//! ```text
//! length of the message (u32) | topic (u8) | virtual time in nanoseconds (u64) | message
//! ```
//!
//! Numbers are little endian; a topic is its place in [`Topic::ALL`].

use std::io::{self, Read, Write};

use prost::Message;

use crate::{reader::Entry, topic::Topic};

/// Bytes before each message.
const HEAD_BYTES: usize = 13;
/// Longest message that is read, bytes: longer than any that is written.
const MESSAGE_BYTES_MAX: usize = 1 << 28;

/// Writes messages.
#[derive(Debug)]
pub struct StreamWriter<W> {
    to: W,
    message: Vec<u8>,
}

impl<W: Write> StreamWriter<W> {
    /// Writes to `to`, in large pieces.
    pub fn new(to: W) -> Self {
        Self { to, message: Vec::new() }
    }

    /// Writes a message.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, topic: Topic, time_ns: u64, message: &impl Message) -> io::Result<()> {
        self.message.clear();
        self.message.resize(HEAD_BYTES, 0);
        message.encode(&mut self.message).expect("a vector takes all that is written to it");
        let length = (self.message.len() - HEAD_BYTES) as u32;
        self.message[..4].copy_from_slice(&length.to_le_bytes());
        self.message[4] = Topic::ALL.iter().position(|it| *it == topic).expect("all are there") as u8;
        self.message[5..HEAD_BYTES].copy_from_slice(&time_ns.to_le_bytes());
        self.to.write_all(&self.message)
    }

    /// Hands on all that was written.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Reads messages.
#[derive(Debug)]
pub struct StreamReader<R>(R);

impl<R: Read> StreamReader<R> {
    /// Reads from `from`, in large pieces.
    pub fn new(from: R) -> Self {
        Self(from)
    }

    /// Waits for the next message; `None` at the end.
    ///
    /// # Errors
    /// If it ends within a message, or says what no message is.
    pub fn next_entry(&mut self) -> io::Result<Option<Entry>> {
        let mut head = [0; HEAD_BYTES];
        if self.0.read(&mut head[..1])? == 0 {
            return Ok(None);
        }
        self.0.read_exact(&mut head[1..])?;
        let length = u32::from_le_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let topic = Topic::ALL.get(usize::from(head[4])).copied();
        let topic = topic.filter(|_| length <= MESSAGE_BYTES_MAX).ok_or(io::ErrorKind::InvalidData)?;
        let mut time_ns = [0; 8];
        time_ns.copy_from_slice(&head[5..]);
        let mut data = vec![0; length];
        self.0.read_exact(&mut data)?;
        Ok(Some(Entry { topic, time_ns: u64::from_le_bytes(time_ns), data }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::lamplight::Tick;

    #[test]
    fn messages_are_read_as_they_were_written() {
        let mut bytes = Vec::new();
        let mut writer = StreamWriter::new(&mut bytes);
        let tick = |tick| Tick { tick, hashes: vec![7; 3] };
        for number in 0..3 {
            writer.write(Topic::Ticks, number * 100, &tick(number)).unwrap();
        }
        let mut reader = StreamReader::new(&bytes[..]);
        for number in 0..3 {
            let entry = reader.next_entry().unwrap().unwrap();
            assert_eq!((entry.topic, entry.time_ns), (Topic::Ticks, number * 100));
            assert_eq!(entry.message::<Tick>().unwrap(), tick(number));
        }
        assert!(reader.next_entry().unwrap().is_none());
        let mut cut = StreamReader::new(&bytes[..bytes.len() - 1]);
        assert!(cut.next_entry().is_ok() && cut.next_entry().is_ok() && cut.next_entry().is_err());
        assert!(StreamReader::new(&[255; 40][..]).next_entry().is_err());
    }
}
