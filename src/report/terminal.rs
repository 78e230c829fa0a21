//! The report as a person sees it in a terminal: a table of levels, a table of sites.

use super::{CostReport, Report, TimeReport, place_of};
use crate::emit::{Form, Output};
use crate::front::{Place, Source};
use crate::search::Measured;
use crate::time::Verdict;
use lodc_passes::{
    Candidate, Facts, Rates, Shader, Stage, WITH_PARAMETERS, WITH_TEXTURES, texture_removal,
};
use naga::{Expression, Handle};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// How much of what was left out is listed: the report has it all.
const LEFT_OUT: usize = 8;

/// The table of levels.
pub fn table(report: &Report) -> String {
    let mut rows = vec![
        [
            "level",
            "autoLOD",
            "distance",
            "error",
            "floor",
            "excess",
            "bound",
            if is_timed(report) { "time" } else { "cost" },
            "samples",
            "what changed",
        ]
        .map(str::to_owned),
    ];
    for (i, level) in report.levels.iter().enumerate() {
        let original = i == 0;
        let unless = |text: String| if original { "-".to_owned() } else { text };
        rows.push([
            i.to_string(),
            format!("{:.2}", level.autolod),
            format!("{:.2}", level.distance),
            unless(format!("{:.3}", level.error.rmse)),
            format!("{:.3}", level.error.floor),
            unless(format!("{:.3}", level.error.excess)),
            unless(format!("{:.3}", level.error.bound)),
            time(&level.time),
            samples(level.cost.texture_samples),
            match level.mesh.file {
                Some(_) => format!("{}; {} triangles", level.says, level.mesh.triangles),
                None => level.says.clone(),
            },
        ]);
    }
    columns(
        &rows,
        &[
            true, false, false, false, false, false, false, false, false, true,
        ],
    )
}

/// Whether the levels were timed.
fn is_timed(report: &Report) -> bool {
    let mut levels = report.levels.iter();
    levels.any(|level| level.time.kind == "measured")
}

/// A share of the original's time, with its interval where it was measured.
fn time(time: &TimeReport) -> String {
    match (time.low, time.high) {
        (Some(low), Some(high)) => {
            // An interval that is narrower than what is printed would look like none.
            let off = (high - time.ratio).max(time.ratio - low).max(0.0005);
            format!("{:.3} +- {off:.3}", time.ratio)
        }
        _ => format!("{:.2}", time.ratio),
    }
}

/// How the levels were timed.
fn timed(report: &Report) -> String {
    let mut out = String::new();
    for level in &report.levels {
        for time in std::iter::once(&level.time).chain(&level.time.others) {
            let Some(adapter) = &time.adapter else {
                continue;
            };
            let line = format!(
                "  time is measured on {adapter}, as a share of the original's at the same distance, with 99 % intervals\n"
            );
            if !out.contains(&line) {
                out.push_str(&line);
            }
        }
    }
    let estimated = report
        .levels
        .iter()
        .skip(1)
        .filter(|level| level.time.kind != "measured");
    if !out.is_empty() && estimated.count() > 0 {
        out.push_str("  a time without an interval is estimated\n");
    }
    let each = |of: &dyn Fn(&TimeReport) -> Option<String>| -> Vec<String> {
        let levels = report.levels.iter().enumerate();
        levels
            .filter_map(|(i, level)| Some(format!("{} of level {i}", of(&level.time)?)))
            .collect()
    };
    for (title, all) in [
        (
            "estimated before",
            match out.is_empty() {
                true => Vec::new(),
                false => (report.levels.iter().enumerate())
                    .filter(|(_, level)| level.time.kind == "measured")
                    .map(|(i, level)| format!("{:.2} of level {i}", level.cost.estimated_time))
                    .collect(),
            },
        ),
        (
            "noise floor",
            each(&|time| Some(format!("{:.3}", time.floor?))),
        ),
        (
            "with the branch of `--form uniform`",
            each(&|time| {
                let branching = time.branching.as_ref()?;
                Some(format!("{:.3}", branching.ratio))
            }),
        ),
        (
            "no difference to the original beyond the noise",
            each(&|time| {
                let same = time.verdict == Some(Verdict::NoDifference);
                same.then(|| format!("{:.3}", time.ratio))
            }),
        ),
    ] {
        if !all.is_empty() {
            let _ = writeln!(out, "  {title}: {}", all.join(", "));
        }
    }
    out
}

