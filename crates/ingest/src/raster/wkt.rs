//! The EPSG code that a well-known text names. Its parameters are not read: readers of WKT parameters disagree silently, so
//! the caller refuses a text without a code.

/// Returns the code of the outermost `AUTHORITY["EPSG","n"]` or `ID["EPSG",n]`, or of a name that ESRI and OGC write for UTM,
/// Web Mercator and WGS 84.
pub(super) fn epsg_from_wkt(text: &str) -> Option<u32> {
    let text = text.trim();
    if text.starts_with("COMPD_CS[") || text.starts_with("COMPOUNDCRS[") {
        return None;
    }
    outermost_code(text).or_else(|| code_from_name(text.split('"').nth(1)?, text))
}

/// Returns the code at the first level of brackets. Codes of the ellipsoid, the unit and the base CRS are nested deeper.
fn outermost_code(text: &str) -> Option<u32> {
    let mut depth = 0;
    let mut quoted = false;
    for (i, c) in text.char_indices() {
        match c {
            '"' => quoted = !quoted,
            '[' | '(' if !quoted => depth += 1,
            ']' | ')' if !quoted => depth -= 1,
            'A' | 'I' if !quoted && depth == 1 => {
                let rest = &text[i..];
                let inside = ["AUTHORITY[\"EPSG\",", "ID[\"EPSG\","].iter().find_map(|start| rest.strip_prefix(start));
                if let Some(inside) = inside {
                    let digits = inside.trim_start_matches(['"', ' ']);
                    return digits.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok();
                }
            }
            _ => {}
        }
    }
    None
}

fn code_from_name(name: &str, text: &str) -> Option<u32> {
    let name = name.replace(' ', "_").replace("_/_", "_");
    match (text.split('[').next()?, name.as_str()) {
        ("GEOGCS" | "GEOGCRS", "GCS_WGS_1984" | "WGS_84") => return Some(4326),
        ("PROJCS" | "PROJCRS", "WGS_1984_Web_Mercator_Auxiliary_Sphere" | "WGS_84_Pseudo-Mercator") => {
            return Some(3857);
        }
        _ => {}
    }
    for (start, north, south) in [
        ("WGS_1984_UTM_Zone_", 32600, Some(32700)),
        ("WGS_84_UTM_zone_", 32600, Some(32700)),
        ("NAD_1983_UTM_Zone_", 26900, None),
        ("NAD83_UTM_zone_", 26900, None),
        ("ETRS_1989_UTM_Zone_", 25800, None),
        ("ETRS89_UTM_zone_", 25800, None),
    ] {
        let Some(zone) = name.strip_prefix(start) else { continue };
        let on = |hemisphere| {
            let number = zone.strip_suffix(hemisphere)?.parse().ok();
            number.filter(|n| (1..=60).contains(n))
        };
        return on('N').map(|n: u32| north + n).or_else(|| Some(south? + on('S')?));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_outermost_code_alone() {
        let utm = r#"PROJCS["a (b]",GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]],UNIT["metre",1,AUTHORITY["EPSG","9001"]],AUTHORITY["EPSG","32614"]]"#;
        assert_eq!(epsg_from_wkt(utm), Some(32614));
        assert_eq!(epsg_from_wkt(r#"PROJCRS["x",BASEGEOGCRS["y",ID["EPSG",4269]],ID["EPSG",26914]]"#), Some(26914));
        assert_eq!(epsg_from_wkt(r#"PROJCS["Own",GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]]]"#), None);
        assert_eq!(epsg_from_wkt(r#"COMPD_CS["x",PROJCS["y"],AUTHORITY["EPSG","5555"]]"#), None);
    }

    #[test]
    fn knows_the_common_names() {
        for (name, code) in [
            ("WGS_1984_UTM_Zone_14N", Some(32614)),
            ("WGS_1984_UTM_Zone_33S", Some(32733)),
            ("NAD_1983_UTM_Zone_14N", Some(26914)),
            ("ETRS89 / UTM zone 32N", Some(25832)),
            ("WGS_1984_Web_Mercator_Auxiliary_Sphere", Some(3857)),
            ("NAD_1983_UTM_Zone_99N", None),
            ("NAD_1927_UTM_Zone_14N", None),
            ("WGS 84 / UTM zone 14\u{fffd}", None),
        ] {
            assert_eq!(epsg_from_wkt(&format!("PROJCS[\"{name}\",GEOGCS[\"g\"]]")), code, "{name}");
        }
        assert_eq!(epsg_from_wkt("GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\"]]"), Some(4326));
        assert_eq!(epsg_from_wkt("nonsense"), None);
        assert_eq!(epsg_from_wkt(""), None);
    }
}
