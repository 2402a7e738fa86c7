//! Colours: components of any sampling to red, green, blue.

use super::frame_header::Frame;
use super::plane::Plane;
use crate::pixels::Colour;

/// What the components of a file mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ColourSpace {
    Gray,
    /// Luma and two chroma components (T.871).
    YCbCr,
    Rgb,
    /// Inverted ink: 255 is none.
    Cmyk,
    /// Inverted ink coded as luma and chroma, and black.
    Ycck,
}

/// Reads the colour space from the number of components and the transform that an Adobe segment states, if there is one.
pub(super) fn colour_space(frame: &Frame, adobe_transform: Option<u8>) -> ColourSpace {
    match (frame.components.len(), adobe_transform) {
        (1, _) => ColourSpace::Gray,
        (3, Some(0)) => ColourSpace::Rgb,
        (3, None) if frame.components.iter().map(|c| c.id).eq(*b"RGB") => ColourSpace::Rgb,
        (3, _) => ColourSpace::YCbCr,
        (_, Some(2)) => ColourSpace::Ycck,
        _ => ColourSpace::Cmyk,
    }
}

/// Puts planes together. Chroma planes of a smaller sampling are interpolated linearly.
pub(super) fn compose(frame: &Frame, space: ColourSpace, planes: &[&Plane<u8>]) -> Colour {
    let (width, height) = (planes.iter().map(|p| p.width_px).max(), planes.iter().map(|p| p.height_px).max());
    let (width, height) = (width.unwrap_or(0), height.unwrap_or(0));
    let most = |of: fn(&super::frame_header::Component) -> usize| frame.components.iter().map(of).max().unwrap_or(1);
    let (most_across, most_down) = (most(|c| c.across), most(|c| c.down));
    let columns: Vec<_> =
        frame.components.iter().zip(planes).map(|(c, p)| taps(width, p.width_px, c.across, most_across)).collect();
    let rows: Vec<_> =
        frame.components.iter().zip(planes).map(|(c, p)| taps(height, p.height_px, c.down, most_down)).collect();
    let mut lines = vec![vec![0f32; width]; planes.len().max(3)];
    let mut values = vec![0; width * height * 3];
    for (y, out) in values.chunks_exact_mut((width * 3).max(1)).enumerate() {
        for (i, plane) in planes.iter().enumerate() {
            interpolate(plane, &columns[i], rows[i][y], &mut lines[i]);
        }
        match space {
            ColourSpace::Gray => convert(&lines, out, |[a, ..], _| [a; 3]),
            ColourSpace::YCbCr => convert(&lines, out, |levels, _| from_chroma(levels)),
            ColourSpace::Rgb => convert(&lines, out, |levels, _| levels),
            ColourSpace::Cmyk => convert(&lines, out, inked),
            ColourSpace::Ycck => convert(&lines, out, |levels, black| inked(from_chroma(levels), black)),
        }
    }
    Colour::from_values(width, height, values).expect("three values a pixel")
}

/// Converts a row by a function of three components and the fourth.
#[inline(always)]
fn convert(lines: &[Vec<f32>], out: &mut [u8], rgb: impl Fn([f32; 3], f32) -> [f32; 3]) {
    let (a, b, c, k) = (&lines[0], &lines[1], &lines[2], lines.get(3).unwrap_or(&lines[0]));
    for (x, pixel) in out.chunks_exact_mut(3).enumerate() {
        let levels = rgb([a[x], b[x], c[x]], k[x]);
        pixel.iter_mut().zip(levels).for_each(|(out, level)| *out = (level + 0.5).clamp(0.0, 255.0) as u8);
    }
}

/// T.871, clause 7.
#[inline(always)]
fn from_chroma([y, cb, cr]: [f32; 3]) -> [f32; 3] {
    let (cb, cr) = (cb - 128.0, cr - 128.0);
    [y + 1.402 * cr, y - 0.344_136 * cb - 0.714_136 * cr, y + 1.772 * cb]
}

#[inline(always)]
fn inked(inks: [f32; 3], black: f32) -> [f32; 3] {
    inks.map(|ink| ink.clamp(0.0, 255.0) * black / 255.0)
}

/// For every output pixel: the two nearest samples of a component, and the weight of the second.
fn taps(length: usize, samples: usize, factor: usize, most: usize) -> Vec<(usize, usize, f32)> {
    let scale = factor as f32 / most as f32;
    let last = samples.saturating_sub(1);
    let tap = |i: usize| {
        let at = ((i as f32 + 0.5) * scale - 0.5).clamp(0.0, last as f32);
        (at as usize, (at as usize + 1).min(last), at.fract())
    };
    (0..length).map(tap).collect()
}

fn interpolate(plane: &Plane<u8>, columns: &[(usize, usize, f32)], row: (usize, usize, f32), line: &mut [f32]) {
    let at = |y: usize| &plane.values[y * plane.width_px..(y + 1) * plane.width_px];
    let (upper, lower) = (at(row.0), at(row.1));
    if plane.width_px == line.len() && row.2 == 0.0 {
        return line.iter_mut().zip(upper).for_each(|(out, &v)| *out = v.into());
    }
    let mix = |a: u8, b: u8, weight: f32| f32::from(a) + weight * (f32::from(b) - f32::from(a));
    for (out, &(left, right, weight)) in line.iter_mut().zip(columns) {
        let (a, b) = (mix(upper[left], lower[left], row.2), mix(upper[right], lower[right], row.2));
        *out = a + weight * (b - a);
    }
}
