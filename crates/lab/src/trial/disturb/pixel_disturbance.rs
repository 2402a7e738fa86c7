//! Disturbances of the pixels: sensor, lens, link, weather.

use super::kind::DisturbanceKind;
use overfly_core::pixels::Gray;
use overfly_flight::frame::decode_frame;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Disturbs the pixels of a frame and says how strongly, in the kind's own unit; kinds of another sort leave the frame as it is.
/// Values are whole numbers in [0, 255] afterwards, as a file's are.
pub fn pixels(kind: DisturbanceKind, gray: Gray, rng: &mut ChaCha8Rng) -> (Gray, Option<f64>) {
    let found = match kind {
        DisturbanceKind::Blur | DisturbanceKind::MotionBlur | DisturbanceKind::Resampled => smoothed(kind, &gray, rng),
        DisturbanceKind::Noise
        | DisturbanceKind::Exposure
        | DisturbanceKind::Gamma
        | DisturbanceKind::Inverted
        | DisturbanceKind::Vignette => developed(kind, &gray, rng),
        DisturbanceKind::Jpeg => compressed(&gray, rng),
        DisturbanceKind::Occlusion
        | DisturbanceKind::Glare
        | DisturbanceKind::Clouds
        | DisturbanceKind::Hud
        | DisturbanceKind::Dust => covered(kind, &gray, rng),
        DisturbanceKind::Seam => with_seam(&gray, rng),
        DisturbanceKind::DeadRows | DisturbanceKind::Interlaced => read_out(kind, &gray, rng),
        _ => return (rounded(gray), None),
    };
    (rounded(found.0), Some(found.1))
}

fn rounded(mut gray: Gray) -> Gray {
    gray.values_mut().iter_mut().for_each(|v| *v = v.round().clamp(0.0, 255.0));
    gray
}

/// The frame with each value replaced by a function of column, row and value.
fn mapped(gray: &Gray, mut value: impl FnMut(usize, usize, f32) -> f32) -> Gray {
    let mut out = gray.clone();
    let width = gray.width_px();
    out.values_mut().iter_mut().enumerate().for_each(|(i, v)| *v = value(i % width, i / width, *v));
    out
}

fn smoothed(kind: DisturbanceKind, gray: &Gray, rng: &mut ChaCha8Rng) -> (Gray, f64) {
    let (width, height) = (gray.width_px(), gray.height_px());
    match kind {
        DisturbanceKind::Blur => {
            let radius = rng.random_range(1.0..4.0f64);
            // Three box filters are nearly a Gaussian.
            let out =
                (0..3).fold(gray.clone(), |g, _| line_mean(&line_mean(&g, radius, [1.0, 0.0]), radius, [0.0, 1.0]));
            (out, radius)
        }
        DisturbanceKind::MotionBlur => {
            let (length, angle) = (rng.random_range(3.0..15.0f64), rng.random_range(0.0..TAU));
            (line_mean(gray, length / 2.0, [angle.cos(), angle.sin()]), length)
        }
        _ => {
            let factor = rng.random_range(1.5..4.0f64);
            let side = |n: usize| (n as f64 / factor).round().max(1.0) as usize;
            let small = gray.shrunk(side(width), side(height));
            let (sx, sy) = (small.width_px() as f64 / width as f64, small.height_px() as f64 / height as f64);
            (mapped(gray, |x, y, _| small.sample((x as f64 + 0.5) * sx, (y as f64 + 0.5) * sy)), factor)
        }
    }
}

/// The mean over a line of half length `half` about each pixel.
fn line_mean(gray: &Gray, half: f64, direction: [f64; 2]) -> Gray {
    let steps = half.ceil() as i32;
    mapped(gray, |x, y, _| {
        let at = |i: i32| {
            let along = half * f64::from(i) / f64::from(steps);
            gray.sample(x as f64 + 0.5 + along * direction[0], y as f64 + 0.5 + along * direction[1])
        };
        (-steps..=steps).map(at).sum::<f32>() / (2 * steps + 1) as f32
    })
}

