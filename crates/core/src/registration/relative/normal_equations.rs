//! The normal equations of one block of frame b: layout of the design, and elimination of the block's own plane.

use nalgebra::{SMatrix, SVector};

/// Parameters of the alignment: shift of b's centre in a (x, y), growth and rotation (both times `Template::radius_px`),
/// gain.
pub const PARAMETERS: usize = 5;
/// Pixels compared side by side.
pub const LANES: usize = 8;
/// Parameters of a block's plane of brightness: offset, slope along x, slope along y.
pub const PLANE: usize = 3;
/// Columns of the design: the parameters and the block's plane; then the residual and b itself.
pub const COLUMNS: usize = PARAMETERS + PLANE + 2;
/// The column of the gain.
pub const GAIN: usize = PARAMETERS - 1;
/// The first column of the plane.
pub const OFFSET: usize = PARAMETERS;
/// The column of the residual.
pub const RESIDUAL: usize = OFFSET + PLANE;
/// The column of b itself.
pub const SEEN: usize = RESIDUAL + 1;
/// Products of two columns, each pair of columns once.
pub const PRODUCTS: usize = COLUMNS * (COLUMNS + 1) / 2;
/// The pixels of a block that are in the overlap are spread along both axes: the least determinant of their moments,
/// coordinates in half blocks; a full block has 0.1.
const LEAST_SPREAD: f64 = 0.003;

/// One value for each of the pixels compared side by side.
pub type Lanes = [f32; LANES];
/// A plane of brightness over a block, gray levels; coordinates in half blocks from the block's middle.
pub type Plane = [f32; PLANE];

/// One block's part of the normal equations, its plane eliminated.
pub struct BlockSums {
    /// Normal matrix.
    pub normal: SMatrix<f64, PARAMETERS, PARAMETERS>,
    /// Design times residual.
    pub right: SVector<f64, PARAMETERS>,
    /// Correlation of a and b.
    pub correlation: f64,
    /// Number of pixels compared.
    pub count: f64,
    /// Sum of their absolute residuals, gray levels.
    pub absolute: f64,
}

/// Eliminates the block's plane from the products of the design's columns. Returns the block's part of the normal equations,
/// and the correction of the plane; `None` where too few pixels determine the plane.
pub fn eliminate_plane(products: &[Lanes; PRODUCTS]) -> Option<(BlockSums, Plane)> {
    let mut full = SMatrix::<f64, COLUMNS, COLUMNS>::zeros();
    let mut k = 0;
    for row in 0..COLUMNS {
        for column in row..COLUMNS {
            let sum: f64 = products[k].iter().map(|&v| f64::from(v)).sum();
            (full[(row, column)], full[(column, row)]) = (sum, sum);
            k += 1;
        }
    }
    let of_plane = full.fixed_columns::<PLANE>(OFFSET).into_owned();
    let plane = of_plane.fixed_rows::<PLANE>(OFFSET).into_owned();
    let inverse = plane.try_inverse().filter(|_| plane.determinant() > LEAST_SPREAD * plane[(0, 0)].powi(3))?;
    let rest = full - of_plane * inverse * of_plane.transpose();
    let squares = rest[(GAIN, GAIN)].max(0.0) * rest[(SEEN, SEEN)].max(0.0);
    let correlation = if squares > 1e-6 { (rest[(GAIN, SEEN)] / squares.sqrt()).clamp(-1.0, 1.0) } else { 0.0 };
    let sums = BlockSums {
        normal: rest.fixed_view::<PARAMETERS, PARAMETERS>(0, 0).into_owned(),
        right: rest.fixed_view::<PARAMETERS, 1>(0, RESIDUAL).into_owned(),
        correlation,
        count: 0.0,
        absolute: 0.0,
    };
    let off = inverse * of_plane.row(RESIDUAL).transpose();
    Some((sums, [off[0] as f32, off[1] as f32, off[2] as f32]))
}
