//! `lamplight new controller`: a folder to begin with, whose every command runs as it is.

use std::{
    env, fs, io,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail};
use clap::{Args, Subcommand, ValueEnum};

use crate::{failure::Failure, python::own_program, status::Status, stdout::say};

#[derive(Args, Debug)]
pub(crate) struct NewArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Make a folder with a controller, a scenario, a test and a README
    Controller(ControllerArgs),
}

#[derive(Args, Debug)]
struct ControllerArgs {
    /// Name of the folder and of the controller: letters, digits, - and _, such as to-the-light
    name: String,

    /// Language of the controller
    #[arg(long, value_enum, default_value_t)]
    lang: Language,

    /// Checkout of Lamplight that a controller in Rust is built against [default: the one that this program was built in]
    #[arg(long, value_name = "DIR")]
    checkout: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Language {
    /// A class, by the package lamplight
    #[default]
    Python,
    /// A type, built on a checkout of Lamplight
    Rust,
    /// Any program that reads and writes lines of JSON, begun in JavaScript
    JsonLines,
}

const SCENARIO: &str = include_str!("../templates/scenario.toml");
const PYTHON: &[(&str, &str)] = &[
    ("controller.py", include_str!("../templates/python/controller.py")),
    ("test_controller.py", include_str!("../templates/python/test_controller.py")),
    ("README.md", include_str!("../templates/python/README.md")),
];
const JSON_LINES: &[(&str, &str)] = &[
    ("controller.js", include_str!("../templates/json-lines/controller.js")),
    ("test.js", include_str!("../templates/json-lines/test.js")),
    ("README.md", include_str!("../templates/json-lines/README.md")),
];
const RUST: &[(&str, &str)] = &[
    ("Cargo.toml", include_str!("../templates/rust/Cargo.toml.in")),
    ("src/main.rs", include_str!("../templates/rust/main.rs.in")),
    ("README.md", include_str!("../templates/rust/README.md")),
];

pub(crate) fn new(args: &NewArgs) -> Result<Status, Failure> {
    let What::Controller(args) = &args.what;
    let ControllerArgs { name, lang, checkout } = args;
    let begins = name.starts_with(|first: char| first.is_ascii_alphabetic());
    if !begins || !name.chars().all(|char| char.is_ascii_alphanumeric() || "-_".contains(char)) {
        let message = "a name begins with a letter and has letters, digits, - and _, such as to-the-light";
        return Err(Failure::Usage(anyhow!("`{name}`: {message}")));
    }
    let checkout = match lang {
        Language::Rust => checkout_of(checkout.as_deref()).map_err(Failure::Usage)?,
        Language::Python | Language::JsonLines => String::new(),
    };
    let (files, controller) = match lang {
        Language::Python => (PYTHON, format!("python = \"controller.py:{}\"", camel_case(name))),
        Language::JsonLines => {
            (JSON_LINES, "program = [\"node\", \"controller.js\"]\nspeaks = \"json-lines\"".into())
        }
        Language::Rust => (RUST, format!("program = [\"./target/release/{name}\"]")),
    };
    let filled = |text: &str| {
        text.replace("{{name}}", name)
            .replace("{{Name}}", &camel_case(name))
            .replace("{{checkout}}", &checkout)
            .replace("{{controller}}", &controller)
    };
    let folder = Path::new(name);
    fs::create_dir(folder).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => {
            Failure::Usage(anyhow!("{name} is there already; take another name, or remove it"))
        }
        _ => Failure::Run(anyhow!("{name} cannot be made: {error}")),
    })?;
    for (file, text) in files.iter().chain([&("scenario.toml", SCENARIO)]) {
        write(&folder.join(file), &filled(text)).map_err(Failure::Run)?;
    }
    let build = if *lang == Language::Rust { "cargo build --release && " } else { "" };
    say(&format!("made {name}; now: cd {name} && {build}lamplight run scenario.toml\n"))?;
    Ok(Status::SUCCESS)
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    let folder = path.parent().context("a file lies in a folder")?;
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(path, text))
        .with_context(|| path.display().to_string())
}

/// The checkout that a controller in Rust is built against.
fn checkout_of(named: Option<&Path>) -> anyhow::Result<String> {
    let is_checkout = |folder: &Path| folder.join("robot-agent/Cargo.toml").is_file();
    let found = match named {
        Some(folder) if is_checkout(folder) => fs::canonicalize(folder)?,
        Some(folder) => bail!("{} is no checkout of Lamplight", folder.display()),
        None => {
            let us = own_program()?;
            let around = us.ancestors().find(|folder| is_checkout(folder)).map(Path::to_path_buf);
            around.or_else(|| env::current_dir().ok().filter(|folder| is_checkout(folder))).context(
                "a controller in Rust is built against a checkout of Lamplight; name one by --checkout DIR",
            )?
        }
    };
    found.to_str().map(Into::into).with_context(|| format!("{}: its name is no UTF-8", found.display()))
}

/// `to-the-light` as the name of a type: `ToTheLight`.
fn camel_case(name: &str) -> String {
    let words = name.split(['-', '_']).filter(|word| !word.is_empty());
    words.map(|word| word[..1].to_uppercase() + &word[1..]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_folders_become_names_of_types() {
        for (name, expected) in
            [("to-the-light", "ToTheLight"), ("x", "X"), ("a_b-", "AB"), ("already2", "Already2")]
        {
            assert_eq!(camel_case(name), expected);
        }
    }
}
