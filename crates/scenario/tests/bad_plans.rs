//! Channels and fault plans that cannot be: each is refused with its line and a way out.

use expect_test::{Expect, expect};
use scenario::Scenario;

/// Two robots; what is checked begins in line 14.
fn error(rest: &str) -> String {
    let text = format!(
        "\
duration_s = 100
step_s = 0.1
controller.gain_per_s = 1

[arena]
size_m = [2, 1]

[robots]
count = 5
radius_m = 0.01

[channel]
range_m = 1
{rest}"
    );
    Scenario::parse("plan.toml", &text, &[]).expect_err("a bad plan").to_string()
}

fn check(rest: &str, expected: Expect) {
    expected.assert_eq(&error(rest));
}

fn check_fault(fault: &str, expected: Expect) {
    check(&format!("[[fault]]\n{fault}"), expected);
}

mod channels {
    use super::*;

    #[test]
    fn a_packet_longer_than_its_cycle_is_refused() {
        check(
            "profile = \"isis\"\nairtime_s = 0.3",
            expect![[
                "plan.toml:15: a packet of channel.airtime_s = 0.3 is longer than the cycle, channel.cycle_s = 0.25"
            ]],
        );
    }

    #[test]
    fn an_angle_step_that_does_not_divide_a_turn_is_refused() {
        check(
            "bearing_step_deg = 50",
            expect![[r#"
            plan.toml:14: channel.bearing_step_deg = 50 does not divide 360 degrees
            hint: the nearest steps that do are 45 and 51.42857142857143 (0 is exact)"#]],
        );
        check(
            "profile = \"isis\"\norientation_step_deg = 240",
            expect![[r#"
            plan.toml:15: channel.orientation_step_deg = 240 does not divide 360 degrees
            hint: the nearest steps that do are 180 and 360 (0 is exact)"#]],
        );
        for whole in ["0", "360", "0.1", "22.5", "51.42857142857143"] {
            let text = format!(
                "duration_s = 1\nstep_s = 0.1\ncontroller.gain_per_s = 1\narena.size_m = [2, 1]\nrobots.count = 5\n\
                 channel = {{ range_m = 1, bearing_step_deg = {whole}, orientation_step_deg = {whole} }}"
            );
            Scenario::parse("plan.toml", &text, &[]).unwrap_or_else(|error| panic!("{error}"));
        }
    }

    #[test]
    fn a_cycle_shorter_than_a_tick_is_refused() {
        check(
            "access = \"random\"\ncycle_s = 0.05",
            expect![[
                "plan.toml:15: channel.cycle_s = 0.05 is shorter than a tick, step_s = 0.1; lower step_s"
            ]],
        );
    }

    #[test]
    fn keys_without_a_meaning_are_refused() {
        check(
            "airtime_s = 0.01",
            expect![[r#"
                plan.toml:14: channel.airtime_s has no meaning with channel.profile = "ideal"
                hint: remove it (on the command line: --set channel.airtime_s=)"#]],
        );
        check(
            "access = \"aligned\"\nslots = 8",
            expect![[r#"
                plan.toml:15: channel.slots has no meaning with channel.access = "aligned"
                hint: remove it (on the command line: --set channel.slots=)"#]],
        );
        check(
            "[light]\ndiodes = 8",
            expect![[r#"
                plan.toml:15: light.diodes has no meaning with light.sensor = "ideal"
                hint: remove it (on the command line: --set light.diodes=)"#]],
        );
    }

    #[test]
    fn what_does_not_fit_into_a_cycle_is_refused() {
        check(
            "profile = \"isis\"\naccess = \"slotted\"\nslots = 51",
            expect![["plan.toml:16: 51 slots of channel.airtime_s = 0.005 do not fit into cycle_s = 0.25"]],
        );
        check(
            "profile = \"isis\"\naccess = \"fixed-phase\"\njitter_s = 0.25",
            expect![[
                "plan.toml:16: channel.jitter_s = 0.25 and airtime_s = 0.005 do not fit into cycle_s = 0.25"
            ]],
        );
        check(
            "profile = \"isis\"\nguard_s = 0.001",
            expect![[
                "plan.toml:15: channel.guard_s = 0.001 is not between airtime_s = 0.005 (a packet ends in its own cycle) and cycle_s = 0.25"
            ]],
        );
    }

    #[test]
    fn chances_and_shares_are_bounded() {
        check(
            "loss = 1.5",
            expect![["plan.toml:14: channel.loss: must be a probability from 0 to 1, got 1.5"]],
        );
        check("sigma_range = 5", expect![["plan.toml:14: channel.sigma_range = 5 is more than 1"]]);
        check(
            "soft_edge_m = 1.5",
            expect![["plan.toml:14: the soft edge of 1.5 m is wider than the range of 1 m"]],
        );
    }

    #[test]
    fn a_cycle_has_room_on_the_fastest_clock_or_is_refused() {
        check(
            "profile = \"isis\"\naccess = \"fixed-phase\"\njitter_s = 0.24\n[processes]\nclock_drift_ppm = 50000",
            expect![[
                "plan.toml:18: jitter and airtime of 0.245 s cannot be in a cycle of the fastest clock: with processes.clock_drift_ppm = 50000 it lasts 0.2375 s"
            ]],
        );
        check(
            "profile = \"isis\"\nguard_s = 0.25\n[processes]\nclock_drift_ppm = 50",
            expect![[
                "plan.toml:17: the guard of 0.25 s cannot be in a cycle of the fastest clock: with processes.clock_drift_ppm = 50 it lasts 0.249988 s"
            ]],
        );
    }

    #[test]
    fn interference_that_cannot_be_is_refused() {
        check(
            "profile = \"isis\"\ninterference_range_m = 0.9",
            expect![[r#"
                plan.toml:15: channel.interference_range_m = 0.9 is less than range_m = 1: a packet that can be read disturbs as well
                hint: without it (on the command line: --set channel.interference_range_m=) it is range_m"#]],
        );
        check(
            "interference_range_m = 2",
            expect![[r#"
                plan.toml:14: channel.interference_range_m has no meaning with channel.profile = "ideal"
                hint: remove it (on the command line: --set channel.interference_range_m=)"#]],
        );
        check(
            "profile = \"isis\"\noccluded_interference = true",
            expect![[r#"
                plan.toml:15: channel.occluded_interference has no meaning without channel.occlusion = true: bodies block nothing
                hint: remove it (on the command line: --set channel.occluded_interference=)"#]],
        );
        check(
            "occlusion = true\noccluded_interference = true",
            expect![[r#"
                plan.toml:15: channel.occluded_interference has no meaning with channel.profile = "ideal"
                hint: remove it (on the command line: --set channel.occluded_interference=)"#]],
        );
    }

    #[test]
    fn a_gain_too_high_for_the_cycle_is_refused() {
        check(
            "profile = \"isis\"\ncycle_s = 2",
            expect![[
                "plan.toml:3: gain_per_s × cycle_s = 2 exceeds 1.5, beyond which the Euler step overshoots; lower one of them, e.g. channel.cycle_s <= 1.5"
            ]],
        );
    }

    #[test]
    fn a_ring_needs_lamps_and_a_fixed_gradient() {
        check(
            "[light]\nsensor = \"ring\"",
            expect![[r#"plan.toml:15: light.sensor = "ring" needs lamps, and the field has none"#]],
        );
        check(
            "[light]\nsensor = \"ring\"\ndiodes = 2",
            expect![["plan.toml:16: light.diodes: must be from 3 to 64 diodes, got 2"]],
        );
    }
}

mod faults {
    use super::*;

    #[test]
    fn a_misspelled_kind_or_key_gets_a_suggestion() {
        check_fault(
            "kind = \"los\"",
            expect![["plan.toml:15: fault.0.kind: unknown value `los`; did you mean `loss`?"]],
        );
        check_fault(
            "kind = \"loss\"\nprobabillity = 0.1",
            expect![["plan.toml:16: unknown key `probabillity` in [[fault]]; did you mean `probability`?"]],
        );
    }

    #[test]
    fn a_kind_names_what_it_needs_and_what_it_does_not_know() {
        check_fault(
            "kind = \"loss\"",
            expect![[r#"plan.toml:15: a fault of kind "loss" needs `probability`"#]],
        );
        check_fault(
            "kind = \"jam\"\nregion = { center_m = [1, 1], radius_m = 1 }\nprobability = 0.5",
            expect![[r#"
                plan.toml:17: `probability` has no meaning in a fault of kind "jam"
                hint: it knows `from_s`, `region`, `until_s`"#]],
        );
        check_fault(
            "kind = \"kill\"\nat_s = 3",
            expect![[r#"plan.toml:15: a fault of kind "kill" needs one of `robots`, `region`, `share`"#]],
        );
    }

    #[test]
    fn an_empty_window_is_refused() {
        check_fault(
            "kind = \"pause\"\nfrom_s = 5\nuntil_s = 5",
            expect![["plan.toml:17: the window is empty: until_s = 5 does not come after from_s = 5"]],
        );
        check_fault(
            "kind = \"pause\"\nfrom_s = 1.06\nuntil_s = 1.1",
            expect![["plan.toml:17: the window is empty: 1.06 s and 1.1 s fall on the same tick of 0.1 s"]],
        );
    }

    #[test]
    fn nobody_is_restarted_before_being_killed() {
        check_fault(
            "kind = \"kill\"\nrobots = 1\nat_s = 5\nrestart_at_s = 4",
            expect![[
                "plan.toml:18: restart_at_s = 4 does not come after at_s = 5: nobody can be restarted before being killed"
            ]],
        );
    }

    #[test]
    fn overlapping_windows_of_faults_that_exclude_each_other_are_refused() {
        check_fault(
            "kind = \"pause\"\nrobots = \"0-2\"\nfrom_s = 5\n[[fault]]\nkind = \"pause\"\nrobots = [2, 3]\nfrom_s = 7\nuntil_s = 8",
            expect![[
                r#"plan.toml:19: two faults of kind "pause" strike robot 2 at once: this one (7 s to 8 s) and number 0 (5 s to the end)"#
            ]],
        );
    }

    #[test]
    fn chances_lie_between_0_and_1() {
        check_fault(
            "kind = \"loss\"\nprobability = -0.1",
            expect![["plan.toml:16: fault.0.probability: must be a probability from 0 to 1, got -0.1"]],
        );
        check_fault(
            "kind = \"pause\"\nshare = 0",
            expect![["plan.toml:16: fault.0.share: must be a share above 0, at most 1, got 0"]],
        );
        check_fault(
            "kind = \"burst\"\np = 0\nr = 0",
            expect![["plan.toml:16: p and r are both 0: links would never change"]],
        );
    }

    #[test]
    fn false_bytes_are_bytes_and_lie_in_a_payload() {
        check_fault(
            "kind = \"liar\"\npayload_hex = \"abc\"",
            expect![[
                r#"plan.toml:16: fault.0.payload_hex: must be 1 to 128 bytes of two hexadecimal digits each, such as "00c07f45", got `abc`"#
            ]],
        );
        check_fault(
            "kind = \"liar\"\nidentity = 1\npayload_offset = 2",
            expect!["plan.toml:17: `payload_offset` has no meaning without `payload_hex`"],
        );
        check_fault(
            "kind = \"liar\"\npayload_hex = \"abcd\"\npayload_offset = 8",
            expect![
                "plan.toml:16: payload_hex ends at byte 10 of the payload, and no payload has more than channel.payload_bytes_max = 9 bytes"
            ],
        );
    }

    #[test]
    fn unknown_robots_are_refused_wherever_they_are_named() {
        check_fault(
            "kind = \"pause\"\nrobots = \"1,5\"",
            expect![["plan.toml:16: there is no robot 5: the scenario has robots 0 to 4"]],
        );
        check_fault(
            "kind = \"delay\"\ndelay_s = 1\nlinks = [\"0->1\", \"7<->2\"]",
            expect![["plan.toml:17: there is no robot 7: the scenario has robots 0 to 4"]],
        );
        check_fault(
            "kind = \"liar\"\nidentity = 9",
            expect![["plan.toml:16: there is no robot 9: the scenario has robots 0 to 4"]],
        );
        check_fault(
            "kind = \"partition\"\ngroups = [\"0-1\", \"2-8\"]",
            expect![["plan.toml:16: there is no robot 8: the scenario has robots 0 to 4"]],
        );
    }

    #[test]
    fn robots_and_links_that_cannot_be_read_are_refused() {
        check_fault(
            "kind = \"pause\"\nrobots = \"5-3\"",
            expect![["plan.toml:16: fault.0.robots: must name robots such as \"3, 7, 10-19\", got `5-3`"]],
        );
        check_fault(
            "kind = \"pause\"\nrobots = []",
            expect![["plan.toml:16: fault.0.robots: must name robots such as \"3, 7, 10-19\", got `[]`"]],
        );
        check_fault(
            "kind = \"loss\"\nprobability = 1\nlinks = [\"3-4\"]",
            expect![[
                "plan.toml:17: fault.0.links: must be a link such as \"3->7\" (packets of 3 to 7) or \"3<->7\" (both ways), got `3-4`"
            ]],
        );
    }

    #[test]
    fn a_jam_outside_the_arena_is_refused() {
        check_fault(
            "kind = \"jam\"\nregion = { center_m = [9, 9], radius_m = 1 }",
            expect![["plan.toml:16: the disc of 1 m around [9, 9] lies outside the arena of 2 m x 1 m"]],
        );
    }

    #[test]
    fn choices_that_contradict_each_other_are_refused() {
        check_fault(
            "kind = \"loss\"\nprobability = 1\nlinks = [\"3->4\"]\nrobots = 3",
            expect![["plan.toml:18: give either `links` or `robots`, not both"]],
        );
        check_fault(
            "kind = \"loss\"\nprobability = 1\nlinks = []",
            expect![["plan.toml:17: `links` is empty: no packet is struck"]],
        );
        check_fault(
            "kind = \"pause\"\nrobots = [-1]",
            expect![
                "plan.toml:16: fault.0.robots.0: expected a whole number from 0 to 4294967295, found integer `-1`"
            ],
        );
        check_fault(
            "kind = \"partition\"\ngroups = [\"0-2\", \"2-4\"]",
            expect![["plan.toml:16: robot 2 is in groups 0 and 1"]],
        );
        check_fault(
            "kind = \"pause\"\npick = \"random\"",
            expect![["plan.toml:16: `pick` says how a `share` is chosen, and there is none"]],
        );
        check_fault(
            "kind = \"pause\"\nshare = 0.5\npick = \"nearest-lamps\"",
            expect![[r#"plan.toml:17: pick = "nearest-lamps" needs lamps, and the field has none"#]],
        );
    }

    /// A field with two lamps and a Gaussian, and a change of it that begins in line 18.
    fn check_change(change: &str, expected: Expect) {
        let field = "[field]\nlamp = [{ position_m = [0, 0], peak = 5, half_distance_m = 1 }, { position_m = [2, 0], \
                     peak = 5, half_distance_m = 1 }]\ngaussian = [{ center_m = [1, 1], sigma_m = 1 }]";
        check(&format!("{field}\n[[fault]]\nkind = \"field\"\nat_s = 5\n{change}"), expected);
    }

    #[test]
    fn a_change_of_the_field_is_of_one_term_that_is_there_and_changes_something() {
        check_fault(
            "kind = \"field\"\noffset = 1",
            expect![[r#"plan.toml:15: a fault of kind "field" needs `at_s`"#]],
        );
        check_change(
            "",
            expect![[r#"plan.toml:18: a fault of kind "field" needs one of `lamp`, `gaussian`, `offset`"#]],
        );
        check_change(
            "peak = 1",
            expect![[r#"plan.toml:18: a fault of kind "field" needs one of `lamp`, `gaussian`, `offset`"#]],
        );
        check_change(
            "lamp = 2\npeak = 1",
            expect!["plan.toml:20: there is no lamp 2: the field has 2, numbered from 0"],
        );
        check_change(
            "gaussian = 7\ngamma = 1",
            expect!["plan.toml:20: there is no gaussian 7: the field has 1, numbered from 0"],
        );
        check_fault(
            "kind = \"field\"\nat_s = 5\nlamp = 0\npeak = 1",
            expect!["plan.toml:17: there is no lamp 0: the field has none"],
        );
        check_change(
            "lamp = -1\npeak = 1",
            expect![
                "plan.toml:20: fault.0.lamp: expected a whole number from 0 to 4294967295, found integer `-1`"
            ],
        );
        check_change(
            "lamp = 1",
            expect![
                "plan.toml:20: lamp 1 is given nothing to change: it needs one of `position_m`, `peak`, `half_distance_m`"
            ],
        );
        check_change(
            "gaussian = 0",
            expect![
                "plan.toml:20: gaussian 0 is given nothing to change: it needs one of `center_m`, `sigma_m`, `gamma`"
            ],
        );
        check_change(
            "lamp = 0\npeak = 1\noffset = 3",
            expect![[r#"
            plan.toml:22: a fault of kind "field" changes one term: give either `lamp` or `offset`
            hint: two faults may strike at the same `at_s`"#]],
        );
        check_change(
            "lamp = 0\ngaussian = 0\npeak = 1",
            expect![[r#"
            plan.toml:21: a fault of kind "field" changes one term: give either `lamp` or `gaussian`
            hint: two faults may strike at the same `at_s`"#]],
        );
        check_change(
            "lamp = 0\npeak = 1\ngamma = 2",
            expect![[r#"
            plan.toml:22: `gamma` has no meaning beside `lamp`
            hint: a lamp has `position_m`, `peak`, `half_distance_m`"#]],
        );
        check_change(
            "gaussian = 0\nhalf_distance_m = 2",
            expect![[r#"
            plan.toml:21: `half_distance_m` has no meaning beside `gaussian`
            hint: a gaussian has `center_m`, `sigma_m`, `gamma`"#]],
        );
        check_change(
            "offset = 0\npeak = 2",
            expect![[r#"
            plan.toml:21: `peak` has no meaning beside `offset`
            hint: the offset is a number, and nothing else of it can change"#]],
        );
        check_change(
            "offset = 0\nrobots = 2",
            expect![[r#"
            plan.toml:21: `robots` has no meaning in a fault of kind "field"
            hint: it knows `at_s`, `center_m`, `gamma`, `gaussian`, `half_distance_m`, `lamp`, `offset`, `peak`, `position_m`, `sigma_m`"#]],
        );
        check_change(
            "offset = 0\nrestart_at_s = 7",
            expect![[r#"
            plan.toml:21: `restart_at_s` has no meaning in a fault of kind "field"
            hint: it knows `at_s`, `center_m`, `gamma`, `gaussian`, `half_distance_m`, `lamp`, `offset`, `peak`, `position_m`, `sigma_m`"#]],
        );
        check_change(
            "offset = 0\nuntil_s = 7",
            expect![[r#"
            plan.toml:21: `until_s` has no meaning in a fault of kind "field"
            hint: it knows `at_s`, `center_m`, `gamma`, `gaussian`, `half_distance_m`, `lamp`, `offset`, `peak`, `position_m`, `sigma_m`"#]],
        );
    }

    #[test]
    fn a_change_of_the_field_is_within_the_bounds_of_the_field() {
        check_change("lamp = 0\npeak = 1e13", expect!["plan.toml:21: peak = 1e13 is beyond -1e12 to 1e12"]);
        check_change(
            "lamp = 0\nhalf_distance_m = 1e-9",
            expect!["plan.toml:21: half_distance_m = 1e-9 is beyond 1e-6 to 1e12"],
        );
        check_change(
            "lamp = 0\nhalf_distance_m = 0",
            expect!["plan.toml:21: fault.0.half_distance_m: must be a positive number, got 0"],
        );
        check_change(
            "lamp = 0\nposition_m = [1, nan]",
            expect!["plan.toml:21: fault.0.position_m: must be a finite number, got NaN"],
        );
        check_change(
            "lamp = 0\nposition_m = [1, 2, 3]",
            expect!["plan.toml:21: fault.0.position_m: must be a pair of numbers [x, y], got 3 of them"],
        );
        check_change(
            "gaussian = 0\nsigma_m = -1",
            expect!["plan.toml:21: fault.0.sigma_m: must be a positive number, got -1"],
        );
        check_change(
            "gaussian = 0\nsigma_m = 1e-7",
            expect!["plan.toml:21: sigma_m = 1e-7 is beyond 1e-6 to 1e12"],
        );
        check_change(
            "gaussian = 0\ngamma = -2e12",
            expect!["plan.toml:21: gamma = -2e12 is beyond -1e12 to 1e12"],
        );
        check_change("offset = -2e12", expect!["plan.toml:20: offset = -2e12 is beyond -1e12 to 1e12"]);
    }

    #[test]
    fn delays_that_delay_nothing_are_refused() {
        check_fault(
            "kind = \"slow\"\ndelay_s = 0.04",
            expect![[
                "plan.toml:16: delay_s = 0.04 is less than half a tick of 0.1 s: nothing would be late"
            ]],
        );
    }

    #[test]
    fn numbers_beyond_all_reason_are_refused() {
        check_fault(
            "kind = \"sensor\"\nbias_counts = -1e300",
            expect![["plan.toml:16: bias_counts = -1e300 is beyond -1e12 to 1e12"]],
        );
        check_fault(
            "kind = \"motion\"\ndrift_m_per_s = [0, 1e7]",
            expect![["plan.toml:16: drift_m_per_s = 1e7 is beyond -1e6 to 1e6"]],
        );
    }
}
