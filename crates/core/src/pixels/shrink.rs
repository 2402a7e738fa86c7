//! Area-correct shrinking.

use super::gray::Gray;
use super::mask::Mask;
use fast_image_resize as fir;
use fir::images::TypedImage;
use fir::pixels::F32;

impl Gray {
    /// The image at a smaller size, without aliasing: a triangle filter as wide as the reduction weighs every source pixel.
    /// Returns the image unchanged for a size that is not smaller in either direction, or is zero.
    pub fn shrunk(&self, width_px: usize, height_px: usize) -> Self {
        let (own_width, own_height) = (self.width_px(), self.height_px());
        let shrinks = width_px < own_width || height_px < own_height;
        if !shrinks || width_px == 0 || height_px == 0 || width_px > own_width || height_px > own_height {
            return self.clone();
        }
        let pixels: Vec<F32> = self.values().iter().map(|&v| F32::new(v)).collect();
        let source = TypedImage::from_pixels(own_width as u32, own_height as u32, pixels).expect("a value a pixel");
        let mut target = TypedImage::<F32>::new(width_px as u32, height_px as u32);
        let options = fir::ResizeOptions::new().resize_alg(fir::ResizeAlg::Convolution(fir::FilterType::Bilinear));
        fir::Resizer::new().resize_typed(&source, &mut target, &options).expect("both images are F32");
        let values = target.pixels().iter().map(|p| p.0).collect();
        Self::from_values(width_px, height_px, values).expect("the resizer filled every pixel")
    }

    /// The means of `factor` x `factor` pixels; a remainder at the right and below is dropped. A factor of 0, or larger than
    /// the image, gives an empty image.
    pub fn binned(&self, factor: usize) -> Self {
        let (width, height) =
            (self.width_px().checked_div(factor).unwrap_or(0), self.height_px().checked_div(factor).unwrap_or(0));
        let mut out = Self::filled(width, height, 0.0);
        let norm = 1.0 / (factor * factor) as f32;
        for y in 0..height * factor {
            let target = &mut out.values_mut()[y / factor * width..(y / factor + 1) * width];
            let row = self.row(y);
            if factor == 2 {
                // A bin size known at compile time lets the compiler vectorise.
                for (sum, bin) in target.iter_mut().zip(row.chunks_exact(2)) {
                    *sum += (bin[0] + bin[1]) * norm;
                }
            } else {
                for (sum, bin) in target.iter_mut().zip(row.chunks_exact(factor)) {
                    *sum += bin.iter().sum::<f32>() * norm;
                }
            }
        }
        out
    }

    /// The image at half its size: the mean of the valid pixels among each 2 x 2; valid where at least two are.
    pub fn halved(&self, mask: &Mask) -> (Self, Mask) {
        let (width, height) = (self.width_px() / 2, self.height_px() / 2);
        let mut half = Self::filled(width, height, 0.0);
        let mut valid = Mask::filled(width, height, false);
        for y in 0..height {
            for x in 0..width {
                let (mut sum, mut count) = (0.0, 0u8);
                for (i, j) in [(2 * x, 2 * y), (2 * x + 1, 2 * y), (2 * x, 2 * y + 1), (2 * x + 1, 2 * y + 1)] {
                    if mask.at(i, j) {
                        sum += self.at(i, j);
                        count += 1;
                    }
                }
                if count >= 2 {
                    half.values_mut()[y * width + x] = sum / f32::from(count);
                    valid.set(x, y, true);
                }
            }
        }
        (half, valid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_means_and_the_remainder_is_dropped() {
        let ramp = Gray::from_values(7, 5, (0..35).map(|i| i as f32).collect()).unwrap().binned(2);
        assert_eq!((ramp.width_px(), ramp.height_px()), (3, 2));
        assert_eq!(ramp.at(1, 1), (16.0 + 17.0 + 23.0 + 24.0) / 4.0);
        assert_eq!(ramp.binned(0).values().len(), 0);
    }

    #[test]
    fn a_ramp_stays_a_ramp_and_a_checkerboard_turns_gray() {
        let ramp = Gray::from_values(64, 8, (0..512).map(|i| (i % 64) as f32).collect()).unwrap().shrunk(16, 2);
        // Pixel i covers source columns 4i..4i+4, whose mean is 4i + 1.5.
        assert!((1..15).all(|i| (ramp.at(i, 1) - (4 * i) as f32 - 1.5).abs() < 1e-3));
        let board = Gray::from_values(64, 64, (0..4096).map(|i| ((i % 64 + i / 64) % 2 * 255) as f32).collect());
        assert!(board.unwrap().shrunk(20, 20).values().iter().all(|v| (v - 127.5).abs() < 6.0));
    }
}
