//! Describing a finished layer anew: description, licence, attribution, and the date of its sources, without the orthophotos.

use super::build_plan::{cover, tile_inputs};
use super::error::BuildError;
use super::request::check_date;
use overfly_core::tile::TileId;
use overfly_store::package::Date;
use overfly_store::{
    LayerChange, LayerChanged, LayerDescription, LayerState, Reader, Source, StatedDate, change_layer,
    preview_layer_change,
};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What a planner states of a layer. What is `None` stays as it is; an empty text takes away what is stated.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DescribeRequest {
    /// The store.
    pub db: PathBuf,
    /// The layer.
    pub layer: String,
    /// A text for people.
    pub description: Option<String>,
    /// Licence of the imagery.
    pub licence: Option<String>,
    /// Whom maps must name.
    pub attribution: Option<String>,
    /// Acquisition date of all sources of the layer.
    pub date: Option<String>,
    /// The day of the clock: a date of the future is refused. `None` refuses no date.
    pub today: Option<Date>,
}

impl DescribeRequest {
    /// Describes the layer, and returns what has changed.
    ///
    /// # Errors
    /// [`BuildError::Date`], [`BuildError::FutureDate`], [`BuildError::DateChangesCover`], or where the store cannot be changed.
    pub fn run(&self) -> Result<LayerChanged, BuildError> {
        Ok(change_layer(&self.db, &self.layer, &self.change()?)?)
    }

    /// Returns what [`DescribeRequest::run`] would change. Writes nothing.
    ///
    /// # Errors
    /// As [`DescribeRequest::run`].
    pub fn preview(&self) -> Result<LayerChanged, BuildError> {
        Ok(preview_layer_change(&self.db, &self.layer, &self.change()?)?)
    }

    fn change(&self) -> Result<LayerChange, BuildError> {
        Ok(LayerChange::Describe(LayerDescription {
            description: self.description.clone(),
            licence: self.licence.clone(),
            attribution: self.attribution.clone(),
            date: self.date.as_ref().map(|date| self.stated_date(date)).transpose()?,
        }))
    }

    /// The date, and what the tiles are made from with it, so that a later build keeps them.
    fn stated_date(&self, date: &str) -> Result<StatedDate, BuildError> {
        check_date(date, self.today)?;
        let reader = Reader::open(&self.db)?;
        let layer = reader.layer(&self.layer)?;
        let (base_zoom, heights) = (layer.base_zoom, layer.terrain.is_some());
        let state = LayerState::read(&self.db, &self.layer)?;
        let mut old = state.sources;
        old.sort_by(Source::covering_order);
        let mut new = old.clone();
        new.iter_mut().for_each(|source| source.acquired = Some(date.to_owned()));
        new.sort_by(Source::covering_order);
        let (old_cover, new_cover) = (cover(&old, base_zoom)?, cover(&new, base_zoom)?);
        if orders(&old, &old_cover) != orders(&new, &new_cover) {
            return Err(BuildError::DateChangesCover { layer: self.layer.clone() });
        }
        let (before, after) = (tile_inputs(&old, &old_cover, heights).0, tile_inputs(&new, &new_cover, heights).0);
        // A tile that a build would make anew is still made anew.
        let kept = state.inputs.into_iter().filter(|(tile, hash)| before.get(tile) == Some(hash));
        let inputs = kept.filter_map(|(tile, _)| Some((tile, *after.get(&tile)?))).collect();
        Ok(StatedDate { date: date.to_owned(), inputs })
    }
}

/// Which source covers which, by tile.
fn orders(sources: &[Source], cover: &BTreeMap<TileId, Vec<usize>>) -> Vec<Vec<[u8; 32]>> {
    cover.values().map(|order| order.iter().map(|&index| sources[index].content_hash).collect()).collect()
}
