//! Cell templates: a view as cells under any heading, scale and pitch, from one description.

use super::cell_dots::{MOST_VALUE, TemplateCell};
use crate::feature::{BORDER_PX, LEAST_VALID, Structure};
use crate::pixels::Mask;
use crate::simd::dispatch;

/// The structure of a view in small squares, from which templates of any rotation are made without reading pixels again.
#[derive(Debug, Clone)]
pub struct CellView {
    squares: Vec<Square>,
    /// The middle of the described part of the view, from the nadir, pixels right and down.
    middle_px: [f64; 2],
}

/// One square of the view.
#[derive(Debug, Clone, Copy)]
struct Square {
    /// Middle of the square, px from the view's middle.
    at_px: [f32; 2],
    /// What it holds.
    sums: Sums,
}

/// Sums of the four components over pixels, and the number of these at [`COUNT`]; zeros fill a register.
type Sums = [f32; 8];

/// Where [`Sums`] holds the number of described pixels.
const COUNT: usize = 4;

/// Edge of the squares: a quarter of a cell.
const SQUARE_PX: usize = 4;

/// The cells of a view under one heading, scale and pitch, their mean removed.
#[derive(Debug, Clone, PartialEq)]
pub struct CellTemplate {
    /// The known cells: position from the middle, and values up to [`MOST_VALUE`].
    cells: Vec<([i32; 2], [i8; 4])>,
    /// Sum of squares of all values.
    norm: f32,
    /// Sum of all values.
    total: i32,
}

impl CellView {
    /// Makes the cell view of a north-up view (heading 0), its mask and its nadir, px from the corner. `None` where the view
    /// shows nothing.
    pub fn new(structure: &Structure, mask: &Mask, nadir_px: [f64; 2]) -> Option<Self> {
        let valid = mask.eroded(BORDER_PX);
        let mut squares = Vec::new();
        for (row, column) in (0..structure.height_px / SQUARE_PX)
            .flat_map(|row| (0..structure.width_px / SQUARE_PX).map(move |column| (row, column)))
        {
            squares.extend(Square::new(structure, &valid, column * SQUARE_PX, row * SQUARE_PX, nadir_px));
        }
        let count = squares.iter().map(|p| f64::from(p.sums[COUNT])).sum::<f64>();
        let mean = |axis: usize| squares.iter().map(|p| f64::from(p.at_px[axis] * p.sums[COUNT])).sum::<f64>() / count;
        if count <= 0.0 || structure.total_energy() <= 0.0 {
            return None;
        }
        let middle_px = [mean(0), mean(1)];
        for square in &mut squares {
            (0..2).for_each(|axis| square.at_px[axis] -= middle_px[axis] as f32);
        }
        Some(Self { squares, middle_px })
    }

    /// Offset from the nadir to the view's middle under a heading and a scale, pixels right and down.
    pub fn middle_px(&self, heading_rad: f64, ratio: f64) -> [f64; 2] {
        let (sin, cos) = heading_rad.sin_cos();
        let [x, y] = self.middle_px;
        [ratio * (x * cos - y * sin), ratio * (x * sin + y * cos)]
    }

    /// The template of cells of `pitch_px` within `half` cells of the middle; `None` where nothing is left to compare. Each
    /// square is divided among the four nearest cells, which smooths the template as merging smooths the map.
    pub fn template(&self, heading_rad: f64, ratio: f64, pitch_px: f64, half: usize) -> Option<CellTemplate> {
        let side = 2 * half + 1;
        let (sin, cos) = heading_rad.sin_cos();
        let scale = ratio / pitch_px;
        let turn = [(cos * scale) as f32, (sin * scale) as f32];
        let mut cells = vec![Sums::default(); side * side];
        divide(&self.squares, turn, half, &mut cells);
        let least = LEAST_VALID * (1.0 / scale.powi(2)) as f32;
        let turn = Turn::new(heading_rad);
        let known: Vec<_> = (0..side * side)
            .filter(|&i| cells[i][COUNT] >= least)
            .map(|i| {
                let [a, b, c, d, count, ..] = cells[i];
                let at = [i % side, i / side].map(|v| v as i32 - half as i32);
                (at, turn.applied([a / count, b / count, c / count, d / count]))
            })
            .collect();
        CellTemplate::from_cells(&known)
    }
}

impl Square {
    fn new(structure: &Structure, valid: &Mask, left: usize, top: usize, nadir_px: [f64; 2]) -> Option<Self> {
        let mut sums = [0i32; 8];
        for y in top..top + SQUARE_PX {
            for x in left..left + SQUARE_PX {
                let i = y * structure.width_px + x;
                sums[COUNT] += i32::from(valid.at(x, y));
                (0..4).for_each(|k| sums[k] += i32::from(structure.channels[i][k]));
            }
        }
        let half = SQUARE_PX as f64 / 2.0;
        let at_px = [(left as f64 + half - nadir_px[0]) as f32, (top as f64 + half - nadir_px[1]) as f32];
        (sums[COUNT] > 0).then(|| Self { at_px, sums: sums.map(|s| s as f32) })
    }
}

