//! `RequestedRange`: the part of a file that a `Range` header asks for (RFC 9110, section 14).

/// The requested part of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RequestedRange {
    /// The whole file: there is no range, there are several, or the range is not valid.
    Whole,
    /// The bytes from the first to the last, both included.
    Part(u64, u64),
    /// Bytes beyond the end of the file.
    Beyond,
}

impl RequestedRange {
    /// Parses the range for a file of `len` bytes.
    pub(super) fn parse(range: Option<&str>, len: u64) -> Self {
        let spec = range.and_then(|text| text.trim().strip_prefix("bytes="));
        let Some((first, last)) = spec.and_then(|spec| spec.split_once('-')) else { return Self::Whole };
        match (number(first), number(last)) {
            (None, Some(0)) if first.is_empty() => Self::Beyond,
            (None, Some(count)) if first.is_empty() && len > 0 => Self::Part(len - count.min(len), len - 1),
            (Some(first), None) if last.is_empty() => Self::part(first, u64::MAX, len),
            (Some(first), Some(last)) if first <= last => Self::part(first, last, len),
            _ => Self::Whole,
        }
    }

    fn part(first: u64, last: u64, len: u64) -> Self {
        if first >= len { Self::Beyond } else { Self::Part(first, last.min(len - 1)) }
    }
}

/// A number of digits only; numbers above `u64::MAX` become `u64::MAX`.
fn number(text: &str) -> Option<u64> {
    let digits = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    digits.then(|| text.parse().unwrap_or(u64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_those_of_the_rfc() {
        for (range, expected) in [
            ("bytes=0-99", RequestedRange::Part(0, 99)),
            ("bytes=990-", RequestedRange::Part(990, 999)),
            ("bytes=-10", RequestedRange::Part(990, 999)),
            ("bytes=-5000", RequestedRange::Part(0, 999)),
            ("bytes=0-99999999999999999999999", RequestedRange::Part(0, 999)),
            ("bytes=-99999999999999999999999", RequestedRange::Part(0, 999)),
            ("bytes=1000-", RequestedRange::Beyond),
            ("bytes=99999999999999999999999-", RequestedRange::Beyond),
            ("bytes=-0", RequestedRange::Beyond),
            ("bytes=5-1", RequestedRange::Whole),
            ("bytes=0-0,5-9", RequestedRange::Whole),
            ("bytes=-", RequestedRange::Whole),
            ("bytes=+1-2", RequestedRange::Whole),
            ("bytes=abc", RequestedRange::Whole),
            ("items=0-5", RequestedRange::Whole),
        ] {
            assert_eq!(RequestedRange::parse(Some(range), 1000), expected, "{range}");
        }
        assert_eq!(RequestedRange::parse(None, 1000), RequestedRange::Whole);
        assert_eq!(RequestedRange::parse(Some("bytes=0-0"), 0), RequestedRange::Beyond);
    }
}
