//! The lines of a GPX (1.0, 1.1) or KML (2.2) text. Elements by their local names, whatever their namespace.

use overfly_core::geodesy::Geodetic;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// No route stands deeper in its document.
const MOST_DEEP: usize = 64;

/// What the root element says the text is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Gpx,
    Kml,
}

/// Every line in order: of GPX each `rte` and each `trk` (its segments joined), of KML each `LineString`.
///
/// # Errors
/// What is wrong with it, for people.
pub(super) fn lines(text: &str) -> Result<Vec<Vec<Geodetic>>, String> {
    let mut reader = Reader::from_str(text);
    let (mut format, mut lines) = (None, Vec::<Vec<Geodetic>>::new());
    let mut open: Vec<String> = Vec::new();
    loop {
        let event = reader.read_event().map_err(|e| format!("at byte {}: {e}", reader.error_position()))?;
        match event {
            Event::Start(element) => {
                begin(&element, &mut format, &mut lines)?;
                if open.len() == MOST_DEEP {
                    return Err(format!("elements within elements deeper than {MOST_DEEP}"));
                }
                open.push(element.local_name().as_ref().to_owned());
            }
            Event::Empty(element) => begin(&element, &mut format, &mut lines)?,
            Event::End(_) => {
                open.pop();
            }
            Event::Text(text) if holds_coordinates(&open) && format == Some(Format::Kml) => {
                let line = lines.last_mut().ok_or("coordinates outside a LineString")?;
                for (index, tuple) in text.split_whitespace().enumerate() {
                    line.push(of_tuple(index, tuple)?);
                }
            }
            Event::Eof if !open.is_empty() => {
                return Err(format!("it ends within <{}>", open[open.len() - 1]));
            }
            Event::Eof => break,
            _ => {}
        }
    }
    if lines.is_empty() { Err("no line in it: GPX has rte or trk, KML LineString".into()) } else { Ok(lines) }
}

fn holds_coordinates(open: &[String]) -> bool {
    matches!(open, [.., line, last] if line == "LineString" && last == "coordinates")
}

/// An element begins: a line, or a point of one.
fn begin(element: &BytesStart<'_>, format: &mut Option<Format>, lines: &mut Vec<Vec<Geodetic>>) -> Result<(), String> {
    let name = element.local_name();
    match (*format, name.as_ref()) {
        (None, "gpx") => *format = Some(Format::Gpx),
        (None, "kml") => *format = Some(Format::Kml),
        (None, other) => return Err(format!("<{}> is neither GPX nor KML", other)),
        (Some(Format::Gpx), "rte" | "trk") | (Some(Format::Kml), "LineString") => lines.push(Vec::new()),
        (Some(Format::Gpx), "rtept" | "trkpt") => {
            let line = lines.last_mut().ok_or("a point outside rte and trk")?;
            let (latitude, longitude) = (attribute(element, "lat")?, attribute(element, "lon")?);
            line.push(at(line.len(), &latitude, &longitude)?);
        }
        _ => {}
    }
    Ok(())
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Result<String, String> {
    let found = element.try_get_attribute(name).map_err(|e| e.to_string())?;
    let value = found.ok_or_else(|| format!("a point has no {name}"))?;
    Ok(value.value.into_owned())
}

fn of_tuple(index: usize, tuple: &str) -> Result<Geodetic, String> {
    let mut parts = tuple.split(',');
    let (Some(longitude), Some(latitude)) = (parts.next(), parts.next()) else {
        return Err(format!("position {index}, {tuple:?}, is not longitude,latitude"));
    };
    at(index, latitude, longitude)
}

fn at(index: usize, latitude: &str, longitude: &str) -> Result<Geodetic, String> {
    let number = |text: &str| text.trim().parse().map_err(|_| format!("position {index}: {text:?} is no number"));
    Geodetic::from_degrees(number(latitude)?, number(longitude)?).map_err(|e| format!("position {index}: {e}"))
}
