//! How much the pictures react to each triangle: to where it is, and to what its vertices hand over. What no view sees weighs
//! next to nothing.
//!
//! Each is a difference of pictures: the original's, and one of all vertices changed a little, by a pixel where that has
//! a meaning. A pixel's squared difference is its triangle's. In sums over the triangles around a point this is what the
//! derivative of the error is: a dense mesh has less than a pixel for each triangle, so that single ones would say little.

use super::view::Drawn;
use super::{Pictures, Triangles};
use crate::eval::raster::{Attribute, Frame, Retained};
use crate::scene::mesh::Mesh;
use glam::{DVec3, Vec3};
use lodc_mesh::{CHANNELS, Surface, Weights};
use rayon::prelude::*;
use std::sync::Arc;

/// How far a picture is moved to see how it reacts, in pixels. Where an outline moves by a part of a pixel, that part of the
/// samples changes, but the error against a filtered reference grows by its square: samples on the edge are as wrong on
/// either side of it. At a whole pixel both are the same.
const STEP: f64 = 1.0;

/// How much a normal or a colour is changed for that.
const SMALL: f64 = 0.02;

/// What a triangle that no view sees weighs, as a share of the mean by area of those that are seen.
const UNSEEN: f64 = 1e-4;

/// How much of what a triangle weighs is that mean, where it is seen: of its position, since every part of a surface is an
/// outline for somebody, and of what its vertices hand over.
const COMMON: [f64; 2] = [0.5, 0.25];

/// A triangle with less of its share of pixels than this is seen from few sides.
const SEEN: f64 = 0.1;

/// How many sums there are for a triangle: what the position weighs, what each channel does, and how many pixels show it.
const SUMS: usize = CHANNELS + 2;

/// The last of them.
const PIXELS: usize = CHANNELS + 1;

/// What is changed, and by how much.
#[derive(Clone, Copy)]
enum Change {
    /// All points outwards.
    Position(f64),
    /// A number of all vertices.
    Channel(usize, f64),
}

/// What changing each triangle costs, by its number in the mesh: sums of squared errors over the pixels of the views.
/// `pixels_per_unit` is the scale of the nearest point of the object.
pub(super) fn weights(
    pictures: &Pictures<'_>,
    (surface, triangles): (&Surface, &Triangles),
    pixels_per_unit: f64,
) -> Vec<Weights> {
    let Pictures { subject, views, .. } = pictures;
    let Some(first) = views.first() else {
        return Vec::new();
    };
    let mesh = &first.frame().mesh;
    let changes = changes(first.frame(), (surface, triangles), pixels_per_unit);
    let of_views = views.par_iter().map(|view| {
        let mut sums = vec![[0.0; SUMS]; triangles.0.len()];
        let squares = view.squares(true);
        let of_view = (view.retained(), view.frame());
        let plain = view.draw(subject, of_view, triangles, &squares);
        let draws = mesh.draws();
        let of = |(draw, number): (usize, u32)| draws[draw].triangles.start + number as usize;
        for (_, _, triangle) in plain.coverage.triangles() {
            sums[of(triangle)][PIXELS] += 1.0;
        }
        for change in &changes {
            let frame = Frame {
                mesh: Arc::new(changed(mesh, *change)),
                ..view.frame().clone()
            };
            let retained = Retained::new(subject.vertex, subject.fragment, &frame);
            let other = view.draw(subject, (&retained, &frame), triangles, &squares);
            add(&mut sums, *change, [&plain, &other], of);
        }
        sums
    });
    let of_views: Vec<Vec<[f64; SUMS]>> = of_views.collect();
    let sums = of_views.into_iter().reduce(|mut sums, view| {
        for (to, from) in sums.as_flattened_mut().iter_mut().zip(view.as_flattened()) {
            *to += from;
        }
        sums
    });
    smooth((surface, triangles), &sums.unwrap_or_default())
}

/// What the shader is fed with, and the picture may react to.
fn changes(
    frame: &Frame,
    (surface, triangles): (&Surface, &Triangles),
    pixels_per_unit: f64,
) -> Vec<Change> {
    let has = |wanted: &[Attribute]| {
        let mut fed = frame.attributes.values();
        fed.any(|attribute| wanted.contains(attribute))
    };
    let mut changes = Vec::new();
    if pixels_per_unit > 0.0 {
        changes.push(Change::Position(STEP / pixels_per_unit));
    }
    if has(&[Attribute::Normal, Attribute::Bitangent]) {
        changes.extend([0, 1, 2].map(|channel| Change::Channel(channel, SMALL)));
    }
    if has(&[Attribute::Uv, Attribute::SecondUv]) {
        // As far as a pixel is, on average over the surface.
        let (mut area, mut area_of_texture) = (0.0, 0.0);
        for corners in triangles.0.iter().flatten() {
            let [a, b, c] = corners.map(|v| surface.position(surface.point_of(v)));
            area += (b - a).cross(c - a).length();
            let [a, b, c] = corners.map(|v| lodc_mesh::channels(&frame.mesh, v));
            let [p, q] = [b, c].map(|to| [to[3] - a[3], to[4] - a[4]]);
            area_of_texture += (p[0] * q[1] - p[1] * q[0]).abs();
        }
        let step = STEP / pixels_per_unit * (area_of_texture / area).sqrt();
        if step.is_finite() && step > 0.0 {
            changes.extend([3, 4].map(|channel| Change::Channel(channel, step)));
        }
    }
    if has(&[Attribute::Colour]) {
        changes.extend([5, 6, 7].map(|channel| Change::Channel(channel, SMALL)));
    }
    changes
}

