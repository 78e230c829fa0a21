//! A calibration: times that were measured, the model that was fitted to them, and how good that is on what it was not
//! fitted to.

use super::features::COUNT;
use super::{Features, Judged, Model, coefficient, figures, he, judged};
use crate::Diagnostic;
use crate::scene::chance::{child, unit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

/// The part of the variants that a model is judged by, and not fitted to.
const HELD_OUT: f64 = 0.25;
/// Shaders that there are at least where whole ones are held out: what is left has to say something of others.
const SHADERS: usize = 3;

/// What was measured of a variant at a distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// The shader's file name.
    pub shader: String,
    /// Which of its variants; 0 is the original.
    pub variant: u32,
    /// From the eye to the object's centre, world units.
    pub distance: f64,
    /// How long its draw takes, milliseconds.
    pub ms: f64,
    /// The same as a share of the original's.
    pub ratio: f64,
    /// The lower end of the ratio's interval of 99 %.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// As [`Features::row`] has them.
    features: Vec<f64>,
}

/// A model with what it was fitted to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Fitted to all of it.
    pub model: Model,
    /// The names of the features, in their order.
    columns: Vec<String>,
    measurements: Vec<Measurement>,
}

/// How good predictions are: of times, and of variants' times as shares of their originals' at the same distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Of milliseconds.
    pub times: Judged,
    /// Of shares.
    pub ratios: Judged,
}

/// The same of our model and of He's, of measurements that neither was fitted to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Of [`Model`].
    pub model: Quality,
    /// Of [`he`], times a coefficient that was fitted.
    pub he: Quality,
}

impl Measurement {
    /// What was measured of a variant; `ratio` is its share of the original's time, with its interval.
    pub fn new(
        (shader, variant): (&str, u32),
        (distance, features): (f64, &Features),
        ms: f64,
        [low, ratio, high]: [f64; 3],
    ) -> Self {
        Self {
            shader: shader.to_owned(),
            variant,
            distance,
            ms: figures(ms),
            ratio: figures(ratio),
            low: figures(low),
            high: figures(high),
            features: features.row().map(figures).to_vec(),
        }
    }

    /// What its draw executes.
    pub fn features(&self) -> Features {
        let mut row = [0.0; COUNT];
        for (to, number) in row.iter_mut().zip(&self.features) {
            *to = *number;
        }
        Features::of_row(&row)
    }

    /// Whether it is the original of a measurement.
    fn is_original_of(&self, other: &Self) -> bool {
        self.variant == 0 && self.shader == other.shader && self.distance == other.distance
    }
}

impl Calibration {
    /// Fits a model to measurements on an adapter.
    pub fn new(measurements: Vec<Measurement>, adapter: &str) -> Self {
        let all: Vec<&Measurement> = measurements.iter().collect();
        Self {
            model: fitted(&all, adapter),
            columns: Features::names().map(str::to_owned).to_vec(),
            measurements,
        }
    }

    /// Reads what [`Calibration::json`] has written.
    ///
    /// # Errors
    /// When the file cannot be read, or is no calibration of this version of the features.
    pub fn read(file: &Path) -> crate::Result<Self> {
        let wrong = |what: &str, reason: &dyn std::fmt::Display| {
            Diagnostic::error(format!("`{}` {what}", file.display()))
                .with_reason(reason)
                .with_note("`lodc calibrate SHADERS -o FILE` writes such a file")
        };
        let text =
            std::fs::read_to_string(file).map_err(|error| wrong("cannot be read", &error))?;
        let read: Self =
            serde_json::from_str(&text).map_err(|error| wrong("is no calibration", &error))?;
        let whole = read.measurements.iter().all(|m| m.features.len() == COUNT);
        match read.columns == Features::names() && whole {
            true => Ok(read),
            false => Err(wrong(
                "is a calibration of another lodc",
                &"what it counts is not what this lodc counts",
            )),
        }
    }

    /// The whole of it as JSON, a line for each measurement.
    pub fn json(&self) -> String {
        let mut text = format!(
            "{{\n\"model\": {},\n\"columns\": {},\n\"measurements\": [\n",
            line(&self.model),
            line(&self.columns)
        );
        for (at, measurement) in self.measurements.iter().enumerate() {
            let comma = if at + 1 < self.measurements.len() {
                ","
            } else {
                ""
            };
            let _ = writeln!(text, "{}{comma}", line(measurement));
        }
        text + "]\n}\n"
    }

    /// What was measured.
    pub fn measurements(&self) -> &[Measurement] {
        &self.measurements
    }

    /// How good models are that were fitted without some variants of each shader, on those.
    pub fn on_variants(&self) -> Comparison {
        let (held_out, rest): (Vec<&Measurement>, Vec<&Measurement>) = (self.measurements.iter())
            .partition(|m| {
                let of_name = m.shader.bytes().fold(0, |seed, b| child(seed, b.into()));
                unit(child(of_name, m.variant.into())) < HELD_OUT && m.variant > 0
            });
        let mut tested = Tested::default();
        self.test(&rest, &held_out, &mut tested);
        tested.comparison()
    }

    /// The same without each shader in turn, on that; `None` where there are too few.
    pub fn on_shaders(&self) -> Option<Comparison> {
        let shaders: BTreeSet<&str> = self.measurements.iter().map(|m| &*m.shader).collect();
        if shaders.len() < SHADERS {
            return None;
        }
        let mut tested = Tested::default();
        for shader in shaders {
            let (held_out, rest): (Vec<&Measurement>, Vec<&Measurement>) =
                self.measurements.iter().partition(|m| m.shader == shader);
            self.test(&rest, &held_out, &mut tested);
        }
        Some(tested.comparison())
    }

