//! Makes a store of any size, exported and sealed as for the aircraft: the drawn landscape of `tiles/` in its place,
//! surrounded by blocks of its tiles, every one mirrored, so that no frame of the landscape has a second place.
//!
//! ```sh
//! cargo run --release -p overfly-testkit --example big_store -- --gigabytes 10 --out big.gpkg --scratch /dev/shm
//! ```
//!
//! Pixels, descriptors, cells and overviews are the project's own, computed once for some hundred distinct tiles,
//! which stand under 130,000 names in a store of 10 GB. The same size gives the same store. `--scratch` needs as many
//! bytes again.

use anyhow::{Context, ensure};
use clap::Parser;
use overfly_core::feature::keypoint::{CONTRACT, describe};
use overfly_core::pixels::{Colour, Mask, MaskedColour};
use overfly_core::tile::{TILE_SIZE_PX, TileId};
use overfly_ingest::build::{self, KEYPOINTS_PER_TILE};
use overfly_ingest::export::{ExportRequest, export};
use overfly_ingest::plan::parse_routes;
use overfly_store::package::SecretKey;
use overfly_store::{BuiltTile, Declaration, EncodedTile, Layer, Reader, Source, StoredTile, TileContent, Writer};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Makes a large store.
#[derive(Parser)]
struct Args {
    /// Approximate size.
    #[arg(long, default_value_t = 10.0)]
    gigabytes: f64,
    /// The file to write.
    #[arg(long)]
    out: PathBuf,
    /// A folder for the store before it is exported; beside `--out` by default.
    #[arg(long)]
    scratch: Option<PathBuf>,
    /// Sign it with this key (`overfly keygen`).
    #[arg(long)]
    sign: Option<PathBuf>,
}

const LAYER: &str = "ortho";
/// Base tiles along a block's edge: a block is one tile three levels up.
const BLOCK: u32 = 8;
const LEVELS: u8 = 3;
/// Number of different blocks.
const BLOCKS: usize = 16;
const SIZE_PX: usize = TILE_SIZE_PX as usize;

/// A tile of a block: levels above the base, column and row within the block, and what it holds.
struct BlockTile {
    above: u8,
    column: u32,
    row: u32,
    content: TileContent,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let folder = match &args.scratch {
        Some(scratch) => tempfile::tempdir_in(scratch)?,
        None => {
            tempfile::tempdir_in(args.out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")))?
        }
    };
    let landscape = landscape(&folder.path().join("landscape.gpkg"))?;
    let blocks = blocks(&landscape)?;
    let whole = folder.path().join("whole.gpkg");
    let tiles = write(&whole, &landscape, &blocks, (args.gigabytes * 1e9) as u64)?;
    eprintln!("{tiles} tiles written; exporting");
    let store = Reader::open(&whole)?;
    let exported = export(&store, &everything(&store, args.sign.as_deref())?, &args.out, &|_, _| ())?;
    println!("{}: {} bytes, {tiles} tiles, digest {}", args.out.display(), exported.bytes, exported.digest);
    Ok(())
}

/// The store of the project's drawn landscape.
fn landscape(path: &Path) -> anyhow::Result<Reader> {
    let request = build::Request {
        db: path.into(),
        layer: LAYER.into(),
        horizontal_error_m: Some(0.0),
        sources: vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tiles/epoch_1")],
        threads: 2,
        ..build::Request::default()
    };
    build::run(&request, &mut |_| ControlFlow::Continue(()))?;
    Ok(Reader::open(path)?)
}

/// Blocks of mirrored tiles with their overviews.
fn blocks(landscape: &Reader) -> anyhow::Result<Vec<Vec<BlockTile>>> {
    let layer = landscape.layer(LAYER)?;
    let sources = landscape.sources(layer)?;
    let seen: Vec<&Source> = sources.iter().take(1).collect();
    let mut mirrored = Vec::new();
    for footprint in landscape.footprints(layer, layer.base_zoom)?.iter().filter(|f| f.valid_fraction == 1.0) {
        let pixels = landscape.tile(layer, footprint.tile)?.context("a tile that has a footprint")?;
        for quarters in 0..4 {
            let pixels = turned_mirror(&pixels, quarters);
            let keypoints = describe(&pixels.colour.to_gray(), &pixels.mask, KEYPOINTS_PER_TILE);
            mirrored.push((TileContent::encode(footprint.tile, &pixels, &seen, Some(&keypoints))?, pixels));
        }
    }
    ensure!(!mirrored.is_empty(), "no tile of the landscape is whole");
    let mut dice = ChaCha8Rng::seed_from_u64(1);
    (0..BLOCKS).map(|_| block(&mirrored, &seen, &mut dice)).collect()
}

fn block(
    mirrored: &[(TileContent, MaskedColour)],
    seen: &[&Source],
    dice: &mut ChaCha8Rng,
) -> anyhow::Result<Vec<BlockTile>> {
    let name = TileId::new(LEVELS, 0, 0)?;
    let mut placed = Vec::new();
    let mut level: Vec<MaskedColour> = Vec::new();
    for (row, column) in (0..BLOCK).flat_map(|r| (0..BLOCK).map(move |c| (r, c))) {
        let (content, pixels) = &mirrored[dice.random_range(0..mirrored.len())];
        placed.push(BlockTile { above: 0, column, row, content: content.clone() });
        level.push(pixels.clone());
    }
    for above in 1..=LEVELS {
        let side = BLOCK >> above;
        let below = std::mem::take(&mut level);
        let at = |column: u32, row: u32| &below[(row * side * 2 + column) as usize];
        for (row, column) in (0..side).flat_map(|r| (0..side).map(move |c| (r, c))) {
            let (x, y) = (2 * column, 2 * row);
            let pixels = halved([at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)]);
            placed.push(BlockTile { above, column, row, content: TileContent::encode(name, &pixels, seen, None)? });
            level.push(pixels);
        }
    }
    Ok(placed)
}

