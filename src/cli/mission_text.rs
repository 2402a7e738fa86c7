//! Mission, serial and last day of an export, in words.

use crate::cli::output::one_line;

/// What an export is for, and a separator; empty where it states nothing of it.
pub fn mission_text(name: Option<&str>, serial: Option<u64>, valid_until: Option<&str>) -> String {
    let stated = [
        name.map(|name| format!("mission {}", one_line(name))),
        serial.map(|serial| format!("serial {serial}")),
        valid_until.map(|day| format!("valid until {day}")),
    ];
    let stated: Vec<String> = stated.into_iter().flatten().collect();
    if stated.is_empty() { String::new() } else { format!("{}; ", stated.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_what_is_stated() {
        assert_eq!(mission_text(None, None, None), "");
        assert_eq!(
            mission_text(Some("Survey 7"), Some(12), Some("2027-03-31")),
            "mission Survey 7, serial 12, valid until 2027-03-31; "
        );
    }
}