    /// Fits to some measurements, and predicts others.
    fn test(&self, fit: &[&Measurement], predict: &[&Measurement], tested: &mut Tested) {
        let model = fitted(fit, "");
        let costs: Vec<(f64, f64)> = fit.iter().map(|m| (he(&m.features()), m.ms)).collect();
        let unit = coefficient(&costs);
        for m in predict {
            let features = m.features();
            tested.times.push((model.time(&features), m.ms));
            tested.he_times.push((unit * he(&features), m.ms));
            let original = self.measurements.iter().find(|o| o.is_original_of(m));
            let Some(original) = original.filter(|_| m.variant > 0) else {
                continue;
            };
            let original = original.features();
            tested
                .ratios
                .push((model.ratio(&features, &original), m.ratio));
            let of_he = he(&features) / he(&original).max(f64::MIN_POSITIVE);
            tested.he_ratios.push((of_he, m.ratio));
        }
    }
}

fn line(value: &impl Serialize) -> String {
    // Names and numbers alone: nothing that JSON has not.
    serde_json::to_string(value).unwrap_or_default()
}

fn fitted(measurements: &[&Measurement], adapter: &str) -> Model {
    let rows: Vec<(Features, f64)> = (measurements.iter())
        .map(|m| (m.features(), m.ms))
        .collect();
    Model::fit(&rows, adapter)
}

/// Predicted and measured numbers.
#[derive(Default)]
struct Tested {
    times: Vec<(f64, f64)>,
    ratios: Vec<(f64, f64)>,
    he_times: Vec<(f64, f64)>,
    he_ratios: Vec<(f64, f64)>,
}

impl Tested {
    fn comparison(&self) -> Comparison {
        Comparison {
            model: Quality {
                times: judged(&self.times),
                ratios: judged(&self.ratios),
            },
            he: Quality {
                times: judged(&self.he_times),
                ratios: judged(&self.he_ratios),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Measurements of made-up variants of shaders, at three distances each; what they take is a known sum.
    fn made_up(shaders: u64) -> Vec<Measurement> {
        let mut all = Vec::new();
        for shader in 0..shaders {
            for (near, distance) in [1.0, 4.0, 16.0].into_iter().enumerate() {
                let mut original_ms = 1.0;
                for variant in 0..12 {
                    let number = |i: u64| unit(child(child(shader, variant), i));
                    let mut row = [0.0; COUNT];
                    row[0] = 50.0 + 300.0 * number(0);
                    row[9] = (6.0 * number(1)).floor();
                    row[10] = 8.0 * row[9];
                    let names = Features::names();
                    let lanes = 60_000.0 / 4_f64.powi(near as i32);
                    for (name, to) in names.iter().zip(&mut row) {
                        match *name {
                            "fragments" => *to = 0.8 * lanes,
                            "lanes" => *to = lanes,
                            "stamp lanes" => *to = 1.5 * lanes,
                            "vertices" | "triangles" => *to = 1000.0,
                            _ => {}
                        }
                    }
                    let features = Features::of_row(&row);
                    let ms = lanes * 1e-7 * (row[0] + 30.0 * row[9]) + 0.05;
                    if variant == 0 {
                        original_ms = ms;
                    }
                    let ratio = ms / original_ms;
                    all.push(Measurement::new(
                        (&format!("shader {shader}"), variant as u32),
                        (distance, &features),
                        ms,
                        [0.99 * ratio, ratio, 1.01 * ratio],
                    ));
                }
            }
        }
        all
    }

    #[test]
    fn what_is_held_out_is_predicted() {
        let calibration = Calibration::new(made_up(4), "none");
        let all = [Some(calibration.on_variants()), calibration.on_shaders()];
        for comparison in all {
            let Comparison { model, he } = comparison.expect("there are enough");
            assert!(model.times.error < 0.03, "{model:?}");
            assert!(model.ratios.error < 0.03, "{model:?}");
            assert!(model.times.spearman > 0.99, "{model:?}");
            assert!(he.times.error > 0.2, "{he:?}");
            assert!(model.times.count > model.ratios.count.saturating_sub(1));
        }
        assert_eq!(Calibration::new(made_up(2), "none").on_shaders(), None);
        // Held out are variants, and never the original.
        let held_out = calibration.on_variants().model.times.count;
        assert!((12..60).contains(&held_out), "{held_out}");
    }

    #[test]
    fn a_calibration_is_read_as_it_was_written() {
        let calibration = Calibration::new(made_up(1), "an adapter");
        let folder = std::env::temp_dir().join(format!("lodc-calibration-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("it can be made");
        let file = folder.join("a.json");
        let json = calibration.json();
        assert_eq!(json.lines().count(), 3 + 2 + 36 + 1);
        std::fs::write(&file, &json).expect("it can be written");
        assert_eq!(Calibration::read(&file).expect("it is one"), calibration);
        let said = |text: &str| {
            std::fs::write(&file, text).expect("it can be written");
            Calibration::read(&file)
                .expect_err("it is none")
                .to_string()
        };
        assert!(said("{}").contains("is no calibration"));
        assert!(said(&json.replace("\"texel\"", "\"taps\"")).contains("another lodc"));
        let _ = std::fs::remove_dir_all(&folder);
        let gone = Calibration::read(&file).expect_err("it is gone");
        assert!(gone.to_string().contains("cannot be read"), "{gone}");
    }
}
