//! The server of a page: HTTP and WebSockets, in a thread of its own.

use std::{
    io,
    net::{SocketAddr, TcpListener},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use axum::{
    Router,
    extract::{FromRequestParts, Request, State, WebSocketUpgrade},
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
    routing::any,
};
use observe::live::ListenAddr;

use crate::{
    door::{Door, Refusal, Token},
    page,
    session::{self, Show, Source, Untold},
};

/// Most pages at once; one more is turned away.
pub(crate) const CLIENTS_MAX: usize = 32;
/// Longest message of a page, bytes.
const MESSAGE_BYTES_MAX: usize = 1 << 16;

/// Why a page cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address is taken, or not ours.
    #[error("cannot serve the page at {address}: {error}; choose another port, or none for any that is free")]
    Bind {
        /// The address.
        address: ListenAddr,
        /// The system's error.
        error: io::Error,
    },
    /// The operating system said no.
    #[error("cannot serve the page: {0}")]
    Io(#[from] io::Error),
}

/// A page that will be served.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    token: Token,
}

/// State by which every request is answered.
#[derive(Clone)]
struct Shared {
    door: Door,
    source: Arc<dyn Source>,
    clients: Arc<AtomicUsize>,
    untold: Untold,
}

impl Server {
    /// Takes `address`.
    ///
    /// # Errors
    /// If it is in use, or not ours.
    pub fn bind(address: ListenAddr) -> Result<Self, ServeError> {
        let listener = TcpListener::bind(address.0).map_err(|error| ServeError::Bind { address, error })?;
        listener.set_nonblocking(true)?;
        Ok(Self { address: listener.local_addr()?, listener, token: Token::new()? })
    }

    /// The address that opens the page.
    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.address, self.token)
    }

    /// Serves what is shown until this process ends.
    ///
    /// # Errors
    /// If no thread can be made for it.
    pub fn serve(self, Show(source): Show) -> Result<Serving, ServeError> {
        let Self { listener, address, token } = self;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let door = Door { token, port: address.port() };
        let untold = Untold::default();
        let shared = Shared { door, source, clients: Arc::default(), untold: untold.clone() };
        let app = Router::new().route("/stream", any(stream)).fallback(file).with_state(shared);
        thread::Builder::new().name("page".into()).spawn(move || {
            runtime.block_on(async {
                let served = match tokio::net::TcpListener::from_std(listener) {
                    Ok(listener) => axum::serve(listener, app).await,
                    Err(error) => Err(error),
                };
                if let Err(error) = served {
                    tracing::warn!("the page is no longer served: {error}");
                }
            });
        })?;
        Ok(Serving(untold))
    }
}

/// A page that is served.
#[derive(Debug)]
pub struct Serving(Untold);

impl Serving {
    /// Waits until open pages have been told that what they show is over, a second at most.
    pub fn end(self) {
        self.0.wait();
    }
}

/// A part of the page. The address with the token leaves a cookie, and leads to the one without.
async fn file(State(shared): State<Shared>, request: Request) -> Response {
    let (door, uri) = (&shared.door, request.uri());
    if let Some(token) = uri.query().and_then(|query| query.strip_prefix("token=")) {
        return match door.knows_place(request.headers()) {
            Err(refusal) => refused(refusal),
            Ok(()) if !door.opens(token) => refused(Refusal::Token),
            Ok(()) => {
                let headers = [(header::SET_COOKIE, door.set_cookie()), (header::LOCATION, "/".into())];
                (StatusCode::SEE_OTHER, headers).into_response()
            }
        };
    }
    if let Err(refusal) = door.admits(request.headers()) {
        return refused(refusal);
    }
    let Some((kind, bytes)) = page::file(uri.path()) else {
        return (StatusCode::NOT_FOUND, "there is no such file\n").into_response();
    };
    let fixed = |value: &'static str| HeaderValue::from_static(value);
    let headers = [
        (header::CONTENT_TYPE, fixed(kind)),
        (header::CACHE_CONTROL, fixed("no-store")),
        (header::CONTENT_SECURITY_POLICY, fixed(page::POLICY)),
        (header::X_CONTENT_TYPE_OPTIONS, fixed("nosniff")),
        (header::REFERRER_POLICY, fixed("no-referrer")),
        (header::X_FRAME_OPTIONS, fixed("DENY")),
    ];
    (headers, bytes).into_response()
}

/// The stream of a page.
async fn stream(State(shared): State<Shared>, request: Request) -> Response {
    if let Err(refusal) = shared.door.admits(request.headers()) {
        return refused(refusal);
    }
    let (mut parts, _) = request.into_parts();
    let upgrade = match WebSocketUpgrade::from_request_parts(&mut parts, &()).await {
        Ok(upgrade) => upgrade,
        Err(refusal) => return refusal.into_response(),
    };
    if shared.clients.fetch_add(1, Ordering::Relaxed) >= CLIENTS_MAX {
        shared.clients.fetch_sub(1, Ordering::Relaxed);
        let why = format!("{CLIENTS_MAX} pages are open already\n");
        return (StatusCode::SERVICE_UNAVAILABLE, why).into_response();
    }
    let leaving = Leaving(Arc::clone(&shared.clients));
    upgrade.max_message_size(MESSAGE_BYTES_MAX).max_frame_size(MESSAGE_BYTES_MAX).on_upgrade(
        async move |socket| {
            let _leaving = leaving;
            session::talk(socket, shared.source, shared.untold).await;
        },
    )
}

/// Counts a client no more, however it ends.
struct Leaving(Arc<AtomicUsize>);

impl Drop for Leaving {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

fn refused(refusal: Refusal) -> Response {
    (StatusCode::FORBIDDEN, refusal.text()).into_response()
}
