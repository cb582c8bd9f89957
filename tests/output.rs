//! Image files: what is written is read back, what is hostile is refused, what was there is not lost.

use restir::Error;
use restir::output::{
    ExrPicture, Image, check_writable, decode_exr, encode_exr, encode_png, read_exr, write_atomic, write_png,
};
use std::path::PathBuf;

/// A new empty folder, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("restir-output-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir(&path).unwrap();
        Folder(path)
    }

    fn names(&self) -> Vec<String> {
        std::fs::read_dir(&self.0).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn picture(width: u32, height: u32) -> Image {
    let value = |i: u32| [i as f32 * 0.25, -1.5 + i as f32, 1e6 / (1 + i) as f32];
    Image::new(width, height, (0..width * height).map(value).collect()).unwrap()
}

fn described(image: &Image) -> ExrPicture<'_> {
    ExrPicture {
        image,
        albedo: None,
        normal: None,
        depth: None,
        motion: None,
        technique: "restir-di",
        parameters: r#"{"film":{"exposure":0.0}}"#,
        seed: 4_000_000_000,
        frames: 16,
    }
}

#[test]
fn exr_gives_back_every_bit() {
    let image = picture(37, 21);
    let bytes = encode_exr(&described(&image)).unwrap();
    assert_eq!(decode_exr("a.exr", &bytes).unwrap(), image);
    assert_eq!(encode_exr(&described(&image)).unwrap(), bytes, "the same picture gives the same bytes");
}

