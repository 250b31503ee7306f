//! A recording of a load path for Foxglove: one second of log time per load state.
//!
//! Channels, for every source that is recorded ("continuum", "atoms"):
//!
//! * `/SOURCE/gap`: `foxglove.Grid` of the gap, float32, at most 256 cells along a side (block means);
//! * `/SOURCE/cloud`: `foxglove.PointCloud` of atoms, x, y, z float32 and contact uint8;
//! * `/SOURCE/load`: the scalars of the state as JSON with a JSON Schema, so that they plot without a plug-in.
//!
//! Time stamps follow from the load index, not from a clock: equal runs give identical files.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{Grid, PackedElementField, PointCloud, Pose, Quaternion, Timestamp, Vector2, Vector3};
use foxglove::{Decode, Encode};
use mcap::records::{MessageHeader, Metadata};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::downsample::downsample;
use asperity_grid::error::{Error, Result};
use asperity_surface::files::atomic_file::AtomicFile;

/// Maximum number of cells along the longer side of a map: 256² float32 are 256 KiB per frame before compression.
pub const LONGEST_SIDE: usize = 256;
/// Coordinate frame of all grids and clouds; its origin is the corner of the cell.
pub const FRAME_ID: &str = "cell";

/// Metadata of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingInfo {
    pub name: String,
    /// Unit of all lengths recorded ("Å", "cell extent in x"); Foxglove itself shows metres.
    pub length_unit: String,
    /// Extents of the cell along x and y in that unit.
    pub cell: [f64; 2],
    /// Additional metadata: hash of the scene, versions.
    pub notes: BTreeMap<String, String>,
}

/// A gap map: row-major `[ny, nx]` over the whole cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapMap<'a> {
    pub nx: usize,
    pub gap: &'a [f64],
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudAtom {
    pub position: [f32; 3],
    pub contact: bool,
}

/// Scalars of one state. Lengths in the unit of the recording; absent where not available.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoadScalars {
    /// Mean pressure over E* times the rms gradient.
    pub p_star: f64,
    /// Contact fraction of the cell or of the surface atoms.
    pub contact_area: f64,
    /// Contact criterion.
    pub criterion: String,
    pub mean_gap: f64,
    pub patches: Option<usize>,
    pub energy: Option<f64>,
    pub residual: Option<f64>,
}

/// One load state of one source.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadState<'a> {
    /// "continuum" or "atoms": first element of the topic.
    pub source: &'a str,
    /// Index on the load path, which is the log time in seconds.
    pub index: u32,
    pub scalars: LoadScalars,
    pub gap: Option<GapMap<'a>>,
    pub atoms: &'a [CloudAtom],
}

/// Writer of a recording; the file appears under its name at [`Recorder::finish`].
pub struct Recorder {
    // Dropping the recorder before `finish` leaves no file.
    writer: mcap::Writer<AtomicFile>,
    scene: RecordingInfo,
    path: std::path::PathBuf,
    sequence: u32,
}

