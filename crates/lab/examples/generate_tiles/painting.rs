//! Paints a scene: the ground, then trees and buildings.

use crate::canvas::SceneCanvas;
use crate::ground::ground;
use crate::scene::{FarmlandScene, SIZE_M};

/// The canvas of a scene in an epoch, without sunlight.
pub fn paint(scene: &FarmlandScene, epoch: usize) -> SceneCanvas {
    let mut canvas = SceneCanvas::paint(SIZE_M, |x, y| ground(scene, epoch, x, y));
    for tree in scene.trees(epoch) {
        tree.draw(&mut canvas, scene.seed, epoch);
    }
    for (building, _) in scene.buildings.iter().filter(|(_, stands)| stands[epoch]) {
        building.draw(&mut canvas, scene.seed + 60);
    }
    canvas
}
