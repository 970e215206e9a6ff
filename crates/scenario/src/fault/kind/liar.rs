//! `liar`: packets carry a false reading or other false bytes, or another robot's name.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::hex::PayloadHex;
use crate::number::{Finite, PayloadBytes};
use crate::problem::{Problem, ensure};

/// Packets carry a false reading or a false name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Liar {
    /// The light reading that packets falsely carry, counts; for robots that a law of the paper moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light_counts: Option<Finite>,
    /// Bytes that packets falsely carry in their payloads, such as "00c07f45", from `payload_offset` on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload_hex: Option<PayloadHex>,
    /// Number of the first of these bytes in the payload, from 0; default 0. A packet whose payload ends before the last
    /// one is left as it is.
    #[serde(default = "first", skip_serializing_if = "is_first")]
    pub payload_offset: PayloadBytes,
    /// The robot that packets falsely claim to come from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub identity: Option<u32>,
}

impl Parameters for Liar {
    // They speak as always, if falsely.
    const NATURE: Nature = Nature::of(Strikes::Robots);

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        let is_there = self.light_counts.is_some() || self.identity.is_some() || self.payload_hex.is_some();
        entry.one_of(&["light_counts", "identity", "payload_hex"], is_there)?;
        self.check_payload(entry)?;
        self.check_reading(entry)?;
        entry.counts("light_counts", self.light_counts.map(Finite::get))?;
        self.identity.map_or(Ok(()), |robot| entry.knows("identity", robot))
    }

    fn cut(&mut self, count: u32) -> bool {
        self.identity.is_none_or(|robot| robot < count)
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        let (given, counts) = (1 + draw.below(3), draw.counts_max());
        let reading = (given & 1 > 0).then(|| draw.finite(counts)).flatten();
        let identity = (given & 2 > 0).then(|| draw.robot());
        // Of others' payloads nobody knows what they mean: any bytes will do.
        let light_counts = reading.filter(|_| draw.setting.has_laws_alone());
        let bytes = reading.filter(|_| light_counts.is_none()).map(|reading| {
            let room = usize::from(draw.setting.payload_bytes_max);
            reading.get().to_le_bytes().into_iter().rev().take(room).collect::<Vec<u8>>()
        });
        let payload_hex = bytes.and_then(|bytes| PayloadHex::of(&bytes));
        let is_honest = light_counts.is_none() && payload_hex.is_none() && identity.is_none();
        Self {
            light_counts,
            payload_hex,
            payload_offset: first(),
            identity: if is_honest { Some(0) } else { identity },
        }
    }
}

impl Liar {
    /// Checks that no program thinks for its robots: only the paper's robots send readings of this form.
    fn check_reading(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        let named = entry.target.choice().and_then(|choice| choice.robots.as_ref());
        let is_struck = |robot: &u32| named.is_none_or(|robots| robots.contains(*robot));
        let struck =
            entry.setting.controllers.iter().find_map(|controller| {
                Some((controller.robots.iter().find(is_struck)?, controller.own_name()?))
            });
        let Some((robot, program)) = struck.filter(|_| self.light_counts.is_some()) else { return Ok(()) };
        let message =
            format!("`light_counts` has no meaning for robot {robot}: its payload is up to {program}");
        let hint = "name `robots` that a `law` moves, or give false bytes by `payload_hex`";
        Err(entry.problem(&["light_counts"], message).hint(hint))
    }

    fn check_payload(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        let Some(hex) = &self.payload_hex else {
            return ensure(!entry.gives("payload_offset"), || {
                entry.problem(&["payload_offset"], "`payload_offset` has no meaning without `payload_hex`")
            });
        };
        let end = usize::from(self.payload_offset.get()) + hex.bytes().len();
        let limit = entry.setting.payload_bytes_max;
        ensure(end <= limit.into(), || {
            let message = format!(
                "payload_hex ends at byte {end} of the payload, and no payload has more than \
                 channel.payload_bytes_max = {limit} bytes"
            );
            entry.problem(&["payload_hex"], message)
        })
    }
}

fn first() -> PayloadBytes {
    constant!(PayloadBytes, 0)
}

fn is_first(offset: &PayloadBytes) -> bool {
    *offset == first()
}
