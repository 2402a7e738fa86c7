//! Acquisition dates, as files state them.

use super::gdal_metadata::{items, xml_of};
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

/// A TIFF's: GDAL's metadata item, EXIF's original time, the DateTime tag, in this order.
pub(super) fn of_tiff(file: &TiffFile, image: &Ifd) -> Option<String> {
    let gdal = of_gdal_metadata(xml_of(image));
    let exif = || {
        let offset = image.tag(TAG_EXIF)?.value.as_u64()?;
        text_of(&file.read_ifd_at_offset(offset).ok()?, TAG_DATE_TIME_ORIGINAL).and_then(|t| iso_date(&t))
    };
    gdal.or_else(exif).or_else(|| text_of(image, TAG_DATE_TIME).and_then(|t| iso_date(&t)))
}

/// Of an EXIF block, which is a TIFF of its own.
pub(super) fn of_exif(bytes: Vec<u8>) -> Option<String> {
    let file = TiffFile::from_bytes(bytes).ok()?;
    of_tiff(&file, file.ifds().first()?)
}

fn of_gdal_metadata(xml: &str) -> Option<String> {
    GDAL_METADATA.iter().find_map(|name| {
        items(xml).filter(|item| item.name.eq_ignore_ascii_case(name)).find_map(|item| iso_date(item.text))
    })
}

fn text_of(ifd: &Ifd, tag: u16) -> Option<String> {
    match &ifd.tag(tag)?.value {
        TagValue::Ascii(text) => Some(text.clone()),
        _ => None,
    }
}

/// `2018:07:16 12:00:00`, `2018-07-16T12:00:00Z`, `20180716`, `2018/07/16` as 2018-07-16; `None` for what is no date.
fn iso_date(text: &str) -> Option<String> {
    let digits: String = text.trim().chars().take(10).filter(char::is_ascii_digit).take(8).collect();
    if digits.len() != 8 {
        return None;
    }
    let (year, month, day): (u32, u32, u32) =
        (digits[..4].parse().ok()?, digits[4..6].parse().ok()?, digits[6..].parse().ok()?);
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = match month {
        2 => 28 + u32::from(leap),
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => 0,
    };
    ((1850..=2200).contains(&year) && (1..=days).contains(&day)).then(|| format!("{year:04}-{month:02}-{day:02}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_dates_that_files_write() {
        for (text, date) in [
            ("2018:07:16 12:00:00", Some("2018-07-16")),
            ("2018-07-16T12:00:00Z", Some("2018-07-16")),
            ("20180716", Some("2018-07-16")),
            ("2020/02/29", Some("2020-02-29")),
            ("2019-02-29", None),
            ("0000:00:00 00:00:00", None),
            ("2018:13:01", None),
            ("last summer", None),
            ("", None),
        ] {
            assert_eq!(iso_date(text).as_deref(), date, "{text}");
        }
    }

    #[test]
    fn finds_gdals_item() {
        let xml = "<GDALMetadata>\n<Item name=\"OTHER\">1</Item>\n<Item name=\"ACQUISITIONDATE\">2018-07-16</Item></GDALMetadata>";
        assert_eq!(of_gdal_metadata(xml).as_deref(), Some("2018-07-16"));
        assert_eq!(of_gdal_metadata("<Item name="), None);
    }
}
