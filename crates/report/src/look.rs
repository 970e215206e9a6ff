//! Looks of series: ink, dash and marker.

use kuva::plot::scatter::MarkerShape;

use crate::theme::Ink;

/// How a series looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Its ink.
    pub ink: Ink,
    /// Its dashes.
    pub dash: Dash,
    /// Its marker.
    pub marker: MarkerShape,
}

/// The dashes of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dash {
    /// None.
    Solid,
    /// Long.
    Long,
    /// Dots.
    Dots,
    /// Long and short in turn.
    Mixed,
    /// Short.
    Short,
    /// Very long.
    VeryLong,
}

/// Looks that differ in ink, dash and marker.
const LOOKS: [Look; 6] = [
    Look { ink: Ink::Blue, dash: Dash::Solid, marker: MarkerShape::Circle },
    Look { ink: Ink::Vermillion, dash: Dash::Long, marker: MarkerShape::Square },
    Look { ink: Ink::Green, dash: Dash::Dots, marker: MarkerShape::Triangle },
    Look { ink: Ink::Purple, dash: Dash::Mixed, marker: MarkerShape::Diamond },
    Look { ink: Ink::Orange, dash: Dash::Short, marker: MarkerShape::TriangleDown },
    Look { ink: Ink::Sky, dash: Dash::VeryLong, marker: MarkerShape::Plus },
];

impl Look {
    /// The look of series number `index`; they repeat after six.
    pub fn nth(index: usize) -> Self {
        LOOKS[index % LOOKS.len()]
    }

    /// The same in another ink.
    pub fn with_ink(self, ink: Ink) -> Self {
        Self { ink, ..self }
    }
}

impl Dash {
    /// As SVG writes it; `None` for a solid line.
    pub fn pattern(self) -> Option<&'static str> {
        match self {
            Self::Solid => None,
            Self::Long => Some("8 4"),
            Self::Dots => Some("1.6 3.2"),
            Self::Mixed => Some("8 3 2 3"),
            Self::Short => Some("4 3"),
            Self::VeryLong => Some("14 4"),
        }
    }
}
