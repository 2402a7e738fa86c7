//! The blob of a tile's keypoints in a store. Little-endian; documented in migrations/README.md.
//!
//! Header: `u32` count. Then per keypoint 44 bytes: x, y in 1/64 px (`u16` each), response (`f32`), angle in
//! 65536ths of a turn (`u16`), octave (`u8`), zero (`u8`), descriptor (32 bytes).

use super::keypoints::{Keypoint, Keypoints};
use std::f32::consts::TAU;

const HEADER_BYTES: usize = 4;
const ROW_BYTES: usize = 44;
const POSITION_STEPS: f32 = 64.0;

/// The blob of a tile's keypoints. Positions are kept to 1/64 px, angles to 1/65536 turn.
pub fn to_blob(keypoints: &Keypoints) -> Vec<u8> {
    let mut blob = Vec::with_capacity(HEADER_BYTES + ROW_BYTES * keypoints.points.len());
    blob.extend((keypoints.points.len() as u32).to_le_bytes());
    for (point, descriptor) in keypoints.points.iter().zip(&keypoints.descriptors) {
        blob.extend(((point.x_px * POSITION_STEPS).round() as u16).to_le_bytes());
        blob.extend(((point.y_px * POSITION_STEPS).round() as u16).to_le_bytes());
        blob.extend(point.response.to_le_bytes());
        let turn = point.angle_rad.rem_euclid(TAU) / TAU * 65536.0;
        blob.extend(((turn.round() as u32 & 0xffff) as u16).to_le_bytes());
        blob.push(point.scale.log2().round() as u8);
        blob.push(0);
        blob.extend(descriptor);
    }
    blob
}

/// Reads the bytes of [`to_blob`]; `None` where they are not a valid blob.
pub fn from_blob(blob: &[u8]) -> Option<Keypoints> {
    let count = u32::from_le_bytes(blob.get(..HEADER_BYTES)?.try_into().ok()?) as usize;
    let rows = &blob[HEADER_BYTES..];
    if rows.len() != count.checked_mul(ROW_BYTES)? {
        return None;
    }
    let mut keypoints = Keypoints::default();
    for row in rows.chunks_exact(ROW_BYTES) {
        let half = |i: usize| f32::from(u16::from_le_bytes([row[i], row[i + 1]]));
        let response = f32::from_le_bytes([row[4], row[5], row[6], row[7]]);
        if row[10] > 15 || row[11] != 0 || !response.is_finite() {
            return None;
        }
        keypoints.points.push(Keypoint {
            x_px: half(0) / POSITION_STEPS,
            y_px: half(2) / POSITION_STEPS,
            response,
            angle_rad: half(8) / 65536.0 * TAU,
            scale: f32::from(1u16 << row[10]),
        });
        keypoints.descriptors.push(row[12..].try_into().expect("32 bytes are left of 44"));
    }
    Some(keypoints)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn reads_back_to_the_stated_steps(
            rows in proptest::collection::vec((0f32..512.0, 0f32..512.0, 0f32..1e4, -3.2f32..3.2, 0u32..3, any::<[u8; 32]>()), 0..40)
        ) {
            let keypoints = Keypoints {
                points: rows.iter().map(|r| Keypoint { x_px: r.0, y_px: r.1, response: r.2, angle_rad: r.3, scale: (1 << r.4) as f32 }).collect(),
                descriptors: rows.iter().map(|r| r.5).collect(),
            };
            let back = from_blob(&to_blob(&keypoints)).unwrap();
            prop_assert_eq!(&back.descriptors, &keypoints.descriptors);
            for (p, q) in keypoints.points.iter().zip(&back.points) {
                prop_assert!((p.x_px - q.x_px).abs() <= 1.0 / 128.0 && (p.y_px - q.y_px).abs() <= 1.0 / 128.0);
                let turn = (p.angle_rad - q.angle_rad).rem_euclid(TAU);
                prop_assert!(turn.min(TAU - turn) < 1e-4);
                prop_assert_eq!(p.scale, q.scale);
            }
        }

        #[test]
        fn refuses_other_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            if let Some(keypoints) = from_blob(&bytes) {
                prop_assert_eq!(bytes.len(), 4 + 44 * keypoints.points.len());
            }
        }
    }
}