/// Mirrors a tile, then turns it by quarters.
fn turned_mirror(tile: &MaskedColour, quarters: usize) -> MaskedColour {
    let mut out = whole();
    let last = SIZE_PX - 1;
    for (x, y) in (0..SIZE_PX).flat_map(|y| (0..SIZE_PX).map(move |x| (x, y))) {
        let (u, v) = [(last - x, y), (y, x), (x, last - y), (last - y, last - x)][quarters];
        out.colour.set(x, y, tile.colour.at(u, v));
    }
    out
}

fn whole() -> MaskedColour {
    MaskedColour { colour: Colour::black(SIZE_PX, SIZE_PX), mask: Mask::filled(SIZE_PX, SIZE_PX, true) }
}

/// Makes one tile of four; each pixel is the mean of two by two.
fn halved(four: [&MaskedColour; 4]) -> MaskedColour {
    let mut out = whole();
    let half = SIZE_PX / 2;
    for (x, y) in (0..SIZE_PX).flat_map(|y| (0..SIZE_PX).map(move |x| (x, y))) {
        let from = &four[x / half + 2 * (y / half)].colour;
        let (u, v) = (x % half * 2, y % half * 2);
        let below = [(u, v), (u + 1, v), (u, v + 1), (u + 1, v + 1)].map(|(u, v)| from.at(u, v));
        let mean = |c: usize| ((below.iter().map(|rgb| u32::from(rgb[c])).sum::<u32>() + 2) / 4) as u8;
        out.colour.set(x, y, [mean(0), mean(1), mean(2)]);
    }
    out
}

