//! Mutated files of every kind, through every loader: none may panic, hang, say something in two lines, or make the
//! program allocate much more than it was allowed to.
//!
//! By default a bounded number of files; `RESTIR_FUZZ_SECONDS=600 cargo test --test fuzz` goes on for that long. A failure
//! names the kind of file and the seed.

mod support;

use restir::scene::flat::cooked;
use restir::scene::{FlatScene, Scene, environment, gltf, obj};
use restir::{Error, Result};
use restir_decoders::picture::Limits;
use restir_decoders::{draco, meshopt, picture};
use serde_json::json;
use std::alloc::{GlobalAlloc, Layout, System};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use support::extensions::*;
use support::gltf_writer::{Writer, image_file};

/// Counts what is allocated, so that a bomb is seen although it does not go off.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: everything is the system allocator's; only sizes are counted beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// xorshift64, seeded by a hash so that neighbouring seeds differ.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        let mixed = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Random((mixed ^ (mixed >> 29)) | 1)
    }

    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end.max(1) as u64) as usize
    }
}

/// A few changes of the kinds that break parsers: single bytes, bits, whole words of telling values, digits of JSON,
/// pieces cut out, repeated or moved, and an early end.
fn mutate(good: &[u8], random: &mut Random) -> Vec<u8> {
    let mut file = good.to_vec();
    let words =
        [0, 1, 2, 3, 255, 256, 0x7fff, 0xffff, 0x7fff_ffff, 0x8000_0000, 0xffff_fffe, 0xffff_ffff, good.len() as u32];
    for _ in 0..=random.below(4) {
        if file.is_empty() {
            break;
        }
        let at = random.below(file.len());
        let length = 1 + random.below(file.len() - at).min(random.below(64));
        match random.below(10) {
            0 | 1 => file[at] = random.below(256) as u8,
            2 => file[at] ^= 1 << random.below(8),
            3 => {
                let word = words[random.below(words.len())].to_le_bytes();
                for (byte, value) in file[at..].iter_mut().zip(word) {
                    *byte = value;
                }
            }
            4..=6 => {
                let digits: Vec<usize> = (0..file.len()).filter(|&i| file[i].is_ascii_digit()).collect();
                if let Some(&digit) = digits.get(random.below(digits.len())) {
                    let symbols: &[u8] = if random.below(4) == 0 { b"-.e" } else { b"0123456789" };
                    file[digit] = symbols[random.below(symbols.len())];
                }
            }
            7 => {
                file.drain(at..at + length);
            }
            8 => {
                let piece = file[at..at + length].to_vec();
                let to = random.below(file.len());
                file.splice(to..to, piece);
            }
            _ if random.below(4) == 0 => file.truncate(at),
            _ => file[at] = 255,
        }
    }
    file
}

/// One kind of file: good ones to start from, and what is done with a mutated one. It may allocate so many bytes.
struct Kind {
    name: &'static str,
    goods: Vec<Vec<u8>>,
    load: fn(&[u8]),
    most: usize,
}

/// What every loader allows itself, and twice as much for what it makes of it.
const LOADERS: usize = 6 << 30;
/// What the decoders are allowed in this test, and what they need besides: tables, windows, a second copy.
const ALLOWED: u64 = 1 << 20;
const DECODERS: usize = 64 << 20;

/// Every error is one line.
fn checked<T>(result: Result<T>) -> Option<T> {
    if let Err(error) = &result {
        assert!(!error.to_string().contains(['\n', '\r']), "{error}");
    }
    result.ok()
}

/// What loads must be sound, and go on to be flattened, written and read.
fn check_scene(scene: Option<Scene>) {
    let Some(scene) = scene else { return };
    let mut triangles = 0;
    for mesh in &scene.meshes {
        let vertices = mesh.positions.len();
        assert!(mesh.indices.iter().all(|&index| (index as usize) < vertices));
        assert!(mesh.positions.iter().all(|position| position.is_finite()));
        assert!(mesh.normals.len() == vertices && (mesh.material as usize) < scene.materials.len());
        assert!(mesh.uvs.iter().all(|uvs| uvs.is_empty() || uvs.len() == vertices));
        triangles += mesh.indices.len() / 3;
    }
    assert!(scene.instances.iter().all(|instance| (instance.mesh as usize) < scene.meshes.len()));
    if triangles * scene.instances.len().max(1) < 20_000
        && let Some(flat) = checked(FlatScene::build(&scene, &mut |_, _| ()))
    {
        assert!(FlatScene::from_bytes(&flat.to_bytes()).is_ok());
    }
}

fn load_gltf(file: &[u8]) {
    let mut nothing = |path: &str| Err(Error::Io { path: path.into(), source: std::io::Error::other("no such file") });
    let variant = gltf::contents("fuzz", file).ok().and_then(|contents| contents.variants.first().cloned());
    let options = gltf::Options { variant: variant.as_deref(), ..gltf::Options::default() };
    check_scene(checked(gltf::load_bytes_with("fuzz", file, &options, &mut nothing)));
}

