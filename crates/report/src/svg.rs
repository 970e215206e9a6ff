//! A drawn figure, for a page and for a file of its own.

use kuva::{backend::svg::SvgBackend, render::render::Scene};

use crate::{escape::escape, theme};

/// Prefix of the plotting library's clips; they are renamed, for a page has many figures.
const CLIP: &str = "kuva-clip-";

/// By this a file is known to be ours.
pub const MARK: &str = "class=\"chart lamplight-figure\"";

/// A drawn figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Svg {
    width: f64,
    height: f64,
    font: String,
    about: String,
    body: String,
}

impl Svg {
    /// The scene as SVG; `about` says in words what it shows.
    pub fn new(scene: &Scene, about: &str) -> Self {
        let drawn = SvgBackend::new().render_scene(scene);
        // The root element is ours; what is inside is the library's.
        let inside = drawn.find('>').map_or("", |end| &drawn[end + 1..]);
        let body = inside.strip_suffix("</svg>").unwrap_or(inside.trim_end().trim_end_matches("</svg>"));
        Self {
            width: scene.width,
            height: scene.height,
            font: scene.font_family.clone().unwrap_or_else(|| "sans-serif".into()),
            about: about.to_owned(),
            body: body.to_owned(),
        }
    }

    /// For a page, which has the style sheet; `name` keeps apart what figures of a page call by name.
    pub fn inline(&self, name: &str) -> String {
        format!("{}{}</svg>\n", self.root(name, ""), self.body_of(name))
    }

    /// For a file.
    pub fn file(&self, name: &str) -> String {
        let style = theme::figure_css();
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}<style>{style}</style>{}</svg>\n",
            self.root(name, " xmlns=\"http://www.w3.org/2000/svg\""),
            self.body_of(name)
        )
    }

    fn root(&self, name: &str, namespace: &str) -> String {
        let (width, height) = (self.width, self.height);
        format!(
            "<svg{namespace} {MARK} id=\"{name}\" role=\"img\" aria-label=\"{}\" width=\"{width}\" \
             height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"{}\" fill=\"{}\">",
            escape(&self.about),
            escape(&self.font),
            theme::Ink::Text.light(),
        )
    }

    fn body_of(&self, name: &str) -> String {
        self.body.replace(CLIP, &format!("{name}-clip-"))
    }
}
