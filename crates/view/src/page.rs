//! The page itself: its files, as they are in `page/`.

/// What the page may load: its own files, and nothing else.
pub(crate) const POLICY: &str = "default-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'; \
                                 base-uri 'none'; form-action 'none'";

macro_rules! files {
    ($($path:literal: $kind:ident = $file:literal,)*) => {
        /// A file of the page and its kind, by its path on the server.
        pub(crate) fn file(path: &str) -> Option<(&'static str, &'static [u8])> {
            match path {
                $($path => Some(($kind, include_bytes!(concat!("../page/", $file)))),)*
                _ => None,
            }
        }
    };
}

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

files! {
    "/": HTML = "index.html",
    "/style.css": STYLE = "style.css",
}
