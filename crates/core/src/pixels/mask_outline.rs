//! `MaskOutline`: where the valid pixels of a mask lie, as polygons on a grid of cells.

use super::Mask;
use std::collections::BTreeMap;

/// Edge of a cell, pixels. A cell is inside where at least half of its pixels are valid.
pub const OUTLINE_CELL_PX: usize = 16;
/// More points than the outline of a tile has at most: each of 33 x 33 corners twice.
const MOST_POINTS: usize = 4096;

/// Rings around the valid cells of a mask: outer ones with the ground on the right of each step (x to the right, y down), holes with
/// the ground on the right too. Rings are not closed; their points are corners of cells, pixels from the upper-left corner of the mask.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct MaskOutline {
    rings: Vec<Vec<[u16; 2]>>,
}

impl MaskOutline {
    /// Returns the outline of a mask, with no ring where no cell is half valid.
    pub fn new(mask: &Mask) -> Self {
        let (columns, rows) = (mask.width_px().div_ceil(OUTLINE_CELL_PX), mask.height_px().div_ceil(OUTLINE_CELL_PX));
        let cells: Vec<bool> = (0..columns * rows).map(|i| is_half_valid(mask, i % columns, i / columns)).collect();
        let is_inside = |x: isize, y: isize| {
            let within = (0..columns as isize).contains(&x) && (0..rows as isize).contains(&y);
            within && cells[y as usize * columns + x as usize]
        };
        let corner = |x: usize, of: usize| (x * OUTLINE_CELL_PX).min(of) as u16;
        let rings = trace(boundary(columns, rows, &is_inside)).into_iter();
        let in_pixels = |ring: Vec<[usize; 2]>| {
            ring.iter().map(|[x, y]| [corner(*x, mask.width_px()), corner(*y, mask.height_px())]).collect()
        };
        Self { rings: rings.map(in_pixels).collect() }
    }

    /// The rings.
    pub fn rings(&self) -> &[Vec<[u16; 2]>] {
        &self.rings
    }

    /// The area inside, px^2.
    pub fn area_px2(&self) -> f64 {
        let cross = |[a, b]: [[u16; 2]; 2]| f64::from(a[0]) * f64::from(b[1]) - f64::from(b[0]) * f64::from(a[1]);
        let doubled =
            |ring: &Vec<[u16; 2]>| (0..ring.len()).map(|i| cross([ring[i], ring[(i + 1) % ring.len()]])).sum::<f64>();
        self.rings.iter().map(doubled).sum::<f64>() / 2.0
    }

    /// The inside as disjoint rectangles: left, upper, right and lower edge, pixels. Equal runs of successive rows are one.
    pub fn rectangles(&self) -> Vec<[u16; 4]> {
        let mut rows: Vec<u16> = self.rings.iter().flatten().map(|[_, y]| *y).collect();
        rows.sort_unstable();
        rows.dedup();
        let between =
            |rows: &[u16]| self.runs(rows[0], rows[1]).into_iter().map(|[x0, x1]| [x0, rows[0], x1, rows[1]]).collect();
        rows.windows(2).flat_map(|rows| -> Vec<[u16; 4]> { between(rows) }).collect()
    }

