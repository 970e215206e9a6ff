//! Controllers and their robots: what `[controller]` and `[[controller]]` mean, and what is refused with its line.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use coverage::law::Law;
use expect_test::{Expect, expect};
use protocol::setup::Mode;
use scenario::{Override, Scenario, ScenarioError};

/// Five robots; controllers begin in line 7.
fn text(controllers: &str) -> String {
    format!(
        "duration_s = 10\nstep_s = 0.1\narena.size_m = [2, 1]\nrobots.count = 5\nfield.offset = 1\n\
         channel.range_m = 1\n{controllers}"
    )
}

fn parse(controllers: &str) -> Result<Scenario, ScenarioError> {
    Scenario::parse("folder/x.toml", &text(controllers), &[])
}

fn check(controllers: &str, expected: Expect) {
    expected.assert_eq(&parse(controllers).expect_err("a bad scenario").to_string());
}

fn mixed() -> Scenario {
    parse(
        "[[controller]]\nrobots = \"0-2\"\nlaw = \"uniform\"\ngain_per_s = 1\n\
         [[controller]]\nrobots = [3, 4]\nprogram = [\"./my-robot\", \"--fast\"]\n\
         params = { threshold = 3, deep = { share = 0.1, names = [\"a\"] } }\n",
    )
    .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_mixed_swarm_says_of_each_robot_who_thinks_for_it() {
    let scenario = mixed();
    assert_eq!(scenario.coverage_setup(2).map(|setup| setup.law), Some(Law::Uniform));
    assert_eq!(scenario.coverage_setup(3), None);
    let controller = scenario.controller_of(4);
    let program = controller.program().expect("a program");
    let beside = std::path::absolute("folder/my-robot").expect("a path");
    assert_eq!(program.command, [&beside.display().to_string(), "--fast"]);
    let setup = scenario.agent_setup(Mode::Lockstep, controller);
    expect![[r#"{"deep":{"names":["a"],"share":0.1},"threshold":3}"#]]
        .assert_eq(str::from_utf8(setup.params.bytes()).expect("text"));
    assert!(controller.senses_gradient() && !controller.senses_field());
}

#[test]
fn a_mixed_swarm_is_equal_after_a_round_trip() {
    let scenario = mixed();
    assert_eq!(
        Scenario::parse("elsewhere/y.toml", &scenario.to_toml(), &[]).expect("it is sound").controllers,
        scenario.controllers
    );
}

#[test]
fn one_program_may_think_for_all_and_need_no_robots() {
    for table in ["[controller]", "[[controller]]"] {
        let scenario =
            parse(&format!("{table}\nprogram = [\"robot\"]")).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scenario.controllers[0].robots.to_string(), "0-4");
        assert_eq!(scenario.controllers[0].program().map(|program| program.json()), Some(b"{}".to_vec()));
        assert!(
            scenario.to_toml().contains("\n[controller]\nprogram = [\"robot\"]\n"),
            "{}",
            scenario.to_toml()
        );
    }
}

#[test]
fn every_robot_has_one_controller() {
    let two = |first: &str, second: &str| {
        format!("[[controller]]\n{first}\ngain_per_s = 1\n[[controller]]\n{second}\nprogram = [\"x\"]\n")
    };
    check(
        &two("robots = \"0-3\"", "robots = \"3-4\""),
        expect![[r#"
        folder/x.toml:11: robot 3 is named by two controllers: this one and number 0
        hint: name each robot once"#]],
    );
    check(
        &two("robots = \"0-1\"", "robots = \"3-4\""),
        expect![[r#"
        folder/x.toml:8: robot 2 has no controller: no entry names it
        hint: the scenario has robots 0 to 4; name each once"#]],
    );
    check(
        &two("robots = \"0-1\"", "robots = \"2-5\""),
        expect![[r#"
            folder/x.toml:11: there is no robot 5: the scenario has robots 0 to 4
            hint: name those that there are, or take more robots"#]],
    );
    check(
        &two("robots = \"0-1\"", ""),
        expect![[r#"
        folder/x.toml:10: `robots` is missing in [[controller]]: there is more than one entry
        hint: say which robots each is for, such as robots = "0-9""#]],
    );
    check(
        "controller = []",
        expect![[r#"
        folder/x.toml:7: controller is empty: nobody thinks for the robots
        hint: give one [controller] for all robots, or a [[controller]] for some each"#]],
    );
    check(
        "[controller]\nrobots = \"0-3\"\ngain_per_s = 1",
        expect![[r#"
        folder/x.toml:7: robot 4 has no controller: no entry names it
        hint: the scenario has robots 0 to 4; name each once"#]],
    );
}

#[test]
fn a_table_has_the_keys_of_a_law_or_of_a_program() {
    check(
        "[controller]\nlaw = \"linear\"\nprogram = [\"x\"]",
        expect![[r#"
        folder/x.toml:8: an entry has either `law` or `program`, not both
        hint: give each an entry in [[controller]], with its `robots`"#]],
    );
    check(
        "[controller]\nprogram = [\"x\"]\ngain_per_s = 1",
        expect![[r#"
        folder/x.toml:9: `gain_per_s` has no meaning beside `program`: it is for the laws of the paper
        hint: a program has its parameters in `params = { gain_per_s = ... }`"#]],
    );
    check(
        "[controller]\ngain_per_s = 1\nparams = { a = 1 }",
        expect![[r#"
            folder/x.toml:9: `params` has no meaning without `program` or `python`: laws have keys of their own
            hint: name the `program` that they are for, or remove them"#]],
    );
    check(
        "[[controller]]\nrobots = \"0-4\"",
        expect![[r#"
            folder/x.toml:7: nobody thinks for these robots: there is neither a `law` nor a `program`, nor `python`
            hint: give the law of the paper its gain, such as gain_per_s = 1.0, or name a `program` or a class in `python`"#]],
    );
    check(
        "[controller]\nprogram = [\"x\", \"a\\u0000\"]",
        expect![[r#"
        folder/x.toml:8: a word of `program` has a NUL character
        hint: the operating system ends a word there; leave it out"#]],
    );
    check(
        "[controller]\nprogram = [\"x\"]\nprogam = 1",
        expect!["folder/x.toml:9: unknown key `progam` in [controller]; did you mean `program`?"],
    );
    check(
        "[[controller]]\ngain_per_s = 1\nlawn = \"linear\"",
        expect!["folder/x.toml:9: unknown key `lawn` in [[controller]]; did you mean `law`?"],
    );
    check("controller = 3", expect!["folder/x.toml:7: controller: expected a table, found integer `3`"]);
}

#[test]
fn a_program_has_a_name_and_parameters_that_json_can_say() {
    check(
        "[controller]\nprogram = []",
        expect![[r#"
        folder/x.toml:8: `program` is empty
        hint: name it, such as program = ["./my-robot"], or give a `law`"#]],
    );
    check(
        "[controller]\nprogram = [\"\"]",
        expect![[r#"
        folder/x.toml:8: `program` is empty
        hint: name it, such as program = ["./my-robot"], or give a `law`"#]],
    );
    check(
        "[controller]\nprogram = \"./x\"",
        expect![[r#"folder/x.toml:8: controller.program: expected an array, found string "./x""#]],
    );
    check(
        "[controller]\nprogram = [\"x\"]\nparams = 3",
        expect!["folder/x.toml:9: controller.params: expected a table, found integer `3`"],
    );
    check(
        "[controller]\nprogram = [\"x\"]\nparams = { deep = [{ since = 1979-05-27 }] }",
        expect![[r#"
        folder/x.toml:9: controller.params.deep.0.since: 1979-05-27 is a date or a time, which JSON has not; programs get their params as JSON
        hint: give it as text, in quotes, or as another number"#]],
    );
    check(
        "[controller]\nprogram = [\"x\"]\n[controller.params]\nlimit = inf",
        expect![[r#"
        folder/x.toml:10: controller.params.limit: this is inf, which JSON has not; programs get their params as JSON
        hint: give it as text, in quotes, or as another number"#]],
    );
}

#[test]
fn what_a_law_must_not_is_blamed_on_its_entry() {
    check(
        "[[controller]]\nrobots = \"0-2\"\ngain_per_s = 1\n[[controller]]\nrobots = \"3-4\"\ngain_per_s = 25",
        expect![
            "folder/x.toml:12: gain_per_s × step_s = 2.5 exceeds 1.5, beyond which the Euler step overshoots; lower one of them, e.g. step_s <= 0.06"
        ],
    );
    check(
        "[[controller]]\nrobots = \"0-2\"\ngain_per_s = 1\n[[controller]]\nrobots = \"3-4\"\nlaw = \"exact\"\ngain_per_s = 1",
        expect![[r#"
            folder/x.toml:12: controller.1.law = "exact" needs bounded cells: robots that sense no walls may have cells hundreds of meters long
            hint: set arena.boundary_sensing = true, or controller.cell_cap_m (such as 2.0)"#]],
    );
}

#[test]
fn a_false_reading_is_refused_where_a_program_thinks() {
    let liar = |robots: &str| {
        format!(
            "[[controller]]\nrobots = \"0-2\"\ngain_per_s = 1\n\
             [[controller]]\nrobots = \"3-4\"\nprogram = [\"my-robot\"]\n\
             [[fault]]\nkind = \"liar\"\nlight_counts = 7\n{robots}"
        )
    };
    let refused = expect![[r#"
        folder/x.toml:15: `light_counts` has no meaning for robot 3: its payload is up to my-robot
        hint: name `robots` that a `law` moves, or give false bytes by `payload_hex`"#]];
    for robots in ["robots = [1, 3]", ""] {
        refused.assert_eq(&parse(&liar(robots)).expect_err("a bad scenario").to_string());
    }
    assert_eq!(parse(&liar("robots = \"0-2\"")).err(), None);
}

/// A fresh folder of this test's own.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).expect("a writable folder for tests");
    folder
}

fn not_found(folder: &Path, program: &str, expected: Expect) {
    let source = folder.join("x.toml").display().to_string();
    let text = text(&format!("[controller]\nprogram = [\"{program}\"]"));
    let mut scenario = Scenario::parse(&source, &text, &[]).unwrap_or_else(|error| panic!("{error}"));
    let error = scenario.find_controllers().expect_err("nothing to start").to_string();
    expected.assert_eq(&error.replace(&folder.display().to_string(), "DIR"));
}

#[test]
fn a_program_that_cannot_be_started_is_refused_by_who_would_start_it() {
    let folder = folder("programs");
    not_found(
        &folder,
        "./missing",
        expect![[r#"
        DIR/x.toml:7: the program DIR/missing of robots 0-4 cannot be started: No such file or directory (os error 2)
        hint: build it, or correct its path, which is relative to the scenario file"#]],
    );
    not_found(
        &folder,
        "no-such-robot-anywhere",
        expect![[r#"
        DIR/x.toml:7: the program `no-such-robot-anywhere` of robots 0-4 is not in PATH
        hint: give its path, such as ./no-such-robot-anywhere, which is relative to the scenario file"#]],
    );
    not_found(
        &folder,
        "./",
        expect![[r#"
        DIR/x.toml:7: the program DIR/ of robots 0-4 is a directory
        hint: name a program in it"#]],
    );
    fs::write(folder.join("plain"), "#!/bin/sh\n").expect("a writable file");
    not_found(
        &folder,
        "./plain",
        expect![[r#"
        DIR/x.toml:7: the program DIR/plain of robots 0-4 is not executable
        hint: make it so with `chmod +x`, or name another one"#]],
    );

    let text = text("[controller]\nprogram = [\"sh\", \"./ours\"]");
    let mut scenario = Scenario::parse("x.toml", &text, &[]).unwrap_or_else(|error| panic!("{error}"));
    scenario.find_controllers().expect("every machine has a shell");
    let command = &scenario.controllers[0].program().expect("a program").command;
    let file = fs::metadata(&command[0]).expect("the shell");
    assert!(file.permissions().mode() & 0o111 != 0 && command[1] == "./ours", "{command:?}");
}

#[test]
fn who_starts_no_processes_refuses_programs() {
    assert_eq!(parse("controller.gain_per_s = 1").expect("a law").refuse_programs(false, "run it"), Ok(()));
    let error = mixed().refuse_programs(false, "use --engine processes").expect_err("a program").to_string();
    let folder = std::path::absolute("folder").expect("a path").display().to_string();
    expect![[r#"
        folder/x.toml:11: robots 3-4 need processes: they run DIR/my-robot
        hint: use --engine processes"#]]
    .assert_eq(&error.replace(&folder, "DIR"));
}

#[test]
fn a_program_in_a_folder_whose_name_is_no_text_is_refused_with_its_line() {
    let text = text("controller.program = [\"./mind\"]\n");
    // So a path reads that is no UTF-8.
    let refusal = Scenario::parse("caf\u{FFFD}/x.toml", &text, &[]).expect_err("nobody could start it");
    expect![[r#"
        caf�/x.toml:7: the folder of caf�/x.toml has a name that is no UTF-8, and so has the program
        hint: move them into another folder"#]]
    .assert_eq(&refusal.to_string());
}

#[test]
fn a_class_in_python_may_think_for_robots() {
    let scenario = parse(
        "[[controller]]\nrobots = \"0-2\"\ngain_per_s = 1\n[[controller]]\nrobots = [3, 4]\n\
         python = \"my.py:ToTheLight\"\nneighbor_timeout_cycles = 3\nparams = { speed = 0.1 }\n",
    )
    .unwrap_or_else(|error| panic!("{error}"));
    let controller = scenario.controller_of(4);
    let python = controller.python().expect("a class");
    let beside = std::path::absolute("folder/my.py").expect("a path");
    assert_eq!(
        (&*python.file, python.class.as_deref()),
        (beside.to_str().expect("text"), Some("ToTheLight"))
    );
    let setup = scenario.agent_setup(Mode::Lockstep, controller);
    expect![[r#"{"params":{"speed":0.1},"neighbor_timeout_ticks":3}"#]]
        .assert_eq(str::from_utf8(setup.params.bytes()).expect("text"));
    let again = Scenario::parse("elsewhere/y.toml", &scenario.to_toml(), &[]).expect("it is sound");
    assert_eq!(again.controllers, scenario.controllers);
    assert_eq!(scenario.refuse_programs(true, "no"), Ok(()));
    assert!(scenario.refuse_programs(false, "no").is_err());
}

#[test]
fn keys_of_a_class_in_python_are_checked() {
    let entry = |keys: &str| format!("[controller]\n{keys}");
    check(
        &entry("python = \"my.py:a class\""),
        expect![[r#"
            folder/x.toml:8: `a class` is no name of a class
            hint: name a file and a class in it, such as python = "my.py:ToTheLight""#]],
    );
    check(
        &entry("python = \":ToTheLight\""),
        expect![[r#"
            folder/x.toml:8: `:ToTheLight` names no file
            hint: name a file and a class in it, such as python = "my.py:ToTheLight""#]],
    );
    check(
        &entry("python = \"my.py\"\nprogram = [\"x\"]"),
        expect![[r#"
            folder/x.toml:9: an entry has either `program` or `python`, not both
            hint: give each an entry in [[controller]], with its `robots`"#]],
    );
    check(
        &entry("python = \"my.py\"\ngain_per_s = 1"),
        expect![[r#"
            folder/x.toml:9: `gain_per_s` has no meaning beside `python`: it is for the laws of the paper
            hint: a controller has its parameters in `params = { gain_per_s = ... }`"#]],
    );
    check(
        &entry("program = [\"x\"]\nfolder = \"y\""),
        expect![[r#"
            folder/x.toml:9: `folder` has no meaning without `speaks = "json-lines"`
            hint: remove it, or put `env -C FOLDER` before the program"#]],
    );
}

#[test]
fn a_program_that_speaks_lines_is_started_beside_the_scenario() {
    let of = |keys: &str| {
        let scenario =
            parse(&format!("[controller]\nprogram = [\"node\", \"my.js\"]\nspeaks = \"json-lines\"\n{keys}"));
        scenario.expect("it is sound").controllers[0].program().expect("a program").folder.clone()
    };
    let absolute = |path: &str| Some(std::path::absolute(path).expect("a path").display().to_string());
    assert_eq!(of(""), absolute("folder"));
    assert_eq!(of("folder = \"deeper\""), absolute("folder/deeper"));
}

#[test]
fn the_command_line_gives_robots_a_controller_in_python() {
    let given = |controllers: &str, options: &[&str]| {
        let overrides: Vec<_> =
            options.iter().map(|option| Override::controller(option).expect("an option")).collect();
        let scenario = Scenario::parse("folder/x.toml", &text(controllers), &overrides)?;
        let named = scenario.controllers.iter().map(|controller| {
            let name =
                controller.own_name().map(|name| name.rsplit('/').next().unwrap_or_default().to_owned());
            format!("{}: {}", controller.robots, name.unwrap_or("a law".into()))
        });
        Ok::<_, ScenarioError>(named.collect::<Vec<_>>().join("; "))
    };
    let law = "[controller]\ngain_per_s = 1";
    let two = "[[controller]]\nrobots = \"0-2\"\ngain_per_s = 1\n[[controller]]\nrobots = \"3-4\"\nprogram = [\"x\"]";
    for (controllers, options, expected) in [
        (law, &["my.py:A"][..], "0-4: my.py:A"),
        (two, &["my.py"], "0-4: my.py"),
        (law, &["my.py:A=1-2"], "0,3-4: a law; 1-2: my.py:A"),
        (two, &["my.py:A=2-3"], "0-1: a law; 4: x; 2-3: my.py:A"),
        (two, &["my.py:A=0-2", "my.py:B=1"], "3-4: x; 0,2: my.py:A; 1: my.py:B"),
        (law, &["a=1/my.py:A"], "0-4: my.py:A"),
        (two, &["my.py:A", "my.py:B=1"], "0,2-4: my.py:A; 1: my.py:B"),
    ] {
        assert_eq!(given(controllers, options).as_deref(), Ok(expected), "{options:?}");
    }
    expect![[r#"
        --controller my.py:A=7: there is no robot 7: the scenario has robots 0 to 4
        hint: name those that there are, or take more robots"#]]
    .assert_eq(&given(law, &["my.py:A=7"]).expect_err("no such robot").to_string());
    assert!(given(law, &["my.py:A=x"]).is_err());
}

#[test]
fn a_file_is_known_by_its_contents() {
    let folder = folder("contents");
    fs::write(folder.join("my.py"), "pass\n").expect("a writable file");
    let source = folder.join("x.toml").display().to_string();
    let mut scenario =
        Scenario::parse(&source, &text("[controller]\npython = \"my.py\""), &[]).expect("it is sound");
    scenario.find_controllers().expect("the file is there");
    expect!["9f56e761d79bfdb34304a012586cb04d16b435ef6130091a97702e559260a2f2"].assert_eq(
        scenario.controllers[0].python().and_then(|python| python.sha256.as_deref()).expect("a hash"),
    );
    let resolved = scenario.to_toml();
    let again = || Scenario::parse(&source, &resolved, &[]).expect("it is sound").find_controllers();
    assert_eq!(again(), Ok(()));
    fs::write(folder.join("my.py"), "pass \n").expect("a writable file");
    assert!(again().expect_err("another file").to_string().contains("is another one: its SHA-256 is "));
}
