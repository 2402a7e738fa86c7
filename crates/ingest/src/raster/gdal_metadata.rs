//! GDAL's metadata in a TIFF: the items of the XML in tag 42112.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use tiff_reader::{Ifd, TagValue};

const TAG_GDAL_METADATA: u16 = 42112;

/// One `<Item name="NAME" sample="0" role="ROLE">text</Item>`.
#[derive(Debug, PartialEq)]
pub(super) struct MetadataItem {
    pub name: String,
    pub sample: Option<usize>,
    pub text: String,
}

/// Returns the XML of an image; empty where it has none.
pub(super) fn metadata_xml(image: &Ifd) -> &str {
    match image.tag(TAG_GDAL_METADATA).map(|t| &t.value) {
        Some(TagValue::Ascii(text)) => text,
        _ => "",
    }
}

/// Returns the items in order. Other elements are skipped, and parsing ends without an error where the XML is malformed.
pub(super) fn parse_items(xml: &str) -> Vec<MetadataItem> {
    let mut reader = Reader::from_str(xml);
    let mut items = Vec::new();
    let mut open: Option<MetadataItem> = None;
    loop {
        match reader.read_event() {
            Ok(Event::Start(element)) => open = parse_attributes(&element),
            Ok(Event::Text(text)) => {
                if let Some(item) = &mut open {
                    item.text.push_str(&text);
                }
            }
            Ok(Event::End(_)) => items.extend(open.take().map(trimmed)),
            Ok(Event::Eof) | Err(_) => return items,
            Ok(_) => {}
        }
    }
}

/// Returns an item without its text; `None` for another element, and for an item without a name.
fn parse_attributes(element: &BytesStart<'_>) -> Option<MetadataItem> {
    if element.name().as_ref() != "Item" {
        return None;
    }
    let attribute = |key: &str| element.try_get_attribute(key).ok().flatten().map(|a| a.value.into_owned());
    let sample = attribute("sample").and_then(|s| s.parse().ok());
    Some(MetadataItem { name: attribute("name")?, sample, text: String::new() })
}

fn trimmed(item: MetadataItem) -> MetadataItem {
    MetadataItem { text: item.text.trim().to_owned(), ..item }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(name: &str, sample: Option<usize>, text: &str) -> MetadataItem {
        MetadataItem { name: name.into(), sample, text: text.into() }
    }

    #[test]
    fn reads_items_and_skips_the_rest() {
        let xml = "<GDALMetadata>\n <Item name=\"A\"> 1\n</Item>\n <Other name=\"B\">2</Other><Item>3</Item>\n <Item name=\"COLORINTERP\" sample=\"3\" role=\"colorinterp\">Undefined</Item>\n <Item broken </GDALMetadata>";
        assert_eq!(parse_items(xml), [item("A", None, "1"), item("COLORINTERP", Some(3), "Undefined")]);
        assert_eq!(parse_items("<Item name="), []);
        assert_eq!(parse_items(""), []);
    }
}
