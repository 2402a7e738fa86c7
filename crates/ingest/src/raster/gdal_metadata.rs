//! GDAL's metadata in a TIFF: the items of the XML in tag 42112.

use tiff_reader::{Ifd, TagValue};

const TAG_GDAL_METADATA: u16 = 42112;

/// One `<Item name="NAME" sample="0" role="ROLE">text</Item>`.
#[derive(Debug, PartialEq)]
pub(super) struct Item<'a> {
    pub name: &'a str,
    pub sample: Option<usize>,
    pub text: &'a str,
}

/// The XML of an image; empty where it has none.
pub(super) fn xml_of(image: &Ifd) -> &str {
    match image.tag(TAG_GDAL_METADATA).map(|t| &t.value) {
        Some(TagValue::Ascii(text)) => text,
        _ => "",
    }
}

/// The items in order. Text that is not such an item is passed over.
pub(super) fn items(xml: &str) -> impl Iterator<Item = Item<'_>> {
    xml.split("<Item ").skip(1).filter_map(|item| {
        let (attributes, rest) = item.split_once('>')?;
        let attribute = |key: &str| {
            let after = attributes.split_once(key)?.1;
            after.strip_prefix("=\"")?.split_once('"').map(|(value, _)| value)
        };
        let sample = attribute("sample").and_then(|s| s.parse().ok());
        Some(Item { name: attribute("name")?, sample, text: rest.split('<').next()?.trim() })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_items_and_passes_over_the_rest() {
        let xml = "<GDALMetadata>\n <Item name=\"A\">1</Item>\n <Item name=\"COLORINTERP\" sample=\"3\" role=\"colorinterp\">Undefined</Item>\n <Item broken </GDALMetadata>";
        let found: Vec<_> = items(xml).collect();
        assert_eq!(found[0], Item { name: "A", sample: None, text: "1" });
        assert_eq!(found[1], Item { name: "COLORINTERP", sample: Some(3), text: "Undefined" });
        assert_eq!(found.len(), 2);
        assert_eq!(items("<Item name=").count(), 0);
    }
}