dispatch! {
    /// Divides each square among the four nearest cells. `turn` is the cosine and sine of the heading, in cells per pixel; the view's middle
    /// is the middle of the cell in column and row `half`.
    fn divide(squares: &[Square], turn: [f32; 2], half: usize, cells: &mut [Sums]) {
        let side = 2 * half as i32 + 1;
        for p in squares {
            let x = p.at_px[0] * turn[0] - p.at_px[1] * turn[1] + half as f32;
            let y = p.at_px[0] * turn[1] + p.at_px[1] * turn[0] + half as f32;
            let (x0, y0) = (x.floor(), y.floor());
            let (fx, fy) = (x - x0, y - y0);
            for (dx, dy, w) in
                [(0, 0, (1.0 - fx) * (1.0 - fy)), (1, 0, fx * (1.0 - fy)), (0, 1, (1.0 - fx) * fy), (1, 1, fx * fy)]
            {
                let (column, row) = (x0 as i32 + dx, y0 as i32 + dy);
                if (0..side).contains(&column) && (0..side).contains(&row) {
                    let cell = &mut cells[(row * side + column) as usize];
                    cell.iter_mut().zip(&p.sums).for_each(|(cell, sum)| *cell += w * sum);
                }
            }
        }
    }
}

/// A clockwise rotation of both harmonics: cosine and sine of twice and four times the heading.
struct Turn([[f32; 2]; 2]);

impl Turn {
    fn new(heading_rad: f64) -> Self {
        Self([2.0, 4.0].map(|fold: f64| [(fold * heading_rad).cos() as f32, (fold * heading_rad).sin() as f32]))
    }

    fn applied(&self, [a, b, c, d]: [f32; 4]) -> [f32; 4] {
        let by = |re: f32, im: f32, [cos, sin]: [f32; 2]| [re * cos - im * sin, re * sin + im * cos];
        let ([a, b], [c, d]) = (by(a, b, self.0[0]), by(c, d, self.0[1]));
        [a, b, c, d]
    }
}

impl CellTemplate {
    /// Makes the template of known cells; `None` where all are alike.
    fn from_cells(known: &[([i32; 2], [f32; 4])]) -> Option<Self> {
        let n = known.len() as f32;
        let mean: [f32; 4] = std::array::from_fn(|i| known.iter().map(|(_, v)| v[i]).sum::<f32>() / n);
        let less = |v: &[f32; 4]| -> [f32; 4] { std::array::from_fn(|i| v[i] - mean[i]) };
        let largest = known.iter().flat_map(|(_, v)| less(v)).map(f32::abs).fold(0.0, f32::max);
        if largest <= 0.0 {
            return None;
        }
        let scale = f32::from(MOST_VALUE) / largest;
        let cells: Vec<_> = known.iter().map(|(at, v)| (*at, less(v).map(|v| (v * scale).round() as i8))).collect();
        let values = || cells.iter().flat_map(|(_, v)| v.map(i32::from));
        let norm = values().map(|v| (v * v) as f32).sum();
        let total = values().sum();
        Some(Self { cells, norm, total })
    }

    /// Sum of squares of all values.
    pub fn norm(&self) -> f32 {
        self.norm
    }

    /// Sum of all values.
    pub fn total(&self) -> i32 {
        self.total
    }

    /// The cells laid out for a window of `stride` columns, with the template's middle `margin` cells right of and below the
    /// place.
    pub fn laid_out(&self, stride: usize, margin: usize) -> Vec<TemplateCell> {
        self.at_offsets(stride, margin, |values| values)
    }

    /// As [`CellTemplate::laid_out`] with the value 1 for every known cell, to sum energy.
    pub fn mask_laid_out(&self, stride: usize, margin: usize) -> Vec<TemplateCell> {
        self.at_offsets(stride, margin, |_| [1, 0, 0, 0])
    }

    fn at_offsets(&self, stride: usize, margin: usize, values: impl Fn([i8; 4]) -> [i8; 4]) -> Vec<TemplateCell> {
        let place = |v: i32| (v + margin as i32) as usize;
        self.cells
            .iter()
            .map(|&([x, y], v)| TemplateCell { offset: place(y) * stride + place(x), values: values(v) })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixels::{Gray, Mask};

    fn ground(turned: bool) -> Gray {
        // A scene and the same a quarter turn clockwise: (x, y) shows what (y, 191 - x) shows.
        let at = |x: usize, y: usize| ((x / 9 * 31 + y / 7 * 17 + x * y / 50) % 97) as f32;
        let pixel = |i: usize| if turned { at(i / 192, 191 - i % 192) } else { at(i % 192, i / 192) };
        Gray::from_values(192, 192, (0..192 * 192).map(pixel).collect()).unwrap()
    }

    #[test]
    fn a_turned_template_is_the_template_of_the_turned_view() {
        let mask = Mask::filled(192, 192, true);
        let view = |turned| CellView::new(&Structure::new(&ground(turned), &mask), &mask, [96.0, 96.0]).unwrap();
        let by_template = view(false).template(std::f64::consts::FRAC_PI_2, 1.0, 24.0, 4).unwrap();
        let by_view = view(true).template(0.0, 1.0, 24.0, 4).unwrap();
        assert_eq!(by_template.cells.len(), by_view.cells.len());
        for ((a, p), (b, q)) in by_template.cells.iter().zip(&by_view.cells) {
            assert_eq!(a, b);
            assert!(p.iter().zip(q).all(|(p, q)| (p - q).abs() <= 3), "{a:?}: {p:?} {q:?}");
        }
    }

    #[test]
    fn a_flat_view_makes_no_template() {
        let mask = Mask::filled(64, 64, true);
        let flat = Structure::new(&Gray::filled(64, 64, 9.0), &mask);
        assert!(CellView::new(&flat, &mask, [32.0; 2]).is_none());
    }
}
