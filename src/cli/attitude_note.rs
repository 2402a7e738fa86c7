//! The note on standard error of how exactly the attitude is taken to be known.

use overfly_core::camera::{Attitude, View};

/// What a search takes a view's attitude for.
pub fn view_note(view: &View) -> String {
    match view {
        View::Nadir { .. } => {
            "attitude: no height is known, so prior and answer are the ground at the image's centre".into()
        }
        View::Posed { attitude, .. } => attitude_note([*attitude].into_iter()),
    }
}

/// What a search takes pitch and roll for, and their standard deviation; over many frames the range of the standard deviations.
pub fn attitude_note(attitudes: impl Iterator<Item = Attitude>) -> String {
    let (mut least, mut most) = (f64::INFINITY, 0f64);
    let mut is_stated = true;
    for attitude in attitudes {
        least = least.min(attitude.sigma_rad.to_degrees());
        most = most.max(attitude.sigma_rad.to_degrees());
        is_stated &= attitude.is_stated();
    }
    let angles = if is_stated { "pitch and roll as stated" } else { "pitch or roll not stated and taken as 0" };
    let sigma = if least < most { format!("{least:.3} to {most:.3}") } else { format!("{most:.3}") };
    format!("attitude: {angles}, one standard deviation {sigma} degrees (--attitude-sigma-deg)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_what_was_assumed() {
        let stated = Attitude::new(Some(0.0), Some(0.0), None);
        let note = attitude_note([stated].into_iter());
        assert_eq!(
            note,
            "attitude: pitch and roll as stated, one standard deviation 2.000 degrees (--attitude-sigma-deg)"
        );
        let note = attitude_note([stated, Attitude::UNSTATED].into_iter());
        assert!(view_note(&View::Nadir { gsd_m_per_px: 1.0 }).contains("image's centre"));
        assert!(note.contains("not stated and taken as 0") && note.contains("2.000 to 5.000 degrees"), "{note}");
    }
}
