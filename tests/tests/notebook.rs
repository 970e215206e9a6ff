//! The example notebook runs from its first cell to its last, as its reader would run it.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{fs, path::Path, process::Command};

use tests::programs::{interpreter, program, said};

/// Runs a notebook in its folder; an error of a cell is one of this.
const RUN: &str = "import nbclient, nbformat, sys; \
                   notebook = nbformat.read(sys.argv[1], as_version=4); \
                   nbclient.NotebookClient(notebook, timeout=600, kernel_name='python3').execute()";

#[test]
fn the_notebook_runs_to_its_end() {
    let Some(python) = interpreter() else { return };
    let notebook =
        fs::canonicalize(Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/notebook.ipynb")).unwrap();
    // The kernel's files go with the test, too.
    let home = tempfile::tempdir().unwrap();
    let output = Command::new(&python)
        .args(["-c", RUN])
        .arg(&notebook)
        .current_dir(notebook.parent().unwrap())
        .env("LAMPLIGHT_PROGRAM", program("lamplight"))
        .envs(["HOME", "IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "MPLCONFIGDIR"].map(|name| (name, home.path())))
        .env("MPLBACKEND", "agg")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));
}
