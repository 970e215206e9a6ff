//! Addresses that this process listens at.

use std::{
    fmt,
    net::{IpAddr, Ipv4Addr, SocketAddr},
    str::FromStr,
};

use serde::{Deserialize, Serialize};

/// An address to listen at: `127.0.0.1:8080`, `[::1]:8080`, or `:8080` on this machine alone; port 0 is any that is free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListenAddr(pub SocketAddr);

impl FromStr for ListenAddr {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let port = text.strip_prefix(':').or_else(|| text.strip_prefix("localhost:"));
        let address = match port {
            Some(port) => port.parse().ok().map(|port| (IpAddr::V4(Ipv4Addr::LOCALHOST), port).into()),
            None => text.parse().ok(),
        };
        let hint = "use an address and a port, such as 127.0.0.1:8080, or :8080 for this machine alone";
        address.map(Self).ok_or_else(|| hint.into())
    }
}

impl fmt::Display for ListenAddr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_without_a_host_are_of_this_machine() {
        let parsed = |text: &str| text.parse::<ListenAddr>().map(|address| address.to_string());
        for (text, address) in [
            (":9464", "127.0.0.1:9464"),
            ("localhost:0", "127.0.0.1:0"),
            ("0.0.0.0:9464", "0.0.0.0:9464"),
            ("[::1]:9464", "[::1]:9464"),
        ] {
            assert_eq!(parsed(text).as_deref(), Ok(address));
        }
        for bad in ["", "9464", ":", ":70000", "host:9464", "127.0.0.1"] {
            assert!(parsed(bad).is_err(), "{bad:?}");
        }
    }
}
