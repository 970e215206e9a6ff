//! The scenario file: what is read, what is refused in which words, and the ready files in `scenarios/`.

use std::fs;
use std::path::{Path, PathBuf};

use coverage::setup::GradientMode;
use expect_test::{Expect, expect};
use proptest::prelude::*;
use protocol::setup::{Mode, Plane};
use scenario::{
    Access, BYTES_MAX, ChannelModel, NonNegative, Override, SEED_MAX, STEPS_MAX, Scenario, ScenarioError,
    schema_json,
};

/// The smallest scenario there is.
const SMALLEST: &str = "\
duration_s = 10
step_s = 0.1

[arena]
size_m = [2, 1]

[robots]
count = 3

[controller]
gain_per_s = 1

[channel]
range_m = 1
";

fn scenarios() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../scenarios")
}

fn ready_files() -> Vec<PathBuf> {
    let entries = fs::read_dir(scenarios()).expect("the folder of ready scenarios");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a readable entry").path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    files
}

fn parse(text: &str, overrides: &[&str]) -> Result<Scenario, ScenarioError> {
    let overrides: Vec<Override> =
        overrides.iter().map(|entry| entry.parse().expect("a well-formed override")).collect();
    Scenario::parse("x.toml", text, &overrides)
}

/// The smallest scenario with one piece of its text replaced.
fn edited(from: &str, to: &str) -> String {
    assert!(SMALLEST.contains(from), "{from:?} is not in the smallest scenario");
    SMALLEST.replacen(from, to, 1)
}

fn check_text(text: &str, expected: Expect) {
    expected.assert_eq(&parse(text, &[]).expect_err("a bad scenario").to_string());
}

fn check_edit(from: &str, to: &str, expected: Expect) {
    check_text(&edited(from, to), expected);
}

fn check_override(overrides: &[&str], expected: Expect) {
    expected.assert_eq(&parse(SMALLEST, overrides).expect_err("a bad override").to_string());
}

mod reading {
    use super::*;

