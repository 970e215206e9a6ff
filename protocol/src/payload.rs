//! The payload of a packet: bytes of the controller's own, which nobody on the way reads.

use alloc::boxed::Box;
use core::{
    fmt,
    ops::{Deref, DerefMut},
};

/// Longest payload that a scenario may allow, in bytes.
pub const PAYLOAD_BYTES_MAX: usize = 128;

/// Longest payload whose frame lies in a message itself, in bytes: up to this one costs nothing. With its length, such a
/// frame fills three words of shared memory, and how many lines of cache a percept takes is most of what it costs.
pub const SHORT_PAYLOAD_BYTES: usize = 9;

/// Bytes that a robot says to its neighbors, up to [`PAYLOAD_BYTES_MAX`] bytes; it dereferences to them.
///
/// A short one is small and needs no memory of its own: it is moved often, and most controllers say a number or two.
///
/// ```
/// use protocol::payload::Payload;
///
/// let payload = Payload::from(7_u16.to_le_bytes());
/// assert_eq!(*payload, [7, 0]);
/// assert!(Payload::try_from(&[0; 129][..]).is_err());
/// ```
#[derive(Clone)]
pub struct Payload(Bytes);

#[derive(Clone)]
enum Bytes {
    Short { len: u8, bytes: [u8; SHORT_PAYLOAD_BYTES] },
    Long(Box<[u8]>),
}

/// More bytes than any packet carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a payload of {0} bytes is longer than any packet's, which is at most {PAYLOAD_BYTES_MAX}")]
pub struct PayloadTooLong(pub usize);

/// More bytes than a robot of this run may say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "its payload of {length} bytes is longer than the {limit} that `channel.payload_bytes_max` allows (up to {PAYLOAD_BYTES_MAX})"
)]
pub struct PayloadOverLimit {
    /// Length of the payload, bytes.
    pub length: usize,
    /// The longest that is allowed, bytes.
    pub limit: usize,
}

impl Payload {
    /// No bytes: a packet that says no more than that its sender is there.
    pub const EMPTY: Self = Self(Bytes::Short { len: 0, bytes: [0; SHORT_PAYLOAD_BYTES] });

    #[inline]
    fn new(payload: &[u8]) -> Self {
        // First the one that is most frequent, and copied in one piece.
        match payload.first_chunk::<4>().filter(|usual| usual.len() == payload.len()) {
            Some(usual) => Self::short(usual),
            None => Self::of_any(payload),
        }
    }

    #[inline]
    fn short(payload: &[u8]) -> Self {
        let mut bytes = [0; SHORT_PAYLOAD_BYTES];
        bytes[..payload.len()].copy_from_slice(payload);
        Self(Bytes::Short { len: payload.len() as u8, bytes })
    }

    #[inline(never)]
    fn of_any(payload: &[u8]) -> Self {
        match payload.len() <= SHORT_PAYLOAD_BYTES {
            true => Self::short(payload),
            false => Self(Bytes::Long(payload.into())),
        }
    }
}

/// No bytes.
impl Default for Payload {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl<const N: usize> From<[u8; N]> for Payload {
    #[inline]
    fn from(payload: [u8; N]) -> Self {
        const { assert!(N <= PAYLOAD_BYTES_MAX, "no packet carries so many bytes") };
        Self::new(&payload)
    }
}

impl TryFrom<&[u8]> for Payload {
    type Error = PayloadTooLong;

    #[inline]
    fn try_from(payload: &[u8]) -> Result<Self, PayloadTooLong> {
        match payload.len() {
            ..=PAYLOAD_BYTES_MAX => Ok(Self::new(payload)),
            length => Err(PayloadTooLong(length)),
        }
    }
}

impl Deref for Payload {
    type Target = [u8];

    #[inline]
    fn deref(&self) -> &[u8] {
        match &self.0 {
            Bytes::Short { len, bytes } => &bytes[..usize::from(*len)],
            Bytes::Long(bytes) => bytes,
        }
    }
}

/// Bytes may be changed; how many there are may not.
impl DerefMut for Payload {
    #[inline]
    fn deref_mut(&mut self) -> &mut [u8] {
        match &mut self.0 {
            Bytes::Short { len, bytes } => &mut bytes[..usize::from(*len)],
            Bytes::Long(bytes) => bytes,
        }
    }
}

impl PartialEq for Payload {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl fmt::Debug for Payload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}
