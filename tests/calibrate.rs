//! `lodc calibrate`, as a person runs it. Nothing here says how good a model is: only what is timed, and what is made of it.
#![cfg(all(feature = "gpu", feature = "cli"))]

mod fixtures;
mod pictures;

use lodc::time::model::{Calibration, Features};
use pictures::open;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder with a small copy of a material.
fn place(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("calibrate-{name}"));
    let _ = fs::remove_dir_all(&folder);
    fixtures::small_materials(&folder, 48, &["offsets = 1", "levels = 2"]);
    folder
}

fn calibrate(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lodc"))
        .current_dir(folder)
        .env("LODC_CACHE", folder.join("cache"))
        .arg("calibrate")
        .args(arguments)
        .output()
        .expect("lodc starts")
}

#[test]
fn a_material_is_timed_and_a_model_is_written() {
    if open("vulkan").is_none() {
        return;
    }
    let folder = place("clay");
    let arguments = [
        "clay.wgsl",
        "--variants",
        "3",
        "--time-budget",
        "0.05",
        "--adapter",
        "vulkan",
        "-o",
        "model.json",
    ];
    let output = calibrate(&folder, &arguments);
    let (table, said) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(output.status.success(), "{said}");
    assert!(table.contains("9 taken, 0 found"), "{table}");
    assert!(table.contains("3 variants of 1 shader"), "{table}");
    assert!(table.contains("He et al. 2015"), "{table}");
    let calibration = Calibration::read(&folder.join("model.json")).expect("it was written");
    assert!(calibration.model.is_calibrated());
    // Three variants and the original, at three distances.
    let all = calibration.measurements();
    assert_eq!(all.len(), 12);
    for measurement in all {
        assert!(
            measurement.ms > 0.0 && measurement.ratio > 0.0,
            "{measurement:?}"
        );
        let Features { invocation, extent } = measurement.features();
        assert!(
            extent.fragments > 0.0 && extent.vertices > 0.0,
            "{extent:?}"
        );
        assert!(extent.lanes >= extent.fragments && extent.stamp_lanes >= extent.lanes);
        // Clay's vertices are computed on, whatever becomes of its fragments.
        assert!(invocation.vertex.operations() > 0.0, "{invocation:?}");
    }
    let fragments = |variant: u32| {
        let mut of = all.iter().filter(|m| m.variant == variant);
        of.next().map(|m| m.features().extent.fragments)
    };
    assert_eq!(fragments(0), fragments(1));
    // What was timed is not timed again, and gives the same.
    let again = calibrate(&folder, &arguments);
    let table = String::from_utf8_lossy(&again.stdout);
    assert!(table.contains("0 taken, 9 found"), "{table}");
    assert_eq!(
        Calibration::read(&folder.join("model.json")).expect("it was written"),
        calibration
    );
}

#[test]
fn what_cannot_be_calibrated_is_said() {
    let folder = place("refused");
    for (arguments, says) in [
        (&[][..], "<SHADER>"),
        (&["gone.wgsl"], "gone.wgsl"),
        (
            &["clay.wgsl", "--adapter", "Voodoo 2"],
            "nothing to calibrate on",
        ),
        (&["clay.wgsl", "--variants", "0"], "--variants"),
    ] {
        let output = calibrate(&folder, arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(says), "{said}");
    }
}