/// Samples of a fragment on average: to a tenth, whole numbers without a point.
fn samples(count: f64) -> String {
    let rounded = format!("{count:.1}");
    match rounded.strip_suffix(".0") {
        Some(whole) => whole.to_owned(),
        None => rounded,
    }
}

/// What a person sees when a search has ended: what was read, what was inferred, the levels.
pub fn summary(report: &Report) -> String {
    let mut out = String::new();
    let mut line = |title: &str, text: &str| {
        let _ = writeln!(out, "  {title:<16}{text}");
    };
    for (i, inference) in report.inferences.iter().enumerate() {
        line(if i == 0 { "inferred" } else { "" }, inference);
    }
    let timed_too = match report.timed {
        0 => String::new(),
        timed => format!(", {timed} of them timed"),
    };
    line(
        "searched",
        &format!("{} variants{timed_too}", report.variants),
    );
    out.push('\n');
    out.push_str(&table(report));
    out.push_str(&timed(report));
    if !is_timed(report) || report.goal != "time" {
        out.push_str(&cost(report));
    }
    #[cfg(feature = "mesh")]
    if let Some(joint) = &report.joint {
        out.push_str(&joint.summary());
    }
    out.push_str(&exact(report));
    out.push_str(&held_out(report));
    out.push_str(&stability(report));
    out.push_str(&transitions(report));
    if report.bound == "paper" {
        out.push_str("  the bound is read as Liang's paper reads it: three times the squared error, the floor in it\n");
    }
    out.push_str(&with_host(report));
    for what in report.left_out.iter().take(LEFT_OUT) {
        let _ = writeln!(out, "  left out: {what}");
    }
    if let Some(more @ 1..) = report.left_out.len().checked_sub(LEFT_OUT) {
        let _ = writeln!(out, "  left out: {more} more, in the report");
    }
    out.push('\n');
    out
}

/// How the levels stand beyond the pictures.
fn stability(report: &Report) -> String {
    let mut text = String::new();
    let mut stable = 0;
    let mut inputs = u64::MAX;
    for level in &report.levels {
        let stability = &level.stability;
        inputs = inputs.min(stability.inputs.unwrap_or(inputs));
        match stability.worst.first() {
            Some(worst) => {
                let at = level.autolod;
                let _ = writeln!(text, "  UNSTABLE from autoLOD {at} on: {worst}");
            }
            None => stable += 1,
        }
    }
    if stable == report.levels.len() && inputs < u64::MAX {
        let rate = 3.0 / inputs.max(1) as f64;
        let _ = writeln!(
            text,
            "  no level fails on an input on which the original holds: under {rate:.1e} of inputs at 95 %"
        );
    }
    text
}

/// What the costs are.
fn cost(report: &Report) -> String {
    let of_time = "executed operations, a texture sample counted as 100";
    let what = match &*report.goal {
        "time" => return format!("  cost is estimated, not timed: {of_time}\n"),
        "accesses" => "texture accesses of a fragment",
        "textures" => "textures that are bound",
        "memory" => "bytes of the textures that are bound",
        "operations" => "executed operations without texture samples",
        mixed => {
            let named = format!("{mixed}, each as a share of the original's; time is {of_time}");
            return format!("  cost is a weighted mean: {named}\n");
        }
    };
    format!("  cost is by the goal: {what}, as a share of the original's\n")
}

/// What costs no error, in a line; nothing where there is no such thing.
fn exact(report: &Report) -> String {
    let Some(exact) = &report.exact else {
        return String::new();
    };
    let [_, left] = exact.texture_samples;
    format!(
        "  exact: cost {:.2}, {} samples, the same picture: in every level, and in no figure of what the others gain\n",
        exact.cost,
        samples(left)
    )
}

/// The errors of the levels on pictures that decided nothing; nothing where there is no level.
fn held_out(report: &Report) -> String {
    let errors: Vec<String> = report
        .levels
        .iter()
        .filter_map(|level| {
            let rmse = format!("{:.3}", level.error.held_out_rmse?);
            Some(match level.error.held_out_standard_error {
                Some(chance) => format!("{rmse} +- {chance:.3}"),
                None => rmse,
            })
        })
        .collect();
    if errors.is_empty() {
        return String::new();
    }
    format!(
        "  error on pictures that the search has not seen: {}\n",
        errors.join(", ")
    )
}

