//! Reduces the vertices of an outline without losing ground.

use super::bearings::OutlineVertex;
use super::polygon::{Vertex, weighted_area};

/// Encloses an outline (counterclockwise, from [`super::bearings::Bearings::outline`]) in one with fewer vertices. Stops at
/// `target` vertices, or when the area has grown by the share `budget`.
///
/// A vertex at which the outline bends inwards is removed. A side between two vertices at which it bends outwards is
/// replaced by the point where its neighbours meet. Both add a triangle between the bearings of its ends, where no other
/// part of the outline lies, so the outline stays simple.
pub(super) fn enclose(mut outline: Vec<OutlineVertex>, target: usize, budget: f64) -> Vec<Vertex> {
    let area = weighted_area(&vertices(&outline), |_| 1.0);
    let mut left = budget * area;
    while outline.len() > target {
        let steps: Vec<Option<Reduction>> = (0..outline.len()).map(|i| step(&outline, i)).collect();
        let mut costs: Vec<f64> = steps.iter().flatten().map(|s| s.area).collect();
        if costs.is_empty() {
            break;
        }
        costs.sort_by(f64::total_cmp);
        // Take the cheaper half of the reductions: a cheap one may follow later in place of an expensive one now.
        let limit = costs[costs.len() / 2].min(left);
        let before = outline.len();
        outline = apply(&outline, &steps, limit, target, &mut left);
        if outline.len() == before {
            break;
        }
    }
    vertices(&outline)
}

fn vertices(outline: &[OutlineVertex]) -> Vec<Vertex> {
    outline.iter().map(|v| v.at).collect()
}

/// The reduction at a vertex: remove it, or replace it and the next by `merged`. `area` is the added area.
#[derive(Debug, Clone, Copy)]
struct Reduction {
    area: f64,
    merged: Option<OutlineVertex>,
}

fn step(outline: &[OutlineVertex], i: usize) -> Option<Reduction> {
    let n = outline.len();
    let [a, b, c, d] = [i + n - 1, i, i + 1, i + 2].map(|k| outline[k % n]);
    let inward = -cross(a.at, b.at, c.at);
    if inward >= 0.0 {
        return Some(Reduction { area: inward / 2.0, merged: None });
    }
    // The end of a run must not reach past its bearing.
    if (b.ends && c.ends) || cross(b.at, c.at, d.at) <= 0.0 {
        return None;
    }
    let (ab, dc) = ([b.at[0] - a.at[0], b.at[1] - a.at[1]], [c.at[0] - d.at[0], c.at[1] - d.at[1]]);
    let turn = ab[0] * dc[1] - ab[1] * dc[0];
    // Both sides, prolonged, must meet ahead of b and c.
    if turn >= 0.0 {
        return None;
    }
    let bc = [c.at[0] - b.at[0], c.at[1] - b.at[1]];
    let t = (bc[0] * dc[1] - bc[1] * dc[0]) / turn;
    let at = [b.at[0] + t * ab[0], b.at[1] + t * ab[1]];
    let area = cross(b.at, at, c.at).abs() / 2.0;
    area.is_finite().then_some(Reduction { area, merged: Some(OutlineVertex { at, ends: b.ends || c.ends }) })
}

/// Applies the reductions that add at most `limit`, in one pass, never two side by side.
fn apply(
    outline: &[OutlineVertex],
    steps: &[Option<Reduction>],
    limit: f64,
    target: usize,
    left: &mut f64,
) -> Vec<OutlineVertex> {
    let n = outline.len();
    let mut kept = Vec::with_capacity(n);
    let mut count = n;
    let mut i = 0;
    while i < n {
        // Keep the first and the last few in this pass: their neighbours lie across the end of the list.
        let step = steps[i].filter(|s| s.area <= limit.min(*left) && i > 0 && i + 3 < n && count > target);
        let Some(step) = step else {
            kept.push(outline[i]);
            i += 1;
            continue;
        };
        *left -= step.area;
        count -= 1;
        // Skip the vertices from which the cost of this reduction was computed.
        match step.merged {
            Some(merged) => {
                kept.extend([merged, outline[i + 2]]);
                i += 3;
            }
            None => {
                kept.push(outline[i + 1]);
                i += 2;
            }
        }
    }
    kept
}

/// Twice the area of a triangle, positive if counterclockwise.
fn cross(a: Vertex, b: Vertex, c: Vertex) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::super::polygon::{Rectangle, touches};
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    fn star(radii: &[f64]) -> Vec<OutlineVertex> {
        let bearing = |i: usize| TAU * i as f64 / radii.len() as f64;
        let at = |i: usize| [radii[i] * bearing(i).cos(), radii[i] * bearing(i).sin()];
        (0..radii.len()).map(|i| OutlineVertex { at: at(i), ends: false }).collect()
    }

    #[test]
    fn a_circle_becomes_a_polygon_around_it() {
        let few = enclose(star(&[5.0; 720]), 24, 0.05);
        assert_eq!(few.len(), 24);
        let area = weighted_area(&few, |_| 1.0);
        // The best 24 sides around it have 0.6 % more; merging neighbours is not that even.
        assert!(
            area >= weighted_area(&vertices(&star(&[5.0; 720])), |_| 1.0) && area < 1.03 * 25.0 * std::f64::consts::PI
        );
    }

    #[test]
    fn no_more_than_the_budget_is_added() {
        let ragged: Vec<f64> = (0..400).map(|i| if i % 2 == 0 { 5.0 } else { 3.0 }).collect();
        let outline = star(&ragged);
        let area = weighted_area(&vertices(&outline), |_| 1.0);
        let few = enclose(outline, 8, 0.01);
        assert!(few.len() > 300 && weighted_area(&few, |_| 1.0) <= 1.0101 * area);
    }

    proptest! {
        #[test]
        fn the_enclosing_outline_contains_every_point(radii in prop::collection::vec(1.0..9.0f64, 12..200), budget in 0.0..0.5f64, target in 4usize..40) {
            let outline = star(&radii);
            let few = enclose(outline.clone(), target, budget);
            prop_assert!(few.len() <= outline.len());
            for (a, b) in outline.iter().zip(outline.iter().skip(1)) {
                // From the middle out to the vertices and to the middles of sides.
                let side = [(a.at[0] + b.at[0]) / 2.0, (a.at[1] + b.at[1]) / 2.0];
                for point in [a.at, side] {
                    let point = point.map(|x| x * (1.0 - 1e-9));
                    prop_assert!(touches(&few, Rectangle { min: point, max: point }), "{point:?}");
                }
            }
        }
    }
}