fn developed(kind: DisturbanceKind, gray: &Gray, rng: &mut ChaCha8Rng) -> (Gray, f64) {
    let (width, height) = (gray.width_px() as f64, gray.height_px() as f64);
    match kind {
        DisturbanceKind::Noise => {
            let sigma = rng.random_range(5.0..40.0f32);
            let out = mapped(gray, |_, _, v| v + sigma * ((0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0));
            (out, f64::from(sigma))
        }
        DisturbanceKind::Exposure => {
            let gain = if rng.random_bool(0.5) { rng.random_range(1.5..3.0f32) } else { rng.random_range(0.1..0.4) };
            let offset = if gain > 1.0 { 0.0 } else { rng.random_range(-15.0..0.0f32) };
            (mapped(gray, |_, _, v| v * gain + offset), f64::from(gain))
        }
        DisturbanceKind::Gamma => {
            let power = 2f32.powf(rng.random_range(-1.3..1.3));
            (mapped(gray, |_, _, v| 255.0 * (v.clamp(0.0, 255.0) / 255.0).powf(power)), f64::from(power))
        }
        DisturbanceKind::Inverted => (mapped(gray, |_, _, v| 255.0 - v), 1.0),
        _ => {
            let depth = rng.random_range(0.3..0.9f64);
            let out = mapped(gray, |x, y, v| {
                let (dx, dy) = (2.0 * x as f64 / width - 1.0, 2.0 * y as f64 / height - 1.0);
                v * (1.0 - depth * (dx * dx + dy * dy) / 2.0) as f32
            });
            (out, depth)
        }
    }
}

fn compressed(gray: &Gray, rng: &mut ChaCha8Rng) -> (Gray, f64) {
    let quality = rng.random_range(3..=25u8);
    let (bytes, side) = (rounded(gray.clone()), |n: usize| u16::try_from(n).unwrap_or(u16::MAX));
    let bytes: Vec<u8> = bytes.values().iter().map(|v| *v as u8).collect();
    let mut file = Vec::new();
    let encoded = jpeg_encoder::Encoder::new(&mut file, quality).encode(
        &bytes,
        side(gray.width_px()),
        side(gray.height_px()),
        jpeg_encoder::ColorType::Luma,
    );
    let read = encoded.ok().and_then(|()| decode_frame(&file, "disturbed.jpg").ok());
    (read.unwrap_or_else(|| gray.clone()), f64::from(quality))
}

fn covered(kind: DisturbanceKind, gray: &Gray, rng: &mut ChaCha8Rng) -> (Gray, f64) {
    let (width, height) = (gray.width_px(), gray.height_px());
    let (w, h) = (width as f64, height as f64);
    match kind {
        DisturbanceKind::Occlusion => occluded(gray, rng),
        DisturbanceKind::Glare => {
            let ([cx, cy], reach) =
                ([rng.random_range(0.0..w), rng.random_range(0.0..h)], w * rng.random_range(0.15..0.5));
            let out = mapped(gray, |x, y, v| {
                let square = ((x as f64 - cx).powi(2) + (y as f64 - cy).powi(2)) / (reach * reach);
                v + (300.0 * (-square).exp()) as f32
            });
            (out, reach / w)
        }
        DisturbanceKind::Clouds => {
            let share = rng.random_range(0.2..0.6f64);
            let waves: Vec<[f64; 4]> = (0..12)
                .map(|_| {
                    let (length, angle) = (w * rng.random_range(0.15..0.7), rng.random_range(0.0..TAU));
                    [TAU * angle.cos() / length, TAU * angle.sin() / length, rng.random_range(0.0..TAU), length]
                })
                .collect();
            let field = |x: usize, y: usize| {
                waves.iter().map(|[kx, ky, p, a]| a * (kx * x as f64 + ky * y as f64 + p).sin()).sum::<f64>()
            };
            let mut sorted: Vec<f64> = (0..width * height).map(|i| field(i % width, i / width)).collect();
            sorted.sort_by(f64::total_cmp);
            let (edge, top) = (sorted[((1.0 - share) * (sorted.len() - 1) as f64) as usize], sorted[sorted.len() - 1]);
            let out = mapped(gray, |x, y, v| {
                let opacity = ((field(x, y) - edge) / (top - edge) * 4.0).clamp(0.0, 1.0) as f32;
                v + (235.0 - v) * opacity
            });
            (out, share)
        }
        DisturbanceKind::Hud => (with_hud(gray, rng), 1.0),
        _ => {
            let specks: Vec<[f64; 3]> = (0..rng.random_range(5..60))
                .map(|_| [rng.random_range(0.0..w), rng.random_range(0.0..h), rng.random_range(1.0..6.0)])
                .collect();
            let out = mapped(gray, |x, y, v| {
                let dark = specks
                    .iter()
                    .map(|[cx, cy, r]| (-((x as f64 - cx).powi(2) + (y as f64 - cy).powi(2)) / (r * r)).exp());
                v * (1.0 - 0.8 * dark.fold(0.0, f64::max)) as f32
            });
            (out, specks.len() as f64)
        }
    }
}

/// Uniform rectangles over a share of the frame.
fn occluded(gray: &Gray, rng: &mut ChaCha8Rng) -> (Gray, f64) {
    let (width, height) = (gray.width_px(), gray.height_px());
    let (share, mut out, mut hidden) = (rng.random_range(0.1..0.5f64), gray.clone(), vec![false; width * height]);
    while (hidden.iter().filter(|h| **h).count() as f64) < share * hidden.len() as f64 {
        let (w, h) =
            (rng.random_range(width / 10 + 1..=width / 3 + 1), rng.random_range(height / 10 + 1..=height / 3 + 1));
        let (left, top) = (rng.random_range(0..width), rng.random_range(0..height));
        let value = rng.random_range(0.0..255.0f32);
        for y in top..(top + h).min(height) {
            for x in left..(left + w).min(width) {
                out.values_mut()[y * width + x] = value;
                hidden[y * width + x] = true;
            }
        }
    }
    (out, share)
}

/// A cross, a horizon line, a frame of ticks and blocks of digits, as a head-up display draws them.
fn with_hud(gray: &Gray, rng: &mut ChaCha8Rng) -> Gray {
    let (width, height) = (gray.width_px(), gray.height_px());
    let (cx, cy, tick) = (width / 2, height / 2, rng.random_range(8..20usize));
    let digits: Vec<bool> = (0..400).map(|_| rng.random_bool(0.5)).collect();
    mapped(gray, |x, y, v| {
        let cross =
            (x.abs_diff(cx) < 1 && y.abs_diff(cy) < height / 6) || (y.abs_diff(cy) < 1 && x.abs_diff(cx) < width / 4);
        let ticks = (x < 10 || x + 10 > width) && y % tick == 0;
        let in_text = (4..16).contains(&y) || (y + 16 > height && y + 4 < height);
        let text = in_text && x / 2 < digits.len() && digits[(x / 2 + 7 * (y / 2)) % digits.len()] && (x / 40) % 2 == 0;
        if cross || ticks || text { 255.0 } else { v }
    })
}

fn read_out(kind: DisturbanceKind, gray: &Gray, rng: &mut ChaCha8Rng) -> (Gray, f64) {
    let (width, height) = (gray.width_px(), gray.height_px());
    if kind == DisturbanceKind::Interlaced {
        let (shift, angle) = (rng.random_range(0.5..2.0f64), rng.random_range(0.0..TAU));
        let out = mapped(gray, |x, y, _| {
            let later = |t: f64| gray.sample(x as f64 + 0.5 + t * angle.cos(), y as f64 + 0.5 + t * angle.sin());
            later(if y % 2 == 1 { shift / 2.0 } else { -shift / 2.0 })
        });
        return (out, shift);
    }
    let share = rng.random_range(0.05..0.3f64);
    let mut out = gray.clone();
    for y in 1..height {
        if rng.random_bool(share) {
            let choice = rng.random_range(0..3);
            for x in 0..width {
                let before = out.at(x, y - 1);
                out.values_mut()[y * width + x] = [0.0, 255.0, before][choice];
            }
        }
    }
    (out, share)
}

/// The part of the frame beyond a line through its inner half is displaced. Either part is the larger one.
fn with_seam(gray: &Gray, rng: &mut ChaCha8Rng) -> (Gray, f64) {
    let inner = |side: usize, rng: &mut ChaCha8Rng| side as f64 * rng.random_range(0.25..0.75);
    let (px, py) = (inner(gray.width_px(), rng), inner(gray.height_px(), rng));
    let (normal, direction) = (rng.random_range(0.0..TAU), rng.random_range(0.0..TAU));
    let shift = rng.random_range(2.0..10.0f64);
    let out = mapped(gray, |x, y, v| {
        let (x, y) = (x as f64 + 0.5, y as f64 + 0.5);
        let is_beyond = (x - px) * normal.cos() + (y - py) * normal.sin() > 0.0;
        if is_beyond { gray.sample(x + shift * direction.cos(), y + shift * direction.sin()) } else { v }
    });
    (out, shift)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn each_kind_of_pixels_changes_the_frame_alike_for_one_seed() {
        let values = (0..64 * 48).map(|i| (40 + (i * 37 % 64) + i / 64) as f32).collect();
        let gray = Gray::from_values(64, 48, values).unwrap();
        let draw = |kind| pixels(kind, gray.clone(), &mut ChaCha8Rng::seed_from_u64(5));
        let altered: Vec<_> = DisturbanceKind::ALL.into_iter().filter(|&kind| draw(kind).0 != gray).collect();
        assert_eq!(altered.len(), 17, "{altered:?}");
        for kind in altered {
            let (frame, size) = draw(kind);
            assert_eq!((frame, size), draw(kind));
            assert!(size.is_some());
        }
    }
}