const OBJ: &str = "mtllib a.mtl\no box\nv 0 0 0\nv 1 0 0 1\nv 1 1 0\nv -0.5 1e0 0\nvt 0 0\nvt 1 0\nvn 0 0 1\ng a\nusemtl red\n\
                   f 1/1/1 2/2/1 3/1/1 4/2/1\nusemtl glass\nf -4//1 -3//1 -2//1\nl 1 2\ns off\nf 1 2 3\n";
const MTL: &str = "newmtl red\nKd 1 0.5 0\nNs 100\nKe 0 2 0\nmap_Kd -s 2 2 -o 0.5 0 1 a.png\nbump -bm 0.5 a.png\n\
                   newmtl glass\nillum 7\nNi 1.5\nd 0.5\nPr 0.3\nPm 1\nTr 0.5\n";

fn load_obj(obj: &[u8], mtl: &[u8]) {
    let picture = image_file(2, 1, &[255, 0, 0, 255, 0, 255, 0, 128], image::ImageFormat::Png);
    let mut beside = |path: &str| match path {
        "a.mtl" => Ok(mtl.to_vec()),
        "a.png" => Ok(picture.clone()),
        _ => Err(Error::Io { path: path.into(), source: std::io::Error::other("no such file") }),
    };
    check_scene(checked(obj::load_bytes("fuzz.obj", obj, &mut beside)));
}

/// The meshopt case whose layout leads the bytes: its number, count and stride.
fn load_meshopt(file: &[u8]) {
    let [case, count, stride, rest @ ..] = file else { return };
    let modes = ["ATTRIBUTES", "TRIANGLES", "INDICES"];
    let filters = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"];
    let (mode, filter) = (modes[usize::from(*case) % 3], filters[usize::from(*case) / 3 % 5]);
    let count = usize::from(*count) * if case & 128 != 0 { 65_536 } else { 3 };
    if let Ok(layout) = meshopt::Layout::new(mode, filter, count, usize::from(*stride))
        && count * layout.stride <= 16 << 20
        && let Ok(decoded) = meshopt::decode(rest, &layout)
    {
        assert_eq!(decoded.len(), count * layout.stride);
    }
}

fn meshopt_goods() -> Vec<Vec<u8>> {
    let good = |case: &serde_json::Value| {
        let position = |names: &[&str], key: &str| names.iter().position(|name| case[key] == *name).unwrap() as u8;
        let mode = position(&["ATTRIBUTES", "TRIANGLES", "INDICES"], "mode");
        let filter = position(&["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"], "filter");
        let [count, stride] = ["count", "stride"].map(|key| case[key].as_u64().unwrap());
        [vec![mode + 3 * filter, (count / 3) as u8, stride as u8], unbase64(&case["encoded"])].concat()
    };
    cases("meshopt.json").iter().map(good).collect()
}

