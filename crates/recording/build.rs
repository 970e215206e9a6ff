//! Makes types of the messages in `proto/`, and the descriptions of them that a recording brings along for its readers.

use std::{env, error::Error, fs, path::Path};

use prost::Message;
use prost_build::Config;
use prost_types::FileDescriptorSet;

fn main() -> Result<(), Box<dyn Error>> {
    let out = env::var("OUT_DIR")?;
    let mut all = FileDescriptorSet::default();
    for name in ["foxglove", "lamplight"] {
        let file = format!("{name}.proto");
        // With all that they import, or readers cannot use them; without comments, which are half of it.
        let mut compiler = protox::Compiler::new(["proto"])?;
        compiler.include_imports(true).include_source_info(false).open_file(&file)?;
        let descriptors = compiler.file_descriptor_set();
        fs::write(Path::new(&out).join(format!("{name}.bin")), descriptors.encode_to_vec())?;
        for file in descriptors.file {
            if !all.file.iter().any(|known| known.name == file.name) {
                all.file.push(file);
            }
        }
    }
    Config::new().compile_fds(all)?;
    println!("cargo:rerun-if-changed=proto");
    Ok(())
}