/// What transitions cost; nothing where levels pop.
fn transitions(report: &Report) -> String {
    let levels = report.levels.iter().enumerate();
    let all: Vec<String> = levels
        .filter_map(|(i, level)| {
            let transition = level.transition.as_ref()?;
            let cost = transition
                .cost
                .map_or("unknown".to_owned(), |cost| format!("{cost:.2}"));
            let time = transition.time.as_ref();
            let time = time.map_or_else(String::new, |time| format!(", time {:.3}", time.ratio));
            Some(format!(
                "{} into level {i} until {:.2}, cost {cost}{time}",
                transition.kind, transition.until
            ))
        })
        .collect();
    match all.is_empty() {
        true => String::new(),
        false => format!(
            "  both levels are drawn in the bands between: {}\n",
            all.join("; ")
        ),
    }
}

/// What levels would cost if the host did more for them, where that is a difference.
fn with_host(report: &Report) -> String {
    let line = |of: &dyn Fn(&CostReport) -> Option<f64>, says: &str| -> String {
        let levels = report.levels.iter().enumerate();
        let costs: Vec<String> = levels
            .filter_map(|(i, level)| Some(format!("{:.2} of level {i}", of(&level.cost)?)))
            .collect();
        match costs.is_empty() {
            true => String::new(),
            false => format!("  with {says}: cost {}\n", costs.join(", ")),
        }
    };
    let parameters = line(
        &|cost| cost.ratio_with_parameters,
        "--host parameters, what is the same for a whole draw is computed once",
    );
    let textures = line(
        &|cost| cost.ratio_with_textures,
        "--host textures, samples at the same coordinates become one",
    );
    parameters + &textures
}

/// What to do next, after the files have been written.
pub fn next(report: &Report, output: Output) -> String {
    let next = if report.levels.len() < 2 {
        "nothing was worth a level: raise e_max or distance.farthest in the scene"
    } else {
        match output.form {
            _ if output.per_pixel.is_some() => "draw with it: each pixel chooses its level",
            Form::Override => {
                "set the pipeline constant autoLOD, or choose per draw with --form uniform"
            }
            Form::Uniform => "fill the uniform autoLOD for each draw",
            Form::Files => "load the file of the level that autoLOD selects",
        }
    };
    format!("  next            {next}\n")
}