fn kinds() -> Vec<Kind> {
    let mut instanced = quad(json!({}));
    instanced.floats("VEC3", &[0.0, 0.0, 0.0, 3.0, 0.0, 1.0]);
    instanced.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 4, "SCALE": 4}}});
    let draco_files = cases("draco.json");
    let (meshopt_file, _) = meshopt_twins(
        "KHR_meshopt_compression",
        &cases("meshopt.json"),
        ["exponential v1", "octahedral 8 v1", "sheet TRIANGLES"],
    );
    let png = image_file(4, 4, &[200; 64], image::ImageFormat::Png);
    let jpeg = image_file(8, 8, &[200; 256], image::ImageFormat::Jpeg);
    let plain = |image: &[u8]| {
        let mut writer: Writer = quad(textured());
        let view = writer.view(image);
        writer.push("images", json!({"bufferView": view}));
        writer.push("textures", json!({"source": 0}));
        writer.glb()
    };
    let radiance = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".iter().copied().chain([128; 32]).collect();
    let pixels = restir::Image::new(8, 4, vec![[1.0, 0.5, 0.0]; 32]).unwrap();
    let picture = restir::output::ExrPicture {
        image: &pixels,
        albedo: None,
        normal: None,
        depth: None,
        motion: None,
        technique: "",
        parameters: "",
        seed: 0,
        frames: 1,
    };
    let exr = restir::output::encode_exr(&picture).unwrap();
    let cornell = support::builtin("cornell");
    vec![
        Kind { name: "glTF with pictures", goods: vec![plain(&png), plain(&jpeg)], load: load_gltf, most: LOADERS },
        Kind {
            name: "glTF with variants and instances",
            goods: vec![with_variants().glb(), instanced.glb()],
            load: load_gltf,
            most: LOADERS,
        },
        Kind {
            name: "glTF with Draco",
            goods: draco_files.iter().map(|case| draco_twins(case).0.glb()).collect(),
            load: load_gltf,
            most: LOADERS,
        },
        Kind {
            name: "glTF with meshopt",
            goods: vec![with_placeholder(meshopt_file, json!({"byteLength": 4000}))],
            load: load_gltf,
            most: LOADERS,
        },
        Kind {
            name: "glTF with KTX2 and WebP",
            goods: vec![
                pictured(Some("KHR_texture_basisu"), "etc1s-alpha.ktx2").glb(),
                pictured(Some("KHR_texture_basisu"), "uastc-zstd.ktx2").glb(),
                pictured(Some("EXT_texture_webp"), "lossy.webp").glb(),
            ],
            load: load_gltf,
            most: LOADERS,
        },
        Kind {
            name: "Draco",
            goods: draco_files.iter().map(|case| unbase64(&case["encoded"])).collect(),
            load: |file| {
                if let Ok(mesh) = draco::decode(file, ALLOWED) {
                    assert!(mesh.indices.iter().all(|&index| index < mesh.vertices));
                }
            },
            most: DECODERS,
        },
        Kind { name: "meshopt", goods: meshopt_goods(), load: load_meshopt, most: DECODERS },
        Kind {
            name: "KTX2",
            goods: ["etc1s", "etc1s-alpha", "uastc", "uastc-zstd"].map(|name| data(&format!("{name}.ktx2"))).to_vec(),
            load: load_picture,
            most: DECODERS,
        },
        Kind {
            name: "WebP",
            goods: ["lossless", "lossy"].map(|name| data(&format!("{name}.webp"))).to_vec(),
            load: load_picture,
            most: DECODERS,
        },
        Kind { name: "OBJ", goods: vec![OBJ.into()], load: |file| load_obj(file, MTL.as_bytes()), most: DECODERS },
        Kind { name: "MTL", goods: vec![MTL.into()], load: |file| load_obj(OBJ.as_bytes(), file), most: DECODERS },
        Kind {
            name: "environment",
            goods: vec![radiance, exr],
            load: |file| {
                let environment = checked(environment::decode("fuzz", file));
                assert!(environment.is_none_or(|e| e.pixels.iter().flatten().all(|value| value.is_finite())));
            },
            most: LOADERS,
        },
        Kind {
            name: "cooked scene",
            goods: vec![cooked::to_file(&cornell)],
            load: |file| drop(checked(cooked::from_file("fuzz", file))),
            most: DECODERS,
        },
        Kind {
            name: "flattened scene",
            goods: vec![cornell.to_bytes()],
            load: |file| drop(checked(FlatScene::from_bytes(file))),
            most: DECODERS,
        },
    ]
}

fn load_picture(file: &[u8]) {
    if let Ok(picture) = picture::decode(file, Limits { side: 16_384, bytes: ALLOWED }) {
        assert_eq!(picture.pixels.len() as u64, u64::from(picture.width) * u64::from(picture.height) * 4);
    }
}

#[test]
fn mutated_files_do_no_harm() {
    let seconds = std::env::var("RESTIR_FUZZ_SECONDS").ok().and_then(|text| text.parse::<u64>().ok());
    let kinds = kinds();
    for kind in &kinds {
        kind.goods.iter().for_each(|good| (kind.load)(good));
    }
    let start = Instant::now();
    let more = |round: u64| match seconds {
        Some(seconds) => start.elapsed() < Duration::from_secs(seconds),
        None => round < 150,
    };
    let (mut round, mut files, mut slowest) = (0u64, 0u64, (Duration::ZERO, ""));
    while more(round) {
        for kind in &kinds {
            for (which, good) in kind.goods.iter().enumerate() {
                let seed = round * 1000 + which as u64;
                let file = mutate(good, &mut Random::new(seed));
                let (began, before) = (Instant::now(), NOW.load(Ordering::Relaxed));
                PEAK.store(before, Ordering::Relaxed);
                let outcome = catch_unwind(AssertUnwindSafe(|| (kind.load)(&file)));
                let grown = PEAK.load(Ordering::Relaxed).saturating_sub(before);
                let place = format!("{} {which}, seed {seed}", kind.name);
                assert!(outcome.is_ok(), "{place}: it panics");
                assert!(grown <= kind.most, "{place}: {grown} bytes allocated, {} allowed", kind.most);
                assert!(began.elapsed() < Duration::from_secs(10), "{place}: {:?}", began.elapsed());
                slowest = slowest.max((began.elapsed(), kind.name));
                files += 1;
            }
        }
        round += 1;
    }
    if seconds.is_some() {
        support::say(&format!("{files} mutated files in {:?}, the slowest {slowest:?}", start.elapsed()));
    }
}
