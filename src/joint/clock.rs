//! The times of pairs, as a clock has them: what a model puts within reach is measured.

use super::table::Table;
use crate::search::Level;
use crate::time::clock::{Clock, worst_ratio};
use lodc_joint::Pair;
use lodc_mesh::Mesh;
use lodc_passes::{Recipe, Shader};
use std::sync::Arc;

/// How much slower than the fastest a pair may be by the model to be measured, as a share of that one's time: what is near by itself,
/// and by how much the model is wrong of shaders that it has not seen.
pub(super) const REACH: f64 = 0.25;

/// Measures all pairs of a table at all its distances, the first excepted, which is the original; the table keeps what it has where
/// nothing could be timed. What alone could not be timed is used nowhere.
pub(super) fn measure(
    table: &mut Table<'_>,
    clock: &mut dyn Clock,
    meshes: &[Arc<Mesh>],
    shaders: &[(Recipe, Shader)],
) -> u64 {
    let drawn = |pair: &Pair| (&meshes[pair.mesh], &shaders[pair.shader].1);
    let pairs: Vec<(&Arc<Mesh>, &Shader)> = table.pairs.iter().skip(1).map(drawn).collect();
    let mut count = 0;
    let mut times = Vec::new();
    for distance in &table.distances {
        let timings = clock.time_on(&pairs, *distance);
        let ratios = timings.iter().map(|of| worst_ratio(of));
        count += ratios.clone().flatten().count() as u64;
        let ratios = ratios.map(|ratio| ratio.unwrap_or(f64::INFINITY));
        times.push(std::iter::once(1.0).chain(ratios).collect());
    }
    if count > 0 {
        table.timed(&times);
    }
    count
}

/// Times a level where it begins.
pub(super) fn level(level: &mut Level, clock: &mut dyn Clock, mesh: &Arc<Mesh>) {
    let timings = clock.time_on(&[(mesh, &level.shader)], level.distance);
    level.timed = timings.into_iter().next().unwrap_or_default();
    if let Some(ratio) = worst_ratio(&level.timed) {
        level.time = ratio;
    }
}
