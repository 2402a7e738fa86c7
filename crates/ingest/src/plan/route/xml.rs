//! Parsing the lines of a GPX (1.0, 1.1) or KML (2.2) text. Elements are known by their local names, whatever their namespace.

use super::position::position_at;
use overfly_core::geodesy::Geodetic;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// The deepest nesting of elements that is accepted.
const MAX_DEPTH: usize = 64;

/// The format, by the root element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Gpx,
    Kml,
}

/// Returns every line in order: each `rte` and each `trk` of GPX (its segments joined), and each `LineString` of KML.
///
/// # Errors
/// What is wrong with the text, for people.
pub(super) fn lines(text: &str) -> Result<Vec<Vec<Geodetic>>, String> {
    let mut reader = Reader::from_str(text);
    let (mut format, mut lines) = (None, Vec::<Vec<Geodetic>>::new());
    let mut open: Vec<String> = Vec::new();
    loop {
        let event = reader.read_event().map_err(|e| format!("at byte {}: {e}", reader.error_position()))?;
        match event {
            Event::Start(element) => {
                begin(&element, &mut format, &mut lines)?;
                if open.len() == MAX_DEPTH {
                    return Err(format!("elements within elements deeper than {MAX_DEPTH}"));
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
                    line.push(parse_tuple(index, tuple)?);
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

/// Handles the start of an element, which may begin a line or be a point of one.
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

fn parse_tuple(index: usize, tuple: &str) -> Result<Geodetic, String> {
    let mut parts = tuple.split(',');
    let (Some(longitude), Some(latitude)) = (parts.next(), parts.next()) else {
        return Err(format!("position {index}, {tuple:?}, is not longitude,latitude"));
    };
    at(index, latitude, longitude)
}

fn at(index: usize, latitude: &str, longitude: &str) -> Result<Geodetic, String> {
    let number = |text: &str| text.trim().parse().map_err(|_| format!("position {index}: {text:?} is not a number"));
    position_at(index, number(latitude)?, number(longitude)?)
}
