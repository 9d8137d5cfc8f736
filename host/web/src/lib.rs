//! Pages on loopback: a server on a thread of its own, which answers only requests that name its address.
//!
//! A browser also sends the requests of foreign pages. A page elsewhere can reach this address under a name of its own,
//! so a request whose `Host` is another one is refused.

pub use axum::Router;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use serde_json::Value;
use std::net::{SocketAddr, TcpListener};
use std::thread::{self, JoinHandle};
use tokio::sync::oneshot;

/// Why a page cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum WebError {
    /// The text is no address.
    #[error("`{0}` is no address of a page")]
    NoAddress(String),
    /// Other machines could reach the address.
    #[error("{0} is reachable from other machines")]
    NotLoopback(SocketAddr),
    /// The address cannot be bound.
    #[error("cannot serve the page on {address}: {source}")]
    Bind {
        /// The address.
        address: SocketAddr,
        /// Message of the system.
        source: std::io::Error,
    },
    /// The operating system refuses a socket or a thread.
    #[error(transparent)]
    System(#[from] std::io::Error),
}

/// A server of pages, until dropped.
pub struct LoopbackServer {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl LoopbackServer {
    /// Serves pages at a loopback address (`127.0.0.1:8765`; port 0 for any free one) on a thread of this name.
    ///
    /// # Errors
    /// If the address is not on loopback, or cannot be bound.
    pub fn start(address: &str, name: &str, router: Router) -> Result<Self, WebError> {
        let wanted: SocketAddr = address.parse().map_err(|_| WebError::NoAddress(address.to_owned()))?;
        if !wanted.ip().is_loopback() {
            return Err(WebError::NotLoopback(wanted));
        }
        let listener = TcpListener::bind(wanted)
            .and_then(|listener| listener.set_nonblocking(true).map(|()| listener))
            .map_err(|source| WebError::Bind { address: wanted, source })?;
        let address = listener.local_addr()?;
        let router = router.layer(from_fn_with_state(address, only_this_address));
        let (stop, stopped) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let thread = thread::Builder::new().name(name.to_owned()).spawn(move || {
            runtime.block_on(async {
                let listener = tokio::net::TcpListener::from_std(listener).expect("a listener that does not block");
                tokio::select! {
                    _ = axum::serve(listener, router).into_future() => {}
                    _ = stopped => {}
                }
            });
        })?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// Returns the address.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for LoopbackServer {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            let _ = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A request that names another host comes from a foreign page.
async fn only_this_address(State(address): State<SocketAddr>, request: Request, next: Next) -> Response {
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    let own = [address.to_string(), format!("localhost:{}", address.port())];
    match own.iter().any(|own| own == host) {
        true => next.run(request).await,
        false => (StatusCode::FORBIDDEN, "this page is served to this machine only").into_response(),
    }
}

/// A page whose scripts and styles stand inside it; it may fetch from its own server.
pub fn page(text: String) -> Response {
    let policy = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'; \
                  img-src data: blob:; worker-src blob:; base-uri 'none'; form-action 'none'";
    let headers = [
        (header::CONTENT_TYPE, "text/html; charset=utf-8"),
        (header::CACHE_CONTROL, "no-store"),
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ];
    (headers, text).into_response()
}

/// An answer for the script of a page.
pub fn answer(value: &Value) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "application/json"),
        (header::CACHE_CONTROL, "no-store"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ];
    (headers, value.to_string()).into_response()
}

/// An error for the script of a page, or its reader.
pub fn refusal(status: StatusCode, text: impl Into<String>) -> Response {
    (status, HeaderMap::new(), text.into()).into_response()
}