/// A mesh of which all vertices are changed.
fn changed(mesh: &Mesh, change: Change) -> Mesh {
    let mut mesh = mesh.clone();
    match change {
        Change::Position(step) => {
            for (position, normal) in mesh.positions.iter_mut().zip(&mesh.normals) {
                let outwards = Vec3::from(*normal).normalize_or_zero() * step as f32;
                *position = (Vec3::from(*position) + outwards).to_array();
            }
        }
        Change::Channel(channel @ 0..3, step) => {
            for normal in &mut mesh.normals {
                normal[channel] += step as f32;
                *normal = Vec3::from(*normal).normalize_or_zero().to_array();
            }
        }
        Change::Channel(channel @ 3..5, step) => {
            let both = mesh.uvs.iter_mut().chain(&mut mesh.second_uvs);
            both.for_each(|uv| uv[channel - 3] += step as f32);
        }
        Change::Channel(channel, step) => {
            let colours = mesh.colours.iter_mut();
            colours.for_each(|colour| colour[channel - 5] += step as f32);
        }
    }
    mesh
}

/// Adds what two pictures differ by to the triangles that are seen in them; `of` numbers those.
fn add(
    sums: &mut [[f64; SUMS]],
    change: Change,
    [plain, other]: [&Drawn; 2],
    of: impl Fn((usize, u32)) -> usize,
) {
    let mut seen = vec![None; plain.shown.len()];
    for drawn in [other, plain] {
        for (pixel, _, triangle) in drawn.coverage.triangles() {
            seen[pixel as usize] = Some(of(triangle));
        }
    }
    for ((triangle, plain), other) in seen.iter().zip(&plain.shown).zip(&other.shown) {
        let Some(sums) = triangle.and_then(|triangle| sums.get_mut(triangle)) else {
            continue;
        };
        let each = plain.as_flattened().iter().zip(other.as_flattened());
        let square = each
            .map(|(a, b)| f64::from(a - b).powi(2))
            .filter(|square| square.is_finite())
            .sum::<f64>()
            / 6.0;
        match change {
            Change::Position(step) => sums[0] += square / (step * step),
            Change::Channel(channel, step) => sums[channel + 1] += square / (step * step),
        }
    }
}

/// Weights from sums, which are spread over the triangles around each point, by area.
fn smooth((surface, triangles): (&Surface, &Triangles), sums: &[[f64; SUMS]]) -> Vec<Weights> {
    let area = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|vertex| surface.position(surface.point_of(vertex)));
        DVec3::cross(b - a, c - a).length()
    };
    let points = |corners: [u32; 3]| corners.map(|vertex| surface.point_of(vertex) as usize);
    let mut areas = vec![0.0; surface.points()];
    let mut around = vec![[0.0; SUMS]; surface.points()];
    let (mut seen, mut total) = (0.0, [0.0; SUMS]);
    for (corners, sums) in triangles.0.iter().zip(sums) {
        let Some(corners) = *corners else { continue };
        let area = area(corners);
        for point in points(corners) {
            areas[point] += area;
            for (to, from) in around[point].iter_mut().zip(sums) {
                *to += from;
            }
        }
        for (to, from) in total.iter_mut().zip(sums) {
            *to += from;
        }
    }
    for (areas, around) in areas.iter().zip(&around) {
        // Each triangle is around three points.
        seen += if around[PIXELS] > 0.0 {
            areas / 3.0
        } else {
            0.0
        };
    }
    let mean = total.map(|total| total / f64::max(seen, f64::MIN_POSITIVE));
    let of_triangle = |corners: &Option<[u32; 3]>| {
        let Some(corners) = *corners else {
            return Weights::default();
        };
        let density = |i: usize| {
            let density = points(corners).map(|point| match areas[point] > 0.0 {
                true => around[point][i] / areas[point],
                false => 0.0,
            });
            density.iter().sum::<f64>() / 3.0
        };
        let is_seen = (density(PIXELS) / (SEEN * mean[PIXELS])).min(1.0);
        let is_seen = if is_seen.is_nan() { 0.0 } else { is_seen };
        let part = |i: usize| {
            let common = COMMON[usize::from(i > 0)] * is_seen;
            let own = (1.0 - common) * density(i) + common * mean[i];
            area(corners) * (own + UNSEEN * mean[i])
        };
        Weights {
            position: part(0),
            channels: std::array::from_fn(|channel| part(channel + 1)),
        }
    };
    triangles.0.iter().map(of_triangle).collect()
}
