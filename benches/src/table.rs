//! The result as Markdown: what a tick takes, how many times the floor that is, and what is missing.

use crate::{
    peer::Peer,
    results::{Round, Size},
    spread::{Spread, figures},
};

const LEGEND: &str = "\
Median tick in µs; median of the rounds, in parentheses the least and the greatest. All but in-process have
one process per robot, and all but the last two have nothing in the tick: 8 × 96 B into each process and 96 B
out of it, all read. futex, the floor: a page of shared memory and one broadcast. pipes: two per process.
sockets: a SEQPACKET pair per process. zeromq: a ROUTER, and a DEALER per process, over ipc. idle: our
lock-step without arena and controller, a checked percept of 8 packets in, a checked command out. lock-step:
a whole tick of ours: motion, the infrared channel, and the real controller in each process; only metrics and
outputs are off the tick. in-process: the same tick in one loop.";

const RATIOS: &str =
    "How many times as long a tick takes. Ratios are formed within a round, then the median is taken.";

/// Legend, tables and what is missing. `peers` are the columns, in this order.
pub(crate) fn markdown(sizes: &[Size], peers: &[Peer]) -> String {
    let mut text = format!("{LEGEND}\n\n{}", times(sizes, peers));
    let columns = ratio_columns(peers);
    if !columns.is_empty() {
        text.push_str(&format!("\n{RATIOS}\n\n{}", ratios(sizes, &columns)));
    }
    let missing: String = sizes.iter().flat_map(why).collect();
    if !missing.is_empty() {
        text.push_str(&format!("\nA dash stands for what could not be measured:\n\n{missing}"));
    }
    text
}

fn times(sizes: &[Size], peers: &[Peer]) -> String {
    let names = peers.iter().map(|peer| peer.name().to_owned());
    table(
        ["N".to_owned(), "heard per robot".to_owned()].into_iter().chain(names),
        sizes.iter().map(|size| {
            let heard = size.spread(|round| round.heard);
            let heard = heard.map_or_else(dash, |heard| figures(heard.median(), 3));
            let times = peers.iter().map(|&peer| cell(size.spread(|round| round.tick_us(peer))));
            [size.robots.to_string(), heard].into_iter().chain(times).collect()
        }),
    )
}

/// Pairs of a peer and the one that it is divided by.
fn ratio_columns(peers: &[Peer]) -> Vec<(Peer, Peer)> {
    let has = |peer| peers.contains(&peer);
    let over_floor = peers.iter().filter(|&&peer| peer != Peer::Futex && has(Peer::Futex));
    let mut columns: Vec<_> = over_floor.map(|&peer| (peer, Peer::Futex)).collect();
    if has(Peer::Lockstep) && has(Peer::InProcess) {
        columns.push((Peer::Lockstep, Peer::InProcess));
    }
    columns
}

fn ratios(sizes: &[Size], columns: &[(Peer, Peer)]) -> String {
    let names = columns.iter().map(|(peer, base)| format!("{} / {}", peer.name(), base.name()));
    table(
        ["N".to_owned()].into_iter().chain(names),
        sizes.iter().map(|size| {
            let ratio = |&(peer, base)| cell(size.spread(|round: &Round| round.ratio(peer, base)));
            [size.robots.to_string()].into_iter().chain(columns.iter().map(ratio)).collect()
        }),
    )
}

/// A Markdown table, all columns to the right.
pub(crate) fn table(header: impl Iterator<Item = String>, rows: impl Iterator<Item = Vec<String>>) -> String {
    let header: Vec<String> = header.collect();
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rows: String = rows.map(|row| line(&row)).collect();
    format!("{}|{}\n{rows}", line(&header), "--:|".repeat(header.len()))
}

fn cell(spread: Option<Spread>) -> String {
    spread.map_or_else(dash, |spread| spread.to_string())
}

/// Placeholder of a value that is not there.
pub(crate) fn dash() -> String {
    "–".to_owned()
}

fn why(size: &Size) -> impl Iterator<Item = String> {
    size.missing.iter().map(|(peer, reason)| format!("- {}, N = {}: {reason}\n", peer.name(), size.robots))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One round with what was measured, µs.
    fn round(tick_us: &[(Peer, f64)], heard: Option<f64>) -> Round {
        Round { tick_us: tick_us.iter().copied().collect(), heard }
    }

    #[test]
    fn ratios_compare_what_was_measured_together() {
        use Peer::{Futex, InProcess, Lockstep};
        // The machine slowed down tenfold in the second round.
        let slowed =
            |by| round(&[(Futex, 100.0 * by), (Lockstep, 150.0 * by), (InProcess, 37.5 * by)], Some(8.0));
        let size = Size { rounds: vec![slowed(1.0), slowed(10.0)], ..Size::of(10) };
        let text = markdown(&[size], &[Futex, Lockstep, InProcess]);
        let tables: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
        assert_eq!(
            tables,
            [
                "| N | heard per robot | futex | lock-step | in-process |",
                "|--:|--:|--:|--:|--:|",
                "| 10 | 8.00 | 550 (100–1000) | 825 (150–1500) | 206 (38–375) |",
                "| N | lock-step / futex | in-process / futex | lock-step / in-process |",
                "|--:|--:|--:|--:|",
                "| 10 | 1.50 (1.5–1.5) | 0.375 (0.38–0.38) | 4.00 (4.0–4.0) |",
            ]
        );
        assert!(!text.contains("could not be measured"));
    }

    #[test]
    fn what_is_missing_is_a_dash_with_its_reason_below() {
        use Peer::{Futex, Idle, Pipes};
        let mut size = Size::of(2000);
        size.missing.insert(Idle, "too many open files".into());
        // The second round was cut short: pipes are compared with the floor of the first alone.
        size.rounds = vec![round(&[(Futex, 10.0), (Pipes, 20.0)], None), round(&[(Futex, 40.0)], None)];
        let text = markdown(&[size], &[Futex, Pipes, Idle]);
        assert!(text.contains("\n| 2000 | – | 25.0 (10–40) | 20.0 (20–20) | – |\n"), "{text}");
        assert!(text.contains("\n| 2000 | 2.00 (2.0–2.0) | – |\n"), "{text}");
        assert!(text.ends_with("measured:\n\n- idle, N = 2000: too many open files\n"), "{text}");
    }

    #[test]
    fn without_the_floor_there_is_nothing_to_divide_by() {
        let size = Size { rounds: vec![round(&[(Peer::Pipes, 20.0)], None)], ..Size::of(10) };
        assert!(!markdown(&[size], &[Peer::Pipes]).contains("How many times"));
    }
}
