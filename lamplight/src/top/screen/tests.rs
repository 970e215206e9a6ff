use arena::packets::Packets;
use engine::{Awaited, Waiting};
use expect_test::expect;
use observe::live::About;
use profile::{RecentCycles, RecentTimes};
use protocol::{robot_id::RobotId, setup::Mode};
use ratatui::{Terminal, backend::TestBackend, style::Color};

use super::*;

fn quantiles(us: f64) -> Option<Quantiles> {
    Some(Quantiles {
        p50_us: us,
        p90_us: 2.0 * us,
        p99_us: 10.0 * us,
        max_us: 1e3 * us,
        ..Quantiles::default()
    })
}

fn robot(index: u32, p99_us: f64) -> Robot {
    Robot {
        id: RobotId::first(index),
        pid: Some(4225 + index),
        participation: Participation::Present,
        cycles: Some(RecentCycles { last_us: 9.5 + f64::from(index), p99_us, wake_us: 80.0 }),
        missed_deadlines: Some(0),
        refused: u64::from(index == 2),
    }
}

/// Robot 17 of five is stopped, and has the shortest cycle; robot 3 was killed and has none.
fn snapshot() -> Snapshot {
    let of = About {
        run: "lab".into(),
        scenario: "swarmbots".into(),
        engine: "processes".into(),
        mode: Mode::Lockstep,
        arena_pid: 4200,
    };
    let down = Robot { pid: None, participation: Participation::Down, cycles: None, ..robot(3, 0.0) };
    let reborn = Robot { id: RobotId { index: 4, incarnation: 2 }, ..robot(4, 31.0) };
    let stopped =
        Waited { id: RobotId::first(17), pid: Some(4242), state: Some("stopped".into()), for_s: 1.23 };
    Snapshot {
        phase: Phase::Running,
        tick: 811,
        time_s: 40.55,
        wall_s: 12.0,
        mean_error_m: Some(0.0203),
        packets: Packets { sent: 8110, heard: 60000, collided: 12, half_duplex: 3, ..Packets::default() },
        tick_time: quantiles(686.0),
        agents: Some(RecentTimes {
            stages: [quantiles(1.5); Stage::ALL.len()],
            cycle: quantiles(12.0),
            packet: None,
        }),
        robots: vec![robot(1, 30.0), robot(2, 1500.0), down, reborn, robot(17, 9.0)],
        waiting: Some(Waiting { what: Awaited::Answer, tick: 812, count: 1, robots: vec![stopped] }),
        ..Snapshot::begin(of, 2400)
    }
}

fn view<'a>(snapshot: &'a Snapshot, screen: &'a Screen, shares: &'a HashMap<u32, f64>) -> View<'a> {
    let rate = Some(Rate { ticks_per_s: 1180.2, real_time_factor: 59.0 });
    View { snapshot, rate, shares, silence: None, screen }
}

/// A screen of 80 columns and so many rows.
fn drawn(view: View<'_>, rows: u16) -> Terminal<TestBackend> {
    let mut terminal = Terminal::new(TestBackend::new(80, rows)).unwrap();
    terminal.draw(|frame| frame.render_widget(view, frame.area())).unwrap();
    terminal
}

fn text(terminal: &Terminal<TestBackend>) -> String {
    let buffer = terminal.backend().buffer();
    let rows = buffer.content().chunks(buffer.area.width.into());
    rows.map(|row| row.iter().map(|cell| cell.symbol()).collect::<String>().trim_end().to_owned() + "\n")
        .collect()
}

/// Robots in the order of their rows.
fn order(snapshot: &Snapshot, screen: &Screen) -> Vec<u32> {
    screen.shown(snapshot).map(|robot| robot.id.index).collect()
}