/// Writes the landscape and blocks around it until the store has about `bytes` bytes; returns the number of tiles.
fn write(path: &Path, landscape: &Reader, blocks: &[Vec<BlockTile>], bytes: u64) -> anyhow::Result<u64> {
    let layer = landscape.layer(LAYER)?;
    let declaration = Declaration {
        layer: LAYER.into(),
        sources: landscape.sources(layer)?,
        zoom_override: None,
        base_zoom: layer.base_zoom,
        min_zoom: layer.base_zoom - LEVELS,
        terms: layer.terms.clone(),
        terrain: None,
    };
    let mut writer = Writer::begin(path, CONTRACT, declaration)?;
    let mut written = 0;
    let mut taken = BTreeSet::new();
    for zoom in layer.base_zoom - LEVELS..=layer.base_zoom {
        for footprint in landscape.footprints(layer, zoom)? {
            let tile = landscape.stored_tile(layer, footprint.tile)?.context("a tile that has a footprint")?;
            let up = zoom + LEVELS - layer.base_zoom;
            taken.insert((footprint.tile.column() >> up, footprint.tile.row() >> up));
            written += put(&mut writer, footprint.tile, content_of(tile)?)?;
        }
    }
    let mut dice = ChaCha8Rng::seed_from_u64(2);
    for (column, row) in spiral(middle(layer)?).filter(|place| !taken.contains(place)) {
        if written >= bytes {
            break;
        }
        for tile in &blocks[dice.random_range(0..blocks.len())] {
            let up = LEVELS - tile.above;
            let id = TileId::new(layer.base_zoom - tile.above, (column << up) + tile.column, (row << up) + tile.row)?;
            written += put(&mut writer, id, tile.content.clone())?;
        }
        writer.commit()?;
    }
    writer.finish(&|_| true)?.context("a store without tiles")
}

/// Puts a tile; returns about how many bytes it takes.
fn put(writer: &mut Writer, tile: TileId, content: TileContent) -> anyhow::Result<u64> {
    let descriptors = content.descriptors.as_ref().map_or(0, Vec::len);
    // 1,300 bytes for rows, indexes, and free space on the last page of each chain.
    let bytes = (content.image.bytes.len() + descriptors + content.cells.as_ref().map_or(0, Vec::len) + 1_300) as u64;
    writer.put(&BuiltTile { tile, inputs_hash: content.image.content_hash, content: Some(content) })?;
    Ok(bytes)
}

fn content_of(tile: StoredTile) -> anyhow::Result<TileContent> {
    let StoredTile { footprint, media_type, image, descriptors, cells } = tile;
    Ok(TileContent {
        image: EncodedTile { media_type, bytes: image, content_hash: footprint.content_hash },
        descriptors,
        cells: Some(cells.context("the landscape has cells")?),
        sources: footprint.sources,
        acquired: footprint.acquired,
        valid_fraction: footprint.valid_fraction,
        horizontal_error_m: footprint.horizontal_error_m,
        valid_outline: footprint.valid_outline,
        keypoints: footprint.keypoints,
        distinctiveness: footprint.distinctiveness,
    })
}

/// The block at the centre of a layer.
fn middle(layer: &Layer) -> anyhow::Result<(u32, u32)> {
    let tile = TileId::containing(layer.bounds_deg.middle()?, layer.base_zoom - LEVELS)?;
    Ok((tile.column(), tile.row()))
}

/// Blocks in rings around one block, which comes first.
fn spiral((column, row): (u32, u32)) -> impl Iterator<Item = (u32, u32)> {
    (0i64..).flat_map(move |ring| {
        let square = (-ring..=ring).flat_map(move |y| (-ring..=ring).map(move |x| (x, y)));
        square
            .filter(move |(x, y)| x.abs().max(y.abs()) == ring)
            .map(move |(x, y)| ((i64::from(column) + x) as u32, (i64::from(row) + y) as u32))
    })
}

/// A request to export a whole store: a short route at its centre, and a corridor as wide as the store.
fn everything(store: &Reader, key: Option<&Path>) -> anyhow::Result<ExportRequest> {
    let [west, south, east, north] = <[f64; 4]>::from(store.layer(LAYER)?.bounds_deg);
    let (middle, longitude) = ((south + north) / 2.0, (west + east) / 2.0);
    let line =
        serde_json::json!({"type": "LineString", "coordinates": [[longitude, middle], [longitude + 1e-3, middle]]});
    let routes = parse_routes(&line.to_string()).map_err(anyhow::Error::msg)?;
    let corridor_m = (north - south).max((east - west) * middle.to_radians().cos()) / 2.0 * 112_000.0;
    let key = key.map(SecretKey::read).transpose()?;
    Ok(ExportRequest { key, ..ExportRequest::along(routes, corridor_m) })
}