    /// Where the rows from `upper` to `lower`, between which no ring turns, are inside: pairs of left and right edges.
    fn runs(&self, upper: u16, lower: u16) -> Vec<[u16; 2]> {
        let sides =
            |ring: &Vec<[u16; 2]>| (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()])).collect::<Vec<_>>();
        let spans = |(a, b): &([u16; 2], [u16; 2])| a[0] == b[0] && a[1].min(b[1]) <= upper && a[1].max(b[1]) >= lower;
        let mut edges: Vec<u16> = self.rings.iter().flat_map(sides).filter(spans).map(|(a, _)| a[0]).collect();
        edges.sort_unstable();
        edges.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
    }

    /// Returns the outline as bytes: for each ring the number of its points, then x and y of each (u16, little-endian).
    pub fn to_bytes(&self) -> Vec<u8> {
        let number = |value: u16| value.to_le_bytes();
        let ring = |ring: &Vec<[u16; 2]>| {
            let points = ring.iter().flatten().flat_map(|v| number(*v));
            number(ring.len() as u16).into_iter().chain(points).collect::<Vec<u8>>()
        };
        self.rings.iter().flat_map(ring).collect()
    }

    /// Reads [`MaskOutline::to_bytes`] of a mask of at most `edge_px` on each side; `None` where the bytes are no outline: too many
    /// points, one beyond the mask, or a step that is not along an axis.
    pub fn from_bytes(bytes: &[u8], edge_px: u16) -> Option<Self> {
        let mut numbers = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
        if !bytes.len().is_multiple_of(2) || bytes.len() > 6 * MOST_POINTS {
            return None;
        }
        let is_step = |[a, b]: [[u16; 2]; 2]| (a[0] == b[0]) != (a[1] == b[1]);
        let is_ring = |ring: &Vec<[u16; 2]>| {
            let steps = (0..ring.len()).map(|i| [ring[i], ring[(i + 1) % ring.len()]]);
            ring.len() >= 4 && ring.iter().flatten().all(|v| *v <= edge_px) && steps.into_iter().all(is_step)
        };
        let mut rings = Vec::new();
        while let Some(count) = numbers.next() {
            let ring: Option<Vec<[u16; 2]>> = (0..count).map(|_| Some([numbers.next()?, numbers.next()?])).collect();
            rings.push(ring.filter(is_ring)?);
        }
        Some(Self { rings })
    }
}

fn is_half_valid(mask: &Mask, column: usize, row: usize) -> bool {
    let range = |cell: usize, of: usize| cell * OUTLINE_CELL_PX..((cell + 1) * OUTLINE_CELL_PX).min(of);
    let (xs, ys) = (range(column, mask.width_px()), range(row, mask.height_px()));
    let valid: usize = ys.clone().map(|y| xs.clone().filter(|x| mask.at(*x, y)).count()).sum();
    2 * valid >= xs.len() * ys.len()
}

/// The steps along the sides between a cell inside and one that is not, by their starts: at most two from one corner.
fn boundary(
    columns: usize,
    rows: usize,
    is_inside: &dyn Fn(isize, isize) -> bool,
) -> BTreeMap<[usize; 2], Vec<[usize; 2]>> {
    let mut steps: BTreeMap<[usize; 2], Vec<[usize; 2]>> = BTreeMap::new();
    for (x, y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
        let (column, row) = (x as isize, y as isize);
        if !is_inside(column, row) {
            continue;
        }
        let sides = [
            ((column, row - 1), [x, y], [x + 1, y]),
            ((column + 1, row), [x + 1, y], [x + 1, y + 1]),
            ((column, row + 1), [x + 1, y + 1], [x, y + 1]),
            ((column - 1, row), [x, y + 1], [x, y]),
        ];
        for (_, from, to) in sides.into_iter().filter(|((c, r), ..)| !is_inside(*c, *r)) {
            steps.entry(from).or_default().push(to);
        }
    }
    steps
}

/// Links steps to rings, from the uppermost leftmost corner on, and leaves out corners that turn nowhere.
fn trace(mut steps: BTreeMap<[usize; 2], Vec<[usize; 2]>>) -> Vec<Vec<[usize; 2]>> {
    let mut rings = Vec::new();
    while let Some(start) = steps.keys().next().copied() {
        let (mut ring, mut at, mut from) = (Vec::new(), start, None);
        loop {
            let next = take_step(&mut steps, at, from);
            if from.is_none_or(|before| !is_straight(before, at, next)) {
                ring.push(at);
            }
            (from, at) = (Some(at), next);
            if at == start {
                break;
            }
        }
        // The start turns: it is the uppermost leftmost corner of its ring.
        rings.push(ring);
    }
    rings
}

