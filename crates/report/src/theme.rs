//! The inks of all figures and the style sheets that turn them dark.
//!
//! A figure is drawn in the light inks, so that any program can show its file. A style sheet gives each
//! ink its dark counterpart where the reader prefers that; it selects elements by the light ink they were drawn in.
//! Colors after Okabe and Ito (<https://jfly.uni-koeln.de/color/>), which people with color blindness tell
//! apart; on the dark ground they are lighter.

use std::fmt::Write;

/// A color, by its role in figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// The ground under everything.
    Ground,
    /// Text and axes.
    Text,
    /// Grid lines.
    Grid,
    /// Cells, thin lines, what stays in the background.
    Soft,
    /// Marks that are no data: events, limits.
    Mark,
    /// First series.
    Blue,
    /// Second series.
    Vermillion,
    /// Third series.
    Green,
    /// Fourth series.
    Purple,
    /// Fifth series.
    Orange,
    /// Sixth series.
    Sky,
}

/// Name in style sheets, light color, dark color.
const INKS: [(Ink, &str, &str, &str); 11] = [
    (Ink::Ground, "ground", "#ffffff", "#15181c"),
    (Ink::Text, "text", "#1b1b1b", "#e6e6e6"),
    (Ink::Grid, "grid", "#e3e3e3", "#31363c"),
    (Ink::Soft, "soft", "#a3a3a3", "#747b84"),
    (Ink::Mark, "mark", "#5a5a5a", "#b3b9c1"),
    (Ink::Blue, "blue", "#0072b2", "#4fa8e8"),
    (Ink::Vermillion, "vermillion", "#d55e00", "#ff8440"),
    (Ink::Green, "green", "#009e73", "#35c79c"),
    (Ink::Purple, "purple", "#b4568c", "#e59bc6"),
    (Ink::Orange, "orange", "#c98500", "#f2b740"),
    (Ink::Sky, "sky", "#56b4e9", "#a3d8fa"),
];

impl Ink {
    /// The color of this ink on light ground.
    pub fn light(self) -> &'static str {
        INKS[self as usize].2
    }
}

/// Style sheet of a page: inks as variables, and figures that follow them. Paper is always light.
pub fn page_css() -> String {
    let variables = |color: fn(&(Ink, &'static str, &'static str, &'static str)) -> &'static str| {
        INKS.iter().fold(String::new(), |mut text, ink| {
            let _ = write!(text, "--{}:{};", ink.1, color(ink));
            text
        })
    };
    let mut css = format!(
        ":root{{color-scheme:light dark;{}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}\n",
        variables(|ink| ink.2),
        variables(|ink| ink.3),
    );
    for (_, name, light, _) in INKS {
        let value = format!("var(--{name})");
        css.push_str(&rules(light, &value));
    }
    css
}

/// Style sheet inside a figure's own file.
pub fn figure_css() -> String {
    let dark: String = INKS.iter().map(|(_, _, light, dark)| rules(light, dark)).collect();
    format!("@media screen and (prefers-color-scheme:dark){{\n{dark}}}\n")
}

/// Style rules that show in `color` what was drawn in `light`.
fn rules(light: &str, color: &str) -> String {
    format!(
        ".chart[fill=\"{light}\"],.chart [fill=\"{light}\"]{{fill:{color}}}\
         .chart [stroke=\"{light}\"]{{stroke:{color}}}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_ink_stands_at_its_own_place_in_the_table() {
        assert!(INKS.iter().enumerate().all(|(place, (ink, ..))| *ink as usize == place));
    }

    #[test]
    fn no_two_inks_share_a_color_for_a_style_sheet_could_not_tell_them_apart() {
        let mut light: Vec<_> = INKS.iter().map(|ink| ink.2).collect();
        light.sort_unstable();
        light.dedup();
        assert_eq!(light.len(), INKS.len());
    }
}
