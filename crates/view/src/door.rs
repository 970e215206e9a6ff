//! The door of the page: open to whoever has its token and comes from a page of this very server.
//!
//! The address that is printed has the token; visiting it once leaves a cookie, which every other request must show. `Host`
//! must be an address or `localhost`, so that no name that somebody else controls leads here, and where a browser tells an
//! `Origin`, it must be ours.

use std::{
    fmt,
    fs::File,
    io::{self, Read},
    net::IpAddr,
};

use axum::http::{HeaderMap, HeaderName, header};

/// A secret of one server.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Token(String);

/// Bytes of a token.
const TOKEN_BYTES: usize = 16;

impl Token {
    /// A new one, of the operating system's randomness.
    ///
    /// # Errors
    /// If that cannot be read.
    pub(crate) fn new() -> io::Result<Self> {
        let mut bytes = [0; TOKEN_BYTES];
        File::open("/dev/urandom")?.read_exact(&mut bytes)?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Whether `text` is this one; how long that takes says nothing.
    fn is(&self, text: &str) -> bool {
        let (ours, theirs) = (self.0.as_bytes(), text.as_bytes());
        let differ = ours.iter().zip(theirs).fold(0, |all, (a, b)| all | (a ^ b));
        ours.len() == theirs.len() && differ == 0
    }
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

/// Why somebody may not enter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    Token,
    Host,
    Origin,
}

impl Refusal {
    /// In words for whoever asks.
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Token => "open the address that lamplight has printed, with its token\n",
            Self::Host => "open this page by its address, or as localhost\n",
            Self::Origin => "this comes from another page\n",
        }
    }
}

/// The door of one server.
#[derive(Clone, Debug)]
pub(crate) struct Door {
    pub(crate) token: Token,
    pub(crate) port: u16,
}

impl Door {
    /// Name of the cookie: servers on other ports of this machine have others.
    fn cookie(&self) -> String {
        format!("lamplight_{}", self.port)
    }

    /// The cookie that a browser is told to keep.
    pub(crate) fn set_cookie(&self) -> String {
        format!("{}={}; HttpOnly; SameSite=Strict; Path=/", self.cookie(), self.token)
    }

    /// Whether `token` opens.
    pub(crate) fn opens(&self, token: &str) -> bool {
        self.token.is(token)
    }

    /// Whether a request with these headers comes from where it may, whatever it shows.
    pub(crate) fn knows_place(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let host = text(headers, &header::HOST).ok_or(Refusal::Host)?;
        let (name, port) = match host.rsplit_once(':') {
            Some((name, port)) if !port.ends_with(']') => (name, port.parse().map_err(|_| Refusal::Host)?),
            _ => (host, 80),
        };
        let bare = name.trim_start_matches('[').trim_end_matches(']');
        if port != self.port || (name != "localhost" && bare.parse::<IpAddr>().is_err()) {
            return Err(Refusal::Host);
        }
        match text(headers, &header::ORIGIN) {
            Some(origin) if origin != format!("http://{host}") => Err(Refusal::Origin),
            _ => Ok(()),
        }
    }

    /// Whether a request with these headers may enter.
    pub(crate) fn admits(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        self.knows_place(headers)?;
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut pairs =
            cookies.flat_map(|cookies| cookies.split(';')).filter_map(|it| it.trim().split_once('='));
        let name = self.cookie();
        match pairs.any(|(key, value)| key == name && self.token.is(value)) {
            true => Ok(()),
            false => Err(Refusal::Token),
        }
    }
}

fn text<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    headers.get(name)?.to_str().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(pairs: &[(HeaderName, &str)]) -> Result<(), Refusal> {
        let door = Door { token: Token("secret".into()), port: 8080 };
        let mut headers = HeaderMap::new();
        for (name, value) in pairs {
            headers.append(name, value.parse().unwrap());
        }
        door.admits(&headers)
    }

    #[test]
    fn only_who_has_the_token_and_comes_from_our_page_may_enter() {
        use header::{COOKIE, HOST, ORIGIN};
        let cookie = (COOKIE, "other=1; lamplight_8080=secret");
        for host in ["127.0.0.1:8080", "localhost:8080", "[::1]:8080", "192.0.2.7:8080"] {
            assert_eq!(asked(&[(HOST, host), cookie.clone()]), Ok(()), "{host}");
            let origin = format!("http://{host}");
            assert_eq!(asked(&[(HOST, host), cookie.clone(), (ORIGIN, &origin)]), Ok(()));
        }
        for host in ["evil.example:8080", "127.0.0.1:80", "127.0.0.1", "localhost", ""] {
            assert_eq!(asked(&[(HOST, host), cookie.clone()]), Err(Refusal::Host), "{host:?}");
        }
        assert_eq!(asked(std::slice::from_ref(&cookie)), Err(Refusal::Host));
        let here = (HOST, "127.0.0.1:8080");
        for origin in ["http://evil.example", "http://127.0.0.1:8081", "https://127.0.0.1:8080", "null"] {
            assert_eq!(asked(&[here.clone(), cookie.clone(), (ORIGIN, origin)]), Err(Refusal::Origin));
        }
        for wrong in ["", "lamplight_8080=", "lamplight_8080=secreT", "lamplight_8081=secret"] {
            assert_eq!(asked(&[here.clone(), (COOKIE, wrong)]), Err(Refusal::Token), "{wrong:?}");
        }
        assert_eq!(asked(&[here]), Err(Refusal::Token));
    }

    #[test]
    fn no_two_tokens_are_the_same() {
        let (one, other) = (Token::new().unwrap(), Token::new().unwrap());
        assert!(one != other && one.to_string().len() == 2 * TOKEN_BYTES);
        assert!(!format!("{one:?}").contains(&one.to_string()));
    }
}