#[test]
fn exr_carries_its_channels_and_attributes() {
    use exr::prelude::*;
    let image = picture(5, 3);
    let albedo = vec![[0.1, 0.2, 0.3]; 15];
    let normal = vec![[0.0, 1.0, 0.0]; 15];
    let depth: Vec<f32> = (0..15).map(|i| i as f32).collect();
    let motion: Vec<[f32; 2]> = (0..15).map(|i| [i as f32, -(i as f32)]).collect();
    let described = ExrPicture {
        albedo: Some(&albedo),
        normal: Some(&normal),
        depth: Some(&depth),
        motion: Some(&motion),
        ..described(&image)
    };
    let bytes = encode_exr(&described).unwrap();

    let file = read_all_flat_layers_from_memory(&bytes);
    let layer = &file.layer_data[0];
    let names: Vec<String> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    let expected = [
        "B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "depth.Z", "motion.X", "motion.Y", "normal.X", "normal.Y",
        "normal.Z",
    ];
    assert_eq!(names, expected);
    let channel = |name: &str| -> Vec<f32> {
        let found = layer.channel_data.list.iter().find(|c| c.name.to_string() == name).unwrap();
        found.sample_data.values_as_f32().collect()
    };
    assert_eq!(channel("depth.Z"), depth);
    assert_eq!(channel("albedo.G"), vec![0.2; 15]);
    assert_eq!(channel("normal.Y"), vec![1.0; 15]);

    let attribute = |name: &str| match layer.attributes.other.get(&Text::from(name)) {
        Some(AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(attribute("restir.technique"), "restir-di");
    assert_eq!(attribute("restir.parameters"), r#"{"film":{"exposure":0.0}}"#);
    assert_eq!(attribute("restir.seed"), "4000000000");
    assert_eq!(attribute("restir.frames"), "16");
    assert_eq!(attribute("restir.version"), env!("CARGO_PKG_VERSION"));
    assert_eq!(file.attributes.chromaticities.unwrap().red, Vec2(0.64, 0.33));
    assert_eq!(decode_exr("a.exr", &bytes).unwrap(), image);
}

fn read_all_flat_layers_from_memory(bytes: &[u8]) -> exr::prelude::FlatImage {
    use exr::prelude::*;
    let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    reader.from_buffered(std::io::Cursor::new(bytes)).unwrap()
}

/// Writes channels as other programs might: any sample type, compression and block shape.
fn foreign(channels: Vec<(&str, exr::prelude::FlatSamples)>, encoding: exr::prelude::Encoding) -> Vec<u8> {
    use exr::prelude::*;
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    let layer = Layer::new((6, 4), LayerAttributes::default(), encoding, AnyChannels::sort(channels));
    let mut bytes = Vec::new();
    Image::from_layer(layer).write().to_buffered(std::io::Cursor::new(&mut bytes)).unwrap();
    bytes
}

#[test]
fn exr_of_other_programs_is_read() {
    use exr::prelude::*;
    let values: Vec<f32> = (0..24).map(|i| i as f32 * 0.5).collect();
    let half = || FlatSamples::F16(values.iter().map(|&v| f16::from_f32(v)).collect());
    let full = || FlatSamples::F32(values.clone());
    let zero = || FlatSamples::F32(vec![0.0; 24]);
    let encodings = [
        Encoding::UNCOMPRESSED,
        Encoding::FAST_LOSSLESS,
        Encoding::SMALL_LOSSLESS,
        Encoding { compression: Compression::PIZ, ..Encoding::UNCOMPRESSED },
        Encoding { blocks: Blocks::Tiles(Vec2(4, 3)), ..Encoding::SMALL_LOSSLESS },
        Encoding { line_order: LineOrder::Decreasing, ..Encoding::SMALL_LOSSLESS },
    ];
    for encoding in encodings {
        let mixed = foreign(vec![("R", half()), ("A", full()), ("G", full()), ("Z", zero()), ("B", zero())], encoding);
        let image = decode_exr("mixed.exr", &mixed).unwrap();
        assert_eq!((image.width, image.height), (6, 4));
        for (pixel, &value) in image.pixels.iter().zip(&values) {
            assert_eq!(*pixel, [value, value, 0.0]);
        }
        let grey = decode_exr("grey.exr", &foreign(vec![("Y", half())], encoding)).unwrap();
        assert_eq!(grey.pixels[23], [11.5; 3]);
    }
    let lossy = foreign(vec![("Y", half())], Encoding { compression: Compression::B44, ..Encoding::UNCOMPRESSED });
    assert!(matches!(decode_exr("b44.exr", &lossy), Err(restir::Error::Unsupported { .. })));
    let neither = foreign(vec![("R", full()), ("Z", full())], Encoding::UNCOMPRESSED);
    assert!(matches!(decode_exr("z.exr", &neither), Err(restir::Error::BadFile { .. })));
}

#[test]
fn exr_that_is_cut_off_is_refused() {
    let bytes = encode_exr(&described(&picture(37, 41))).unwrap();
    for length in (0..bytes.len()).step_by(7).chain([bytes.len() - 1]) {
        let error = decode_exr("cut.exr", &bytes[..length]).unwrap_err();
        assert!(error.to_string().starts_with("cut.exr: "), "{error}");
    }
}

/// Replaces the data window (and display window) of a file by one of this last column and row.
fn with_window(bytes: &[u8], last: [i32; 2]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
        bytes[at + 8..at + 12].copy_from_slice(&last[0].to_le_bytes());
        bytes[at + 12..at + 16].copy_from_slice(&last[1].to_le_bytes());
    }
    bytes
}

#[test]
fn exr_of_absurd_size_is_refused_before_allocation() {
    let bytes = encode_exr(&described(&picture(8, 8))).unwrap();
    let sides = [[16383, 16383], [i32::MAX, i32::MAX], [i32::MAX / 2 - 2, 0], [-1, -1], [i32::MIN, 7], [16384, 7]];
    for last in sides {
        let error = decode_exr("huge.exr", &with_window(&bytes, last)).unwrap_err();
        assert!(matches!(error, Error::BadFile { .. } | Error::Unsupported { .. }), "{last:?}: {error}");
    }
}

#[test]
fn exr_with_any_byte_changed_never_panics() {
    use exr::prelude::*;
    let tiled = |compression| Encoding { compression, blocks: Blocks::Tiles(Vec2(4, 4)), ..Encoding::UNCOMPRESSED };
    let noise = || FlatSamples::F16((0..24).map(|i| f16::from_f32((i * 7919 % 1000) as f32)).collect());
    let mut files = vec![encode_exr(&described(&picture(6, 5))).unwrap()];
    for compression in [Compression::RLE, Compression::PIZ, Compression::PXR24] {
        files.push(foreign(vec![("Y", noise())], tiled(compression)));
    }
    let mut accepted = 0;
    for file in files {
        for at in 0..file.len() {
            for value in [0, 1, 0x7f, 0x80, 0xff, file[at] ^ 0x10] {
                let mut bytes = file.clone();
                bytes[at] = value;
                accepted += usize::from(decode_exr("changed.exr", &bytes).is_ok());
            }
        }
    }
    assert!(accepted > 0, "changes to attributes alone are harmless");
}

#[test]
fn png_is_read_back_and_checked() {
    let rgba: Vec<u8> = (0..6 * 4 * 4).map(|i| i as u8).collect();
    let bytes = encode_png(6, 4, &rgba).unwrap();
    assert_eq!(image::load_from_memory(&bytes).unwrap().to_rgba8().into_raw(), rgba);
    assert!(matches!(encode_png(6, 5, &rgba), Err(Error::BadValue { .. })));
    assert!(matches!(encode_png(0, 0, &[]), Err(Error::BadValue { .. })));
    assert!(matches!(encode_png(1, 1, &[0; 5]), Err(Error::BadValue { .. })));
}

#[test]
fn files_are_replaced_whole_or_not_at_all() {
    let folder = Folder::new("atomic");
    let path = folder.0.join("a.png");
    write_png(&path, 1, 1, &[1, 2, 3, 255]).unwrap();
    let old = std::fs::read(&path).unwrap();

    assert!(write_png(&path, 2, 2, &[0; 4]).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), old, "a failed write leaves the old file");

    write_atomic(&path, b"new").unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"new");

    // A rename that fails, for a folder of that name that is not empty lies in the way.
    let blocked = folder.0.join("blocked");
    std::fs::create_dir_all(blocked.join("inside")).unwrap();
    assert!(matches!(write_atomic(&blocked, b"new"), Err(Error::Io { .. })));

    let mut names = folder.names();
    names.sort();
    assert_eq!(names, ["a.png", "blocked"], "no temporary file is left");
}

#[test]
fn unwritable_places_are_known_beforehand() {
    let folder = Folder::new("writable");
    let path = folder.0.join("a.png");
    check_writable(&path).unwrap();
    assert!(folder.names().is_empty(), "checking leaves nothing");
    let missing = check_writable(&folder.0.join("none").join("a.png")).unwrap_err();
    assert!(missing.to_string().contains("a.png"), "{missing}");
    assert!(matches!(check_writable(&folder.0), Err(Error::Io { .. })));
    assert!(matches!(read_exr(&path), Err(Error::Io { .. })));
}
