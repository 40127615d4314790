//! Bad input gets one clear sentence and exit 1 (2 for bad usage), never a panic, and nothing half-written stays behind.

mod common;

use common::Files;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use q3rays::assets::bsp::Bsp;
use q3rays::assets::bsp::build::fixtures::{Doorways, Fixture, chain};
use q3rays::scene::Scene;
use std::path::Path;
use std::process::{Command, Output};

fn fixture() -> Fixture {
    chain(3, Doorways::Staggered, 1000).unwrap()
}

/// A base path that holds a fixture's files, loose.
fn base_path(bsp: &[u8]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut files = fixture().files();
    files[0].1 = bsp.to_vec();
    for (path, bytes) in files {
        let path = folder.path().join("baseq3").join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    folder
}

fn run(base: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_q3rays"))
        .args(arguments)
        .current_dir(base)
        .output()
        .unwrap()
}

/// Runs the program, which must fail with a code and one sentence that has all of `words` in it.
fn fails(base: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let output = run(base, arguments);
    let (said, printed) = (
        String::from_utf8_lossy(&output.stderr),
        String::from_utf8_lossy(&output.stdout),
    );
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    assert!(
        !said.contains("panicked") && !printed.contains("panicked"),
        "{arguments:?}: {said}"
    );
    let sentences: Vec<&str> = said.lines().filter(|l| l.starts_with("q3rays: ")).collect();
    assert_eq!(sentences.len(), 1, "{arguments:?}: {said}");
    for word in words {
        assert!(sentences[0].contains(word), "{arguments:?}: no {word:?} in: {said}");
    }
}

/// Fails to render the fixture map, whose file is given.
fn map_fails(bsp: &[u8], words: &[&str]) {
    let base = base_path(bsp);
    let arguments = [
        "render",
        "chain",
        "--basepath",
        ".",
        "--backend",
        "cpu",
        "--out",
        "a.png",
    ];
    fails(base.path(), &arguments, 1, words);
    assert_eq!(names(base.path()), ["baseq3"], "a failed render leaves nothing behind");
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Small renders of the whole fixture map, with more arguments.
fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let mut arguments = vec![
        "render",
        "chain",
        "--basepath",
        ".",
        "--backend",
        "cpu",
        "--size",
        "8x8",
        "--spp",
        "1",
    ];
    arguments.extend(more);
    arguments
}

#[test]
fn a_truncated_map_is_refused_at_every_length() {
    let whole = fixture().bsp.write();
    let unpadded = (0..17).map(|lump| {
        let int = |at: usize| u32::from_le_bytes(whole[at..at + 4].try_into().unwrap()) as usize;
        int(8 + lump * 8) + int(12 + lump * 8)
    });
    let end = unpadded.max().unwrap();
    for length in (0..400).chain((400..end).step_by(97)) {
        assert!(Bsp::read(&whole[..length]).is_err(), "{length} of {end} bytes");
    }
    assert!(Bsp::read(&whole[..end]).is_ok());
    map_fails(&whole[..0], &["chain", "IBSP"]);
    for length in [100, 150, end / 2, end - 1] {
        map_fails(&whole[..length], &["chain", "truncated"]);
    }
}

#[test]
fn other_versions_and_formats_are_refused_by_name() {
    let mut file = fixture().bsp.write();
    file[4] = 47;
    map_fails(&file, &["chain", "47", "46"]);
    file[..4].copy_from_slice(b"RBSP");
    map_fails(&file, &["chain", "IBSP"]);
}

/// Loads a damaged map as the program does: it may be refused or accepted, and must end.
fn load_whatever(bytes: &[u8]) {
    if let Ok(bsp) = Bsp::read(bytes) {
        let mut files = fixture().files();
        files.remove(0);
        let scene = Scene::from_bsp(&Files(files), "chain", bsp).unwrap();
        // The tracer's trees and receivers' classification see the damage too.
        let cpu = q3rays::reference::CpuRenderer::new(&scene);
        let view = common::camera([40.3, 60.6, 60.2], 5.0, 2.0, 90.0);
        let settings = common::still(1, q3rays::scene::sampling::Sequence::Sobol, 0);
        cpu.accumulate(&view, (4, 4), &settings, 0..1, &common::quiet);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_never_crash(flips in proptest::collection::vec((any::<prop::sample::Index>(), 1u8..), 1..8)) {
        let mut bytes = fixture().bsp.write();
        for (at, flip) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= flip;
        }
        load_whatever(&bytes);
    }

    /// Most of a file is names, which nothing can damage: whole words of the directory and the records.
    #[test]
    fn wild_numbers_never_crash(
        writes in proptest::collection::vec(
            (any::<prop::sample::Index>(), prop_oneof![
                any::<u32>(),
                Just(u32::MAX),
                Just(i32::MIN as u32),
                Just(i32::MAX as u32),
                Just(f32::NAN.to_bits()),
                Just(f32::INFINITY.to_bits()),
                Just(3e38f32.to_bits()),
                0u32..2000,
            ]),
            1..4,
        ),
    ) {
        let mut bytes = fixture().bsp.write();
        for (at, value) in writes {
            let at = at.index(bytes.len() / 4) * 4;
            bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        }
        load_whatever(&bytes);
    }
}

#[test]
fn what_is_not_there_is_named() {
    let base = base_path(&fixture().bsp.write());
    let at = base.path();
    fails(
        at,
        &["render", "no_such_map", "--basepath", ".", "--out", "a.png"],
        1,
        &["no_such_map", "q3rays maps"],
    );
    fails(at, &["info", "no_such_map", "--basepath", "."], 1, &["no_such_map"]);
    fails(
        at,
        &["render", "chain", "--basepath", "nowhere", "--out", "a.png"],
        1,
        &["nowhere"],
    );
    fails(at, &small(&["--spawn", "3", "--out", "a.png"]), 1, &["3 spawn points"]);
    fails(at, &["compare", "no.exr", "no.exr"], 1, &["no.exr"]);
    assert_eq!(names(at), ["baseq3"]);
}

#[test]
fn bad_usage_is_told_apart() {
    let base = base_path(&fixture().bsp.write());
    let at = base.path();
    fails(
        at,
        &small(&["--camera", "1,2,three,4,5", "--out", "a.png"]),
        2,
        &["--camera", "1,2,three,4,5"],
    );
    fails(
        at,
        &small(&["--camera", "1,2,nan,4,5", "--out", "a.png"]),
        2,
        &["--camera"],
    );
    fails(
        at,
        &small(&["+set", "rt_culllight", "1", "--out", "a.png"]),
        2,
        &["rt_culllight", "rt_cullLights"],
    );
    fails(at, &small(&["--out", "a.jpg"]), 2, &["a.jpg", ".png", ".exr"]);
    fails(at, &small(&["+nonsense", "--out", "a.png"]), 2, &["+nonsense"]);
    assert_eq!(names(at), ["baseq3"]);
}

#[test]
fn a_broken_archive_is_told_and_does_not_hide_the_rest() {
    let base = base_path(&fixture().bsp.write());
    let pak = base.path().join("baseq3/broken.pk3");
    std::fs::write(&pak, b"PK\x03\x04 and then nothing of use").unwrap();
    let output = run(base.path(), &small(&["--out", "a.png"]));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("broken.pk3"), "{said}");
    // Where the archive was all there is, the map is missing, and the reason stands beside it.
    std::fs::remove_dir_all(base.path().join("baseq3/maps")).unwrap();
    fails(base.path(), &small(&["--out", "b.png"]), 1, &["chain"]);
    // An archive that opens, but whose map does not inflate.
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    zip.start_file("maps/chain.bsp", options).unwrap();
    std::io::Write::write_all(&mut zip, &fixture().bsp.write()).unwrap();
    let mut bytes = zip.finish().unwrap().into_inner();
    bytes[200..2000].fill(0xff);
    std::fs::write(&pak, bytes).unwrap();
    fails(base.path(), &small(&["--out", "c.png"]), 1, &["broken.pk3"]);
    assert_eq!(names(base.path()), ["a.png", "baseq3"]);
}

