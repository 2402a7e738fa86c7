//! Acquisition dates, as files state them.

use super::gdal_metadata::{metadata_xml, parse_items};
use jiff::civil::Date;
use tiff_reader::{Ifd, TagValue, TiffFile};

const TAG_DATE_TIME: u16 = 306;
const TAG_EXIF: u16 = 34665;
const TAG_DATE_TIME_ORIGINAL: u16 = 36867;
const GDAL_METADATA: &[&str] = &[
    "ACQUISITION_DATE",
    "ACQUISITIONDATE",
    "ACQUISITIONDATETIME",
    "ACQUISITION_DATETIME",
    "DATE_ACQUIRED",
    "TIFFTAG_DATETIME",
];

/// Returns the date of a TIFF as YYYY-MM-DD: GDAL's metadata item, else EXIF's original time, else the DateTime tag.
pub(super) fn tiff_date(file: &TiffFile, image: &Ifd) -> Option<String> {
    let exif = || {
        let offset = image.tag(TAG_EXIF)?.value.as_u64()?;
        ascii_tag(&file.read_ifd_at_offset(offset).ok()?, TAG_DATE_TIME_ORIGINAL).and_then(iso_date)
    };
    gdal_date(metadata_xml(image)).or_else(exif).or_else(|| ascii_tag(image, TAG_DATE_TIME).and_then(iso_date))
}

/// Returns the date of an EXIF block, which is a TIFF itself.
pub(super) fn exif_date(bytes: Vec<u8>) -> Option<String> {
    let file = TiffFile::from_bytes(bytes).ok()?;
    tiff_date(&file, file.ifds().first()?)
}

fn gdal_date(xml: &str) -> Option<String> {
    let items = parse_items(xml);
    GDAL_METADATA.iter().find_map(|name| {
        items.iter().filter(|item| item.name.eq_ignore_ascii_case(name)).find_map(|item| iso_date(&item.text))
    })
}

fn ascii_tag(ifd: &Ifd, tag: u16) -> Option<&str> {
    match &ifd.tag(tag)?.value {
        TagValue::Ascii(text) => Some(text),
        _ => None,
    }
}

/// Returns `2018:07:16 12:00:00`, `2018-07-16T12:00:00Z`, `20180716` or `2018/07/16` as 2018-07-16; `None` for a text that
/// is not a date, or a year outside 1850 to 2200.
fn iso_date(text: &str) -> Option<String> {
    let digits: String = text.trim().chars().take(10).filter(char::is_ascii_digit).take(8).collect();
    let part = |range: std::ops::Range<usize>| digits.get(range)?.parse::<i16>().ok();
    let (year, month, day) = (part(0..4)?, part(4..6)?, part(6..8)?);
    let date = Date::new(year, month as i8, day as i8).ok()?;
    (1850..=2200).contains(&year).then(|| date.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_dates_that_files_state() {
        for (text, date) in [
            ("2018:07:16 12:00:00", Some("2018-07-16")),
            ("2018-07-16T12:00:00Z", Some("2018-07-16")),
            ("20180716", Some("2018-07-16")),
            ("2018071", None),
            ("2020/02/29", Some("2020-02-29")),
            ("2019-02-29", None),
            ("1849-12-31", None),
            ("0000:00:00 00:00:00", None),
            ("2018:13:01", None),
            ("last summer", None),
            ("", None),
        ] {
            assert_eq!(iso_date(text).as_deref(), date, "{text}");
        }
    }

    #[test]
    fn finds_the_item_of_gdals_metadata() {
        let xml = "<GDALMetadata>\n<Item name=\"OTHER\">1</Item>\n<Item name=\"ACQUISITIONDATE\">2018-07-16</Item></GDALMetadata>";
        assert_eq!(gdal_date(xml).as_deref(), Some("2018-07-16"));
        assert_eq!(gdal_date("<Item name="), None);
    }
}
