//! Size reduction: what an export drops, and in which order, where it must be small.

use overfly_core::tile::{TileId, gsd_at};
use overfly_store::package::Dropped;
use overfly_store::{Layer, LayerPart};

/// JPEG qualities with which imagery is encoded again (it is stored with 90), and how many of a hundred fixes over synthetic
/// ground of another season are lost (docs/onboard.md).
const QUALITIES: [(u8, u32); 2] = [(60, 5), (40, 10)];

/// Returns the effect of a JPEG quality that the user states, for the manifest.
pub fn stated_quality(quality: u8) -> Dropped {
    let what = format!("imagery's quality: JPEG {quality} instead of 90, as asked");
    let effect = "fixes on ground that has changed are fewer and less exact; docs/onboard.md has figures";
    Dropped { what, effect: effect.into() }
}

/// Applies the next step of size reduction to the parts and returns its effect; `None` where no step is left.
///
/// The order is: the keypoint descriptors, which no fix uses; whole layers, the oldest first (those of unknown date before all
/// others), down to one; the finest level of that layer, repeatedly, down to one level; the quality of its imagery, which
/// costs more fixes and saves less than a level. The terrain stays: it is small.
pub fn reduce_size(parts: &mut Vec<LayerPart>, layers: &[Layer]) -> Option<Dropped> {
    let is_imagery = |part: &LayerPart| !is_terrain(part, layers);
    if parts.iter().any(|p| p.with_descriptors) {
        parts.iter_mut().for_each(|p| p.with_descriptors = false);
        let effect = "none on fixes; /descriptors of a tile answers 404, and content hashes differ from the source's";
        return Some(Dropped { what: "keypoint descriptors".into(), effect: effect.into() });
    }
    if parts.iter().filter(|part| is_imagery(part)).count() > 1 {
        return drop_oldest_layer(parts, layers);
    }
    let part = parts.iter_mut().find(|part| is_imagery(part))?;
    if part.base_zoom > part.min_zoom { Some(drop_finest_level(part)) } else { lower_quality(part) }
}

fn is_terrain(part: &LayerPart, layers: &[Layer]) -> bool {
    layers.iter().any(|layer| layer.name == part.name && layer.terrain.is_some())
}

fn drop_finest_level(part: &mut LayerPart) -> Dropped {
    let middle = part.tiles.iter().filter(|t| t.zoom() == part.base_zoom).nth(part.tiles.len() / 4);
    let place = middle.or(part.tiles.last()).map(|t| t.centre());
    let gsd = |zoom: u8| place.map_or(0.0, |at| gsd_at(at, zoom).mean_m_per_px());
    let dropped = Dropped {
        what: format!("level {} of layer {}", part.base_zoom, part.name),
        effect: format!(
            "the map's pixels are {:.2} m instead of {:.2} m: errors of fixes grow about as much, and a frame that shows less than {:.0} m across (46 pixels) is not found",
            gsd(part.base_zoom - 1),
            gsd(part.base_zoom),
            46.0 * gsd(part.base_zoom - 1)
        ),
    };
    part.base_zoom -= 1;
    let finest = part.base_zoom;
    part.tiles.retain(|t: &TileId| t.zoom() <= finest);
    dropped
}

fn lower_quality(part: &mut LayerPart) -> Option<Dropped> {
    let (quality, lost) = QUALITIES.into_iter().find(|(lower, _)| part.jpeg_quality.is_none_or(|q| q > *lower))?;
    part.jpeg_quality = Some(quality);
    let what = format!("imagery's quality: JPEG {quality} instead of 90");
    let effect = format!(
        "about {lost} in 100 fixes on ground that has changed are not had, and errors are a tenth larger; tiles with missing pixels stay as they are"
    );
    Some(Dropped { what, effect })
}

fn drop_oldest_layer(parts: &mut Vec<LayerPart>, layers: &[Layer]) -> Option<Dropped> {
    let newest = |p: &LayerPart| {
        let layer = layers.iter().find(|l| l.name == p.name);
        layer.and_then(|l| l.acquired.as_ref()).map(|(_, last)| last.clone())
    };
    let imagery = (0..parts.len()).filter(|&i| !is_terrain(&parts[i], layers));
    let oldest = imagery.min_by_key(|&i| (newest(&parts[i]), parts[i].name.clone()))?;
    let date = newest(&parts[oldest]).map_or("unknown date".into(), |d| format!("imagery up to {d}"));
    let part = parts.remove(oldest);
    Some(Dropped {
        what: format!("layer {} ({date})", part.name),
        effect: "none on fixes over the other layers; ground that only this epoch still resembles is not recognised"
            .into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(name: &str, acquired: Option<&str>) -> Layer {
        Layer {
            name: name.into(),
            base_zoom: 14,
            min_zoom: 13,
            base_tiles: 1,
            tiles: 2,
            bounds_deg: [0.0; 4].into(),
            acquired: acquired.map(|d| (d.into(), d.into())),
            complete: true,
            digest: None,
            terms: Default::default(),
            terrain: None,
        }
    }

    #[test]
    fn drops_in_the_stated_order_until_nothing_is_left() {
        let layers = [layer("a", Some("2018-07-16")), layer("b", Some("2010-01-01")), layer("c", None)];
        let tiles = vec![TileId::new(13, 4, 4).unwrap(), TileId::new(14, 8, 8).unwrap()];
        let part = |l: &Layer| LayerPart {
            name: l.name.clone(),
            base_zoom: 14,
            min_zoom: 13,
            tiles: tiles.clone(),
            with_descriptors: true,
            jpeg_quality: None,
        };
        let mut parts: Vec<_> = layers.iter().map(part).collect();
        let dropped: Vec<String> = std::iter::from_fn(|| reduce_size(&mut parts, &layers)).map(|d| d.what).collect();
        let expected = [
            "keypoint descriptors",
            "layer c (unknown date)",
            "layer b (imagery up to 2010-01-01)",
            "level 14 of layer a",
            "imagery's quality: JPEG 60 instead of 90",
            "imagery's quality: JPEG 40 instead of 90",
        ];
        assert_eq!(dropped, expected);
        assert_eq!((parts.len(), parts[0].base_zoom, parts[0].tiles.len()), (1, 13, 1));
    }
}
