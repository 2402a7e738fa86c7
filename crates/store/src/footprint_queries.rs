//! Queries of a reader for footprints. Onboard, every answer is compared with the proved footprints.

use super::footprint::Footprint;
use super::footprint_proof::FootprintProof;
use super::footprint_rows;
use super::reader::collect;
use super::window::{rounded_outward, windows_on_the_map};
use super::{Layer, Reader, StoreError};
use overfly_core::tile::{MercatorBounds, TILE_SIZE_PX, TileId};
use rusqlite::{OptionalExtension, Row};

impl Reader {
    /// Returns the footprints of one zoom whose exact bounds intersect `bounds` (x may run past the antimeridian), by row and
    /// column. Bounds that only touch do not intersect. The result is empty if a bound is not a number.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store is damaged.
    pub fn footprints_in(
        &self,
        layer: &Layer,
        zoom: u8,
        bounds: &MercatorBounds,
    ) -> Result<Vec<Footprint>, StoreError> {
        self.require_complete(layer)?;
        let sql = format!(
            "SELECT {} FROM rtree_footprints_geom r CROSS JOIN footprints f ON f.fid = r.id
             WHERE r.maxx >= ?1 AND r.minx <= ?2 AND r.maxy >= ?3 AND r.miny <= ?4 AND f.layer = ?5 AND f.zoom = ?6",
            footprint_rows::columns(self.format_version())
        );
        let mut found = Vec::new();
        for window in windows_on_the_map(bounds) {
            let filter = rounded_outward(&window);
            let parameters = (filter[0], filter[1], filter[2], filter[3], &layer.name, zoom);
            let rows = self.with(|c| collect(c, &sql, parameters))?;
            found.extend(rows.into_iter().filter(|f| f.tile.mercator_bounds().intersects(&window)));
        }
        found.sort_by_key(|f| f.tile);
        found.dedup_by_key(|f| f.tile);
        self.check_against_proof(layer, &found, |w| w.count_in(&layer.name, zoom, &windows_on_the_map(bounds)))?;
        Ok(found)
    }

    /// Returns every footprint of one zoom, by row and column.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store is damaged.
    pub fn footprints(&self, layer: &Layer, zoom: u8) -> Result<Vec<Footprint>, StoreError> {
        self.require_complete(layer)?;
        let sql = format!(
            "SELECT {} FROM footprints f WHERE f.layer = ?1 AND f.zoom = ?2 ORDER BY f.tile_row, f.tile_column",
            footprint_rows::columns(self.format_version())
        );
        let found = self.with(|c| collect(c, &sql, (&layer.name, zoom)))?;
        self.check_against_proof(layer, &found, |w| w.count_at(&layer.name, zoom))?;
        Ok(found)
    }

    /// Returns every footprint of a finished layer, by tile. The result is empty if there is no such layer.
    ///
    /// # Errors
    /// Where the store is damaged.
    pub fn all_footprints(&self, name: &str) -> Result<Vec<Footprint>, StoreError> {
        let Some(layer) = self.finished_layers().find(|l| l.name == name) else { return Ok(Vec::new()) };
        let mut all = Vec::new();
        for zoom in layer.min_zoom..=layer.base_zoom {
            all.extend(self.footprints(layer, zoom)?);
        }
        Ok(all)
    }

    /// Returns the footprint of a tile: `None` if the layer has no such tile.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store is damaged.
    pub fn footprint(&self, layer: &Layer, tile: TileId) -> Result<Option<Footprint>, StoreError> {
        self.require_complete(layer)?;
        let sql = format!(
            "SELECT {} FROM footprints f
             WHERE f.layer = ?1 AND f.zoom = ?2 AND f.tile_row = ?3 AND f.tile_column = ?4",
            footprint_rows::columns(self.format_version())
        );
        let key = (&layer.name, tile.zoom(), tile.row(), tile.column());
        let found = self.with(|c| c.prepare_cached(&sql)?.query_row(key, footprint_rows::read).optional())?;
        self.check_against_proof(layer, found.as_slice(), |w| usize::from(w.knows(&layer.name, tile)))?;
        Ok(found)
    }

    /// Returns the area of the ground of which a layer has pixels at its base level, true square metres.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store is damaged.
    pub fn imaged_area_m2(&self, layer: &Layer) -> Result<f64, StoreError> {
        self.require_complete(layer)?;
        let sql = "SELECT min(tile_column), tile_row, sum(valid_fraction) FROM footprints
                   WHERE layer = ?1 AND zoom = ?2 GROUP BY tile_row ORDER BY tile_row";
        let of_row = |row: &Row<'_>| Ok((row.get(0)?, row.get(1)?, row.get(2)?));
        let key = (&layer.name, layer.base_zoom);
        let rows: Vec<(u32, u32, f64)> =
            self.with(|c| c.prepare_cached(sql)?.query_map(key, of_row)?.collect::<rusqlite::Result<_>>())?;
        let tile_m2 = |column, row| {
            let gsd = TileId::new(layer.base_zoom, column, row).map(TileId::gsd);
            gsd.map_or(0.0, |gsd| gsd.east_m_per_px * gsd.north_m_per_px * f64::from(TILE_SIZE_PX).powi(2))
        };
        Ok(rows.iter().map(|(column, row, valid)| valid * tile_m2(*column, *row)).sum())
    }

    /// Compares the answer of an index with the proved footprints: it must be complete, and hold nothing else.
    fn check_against_proof(
        &self,
        layer: &Layer,
        found: &[Footprint],
        count: impl FnOnce(&FootprintProof) -> usize,
    ) -> Result<(), StoreError> {
        let Some(proof) = self.footprint_proof() else { return Ok(()) };
        if found.len() == count(proof) && found.iter().all(|f| proof.agrees(&layer.name, f)) {
            return Ok(());
        }
        // Where another program may write, the store may be another by now.
        if !self.is_onboard() {
            self.check_unchanged()?;
        }
        let reason = format!(
            "an index of layer {} does not give the footprints that were proved when the store was opened",
            layer.name
        );
        Err(StoreError::Damaged { path: self.path().into(), reason })
    }
}
