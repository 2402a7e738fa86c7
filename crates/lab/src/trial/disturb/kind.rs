//! `DisturbanceKind`: the ways in which a frame is disturbed.

use serde::Serialize;

/// The way in which a frame is disturbed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DisturbanceKind {
    /// The camera looks 0.5 to 20 degrees off nadir in any direction, and nothing of its attitude is stated.
    Tilt,
    /// Pitch and roll are stated, with errors of 2 degrees (one standard deviation) each.
    AttitudeError,
    /// Pixels are 0.95 to 1.05 times as wide as high.
    Aspect,
    /// Rows are shifted along the image, by up to 3 % of their distance, as by a rolling shutter.
    Shear,
    /// A radial distortion k1 of 0.05 to 0.2 of either sign.
    Distortion,
    /// The image is cut from beside the middle of the sensor, by up to a tenth of its edge; nothing of its attitude is stated.
    PrincipalPoint,
    /// The stated height is off by 5 to 15 %.
    ScaleError,
    /// The stated heading is off by 5 to 20 degrees.
    HeadingError,
    /// Out of focus by 1 to 4 pixels.
    Blur,
    /// Smeared along a line of 3 to 15 pixels.
    MotionBlur,
    /// Sensor noise of 5 to 40 gray levels.
    Noise,
    /// Compressed as JPEG of quality 3 to 25.
    Jpeg,
    /// Over- or underexposed: values clipped at either end.
    Exposure,
    /// Gray levels to a power of 0.4 to 2.5.
    Gamma,
    /// Bright is dark, as in another band.
    Inverted,
    /// Uniform rectangles cover 10 to 50 % of the frame.
    Occlusion,
    /// A bright spot washes out a part of the frame.
    Glare,
    /// Soft bright patches cover 20 to 60 % of the frame.
    Clouds,
    /// 5 to 30 % of the rows are black, white or repeat the row before.
    DeadRows,
    /// Bright lines, a cross and digits lie over the frame.
    Hud,
    /// Dark soft specks on the sensor.
    Dust,
    /// The corners are darker, by 30 to 90 %.
    Vignette,
    /// Shrunk 1.5 to 4 times and enlarged again.
    Resampled,
    /// Every second row was taken later: the two fields are 0.5 to 2 pixels apart.
    Interlaced,
    /// The ground beyond a line is displaced by 2 to 10 pixels, as where two sources of a map disagree; the truth is that of either part.
    Seam,
}

impl DisturbanceKind {
    /// All kinds, in the order of reports.
    pub const ALL: [Self; 25] = [
        Self::Tilt,
        Self::AttitudeError,
        Self::Aspect,
        Self::Shear,
        Self::Distortion,
        Self::PrincipalPoint,
        Self::ScaleError,
        Self::HeadingError,
        Self::Blur,
        Self::MotionBlur,
        Self::Noise,
        Self::Jpeg,
        Self::Exposure,
        Self::Gamma,
        Self::Inverted,
        Self::Occlusion,
        Self::Glare,
        Self::Clouds,
        Self::DeadRows,
        Self::Hud,
        Self::Dust,
        Self::Vignette,
        Self::Resampled,
        Self::Interlaced,
        Self::Seam,
    ];

    /// The name in JSON and on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Tilt => "tilt",
            Self::AttitudeError => "attitude_error",
            Self::Aspect => "aspect",
            Self::Shear => "shear",
            Self::Distortion => "distortion",
            Self::PrincipalPoint => "principal_point",
            Self::ScaleError => "scale_error",
            Self::HeadingError => "heading_error",
            Self::Blur => "blur",
            Self::MotionBlur => "motion_blur",
            Self::Noise => "noise",
            Self::Jpeg => "jpeg",
            Self::Exposure => "exposure",
            Self::Gamma => "gamma",
            Self::Inverted => "inverted",
            Self::Occlusion => "occlusion",
            Self::Glare => "glare",
            Self::Clouds => "clouds",
            Self::DeadRows => "dead_rows",
            Self::Hud => "hud",
            Self::Dust => "dust",
            Self::Vignette => "vignette",
            Self::Resampled => "resampled",
            Self::Interlaced => "interlaced",
            Self::Seam => "seam",
        }
    }
}

impl std::str::FromStr for DisturbanceKind {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        let words = || Self::ALL.map(Self::word).join(", ");
        Self::ALL.into_iter().find(|k| k.word() == word).ok_or_else(|| format!("all, or some of {}", words()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_what_json_says() {
        for kind in DisturbanceKind::ALL {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.word());
            assert_eq!(kind.word().parse(), Ok(kind));
        }
        assert!("nothing".parse::<DisturbanceKind>().is_err());
    }
}