/// The table of every value that could be simplified, in the order of the source's lines, with what
/// the best single change there saves and adds at `distance`, by what the samples showed there.
pub fn inspection(
    shader: &Shader,
    source: &Source,
    distance: f64,
    original: &Measured,
    facts: &Facts,
    tried: &[(Candidate, Option<Measured>)],
) -> String {
    /// What is known of a site: its rates, how many candidates each pass has, and the best one.
    #[derive(Default)]
    struct Site<'a> {
        /// The rate that it has, and the one that it could have.
        rates: [String; 2],
        passes: BTreeMap<&'a str, usize>,
        /// Where a texture's mean could take its place: the standard deviation of its texels, of the worst channel.
        deviation: Option<f32>,
        /// Saved share of the cost, added error, and the change.
        best: Option<(f64, f64, &'a Candidate)>,
    }
    let stages = [Stage::Vertex, Stage::Fragment].map(|stage| (stage, Rates::of(shader, stage)));
    let rates_at = |(stage, value): (Stage, Handle<Expression>)| {
        // A texture's variable is a site, and no value.
        if let Expression::GlobalVariable(_) = shader.function(stage)?.expressions[value] {
            return None;
        }
        let (_, rates) = stages.iter().find(|(of, _)| *of == stage)?;
        let rates = rates.as_ref()?;
        let line = |at| place_of(shader, source, (stage, at)).map(|place| line_of(&place));
        Some([rates.now().to_string(), cheaper(rates, value, &line)])
    };
    let mut sites: BTreeMap<(usize, u32, &str), (String, Site<'_>)> = BTreeMap::new();
    for (candidate, measured) in tried {
        let found = shader.find(&candidate.site);
        let place = found.and_then(|at| place_of(shader, source, at));
        let (file, line) = place.as_ref().map_or((0, 0), |p| (p.file.start, p.line()));
        let (_, site) = sites
            .entry((file, line, candidate.site.path()))
            .or_insert_with(|| {
                let site = Site {
                    rates: found.and_then(rates_at).unwrap_or_default(),
                    ..Site::default()
                };
                (place.as_ref().map_or_else(String::new, line_of), site)
            });
        *site.passes.entry(&candidate.pass).or_default() += 1;
        if let Some(deviation) = texture_removal::deviation(shader, facts, candidate) {
            site.deviation = deviation.into_iter().reduce(f32::max);
        }
        let Some(measured) = measured else { continue };
        let saved = 1.0 - measured.cost / original.cost;
        let added = (measured.error.square() - original.error.square())
            .max(0.0)
            .sqrt();
        // The most saved for the error: a change that adds none is the best there can be.
        let worth = |saved: f64, added: f64| saved / added.max(1e-6);
        if saved > 0.0
            && site
                .best
                .is_none_or(|(s, a, _)| worth(saved, added) > worth(s, a))
        {
            site.best = Some((saved, added, candidate));
        }
    }
    let mut rows = vec![
        [
            "line",
            "value",
            "rate",
            "could be",
            "candidates",
            "saves",
            "excess",
            "by",
        ]
        .map(str::to_owned),
    ];
    for ((_, _, value), (line, site)) in sites {
        let deviation = site.deviation.map(|d| format!("texels +- {d:.2}"));
        let passes: Vec<String> = site
            .passes
            .iter()
            .map(|(pass, count)| {
                let mut asking = WITH_PARAMETERS.iter().chain(WITH_TEXTURES);
                let mark = match asking.any(|asking| asking.name() == *pass) {
                    true => "*",
                    false => "",
                };
                if *count == 1 {
                    format!("{pass}{mark}")
                } else {
                    format!("{pass}{mark} ({count})")
                }
            })
            .chain(deviation)
            .collect();
        let (saves, excess, by) = match site.best {
            Some((saved, added, candidate)) => (
                format!("{:.1} %", saved * 100.0),
                format!("{added:.4}"),
                short(&candidate.choice).to_owned(),
            ),
            None => ("-".to_owned(), "-".to_owned(), String::new()),
        };
        let [now, could_be] = site.rates;
        let value = value.to_owned();
        rows.push([
            line,
            value,
            now,
            could_be,
            passes.join(", "),
            saves,
            excess,
            by,
        ]);
    }
    let left = [false, true, true, true, true, false, false, true];
    let table = columns(&rows, &left);
    let asks = match table.contains("*") {
        true => {
            "  * asks the host to fill a block, or to bind new textures: --host parameters,textures\n"
        }
        false => "",
    };
    format!("{table}  each change alone, at distance {distance:.2}; cost is estimated\n{asks}")
}

/// The cheaper rates that a value could have, or what keeps it where it is.
fn cheaper(
    rates: &Rates,
    value: Handle<Expression>,
    line: &dyn Fn(Handle<Expression>) -> Option<String>,
) -> String {
    let (exactly, approximately) = (rates.exactly(value), rates.approximately(value));
    if exactly < rates.now() && exactly <= approximately {
        return format!("{exactly}, exactly");
    }
    if approximately < rates.now() {
        return format!("{approximately}, approximately");
    }
    let stop = rates.stop(value);
    stop.map_or_else(String::new, |stop| match line(stop.value) {
        Some(line) => format!("stops at {} in line {line}", stop.why),
        None => format!("stops at {}", stop.why),
    })
}

/// A line of the shader's own file as its number, one of another file with that file's name.
fn line_of(place: &Place<'_>) -> String {
    let file = Path::new(place.file.name).file_name();
    match file.filter(|_| !place.is_in_main()) {
        Some(file) => format!("{}:{}", file.display(), place.line()),
        None => place.line().to_string(),
    }
}

/// A choice without the hash of the value that it names.
fn short(choice: &str) -> &str {
    choice.split_once('#').map_or(choice, |(named, _)| named)
}

/// Rows as aligned columns, two spaces in front; `left` says which are aligned to the left.
pub(super) fn columns<const N: usize>(rows: &[[String; N]], left: &[bool; N]) -> String {
    let mut widths = [0; N];
    for row in rows {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = (*width).max(cell.chars().count());
        }
    }
    let mut out = String::new();
    for row in rows {
        let mut line = String::from(" ");
        for ((cell, width), left) in row.iter().zip(widths).zip(left) {
            let _ = if *left {
                write!(line, " {cell:<width$} ")
            } else {
                write!(line, " {cell:>width$} ")
            };
        }
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out
}