impl Recorder {
    pub fn create(path: &Path, scene: RecordingInfo) -> Result<Self> {
        let options = mcap::WriteOptions::new()
            .compression(Some(mcap::Compression::Zstd))
            .library(concat!("asperity ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(AtomicFile::open(path)?).map_err(|e| write_error(path, e))?;
        let mut metadata = scene.notes.clone();
        metadata.insert("scene".into(), scene.name.clone());
        metadata.insert("length_unit".into(), scene.length_unit.clone());
        metadata.insert("cell".into(), format!("{} {}", scene.cell[0], scene.cell[1]));
        metadata.insert("time".into(), "one second per load state".into());
        writer.write_metadata(&Metadata { name: "asperity".into(), metadata }).map_err(|e| write_error(path, e))?;
        Ok(Recorder { writer, scene, path: path.to_path_buf(), sequence: 0 })
    }

    /// Records the scalars and, where given, the gap map and the atoms.
    pub fn state(&mut self, state: &LoadState) -> Result<()> {
        let timestamp = Timestamp::new(state.index, 0);
        let schema = serde_json::to_vec(&schemars::schema_for!(LoadScalars)).map_err(|e| write_error(&self.path, e))?;
        let json = serde_json::to_vec(&state.scalars).map_err(|e| write_error(&self.path, e))?;
        self.message(state, "load", ("asperity.Load", "jsonschema", &schema), "json", &json)?;
        if let Some(map) = state.gap {
            if map.nx == 0 || map.gap.is_empty() || map.gap.len() % map.nx != 0 {
                let found = format!("a gap map of {} values in rows of {}", map.gap.len(), map.nx);
                return Err(Error::format(&self.path, found, "whole rows"));
            }
            self.foxglove(state, "gap", &self.grid(map, timestamp))?;
        }
        if !state.atoms.is_empty() {
            self.foxglove(state, "cloud", &cloud(state.atoms, timestamp))?;
        }
        Ok(())
    }

    /// Writes index and summary, and commits the file.
    pub fn finish(mut self) -> Result<()> {
        self.writer.finish().map_err(|e| write_error(&self.path, e))?;
        self.writer.into_inner().commit()
    }

    fn grid(&self, map: GapMap, timestamp: Timestamp) -> Grid {
        let ny = map.gap.len() / map.nx;
        let small = downsample(map.nx, map.gap, LONGEST_SIDE);
        let cell_size = Vector2 {
            x: self.scene.cell[0] * small.factor as f64 / map.nx as f64,
            y: self.scene.cell[1] * small.factor as f64 / ny as f64,
        };
        Grid {
            timestamp: Some(timestamp),
            frame_id: FRAME_ID.into(),
            pose: Some(origin()),
            column_count: small.nx as u32,
            cell_size: Some(cell_size),
            row_stride: 4 * small.nx as u32,
            cell_stride: 4,
            fields: vec![field("gap", 0, NumericType::Float32)],
            data: small.values.iter().flat_map(|&g| (g as f32).to_le_bytes()).collect::<Vec<u8>>().into(),
        }
    }

    fn foxglove<M: Encode + Decode>(&mut self, state: &LoadState, description: &str, message: &M) -> Result<()> {
        let schema = M::get_schema().ok_or_else(|| write_error(&self.path, format!("no schema for {description}")))?;
        let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or(0));
        message.encode(&mut bytes).map_err(|e| write_error(&self.path, e.to_string()))?;
        let encoding = M::get_message_encoding();
        self.message(state, description, (&schema.name, &schema.encoding, &schema.data), &encoding, &bytes)
    }

    /// The writer stores each schema and channel only once.
    fn message(
        &mut self,
        state: &LoadState,
        what: &str,
        schema: (&str, &str, &[u8]),
        encoding: &str,
        bytes: &[u8],
    ) -> Result<()> {
        let topic = format!("/{}/{what}", state.source);
        let time = u64::from(state.index) * 1_000_000_000;
        self.sequence += 1;
        let writer = &mut self.writer;
        let written = writer.add_schema(schema.0, schema.1, schema.2).and_then(|schema_id| {
            let channel_id = writer.add_channel(schema_id, &topic, encoding, &BTreeMap::new())?;
            let header = MessageHeader { channel_id, sequence: self.sequence, log_time: time, publish_time: time };
            writer.write_to_known_channel(&header, bytes)
        });
        written.map_err(|e| write_error(&self.path, e))
    }
}

fn cloud(atoms: &[CloudAtom], timestamp: Timestamp) -> PointCloud {
    const STRIDE: usize = 13;
    let mut data = Vec::with_capacity(STRIDE * atoms.len());
    for atom in atoms {
        atom.position.iter().for_each(|c| data.extend_from_slice(&c.to_le_bytes()));
        data.push(u8::from(atom.contact));
    }
    let fields = vec![
        field("x", 0, NumericType::Float32),
        field("y", 4, NumericType::Float32),
        field("z", 8, NumericType::Float32),
        field("contact", 12, NumericType::Uint8),
    ];
    PointCloud {
        timestamp: Some(timestamp),
        frame_id: FRAME_ID.into(),
        pose: Some(origin()),
        point_stride: STRIDE as u32,
        fields,
        data: data.into(),
    }
}

fn field(name: &str, offset: u32, kind: NumericType) -> PackedElementField {
    PackedElementField { name: name.into(), offset, r#type: kind.into() }
}

fn origin() -> Pose {
    Pose {
        position: Some(Vector3 { x: 0.0, y: 0.0, z: 0.0 }),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    }
}

fn write_error(path: &Path, e: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
    let e = e.into();
    // The kind distinguishes a full disk from other failures.
    let kind = match e.downcast_ref() {
        Some(mcap::McapError::Io(e)) => e.kind(),
        _ => io::ErrorKind::Other,
    };
    Error::io("write", path)(io::Error::new(kind, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(path: &Path) {
        let notes = BTreeMap::from([("seed".to_string(), "1".to_string())]);
        let scene = RecordingInfo { name: "two loads".into(), length_unit: "Å".into(), cell: [100.0, 50.0], notes };
        let mut recorder = Recorder::create(path, scene).unwrap();
        let gap: Vec<f64> = (0..512 * 256).map(|i| f64::from(i % 512)).collect();
        let atoms: Vec<CloudAtom> =
            (0..10).map(|i| CloudAtom { position: [i as f32, 0.5, -1.25], contact: i % 2 == 1 }).collect();
        for index in 0..2 {
            for source in ["continuum", "atoms"] {
                let scalars = LoadScalars { p_star: 0.01 * f64::from(index + 1), ..LoadScalars::default() };
                let continuum = source == "continuum";
                recorder
                    .state(&LoadState {
                        source,
                        index,
                        scalars,
                        gap: continuum.then_some(GapMap { nx: 512, gap: &gap }),
                        atoms: if continuum { &[] } else { &atoms },
                    })
                    .unwrap();
            }
        }
        recorder.finish().unwrap();
    }

    #[test]
    fn a_recording_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        record(&path);
        let bytes = std::fs::read(&path).unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let mut topics: Vec<(&str, &str)> = summary
            .channels
            .values()
            .map(|c| (c.topic.as_str(), c.schema.as_ref().map_or("", |s| s.name.as_str())))
            .collect();
        topics.sort();
        let expected = [
            ("/atoms/cloud", "foxglove.PointCloud"),
            ("/atoms/load", "asperity.Load"),
            ("/continuum/gap", "foxglove.Grid"),
            ("/continuum/load", "asperity.Load"),
        ];
        assert_eq!(topics, expected);
        assert_eq!(summary.schemas.len(), 3);
        assert!(summary.chunk_indexes.iter().all(|c| c.compression == "zstd"));
        let metadata = mcap::read::metadata(&bytes, &summary.metadata_indexes[0]).unwrap();
        assert_eq!(metadata.metadata["scene"], "two loads");
        assert_eq!(metadata.metadata["seed"], "1");

        let mut seen = 0;
        for message in mcap::MessageStream::new(&bytes).unwrap().map(|m| m.unwrap()) {
            seen += 1;
            assert!([0, 1_000_000_000].contains(&message.log_time));
            match message.channel.topic.as_str() {
                "/continuum/gap" => {
                    let grid = Grid::decode(&message.data[..]).unwrap();
                    assert_eq!((grid.column_count, grid.row_stride, grid.frame_id.as_str()), (256, 1024, "cell"));
                    assert_eq!(grid.data.len(), 256 * 128 * 4);
                    assert_eq!(f32::from_le_bytes(grid.data[12..16].try_into().unwrap()), 6.5);
                    assert_eq!(grid.cell_size.unwrap(), Vector2 { x: 200.0 / 512.0, y: 100.0 / 256.0 });
                }
                "/atoms/cloud" => {
                    let cloud = PointCloud::decode(&message.data[..]).unwrap();
                    assert_eq!(cloud.data.len(), 130);
                    assert_eq!(f32::from_le_bytes(cloud.data[34..38].try_into().unwrap()), -1.25);
                    assert_eq!(cloud.data[25], 1);
                }
                _ => {
                    let load: LoadScalars = serde_json::from_slice(&message.data).unwrap();
                    assert_eq!(load.p_star, if message.log_time == 0 { 0.01 } else { 0.02 });
                }
            }
        }
        assert_eq!(seen, 8);
    }

    #[test]
    fn a_full_disk_is_distinguished_from_other_failures() {
        let full = mcap::McapError::Io(io::ErrorKind::StorageFull.into());
        assert_eq!(write_error(Path::new("run.mcap"), full).exit_code(), 5);
        assert_eq!(write_error(Path::new("run.mcap"), "no schema").exit_code(), 2);
    }

    #[test]
    fn the_same_run_writes_the_same_bytes_and_an_abandoned_one_none() {
        let folder = tempfile::tempdir().unwrap();
        let paths = ["a.mcap", "b.mcap"].map(|n| folder.path().join(n));
        paths.iter().for_each(|p| record(p));
        assert_eq!(std::fs::read(&paths[0]).unwrap(), std::fs::read(&paths[1]).unwrap());
        let scene =
            RecordingInfo { name: String::new(), length_unit: "Å".into(), cell: [1.0; 2], notes: BTreeMap::new() };
        drop(Recorder::create(&folder.path().join("c.mcap"), scene).unwrap());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
