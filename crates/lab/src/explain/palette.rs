//! Numbers as colours.

use overfly_core::feature::{CHANNEL_ONE, Structure};
use overfly_core::pixels::{Colour, Gray};

/// A gray image in colour.
pub fn gray(gray: &Gray) -> Colour {
    let values = gray.values().iter().flat_map(|v| [v.round().clamp(0.0, 255.0) as u8; 3]).collect();
    Colour::from_values(gray.width_px(), gray.height_px(), values).expect("three values a pixel")
}

/// A complex channel: its angle as hue, its modulus as brightness. `channel`: 0 the doubled angle, 1 the quadrupled.
pub fn channel(structure: &Structure, channel: usize) -> Colour {
    let paint = |c: &[i8; 4]| {
        let (re, im) = (f32::from(c[2 * channel]) / CHANNEL_ONE, f32::from(c[2 * channel + 1]) / CHANNEL_ONE);
        hue(im.atan2(re), re.hypot(im).min(1.0).sqrt())
    };
    let values = structure.channels.iter().flat_map(paint).collect();
    Colour::from_values(structure.width_px, structure.height_px, values).expect("three values a pixel")
}

/// A fully saturated colour of the wheel, `angle` in radians, `value` in [0, 1].
pub fn hue(angle: f32, value: f32) -> [u8; 3] {
    let sixth = (angle / std::f32::consts::TAU).rem_euclid(1.0) * 6.0;
    let part = |shift: f32| {
        let k = (shift + sixth).rem_euclid(6.0);
        (value * (1.0 - k.min(4.0 - k).clamp(0.0, 1.0)) * 255.0).round() as u8
    };
    [part(5.0), part(3.0), part(1.0)]
}

/// Dark violet over red to light yellow, for `share` in [0, 1].
pub fn heat(share: f32) -> [u8; 3] {
    const STOPS: [[f32; 3]; 6] = [
        [4.0, 3.0, 22.0],
        [66.0, 15.0, 109.0],
        [147.0, 38.0, 103.0],
        [221.0, 81.0, 58.0],
        [251.0, 165.0, 10.0],
        [252.0, 253.0, 164.0],
    ];
    let at = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let i = (at as usize).min(STOPS.len() - 2);
    std::array::from_fn(|k| (STOPS[i][k] + (STOPS[i + 1][k] - STOPS[i][k]) * (at - i as f32)).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wheel_turns_from_red_over_green_to_blue() {
        use std::f32::consts::TAU;
        assert_eq!(hue(0.0, 1.0), [255, 0, 0]);
        assert_eq!(hue(TAU / 3.0, 1.0), [0, 255, 0]);
        assert_eq!(hue(-TAU / 3.0, 1.0), [0, 0, 255]);
        assert_eq!(hue(1.0, 0.0), [0, 0, 0]);
    }

    #[test]
    fn heat_grows_lighter() {
        let light = |s: f32| heat(s).iter().map(|v| u32::from(*v)).sum::<u32>();
        assert!((1..=20).all(|i| light(i as f32 / 20.0) > light((i - 1) as f32 / 20.0)));
    }
}