/// Removes and returns a step from a corner: where two cells touch at it only, the one that turns right, so that each keeps its ring.
fn take_step(
    steps: &mut BTreeMap<[usize; 2], Vec<[usize; 2]>>,
    at: [usize; 2],
    from: Option<[usize; 2]>,
) -> [usize; 2] {
    let ends = steps.get_mut(&at).expect("boundaries are closed");
    let turns_right = |end: &[usize; 2]| from.is_some_and(|from| cross(from, at, *end) > 0);
    let index = ends.iter().position(turns_right).unwrap_or(0);
    let end = ends.remove(index);
    if ends.is_empty() {
        steps.remove(&at);
    }
    end
}

fn is_straight(a: [usize; 2], b: [usize; 2], c: [usize; 2]) -> bool {
    cross(a, b, c) == 0
}

/// Positive where the way a, b, c turns right, with y down.
fn cross(a: [usize; 2], b: [usize; 2], c: [usize; 2]) -> isize {
    let step =
        |from: [usize; 2], to: [usize; 2]| [to[0] as isize - from[0] as isize, to[1] as isize - from[1] as isize];
    let (ab, bc) = (step(a, b), step(b, c));
    ab[0] * bc[1] - ab[1] * bc[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn mask_of(cells: &[bool], columns: usize) -> Mask {
        let (width, rows) = (columns * OUTLINE_CELL_PX, cells.len() / columns);
        let at = |i: usize| cells[i / width / OUTLINE_CELL_PX * columns + i % width / OUTLINE_CELL_PX];
        let values = (0..width * rows * OUTLINE_CELL_PX).map(|i| u8::from(at(i))).collect();
        Mask::from_values(width, rows * OUTLINE_CELL_PX, values).unwrap()
    }

    #[test]
    fn a_rectangle_has_four_corners_and_a_hole_a_second_ring() {
        let outline = MaskOutline::new(&Mask::filled(512, 512, true));
        assert_eq!(outline.rings(), [vec![[0, 0], [512, 0], [512, 512], [0, 512]]]);
        let holed = MaskOutline::new(&mask_of(&[true, true, true, true, false, true, true, true, true], 3));
        assert_eq!(holed.rings().len(), 2);
        assert_eq!(holed.area_px2(), 8.0 * 256.0);
        assert_eq!(MaskOutline::new(&Mask::filled(512, 512, false)).rings().len(), 0);
    }

    #[test]
    fn cells_that_touch_at_a_corner_have_rings_of_their_own() {
        let outline = MaskOutline::new(&mask_of(&[true, false, false, true], 2));
        assert_eq!(
            outline.rings(),
            [vec![[0, 0], [16, 0], [16, 16], [0, 16]], vec![[16, 16], [32, 16], [32, 32], [16, 32]]]
        );
    }

    #[test]
    fn bytes_that_are_no_outline_are_refused() {
        let bytes = MaskOutline::new(&Mask::filled(64, 64, true)).to_bytes();
        assert!((1..bytes.len()).all(|cut| MaskOutline::from_bytes(&bytes[..cut], 64).is_none()));
        assert!(MaskOutline::from_bytes(&vec![0; 6 * MOST_POINTS + 2], 64).is_none());
        assert!(MaskOutline::from_bytes(&bytes, 63).is_none(), "beyond the mask");
        assert!(MaskOutline::from_bytes(&[3, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0], 64).is_none(), "a triangle");
    }

    proptest! {
        #[test]
        fn encloses_the_area_of_its_cells(cells in prop::collection::vec(any::<bool>(), 48)) {
            let outline = MaskOutline::new(&mask_of(&cells, 8));
            let valid = cells.iter().filter(|cell| **cell).count();
            prop_assert_eq!(outline.area_px2(), (valid * OUTLINE_CELL_PX * OUTLINE_CELL_PX) as f64);
            let mut covered = Mask::filled(128, 96, false);
            for [left, upper, right, lower] in outline.rectangles() {
                for (x, y) in (upper..lower).flat_map(|y| (left..right).map(move |x| (usize::from(x), usize::from(y)))) {
                    prop_assert!(!covered.at(x, y), "twice");
                    covered.set(x, y, true);
                }
            }
            prop_assert_eq!(covered, mask_of(&cells, 8));
            prop_assert_eq!(MaskOutline::from_bytes(&outline.to_bytes(), 128), Some(outline));
        }
    }
}
