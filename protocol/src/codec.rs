//! Control blobs: small structures that cross a process boundary once, such as an agent's setup.
//!
//! A blob is four bytes of magic, a version (u16, little endian) and bincode. A reader of another
//! build sees at once that it cannot read it.

use std::{format, string::String, vec::Vec};

use bincode::config::Configuration;
use serde::{Serialize, de::DeserializeOwned};

const MAGIC: [u8; 4] = *b"LMPL";
/// Raised whenever the layout of a blob's type changes.
const VERSION: u16 = 5;
const HEADER_BYTES: usize = MAGIC.len() + size_of::<u16>();
const CONFIG: Configuration = bincode::config::standard();

/// Why bytes are not a blob of ours.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CodecError {
    /// Not written by this program at all.
    #[error("not a Lamplight blob: it begins with {0:02x?}")]
    Magic(Vec<u8>),
    /// Written by another build.
    #[error("blob has version {actual}, this build reads version {VERSION}; use binaries of one build")]
    Version {
        /// The version in the blob.
        actual: u16,
    },
    /// Cut short, or garbled.
    #[error("blob does not decode: {0}")]
    Body(String),
}

/// The blob of `value`.
pub fn encode<T: Serialize>(value: &T) -> Vec<u8> {
    let mut blob = Vec::from(MAGIC);
    blob.extend(VERSION.to_le_bytes());
    let body =
        bincode::serde::encode_to_vec(value, CONFIG).expect("control types have no unserializable part");
    blob.extend(body);
    blob
}

/// Reads a blob back.
pub fn decode<T: DeserializeOwned>(blob: &[u8]) -> Result<T, CodecError> {
    let header = &blob[..blob.len().min(HEADER_BYTES)];
    if header.len() < HEADER_BYTES || header[..MAGIC.len()] != MAGIC {
        return Err(CodecError::Magic(header.to_vec()));
    }
    let actual = u16::from_le_bytes([header[4], header[5]]);
    if actual != VERSION {
        return Err(CodecError::Version { actual });
    }
    let body = &blob[HEADER_BYTES..];
    let garbled = |what: &dyn std::fmt::Display| CodecError::Body(format!("{what}"));
    let (value, read) = bincode::serde::decode_from_slice(body, CONFIG).map_err(|error| garbled(&error))?;
    if read != body.len() {
        return Err(garbled(&std::format_args!("{} bytes left over", body.len() - read)));
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        params::Params,
        setup::{AgentSetup, ClockSetup, Mode, Plane},
        units::Seconds,
    };

    fn setup() -> AgentSetup {
        AgentSetup {
            mode: Mode::Lockstep,
            plane: Plane::PublishSubscribe,
            payload_bytes_max: 128,
            cycle: Seconds::new(0.5).unwrap(),
            clock: ClockSetup { drift_ppm: 0.5, jitter: Seconds::new(0.25).unwrap(), seed: 3 },
            params: Params::of_json(b"{}".to_vec()),
            memory_max_bytes: Some(1 << 40),
            pid_namespace: None,
        }
    }

    #[test]
    fn a_setup_survives() {
        assert_eq!(decode(&encode(&setup())), Ok(setup()));
    }

    /// If this fails the layout has changed: raise `VERSION` and record the new bytes.
    #[test]
    fn the_layout_is_golden() {
        let golden = "4c4d504c0500000180000000000000e03f000000000000e03f000000000000d03f03027b7d01fd000000000001000000";
        let hex: String = encode(&setup()).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(hex, golden);
    }

    #[test]
    fn blobs_of_others_are_refused() {
        assert!(matches!(decode::<AgentSetup>(b"x"), Err(CodecError::Magic(_))));
        let mut newer = encode(&setup());
        newer[4] = 9;
        assert_eq!(decode::<AgentSetup>(&newer), Err(CodecError::Version { actual: 9 }));
        let blob = encode(&setup());
        assert!(matches!(decode::<AgentSetup>(&blob[..20]), Err(CodecError::Body(_))));
    }
}
