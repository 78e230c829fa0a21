//! What the window shows: from where, and which level. Keys and mouse change it.

use super::drawing::Material;
use glam::DVec3;

/// The tints of levels, in turn: white is the shader's own colour.
const TINTS: [[f64; 3]; 6] = [
    [1.0, 1.0, 1.0],
    [0.4, 1.0, 0.4],
    [1.0, 0.9, 0.3],
    [1.0, 0.5, 0.3],
    [1.0, 0.35, 0.9],
    [0.4, 0.6, 1.0],
];

/// How many radians a pixel of the mouse turns.
const TURN: f64 = 0.01;

/// How much farther or nearer a step goes.
const STEP: f64 = 1.1;

pub(super) struct View {
    /// Around the object from the z axis, and up from its equator, radians.
    turned: [f64; 2],
    /// From the eye to the object's centre.
    pub(super) distance: f64,
    /// From where to where that may go.
    range: [f64; 2],
    /// The level that was chosen by hand.
    by_hand: Option<usize>,
    /// The level of the frame before.
    before: Option<usize>,
    tints: bool,
}

impl View {
    pub(super) fn new(material: &Material) -> Self {
        let scene = &material.scene;
        Self {
            turned: [0.4, 0.3],
            distance: scene.nearest,
            range: [1.05 * scene.sphere.radius, 4.0 * scene.farthest],
            by_hand: None,
            before: None,
            tints: false,
        }
    }

    /// From the object to the eye.
    pub(super) fn direction(&self) -> DVec3 {
        let [around, up] = self.turned;
        let level = up.cos();
        DVec3::new(level * around.sin(), up.sin(), level * around.cos())
    }

    /// The level to draw in pictures so many pixels high: the one by hand, or that of the distance.
    pub(super) fn level(&mut self, material: &Material, height: u32) -> usize {
        let auto_lod = material.auto_lod(self.distance, height);
        let level = self.by_hand;
        let level = level.unwrap_or_else(|| material.level(auto_lod, self.before));
        self.before = Some(level);
        level
    }

    /// What a level's colours are multiplied by.
    pub(super) fn tint(&self, level: usize) -> [f64; 3] {
        match self.tints {
            true => TINTS[level % TINTS.len()],
            false => TINTS[0],
        }
    }

    /// Does what a key says, of a material with so many levels.
    pub(super) fn press(&mut self, key: &str, levels: usize) {
        match key {
            "a" => self.by_hand = None,
            "t" => self.tints = !self.tints,
            "+" | "=" => self.approach(1.0),
            "-" => self.approach(-1.0),
            _ => {
                if let Some(level) = key.parse().ok().filter(|level| *level < levels) {
                    self.by_hand = Some(level);
                }
            }
        }
    }

    /// Turns by so many pixels of the mouse. The first place of a drag has none before it.
    pub(super) fn turn(&mut self, x: f64, y: f64) {
        if x.is_finite() && y.is_finite() {
            let [around, up] = self.turned;
            // Not over the poles.
            self.turned = [around - TURN * x, (up + TURN * y).clamp(-1.5, 1.5)];
        }
    }

    /// Goes so many steps nearer.
    pub(super) fn approach(&mut self, steps: f64) {
        let [nearest, farthest] = self.range;
        self.distance = (self.distance / STEP.powf(steps)).clamp(nearest, farthest);
    }
}