    #[test]
    fn the_smallest_scenario_is_filled_with_every_default() {
        let scenario = parse(SMALLEST, &[]).expect("a good scenario");
        expect![[r#"
            name = "x"
            seed = 1
            duration_s = 10.0
            step_s = 0.1

            [arena]
            size_m = [2.0, 1.0]
            boundary_sensing = false

            [robots]
            count = 3
            radius_m = 0.0
            drive = "holonomic"
            turn_limit_rad_per_s = 3.0

            [field]
            offset = 0.0
            gaussian = []
            lamp = []

            [light]
            sensor = "ideal"

            [sensors]
            odometry = false
            odometry_error = 0.0
            compass = false
            position = false

            [controller]
            law = "linear"
            gain_per_s = 1.0
            gradient = "measured"
            neighbor_timeout_cycles = 1
            triangle_base_m = 0.6
            triangle_height_m = 0.6
            close_distance_m = 0.25

            [channel]
            profile = "ideal"
            model = "range"
            range_m = 1.0
            soft_edge_m = 0.0
            occlusion = false
            cycle_s = 0.1
            access = "instant"
            loss = 0.0
            sigma_range = 0.0
            sigma_bearing_deg = 0.0
            sigma_orientation_deg = 0.0
            range_step_m = 0.0
            bearing_step_deg = 0.0
            orientation_step_deg = 0.0
            payload_bytes_max = 9

            [convergence]
            tolerance_m = 0.0000001
            stop = false

            [processes]
            hang_timeout_s = 2.0
            on_hang = "exclude"
            clock_drift_ppm = 0.0
            timer_jitter_s = 0.0

            [output]
            metrics_every_s = 1.0
            scene_every_s = 0.5
            crowding = false

            [fuzz]
            faults_max = 6
            kinds = ["loss", "burst", "delay", "duplicate", "corrupt", "partition", "jam", "kill", "pause", "slow", "sensor", "motion", "liar"]
            probability_max = 0.9
            share_max = 0.5
            delay_max_s = 2.0
        "#]]
        .assert_eq(&scenario.to_toml());
    }

    #[test]
    fn laws_have_room_for_their_readings() {
        let error = parse(SMALLEST, &["channel.payload_bytes_max=3"]).expect_err("too few").to_string();
        assert!(
            error.contains("channel.payload_bytes_max = 3 is less than the 4 bytes that robots of"),
            "{error}"
        );
        assert!(parse(SMALLEST, &["channel.payload_bytes_max=4"]).is_ok());
    }

    #[test]
    fn what_is_no_default_is_equal_after_a_round_trip() {
        let sets = [
            "channel.payload_bytes_max=128",
            "channel.loss=0.25",
            "channel.sigma_range=0.125",
            "channel.occlusion=true",
            "sensors.compass=true",
            "sensors.position=true",
            "sensors.odometry=true",
            "sensors.odometry_error=0.5",
            "convergence.stop=true",
            "output.crowding=true",
            "processes.on_hang=restart",
        ];
        let scenario = parse(SMALLEST, &sets).expect("a sound scenario");
        assert_eq!(scenario.channel.payload_bytes_max.get(), 128);
        assert_eq!(parse(&scenario.to_toml(), &[]), Ok(scenario));
    }

    #[test]
    fn every_ready_file_loads_and_is_equal_after_a_round_trip() {
        let files = ready_files();
        assert_eq!(files.len(), 13);
        for file in files {
            let scenario = Scenario::load(&file, &[]).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(Some(scenario.name.as_str()), file.file_stem().and_then(|stem| stem.to_str()));
            assert_eq!(Scenario::parse("resolved.toml", &scenario.to_toml(), &[]), Ok(scenario));
        }
    }

    #[test]
    fn every_ready_file_names_the_schema_and_says_what_to_expect() {
        for file in ready_files() {
            let text = fs::read_to_string(&file).expect("a readable file");
            assert!(text.starts_with("#:schema scenario.schema.json\n"), "{}", file.display());
            assert!(text.contains("# Expected"), "{}", file.display());
        }
    }

    #[test]
    fn the_committed_schema_is_current() {
        let committed = fs::read_to_string(scenarios().join("scenario.schema.json")).unwrap_or_default();
        // Compared as values: another crate's features may change the order of serde_json's keys.
        let value = |text: &str| serde_json::from_str::<serde_json::Value>(text).ok();
        assert!(
            value(&committed) == value(&schema_json()),
            "the schema is out of date; run `lamplight schema > scenarios/scenario.schema.json`"
        );
    }

    #[test]
    fn the_largest_seed_is_one_that_every_reader_of_toml_and_json_keeps() {
        let scenario = parse(SMALLEST, &["seed=9007199254740991"]).expect("a good scenario");
        assert_eq!(scenario.seed.get(), SEED_MAX);
        assert_eq!(SEED_MAX as f64 as u64, SEED_MAX);
        assert_eq!(parse(&scenario.to_toml(), &[]), Ok(scenario));
        for beyond in ["9007199254740992", "18446744073709551616", "-1"] {
            let error = parse(SMALLEST, &[&format!("seed={beyond}")]).expect_err("a bad seed").to_string();
            let expected = format!("--set seed={beyond}: must be from 0 to 9007199254740991, got {beyond}");
            assert_eq!(error, expected);
        }
    }

    #[test]
    fn the_run_and_its_samples_are_counted_in_whole_ticks() {
        let ticks = |overrides: &[&str]| {
            let scenario = parse(SMALLEST, overrides).expect("a good scenario");
            (scenario.ticks(), scenario.sample_every_ticks())
        };
        assert_eq!(ticks(&[]), (100, 10));
        assert_eq!(ticks(&["step_s=0.3"]), (33, 3));
        assert_eq!(ticks(&["output.metrics_every_s=0.01"]), (100, 1));
    }

    /// Checks the roundings of the smallest scenario with overrides.
    fn said_of(overrides: &[&str], expected: Expect) -> Scenario {
        let scenario = parse(SMALLEST, overrides).unwrap_or_else(|error| panic!("{error}"));
        let said = scenario.roundings.0.iter().map(|rounded| format!("{rounded}\n")).collect::<String>();
        expected.assert_eq(&said);
        scenario
    }

    #[test]
    fn a_time_that_is_no_whole_number_of_steps_is_rounded_and_said() {
        let scenario = said_of(
            &["duration_s=1", "step_s=0.4", "output.poses_every_s=0.5", "output.metrics_every_s=0.01"],
            expect![[r#"
                --set duration_s=1: duration_s = 1 is not a whole number of steps of 0.4 s: 3 steps, 1.2 s, will be run
                --set output.metrics_every_s=0.01: output.metrics_every_s = 0.01 is not a whole number of steps of 0.4 s: 1 step, 0.4 s, will be run
                --set output.poses_every_s=0.5: output.poses_every_s = 0.5 is not a whole number of steps of 0.4 s: 1 step, 0.4 s, will be run
            "#]],
        );
        assert_eq!((scenario.ticks(), scenario.duration_s.get()), (3, 1.2));
        assert!(scenario.to_toml().contains("\nduration_s = 1.2\n"), "{}", scenario.to_toml());
        let resolved = parse(&scenario.to_toml(), &[]).expect("a resolved scenario");
        assert!(resolved.roundings.0.is_empty(), "{:?}", resolved.roundings);
        assert_eq!(resolved, scenario);
    }

    #[test]
    fn the_times_of_faults_are_rounded_and_said() {
        let plan = r#"fault=[{ kind = "kill", robots = 0, at_s = 0.26, restart_at_s = 0.5 },
            { kind = "delay", from_s = 0.04, until_s = 9.99, delay_s = 0.16 },
            { kind = "delay", delay_s = 0.16, jitter_s = 0.01 }, { kind = "slow", delay_s = 0.3 }]"#;
        let scenario = parse(SMALLEST, &[plan]).unwrap_or_else(|error| panic!("{error}"));
        let said: Vec<String> = scenario.roundings.0.iter().map(ToString::to_string).collect();
        let run = |written: &str| {
            let line = said.iter().find(|line| line.contains(&format!(": {written} is not a whole")))?;
            line.rsplit_once(": ").map(|(_, run)| run)
        };
        assert_eq!(run("fault.0.at_s = 0.26"), Some("3 steps, 0.3 s, will be run"));
        assert_eq!(run("fault.1.from_s = 0.04"), Some("0 steps, 0 s, will be run"));
        assert_eq!(run("fault.1.until_s = 9.99"), Some("100 steps, 10 s, will be run"));
        assert_eq!(run("fault.1.delay_s = 0.16"), Some("2 steps, 0.2 s, will be run"));
        assert_eq!(said.len(), 4, "a delay with jitter is rounded as a whole: {said:?}");
        let times = |index: usize| (scenario.fault[index].begins_s(), scenario.fault[index].ends_s());
        assert_eq!((times(0), times(1)), ((0.3, Some(0.5)), (0.0, Some(10.0))));
    }

    #[test]
    fn a_default_and_a_rounding_error_are_no_news() {
        let scenario = said_of(&["duration_s=6", "step_s=0.3"], expect![""]);
        assert_eq!((scenario.sample_every_ticks(), scenario.output.metrics_every_s.get()), (3, 0.9));
        let scenario = said_of(&["duration_s=0.30000000000000004", "step_s=0.1"], expect![""]);
        assert_eq!(scenario.duration_s.get(), 0.30000000000000004, "as it was written");
    }

    #[test]
    fn every_step_up_to_the_last_that_is_counted_begins_a_cycle_of_its_own() {
        let scenario = parse(SMALLEST, &["duration_s=1e8"]).expect("a good scenario");
        assert_eq!(scenario.ticks(), STEPS_MAX);
        for from in (0..STEPS_MAX).step_by(9_876_543) {
            assert!((from..from + 1000).all(|tick| scenario.begins_cycle(tick)), "beyond {from}");
        }
    }

    #[test]
    fn the_count_follows_from_the_positions() {
        let scenario =
            parse(&edited("count = 3", "positions_m = [[0, 0], [2, 1]]"), &[]).expect("a good scenario");
        assert_eq!(scenario.robot_count(), 2);
    }

    #[test]
    fn a_neighbor_is_remembered_for_four_cycles_wherever_packets_can_be_lost_or_late() {
        let cycles = |overrides: &[&str]| {
            let scenario = parse(SMALLEST, overrides).unwrap_or_else(|error| panic!("{error}"));
            scenario.controllers[0].neighbor_timeout_cycles().get()
        };
        for overrides in [
            &["channel.loss=0.3"][..],
            &["channel.soft_edge_m=0.1"],
            &["channel.occlusion=true"],
            &["channel.profile=isis"],
            &["channel.access=slotted"],
            &["fault=[{ kind = \"loss\", probability = 0.3, from_s = 5 }]"],
            &["fault=[{ kind = \"burst\", p = 0.1, r = 0.1 }]"],
            &["fault=[{ kind = \"delay\", delay_s = 0.1 }]"],
            &["fault=[{ kind = \"corrupt\", probability = 0.1 }]"],
            &["fault=[{ kind = \"partition\", groups = [\"0\", \"1\"] }]"],
            &["fault=[{ kind = \"jam\", region = { center_m = [1, 0.5], radius_m = 0.1 } }]"],
        ] {
            assert_eq!(cycles(overrides), 4, "{overrides:?}");
            let given = [overrides, &["controller.neighbor_timeout_cycles=2"]].concat();
            assert_eq!(cycles(&given), 2, "{given:?}");
        }
        for overrides in [
            &[][..],
            &["channel.loss=0", "channel.soft_edge_m=0", "channel.occlusion=false"],
            &["fault=[{ kind = \"duplicate\", probability = 0.3, delay_s = 1 }]"],
            &["fault=[{ kind = \"kill\", robots = 0, at_s = 1, restart_at_s = 2 }]"],
            &["fault=[{ kind = \"pause\", robots = 0 }]"],
            &["fault=[{ kind = \"slow\", delay_s = 1 }]"],
            &["fault=[{ kind = \"sensor\", stuck = true }]"],
            &["fault=[{ kind = \"motion\", stuck = true }]"],
            &["fault=[{ kind = \"liar\", identity = 1 }]"],
            &["fault=[{ kind = \"field\", at_s = 1, offset = 2 }]"],
        ] {
            assert_eq!(cycles(overrides), 1, "{overrides:?}");
        }
    }

    #[test]
    fn diodes_see_no_darkness_of_a_lamp_that_changes_either() {
        let lit = [
            "light.sensor=ring",
            "controller.gradient=fixed",
            "controller.gradient_magnitude_per_m=1",
            "field.lamp=[{ position_m = [1, 1], peak = 5, half_distance_m = 1 }]",
        ];
        let change = |peak: f64| {
            let fault = format!("fault=[{{ kind = \"field\", at_s = 1, lamp = 0, peak = {peak} }}]");
            parse(SMALLEST, &[&lit[..], &[&fault]].concat())
        };
        assert!(change(0.0).is_ok());
        let error = change(-1.0).expect_err("a bad change").to_string();
        assert!(error.ends_with("peak = -1: a diode sees no darkness; peaks are zero or more"), "{error}");
    }

    #[test]
    fn a_change_of_the_field_is_equal_after_a_round_trip() {
        let sets = [
            "field.lamp=[{ position_m = [1, 1], peak = 5, half_distance_m = 1 }]",
            "field.gaussian=[{ center_m = [1, 1], sigma_m = 1 }]",
            "fault=[{ kind = \"field\", at_s = 0.26, lamp = 0, position_m = [-1, 9], half_distance_m = 2 },
              { kind = \"field\", at_s = 2, gaussian = 0, center_m = [0, 0], gamma = -2, sigma_m = 0.5 },
              { kind = \"field\", at_s = 2, offset = -3 }]",
        ];
        let scenario = parse(SMALLEST, &sets).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scenario.fault.iter().map(|fault| fault.begins_s()).collect::<Vec<_>>(), [0.3, 2.0, 2.0]);
        assert!(scenario.fault.iter().all(|fault| fault.ends_s().is_none()));
        assert_eq!(
            scenario.fault[1].among_first(1).as_ref(),
            Some(&scenario.fault[1]),
            "robots are nothing to it"
        );
        assert_eq!(parse(&scenario.to_toml(), &[]).map(|again| again.fault), Ok(scenario.fault));
    }

    #[test]
    fn wheels_have_odometry_unless_the_scenario_says_otherwise() {
        let odometry =
            |sets: &[&str]| parse(SMALLEST, sets).expect("a good scenario").sensors.odometry.is_some();
        assert!(!odometry(&[]));
        assert!(odometry(&["robots.drive=differential"]));
        assert!(!odometry(&["robots.drive=differential", "sensors.odometry=false"]));
        assert!(odometry(&["sensors.odometry=true"]));
    }

    #[test]
    fn an_error_of_odometry_wants_odometry() {
        check_override(
            &["sensors.odometry_error=0.1"],
            expect![[r#"
            --set sensors.odometry_error=0.1: sensors.odometry_error has no meaning without odometry
            hint: grant it (on the command line: --set sensors.odometry=true)"#]],
        );
        check_override(
            &["robots.drive=differential", "sensors.odometry=false", "sensors.odometry_error=0.1"],
            expect![[r#"
                --set sensors.odometry_error=0.1: sensors.odometry_error has no meaning without odometry
                hint: grant it (on the command line: --set sensors.odometry=true)"#]],
        );
        check_override(
            &["robots.drive=differential", "sensors.odometry_error=1.5"],
            expect!["--set sensors.odometry_error=1.5: sensors.odometry_error = 1.5 is more than 1"],
        );
        assert!(parse(SMALLEST, &["robots.drive=differential", "sensors.odometry_error=0.1"]).is_ok());
    }

    #[test]
    fn the_infrared_of_the_swarmbots_is_what_the_guide_says() {
        let isis =
            parse(SMALLEST, &["channel.profile=isis", "channel.range_m="]).expect("a good scenario").channel;
        let air = isis.air().expect("packets that last");
        assert!(matches!(air.access, Access::Random { guard_s } if guard_s.get() == 0.005), "{air:?}");
        assert!(air.half_duplex);
        assert_eq!((air.airtime_s.get(), isis.cycle_s.get()), (0.005, 0.25));
        let noise = [isis.sigma_range, isis.sigma_bearing_deg, isis.sigma_orientation_deg];
        assert_eq!(noise.map(NonNegative::get), [0.05, 2.0, 2.0]);
        let ChannelModel::Range { range_m, interference_range_m, .. } = isis.model else {
            panic!("{isis:?}")
        };
        assert_eq!(range_m, interference_range_m, "what can be read disturbs, and nothing else");
        let hidden = parse(SMALLEST, &["channel.profile=isis", "channel.occlusion=true"]).unwrap().channel;
        assert!(hidden.air().is_some_and(|air| !air.occluded_interference));
    }

    #[test]
    fn agents_are_told_what_the_swarmbots_file_says() {
        let scenario = Scenario::load(&scenarios().join("swarmbots.toml"), &[]).expect("a good scenario");
        let agent = |mode| scenario.agent_setup(mode, &scenario.controllers[0]);
        let told = agent(Mode::Lockstep);
        assert_eq!(
            (told.cycle.get(), told.plane, told.params.decode().ok()),
            (0.1, Plane::Blackboard, scenario.coverage_setup(0))
        );
        assert_eq!(agent(Mode::Realtime).plane, Plane::PublishSubscribe);
        let setup = scenario.coverage_setup(49).expect("a law");
        assert_eq!(setup.gradient, GradientMode::Fixed(1000.0));
        assert_eq!(setup.neighbor_timeout_ticks, 1);
        assert_eq!(setup.speed_cap.map(|cap| cap.get()), Some(0.3));
        assert_eq!(setup.closure.close_distance.get(), 0.25);
        assert_eq!(setup.closure.cap, None);
        assert_eq!(scenario.lamps().len(), 2);
    }

    #[test]
    fn windows_line_ends_and_a_byte_order_mark_are_read() {
        let text = format!("\u{feff}{}", SMALLEST.replace('\n', "\r\n"));
        assert_eq!(parse(&text, &[]), parse(SMALLEST, &[]));
    }
}

mod overriding {
    use super::*;

    fn overridden(overrides: &[&str]) -> Scenario {
        parse(SMALLEST, overrides).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn an_override_is_stronger_than_the_file_and_the_last_one_wins() {
        assert_eq!(overridden(&["robots.count=20", "robots.count=7"]).robot_count(), 7);
    }

    #[test]
    fn an_override_gives_what_the_file_lacks() {
        let scenario = parse(&edited("count = 3", ""), &["robots.count=4"]).expect("a good scenario");
        assert_eq!(scenario.robot_count(), 4);
    }

    #[test]
    fn a_value_that_is_not_toml_is_a_bare_string() {
        assert_eq!(overridden(&["name=night run"]).name, "night run");
    }

    #[test]
    fn an_index_steps_into_an_array() {
        let text = format!("{SMALLEST}[[field.gaussian]]\ncenter_m = [0, 0]\nsigma_m = 1\n");
        let scenario = parse(&text, &["field.gaussian.0.sigma_m=0.2"]).expect("a good scenario");
        assert_eq!(scenario.field.gaussian[0].sigma_m.get(), 0.2);
    }

    #[test]
    fn an_override_can_be_a_whole_table() {
        let scenario =
            overridden(&["field={ lamp = [{ position_m = [1, 0], peak = 5, half_distance_m = 1 }] }"]);
        assert_eq!(scenario.lamps()[0].peak.get(), 5.0);
    }

    #[test]
    fn an_empty_value_removes_a_key() {
        let scenario = overridden(&["channel.range_m=", "channel.model=voronoi"]);
        assert_eq!(scenario.channel.model, ChannelModel::Voronoi);
    }

    #[test]
    fn a_bad_value_is_blamed_on_its_override() {
        check_override(
            &["seed=2", "channel.range_m=-1"],
            expect!["--set channel.range_m=-1: must be a positive number, got -1"],
        );
        check_override(
            &["step_s=fast"],
            expect![[r#"--set step_s=fast: expected a number, found string "fast""#]],
        );
        check_override(
            &["robots.positions_m=[[0, 0], [1, nan], [1, 1]]"],
            expect!["--set robots.positions_m=[[0, 0], [1, nan], [1, 1]]: must be a finite number, got NaN"],
        );
        check_override(
            &["field={ lamp = [{ peak = 1 }] }"],
            expect!["--set field={ lamp = [{ peak = 1 }] }: `position_m` is missing in [[field.lamp]]"],
        );
    }

    #[test]
    fn a_flag_of_its_own_is_shown_as_the_user_spelled_it() {
        let robots: Override = "robots.count=0".parse().expect("an override");
        let error = Scenario::parse("x.toml", SMALLEST, &[robots.spelled("--robots 0")]);
        expect!["--robots 0: must be from 1 to 1000000 robots, got 0"]
            .assert_eq(&error.expect_err("no robots").to_string());
    }

    #[test]
    fn a_path_to_an_unknown_key_gets_a_suggestion() {
        check_override(
            &["chanel.range_m=1"],
            expect!["--set chanel.range_m=1: unknown key `chanel`; did you mean `channel`?"],
        );
        check_override(
            &["channel.range=1"],
            expect!["--set channel.range=1: unknown key `range` in [channel]; did you mean `range_m`?"],
        );
        check_override(
            &["field.gausian.0.sigma_m=1"],
            expect![
                "--set field.gausian.0.sigma_m=1: unknown key `gausian` in [field]; did you mean `gaussian`?"
            ],
        );
    }

    #[test]
    fn a_star_sets_every_entry_of_an_array() {
        let two = format!(
            "{SMALLEST}[field]\ngaussian = [{{ center_m = [0, 0], sigma_m = 1 }}, {{ center_m = [1, 1], sigma_m = 2 }}]\n"
        );
        let scenario = parse(&two, &["field.gaussian.*.sigma_m=0.2"]).expect("a good override");
        assert!(scenario.field.gaussian.iter().all(|peak| peak.sigma_m.get() == 0.2));
        check_override(
            &["field.gaussian.*.sigma_m=0.2"],
            expect![[r#"
                --set field.gaussian.*.sigma_m=0.2: there is no entry `*`: `field.gaussian` is empty or not given
                hint: give the array whole: --set 'field.gaussian=[{ sigma_m = ... }]'"#]],
        );
        check_override(
            &["robots.*=1"],
            expect![[r#"
            --set robots.*=1: unknown key `*` in [robots]
            hint: one of `count`, `radius_m`, `speed_limit_m_per_s`, `drive`, `turn_limit_rad_per_s`, `positions_m`, `headings_rad`"#]],
        );
    }

    #[test]
    fn a_path_that_leads_nowhere_says_so() {
        check_override(
            &["seed.first=1"],
            expect!["--set seed.first=1: expected a whole number, found a table"],
        );
        check_override(
            &["arena.size_m.2=1"],
            expect![[r#"
                --set arena.size_m.2=1: there is no entry `2` in an array of 2
                hint: name an entry by its number from 0 on, or all of them by *"#]],
        );
        check_override(
            &["robots.radius_m="],
            expect!["--set robots.radius_m=: there is no key `radius_m` to remove"],
        );
    }

    #[test]
    fn an_entry_of_an_array_that_is_empty_or_not_there_is_said_to_be_missing() {
        check_override(
            &["fault.0.kind=\"kill\""],
            expect![[r#"
                --set fault.0.kind="kill": there is no entry `0`: `fault` is empty or not given
                hint: give the array whole: --set 'fault=[{ kind = ... }]'"#]],
        );
        check_override(
            &["fault=[]", "fault.0.kind=\"kill\""],
            expect![[r#"
                --set fault.0.kind="kill": there is no entry `0`: `fault` is empty or not given
                hint: give the array whole: --set 'fault=[{ kind = ... }]'"#]],
        );
        check_override(
            &["field.lamp=[]", "field.lamp.*.peak=3"],
            expect![[r#"
                --set field.lamp.*.peak=3: there is no entry `*`: `field.lamp` is empty or not given
                hint: give the array whole: --set 'field.lamp=[{ peak = ... }]'"#]],
        );
        check_override(
            &["robots.positions_m.0=[1, 1]"],
            expect![[r#"
                --set robots.positions_m.0=[1, 1]: there is no entry `0`: `robots.positions_m` is empty or not given
                hint: give the array whole: --set 'robots.positions_m=[...]'"#]],
        );
        check_override(
            &["fault=[{ kind = \"pause\" }]", "fault.1.kind=\"kill\""],
            expect![[r#"
                --set fault.1.kind="kill": there is no entry `1` in an array of 1
                hint: name an entry by its number from 0 on, or all of them by *"#]],
        );
        check_override(
            &["foult.0.kind=\"kill\""],
            expect![[r#"--set foult.0.kind="kill": unknown key `foult`; did you mean `fault`?"#]],
        );
    }

    #[test]
    fn a_date_is_called_a_date_and_text_is_told_to_stand_in_quotes() {
        check_override(
            &["name=1979-05-27"],
            expect![[r#"
                --set name=1979-05-27: expected a string, found 1979-05-27, a date or a time to TOML
                hint: in quotes it is text: --set 'name="1979-05-27"'"#]],
        );
        check_override(
            &["name=7"],
            expect![[r#"
                --set name=7: expected a string, found integer `7`
                hint: in quotes it is text: --set 'name="7"'"#]],
        );
        check_override(
            &["arena=07:32:00"],
            expect!["--set arena=07:32:00: expected a table, found 07:32:00, a date or a time to TOML"],
        );
        check_override(
            &["fault=1979-05-27"],
            expect!["--set fault=1979-05-27: expected an array, found 1979-05-27, a date or a time to TOML"],
        );
        check_override(
            &["channel.model=1979-05-27"],
            expect![
                "--set channel.model=1979-05-27: expected a string, found 1979-05-27, a date or a time to TOML"
            ],
        );
        check_override(
            &["fault=[{ kind = \"pause\", robots = 1979-05-27 }]"],
            expect![[
                r#"--set fault=[{ kind = "pause", robots = 1979-05-27 }]: expected robots such as 3, [3, 7] or "3, 7, 10-19", found 1979-05-27, a date or a time to TOML"#
            ]],
        );
        check_override(
            &["channel.rnge_m=1979-05-27"],
            expect![
                "--set channel.rnge_m=1979-05-27: unknown key `rnge_m` in [channel]; did you mean `range_m`?"
            ],
        );
        assert!(overridden(&["name=\"1979-05-27\""]).name == "1979-05-27");
    }

    #[test]
    fn a_count_against_the_positions_of_the_file_is_refused() {
        let text = edited("count = 3", "positions_m = [[0, 0], [1, 1]]");
        expect![[r#"
            --set robots.count=5: robots.count is 5, but robots.positions_m places 2
            hint: without positions_m (on the command line: --set robots.positions_m=) placement is random"#]]
        .assert_eq(&parse(&text, &["robots.count=5"]).expect_err("two counts").to_string());
    }

    #[test]
    fn values_that_disagree_are_blamed_on_the_override_among_them() {
        check_override(
            &["step_s=2"],
            expect![
                "--set step_s=2: gain_per_s × step_s = 2 exceeds 1.5, beyond which the Euler step overshoots; lower one of them, e.g. step_s <= 1.5"
            ],
        );
        check_override(
            &["channel.model=voronoi"],
            expect![[r#"
            --set channel.model=voronoi: channel.range_m has no meaning with channel.model = "voronoi"
            hint: remove it (on the command line: --set channel.range_m=)"#]],
        );
    }
}

mod refusing {
    use super::*;

    #[test]
    fn syntax_errors_have_a_line() {
        check_edit("duration_s = 10", "duration_s 10", expect!["x.toml:1: key with no value, expected `=`"]);
        check_edit("[arena]", "[arena", expect!["x.toml:4: unclosed table, expected `]`"]);
        check_edit(
            "gain_per_s = 1",
            "gain_per_s =",
            expect![[
                r#"x.toml:11: expected a value: a number, true, false, a "quoted string", an array or a table"#
            ]],
        );
        check_edit("count = 3", "count = 3\ncount = 4", expect!["x.toml:9: `count` is given twice"]);
    }

    #[test]
    fn unknown_keys_get_a_suggestion_or_the_valid_keys() {
        check_edit(
            "range_m",
            "rnge_m",
            expect!["x.toml:14: unknown key `rnge_m` in [channel]; did you mean `range_m`?"],
        );
        check_edit(
            "duration_s",
            "duration",
            expect!["x.toml:1: unknown key `duration`; did you mean `duration_s`?"],
        );
        check_edit(
            "[channel]",
            "[chanel]",
            expect!["x.toml:13: unknown key `chanel`; did you mean `channel`?"],
        );
        check_edit(
            "count = 3",
            "count = 3\ncolor = \"red\"",
            expect![[r#"
            x.toml:9: unknown key `color` in [robots]
            hint: one of `count`, `radius_m`, `speed_limit_m_per_s`, `drive`, `turn_limit_rad_per_s`, `positions_m`, `headings_rad`"#]],
        );
        check_text(
            &format!("{SMALLEST}[[field.lamp]]\nposition = [1, 1]\n"),
            expect!["x.toml:16: unknown key `position` in [[field.lamp]]; did you mean `position_m`?"],
        );
        check_edit(
            "[channel]",
            "\"a\\nb\" = 1\n[channel]",
            expect![[r#"
                x.toml:13: unknown key `a\nb` in [controller]
                hint: one of `robots`, `law`, `gain_per_s`, `gradient`, `gradient_magnitude_per_m`, `neighbor_timeout_cycles`, `triangle_base_m`, `triangle_height_m`, `close_distance_m`, `cell_cap_m`"#]],
        );
        check_text(
            &format!("{SMALLEST}[processes]\ntimeout_s = 1\n"),
            expect!["x.toml:16: unknown key `timeout_s` in [processes]; did you mean `timer_jitter_s`?"],
        );
    }

    #[test]
    fn unknown_values_get_a_suggestion_or_the_valid_values() {
        check_edit(
            "range_m = 1",
            "model = \"rang\"",
            expect!["x.toml:14: channel.model: unknown value `rang`; did you mean `range`?"],
        );
        check_edit(
            "range_m = 1",
            "model = \"wifi\"",
            expect![[r#"
            x.toml:14: channel.model: unknown value `wifi`
            hint: one of `range`, `voronoi`"#]],
        );
        check_edit(
            "gain_per_s = 1",
            "gain_per_s = 1\nlaw = \"Linear\"",
            expect!["x.toml:12: controller.law: unknown value `Linear`; did you mean `linear`?"],
        );
    }

    #[test]
    fn missing_keys_are_named_with_their_table() {
        check_edit("duration_s = 10", "", expect!["x.toml: `duration_s` is missing"]);
        check_edit("[arena]\nsize_m = [2, 1]\n", "", expect!["x.toml: the table [arena] is missing"]);
        check_edit("gain_per_s = 1\n", "", expect!["x.toml:10: `gain_per_s` is missing in [controller]"]);
        check_edit("count = 3", "", expect!["x.toml:7: `count` is missing in [robots]"]);
        check_text(
            &format!("{SMALLEST}[[field.lamp]]\npeak = 1\n"),
            expect!["x.toml:15: `position_m` is missing in [[field.lamp]]"],
        );
        check_text("", expect!["x.toml: `duration_s` is missing"]);
    }

    #[test]
    fn wrong_types_say_what_was_expected_and_found() {
        check_edit(
            "step_s = 0.1",
            "step_s = \"fast\"",
            expect![[r#"x.toml:2: step_s: expected a number, found string "fast""#]],
        );
        check_edit(
            "count = 3",
            "count = 2.5",
            expect!["x.toml:8: robots.count: expected a whole number, found `2.5`"],
        );
        check_edit(
            "count = 3",
            "count = [1]",
            expect!["x.toml:8: robots.count: expected a whole number, found an array"],
        );
        check_edit(
            "[2, 1]",
            "[2, 1, 1]",
            expect!["x.toml:5: arena.size_m: must be a pair of numbers [x, y], got 3 of them"],
        );
        check_edit(
            "[2, 1]",
            "[2, true]",
            expect!["x.toml:5: arena.size_m.1: expected a number, found boolean `true`"],
        );
        check_edit("[2, 1]", "2", expect!["x.toml:5: arena.size_m: expected an array, found integer `2`"]);
        check_edit(
            "[arena]\nsize_m = [2, 1]",
            "arena = 1",
            expect!["x.toml:4: arena: expected a table, found integer `1`"],
        );
        check_edit(
            "[channel]",
            "[[channel]]",
            expect!["x.toml:13: expected one table [channel], found an array"],
        );
        check_edit("range_m = 1", "model = 3", expect!["x.toml:14: channel.model: expected a string"]);
        check_edit(
            "step_s = 0.1",
            "step_s = 0.1\nname = 3",
            expect!["x.toml:3: name: expected a string, found integer `3`"],
        );
        check_edit(
            "step_s = 0.1",
            "step_s = 2020-01-01",
            expect!["x.toml:2: step_s: expected a number, found 2020-01-01, a date or a time to TOML"],
        );
        check_edit(
            "size_m",
            "boundary_sensing = 1\nsize_m",
            expect!["x.toml:5: arena.boundary_sensing: expected true or false, found integer `1`"],
        );
    }

    #[test]
    fn numbers_out_of_bounds_say_the_bound() {
        check_edit(
            "duration_s = 10",
            "duration_s = -1",
            expect!["x.toml:1: duration_s: must be a positive number, got -1"],
        );
        check_edit(
            "duration_s = 10",
            "duration_s = inf",
            expect!["x.toml:1: duration_s: must be a finite number, got inf"],
        );
        check_edit(
            "duration_s = 10",
            "duration_s = 1e999",
            expect!["x.toml:1: duration_s: floating-point number overflowed"],
        );
        check_edit(
            "step_s = 0.1",
            "step_s = 0",
            expect!["x.toml:2: step_s: must be a positive number, got 0"],
        );
        check_edit(
            "step_s = 0.1",
            "step_s = 0.1\nseed = -1",
            expect!["x.toml:3: seed: must be from 0 to 9007199254740991, got -1"],
        );
        check_edit(
            "count = 3",
            "count = 0",
            expect!["x.toml:8: robots.count: must be from 1 to 1000000 robots, got 0"],
        );
        check_edit(
            "count = 3",
            "count = 1_000_001",
            expect!["x.toml:8: robots.count: must be from 1 to 1000000 robots, got 1000001"],
        );
        check_edit(
            "count = 3",
            "count = 99999999999999999999",
            expect!["x.toml:8: robots.count: must be from 1 to 1000000 robots, got 99999999999999999999"],
        );
        check_edit(
            "count = 3",
            "count = 3\nradius_m = -0.1",
            expect!["x.toml:9: robots.radius_m: must be zero or a positive number, got -0.1"],
        );
        check_edit(
            "count = 3",
            "positions_m = []",
            expect!["x.toml:8: robots.positions_m: must be from 1 to 1000000 robots, got 0"],
        );
        check_edit(
            "gain_per_s = 1",
            "gain_per_s = nan",
            expect!["x.toml:11: controller.gain_per_s: must be a finite number, got NaN"],
        );
        check_edit(
            "gain_per_s = 1",
            "gain_per_s = 1\nneighbor_timeout_cycles = 0",
            expect![
                "x.toml:12: controller.neighbor_timeout_cycles: expected a whole number from 1 to 4294967295, found integer `0`"
            ],
        );
    }

    #[test]
    fn a_step_longer_than_the_run_is_refused() {
        check_edit(
            "duration_s = 10",
            "duration_s = 0.05",
            expect!["x.toml:2: step_s = 0.1 is longer than the whole run, duration_s = 0.05"],
        );
    }

    #[test]
    fn a_time_of_more_steps_than_are_counted_is_refused_with_the_bound() {
        check_override(
            &["duration_s=1e300"],
            expect![
                "--set duration_s=1e300: duration_s = 1e300 is more than 1000000000 steps of 0.1 s, the most that are counted; use 100000000.0 or less, or a longer step_s"
            ],
        );
        check_override(
            &["step_s=1e-300"],
            expect![
                "--set step_s=1e-300: duration_s = 10.0 is more than 1000000000 steps of 1e-300 s, the most that are counted; use 1e-291 or less, or a longer step_s"
            ],
        );
        for (path, set) in [
            ("output.metrics_every_s", "output.metrics_every_s=2e8"),
            ("output.poses_every_s", "output.poses_every_s=2e8"),
            ("fuzz.duration_s", "fuzz.duration_s=2e8"),
            ("fuzz.delay_max_s", "fuzz.delay_max_s=2e8"),
            ("fault.0.from_s", "fault=[{ kind = \"pause\", from_s = 2e8 }]"),
            ("fault.0.until_s", "fault=[{ kind = \"pause\", until_s = 2e8 }]"),
            ("fault.0.at_s", "fault=[{ kind = \"kill\", robots = 1, at_s = 2e8 }]"),
            ("fault.0.restart_at_s", "fault=[{ kind = \"kill\", robots = 1, at_s = 1, restart_at_s = 2e8 }]"),
            ("fault.0.delay_s", "fault=[{ kind = \"slow\", delay_s = 2e8 }]"),
            ("fault.0.delay_s", "fault=[{ kind = \"delay\", delay_s = 2e8, jitter_s = 1 }]"),
            ("fault.0.jitter_s", "fault=[{ kind = \"delay\", delay_s = 1, jitter_s = 2e8 }]"),
        ] {
            let error = parse(SMALLEST, &[set]).expect_err(set).to_string();
            let message = format!("{path} = 200000000.0 is more than 1000000000 steps of 0.1 s");
            assert!(error.contains(&message), "{error}");
        }
    }

    #[test]
    fn a_gain_that_overshoots_is_refused_with_a_step_that_works() {
        check_edit(
            "gain_per_s = 1",
            "gain_per_s = 25",
            expect![
                "x.toml:11: gain_per_s × step_s = 2.5 exceeds 1.5, beyond which the Euler step overshoots; lower one of them, e.g. step_s <= 0.06"
            ],
        );
        check_edit(
            "gain_per_s = 1",
            "gain_per_s = 7e6",
            expect![
                "x.toml:11: gain_per_s × step_s = 700000 exceeds 1.5, beyond which the Euler step overshoots; lower one of them, e.g. step_s <= 0.000000214"
            ],
        );
    }

    #[test]
    fn the_largest_gain_is_allowed() {
        assert!(parse(SMALLEST, &["controller.gain_per_s=15"]).is_ok());
    }

    #[test]
    fn lists_of_another_length_than_the_count_are_refused() {
        check_edit(
            "count = 3",
            "count = 3\npositions_m = [[0, 0]]",
            expect![[r#"
            x.toml:8: robots.count is 3, but robots.positions_m places 1
            hint: without positions_m (on the command line: --set robots.positions_m=) placement is random"#]],
        );
        check_edit(
            "count = 3",
            "count = 3\nheadings_rad = [0, 0]",
            expect![[r#"
            x.toml:9: robots.headings_rad lists 2, but there are 3 robots
            hint: without headings_rad (on the command line: --set robots.headings_rad=) they are random"#]],
        );
    }

    #[test]
    fn bodies_that_cannot_fit_are_refused_with_figures() {
        check_edit(
            "count = 3",
            "count = 3\nradius_m = 0.6",
            expect!["x.toml:9: a robot of radius 0.6 m does not fit into 2 m x 1 m"],
        );
        check_edit(
            "count = 3",
            "count = 60\nradius_m = 0.1",
            expect![
                "x.toml:9: 60 robots of radius 0.1 m cannot fit: packed as densely as discs can be they need 2.078461 m², the arena has 2 m²"
            ],
        );
    }

    #[test]
    fn positions_outside_the_arena_are_refused_by_their_bodies() {
        check_edit(
            "count = 3",
            "positions_m = [\n  [1, 0.5],\n  [1, 1.5],\n]",
            expect!["x.toml:10: robot 1 at [1, 1.5] is not inside the arena of 2 m x 1 m: its radius is 0 m"],
        );
        check_edit(
            "count = 3",
            "radius_m = 0.1\npositions_m = [[0.05, 0.5]]",
            expect![
                "x.toml:9: robot 0 at [0.05, 0.5] is not inside the arena of 2 m x 1 m: its radius is 0.1 m"
            ],
        );
    }

    #[test]
    fn overlapping_bodies_are_refused_and_touching_ones_allowed() {
        let bodies = |second: &str| format!("radius_m = 0.1\npositions_m = [\n  [0.5, 0.5],\n  {second},\n]");
        check_edit(
            "count = 3",
            &bodies("[0.4, 0.6]"),
            expect![
                "x.toml:11: robots 0 and 1 overlap: their centers are 0.141421 m apart, two bodies need 0.2 m"
            ],
        );
        assert!(parse(&edited("count = 3", &bodies("[0.7, 0.5]")), &[]).is_ok());
    }

    #[test]
    fn a_fixed_gradient_has_a_magnitude_and_a_measured_one_has_none() {
        check_edit(
            "gain_per_s = 1",
            "gain_per_s = 1\ngradient = \"fixed\"",
            expect![[
                r#"x.toml:12: controller.gradient = "fixed" needs `gradient_magnitude_per_m` in [controller]"#
            ]],
        );
        check_edit(
            "gain_per_s = 1",
            "gain_per_s = 1\ngradient_magnitude_per_m = 9",
            expect![[r#"
            x.toml:12: controller.gradient_magnitude_per_m has no meaning with controller.gradient = "measured"
            hint: remove it (on the command line: --set controller.gradient_magnitude_per_m=)"#]],
        );
    }

    #[test]
    fn the_range_model_has_a_range_and_the_voronoi_model_has_none() {
        check_edit(
            "range_m = 1",
            "",
            expect![[r#"x.toml:13: channel.model = "range" needs `range_m` in [channel]"#]],
        );
        check_edit(
            "range_m = 1",
            "model = \"range\"",
            expect![[r#"x.toml:14: channel.model = "range" needs `range_m` in [channel]"#]],
        );
        check_edit(
            "range_m = 1",
            "range_m = 1\nmodel = \"voronoi\"",
            expect![[r#"
            x.toml:14: channel.range_m has no meaning with channel.model = "voronoi"
            hint: remove it (on the command line: --set channel.range_m=)"#]],
        );
    }
}

proptest! {
    #[test]
    fn a_damaged_file_is_loaded_or_refused_in_one_line_and_a_hint(
        start in 0..SMALLEST.len(),
        length in 0..40_usize,
        patch in "[a-z0-9_.=\\[\\]{}\"# \\n-]{0,8}",
    ) {
        let end = (start + length).min(SMALLEST.len());
        let text = format!("{}{patch}{}", &SMALLEST[..start], &SMALLEST[end..]);
        if let Err(error) = parse(&text, &["field.offset=1"]) {
            let lines: Vec<_> = error.to_string().lines().map(str::to_owned).collect();
            prop_assert!(lines[0].starts_with("x.toml") || lines[0].starts_with("--set"), "{error}");
            prop_assert!(lines.len() == 1 || lines.len() == 2 && lines[1].starts_with("hint: "), "{error}");
        }
    }
}

mod files {
    use super::*;

    /// A fresh folder of this test's own.
    fn folder(name: &str) -> PathBuf {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
        fs::create_dir_all(&folder).expect("a writable folder for tests");
        folder
    }

    fn check_file(path: PathBuf, expected: Expect) {
        let error = Scenario::load(&path, &[]).expect_err("a bad file");
        let folder = path.parent().expect("a file in a folder").display().to_string();
        expected.assert_eq(&error.to_string().replace(&folder, "DIR"));
    }

    #[test]
    fn a_missing_file_is_reported_with_similar_names() {
        check_file(
            scenarios().join("swarmbot.toml"),
            expect![[r#"
            DIR/swarmbot.toml: no such file
            hint: did you mean DIR/swarmbots.toml?"#]],
        );
        check_file(
            scenarios().join("swarmbots"),
            expect![[r#"
            DIR/swarmbots: no such file
            hint: did you mean DIR/swarmbots.toml?"#]],
        );
        check_file(scenarios().join("qqq.toml"), expect!["DIR/qqq.toml: no such file"]);
        check_file(scenarios().join("nowhere/x.toml"), expect!["DIR/x.toml: no such file"]);
    }

    #[test]
    fn a_folder_is_not_a_scenario() {
        check_file(scenarios(), expect!["DIR/scenarios: is a directory, not a scenario file"]);
    }

    #[test]
    fn a_file_without_an_end_is_refused_at_the_bound() {
        let error = Scenario::load(Path::new("/dev/zero"), &[]).expect_err("no scenario").to_string();
        assert_eq!(
            error,
            format!("/dev/zero: is longer than {BYTES_MAX} bytes, the most that a scenario may have")
        );
    }

    #[test]
    fn a_file_that_is_not_text_is_refused() {
        let path = folder("not-text").join("x.toml");
        fs::write(&path, b"name = \"a\"\nseed = \xff\n").expect("a writable file");
        check_file(path, expect!["DIR/x.toml: is not UTF-8 text (line 2)"]);
    }
}

mod agreement {
    use super::*;

    #[test]
    fn the_exact_law_wants_cells_that_end() {
        check_edit(
            "gain_per_s = 1",
            "gain_per_s = 1\nlaw = \"exact\"",
            expect![[r#"
                x.toml:12: controller.law = "exact" needs bounded cells: robots that sense no walls may have cells hundreds of meters long
                hint: set arena.boundary_sensing = true, or controller.cell_cap_m (such as 2.0)"#]],
        );
    }

    #[test]
    fn a_cap_of_cells_reaches_no_farther_than_an_arena() {
        check_edit(
            "gain_per_s = 1",
            "gain_per_s = 1\ncell_cap_m = 1.1e5",
            expect![[r#"
            x.toml:12: controller.cell_cap_m = 1.1e5 is beyond 1e5, the side of the largest arena
            hint: without the key cells are not capped"#]],
        );
        assert!(parse(&SMALLEST.replace("gain_per_s = 1", "gain_per_s = 1\ncell_cap_m = 1e5"), &[]).is_ok());
    }

    #[test]
    fn a_field_has_room_for_fifteen_peaks() {
        let lamp = "\n[[field.lamp]]\nposition_m = [1, 0]\npeak = 1\nhalf_distance_m = 1\n";
        let with = |lamps: usize| format!("{SMALLEST}{}", lamp.repeat(lamps));
        assert!(parse(&with(15), &[]).is_ok());
        let error = parse(&with(16), &[]).expect_err("one lamp too many").to_string();
        assert!(error.ends_with("16 Gaussians and lamps are more than the 15 a field can have"), "{error}");
    }
}