#[test]
fn an_output_that_cannot_be_written_leaves_nothing_behind() {
    let base = base_path(&fixture().bsp.write());
    let at = base.path();
    std::fs::write(at.join("file"), b"not a folder").unwrap();
    // Root may write anywhere, so permissions prove nothing: places that cannot exist do.
    fails(at, &small(&["--out", "file/a.png"]), 1, &["file"]);
    std::fs::create_dir(at.join("taken.png")).unwrap();
    fails(at, &small(&["--out", "taken.png"]), 1, &["taken.png"]);
    std::fs::create_dir(at.join("taken.exr")).unwrap();
    fails(at, &small(&["--out", "taken.exr"]), 1, &["taken.exr"]);
    fails(at, &small(&["--out", "a.png", "--aov", "file/aov"]), 1, &["file"]);
    let left = names(at);
    assert!(!left.iter().any(|n| n.contains(".part")), "{left:?}");
    assert_eq!(std::fs::read(at.join("file")).unwrap(), b"not a folder");
    assert_eq!(names(&at.join("taken.png")), [""; 0]);
}

#[test]
fn images_that_do_not_fit_are_refused() {
    let base = base_path(&fixture().bsp.write());
    let at = base.path();
    for (name, size) in [("a.exr", "8x8"), ("b.exr", "9x8"), ("a.png", "8x8"), ("b.png", "9x8")] {
        let mut arguments = small(&["--out", name]);
        arguments[7] = size;
        let output = run(at, &arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    fails(at, &["compare", "a.exr", "b.exr"], 1, &["8x8", "9x8"]);
    fails(at, &["compare", "a.png", "b.png"], 1, &["8x8", "9x8"]);
    fails(at, &["compare", "a.png", "a.exr"], 1, &["PNG", "EXR"]);
    fails(at, &["merge", "out.exr", "a.exr", "b.exr"], 1, &["b.exr", "8x8", "9x8"]);
    fails(at, &["merge", "out.exr", "a.png"], 1, &["a.png"]);
    fails(at, &["merge", "out.png", "a.exr"], 2, &["out.png", ".exr"]);
    let whole = std::fs::read(at.join("a.exr")).unwrap();
    for length in [0, 3, 8, 60, whole.len() / 2, whole.len() - 1] {
        std::fs::write(at.join("cut.exr"), &whole[..length]).unwrap();
        fails(at, &["merge", "out.exr", "a.exr", "cut.exr"], 1, &["cut.exr"]);
        fails(at, &["compare", "cut.exr", "a.exr"], 1, &["cut.exr"]);
    }
    assert!(!at.join("out.exr").exists() && !at.join("out.png").exists());
}
