//! Metrics over HTTP, for Prometheus and for `curl`: `GET /metrics`.
//!
//! One route and one kind of client: a request, which `httparse` reads, an answer, the end of the connection. HTTP
//! servers that are kept up want an asynchronous runtime, which nothing else here needs; so `server.rs` serves the
//! connections, and the run's loop never waits.

use std::{io, net::TcpListener, sync::Arc};

use super::{address::ListenAddr, prometheus, server, state::Live};

/// Longest request that is read, bytes.
const REQUEST_MAX: usize = 8192;
/// Most headers that are read.
const HEADERS_MAX: usize = 64;
/// Content type of a scrape: Prometheus text of this version.
const TEXT: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Why metrics cannot be served.
#[derive(Debug, thiserror::Error)]
#[error("--metrics {address}: {error}; choose another port, or 0 for any that is free")]
pub struct BindError {
    address: ListenAddr,
    error: io::Error,
}

/// Metrics that will be served.
#[derive(Debug)]
pub struct Endpoint(TcpListener);

impl Endpoint {
    /// Takes `address`.
    ///
    /// # Errors
    /// If it is in use, or not ours.
    pub fn bind(address: ListenAddr) -> Result<Self, BindError> {
        TcpListener::bind(address.0).map(Self).map_err(|error| BindError { address, error })
    }

    /// Serves until this process ends, and says where.
    ///
    /// # Errors
    /// If no thread can be made for it.
    pub fn serve(self, live: Arc<Live>) -> io::Result<()> {
        let Self(listener) = self;
        tracing::info!("metrics at http://{}/metrics", listener.local_addr()?);
        server::serve("metrics", listener.into(), live, answer)
    }
}

/// Waits for a request to the end of its headers: a client that is answered while it still talks may take that for a
/// broken connection.
fn answer(live: &Live, text: &[u8], ended: bool) -> Option<Vec<u8>> {
    let request = match read(text) {
        None if !ended && text.len() <= REQUEST_MAX => return None,
        request => request.unwrap_or(Request::Broken),
    };
    let (status, kind, body) = match &request {
        Request::Get { path, .. } if path.split('?').next() == Some("/metrics") => {
            ("200 OK", TEXT, prometheus::text(&live.ask()))
        }
        Request::Get { .. } => ("404 Not Found", "text/plain", "metrics are at /metrics\n".into()),
        Request::Other => ("405 Method Not Allowed\r\nAllow: GET, HEAD", "text/plain", String::new()),
        Request::Broken => ("400 Bad Request", "text/plain", String::new()),
    };
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
    );
    let head_only = matches!(request, Request::Get { head_only: true, .. });
    Some(if head_only { head } else { head + &body }.into_bytes())
}

/// Request of a client.
#[derive(Debug)]
enum Request {
    /// To read something.
    Get { path: String, head_only: bool },
    /// A method that is not served.
    Other,
    /// Nothing that is HTTP.
    Broken,
}

/// Reads a request; `None` if it goes on.
fn read(text: &[u8]) -> Option<Request> {
    let mut headers = [httparse::EMPTY_HEADER; HEADERS_MAX];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(text) {
        Ok(httparse::Status::Partial) => None,
        Ok(httparse::Status::Complete(_)) => Some(Request::of(&request)),
        Err(_) => Some(Request::Broken),
    }
}

impl Request {
    fn of(request: &httparse::Request<'_, '_>) -> Self {
        match (request.method, request.path) {
            (Some(method @ ("GET" | "HEAD")), Some(path)) => {
                Self::Get { path: path.into(), head_only: method == "HEAD" }
            }
            _ => Self::Other,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{
        io::{Read, Write},
        net::{SocketAddr, TcpStream},
    };

    use super::*;
    use crate::live::snapshot::about;

    fn exchange(address: SocketAddr, request: &str) -> String {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    #[test]
    fn metrics_are_served_and_nothing_else_is() {
        let endpoint = Endpoint::bind(":0".parse().unwrap()).unwrap();
        let address = endpoint.0.local_addr().unwrap();
        assert!(address.ip().is_loopback());
        let taken = Endpoint::bind(ListenAddr(address)).unwrap_err().to_string();
        assert!(taken.contains(&address.to_string()) && taken.contains("in use"), "{taken}");
        endpoint.serve(Arc::new(Live::new(about(), 10, true))).unwrap();
        let scrape = exchange(address, "GET /metrics HTTP/1.1\r\nHost: lab\r\n\r\n");
        assert!(scrape.starts_with("HTTP/1.1 200 OK\r\n") && scrape.contains(TEXT), "{scrape}");
        let (_, body) = scrape.split_once("\r\n\r\n").unwrap();
        assert!(body.contains("\nlamplight_ticks_total 0\n"), "{body}");
        assert!(scrape.contains(&format!("Content-Length: {}\r\n", body.len())), "{scrape}");
        let head = exchange(address, "HEAD /metrics HTTP/1.1\r\n\r\n");
        assert!(head.starts_with("HTTP/1.1 200 OK\r\n") && head.ends_with("\r\n\r\n"), "{head}");
        for (request, status) in [
            ("GET / HTTP/1.1\r\n\r\n", "404"),
            ("POST /metrics HTTP/1.1\r\n\r\n", "405"),
            ("hello\r\n\r\n", "400"),
            ("GET /metrics\r\n\r\n", "400"),
            (&format!("GET /{} HTTP/1.1", "m".repeat(REQUEST_MAX)), "400"),
        ] {
            let answer = exchange(address, request);
            assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{request:?}: {answer}");
        }
    }
}
