//! The page itself: its files, as they are in `page/`.

/// Policy by which the page may load its own files, and nothing else.
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
const IMAGE: &str = "image/svg+xml";

files! {
    "/": HTML = "index.html",
    "/js/acts.js": SCRIPT = "js/acts.js",
    "/js/agents.js": SCRIPT = "js/agents.js",
    "/js/camera.js": SCRIPT = "js/camera.js",
    "/js/disturb.js": SCRIPT = "js/disturb.js",
    "/js/dom.js": SCRIPT = "js/dom.js",
    "/js/format.js": SCRIPT = "js/format.js",
    "/js/frame.js": SCRIPT = "js/frame.js",
    "/js/glyphs.js": SCRIPT = "js/glyphs.js",
    "/js/heatmap.js": SCRIPT = "js/heatmap.js",
    "/js/histogram.js": SCRIPT = "js/histogram.js",
    "/js/inspector.js": SCRIPT = "js/inspector.js",
    "/js/keys.js": SCRIPT = "js/keys.js",
    "/js/ledger.js": SCRIPT = "js/ledger.js",
    "/js/legend.js": SCRIPT = "js/legend.js",
    "/js/main.js": SCRIPT = "js/main.js",
    "/js/notices.js": SCRIPT = "js/notices.js",
    "/js/order.js": SCRIPT = "js/order.js",
    "/js/overlays.js": SCRIPT = "js/overlays.js",
    "/js/pace.js": SCRIPT = "js/pace.js",
    "/js/packets.js": SCRIPT = "js/packets.js",
    "/js/plots.js": SCRIPT = "js/plots.js",
    "/js/pointer.js": SCRIPT = "js/pointer.js",
    "/js/scene.js": SCRIPT = "js/scene.js",
    "/js/state.js": SCRIPT = "js/state.js",
    "/js/stream.js": SCRIPT = "js/stream.js",
    "/js/tabs.js": SCRIPT = "js/tabs.js",
    "/js/theme.js": SCRIPT = "js/theme.js",
    "/js/timeline.js": SCRIPT = "js/timeline.js",
    "/js/topbar.js": SCRIPT = "js/topbar.js",
    "/js/trails.js": SCRIPT = "js/trails.js",
    "/style.css": STYLE = "style.css",
    "/vendor/icon.svg": IMAGE = "vendor/icon.svg",
    "/vendor/uPlot.iife.min.js": SCRIPT = "vendor/uPlot.iife.min.js",
    "/vendor/uPlot.min.css": STYLE = "vendor/uPlot.min.css",
}
