//! What a calibration says to a person: how good the model is on what it was not fitted to, and its weights.

use crate::compile::{Calibrated, Timings};
use crate::time::model::{Comparison, Judged, Quality};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The table of a calibration.
pub fn calibration(calibrated: &Calibrated) -> String {
    let Calibrated {
        calibration,
        adapter,
        timings: Timings {
            taken,
            found,
            missing,
        },
        ..
    } = calibrated;
    let all = calibration.measurements();
    let shaders: BTreeSet<&str> = all.iter().map(|m| &*m.shader).collect();
    let of_variants: BTreeSet<(&str, u32)> = (all.iter())
        .filter(|m| m.variant > 0)
        .map(|m| (&*m.shader, m.variant))
        .collect();
    let mut text = String::new();
    let mut line = |name: &str, says: &str| {
        let _ = writeln!(text, "  {name:<16}{says}");
    };
    line("adapter", adapter);
    line(
        "timings",
        &format!("{taken} taken, {found} found in what was timed before, {missing} failed"),
    );
    for problem in &calibrated.problems {
        line("", problem);
    }
    line(
        "measured",
        &format!(
            "{} draws: {} variants of {} shader{}, and the originals",
            all.len(),
            of_variants.len(),
            shaders.len(),
            if shaders.len() == 1 { "" } else { "s" }
        ),
    );
    let [half, tenth] = calibrated.spread.map(|width| 100.0 * width);
    line(
        "spread",
        &format!("half of the timings are known to {half:.1} %, nine in ten to {tenth:.1} %"),
    );
    for (warning, count) in &calibrated.warned {
        line("", &format!("{warning}: {count} timings"));
    }
    text += "\n                          milliseconds        share of the original\n";
    text += "  of what was held out     error     ranks      error     ranks\n";
    part(&mut text, "variants", &calibration.on_variants());
    match calibration.on_shaders() {
        Some(comparison) => part(&mut text, "whole shaders", &comparison),
        None => text += "  whole shaders            too few\n",
    }
    text += "\n  one of               takes, nanoseconds of a draw\n";
    for (name, weight) in calibration.model.weights() {
        let _ = writeln!(text, "  {name:<20} {:>12}", short(1e6 * weight));
    }
    let [fragments, geometry, stamps] = calibration.model.exponents();
    let _ = writeln!(
        text,
        "  the parts of fragments are added with p = {fragments:.1}, and with those of vertices p = {geometry:.1};\n  \
         {:.0} % of what is not covered of a 4 x 4 block is shaded",
        100.0 * stamps
    );
    text + "\n"
}

fn part(text: &mut String, name: &str, comparison: &Comparison) {
    let Comparison { model, he } = comparison;
    for (name, of, Quality { times, ratios }) in [(name, "lodc", model), ("", "He et al. 2015", he)]
    {
        let of = format!("{name:<15}{of}");
        let _ = writeln!(text, "  {of:<24}{}   {}", judged(times), judged(ratios));
    }
}

fn judged(judged: &Judged) -> String {
    format!("{:6.1} %  {:8.3}", 100.0 * judged.error, judged.spearman)
}

/// Three figures.
fn short(number: f64) -> String {
    match number {
        0.0 => "0".to_owned(),
        x if x < 1e-3 => format!("{x:.1e}"),
        x if x < 10.0 => format!("{x:.3}"),
        x => format!("{x:.0}"),
    }
}