#[test]
fn a_screen_shows_who_the_tick_waits_for() {
    let (snapshot, screen, shares) = (snapshot(), Screen::default(), HashMap::from([(4227, 0.125)]));
    let terminal = drawn(view(&snapshot, &screen, &shares), 25);
    expect![[r#"
        run lab: swarmbots (processes, lockstep)
        tick 811 of 2400, 40.5 s of virtual time in 12.0 s; 4 of 5 robots take part
        1180 ticks/s, 59.0x real time, mean error 2.030e-2 m
        packets: 8110 sent, 60000 heard, 12 collided, 3 missed, 0 lost, 0 delayed
        tick 812 waits for robot 17 (pid 4242, stopped) since 1.2 s

        last seconds        p50        p90        p99        max
        tick           686.0 us    1.37 ms    6.86 ms  686.00 ms
          wake           1.5 us     3.0 us    15.0 us    1.50 ms
          receive        1.5 us     3.0 us    15.0 us    1.50 ms
          neighbors      1.5 us     3.0 us    15.0 us    1.50 ms
          cell           1.5 us     3.0 us    15.0 us    1.50 ms
          truncation     1.5 us     3.0 us    15.0 us    1.50 ms
          centroid       1.5 us     3.0 us    15.0 us    1.50 ms
          step           1.5 us     3.0 us    15.0 us    1.50 ms
          publish        1.5 us     3.0 us    15.0 us    1.50 ms
        cycle           12.0 us    24.0 us   120.0 us   12.00 ms
        packet                -          -          -          -

         robot life     pid  state    cycle p99      last   wake-up   cpu missed refused
            17    1    4242  stopped     9.0 us   26.5 us   80.0 us     -      0       0
             2    1    4227  present    1.50 ms   11.5 us   80.0 us 12.5%      0       1
             4    3    4229  present    31.0 us   13.5 us   80.0 us     -      0       0
             1    1    4226  present    30.0 us   10.5 us   80.0 us     -      0       0
        q quit   s sort (slowest first)   arrows scroll
    "#]]
    .assert_eq(&text(&terminal));
    let red: Vec<u16> =
        (0..25).filter(|&row| terminal.backend().buffer()[(0, row)].bg == Color::Red).collect();
    assert_eq!(red, [4], "the line about who is waited for, and no other");
}

#[test]
fn who_does_not_fit_is_scrolled_to() {
    let (snapshot, mut screen, shares) = (snapshot(), Screen::default(), HashMap::new());
    let rows = |screen: &Screen| text(&drawn(view(&snapshot, screen, &shares), 23));
    let shows = |text: &str| [4242, 4227, 4229, 4226].map(|pid| text.contains(&format!("  {pid}  ")));
    let top = rows(&screen);
    assert_eq!(shows(&top), [true, true, false, false], "{top}");
    screen.scroll(2);
    let below = rows(&screen);
    assert_eq!(shows(&below), [false, false, true, true], "{below}");
    assert!(below.contains("q quit"), "{below}");
    screen.scroll(isize::MIN);
    assert_eq!(rows(&screen), top);
    screen.scroll(isize::MAX);
    assert_eq!(order(&snapshot, &screen), [3], "the last one stays");
}

#[test]
fn robots_are_sorted_by_what_is_asked_for_behind_those_that_are_waited_for() {
    let (mut snapshot, mut screen) = (snapshot(), Screen::default());
    assert_eq!(order(&snapshot, &screen), [17, 2, 4, 1, 3]);
    screen.sort_next();
    assert_eq!(order(&snapshot, &screen), [17, 4, 2, 1, 3], "by the last cycle");
    snapshot.waiting = None;
    assert_eq!(order(&snapshot, &screen), [17, 4, 2, 1, 3]);
    screen.sort_next();
    screen.sort_next();
    assert_eq!(order(&snapshot, &screen), [1, 2, 3, 4, 17], "by number");
}

#[test]
fn what_is_not_known_is_a_dash() {
    let begun = Snapshot::begin(snapshot().of, 2400);
    let (screen, shares) = (Screen::default(), HashMap::new());
    let lines =
        View { rate: None, ..view(&begun, &screen, &shares) }.lines(Layout { robots: 20, keys: false });
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    assert!(text.contains("robots join") && text.contains("- ticks/s, -x real time"), "{text}");
    assert!(text.contains("nobody is waited for"), "{text}");
}
