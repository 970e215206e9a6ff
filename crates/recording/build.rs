//! Makes types of the messages in `proto/`, and the descriptions of them that a recording brings along for its readers.

use std::{env, error::Error, fs, path::Path};

use prost_build::Config;

fn main() -> Result<(), Box<dyn Error>> {
    let files = ["proto/foxglove.proto", "proto/lamplight.proto"];
    let descriptors = protox::compile(files, ["proto"])?;
    let out = env::var("OUT_DIR")?;
    // With all that they import, or readers cannot use them.
    fs::write(Path::new(&out).join("descriptors.bin"), prost::Message::encode_to_vec(&descriptors))?;
    Config::new().compile_fds(descriptors)?;
    println!("cargo:rerun-if-changed=proto");
    Ok(())
}
